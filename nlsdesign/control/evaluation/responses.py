"""Figures of merit of a closed torque loop, measured on simulated runs."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from ...errors import ValueRangeError
from ...model.roles import moved_load
from ...simulation import Trace
from ...simulation.sampled_batch import PLANT
from ..loop.closed_loop import ClosedLoop

Array = NDArray[np.float64]


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
    """

    rms_error: float
    largest_error: float
    relative_error: float
    estimate_error: float


@dataclass(frozen=True, eq=False)
class SineResponse:
    """Desired to actual torque at several frequencies and one amplitude: a describing function.

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
    """

    amplitude: float
    frequency: Array
    response: NDArray[np.complex128]
    distortion: Array

    @property
    def decibel(self) -> Array:
        """Magnitude in dB."""
        magnitude: Array = 20.0 * np.log10(np.abs(self.response))
        return magnitude

    @property
    def phase_degrees(self) -> Array:
        """Phase in degrees, unwrapped over the frequencies."""
        phase: Array = np.degrees(np.unwrap(np.angle(self.response)))
        return phase


def tracking(loop: ClosedLoop, trace: Trace, *, settled: float = 0.0) -> Tracking:
    """Return how well the torque followed in a run of a closed loop.

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
    error = (trace[loop.torque] - trace[loop.desired])[counted]
    estimate = (trace[loop.estimate] - trace[loop.torque])[counted]
    size = _rms(trace[loop.desired][counted])
    return Tracking(
        _rms(error),
        float(np.max(np.abs(error))),
        _rms(error) / size if size > 0.0 else math.inf,
        _rms(estimate),
    )


def sine_response(
    loop: ClosedLoop, *, amplitude: float, frequencies: Sequence[float], offset: float = 0.0, cycles: int = 4
) -> SineResponse:
    """Run the loop on sines of the desired torque, one run per frequency.

    The first half of the cycles, and at least 0.5 s, count as transient.

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
        Number of cycles that are evaluated.

    Raises
    ------
    ValueRangeError
        If a frequency is not between zero and half the sampling frequency.
    ConvergenceError
        If the plant runs away.
    """
    used, response, distortion = [], [], []
    for wanted in frequencies:
        frequency, samples, skip = _whole(wanted, loop.sample_time, cycles)
        omega = 2.0 * math.pi * frequency
        trace = loop.run(
            (samples + skip) * loop.sample_time,
            inputs={loop.desired: _Sine(amplitude, omega, offset=offset)},
        )
        counted = slice(skip, skip + samples)
        torque, turn = trace[loop.torque][counted], np.exp(-1j * omega * trace.time[counted])
        fundamental = 2.0 * np.mean(torque * turn)
        # sin(ωt) = Im e^(iωt): its fundamental is −i times the amplitude.
        response.append(fundamental / (-1j * amplitude))
        rest = torque - np.mean(torque) - np.real(fundamental / turn)
        distortion.append(_rms(rest) / (abs(fundamental) / math.sqrt(2.0)))
        used.append(frequency)
    return SineResponse(amplitude, np.array(used), np.array(response), np.array(distortion))


def zero_torque(
    loop: ClosedLoop,
    *,
    amplitude: float,
    frequencies: Sequence[float],
    load: str | None = None,
    cycles: int = 4,
) -> Array:
    """Return the root mean square torque, in N·m, that a moved load feels while no torque is wanted.

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
        Number of cycles that are evaluated.

    Raises
    ------
    UnknownNameError
        If the plant has no driven load of that name.
    ArrangementError
        If the structure does not say which body is the load.
    ConvergenceError
        If the plant runs away.
    """
    moved, torques = moved_load(loop.plant, load), []
    for wanted in frequencies:
        frequency, samples, skip = _whole(wanted, loop.sample_time, cycles)
        omega = 2.0 * math.pi * frequency
        trace = loop.run(
            (samples + skip) * loop.sample_time,
            inputs={
                loop.desired: 0.0,
                f"{PLANT}.{moved.motion}": _Sine(amplitude, omega),
                f"{PLANT}.{moved.rate}": _Sine(amplitude * omega, omega, ahead=math.pi / 2.0),
            },
        )
        torques.append(_rms(trace[loop.torque][skip : skip + samples]))
    return np.array(torques)


@dataclass(frozen=True)
class _Sine:
    """A sine of time."""

    amplitude: float
    omega: float
    offset: float = 0.0
    ahead: float = 0.0

    def __call__(self, time: float) -> float:
        return self.offset + self.amplitude * math.sin(self.omega * time + self.ahead)


def _whole(frequency: float, sample_time: float, cycles: int) -> tuple[float, int, int]:
    """Return a frequency of which the cycles fill whole samples, their number, and the samples before."""
    if not 0.0 < frequency < 0.5 / sample_time:
        raise ValueRangeError(
            f"frequency {frequency:g} Hz", f"must lie between 0 and {0.5 / sample_time:g} Hz"
        )
    samples = round(cycles / (frequency * sample_time))
    skip = max(round(0.5 / sample_time), samples // 2)
    return cycles / (samples * sample_time), samples, skip


def _rms(values: Array) -> float:
    return float(np.sqrt(np.mean(np.square(values))))
