"""Which rubber is best, by each figure of merit, and how probable it is that the order holds."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from scipy.special import ndtr

from nlsdesign.foundation.arrays import Array

from .merits import METRICS, MORE_IS_BETTER, Merits

DRAWS = 4000
PUBLISHED = "PMC-770"
RESOLUTION = 0.02
"""Standard deviation of the relative difference of two figures: as well as gain and figures are known."""
_REACH = 2.0
"""Standard deviations at which the factor of the modulus is cut off: the figures are not known beyond."""


@dataclass(frozen=True, eq=False)
class Ranking:
    """Rubbers in the order of one figure of merit.

    Parameters
    ----------
    metric
        By name.
    labels
        Of the rubbers that were compared, best first, by the median.
    values
        5 %, 50 % and 95 % quantile of each, shape (n, 3).
    best
        Probability that each is the best, shape (n,).
    over_published
        Probability that each is better than the rubber of the published actuator, shape (n,).
    first_two
        Probability that the first is better than the second.
    skewed
        The same if small loss tangents count more (evenly distributed in their logarithm).
    missed
        Labels of rubbers whose spring misses its target, or whose loop limit-cycles; they come last.
    """

    metric: str
    labels: tuple[str, ...]
    values: Array
    best: Array
    over_published: Array
    first_two: float
    skewed: float
    missed: tuple[str, ...]

    def quantiles(self, label: str) -> Array:
        """Return the quantiles of one rubber, shape (3,)."""
        row: Array = self.values[self.labels.index(label)]
        return row


def rankings(merits: Sequence[Merits], *, draws: int = DRAWS, seed: int = 1) -> dict[str, Ranking]:
    """Return the ranking by each figure of merit, and by the mean rank over all, by name.

    Loss tangents are drawn evenly from their ranges, each rubber for itself, factors of the moduli from
    normal distributions, one for each elastic curve.
    """
    chosen = [m for m in merits if m.met]
    drawn = {metric: _drawn(chosen, metric, draws, seed, skewed=False) for metric in METRICS}
    skewed = {metric: _drawn(chosen, metric, draws, seed, skewed=True) for metric in METRICS}
    for columns in (drawn, skewed):
        columns["mean_rank"] = _mean_rank(columns)
    missed = tuple(m.candidate.label for m in merits if not m.met)
    return {
        metric: _ranked(metric, [m.candidate.label for m in chosen], (drawn[metric], skewed[metric]), missed)
        for metric in drawn
    }


def _drawn(merits: Sequence[Merits], metric: str, draws: int, seed: int, *, skewed: bool) -> Array:
    """Return a figure of merit of each rubber over the draws, shape (rubbers, draws); less is better."""
    sign = -1.0 if metric in MORE_IS_BETTER else 1.0
    rows, curves = [], [each.candidate.elastic.name for each in merits]
    for number, each in enumerate(merits):
        share = np.random.default_rng([seed, number]).uniform(size=draws)
        # A rubber whose curve is another's is as much stiffer as that one.
        curve = curves.index(each.candidate.elastic.name)
        deviation = np.random.default_rng([seed, curve, 1]).normal(size=draws)
        low, high = each.candidate.loss.lower, each.candidate.loss.upper
        tangents = low * (high / low) ** share if skewed else low + (high - low) * share
        moduli = 1.0 + each.candidate.spread * np.clip(deviation, -_REACH, _REACH)
        if metric == "volume" and not each.candidate.own_curve:
            rows.append(np.full(draws, np.nan))  # its size would be that of another rubber
        else:
            rows.append(sign * each.at(metric, tangents, moduli))
    return np.array(rows)


def _mean_rank(columns: dict[str, Array]) -> Array:
    loop = [rows for metric, rows in columns.items() if metric != "volume"]
    mean: Array = np.mean([np.argsort(np.argsort(rows, axis=0), axis=0) + 1.0 for rows in loop], axis=0)
    # Who has no number in one of them has no mean.
    return np.where(np.all(np.isfinite(loop), axis=0), mean, np.nan)


def _ranked(
    metric: str, labels: Sequence[str], columns: tuple[Array, Array], missed: tuple[str, ...]
) -> Ranking:
    drawn, _ = columns
    if metric != "volume":
        missed = (*(labels[i] for i, row in enumerate(drawn) if not np.all(np.isfinite(row))), *missed)
    known = [i for i, row in enumerate(drawn) if np.all(np.isfinite(row))]
    order = sorted(known, key=lambda i: float(np.median(drawn[i])))
    if not order:
        none = np.zeros((0, 3))
        return Ranking(metric, (), none, none[:, 0], none[:, 0], float("nan"), float("nan"), missed)
    rows = drawn[order]
    sign = -1.0 if metric in MORE_IS_BETTER else 1.0
    values = np.sort(sign * np.quantile(rows, (0.05, 0.5, 0.95), axis=1).T, axis=1)
    lowest = np.min(rows, axis=0)
    least = rows <= lowest + RESOLUTION * np.abs(lowest)
    best = np.mean(least / np.sum(least, axis=0), axis=1)
    first_two, skewed = (
        _before(x[order[0]], x[order[1]]) if len(order) > 1 else float("nan") for x in columns
    )
    names = tuple(labels[i] for i in order)
    published = rows[names.index(PUBLISHED)] if PUBLISHED in names else np.full(rows.shape[1], np.nan)
    over = np.array([_before(row, published) for row in rows])
    return Ranking(metric, names, values, best, over, first_two, skewed, missed)


def _before(first: Array, second: Array) -> float:
    """Return the probability that the first is less than the second, both known as well as the resolution."""
    if np.any(np.isnan(first) | np.isnan(second)):
        return float("nan")
    scale = RESOLUTION * np.sqrt((first**2 + second**2) / 2.0)
    return float(np.mean(ndtr((second - first) / np.maximum(scale, np.finfo(float).tiny))))
