"""The adaptive observer, a yardstick: a joint Kalman filter of states and of what the deck does not know.

It carries the states of the plant and, as slow states s, how far the machine lies from its deck along a few
directions in the space of the uncertain numbers. Given the measured angle everything is linear in the other
states, so it is a Kalman filter of a system that varies with the angle; its covariance is part of its memory.
How far rubber and current are trusted follows from the spreads of the deck, and from what the motion has
shown so far. Beyond the textbook:

- The inner states of the rubber get no correction. They are driven by the measured angle alone, as in the
  cascade, so the estimate stays bounded whatever current and friction do.
- Near standstill dry friction can carry anything up to its limit, so there the slow states get no correction.
  The same holds near a limit of the drive that is not known exactly.
- What surprises by more than a few deviations corrects the slow states no further than that.
- Slow states are held within a stated number of deviations.

A sample is split: what the inner states do to angle and speed is known at both of its ends, so it runs
linearly between a(θ_k)·z_k and a(θ_{k+1})·z_{k+1}. Held at the beginning instead, it would be late by half a
sample, and a filter that learns would take that for damping. Torques are linear in the slow states, but what
they do to the speed is divided by the inertia, which may be uncertain too. So all that accelerates is kept
per inertia, and the inertia is an exact factor, exp(−Σ cᵢ·sᵢ).

| symbol | name here | what it is |
| --- | --- | --- |
| x̂⁻, P⁻ | ``expected``, ``prior`` | states expected at a sample, and the covariance of their error |
| ν | ``innovation`` | measured minus expected angle |
| λ | ``inflation`` | covariance inflation, the factor on all noise |
| ε = ν²/(P⁻ + λ) | ``nis`` | normalised innovation squared, in counts |
| min(1, ε₀/√ε) | ``gate`` | innovation gate of the slow states |
| ω₀, ω²/(ω² + ω₀²) | ``dead_band``, ``moving`` | speed dead band of the slow states, and what passes it |
| J₀/J(s) | ``inertia_ratio`` | declared inertia over that at the slow states |
| w in √(ω² + w²) | ``smoothing_width`` | width over which dry friction is smoothed around zero speed |
| θ_f | ``low_pass`` | measured angle behind a low-pass |
| Δθ, P⁺/P⁻ | ``mean_shift``, ``variance_ratio`` | what one reading does to mean and variance of the angle |
| K, I − KC | ``gain``, ``complement`` | gain, and what it leaves of the covariance (Joseph form) |
| φ | ``forgetting`` | share of the variance of the slow states that one sample makes open again |
"""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import dataclass, replace
from functools import cached_property
from typing import NamedTuple

import casadi as ca
import numpy as np
from scipy.linalg import solve_discrete_are

from benchmarks._adaptive_directions import UncertainDirections, uncertain_directions
from nlsdesign.feedback.observer import Duty
from nlsdesign.feedback.observer.corrected.corrected_cascade import encoder_quantum, safe_inputs
from nlsdesign.feedback.observer.corrected.correction_equations import pairs, unpacked
from nlsdesign.feedback.observer.corrected.duty import operating_points, spring_inertia
from nlsdesign.feedback.observer.scheduling.angle_form import (
    AngleForm,
    AngleScheduledPlant,
    finished,
    minimal_form,
)
from nlsdesign.feedback.observer.scheduling.scheduled import whole_contour
from nlsdesign.feedback.observer.scheduling.step import held, linear, speed_change
from nlsdesign.foundation.arrays import Array
from nlsdesign.foundation.symbolic import Expression
from nlsdesign.model import FlatModel
from nlsdesign.model.roles import measured_motion, spring_torque
from nlsdesign.simulation.prior import Prior, declared_prior

TIME = 1e-3
"""Sample time in s."""
GRID = 513
"""Angles over the contour at which the matrices of the step are computed; between them they are linear."""
SMALLEST = 1e-12
"""Entries of the step that are nowhere larger are rounding."""
KINDS = ("estimate", "next", "prior", "coupling", "shift")
LOW_PASS_TIME = 0.01
"""Seconds by which an angle lags the measured one; their distance says whether the actuator moves at all."""
INFLATION_TIME, LARGEST_INFLATION = 1.0, 1e4
"""Seconds over which innovations that are larger than expected raise the noise, and the largest factor."""
FIRST_READING = 2.0
"""Deviation of the angle at the start, in deviations of rounding: the filter begins at its first reading."""
_WIDE = 5.0
"""Deviation of a prediction, in deviations of rounding, beyond which rounding is as good as normal noise."""


@dataclass(frozen=True)
class Trust:
    """How far the filter trusts its equations."""

    unmodelled: float = 0.02  # torque that they miss, one deviation, as a share of that of the duty
    correlation_time: float = 0.02  # seconds over which it stays the same
    drift_time: float = 60.0  # seconds of motion after which nothing that was learned is left
    counts: float = 4.0  # deviation of the measured angle in those of an ideal encoder, quantum/√12
    limit: float = 2.5  # largest distance of a slow state from the deck, in deviations
    surprise: float = 3.0  # innovation in deviations from which on it corrects the slow states no further
    smallest: float = 0.0004  # torque of the smallest slow state, as a share of that of the duty
    most: int = 12  # slow states at most


class Side(NamedTuple):
    """A plant with other numbers, and its inertia over the declared one."""

    plant: AngleScheduledPlant
    relative_inertia: float


class Estimates(NamedTuple):
    """What the filter makes of a run; each by sample."""

    torque: Array
    deviation: Array  # that it expects of the torque
    slow: Array  # shape (directions, T)
    inflation: Array
    covariance: Array  # upper triangles, shape (pairs, T)


class AdaptiveFilter:
    """The filter of one machine, as one function of a sample."""

    def __init__(
        self, model: FlatModel, *, prior: Prior | None = None, duty: Duty | None = None,
        trust: Trust | None = None,
    ) -> None:  # fmt: skip
        self.trust, duty, prior = trust or Trust(), duty or Duty(), prior or declared_prior(model)
        measured, over = measured_motion(model, None), whole_contour(model)
        form, sizes = minimal_form(
            model, estimate=spring_torque(model, None), angle=measured,
            angles=np.linspace(over.lower, over.upper, 65),
        )  # fmt: skip
        self.plant, points = finished(form, sizes, ()), operating_points(form, duty)
        self.directions = uncertain_directions(
            form, prior, duty, resolution=self.trust.smallest * points.torque, most=self.trust.most
        )
        self.n, self.slow = len(self.plant.states), len(self.directions.effect)
        self.inner = self.n - 2
        self.angle, self.speed = self.plant.moving
        self.sides = _sides(form, self.plant, self.directions)
        self.missed = math.hypot(self.trust.unmodelled * points.torque, self.directions.left_out)
        self.acceleration = _white(self.missed / points.inertia, self.trust)
        self.safe_inputs = safe_inputs(model, prior)
        # Units in which all covariances are near one: counts, counts per sample, sizes of inner states.
        self.rounding = self.trust.counts * encoder_quantum(model, measured) / math.sqrt(12.0)
        self.units = self.plant.sizes.copy()
        self.units[self.angle], self.units[self.speed] = self.rounding, self.rounding / TIME
        self.smoothing_width = _speed_deviation(self.rounding, self.acceleration)
        self.dead_band = _dead_band(
            self.plant.friction, float(self.plant.sizes[self.speed]), self.smoothing_width
        )
        self.grid = np.linspace(over.lower, over.upper, GRID)
        self.columns, self.entries = self._table()

    # --- the step as functions of the angle -------------------------------------------------------------

    def _table(self) -> tuple[Array, dict[str, list[Expression]]]:
        """Return columns over the grid, shape (columns, GRID), and matrices of them: nominal, then slopes."""
        kinds = {kind: [step] for kind, step in matrices(Side(self.plant, 1.0), self.grid).items()}
        for up, down in self.sides:
            high, low = matrices(up, self.grid), matrices(down, self.grid)
            for kind in KINDS:
                kinds[kind].append((high[kind] - low[kind]) / 2.0)
        columns: list[tuple[Expression, Array]] = []
        entries: dict[str, list[Expression]] = {}
        for kind, parts in kinds.items():
            entries[kind] = [ca.SX(*part.shape[1:]) for part in parts]
            for entry, part in zip(entries[kind], parts, strict=True):
                for i, j in np.ndindex(*part.shape[1:]):
                    values = part[:, i, j]
                    if np.max(np.abs(values)) > SMALLEST:
                        entry[i, j] = ca.SX.sym(f"w{len(columns)}")
                        columns.append((entry[i, j], values))
        self.w = ca.vertcat(*[symbol for symbol, _ in columns])
        return np.array([values for _, values in columns]), entries

    def matrix(self, kind: str, slow: Expression) -> Expression:
        """Return a matrix of the step at the slow states."""
        nominal, *slopes = self.entries[kind]
        total = nominal + sum((slow[d] * slope for d, slope in enumerate(slopes)), start=ca.SX(0))
        if kind in ("prior", "coupling"):
            total[self.inner :, :] *= self.inertia_ratio(slow)
        if kind == "next":  # what inner states and torques at rest do to angle and speed
            total[self.inner :, : self.inner] *= self.inertia_ratio(slow)
            total[self.inner :, self.n] *= self.inertia_ratio(slow)
        return ca.SX(total)

    def inertia_ratio(self, slow: Expression) -> Expression:
        """Return the declared inertia over that at the slow states."""
        total = ca.SX(0)
        for d, (up, down) in enumerate(self.sides):
            slope = (math.log(down.relative_inertia) - math.log(up.relative_inertia)) / 2.0
            total += slope * slow[d] if abs(slope) > 1e-6 else 0
        return ca.SX(ca.exp(total))

    def _per_inertia(self, rate: Callable[[AngleScheduledPlant], Expression], slow: Expression) -> Expression:
        """Return a rate that is one over the inertia, at the slow states."""
        total = rate(self.plant)
        for d, (up, down) in enumerate(self.sides):
            high, low = (side.relative_inertia * rate(side.plant) for side in (up, down))
            total += slow[d] * (high - low) / 2.0
        return ca.SX(self.inertia_ratio(slow) * total)

    # --- the two halves of a sample ---------------------------------------------------------------------

    def expected_states(self, memory: Expression, slow: Expression) -> Expression:
        """Return the states expected at a sample: what the angle adds at its end, then friction."""
        state = memory + self.matrix("prior", slow)
        if self.inner:
            state += ca.mtimes(self.matrix("coupling", slow), state[: self.inner])
        speed = ca.SX.sym("speed")
        length = ca.sqrt(speed**2 + self.smoothing_width**2)

        def smoothed(plant: AngleScheduledPlant) -> Expression:
            if plant.friction is None:
                return ca.SX(0)
            ahead, back = ca.SX(plant.friction(length)), ca.SX(plant.friction(-length))
            return (ahead + back) / 2.0 + (ahead - back) / 2.0 * speed / length

        if self.plant.friction is not None:
            change = speed_change(self._per_inertia(smoothed, slow), speed, TIME)
            change = ca.substitute(change, speed, state[self.speed])
            state[self.angle] += TIME / 2.0 * change
            state[self.speed] += change
        return state

    def _end(self, state: Expression, slow: Expression, u: Expression) -> Expression:
        """Return what goes on to the next sample."""
        pushed = self._per_inertia(lambda plant: ca.SX(plant.driven(u)), slow)
        return ca.SX(ca.mtimes(self.matrix("next", slow), ca.vertcat(state, 1, pushed)))

    def slopes(self, expression: Expression, of: Expression, slow: Expression) -> Expression:
        """Return slopes by states and slow states, both in the units of the filter.

        They are taken at the deck, not at the estimate: what no motion can tell apart (a drive, a rubber and
        an inertia that are all ten per cent larger) must be the same direction at every sample, or the filter
        would believe to have seen it. Source: Huang et al. 2010 (first-estimates Jacobian).
        """
        jacobian = ca.substitute(
            ca.jacobian(expression, ca.vertcat(of, slow)), slow, ca.SX.zeros(self.slow, 1)
        )
        return ca.SX(ca.mtimes(jacobian, ca.diag(np.concatenate([self.units, np.ones(self.slow)]))))

    def _carried(self, expression: Expression, of: Expression, slow: Expression) -> Expression:
        """Return the slopes of one half of a sample; slow states, which stay, below the others."""
        upper = ca.mtimes(ca.diag(1.0 / self.units), self.slopes(expression, of, slow))
        return ca.SX(ca.vertcat(upper, ca.horzcat(ca.SX(self.slow, self.n), ca.SX.eye(self.slow))))

    def _at(self, value: Expression, x: Expression, s: Expression, at: Expression) -> Expression:
        return ca.SX(ca.substitute(value, ca.vertcat(x, s), at))

    # --- one sample -------------------------------------------------------------------------------------

    @cached_property
    def sample(self) -> ca.Function:
        """Return (memory, (angle, inputs, columns)) -> (memory after, what `Estimates` holds)."""
        n, size = self.n, self.n + self.slow
        memory, slow = ca.SX.sym("memory", n), ca.SX.sym("slow", self.slow)
        inflation, low_pass = ca.SX.sym("inflation"), ca.SX.sym("low_pass")
        packed = ca.SX.sym("covariance", len(pairs(size)))
        angle, u = ca.SX.sym("angle"), ca.SX.sym("u", len(self.plant.inputs))

        expected = self.expected_states(memory, slow)
        onward = self._carried(expected, memory, slow)
        prior = ca.mtimes([onward, unpacked(packed, size), onward.T])
        innovation = angle - expected[self.angle]
        seen_speed = ca.fabs(angle - low_pass) / LOW_PASS_TIME
        direction, moving = self._direction(prior, ca.fmin(ca.fabs(expected[self.speed]), seen_speed))
        nis = (innovation / self.rounding) ** 2 / (prior[self.angle, self.angle] + inflation)
        gate = ca.fmin(1.0, self.trust.surprise / ca.sqrt(nis + 1e-12))
        direction[n:] *= gate * self._safe(u)
        step, posterior = self._corrected(prior, direction, innovation, inflation)
        corrected = ca.vertcat(
            expected + step[:n] * self.units,
            ca.fmin(ca.fmax(slow + step[n:], -self.trust.limit), self.trust.limit),
        )

        forgetting = moving * (1.0 - math.exp(-2.0 * TIME / self.trust.drift_time))
        fading = ca.vertcat(ca.SX.ones(n, 1), ca.sqrt(1.0 - forgetting) * ca.SX.ones(self.slow, 1))
        x, s = ca.SX.sym("x", n), ca.SX.sym("s", self.slow)
        end, torque = self._end(x, s, u), ca.mtimes(self.matrix("estimate", s), ca.vertcat(x, 1))
        onward = ca.mtimes(ca.diag(fading), self._at(self._carried(end, x, s), x, s, corrected))
        following = ca.mtimes([onward, posterior, onward.T]) + self._process_noise(forgetting, inflation, u)
        excess = ca.fmin(nis, self.trust.surprise**2) - 1.0
        inflated = inflation * (1.0 + TIME / INFLATION_TIME * excess)
        after = ca.vertcat(
            self._at(end, x, s, corrected), corrected[n:] * fading[n:],
            ca.fmin(ca.fmax(inflated, 1.0), LARGEST_INFLATION),
            angle + math.exp(-TIME / LOW_PASS_TIME) * (low_pass - angle), symmetric(following),
        )  # fmt: skip
        by = self._at(self.slopes(torque, x, s), x, s, corrected)
        variance = ca.mtimes([by, posterior, by.T]) + self.missed**2
        shown = ca.vertcat(
            self._at(torque, x, s, corrected), ca.sqrt(variance), corrected[n:], inflation, packed
        )
        after, shown = ca.cse([ca.densify(after), ca.densify(shown)])
        carried = ca.vertcat(memory, slow, inflation, low_pass, packed)
        return ca.Function("sample", [carried, ca.vertcat(angle, u, self.w)], [after, shown])

    def _direction(self, covariance: Expression, speed: Expression) -> tuple[Expression, Expression]:
        """Return what a change of the angle says of all states, and how far the actuator moves, 0 to 1."""
        moving = speed**2 / (speed**2 + self.dead_band**2) if self.dead_band else ca.SX(1)
        column = covariance[:, self.angle] / covariance[self.angle, self.angle]
        for i in range(self.n):
            if i not in (self.angle, self.speed):
                column[i] = 0
        column[self.n :] *= moving
        return column, moving

    def _safe(self, u: Expression) -> Expression:
        """Return 1 where the drive surely gives what its inputs ask for, else 0."""
        safe = ca.SX(1)
        for i, v in enumerate(self.plant.inputs):
            if v.name in self.safe_inputs:
                safe *= ca.fabs(u[i]) < self.safe_inputs[v.name]
        return safe

    def _corrected(
        self, prior: Expression, direction: Expression, innovation: Expression, inflation: Expression
    ) -> tuple[Expression, Expression]:
        """Return the change of all states by one reading, and the covariance after it, in Joseph's form."""
        variance = prior[self.angle, self.angle]
        deviations = innovation / self.rounding / ca.sqrt(inflation)
        mean_shift, variance_ratio = truncated_update(deviations, variance / inflation)
        gain = direction * (1.0 - variance_ratio)
        complement = ca.SX.eye(prior.shape[0])
        complement[:, self.angle] -= gain
        spread = direction * ca.sqrt(variance_ratio * (1.0 - variance_ratio) * variance)
        posterior = ca.mtimes([complement, prior, complement.T]) + ca.mtimes(spread, spread.T)
        return direction * (mean_shift * ca.sqrt(inflation)), posterior

    def _process_noise(self, forgetting: Expression, inflation: Expression, u: Expression) -> Expression:
        """Return what one sample adds to the covariance.

        Of an input beyond what the drive surely gives, all that is beyond may be missing.
        """
        push = np.zeros(self.n)
        push[self.angle], push[self.speed] = TIME**2 / 2.0, TIME
        push /= self.units
        noise = ca.SX.zeros(self.n + self.slow, self.n + self.slow)
        missing = ca.SX(0)
        for i, v in enumerate(self.plant.inputs):
            if v.name in self.safe_inputs:
                beyond = ca.fmax(ca.fabs(u[i]) - self.safe_inputs[v.name], 0.0)
                missing += abs(self._slope_of_drive(i)) * beyond
        push_noise = inflation * self.acceleration**2 + missing**2
        noise[: self.n, : self.n] = push_noise * ca.DM(np.outer(push, push))
        for i in range(self.n):  # Rounding of a small number beside large ones.
            noise[i, i] += 1e-6 if i in (self.angle, self.speed) else 1e-12
        for d in range(self.slow):
            noise[self.n + d, self.n + d] += forgetting
        return noise

    def _slope_of_drive(self, index: int) -> float:
        """Return the acceleration per unit of an input, at its start value; zero where it gives none."""
        rows = list(self.plant.rows)
        if self.speed not in rows:
            return 0.0
        u = ca.SX.sym("u", len(self.plant.inputs))
        slopes = ca.Function("slopes", [u], [ca.densify(ca.jacobian(ca.SX(self.plant.driven(u)), u))])
        return float(slopes([v.start for v in self.plant.inputs])[rows.index(self.speed), index])

    # --- a run ------------------------------------------------------------------------------------------

    def start(self, angle: float) -> Array:
        """Return the memory of a filter that begins while the actuator rests at an angle.

        The angle is that of the first reading, the rest is little known.
        """
        step = matrices(Side(self.plant, 1.0), np.array([angle]))
        state = self.plant.rest(np.array([angle]))[0] - step["shift"][0, :, 0]
        memory = state - step["prior"][0, :, 0] - step["coupling"][0] @ state[: self.inner]
        sizes = self.plant.sizes / self.units
        first = (0.1 * sizes) ** 2
        first[self.angle], first[self.speed] = FIRST_READING**2, (0.03 * sizes[self.speed]) ** 2
        variances = np.diag(np.concatenate([first, np.ones(self.slow)]))
        packed = [variances[i, j] for i, j in pairs(self.n + self.slow)]
        return np.concatenate([memory, np.zeros(self.slow), [1.0, angle], packed])

    def run(self, angle: Array, inputs: Array) -> Estimates:
        """Return the estimates along readings of the angle and inputs, shapes (T,) and (inputs, T)."""
        columns = [np.interp(angle, self.grid, column) for column in self.columns]
        course = self.sample.mapaccum("run", len(angle), {"base": 10})
        _, shown = course(self.start(float(angle[0])), np.vstack([angle, inputs, *columns]))
        torque, deviation, *others = np.array(shown)
        slow, rest = np.array(others[: self.slow]), others[self.slow :]
        return Estimates(torque, deviation, slow, rest[0], np.array(rest[1:]))


def matrices(side: Side, angles: Array) -> dict[str, Array]:
    """Return the matrices of the step, inner states first; see the top of this module."""
    plant = side.plant
    c, n, inner = plant.at(angles), len(plant.states), len(plant.states) - 2
    # What accelerates, times the inertia over the declared one.
    pulled = side.relative_inertia * c.a[:, inner:, :inner]
    given = side.relative_inertia * c.drive[:, inner:, None]
    within, begin_inner, end_inner = linear(c.a[:, :inner, :inner], TIME)
    moving, begin, end = linear(c.a[:, inner:, inner:], TIME)
    count, pushes = len(angles), len(plant.rows)
    pushed = np.zeros((count, n, pushes))
    pushed[:, list(plant.rows), range(pushes)] = 1.0
    following, prior = np.zeros((count, n, n + 1 + pushes)), np.zeros((count, n, 1))
    coupling = np.zeros((count, n, inner))
    for part in (slice(None, inner), slice(inner, None)):
        following[:, part, n + 1 :] = held(c.a[:, part, part], pushed[:, part], TIME)[1]
    following[:, :inner, :inner] = within
    following[:, :inner, n : n + 1] = begin_inner @ c.drive[:, :inner, None]
    following[:, inner:, inner:n] = moving
    following[:, inner:, :inner] = begin @ pulled
    following[:, inner:, n : n + 1] = begin @ given
    prior[:, :inner] = end_inner @ c.drive[:, :inner, None]
    prior[:, inner:] = end @ given
    coupling[:, inner:] = end @ pulled
    named = (c.estimate[:, None, :], following, prior, coupling, c.shift[:, :, None])
    return dict(zip(KINDS, named, strict=True))


def _sides(
    form: AngleForm, plant: AngleScheduledPlant, directions: UncertainDirections
) -> list[tuple[Side, Side]]:
    """Return the plants a deviation up and down each direction."""
    sides, inertia = [], spring_inertia(form)
    for unit in np.eye(len(directions.effect)):
        pair = []
        for sign in (1.0, -1.0):
            other = form.with_values(directions.values(form.model.values, sign * unit))
            moved = replace(
                plant, at=other.at, rest=other.rest, driven=other.driven()[0], friction=other.friction()
            )
            pair.append(Side(moved, spring_inertia(other) / inertia))
        sides.append((pair[0], pair[1]))
    return sides


def _white(deviation: float, trust: Trust) -> float:
    """Return what stays the same over the correlation time, to a filter that takes it as white."""
    return deviation * math.sqrt(max(2.0 * trust.correlation_time / TIME, 1.0))


def truncated_update(innovation: Expression, variance: Expression) -> tuple[Expression, Expression]:
    """Return what one reading says of the angle: the shift of its mean, and the share of variance left.

    A reading does not say "this angle, with an error": it says that the angle lies within one count. So a
    prediction inside the count is neither corrected nor believed more, and what is learned at the edges is
    not taken for white noise, which a drive that follows the counts would turn into a wrong inertia. Mean and
    variance are those of the normal distribution of the prediction, truncated at the edges. Where the
    prediction is much wider than a count, that is the Kalman filter with the variance of rounding; three
    deviations outside, the correction goes on as there. The innovation is in units of the deviation of
    rounding, a count over √12, the variance of the prediction in the square of that unit.
    """
    half = math.sqrt(3.0)
    narrow = ca.sqrt(ca.fmin(variance, _WIDE**2))
    size = ca.fabs(innovation)
    near = ca.fmin(size, half + 3.0 * narrow)
    low, high = (near - half) / narrow, (near + half) / narrow
    mass = (ca.erf(high / math.sqrt(2.0)) - ca.erf(low / math.sqrt(2.0))) / 2.0
    at_low, at_high = (ca.exp(-(ca.fmin(edge**2, 100.0)) / 2.0) for edge in (low, high))
    root = math.sqrt(2.0 * math.pi)
    mean = (at_low - at_high) / (root * mass)
    truncated = 1.0 + (low * at_low - high * at_high) / (root * mass) - mean**2
    kalman_gain = variance / (variance + 1.0)
    wide = variance > _WIDE**2
    mean_shift = ca.if_else(wide, kalman_gain * size, narrow * mean + kalman_gain * (size - near))
    variance_ratio = ca.if_else(wide, 1.0 - kalman_gain, ca.fmin(ca.fmax(truncated, 0.0), 1.0))
    return ca.SX(ca.sign(innovation) * mean_shift), ca.SX(variance_ratio)


def _dead_band(friction: ca.Function | None, size: float, smoothing_width: float) -> float:
    """Return a speed below which dry friction is not at its level, as the filter sees it; 0 for none.

    That is twice the speed at which 90 % of it are reached.
    """
    if friction is None:
        return 0.0
    speeds = size * np.logspace(-7.0, 0.0, 400)
    level = np.abs(friction.map(len(speeds))(speeds[None, :]).full().ravel())
    reached = np.flatnonzero(level >= 0.9 * np.max(level))
    return 2.0 * max(float(speeds[reached[0]]), 2.0 * smoothing_width)


def _speed_deviation(angle: float, acceleration: float) -> float:
    """Return how well the speed of a free body is known from readings of its angle, before each reading.

    The dry friction of a speed that is known no better is a mean over its deviation: taken at the estimate,
    noise of the reading would be rectified, and learned as a torque of the spring.
    """
    carried = np.array([[1.0, TIME], [0.0, 1.0]])
    push = acceleration * np.array([[TIME**2 / 2.0], [TIME]])
    seen, tiny = np.array([[1.0, 0.0]]), 1e-12 * np.diag([angle, angle / TIME]) ** 2
    covariance = solve_discrete_are(carried.T, seen.T, push @ push.T + tiny, np.array([[angle**2]]))
    return math.sqrt(float(covariance[1, 1]))


def symmetric(matrix: Expression) -> Expression:
    """Return the upper triangle, row by row; symmetric by taking both halves."""
    return ca.SX(ca.vertcat(*[(matrix[i, j] + matrix[j, i]) / 2.0 for i, j in pairs(matrix.shape[0])]))
