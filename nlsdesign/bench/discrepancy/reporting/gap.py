"""The gap before and after, per record and over time, in the unit of each block."""

from __future__ import annotations

import numpy as np

from ....foundation.arrays import Array
from ....model import flatten
from ...identification.equation_error.block_noise import rate_span
from ...identification.filters import derivative
from ...identification.residuals import Binned, shapes
from ..screening.acting_effort import Acting
from ..selection.comparison import Comparison
from ..selection.hypothesis import Hypothesis
from .verdict import Course, RecordGap


def gaps_of(before: Hypothesis, after: Hypothesis, comparison: Comparison) -> tuple[RecordGap, ...]:
    """Return the error of every block on every record, the records in the order in which they were given."""
    gaps = []
    acting = Acting(comparison.bench, flatten(before.fitted))
    for then, now in zip(comparison.judged(before), comparison.judged(after), strict=True):
        first, last, floor = (
            float(np.sqrt(np.mean(np.square(r)))) for r in (then.error, now.error, then.floor.sigma)
        )
        name, record, unit = then.block.name, then.record, then.block.model.outputs[0].unit
        size = float(np.std(acting.filtered(then)))
        rows, beside = len(then.residual), acting.name(then.block)
        gap = RecordGap(name, record.name, record.role, first, last, floor, rows, unit, size, beside)
        gaps.append(gap)
    blocks, given = list(dict.fromkeys(g.block for g in gaps)), comparison.bench.given_order
    return tuple(sorted(gaps, key=lambda gap: (blocks.index(gap.block), given[gap.record])))


def course_of(before: Hypothesis, after: Hypothesis, comparison: Comparison, block: str) -> Course:
    """Return a held-out record of a block over time; the one with the largest error before.

    Everything passes the filter of the block, so that the errors are those of :func:`gaps_of`.
    """
    pairs = zip(comparison.judged(before), comparison.judged(after), strict=True)
    own = [(a, b) for a, b in pairs if a.block.name == block]
    held = [pair for pair in own if pair[0].record.role == "held_out"] or own
    then, now = max(held, key=lambda pair: float(np.mean(np.square(pair[0].error))))
    acting = Acting(comparison.bench, flatten(before.fitted))
    measured = acting.filtered(then)
    return Course(
        then.record.name,
        acting.name(then.block),
        then.block.model.outputs[0].unit,
        then.record.trace.time[then.floor.places],
        measured,
        measured - then.error,
        measured - now.error,
        float(np.sqrt(np.mean(np.square(then.floor.sigma)))),
        then.record.role,
    )


def shapes_of(
    before: Hypothesis, after: Hypothesis, comparison: Comparison, block: str
) -> dict[str, tuple[Binned, Binned]]:
    """Return the residual of a block over every measured signal, before and after, from all records."""
    first, last = (_shapes(h, comparison, block) for h in (before, after))
    return {name: (first[name], last[name]) for name in first if name in last}


def _shapes(hypothesis: Hypothesis, comparison: Comparison, block: str) -> dict[str, Binned]:
    bench = comparison.bench
    judged = [e for e in comparison.judged(hypothesis) if e.block.name == block]
    error = np.concatenate([e.error for e in judged])

    def gathered(signal: str, order: int) -> Array:
        span = rate_span(bench.records.records, signal) if order else 0.0
        rows = [
            derivative(e.record.trace[signal], e.record.step, order=order, span=span)[e.floor.places]
            for e in judged
        ]
        return np.concatenate(rows)

    signals = {s: gathered(s, 0) for s in bench.records.signals}
    motion = next((s for s in bench.records.signals if bench.noise.rounded[s]), bench.records.signals[0])
    time = np.concatenate([(e.record.trace.time - e.record.trace.time[0])[e.floor.places] for e in judged])
    return shapes(error, signals, speed=gathered(motion, 1), time=time, step=bench.filters[block].spacing)
