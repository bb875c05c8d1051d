"""The design problem in symbols: its variables, the design they make, and what its geometry demands."""

from __future__ import annotations

import math
from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace
from typing import NamedTuple

import casadi as ca
import numpy as np

from ...foundation.arrays import Array
from ...foundation.errors import InfeasibleError, NlsError, ValueRangeError, unknown_name
from ...foundation.symbolic import Expression
from ...model import FlatModel, Variable
from ...model.structure import CamNames
from ..curves.target import Target
from ..statics.declared_cam import declared_cam
from ..statics.energy import closed_form
from ..statics.equilibrium import ElasticLaw, elastic_law
from .design_point import DesignPoint, Stretched
from .program import DesignVariable, Rows, scalar
from .shape import INTERVALS, FreeContour, Shape, Start, StartSizes, free_shape, given, start_values

_ERROR_SCALE = 0.01
"""Scale of the equations of the torque errors: first errors of the size of the torque become about 10."""
_SHOWN = {"m": "mm", "m^2": "mm^2"}
_NEAREST_START = 0.45
"""Largest lever arm of a start, relative to the distance of the anchor."""


class SymbolicTarget(NamedTuple):
    """What stands for the numbers of a target that are symbols.

    ``sized_for`` is a target in numbers for which variables are scaled, ``last_angle`` its symbol.
    """

    sized_for: Target
    last_angle: Expression


@dataclass(frozen=True, eq=False)
class DesignProblem:
    """Variables and what follows from them."""

    law: ElasticLaw  # equilibrium law of the element behind the cam
    # variables: all, in the order of the vector: single numbers, contour, states, torque errors
    variables: tuple[DesignVariable, ...]
    design: DesignPoint  # the design in symbols
    structure: tuple[Rows, ...]  # rows that hold for any cam; no limit of the designer
    scalars: tuple[DesignVariable, ...]  # the single numbers that are free
    contour: FreeContour | None  # the variables of the contour; None where it is given
    sizes: StartSizes  # what starts are relative to
    # states: scaled values of the unknowns that the structure ties to the contour; they follow its variables
    states: Expression

    @property
    def vector(self) -> Expression:
        """The symbols as a column."""
        return ca.vertcat(*[v.symbol for v in self.variables])

    def named(self, point: Array) -> dict[str, float]:
        """Return the variables in SI by name."""
        values = self.evaluate(ca.vertcat(*[v.value for v in self.variables]), point)
        return {v.name: float(value) for v, value in zip(self.variables, values, strict=True)}

    def chosen(self, point: Array) -> dict[str, float]:
        """Return the scaled values by name, without states and torque errors, which follow from them."""
        kept = self._chosen
        return {v.name: float(value) for v, value in zip(self.variables[:kept], point[:kept], strict=True)}

    @property
    def _chosen(self) -> int:
        """Number of variables from which the others follow."""
        return len(self.scalars) + (len(self.contour.all()) if self.contour else 0)

    def evaluate(self, expression: Expression, point: Array) -> Array:
        """Return the value of an expression of the variables."""
        return np.array(ca.Function("value", [self.vector], [expression])(point), dtype=float).ravel()

    def rms(self, point: Array) -> float:
        """Return the rms torque error in N·m at a point."""
        return float(np.sqrt(max(self.evaluate(self.design.mean_square_error, point)[0], 0.0)))

    def at(self, start: Start) -> Array:
        """Return the point where a search begins."""
        values = start_values(start, scalars=self.scalars, contour=self.contour, sizes=self.sizes)
        return self.completed(values)

    def completed(self, values: dict[str, float]) -> Array:
        """Return a point at which the equations of states and torque errors hold.

        ``values``: scaled values by name; what is missing starts as it does by itself.
        """
        point = np.array([values.get(v.name, v.start) for v in self.variables])
        if self.states.shape[0]:
            point[self._chosen : self._chosen + self.states.shape[0]] = self.evaluate(self.states, point)
        errors = self.structure[-1].expression / _ERROR_SCALE
        point[len(point) - errors.shape[0] :] += self.evaluate(errors, point)
        return point


def design_problem(
    model: FlatModel,
    cam: object,
    *,
    target: Target,
    free: Sequence[str],
    spring: str | None = None,
    rounding: float | tuple[float, Expression] = 0.0,
    symbols: SymbolicTarget | None = None,
) -> DesignProblem:
    """Write the design problem of a cam spring.

    ``free``: full names of what may change; the contour is ``<cam>.contour`` or ``<cam>.lever_arm``.
    ``spring``: path of the cam spring; decided from the structure if it is left out. ``rounding``: width over
    which knots are rounded, and with it, where it is one, the symbol that stands for it in the torque over
    the contour; goals see the number.
    """
    made = declared_cam(cam)
    sharp = law = elastic_law(model, spring)
    contour_is_free, numbers = _split(model, free, law.cam)
    arm, stretch, profile = _sizes(law, target if symbols is None else symbols.sized_for)
    end = ca.SX(target.last_angle) if symbols is None else symbols.last_angle
    share, width = rounding if isinstance(rounding, tuple) else (rounding, None)
    if share > 0.0:
        law = law.without_knots(2.0 * stretch, share)
    scalars = {number.name: scalar(number, 0.3 * stretch) for number in numbers}
    parameters = {
        v.name: scalars[v.name].value if v.name in scalars else ca.SX(v.start) for v in model.parameters
    }
    contour: FreeContour | None = None
    if not contour_is_free:
        shape = given(model, cam, target.last_angle, law.cam.drive)
    else:
        ends = (target.last_angle, end)
        contour, shape = free_shape(made.through_centre, parameters, names=law.cam, ends=ends, arm=arm)
    anchor = law.cam.anchor_distance
    largest = math.inf if anchor is None else _NEAREST_START * model.values[anchor]
    base = 0.0 if law.cam.rolling is None else model.values[law.cam.rolling.base]
    sizes = StartSizes(arm, stretch, law.cam.pretension, largest, profile, base)
    called = law if width is None else sharp.without_knots(2.0 * stretch, width)
    everything = ca.vertcat(*[parameters[v.name] for v in law.parameters])

    def stretched(extension: Expression) -> Stretched:
        more = [] if width is None else [width]
        return Stretched(*called.function.call([extension, everything, *more]))

    return _lifted(
        DesignProblem(
            law=law,
            variables=(*scalars.values(), *(contour.all() if contour else ()), *shape.states),
            design=_design(model, law, target, shape, parameters, stretched),
            structure=shape.rows,
            scalars=tuple(scalars.values()),
            contour=contour,
            sizes=sizes,
            states=shape.state_values,
        )
    )


def contour_names(cam: CamNames) -> tuple[str, str]:
    """Return the two names by which the contour of a cam is called free."""
    return cam.contour, f"{cam.name}.lever_arm"


def movable_numbers(model: FlatModel, cam: CamNames) -> dict[str, Variable]:
    """Return the single numbers that a design may change, by name."""
    ratios = [body.motor.gear_ratio for body in model.bodies if body.motor is not None]
    base = [] if cam.rolling is None else [cam.rolling.base]
    names = [*cam.numbers, cam.anchor_distance, *base, *ratios]
    return {name: model.variable(name) for name in names if name is not None}


def _split(model: FlatModel, free: Sequence[str], cam: CamNames) -> tuple[bool, list[Variable]]:
    contours, movable = contour_names(cam), movable_numbers(model, cam)
    for name in free:
        if name == cam.elements:
            raise ValueRangeError(
                f"free: '{name}'", "is a whole number, which no derivative leads to",
                next_step=f"offer the numbers to choose from: Stock('{name}', (1, 2, 3))",
            )  # fmt: skip
        if name not in movable and name not in contours:
            raise _not_movable(name, model, [*contours, *movable])
    if not free:
        raise ValueRangeError(
            "free = []", "nothing may change", next_step=f"free for instance '{contours[0]}'"
        )
    contour_is_free = any(name in free for name in contours)
    if cam.anchor_distance in free and not contour_is_free:
        raise ValueRangeError(
            f"free: '{cam.anchor_distance}'",
            "the anchor shapes the contour, so it can only be free together with it",
            next_step=f"free '{contours[0]}' too",
        )
    # The distance of what rolls on a cam is chosen with its contour.
    base = [cam.rolling.base] if cam.rolling is not None and contour_is_free else []
    return contour_is_free, [v for name, v in movable.items() if name in (*free, *base)]


def _not_movable(name: str, model: FlatModel, movable: Sequence[str]) -> NlsError:
    """Return the error on a name that cannot be free: it does not exist, or a design cannot change it."""
    if name not in {v.name for v in model.parameters}:
        return unknown_name("free", name, movable)
    return ValueRangeError(
        f"free: '{name}'", "exists, but a design cannot change it",
        next_step=f"free one of: {', '.join(movable)}; set other numbers in the deck, or sweep them",
    )  # fmt: skip


def _sizes(law: ElasticLaw, target: Target) -> tuple[float, float, Array]:
    """Return a typical lever arm and stretch, and the wanted torque at the nodes relative to the largest.

    Those of the closed form, or of a wheel where there is none.
    """
    elements = {v.name: v.start for v in law.parameters}[law.cam.elements]
    nodes = np.linspace(0.0, 1.0, INTERVALS + 1)
    try:
        profile = closed_form(law, target, elements=elements, points=21)
    except InfeasibleError:
        # The rubber as it is cannot store the energy; what is free may change that.
        return 0.01, 0.01 * target.last_angle, nodes
    wanted = np.interp(nodes * profile.angles[-1], profile.angles, profile.torques / target.largest)
    arm = float(np.clip(profile.lever_arms.max(), 1e-4, 0.2))
    return arm, float(profile.extensions.max()), wanted


def _lifted(problem: DesignProblem) -> DesignProblem:
    """Return the problem with the torque errors as variables of their own, held by equations.

    The square of an error that nearly vanishes along a curve (rubber, pretension and contour can
    replace each other) is what Newton's method finds hard; with the errors lifted out the cost is quadratic.
    """
    design = problem.design
    scale = 1e-3 * design.target.largest
    # Where the cable passes through the centre there is neither torque nor error at angle zero.
    first = 1 if ca.SX(design.lever_arms[0]).is_zero() else 0
    errors = design.torque_errors[first:] / scale
    symbols = ca.SX.sym("torque_error", errors.shape[0])
    lifted = tuple(
        DesignVariable(f"torque_error[{i + first}]", symbols[i], scale * symbols[i], -math.inf, math.inf, 0.0)
        for i in range(errors.shape[0])
    )
    return replace(
        problem,
        variables=problem.variables + lifted,
        design=replace(design, torque_errors=ca.vertcat(ca.SX.zeros(first), scale * symbols)),
        structure=(*problem.structure, Rows(_ERROR_SCALE * (errors - symbols), 0.0, 0.0)),
    )


def _design(
    model: FlatModel,
    law: ElasticLaw,
    target: Target,
    shape: Shape,
    parameters: dict[str, Expression],
    element: Callable[[Expression], Stretched],
) -> DesignPoint:
    cam = law.cam
    stretched = parameters[cam.pretension] + shape.extensions
    columns = [element(stretched[i]) for i in range(stretched.shape[0])]
    strains = ca.horzcat(*[column.strains for column in columns])
    stresses = ca.horzcat(*[column.stresses for column in columns])
    forces = ca.vertcat(*[column.force for column in columns])
    wanted = ca.vertcat(*[target.torque_law(shape.angles[i]) for i in range(shape.angles.shape[0])])
    return DesignPoint(
        cam=cam,
        target=target,
        angles=shape.angles,
        directions=shape.directions,
        lever_arms=shape.lever_arms,
        lever_arm_slopes=shape.lever_arm_slopes,
        radii_of_curvature=shape.radii_of_curvature,
        radii=shape.radii,
        edge=shape.edge,
        extensions=stretched,
        forces=forces,
        stiffnesses=ca.vertcat(*[column.stiffness for column in columns]),
        strains={path: strains[i, :].T for i, path in enumerate(law.specimens)},
        stresses={path: stresses[i, :].T for i, path in enumerate(law.specimens)},
        coil_rows=ca.horzcat(*[column.coils for column in columns]),
        torque_errors=parameters[cam.elements] * shape.lever_arms * forces - wanted,
        parameters=parameters,
        element=element,
        through_centre=shape.through_centre,
        shown_units={v.name: _SHOWN.get(v.unit, v.unit) for v in law.parameters},
        model=model,
        law=law,
    )
