"""What a design with a coil must keep: its travel, a spring index that can be wound, a wire that endures."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass
from typing import ClassVar

import casadi as ca

from ...foundation.errors import ArrangementError
from ...foundation.quantity import Quantity
from ..curves.numbers import plain
from .design_point import DesignPoint
from .limits import Bound, Limit, OneNumber

_MOST = 1000.0
"""Safety beyond which it is not told apart."""


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
class SpringIndexLimit(Limit):
    """Base of the limits on mean diameter over wire diameter.

    Parameters
    ----------
    index
        Spring index, a pure number.
    """

    index: Quantity | float

    def __post_init__(self) -> None:
        self.number("index", "1", 2.0, 50.0)

    def _indices(self, design: DesignPoint, *, upper: bool) -> Iterator[Bound]:
        wound = [coil for coil in design.cam.coils if coil.winding]
        _require(design, bool(wound), "coil of declared wire", "declare its Winding, or leave this limit out")
        for coil in wound:
            wire, mean = (design.parameters[name] for name in coil.winding[:2])
            of = f"spring index of {coil.name}"
            yield self.bound(of, mean / wire, plain(self.index), upper=upper, unit="1")


@dataclass(frozen=True)
class MinimumSpringIndex(SpringIndexLimit):
    """Mean diameter over wire diameter ≥ index: below 4 wire is hard to coil, and cracks.

    Parameters
    ----------
    index
        Least spring index, a pure number.
    """

    described: ClassVar[OneNumber | None] = OneNumber(
        "index", "spring index of the coil", unit="1", shown_unit="1", upper=False
    )

    index: Quantity | float

    def bounds(self, design: DesignPoint) -> Iterator[Bound]:
        """Yield one bound for each coil whose wire is declared."""
        yield from self._indices(design, upper=False)


@dataclass(frozen=True)
class MaximumSpringIndex(SpringIndexLimit):
    """Mean diameter over wire diameter ≤ index: above 16 coils tangle, and do not keep their diameter.

    Parameters
    ----------
    index
        Largest spring index, a pure number.
    """

    described: ClassVar[OneNumber | None] = OneNumber(
        "index", "spring index of the coil", unit="1", shown_unit="1", upper=True
    )

    index: Quantity | float

    def bounds(self, design: DesignPoint) -> Iterator[Bound]:
        """Yield one bound for each coil whose wire is declared."""
        yield from self._indices(design, upper=True)


@dataclass(frozen=True)
class GoodmanSafety(Limit):
    """Safety of the wire of each coil by Goodman ≥ safety, from angle zero to the last and back for good.

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
        strong = [coil.name for coil in design.cam.coils if coil.tensile_strength]
        step = "declare its Winding and WireStrength, or leave this limit out"
        _require(design, bool(strong), "coil of a wire with a strength", step)
        for path in strong:
            coil = design.coils[path]
            # Lever arms are not negative, so the extension rises from angle zero on.
            low, high = coil.shear_stress[0], coil.shear_stress[-1]
            shear_strength = 0.67 * coil.tensile_strength[0]
            # Of soft wire the strength alone decides: Zimmerli's point lies beyond it.
            slope = ca.fmax(1 - plain(self.mean) / shear_strength, plain(self.amplitude) / shear_strength)
            endured = plain(self.amplitude) / slope
            used = (high - low) / 2 / endured + (high + low) / 2 / shear_strength
            # A coil that is hardly loaded has no finite safety.
            safety = 1 / ca.fmax(used, 1 / _MOST)
            yield self.bound(f"safety of {path}", safety, plain(self.safety), upper=False, unit="1")
