"""What a fit would leave over on pieces of records that it has not seen, against fits without them."""

from __future__ import annotations

import math
from collections.abc import Callable, Mapping
from dataclasses import replace
from types import SimpleNamespace
from typing import cast

import numpy as np
import pytest
from scipy.optimize import least_squares

from nlsdesign.bench.discrepancy.selection.cross_validation import SEGMENTS, by_pieces, by_records, tallies_of
from nlsdesign.bench.identification import Parameter
from nlsdesign.bench.identification.equation_error.evidence import Evidence
from nlsdesign.bench.identification.least_squares import Fit

ROWS, RANDOM = 60, np.random.default_rng(4)
SLOPES = {name: RANDOM.standard_normal((ROWS, 2)) for name in ("one", "two", "chosen")}
DATA = {name: s @ [1.5, -0.7] + 3.0 * RANDOM.standard_normal(ROWS) for name, s in SLOPES.items()}
ROLES = {"one": "fit", "two": "fit", "chosen": "selection"}
PRIOR = 0.4
DEALT = {"one": 0, "two": 1}
"""Fold of the first piece of each record that is fitted."""


def evidence(name: str) -> Evidence:
    """A record of a linear block."""

    def residual(values: Mapping[str, float]) -> tuple[np.ndarray, np.ndarray]:
        return DATA[name] - SLOPES[name] @ [values["a"], values["b"]], -SLOPES[name]

    return evidence_of(name, ROLES[name], residual)


def evidence_of(
    name: str, role: str, residual: Callable[[Mapping[str, float]], tuple[np.ndarray, np.ndarray]]
) -> Evidence:
    """A record of any block."""
    driven = SimpleNamespace(block=SimpleNamespace(name="spring"), free=("a", "b"), stiff=False)
    record = SimpleNamespace(name=name, role=role)
    floor = SimpleNamespace(sigma=np.ones(ROWS), independent=math.inf)
    return cast(
        Evidence,
        SimpleNamespace(
            driven=driven, record=record, floor=floor, residual=residual, left=lambda v: residual(v)[0]
        ),
    )


def solved(rows: np.ndarray, data: np.ndarray) -> np.ndarray:
    """Least squares with the prior on the first number, written out."""
    matrix, right = np.vstack([rows, [1.0 / PRIOR, 0.0]]), np.append(data, 1.0 / PRIOR)
    return np.asarray(np.linalg.lstsq(matrix, right, rcond=None)[0])


def fitted(*, upper: float = 10.0) -> Fit:
    parameters = (
        Parameter("a", "1", 1.0, 1.0, PRIOR, -10.0, 10.0, "linear"),
        Parameter("b", "1", 0.0, 0.0, math.inf, -10.0, upper, "linear"),
    )
    best = solved(np.vstack([SLOPES["one"], SLOPES["two"]]), np.concatenate([DATA["one"], DATA["two"]]))
    values = {"a": float(best[0]), "b": min(float(best[1]), upper)}
    return Fit(parameters, values, np.eye(2), 1.0, {}, True)


EVERY = [evidence(name) for name in ROLES]


def test_each_fold_is_predicted_with_the_numbers_that_the_other_folds_give() -> None:
    tallies = tallies_of(EVERY, fitted(), by_pieces)
    by_hand = {name: [0.0] * SEGMENTS for name in ("one", "two")}
    piece = np.arange(ROWS) // (ROWS // SEGMENTS)
    for fold in range(3):
        others = {name: (piece + DEALT[name]) % 3 != fold for name in by_hand}
        numbers = solved(
            np.vstack([SLOPES[name][kept] for name, kept in others.items()]),
            np.concatenate([DATA[name][kept] for name, kept in others.items()]),
        )
        for name, sums in by_hand.items():
            left = DATA[name] - SLOPES[name] @ numbers
            for k in range((fold - DEALT[name]) % 3, SEGMENTS, 3):
                sums[k] = float(np.sum(left[piece == k] ** 2))
    for name, sums in by_hand.items():
        assert tallies["spring", name].segments == pytest.approx(sums)
        assert tallies["spring", name].predicted > tallies["spring", name].squares


def test_a_record_for_selection_is_predicted_with_the_numbers_of_all_fitted_records() -> None:
    best = fitted()
    left = DATA["chosen"] - SLOPES["chosen"] @ [best.values["a"], best.values["b"]]
    tally = tallies_of(EVERY, best, by_pieces)["spring", "chosen"]
    assert tally.predicted == pytest.approx(float(left @ left))
    without = tallies_of(EVERY[:2], best, by_pieces)["spring", "one"]
    assert without.segments == tallies_of(EVERY, best, by_pieces)["spring", "one"].segments


def test_slow_noise_leaves_no_more_independent_residuals_than_it_allows() -> None:
    (white,) = tallies_of(EVERY[:1], fitted(), by_pieces).values()
    assert white.effective_size > 3.0
    slow = cast(Evidence, SimpleNamespace(**{**vars(EVERY[0]), "floor": SimpleNamespace(
        sigma=np.ones(ROWS), independent=3.0)}))  # fmt: skip
    assert tallies_of([slow], fitted(), by_pieces)["spring", "one"].effective_size == 3.0


def test_numbers_stay_inside_their_bounds_when_pieces_are_left_out() -> None:
    held = fitted(upper=-1.2)
    tallies = tallies_of(EVERY[:2], held, by_pieces)
    assert held.values["b"] == -1.2, "or the test would show nothing"
    # The bound holds the second number for every fold, so only the first moves.
    piece = np.arange(ROWS) // (ROWS // SEGMENTS)
    others = np.concatenate([(piece + shift) % 3 != 0 for shift in DEALT.values()])
    rows = np.vstack([SLOPES["one"], SLOPES["two"]])[others]
    data = np.concatenate([DATA["one"], DATA["two"]])[others] + 1.2 * rows[:, 1]
    first = (rows[:, 0] @ data + 1.0 / PRIOR**2) / (rows[:, 0] @ rows[:, 0] + 1.0 / PRIOR**2)
    left = DATA["one"] - SLOPES["one"] @ [first, -1.2]
    # Not refitted to its own optimum at the bound, the step differs in second order only.
    assert tallies["spring", "one"].segments[0] == pytest.approx(
        float(np.sum(left[piece == 0] ** 2)), rel=0.02
    )


def test_without_leaving_out_every_piece_is_as_fitted() -> None:
    tally = tallies_of(EVERY, fitted(), None)["spring", "one"]
    assert tally.predicted == pytest.approx(tally.squares)


def test_a_whole_record_is_predicted_with_the_numbers_of_the_other_records(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    for name in ("three", "four"):
        monkeypatch.setitem(ROLES, name, "fit")
        monkeypatch.setitem(SLOPES, name, RANDOM.standard_normal((ROWS, 2)))
        monkeypatch.setitem(DATA, name, SLOPES[name] @ [1.5, -0.7] + 3.0 * RANDOM.standard_normal(ROWS))
    fits = [name for name, role in ROLES.items() if role == "fit"]
    best = solved(np.vstack([SLOPES[n] for n in fits]), np.concatenate([DATA[n] for n in fits]))
    whole = replace(fitted(), values={"a": float(best[0]), "b": float(best[1])})
    tallies = tallies_of([evidence(name) for name in ROLES], whole, by_records)
    for name in fits:
        others = [n for n in fits if n != name]
        numbers = solved(np.vstack([SLOPES[n] for n in others]), np.concatenate([DATA[n] for n in others]))
        left = DATA[name] - SLOPES[name] @ numbers
        assert tallies["spring", name].predicted == pytest.approx(float(left @ left))
        # The least squares of all records together are those of the others and what this record adds to them.
        adds = cost_of(fits, best) - cost_of(others, numbers)
        assert tallies["spring", name].in_common == pytest.approx(adds, abs=0.05)
        assert tallies["spring", name].squares < tallies["spring", name].in_common
        assert tallies["spring", name].in_common < tallies["spring", name].predicted


def cost_of(names: list[str], numbers: np.ndarray) -> float:
    """Sum of squares over some records with the prior on the first number, written out."""
    left = [DATA[name] - SLOPES[name] @ numbers for name in names]
    return float(np.sum(np.concatenate(left) ** 2) + ((numbers[0] - 1.0) / PRIOR) ** 2)


def test_of_two_records_none_is_left_out_as_a_whole() -> None:
    assert tallies_of(EVERY, fitted(), by_records) == tallies_of(EVERY, fitted(), by_pieces)


def test_what_shows_at_one_phase_of_every_record_is_left_out_of_some_records_only() -> None:
    """Motions of one kind turn about in one piece: were that the same fold in each, nothing would know it."""
    many = [evidence_of(name, "fit", lambda values: (np.zeros(ROWS), np.zeros((ROWS, 2)))) for name in "abc"]
    folds = np.array([fold[:: ROWS // SEGMENTS] for fold in by_pieces(many)])
    assert all(set(at_one_phase) == {0, 1, 2} for at_one_phase in folds.T)
    again = by_pieces([*many, many[1]])
    assert np.array_equal(again[1], again[3]), "in every block alike"
    renamed = by_pieces([evidence_of(each, "fit", evidence("one").residual) for each in "cba"])
    assert np.array_equal(renamed, by_pieces(many)), "whatever the records are called"


def test_where_a_step_leaves_what_its_slopes_hold_the_numbers_come_from_a_descent() -> None:
    """Only the left-out piece knows the second number, and along that one the slopes hold nowhere else."""
    time = np.linspace(0.0, 1.0, ROWS)
    truth = 1.0 - np.exp(-time / 3.0)
    wrong = truth + np.where(time > 0.8, 0.3 * (time - 0.8), 0.0)

    def residual(values: Mapping[str, float]) -> tuple[np.ndarray, np.ndarray]:
        level, slowness = np.exp(values["a"]), np.exp(values["b"])
        rest = np.exp(-time / slowness)
        slopes = np.column_stack([-level * (1.0 - rest), level * rest * time / slowness])
        return 1e3 * (wrong - level * (1.0 - rest)), 1e3 * slopes

    records = [evidence_of("one", "fit", residual)]
    parameters = tuple(Parameter(n, "1", 0.0, 0.0, math.inf, -6.0, 12.0, "linear") for n in ("a", "b"))

    def left(numbers: np.ndarray) -> np.ndarray:
        return residual({"a": float(numbers[0]), "b": float(numbers[1])})[0]

    def refitted(kept: np.ndarray, start: np.ndarray) -> np.ndarray:
        bounds = ([-6.0, -6.0], [12.0, 12.0])
        return np.asarray(least_squares(lambda x: left(x)[kept], start, bounds=bounds, x_scale="jac").x)

    best = refitted(np.ones(ROWS, dtype=bool), np.array([0.0, 1.0]))
    fit = Fit(parameters, {"a": float(best[0]), "b": float(best[1])}, np.eye(2), 1.0, {}, True)
    found = np.array(tallies_of(records, fit, by_pieces)["spring", "one"].segments)
    (fold,), piece = by_pieces(records), np.arange(ROWS) // (ROWS // SEGMENTS)
    exact = np.zeros(SEGMENTS)
    for k in range(3):
        squares = left(refitted(fold != k, best)) ** 2
        for each in range(SEGMENTS):
            if (fold[piece == each] == k).all():
                exact[each] = float(np.sum(squares[piece == each]))
    assert found.sum() == pytest.approx(exact.sum(), rel=0.1)
