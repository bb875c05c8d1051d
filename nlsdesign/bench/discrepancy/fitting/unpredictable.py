"""Records that free flight makes unpredictable, however right the law.

Behind backlash a body flies freely between contacts. A contact that comes slightly too late sends it
on another course, and the prediction of that record stays wrong. Slow motion does not depend on it. So the
first look is at the slower records, and a quick record that is not predicted is judged by the others.
"""

from __future__ import annotations

import math
from collections.abc import Collection, Mapping, Sequence
from typing import NamedTuple, TypeAlias

import numpy as np

from ....foundation.errors import ConvergenceError
from ...identification.equation_error.evidence import Evidence
from ...identification.filters import derivative
from ...identification.least_squares import Fit
from ...identification.residuals import rmse

Key: TypeAlias = tuple[str, str]
"""Names of a block and of a record."""

_RECORDS_PER_QUICK_ONE = 4
"""Of so many records one, the quickest, is left out of the first look and may be unpredictable: a quarter is
what a diagnosis can spare."""
_STANDS_OUT = 2.0
"""Mean square by which it must exceed that of every other record of the block: records of one law differ by
less."""


_MEMBERS, _NEIGHBOURHOOD = 4, 0.01
"""Size of an ensemble, and how far its members differ at most on the fitted scale."""
_DIVERGING = 0.5
"""Share of the squares of a record by which neighbours must differ; independent courses differ by one."""


class Tally(NamedTuple):
    """What one block leaves over on one record.

    Parameters
    ----------
    squares
        Sum of squared residuals in units of the noise floor.
    rows
        Number of residuals.
    effective_size
        How many independent residuals these are equivalent to, coloured as they are.
    segments
        Sum of squares where the numbers come from the other records, one for each piece of the record in
        time. Empty where no record was left out.
    """

    squares: float
    rows: int
    effective_size: float
    segments: tuple[float, ...] = ()

    @property
    def predicted(self) -> float:
        """Sum of squares where the numbers come from the other records."""
        return math.fsum(self.segments) if self.segments else self.squares


def quickest(evidence: Sequence[Evidence]) -> frozenset[str]:
    """Return the quickest quarter of the records, rounded down, by the acceleration of what moves."""
    size: dict[str, float] = {}
    for each in evidence:
        for drive in each.driven.block.drives.values():
            if drive.order > 0:
                rows = derivative(each.record.trace[drive.signal], each.record.step, order=2)
                size[each.record.name] = max(rmse(rows), size.get(each.record.name, 0.0))
    by_size = sorted(size, key=lambda name: -size[name])
    return frozenset(by_size[: len(size) // _RECORDS_PER_QUICK_ONE])


def unpredictable(
    before: Mapping[Key, Tally], after: Mapping[Key, Tally], quick: Collection[str]
) -> frozenset[Key]:
    """Return where a quick record is predicted worse than before, or far worse than every other one."""

    def mean_square(key: Key) -> float:
        return after[key].squares / after[key].rows

    def stands_out(key: Key) -> bool:
        others = [mean_square(k) for k in after if k[0] == key[0] and k[1] not in quick]
        return bool(others) and mean_square(key) > _STANDS_OUT * max(others)

    def is_worse(key: Key) -> bool:
        return after[key].squares > before[key].squares + after[key].rows

    return frozenset(key for key in after if key[1] in quick and (is_worse(key) or stands_out(key)))


def diverges(evidence: Evidence, best: Fit) -> bool:
    """Tell whether neighbours of the fitted numbers predict a record as differently as it is mispredicted.

    Only that proves a record unpredictable: a wrong law that fails on it fails in its neighbourhood too. The
    members of the ensemble differ by a standard error of each number, a hundredth at most, in directions
    drawn once for all.
    """
    random = np.random.default_rng(0)
    error = np.minimum(np.sqrt(np.diag(best.covariance)), _NEIGHBOURHOOD)
    residual = evidence.residual(best.values)[0]
    spread = []
    for _ in range(_MEMBERS):
        moved = {
            p.name: p.outward(p.inward(best.values[p.name]) + step)
            for p, step in zip(best.parameters, error * random.standard_normal(len(error)), strict=True)
        }
        try:
            spread.append(float(np.sum((evidence.residual(moved)[0] - residual) ** 2)))
        except ConvergenceError:
            spread.append(math.inf)
    return float(np.median(spread)) >= _DIVERGING * float(residual @ residual)


def like_the_others(tallies: Mapping[Key, Tally], unpredictable: Collection[Key]) -> dict[Key, Tally]:
    """Return tallies in which an unpredictable record is as well predicted as the others of its block.

    ``unpredictable``: blocks and records; none of them counts for more than it did.
    """
    result = dict(tallies)
    for block, record in unpredictable:
        others = [tallies[k] for k in tallies if k[0] == block and k not in unpredictable]
        share = sum(t.squares for t in others) / max(sum(t.rows for t in others), 1)
        own = tallies[block, record]
        factor = min(1.0, share * own.rows / max(own.squares, 1e-300))
        result[block, record] = own._replace(
            squares=factor * own.squares, segments=tuple(factor * s for s in own.segments)
        )
    return result
