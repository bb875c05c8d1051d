"""Points of a sweep are judged by what is stated: fronts, quantiles, surfaces, shares of the variance."""

from __future__ import annotations

import numpy as np
import pytest
from scipy.stats import norm

from nlsdesign.foundation.errors import UnknownNameError, ValueRangeError
from nlsdesign.sweeps.answer_statistics import AnswerSurface, answer_quantiles, answer_surface, dependent_axes
from nlsdesign.sweeps.axes import saltelli_plan
from nlsdesign.sweeps.preferences import (
    Preference,
    Requirement,
    nondominated,
    rank_points,
)
from nlsdesign.sweeps.sensitivity import sensitivity

NAN, INF = float("nan"), float("inf")


# --- fronts ---------------------------------------------------------------------------------------


def test_the_front_of_points_drawn_by_hand() -> None:
    """Error and mass; 0, 3 and 4 are on the front, 4 twice; 1 and 2 are bettered; 5 failed, 6 is infinite."""
    answers = {
        "error": np.array([1.0, 2.0, 3.0, 2.0, 4.0, NAN, 0.5, 4.0, 0.1]),
        "mass": np.array([5.0, 5.0, 4.0, 3.0, 1.0, NAN, INF, 1.0, NAN]),
    }
    done = np.array([True] * 5 + [False] + [True] * 3)
    both = [Preference.smaller("error"), Preference.smaller("mass")]
    ranked = rank_points(answers, done, preferences=both)
    assert ranked.front.tolist() == [0, 3, 4, 7]
    assert np.flatnonzero(ranked.failed).tolist() == [5]
    assert np.flatnonzero(ranked.incomplete).tolist() == [6, 8]
    assert not ranked.missed.any()
    turned = rank_points(answers, done, preferences=[Preference.larger("error"), Preference.larger("mass")])
    assert turned.front.tolist() == [4, 7, 2, 1]
    near = rank_points(answers, done, preferences=[Preference.near("error", 2.2)])
    assert near.front.tolist() == [1, 3]


def test_a_miss_is_on_no_front_and_betters_nothing() -> None:
    answers = {"error": np.array([1.0, 2.0, 3.0]), "strain": np.array([9.0, 1.0, NAN])}
    ranked = rank_points(
        answers, np.ones(3, dtype=bool), preferences=[Preference.smaller("error")],
        requirements=[Requirement.at_most("strain", 3.0), Requirement.at_least("error", 1.5)],
    )  # fmt: skip
    assert ranked.front.tolist() == [1]
    assert np.flatnonzero(ranked.missed).tolist() == [0, 2]
    assert ranked.misses == (2, 1)


def test_nothing_is_better_where_no_direction_is_stated() -> None:
    ranked = rank_points({"a": np.array([1.0, NAN])}, np.array([True, False]))
    assert not len(ranked.front)
    assert ranked.compared.tolist() == [True, False]
    empty = rank_points({"a": np.zeros(0)}, np.zeros(0, dtype=bool), preferences=[Preference.smaller("a")])
    assert not len(empty.front)


def test_the_front_agrees_with_its_definition_on_random_points() -> None:
    random = np.random.default_rng(2)
    for columns in (1, 2, 3, 4):
        costs = random.integers(0, 6, (120, columns)).astype(float)
        bettered = [any(np.all(other <= row) and np.any(other < row) for other in costs) for row in costs]
        assert nondominated(costs).tolist() == np.flatnonzero(~np.array(bettered)).tolist()


def test_a_name_that_does_not_exist_and_two_directions_are_refused() -> None:
    answers, done = {"torque_error": np.zeros(2)}, np.ones(2, dtype=bool)
    with pytest.raises(UnknownNameError, match="did you mean 'torque_error'"):
        rank_points(answers, done, preferences=[Preference.smaller("torque_eror")])
    twice = [Preference.smaller("torque_error"), Preference.larger("torque_error")]
    with pytest.raises(ValueRangeError, match="two directions"):
        rank_points(answers, done, preferences=twice)


# --- quantiles ------------------------------------------------------------------------------------


def test_the_bounds_of_quantiles_hold_as_often_as_they_say() -> None:
    random, shares = np.random.default_rng(4), (0.05, 0.5, 0.95)
    held = np.zeros((200, len(shares)), dtype=bool)
    for draw in range(len(held)):
        for k, each in enumerate(answer_quantiles(random.normal(size=200), shares)):
            held[draw, k] = each.lower <= norm.ppf(each.share) <= each.upper
    # 200 draws: 95 % minus two standard deviations of the count; the binomial steps only make them wider.
    assert np.all(held.mean(axis=0) > 0.919)
    assert np.all(held.mean(axis=0) < 1.0)


def test_too_few_points_bound_no_side_and_infinite_answers_stay_in_their_order() -> None:
    low, middle, high = answer_quantiles([3.0, 1.0, 2.0, INF, NAN], (0.05, 0.5, 0.95))
    assert (low.value, middle.value, high.value) == (1.0, 2.0, INF)
    assert np.isnan([low.lower, high.upper]).all()
    assert answer_quantiles([NAN]) == []
    least = answer_quantiles(np.arange(58.0), (0.5,))[0]
    assert least.lower < least.value < least.upper


# --- surfaces -------------------------------------------------------------------------------------


def plane(x: np.ndarray, y: np.ndarray) -> np.ndarray:
    return 2.0 + 3.0 * x - 0.5 * y


def test_a_plane_is_met_exactly_within_the_hull_and_nothing_is_said_outside() -> None:
    random = np.random.default_rng(5)
    x, y = random.uniform(0.0, 1e-3, 80), random.uniform(100.0, 300.0, 80)
    inside = y - 100.0 < 2e5 * x  # a triangle, so that the hull is no rectangle
    x, y = x[inside], y[inside]
    surface = answer_surface(x, y, plane(x, y), others_vary=False)
    assert isinstance(surface, AnswerSurface)
    across, up = np.meshgrid(surface.across, surface.up)
    known = np.isfinite(surface.values)
    assert np.allclose(surface.values[known], plane(across, up)[known], rtol=1e-9)
    assert not known[up - 100.0 > 2.05e5 * across + 5.0].any()
    assert 0.3 < known.mean() < 0.6
    assert surface.predicts
    assert surface.error < 1e-9 * surface.deviation
    assert surface.unpredicted >= 3


def test_noise_is_no_surface() -> None:
    random = np.random.default_rng(6)
    x, y, noise = random.uniform(size=(3, 300))
    for others_vary in (False, True):
        surface = answer_surface(x, y, noise, others_vary=others_vary)
        assert isinstance(surface, AnswerSurface)
        assert not surface.predicts
        assert surface.deviation == pytest.approx(np.std(noise))


def test_the_error_of_a_polynomial_is_that_on_points_that_were_left_out() -> None:
    random = np.random.default_rng(7)
    x, y = random.uniform(-1.0, 1.0, (2, 60))
    answer = x**2 - x * y + random.normal(size=60) * 0.1
    surface = answer_surface(x, y, answer, others_vary=True)
    assert isinstance(surface, AnswerSurface)
    assert "degree 2" in surface.method
    terms = np.column_stack([np.ones(60), x, y, x**2, x * y, y**2])
    wrong = [
        terms[k] @ np.linalg.lstsq(np.delete(terms, k, 0), np.delete(answer, k), rcond=None)[0] - answer[k]
        for k in range(60)
    ]
    assert surface.error == pytest.approx(np.sqrt(np.mean(np.square(wrong))), rel=1e-9)


def test_a_grid_keeps_its_values_and_a_failed_point_leaves_a_hole() -> None:
    x, y = (each.ravel() for each in np.meshgrid([1.0, 2.0, 4.0], [0.0, 1.0, 2.0, 3.0]))
    answer = plane(x, y)
    answer[5] = NAN
    surface = answer_surface(x, y, answer, others_vary=False)
    assert isinstance(surface, AnswerSurface)
    assert surface.method.endswith("a grid")
    assert surface.values.shape == (4, 3)
    assert np.isnan(surface.values[1, 2])
    assert np.isnan(surface.values).sum() == 1


@pytest.mark.parametrize(
    ("x", "y", "reason"),
    [
        (np.arange(5.0), np.arange(5.0) ** 2, "too few"),
        (np.arange(9.0), np.ones(9), "does not vary"),
        (np.arange(9.0), 2.0 * np.arange(9.0), "one line"),
    ],
)
def test_where_there_is_no_surface_the_reason_is_stated(x: np.ndarray, y: np.ndarray, reason: str) -> None:
    assert reason in str(answer_surface(x, y, x, others_vary=False))


# --- shares of the variance -----------------------------------------------------------------------


def uniform(count: int, axes: int = 2, seed: int = 8) -> dict[str, np.ndarray]:
    return {f"x{k}": each for k, each in enumerate(np.random.default_rng(seed).uniform(size=(axes, count)))}


def refusal(axes: dict[str, np.ndarray], answer: np.ndarray, done: np.ndarray | None = None) -> str:
    good = np.ones(len(answer), dtype=bool) if done is None else done
    result = sensitivity(axes, {"y": answer}, good)[0]
    assert not result.indices
    return result.refusal


def test_shares_are_refused_where_they_would_mean_nothing() -> None:
    axes = uniform(400)
    assert "too few" in refusal(uniform(50), np.arange(50.0))
    assert "same at all points" in refusal(axes, np.full(400, 0.3))
    assert "no axis varies" in refusal({"x": np.ones(400)}, np.arange(400.0))
    assert "no point has" in refusal(axes, np.full(400, NAN))
    lost = np.where(np.arange(400) < 60, INF, axes["x0"])
    assert "60 of 400" in refusal(axes, lost)
    angle = np.random.default_rng(9).uniform(0.0, 2.0 * np.pi, 400)
    assert "x and z depend on each other" in refusal({"x": np.cos(angle), "z": np.sin(angle)}, angle)
    follows = {"x": axes["x0"], "z": axes["x0"] + 0.2 * axes["x1"]}
    assert "x and z depend on each other" in refusal(follows, axes["x0"])


def test_independent_axes_are_not_refused() -> None:
    for seed in range(20):
        assert not dependent_axes(uniform(300, 4, seed))


def test_words_have_their_share_too_and_what_was_left_out_is_stated() -> None:
    random = np.random.default_rng(10)
    axes = uniform(1000) | {"rubber": np.array(["a", "b", "c"], dtype=object)[random.integers(3, size=1000)]}
    pieces = {"a": 0.0, "b": 1.0, "c": 2.0}
    answer = np.array([pieces[each] for each in axes["rubber"]]) + axes["x0"]  # variances 2/3 and 1/12
    done = np.arange(1000) >= 20
    pytest.importorskip("SALib")
    result = sensitivity(axes, {"y": answer}, done)[0]
    shares = {each.axis: each for each in result.indices}
    assert shares["rubber"].first == pytest.approx(8.0 / 9.0, abs=0.03)
    assert shares["x0"].first == pytest.approx(1.0 / 9.0, abs=0.05)
    assert abs(shares["x1"].first) < shares["x1"].first_error + 0.02
    assert result.points == 980
    assert any("20 points" in remark for remark in result.remarks)


def test_a_plan_is_seen_from_its_points_and_a_shuffled_one_is_none() -> None:
    sample = pytest.importorskip("SALib.sample.sobol")
    problem = {"num_vars": 3, "names": list("abc"), "bounds": [[0.0, 1.0]] * 3}
    for second_order, rows in ((False, 5), (True, 8)):
        points = sample.sample(problem, 32, calc_second_order=second_order, seed=1)
        assert saltelli_plan(points) == (32, rows, second_order)
        assert saltelli_plan(points[:-1]) == (31, rows, second_order)
        assert saltelli_plan(np.random.default_rng(0).permutation(points)) is None
    assert saltelli_plan(np.random.default_rng(0).uniform(size=(40, 3))) is None


def test_points_of_a_plan_that_are_no_whole_plan_get_no_shares() -> None:
    """Its points belong together in blocks, so a method for independent points would be surer than it is."""
    sample = pytest.importorskip("SALib.sample.sobol")
    problem = {"num_vars": 2, "names": list("ab"), "bounds": [[0.0, 1.0]] * 2}
    points = sample.sample(problem, 128, calc_second_order=False, seed=1)
    crossed = {"a": np.tile(points[:, 0], 3), "b": np.tile(points[:, 1], 3)}
    crossed["c"] = np.repeat([1.0, 2.0, 3.0], len(points))
    kinds = {"a": "saltelli", "b": "saltelli", "c": "grid"}
    holes = {name: np.delete(points[:, k], [7, 30]) for k, name in enumerate("ab")}
    for axes in (crossed, holes):
        answers = {"y": axes["a"] + 2.0 * axes["b"]}
        done = np.ones(len(axes["a"]), dtype=bool)
        result = sensitivity(axes, answers, done, kinds=kinds)[0]
        assert not result.indices
        assert "no whole plan" in result.refusal
    whole = {"a": points[:, 0], "b": points[:, 1], "c": np.ones(len(points))}
    result = sensitivity(whole, {"y": points[:, 0]}, np.ones(len(points), dtype=bool), kinds=kinds)[0]
    assert len(result.indices) == 2, "an axis of one value takes nothing from the plan"


def test_a_block_with_a_failed_point_is_left_out_whole_and_many_are_refused() -> None:
    sample = pytest.importorskip("SALib.sample.sobol")
    problem = {"num_vars": 2, "names": list("ab"), "bounds": [[0.0, 1.0]] * 2}
    points = sample.sample(problem, 256, calc_second_order=False, seed=1)
    axes = {"a": points[:, 0], "b": points[:, 1]}
    answer = points[:, 0] + 2.0 * points[:, 1]
    broken = np.where(np.arange(len(answer)) % 61 == 0, NAN, answer)
    result = sensitivity(axes, {"y": broken}, np.isfinite(broken))[0]
    lost = len({k // 4 for k in range(0, len(answer), 61)})
    assert result.points == 4 * (256 - lost)
    assert f"{lost} of 256 blocks" in result.remarks[0]
    assert {each.axis: round(each.total, 1) for each in result.indices} == {"b": 0.8, "a": 0.2}
    worse = np.where(np.arange(len(answer)) % 13 == 0, NAN, answer)
    assert "blocks of the Saltelli plan have a point" in refusal(axes, worse, np.isfinite(worse))
