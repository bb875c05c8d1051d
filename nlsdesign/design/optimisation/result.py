"""What a design gives back: numbers for the assembly, the changed assembly, and how good it is."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from ...components.assembly.named_parts import Assembly
from ...quantity import Quantity, parse_unit, with_unit
from ..curves.target import Target
from ..drawing.cam_drawing import fingerprint
from ..statics.contour import Contour

Floats = NDArray[np.float64]


@dataclass(frozen=True)
class LimitState:
    """One side of a limit at the solution.

    Parameters
    ----------
    limit, of
        Name of the limit and what it bounds.
    value
        The value that comes closest to the bound, in SI.
    bound
        The bound in SI.
    upper
        Which side.
    unit
        Unit in which it is shown.
    active
        Whether the design sits on the bound.
    """

    limit: str
    of: str
    value: float
    bound: float
    upper: bool
    unit: str
    active: bool

    def __str__(self) -> str:
        factor = parse_unit(self.unit).factor
        sign = "<=" if self.upper else ">="
        mark = "  ACTIVE" if self.active else ""
        value, bound = (with_unit(f"{number / factor:.4g}", self.unit) for number in (self.value, self.bound))
        return f"{self.limit}: {self.of} {value} {sign} {bound}{mark}"


@dataclass(frozen=True, eq=False)
class TorqueCheck:
    """Torque of the changed assembly against the target, from a model flattened anew.

    Parameters
    ----------
    angles, torques, targets
        Shape (n,), in rad and N·m.
    """

    angles: Floats
    torques: Floats
    targets: Floats

    @property
    def errors(self) -> Floats:
        """Torque minus target."""
        return self.torques - self.targets

    @property
    def rms(self) -> float:
        """Root of the mean over the angle of the squared error."""
        return float(np.sqrt(np.trapezoid(self.errors**2, self.angles) / (self.angles[-1] - self.angles[0])))

    @property
    def largest(self) -> float:
        """Largest magnitude of the error."""
        return float(np.max(np.abs(self.errors)))


@dataclass(frozen=True)
class Sensitivity:
    """Torque error when the moduli of the rubber lie at the edges of their stated spread.

    Parameters
    ----------
    rms
        Largest rms error over all corners, in N·m.
    corner
        Relative deviation of each modulus there, by name.
    """

    rms: float
    corner: tuple[tuple[str, float], ...]

    def __str__(self) -> str:
        if not self.corner:
            return "no modulus has a stated spread"
        signs = {deviation > 0.0 for _, deviation in self.corner}
        where = (
            "all moduli high" if signs == {True} else "all moduli low" if signs == {False} else "moduli mixed"
        )
        largest = max(abs(deviation) for _, deviation in self.corner)
        return f"{1e3 * self.rms:.4g} mN·m rms at worst ({where}, spread up to {100 * largest:.3g} %)"


@dataclass(frozen=True, eq=False)
class CamDesign:
    """A finished design; immutable.

    Parameters
    ----------
    target
        Torque curve that was asked for.
    changes
        Pairs of full name and number.
    actuator
        Changed copy of the assembly.
    check
        Torque of that copy against the target.
    predicted_rms
        Rms error that the optimiser saw at its own nodes, in N·m.
    contour
        Contour of the cam at the cable's centre line.
    fit_error
        Largest deviation of the declared lever arm from that of the contour, in m.
    limits
        State of every limit.
    sensitivity
        Torque error over the spread of the moduli.
    iterations
        Of the solution taken.
    """

    target: Target
    changes: tuple[tuple[str, Quantity], ...]
    actuator: Assembly
    check: TorqueCheck
    predicted_rms: float
    contour: Contour
    fit_error: float
    limits: tuple[LimitState, ...]
    sensitivity: Sensitivity
    iterations: int

    @property
    def values(self) -> dict[str, Quantity]:
        """Numbers by full name, for ``actuator.with_values``."""
        return dict(self.changes)

    @property
    def rms(self) -> float:
        """Rms torque error over the angle in N·m, of the changed assembly."""
        return self.check.rms

    @property
    def active_limits(self) -> tuple[str, ...]:
        """Names of the limits that the design sits on."""
        return tuple(dict.fromkeys(state.limit for state in self.limits if state.active))

    @property
    def within_tolerance(self) -> float | None:
        """Share of the angles at which the torque lies in the target's band; None without a band."""
        lower, upper = self.target.band(self.check.angles)
        if np.all(upper == lower):
            return None
        return float(np.mean((self.check.torques >= lower) & (self.check.torques <= upper)))

    @property
    def fingerprint(self) -> str:
        """Twelve hexadecimal digits that stand for the numbers."""
        return fingerprint(self.values)

    def rows(self) -> list[tuple[str, str]]:
        """Return a table of what was found: pairs of text."""
        rho, millis = self.contour.radii_of_curvature, 1e3
        rows = [("target", f"{type(self.target).__name__}, {self.target.largest:.4g} N·m at {self._end}")]
        rows += [(name, _brief(value)) for name, value in self.changes]
        rows += [
            (
                "torque error",
                f"{millis * self.rms:.3g} mN·m rms, {millis * self.check.largest:.3g} mN·m at most",
            ),
            ("over the spread", str(self.sensitivity)),
            ("radius of curvature", f"{millis * rho.min():.3g} to {millis * rho.max():.3g} mm"),
            ("cam radius", f"{millis * self.contour.radii.max():.4g} mm"),
            ("lever arm", f"up to {millis * self.contour.lever_arms.max():.4g} mm"),
            ("solver", f"{self.iterations} iterations{self._contour_error}"),
            ("fingerprint", self.fingerprint),
        ]
        share = self.within_tolerance
        return rows if share is None else [*rows, ("within tolerance", f"{100 * share:.3g} % of the angles")]

    @property
    def _contour_error(self) -> str:
        return f", contour held to {1e6 * self.fit_error:.2g} µm" if self.fit_error > 0.0 else ""

    @property
    def _end(self) -> str:
        return f"{np.degrees(self.target.last_angle):.4g} deg"

    def __str__(self) -> str:
        rows = self.rows()
        width = max(len(name) for name, _ in rows)
        lines = ["cam design", *(f"  {name:<{width}}  {text}" for name, text in rows)]
        return "\n".join([*lines, "  limits", *(f"    {state}" for state in self.limits)])


def _brief(value: Quantity) -> str:
    return str(value) if len(value.values) <= 4 else f"<{len(value.values)} control values>"
