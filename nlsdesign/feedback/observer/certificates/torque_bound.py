"""How far the estimated torque can be from the true one, for every motion and every current.

It holds where nothing corrects the inner states of the rubber: they are driven by the measured angle alone,
so current, inertia and friction never enter the torque. Each inner state obeys ż = a·(r(θ) − z); observer and
rubber filter nearly the same rest value r with nearly the same rate a, and the bound adds up what differs.
All ranges are verified by interval arithmetic over cells of the angle, not sampled. For that the spring is
read as functions of angle and parameters: its torque and its inner states.
"""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import dataclass, field
from itertools import pairwise

import casadi as ca
import numpy as np
from numpy.typing import ArrayLike

from ....foundation.arrays import Array
from ....foundation.errors import ArrangementError, ValueRangeError, unknown_name
from ....model import FlatModel
from ....model.transform import with_outputs, without_idle_states
from ..scheduling.scheduled import ObserverDesign
from .intervals import Bounds, Range, enclose, halved

NARROWEST = 1e-7
"""Width in rad below which a range of angles around the knot of a contour is not divided further."""


@dataclass(frozen=True, eq=False)
class SpringView:
    """ż = a·(r(θ) − z) for each inner state, and the torque τ(θ, z), with their slopes, all symbolic."""

    inner: tuple[str, ...]  # names of the inner states z
    uncertain: tuple[str, ...]  # names of the parameters with a range
    # nominal, spread: their values and half ranges, shape (parameters,)
    nominal: Array
    spread: Array
    rest: ca.Function  # casadi.Function (θ, z, p) -> (r, ∂r/∂θ, a)
    torque: ca.Function  # casadi.Function (θ, z, p) -> (τ, ∂τ/∂θ, ∂τ/∂z)
    # rest_by_parameter, torque_by_parameter: casadi.Function (θ, z, p) -> (∂r/∂p,) and (∂τ/∂p,)
    rest_by_parameter: ca.Function
    torque_by_parameter: ca.Function
    affine: bool  # whether the torque is affine in z

    def ranges(
        self, function: ca.Function, cells: Bounds, z: Array | None = None, *, whole: bool = False
    ) -> tuple[Range, ...]:
        """Return verified ranges of one of the functions over cells of the angle.

        ``z``: bounds of the inner states in each cell, shape (cells, inner, 2); zero if it is left out.
        """
        spread = self.spread if whole else np.zeros_like(self.spread)
        held = np.zeros((1, len(self.inner), 2)) if z is None else z
        boxes: list[list[tuple[ArrayLike, ArrayLike]]] = [
            [cells],
            [(held[:, k, 0], held[:, k, 1]) for k in range(len(self.inner))],
            [(v - s, v + s) for v, s in zip(self.nominal, spread, strict=True)],
        ]
        return enclose(function, boxes).outputs

    def cells(self, edges: Array) -> Bounds:
        """Return cells of the angle, divided where a piece of a contour ends; without the narrowest ones."""
        low, high = edges[:-1], edges[1:]
        kept_low, kept_high = [], []
        empty = [(0.0, 0.0)] * len(self.inner)
        fixed = [(v, v) for v in self.nominal]
        pieces = ca.Function("pieces", self.torque.sx_in(), [self.torque(*self.torque.sx_in())[0]])
        while len(low):  # ends, since what is narrow is not divided
            undecided = enclose(pieces, [[(low, high)], empty, fixed]).undecided
            kept_low.append(low[~undecided])
            kept_high.append(high[~undecided])
            split = undecided & (high - low > NARROWEST)
            middle = (low[split] + high[split]) / 2.0
            low, high = np.concatenate([low[split], middle]), np.concatenate([middle, high[split]])
        low, high = np.concatenate(kept_low), np.concatenate(kept_high)
        order = np.argsort(low)
        return low[order], high[order]


def spring_view(
    model: FlatModel, inner: tuple[str, ...], *, estimate: str, angle: str, spreads: dict[str, float]
) -> SpringView:
    """Return the spring of a model as a certificate sees it."""
    model = without_idle_states(with_outputs(model, [estimate, angle]), [estimate, angle])
    s, names = model.symbols(), [v.name for v in model.states]
    theta = s.state[names.index(angle)]
    places = [names.index(name) for name in inner]
    z = ca.vertcat(*[s.state[i] for i in places]) if places else ca.SX(0, 1)
    others = ca.vertcat(
        s.time, s.input, *[s.state[i] for i in range(len(names)) if i not in places], ca.SX(0, 1)
    )
    others = ca.vertcat(*[others[i] for i in range(others.numel()) if not ca.is_equal(others[i], theta)])
    rates = ca.vertcat(*[s.derivative[i] for i in places]) if places else ca.SX(0, 1)
    torque = ca.densify(s.output[0])
    for what, name in ((torque, estimate), *zip(ca.vertsplit(rates) if places else [], inner, strict=True)):
        if others.numel() and ca.depends_on(what, others):
            raise ArrangementError(
                f"torque bound, '{name}'",
                "depends on more than the measured angle and the inner states",
                next_step="a bound for every motion needs a spring that is led by the angle alone",
            )
    values = model.values
    uncertain = [n for n in spreads if spreads[n] > 0.0]
    p = ca.vertcat(*[s.parameter[list(values).index(n)] for n in uncertain]) if uncertain else ca.SX(0, 1)
    fixed = [i for i, n in enumerate(values) if n not in uncertain]
    numbers = ca.vertcat(*[s.parameter[i] for i in fixed])
    constants = ca.DM([list(values.values())[i] for i in fixed])

    def given(expression: ca.SX) -> ca.SX:
        return ca.densify(ca.substitute(expression, numbers, constants)) if fixed else ca.densify(expression)

    rest, forgetting = _rest(given(rates), theta, z, inner)
    torque = given(torque)
    slope = ca.jacobian(torque, z)

    def function(name: str, outputs: list[ca.SX]) -> ca.Function:
        return ca.Function(name, [theta, z, p], [ca.densify(each) for each in outputs], {"cse": True})

    return SpringView(
        inner=inner,
        uncertain=tuple(uncertain),
        nominal=np.array([values[n] for n in uncertain]),
        spread=np.array([abs(values[n]) * spreads[n] for n in uncertain]),
        rest=function("rest", [rest, ca.jacobian(rest, theta), forgetting]),
        torque=function("torque", [torque, ca.jacobian(torque, theta), slope]),
        rest_by_parameter=function("rest_by_parameter", [ca.jacobian(rest, p)]),
        torque_by_parameter=function("torque_by_parameter", [ca.jacobian(torque, p)]),
        affine=not places or not ca.depends_on(slope, z),
    )


def _rest(rates: ca.SX, theta: ca.SX, z: ca.SX, inner: tuple[str, ...]) -> tuple[ca.SX, ca.SX]:
    """Return where each inner state rests and how fast it goes there, from ż = a·(r(θ) − z)."""
    rest, forgetting = [], []
    led = ca.vertcat(theta, z)
    for i, name in enumerate(inner):
        slopes = ca.jacobian(rates[i], z)
        coupled = any(not slopes[j].is_zero() for j in range(z.numel()) if j != i)
        if coupled or ca.depends_on(slopes[i], led):
            raise ArrangementError(
                f"torque bound, '{name}'",
                "is coupled to another inner state, or forgets at a rate that depends on the angle",
                next_step="the contraction of the whole error is certified without this bound",
            )
        # A common factor, such as k/η, says how fast, not where: without it parameters do not cancel badly.
        bare = _without_factors(rates[i], led)
        start = ca.substitute(bare, z, ca.DM.zeros(z.numel()))
        rest.append(-start / ca.jacobian(bare, z[i]))
        forgetting.append(-slopes[i])
    return (ca.vertcat(*rest), ca.vertcat(*forgetting)) if rest else (ca.SX(0, 1), ca.SX(0, 1))


def _without_factors(expression: ca.SX, led: ca.SX) -> ca.SX:
    """Return an expression without the factors that do not depend on ``led``."""
    if expression.is_op(ca.OP_NEG) or expression.is_op(ca.OP_TWICE):
        return _without_factors(expression.dep(0), led)
    if expression.is_op(ca.OP_MUL) or expression.is_op(ca.OP_DIV):
        first, second = expression.dep(0), expression.dep(1)
        if not ca.depends_on(second, led):
            return _without_factors(first, led)
        if expression.is_op(ca.OP_MUL) and not ca.depends_on(first, led):
            return _without_factors(second, led)
    return expression


ROUNDING = {"double": 2.0**-53, "float": 2.0**-24}
OPERATIONS = 16
"""Roundings counted for each sum of a step: products, look-up and additions."""
REFINEMENTS = 12
"""How often a cell of the angle is halved at most."""
SLACK = 1.0 + 1e-9
"""Covers rounding where verified numbers are added up."""


@dataclass(frozen=True)
class Assumptions:
    """Under which a bound on the torque holds.

    Raises
    ------
    ValueRangeError
        If a number is not finite or negative, or a range is empty.
    UnknownNameError
        If the number type does not exist.

    Parameters
    ----------
    angles
        Range of the angle in rad; the whole table by default.
    speed
        Largest speed in rad/s.
    angle_error
        Largest deviation of the measured from the true angle in rad, half a count of the encoder, say.
    spreads
        Relative half range of each parameter that may differ from its declared value, by name.
    real
        ``"double"`` or ``"float"``: the numbers that the controller computes with.
    """

    angles: tuple[float, float]
    speed: float = 20.0
    angle_error: float = 0.0
    spreads: Mapping[str, float] = field(default_factory=dict)
    real: str = "float"

    def __post_init__(self) -> None:
        low, high = self.angles
        if not (math.isfinite(low) and math.isfinite(high) and low < high):
            raise ValueRangeError(f"angles {low:g} to {high:g} rad", "must be finite and ascending")
        for name, value in (("speed", self.speed), ("angle_error", self.angle_error)):
            if not 0.0 <= value < math.inf:
                raise ValueRangeError(f"{name} {value:g}", "must be finite and not negative")
        for name, value in self.spreads.items():
            if not 0.0 <= value < 1.0:
                raise ValueRangeError(f"spread {value:g} of '{name}'", "must lie between 0 and 1")
        if self.real not in ROUNDING:
            raise unknown_name("number type", self.real, ROUNDING)


@dataclass(frozen=True)
class TorqueErrorBound:
    """Bounds on the torque error in N·m, by cause; they add up."""

    encoder: float  # of the measured angle
    motion: float  # of what the angle does between two samples
    parameters: float  # of parameters anywhere in their ranges
    table: float  # of interpolation, shared columns and linearisation
    rounding: float  # of the numbers of the controller
    # start: by inner state: torque per unit of a wrong start, and 1/s with which that is forgotten
    start: Mapping[str, tuple[float, float]]

    @property
    def total(self) -> float:
        """Bound on the torque error once a wrong start is forgotten, in N·m."""
        return (self.encoder + self.motion + self.parameters + self.table + self.rounding) * SLACK

    @property
    def causes(self) -> dict[str, float]:
        """Bounds by cause in N·m."""
        names = ("encoder", "motion", "parameters", "table", "rounding")
        return {name: float(getattr(self, name)) for name in names}


def torque_bound(model: FlatModel, design: ObserverDesign, assumptions: Assumptions) -> TorqueErrorBound:
    """Return a bound on the torque error that holds for every motion and every current.

    ``model``: continuous; the deck's actuator.
    """
    return _Bounding(model, design, assumptions).bound()


class _Bounding:
    def __init__(self, model: FlatModel, design: ObserverDesign, assumptions: Assumptions) -> None:
        plant, grid = design.step.plant, design.compact.angles
        for name in assumptions.spreads:
            if name not in model.values:
                raise unknown_name("parameter", name, model.values)
        low, high = assumptions.angles
        if low < grid[0] - 1e-12 or high > grid[-1] + 1e-12:
            raise ValueRangeError(
                f"angles {low:g} to {high:g} rad",
                f"reach beyond the table, {grid[0]:.4g} to {grid[-1]:.4g} rad",
            )
        self.design, self.assumed = design, assumptions
        self.inner = tuple(n for n in plant.names if n not in (plant.angle, plant.speed))
        _refuse_corrected(design, self.inner)
        self.view: SpringView = spring_view(
            model, self.inner, estimate=plant.estimate.name, angle=plant.angle,
            spreads=dict(assumptions.spreads),
        )  # fmt: skip
        edges = np.unique(np.clip(np.concatenate([grid, [low, high]]), low, high))
        first = self.view.cells(edges)
        # Largest slope of the rest values, first roughly, then over the refined cells.
        rest, slope, _ = self.view.ranges(self.view.rest, first, whole=True)
        self.lead = np.max(slope.magnitude, axis=0, initial=0.0)
        least, greatest = (
            np.min(rest.lower, axis=0, initial=np.inf),
            np.max(rest.upper, axis=0, initial=-np.inf),
        )
        self.box = least[None, :, None], greatest[None, :, None]
        self.cells = self._refined(first)
        # Rest values over the cells: of the numbers of the deck, of all numbers, and in the middle of a cell.
        middle = (self.cells[0] + self.cells[1]) / 2.0
        self.rest = self.view.ranges(self.view.rest, self.cells)
        self.rest_of_all = self.view.ranges(self.view.rest, self.cells, whole=True)
        self.rest_in_middle = self.view.ranges(self.view.rest, (middle, middle))
        self.lead = np.max(self.rest_of_all[1].magnitude, axis=0, initial=0.0)

    def _refined(self, cells: Bounds) -> Bounds:
        """Return the cells, halved where the slope over the angle is known too badly."""
        done: list[Bounds] = []
        largest = 0.0
        for _ in range(REFINEMENTS):
            middle = (cells[0] + cells[1]) / 2.0
            both = (np.concatenate([cells[0], middle]), np.concatenate([cells[1], middle]))
            rest = self.view.ranges(self.view.rest, both)
            slopes = self.view.ranges(self.view.torque, both, self._carried(rest))[1].magnitude[:, 0]
            slope, steep = np.split(slopes + np.sum(rest[1].magnitude, axis=1), 2)
            largest = max(largest, float(np.max(steep, initial=0.0)))
            wide = (slope > 1.3 * largest) & (cells[1] - cells[0] > 1e-6)
            done.append((cells[0][~wide], cells[1][~wide]))
            cells = halved(cells, middle, wide)
            if not len(cells[0]):
                break
        done.append(cells)
        low, high = (np.concatenate([each[k] for each in done]) for k in (0, 1))
        order = np.argsort(low)
        return low[order], high[order]

    def _carried(self, ranges: tuple[Range, ...]) -> Array:
        """Return where the inner states can be at each angle, shape (cells, inner, 2).

        They follow their rest value; it moves no faster than its slope times the largest speed, so they lag
        behind it by no more than that over their rate, and never leave the range of all rest values.
        """
        rest, _, rate = ranges
        slow = self.lead * self.assumed.speed / np.min(rate.lower, axis=0, initial=np.inf)
        box: Array = np.clip(np.stack([rest.lower - slow, rest.upper + slow], axis=2), *self.box)
        return box

    def bound(self) -> TorqueErrorBound:
        """Return the bound; see :func:`torque_bound`."""
        view, assumed, cells = self.view, self.assumed, self.cells
        z = self._carried(self.rest_of_all)
        table, roundoff = self._step_errors(z)
        grid, lead = self.design.compact.angles, self.lead
        # Rounding moves a look-up as an error of the angle would.
        shift = 4.0 * ROUNDING[assumed.real] * float(grid[-1] - grid[0] + np.max(np.abs(grid)))
        causes = {
            "encoder": lead * assumed.angle_error,
            "motion": lead * assumed.speed * self.design.step.sample_time / 2.0,
            "parameters": self._parameter_errors(z),
            "table": table,
            "rounding": roundoff + lead * shift,
        }
        whole = sum(causes.values(), start=np.zeros(len(self.inner)))
        around = z + np.stack([-whole, whole], axis=1)[None]
        torque = view.ranges(view.torque, cells, around)
        per = np.max(torque[2].magnitude, axis=0, initial=0.0)
        steep = float(np.max(torque[1].magnitude))
        moved = view.ranges(view.torque_by_parameter, cells, z, whole=True)[0].magnitude
        size = float(np.max(torque[0].magnitude))
        direct = {
            "encoder": steep * assumed.angle_error,
            "motion": 0.0,
            "parameters": float(np.max(moved @ view.spread, initial=0.0)),
            "table": self._output_error(around),
            "rounding": steep * shift
            + OPERATIONS * ROUNDING[assumed.real] * _terms(self.design, self.inner, around, size),
        }
        added = {name: float(per @ causes[name]) + direct[name] for name in causes}
        forget = (
            -np.log(_kept(self.design, self.inner)) / self.design.step.sample_time
            if self.inner
            else np.zeros(0)
        )
        start = {n: (float(p), float(f)) for n, p, f in zip(self.inner, per, forget, strict=True)}
        if not all(math.isfinite(v) for v in added.values()):
            raise ArrangementError(
                "torque bound", "is infinite: a law has no bounded slope over these ranges",
                next_step="narrow the angles or the spreads",
            )  # fmt: skip
        return TorqueErrorBound(**{name: value * SLACK for name, value in added.items()}, start=start)

    # --- inner states -----------------------------------------------------------------------------------

    def _parameter_errors(self, z: Array) -> Array:
        """Return how far parameters move each inner state: where it rests, and how fast it goes there."""
        if not self.inner:
            return np.zeros(0)
        nominal, spread = self.rest[2].upper[0], self.rest_of_all[2]
        ends = np.array([np.min(spread.lower, axis=0), np.max(spread.upper, axis=0)]) / nominal
        slower = np.max([[_lag_difference(float(r)) for r in row] for row in ends], axis=0)
        jump = slower * (np.max(z[:, :, 1], axis=0) - np.min(z[:, :, 0], axis=0))
        # ∫|e^(−at) − e^(−a*t)| dt = |1/a − 1/a*|, times the largest rate of the rest value.
        creep = self.lead * self.assumed.speed / nominal * np.max(np.abs(1.0 - 1.0 / ends), axis=0)
        # How far parameters move the rest value, shape (cells, inner).
        slopes = self.view.ranges(self.view.rest_by_parameter, self.cells, whole=True)[0].magnitude
        by = slopes.reshape(len(self.cells[0]), len(self.view.uncertain), len(self.inner))
        moved: Array = np.einsum("cpi,p->ci", by, self.view.spread)
        error: Array = np.max(moved, axis=0) + np.minimum(jump, creep)
        return error

    def _step_errors(self, z: Array) -> tuple[Array, Array]:
        """Return what table and rounding do to each inner state, summed up over all samples."""
        if not self.inner:
            return np.zeros(0), np.zeros(0)
        design, time = self.design, self.design.step.sample_time
        rest, _, rate = self.rest
        kept, n = _kept(self.design, self.inner), len(design.step.plant.names)
        table, rounding = [], []
        for k, name in enumerate(self.inner):
            i = design.step.plant.names.index(name)
            x = float(rate.upper[0, k]) * time
            end = 1.0 + math.expm1(-x) / x  # the weight of the end of a sample, the beginning has the rest
            weights = {f"next[{i}][{n}]": -math.expm1(-x) - end, f"prior[{i}][0]": end}
            off = abs(math.exp(-x) - kept[k]) * float(np.max(np.abs(z[:, k])))
            for key, weight in weights.items():
                # The largest distance of what is read from weight × rest value, by cells.
                middle = (self.cells[0] + self.cells[1]) / 2.0
                half = (self.cells[1] - self.cells[0]) / 2.0
                value, slope = _read(self.design, key, middle)
                at = _distance(value, weight, self.rest_in_middle[0], k)
                steep = _distance(slope, weight, self.rest[1], k)
                off += float(np.max(at + steep * half))
            size = max(float(np.max(np.abs(z[:, k]))), float(np.max(rest.magnitude[:, k])))
            table.append(off / (1.0 - kept[k]))
            unit = OPERATIONS * ROUNDING[self.assumed.real]
            rounding.append(unit * size / (1.0 - kept[k]))
        return np.array(table), np.array(rounding)

    # --- torque -----------------------------------------------------------------------------------------

    def _output_error(self, z: Array) -> float:
        """Return how far t(θ)·z + t₀(θ), as read from the table, is from the torque."""
        boxes = _divided(z, 1 if self.view.affine else 6, ends=self.view.affine)
        box = np.concatenate(boxes)
        low, high = (np.tile(end, len(boxes)) for end in self.cells)
        middle, half = (low + high) / 2.0, (high - low) / 2.0
        n, names = len(self.design.step.plant.names), self.design.step.plant.names
        keys = [f"estimate[0][{names.index(name)}]" for name in self.inner] + [f"estimate[0][{n}]"]
        read = [_read(self.design, key, middle) for key in keys]
        at = self.view.ranges(self.view.torque, (middle, middle), box)[0]
        slopes = self.view.ranges(self.view.torque, (low, high), box)[1]
        value, slope = _affine([r[0] for r in read], box), _affine([r[1] for r in read], box)
        off = _apart(value, (at.lower[:, 0], at.upper[:, 0]))
        steep = _apart(slope, (slopes.lower[:, 0], slopes.upper[:, 0]))
        return float(np.max(off + steep * half))


def _affine(read: list[Array], box: Array) -> Bounds:
    low, high = read[-1].copy(), read[-1].copy()
    for k, slope in enumerate(read[:-1]):
        ends = slope[:, None] * box[:, k]
        low += np.min(ends, axis=1)
        high += np.max(ends, axis=1)
    return low, high


def _apart(a: Bounds, b: Bounds) -> Array:
    """Return the largest distance of two numbers in their ranges."""
    return np.maximum(a[1] - b[0], b[1] - a[0])


def _distance(value: Array, weight: float, of: Range, k: int) -> Array:
    ends = np.array([of.lower[:, k], of.upper[:, k]]) * weight
    apart: Array = np.max(np.abs(value[None, :] - ends), axis=0)
    return apart


def _divided(z: Array, parts: int, *, ends: bool) -> list[Array]:
    """Return boxes that together hold all inner states; only the corners where the torque is affine."""
    boxes = [np.zeros((len(z), 0, 2))]
    for k in range(z.shape[1]):
        low, high = z[:, k, 0], z[:, k, 1]
        edges = [low + (high - low) * share for share in np.linspace(0.0, 1.0, parts + 1)]
        pieces = [(low, low), (high, high)] if ends else list(pairwise(edges))
        boxes = [
            np.concatenate([box, np.stack(piece, axis=1)[:, None]], axis=1)
            for box in boxes
            for piece in pieces
        ]
    return boxes


def _lag_difference(ratio: float) -> float:
    """Return the largest |e^(−t) − e^(−ratio·t)| over t ≥ 0, rounded up."""
    if abs(ratio - 1.0) < 1e-6:
        return abs(ratio - 1.0)
    time = math.log(ratio) / (ratio - 1.0)
    return abs(math.exp(-time) - math.exp(-ratio * time)) * SLACK


def _refuse_corrected(design: ObserverDesign, inner: tuple[str, ...]) -> None:
    """Refuse observers in which a correction or another state enters the inner states."""
    plant, places = design.step.plant, design.compact.places
    count, n = len(plant.output_matrix), len(plant.names)
    for name in inner:
        i = plant.names.index(name)
        own = [places[f"next[{i}][{j}]"] for j in range(n) if j != i]
        entering = [*own, *(places[f"correction[{i}][{j}]"] for j in range(count))]
        if any(p.column is not None or p.factor != 0.0 for p in entering) or plant.measured:
            raise ArrangementError(
                f"torque bound, '{name}'",
                "is corrected by a measurement, so current and friction enter the torque",
                next_step="take CascadeGain or CertifiedGain in the minimal form",
            )


def _kept(design: ObserverDesign, inner: tuple[str, ...]) -> Array:
    places, names = design.compact.places, design.step.plant.names
    read_from = [places[f"next[{names.index(n)}][{names.index(n)}]"] for n in inner]
    if any(p.column is not None for p in read_from):
        raise ArrangementError("torque bound", "an inner state forgets at a rate that depends on the angle")
    return np.array([p.factor for p in read_from])


def _read(design: ObserverDesign, key: str, at: Array) -> tuple[Array, Array]:
    """Return what is read at angles within cells of the table, and its slope there."""
    compact = design.compact
    place, grid = compact.places[key], compact.angles
    if place.column is None:
        return np.full(len(at), place.factor), np.zeros(len(at))
    column = place.factor * compact.values[:, place.column]
    left = np.clip(np.searchsorted(grid, at, side="right") - 1, 0, len(grid) - 2)
    slope = (column[left + 1] - column[left]) / (grid[left + 1] - grid[left])
    return column[left] + slope * (at - grid[left]), slope


def _terms(design: ObserverDesign, inner: tuple[str, ...], z: Array, size: float) -> float:
    """Return the sum of the sizes of what is added up to the torque."""
    names = design.step.plant.names
    keys = [f"estimate[0][{names.index(name)}]" for name in inner]
    terms = [float(np.max(np.abs(_read(design, key, design.compact.angles)[0]))) for key in keys]
    added = float(np.dot(terms, np.max(np.abs(z), axis=(0, 2)))) if keys else 0.0
    return size + 2.0 * added
