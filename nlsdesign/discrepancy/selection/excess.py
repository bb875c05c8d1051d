"""Where a model disagrees with the records: the excess of each block over its noise floor."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass

from ...identification.equation_error.evidence import Bench
from ...identification.records.measurement import Role
from .hypothesis import Hypothesis

LEAST_EXCESS = 0.4
"""Mean square above the floor that is let pass: filters and rounding are known no better."""
_SIGNIFICANT = 5.0
_PRIOR_PER_NUMBER = 3.0
"""Squared departure, in prior standard deviations, of a number at the edge of its declared range."""
DECLARED = "declared numbers"
"""Name of the block that stands for the declared numbers: refitted numbers should lie in their ranges."""


@dataclass(frozen=True)
class Excess:
    """How far a block is from its noise floor.

    Parameters
    ----------
    block
        Name of the block, or :data:`DECLARED`.
    unit
        Of the residual.
    floor
        Noise floor, root mean square over the records, in the unit.
    fit, held_out
        Root mean square of the residual on the records of each role, in the unit.
    chi2, rows
        Sum of squares in units of the floor, and number of residuals, over fit and held-out records.
    open
        Whether that is more than noise.
    """

    block: str
    unit: str
    floor: float
    fit: float
    held_out: float
    chi2: tuple[float, float]
    rows: tuple[int, int]
    open: bool

    @property
    def excess(self) -> tuple[float, float]:
        """Sum of squares beyond the floor, on fit and held-out records."""
        first, second = (max(0.0, c - n) for c, n in zip(self.chi2, self.rows, strict=True))
        return first, second


def excesses(hypothesis: Hypothesis, bench: Bench) -> dict[str, Excess]:
    """Return the excess of each block, and of the declared numbers.

    Parameters
    ----------
    hypothesis
        Fitted.
    bench
        Its records and floors.
    """
    names = dict.fromkeys(block for block, _ in hypothesis.chi2)
    found = {name: _block_excess(hypothesis, bench, name) for name in names}
    count = sum(len(f.strain()) for f in hypothesis.fits.values())
    beyond = hypothesis.prior > _PRIOR_PER_NUMBER * count
    strained = math.sqrt(hypothesis.prior / max(count, 1))
    found[DECLARED] = Excess(DECLARED, "1", 1.0, strained, 1.0, (hypothesis.prior, 0.0), (count, 0), beyond)
    return found


def _block_excess(hypothesis: Hypothesis, bench: Bench, block: str) -> Excess:
    parts = [_sums(hypothesis, bench, block, roles) for roles in (("fit",), ("selection", "held_out"))]
    floor = bench.typical_floor(block)
    chi2, rows = (parts[0][0], parts[1][0]), (parts[0][1], parts[1][1])
    ratios = [c / n if n else 1.0 for c, n in zip(chi2, rows, strict=True)]
    is_open = any(
        ratio > 1.0 + max(LEAST_EXCESS, _SIGNIFICANT * math.sqrt(2.0 / max(size, 1.0)))
        for ratio, (_, _, size) in zip(ratios, parts, strict=True)
    )
    fitted, held = (floor * math.sqrt(r) for r in ratios)
    return Excess(block, bench.units[block], floor, fitted, held, chi2, rows, is_open)


def _sums(
    hypothesis: Hypothesis, bench: Bench, block: str, roles: Sequence[Role]
) -> tuple[float, int, float]:
    """Return sum of squares, number of residuals, and how many independent ones these are worth."""
    names = {r.name for r in bench.records.of(*roles)}
    keys = [k for k in hypothesis.chi2 if k[0] == block and k[1] in names]
    return (
        sum(hypothesis.chi2[k] for k in keys),
        sum(hypothesis.rows[k] for k in keys),
        sum(hypothesis.worth[k] for k in keys),
    )


def total_excess(found: dict[str, Excess]) -> float:
    """Return the sum of squares beyond the floor over all blocks and roles.

    Parameters
    ----------
    found
        From :func:`excesses`.
    """
    return sum(sum(each.excess) for each in found.values())


def explained(before: dict[str, Excess], after: dict[str, Excess]) -> dict[str, float]:
    """Return the share of each open block's excess that is gone: the smaller of fit and held-out records.

    Parameters
    ----------
    before, after
        From :func:`excesses`, of two hypotheses on the same rows.
    """
    found = {}
    for name, one in before.items():
        if one.open:
            pairs = zip(one.excess, after[name].excess, one.rows, strict=True)
            found[name] = min(1.0 - b / a for a, b, n in pairs if n and a > LEAST_EXCESS * n)
    return found
