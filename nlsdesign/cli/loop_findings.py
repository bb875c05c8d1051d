"""What of a closed loop does not hold, in sentences: frequencies side by side with one verdict share one."""

from __future__ import annotations

import itertools
import math
from collections.abc import Iterator, Sequence
from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from ..feedback.control.evaluation.loop_verdict import LoopVerdict


def stretches(frequencies: Sequence[float], verdicts: Sequence[LoopVerdict]) -> Iterator[tuple[str, str]]:
    """Yield frequencies and what they have in common, for each stretch that does not hold."""
    pairs = zip(map(float, frequencies), verdicts, strict=True)
    for _, group in itertools.groupby(pairs, key=lambda pair: pair[1].state):
        members = list(group)
        if members[0][1].holds:
            continue
        ends = [f for f, _ in members]
        where = _span(ends[0], ends[-1], "Hz")
        if len(members) > 1:
            where = f"{where} ({len(members)} of {len(frequencies)} frequencies)"
        yield where, _shared([verdict for _, verdict in members])


def _shared(verdicts: Sequence[LoopVerdict]) -> str:
    """Return the words of verdicts of one state, with the ranges of their numbers."""
    if len(verdicts) == 1:
        return str(verdicts[0])
    words = verdicts[0].state
    if not math.isnan(verdicts[0].frequency):
        sizes, paces = [v.amplitude for v in verdicts], [v.frequency for v in verdicts]
        size, pace = _span(min(sizes), max(sizes), "N·m", form=".2g"), _span(min(paces), max(paces), "Hz")
        words += f" of ±{size} at {pace}, current up to {max(v.peak_current for v in verdicts):.3g} A"
    saturated = [100.0 * v.saturated for v in verdicts]
    if max(saturated):
        words += (
            f", {_span(min(saturated), max(saturated), '%', form='.0f')} of the time at the current limit"
        )
    return words


def _span(low: float, high: float, unit: str, *, form: str = ".3g") -> str:
    ends = [format(each, form) for each in (low, high)]
    return f"{ends[0]} {unit}" if ends[0] == ends[1] else f"{ends[0]} to {ends[1]} {unit}"
