"""What a record says about a block: residuals in units of their own noise floor.

Records read on a finer clock where a model bends between their samples.

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

import functools
import itertools
import math
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, field, replace
from typing import NamedTuple

import numpy as np
import scipy

from ....foundation.arrays import Array
from ....foundation.errors import ConvergenceError
from ....simulation import Trace
from ..filters import Smoothing, derivative, every, kernel
from ..records.measurement import Record, RecordSet
from ..records.quality import Finding
from ..records.sampling import FORMS, SAMPLED, Sampling, shifted
from .block import Block, BlockNoise, Filters, NoiseFloor
from .block_noise import noise_of_blocks, slowest_rate
from .block_response import DrivenBlock, Samples
from .inferred_sampling import Missing, plain_terms, remark_on_shift, shiftable, with_inferred_sampling
from .input_noise import with_colour_of_inputs
from .noise import Noise as Noise
from .noise import estimate_noise as estimate_noise

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
    refined = functools.cache(Record.refined)  # blocks ask for the same ones
    return min(
        (
            each.record.step / _needed(each, refined)
            for each in block_records
            if each.floor.width >= _OVER_SAMPLES * each.record.step
        ),
        default=math.inf,
    )


def _needed(seen: _BlockRecord, refined: Callable[[Record, int], Record]) -> int:
    """Return how many samples are needed in the place of one."""
    times = 1
    try:
        now = _filtered(seen, refined(seen.record, times), times)
        while times < _MOST:
            finer = _filtered(seen, refined(seen.record, 2 * times), 2 * times)
            if float(np.mean(((finer - now) / seen.floor.sigma) ** 2)) <= _RESOLVED:
                break
            times, now = 2 * times, finer
    except ConvergenceError:
        pass  # a fit tells that the declared numbers give no response
    return times


def _filtered(seen: _BlockRecord, record: Record, times: int) -> Array:
    """Return the filtered output of a block on a record that has several samples in the place of one."""
    output = seen.driven.respond(seen.driven.samples(record, {}), {}).output
    return refined_filter(seen.floor.filter, seen.floor.width / seen.record.step, times) @ output


_SPARSE = 0.5
"""Share of the power of a motion in the rows of a block, below which a remark says so: most is not judged."""
_COARSE_SHARE, _COARSEST = 0.04, 12
"""The coarse look skips samples while no motion changes by more than this share of its range."""
_REMEMBERED = 4
"""Last answers of a record that are kept: a fit ends a few steps that failed before its last."""


@dataclass(frozen=True, eq=False)
class Evidence:
    """A record seen by a block with free parameters."""

    driven: DrivenBlock
    record: Record
    floor: NoiseFloor
    samples: Samples
    # asked: last answers, by the free numbers: a fit begins and is judged where it was asked before
    asked: dict[tuple[float, ...], tuple[Array, Array]] = field(default_factory=dict, init=False, repr=False)

    def residual(self, values: Mapping[str, float]) -> tuple[Array, Array]:
        """Return measured minus predicted over the noise floor, and its derivatives."""
        key = tuple(values[name] for name in self.driven.free)
        if key not in self.asked:
            response, sigma = self.driven.respond(self._samples(values), values), self.floor.sigma
            answer = self._left(response.output), -(self.floor.filter @ response.slope) / sigma[:, None]
            if len(self.asked) == _REMEMBERED:
                del self.asked[next(iter(self.asked))]
            self.asked[key] = answer
        return self.asked[key]

    def left(self, values: Mapping[str, float]) -> Array:
        """Return measured minus predicted over the noise floor alone, for a fraction of the work."""
        return self._left(self.predicted(values))

    def predicted(self, values: Mapping[str, float]) -> Array:
        """Return the unfiltered output over the record."""
        return self.driven.output(self._samples(values), values)

    def _left(self, output: Array) -> Array:
        target = self.driven.block.target
        error = (self.record.as_computed(target) if target else 0.0) - output
        return (self.floor.filter @ error) / self.floor.sigma

    def _samples(self, values: Mapping[str, float]) -> Samples:
        if not self.driven.needs_new_samples:
            return self.samples
        return self.driven.samples(self.record, values, self.samples)


class Bench:
    """The records as every hypothesis sees them: same order, same filter, same rows, same noise floor.

    ``records``: all records; their order and their names make no difference, see
    :meth:`.RecordSet.in_canonical_order`. ``blocks``: of the declared model; they fix rows and noise floor.
    ``noise``: of the measured signals, where it is known from other records of the same bench. ``filters``:
    by name of the block, where they were chosen for other records of the same bench. ``clock``: time in s
    between samples at which the blocks show what they do, where that is known from other records of the same
    bench. ``sampling``: how inputs run between their samples, where that is known from other records of the
    same bench.
    """

    def __init__(
        self,
        records: RecordSet,
        blocks: Sequence[Block],
        *,
        noise: Noise | None = None,
        filters: Mapping[str, Filters] | None = None,
        clock: float | None = None,
        sampling: Mapping[str, Sampling] | None = None,
    ) -> None:
        self._blocks = tuple(blocks)
        self.records = records.read_as(sampling or {}).in_canonical_order()
        self.given_order = {record.name: place for place, record in enumerate(records.records)}
        self.noise = noise or estimate_noise(self.records, {b.target for b in blocks if b.target})
        read = noise_of_blocks(blocks, self.records, self.noise, filters or {})
        chosen = {name: each.filters for name, each in read.items()}
        if noise is None:
            coloured = with_colour_of_inputs(self.noise, self.records, list(read.values()))
            if coloured is not self.noise:
                self.noise, read = coloured, noise_of_blocks(blocks, self.records, coloured, chosen)
        self._as_measured = self.records, read
        if sampling is None:
            self.records = with_inferred_sampling(self.records, list(read.values()), plain_terms)
        if self.records is not self._as_measured[0]:
            self.noise = self.noise.read_as(self.records)
            read = noise_of_blocks(blocks, self.records, self.noise, chosen)
        self.block_noise = read
        self._as_read = self.records, read
        sparse = tuple(
            Finding(
                f"block '{name}'",
                f"is judged on rows with {100.0 * share:.0f} % of the power of its motion: elsewhere a "
                "reversal or a rest is within reach of its filter; sample faster, or reverse less often",
            )
            for name, share in covered(self).items()
            if share < _SPARSE
        )
        self.records = replace(self.records, remarks=(*self.records.remarks, *sparse))
        self._remarks = self.records.remarks
        self._thin: dict[tuple[str, str, bool], tuple[Record, NoiseFloor]] = {}
        if clock is None:
            driven = [self.driven(block, []) for block in blocks]
            clock = resolving_step(driven, read, self.records.deciding)
        self.clock = clock
        self.block_noise = {n: noise_on_clock(each, self.records, self.clock) for n, each in read.items()}
        self.records = on_clock(self.records, self.clock)

    def with_records(self, records: RecordSet) -> Bench:
        """Return other records of the same bench as they are seen with the same noise and filters."""
        own = [remark for remark in self._remarks if remark not in records.remarks]
        return Bench(
            replace(records, remarks=(*records.remarks, *own)),
            self._blocks,
            noise=self.noise,
            filters={name: each.filters for name, each in self.block_noise.items()},
            clock=self.clock,
            sampling={c.signal: c.sampling for c in self.records.columns if c.sampling},
        )

    def read_otherwise(self, records: RecordSet) -> Bench:
        """Return the same records, read otherwise between their samples, behind the filters chosen here."""
        filters = {name: each.filters for name, each in self._as_measured[1].items()}
        return Bench(records, self._blocks, filters=filters)

    def coloured_beside(self, blocks: Sequence[Block]) -> Bench | None:
        """Return the same records with the colour of inputs that a better model leaves, if it shows one.

        ``blocks``: of that model, with the names of the declared ones.
        """
        records, read = self._as_read
        asked = [read[block.name].read_by(block) for block in blocks if block.name in read]
        noise = with_colour_of_inputs(self.noise, records, asked)
        if noise is self.noise:
            return None
        return Bench(
            replace(records, remarks=self._remarks),
            self._blocks,
            noise=noise,
            filters={name: each.filters for name, each in read.items()},
            sampling={c.signal: c.sampling for c in records.columns if c.sampling},
        )

    def inferred(self, blocks: Sequence[Block], missing: Missing = plain_terms) -> RecordSet:
        """Return the records with inputs of which nothing is said as they tell it by some blocks.

        ``blocks``: of the declared model, or of a better one with the same names. ``missing``: what they may
        lack, see :mod:`.inferred_sampling`.
        """
        records, read = self._as_measured
        asked = [read[block.name].read_by(block) for block in blocks if block.name in read]
        return with_inferred_sampling(records, asked, missing)

    @property
    def shiftable(self) -> list[str]:
        """Measured motions that may be sampled earlier or later than the one that the inputs drive."""
        records, read = self._as_measured
        return [c.signal for c in shiftable(records, list(read.values())) if c.sampling is SAMPLED]

    @property
    def forms(self) -> Sequence[Sampling]:
        """Ways in which inputs of which nothing is said may run; a single one where all is said."""
        return FORMS if any(c.sampling is None for c in self._as_measured[0].columns) else FORMS[:1]

    def shifted(self, signal: str, samples: float, form: Sampling | None = None) -> RecordSet:
        """Return the records as measured, inputs read as here, and one motion earlier, with remarks.

        ``form``: of the inputs of which nothing is said.
        """
        known = {c.signal: c.sampling for c in self.records.columns if c.sampling}
        asked = [c for c in self._as_measured[0].columns if form and c.sampling is None]
        remarks = [remark_on_shift(self.records.column(signal), samples)]
        for column in asked:
            known[column.signal] = form or SAMPLED
            text = f"is taken as {known[column.signal].name}: so it fits best beside the shift of {signal}"
            remarks.append(Finding(f"column '{column.name}'", text))
        places = [each.place for each in remarks]
        others = [each for each in self.records.remarks if each.place not in places]
        read = self._as_measured[0].read_as({**known, signal: shifted(SAMPLED, samples)})
        return replace(read, remarks=(*others, *remarks))

    def driven(
        self, block: Block, free: Sequence[str], values: Mapping[str, float] | None = None
    ) -> DrivenBlock:
        """Return a block ready for evaluation on these records.

        ``block``, ``free``, ``values``: as for :class:`~.block_response.DrivenBlock`. The records that fits
        may see decide what is stiff; if there are none, as where a finished model is only looked at, all do.
        """
        records, read = self.records.of("fit") or self.records.records, self.block_noise.get(block.name)
        if read is None:
            return DrivenBlock(block, free, records=records, values=values)
        block, span, straightened = read.read_by(block).block, read.filters.span, read.filters.straightened
        return DrivenBlock(block, free, records=records, values=values, span=span, straightened=straightened)

    def evidence(
        self,
        driven: DrivenBlock,
        records: Sequence[Record],
        values: Mapping[str, float],
        *,
        coarse: bool = False,
    ) -> list[Evidence]:
        """Return what records say about a block.

        ``coarse``: whether blocks with a target are simulated on every k-th sample alone and compared
        unfiltered: a quick look, less sharp by the square root of the number of samples left out. Blocks that
        are faster than a sample are simulated on all.
        """
        name, thin = driven.block.name, coarse and driven.block.target is not None
        read = self.block_noise.get(name)
        result, floors = [], read.floors if read else {}
        for record in records:
            if record.name in floors:
                seen, floor = record, floors[record.name]
                if thin:
                    seen, floor = self._thinned(name, record, whole=driven.stiff)
                result.append(Evidence(driven, seen, floor, driven.samples(seen, values)))
        return result

    def slowest(self) -> dict[str, float]:
        """Return the least speed that some record resolves, by the measured signal that it is the rate of."""
        speeds: dict[str, float] = {}
        for block, record in itertools.product(self._blocks, self.records.deciding):
            span = self.block_noise[block.name].filters.span
            for name, drive in block.drives.items():
                if drive.order == 1 or name == block.moving:
                    rate = derivative(record.trace[drive.signal], record.step, order=drive.order, span=span)
                    least = slowest_rate(drive, record, self.noise, span, rate)
                    speeds[drive.signal] = min(least, speeds.get(drive.signal, math.inf))
        return speeds

    def _thinned(self, block: str, record: Record, *, whole: bool) -> tuple[Record, NoiseFloor]:
        """Return every k-th sample unfiltered; with ``whole`` all are simulated and the same are compared."""
        key = block, record.name, whole
        if key not in self._thin:
            moving = [s for s in self.records.signals if self.noise.rounded[s]] or list(self.records.signals)
            allowed = _COARSEST
            for signal in moving:
                span = max(float(np.ptp(r.trace[signal])) for r in self.records.records)
                smooth = scipy.ndimage.gaussian_filter1d(record.trace[signal], 2.0)
                fastest = float(np.max(np.abs(np.gradient(smooth))))
                allowed = min(allowed, int(_COARSE_SHARE * span / max(fastest, 1e-300)))
            k = max(1, allowed)
            trace = record.trace
            counted = np.flatnonzero(~record.masked_in(trace.signals)[::k])
            raw = self.block_noise[block].floors[record.name].raw_sigma[::k][counted]
            one = every(len(trace), k)
            masked = record.masked
            if not whole:
                trace = Trace(
                    trace.time[::k], {n: v[::k] for n, v in trace.signals.items()}, trace.units, trace.name
                )
                one = every(len(trace), 1)
                masked = {n: m[::k] for n, m in masked.items()}
            self._thin[key] = replace(record, trace=trace, masked=masked), NoiseFloor(one[counted], raw, raw)
        return self._thin[key]


def covered(bench: Bench) -> dict[str, float]:
    """Return by block the share of the power of its motion in the rows of the records that decide."""
    deciding = {record.name for record in bench.records.deciding}
    shares = {
        block: [floor.covered for record, floor in read.floors.items() if record in deciding]
        for block, read in bench.block_noise.items()
    }
    return {block: float(np.mean(each)) for block, each in shares.items() if each}
