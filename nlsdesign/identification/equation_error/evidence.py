"""What a record says about a block: residuals in units of their own noise floor."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace

import casadi as ca
import numpy as np
import scipy.sparse
from numpy.typing import NDArray
from scipy.ndimage import gaussian_filter1d

from ...errors import MeasurementError
from ...quantity import with_unit
from ...simulation import Trace
from ..records.canonical_order import in_canonical_order
from ..records.measurement import Record, RecordSet
from ..statistics.filters import derivative, noise_gain, rate_noise_gain, smoothing
from .block import Block, Drive
from .block_response import DrivenBlock, Samples

Array = NDArray[np.float64]

STRIDE = 5
"""Of so many filtered samples one is kept: the filters leave no more information."""
SLOW = 10.0
"""A moving block says nothing where its speed is below so many times the noise of the speed."""
_LEAST_ROWS = 20
_COARSE_SHARE, _COARSEST = 0.04, 12
"""The coarse look skips samples while no motion changes by more than this share of its range."""


@dataclass(frozen=True)
class Noise:
    """Standard deviation of the noise of each measured signal, in SI, and whether it is mere rounding."""

    level: Mapping[str, float]
    rounded: Mapping[str, bool]


def estimate_noise(records: RecordSet) -> Noise:
    """Estimate the noise of every channel from the records themselves.

    Parameters
    ----------
    records
        All of them; the median over the records is taken.

    Returns
    -------
    Noise
        At least that of rounding, quantum/√12. Declared noise is not used: it is a claim.
    """
    level, rounded = {}, {}
    for column in records.columns:
        resolutions = [r.resolution_of(column.signal) for r in records.records]
        white = float(np.median([g.noise for g in resolutions]))
        # The count of a resampled signal is that of its samples before, as it weighs on the new clock.
        kept = any(column.signal in r.resolution for r in records.records)
        declared = 0.0 if kept else column.quantum
        quantum = declared or float(np.median([g.quantum for g in resolutions]))
        rounding = quantum / np.sqrt(12.0)
        level[column.signal] = max(white, rounding)
        rounded[column.signal] = white < 2.0 * rounding
    return Noise(level, rounded)


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
    """

    filter: scipy.sparse.csr_array
    sigma: Array
    raw_sigma: Array

    @property
    def places(self) -> NDArray[np.int64]:
        """Index of the sample in the middle of each row."""
        first, behind = self.filter.indptr[:-1], self.filter.indptr[1:]
        result: NDArray[np.int64] = self.filter.indices[(first + behind) // 2].astype(np.int64)
        return result


def noise_floor(block: Block, record: Record, noise: Noise) -> Floor:
    """Return filter and noise floor of a block on a record.

    The noise of each input is carried to the output by the slope of the output with respect to it.

    Parameters
    ----------
    block
        As declared.
    record
        Holds all signals that drive the block.
    noise
        Of the measured signals.
    """
    n = len(record.trace)
    matrix = smoothing(n, block.width, STRIDE)
    masked = record.masked_in([*(drive.signal for drive in block.drives.values()), block.target or ""])
    matrix = matrix[np.flatnonzero((matrix != 0.0) @ masked.astype(float) == 0.0)]
    inputs = measured_inputs(block, record)
    if block.moving is not None:
        speed = np.abs(inputs[[v.name for v in block.model.inputs].index(block.moving)])
        level = _rate_noise(block.drives[block.moving], noise, record.step)
        # The filter smears what happens at a reversal; so its whole reach must be in motion.
        slow = (speed < SLOW * level).astype(float)
        matrix = matrix[np.flatnonzero(matrix @ slow < 1e-3)]
    variance, raw = _variances(block, record, noise, inputs)
    floor = Floor(matrix, np.zeros(0), np.sqrt(raw))
    return replace(floor, sigma=np.sqrt(variance[floor.places]))


def _rate_noise(drive: Drive, noise: Noise, step: float) -> float:
    """Return the noise of a rate, measured itself or the derivative of a motion."""
    level = noise.level[drive.signal]
    return level * rate_noise_gain() / step if drive.order else level


def measured_inputs(block: Block, record: Record) -> Array:
    """Return the inputs of a block's model from a record, shape (inputs, n); those not measured rest.

    Parameters
    ----------
    block
        As declared.
    record
        Holds all signals that drive the block.
    """
    model = block.model
    inputs = np.repeat(model.start(model.inputs)[:, None], len(record.trace), axis=1)
    for i, variable in enumerate(model.inputs):
        if variable.name in block.drives:
            drive = block.drives[variable.name]
            inputs[i] = derivative(record.trace[drive.signal], record.step, order=drive.order)
    return inputs


def _variances(block: Block, record: Record, noise: Noise, inputs: Array) -> tuple[Array, Array]:
    s, model = block.model.symbols(), block.model
    slope = ca.Function(
        "slope", [s.state, s.input, s.parameter, s.table], [ca.densify(ca.jacobian(s.output, s.input))]
    )
    places = np.arange(0, inputs.shape[1], STRIDE)
    start, values = model.start(model.states), model.start(model.parameters)
    flat = slope.map(len(places))(start, inputs[:, places], values, np.zeros(0)).full()
    gains = flat.reshape(len(places), -1).T
    own = noise.level[block.target] if block.target else 0.0
    variance = np.full(len(places), (own * noise_gain(block.width, 0)) ** 2)
    raw = np.full(len(places), own**2)
    for i, variable in enumerate(model.inputs):
        drive = block.drives.get(variable.name)
        if drive is None:
            continue
        level = noise.level[drive.signal]
        # Rounding of a signal at rest is a constant error that no filter takes away.
        constant = noise.rounded[drive.signal] and drive.order == 0
        gain = 1.0 if constant else noise_gain(block.width, drive.order) / record.step**drive.order
        variance += (gains[i] * level * gain) ** 2
        raw += (gains[i] * level) ** 2 if drive.order == 0 else 0.0
    every = np.minimum(np.arange(inputs.shape[1]) // STRIDE, len(places) - 1)
    return variance[every], raw[every]


@dataclass(frozen=True, eq=False)
class Evidence:
    """A record seen by a block with free parameters."""

    driven: DrivenBlock
    record: Record
    floor: Floor
    samples: Samples

    def residual(self, values: Mapping[str, float]) -> tuple[Array, Array]:
        """Return measured minus predicted over the noise floor, and its derivatives.

        Parameters
        ----------
        values
            Free parameters by name.

        Returns
        -------
        tuple
            Shapes (rows,) and (rows, free parameters of the block).
        """
        samples = self.driven.samples(self.record, values) if self.driven.needs_new_samples else self.samples
        response = self.driven.respond(samples, values)
        target = self.driven.block.target
        error = (self.record.trace[target] if target else 0.0) - response.output
        sigma = self.floor.sigma
        return (self.floor.filter @ error) / sigma, -(self.floor.filter @ response.slope) / sigma[:, None]

    def predicted(self, values: Mapping[str, float]) -> Array:
        """Return the unfiltered output over the record.

        Parameters
        ----------
        values
            Free parameters by name.
        """
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

    Raises
    ------
    MeasurementError
        If no record moves enough to say anything about a block.
    """

    def __init__(self, records: RecordSet, blocks: Sequence[Block], *, noise: Noise | None = None) -> None:
        self._blocks = tuple(blocks)
        self.records = in_canonical_order(records)
        self.given_order = {record.name: place for place, record in enumerate(records.records)}
        self.noise = estimate_noise(self.records) if noise is None else noise
        self.floors: dict[tuple[str, str], Floor] = {}
        self.units = {block.name: block.unit for block in blocks}
        self._scales = {block.name: block.effort_per_drive for block in blocks}
        self._thin: dict[tuple[str, str, bool], tuple[Record, Floor]] = {}
        for block in blocks:
            self._check_alive(block)
            for record in self.records.records:
                floor = noise_floor(block, record, self.noise)
                if len(floor.sigma) >= _LEAST_ROWS:
                    self.floors[block.name, record.name] = floor
            if not any(name == block.name for name, _ in self.floors):
                raise MeasurementError(
                    f"block '{block.name}'",
                    "no record moves enough to say anything about it",
                    next_step=self._what_would(block),
                )

    def with_records(self, records: RecordSet) -> Bench:
        """Return other records of the same bench as they are seen with the same noise.

        Parameters
        ----------
        records
            All records.
        """
        return Bench(records, self._blocks, noise=self.noise)

    def _check_alive(self, block: Block) -> None:
        if block.target is None or self.noise.level[block.target] > 0.0:
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
            return f"records need at least {STRIDE * _LEAST_ROWS} samples; record for longer"
        drive = block.drives[block.moving]
        least = SLOW * _rate_noise(drive, self.noise, min(r.step for r in self.records.records))
        unit = self.records.records[0].trace.units[drive.signal]
        rate = with_unit(f"{least:.3g}", f"{unit}/s" if drive.order else unit)
        moves = "changes faster" if drive.order else "is larger"
        return f"record a motion in which {drive.signal} {moves} than {rate}, for seconds on end"

    def driven(
        self, block: Block, free: Sequence[str], values: Mapping[str, float] | None = None
    ) -> DrivenBlock:
        """Return a block ready for evaluation on these records.

        Parameters
        ----------
        block, free, values
            As for :class:`~.block_response.DrivenBlock`. The records that fits may see decide what is stiff;
            if there are none, as where a finished model is only looked at, all do.
        """
        records = self.records.of("fit") or self.records.records
        block = block.scaled_to(self._scales.get(block.name, block.effort_per_drive))
        return DrivenBlock(block, free, records=records, values=values)

    def evidence(
        self,
        driven: DrivenBlock,
        records: Sequence[Record],
        values: Mapping[str, float],
        *,
        coarse: bool = False,
    ) -> list[Evidence]:
        """Return what records say about a block.

        Parameters
        ----------
        driven
            The block, of any hypothesis.
        records
            Some of the records.
        values
            Free parameters by name, by which late signals are advanced.
        coarse
            Whether blocks with a target are simulated on every k-th sample alone and compared unfiltered: a
            quick look, less sharp by the square root of the number of samples left out. Blocks that are
            faster than a sample are simulated on all.
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
        """Return the noise floor of a block over all records, root mean square, in its unit.

        Parameters
        ----------
        block
            Name of the block.
        """
        rows = np.concatenate([f.sigma for (name, _), f in self.floors.items() if name == block])
        return float(np.sqrt(np.mean(rows**2)))

    def _thinned(self, block: str, record: Record, *, whole: bool) -> tuple[Record, Floor]:
        """Return every k-th sample unfiltered; with ``whole`` all are simulated and the same are compared."""
        key = block, record.name, whole
        if key not in self._thin:
            k = self._skip(record)
            trace = record.trace
            counted = np.flatnonzero(~record.masked_in(trace.signals)[::k])
            raw = self.floors[block, record.name].raw_sigma[::k][counted]
            one = scipy.sparse.csr_array(scipy.sparse.identity(len(trace), format="csr")[::k])
            masked = record.masked
            if not whole:
                trace = Trace(
                    trace.time[::k], {n: v[::k] for n, v in trace.signals.items()}, trace.units, trace.name
                )
                one = scipy.sparse.csr_array(scipy.sparse.identity(len(trace), format="csr"))
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
