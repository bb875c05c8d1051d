"""Whether a run of a closed loop answers its drive, oscillates by itself, or is lost.

A figure of merit means what its name says only where the loop has settled to a periodic answer. What the
drive does not explain is what is left of the torque after its mean and its harmonics; a limit cycle is an
oscillation in that rest that keeps swinging. An encoder makes small rests too, by its counts. A uniform
quantiser acts on an oscillation of amplitude A as a gain, its describing function; above A = 2 counts that
gain lies between 0.90 and 1.06, so an oscillation of two counts or more is carried by the loop, which is
then within a tenth of its critical gain with or without counts. Below it is chatter: the counts themselves
can keep it up in a loop that is stable otherwise. The threshold is therefore two counts times the largest
tangent stiffness that the run visits; half a per cent of the size of the torque is added for what harmonics
beyond the tenth leave.

Source: Gelb and Vander Velde 1968 (describing function of the quantiser).
"""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import dataclass, replace
from functools import cached_property
from itertools import pairwise

import casadi as ca
import numpy as np
import scipy

from ....foundation.arrays import Array, Indices
from ....model import FlatModel
from ....model.roles import measured_motion, series_spring
from ....model.transform import named
from ....simulation.sampled_batch import PLANT
from ...analysis.rest import evaluate_at, rate_state, rest_states
from ..closed_loop import ClosedLoop

SETTLED, LIMIT_CYCLE, UNSETTLED, DIVERGED = "settled", "limit cycle", "not settled", "diverged"
NO_ANSWER = "no answer"
HARMONICS = 10
"""Multiples of the drive's frequency that count as answer to the drive; up to twice as many count in part."""
COUNTS = 2.0
"""Amplitude in counts above which an oscillation is no chatter."""
_SHARE = 0.005
_PIECE = 12
"""Half swings of the pieces whose pace and size are looked at."""
_KEEPS = 0.9
"""Last over first of three whole swings that do not die away; a damping ratio of 0.01 gives 0.88."""
_FAST = 3.0
"""Frequency of a drive in Hz below which what oscillates at 30 Hz and more is beyond its tenth harmonic."""
_RISES = 1.1
"""Odd harmonic over the one before from which on it stands out."""
_STEP = math.log(1.3)
_LOCKED = 0.1
"""Share of the torque above which an odd harmonic that stands out is an oscillation in step with the drive;
what stands out less is made by the current limit."""
_PERIODS = 4
"""Periods of a sine from which on its harmonics are told from an oscillation near one of them."""
_SWINGS = 6
"""Half swings beyond the threshold, one after the other, that make an oscillation: three whole ones."""


@dataclass(frozen=True)
class LoopVerdict:
    """What a run of a closed loop turned out to be.

    Parameters
    ----------
    state
        ``"settled"``, ``"limit cycle"``, ``"not settled"`` (still changing from window to window after the
        longest time that was allowed), ``"diverged"`` or ``"no answer"`` (a sine that moves no torque).
    amplitude
        Of the torque that the drive does not explain, in N·m: of the limit cycle where there is one, else
        the largest value of the rest, which is chatter.
    frequency
        Of that oscillation in Hz; not a number where there is none.
    saturated
        Share of the time at the limit of the current, 1.
    peak_current
        Largest current, in A.
    threshold
        Amplitude beyond which an oscillation counts as limit cycle, in N·m.
    """

    state: str
    amplitude: float
    frequency: float
    saturated: float
    peak_current: float
    threshold: float

    @property
    def holds(self) -> bool:
        """Whether numbers of the run mean what their names say."""
        return self.state == SETTLED

    def __str__(self) -> str:
        limit = f", {100 * self.saturated:.0f} % of the time at the current limit" if self.saturated else ""
        if self.state == LIMIT_CYCLE:
            return (
                f"limit cycle of ±{self.amplitude:.2g} N·m at {self.frequency:.3g} Hz, "
                f"current up to {self.peak_current:.3g} A{limit}"
            )
        return f"{self.state}{limit}"


@dataclass(frozen=True, eq=False)
class LoopJudge:
    """Judges runs of one closed loop.

    Parameters
    ----------
    loop
        Closed loop.
    """

    loop: ClosedLoop

    @cached_property
    def current(self) -> str:
        """Full name of the current that acts."""
        return f"{PLANT}.{self.loop.names.current}"

    @cached_property
    def angle(self) -> str:
        """Full name of the angle of the series spring."""
        return f"{PLANT}.{series_spring(self.loop.plant).motion}"

    @cached_property
    def keep(self) -> tuple[str, ...]:
        """Full names of the signals that a verdict needs."""
        return (self.loop.torque, self.current, self.angle)

    @cached_property
    def count(self) -> float:
        """Sum of the counts of the encoders that observer and controller read, in rad; zero without."""
        plant = self.loop.plant
        s = plant.symbols()
        known = named(plant, s)
        sources = [
            source.removeprefix(f"{PLANT}.")
            for source in self.loop.system([self.loop.desired]).sources.values()
            if source.startswith(f"{PLANT}.")
        ]
        read = ca.vertcat(*[known[name] for name in dict.fromkeys(sources)])
        used = {str(symbol) for symbol in ca.symvar(read)}
        unit = plant.variable(series_spring(plant).motion).unit
        quanta = {f"{sensor}.quantum" for reading in plant.readings for sensor in reading.sensors}
        return sum(v.start for v in plant.parameters if v.name in quanta & used and v.unit == unit)

    @cached_property
    def current_limit(self) -> float:
        """Largest current that the controller commands, in A; infinite where it states none."""
        return self.loop.controller.outputs[0].maximum

    @cached_property
    def _tables(self) -> dict[int, tuple[Array, Array]]:
        return {}

    def stiffness(self, largest: float) -> float:
        """Return the largest tangent stiffness up to an angle of the spring, of either sign, in N·m/rad.

        Parameters
        ----------
        largest
            In rad.
        """
        size = math.ceil(math.log(max(largest, 1e-6)) / _STEP)
        if size not in self._tables:
            grid = math.exp(_STEP * size) * np.linspace(-1.0, 1.0, 81)
            slope = np.abs(tangent_stiffness(self.loop.plant, grid))
            both = np.maximum(slope, slope[::-1])[40:]
            self._tables[size] = (grid[40:], np.maximum.accumulate(both))
        return float(np.interp(largest, *self._tables[size]))

    def torque_of_count(self, spring_angle: Array) -> float:
        """Return the largest torque of one count in a run, in N·m; zero without counts.

        Parameters
        ----------
        spring_angle
            Of a run, shape (n,), in rad.
        """
        if not self.count:
            return 0.0
        return self.count * self.stiffness(float(np.max(np.abs(spring_angle))))

    def threshold(self, spring_angle: Array, torque: Array) -> float:
        """Return the amplitude beyond which an oscillation is a limit cycle, in N·m.

        Parameters
        ----------
        spring_angle, torque
            Of a run, shape (n,), in rad and N·m.
        """
        return COUNTS * self.torque_of_count(spring_angle) + _SHARE * float(np.max(np.abs(torque))) + 1e-9

    def judged(self, signals: Mapping[str, Array], *, cycles: int, steady: bool = True) -> LoopVerdict:
        """Return the verdict on a stretch of a run.

        Parameters
        ----------
        signals
            Those of ``keep`` by full name, shape (n,).
        cycles
            Whole cycles of the drive in the stretch; zero for a constant one.
        steady
            Whether the answer had stopped changing.
        """
        torque = signals[self.loop.torque]
        if not np.all(np.isfinite(torque)):
            return self._verdict(signals, torque, steady)
        rest = without_harmonics(torque, cycles)
        verdict = self._verdict(signals, rest, steady)
        if cycles == 0 and verdict.state == SETTLED and np.sqrt(np.mean(rest**2)) > verdict.threshold:
            # Nothing drives a held torque: what moves it, however unevenly, is the loop itself.
            strongest = int(np.argmax(np.abs(np.fft.rfft(rest * np.hanning(len(rest))))[1:])) + 1
            frequency = strongest / (len(rest) * self.loop.sample_time)
            return replace(verdict, state=LIMIT_CYCLE, frequency=frequency)
        driven = cycles / (len(torque) * self.loop.sample_time)
        if verdict.state == LIMIT_CYCLE or driven < _FAST:
            return verdict
        amplitude, order = locked(torque, cycles)
        if not amplitude > max(verdict.threshold, _LOCKED * float(np.max(np.abs(torque)))):
            return verdict
        frequency = order * driven
        return replace(verdict, state=LIMIT_CYCLE, amplitude=amplitude, frequency=frequency)

    def judged_error(self, signals: Mapping[str, Array]) -> LoopVerdict:
        """Return the verdict on a stretch of any course, from what oscillates faster than it.

        What counts is the torque error above three times the frequency below which 99.9 % of the power of the
        desired torque lie. Where that is one sine, its harmonics do not count: a limit that is reached in
        every half period distorts the answer without an oscillation of the loop.

        Parameters
        ----------
        signals
            Those of ``keep`` and the desired torque by full name, shape (n,).
        """
        desired, error = signals[self.loop.desired], signals[self.loop.torque] - signals[self.loop.desired]
        if len(error) > 2 * _SWINGS and np.all(np.isfinite(error)):
            error = _faster(_without_answer(error, desired), desired)
        return self._verdict(signals, error, True)

    def _verdict(self, signals: Mapping[str, Array], rest: Array, steady: bool) -> LoopVerdict:
        torque, current = signals[self.loop.torque], signals[self.current]
        if not all(np.all(np.isfinite(signals[name])) for name in self.keep):
            return LoopVerdict(DIVERGED, math.nan, math.nan, math.nan, math.nan, math.nan)
        limit = self.current_limit
        saturated = float(np.mean(np.abs(current) >= 0.999 * limit)) if math.isfinite(limit) else 0.0
        peak = float(np.max(np.abs(current)))
        threshold = self.threshold(signals[self.angle], torque)
        amplitude, frequency = sustained(rest, threshold, self.loop.sample_time)
        if math.isfinite(frequency):
            return LoopVerdict(LIMIT_CYCLE, amplitude, frequency, saturated, peak, threshold)
        state = SETTLED if steady else UNSETTLED
        return LoopVerdict(state, float(np.max(np.abs(rest))), math.nan, saturated, peak, threshold)


def without_harmonics(values: Array, cycles: int) -> Array:
    """Return what is left of a stretch without its mean and the harmonics of its drive.

    ``cycles``: whole cycles of the drive in it; zero takes off the mean and a straight drift only.
    """
    if cycles == 0:
        time = np.linspace(-1.0, 1.0, len(values))
        return values - np.polynomial.Polynomial.fit(time, values, 1)(time)
    spectrum = np.fft.rfft(values)
    spectrum[0] = 0.0
    multiples = spectrum[cycles::cycles]
    # A sharp end would ring before and after every kick, so the removal fades out.
    share = np.clip((np.arange(1.0, len(multiples) + 1.0) - HARMONICS) / HARMONICS, 0.0, 1.0)
    multiples *= 0.5 - 0.5 * np.cos(math.pi * share)
    return np.fft.irfft(spectrum, len(values))


def locked(values: Array, cycles: int) -> tuple[float, int]:
    """Return amplitude and order of an oscillation that is locked to a multiple of its drive; zero for none.

    What limits and laws make of a sine falls from odd harmonic to odd harmonic. An oscillation of the loop
    that has fallen into step with a fast drive stands out of that fall.
    """
    size = 2.0 * np.abs(np.fft.rfft(values)[cycles::cycles]) / len(values)
    odd = size[0 : 2 * HARMONICS : 2]
    rises = 2 + np.flatnonzero(odd[2:] > _RISES * odd[1:-1])
    if not len(rises):
        return 0.0, 0
    best = int(rises[np.argmax(odd[rises])])
    return float(odd[best]), 2 * best + 1


def _faster(error: Array, desired: Array) -> Array:
    """Return the part of an error that is faster than what was desired."""
    window = np.hanning(len(error))
    drift = np.polynomial.Polynomial.fit(np.linspace(-1.0, 1.0, len(error)), error, 1)
    spectrum = np.fft.rfft(window * (error - drift(np.linspace(-1.0, 1.0, len(error)))))
    power = np.cumsum(np.abs(np.fft.rfft(window * (desired - np.mean(desired)))) ** 2)
    # Below the resolution of the window nothing is told apart.
    last = int(np.searchsorted(power, 0.999 * power[-1])) if power[-1] > 0.0 else 0
    spectrum[: 3 * max(last, 2) + 1] = 0.0
    return np.fft.irfft(spectrum, len(error))


def _without_answer(error: Array, desired: Array) -> Array:
    """Return an error without the harmonics of the desired torque, where that is a sine over some periods."""
    frequency = _frequency_of_sine(desired)
    if frequency is None or frequency * len(error) < _PERIODS:
        return error
    turns = 2.0 * math.pi * frequency * np.arange(len(error))
    orders = np.arange(1, min(4 * HARMONICS, int(0.45 / frequency), len(error) // 8) + 1)
    waves = np.concatenate([np.cos(np.outer(orders, turns)), np.sin(np.outer(orders, turns))]).T
    rest: Array = error - waves @ np.linalg.lstsq(waves, error, rcond=None)[0]
    return rest


def _frequency_of_sine(values: Array) -> float | None:
    """Return the frequency of a sine in periods per sample, or ``None`` where it is none."""
    centred = values - np.mean(values)
    power = float(np.sum(centred**2))
    if power == 0.0:
        return None
    spectrum = np.abs(np.fft.rfft(np.hanning(len(values)) * centred))
    start = max(int(np.argmax(spectrum)), 1) / len(values)
    time = np.arange(len(values))

    def left(frequency: float) -> float:
        waves = np.stack([np.cos(2.0 * math.pi * frequency * time), np.sin(2.0 * math.pi * frequency * time),
                          np.ones(len(values))], axis=1)  # fmt: skip
        rest = values - waves @ np.linalg.lstsq(waves, values, rcond=None)[0]
        return float(np.sum(rest**2))

    width = 1.0 / len(values)
    bounds, options = (max(start - width, 1e-9), start + width), {"xatol": 1e-9}
    best = scipy.optimize.minimize_scalar(left, bounds=bounds, method="bounded", options=options)
    return float(best.x) if best.fun < 1e-6 * power else None


def sustained(rest: Array, threshold: float, sample_time: float) -> tuple[float, float]:
    """Return amplitude and frequency of an oscillation that keeps swinging; not a number where there is none.

    Between swings the sign changes beyond the threshold on both sides; at least three whole swings have to
    follow each other at an even pace without dying away: a ringing after each passage of a dead zone is none.
    """
    beyond = np.flatnonzero(np.abs(rest) > threshold)
    if len(beyond) < _SWINGS:
        return math.nan, math.nan
    signs = np.sign(rest[beyond])
    starts = beyond[np.flatnonzero(np.concatenate([[True], signs[1:] != signs[:-1]]))]
    if len(starts) < _SWINGS:
        return math.nan, math.nan
    first, last = _longest_even(np.diff(starts))
    best = (math.nan, math.nan)
    # The frequency may drift along a burst, so pieces of it are looked at one by one.
    for k in range(first, max(last - _PIECE, first) + 1):
        edges = starts[k : min(k + _PIECE, last) + 1]
        if len(edges) <= _SWINGS:
            continue
        frequency = (len(edges) - 1) / (2.0 * sample_time * float(edges[-1] - edges[0]))
        swings = np.array([np.max(np.abs(rest[a:b])) for a, b in pairwise(edges)])
        amplitude = float(np.median(swings))
        if amplitude <= best[0] or not _keeps_on(swings):
            continue
        if _carries(rest[edges[0] : edges[-1] + 1], frequency * sample_time):
            best = (amplitude, frequency)
    return best


def _keeps_on(swings: Array) -> bool:
    """Tell whether three whole swings follow each other without dying away, as those of a ringing do."""
    return any(
        np.mean(swings[k + _SWINGS - 2 : k + _SWINGS]) > _KEEPS * np.mean(swings[k : k + 2])
        for k in range(len(swings) - _SWINGS + 1)
    )


def _longest_even(gaps: Indices) -> tuple[int, int]:
    """Return the longest stretch of gaps that differ from their median by at most half of it."""
    best, first = (0, 0), 0
    for i in range(1, len(gaps) + 1):
        pace = float(np.median(gaps[first:i]))
        if i == len(gaps) or not 0.5 * pace <= gaps[i] <= 1.5 * pace:
            best = max(best, (first, i), key=lambda stretch: stretch[1] - stretch[0])
            first = i
    return best


def _carries(stretch: Array, frequency: float) -> bool:
    """Tell whether most of the power of a stretch lies near its pace, and not in single kicks."""
    power = np.abs(np.fft.rfft(np.hanning(len(stretch)) * stretch, 4 * len(stretch))) ** 2
    at = np.fft.rfftfreq(4 * len(stretch))
    near = (at > 0.8 * frequency) & (at < 1.25 * frequency)
    return bool(np.sum(power[near]) > 0.5 * np.sum(power))


def tangent_stiffness(plant: FlatModel, angles: Array) -> Array:
    """Return the slope of the spring's torque when the angle jumps from rest, in N·m/rad, shape (n,).

    ``plant``: with a driven body and a series spring; prescribed motions stay at their start values.
    """
    motion = measured_motion(plant)
    names = [v.name for v in plant.states]
    at, of = names.index(motion), names.index(rate_state(plant, motion))
    s = plant.symbols()
    torque = named(plant, s)[series_spring(plant).effort]
    row = ca.jacobian(torque, s.state)
    inner = [i for i in range(len(names)) if i not in (at, of)]
    jump = row[at]
    for i in inner:
        jump += row[i] * ca.jacobian(s.derivative[i], s.state[of])
    (slopes,) = evaluate_at(plant, s, [jump], rest_states(plant, angles, unmoved=True))
    return slopes.ravel()
