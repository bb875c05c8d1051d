"""How well fitted numbers are known: what the residuals scatter, not what the noise was taken to be.

Residuals are coloured by filters, noise and what a model lacks. They are therefore grouped into segments of
the records, longer than the residuals remember, and the gradients of the segments tell how far the numbers
scatter (Liang and Zeger 1986), each as it would be if its segment had not been fitted (Bell and McCaffrey
2002): H⁻¹·(Σ g·gᵀ + P)·H⁻¹, with the information H = JᵀJ + P, the part P of the priors in it, and for each
segment s the gradient g = (1 − Hₛ·H⁻¹)⁻¹·Jₛᵀ·r.
Where a model is known to lack something, the segments are whole records.
Nothing is taken as better known than residuals of that size and colour allow where they are independent of
the slopes.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from typing import NamedTuple

import numpy as np

from ...foundation.arrays import Array, Indices
from .residuals import autocorrelation

_SEGMENTS = 60
"""Segments of all records together that are aimed at: enough for a variance to a fifth."""
_LEAST_ROWS = 8
_LEAST_RECORDS = 3
_LEAST_INFORMATION = 1e-6
"""Information on the fitted scale that is taken for granted, so that a covariance is never infinite."""
_LEAST_STRENGTH = 1e-13
"""Smallest eigenvalue of a correlation matrix that is more than rounding."""
_OWN_SHARE = 0.98
"""Share of the information that a segment may have on its own before it is left in: without it nothing would
be known."""


class Piece(NamedTuple):
    """Residuals of one block on one record."""

    block: str  # its name
    record: str  # its name
    time: Array  # of each row, in s from the begin of the record, shape (n,)
    # residual, slope: shapes (n,) and (n, parameters)
    residual: Array
    slope: Array


def robust_covariance(rows: Sequence[Piece], prior: Array) -> Array:
    """Return the covariance of fitted numbers.

    ``prior``: slopes of the residuals of the priors, shape (priors, parameters).
    """
    # Slopes and residuals of each segment, all blocks of a record together.
    spans: dict[str, float] = {}
    for each in rows:
        if len(each.time):
            spans[each.record] = max(spans.get(each.record, 0.0), float(each.time[-1]))
    length = sum(spans.values()) / _SEGMENTS
    segments = []
    for each in rows:
        count = max(1, round(spans.get(each.record, 0.0) / length)) if length > 0.0 else 1
        place = np.minimum(count * each.time / max(spans.get(each.record, 0.0), 1e-300), count - 1)
        segments.append(place.astype(int))
    return _at_least(_scatter(rows, prior, segments), independent_covariance(rows, prior))


def covariance_by_records(rows: Sequence[Piece], prior: Array, known: Array) -> Array:
    """Return the covariance where residuals hold what a model lacks, at least what is known without that.

    That misses alike in all segments of a record, whose motion is one and mostly repeats itself, so the
    records alone are independent of each other, and fewer than three tell nothing of a scatter. What comes or
    goes in the middle of each record cancels in its sum, so their halves are asked as well.
    """
    if len({each.record for each in rows}) < _LEAST_RECORDS:
        return known
    whole = [np.zeros(len(each.time), dtype=int) for each in rows]
    halves = [(each.time > 0.5 * each.time[-1:]).astype(int) for each in rows]
    return _at_least(_scatter(rows, prior, halves), _at_least(_scatter(rows, prior, whole), known))


def _scatter(rows: Sequence[Piece], prior: Array, segments: Sequence[Indices]) -> Array:
    """Return the covariance that the gradients of segments tell, by the segment in its record of each row."""
    information = sum((r.slope.T @ r.slope for r in rows), start=prior.T @ prior)
    # In the axes and units in which the information is one: the symmetric root.
    powers, directions = np.linalg.eigh(inverse_information(information))
    root: Array = (directions * np.sqrt(np.maximum(powers, 0.0))) @ directions.T
    scatter = root @ (prior.T @ prior) @ root
    parts: dict[tuple[str, int], tuple[list[Array], list[Array]]] = {}
    for each, place in zip(rows, segments, strict=True):
        for k in np.unique(place):
            slopes, residuals = parts.setdefault((each.record, int(k)), ([], []))
            slopes.append(each.slope[place == k])
            residuals.append(each.residual[place == k])
    for slopes, residuals in parts.values():
        scaled = np.vstack(slopes) @ root
        strength, axes = np.linalg.eigh(scaled.T @ scaled)
        freed = (axes.T @ (scaled.T @ np.concatenate(residuals))) / (1.0 - np.minimum(strength, _OWN_SHARE))
        gradient = axes @ freed
        scatter += np.outer(gradient, gradient)
    result: Array = root @ scatter @ root
    return result


def independent_covariance(rows: Sequence[Piece], prior: Array) -> Array:
    """Return the covariance if residuals are coloured noise that has nothing to do with the slopes."""
    information = prior.T @ prior
    for block in dict.fromkeys(r.block for r in rows):
        own = [r for r in rows if r.block == block]
        count = sum(len(r.residual) for r in own)
        squares = sum(float(r.residual @ r.residual) for r in own)
        slopes = sum((r.slope.T @ r.slope for r in own), start=np.zeros_like(information))
        freedom = max(count - int(np.linalg.matrix_rank(slopes)), 1)
        size = max(squares / freedom, 1e-12)
        information = information + slopes / (size * _colour([r.residual for r in own]))
    return inverse_information(information)


def _colour(residuals: Sequence[Array]) -> float:
    """Return by how much coloured residuals say less of a mean than independent ones: 1 + 2Σρₖ."""
    count = sum(len(r) for r in residuals)
    longest = max(len(r) for r in residuals)
    if longest < _LEAST_ROWS:
        return 1.0
    lags = min(200, longest - 1)
    rho = np.zeros(lags)
    for each in residuals:
        own = autocorrelation(each, min(lags, len(each) - 1))[1:] if len(each) > 1 else np.zeros(0)
        rho[: len(own)] += len(each) / count * own
    quiet = np.flatnonzero(rho < 2.0 / math.sqrt(count))
    return max(1.0, 1.0 + 2.0 * float(np.sum(rho[: quiet[0]] if len(quiet) else rho)))


def inverse_information(information: Array) -> Array:
    """Return the covariance that information gives, if residuals are white noise of unit size.

    ``information``: shape (parameters, parameters).
    """
    # What the records leave open altogether gets a large variance, not an infinite one.
    strength, axes = np.linalg.eigh(information)
    result: Array = np.asarray((axes / np.maximum(strength, _LEAST_INFORMATION)) @ axes.T, dtype=np.float64)
    return result


def _at_least(covariance: Array, least: Array) -> Array:
    """Return a covariance that in no direction is smaller than another."""
    # In the units of the numbers themselves, in which rounding leaves no direction negative.
    size = np.sqrt(np.diag(least))
    strength, axes = np.linalg.eigh(least / np.outer(size, size))
    deviation = np.sqrt(np.maximum(strength, _LEAST_STRENGTH))
    lower, upper = size[:, None] * axes * deviation, (axes / deviation).T / size
    inside = upper @ covariance @ upper.T
    strength, axes = np.linalg.eigh(0.5 * (inside + inside.T))
    whole = lower @ axes
    result: Array = (whole * np.maximum(strength, 1.0)) @ whole.T
    return result
