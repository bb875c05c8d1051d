"""The gain at which a loop begins to limit-cycle, by simulation, and by the poles of the linearised loop."""

from __future__ import annotations

import math
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from ....foundation.errors import ValueRangeError, unknown_name
from ....simulation.buffered import Translate, as_it_is
from ..loop.closed_loop import CONTROLLER, ClosedLoop
from .linear_loop import linear_loop
from .linear_parts import LinearMode
from .loop_verdict import DIVERGED, LIMIT_CYCLE, LoopJudge, LoopVerdict
from .periodic_runs import PeriodicDrive, PeriodicRun, run_periodic
from .responses import held_drive, sine_drive

Array = NDArray[np.float64]

_BATCH = 9
MOST_ROUNDS = 40
"""Rounds of the search; each makes the bracket several times narrower, so fewer are enough."""


@dataclass(frozen=True, kw_only=True)
class LimitCycleOnset:
    """Where a gain makes a loop limit-cycle.

    Parameters
    ----------
    gain
        Name of the parameter of the controller.
    amplitude, frequency
        Of the desired torque in N·m and Hz; zero Hz is a held torque.
    below, above
        Largest gain found without and smallest found with limit cycle. Infinite or zero where the range that
        was looked at has no such gain.
    verdict
        On the run at ``above``; ``None`` where there is none.
    linear
        Gain at which the linearised loop (sliding, without counts) loses its stability at the first of the
        angles that the spring visits; infinite where it does not within the range.
    linear_frequency
        Of the eigenvalue that does, in Hz.
    """

    gain: str
    amplitude: float
    frequency: float
    below: float
    above: float
    verdict: LoopVerdict | None
    linear: float
    linear_frequency: float

    @property
    def value(self) -> float:
        """Gain of the onset, the middle of its bracket; not a number where none was found."""
        result = self.verdict is not None and self.below > 0.0
        return math.sqrt(self.below * self.above) if result else math.nan

    def __str__(self) -> str:
        where = f"at ±{self.amplitude:g} N·m, {self.frequency:g} Hz" if self.frequency else (
            f"holding {self.amplitude:g} N·m"
        )  # fmt: skip
        if self.verdict is None:
            return f"{self.gain}: no limit cycle up to {self.below:.4g} {where}"
        if self.below == 0.0:
            return f"{self.gain}: {self.verdict} from {self.above:.4g} or less {where}"
        return (
            f"{self.gain}: limit cycle from {self.value:.4g} on {where} ({self.verdict}); the linear loop "
            f"is stable up to {self.linear:.4g}, {self.linear_frequency:.3g} Hz"
        )


def checked_gains(loop: ClosedLoop, gain: str, between: tuple[float, float]) -> tuple[float, float]:
    """Return the range of a gain after a look at its name and ends.

    Parameters
    ----------
    loop
        Closed loop.
    gain
        Name of a parameter of the controller.
    between
        Smallest and largest gain.

    Raises
    ------
    UnknownNameError
        If the controller has no such parameter.
    ValueRangeError
        If the range is empty.
    """
    names = [v.name for v in loop.controller.parameters]
    if gain not in names:
        raise unknown_name("parameter of the controller", gain, names)
    low, high = between
    if not 0.0 < low < high:
        raise ValueRangeError(f"gains {low:g} to {high:g}", "must be positive and ascending")
    return low, high


def onset_of_limit_cycling(
    loop: ClosedLoop,
    gain: str,
    *,
    between: tuple[float, float],
    amplitude: float,
    frequency: float = 0.0,
    accuracy: float = 0.02,
    translate: Translate = as_it_is,
) -> LimitCycleOnset:
    """Return the gain from which on a loop limit-cycles, by batches of simulated runs.

    What is looked for is the first gain that limit-cycles above the first that does not; between the two the
    search goes on until they are near each other.

    Parameters
    ----------
    loop
        Closed loop.
    gain
        Name of a parameter of the controller, such as ``"controller.proportional"``.
    between
        Smallest and largest gain that are looked at, positive.
    amplitude
        Of the desired torque in N·m.
    frequency
        Of its sine in Hz; by default the torque is held.
    accuracy
        Relative width of the bracket at the end, 1.
    translate
        For instance :func:`~nlsdesign.export.natively`: then compiled code runs.

    Raises
    ------
    UnknownNameError
        If the controller has no such parameter.
    ValueRangeError
        If the range is empty.
    """
    low, high = checked_gains(loop, gain, between)
    if not 0.0 < accuracy < 1.0:
        raise ValueRangeError(f"accuracy {accuracy:g}", "must lie between 0 and 1")
    first, last, verdict = 0.0, math.inf, None
    visited: PeriodicRun | None = None
    for _ in range(MOST_ROUNDS):
        gains = np.geomspace(low, high, _BATCH)
        runs = run_periodic(loop, _drive(loop, gain, gains, amplitude, frequency), translate=translate)
        lost = [run.verdict.state in (LIMIT_CYCLE, DIVERGED) for run in runs]
        # Very small gains may oscillate too, slowly, beside an integrator that is then too strong.
        settles = lost.index(False) if not all(lost) else 0
        at = lost.index(True, settles) if any(lost[settles:]) else len(lost)
        if at > 0:
            first = float(gains[at - 1])
        if at > 0 or visited is None:
            visited = runs[max(at - 1, 0)]
        if at == len(lost):
            if verdict is None:
                last = math.inf
            break
        last, verdict = float(gains[at]), runs[at].verdict
        if at == 0 or last <= (1.0 + accuracy) * first:
            break
        low, high = first, last
    largest = np.max(np.abs(visited[LoopJudge(loop).angle])) if visited is not None else math.nan
    linear = linear_onset(loop, gain, between=between, largest=float(largest))
    return LimitCycleOnset(
        gain=gain, amplitude=amplitude, frequency=frequency, below=first, above=last, verdict=verdict,
        linear=linear[0], linear_frequency=linear[1],
    )  # fmt: skip


def linear_onset(
    loop: ClosedLoop,
    gain: str,
    *,
    between: tuple[float, float],
    largest: float,
    mode: LinearMode | None = None,
) -> tuple[float, float]:
    """Return the gain at which the linearised loop becomes unstable at some angle, and the frequency in Hz.

    Infinite and not a number where it is stable up to the end of the range; zero where it is unstable already
    at its beginning.

    Parameters
    ----------
    loop
        Closed loop.
    gain
        Name of a parameter of the controller.
    between
        Smallest and largest gain that are looked at.
    largest
        Angle of the spring in rad up to which it is looked at, of either sign.
    mode
        Of the plant's dry friction; sliding by default.
    """
    angles = np.linspace(-largest, largest, 21)

    def lost(value: float) -> tuple[bool, float]:
        changed = replace(loop, controller=loop.controller.with_values({gain: value}))
        linear = linear_loop(changed, angles, mode=mode)
        z = np.linalg.eigvals(linear.a[linear.reached]).ravel()
        worst = z[np.argmax(np.abs(z))]
        return bool(np.abs(worst) > 1.0 + 1e-9), float(abs(np.angle(worst))) / (
            2.0 * math.pi * loop.sample_time
        )

    gains = [float(g) for g in np.geomspace(*between, _BATCH)]
    result = next((i for i, value in enumerate(gains) if lost(value)[0]), None)
    if result is None:
        return math.inf, math.nan
    if result == 0:
        return 0.0, lost(gains[0])[1]
    low, high = gains[result - 1], gains[result]
    while high > 1.005 * low:
        middle = math.sqrt(low * high)
        low, high = (low, middle) if lost(middle)[0] else (middle, high)
    return math.sqrt(low * high), lost(high)[1]


def _drive(loop: ClosedLoop, gain: str, gains: Array, amplitude: float, frequency: float) -> PeriodicDrive:
    parameters = {f"{CONTROLLER}.{gain}": gains}
    if frequency > 0.0:
        return sine_drive(
            loop, amplitude=amplitude, frequencies=np.full(len(gains), frequency), parameters=parameters
        )
    return held_drive(loop, torques=np.full(len(gains), amplitude), parameters=parameters)
