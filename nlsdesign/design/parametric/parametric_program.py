"""One nonlinear program for all questions of one structure, solved from where the last one ended.

Points of the target are parameters; numbers of limits are bounds of rows; numbers that are held are variables
whose bounds meet. So a question changes numbers only: the derivatives stand, and the interior point method
begins beside the last solution, with its multipliers. Where no design keeps all limits, the same program with
a slack for each says which of them contradict each other.
"""

from __future__ import annotations

import functools
import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from functools import cached_property
from typing import Any, NamedTuple, cast

import casadi as ca
import numpy as np
import scipy

from ...foundation.arrays import Array
from ...foundation.symbolic import Expression
from ..curves.target import TabulatedTorque, Target
from ..optimisation.limits import Bound, limit_kinds
from ..optimisation.problem import SymbolicTarget, design_problem
from ..optimisation.program import (
    PROVED_INFEASIBLE,
    SOLVED,
    DesignVariable,
    VariableScale,
    interior_point,
    scale_of,
    scaled,
)
from ..optimisation.shape import ContourVariables, start_values, starts
from ..optimisation.solve import GOALS
from ..statics.equilibrium import elastic_law, has_corners
from .cam_question import CamQuestion


class MovableTarget:
    """The curve of :class:`~nlsdesign.design.TabulatedTorque` with its pieces as symbols.

    It has what the design problem asks of a target, and is none itself: it has no numbers.

    ``pieces``: number of pieces between the points. ``last_angle``: in rad, from which bounds and starts of
    variables follow.
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


@functools.lru_cache(maxsize=8)
def _numbers_of(target: TabulatedTorque) -> Array:
    """Return the numbers of the symbols for a curve with as many pieces.

    It is the same array where it is asked for again, so it cannot be changed.
    """
    curve = scipy.interpolate.PchipInterpolator(target.angles, target.torques)
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

    ``question``: one of its questions, whose sizes scale the variables.
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
        # Machines whose cam has a roller are refused by the question.
        self.contour = cast(ContourVariables | None, self.problem.contour)
        design = self.problem.design
        kept: list[Bound] = []
        watched: list[Bound] = []
        for each in question.limit_values.values():
            bounds = each.kind.limit(each.value).bounds(design)
            (kept if question.keeps(each.kind.name) else watched).extend(bounds)
        self.bounds: tuple[Bound, ...] = tuple(kept)
        self.shown_bounds: tuple[Bound, ...] = (*kept, *watched)
        self.cost = sum((goal.cost(design) for goal in GOALS), start=ca.SX(0))
        parameters = self.numbers_of(question)
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
        return _numbers_of(question.target)

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


MOST_ITERATIONS = 120
"""Iterations at most of a search from a start."""
_LOOSE: dict[str, Any] = {"tol": 1e-9, "acceptable_tol": 1e-7}
_NONE: Array = np.zeros(0)


class SearchPoint(NamedTuple):
    """Where a search begins or ended: unknowns and, where they are known, multipliers of one program."""

    unknowns: Array
    of_bounds: Array = _NONE
    of_rows: Array = _NONE


@dataclass(frozen=True, eq=False)
class SearchOutcome:
    """What a search came to."""

    state: str  # "solved", "infeasible" or "not solved"
    words: str  # of the solver, or what is in conflict
    point: SearchPoint | None = None  # where it is solved
    cost: float = math.inf  # sum of the goals
    conflicts: tuple[str, ...] = ()  # names of the limits that contradict each other
    # room: what each row of a limit gave where all limits count as kept: rounding leaves a limit that binds
    # at a held contour beyond its number by some parts in a thousand million
    room: Array | float = 0.0


class ProgramOutputs:
    """What follows from the unknowns of one program."""

    def __init__(self, rows: ProgramRows) -> None:
        self._rows = rows

    def columns(self, unknowns: Array, question: CamQuestion) -> dict[str, Array]:
        """Return curves, sums and values of the limits by name."""
        names, function = self._columns
        columns = function(unknowns, self._rows.numbers_of(question))
        return {name: np.array(c, dtype=float).ravel() for name, c in zip(names, columns, strict=True)}

    def chosen_values(self, unknowns: Array) -> dict[str, float]:
        """Return sizes and variables of the contour in SI by name."""
        values = np.array(self._in_si(unknowns)).ravel()
        return {v.name: float(value) for v, value in zip(self._rows.chosen, values, strict=True)}

    def scaled_values(self, values: Mapping[str, float]) -> dict[str, float]:
        """Return values in SI as this program scales them, those that it knows."""
        return {v.name: self._rows.scaled(v, values[v.name]) for v in self._rows.chosen if v.name in values}

    @cached_property
    def _in_si(self) -> ca.Function:
        values = ca.vertcat(*[v.value for v in self._rows.chosen])
        return ca.Function("chosen", [self._rows.problem.vector], [values])

    @cached_property
    def _columns(self) -> tuple[tuple[str, ...], ca.Function]:
        """Names, and the function of unknowns and numbers of the target that gives their values."""
        problem, target = self._rows.problem, self._rows.target
        design, contour = problem.design, self._rows.contour
        wanted = [target.torque_law(design.angles[i]) for i in range(design.angles.shape[0])]
        columns = {
            "angle": design.angles, "direction": design.directions, "lever_arm": design.lever_arms,
            "radius": design.radii, "radius_of_curvature": design.radii_of_curvature,
            "torque": design.torques, "wanted": ca.vertcat(*wanted), "stiffness": design.tangent_stiffness,
            "extension": design.extensions, "force": design.forces,
            "strains": ca.vertcat(*design.strains.values()),
            "stresses": ca.vertcat(*design.stresses.values()),
            "mean_square": design.mean_square_error, "volume": design.rubber_volume,
            "sizes": ca.vertcat(*[v.value for v in problem.scalars]),
            "first_slope": ca.SX(0) if contour is None else contour.first_slope.value,
            **{f"bound {i}": bound.expression for i, bound in enumerate(self._rows.shown_bounds)},
        }  # fmt: skip
        given, values = [problem.vector, target.symbols], [ca.SX(each) for each in columns.values()]
        return tuple(columns), ca.Function("outputs", given, values)


_INVOLVED = 1e-3
"""Price from which a limit counts as part of a conflict, as in the whole design."""
_KEPT = 1e-6
"""Relative give below which a limit counts as kept."""


class SoftenedProgram:
    """The program of one structure with limits that give."""

    def __init__(self, rows: ProgramRows) -> None:
        self._rows = rows

    def conflict(self, question: CamQuestion, begin: Array) -> SearchOutcome:
        """Find out whether any cam keeps all limits, and which are in conflict where none does."""
        rows = self._rows
        count = len(rows.bounds)
        if not count:
            return SearchOutcome("not solved", "the solver found no design, and there is no limit to widen")
        low, high = rows.ranges_of(question)
        rows_low, rows_high = rows.limits_of(question)
        # A give counts relative to the limit as it is now, not as it was when the program was made.
        price = rows.scales / np.array([abs(value) or 1.0 for value in rows.values_of(question)[:count]])
        answer = self._softened(
            x0=np.concatenate([begin, np.full(count, 0.1)]),
            p=np.concatenate([rows.numbers_of(question), price]),
            lbx=np.concatenate([low, np.zeros(count)]), ubx=np.concatenate([high, np.full(count, 1e3)]),
            lbg=rows_low, ubg=rows_high,
        )  # fmt: skip
        point, status = np.array(answer["x"]).ravel(), str(self._softened.stats()["return_status"])
        if status not in SOLVED or not np.all(np.isfinite(point)):
            return SearchOutcome("not solved", f"the solver stopped with '{status}'")
        gives = point[len(point) - count :]
        if float(gives @ price) <= _KEPT * count:
            return SearchOutcome("solved", "", SearchPoint(point[:-count]), room=gives)
        sizes = [row.expression.shape[0] for row in rows.problem.structure]
        sizes += [bound.expression.shape[0] for bound in rows.bounds]
        groups = np.split(np.abs(np.array(answer["lam_g"]).ravel()), np.cumsum(sizes)[:-1])
        limits = groups[len(rows.problem.structure) :]
        involved = [i for i, each in enumerate(limits) if np.max(each, initial=0.0) > _INVOLVED * price[i]]
        return SearchOutcome(
            "infeasible", self._words(question, involved, gives),
            conflicts=tuple(dict.fromkeys(rows.bounds[i].limit for i in involved)),
        )  # fmt: skip

    @cached_property
    def _softened(self) -> ca.Function:
        return interior_point("softened", self.program, iterations=MOST_ITERATIONS, **_LOOSE)

    @cached_property
    def program(self) -> dict[str, ca.SX]:
        """The program with a slack for each limit; their sum, relative to the limits, is made small."""
        problem, bounds = self._rows.problem, self._rows.bounds
        slacks, prices = ca.SX.sym("slack", len(bounds)), ca.SX.sym("price", len(bounds))
        rows = [row.expression for row in problem.structure]
        for i, row in enumerate(self._rows.limit_rows):
            rows.append(row + (-slacks[i] if bounds[i].upper else slacks[i]))
        return {
            "x": ca.vertcat(problem.vector, slacks),
            "f": ca.dot(slacks, prices),
            "g": ca.vertcat(*rows),
            "p": ca.vertcat(self._rows.target.symbols, prices),
        }

    def _words(self, question: CamQuestion, involved: Sequence[int], gives: Array) -> str:
        bounds = self._rows.bounds
        kinds = [limit_kinds()[name] for name in dict.fromkeys(bounds[i].limit for i in involved)]
        rule = "contradict each other" if len(kinds) > 1 else "cannot be kept with what is free"
        limits, values = question.limit_values, self._rows.values_of(question)
        needed = []
        for i in involved:
            bound, give = bounds[i], float(gives[i] * self._rows.scales[i])
            if gives[i] > _KEPT:
                moved = values[i] + give if bound.upper else values[i] - give
                kind = limit_kinds()[bound.limit]
                needed.append(f"{kind.title} from {kind.shown(values[i])} to about {kind.shown(moved)}")
        names = [f"{kind.title} ({kind.shown(limits[kind.name].value)})" for kind in kinds]
        words = f"{' and '.join(names)} {rule}"
        return words + (f"; it would be enough to move {' and '.join(needed)}" if needed else "")


_WARM = 20
"""Iterations at most of a search with the last multipliers; where they do not help one without takes over."""
_AGAIN = 45
"""Iterations at most of a search from the last design without its multipliers."""
_STARTS = 4
_BESIDE: dict[str, Any] = {
    **_LOOSE,
    "warm_start_init_point": "yes",
    "mu_init": 1e-5,
    # Measured over drags of five decks: with the usual rule a flat optimum takes 50 iterations, with this 5.
    "mu_strategy": "adaptive",
    **{
        f"warm_start_{each}": 1e-8
        for each in ("bound_push", "bound_frac", "slack_bound_push", "slack_bound_frac", "mult_bound_push")
    },
}


class ParametricProgram:
    """The program of one structure: see :func:`~.quick_rows.structure_of`.

    ``question``: one of its questions, whose sizes scale the variables.
    """

    def __init__(self, question: CamQuestion) -> None:
        self.rows = ProgramRows(question)
        self.outputs = ProgramOutputs(self.rows)
        self.softened = SoftenedProgram(self.rows)

    @cached_property
    def _cold(self) -> ca.Function:
        return interior_point("quick", self.rows.program, iterations=MOST_ITERATIONS, **_LOOSE)

    @cached_property
    def _warm(self) -> ca.Function:
        return interior_point("beside", self.rows.program, iterations=_WARM, beside=self._cold, **_BESIDE)

    @cached_property
    def _again(self) -> ca.Function:
        options = {**_LOOSE, "mu_strategy": "adaptive"}
        return interior_point("again", self.rows.program, iterations=_AGAIN, beside=self._cold, **options)

    def prepare(self) -> None:
        """Make the derivatives, which takes some tenths of a second."""
        _ = self._cold, self._warm, self._again

    def from_starts(self, question: CamQuestion) -> SearchOutcome:
        """Return the best solution from the starts that are always taken."""
        best: SearchOutcome | None = None
        problem = self.rows.problem
        for start in starts(_STARTS, 1, []):
            values = start_values(
                start, scalars=problem.scalars, contour=problem.contour, sizes=problem.sizes
            )
            outcome = self._solved(self._cold, question, SearchPoint(self.rows.completed(question, values)))
            if best is None or (outcome.state == "solved", -outcome.cost) > (
                best.state == "solved",
                -best.cost,
            ):
                best = outcome
            if problem.contour is None and best.state == "solved":
                break
        assert best is not None
        return best

    def beside(self, question: CamQuestion, last: SearchPoint) -> SearchOutcome:
        """Return the solution beside the last one."""
        return self._solved(self._warm, question, last)

    def from_point(self, question: CamQuestion, point: SearchPoint, room: Array | float) -> SearchOutcome:
        """Return the solution from unknowns that keep all limits, as far as they do there."""
        return self._solved(self._cold, question, point, room)

    def from_values(self, question: CamQuestion, values: Mapping[str, float]) -> SearchOutcome:
        """Return the solution from scaled values of another program or design."""
        point = SearchPoint(self.rows.completed(question, values))
        return self._solved(self._again, question, point)

    def _solved(
        self, solver: ca.Function, question: CamQuestion, begin: SearchPoint, room: Array | float = 0.0
    ) -> SearchOutcome:
        low, high = self.rows.ranges_of(question)
        rows_low, rows_high = self.rows.limits_of(question, room)
        given: dict[str, Any] = {"x0": np.clip(begin.unknowns, low, high)}
        if len(begin.of_rows) == len(rows_low):
            given |= {"lam_x0": begin.of_bounds, "lam_g0": begin.of_rows}
        numbers = self.rows.numbers_of(question)
        answer = solver(p=numbers, lbx=low, ubx=high, lbg=rows_low, ubg=rows_high, **given)
        status = str(solver.stats()["return_status"])
        point = SearchPoint(*(np.array(answer[key]).ravel() for key in ("x", "lam_x", "lam_g")))
        cost = float(answer["f"])
        finite = bool(np.all(np.isfinite(point.unknowns)) and math.isfinite(cost))
        if finite and status in SOLVED:
            return SearchOutcome("solved", "", point, cost)
        state = "infeasible" if status == PROVED_INFEASIBLE else "not solved"
        return SearchOutcome(state, f"the solver stopped with '{status}'", point if finite else None)
