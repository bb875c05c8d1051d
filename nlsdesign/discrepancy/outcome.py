"""The gap before and after, per record and over time, in the unit of each block."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from ..identification.evidence import STRIDE, Evidence
from ..identification.filters import derivative
from ..identification.residuals import Binned, shapes
from .compare import Comparison, Hypothesis
from .verdict import Course, RecordGap


def gaps_of(before: Hypothesis, after: Hypothesis, comparison: Comparison) -> tuple[RecordGap, ...]:
    """Return the error of every block on every record.

    Parameters
    ----------
    before, after
        Fitted to all samples.
    comparison
        Knows the records.
    """
    later = {_key(e): e for e in comparison.evidence(after)}
    found = []
    for each in comparison.evidence(before):
        sigma = each.floor.sigma
        then, now = (
            each.residual(before.values)[0] * sigma,
            later[_key(each)].residual(after.values)[0] * sigma,
        )
        unit = each.driven.block.model.outputs[0].unit
        first, last, floor = (float(np.sqrt(np.mean(np.square(row)))) for row in (then, now, sigma))
        name = each.driven.block.name
        found.append(
            RecordGap(name, each.record.name, each.record.role, first, last, floor, len(sigma), unit)
        )
    return tuple(found)


def course_of(before: Hypothesis, after: Hypothesis, comparison: Comparison, block: str) -> Course:
    """Return a held-out record of a block over time; the one with the largest error before.

    Parameters
    ----------
    before, after, comparison
        As above.
    block
        Name.
    """
    mine = [e for e in comparison.evidence(before) if e.driven.block.name == block]
    held = [e for e in mine if e.record.role == "held_out"] or mine
    worst = max(held, key=lambda e: float(np.mean(np.square(e.residual(before.values)[0] * e.floor.sigma))))
    later = {_key(e): e for e in comparison.evidence(after)}[_key(worst)]
    target = worst.driven.block.target
    trace = worst.record.trace
    measured = trace[target] if target else np.zeros(len(trace))
    output = worst.driven.block.model.outputs[0]
    return Course(
        worst.record.name,
        target or output.description,
        output.unit,
        trace.time,
        measured,
        worst.predicted(before.values),
        later.predicted(after.values),
        float(np.mean(worst.floor.raw_sigma)),
    )


def _key(evidence: Evidence) -> tuple[str, str]:
    return evidence.driven.block.name, evidence.record.name


def shapes_of(
    before: Hypothesis, after: Hypothesis, comparison: Comparison, block: str
) -> dict[str, tuple[Binned, Binned]]:
    """Return the residual of a block over every measured signal, before and after, from all records.

    Parameters
    ----------
    before, after, comparison, block
        As above.
    """
    found = [_shapes(h, comparison, block) for h in (before, after)]
    return {name: (found[0][name], found[1][name]) for name in found[0] if name in found[1]}


def _shapes(hypothesis: Hypothesis, comparison: Comparison, block: str) -> dict[str, Binned]:
    bench = comparison.bench
    mine = [e for e in comparison.evidence(hypothesis) if e.driven.block.name == block]
    error = np.concatenate([e.residual(hypothesis.values)[0] * e.floor.sigma for e in mine])

    def gathered(signal: str, order: int) -> NDArray[np.float64]:
        rows = [derivative(e.record.trace[signal], e.record.step, order=order)[e.floor.places] for e in mine]
        return np.concatenate(rows)

    signals = {s: gathered(s, 0) for s in bench.records.signals}
    motion = next((s for s in bench.records.signals if bench.noise.rounded[s]), bench.records.signals[0])
    return shapes(error, signals, gathered(motion, 1), STRIDE * mine[0].record.step)
