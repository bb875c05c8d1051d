"""Where a model disagrees with the records: the excess of each block over its noise floor."""

from __future__ import annotations

import math
from collections.abc import Sequence

from ...identification.equation_error.evidence import Bench
from ...identification.records.measurement import Role
from ..fitting.unpredictable import Tally
from .criteria import DECLARED, Excess, is_beyond_noise, is_beyond_prior
from .hypothesis import Hypothesis


def excesses(hypothesis: Hypothesis, bench: Bench) -> dict[str, Excess]:
    """Return the excess of each block, and of the declared numbers.

    Parameters
    ----------
    hypothesis
        Fitted.
    bench
        Its records and floors.
    """
    names = dict.fromkeys(block for block, _ in hypothesis.tallies)
    result = {name: _block_excess(hypothesis, bench, name) for name in names}
    prior, count = hypothesis.prior, sum(len(f.prior_z_scores()) for f in hypothesis.fits.values())
    typical, beyond = math.sqrt(prior / max(count, 1)), is_beyond_prior(prior, count)
    result[DECLARED] = Excess(DECLARED, "1", 1.0, typical, 1.0, (prior, 0.0), (count, 0), beyond)
    return result


def _block_excess(hypothesis: Hypothesis, bench: Bench, block: str) -> Excess:
    fitted = _total(hypothesis, bench, block, ("fit",))
    others = _total(hypothesis, bench, block, ("selection", "held_out"))
    ratios = [t.squares / t.rows if t.rows else 1.0 for t in (fitted, others)]
    floor = bench.typical_floor(block)
    return Excess(
        block,
        bench.units[block],
        floor,
        floor * math.sqrt(ratios[0]),
        floor * math.sqrt(ratios[1]),
        (fitted.squares, others.squares),
        (fitted.rows, others.rows),
        any(is_beyond_noise(r, t.effective_size) for r, t in zip(ratios, (fitted, others), strict=True)),
    )


def _total(hypothesis: Hypothesis, bench: Bench, block: str, roles: Sequence[Role]) -> Tally:
    names = {r.name for r in bench.records.of(*roles)}
    tallies = [t for (b, record), t in hypothesis.tallies.items() if b == block and record in names]
    return Tally(
        sum(t.squares for t in tallies), sum(t.rows for t in tallies), sum(t.effective_size for t in tallies)
    )
