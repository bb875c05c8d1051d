"""How well numbers predict what they were not fitted to: cross-validation at the price of a step.

Each record is cut into pieces in time, and the pieces are dealt out to folds, so that each fold holds pieces
of every record. Each fold in turn is left out; the numbers that the others would give follow from the optimum
by one Gauss–Newton step without that fold, inside the bounds (approximate leave-one-out, Beirami et al. 2017,
with pieces of records in place of samples, as Burman et al. 1994 ask for where samples are dependent). The
fold is then predicted with those numbers, exactly.

By pieces hypotheses are compared. Leaving whole records out asks more: of six motions of six kinds five may
not identify what the sixth shows, so it would choose the models that leave that out. But an effect that does
not predict whole records at all describes the records it was fitted to and nothing else.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from typing import NamedTuple, TypeAlias

import numpy as np
from numpy.typing import NDArray
from scipy.optimize import lsq_linear

from ...errors import ConvergenceError
from ...identification.equation_error.evidence import Evidence
from ...identification.estimation.least_squares import Fit, StackedRows
from ...identification.estimation.parameters import box
from ...identification.statistics.residuals import effective_size
from ..fitting.unpredictable import Key, Tally

Array = NDArray[np.float64]

SEGMENTS = 6
"""Pieces of a record whose sums of squares are kept apart: their scatter is the standard error of a sum."""
_FOLDS = 3
"""A fold is two pieces of each record: enough is left to identify what shows in one record alone."""
_LEAST_RECORDS = 3
"""Records from which one is left out as a whole: a single other one rarely identifies every number."""
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

    Parameters
    ----------
    evidence
        Of all blocks that share numbers.
    """
    folds = []
    for each in evidence:
        cuts = [len(part) for part in np.array_split(np.arange(len(each.floor.sigma)), SEGMENTS)]
        fold = np.repeat(np.arange(SEGMENTS) % _FOLDS, cuts)
        folds.append(fold if each.record.role == "fit" else np.full_like(fold, -1))
    return folds


def by_records(evidence: Sequence[Evidence]) -> list[NDArray[np.int64]]:
    """Return folds that are whole records; pieces where there are too few to leave one out.

    Parameters
    ----------
    evidence
        Of all blocks that share numbers.
    """
    names = sorted({e.record.name for e in evidence if e.record.role == "fit"})
    if len(names) < _LEAST_RECORDS:
        return by_pieces(evidence)
    return [
        np.full(len(e.floor.sigma), names.index(e.record.name) if e.record.role == "fit" else -1)
        for e in evidence
    ]


def tallies_of(evidence: Sequence[Evidence], best: Fit, folds: Folds | None) -> dict[Key, Tally]:
    """Return what a fit leaves over on each record, and what it would leave over on a record it has not seen.

    Parameters
    ----------
    evidence
        Of all blocks that share the numbers, on records for fits and for selection.
    best
        The fitted numbers.
    folds
        What is left out in turn; with ``None`` everything is predicted with the numbers as they are.
    """
    rows = StackedRows(evidence, best.parameters)
    x = np.array([p.inward(best.values[p.name]) for p in best.parameters])
    pieces = _pieces(rows, evidence, x, folds)
    predicted = [piece.residual for piece in pieces]
    if folds is not None and len(x):
        predicted = _predicted(rows, pieces, x)
    return {
        (p.evidence.driven.block.name, p.evidence.record.name): Tally(
            float(p.residual @ p.residual),
            len(p.residual),
            min(effective_size(p.residual), p.evidence.floor.independent),
            tuple(float(s @ s) for s in np.array_split(beside, SEGMENTS)),
        )
        for p, beside in zip(pieces, predicted, strict=True)
    }


def _pieces(rows: StackedRows, evidence: Sequence[Evidence], x: Array, folds: Folds | None) -> list[_Piece]:
    numbers = folds(evidence) if folds else [np.zeros(len(e.floor.sigma), dtype=np.int64) for e in evidence]
    return [_Piece(each, *rows.of(each, x), fold) for each, fold in zip(evidence, numbers, strict=True)]


def _predicted(rows: StackedRows, pieces: Sequence[_Piece], x: Array) -> list[Array]:
    """Return the residual of every piece, each fold predicted with the numbers that the other folds give."""
    predicted = [piece.residual.copy() for piece in pieces]
    folds = sorted({int(k) for piece in pieces for k in np.unique(piece.fold) if k >= 0})
    used = [piece for piece in pieces if piece.evidence.record.role == "fit"]
    whole = rows.prior_information + sum((p.slope.T @ p.slope for p in used), np.zeros((len(x), len(x))))
    gradient = rows.prior_gradient(x) + sum((p.slope.T @ p.residual for p in used), np.zeros(len(x)))
    for fold in folds:
        own = [(p.slope[p.fold == fold], p.residual[p.fold == fold]) for p in used]
        information = whole - sum((s.T @ s for s, _ in own), np.zeros_like(whole))
        pull = sum((s.T @ r for s, r in own), np.zeros(len(x)))
        moved = _without(information, pull, gradient, (x, *box(rows.parameters)[:2]))
        for place, piece in enumerate(pieces):
            mask = piece.fold == fold
            if mask.any():
                try:
                    predicted[place][mask] = rows.of(piece.evidence, moved)[0][mask]
                except ConvergenceError:
                    # No response there: what the linearised problem says is all that is known.
                    predicted[place][mask] = (piece.residual + piece.slope @ (moved - x))[mask]
    return predicted


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
    step = lsq_linear(
        root[:, None] * axes.T,
        target,
        (np.minimum(low - x, -1e-12), np.maximum(high - x, 1e-12)),
        method="bvls",
    ).x
    moved: Array = np.clip(x + step, low, high)
    return moved
