"""Limits that give: a slack moves each of them to the side on which more designs keep it."""

from __future__ import annotations

from dataclasses import replace

import casadi as ca
import numpy as np
import pytest

from nlsdesign.design.optimisation.limits import limit_kinds
from nlsdesign.design.parametric.parametric_program import ProgramRows, SoftenedProgram
from nlsdesign.live.gallery import gallery_question
from nlsdesign.live.question import LiveQuestion

MACHINES = ("cam-actuator", "coil_cable_drive")


def with_limits(machine: str) -> LiveQuestion:
    """The question of a machine with every limit that follows from it, and two that do not."""
    question = gallery_question(machine)
    limits = {n: each.value for n, each in question.limit_values.items()}
    return replace(question, limits={"MaximumCamRadius": 0.03, "PositiveStiffness": 0.1, **limits})


def test_every_limit_of_the_package_is_tried() -> None:
    assert {name for machine in MACHINES for name in with_limits(machine).limits} == {
        name for name, kind in limit_kinds().items() if kind.kind.__module__.startswith("nlsdesign.design.")
    }


@pytest.mark.parametrize("machine", MACHINES)
def test_a_slack_widens_its_limit_and_no_other(machine: str) -> None:
    """Of all kinds, by differences: the distance to what the limit allows grows by the slack."""
    question = with_limits(machine)
    rows = ProgramRows(question)
    program = SoftenedProgram(rows).program
    count, values = len(rows.bounds), rows.numbers_of(question)
    given = ca.Function("rows", [program["x"], program["p"]], [program["g"], program["f"]])
    draw = np.random.default_rng(1)
    point = rows.completed(question, {}) + 1e-3 * draw.standard_normal(rows.problem.vector.shape[0])
    prices = draw.uniform(1.0, 2.0, count)

    def at(slacks: np.ndarray) -> tuple[np.ndarray, float]:
        answer = given(np.concatenate([point, slacks]), np.concatenate([values, prices]))
        return np.array(answer[0]).ravel(), float(answer[1])

    low, high = rows.limits_of(question)
    sizes = [row.expression.shape[0] for row in rows.problem.structure]
    sizes += [bound.expression.shape[0] for bound in rows.bounds]
    of_row = np.repeat(np.arange(len(sizes)) - len(rows.problem.structure), sizes)
    before, nothing = at(np.zeros(count))
    assert nothing == 0.0
    for i, bound in enumerate(rows.bounds):
        moved, cost = at(np.eye(count)[i] * 0.25)
        room = np.minimum(moved - low, high - moved) - np.minimum(before - low, high - before)
        np.testing.assert_allclose(room[of_row == i], 0.25, atol=1e-12, err_msg=str(bound.limit))
        np.testing.assert_array_equal(moved[of_row != i], before[of_row != i])
        assert cost == 0.25 * prices[i]
