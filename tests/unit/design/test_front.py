"""Fronts as data and as a figure: what is refused, what is told, what is written."""

from __future__ import annotations

import csv
from dataclasses import replace
from functools import cache
from pathlib import Path

import numpy as np
import pytest

from nlsdesign.design import (
    DesignSettings,
    LeastRubber,
    LeastSize,
    MaximumCamRadius,
    MaximumTorqueError,
    MinimumRadiusOfCurvature,
    ParetoFront,
    PretensionRange,
    TorqueError,
    pareto,
)
from nlsdesign.design.optimisation.program import Program, Solution
from nlsdesign.foundation.errors import InfeasibleError, ValueRangeError
from nlsdesign.presentation import figures
from nlsdesign.presentation.figures.style import alternative_text
from tests.cam_cases import CONCAVE, KEEP, RUBBER, TARGET, actuator

AREA = RUBBER[:3]
MACHINE = actuator(CONCAVE, pretension=2e-3)
QUICK = DesignSettings(starts=2, draws=0, look_for_size_ranges=False)
BOUNDED = (*KEEP, PretensionRange(0.0, 8e-3))


def solved() -> ParetoFront:
    return pareto(
        MACHINE, target=TARGET, goals=(LeastRubber(), LeastSize()), free=AREA, keep=BOUNDED, points=4,
        settings=QUICK,
    )  # fmt: skip


front = cache(solved)


@pytest.mark.parametrize(
    ("goals", "points", "words"),
    [
        ((TorqueError(),), 5, "goals: 1.*a front has two or three"),
        ((TorqueError(), LeastSize(), LeastRubber(), LeastSize(2.0)), 5, "goals: 4"),
        ((LeastSize(), LeastSize(2.0)), 5, "goals: LeastSize, LeastSize.*two of a kind"),
        ((TorqueError(), LeastSize()), 2, r"points = 2.*must lie in \[3, 50\]"),
    ],
)
def test_what_is_no_front_is_refused(goals: tuple[object, ...], points: int, words: str) -> None:
    with pytest.raises(ValueRangeError, match=words):
        pareto(MACHINE, target=TARGET, goals=goals, free=AREA, points=points)  # type: ignore[arg-type]


# Ten seconds; conflicts of one design are named in every run.
@pytest.mark.slow
def test_limits_in_conflict_are_named_before_any_front() -> None:
    keep = [MinimumRadiusOfCurvature(10e-3), MaximumCamRadius(6e-3)]
    with pytest.raises(InfeasibleError, match="MaximumCamRadius"):
        pareto(MACHINE, target=TARGET, goals=(TorqueError(), LeastSize()), free=AREA, keep=keep, points=3)


@pytest.mark.slow
def test_every_point_meets_the_target_as_the_settings_ask() -> None:
    for number in range(len(front().points)):
        assert front().design(number).met
    values = front().values
    assert values.shape == (4, 2)
    assert np.all(np.diff(values[:, 0]) > 0.0)
    assert np.all(np.diff(values[:, 1]) < 0.0)


@pytest.mark.slow
def test_the_same_front_comes_again_and_progress_is_told() -> None:
    calls = []
    settings = replace(QUICK, progress=lambda: calls.append(1))
    again = pareto(
        MACHINE, target=TARGET, goals=(LeastRubber(), LeastSize()), free=AREA, keep=BOUNDED, points=4,
        settings=settings,
    )  # fmt: skip
    assert str(again) == str(front())
    # Two starts for the first goal, three for the second, two rungs of the ladder.
    assert len(calls) >= 7


@pytest.mark.slow
def test_the_table_holds_goals_numbers_and_limits(tmp_path: Path) -> None:
    front().write_csv(tmp_path / "out" / "front.csv")
    with (tmp_path / "out" / "front.csv").open(encoding="utf-8", newline="") as stream:
        head, *rows = csv.reader(stream)
    assert head == [
        "rubber volume [cm^3]", "cam radius [mm]", "spring.pretension [mm]", "spring.rubber.area [mm^2]",
        "binding limits",
    ]  # fmt: skip
    assert len(rows) == len(front().points)
    for row, point in zip(rows, front().points, strict=True):
        volume, radius, pretension, area = map(float, row[:4])
        assert (volume * 1e-6, radius * 1e-3) == pytest.approx(point.values)
        # Two elements of 12.5 mm.
        assert volume == pytest.approx(2 * 1.25 * area * 1e-2)
        assert -1e-6 <= pretension <= 8.0 + 1e-6
        assert row[4] == "; ".join(point.binding)


@pytest.mark.slow
def test_what_the_solver_does_not_find_is_said(monkeypatch: pytest.MonkeyPatch) -> None:
    solve = Program.solve

    def stubborn(self: Program, start: np.ndarray, **more: np.ndarray) -> Solution:
        outcome = solve(self, start, **more)
        parameters = more.get("parameters")
        tight = parameters is not None and parameters[-1] < 1e5
        return replace(outcome, solved=False, status="Stubborn") if tight else outcome

    monkeypatch.setattr(Program, "solve", stubborn)
    ends = solved()
    assert len(ends.points) == 2
    said = [str(each) for each in ends.left_out]
    assert len(said) == 2
    assert all("cam radius ≤" in each and "IPOPT stopped with 'Stubborn'" in each for each in said)
    assert all(each in str(ends) for each in said)


def test_a_point_that_does_not_exist_is_refused() -> None:
    with pytest.raises(ValueRangeError, match=r"point 99: the front has points 0 to"):
        front().design(99)


def test_the_figure_draws_every_point_with_its_number() -> None:
    figure = figures.pareto_front(front())
    (axes,) = figure.axes
    drawn = {text.get_text() for text in axes.texts}
    assert drawn == {str(number) for number in range(len(front().points))}
    assert axes.get_xlabel() == "cam radius in mm"
    assert axes.get_ylabel() == "rubber volume in cm³"
    line = axes.lines[0].get_xydata()
    assert np.sort(line[:, 1]) == pytest.approx(front().shown[:, 0])
    assert "Front of" in alternative_text(figure)


def test_three_goals_are_drawn_by_steps_of_the_third() -> None:
    points = tuple(
        each._replace(values=(*each.values, 0.01 * number)) for number, each in enumerate(front().points)
    )
    three = replace(
        front(), points=points, goals=(*front().goals, "energy lost per cycle"), units=(*front().units, "%")
    )
    (axes,) = figures.pareto_front(three).axes
    assert sum(len(line.get_xdata()) for line in axes.lines) == len(points)
    assert len(axes.lines) > 1
    assert MaximumTorqueError.__name__ in str(three)
