"""The contour as numbers that a solver chooses, and where its search starts."""

from __future__ import annotations

import itertools
from abc import ABC, abstractmethod
from collections.abc import Callable, Iterator, Mapping, Sequence
from dataclasses import dataclass
from typing import NamedTuple

import casadi as ca
import numpy as np
import scipy

from ...foundation.arrays import Array
from ...foundation.symbolic import Expression
from ...model import FlatModel
from ...model.structure import CamNames
from ..statics.contour import (
    Contour,
    PairContour,
    RollerContour,
    RollingContour,
    contour_from_curvature,
    pair_contour,
    roller_contour,
)
from ..statics.declared_cam import DesignedCam, contour_of_cam, declared_cam
from ..statics.equilibrium import cam_function
from .design_point import DesignPoint
from .edges import CableEdge, Edge, PairEdge, RollerEdge
from .limits import Bound
from .program import DesignVariable, Rows, scaled

CONVEX = "ConvexContour"
"""Name of what holds a contour under a cable: it is nowhere hollow."""

INTERVALS = 40
"""Intervals of the contour; the number moves the results by less than their last digit shown."""

_STEEPEST = 200.0
"""Largest slope of the lever arm of a roller, relative to the size of the lever arm."""
_POINTS = 8
"""Points of the contour under a roller in each interval."""
_LARGEST_RADIUS = 0.5
"""Largest radius of curvature and first slope in m."""
_LEAST_CLEARANCE = 0.02
"""Free length of the cable and clearance between cam and anchor, relative to the anchor distance."""
_FARTHEST = (1.0 - _LEAST_CLEARANCE) ** 2


class Shape(NamedTuple):
    """Columns over the nodes of a contour, what must hold for it to be one, and where its cable passes.

    ``states`` are unknowns that the rows tie to the contour: p, p' and ∫ρ at each node, so that what is asked
    of a node depends on a few unknowns only, and the derivatives are sparse; ``state_values`` are their
    scaled values as they follow from the contour.
    """

    directions: Expression
    angles: Expression
    lever_arms: Expression
    radii: Expression
    radii_of_curvature: Expression
    extensions: Expression
    lever_arm_slopes: Expression
    rows: tuple[Rows, ...]
    through_centre: bool
    states: tuple[DesignVariable, ...]
    state_values: Expression
    edge: Edge


@dataclass(frozen=True, eq=False)
class FreeContour(ABC):
    """The variables that shape the contour of one kind of cam, and what follows from them."""

    # radii_of_curvature: those that must not be negative, or the contour is hollow; none where it may be
    radii_of_curvature: tuple[DesignVariable, ...]

    @property
    def hollow(self) -> str:
        """What a hollow contour would do."""
        return (
            "a taut cable lifts off there; the roller of a follower (RollerCam) does not, and two cams that "
            "roll on one another (RollingPair) stay convex"
        )

    @abstractmethod
    def all(self) -> list[DesignVariable]:
        """Return them in the order of the vector."""

    @abstractmethod
    def at(self, start: Start, sizes: StartSizes) -> dict[str, float]:
        """Return their scaled values at a start by name."""

    @abstractmethod
    def held(self, design: DesignPoint, arm: float, *, curved: bool) -> list[Bound]:
        """Return what holds them besides the limits; ``curved``: whether a limit keeps the edge convex."""

    @abstractmethod
    def made(self, design: DesignPoint, value: Callable[[Expression], Array]) -> Contour:
        """Return the contour at a solution, at which ``value`` gives numbers for expressions."""


def held(limit: str, of: str, expression: Expression, scale: float) -> Bound:
    """Return what must not be negative."""
    return Bound(limit, of, ca.SX(expression), 0.0, False, "mm", scale)


@dataclass(frozen=True, eq=False)
class ContourVariables(FreeContour):
    """The variables of a contour under a cable; the last is the last direction, or the first lever arm.

    Where the cable passes through the centre the first lever arm is zero and the last direction follows from
    the anchor; where it stays parallel the last direction is the last angle and the first lever arm is free.
    """

    first_slope: DesignVariable
    last: DesignVariable

    def all(self) -> list[DesignVariable]:
        """Return them in the order of the vector."""
        return [*self.radii_of_curvature, self.first_slope, self.last]

    def at(self, start: Start, sizes: StartSizes) -> dict[str, float]:
        """Return their scaled values at a start by name."""
        values = {v.name: v.start for v in self.all()}
        # No start may reach to the anchor.
        size = min(start.contour_size, sizes.largest_arm / sizes.arm)
        slope = size * start.slope_share
        values |= {radius.name: size - 0.5 * slope for radius in self.radii_of_curvature}
        values[self.first_slope.name] = slope
        return values

    def held(self, design: DesignPoint, arm: float, *, curved: bool) -> list[Bound]:
        """Return that the contour is convex and the cable pulls."""
        bounds = [] if curved else [held(CONVEX, "radius of curvature", design.radii_of_curvature, arm)]
        if design.cam.anchor_distance is None or not design.through_centre:
            return [*bounds, held("PullingCable", "lever arm", design.lever_arms, arm)]
        return [*bounds, held("PullingCable", "first slope", self.first_slope.value, arm)]

    def made(self, design: DesignPoint, value: Callable[[Expression], Array]) -> Contour:
        """Return the contour at a solution."""
        anchor = design.cam.anchor_distance
        return contour_from_curvature(
            value(design.directions),
            value(design.radii_of_curvature),
            first_slope=float(value(self.first_slope.value)[0]),
            first_lever_arm=float(value(design.lever_arms[0])[0]),
            anchor_distance=np.inf if anchor is None else float(value(design.parameters[anchor])[0]),
        )


@dataclass(frozen=True, eq=False)
class RollerVariables(FreeContour):
    """The slope of the lever arm at each node, straight between them, in units of a typical lever arm."""

    slopes: tuple[DesignVariable, ...]
    radius: float  # of the roller in m
    per_interval: float  # intervals in a radian

    def all(self) -> list[DesignVariable]:
        """Return them in the order of the vector."""
        return list(self.slopes)

    def at(self, start: Start, sizes: StartSizes) -> dict[str, float]:
        """Return a lever arm that rises and falls as the torque does."""
        slopes = np.gradient(sizes.profile) * start.contour_size * 2.0 * start.slope_share * self.per_interval
        return {v.name: each for v, each in zip(self.slopes, slopes.tolist(), strict=True)}

    def held(self, design: DesignPoint, arm: float, *, curved: bool) -> list[Bound]:
        """Return nothing: the edge may be hollow."""
        return []

    def made(self, design: DesignPoint, value: Callable[[Expression], Array]) -> Contour:
        """Return the contour at a solution: a slope that is straight between nodes, integrated exactly."""
        nodes, slopes = value(design.angles), value(design.lever_arm_slopes)
        share = np.arange(_POINTS) / _POINTS
        bearings = np.append((nodes[:-1, None] + np.diff(nodes)[:, None] * share).ravel(), nodes[-1])
        law = scipy.interpolate.PPoly(np.array([np.diff(slopes) / np.diff(nodes), slopes[:-1]]), nodes)
        arms, way = law.antiderivative(), law.antiderivative(2)
        rho = design.parameters[design.cam.rolling.base]  # type: ignore[union-attr]
        return roller_contour(
            bearings,
            (way(bearings), arms(bearings), law(bearings)),
            base_radius=float(value(rho)[0]),
            roller_radius=self.radius,
        )


@dataclass(frozen=True, eq=False)
class PairVariables(FreeContour):
    """The variables of a cam that rolls on its mirror image.

    With a first slope above zero both begin with a straight facet, and the lever arm with a jump.
    """

    first_slope: DesignVariable
    per_interval: float  # intervals in a radian of the angle

    @property
    def hollow(self) -> str:
        """What a hollow contour would do."""
        return "both cams would meet there; with a larger distance of their pivots they would not"

    def all(self) -> list[DesignVariable]:
        """Return them in the order of the vector."""
        return [*self.radii_of_curvature, self.first_slope]

    def at(self, start: Start, sizes: StartSizes) -> dict[str, float]:
        """Return a lever arm that rises and falls as the torque does, where the profile stays convex."""
        arms = 2.0 * start.contour_size * start.slope_share * sizes.profile
        # A curve that begins with a jump needs a facet.
        arms[0] = max(0.0, 2.0 * arms[1] - arms[2])
        radii = np.maximum(sizes.base / sizes.arm / 2.0 + 2.0 * np.gradient(arms) * self.per_interval, 0.1)
        values = {v.name: each for v, each in zip(self.radii_of_curvature, radii.tolist(), strict=True)}
        return values | {self.first_slope.name: arms[0]}

    def held(self, design: DesignPoint, arm: float, *, curved: bool) -> list[Bound]:
        """Return that the profile is convex."""
        return [] if curved else [held(CONVEX, "radius of curvature", design.radii_of_curvature, arm)]

    def made(self, design: DesignPoint, value: Callable[[Expression], Array]) -> Contour:
        """Return the contour at a solution."""
        base = design.parameters[design.cam.rolling.base]  # type: ignore[union-attr]
        edge = contour_from_curvature(
            value(design.directions), value(design.radii_of_curvature), anchor_distance=np.inf,
            first_slope=float(value(self.first_slope.value)[0]), first_lever_arm=float(value(base)[0]) / 2.0,
        )  # fmt: skip
        return pair_contour(edge)


State = tuple[Expression, ...]
"""What is carried from node to node along a contour."""


class _Support(NamedTuple):
    """Columns of p, p' and ∫ρ over the nodes; the unknowns that they are, with what ties these down."""

    values: Expression
    slopes: Expression
    arcs: Expression
    directions: Expression
    rows: Rows
    states: tuple[DesignVariable, ...]
    state_values: Expression


def through_centre(
    anchor: Expression, last_angle: float, size: float, *, end: Expression
) -> tuple[ContourVariables, Shape]:
    """Return the contour of a cam through whose centre the cable passes to an anchor."""
    turned = ca.SX.sym("last_direction")
    last = DesignVariable(
        "last_direction", turned, turned, last_angle, last_angle + np.pi / 2, last_angle + 0.6
    )
    variables = ContourVariables(_radii(size), _length("first_slope", size, start=0.5), last)
    support = _support(variables, ca.SX(0), last.value, size)
    p, slope, arcs, directions = support[:4]
    root = ca.sqrt(anchor**2 - p**2)
    angles = directions - ca.asin(p / anchor)
    # √(D² − p²) − D without cancellation
    extensions = arcs - (slope - slope[0]) - p**2 / (anchor + root)
    rows = (
        support.rows,
        Rows(angles[-1] - end, 0.0, 0.0),
        Rows((root - slope) / anchor, _LEAST_CLEARANCE, ca.inf, "free cable over anchor distance"),
        Rows(
            (p**2 + slope**2) / anchor**2, -ca.inf, _FARTHEST, "square of radius over distance of the anchor"
        ),
    )
    rho = ca.vertcat(*[u.value for u in variables.radii_of_curvature])
    return variables, Shape(
        directions, angles, p, _distance(p, slope), rho, extensions, slope * root / (root - slope),
        rows, True, support.states, support.state_values, CableEdge(directions, p, rho, 2),
    )  # fmt: skip


def parallel(last_angle: Expression, size: float) -> tuple[ContourVariables, Shape]:
    """Return the contour of a cam whose cable leaves to one side and stays parallel: φ = θ, h = p."""
    slope = _length("first_slope", size, start=0.3)._replace(lower=-_LARGEST_RADIUS / size)
    arm = _length("first_lever_arm", size, start=0.5)
    variables = ContourVariables(_radii(size), slope, arm)
    support = _support(variables, arm.value, last_angle, size)
    p, slopes, arcs, directions = support[:4]
    rho = ca.vertcat(*[u.value for u in variables.radii_of_curvature])
    rows = (support.rows, Rows(p / size, 0.0, ca.inf))
    return variables, Shape(
        directions, directions, p, _distance(p, slopes), rho, arcs - (slopes - slopes[0]), slopes,
        rows, False, support.states, support.state_values, CableEdge(directions, p, rho, 1),
    )  # fmt: skip


def _distance(p: Expression, slopes: Expression) -> Expression:
    return ca.sqrt(p**2 + slopes**2 + 1e-18)


def rolled(
    last_angle: float, arm: float, *, end: Expression, base: Expression, radius: float
) -> tuple[FreeContour, Shape]:
    """Return the way of a roller whose lever arm is zero at angle zero.

    ``base``, ``radius``: base radius, and radius of the roller in m; ``arm``: a typical lever arm.
    """
    names = [f"lever_arm_slope[{i}]" for i in range(INTERVALS + 1)]
    symbols = [ca.SX.sym(name) for name in names]
    variables = tuple(
        DesignVariable(name, symbol, arm * symbol, -_STEEPEST, _STEEPEST, 0.0)
        for name, symbol in zip(names, symbols, strict=True)
    )
    slopes, step = [v.value for v in variables], end / INTERVALS
    begin = {"lever_arm": ca.SX(0), "way": ca.SX(0)}

    def further(state: State, left: Expression, right: Expression) -> State:
        at, way = state
        return at + step * (left + right) / 2, way + step * at + step**2 * (2 * left + right) / 6

    (arms, taken), held, states = _course(begin, slopes, further, arm)
    angles = step * ca.SX(np.arange(INTERVALS + 1))
    edge = RollerEdge(angles, base + taken, arms, ca.vertcat(*slopes), radius)
    clear = Rows((edge.centre_radii - 1.01 * radius) / arm, 0.0, ca.inf)
    shape = _rolling(edge, taken, (held, clear), states)
    return RollerVariables((), variables, radius, INTERVALS / last_angle), shape


def paired(last_angle: float, arm: float, *, end: Expression, base: Expression) -> tuple[FreeContour, Shape]:
    """Return a cam that rolls on its mirror image; ``base``: distance of the pivots at angle zero."""
    variables = PairVariables(_radii(arm), _length("first_slope", arm, start=0.0), INTERVALS / last_angle)
    support = _support(variables, base / 2.0, end / 2.0, arm)
    p, arms, _, directions, held = support[:5]
    rho = ca.vertcat(*[u.value for u in variables.radii_of_curvature])
    clear = Rows(p / arm, 0.01, ca.inf)
    edge = PairEdge(directions, p, rho, 4)
    return variables, _pair(edge, arms, 2.0 * (p - p[0]), (held, clear))._replace(
        states=support.states, state_values=support.state_values
    )


def _pair(edge: PairEdge, arms: Expression, taken: Expression, rows: tuple[Rows, ...] = ()) -> Shape:
    p, rho = edge.supports, edge.radii_of_curvature
    # At angle zero the two sides meet: whatever facet the profile begins with, the lever arm is zero.
    arms = ca.vertcat(0, arms[1:])
    return Shape(
        edge.directions, 2.0 * edge.directions, arms, _distance(p, arms), rho, taken, (rho - p) / 2.0,
        rows, True, (), ca.SX(0, 1), edge,
    )  # fmt: skip


def _rolling(
    edge: RollerEdge,
    taken: Expression,
    rows: tuple[Rows, ...],
    states: tuple[tuple[DesignVariable, ...], Expression],
) -> Shape:
    return Shape(
        edge.bearings, edge.bearings, edge.lever_arms, edge.radii, edge.radii_of_curvature, taken,
        edge.lever_arm_slopes, rows, True, *states, edge,
    )  # fmt: skip


def free_shape(
    both_sides: bool,
    parameters: Mapping[str, Expression],
    *,
    names: CamNames,
    ends: tuple[float, Expression],
    arm: float,
) -> tuple[FreeContour, Shape]:
    """Return the shape of a cam whose contour is free, and its variables.

    ``both_sides``: whether the cam works to both sides alike; ``ends``: the last angle, and the expression
    that stands for it; ``arm``: a typical lever arm in m.
    """
    last_angle, end = ends
    anchor, rolling = names.anchor_distance, names.rolling
    if rolling is not None:
        base = parameters[rolling.base]
        if rolling.radius is None:
            return paired(last_angle, arm, end=end, base=base)
        return rolled(last_angle, arm, end=end, base=base, radius=float(parameters[rolling.radius]))
    if both_sides and anchor is not None:
        return through_centre(parameters[anchor], last_angle, arm, end=end)
    return parallel(end, arm)


def given(model: FlatModel, cam: object, last_angle: float, spring: str) -> Shape:
    """Return the shape of a declared cam that stays as it is."""
    contour = contour_of_cam(cam, last_angle=last_angle, points=INTERVALS + 1)
    both = declared_cam(cam).through_centre
    if isinstance(cam, DesignedCam) or isinstance(contour, RollingContour):
        # As the search saw it that designed the contour, without the change of sides of the fitted cam.
        extensions = contour.taken_lengths
    else:
        law = cam_function(model, spring)(contour.angles.reshape(1, -1), model.start(model.parameters))
        extensions = np.array(law[1]).ravel()
    if isinstance(contour, RollerContour):
        arms, slopes = ca.SX(contour.lever_arms), ca.SX(contour.slopes)
        centre = ca.SX(contour.centre_radii)
        edge = RollerEdge(ca.SX(contour.bearings), centre, arms, slopes, contour.roller_radius)
        return _rolling(edge, ca.SX(extensions), (), ((), ca.SX(0, 1)))
    if isinstance(contour, PairContour):
        on = contour.edge
        pair = PairEdge(ca.SX(on.directions), ca.SX(on.lever_arms), ca.SX(on.radii_of_curvature), 4)
        return _pair(pair, ca.SX(contour.lever_arms), ca.SX(extensions))
    # dφ/dθ = 1/(1 − p'/√(D² − p²)); the fraction vanishes for an anchor that is infinitely far.
    root = np.sqrt(contour.anchor_distance**2 - contour.lever_arms**2)
    rho, phi, p = (ca.SX(c) for c in (contour.radii_of_curvature, contour.directions, contour.lever_arms))
    return Shape(
        phi, ca.SX(contour.angles), p, _distance(p, ca.SX(contour.slopes)), rho, ca.SX(extensions),
        ca.SX(contour.slopes / (1.0 - contour.slopes / root)), (), both, (), ca.SX(0, 1),
        CableEdge(phi, p, rho, 2 if both else 1),
    )  # fmt: skip


def _radii(size: float) -> tuple[DesignVariable, ...]:
    return tuple(_length(f"radius_of_curvature[{i}]", size, start=0.7) for i in range(INTERVALS + 1))


def _length(name: str, size: float, *, start: float) -> DesignVariable:
    symbol = ca.SX.sym(name)
    return DesignVariable(name, symbol, size * symbol, 0.0, _LARGEST_RADIUS / size, start)


def _support(
    variables: ContourVariables | PairVariables, first: Expression, last: Expression, size: float
) -> _Support:
    rho, step = [u.value for u in variables.radii_of_curvature], last / INTERVALS
    begin = {"support": first, "support_slope": variables.first_slope.value, "arc": ca.SX(0)}
    (p, slopes, arcs), held, states = _course(
        begin, rho, lambda state, left, right: _next(state, left, right, step), size
    )
    return _Support(p, slopes, arcs, step * ca.SX(np.arange(INTERVALS + 1)), held, *states)


def _course(
    begin: Mapping[str, Expression], rates: Sequence[Expression], following: Callable[..., State], size: float
) -> tuple[list[Expression], Rows, tuple[tuple[DesignVariable, ...], Expression]]:
    """Return states over the nodes as unknowns of their own, what ties them down, and what they become.

    ``begin``: at the first node, by name; ``following``: gives those one interval further from state and rate
    on the left and the rate on the right; ``size``: of all of them.
    """
    symbols = ca.SX.sym("state", len(begin), INTERVALS)
    first: State = tuple(begin.values())
    states = [first, *[tuple(size * symbols[k, i] for k in range(len(begin))) for i in range(INTERVALS)]]
    explicit, rows = [first], []
    for i, (left, right) in enumerate(itertools.pairwise(rates)):
        explicit.append(following(explicit[-1], left, right))
        there = following(states[i], left, right)
        rows += [(a - b) / size for a, b in zip(there, states[i + 1], strict=True)]
    lifted = tuple(
        DesignVariable(f"{name}[{i + 1}]", symbols[k, i], size * symbols[k, i], -np.inf, np.inf, 0.0)
        for i in range(INTERVALS)
        for k, name in enumerate(begin)
    )
    values = ca.vertcat(*[each for state in explicit[1:] for each in state]) / size
    columns = [ca.vertcat(*column) for column in zip(*states, strict=True)]
    return columns, Rows(ca.vertcat(*rows), 0.0, 0.0), (lifted, values)


def _next(state: State, left: Expression, right: Expression, step: Expression) -> State:
    """Return p, p' and ∫ρ one interval further."""
    cosine, sine = ca.cos(step), ca.sin(step)
    growth = (right - left) / step
    off, tilt = state[0] - left, state[1] - growth
    return (
        right + off * cosine + tilt * sine,
        growth - off * sine + tilt * cosine,
        state[2] + step * (left + right) / 2,
    )


_ALWAYS = ((0.5, 0.3), (0.8, 0.1), (0.3, 0.6), (0.6, 0.9))
"""Share of the size that is first slope, and share of the stretch that is pretension."""
_SIZES = 0.7
"""Standard deviation of the logarithm of a drawn size."""


class Start(NamedTuple):
    """Where a search begins."""

    slope_share: float  # first slope of the contour relative to its size
    tight: float  # pretension relative to the stretch of the closed form
    factors: dict[str, float]  # of the other sizes by name, relative to what they are now
    contour_size: float = 1.0  # relative to the size of the closed form


def starts(count: int, seed: int, sizes: Sequence[str]) -> Iterator[Start]:
    """Yield starts; the first four do not depend on the seed."""
    draw = np.random.default_rng(seed)
    for number in range(count):
        if number < len(_ALWAYS):
            yield Start(*_ALWAYS[number], {})
            continue
        slope, tight = draw.uniform(0.2, 0.9), draw.uniform(0.05, 1.2)
        factors = {name: float(np.exp(_SIZES * draw.normal())) for name in sizes}
        yield Start(float(slope), float(tight), factors, float(np.exp(0.4 * draw.normal())))


class StartSizes(NamedTuple):
    """What starts are relative to: largest lever arm and stretch in m, name of the pretension."""

    arm: float
    stretch: float
    pretension: str
    largest_arm: float
    profile: Array  # wanted torque at the nodes, relative to the largest
    base: float  # declared distance in m of what rolls on the cam; zero for a cable


def start_values(
    start: Start,
    *,
    scalars: Sequence[DesignVariable],
    contour: FreeContour | None,
    sizes: StartSizes,
) -> dict[str, float]:
    """Return the scaled values of the variables at a start by name."""
    values = {}
    for variable in scalars:
        values[variable.name] = variable.start
        if variable.name == sizes.pretension:
            values[variable.name] = scaled(variable, start.tight * sizes.stretch)
        elif variable.name in start.factors:
            now = float(ca.evalf(ca.substitute(variable.value, variable.symbol, variable.start)))
            values[variable.name] = scaled(variable, start.factors[variable.name] * now)
    return values if contour is None else values | contour.at(start, sizes)
