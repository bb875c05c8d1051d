"""Where a loop stops to do what it does: current limit, onset of limit cycling, spread of the deck."""

from __future__ import annotations

import math
from collections import Counter
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace

import casadi as ca
import numpy as np

from ....foundation.arrays import Array
from ....foundation.errors import ArrangementError, ValueRangeError, unknown_name
from ....model.roles import measured_motion, series_spring
from ....model.transform import named
from ....simulation.buffered import Translate, as_it_is
from ....simulation.prior import declared_prior
from ....simulation.sampled_batch import PLANT
from ...analysis.rest import rate_state, rest_states
from ..closed_loop import CONTROLLER, ClosedLoop
from ..laws.known_drive import check_torque
from .linear_loop import linear_loop
from .loop_verdict import DIVERGED, LIMIT_CYCLE, LoopJudge, LoopVerdict
from .responses import PeriodicDrive, PeriodicRun, held_drive, run_periodic, sine_drive

_STEPS = 160
_ANGLES = 40
_NEWTON = 3


@dataclass(frozen=True, eq=False)
class SaturationLine:
    """Largest torque of a sine of the angle over frequency.

    Parameters
    ----------
    frequency
        In Hz, shape (n,).
    torque
        Largest torque of the cycle in N·m, shape (n,); not a number where even the smallest motion that was
        looked at takes more than the limit.
    angle
        Amplitude of the spring's angle in rad, shape (n,).
    limited_by
        ``"current"``, ``"speed"`` or ``"angle"`` (the end of the range that was looked at), for each
        frequency.
    """

    frequency: Array
    torque: Array
    angle: Array
    limited_by: tuple[str, ...]


def saturation_line(
    loop: ClosedLoop,
    frequencies: Sequence[float] | Array,
    *,
    largest_angle: float = math.radians(50.0),
    speed_limit: float = math.inf,
) -> SaturationLine:
    """Return the largest torque at each frequency that the limits of current and speed allow.

    Parameters
    ----------
    loop
        Load fixed, or held by its inputs at zero.
    frequencies
        In Hz, shape (n,).
    largest_angle
        Of the spring, in rad: the end of the cam.
    speed_limit
        Of the driven body, in rad/s.

    Raises
    ------
    ArrangementError
        If more than one body moves freely.
    """
    plant = loop.plant
    if sum(not body.prescribed for body in plant.bodies) != 1:
        raise ArrangementError(
            f"plant '{plant.name}'", "needs one body that moves freely for its inverse dynamics",
            next_step="hold the load, as a Fixed or Driven body",
        )  # fmt: skip
    at = np.asarray(frequencies, dtype=float)
    angles = np.geomspace(0.02, 1.0, _ANGLES) * largest_angle
    f, size = (grid.ravel() for grid in np.meshgrid(at, angles, indexing="ij"))
    torque, current = _inverse(loop, f, size)
    shape = (len(at), len(angles))
    peak, needed = torque.reshape(shape), current.reshape(shape)
    speed = (2.0 * math.pi * f * size).reshape(shape)
    limit = loop.controller.outputs[0].maximum
    use = np.maximum(needed / limit, speed / speed_limit)
    lines = [_first(use[i], peak[i], angles) for i in range(len(at))]
    words = []
    for i, (_, _, end) in enumerate(lines):
        by_current = end < _ANGLES and needed[i, end] / limit >= speed[i, end] / speed_limit
        words.append("angle" if end == _ANGLES else "current" if by_current else "speed")
    return SaturationLine(
        at, np.array([t for t, _, _ in lines]), np.array([a for _, a, _ in lines]), tuple(words)
    )


def _first(use: Array, torque: Array, angles: Array) -> tuple[float, float, int]:
    """Return torque and angle at which the limits are reached first, and the number of the angle beyond."""
    over = np.flatnonzero(use > 1.0)
    if not len(over):
        return float(torque[-1]), float(angles[-1]), _ANGLES
    end = int(over[0])
    if end == 0:
        return math.nan, math.nan, 0
    share = (1.0 - use[end - 1]) / (use[end] - use[end - 1])
    result = [float((1.0 - share) * v[end - 1] + share * v[end]) for v in (torque, angles)]
    return result[0], result[1], end


def _inverse(loop: ClosedLoop, frequency: Array, size: Array) -> tuple[Array, Array]:
    """Return the largest torque and current of the second cycle of each sine of the angle."""
    plant = loop.plant
    motion = measured_motion(plant)
    rate = rate_state(plant, motion)
    names = [v.name for v in plant.states]
    inner = [i for i, name in enumerate(names) if name not in (motion, rate)]
    follow, balance = _functions(loop, (motion, rate), inner)
    state = np.tile(rest_states(plant, np.zeros(1), unmoved=True), (len(size), 1))
    u, p = plant.start(plant.inputs), plant.start(plant.parameters)
    omega = 2.0 * math.pi * frequency
    fixed = [np.tile(column[:, None], (1, len(size))) for column in (u, p)]
    steps, balances = (f.map(len(size)) for f in (follow, balance))
    zero = np.zeros((1, len(size)))
    largest = np.zeros((2, len(size)))
    place, of = names.index(motion), names.index(rate)
    for k in range(2 * _STEPS):
        middle, end = (2.0 * math.pi * (k + share) / _STEPS for share in (0.5, 1.0))
        state[:, place], state[:, of] = size * np.sin(middle), size * omega * np.cos(middle)
        if inner:
            step = 2.0 * math.pi / (omega * _STEPS)
            state[:, inner] = steps(zero, np.column_stack([state, step]).T, *fixed).full().T
        state[:, place], state[:, of] = size * np.sin(end), size * omega * np.cos(end)
        if k >= _STEPS:
            torque, free, slope = (r.full()[0] for r in balances(zero, state.T, *fixed))
            current = (-size * omega**2 * np.sin(end) - free) / slope
            largest = np.maximum(largest, np.abs([torque, current]))
    return largest[0], largest[1]


def _functions(
    loop: ClosedLoop, motion: tuple[str, str], inner: list[int]
) -> tuple[ca.Function, ca.Function]:
    plant = loop.plant
    s = plant.symbols()
    names = [v.name for v in plant.states]
    step = ca.SX.sym("step")
    begin = ca.vertcat(*[s.state[i] for i in inner]) if inner else ca.SX(0, 1)
    rates = ca.vertcat(*[s.derivative[i] for i in inner]) if inner else ca.SX(0, 1)
    z = ca.SX.sym("z", len(inner))
    residual = z - begin - step * ca.substitute(rates, begin, (begin + z) / 2)
    newton = ca.Function("newton", [z, s.state, step, s.input, s.parameter, s.time],
                         [z - ca.solve(ca.jacobian(residual, z), residual)] if inner else [z])  # fmt: skip
    result = begin
    for _ in range(_NEWTON):
        result = newton(result, s.state, step, s.input, s.parameter, s.time)
    follow = ca.Function(
        "follow", [s.time, ca.vertcat(s.state, step), s.input, s.parameter], [ca.densify(result)]
    )
    place = [v.name for v in plant.inputs].index(loop.names.current)
    acceleration = s.derivative[names.index(motion[1])]
    free = ca.substitute(acceleration, s.input[place], 0.0)
    slope = (ca.substitute(acceleration, s.input[place], 1e-3) - free) / 1e-3
    torque = named(plant, s)[series_spring(plant).effort]
    arguments = [s.time, s.state, s.input, s.parameter]
    balance = ca.Function("balance", arguments, [ca.densify(e) for e in (torque, free, slope)])
    return follow, balance


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
    """Return the range of a gain after a look at its name and ends."""
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
) -> tuple[float, float]:
    """Return the gain at which the linearised loop becomes unstable at some angle, and the frequency in Hz.

    Infinite and not a number where it is stable up to the end of the range; zero where it is unstable already
    at its beginning.
    """
    angles = np.linspace(-largest, largest, 21)

    def lost(value: float) -> tuple[bool, float]:
        changed = replace(loop, controller=loop.controller.with_values({gain: value}))
        linear = linear_loop(changed, angles)
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


@dataclass(frozen=True, eq=False)
class LoopSpread:
    """What a loop does over draws of the numbers of its plant; observer and controller stay as designed.

    Parameters
    ----------
    amplitude, frequency
        Of the desired torque in N·m and Hz; zero Hz is a held torque.
    drawn
        The numbers in SI by name, each of shape (n,).
    verdicts
        On each run.
    error
        Root mean square of the torque error over that of the desired torque, shape (n,); not a number where
        a verdict does not hold.
    """

    amplitude: float
    frequency: float
    drawn: Mapping[str, Array]
    verdicts: tuple[LoopVerdict, ...]
    error: Array

    @property
    def held(self) -> float:
        """Share of the draws in which the loop settles, 1."""
        return float(np.mean([verdict.holds for verdict in self.verdicts]))

    def quantile(self, share: float) -> float:
        """Return a quantile of the error over all draws; a draw that does not settle counts as infinite.

        Parameters
        ----------
        share
            Between 0 and 1.
        """
        ranked = np.sort(np.where(np.isfinite(self.error), self.error, np.inf))
        return float(ranked[min(int(share * len(ranked)), len(ranked) - 1)])

    def __str__(self) -> str:
        states = Counter(verdict.state for verdict in self.verdicts)
        counts = ", ".join(f"{number} {state}" for state, number in states.most_common())
        return (
            f"{len(self.verdicts)} draws at {self.amplitude:g} N·m, {self.frequency:g} Hz: "
            f"{counts}; error over desired torque {self.quantile(0.5):.3g} in the median, "
            f"{self.quantile(0.9):.3g} at 90 %"
        )


def loop_over_spread(
    loop: ClosedLoop,
    *,
    amplitude: float,
    frequency: float,
    draws: int = 100,
    seed: int = 1,
    kick: float = 0.0,
    translate: Translate = as_it_is,
) -> LoopSpread:
    """Run a loop on draws of the numbers of its plant, which its observer and controller do not know.

    Parameters
    ----------
    loop
        Closed loop; its plant has numbers with a spread.
    amplitude
        Of the desired torque in N·m.
    frequency
        Of its sine in Hz; zero holds it.
    draws
        Number of draws.
    seed
        The same seed gives the same numbers.
    kick
        Torque in N·m that is wanted besides for 10 ms when a held torque is reached.
    translate
        For instance :func:`~nlsdesign.export.natively`: then compiled code runs.

    Raises
    ------
    ValueRangeError
        If no number of the plant has a spread, or the amplitude is beyond the current limit.
    """
    check_torque(loop.plant, amplitude)
    drawn = declared_prior(loop.plant).draws(draws, seed)
    if not drawn:
        raise ValueRangeError(
            f"plant '{loop.plant.name}'", "has no number with a spread", next_step="state spreads in the deck"
        )
    parameters = {f"{PLANT}.{name}": values for name, values in drawn.items()}
    if frequency > 0.0:
        drive = sine_drive(
            loop, amplitude=amplitude, frequencies=np.full(draws, frequency), parameters=parameters
        )
    else:
        drive = held_drive(loop, torques=np.full(draws, amplitude), parameters=parameters, kick=kick)
    runs = run_periodic(loop, drive, translate=translate)
    errors = []
    for run in runs:
        wanted = drive.drives(run.time, np.zeros(1, dtype=np.intp))[loop.desired]
        desired = np.asarray(wanted, dtype=float)[0]
        error = run[loop.torque] - desired
        size = float(np.sqrt(np.mean(desired**2)))
        errors.append(float(np.sqrt(np.mean(error**2))) / size if run.verdict.holds else math.nan)
    return LoopSpread(amplitude, frequency, drawn, tuple(run.verdict for run in runs), np.array(errors))
