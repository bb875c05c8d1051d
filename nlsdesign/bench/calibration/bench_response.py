"""What a machine on the bench should show while it follows a measured motion, with exact derivatives.

The motion drives everything: inner states of the rubber follow from it, every measured effort is compared
with the model's, and the drive is held to the balance of efforts on it. So it does not matter who moves the
machine, and nothing has to be integrated twice.

Samples of a bench become rows of least squares: means under smooth windows, each with its noise.

A balance of efforts is multiplied by a smooth window and integrated; by parts the acceleration becomes the
measured motion times the second derivative of the window (a modulating function), so counts of an encoder are
never differentiated twice and the window blurs all terms alike.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass, field
from typing import NamedTuple

import casadi as ca
import numpy as np
from numpy.typing import NDArray
from scipy.sparse import csr_matrix

from ...foundation.arrays import Array, Mask
from ...foundation.errors import ArrangementError
from ...model import FlatModel
from ...model.roles import driven_body
from ...model.structure import MovingBody
from ...simulation import Prior
from .bench_test import WEIGHT

_LEAST_SAMPLES, _LONGEST = 13, 0.25
"""Samples and seconds of a window at least and at most."""
_SHARE = 0.2
"""Of the time in which the motion turns once by a radian of its phase: a window sees little of a period."""
_STRIDE = 0.6
"""SmoothWindows apart, in lengths."""
_MOVING = 5.0
"""Standard deviations of the noise of the rate above which a sample moves for certain."""


class SampleNoise(NamedTuple):
    """Standard deviations of a sample."""

    motion: float
    command: float
    quantum: float  # count of the motion; zero where there is none
    channels: tuple[float, ...]  # of the measured efforts
    window: float  # length of a window in s


@dataclass(frozen=True, eq=False)
class SmoothWindows:
    """Smooth windows over samples."""

    mean: csr_matrix  # shape (rows, n): weighted means
    second: csr_matrix  # shape (rows, n): second derivatives of the windowed mean over time, in 1/s²
    centres: NDArray[np.int64]  # sample in the middle of each row
    length: int  # samples of a window


class BenchRows(NamedTuple):
    """Rows of one channel of one record."""

    channel: str
    centres: NDArray[np.int64]  # sample in the middle of each
    # residual, sigma: measured minus shown in the unit of the channel, and its noise; shape (rows,)
    residual: Array
    sigma: Array
    slope: Array  # of the residual over the factors, shape (rows, columns)
    shown: Array  # what the model shows, in the unit of the channel, shape (rows,)
    size: float  # root mean square of what is compared, in its unit


def windows(count: int, step: float, seconds: float) -> SmoothWindows:
    """Return windows over a record.

    ``seconds``: length of a window; at least 13 samples are taken.
    """
    half = max(_LEAST_SAMPLES // 2, round(0.5 * seconds / step))
    s = np.arange(-half, half + 1) / (half + 1.0)
    mean = (1.0 - s**2) ** 4
    mean /= mean.sum()
    second = (1.0 - s**2) ** 2 * (56.0 * s**2 - 8.0)
    # On samples too, a line has no second derivative and t²/2 has one of one.
    second -= mean * second.sum()
    second *= 2.0 / float((second * (s * (half + 1.0) * step) ** 2).sum())
    second -= mean * second.sum()
    stride = max(1, round(_STRIDE * len(s)))
    centres = np.arange(half, count - half, stride)
    columns = (centres[:, None] + np.arange(-half, half + 1)[None]).ravel()
    rows = np.repeat(np.arange(len(centres)), len(s))
    shape = (len(centres), count)
    return SmoothWindows(
        csr_matrix((np.tile(mean, len(centres)), (rows, columns)), shape),
        csr_matrix((np.tile(second, len(centres)), (rows, columns)), shape),
        centres,
        len(s),
    )


def rate_of(motion: Array, step: float, seconds: float) -> tuple[Array, float]:
    """Return the rate of a sampled motion, and the factor from noise of the motion to that of the rate."""
    half = max(_LEAST_SAMPLES // 4, round(0.5 * seconds / step))
    s = np.arange(-half, half + 1) / (half + 1.0)
    slope = s * (1.0 - s**2) ** 3
    slope /= float((slope * s).sum()) * (half + 1.0) * step
    wide = np.concatenate(
        [2 * motion[0] - motion[half:0:-1], motion, 2 * motion[-1] - motion[-2 : -half - 2 : -1]]
    )
    rate: Array = np.convolve(wide, slope[::-1], mode="valid")
    return rate, float(np.linalg.norm(slope))


def window_length(motion: Array, step: float) -> float:
    """Return the length of a window in s that suits a motion: a fifth of a radian of its phase."""
    rate = rate_of(motion, step, 0.03)[0]
    line = np.polynomial.polynomial.polyfit(np.arange(len(motion)), motion, 1)
    swing = motion - np.polynomial.polynomial.polyval(np.arange(len(motion)), line)
    pace = float(np.std(rate - np.mean(rate)) / max(float(np.std(swing)), 1e-12))
    return min(_LONGEST, max(_LEAST_SAMPLES * step, _SHARE * 2.0 * math.pi / max(pace, 1e-9)))


class RecordedRun(NamedTuple):
    """A record on a bench."""

    course: BenchCourse  # motion, command and weight as measured
    measured: Array  # efforts, shape (channels, n)
    noise: SampleNoise
    masked: Mask  # samples that are faulty, shape (n,)


def rows_of(response: BenchResponse, run: RecordedRun, x: Array) -> list[BenchRows]:
    """Return the rows of all channels of one record, the balance of the drive first.

    The balance is solved for the command: its noise is what the balance is uncertain by, and so no number
    can make the error smaller by making all efforts small.
    """
    course, noise = run.course, run.noise
    view = windows(len(course.motion), course.step, noise.window)
    if not len(view.centres):
        return []
    shown = response.along(course, x)
    mean = np.array([view.mean @ value for value in shown.value])
    slope = np.array([view.mean @ each for each in shown.slope])
    stiff = np.array([view.mean @ np.abs(each) for each in shown.by_motion])
    sound = view.mean @ run.masked.astype(float) == 0.0
    counts = (view.mean @ np.abs(np.gradient(course.motion))) * view.length
    narrow = float(np.linalg.norm(view.mean[0].data))
    # Rounding of a motion that stays within a count does not average out.
    averaged = counts > 3.0 * noise.quantum
    blur = np.where(averaged, noise.motion * narrow, max(noise.motion, noise.quantum / math.sqrt(12.0)))
    rows = []
    if response.balanced:
        gain = np.where(np.abs(mean[1]) > 1e-6 * np.max(np.abs(mean[1])), mean[1], np.inf)
        error = (view.second @ course.motion - mean[0]) / gain
        by_x = -(slope[0] + error[:, None] * slope[1]) / gain[:, None]
        bend = float(np.linalg.norm(view.second[0].data))
        variance = (noise.command * narrow) ** 2 + (noise.motion * bend / gain) ** 2
        variance += (stiff[0] * blur / gain) ** 2
        # In which windows every sample moves, in one direction: only there dry friction is known.
        factor = rate_of(course.motion, course.step, 0.5 * noise.window)[1]
        least = _MOVING * max(noise.motion, 1e-12) * factor
        least = max(least, 1e-3 * float(np.max(np.abs(course.rate))))
        fast = np.where(np.abs(course.rate) > least, np.sign(course.rate), 0.0)
        inside = view.mean.copy()
        inside.data = np.ones_like(inside.data)
        in_motion: Mask = np.abs(np.asarray(inside @ fast)).ravel() >= view.length - 0.5
        use = sound & in_motion & np.isfinite(gain)
        effort = response.inertia * float(np.median(np.abs(mean[1])))
        parts = (effort * error, effort * np.sqrt(variance), effort * by_x, effort * mean[1])
        rows.append(_row(BALANCE, view.centres, use, *parts, effort * course.command))
    for k, channel in enumerate(response.channels):
        error = view.mean @ run.measured[k] - mean[2 + k]
        variance = (stiff[2 + k] * blur) ** 2 + (noise.channels[k] * narrow) ** 2
        parts = (error, np.sqrt(variance), -slope[2 + k], mean[2 + k])
        rows.append(_row(channel, view.centres, sound, *parts, run.measured[k]))
    return rows


def _row(channel: str, centres: NDArray[np.int64], use: Mask, *parts: Array) -> BenchRows:
    error, sigma, slope, shown, compared = parts
    size = float(np.sqrt(np.mean(compared**2)))
    floor = np.maximum(sigma, 1e-6 * size + 1e-12)
    return BenchRows(channel, centres[use], error[use], floor[use], slope[use], shown[use], size)


BALANCE = "balance of the drive"


class BenchCourse(NamedTuple):
    """What is known of a run at evenly spaced times, arrays of shape (n,)."""

    step: float  # time between samples in s
    motion: Array
    rate: Array
    command: Array  # what drives it, for instance a current
    weight: Array  # torque of a hung weight, positive against positive motion


class Shown(NamedTuple):
    """What the machine should show at each sample."""

    # value: acceleration of the drive at the measured command, its derivative with respect to the command,
    # and the channels; shape (2 + channels, n)
    value: Array
    slope: Array  # over the factors, shape (2 + channels, n, factors)
    by_motion: Array  # derivative with respect to the motion, shape (2 + channels, n)


@dataclass(frozen=True, eq=False)
class BenchResponse:
    """Functions of a machine on the bench over factors: the logarithms of its numbers over their values."""

    model: FlatModel
    channels: tuple[str, ...]  # measured efforts that are compared with the model
    balanced: bool  # whether the command is measured, and compared with what the motion needs
    # factors: names of the numbers that vary; of those that share one factor the first stands for all. Three
    # follow for the instruments: zero of the motion, offset of the command, factor of the weight.
    factors: tuple[str, ...]
    inner: tuple[str, ...]  # names of the states that the motion drives
    inertia: float  # which turns acceleration into effort, SI
    _rest: ca.Function
    _step: ca.Function
    _shown: ca.Function
    _mapped: dict[int, tuple[ca.Function, ca.Function]] = field(default_factory=dict)

    @property
    def columns(self) -> int:
        """Number of factors, those of the instruments included."""
        return len(self.factors) + 3

    def along(self, course: BenchCourse, x: Array) -> Shown:
        """Return what the machine shows along a course."""
        n, size, columns = len(course.motion), len(self.inner), self.columns
        data = np.vstack([course.motion, course.rate, course.command, course.weight])
        if n not in self._mapped:
            carried = self._step.mapaccum("run", n - 1) if n > 1 else self._step
            self._mapped[n] = carried, self._shown.map(n)
        run, shown = self._mapped[n]
        states, sensitivities = np.zeros((size, n)), np.zeros((n, size, columns))
        if size:
            first = self._at_rest(data[:, 0], x)
            everywhere = np.tile(x[:, None], (1, n - 1))
            pace = np.full((1, n - 1), course.step)
            rows = first[:, None]
            if n > 1:
                later = run(first, data[:, :-1], data[:, 1:], pace, everywhere).full()
                rows = np.hstack([rows, later])
            states = rows[:size]
            sensitivities = rows[size:].T.reshape(n, columns, size).transpose(0, 2, 1)
        results = shown(states, data, np.tile(x[:, None], (1, n)))
        value, by_x, by_inner, by_motion = (r.full() for r in results)
        count = 2 + len(self.channels)
        slope = by_x.reshape(count, n, columns)
        if size:
            slope = slope + np.einsum("cns,nsk->cnk", by_inner.reshape(count, n, size), sensitivities)
        return Shown(value, slope, by_motion)

    def resting(self, motion: float, x: Array) -> Shown:
        """Return what the machine shows at rest, as :meth:`along` does; shapes (2 + channels, 1)."""
        still = np.zeros(1)
        return self.along(BenchCourse(1.0, still + motion, still, still, still), x)

    def _at_rest(self, data: Array, x: Array) -> Array:
        """Return inner states and their slopes where the machine has rested; as declared if it never does."""
        size, columns = len(self.inner), self.columns
        z = np.array([self.model.variable(name).start for name in self.inner])
        resting = np.array([data[0], 0.0, data[2], data[3]])
        slope = np.zeros((size, columns))
        for _ in range(20):
            rate, by_z, by_x = (r.full() for r in self._rest(z, resting, x))
            if not np.all(np.isfinite(by_z)) or np.linalg.cond(by_z) > 1e12:
                break  # a state without a place of rest, such as a history, begins as declared
            change = np.linalg.solve(by_z, rate.ravel())
            z, slope = z - change, -np.linalg.solve(by_z, by_x)
            if np.max(np.abs(change)) <= 1e-12 * (1.0 + np.max(np.abs(z))):
                break
        return np.concatenate([z, slope.T.ravel()])


def bench_response(
    model: FlatModel, prior: Prior, channels: Sequence[str], *, balanced: bool = True
) -> BenchResponse:
    """Return the functions of a machine on the bench."""
    body = driven_body(model)
    if body.prescribed or body.inertia is None or len(body.drives) > 1:
        raise ArrangementError(
            f"body '{body.name}'",
            "has no single drive whose effort could be calibrated",
            next_step="declare a motor with a current, or a torque, as its one input",
        )
    others = [b for b in model.bodies if b.name != body.name and not b.prescribed]
    if others:
        raise ArrangementError(f"body '{others[0].name}'", "moves too", next_step="clamp it")
    given = _expressions(model, body, prior)
    by_command = ca.jacobian(given.acceleration, given.data[2])
    shown = [given.acceleration, by_command, *(given.signals[c] for c in channels)]
    return BenchResponse(
        model,
        tuple(channels),
        balanced,
        given.factors,
        given.inner,
        _inertia(model, body.inertia),
        *_functions(given, ca.vertcat(*shown)),
    )


class _Expressions(NamedTuple):
    """Expressions of a machine on the bench."""

    factors: tuple[str, ...]
    inner: tuple[str, ...]
    x: ca.SX
    z: ca.SX
    data: ca.SX
    flow: ca.SX
    acceleration: ca.SX
    signals: dict[str, ca.SX]


def shared_factors(prior: Prior) -> dict[str, tuple[str, ...]]:
    """Return the numbers that share one factor, by the first of them."""
    size = prior.deviations
    result: dict[str, list[str]] = {}
    for k, name in enumerate(prior.names):
        for first in result:
            j = prior.place(first)
            alike = abs(size[j] - size[k]) < 1e-9 * size[j]
            if alike and prior.covariance[j, k] > (1.0 - 1e-9) * size[j] * size[k]:
                result[first].append(name)
                break
        else:
            result[name] = [name]
    return {first: tuple(names) for first, names in result.items()}


def _expressions(model: FlatModel, body: MovingBody, prior: Prior) -> _Expressions:
    named = [v.name for v in model.states]
    inner = tuple(n for n in named if n not in (body.motion, body.rate))
    shapes = shared_factors(prior)
    wide = ca.SX.sym("x", len(shapes) + 3)
    data, z = ca.SX.sym("data", 4), ca.SX.sym("z", len(inner))
    held = {body.motion: data[0] + wide[-3], body.rate: data[1], **{n: z[i] for i, n in enumerate(inner)}}
    drive = body.drives[0] if body.drives else ""
    commanded = [data[2] + wide[-2] if v.name == drive else ca.SX(v.start) for v in model.inputs]
    factor = {name: wide[k] for k, names in enumerate(shapes.values()) for name in names}
    kinds = dict(zip(prior.names, prior.kinds, strict=True))
    numbers = [
        data[3] * (1.0 + wide[-1])
        if v.name == f"{WEIGHT}.load"
        else (kinds[v.name].expression(v.start, factor[v.name]) if v.name in factor else ca.SX(v.start))
        for v in model.parameters
    ]
    arguments = [ca.vertcat(*[held[n] for n in named]), ca.vertcat(*commanded), ca.vertcat(*numbers)]
    inserted = [ca.SX(0), *arguments, ca.SX(0, 1)]
    rates, _, signals, _ = model.equations.call(inserted)
    everything = ca.vertcat(rates, signals)
    acts = np.array(ca.DM(ca.jacobian_sparsity(everything, wide), 1).full().any(axis=0)).ravel()
    kept = [k for k in range(len(shapes)) if acts[k]]
    x = ca.SX.sym("x", len(kept) + 3)
    place = {k: i for i, k in enumerate([*kept, *range(len(shapes), len(shapes) + 3)])}
    narrow = ca.vertcat(*[x[place[k]] if k in place else ca.SX(0) for k in range(len(shapes) + 3)])
    rates, signals, state = (ca.substitute(each, wide, narrow) for each in (rates, signals, inserted[1]))
    return _Expressions(
        tuple(list(shapes)[k] for k in kept),
        inner,
        x,
        z,
        data,
        ca.vertcat(*[rates[named.index(n)] for n in inner]),
        rates[named.index(body.rate)],
        {v.name: state[i] for i, v in enumerate(model.states)}
        | {v.name: signals[i] for i, v in enumerate(model.signals)},
    )


def _functions(given: _Expressions, shown: ca.SX) -> tuple[ca.Function, ca.Function, ca.Function]:
    """Return rates at rest with slopes, the step of inner states with slopes, and channels with slopes."""
    x, z, data, flow = given.x, given.z, given.data, given.flow
    rest = ca.Function("rest", [z, data, x], [flow, ca.jacobian(flow, z), ca.jacobian(flow, x)])
    later, pace = ca.SX.sym("later", 4), ca.SX.sym("pace")
    then = ca.substitute([flow], [data], [later])[0]
    size = z.numel()
    # Linearly implicit trapezoidal rule: fast relaxation at a slow sample rate stays stable.
    matrix = ca.SX.eye(size) - 0.5 * pace * ca.jacobian(then, z)
    after = z + ca.solve(matrix, 0.5 * pace * (flow + then)) if size else z
    slope = ca.SX.sym("slope", size, x.numel())
    carried = ca.jacobian(after, z) @ slope + ca.jacobian(after, x)
    step = ca.Function(
        "step",
        [ca.vertcat(z, ca.vec(slope)), data, later, pace, x],
        [ca.vertcat(after, ca.vec(carried))],
    )
    derivatives = [ca.jacobian(shown, x), ca.jacobian(shown, z), ca.jacobian(shown, data[0])]
    return rest, step, ca.Function("shown", [z, data, x], [shown, *derivatives])


def _inertia(model: FlatModel, name: str) -> float:
    if name in model.values:
        return model.values[name]
    return float(model.evaluate(model.start(model.states).tolist())[name])
