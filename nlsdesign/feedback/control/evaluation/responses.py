"""Figures of merit of a closed torque loop, measured on simulated runs.

Every figure comes with the verdict on its run. Where the loop did not settle (a limit cycle, a run that
diverged or never repeated itself) the figure is not a number, and the verdict says why.
"""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from ....foundation.errors import ValueRangeError
from ....model.roles import moved_load
from ....simulation import Trace
from ....simulation.buffered import Translate, as_it_is
from ....simulation.sampled_batch import PLANT
from ..laws.largest_torque import check_torque
from ..loop.closed_loop import ClosedLoop
from .loop_verdict import NO_ANSWER, LoopJudge, LoopVerdict
from .periodic_runs import PeriodicDrive, PeriodicRun, run_periodic

Array = NDArray[np.float64]

_APPROACH = 0.3
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
        magnitude: Array = 20.0 * np.log10(np.abs(self.response))
        return magnitude

    @property
    def phase_degrees(self) -> Array:
        """Phase in degrees, unwrapped over the frequencies that settled."""
        phase = np.angle(self.response)
        good = np.isfinite(phase)
        phase[good] = np.unwrap(phase[good])
        degrees: Array = np.degrees(phase)
        return degrees

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
    """How a loop holds torques.

    Parameters
    ----------
    torque
        In N·m, shape (n,).
    rms_error
        Root mean square of the torque error in N·m, shape (n,); not a number where a verdict does not hold.
    verdicts
        On each run.
    """

    torque: Array
    rms_error: Array
    verdicts: tuple[LoopVerdict, ...]


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
    response = [_answer(run, loop.torque, amplitude) for run in runs]
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
    """Return sines of the desired torque as drives of many runs.

    Parameters
    ----------
    loop
        Closed loop.
    amplitude
        In N·m, one number or shape (runs,).
    frequencies
        In Hz, shape (runs,).
    offset
        In N·m.
    cycles
        In a window.
    parameters
        Of the loop by full name, numbers or shape (runs,).
    """
    plain = PeriodicDrive(
        frequencies=frequencies, drives=lambda _, __: {}, parameters=parameters or {}, cycles=cycles
    )
    omega = 2.0 * math.pi * plain.windows(loop.sample_time)[2]
    size = amplitude * np.ones(len(omega))

    def drives(time: Array, runs: NDArray[np.intp]) -> dict[str, Array | float]:
        return {loop.desired: offset + size[runs, None] * np.sin(omega[runs, None] * time)}

    return PeriodicDrive(frequencies=frequencies, drives=drives, parameters=parameters or {}, cycles=cycles)


def held_drive(
    loop: ClosedLoop, *, torques: Array, parameters: Mapping[str, Array | float] | None = None
) -> PeriodicDrive:
    """Return torques that are approached smoothly and then held, as drives of many runs.

    The last twentieth comes as a step: a loop that only dry friction keeps quiet is woken by it.

    Parameters
    ----------
    loop
        Closed loop.
    torques
        In N·m, shape (runs,).
    parameters
        Of the loop by full name, numbers or shape (runs,).
    """

    def drives(time: Array, runs: NDArray[np.intp]) -> dict[str, Array | float]:
        share = 0.475 - 0.475 * np.cos(math.pi * np.minimum(time / _APPROACH, 1.0))
        return {loop.desired: torques[runs, None] * np.where(time >= _APPROACH, 1.0, share)}

    return PeriodicDrive(frequencies=np.zeros(len(torques)), drives=drives, parameters=parameters or {})


def held_torque(
    loop: ClosedLoop, torques: Sequence[float] | Array, *, translate: Translate = as_it_is
) -> HeldTorque:
    """Return how a loop holds torques: the error at rest, and whether it limit-cycles there.

    Parameters
    ----------
    loop
        Load fixed, or held by its inputs at zero.
    torques
        In N·m, shape (n,).
    translate
        For instance :func:`~nlsdesign.export.natively`: then compiled code runs.
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

    def drives(time: Array, runs: NDArray[np.intp]) -> dict[str, Array | float]:
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


def _answer(run: PeriodicRun, torque: str, amplitude: float) -> complex:
    # sin(ωt) = Im e^(iωt): its fundamental is −i times the amplitude.
    return run.fundamental(torque) / (-1j * amplitude) if run.verdict.holds else complex(math.nan, math.nan)


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
