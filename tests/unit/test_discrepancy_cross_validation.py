"""What a fit would leave over on pieces of records that it has not seen, against fits without them."""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import replace
from types import SimpleNamespace
from typing import cast

import numpy as np
import pytest

from nlsdesign.discrepancy.selection.cross_validation import SEGMENTS, by_pieces, by_records, tallies_of
from nlsdesign.identification import Fit, Parameter
from nlsdesign.identification.equation_error.evidence import Evidence

ROWS, RANDOM = 60, np.random.default_rng(4)
SLOPES = {name: RANDOM.standard_normal((ROWS, 2)) for name in ("one", "two", "chosen")}
DATA = {name: s @ [1.5, -0.7] + 3.0 * RANDOM.standard_normal(ROWS) for name, s in SLOPES.items()}
ROLES = {"one": "fit", "two": "fit", "chosen": "selection"}
PRIOR = 0.4


def evidence(name: str) -> Evidence:
    """A record of a linear block."""

    def residual(values: Mapping[str, float]) -> tuple[np.ndarray, np.ndarray]:
        return DATA[name] - SLOPES[name] @ [values["a"], values["b"]], -SLOPES[name]

    driven = SimpleNamespace(block=SimpleNamespace(name="spring"), free=("a", "b"), stiff=False)
    record = SimpleNamespace(name=name, role=ROLES[name])
    floor = SimpleNamespace(sigma=np.ones(ROWS), independent=math.inf)
    return cast(Evidence, SimpleNamespace(driven=driven, record=record, floor=floor, residual=residual))


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
        others = piece % 3 != fold
        numbers = solved(
            np.vstack([SLOPES["one"][others], SLOPES["two"][others]]),
            np.concatenate([DATA["one"][others], DATA["two"][others]]),
        )
        for name, sums in by_hand.items():
            left = DATA[name] - SLOPES[name] @ numbers
            for k in range(fold, SEGMENTS, 3):
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
    others = np.concatenate([piece % 3 != 0] * 2)
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


def test_of_two_records_none_is_left_out_as_a_whole() -> None:
    assert tallies_of(EVERY, fitted(), by_records) == tallies_of(EVERY, fitted(), by_pieces)
