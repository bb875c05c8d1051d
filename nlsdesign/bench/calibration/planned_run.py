"""The runs that a calibration is planned with: motions of the machine as declared, and the current needed."""

from __future__ import annotations

import math
from collections.abc import Sequence
from typing import NamedTuple

import numpy as np

from ...foundation.arrays import Array
from ...foundation.errors import InfeasibleError
from ...model import FlatModel
from ...model.readings import reading_of
from ...model.roles import driven_body, series_spring
from ...simulation import Prior
from .bench_response import BenchCourse, BenchResponse, bench_response
from .bench_rows import RecordedRun, SampleNoise, window_length
from .bench_test import CalibrationTest, FreeRunTest, HungWeightTest
from .unknowns import BenchEvidence, bench_evidence, bench_prior

_SAMPLES = 1000.0
"""Hz at which a bench is taken to log."""
_PER_WINDOW = 24
"""Samples of a window that are enough; each stands for the mean of several."""
_SLOW = (0.25, 8.0, 1.0)
_QUICK = (_SLOW, (1.0, 4.0, 1.0), (5.0, 3.0, 0.5))
"""Frequency in Hz, duration in s, share of the amplitude of each sweep."""
_PART = 0.75
"""Of the contour that a sweep uses."""
_NO_CONTOUR = 0.6
"""Amplitude in rad where no cam says how far its contour goes."""
_WEIGHT = 0.5
"""Torque of the weight, in torques of the spring at the end of the sweep."""
_CURRENT = 0.8
"""Share of the limit of the current that a plan uses."""
_COUNT = 2.0 * math.pi / 8192.0
"""Count of the encoder in rad where none is declared, assumed: 13 bit."""
_FINE = 2e-3
"""Noise of current and cell where none is declared, assumed: share of the largest value."""
_LONGEST = 0.25
"""Longest window in s."""
_FREE_SPEED, _FREE_PERIOD, _FREE_TIME = 25.0, 2.0, 8.0
"""Free run: rad/s, s, s."""


class _Sweep(NamedTuple):
    """A motion over time, and the weight that hangs meanwhile."""

    name: str
    step: float
    motion: Array
    weight: float


def planned_bench(model: FlatModel, kind: CalibrationTest, known: Prior) -> BenchEvidence:
    """Return a bench with the runs that are planned for a kind of calibration."""
    # The readings of efforts.
    efforts = {"N", "N*m"}
    channels = [
        r.signal
        for r in model.readings
        if model.variable(reading_of(model.readings, r.signal).measured).unit in efforts
    ]
    response = bench_response(model, bench_prior(model, known), channels)
    share = 1.0
    while True:
        runs = [_run(model, response, sweep) for sweep in _sweeps(model, kind, response, share)]
        # A drive that saturates by itself has no command for a motion that is too fast for it.
        most = float(np.max([np.max(np.abs(run.course.command)) for _, run in runs]))
        limit = _limit(model)
        if math.isfinite(most) and most <= _CURRENT * limit:
            return bench_evidence(model, kind, channels, runs, known=known)
        share *= 0.8
        if share < 0.05:
            raise InfeasibleError(
                f"{kind.title} of '{model.name}'",
                f"needs more than {_CURRENT:g} of the limit of its drive for any motion worth the name",
                next_step="check the limit of the current in the deck",
            )


def sweep_end(model: FlatModel) -> float:
    """Return how far a calibration turns the drive, in rad of the series spring."""
    if not model.springs:
        return _NO_CONTOUR
    ends = [cam.last_angle for cam in series_spring(model).cams if cam.last_angle]
    return _PART * model.values[ends[0]] if ends else _NO_CONTOUR


def _limit(model: FlatModel) -> float:
    motor = driven_body(model).motor
    return model.values[motor.current_limit] if motor else math.inf


def _sweeps(
    model: FlatModel, kind: CalibrationTest, response: BenchResponse, share: float
) -> Sequence[_Sweep]:
    if isinstance(kind, FreeRunTest):
        step = _step(_LONGEST)
        time = np.arange(0.0, _FREE_TIME, step)
        turn = 2.0 * math.pi / _FREE_PERIOD
        # Speed as a sine whose size changes, so that acceleration and speed are told apart.
        size = share * _FREE_SPEED * (1.0 + 0.5 * np.sin(0.31 * turn * time))
        return [_Sweep("free run", step, np.cumsum(size * _begun(time) * np.sin(turn * time)) * step, 0.0)]
    end = share * sweep_end(model) * drive_ratio(model)
    # Whether the spring resists to both sides.
    still = np.zeros(response.columns)
    forth, back = (abs(float(response.resting(angle, still).value[0, 0])) for angle in (end, -end))
    both = back > 0.1 * forth
    if isinstance(kind, HungWeightTest):
        held = response.resting(end, np.zeros(response.columns))
        torque = _WEIGHT * response.inertia * abs(float(held.value[0, 0])) * abs(drive_ratio(model))
        weights = (0.0, torque, -torque) if both else (0.0, torque, 2.0 * torque)
        return [_sine(f"weight {w:.3g} N·m", end, _SLOW, both)._replace(weight=w) for w in weights]
    return [_sine(f"{sweep[0]:g} Hz", end, sweep, both) for sweep in _QUICK]


def _step(window: float) -> float:
    return max(1, int(window * _SAMPLES) // _PER_WINDOW) / _SAMPLES


def drive_ratio(model: FlatModel) -> float:
    """Return the turns of the driven body for one of the spring."""
    if not model.springs:
        return 1.0
    body, spring = driven_body(model), series_spring(model)
    shown = [
        model.evaluate([a if v.name == body.motion else v.start for v in model.states])[spring.motion]
        for a in (0.0, 1e-3)
    ]
    change = (shown[1] - shown[0]) / 1e-3
    return 1.0 / change if change else 1.0


def _begun(time: Array) -> Array:
    s = np.clip((time - 0.2) / 0.5, 0.0, 1.0)
    result: Array = s * s * (3.0 - 2.0 * s)
    return result


def _sine(name: str, end: float, sweep: tuple[float, float, float], both: bool) -> _Sweep:
    frequency, seconds, part = sweep
    step = _step(min(_LONGEST, 0.2 / frequency))
    time = np.arange(0.0, seconds, step)
    phase = 2.0 * math.pi * frequency * (time - 0.2)
    shape = np.sin(phase) if both else 0.5 - 0.5 * np.cos(phase)
    return _Sweep(name, step, part * end * _begun(time) * shape, 0.0)


def _run(model: FlatModel, response: BenchResponse, sweep: _Sweep) -> tuple[str, RecordedRun]:
    step = sweep.step
    rate = np.gradient(sweep.motion, step)
    still = np.zeros(len(rate))
    course = BenchCourse(step, sweep.motion, rate, still, still + sweep.weight)
    free = response.along(course, np.zeros(response.columns))
    with np.errstate(divide="ignore", invalid="ignore"):
        command = (np.gradient(rate, step) - free.value[0]) / free.value[1]
    course = course._replace(command=command)
    shown = response.along(course, np.zeros(response.columns))
    measured = shown.value[2:]
    count = _declared(model, driven_body(model).motion, "quantum") or _COUNT
    drive = next(iter(driven_body(model).drives), "")
    noises = [
        _declared(model, c, "noise") or _FINE * float(np.max(np.abs(m)))
        for c, m in zip(response.channels, measured, strict=True)
    ]
    most = min(_limit(model), 10.0 * float(np.max(np.abs(command))))
    finer = 1.0 / math.sqrt(max(1.0, step * _SAMPLES))
    noise = SampleNoise(
        count / math.sqrt(12.0) * finer,
        (_declared(model, drive, "noise") or _FINE * most) * finer,
        count,
        tuple(n * finer for n in noises),
        window_length(sweep.motion, step),
    )
    return sweep.name, RecordedRun(course, measured, noise, np.zeros(len(rate), dtype=bool))


def _declared(model: FlatModel, signal: str, which: str) -> float:
    """Return the declared count or noise of what reads a signal; zero where there is none."""
    for reading in model.readings:
        if signal in (reading.measured, reading.signal):
            for law in reading.laws:
                number = law.parameters().get(which)
                if number is not None and number.number > 0.0:
                    return number.number
    return 0.0
