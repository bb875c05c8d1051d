"""What a design with a coil must keep: its travel, a spring index that can be wound, a wire that endures."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass
from typing import ClassVar

from ...foundation.errors import ArrangementError
from ...foundation.quantity import Quantity
from ..curves.numbers import plain
from .design_point import DesignPoint
from .limits import Bound, Limit, OneNumber, ParameterRange


def _require(design: DesignPoint, known: bool, what: str, step: str) -> None:
    if not known:
        raise ArrangementError(f"part '{design.cam.drive}'", f"has no {what} behind its cam", next_step=step)


@dataclass(frozen=True)
class MaximumTravel(Limit):
    """Extension of each coil that is pulled, or shortening of one that is pushed, ≤ travel.

    Parameters
    ----------
    travel
        Largest extension or shortening, in m.
    """

    described: ClassVar[OneNumber | None] = OneNumber(
        "travel", "travel of the coil", unit="m", shown_unit="mm", upper=True
    )

    travel: Quantity | float

    def __post_init__(self) -> None:
        self.number("travel", "m", 1e-5, 2.0)

    def bounds(self, design: DesignPoint) -> Iterator[Bound]:
        """Yield one bound for each coil."""
        _require(design, bool(design.coils), "coil", "leave this limit out, or declare an ExtensionCoil")
        for path, coil in design.coils.items():
            yield self.bound(f"travel of {path}", coil.extension, plain(self.travel), upper=True, unit="mm")


@dataclass(frozen=True)
class SpringIndexRange(ParameterRange):
    """Mean diameter over wire diameter of each wound coil between two numbers.

    Parameters
    ----------
    minimum, maximum
        Least and largest spring index, pure numbers.
    """

    possible: ClassVar[tuple[str, float, float]] = ("1", 2.0, 50.0)

    minimum: Quantity | float
    maximum: Quantity | float

    def bounds(self, design: DesignPoint) -> Iterator[Bound]:
        """Yield both sides for each coil whose wire is declared."""
        for coil in design.cam.coils:
            if coil.winding:
                wire, mean = (design.parameters[name] for name in coil.winding[:2])
                yield from self._both(f"spring index of {coil.name}", mean / wire, "1")


@dataclass(frozen=True)
class GoodmanSafety(Limit):
    """Safety of the wire of each coil against fatigue by Goodman ≥ safety, from angle zero to the last and back.

    τ_a/S_e + τ_m/S_su ≤ 1/safety with the amplitude τ_a and the mean τ_m of the shear stress at the inside of
    the coil, S_su = 0.67·S_ut and S_e = S_a/(1 − S_m/S_su). The amplitude S_a that any spring wire up to
    10 mm bears for good around the mean S_m is Zimmerli's, for wire that is not peened; peened wire bears
    398 MPa around 534 MPa. Hooks are not looked at. Source: Zimmerli 1957, as in Budynas and Nisbett 2015,
    eqs. (10-28) to (10-30).

    Parameters
    ----------
    safety
        Least factor, a pure number of at least 1.
    amplitude, mean
        S_a and S_m in Pa.
    """

    described: ClassVar[OneNumber | None] = OneNumber(
        "safety", "safety of the wire against fatigue", unit="1", shown_unit="1", upper=False
    )

    safety: Quantity | float
    amplitude: Quantity | float = 241e6
    mean: Quantity | float = 379e6

    def __post_init__(self) -> None:
        self.number("safety", "1", 1.0, 20.0)
        self.number("amplitude", "Pa", 1e6, 2e9)
        self.number("mean", "Pa", 1e6, 2e9)

    def bounds(self, design: DesignPoint) -> Iterator[Bound]:
        """Yield one bound for each coil whose wire is declared with its strength."""
        strong = {coil.name for coil in design.cam.coils if coil.tensile_strength}
        step = "declare its Winding and WireStrength, or leave this limit out"
        _require(design, bool(strong), "coil of a wire with a strength", step)
        for path in strong:
            coil = design.coils[path]
            # Lever arms are not negative, so the extension rises from angle zero on.
            low, high = coil.shear_stress[0], coil.shear_stress[-1]
            shear_strength = 0.67 * coil.tensile_strength[0]
            endured = plain(self.amplitude) / (1 - plain(self.mean) / shear_strength)
            used = (high - low) / 2 / endured + (high + low) / 2 / shear_strength
            # Over the safety itself, a load of nothing would have no end.
            yield self.bound(
                f"share of the endurance of {path}", used, 1.0 / plain(self.safety), upper=True, unit="1"
            )
