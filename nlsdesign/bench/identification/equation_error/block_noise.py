"""The noise of a block on a record: the filter it reads the record through, and the floor behind that filter.

How wide the filter is follows in seconds from the motion and its noise, the same for all hypotheses.

All terms of a balance pass one filter, so what it takes from the motion biases nothing; noise does. A noisy
acceleration a + n in a balance J·a = T makes the inertia too small by the share var(n)/var(a), which no
number of samples removes, while the standard error falls with their root. So the filter is widened until
that bias is below a fifth of the standard error, but not beyond half the power of the motion.

A rate is taken over a span before any filter, as its sign or a drag asks for. A longer span takes from the
noise, which falls with its power of −3/2, and adds blur, which grows with the next derivatives of the motion.
So the span is counted in radians of a pace that is estimated from the records: that of the highest derivative
that a block takes, the root mean square of the next derivative over its own, both behind the narrowest filter
that makes the noise of the next one small, and never so quick that the filter of a balance lets more than a
very small share of noise through. A motion that reverses sharply has a quick acceleration although
its rate hardly changes most of the time, and fine counts show that while coarse ones do not.

What a block takes from a rate in proportion, as a damped spring does, may be quicker than that pace: a mode
that a step of the motion excites swings on. So the span is shortened until what it takes from such a rate is
little of the noise floor; also where nobody declared a damping or a drag, because it may be what is missing.

Where the supply of a motor is at its limit, the current follows the speed with a steep slope, and the
speed bends where that begins. There the span of the rate is as short as the noise of the measured current
allows.

Source: Fuller 1987 (attenuation by errors in variables); Savitzky and Golay 1964 (quartics); Ruppert et al.
1995 (widths from estimated derivatives).
"""

from __future__ import annotations

import math
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass, replace
from functools import lru_cache
from typing import NamedTuple

import casadi as ca
import numpy as np
from numpy.typing import NDArray

from ....foundation.arrays import Array, Mask
from ....foundation.errors import MeasurementError
from ....foundation.quantity import with_unit
from ....foundation.symbolic import remembered
from ....simulation import Trace
from ..filters import Smoothing, blur_weights, difference, filter_weights, filtered, smoothing
from ..records.measurement import Record, RecordSet
from ..residuals import rmse
from .batch import ColumnFunction
from .block import Block, BlockNoise, Drive, Filters, NoiseFloor
from .noise import Noise, NoisePart, independent_number

READING, BALANCE = 0.1, 0.2
"""Least widths, as radians of the typical motion. A balance holds a second derivative."""
SPAN = 1.5
"""Span of a rate in radians of the pace of the block, of which it keeps all but a thousandth."""
SPACING = 1.25
"""Widths from one row to the next, of the filter of a balance: there is no more information."""
_TYPICAL = 0.01
"""Share of noise in the power of the next derivative below which a pace can be told."""
_BIAS = 0.2
"""Standard errors of which a bias is let pass: it takes a share of 0.6 % from a 95 % interval."""
_LEFT = 0.5
"""Share of the power of the motion that a filter leaves at least."""
_COARSEST = 6.0
"""Samples per period of the typical motion below which derivatives are not known."""
_QUIET = 0.005
"""Share of noise in the acceleration, root mean squares, up to which a filter is narrowed to blur less."""
_CLEAR = 3.0
"""Samples in the width of a filter that leaves a hundredth of what has six samples a period: derivatives of
what is quicker are not true."""
_LIMITS = (".voltage_limit", ".current_limit")
_LIMIT_NOISE = 0.3
"""Noise of a rate behind a limit, in that of the target itself, up to which the span is shortened."""
_LEAST_SPAN = 8.0
"""Samples in such a span, at least."""
_STEP = 2.0**0.25
_BLURRED = 0.05
"""Mean square of what the span of a rate takes from a residual, in that of its noise, up to which it is let
pass: a block is open from a mean square of about 1.2 on."""
_LACKED = 0.05
"""Share of the effort of springs and inertias that a damping or drag may have that is not declared."""
_WIDTHS = 60
"""Widths of a filter in the usual record, at least: its reach is five to each side, that of rates is more."""
_ROWS_OF_SHORTEST = 200
"""Rows that the shortest record is read in, at least."""
_PROBES = 2000
"""Rows of a record on which the power of a motion is estimated at most."""
_NOISY, _SMEARED = 5.0, 0.027
"""A moving block says nothing where its speed is below so many times the noise of the speed, and so much of
the span of the rate times the acceleration: where friction bends the motion at a reversal, a rate misses by
a twentieth of span and jump of the acceleration, and a usual jump is half the root mean square of it."""
_SLOW_SHARE = 1e-2
"""Of the filter of a row that may reach into a reversal."""
_RECTIFIED = 0.1
"""Share of the noise floor up to which a block may rectify the noise of an input: 0.01 of its square."""
_HIDDEN = 0.05
"""Share of the power of an acceleration that may be noise: what is in proportion to it is fitted too small by
about as much (errors in variables), and no standard error shows it."""
LEAST_ROWS = 20
"""Rows in which a block says anything of a record, at least."""
LEAST_COVERED = 0.25
"""Share of the power of a motion in the rows of a block, below which it is read across its reversals: the
standard errors of what is in proportion to it are then twice those of the whole motion."""


def noise_of_blocks(
    blocks: Sequence[Block], records: RecordSet, noise: Noise, given: Mapping[str, Filters]
) -> dict[str, BlockNoise]:
    """Return how each block reads the records, by its name.

    Filters that were given are not chosen again. A MeasurementError is raised if no record moves enough to
    say anything about a block, or if the channel that a block predicts has no noise.
    """
    new = [block for block in blocks if block.name not in given]
    pace_by_order, filters = paces(new, records.deciding, noise), dict(given)
    for block in blocks:
        _check_alive(block, records, noise)
        if block.name not in filters:
            filters[block.name] = chosen_filters(block, records.deciding, noise, pace_by_order)
    read = {block.name: block_noise(block, records, noise, filters[block.name]) for block in blocks}
    return read | {b.name: _straightened(read[b.name], records.deciding, noise) for b in new}


def block_noise(block: Block, records: RecordSet, noise: Noise, filters: Filters) -> BlockNoise:
    """Return how a block reads records through some filters; a MeasurementError if none says anything."""
    floors = {record.name: noise_floor(block, record, noise, filters) for record in records.records}
    floors = {name: floor for name, floor in floors.items() if len(floor.sigma) >= LEAST_ROWS}
    if not floors:
        raise MeasurementError(
            f"block '{block.name}'",
            "no record moves enough to say anything about it",
            next_step=_needed_motion(block, records, noise, filters),
        )
    hidden, whole = np.sum([floor.acceleration for floor in floors.values()], axis=0)
    if hidden > _HIDDEN * (whole + 0.1**-2):  # a number that is declared to 10 % says as much
        raise MeasurementError(
            f"block '{block.name}'",
            f"{100.0 * hidden / max(hidden, whole):.0f} % of the power of its acceleration is noise",
            next_step="to see an inertia, record more counts or a higher frequency, or take a finer encoder",
        )
    return BlockNoise(block, filters, floors)


def _straightened(read: BlockNoise, records: Sequence[Record], noise: Noise) -> BlockNoise:
    """Return the same with the inputs whose noise the block rectifies by too much of its floor."""
    inputs = set[str]()
    for record in (r for r in records if r.name in read.floors):
        shifts = rectified(read.block, record, noise, read.filters.span)
        most = _RECTIFIED * read.floors[record.name].typical
        inputs |= {name for name, shift in shifts.items() if shift > most}
    return replace(read, filters=read.filters._replace(straightened=tuple(sorted(inputs))))


class _Course(NamedTuple):
    """A block along a record."""

    inputs: Array  # shape (inputs, n)
    slopes: Array  # of the output by each input, on every k-th sample
    at: NDArray[np.int64]  # which of these stands for each sample, shape (n,)
    spacing: float  # time between them in s


def _course(block: Block, record: Record, filters: Filters) -> _Course:
    stride = max(1, round(filters.spacing / record.step))
    inputs = measured_inputs(block, record, filters.span)
    slopes = output_slopes(block, inputs, stride)
    at = np.minimum(np.arange(inputs.shape[1]) // stride, slopes.shape[1] - 1)
    return _Course(inputs, slopes, at, stride * record.step)


def noise_floor(
    block: Block, record: Record, noise: Noise, filters: Filters, course: _Course | None = None
) -> NoiseFloor:
    """Return what a block makes of the noise of a record.

    The noise of each input is carried to the output by the slope of the output with respect to it. Slow
    noise is remembered only where the block does not take rates of it. ``course``: of the block along the
    record, where it is known.
    """
    step, width, span = record.step, filters.width, filters.span
    inputs, gains, at, spacing = course or _course(block, record, filters)
    noise = noise.in_record(record.name)
    rows, covered = _rows(block, record, noise, filters, inputs)
    own = noise.behind(block.target, step, width=width) if block.target else 0.0
    variance = np.full(gains.shape[1], own**2)
    raw = np.full(gains.shape[1], noise.deviation(block.target) ** 2 if block.target else 0.0)
    memory = list(noise.memory(block.target, step, width=width)) if block.target else []
    powers, accelerations = dict[str, float](), list[tuple[Array, Array]]()
    for i, variable in enumerate(block.model.inputs):
        drive = block.drives.get(variable.name)
        if drive is None:
            continue
        signal, order, deviation = drive.signal, drive.order, noise.deviation(drive.signal)
        # Rounding of a signal at rest is a constant error that no filter takes away.
        constant = noise.rounded[signal] and order == 0
        behind = deviation if constant else noise.behind(signal, step, width=width, order=order, span=span)
        variance += (gains[i] * behind) ** 2
        if order == 0:
            raw += (gains[i] * deviation) ** 2
            powers[signal] = powers.get(signal, 0.0) + float(np.nanmean(gains[i] ** 2)) * behind**2
            parts = noise.memory(signal, step, width=width)
            memory += [NoisePart(float(np.mean(gains[i] ** 2)) * p.variance, p.time) for p in parts]
        elif order == 2:
            accelerations.append((gains[i][at] * inputs[i], gains[i][at] * behind))
    variance, raw = variance[at], raw[at]
    shares = [NoisePart(p.variance / float(np.mean(variance)), p.time) for p in memory]
    heard = {d.signal for d in block.drives.values() if d.order == 0} | {block.target or ""} - {""}
    squares = [
        sum(independent_number(shares, max(1, round(t / spacing)), spacing) for t in noise.seen[signal])
        for signal in heard.intersection(noise.seen)
    ]
    independent = independent_number(shares, len(rows.places), spacing) if shares else math.inf
    known = min(squares, default=math.inf)
    sigma = np.sqrt(variance[rows.places])
    own_shares = {signal: power / float(np.mean(sigma**2)) for signal, power in powers.items() if len(sigma)}
    noise_power = sum(float(np.nansum((part[rows.places] / sigma) ** 2)) for _, part in accelerations)
    power = noise_power, sum(float(np.nansum((rows @ part / sigma) ** 2)) for part, _ in accelerations)
    return NoiseFloor(rows, sigma, np.sqrt(raw), independent, known, covered, own_shares, width, power)


def _rows(
    block: Block, record: Record, noise: Noise, filters: Filters, inputs: Array
) -> tuple[Smoothing, float]:
    """Return the rows of a record that say something of a block: not masked, and in motion where need be.

    With the share of the power of the motion in them.
    """
    n, step, span = len(record.trace), record.step, filters.span
    stride = max(1, round(filters.spacing / step))
    margin = max(len(difference(d.order, span / step)) // 2 for d in block.drives.values())
    rows = smoothing(n, filters.width / step, stride, margin=margin)
    masked = record.masked_in([*(drive.signal for drive in block.drives.values()), block.target or ""])
    rows = rows[~rows.touched_by(masked)]
    if block.moving is None:
        return rows, 1.0
    rate = inputs[[v.name for v in block.model.inputs].index(block.moving)]
    # The filter smears what happens at a reversal; so its whole reach must be in motion.
    slow = np.abs(rate) < slowest_rate(block.drives[block.moving], record, noise, span, rate)
    moving, whole = _in_motion(rows, slow | _reverses(rate)), float(np.sum(rows @ rate**2))
    covered = float(np.sum(moving @ rate**2)) / whole if whole else 0.0
    # A motion that is hardly ever between two reversals, as one that shakes or swings, is read across them.
    if len(moving.places) < LEAST_ROWS or covered < LEAST_COVERED:
        moving = _in_motion(rows, slow)
        covered = float(np.sum(moving @ rate**2)) / whole if whole else 0.0
    return moving, covered


def slowest_rate(drive: Drive, record: Record, noise: Noise, span: float, rate: Array) -> float:
    """Return the least speed of a measured motion whose size a record resolves."""
    step = record.step
    noisy = _NOISY * noise.behind(drive.signal, step, order=drive.order, span=span)
    # A rate that is measured itself is not taken over a span.
    blurred = _SMEARED * span * rmse(np.gradient(rate, step)) if drive.order else 0.0
    return math.hypot(noisy, blurred)


def _in_motion(matrix: Smoothing, still: Mask) -> Smoothing:
    """Return the rows that hardly reach into what is still."""
    return matrix[np.flatnonzero(matrix @ still.astype(float) < _SLOW_SHARE)]


def _reverses(rate: Array) -> Mask:
    """Tell which samples have a reversal beside them: when in between it happened, no sample tells."""
    between = rate[1:] * rate[:-1] < 0.0
    beside: Mask = np.append(between, False) | np.append(False, between)
    return beside


def _check_alive(block: Block, records: RecordSet, noise: Noise) -> None:
    if block.target is None or noise.deviation(block.target) > 0.0:
        return
    head = records.column(block.target).name
    reasons = [f for f in records.findings if f.place.partition(", row")[0].endswith(f"column '{head}'")]
    raise MeasurementError(
        reasons[0].place if reasons else f"column '{head}'",
        f"{reasons[0].text if reasons else 'has no noise'}, so block '{block.name}' cannot be judged",
        next_step="check that the channel was connected, or leave its column out of records.toml",
    )


def _needed_motion(block: Block, records: RecordSet, noise: Noise, filters: Filters) -> str:
    """Return which motion would say something about a block."""
    if block.moving is None:
        return f"records need at least {LEAST_ROWS * filters.spacing:.2g} s; record for longer"
    drive = block.drives[block.moving]
    least = min(
        _NOISY * noise.behind(drive.signal, r.step, order=drive.order, span=filters.span)
        for r in records.records
    )
    unit = records.records[0].trace.units[drive.signal]
    rate = with_unit(f"{least:.3g}", f"{unit}/s" if drive.order else unit)
    moves = "changes faster" if drive.order else "is larger"
    return f"record a motion in which {drive.signal} {moves} than {rate}, for seconds on end"


def pace_of(signals: Sequence[tuple[Array, float]], noise: float, order: int = 1) -> float:
    """Return the typical angular frequency of a derivative in rad/s: the next over it, root mean squares.

    Both behind the narrowest filter that makes the noise of the next small; zero where none does.
    """
    for width in _widths(0.5 * min(step for _, step in signals), signals):
        power, share = _power(signals, width, (order + 1, 0.0), noise)
        below, _ = _power(signals, width, (order, 0.0), noise)
        if power > 0.0 and below > 0.0 and share <= _TYPICAL * (power + share):
            return math.sqrt(power / below)
    return 0.0


def rate_span(records: Sequence[Record], signal: str) -> float:
    """Return the time in s over which the rate of a measured signal is taken; zero where it does not move."""
    resolutions = [r.resolution_of(signal) for r in records]
    noise = float(np.median([max(g.noise, g.quantum / math.sqrt(12.0)) for g in resolutions]))
    runs = tuple((r.trace, r.step) for r in records)
    # Whoever takes a rate alone, as where a simulation begins, wants that of a sharp reversal too.
    pace = max(_bounded_pace(runs, signal, noise, order) for order in (1, 2))
    return SPAN / pace if pace else 0.0


def paces(blocks: Sequence[Block], records: Sequence[Record], noise: Noise) -> dict[tuple[str, int], float]:
    """Return the pace in rad/s of every signal and order that decide on a filter."""
    wanted = dict.fromkeys(
        (signal, order)
        for block in blocks
        for signal, highest in _deciding(block).items()
        for order in range(1, highest + 1)
    )
    runs = tuple((r.trace, r.step) for r in records)
    return {
        (signal, order): _bounded_pace(runs, signal, noise.deviation(signal), order)
        for signal, order in wanted
    }


@remembered(16)  # the same records are asked again each time that they are read otherwise
def _bounded_pace(runs: Sequence[tuple[Trace, float]], signal: str, noise: float, order: int) -> float:
    """Return the pace of a derivative; that of an acceleration no quicker than its noise allows."""
    signals = [(trace[signal], step) for trace, step in runs]
    pace = pace_of(signals, noise, order)
    return min(pace, BALANCE / _quiet_width(signals, noise, order)) if order > 1 and pace else pace


def _quiet_width(signals: Sequence[tuple[Array, float]], noise: float, order: int) -> float:
    """Return the narrowest width behind which the noise of a derivative is a very small share of it."""
    width = 0.0
    for width in _widths(_CLEAR * max(step for _, step in signals), signals):
        power, share = _power(signals, width, (order, 0.0), noise)
        if share <= _QUIET**2 * power:
            break
    return width


def _deciding(block: Block) -> dict[str, int]:
    """Return the motions whose rates drive a block, each with its highest order; all drives if none has."""
    drives = block.drives.values()
    highest: dict[str, int] = {}
    for drive in [d for d in drives if d.order > 0] or drives:
        highest[drive.signal] = max(1, drive.order, highest.get(drive.signal, 0))
    return highest


def chosen_filters(
    block: Block, records: Sequence[Record], noise: Noise, pace_by_order: Mapping[tuple[str, int], float]
) -> Filters:
    """Return the filters of a block for all records of a set and all hypotheses."""
    moving = any(d.order > 0 for d in block.drives.values())
    seen = _deciding(block)
    usual_pace = max((pace_by_order[signal, 1] for signal in seen), default=0.0)
    shortest = min(r.step for r in records)
    if usual_pace == 0.0:
        return Filters(0.0, 0.0, shortest)
    if moving and 2.0 * math.pi < _COARSEST * usual_pace * max(r.step for r in records):
        now = 1.0 / max(r.step for r in records)
        frequency = usual_pace / (2.0 * math.pi)
        raise MeasurementError(
            f"block '{block.name}'",
            f"the motion of {' and '.join(seen)}, typically {frequency:.3g} Hz, is sampled too coarsely "
            f"at {now:.3g} Hz",
            next_step=f"sample at {2.0 * _COARSEST * frequency:.2g} Hz or more, or move more slowly",
        )
    # Where noise hides the highest derivative, or samples are too few for it, the pace of the rate is kept.
    pace = max(usual_pace, *(pace_by_order[key] for key in seen.items()))
    # A motion that hardly changes its rate, such as a slow ramp, has no pace of its own: its record sets one.
    usual = float(np.median([r.step * len(r.trace) for r in records]))
    widest = usual / _WIDTHS
    least = min((READING if block.target else BALANCE) / pace, widest)
    span = min(SPAN / pace, SPAN / BALANCE * widest)
    span = _span_behind_limit(block, records, noise, span)
    spacing = SPACING * BALANCE / pace
    width = min(_unbiased_width(block, records, noise, (least, span)), widest) if moving else least
    true = _true_span(block, records, noise, Filters(width, span, max(spacing, SPACING * width)))
    if true < span:
        span, width = true, min(_unbiased_width(block, records, noise, (least, true)), widest)
    # A record shorter than a few radians of its motion keeps rows that overlap.
    most = min(r.step * len(r.trace) for r in records) / _ROWS_OF_SHORTEST
    return Filters(width, span, min(max(spacing, SPACING * width), most))


def output_slopes(block: Block, inputs: Array, stride: int) -> Array:
    """Return the derivative of a block's output with respect to each input, shape (inputs, rows).

    ``inputs``: shape (inputs, n).
    """
    return _functions(block).slopes(inputs[:, ::stride])


@dataclass(frozen=True)
class _BlockFunctions:
    """The output of a block and its derivatives over its inputs, at the starts of states and parameters."""

    rest: tuple[Array, Array]
    output_function: ColumnFunction
    slopes_function: ColumnFunction

    def output(self, inputs: Array) -> Array:
        """Return the output, shape (1, rows)."""
        return self.output_function(inputs.shape[1], [self.rest[0], inputs, self.rest[1]])

    def slopes(self, inputs: Array) -> Array:
        """Return the derivatives, shape (inputs, rows)."""
        return self.slopes_function(inputs.shape[1], [self.rest[0], inputs, self.rest[1]])


@lru_cache(maxsize=16)
def _functions(block: Block) -> _BlockFunctions:
    """Return the functions of a block, which is asked for them on every record."""
    model, s = block.model, block.model.symbols()
    states, parameters = (np.array([v.start for v in group]) for group in (model.states, model.parameters))
    results = (s.output, ca.jacobian(s.output, s.input).T)
    made = (ca.Function("of", [s.state, s.input, s.parameter], [ca.densify(each)]) for each in results)
    return _BlockFunctions((states, parameters), *map(ColumnFunction, made))


def measured_inputs(block: Block, record: Record, span: float) -> Array:
    """Return the inputs of a block's model from a record, shape (inputs, n); those not measured rest."""
    model = block.model
    inputs = block.at_rest(len(record.trace))
    for i, variable in enumerate(model.inputs):
        if variable.name in block.drives:
            drive = block.drives[variable.name]
            inputs[i] = record.derived(drive.signal, drive.order, span)
    return inputs


def rectified(block: Block, record: Record, noise: Noise, span: float) -> dict[str, float]:
    """Return by how much the noise of each input shifts the output of a block, root mean square in its unit.

    A filter behind the output averages noise only where the output is straight in it. Where it is bent, as
    that of a lossy gear where the power turns over, noise is rectified: half the sum of what it causes
    upwards and downwards stays. Rates are smooth already, and so is a motion.
    """
    model, functions = block.model, _functions(block)
    inputs = measured_inputs(block, record, span)[:, :: max(1, len(record.trace) // _PROBES)]
    motions = {d.signal for d in block.drives.values() if d.order > 0}
    shifts = {}
    for i, variable in enumerate(model.inputs):
        drive = block.drives.get(variable.name)
        if drive is None or drive.order == 1 or (drive.order == 0 and drive.signal in motions):
            continue
        step = np.zeros((len(model.inputs), 1))
        step[i] = noise.behind(drive.signal, record.step, order=drive.order, span=span)
        around = [functions.output(inputs + shift) for shift in (step, -step, 0.0 * step)]
        rest = 0.5 * (around[0] + around[1]) - around[2]
        shifts[variable.name] = float(np.sqrt(np.nanmean(rest**2)))
    return shifts


def _span_behind_limit(block: Block, records: Sequence[Record], noise: Noise, longest: float) -> float:
    """Return the span of the rates of a block, shorter where a limit of a motor switches their effect.

    A rate taken over a long span is blurred where the motion bends, and it bends where a limit sets in.
    """
    limits = [v.name for v in block.model.parameters if v.name.endswith(_LIMITS)]
    rates = {n: d.signal for n, d in block.drives.items() if d.order == 1}
    step = max(r.step for r in records)
    span = _LEAST_SPAN * step
    if not (limits and rates and block.target) or span >= longest:
        return longest
    own = _LIMIT_NOISE * noise.deviation(block.target)
    places = [v.name for v in block.model.inputs]
    for name, signal in rates.items():
        slopes = [_slopes_of(block, record, span, places.index(name)) for record in records]
        size = np.abs(np.concatenate(slopes))
        if np.all(size > 0.0) or not np.any(size > 0.0):
            continue  # no limit, or one that does not set in
        steepest = float(np.max(size))
        while span < longest:
            if steepest * noise.behind(signal, step, order=1, span=span) <= own:
                break
            span *= _STEP
        longest = min(longest, span)
    return longest


def _true_span(block: Block, records: Sequence[Record], noise: Noise, filters: Filters) -> float:
    """Return the longest span, up to that of some filters, that takes hardly anything from what rates do."""
    shortest = _LEAST_SPAN * max(r.step for r in records)
    span = filters.span
    while span > shortest and any(drive.order == 1 for drive in block.drives.values()):
        blur = np.hstack([_blur(block, r, noise, filters._replace(span=span)) for r in records])
        if not blur.size or float(np.max(np.nanmean(blur, axis=1))) <= _BLURRED:
            break
        span = max(span / _STEP, shortest)
    return span


def _blur(block: Block, record: Record, noise: Noise, filters: Filters) -> Array:
    """Return the squares of what the span takes from the rates in each row, in those of its noise.

    Shape (3, rows): from what the model takes of them, and from a damping beside each spring and a drag on
    each body that it may lack. Less what noise alone makes of them; so they may be negative.
    """
    step, span, course = record.step, filters.span, _course(block, record, filters)
    floor = noise_floor(block, record, noise, filters, course)
    if not len(floor.sigma):
        return np.zeros((3, 0))
    of_noise = float(np.linalg.norm(blur_weights(filters.width, step, span)))
    efforts = np.zeros((3, len(record.trace)))
    rates, taken, own = np.zeros_like(efforts), np.zeros_like(efforts), np.zeros((3, len(floor.sigma)))
    place = {block.drives[v.name]: i for i, v in enumerate(block.model.inputs) if v.name in block.drives}
    for drive in (d for d in place if d.order == 1):
        blur = record.blur(drive.signal, span)
        for k, order in enumerate((1, 0, 2)):
            like = place.get(drive._replace(order=order))
            if like is not None:
                gain, motion = course.slopes[like][course.at], course.inputs[like]
                efforts[k] += gain * (motion - motion.mean())
                rates[k] += gain * course.inputs[place[drive]]
                taken[k] += gain * blur
                own[k] += (gain[floor.places] * (noise.deviation(drive.signal) * of_noise)) ** 2
    scale = np.ones((3, 1))
    for k in (1, 2):
        size = rmse(floor.filter @ rates[k])
        scale[k] = _LACKED * rmse(floor.filter @ efforts[k]) / size if size > 0.0 else 0.0
    seen = np.array([floor.filter @ each for each in taken])
    squares: Array = scale**2 * (seen**2 - own) / floor.sigma**2
    return squares


def _slopes_of(block: Block, record: Record, span: float, place: int) -> Array:
    """Return the slope of the output with respect to one input on some samples of a record."""
    stride = max(1, len(record.trace) // _PROBES)
    slopes: Array = output_slopes(block, measured_inputs(block, record, span), stride)[place]
    return slopes


def _unbiased_width(
    block: Block, records: Sequence[Record], noise: Noise, least_and_span: tuple[float, float]
) -> float:
    """Return the narrowest width at which no derivative biases its factor, or the widest that is allowed."""
    least, span = least_and_span
    gains = _mean_square_slopes(block, records, span)
    drives = {n: d for n, d in block.drives.items() if n in gains}
    sloped = {n: d for n, d in drives.items() if d.order > 0}
    runs = {d.signal: [(r.trace[d.signal], r.step) for r in records] for d in drives.values()}
    duration = sum(r.step * len(r.trace) for r in records)
    step = float(np.median([r.step for r in records]))
    whole: dict[str, float] = {}
    best = least
    for width in _widths(least, [run for each in runs.values() for run in each]):
        rows = duration / max(2.0 * math.sqrt(math.pi) * width, step)
        noises = {
            n: noise.behind(d.signal, step, width=width, order=d.order, span=span) ** 2
            for n, d in drives.items()
        }
        total = sum(gains[n] * noises[n] for n in drives)
        if block.target:
            total += noise.behind(block.target, step, width=width) ** 2
        bias = 0.0
        for name, drive in sloped.items():
            seen = _power(runs[drive.signal], width, (drive.order, span), 0.0)[0]
            power = max(seen - noises[name], 0.0)
            whole.setdefault(name, power)
            if power <= _LEFT * whole[name] and width > least:
                return best
            if power > 0.0 and total > 0.0:
                bias = max(bias, noises[name] * math.sqrt(gains[name] * rows / (power * total)))
        best = width
        if bias <= _BIAS:
            return width
    return best


def _mean_square_slopes(block: Block, records: Sequence[Record], span: float) -> dict[str, float]:
    """Return the mean square of the slope of the output with respect to each driven input."""
    squares = []
    for record in records:
        stride = max(1, len(record.trace) // _PROBES)
        slopes = output_slopes(block, measured_inputs(block, record, span), stride)
        squares.append(np.nanmean(np.where(np.isfinite(slopes), slopes, np.nan) ** 2, axis=1))
    mean = np.nan_to_num(np.mean(squares, axis=0))
    names = [v.name for v in block.model.inputs]
    return {name: float(mean[i]) for i, name in enumerate(names) if name in block.drives}


def _widths(least: float, signals: Sequence[tuple[Array, float]]) -> Iterator[float]:
    """Yield widths from the least to those whose reach a record hardly holds."""
    most = max(step * len(signal) for signal, step in signals) / 40.0
    width = least
    yield width
    while (width := width * _STEP) < most:
        yield width


def _power(
    signals: Sequence[tuple[Array, float]], width: float, kind: tuple[int, float], noise: float
) -> tuple[float, float]:
    """Return the mean square of a filtered derivative without that of its noise, and that of its noise."""
    order, span = kind
    squares, count, own = 0.0, 0, 0.0
    for signal, step in signals:
        weights = filter_weights(width, order, step, span)
        stride = max(1, int(width / step), len(signal) // _PROBES)
        rows = filtered(signal, weights, stride)
        squares += float(rows @ rows)
        count += len(rows)
        own += len(rows) * noise**2 * float(weights @ weights)
    return (squares - own) / max(count, 1), own / max(count, 1)
