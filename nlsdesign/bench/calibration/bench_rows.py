"""Samples of a bench become rows of least squares: means under smooth windows, each with its noise.

A balance of efforts is multiplied by a smooth window and integrated; by parts the acceleration becomes the
measured motion times the second derivative of the window (a modulating function), so counts of an encoder are
never differentiated twice and the window blurs all terms alike.
"""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray
from scipy.sparse import csr_matrix

from ...foundation.arrays import Array, Mask
from .bench_response import BALANCE, BenchCourse, BenchResponse

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
