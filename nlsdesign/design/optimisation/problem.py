"""The design problem in symbols: its variables, the design they make, and what its geometry demands.

Variable is the radius of curvature ρ over the cable's direction φ, linear between nodes. Between two nodes
p'' + p = ρ has the exact solution

    p = a + b·t + (p₀ − a)·cos t + (p'₀ − b)·sin t,        ρ = a + b·t,

so that ρ ≥ 0 gives a convex contour by construction, with p(0) = 0 because the cable passes through the
centre. The extension follows from the length of the cable: δ = ∫ρ dφ − (p' − p'(0)) + √(D² − p²) − D.
"""

from __future__ import annotations

import itertools
import math
from collections.abc import Sequence
from dataclasses import dataclass, replace
from typing import NamedTuple

import casadi as ca
import numpy as np
from numpy.typing import NDArray

from ...errors import InfeasibleError, ValueRangeError, unknown_name
from ...model import FlatModel, Variable
from ...model.structure import CamNames
from ...symbolic import Expression
from ..curves.target import Target
from ..statics.declared_cam import contour_of_cam, two_sided
from ..statics.energy import closed_form
from ..statics.equilibrium import ElasticLaw, cam_function, elastic_law
from .design_point import DesignPoint, anchor_of
from .program import Rows

Floats = NDArray[np.float64]

INTERVALS = 40
"""Intervals of the contour; the number moves the results by less than their last digit shown."""

_LARGEST_RADIUS = 0.5
"""Largest radius of curvature and first slope in m."""
_LEAST_CLEARANCE = 0.02
"""Free length of the cable and clearance between cam and anchor, relative to the anchor distance."""
_ERROR_SCALE = 0.01
"""Scale of the equations of the torque errors: first errors of the size of the torque become about 10."""


class DesignVariable(NamedTuple):
    """A number that the solver chooses; ``value`` is it in SI, a function of its symbol of about size 1."""

    name: str
    symbol: Expression
    value: Expression
    lower: float
    upper: float
    start: float


class Shape(NamedTuple):
    """Columns over the nodes of a contour, and what must hold for it to be one."""

    directions: Expression
    angles: Expression
    lever_arms: Expression
    slopes: Expression
    radii_of_curvature: Expression
    extensions: Expression
    rows: tuple[Rows, ...]


class ContourVariables(NamedTuple):
    """The variables that shape a contour."""

    radii_of_curvature: tuple[DesignVariable, ...]
    first_slope: DesignVariable
    last_direction: DesignVariable

    def all(self) -> list[DesignVariable]:
        """Return them in the order of the vector."""
        return [*self.radii_of_curvature, self.first_slope, self.last_direction]


@dataclass(frozen=True, eq=False)
class DesignProblem:
    """Variables and what follows from them.

    Parameters
    ----------
    law
        Equilibrium law of the element behind the cam.
    variables
        All, in the order of the vector.
    design
        The design in symbols.
    structure
        Rows that hold for any cam; no limit of the designer.
    starts
        Starting points, shape (variables,) each.
    contour
        The variables of the contour; ``None`` where it is given.
    """

    law: ElasticLaw
    variables: tuple[DesignVariable, ...]
    design: DesignPoint
    structure: tuple[Rows, ...]
    starts: tuple[Floats, ...]
    contour: ContourVariables | None

    @property
    def vector(self) -> Expression:
        """The symbols as a column."""
        return ca.vertcat(*[v.symbol for v in self.variables])

    def named(self, point: Floats) -> dict[str, float]:
        """Return the variables in SI by name.

        Parameters
        ----------
        point
            Shape (variables,), scaled.
        """
        values = self.evaluate(ca.vertcat(*[v.value for v in self.variables]), point)
        return {v.name: float(value) for v, value in zip(self.variables, values, strict=True)}

    def evaluate(self, expression: Expression, point: Floats) -> Floats:
        """Return the value of an expression of the variables.

        Parameters
        ----------
        expression
            Column.
        point
            Shape (variables,), scaled.
        """
        result: Floats = np.array(
            ca.Function("value", [self.vector], [expression])(point), dtype=float
        ).ravel()
        return result


def design_problem(
    model: FlatModel,
    cam: object,
    *,
    target: Target,
    free: Sequence[str],
    spring: str | None = None,
    rounding: float = 0.0,
) -> DesignProblem:
    """Write the design problem of a cam spring.

    Parameters
    ----------
    model
        Flat model of the actuator.
    cam
        Its declared cam.
    target
        Torque curve.
    free
        Full names of what may change; the contour is ``<cam>.contour`` or ``<cam>.lever_arm``.
    spring
        Path of the cam spring; decided from the structure if it is left out.
    rounding
        Width over which knots of the rubber's law are rounded, relative to its stretch.

    Raises
    ------
    UnknownNameError
        If a free name does not exist or may not change, with the nearest that may.
    ArrangementError
        If the cam is not a two-sided one, or the structure does not say which spring is meant.
    """
    two_sided(cam)
    law = elastic_law(model, spring)
    contour_is_free, numbers = _split(model, free, law.cam)
    size, stretch = _sizes(law, target)
    if rounding > 0.0:
        law = law.without_knots(2.0 * stretch, rounding)
    scalars = {number.name: _scalar(number, 0.3 * stretch) for number in numbers}
    parameters = {
        v.name: scalars[v.name].value if v.name in scalars else ca.SX(v.start) for v in model.parameters
    }
    anchor, contour = anchor_of(law.cam), None
    if contour_is_free:
        contour, shape = _free_shape(parameters[anchor], target.last_angle, size)
    else:
        shape = _given_shape(model, cam, target.last_angle, law.cam.drive)
    variables = [*scalars.values(), *(contour.all() if contour else ())]
    # No start may reach to the anchor.
    shrunk = min(1.0, 0.45 * model.values[anchor] / size)
    starts = []
    for share, tight in _STARTS:
        values = {v.name: v.start for v in variables}
        if law.cam.pretension in scalars:
            pretension = scalars[law.cam.pretension]
            slope = float(ca.evalf(ca.gradient(pretension.value, pretension.symbol)))
            values[pretension.name] = tight * stretch / slope
        if contour:
            values |= _contour_start(contour, shrunk * share, shrunk)
        starts.append(np.array([values[v.name] for v in variables]))
    design = _design(law, target, shape, parameters)
    return _lifted(DesignProblem(law, tuple(variables), design, shape.rows, tuple(starts), contour))


# Share of the size that is first slope, and share of the stretch that is pretension.
_STARTS = ((0.5, 0.3), (0.8, 0.1), (0.3, 0.6), (0.6, 0.9))


def contour_names(cam: CamNames) -> tuple[str, str]:
    """Return the two names by which the contour of a cam is called free.

    Parameters
    ----------
    cam
        Names around it.
    """
    return f"{cam.name}.contour", f"{cam.name}.lever_arm"


def _split(model: FlatModel, free: Sequence[str], cam: CamNames) -> tuple[bool, list[Variable]]:
    contours, anchor = contour_names(cam), anchor_of(cam)
    movable = {name: model.variable(name) for name in (*cam.numbers, anchor)}
    for name in free:
        if name not in movable and name not in contours:
            raise unknown_name("free", name, [*contours, *movable])
    if not free:
        raise ValueRangeError(
            "free = []", "nothing may change", next_step=f"free for instance '{contours[0]}'"
        )
    contour_is_free = any(name in free for name in contours)
    if anchor in free and not contour_is_free:
        raise ValueRangeError(
            f"free: '{anchor}'", "the anchor shapes the contour, so it can only be free together with it",
            next_step=f"free '{contours[0]}' too",
        )  # fmt: skip
    return contour_is_free, [v for name, v in movable.items() if name in free]


def _sizes(law: ElasticLaw, target: Target) -> tuple[float, float]:
    """Return a typical lever arm and stretch: those of the closed form, or of a wheel where there is none."""
    elements = {v.name: v.start for v in law.parameters}[law.cam.elements]
    try:
        profile = closed_form(law, target, elements=elements, points=21)
    except InfeasibleError:
        return 0.01, 0.01 * target.last_angle
    return float(np.clip(profile.lever_arms[-1], 1e-4, 0.2)), float(profile.extensions[-1])


def _scalar(variable: Variable, small: float) -> DesignVariable:
    """Return a single number: a length that may be zero in units of its size, all others as a logarithm."""
    symbol = ca.SX.sym(variable.name)
    now, low, high = variable.start, variable.minimum, variable.maximum
    if low > 0.0 and now > 0.0:
        ends = (math.log(low / now), math.log(high / now) if math.isfinite(high) else ca.inf)
        return DesignVariable(variable.name, symbol, now * ca.exp(symbol), *ends, 0.0)
    size = now or small
    return DesignVariable(variable.name, symbol, size * symbol, low / size, high / size, now / size)


def _contour_start(contour: ContourVariables, slope: float, size: float) -> dict[str, float]:
    """Return the start of a wheel of that size with a first slope, both scaled."""
    starts = {radius.name: size - 0.5 * slope for radius in contour.radii_of_curvature}
    return starts | {contour.first_slope.name: slope}


def _lifted(problem: DesignProblem) -> DesignProblem:
    """Return the problem with the torque errors as variables of their own, held by equations.

    The square of an error that nearly vanishes along a curve (rubber, pretension and contour can
    replace each other) is what Newton's method finds hard; with the errors lifted out the cost is quadratic.
    """
    design = problem.design
    scale = 1e-3 * design.target.largest
    errors = design.torque_errors[1:] / scale  # at angle zero there is no torque and no error
    symbols = ca.SX.sym("torque_error", errors.shape[0])
    lifted = tuple(
        DesignVariable(f"torque_error[{i + 1}]", symbols[i], scale * symbols[i], -math.inf, math.inf, 0.0)
        for i in range(errors.shape[0])
    )
    return replace(
        problem,
        variables=problem.variables + lifted,
        design=replace(design, torque_errors=ca.vertcat(0.0, scale * symbols)),
        structure=(*problem.structure, Rows(_ERROR_SCALE * (errors - symbols), 0.0, 0.0)),
        starts=tuple(np.append(start, problem.evaluate(errors, start)) for start in problem.starts),
    )


def _free_shape(anchor: Expression, last_angle: float, size: float) -> tuple[ContourVariables, Shape]:
    def length(name: str, start: float) -> DesignVariable:
        symbol = ca.SX.sym(name)
        return DesignVariable(name, symbol, size * symbol, 0.0, _LARGEST_RADIUS / size, start)

    radii = [length(f"radius_of_curvature[{i}]", 0.7) for i in range(INTERVALS + 1)]
    first, turned = length("first_slope", 0.5), ca.SX.sym("last_direction")
    ends = (last_angle, last_angle + np.pi / 2)
    last = DesignVariable("last_direction", turned, turned, *ends, last_angle + 0.6)
    rho = [u.value for u in radii]
    step = last.symbol / INTERVALS
    cosine, sine = ca.cos(step), ca.sin(step)
    values, slopes, arcs = [ca.SX(0)], [first.value], [ca.SX(0)]
    for left, right in itertools.pairwise(rho):
        growth = (right - left) / step
        off, tilt = values[-1] - left, slopes[-1] - growth
        values.append(right + off * cosine + tilt * sine)
        slopes.append(growth - off * sine + tilt * cosine)
        arcs.append(arcs[-1] + step * (left + right) / 2)
    p, slope = ca.vertcat(*values), ca.vertcat(*slopes)
    root = ca.sqrt(anchor**2 - p**2)
    directions = step * ca.SX(np.arange(INTERVALS + 1))
    angles = directions - ca.asin(p / anchor)
    # √(D² − p²) − D without cancellation
    extensions = ca.vertcat(*arcs) - (slope - slope[0]) - p**2 / (anchor + root)
    rows = (
        Rows(angles[-1] - last_angle, 0.0, 0.0),
        Rows((root - slope) / anchor, _LEAST_CLEARANCE, ca.inf),
        Rows((p**2 + slope**2) / anchor**2, -ca.inf, (1.0 - _LEAST_CLEARANCE) ** 2),
    )
    shape = Shape(directions, angles, p, slope, ca.vertcat(*rho), extensions, rows)
    return ContourVariables(tuple(radii), first, last), shape


def _given_shape(model: FlatModel, cam: object, last_angle: float, spring: str) -> Shape:
    contour = contour_of_cam(cam, last_angle=last_angle, points=INTERVALS + 1)
    angles = contour.angles.reshape(1, -1)
    _, extensions = cam_function(model, spring)(angles, model.start(model.parameters))
    return Shape(
        ca.SX(contour.directions), ca.SX(contour.angles), ca.SX(contour.lever_arms), ca.SX(contour.slopes),
        ca.SX(contour.radii_of_curvature), ca.SX(extensions).T, (),
    )  # fmt: skip


def _design(law: ElasticLaw, target: Target, shape: Shape, parameters: dict[str, Expression]) -> DesignPoint:
    cam = law.cam
    anchor = parameters[anchor_of(cam)]
    everything = ca.vertcat(*[parameters[v.name] for v in law.parameters])
    stretched = parameters[cam.pretension] + shape.extensions
    columns = [law.function.call([stretched[i], everything]) for i in range(stretched.shape[0])]
    forces, stiffnesses = (ca.vertcat(*[column[i] for column in columns]) for i in (0, 1))
    strains, stresses = (ca.horzcat(*[column[i] for column in columns]) for i in (2, 3))
    root = ca.sqrt(anchor**2 - shape.lever_arms**2)
    free = root - shape.slopes
    elements = parameters[cam.elements]
    wanted = ca.vertcat(*[target.torque_law(shape.angles[i]) for i in range(shape.angles.shape[0])])
    return DesignPoint(
        cam=cam,
        target=target,
        angles=shape.angles,
        directions=shape.directions,
        lever_arms=shape.lever_arms,
        lever_arm_slopes=shape.slopes * root / free,
        radii_of_curvature=shape.radii_of_curvature,
        radii=ca.sqrt(shape.lever_arms**2 + shape.slopes**2 + 1e-18),
        extensions=stretched,
        forces=forces,
        stiffnesses=stiffnesses,
        strains={path: strains[i, :].T for i, path in enumerate(law.specimens)},
        stresses={path: stresses[i, :].T for i, path in enumerate(law.specimens)},
        torque_errors=elements * shape.lever_arms * forces - wanted,
        parameters=parameters,
    )
