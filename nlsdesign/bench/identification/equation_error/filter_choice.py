"""How wide the filter of a block is: in seconds, from the motion and its noise, the same for all hypotheses.

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

Where the supply of a motor is at its limit, the current follows the speed with a steep slope, and the
speed bends where that begins. There the span of the rate is as short as the noise of the measured current
allows.

Source: Fuller 1987 (attenuation by errors in variables); Savitzky and Golay 1964 (quartics); Ruppert et al.
1995 (widths from estimated derivatives).
"""

from __future__ import annotations

import math
from collections.abc import Iterator, Mapping, Sequence
from typing import NamedTuple

import casadi as ca
import numpy as np

from ....foundation.arrays import Array
from ....foundation.errors import MeasurementError
from ..filters import derivative, filter_weights, filtered
from ..records.measurement import Record
from .block import Block
from .noise import Noise

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
_WIDTHS = 60
"""Widths of a filter in the usual record, at least: its reach is five to each side, that of rates is more."""
_LEAST_ROWS = 200
"""Rows that the shortest record is read in, at least."""
_PROBES = 2000
"""Rows of a record on which the power of a motion is estimated at most."""


class Filters(NamedTuple):
    """How a block reads its records.

    Parameters
    ----------
    width
        Standard deviation in s of the zero-phase Gaussian filter that every term passes.
    span
        Time in s over which rates are taken.
    spacing
        Time in s from one row to the next.
    straightened
        Names of the inputs whose noise the block rectifies, see :func:`rectified`.
    """

    width: float
    span: float
    spacing: float
    straightened: tuple[str, ...] = ()


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
    runs = [(r.trace[signal], r.step) for r in records]
    # Whoever takes a rate alone, as where a simulation begins, wants that of a sharp reversal too.
    pace = max(_bounded_pace(runs, noise, order) for order in (1, 2))
    return SPAN / pace if pace else 0.0


def paces(blocks: Sequence[Block], records: Sequence[Record], noise: Noise) -> dict[tuple[str, int], float]:
    """Return the pace in rad/s of every signal and order that decide on a filter."""
    wanted = dict.fromkeys(
        (signal, order)
        for block in blocks
        for signal, highest in _deciding(block).items()
        for order in range(1, highest + 1)
    )
    return {
        (signal, order): _bounded_pace(
            [(r.trace[signal], r.step) for r in records], noise.deviation(signal), order
        )
        for signal, order in wanted
    }


def _bounded_pace(signals: Sequence[tuple[Array, float]], noise: float, order: int) -> float:
    """Return the pace of a derivative; that of an acceleration no quicker than its noise allows."""
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
        raise _too_coarse(block, list(seen), usual_pace, records)
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
    # A record shorter than a few radians of its motion keeps rows that overlap.
    most = min(r.step * len(r.trace) for r in records) / _LEAST_ROWS
    return Filters(width, span, min(max(spacing, SPACING * width), most))


def output_slopes(block: Block, inputs: Array, stride: int) -> Array:
    """Return the derivative of a block's output with respect to each input, shape (inputs, rows).

    ``inputs``: shape (inputs, n).
    """
    s, model = block.model.symbols(), block.model
    slope = ca.Function(
        "slope", [s.state, s.input, s.parameter, s.table], [ca.densify(ca.jacobian(s.output, s.input))]
    )
    some = inputs[:, ::stride]
    start, values = model.start(model.states), model.start(model.parameters)
    flat = slope.map(some.shape[1])(start, some, values, np.zeros(0)).full()
    return np.asarray(flat.reshape(some.shape[1], -1).T, dtype=np.float64)


def measured_inputs(block: Block, record: Record, span: float) -> Array:
    """Return the inputs of a block's model from a record, shape (inputs, n); those not measured rest."""
    model = block.model
    inputs = np.repeat(model.start(model.inputs)[:, None], len(record.trace), axis=1)
    for i, variable in enumerate(model.inputs):
        if variable.name in block.drives:
            drive = block.drives[variable.name]
            inputs[i] = derivative(record.trace[drive.signal], record.step, order=drive.order, span=span)
    return inputs


def rectified(block: Block, record: Record, noise: Noise, span: float) -> dict[str, float]:
    """Return by how much the noise of each input shifts the output of a block, root mean square in its unit.

    A filter behind the output averages noise only where the output is straight in it. Where it is bent, as
    that of a lossy gear where the power turns over, noise is rectified: half the sum of what it causes
    upwards and downwards stays. Rates are smooth already, and so is a motion.
    """
    model, s = block.model, block.model.symbols()
    output = ca.Function("output", [s.state, s.input, s.parameter, s.table], [s.output])
    inputs = measured_inputs(block, record, span)[:, :: max(1, len(record.trace) // _PROBES)]
    start, values = model.start(model.states), model.start(model.parameters)
    motions = {d.signal for d in block.drives.values() if d.order > 0}

    def at(shifted: Array) -> Array:
        return np.asarray(output.map(shifted.shape[1])(start, shifted, values, np.zeros(0)).full()[0])

    shifts = {}
    for i, variable in enumerate(model.inputs):
        drive = block.drives.get(variable.name)
        if drive is None or drive.order == 1 or (drive.order == 0 and drive.signal in motions):
            continue
        weights = filter_weights(0.0, drive.order, record.step, span)
        step = np.zeros((len(model.inputs), 1))
        step[i] = noise.behind(drive.signal, weights, record.step)
        rest = 0.5 * (at(inputs + step) + at(inputs - step)) - at(inputs)
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
            weights = filter_weights(0.0, 1, step, span)
            if steepest * noise.behind(signal, weights, step) <= own:
                break
            span *= _STEP
        longest = min(longest, span)
    return longest


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
            n: noise.behind(d.signal, filter_weights(width, d.order, step, span), step) ** 2
            for n, d in drives.items()
        }
        total = sum(gains[n] * noises[n] for n in drives)
        if block.target:
            total += noise.behind(block.target, filter_weights(width, 0, step), step) ** 2
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


def _too_coarse(
    block: Block, signals: Sequence[str], pace: float, records: Sequence[Record]
) -> MeasurementError:
    now = 1.0 / max(r.step for r in records)
    frequency = pace / (2.0 * math.pi)
    return MeasurementError(
        f"block '{block.name}'",
        f"the motion of {' and '.join(signals)}, typically {frequency:.3g} Hz, is sampled too coarsely at "
        f"{now:.3g} Hz",
        next_step=f"sample at {2.0 * _COARSEST * frequency:.2g} Hz or more, or move more slowly",
    )
