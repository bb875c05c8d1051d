"""Unknowns, rows and parameters of the program of one structure.

Points of the target are parameters; numbers of limits are bounds of rows; numbers that are held are variables
whose bounds meet. So a question changes numbers only, and all expressions stand.
"""

from __future__ import annotations

import functools
import math
from collections.abc import Mapping
from functools import cached_property
from typing import Any, cast

import casadi as ca
import numpy as np
from scipy.interpolate import PchipInterpolator

from ...foundation.arrays import Array
from ...foundation.symbolic import Expression
from ..curves.target import TabulatedTorque, Target
from ..optimisation.limits import Bound
from ..optimisation.problem import SymbolicTarget, design_problem
from ..optimisation.program import DesignVariable, VariableScale, scale_of, scaled
from ..optimisation.solve import GOALS
from ..statics.equilibrium import elastic_law
from ..statics.rounding import has_corners
from .cam_question import CamQuestion


class MovableTarget:
    """The curve of :class:`~nlsdesign.design.TabulatedTorque` with its pieces as symbols.

    It has what the design problem asks of a target, and is none itself: it has no numbers.

    Parameters
    ----------
    pieces
        Number of pieces between the points.
    last_angle
        In rad, from which bounds and starts of variables follow.
    """

    def __init__(self, pieces: int, last_angle: float) -> None:
        self.symbols = ca.SX.sym("target", 5 * pieces + 3)
        self._breaks = self.symbols[: pieces + 1]
        self._rows = ca.reshape(self.symbols[pieces + 1 : 5 * pieces + 1], 4, pieces)
        self.largest: Expression = self.symbols[5 * pieces + 1]
        self._energy: Expression = self.symbols[5 * pieces + 2]
        self.end: Expression = self._breaks[pieces]
        self._pieces = pieces
        self.last_angle = last_angle

    def energy(self, angle: float) -> Expression:
        """Return the energy below the whole curve."""
        return self._energy

    def torque_law(self, angle: Expression) -> Expression:
        """Return the torque; beyond the ends the outer pieces go on."""
        passed = [angle >= self._breaks[k] for k in range(1, self._pieces)]

        def picked(row: Expression) -> Expression:
            steps = [there * (row[k + 1] - row[k]) for k, there in enumerate(passed)]
            return sum(steps, start=row[0])

        local, result = angle - picked(self._breaks), ca.SX(0)
        for row in range(4):
            result = result * local + picked(self._rows[row, :])
        return result

    def weight_law(self, angle: Expression) -> Expression:
        """Return one: the error counts alike everywhere."""
        return 0.0 * angle + 1.0

    def numbers(self, target: TabulatedTorque) -> Array:
        """Return the numbers of the symbols for a curve with as many pieces."""
        return _numbers_of(target)


@functools.lru_cache(maxsize=8)
def _numbers_of(target: TabulatedTorque) -> Array:
    """Return the numbers of a curve; the same array where it is asked for again, so it cannot be changed."""
    curve = PchipInterpolator(target.angles, target.torques)
    # The curve is monotone between its points, so the largest torque is that of a point.
    ends = [max(target.torques), float(curve.integrate(0.0, target.last_angle))]
    numbers: Array = np.concatenate([curve.x, curve.c.T.ravel(), ends])
    numbers.flags.writeable = False
    return numbers


ROUNDING = 0.003
"""Width over which knots of a rubber's law are rounded, relative to its stretch, as a design begins."""
_RESCALED = 8.0
"""Factor of torque times angle from which the variables are scaled anew."""


class ProgramRows:
    """Unknowns, rows and parameters of one structure: see :func:`structure_of`.

    Parameters
    ----------
    question
        One of its questions, whose sizes scale the variables.
    """

    def __init__(self, question: CamQuestion) -> None:
        machine, cam = question.machine, question.cam
        # Held here: structures are told apart by the identity of their machine.
        self.machine = machine
        self._size = question.target_size * question.target.last_angle
        self.target = MovableTarget(len(question.target.angles) - 1, question.target.last_angle)
        contour = [question.contour] if question.contour in question.free else []
        sizes = [name for name in machine.sizes if contour or name != cam.anchor_distance]
        knots = has_corners(elastic_law(machine.model, cam.drive).function)
        self.problem = design_problem(
            machine.model,
            machine.cam_part,
            target=cast(Target, self.target),
            free=[*contour, *sizes],
            spring=cam.drive,
            rounding=ROUNDING if knots else 0.0,
            symbols=SymbolicTarget(question.target, self.target.end),
        )
        design = self.problem.design
        kept: list[Bound] = []
        watched: list[Bound] = []
        for each in question.limit_values.values():
            bounds = each.kind.limit(each.value).bounds(design)
            (kept if question.keeps(each.kind.name) else watched).extend(bounds)
        self.bounds: tuple[Bound, ...] = tuple(kept)
        self.shown_bounds: tuple[Bound, ...] = (*kept, *watched)
        self.cost = sum((goal.cost(design) for goal in GOALS), start=ca.SX(0))
        parameters = self.target.numbers(question.target)
        scales = ca.vertcat(*[bound.scale for bound in self.bounds])
        self.scales = np.array(ca.Function("scales", [self.target.symbols], [scales])(parameters)).ravel()
        self._names = [v.name for v in self.problem.variables]
        # Sizes and variables of the contour.
        of_contour = self.problem.contour.all() if self.problem.contour else ()
        self.chosen: list[DesignVariable] = [*self.problem.scalars, *of_contour]

    @cached_property
    def limit_rows(self) -> list[ca.SX]:
        """Rows of the limits that are kept, each relative to its scale."""
        return [bound.expression / scale for bound, scale in zip(self.bounds, self.scales, strict=True)]

    @cached_property
    def program(self) -> dict[str, Any]:
        """The nonlinear program: unknowns, cost, rows and parameters."""
        held = [row.expression for row in self.problem.structure]
        return {
            "x": self.problem.vector,
            "f": self.cost,
            "g": ca.vertcat(*held, *self.limit_rows),
            "p": self.target.symbols,
        }

    def fits(self, question: CamQuestion) -> bool:
        """Tell whether the variables are scaled for a target as large as that of a question."""
        ratio = question.target_size * question.target.last_angle / self._size
        return 1.0 / _RESCALED < ratio < _RESCALED

    def limits_of(self, question: CamQuestion, room: Array | float = 0.0) -> tuple[Array, Array]:
        """Return the bounds of the rows.

        ``room``: by which each kept limit is wider, relative to its scale; the same for all, or one for each.
        """
        low = [np.full(row.expression.shape[0], row.lower) for row in self.problem.structure]
        high = [np.full(row.expression.shape[0], row.upper) for row in self.problem.structure]
        rooms = np.broadcast_to(room, len(self.bounds))
        values = zip(self.bounds, self.values_of(question), self.scales, rooms, strict=False)
        for bound, value, scale, give in values:
            size, at = bound.expression.shape[0], value / scale + (give if bound.upper else -give)
            low.append(np.full(size, -np.inf if bound.upper else at))
            high.append(np.full(size, at if bound.upper else np.inf))
        return np.concatenate(low), np.concatenate(high)

    def values_of(self, question: CamQuestion) -> list[float]:
        """Return the number of each bound, the kept ones first, as a question has it."""
        return [question.limit_values[bound.limit].value for bound in self.shown_bounds]

    def ranges_of(self, question: CamQuestion) -> tuple[Array, Array]:
        """Return the bounds of the variables: what is held has no room."""
        low = np.array([v.lower for v in self.problem.variables])
        high = np.array([v.upper for v in self.problem.variables])
        numbers = question.numbers
        for i, variable in enumerate(self.problem.scalars):
            state = numbers[variable.name]
            ends = (state.minimum, state.maximum) if state.free else (state.value, state.value)
            low[i], high[i] = (
                self.scaled(variable, end) if math.isfinite(end) else natural
                for end, natural in zip(ends, (low[i], high[i]), strict=True)
            )
        if "last_direction" in self._names:
            at, last = self._names.index("last_direction"), question.target.last_angle
            low[at], high[at] = last, last + math.pi / 2
        return low, high

    def scaled(self, variable: DesignVariable, value: float) -> float:
        """Return the symbol's value at which a variable has a value in SI, within its range."""
        return scaled(variable, value, self._scales_of_variables[variable.name])

    @cached_property
    def _scales_of_variables(self) -> dict[str, VariableScale]:
        return {variable.name: scale_of(variable) for variable in self.chosen}

    def numbers_of(self, question: CamQuestion) -> Array:
        """Return the numbers of the target."""
        return self.target.numbers(question.target)

    def completed(self, question: CamQuestion, values: Mapping[str, float]) -> Array:
        """Return the unknowns that follow from some of them, with held numbers as the question has them."""
        low, high = self.ranges_of(question)
        parameters = self.numbers_of(question)
        wanted = [values.get(v.name, v.start) for v in self.problem.variables]
        point: Array = np.clip(np.array(wanted), low, high)
        states, errors = self.problem.states.shape[0], self.problem.structure[-1].expression.shape[0]
        first = len(point) - errors - states
        follows, misses = self._following
        if states:
            point[first : first + states] = np.array(follows(point, parameters)).ravel()
        point[len(point) - errors :] += np.array(misses(point, parameters)).ravel()
        return point

    @cached_property
    def _following(self) -> tuple[ca.Function, ca.Function]:
        given = [self.problem.vector, self.target.symbols]
        errors = self.problem.structure[-1].expression / 0.01
        return ca.Function("states", given, [self.problem.states]), ca.Function("errors", given, [errors])


def structure_of(question: CamQuestion) -> tuple[Any, ...]:
    """Return what two questions must share for one program: equal keys, one program."""
    free, target = question.contour in question.free, question.target
    return (
        id(question.machine),
        free,
        len(target.angles),
        None if free else target.last_angle,
        tuple(question.limit_values),
    )
