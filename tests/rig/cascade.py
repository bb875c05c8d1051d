"""Another loop and other motions than those of `kinds`: a robot's cascade, told to go from point to point.

The loop of `digital_loop` tracks sines with a feed forward of inertia. Here position acts on speed and speed
on current, a current loop lags, and the motions are those of a robot: points, a chirp, a spline, a slow
sine and steps. A diagnosis that was developed on the one has to hold on the other.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from math import exp, pi

import numpy as np
from scipy.interpolate import CubicSpline

from .digital_loop import Wanted

_REST = 0.4  # s, before the first motion


@dataclass(frozen=True)
class Cascade:
    """A position loop around a speed loop, and the current loop below both."""

    rate: float  # Hz
    position_gain: float  # 1/s
    speed_gain: float  # A·s/rad
    integral: float  # A/rad
    cutoff: float  # Hz, of the low-pass on the speed
    limit: float  # A
    counts: float  # rad or m
    lag: float  # s, of the current loop
    feed: float  # A·s²/rad, times the wanted acceleration

    def begun(self) -> Callable[[float, float, float, float], float]:
        """Return what gives the current at each tick for goal, its speed and acceleration, and the place."""
        period, integral, filtered, before = 1.0 / self.rate, 0.0, 0.0, 0.0
        share = 1.0 - exp(-2.0 * pi * self.cutoff * period)

        def current(goal: float, pace: float, bend: float, place: float) -> float:
            nonlocal integral, filtered, before
            read = self.counts * round(place / self.counts)
            filtered += share * ((read - before) / period - filtered)
            before = read
            error = pace + self.position_gain * (goal - read) - filtered
            wanted = self.speed_gain * error + integral + self.feed * bend
            if abs(wanted) < self.limit:
                integral += period * self.integral * error
            return min(max(wanted, -self.limit), self.limit)

        return current


def journeys(size: float, quickest: float, rate: float, draw: np.random.Generator) -> dict[str, Wanted]:
    """Return motions by the name of the record.

    Parameters
    ----------
    size
        Largest place, rad or m.
    quickest
        Hz, of the end of the chirp.
    rate
        Of the loop, Hz.
    draw
        Of points and times.
    """
    return {
        "points_1": _told(_points(size, rate, draw), rate),
        "chirp": _told(_chirp(size, quickest, rate), rate),
        "spline": _told(_spline(size, quickest, rate, draw), rate),
        "slow": _told(_slow(size, quickest, rate), rate),
        "points_2": _told(_points(size, rate, draw), rate),
        "steps": _told(_steps(size, rate, draw), rate, feed=0.0),
    }


def _told(place: np.ndarray, rate: float, *, feed: float = 1.0) -> Wanted:
    time = np.arange(len(place)) / rate
    speed = np.gradient(place, time)
    return Wanted(time, place, speed, feed * np.gradient(speed, time))


def _points(size: float, rate: float, draw: np.random.Generator) -> np.ndarray:
    """Return moves of least jerk between points drawn by chance, with rests between them."""
    parts, here = [np.zeros(round(_REST * rate))], 0.0
    for _ in range(6):
        there, x = draw.uniform(-size, size), np.linspace(0.0, 1.0, round(draw.uniform(0.5, 1.4) * rate))
        move = here + (there - here) * x**3 * (10.0 - 15.0 * x + 6.0 * x * x)
        parts += [move, np.full(round(draw.uniform(0.1, 0.5) * rate), there)]
        here = there
    return np.concatenate(parts)


def _since(seconds: float, rate: float) -> np.ndarray:
    """Return the time since the motion began, zero before."""
    return np.maximum(np.arange(round(seconds * rate)) / rate - _REST, 0.0)


def _chirp(size: float, quickest: float, rate: float) -> np.ndarray:
    since = _since(7.0, rate)
    lowest, span = 0.1 * quickest, since[-1]
    frequency = lowest + (quickest - lowest) * since / span
    phase = 2.0 * np.pi * (lowest * since + 0.5 * (quickest - lowest) * since**2 / span)
    return np.minimum(since, 1.0) ** 2 * size / (1.0 + 4.0 * frequency / quickest) * np.sin(phase)


def _spline(size: float, quickest: float, rate: float, draw: np.random.Generator) -> np.ndarray:
    """Return a smooth way through points drawn by chance, as a hand leads a joint."""
    knots = np.arange(0.0, 8.0, 1.2 / quickest)
    through = draw.normal(0.0, 0.4 * size, len(knots))
    through[:2] = 0.0
    return np.clip(CubicSpline(knots, through, bc_type="clamped")(_since(7.0, rate)), -1.5 * size, 1.5 * size)


def _slow(size: float, quickest: float, rate: float) -> np.ndarray:
    return 0.8 * size * np.sin(2.0 * np.pi * 0.08 * quickest * _since(8.0, rate))


def _steps(size: float, rate: float, draw: np.random.Generator) -> np.ndarray:
    """Return steps that are told within 40 ms."""
    goals = [0.0, *draw.uniform(-0.4 * size, 0.4 * size, 6)]
    told, over = np.repeat(goals, round(rate)), round(0.04 * rate)
    return np.convolve(np.concatenate([np.zeros(over - 1), told]), np.full(over, 1.0 / over), "valid")
