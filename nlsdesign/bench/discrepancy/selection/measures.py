"""What the rule compares: excess of blocks, gain in prediction, and what fitted numbers say of an effect."""

from __future__ import annotations

import math
from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass, field
from typing import NamedTuple

import numpy as np
import scipy

from ....foundation.arrays import Array
from ...identification.least_squares import Fit
from ...identification.parameters import Parameter, box
from ..effects.effect import Unknown

DECLARED = "declared numbers"
"""Name of the block that stands for the declared numbers: refitted numbers should lie in their ranges."""


@dataclass(frozen=True)
class Excess:
    """How far a block is from its noise floor."""

    block: str  # name of the block, or DECLARED
    unit: str
    floor: float  # noise floor, root mean square over the records, in the unit
    # fit, predicted: root mean square of the residual in the unit: as fitted, and with numbers from the other
    # records
    fit: float
    predicted: float
    chi2: float  # sum of squares of the latter in units of the floor
    # rows, effective: number of residuals, and of independent ones they are equivalent to
    rows: int
    effective: float
    open: bool  # whether that is more than noise
    # pieces: the sum of squares by record, for each piece of the record in time
    pieces: Mapping[str, tuple[float, ...]] = field(default_factory=dict)
    closed_on: frozenset[str] = frozenset()  # records on which, each taken alone, it is no more than noise
    # in_common: by record, the squares with the numbers of all records and what these cost the other records
    in_common: Mapping[str, float] = field(default_factory=dict)

    @property
    def excess(self) -> float:
        """Sum of squares beyond the floor."""
        return max(0.0, self.chi2 - self.rows)

    @property
    def mean_square(self) -> float:
        """Mean square in units of the floor."""
        return self.chi2 / max(self.rows, 1)

    @property
    def colour(self) -> float:
        """Number of residuals for each independent one."""
        return max(1.0, self.rows / max(self.effective, 1.0))


Excesses = Mapping[str, Excess]
"""By name of the block."""


class EffectNumber(NamedTuple):
    """A fitted number of an effect."""

    name: str  # full name
    # distance: departure from the value without effect, on a scale where that is finite; zero for a number
    # that only shapes the effect
    distance: float
    decides: bool  # whether the effect vanishes with it
    # error: standard error: as a share of the number where its logarithm is fitted, else in the size of its
    # fit
    error: float
    at_bound: bool  # whether it stands at a bound of its search that is no limiting form of the effect


@dataclass(frozen=True, eq=False)
class Standing:
    """What the fitted numbers of an effect say about its existence."""

    numbers: tuple[EffectNumber, ...] = ()
    # covariance: of the numbers that decide, on the scale of their distance, shape (deciding, deciding)
    covariance: Array = field(default_factory=lambda: np.zeros((0, 0)))

    @property
    def exclusion(self) -> float:
        """Standard errors by which "no effect" is excluded: of one normal number that is as improbable."""
        distances = np.array([n.distance for n in self.numbers if n.decides])
        if not len(distances):
            return math.inf
        statistic = float(distances @ np.linalg.solve(self.covariance, distances))
        if len(distances) == 1 or statistic > 100.0:
            return math.sqrt(max(statistic - len(distances) + 1.0, 0.0))
        return float(scipy.stats.norm.isf(0.5 * scipy.stats.chi2.sf(statistic, len(distances))))


def total_excess(excesses: Excesses) -> float:
    """Return the sum of squares beyond the floor over all blocks."""
    return sum(each.excess for each in excesses.values())


def explained(before: Excesses, after: Excesses) -> dict[str, float]:
    """Return the explained share of each open block's excess, as predicted."""
    return {
        name: 1.0 - after[name].excess / one.excess
        for name, one in before.items()
        if one.open and one.excess > 0
    }


class Gain(NamedTuple):
    """Gain in prediction, in effective squares of the noise."""

    # value, error: over all pieces of all records, and its standard error from their scatter
    value: float
    error: float
    rest: float  # the same without the piece that gains most


def gain(before: Excesses, after: Excesses) -> Gain:
    """Return by how much predictions gain from one hypothesis to another, over all blocks."""
    differences = np.concatenate(
        [
            np.subtract(pieces, after[name].pieces[record]) / max(one.colour, after[name].colour)
            for name, one in before.items()
            for record, pieces in one.pieces.items()
        ]
        or [np.zeros(0)]
    )
    count = len(differences)
    scatter = float(np.sum((differences - differences.mean()) ** 2)) if count else 0.0
    total, most = float(differences.sum()), float(differences.max()) if count else 0.0
    return Gain(total, math.sqrt(scatter * count / max(count - 1, 1)), total - most)


def gains_by_record(before: Excesses, after: Excesses) -> dict[str, float]:
    """Return by how much the prediction of each record gains, in effective squares of the noise."""
    gains: dict[str, float] = {}
    for name, one in before.items():
        for record, pieces in one.pieces.items():
            gained = sum(pieces) - sum(after[name].pieces[record])
            gains[record] = gains.get(record, 0.0) + gained / max(one.colour, after[name].colour)
    return gains


def common_gains(before: Excesses, after: Excesses) -> list[float]:
    """Return the gain of each record with the numbers of all, less what these cost the other records."""
    gains: dict[str, float] = {}
    for name, one in before.items():
        for record, squares in one.in_common.items():
            gained = (squares - after[name].in_common[record]) / max(one.colour, after[name].colour)
            gains[record] = gains.get(record, 0.0) + gained
    return list(gains.values())


_CLOSE = 0.005
"""Share of the range of a search within which a number stands at its bound."""


def standing_of(unknowns: Sequence[Unknown], fits: Iterable[Fit]) -> Standing:
    """Return distance from "no effect", errors and covariance of the numbers that an effect has brought."""
    known = {u.name: u for u in unknowns}
    for fit in fits:
        places = [k for k, p in enumerate(fit.parameters) if p.name in known]
        if places:
            return _standing(known, fit, places)
    return Standing()


def _standing(known: dict[str, Unknown], fit: Fit, places: Sequence[int]) -> Standing:
    low, high, _ = box(fit.parameters)
    numbers, slopes, deciding = [], [], []
    for k in places:
        parameter = fit.parameters[k]
        value, null = fit.values[parameter.name], known[parameter.name].null
        distance, slope = _distance(parameter, value, null)
        at, error = parameter.inward(value), math.sqrt(fit.covariance[k, k])
        reach = _CLOSE * (high[k] - low[k]) if math.isfinite(low[k]) else 0.0
        at_bound = bool(at - low[k] <= reach or high[k] - at <= reach)
        is_limit = at_bound and known[parameter.name].limiting
        numbers.append(
            EffectNumber(
                parameter.name,
                distance,
                null is not None,
                0.0 if is_limit else math.expm1(min(error, 100.0)) if parameter.scale == "log" else error,
                at_bound and not is_limit,
            )
        )
        if null is not None:
            deciding.append(k)
            slopes.append(slope)
    return Standing(tuple(numbers), fit.covariance[np.ix_(deciding, deciding)] * np.outer(slopes, slopes))


def _distance(parameter: Parameter, value: float, null: float | None) -> tuple[float, float]:
    """Return the departure from no effect, and its derivative with respect to the fitted number."""
    if null is None:
        return 0.0, 0.0
    slope = parameter.slope(value)
    if math.isinf(null):
        return 1.0 / value, -slope / value**2
    return value - null, slope
