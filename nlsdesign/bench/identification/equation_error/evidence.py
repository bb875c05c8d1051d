"""What a record says about a block: residuals in units of their own noise floor."""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray
from scipy.ndimage import gaussian_filter1d

from ....foundation.arrays import Array, Mask
from ....foundation.errors import MeasurementError
from ....foundation.quantity import with_unit
from ....simulation import Trace
from ..filters import Smoothing, difference, every, filter_weights, smoothing
from ..records.measurement import Record, RecordSet, in_canonical_order
from ..residuals import rmse
from .between_samples import BlockRecord, on_clock, refined_filter, resolving_step, times_on
from .block import Block, Drive
from .block_response import DrivenBlock, Samples
from .filter_choice import Filters, chosen_filters, measured_inputs, output_slopes, paces, rectified
from .noise import Noise as Noise
from .noise import NoisePart, independent_number
from .noise import estimate_noise as estimate_noise

_NOISY, _SMEARED = 5.0, 0.027
"""A moving block says nothing where its speed is below so many times the noise of the speed, and so much of
the span of the rate times the acceleration: where friction bends the motion at a reversal, a rate misses by
a twentieth of span and jump of the acceleration, and a usual jump is half the root mean square of it."""
_SLOW_SHARE = 1e-2
"""Of the filter of a row that may reach into a reversal."""
_RECTIFIED = 0.1
"""Share of the noise floor up to which a block may rectify the noise of an input: 0.01 of its square."""
_LEAST_ROWS = 20
_COARSE_SHARE, _COARSEST = 0.04, 12
"""The coarse look skips samples while no motion changes by more than this share of its range."""


@dataclass(frozen=True, eq=False)
class Floor:
    """How a block reads a record: filter, rows that count, and their noise floor.

    Parameters
    ----------
    filter
        Shape (rows, n): zero-phase filter, thinned, without the rows that say nothing.
    sigma
        Noise floor of each row, in the unit of the block.
    raw_sigma
        Noise floor of each unfiltered sample, shape (n,): only for blocks with a target.
    independent
        How many independent rows its own noise makes of them at most.
    known
        Effective squares of that noise from which the floor is known; infinite where it is white.
    """

    filter: Smoothing
    sigma: Array
    raw_sigma: Array
    independent: float = math.inf
    known: float = math.inf

    @property
    def places(self) -> NDArray[np.int64]:
        """Index of the sample in the middle of each row."""
        return self.filter.places


def noise_floor(block: Block, record: Record, noise: Noise, filters: Filters) -> Floor:
    """Return filter and noise floor of a block on a record.

    The noise of each input is carried to the output by the slope of the output with respect to it.
    """
    n, step, span = len(record.trace), record.step, filters.span
    stride = max(1, round(filters.spacing / step))
    margin = max(len(difference(d.order, span / step)) // 2 for d in block.drives.values())
    matrix = smoothing(n, filters.width / step, stride, margin=margin)
    masked = record.masked_in([*(drive.signal for drive in block.drives.values()), block.target or ""])
    matrix = matrix[~matrix.touched_by(masked)]
    inputs = measured_inputs(block, record, span)
    if block.moving is not None:
        drive = block.drives[block.moving]
        rate = inputs[[v.name for v in block.model.inputs].index(block.moving)]
        noisy = _NOISY * _rate_noise(drive, noise, step, span)
        # A rate that is measured itself is not taken over a span.
        blurred = _SMEARED * span * rmse(np.gradient(rate, step)) if drive.order else 0.0
        # The filter smears what happens at a reversal; so its whole reach must be in motion.
        slow = np.abs(rate) < math.hypot(noisy, blurred)
        moving = _in_motion(matrix, slow | _reverses(rate))
        # A motion that is never between two reversals for long, as one that shakes, is read across them.
        matrix = moving if len(moving.places) >= _LEAST_ROWS else _in_motion(matrix, slow)
    variance, raw = _variances(block, record, noise, filters, inputs)
    spacing = stride * step
    memory = _memory(block, step, noise, filters, inputs)
    whole = [NoisePart(p.variance / float(np.mean(variance)), p.time) for p in memory]
    lengths = [noise.seen[s] for s in _heard(block) if s in noise.seen]
    squares = [
        sum(independent_number(whole, max(1, round(t / spacing)), spacing) for t in s) for s in lengths
    ]
    return Floor(
        matrix,
        np.sqrt(variance[matrix.places]),
        np.sqrt(raw),
        independent_number(whole, len(matrix.places), spacing) if whole else math.inf,
        min(squares, default=math.inf),
    )


def _on_clock(floor: Floor, width: float, times: int) -> Floor:
    """Return the same rows with the same noise floor, made of several samples in the place of one."""
    if times == 1:
        return floor
    count = len(floor.raw_sigma)
    raw = np.interp(np.arange((count - 1) * times + 1) / times, np.arange(count), floor.raw_sigma)
    return replace(floor, filter=refined_filter(floor.filter, width, times), raw_sigma=raw)


def _in_motion(matrix: Smoothing, still: Mask) -> Smoothing:
    """Return the rows that hardly reach into what is still."""
    return matrix[np.flatnonzero(matrix @ still.astype(float) < _SLOW_SHARE)]


def _reverses(rate: Array) -> Mask:
    """Tell which samples have a reversal beside them: when in between it happened, no sample tells."""
    between = rate[1:] * rate[:-1] < 0.0
    beside: Mask = np.append(between, False) | np.append(False, between)
    return beside


def _heard(block: Block) -> list[str]:
    """Return the signals whose slow noise a block passes: not those of which it takes rates."""
    drives = [d.signal for d in block.drives.values() if d.order == 0]
    return list(dict.fromkeys([*([block.target] if block.target else []), *drives]))


def _memory(block: Block, step: float, noise: Noise, filters: Filters, inputs: Array) -> list[NoisePart]:
    """Return the parts of the noise in a block's residual that remember, root mean square over a record."""
    if not any(noise.parts.get(signal) for signal in _heard(block)):
        return []
    weights = filter_weights(filters.width, 0, step)
    memory = list(noise.memory(block.target, weights, step)) if block.target else []
    gains = output_slopes(block, inputs, max(1, round(filters.spacing / step)))
    for i, variable in enumerate(block.model.inputs):
        drive = block.drives.get(variable.name)
        if drive is not None and drive.order == 0:
            square = float(np.mean(gains[i] ** 2))
            parts = noise.memory(drive.signal, weights, step)
            memory += [NoisePart(square * p.variance, p.time) for p in parts]
    return memory


def _rate_noise(drive: Drive, noise: Noise, step: float, span: float) -> float:
    """Return the noise of a rate, measured itself or the derivative of a motion."""
    return noise.behind(drive.signal, filter_weights(0.0, drive.order, step, span), step)


def _variances(
    block: Block, record: Record, noise: Noise, filters: Filters, inputs: Array
) -> tuple[Array, Array]:
    model, step = block.model, record.step
    stride = max(1, round(filters.spacing / step))
    gains = output_slopes(block, inputs, stride)
    own = noise.behind(block.target, filter_weights(filters.width, 0, step), step) if block.target else 0.0
    variance = np.full(gains.shape[1], own**2)
    raw = np.full(gains.shape[1], noise.deviation(block.target) ** 2 if block.target else 0.0)
    for i, variable in enumerate(model.inputs):
        drive = block.drives.get(variable.name)
        if drive is None:
            continue
        # Rounding of a signal at rest is a constant error that no filter takes away.
        constant = noise.rounded[drive.signal] and drive.order == 0
        weights = filter_weights(filters.width, drive.order, step, filters.span)
        deviation = noise.deviation(drive.signal)
        behind = deviation if constant else noise.behind(drive.signal, weights, step)
        variance += (gains[i] * behind) ** 2
        raw += (gains[i] * deviation) ** 2 if drive.order == 0 else 0.0
    every_row = np.minimum(np.arange(inputs.shape[1]) // stride, gains.shape[1] - 1)
    return variance[every_row], raw[every_row]


@dataclass(frozen=True, eq=False)
class Evidence:
    """A record seen by a block with free parameters."""

    driven: DrivenBlock
    record: Record
    floor: Floor
    samples: Samples

    def residual(self, values: Mapping[str, float]) -> tuple[Array, Array]:
        """Return measured minus predicted over the noise floor, and its derivatives."""
        samples = self.driven.samples(self.record, values) if self.driven.needs_new_samples else self.samples
        response = self.driven.respond(samples, values)
        target = self.driven.block.target
        error = (self.record.trace[target] if target else 0.0) - response.output
        sigma = self.floor.sigma
        return (self.floor.filter @ error) / sigma, -(self.floor.filter @ response.slope) / sigma[:, None]

    def predicted(self, values: Mapping[str, float]) -> Array:
        """Return the unfiltered output over the record."""
        samples = self.driven.samples(self.record, values) if self.driven.needs_new_samples else self.samples
        return self.driven.respond(samples, values).output


class Bench:
    """The records as every hypothesis sees them: same order, same filter, same rows, same noise floor.

    Parameters
    ----------
    records
        All records; their order and their names make no difference, see :func:`~.in_canonical_order`.
    blocks
        Of the declared model; they fix rows and noise floor.
    noise
        Of the measured signals, where it is known from other records of the same bench.
    filters
        By name of the block, where they were chosen for other records of the same bench.
    clock
        Time in s between samples at which the blocks show what they do, where that is known from other
        records of the same bench.
    """

    def __init__(
        self,
        records: RecordSet,
        blocks: Sequence[Block],
        *,
        noise: Noise | None = None,
        filters: Mapping[str, Filters] | None = None,
        clock: float | None = None,
    ) -> None:
        self._blocks = tuple(blocks)
        self.records = in_canonical_order(records)
        self.given_order = {record.name: place for place, record in enumerate(records.records)}
        self.noise = noise or estimate_noise(self.records, {b.target for b in blocks if b.target})
        self.filters: dict[str, Filters] = dict(filters or {})
        self.floors: dict[tuple[str, str], Floor] = {}
        self.units = {block.name: block.unit for block in blocks}
        self._scales = {block.name: block.effort_per_drive for block in blocks}
        self._thin: dict[tuple[str, str, bool], tuple[Record, Floor]] = {}
        new = [block for block in blocks if block.name not in self.filters]
        pace = paces(new, self.seen, self.noise)
        for block in blocks:
            self._check_alive(block)
            if block.name not in self.filters:
                self.filters[block.name] = chosen_filters(block, self.seen, self.noise, pace)
        self._read()
        for block in new:
            self.filters[block.name] = _straightened(self, block)
        if clock is None:
            clock = resolving_step(_block_records(self, blocks))
        self.clock = clock
        for (block_name, record_name), floor in self.floors.items():
            record = next(r for r in self.records.records if r.name == record_name)
            width = self.filters[block_name].width / record.step
            self.floors[block_name, record_name] = _on_clock(floor, width, times_on(record, clock))
        self.records = on_clock(self.records, clock)

    def _read(self) -> None:
        """Read each record by each block: rows and noise floor."""
        self.floors.clear()
        for block in self._blocks:
            for record in self.records.records:
                floor = noise_floor(block, record, self.noise, self.filters[block.name])
                if len(floor.sigma) >= _LEAST_ROWS:
                    self.floors[block.name, record.name] = floor
            if not any(name == block.name for name, _ in self.floors):
                raise MeasurementError(
                    f"block '{block.name}'",
                    "no record moves enough to say anything about it",
                    next_step=self._what_would(block),
                )

    @property
    def seen(self) -> tuple[Record, ...]:
        """Records that may decide on filters: those held out only where there are no others."""
        return self.records.of("fit", "selection") or self.records.records

    def with_records(self, records: RecordSet) -> Bench:
        """Return other records of the same bench as they are seen with the same noise and filters."""
        return Bench(records, self._blocks, noise=self.noise, filters=self.filters, clock=self.clock)

    def _check_alive(self, block: Block) -> None:
        if block.target is None or self.noise.deviation(block.target) > 0.0:
            return
        head = self.records.column(block.target).name
        reasons = [
            f for f in self.records.findings if f.place.partition(", row")[0].endswith(f"column '{head}'")
        ]
        raise MeasurementError(
            reasons[0].place if reasons else f"column '{head}'",
            f"{reasons[0].text if reasons else 'has no noise'}, so block '{block.name}' cannot be judged",
            next_step="check that the channel was connected, or leave its column out of records.toml",
        )

    def _what_would(self, block: Block) -> str:
        """Return which motion would say something about a block."""
        if block.moving is None:
            least = _LEAST_ROWS * self.filters[block.name].spacing
            return f"records need at least {least:.2g} s; record for longer"
        drive, span = block.drives[block.moving], self.filters[block.name].span
        least = min(_NOISY * _rate_noise(drive, self.noise, r.step, span) for r in self.records.records)
        unit = self.records.records[0].trace.units[drive.signal]
        rate = with_unit(f"{least:.3g}", f"{unit}/s" if drive.order else unit)
        moves = "changes faster" if drive.order else "is larger"
        return f"record a motion in which {drive.signal} {moves} than {rate}, for seconds on end"

    def driven(
        self, block: Block, free: Sequence[str], values: Mapping[str, float] | None = None
    ) -> DrivenBlock:
        """Return a block ready for evaluation on these records.

        ``block``, ``free``, ``values``: as for :class:`~.block_response.DrivenBlock`. The records that fits
        may see decide what is stiff; if there are none, as where a finished model is only looked at, all do.
        """
        filters = self.filters.get(block.name)
        span, straightened = (filters.span, filters.straightened) if filters else (0.0, ())
        records = self.records.of("fit") or self.records.records
        block = block.scaled_to(self._scales.get(block.name, block.effort_per_drive))
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
        result = []
        for record in records:
            if (name, record.name) in self.floors:
                seen, floor = record, self.floors[name, record.name]
                if thin:
                    seen, floor = self._thinned(name, record, whole=driven.stiff)
                result.append(Evidence(driven, seen, floor, driven.samples(seen, values)))
        return result

    def typical_floor(self, block: str) -> float:
        """Return the noise floor of a block over all records, root mean square, in its unit."""
        rows = np.concatenate([f.sigma for (name, _), f in self.floors.items() if name == block])
        return float(np.sqrt(np.mean(rows**2)))

    def known_from(self, block: str) -> float:
        """Return the effective squares of noise from which the floor of a block is known."""
        # One estimate of the noise serves all records, so more of them make it no better.
        doubt = float(np.mean([1.0 / f.known for (name, _), f in self.floors.items() if name == block]))
        return 1.0 / doubt if doubt else math.inf

    def _thinned(self, block: str, record: Record, *, whole: bool) -> tuple[Record, Floor]:
        """Return every k-th sample unfiltered; with ``whole`` all are simulated and the same are compared."""
        key = block, record.name, whole
        if key not in self._thin:
            k = self._skip(record)
            trace = record.trace
            counted = np.flatnonzero(~record.masked_in(trace.signals)[::k])
            raw = self.floors[block, record.name].raw_sigma[::k][counted]
            one = every(len(trace), k)
            masked = record.masked
            if not whole:
                trace = Trace(
                    trace.time[::k], {n: v[::k] for n, v in trace.signals.items()}, trace.units, trace.name
                )
                one = every(len(trace), 1)
                masked = {n: m[::k] for n, m in masked.items()}
            self._thin[key] = replace(record, trace=trace, masked=masked), Floor(one[counted], raw, raw)
        return self._thin[key]

    def _skip(self, record: Record) -> int:
        moving = [s for s in self.records.signals if self.noise.rounded[s]] or list(self.records.signals)
        allowed = _COARSEST
        for signal in moving:
            span = max(float(np.ptp(r.trace[signal])) for r in self.records.records)
            fastest = float(np.max(np.abs(np.gradient(gaussian_filter1d(record.trace[signal], 2.0)))))
            allowed = min(allowed, int(_COARSE_SHARE * span / max(fastest, 1e-300)))
        return max(1, allowed)


def _straightened(bench: Bench, block: Block) -> Filters:
    """Return the filters of a block with the inputs whose noise it rectifies."""
    filters, names = bench.filters[block.name], set[str]()
    for record in bench.seen:
        floor = bench.floors.get((block.name, record.name))
        if floor is not None:
            shifts = rectified(block, record, bench.noise, filters.span)
            names |= {n for n, shift in shifts.items() if shift > _RECTIFIED * rmse(floor.sigma)}
    return filters._replace(straightened=tuple(sorted(names)))


def _block_records(bench: Bench, blocks: Sequence[Block]) -> list[BlockRecord]:
    """Return how blocks read the records that may decide on filters."""
    result = []
    for block in blocks:
        driven = bench.driven(block, [])
        for record in bench.seen:
            floor = bench.floors.get((block.name, record.name))
            if floor is not None:
                width = bench.filters[block.name].width
                result.append(BlockRecord(driven, record, width, floor.filter, floor.sigma))
    return result
