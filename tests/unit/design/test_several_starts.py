"""The best is looked for until it has been found twice, and how often it was found is said."""

from __future__ import annotations

from dataclasses import replace
from typing import Any

import numpy as np
import pytest

from benchmarks.cam_design import Problem, problems, random_point
from nlsdesign.design import DesignSettings, design_cam
from nlsdesign.design.optimisation.design_search import SeveralStarts, same_design, times_found
from nlsdesign.design.optimisation.program import Program, Solution
from nlsdesign.design.optimisation.shape import starts
from tests.cam_cases import CONCAVE, KEEP, PRETENSION, TARGET, actuator

ALL = {problem.name: problem for problem in problems()}


def best_of(problem: Problem) -> tuple[float, int, int]:
    """Return the best cost, how often it was found, and the number of starts."""
    search = problem.search()
    outcomes = SeveralStarts(search).outcomes()
    cost = min(outcome.cost for outcome in outcomes if outcome.solved)
    return cost, times_found(search.problem, outcomes), len(outcomes)


@pytest.mark.slow
def test_knots_rounded_much_at_first_lead_to_what_plain_starts_mostly_miss() -> None:
    """Searches with knots of the last rounding end in the nearest of many local optima, but for a few."""
    search = ALL["README"].search()
    sizes = [v.name for v in search.problem.scalars if v.name != search.problem.law.cam.pretension]
    plain = [search.program.solve(search.problem.at(start)) for start in starts(4, 1, sizes)]
    cost, found, count = best_of(ALL["README"])
    costs = [outcome.cost for outcome in plain if outcome.solved]
    assert cost <= 1.0005 * min(costs)
    assert sum(each > 1.5 * cost for each in costs) >= 3
    assert found == count == 6, "every start that is led comes to the best"


@pytest.mark.slow
@pytest.mark.parametrize("name", ["README", "flat"])
def test_a_hundred_random_starts_find_nothing_better(name: str) -> None:
    search, draw = ALL[name].search(), np.random.default_rng(7)
    random = [search.program.solve(random_point(search.problem, draw)) for _ in range(100)]
    cost, found, _ = best_of(ALL[name])
    assert found >= 2
    assert cost <= 1.0005 * min(outcome.cost for outcome in random if outcome.solved)


def test_two_shapes_of_one_cost_are_two_designs() -> None:
    problem = ALL["flat"].search().problem
    nothing = (np.zeros(0), np.zeros(0))
    one = Solution(True, "", np.zeros(len(problem.variables)), 1.0, 1, (), nothing)
    near = replace(one, point=one.point + 0.01, cost=1.0004)
    wider = replace(one, point=one.point + 0.1)
    dearer = replace(one, cost=1.001)
    failed = replace(one, solved=False)
    assert same_design(problem, one, near)
    assert not any(same_design(problem, one, other) for other in (wider, dearer, failed))
    assert times_found(problem, [dearer, near, one, wider, failed]) == 2
    assert times_found(problem, [failed]) == 0


@pytest.mark.slow
def test_where_the_only_start_fails_more_are_tried(monkeypatch: pytest.MonkeyPatch) -> None:
    """Whether one start comes through differs from processor to processor."""
    solve, tried = Program.solve, []

    def unlucky(program: Program, *given: Any, **more: Any) -> Solution:
        tried.append(1)
        outcome = solve(program, *given, **more)
        return replace(outcome, solved=outcome.solved and len(tried) > 2)

    monkeypatch.setattr(Program, "solve", unlucky)
    monkeypatch.setattr(
        "nlsdesign.design.optimisation.solve.feasible_point",
        lambda search, _: search.problem.at(next(starts(1, 0, []))),
    )
    few = DesignSettings(starts=1, look_for_size_ranges=False, look_for_remedies=False, draws=0)
    design = design_cam(actuator(CONCAVE), target=TARGET, free=PRETENSION, keep=KEEP, settings=few)
    assert design.met
    assert len(design.starts) == 6


@pytest.mark.slow
def test_how_often_the_best_was_found_is_said() -> None:
    settings = DesignSettings(look_for_size_ranges=False, draws=0)
    for most, words in ((24, "found from 6 of 6"), (1, "found once only in 1: another may be better")):
        given = replace(settings, starts=most)
        design = design_cam(actuator(CONCAVE), target=TARGET, free=PRETENSION, keep=KEEP, settings=given)
        assert dict(design.rows())["starts"].startswith(words)
        assert sum(start.same for start in design.starts) == len(design.starts)
