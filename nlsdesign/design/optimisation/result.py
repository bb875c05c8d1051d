"""What a design gives back: numbers for the assembly, the changed assembly, and how good it is."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, fields, replace
from typing import Any

import numpy as np

from ...components.assembly.named_parts import Assembly
from ...foundation.arrays import Array
from ...foundation.csv_tables import Axis, data_frame
from ...foundation.quantity import MM, Quantity, parse_unit
from ...foundation.written_numbers import prefixed, without_power
from ...model.structure import CamNames
from ..curves.numbers import in_unit
from ..curves.target import Target
from ..drawing.cam_drawing import fingerprint
from ..statics.contour import Contour
from ..tolerance.tolerance_result import ToleranceResult
from .design_search import spans_of
from .limits import limits_in_words
from .remedies import Remedies
from .size_ranges import SizeRange


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
    where
        In which ranges of the angle it does, in words; empty for a limit on a single number.
    """

    limit: str
    of: str
    value: float
    bound: float
    upper: bool
    unit: str
    active: bool
    where: str = ""

    def __str__(self) -> str:
        sign = "<=" if self.upper else ">="
        mark = f"  ACTIVE {self.where}".rstrip() if self.active else ""
        value, bound = in_unit(self.value, self.unit), in_unit(self.bound, self.unit)
        return f"{self.of} {value} {sign} {bound} ({self.limit}){mark}"


@dataclass(frozen=True, eq=False)
class TorqueCheck:
    """Torque of the changed assembly against the target, from a model flattened anew."""

    # angles, torques, targets: shape (n,), in rad and N·m
    angles: Array
    torques: Array
    targets: Array
    weights: Array | None = None  # of the squared error, shape (n,); all alike for None

    @property
    def errors(self) -> Array:
        """Torque minus target."""
        return self.torques - self.targets

    @property
    def rms(self) -> float:
        """Root of the mean over the angle of the squared error, weighted as the target says."""
        weights = np.ones_like(self.angles) if self.weights is None else self.weights
        squares = np.trapezoid(weights * self.errors**2, self.angles)
        return float(np.sqrt(squares / np.trapezoid(weights, self.angles)))

    @property
    def largest(self) -> float:
        """Largest magnitude of the error."""
        return float(np.max(np.abs(self.errors)))


@dataclass(frozen=True, eq=False)
class DesignCurves:
    """What cam and rubber do over the angle, as the optimiser sees it; columns of shape (n,), in SI."""

    # angles, lever_arms, radii_of_curvature, radii, torques, stiffnesses: of the cam; the stiffness is the
    # slope of the torque
    angles: Array
    lever_arms: Array
    radii_of_curvature: Array
    radii: Array
    torques: Array
    stiffnesses: Array
    # extensions, forces: of one element with its cable
    extensions: Array
    forces: Array
    # strains, stresses: of each piece of rubber by path
    strains: Mapping[str, Array]
    stresses: Mapping[str, Array]

    @property
    def energy(self) -> float:
        """Energy in J that the spring takes up from angle zero to the last angle."""
        return float(np.trapezoid(self.torques, self.angles))


@dataclass(frozen=True)
class StartOutcome:
    """Where the search from one start came to."""

    # solved, status: whether the solver says that it is a solution, and its words
    solved: bool
    status: str
    iterations: int  # of the solver
    # cost, rms: sum of the goals, and torque error in N·m
    cost: float
    rms: float
    same: bool = False  # whether it is the design that was taken, by cost and shape


@dataclass(frozen=True)
class Alternative:
    """What became of one combination of a stock."""

    choice: str  # in words
    # cost, rms: sum of the goals and torque error in N·m; None where there is no design
    cost: float | None
    rms: float | None
    met: bool  # whether it meets the target
    reason: str  # why not
    rubber_volume: float | None = None  # volume of rubber or wire in m³; None where there is no design


@dataclass(frozen=True)
class Miss:
    """Why a design is not a success."""

    error: float  # rms torque error relative to the largest torque
    allowed: float  # what it may be
    # worst_angle, worst_error: where the torque is furthest from the target, in rad, and by how much there,
    # in N·m
    worst_angle: float
    worst_error: float
    binding: tuple[str, ...]  # limits that the design sits on: what each bounds, and its name
    remedies: Remedies | None  # what would help; None where it was not looked for
    advice: tuple[str, ...]  # the same as sentences

    @property
    def words(self) -> str:
        """How far it is off, where most, and what holds it."""
        held = f"held by {', '.join(self.binding)}" if self.binding else "no limit binds"
        return (
            f"{100 * self.error:.3g} % rms of the largest torque, "
            f"{100 * self.allowed:g} % allowed; worst at {np.degrees(self.worst_angle):.3g}°: "
            f"{_read(self.worst_error)}; {held}"
        )

    def __str__(self) -> str:
        return f"MISSES ITS TARGET: {self.words}"


@dataclass(frozen=True, eq=False)
class CamDesign:
    """A finished design; immutable. Whether it meets its target says ``met``.

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
    tolerance
        What the spreads of all numbers do to the torque error; ``None`` where it was not asked for, or where
        the remarks say why there is none.
    curves
        What cam and rubber do over the angle.
    rubber_volume
        Of all elements in m³.
    starts
        Where the search from each start came to; ``taken`` is the number of the one that was taken.
    taken
        Number of the start.
    cam
        Names around the cam: of its part, cable and rubber.
    size_ranges
        Ranges of sizes that cost nothing.
    miss
        Why the design is no success; ``None`` if it is one.
    remarks
        What a designer should know besides.
    alternatives
        All combinations of the stock that was offered.
    """

    target: Target
    changes: tuple[tuple[str, Quantity], ...]
    actuator: Assembly
    check: TorqueCheck
    predicted_rms: float
    contour: Contour
    fit_error: float
    limits: tuple[LimitState, ...]
    tolerance: ToleranceResult | None
    curves: DesignCurves
    rubber_volume: float
    starts: tuple[StartOutcome, ...]
    taken: int
    cam: CamNames
    size_ranges: tuple[SizeRange, ...] = ()
    miss: Miss | None = None
    remarks: tuple[str, ...] = ()
    alternatives: tuple[Alternative, ...] = ()

    @property
    def drive(self) -> str:
        """Path of the part that holds the cam."""
        return self.cam.drive

    @property
    def met(self) -> bool:
        """Whether the torque error is within what is allowed."""
        return self.miss is None

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
    def limits_reached(self) -> tuple[str, ...]:
        """What the limits bound that the design sits on, each with its name."""
        return limits_in_words((state.limit, state.of) for state in self.limits if state.active)

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

    def to_frames(self) -> dict[str, Any]:
        """Return ``pandas.DataFrame`` objects by name; needs pandas.

        ``numbers`` has the changed numbers, ``limits`` the state of each limit, ``torque`` the check against
        the target over the angle, ``curves`` what the optimiser saw of cam and rubber. Rows of the first
        two are in the unit that they name, the others in SI.
        """
        return design_frames(self)

    def rows(self) -> list[tuple[str, str]]:
        """Return a table of what was found: pairs of text."""
        return result_rows(self)

    def __str__(self) -> str:
        rows = self.rows()
        width = max(len(name) for name, _ in rows)
        lines = ["cam design", *(f"  {name:<{width}}  {text}" for name, text in rows)]
        return "\n".join([*lines, "  limits", *(f"    {state}" for state in self.limits)])


def design_frames(design: CamDesign) -> dict[str, Any]:
    """Return the tables of a design as data frames; see :meth:`CamDesign.to_frames`."""
    rows = [
        (name if len(q.values) == 1 else f"{name}[{k}]", each, q.unit, q.source, q.spread_data)
        for name, q in design.changes
        for k, each in enumerate(np.atleast_1d(np.asarray(q.shown)).tolist(), start=1)
    ]
    keys = ("name", "value", "unit", "source", "spread")
    limits = []
    for state in design.limits:
        factor = parse_unit(state.unit).factor
        limits.append(replace(state, value=state.value / factor, bound=state.bound / factor))
    check, curves = design.check, design.curves
    torque = {"torque": check.torques, "target": check.targets, "error": check.errors}
    over = {
        "lever_arm": curves.lever_arms, "radius": curves.radii, "torque": curves.torques,
        "radius_of_curvature": curves.radii_of_curvature, "stiffness": curves.stiffnesses,
        "extension": curves.extensions, "force": curves.forces,
    }  # fmt: skip
    units = {"lever_arm": "m", "radius": "m", "radius_of_curvature": "m", "torque": "N*m",
             "stiffness": "N*m/rad", "extension": "m", "force": "N"}  # fmt: skip
    for what, unit, by_path in (("strain", "1", curves.strains), ("stress", "Pa", curves.stresses)):
        over |= {f"{path}.{what}": values for path, values in by_path.items()}
        units |= {f"{path}.{what}": unit for path in by_path}
    return {
        "numbers": data_frame({key: [row[k] for row in rows] for k, key in enumerate(keys)}),
        "limits": data_frame({f.name: [getattr(s, f.name) for s in limits] for f in fields(LimitState)}),
        "torque": data_frame(
            torque, units=dict.fromkeys(torque, "N*m"), index=Axis("angle", "rad", check.angles)
        ),
        "curves": data_frame(over, units=units, index=Axis("angle", "rad", curves.angles)),
    }


def result_rows(design: CamDesign) -> list[tuple[str, str]]:
    """Return what a design prints: pairs of text."""
    target, check, curves = design.target, design.check, design.curves
    share, largest = 100.0 / target.largest, check.largest
    end = f"{np.degrees(target.last_angle):.4g} deg"
    pulled = "cable" if design.cam.rolling is None else "element"
    arms = design.contour.lever_arms
    least = float(arms.min())
    fit = f", contour held to {1e6 * design.fit_error:.2g} µm" if design.fit_error > 0.0 else ""
    rows = [("verdict", _MET if design.miss is None else str(design.miss))]
    if design.miss is not None:
        rows += [("what would help", sentence) for sentence in design.miss.advice]
    rows += [
        *_spread_rows(design),
        (
            "torque error, exact numbers",
            f"{prefixed(check.rms)} rms ({without_power(share * check.rms, 2)} %), "
            f"{prefixed(largest)} at most",
        ),
    ]
    rows += [("target", f"{type(target).__name__}, up to {end}, at most {target.largest:.4g} N·m")]
    rows += [
        (name, str(value) if len(value.values) <= 4 else f"<{len(value.values)} control values>")
        for name, value in design.changes
    ]
    rows += [
        (f"{pulled} force", f"{curves.forces[0]:.4g} to {curves.forces.max():.4g} N in each {pulled}"),
        *((f"strain of {path}", f"up to {100 * row.max():.4g} %") for path, row in curves.strains.items()),
        *((f"stress of {path}", f"up to {row.max() / 1e6:.4g} MPa") for path, row in curves.stresses.items()),
        ("energy from angle zero", f"{curves.energy:.4g} J, without that of the pretension"),
        *(
            [("wire" if design.cam.coils else "rubber", f"{1e6 * design.rubber_volume:.4g} cm³")]
            if design.rubber_volume > 0.0
            else []
        ),
        ("radius of curvature", _curvature(design)),
        ("cam radius", f"{1e3 * design.contour.radii.max():.4g} mm"),
        ("lever arm", f"{f'{MM * least:.4g}' if least < 0.0 else 'up'} to {MM * arms.max():.4g} mm"),
        (
            "sizes that cost nothing",
            "; ".join(str(each) for each in design.size_ranges if each.wide) or "none",
        ),
        ("starts", _starts(design)),
        ("solver", f"{design.starts[design.taken].iterations} iterations{fit}"),
        ("fingerprint", design.fingerprint),
    ]
    rows += [("stock", _alternative(design, each)) for each in design.alternatives]
    rows += [("remark", remark) for remark in design.remarks]
    inside = design.within_tolerance
    return rows if inside is None else [*rows, ("within tolerance", f"{100 * inside:.3g} % of the angles")]


_MET = "meets its target with exact numbers"
_SURE = 2
"""Starts from which a design was found where nothing more is said."""
_EDGE = 1e-3
"""Radius of curvature, relative to the largest lever arm, up to which a contour is an edge."""


def _curvature(design: CamDesign) -> str:
    """Return the range of the radius of curvature; where it is zero the contour is an edge, as of a bar."""
    curves, made = design.curves, design.contour.radii_of_curvature
    hollow = curves.radii_of_curvature < 0.0
    if hollow.any():
        narrowest, where = MM * float(-made[made < 0.0].max()), spans_of(curves.angles, hollow)
        return f"from {MM * made[made > 0.0].min():.3g} mm, hollow {where} with at least {narrowest:.3g} mm"
    edge = curves.radii_of_curvature <= _EDGE * curves.lever_arms.max()
    if not edge.any():
        rho = design.contour.radii_of_curvature
        return f"{1e3 * rho.min():.3g} to {1e3 * rho.max():.3g} mm"
    where = f"an edge {spans_of(curves.angles, edge)}, where convexity binds (ConvexContour)"
    return where if edge.all() else f"{where}; up to {1e3 * curves.radii_of_curvature.max():.3g} mm elsewhere"


def _starts(design: CamDesign) -> str:
    """Return from how many starts the design was found, and what the next best of another shape is."""
    solved = [start for start in design.starts if start.solved]
    times = sum(start.same for start in solved)
    text = f"found from {times} of {len(design.starts)}"
    if times < _SURE:
        text = f"found once only in {len(design.starts)}: another may be better, ask for more starts"
    others = sorted((start for start in solved if not start.same), key=lambda start: start.cost)
    if not others:
        return text
    ratio = others[0].cost / design.starts[design.taken].cost
    return text + f"; the next best design has {ratio:.4g} times the cost, {prefixed(others[0].rms)} rms"


def _spread_rows(design: CamDesign) -> list[tuple[str, str]]:
    what, spread = "torque error over the spread", design.tolerance
    if spread is None:
        return [(what, "not known: no draws were asked for, or a remark says why")]
    if not spread.causes:
        return [(what, "not known: the deck declares no spread of a number that acts on the torque")]
    worst = spread.quantiles[-1]
    share = without_power(100.0 * worst.value / design.target.largest, 2)
    below = f"{prefixed(worst.value, digits=4)} rms ({share} %, {len(spread.errors)} draws)"
    text = f"{100 * worst.share:g} % of made springs below {below}"
    if spread.trims:
        trim = spread.trims[0]
        text += f", {prefixed(trim.quantiles[-1].value, digits=4)} after a trim of {trim.name}"
    first = spread.measure_first
    return [(what, text), *([] if first is None else [("measure first", first)])]


def _alternative(design: CamDesign, each: Alternative) -> str:
    if each.rms is None:
        return f"{each.choice}: no design, {each.reason}"
    share = 100.0 * each.rms / design.target.largest
    volume = f", {1e6 * each.rubber_volume:.3g} cm³" if each.rubber_volume else ""
    return f"{each.choice}: {share:.2g} % rms, cost {each.cost:.4g}{volume}" + (
        "" if each.met else ", a miss"
    )


def _read(torque: float) -> str:
    """Return a deviation of torque in the unit in which it has no power of ten."""
    if abs(torque) < 0.9995:
        return f"{1e3 * torque:+.3g} mN·m"
    return f"{torque:+.4g} N·m" if abs(torque) < 1e4 else f"{torque:+.0f} N·m"
