"""Shares of the variance of Ishigami's function, which are published in closed form.

f = sin x₁ + a·sin² x₂ + b·x₃⁴·sin x₁ over [−π, π]³ (Ishigami and Homma 1990, a = 7, b = 0.1). Its variance
has three parts: ½·(1 + b·π⁴/5)² of x₁, a²/8 of x₂, and 8·b²·π⁸/225 of x₁ with x₃.
"""

from __future__ import annotations

import numpy as np
import pytest

pytest.importorskip("SALib")

from nlsdesign.components.assembly.deck_writer import declare
from nlsdesign.foundation.deck import load_deck
from nlsdesign.sweeps import FunctionQuestion, SaltelliSample
from nlsdesign.sweeps.axis_values import Subject
from nlsdesign.sweeps.sensitivity import AnswerSensitivity, sensitivity
from nlsdesign.sweeps.sweep_folder import PointPlan

PARTS = (0.5 * (1.0 + 0.1 * np.pi**4 / 5.0) ** 2, 7.0**2 / 8.0, 8.0 * 0.1**2 * np.pi**8 / 225.0)
FIRST = {"x1": PARTS[0] / sum(PARTS), "x2": PARTS[1] / sum(PARTS), "x3": 0.0}
TOTAL = {"x1": 1.0 - FIRST["x2"], "x2": FIRST["x2"], "x3": PARTS[2] / sum(PARTS)}


def ishigami(x: np.ndarray) -> np.ndarray:
    return np.sin(x[:, 0]) + 7.0 * np.sin(x[:, 1]) ** 2 + 0.1 * x[:, 2] ** 4 * np.sin(x[:, 0])


def shares(x: np.ndarray, y: np.ndarray | None = None) -> AnswerSensitivity:
    axes = {f"x{k + 1}": x[:, k] for k in range(x.shape[1])}
    return sensitivity(axes, {"y": ishigami(x) if y is None else y}, np.ones(len(x), dtype=bool))[0]


def planned(count: int, *, second_order: bool = False) -> np.ndarray:
    """Points of the set of axes itself, on three numbers of a deck, moved to the range of the function."""
    names = ("motor.inertia", "motor.torque_constant", "spring.rubber.area")
    sample = SaltelliSample(dict.fromkeys(names, (1.0, 2.0)), count, second_order=second_order, seed=3)
    question = FunctionQuestion(len, {"y": "1"})  # type: ignore[arg-type]
    plan = PointPlan([sample], Subject({"deck": declare(load_deck("austin2015_as_printed"))}, question))
    assert {column.kind for column in plan.columns} == {"saltelli"}
    return (2.0 * np.array([row for _, row in plan.points()]) - 3.0) * np.pi


def test_the_closed_form_gives_the_digits_in_print() -> None:
    """As in every text on the function: 0.3139, 0.4424, 0 and 0.5576, 0.4424, 0.2437."""
    assert [round(each, 4) for each in FIRST.values()] == [0.3139, 0.4424, 0.0]
    assert [round(each, 4) for each in TOTAL.values()] == [0.5576, 0.4424, 0.2437]


@pytest.mark.parametrize("second_order", [False, True])
def test_a_saltelli_plan_gives_the_published_first_and_total_shares(second_order: bool) -> None:
    result = shares(planned(1024, second_order=second_order))
    assert result.method.startswith("Sobol indices of 1024 blocks")
    assert {each.axis for each in result.indices} == set(FIRST)
    for each in result.indices:
        assert abs(each.first - FIRST[each.axis]) < 0.02
        assert abs(each.total - TOTAL[each.axis]) < 0.02
        assert abs(each.first - FIRST[each.axis]) < each.first_error < 0.1
        assert abs(each.total - TOTAL[each.axis]) < each.total_error < 0.12


def test_a_plain_sample_gives_the_published_first_shares_within_its_intervals() -> None:
    inside = []
    for seed in range(3):
        result = shares(np.random.default_rng(seed).uniform(-np.pi, np.pi, (1000, 3)))
        assert "RBD-FAST" in result.method
        for each in result.indices:
            inside.append(abs(each.first - FIRST[each.axis]) <= each.first_error)
            assert abs(each.first - FIRST[each.axis]) < 0.06
            assert np.isnan(each.total)
    assert np.mean(inside) >= 0.95


def test_a_full_grid_gives_the_shares_of_its_own_points_exactly() -> None:
    steps = (np.arange(24) + 0.5) / 24.0 * 2.0 * np.pi - np.pi
    x = np.stack(np.meshgrid(steps, steps, steps, indexing="ij"), axis=-1).reshape(-1, 3)
    result = shares(x)
    assert result.method.startswith("exact")
    for each in result.indices:
        assert each.first_error == each.total_error == 0.0
        # The rule of midpoints is of second order: 24 steps leave a hundredth.
        assert each.first == pytest.approx(FIRST[each.axis], abs=0.01)
        assert each.total == pytest.approx(TOTAL[each.axis], abs=0.01)


def test_an_additive_function_of_a_grid_splits_its_variance_without_rest() -> None:
    x = np.stack(np.meshgrid([0.0, 1.0, 2.0], [0.0, 1.0], indexing="ij"), axis=-1).reshape(-1, 2)
    result = shares(x, 3.0 * x[:, 0] + 4.0 * x[:, 1])
    parts = {"x1": 9.0 * 2.0 / 3.0, "x2": 16.0 * 0.25}
    for each in result.indices:
        assert each.first == pytest.approx(parts[each.axis] / sum(parts.values()), rel=1e-12)
        assert each.total == pytest.approx(each.first, rel=1e-12)
