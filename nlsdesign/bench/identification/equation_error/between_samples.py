"""Records read on a finer clock where a model bends between their samples.

The residual of a block is filtered over several samples. What the model does between two samples does not
enter it: the friction that turns over at a reversal, the corner of a contour that is passed in less than a
sample. The measured signals hold all that a filter of that width needs, so they are interpolated (quintic
splines, whose error at the frequencies that the filter passes is of sixth order), the model is evaluated in
between, and the same filter averages it. Whether that is needed is told by doubling the rate: twice as many
samples must change the filtered output by little of its noise.

Interpolated samples bring no information: which rows count, and what noise they have, is told by the samples
as measured. Records that show everything already stay as they are.
"""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from dataclasses import replace
from typing import NamedTuple

import numpy as np

from ....foundation.arrays import Array
from ....foundation.errors import ConvergenceError
from ..filters import Smoothing, kernel
from ..records.measurement import Record, RecordSet
from ..records.quality import Finding
from .block import BlockNoise, NoiseFloor
from .block_response import DrivenBlock

_RESOLVED = 0.05
"""Mean square of the change of a residual, in that of its noise, by twice as many samples: below it none are
needed. A block is open from a mean square of about 1.2 on."""
_MOST = 8
"""Samples in the place of one, at most."""
_OVER_SAMPLES = 1.0
"""Samples in the width of a filter from which it averages over them; below, samples are compared as such."""
_SHARE = 1e-3
"""Relative difference up to which two clocks are the same."""


def refined_filter(rows: Smoothing, width: float, times: int) -> Smoothing:
    """Return a filter of the same rows and the same width in time on a finer clock."""
    return replace(
        rows,
        count=(rows.count - 1) * times + 1,
        weights=kernel(width * times),
        stride=rows.stride * times,
        places=rows.places * times,
    )


def on_clock(records: RecordSet, step: float) -> RecordSet:
    """Return records with samples in between until none are further apart than a step."""
    times = [times_on(record, step) for record in records.records]
    changed = [(r, k) for r, k in zip(records.records, times, strict=True) if k > 1]
    if not changed:
        return records
    remark = Finding(
        ", ".join(record.name for record, _ in changed),
        f"sampled so slowly that the model bends between samples; evaluated every {step:.3g} s, the signals "
        "interpolated; a higher rate of recording would show more",
    )
    finer = tuple(r.refined(k) for r, k in zip(records.records, times, strict=True))
    return replace(records, records=finer, remarks=(*records.remarks, remark))


def noise_on_clock(read: BlockNoise, records: RecordSet, step: float) -> BlockNoise:
    """Return how a block reads records on a clock: the same rows with the same noise floor.

    They are made of what stands in between as well. ``records``: as measured. ``step``: time between samples
    of the clock in s.
    """
    floors = dict(read.floors)
    for record in records.records:
        times, floor = times_on(record, step), floors.get(record.name)
        if floor is not None and times > 1:
            count, width = len(floor.raw_sigma), floor.width / record.step
            raw = np.interp(np.arange((count - 1) * times + 1) / times, np.arange(count), floor.raw_sigma)
            finer = refined_filter(floor.filter, width, times)
            floors[record.name] = replace(floor, filter=finer, raw_sigma=raw)
    return replace(read, floors=floors)


def times_on(record: Record, step: float) -> int:
    """Return how many samples stand in the place of one on a clock."""
    return max(1, math.ceil(record.step / step - _SHARE))


class _BlockRecord(NamedTuple):
    """A record as a block reads it."""

    driven: DrivenBlock  # the block, ready for evaluation
    record: Record  # as measured
    floor: NoiseFloor


def resolving_step(
    blocks: Sequence[DrivenBlock], read: Mapping[str, BlockNoise], records: Sequence[Record]
) -> float:
    """Return the time between samples in s at which blocks show what they do; infinite if any is enough.

    Notes
    -----
    Blocks that are faster than a sample, as contact is, take short steps of their own between the samples;
    where there is one, nothing is interpolated.
    """
    block_records = [
        _BlockRecord(driven, record, floors[record.name])
        for driven, floors in ((driven, read[driven.block.name].floors) for driven in blocks)
        for record in records
        if record.name in floors
    ]
    if any(each.driven.stiff for each in block_records):
        return math.inf
    return min(
        (
            each.record.step / _needed(each)
            for each in block_records
            if each.floor.width >= _OVER_SAMPLES * each.record.step
        ),
        default=math.inf,
    )


def _needed(seen: _BlockRecord) -> int:
    """Return how many samples are needed in the place of one."""
    times = 1
    try:
        now = _filtered(seen, times)
        while times < _MOST:
            finer = _filtered(seen, 2 * times)
            if float(np.mean(((finer - now) / seen.floor.sigma) ** 2)) <= _RESOLVED:
                break
            times, now = 2 * times, finer
    except ConvergenceError:
        pass  # a fit tells that the declared numbers give no response
    return times


def _filtered(seen: _BlockRecord, times: int) -> Array:
    """Return the filtered output of a block, evaluated at several samples in the place of one."""
    record = seen.record.refined(times)
    output = seen.driven.respond(seen.driven.samples(record, {}), {}).output
    return refined_filter(seen.floor.filter, seen.floor.width / seen.record.step, times) @ output
