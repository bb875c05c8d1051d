"""How well numbers predict what they were not fitted to: cross-validation at the price of a step.

Each record is cut into pieces in time, and the pieces are dealt out to folds, so that each fold holds pieces
of every record. Each fold in turn is left out; the numbers that the others would give follow from the optimum
by one Gauss–Newton step without that fold, inside the bounds (approximate leave-one-out, Beirami et al. 2017,
with pieces of records in place of samples, as Burman et al. 1994 ask for where samples are dependent). Where
that step does not bring the others what its slopes promise, they are fitted by a descent. The fold is then
predicted with those numbers, exactly.

By pieces hypotheses are compared. Leaving whole records out asks more: of six motions of six kinds five may
not identify what the sixth shows, so it would choose the models that leave that out. But an effect that does
not predict whole records at all describes the records it was fitted to and nothing else. Where a record
depends sharply on the numbers, such as one that rings in a resonance, those of the others never predict it,
right as they are. Whole records are therefore judged in a second way too: with the numbers of all records,
at the price of the squares that these cost the others. That is the least of both together, so what the
numbers of the others leave open is no objection, and what they contradict is.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from contextlib import suppress
from typing import NamedTuple, TypeAlias

import numpy as np
import scipy
from numpy.typing import NDArray

from ....foundation.arrays import Array
from ....foundation.errors import ConvergenceError
from ...identification.equation_error.evidence import Evidence
from ...identification.least_squares import ENOUGH, Fit, StackedRows, minimise
from ...identification.parameters import box
from ...identification.residuals import effective_size
from ..fitting import Key, Tally

SEGMENTS = 6
"""Pieces of a record whose sums of squares are kept apart: their scatter is the standard error of a sum."""
_FOLDS = 3
"""A fold is two pieces of each record: enough is left to identify what shows in one record alone."""
_LEAST_RECORDS = 3
"""Records from which one is left out as a whole: a single other one rarely identifies every number."""
_KEPT = 0.5
"""Share of its promise that a step has to keep on the records that are left, to stand for a fit to them."""
_EVALUATIONS, _TOLERANCE = 20, 1e-3
"""Bounds of the descent in its place, as of a coarse fit."""
_AT_BOUND = 1e-6
_LEAST_INFORMATION = 1e-6
"""Information on the fitted scale that is taken for granted, as in the covariance of a fit."""


class _Piece(NamedTuple):
    """Rows of one block on one record: residuals and slopes at the optimum, and the fold of each row."""

    evidence: Evidence
    residual: Array
    slope: Array
    fold: NDArray[np.int64]


Folds: TypeAlias = Callable[[Sequence[Evidence]], list[NDArray[np.int64]]]
"""From evidence to the fold of each of its rows; below zero for rows that no fit has seen."""


def by_pieces(evidence: Sequence[Evidence]) -> list[NDArray[np.int64]]:
    """Return folds that hold pieces of every record.

    The first piece is in another fold from record to record: what shows at one phase of a motion that is
    repeated, such as the way back, is left out of some records and known from the others.
    """
    # In the order of the records, which follows from what they hold, not from their names.
    names, folds = list(dict.fromkeys(e.record.name for e in evidence)), []
    for each in evidence:
        cuts = [len(part) for part in np.array_split(np.arange(len(each.floor.sigma)), SEGMENTS)]
        fold = np.repeat((np.arange(SEGMENTS) + names.index(each.record.name)) % _FOLDS, cuts)
        folds.append(fold if each.record.role == "fit" else np.full_like(fold, -1))
    return folds


def by_records(evidence: Sequence[Evidence]) -> list[NDArray[np.int64]]:
    """Return folds that are whole records; pieces where there are too few to leave one out."""
    names = sorted({e.record.name for e in evidence if e.record.role == "fit"})
    if len(names) < _LEAST_RECORDS:
        return by_pieces(evidence)
    return [
        np.full(len(e.floor.sigma), names.index(e.record.name) if e.record.role == "fit" else -1)
        for e in evidence
    ]


def tallies_of(
    evidence: Sequence[Evidence], best: Fit, folds: Folds | None, *, exact: bool = True
) -> dict[Key, Tally]:
    """Return what a fit leaves over on each record, and what it would leave over on a record it has not seen.

    ``folds``: what is left out in turn; with ``None`` everything is predicted with the numbers as they are.
    ``exact``: whether a fold is predicted by the block itself; otherwise by its linearisation at the optimum,
    which is enough for what explains too little to be named.
    """
    rows = StackedRows(evidence, best.parameters)
    x = np.array([p.inward(best.values[p.name]) for p in best.parameters])
    pieces = _pieces(rows, evidence, x, folds)
    predicted = [piece.residual for piece in pieces]
    in_common = [float(piece.residual @ piece.residual) for piece in pieces]
    if folds is not None and len(x):
        predicted, in_common = _predicted(rows, pieces, x, exact=exact)
    return {
        (p.evidence.driven.block.name, p.evidence.record.name): Tally(
            float(p.residual @ p.residual),
            len(p.residual),
            min(effective_size(p.residual), p.evidence.floor.independent),
            tuple(float(s @ s) for s in np.array_split(beside, SEGMENTS)),
            common,
        )
        for p, beside, common in zip(pieces, predicted, in_common, strict=True)
    }


def _pieces(rows: StackedRows, evidence: Sequence[Evidence], x: Array, folds: Folds | None) -> list[_Piece]:
    numbers = folds(evidence) if folds else [np.zeros(len(e.floor.sigma), dtype=np.int64) for e in evidence]
    return [_Piece(each, *rows.of(each, x), fold) for each, fold in zip(evidence, numbers, strict=True)]


def _predicted(
    rows: StackedRows, pieces: Sequence[_Piece], x: Array, *, exact: bool
) -> tuple[list[Array], list[float]]:
    """Return the residual of every piece, each fold predicted with the numbers that the other folds give.

    Beside them its squares with the numbers of all folds, and what these cost the other folds.
    """
    predicted = [piece.residual.copy() for piece in pieces]
    in_common = [float(piece.residual @ piece.residual) for piece in pieces]
    folds = sorted({int(k) for piece in pieces for k in np.unique(piece.fold) if k >= 0})
    used = [piece for piece in pieces if piece.evidence.record.role == "fit"]
    whole = rows.prior_information + sum((p.slope.T @ p.slope for p in used), np.zeros((len(x), len(x))))
    gradient = rows.prior_gradient(x) + sum((p.slope.T @ p.residual for p in used), np.zeros(len(x)))
    for fold in folds:
        others = _Others(rows, used, fold, x)
        own = [(p.slope[p.fold == fold], p.residual[p.fold == fold]) for p in used]
        information = whole - sum((s.T @ s for s, _ in own), np.zeros_like(whole))
        pull = sum((s.T @ r for s, r in own), np.zeros(len(x)))
        moved = _without(information, pull, gradient, (x, *box(rows.parameters)[:2]))
        moved, price = others.descended(moved) if exact else (moved, 0.0)
        inside = sum(float(r @ r) for _, r in own)
        for place, piece in enumerate(pieces):
            mask = piece.fold == fold
            squares = float(piece.residual[mask] @ piece.residual[mask])
            in_common[place] += price * squares / max(inside, 1e-300)
            if mask.any():
                linear: Array = piece.residual + piece.slope @ (moved - x)
                predicted[place][mask] = linear[mask]
                if exact:
                    with suppress(ConvergenceError):
                        # Without a response there, what the linearised problem says is all that is known.
                        predicted[place][mask] = others.left(piece.evidence, moved)[mask]
    return predicted, in_common


class _Others:
    """What is left of the records without a fold, over the fitted scale."""

    def __init__(self, rows: StackedRows, used: Sequence[_Piece], fold: int, x: Array) -> None:
        self._rows, self._used, self._fold, self._x = rows, used, fold, x
        self._last: tuple[bytes, dict[int, Array]] = (b"", {})

    def descended(self, moved: Array) -> tuple[Array, float]:
        """Return numbers that one step has given, or those of a descent where the step is none.

        Beside them what the others gain by them, in squares: the price of the numbers of all records.

        The numbers of all records are open to a fit without the fold too. A step that does not bring it
        half of what its slopes promise has left the place where they hold: along what the others hardly
        know, it may lead anywhere, and it would be blamed on the effect.
        """
        before, slope = self(self._x)
        cost = float(before @ before)
        linear = before + slope @ (moved - self._x)
        promised = 0.5 * (cost - float(linear @ linear))
        if promised < ENOUGH:
            return moved, 0.0
        with suppress(ConvergenceError):  # a step that leads to where there is no response is none
            gained = cost - 2.0 * self._cost(moved)
            if gained >= 2.0 * _KEPT * promised:
                return moved, gained
        low, high, _ = box(self._rows.parameters)
        moved = minimise(self, self._x, (low, high), evaluations=_EVALUATIONS, share=_TOLERANCE).x
        return moved, max(cost - 2.0 * self._cost(moved), 0.0)

    def left(self, each: Evidence, x: Array) -> Array:
        """Return residuals of one record; those at the last numbers are remembered."""
        if self._last[0] != x.tobytes():
            self._last = x.tobytes(), {}
        known = self._last[1]
        if id(each) not in known:
            known[id(each)] = each.left(self._rows.values(x))
        return known[id(each)]

    def __call__(self, x: Array) -> tuple[Array, Array]:
        """Return residuals and slopes of the priors and of all that was fitted without the fold."""
        at_optimum = x is self._x
        pairs = [self._rows.prior_rows(x)]
        for piece in self._used:
            kept = piece.fold != self._fold
            if kept.any():
                pair = (piece.residual, piece.slope) if at_optimum else self._rows.of(piece.evidence, x)
                pairs.append((pair[0][kept], pair[1][kept]))
        return np.concatenate([r for r, _ in pairs]), np.vstack([s for _, s in pairs])

    def _cost(self, x: Array) -> float:
        """Return half the sum of squares that the call at these numbers would give."""
        left = [self.left(p.evidence, x)[p.fold != self._fold] for p in self._used]
        return 0.5 * float(np.sum(np.concatenate([self._rows.prior_rows(x)[0], *left]) ** 2))


def _without(information: Array, pull: Array, gradient: Array, place: tuple[Array, Array, Array]) -> Array:
    """Return the numbers that the records give without those that pull at them, inside the bounds.

    At an optimum inside the bounds the gradient of the whole vanishes; at a bound it holds the number there.
    """
    x, low, high = place
    held = (x - low < _AT_BOUND) | (high - x < _AT_BOUND)
    left = np.where(held, gradient, 0.0) - pull
    strength, axes = np.linalg.eigh(information)
    root = np.sqrt(np.maximum(strength, _LEAST_INFORMATION))
    target = -(axes.T @ left) / root
    walls = np.minimum(low - x, -1e-12), np.maximum(high - x, 1e-12)
    step = scipy.optimize.lsq_linear(root[:, None] * axes.T, target, walls, method="bvls").x
    moved: Array = np.clip(x + step, low, high)
    return moved
