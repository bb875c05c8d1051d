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
from collections.abc import Sequence
from dataclasses import replace
from typing import NamedTuple

import numpy as np
from scipy.interpolate import make_interp_spline

from ....foundation.arrays import Array, Mask
from ....foundation.errors import ConvergenceError
from ....simulation import Trace
from ..filters import Smoothing, kernel
from ..records.clocks import Resolution
from ..records.measurement import Record, RecordSet
from ..records.quality import Finding
from .block_noise import BlockNoise
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


def refined(record: Record, times: int) -> Record:
    """Return a record with several samples in the place of one, between those that were measured.

    ``times``: how many; 1 leaves it as it is. What was held or averaged becomes the smooth signal with the
    same effect.
    """
    if times == 1:
        return record
    trace, share = record.trace, math.sqrt(times)
    clock = np.arange(len(trace), dtype=np.float64)
    finer = np.arange((len(trace) - 1) * times + 1) / times
    resolution = {}
    for signal in trace.signals:
        noise, quantum = record.resolution_of(signal)
        resolution[signal] = Resolution(share * noise, share * quantum)
    below, above = np.floor(finer).astype(int), np.ceil(finer).astype(int)
    return replace(
        record,
        trace=Trace(
            trace.time[0] + finer * record.step,
            {n: _between(clock, record.at_samples(n), record.masked_in([n]), finer) for n in trace.signals},
            trace.units,
            trace.name,
        ),
        resolution=resolution,
        masked={name: mask[below] | mask[above] for name, mask in record.masked.items()},
        sampling={},
    )


def _between(clock: Array, values: Array, masked: Mask, finer: Array) -> Array:
    """Return a signal between its samples; those that are masked have no part in it."""
    kept = ~masked
    result: Array = make_interp_spline(clock[kept], values[kept], k=5)(finer)
    return result


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
    finer = tuple(refined(r, k) for r, k in zip(records.records, times, strict=True))
    return replace(records, records=finer, remarks=(*records.remarks, remark))


def floor_on_clock(floor: BlockNoise, record: Record, width: float, step: float) -> BlockNoise:
    """Return the same rows of a record with the same noise floor, made of what stands in between as well.

    ``width``: standard deviation of the filter in s. ``step``: time between samples of the clock in s.
    """
    times = times_on(record, step)
    if times == 1:
        return floor
    count = len(floor.raw_sigma)
    raw = np.interp(np.arange((count - 1) * times + 1) / times, np.arange(count), floor.raw_sigma)
    return replace(floor, filter=refined_filter(floor.filter, width / record.step, times), raw_sigma=raw)


def times_on(record: Record, step: float) -> int:
    """Return how many samples stand in the place of one on a clock."""
    return max(1, math.ceil(record.step / step - _SHARE))


class BlockRecord(NamedTuple):
    """A record as a block reads it."""

    driven: DrivenBlock  # the block, ready for evaluation
    record: Record  # as measured
    width: float  # standard deviation of the filter in s
    rows: Smoothing  # the filter, with the rows that count
    sigma: Array  # noise floor of each row


def resolving_step(block_records: Sequence[BlockRecord]) -> float:
    """Return the time between samples in s at which blocks show what they do; infinite if any is enough.

    Notes
    -----
    Blocks that are faster than a sample, as contact is, take short steps of their own between the samples;
    where there is one, nothing is interpolated.
    """
    if any(each.driven.stiff for each in block_records):
        return math.inf
    return min(
        (
            each.record.step / _needed(each)
            for each in block_records
            if each.width >= _OVER_SAMPLES * each.record.step
        ),
        default=math.inf,
    )


def _needed(seen: BlockRecord) -> int:
    """Return how many samples are needed in the place of one."""
    times = 1
    try:
        now = _filtered(seen, times)
        while times < _MOST:
            finer = _filtered(seen, 2 * times)
            if float(np.mean(((finer - now) / seen.sigma) ** 2)) <= _RESOLVED:
                break
            times, now = 2 * times, finer
    except ConvergenceError:
        pass  # a fit tells that the declared numbers give no response
    return times


def _filtered(seen: BlockRecord, times: int) -> Array:
    """Return the filtered output of a block, evaluated at several samples in the place of one."""
    record = refined(seen.record, times)
    output = seen.driven.respond(seen.driven.samples(record, {}), {}).output
    return refined_filter(seen.rows, seen.width / seen.record.step, times) @ output
