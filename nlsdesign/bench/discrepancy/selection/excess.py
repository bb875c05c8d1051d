"""Where a model disagrees with the records: the excess of each block over its noise floor."""

from __future__ import annotations

import math

from ...identification.equation_error.evidence import Bench
from .criteria import Criteria, is_beyond_noise, is_beyond_prior
from .hypothesis import Hypothesis
from .measures import DECLARED, Excess


def excesses(hypothesis: Hypothesis, bench: Bench, criteria: Criteria) -> dict[str, Excess]:
    """Return the excess of each block, and of the declared numbers."""
    names = dict.fromkeys(block for block, _ in hypothesis.tallies)
    result = {name: _block_excess(hypothesis, bench, name, criteria) for name in names}
    prior, count = hypothesis.prior, sum(len(f.prior_z_scores()) for f in hypothesis.fits.values())
    # What scatters the residuals of an open block is not noise, and excuses no number.
    closed = not any(each.open for each in result.values())
    expected = hypothesis.expected_prior if closed else float(count)
    typical, beyond = math.sqrt(prior / max(count, 1)), is_beyond_prior(criteria, prior, expected)
    result[DECLARED] = Excess(
        DECLARED, "1", 1.0, typical, typical, prior, count, float(max(count, 1)), beyond
    )
    return result


def _block_excess(hypothesis: Hypothesis, bench: Bench, block: str, criteria: Criteria) -> Excess:
    tallies = {record: t for (b, record), t in hypothesis.tallies.items() if b == block}
    rows = sum(t.rows for t in tallies.values())
    effective = sum(t.effective_size for t in tallies.values())
    fitted, predicted = sum(t.squares for t in tallies.values()), sum(t.predicted for t in tallies.values())
    floor = bench.typical_floor(block)
    return Excess(
        block,
        bench.units[block],
        floor,
        floor * math.sqrt(fitted / max(rows, 1)),
        floor * math.sqrt(predicted / max(rows, 1)),
        predicted,
        rows,
        effective,
        is_beyond_noise(criteria, predicted / max(rows, 1), effective, bench.known_from(block)),
        {record: t.segments or (t.squares,) for record, t in tallies.items()},
    )
