"""Figures of merit of a closed torque loop, measured on simulated runs.

Every figure comes with the verdict on its run. Where the loop did not settle (a limit cycle, a run that
diverged or never repeated itself) the figure is not a number, and the verdict says why.

Many runs on periodic drives are simulated at once; those whose windows are of similar length share a batch.
Every batch first runs through its transient, then window after window until the fundamental of the torque is
the same in two that follow each other, or until the longest time that is allowed. The last two windows are
what is evaluated.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, field, replace
from itertools import count
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from ....foundation.arrays import Array, Indices
from ....foundation.errors import ValueRangeError
from ....model.roles import moved_load
from ....simulation import Trace
from ....simulation.buffered import Translate, as_it_is
from ....simulation.sample_writer import SampledSystem
from ....simulation.sampled_batch import PLANT, run_batch
from ..closed_loop import ClosedLoop
from ..laws.known_drive import check_torque
from .loop_verdict import NO_ANSWER, UNSETTLED, LoopJudge, LoopVerdict, tangent_stiffness, without_harmonics

Drives = Callable[[Array, Indices], Mapping[str, Array | float]]
"""Takes times, shape (T,), and the numbers of the runs; returns open inputs, shape (runs, T) or numbers."""

TRANSIENT = 0.5
"""Shortest time in s before the first window."""
WINDOWS, LONGEST = 6, 4.0
"""Windows and time in s after both of which a run that still changes is given up."""
_SAME = 0.005
"""Change of the fundamental from window to window below which the answer counts as periodic."""
_SHARE_OF_COUNT = 0.2
"""Change of the fundamental that counts alone make, in counts; a held torque may wander by a whole one."""
_SIMILAR = 1.5
_SHORTEST = 0.25
"""Shortest window in s: three swings of whatever oscillates faster than 12 Hz."""


@dataclass(frozen=True, eq=False, kw_only=True)
class PeriodicDrive:
    """Which runs are made."""

    # frequencies: in Hz, one per run, shape (runs,); rounded so that whole cycles fill whole samples. Zero is
    # a constant drive, whose windows last half a second.
    frequencies: Array
    drives: Drives  # open inputs over time
    # parameters: parameters of the loop by full name, numbers or shape (runs,)
    parameters: Mapping[str, Array | float] = field(default_factory=dict)
    # cycles: cycles in a window; by default as many as make a quarter of a second, and at least one
    cycles: int | None = None

    def windows(self, sample_time: float) -> tuple[Indices, Indices, Array]:
        """Return samples and cycles of the window of each run, and the frequencies that fit them."""
        for f in self.frequencies:
            if not 0.0 <= f < 0.5 / sample_time:
                raise ValueRangeError(
                    f"frequency {f:g} Hz", f"must lie between 0 and {0.5 / sample_time:g} Hz"
                )
        held = self.frequencies == 0.0
        wanted = np.ceil(_SHORTEST * self.frequencies - 1e-9) if self.cycles is None else self.cycles
        cycles = np.where(held, 0.0, np.maximum(wanted, 1.0) * np.ones(len(self.frequencies)))
        length = np.where(held, TRANSIENT, cycles / np.where(held, 1.0, self.frequencies))
        samples = np.round(length / sample_time)
        return samples.astype(np.intp), cycles.astype(np.intp), cycles / (samples * sample_time)


@dataclass(frozen=True, eq=False)
class PeriodicRun:
    """The last two windows of a run."""

    frequency: float  # of the drive in Hz
    cycles: int  # in both windows together
    time: Array  # in s, shape (n,)
    signals: Mapping[str, Array]  # by full name, shape (n,)
    verdict: LoopVerdict  # what the run turned out to be

    def __getitem__(self, name: str) -> Array:
        """Return one signal, shape (n,)."""
        return self.signals[name]

    def fundamental(self, name: str) -> complex:
        """Return c of the fundamental Re(c·e^(jωt)) of a signal."""
        turn = np.exp(-2j * math.pi * self.frequency * self.time)
        return complex(2.0 * np.mean(self.signals[name] * turn))

    def rms(self, name: str) -> float:
        """Return the root mean square of a signal."""
        return float(np.sqrt(np.mean(np.square(self.signals[name]))))


def run_periodic(
    loop: ClosedLoop, drive: PeriodicDrive, *, keep: Sequence[str] = (), translate: Translate = as_it_is
) -> list[PeriodicRun]:
    """Run a loop on periodic drives until it repeats itself, or diverges, or time is up."""
    samples, cycles, used = drive.windows(loop.sample_time)
    order, runs = np.argsort(samples), {}
    judge, system = LoopJudge(loop), loop.system(drive.drives(np.zeros(1), np.zeros(1, dtype=np.intp)))
    shown = tuple(dict.fromkeys([*judge.keep, *keep]))
    while len(order):
        group = order[samples[order] <= _SIMILAR * samples[order[0]]]
        runs.update(_Group(judge, drive, shown, system, group).run(samples, cycles, used, translate))
        order = order[len(group) :]
    return [runs[i] for i in range(len(samples))]


class _Group(NamedTuple):
    """Runs of similar length, advanced together."""

    judge: LoopJudge
    drive: PeriodicDrive
    keep: tuple[str, ...]
    system: SampledSystem
    group: Indices

    def run(
        self, samples: Indices, cycles: Indices, used: Array, translate: Translate
    ) -> dict[int, PeriodicRun]:
        step, group = self.judge.loop.sample_time, self.group
        parameters = {
            n: v[group] if isinstance(v, np.ndarray) and v.ndim else v
            for n, v in self.drive.parameters.items()
        }
        length = int(np.max(samples[group]))
        begin, state = 0, None
        shown = {name: np.zeros((len(group), 0)) for name in self.keep}
        result: list[PeriodicRun] = []
        for window in count(1):
            # The transient comes with the first two windows, which are the least that is needed.
            more = 2 * length + round(TRANSIENT / step) if window == 1 else length
            time = step * (begin + np.arange(more + 1.0))
            batch = run_batch(
                self.system, (more - 1) * step, inputs=self.drive.drives(time, group),
                parameters=parameters, start=state, keep=self.keep, translate=translate,
            )  # fmt: skip
            state = {name: batch.final[:, i] for i, name in enumerate(self.system.states)}
            begin += more
            shown = {n: np.concatenate([v, batch[n]], axis=1)[:, -2 * length :] for n, v in shown.items()}
            result = [
                self._evaluated({n: v[k, -2 * int(samples[i]) :] for n, v in shown.items()},
                                int(cycles[i]), float(used[i]), step * begin)
                for k, i in enumerate(group)
            ]  # fmt: skip
            if (window >= WINDOWS - 1 and step * begin >= LONGEST) or all(
                run.verdict.state != UNSETTLED for run in result
            ):
                break
        return {int(i): run for i, run in zip(group, result, strict=True)}

    def _evaluated(
        self, signals: Mapping[str, Array], cycles: int, frequency: float, end: float
    ) -> PeriodicRun:
        length = len(signals[self.judge.loop.torque])
        steady = self._steady(signals[self.judge.loop.torque], signals[self.judge.angle], 2 * cycles)
        verdict = self.judge.judged(signals, cycles=2 * cycles, steady=steady)
        time = end + self.judge.loop.sample_time * np.arange(-float(length), 0.0)
        return PeriodicRun(frequency, 2 * cycles, time, signals, verdict)

    def _steady(self, torque: Array, angle: Array, cycles: int) -> bool:
        """Tell whether the last window is like the one before, and what the drive leaves does not grow."""
        n = len(torque) // 2
        if not np.all(np.isfinite(torque)):
            return True
        threshold = self.judge.threshold(angle, torque)
        before, after = (np.fft.rfft(half)[1:] / n for half in (torque[:n], torque[n:]))
        number = int(np.argmax(np.abs(after)))
        change, size = 2.0 * abs(after[number] - before[number]), 2.0 * abs(after[number])
        rest = without_harmonics(torque, cycles)
        earlier, later = (float(np.sqrt(np.mean(part**2))) for part in (rest[:n], rest[n:]))
        grows = later > 1.2 * earlier and later > 0.1 * threshold
        noise = (_SHARE_OF_COUNT if cycles else 1.0) * self.judge.torque_of_count(angle)
        return bool(change <= _SAME * size + noise and not grows)


_APPROACH = 0.3
_BLOW = 0.01
"""Time in s in which a held torque is approached."""
_SILENT = 1e-6
"""Share of the desired torque below which a torque has not answered."""


@dataclass(frozen=True)
class Tracking:
    """How well the torque follows.

    Parameters
    ----------
    rms_error, largest_error
        Actual minus desired torque in N·m.
    relative_error
        Root mean square error over the root mean square of the desired torque, 1.
    estimate_error
        Root mean square of estimated minus actual torque in N·m.
    verdict
        On the run; where it does not hold the numbers are not numbers.
    """

    rms_error: float
    largest_error: float
    relative_error: float
    estimate_error: float
    verdict: LoopVerdict


@dataclass(frozen=True, eq=False)
class SineResponse:
    """Desired to actual torque at several frequencies and one amplitude: a describing function.

    Where a verdict does not hold, response and distortion are not numbers.

    Parameters
    ----------
    amplitude
        Of the desired torque in N·m.
    frequency
        In Hz, shape (n,).
    response
        Complex ratio of the fundamentals, shape (n,).
    distortion
        What is not fundamental, root mean square over that of the fundamental, shape (n,).
    verdicts
        On each run.
    offset
        Of the desired torque in N·m.
    """

    amplitude: float
    frequency: Array
    response: NDArray[np.complex128]
    distortion: Array
    verdicts: tuple[LoopVerdict, ...]
    offset: float = 0.0

    @property
    def decibel(self) -> Array:
        """Magnitude in dB."""
        return 20.0 * np.log10(np.abs(self.response))

    @property
    def phase_degrees(self) -> Array:
        """Phase in degrees, unwrapped over the frequencies that settled."""
        phase = np.angle(self.response)
        good = np.isfinite(phase)
        phase[good] = np.unwrap(phase[good])
        return np.degrees(phase)

    @property
    def saturated(self) -> Array:
        """Share of the time at the current limit, shape (n,)."""
        return np.array([verdict.saturated for verdict in self.verdicts])


@dataclass(frozen=True, eq=False)
class ZeroTorque:
    """What a load feels that is moved as a sine while no torque is wanted.

    Where a verdict does not hold, the numbers are not numbers.

    Parameters
    ----------
    amplitude
        Of the load's angle in rad.
    frequency
        In Hz, shape (n,).
    rms
        Root mean square torque in N·m, shape (n,).
    energy
        That the load loses to the actuator per cycle, in J, shape (n,).
    impedance
        Torque that resists the load over its speed, complex ratio of the fundamentals, in N·m·s/rad.
    verdicts
        On each run.
    """

    amplitude: float
    frequency: Array
    rms: Array
    energy: Array
    impedance: NDArray[np.complex128]
    verdicts: tuple[LoopVerdict, ...]


@dataclass(frozen=True, eq=False)
class HeldTorque:
    """How a loop holds torques."""

    torque: Array  # in N·m, shape (n,)
    # rms_error: root mean square of the torque error in N·m, shape (n,); not a number where a verdict does
    # not hold
    rms_error: Array
    verdicts: tuple[LoopVerdict, ...]  # on each run


def tracking(loop: ClosedLoop, trace: Trace, *, settled: float = 0.0) -> Tracking:
    """Return how well the torque followed in a run of a closed loop.

    Whether the loop limit-cycles is looked for in the torque error, above three times the frequency below
    which 99.9 % of the power of the desired torque lie.

    Parameters
    ----------
    loop
        Closed loop.
    trace
        What its run gave.
    settled
        Time in s before which nothing counts.

    Raises
    ------
    ValueRangeError
        If nothing is left.
    """
    counted = trace.time >= settled
    if not np.any(counted):
        raise ValueRangeError(f"settled {settled:g} s", f"the run ends at {trace.time[-1]:g} s")
    judge = LoopJudge(loop)
    verdict = judge.judged_error({n: trace[n][counted] for n in (*judge.keep, loop.desired)})
    if not verdict.holds:
        return Tracking(math.nan, math.nan, math.nan, math.nan, verdict)
    error = (trace[loop.torque] - trace[loop.desired])[counted]
    estimate = (trace[loop.estimate] - trace[loop.torque])[counted]
    size = _rms(trace[loop.desired][counted])
    return Tracking(
        _rms(error),
        float(np.max(np.abs(error))),
        _rms(error) / size if size > 0.0 else math.inf,
        _rms(estimate),
        verdict,
    )


def sine_response(
    loop: ClosedLoop,
    *,
    amplitude: float,
    frequencies: Sequence[float] | Array,
    offset: float = 0.0,
    cycles: int | None = None,
    translate: Translate = as_it_is,
) -> SineResponse:
    """Run the loop on sines of the desired torque, one run per frequency, until the answer repeats itself.

    A run whose torque does not follow at all has the verdict ``"no answer"``: a spring that pulls to one side
    only need not follow a sine about zero.

    Parameters
    ----------
    loop
        Load fixed, or held by its inputs at zero.
    amplitude
        Of the desired torque in N·m.
    frequencies
        In Hz; rounded so that a whole number of samples makes the evaluated cycles.
    offset
        Of the desired torque in N·m.
    cycles
        Number of cycles in a window, two of which are evaluated; by default a quarter of a second, and at
        least one cycle.
    translate
        For instance :func:`~nlsdesign.export.natively`: then compiled code runs.

    Raises
    ------
    ValueRangeError
        If a frequency is not between zero and half the sampling frequency, or the amplitude not positive or
        beyond what the current limit can hold.
    """
    _check_amplitude(amplitude, "N·m")
    check_torque(loop.plant, abs(offset) + amplitude)
    wanted = np.asarray(frequencies, dtype=float)
    drive = sine_drive(loop, amplitude=amplitude, frequencies=wanted, offset=offset, cycles=cycles)
    runs = [
        _unless_silent(run, loop.torque, amplitude) for run in run_periodic(loop, drive, translate=translate)
    ]
    # sin(ωt) = Im e^(iωt): the fundamental of the drive is −i times the amplitude.
    response = [
        run.fundamental(loop.torque) / (-1j * amplitude) if run.verdict.holds else complex(math.nan, math.nan)
        for run in runs
    ]
    return SineResponse(
        amplitude,
        np.array([run.frequency for run in runs]),
        np.array(response),
        np.array([_distortion(run, loop.torque) for run in runs]),
        tuple(run.verdict for run in runs),
        offset,
    )


def sine_drive(
    loop: ClosedLoop,
    *,
    amplitude: float | Array,
    frequencies: Array,
    offset: float = 0.0,
    cycles: int | None = None,
    parameters: Mapping[str, Array | float] | None = None,
) -> PeriodicDrive:
    """Return sines of the desired torque as drives of many runs."""
    plain = PeriodicDrive(
        frequencies=frequencies, drives=lambda _, __: {}, parameters=parameters or {}, cycles=cycles
    )
    omega = 2.0 * math.pi * plain.windows(loop.sample_time)[2]
    size = amplitude * np.ones(len(omega))

    def drives(time: Array, runs: Indices) -> dict[str, Array | float]:
        return {loop.desired: offset + size[runs, None] * np.sin(omega[runs, None] * time)}

    return PeriodicDrive(frequencies=frequencies, drives=drives, parameters=parameters or {}, cycles=cycles)


def held_drive(
    loop: ClosedLoop,
    *,
    torques: Array,
    parameters: Mapping[str, Array | float] | None = None,
    kick: float = 0.0,
) -> PeriodicDrive:
    """Return torques that are approached smoothly and then held, as drives of many runs.

    The last twentieth comes as a step: a loop that only dry friction keeps quiet is woken by it. A kick is
    wanted besides for the 10 ms after the step.
    """

    def drives(time: Array, runs: Indices) -> dict[str, Array | float]:
        share = 0.475 - 0.475 * np.cos(math.pi * np.minimum(time / _APPROACH, 1.0))
        struck = (time >= _APPROACH) & (time < _APPROACH + _BLOW)
        return {loop.desired: torques[runs, None] * np.where(time >= _APPROACH, 1.0, share) + kick * struck}

    return PeriodicDrive(frequencies=np.zeros(len(torques)), drives=drives, parameters=parameters or {})


def held_torque(
    loop: ClosedLoop, torques: Sequence[float] | Array, *, translate: Translate = as_it_is
) -> HeldTorque:
    """Return how a loop holds torques: the error at rest, and whether it limit-cycles there.

    ``loop``: load fixed, or held by its inputs at zero. ``translate``: for instance
    :func:`~nlsdesign.export.natively`: then compiled code runs.
    """
    wanted = np.asarray(torques, dtype=float)
    check_torque(loop.plant, float(np.max(np.abs(wanted))))
    runs = run_periodic(loop, held_drive(loop, torques=wanted), translate=translate)
    good = np.array([run.verdict.holds for run in runs])
    error = np.array([_rms(run[loop.torque] - t) for run, t in zip(runs, wanted, strict=True)])
    return HeldTorque(wanted, np.where(good, error, np.nan), tuple(run.verdict for run in runs))


def zero_torque(
    loop: ClosedLoop,
    *,
    amplitude: float,
    frequencies: Sequence[float] | Array,
    load: str | None = None,
    cycles: int | None = None,
    translate: Translate = as_it_is,
) -> ZeroTorque:
    """Return what a load feels that is moved as a sine while no torque is wanted: Fig. 9 of the paper.

    Parameters
    ----------
    loop
        Its plant has a load whose motion is prescribed.
    amplitude
        Of the sine of the load's angle in rad.
    frequencies
        In Hz, shape (n,).
    load
        Name of the load; decided from the structure of the plant if it is left out.
    cycles
        Number of cycles in a window, two of which are evaluated.
    translate
        For instance :func:`~nlsdesign.export.natively`: then compiled code runs.

    Raises
    ------
    UnknownNameError
        If the plant has no driven load of that name.
    ArrangementError
        If the structure does not say which body is the load.
    ValueRangeError
        If a frequency is not between zero and half the sampling frequency, or the amplitude not positive.
    """
    moved = moved_load(loop.plant, load)
    _check_amplitude(amplitude, "rad")
    motion, rate = f"{PLANT}.{moved.motion}", f"{PLANT}.{moved.rate}"
    wanted = np.asarray(frequencies, dtype=float)
    plain = PeriodicDrive(frequencies=wanted, drives=lambda _, __: {}, cycles=cycles)
    omega = 2.0 * math.pi * plain.windows(loop.sample_time)[2]

    def drives(time: Array, runs: Indices) -> dict[str, Array | float]:
        turned = omega[runs, None] * time
        return {
            loop.desired: 0.0,
            motion: amplitude * np.sin(turned),
            rate: amplitude * omega[runs, None] * np.cos(turned),
        }

    driven = PeriodicDrive(frequencies=wanted, drives=drives, cycles=cycles)
    runs = run_periodic(loop, driven, keep=(motion, rate), translate=translate)
    good = np.array([run.verdict.holds for run in runs])
    rms = np.array([run.rms(loop.torque) for run in runs])
    # A positive torque of the spring pushes the load on: what resists has the other sign.
    power = np.array([-float(np.mean(run[loop.torque] * run[rate])) for run in runs])
    frequency = np.array([run.frequency for run in runs])
    ratio = np.array([-run.fundamental(loop.torque) / run.fundamental(rate) for run in runs])
    return ZeroTorque(
        amplitude,
        frequency,
        np.where(good, rms, np.nan),
        np.where(good, power / frequency, np.nan),
        np.where(good, ratio, np.nan),
        tuple(run.verdict for run in runs),
    )


def _unless_silent(run: PeriodicRun, torque: str, amplitude: float) -> PeriodicRun:
    """Return a run, with another verdict where the torque did not answer."""
    if not run.verdict.holds or abs(run.fundamental(torque)) > _SILENT * amplitude:
        return run
    return replace(run, verdict=replace(run.verdict, state=NO_ANSWER))


def _distortion(run: PeriodicRun, torque: str) -> float:
    if not run.verdict.holds:
        return math.nan
    fundamental, values = run.fundamental(torque), run[torque]
    turn = np.exp(2j * math.pi * run.frequency * run.time)
    rest = values - np.mean(values) - np.real(fundamental * turn)
    return _rms(rest) / (abs(fundamental) / math.sqrt(2.0))


def _check_amplitude(amplitude: float, unit: str) -> None:
    if not (math.isfinite(amplitude) and amplitude > 0.0):
        raise ValueRangeError(f"amplitude {amplitude:g} {unit}", "must be finite and positive")


def _rms(values: Array) -> float:
    return float(np.sqrt(np.mean(np.square(values))))


def torque_resolution(loop: ClosedLoop, angles: Sequence[float] | Array) -> Array:
    """Return the torque of one encoder count over the angle, k_t(θ)·count in N·m, shape (n,).

    The counts of all encoders between which the deflection is read add up; zero for readings without counts.

    ``angles``: of the driven body with the load at zero, shape (n,), in rad.
    """
    at = np.atleast_1d(np.asarray(angles, dtype=float))
    return np.abs(tangent_stiffness(loop.plant, at)) * LoopJudge(loop).count
