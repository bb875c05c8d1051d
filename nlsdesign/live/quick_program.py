"""One nonlinear program for all questions of one structure, solved from where the last one ended.

Points of the target are parameters; numbers of limits are bounds of rows; numbers that are held are variables
whose bounds meet. So a drag changes numbers only: the derivatives stand, and the interior point method begins
beside the last solution, with its multipliers.
"""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from functools import cached_property
from typing import Any, NamedTuple, cast

import casadi as ca
import numpy as np
from numpy.typing import NDArray

from ..design import Target
from ..design.optimisation.limits import Bound
from ..design.optimisation.problem import design_problem
from ..design.optimisation.program import PROVED_INFEASIBLE
from ..design.optimisation.solve import GOALS
from ..design.optimisation.starts import start_values, starts
from ..design.optimisation.variables import scaled
from ..design.statics.equilibrium import elastic_law
from ..design.statics.rounding import has_corners
from .movable_target import MovableTarget
from .question import LiveQuestion

Floats = NDArray[np.float64]

ROUNDING = 0.003
"""Width over which knots of a rubber's law are rounded, relative to its stretch, as a design begins."""
_COLD = 120
"""Iterations at most of a search from a start."""
_WARM = 20
"""Iterations at most of a search with the last multipliers; where they do not help one without takes over."""
_AGAIN = 45
"""Iterations at most of a search from the last design without its multipliers."""
_STARTS = 4
_RESCALED = 8.0
"""Factor of torque times angle from which the variables are scaled anew."""
_INVOLVED = 1e-3
"""Price from which a limit counts as part of a conflict, as in the whole design."""
_KEPT = 1e-6
"""Relative give below which a limit counts as kept."""
_SOLVED = ("Solve_Succeeded", "Solved_To_Acceptable_Level")
_COMMON: dict[str, Any] = {
    "print_time": False,
    "error_on_fail": False,
    "show_eval_warnings": False,
    "ipopt.print_level": 0,
    "ipopt.sb": "yes",
    "ipopt.tol": 1e-9,
    "ipopt.acceptable_tol": 1e-7,
    "ipopt.honor_original_bounds": "yes",
    "ipopt.mumps_permuting_scaling": 0,
    "ipopt.mumps_scaling": 0,
}
_BESIDE: dict[str, Any] = {
    "ipopt.warm_start_init_point": "yes",
    "ipopt.mu_init": 1e-5,
    # Measured over drags of five decks: with the usual rule a flat optimum takes 50 iterations, with this 5.
    "ipopt.mu_strategy": "adaptive",
    **{
        f"ipopt.warm_start_{each}": 1e-8
        for each in ("bound_push", "bound_frac", "slack_bound_push", "slack_bound_frac", "mult_bound_push")
    },
}


class QuickPoint(NamedTuple):
    """Where a search ended: unknowns and multipliers of one program."""

    unknowns: Floats
    of_bounds: Floats
    of_rows: Floats


@dataclass(frozen=True, eq=False)
class QuickOutcome:
    """What a search came to.

    Parameters
    ----------
    state
        ``"solved"``, ``"infeasible"`` or ``"not solved"``.
    words
        Of the solver, or what is in conflict.
    point
        Where it is solved.
    cost
        Sum of the goals.
    conflicts
        Names of the limits that contradict each other.
    """

    state: str
    words: str
    point: QuickPoint | None = None
    cost: float = math.inf
    conflicts: tuple[str, ...] = ()


class QuickProgram:
    """The program of one structure: see :func:`structure_of`.

    Parameters
    ----------
    question
        One of its questions, whose sizes scale the variables.
    """

    def __init__(self, question: LiveQuestion) -> None:
        machine, cam = question.machine, question.cam
        self.machine = machine
        self._size = question.target_size * question.target.last_angle
        self.target = MovableTarget(len(question.target.angles) - 1, question.target.last_angle)
        contour = [question.contour] if question.contour in question.free else []
        sizes = [name for name in machine.sizes if contour or name != cam.anchor_distance]
        knots = has_corners(elastic_law(machine.model, cam.drive).function)
        self.problem = design_problem(
            machine.model,
            machine.assembly[cam.name],
            target=cast(Target, self.target),
            free=[*contour, *sizes],
            spring=cam.drive,
            rounding=ROUNDING if knots else 0.0,
            sized_for=question.target,
        )
        design = self.problem.design
        kept: list[Bound] = []
        watched: list[Bound] = []
        for each in question.limit_values.values():
            bounds = each.kind.limit(each.value).bounds(design)
            (kept if question.keeps(each.kind) else watched).extend(bounds)
        self.bounds: tuple[Bound, ...] = tuple(kept)
        self.shown_bounds: tuple[Bound, ...] = (*kept, *watched)
        self.cost = sum((goal.cost(design) for goal in GOALS), start=ca.SX(0))
        parameters = self.target.numbers(question.target)
        scales = ca.vertcat(*[bound.scale for bound in self.bounds])
        self._scales = np.array(ca.Function("scales", [self.target.symbols], [scales])(parameters)).ravel()
        self._names = [v.name for v in self.problem.variables]

    @cached_property
    def _rows(self) -> ca.SX:
        held = [row.expression for row in self.problem.structure]
        return ca.vertcat(*held, *self._limit_rows)

    @property
    def _limit_rows(self) -> list[ca.SX]:
        return [bound.expression / scale for bound, scale in zip(self.bounds, self._scales, strict=True)]

    @cached_property
    def _nlp(self) -> dict[str, Any]:
        return {"x": self.problem.vector, "f": self.cost, "g": self._rows, "p": self.target.symbols}

    @cached_property
    def _cold(self) -> ca.Function:
        return ca.nlpsol("quick", "ipopt", self._nlp, {**_COMMON, "ipopt.max_iter": _COLD})

    @cached_property
    def _warm(self) -> ca.Function:
        return ca.nlpsol("beside", "ipopt", self._nlp, {**_COMMON, **_BESIDE, "ipopt.max_iter": _WARM})

    @cached_property
    def _again(self) -> ca.Function:
        options = {**_COMMON, "ipopt.mu_strategy": "adaptive", "ipopt.max_iter": _AGAIN}
        return ca.nlpsol("again", "ipopt", self._nlp, options)

    @cached_property
    def _softened(self) -> ca.Function:
        """The program with a slack for each limit; their sum, relative to the limits, is made small."""
        slacks, prices = ca.SX.sym("slack", len(self.bounds)), ca.SX.sym("price", len(self.bounds))
        rows = [row.expression for row in self.problem.structure]
        for i, row in enumerate(self._limit_rows):
            rows.append(row + (-slacks[i] if self.bounds[i].upper else slacks[i]))
        nlp = {
            "x": ca.vertcat(self.problem.vector, slacks),
            "f": ca.dot(slacks, prices),
            "g": ca.vertcat(*rows),
            "p": ca.vertcat(self.target.symbols, prices),
        }
        return ca.nlpsol("softened", "ipopt", nlp, {**_COMMON, "ipopt.max_iter": _COLD})

    def fits(self, question: LiveQuestion) -> bool:
        """Tell whether the variables are scaled for a target as large as that of a question.

        Parameters
        ----------
        question
            Of this structure.
        """
        ratio = question.target_size * question.target.last_angle / self._size
        return 1.0 / _RESCALED < ratio < _RESCALED

    def prepare(self) -> None:
        """Make the derivatives, which takes some tenths of a second."""
        _ = self._cold, self._warm, self._again

    def limits_of(self, question: LiveQuestion) -> tuple[Floats, Floats]:
        """Return the bounds of the rows.

        Parameters
        ----------
        question
            Of this structure.
        """
        low = [np.full(row.expression.shape[0], row.lower) for row in self.problem.structure]
        high = [np.full(row.expression.shape[0], row.upper) for row in self.problem.structure]
        for bound, value, scale in zip(self.bounds, self.values_of(question), self._scales, strict=False):
            size, at = bound.expression.shape[0], value / scale
            low.append(np.full(size, -np.inf if bound.upper else at))
            high.append(np.full(size, at if bound.upper else np.inf))
        return np.concatenate(low), np.concatenate(high)

    def values_of(self, question: LiveQuestion) -> list[float]:
        """Return the number of each bound, the kept ones first, as a question has it.

        Parameters
        ----------
        question
            Of this structure.
        """
        return [question.limit_values[bound.limit].value for bound in self.shown_bounds]

    def ranges_of(self, question: LiveQuestion) -> tuple[Floats, Floats]:
        """Return the bounds of the variables: what is held has no room.

        Parameters
        ----------
        question
            Of this structure.
        """
        low = np.array([v.lower for v in self.problem.variables])
        high = np.array([v.upper for v in self.problem.variables])
        numbers = question.numbers
        for i, variable in enumerate(self.problem.scalars):
            state = numbers[variable.name]
            ends = (state.minimum, state.maximum) if state.free else (state.value, state.value)
            low[i], high[i] = (
                scaled(variable, end) if math.isfinite(end) else natural
                for end, natural in zip(ends, (low[i], high[i]), strict=True)
            )
        if "last_direction" in self._names:
            at, last = self._names.index("last_direction"), question.target.last_angle
            low[at], high[at] = last, last + math.pi / 2
        return low, high

    def numbers_of(self, question: LiveQuestion) -> Floats:
        """Return the numbers of the target.

        Parameters
        ----------
        question
            Of this structure.
        """
        return self.target.numbers(question.target)

    def completed(self, question: LiveQuestion, values: Mapping[str, float]) -> Floats:
        """Return the unknowns that follow from some of them, with held numbers as the question has them.

        Parameters
        ----------
        question
            Of this structure.
        values
            Scaled values by name.
        """
        low, high = self.ranges_of(question)
        parameters = self.numbers_of(question)
        wanted = [values.get(v.name, v.start) for v in self.problem.variables]
        point: Floats = np.clip(np.array(wanted), low, high)
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

    def from_starts(self, question: LiveQuestion) -> QuickOutcome:
        """Return the best solution from the starts that are always taken.

        Parameters
        ----------
        question
            Of this structure.
        """
        best: QuickOutcome | None = None
        for start in starts(_STARTS, 1, []):
            values = start_values(
                start, scalars=self.problem.scalars, contour=self.problem.contour, sizes=self.problem.sizes
            )
            outcome = self._solved(
                self._cold, question, QuickPoint(self.completed(question, values), _NONE, _NONE)
            )
            if best is None or (outcome.state == "solved", -outcome.cost) > (
                best.state == "solved",
                -best.cost,
            ):
                best = outcome
            if self.problem.contour is None and best.state == "solved":
                break
        assert best is not None
        return best

    def from_point(self, question: LiveQuestion, point: QuickPoint) -> QuickOutcome:
        """Return the solution from unknowns that keep all limits.

        Parameters
        ----------
        question
            Of this structure.
        point
            Of this program.
        """
        return self._solved(self._cold, question, point)

    def from_values(self, question: LiveQuestion, values: Mapping[str, float]) -> QuickOutcome:
        """Return the solution from scaled values of another program or design.

        Parameters
        ----------
        question
            Of this structure.
        values
            By name.
        """
        point = QuickPoint(self.completed(question, values), _NONE, _NONE)
        return self._solved(self._again, question, point)

    def chosen_values(self, unknowns: Floats) -> dict[str, float]:
        """Return sizes and variables of the contour in SI by name.

        Parameters
        ----------
        unknowns
            Scaled.
        """
        kept = [*self.problem.scalars, *(self.problem.contour.all() if self.problem.contour else ())]
        values = np.array(self._in_si(unknowns)).ravel()
        return {v.name: float(value) for v, value in zip(kept, values, strict=True)}

    def scaled_values(self, values: Mapping[str, float]) -> dict[str, float]:
        """Return values in SI as this program scales them, those that it knows.

        Parameters
        ----------
        values
            In SI by name.
        """
        kept = [*self.problem.scalars, *(self.problem.contour.all() if self.problem.contour else ())]
        return {v.name: scaled(v, values[v.name]) for v in kept if v.name in values}

    @cached_property
    def _in_si(self) -> ca.Function:
        kept = [*self.problem.scalars, *(self.problem.contour.all() if self.problem.contour else ())]
        return ca.Function("chosen", [self.problem.vector], [ca.vertcat(*[v.value for v in kept])])

    @cached_property
    def outputs(self) -> ca.Function:
        """Function (unknowns, numbers of the target) -> what :attr:`output_names` says."""
        return ca.Function("outputs", [self.problem.vector, self.target.symbols], self._columns()[1])

    @cached_property
    def output_names(self) -> tuple[str, ...]:
        """Names of the columns of :attr:`outputs`."""
        return self._columns()[0]

    def _columns(self) -> tuple[tuple[str, ...], list[ca.SX]]:
        design, contour = self.problem.design, self.problem.contour
        wanted = [self.target.torque_law(design.angles[i]) for i in range(design.angles.shape[0])]
        columns = {
            "angle": design.angles, "direction": design.directions, "lever_arm": design.lever_arms,
            "radius": design.radii, "radius_of_curvature": design.radii_of_curvature,
            "torque": design.torques, "wanted": ca.vertcat(*wanted), "stiffness": design.tangent_stiffness,
            "extension": design.extensions, "force": design.forces,
            "strains": ca.vertcat(*design.strains.values()),
            "stresses": ca.vertcat(*design.stresses.values()),
            "mean_square": design.mean_square_error, "volume": design.rubber_volume,
            "sizes": ca.vertcat(*[v.value for v in self.problem.scalars]),
            "first_slope": ca.SX(0) if contour is None else contour.first_slope.value,
            **{f"bound {i}": bound.expression for i, bound in enumerate(self.shown_bounds)},
        }  # fmt: skip
        return tuple(columns), [ca.SX(each) for each in columns.values()]

    def beside(self, question: LiveQuestion, last: QuickPoint) -> QuickOutcome:
        """Return the solution beside the last one.

        Parameters
        ----------
        question
            Of this structure.
        last
            Of this program.
        """
        return self._solved(self._warm, question, last)

    def conflict(self, question: LiveQuestion, begin: Floats) -> QuickOutcome:
        """Find out whether any cam keeps all limits, and which are in conflict where none does.

        Parameters
        ----------
        question
            Of this structure.
        begin
            Unknowns.
        """
        count = len(self.bounds)
        if not count:
            return QuickOutcome("not solved", "the solver found no design, and there is no limit to widen")
        low, high = self.ranges_of(question)
        rows_low, rows_high = self.limits_of(question)
        # A give counts relative to the limit as it is now, not as it was when the program was made.
        price = self._scales / np.array([abs(value) or 1.0 for value in self.values_of(question)[:count]])
        answer = self._softened(
            x0=np.concatenate([begin, np.full(count, 0.1)]),
            p=np.concatenate([self.numbers_of(question), price]),
            lbx=np.concatenate([low, np.zeros(count)]), ubx=np.concatenate([high, np.full(count, 1e3)]),
            lbg=rows_low, ubg=rows_high,
        )  # fmt: skip
        point, status = np.array(answer["x"]).ravel(), str(self._softened.stats()["return_status"])
        if status not in _SOLVED or not np.all(np.isfinite(point)):
            return QuickOutcome("not solved", f"the solver stopped with '{status}'")
        gives = point[len(point) - count :]
        if float(gives @ price) <= _KEPT * count:
            return QuickOutcome("solved", "", QuickPoint(point[:-count], _NONE, _NONE))
        sizes = [row.expression.shape[0] for row in self.problem.structure]
        sizes += [bound.expression.shape[0] for bound in self.bounds]
        groups = np.split(np.abs(np.array(answer["lam_g"]).ravel()), np.cumsum(sizes)[:-1])
        limits = groups[len(self.problem.structure) :]
        involved = [i for i, each in enumerate(limits) if np.max(each, initial=0.0) > _INVOLVED * price[i]]
        return QuickOutcome(
            "infeasible", self._words(question, involved, gives),
            conflicts=tuple(dict.fromkeys(self.bounds[i].limit for i in involved)),
        )  # fmt: skip

    def _words(self, question: LiveQuestion, involved: Sequence[int], gives: Floats) -> str:
        names = list(dict.fromkeys(self.bounds[i].limit for i in involved))
        rule = "contradict each other" if len(names) > 1 else "cannot be kept with what is free"
        values = self.values_of(question)
        needed = []
        for i in involved:
            bound, give = self.bounds[i], float(gives[i] * self._scales[i])
            if gives[i] > _KEPT:
                moved = values[i] + give if bound.upper else values[i] - give
                needed.append(f"{bound.limit} {bound.shown(values[i])} to about {bound.shown(moved)}")
        words = f"limits {', '.join(names)} {rule}"
        return words + (f"; it would be enough to move {' and '.join(needed)}" if needed else "")

    def _solved(self, solver: ca.Function, question: LiveQuestion, begin: QuickPoint) -> QuickOutcome:
        low, high = self.ranges_of(question)
        rows_low, rows_high = self.limits_of(question)
        given: dict[str, Any] = {"x0": np.clip(begin.unknowns, low, high)}
        if len(begin.of_rows) == len(rows_low):
            given |= {"lam_x0": begin.of_bounds, "lam_g0": begin.of_rows}
        answer = solver(p=self.numbers_of(question), lbx=low, ubx=high, lbg=rows_low, ubg=rows_high, **given)
        status = str(solver.stats()["return_status"])
        point = QuickPoint(*(np.array(answer[key]).ravel() for key in ("x", "lam_x", "lam_g")))
        cost = float(answer["f"])
        finite = bool(np.all(np.isfinite(point.unknowns)) and math.isfinite(cost))
        if finite and status in _SOLVED:
            return QuickOutcome("solved", "", point, cost)
        state = "infeasible" if status == PROVED_INFEASIBLE else "not solved"
        return QuickOutcome(state, f"the solver stopped with '{status}'", point if finite else None)


_NONE: Floats = np.zeros(0)


def structure_of(question: LiveQuestion) -> tuple[Any, ...]:
    """Return what two questions must share for one program: equal keys, one program.

    Parameters
    ----------
    question
        Any.
    """
    free, target = question.contour in question.free, question.target
    return (
        id(question.machine),
        free,
        len(target.angles),
        None if free else target.last_angle,
        tuple(question.limit_values),
    )
