"""The filter of an adaptive observer: two halves of a sample, their slopes, and the correction between.

It is an extended Kalman filter with these additions. The names of the state variables are those of the
interface, which C code and FMUs have in common.

| symbol | name here | what it is |
| --- | --- | --- |
| x̂⁻, P⁻ | ``expected``, ``prior`` | states expected at a sample, and the covariance of their error |
| ν | ``innovation`` | measured minus expected angle |
| λ | ``inflation`` | covariance inflation, the factor on all noise; state ``unrest`` |
| ε = ν²/(P⁻ + λ) | ``nis`` | normalised innovation squared, in counts |
| min(1, ε₀/√ε) | ``gate`` | innovation gate of the slow states |
| ω₀, ω²/(ω² + ω₀²) | ``dead_band``, ``moving`` | speed dead band of the slow states, and what passes it |
| J₀/J(s) | ``inertia_ratio`` | declared inertia over that at the slow states |
| w in √(ω² + w²) | ``smoothing_width`` | width over which dry friction is smoothed around zero speed |
| θ_f | ``low_pass`` | measured angle behind a low-pass; state ``followed`` |
| Δθ, P⁺/P⁻ | ``mean_shift``, ``variance_ratio`` | what one reading does to mean and variance of the angle |
| K, I − KC | ``gain``, ``complement`` | gain, and what it leaves of the covariance (Joseph form) |
| φ | ``forgetting`` | share of the variance of the slow states that one sample makes open again |

When the observer starts, and after a gap, it takes the states of a machine that rests at its reading.
"""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import dataclass

import casadi as ca
import numpy as np
from scipy.linalg import solve_discrete_are

from ....foundation.symbolic import Expression
from ....model.flat import stated_equations
from ..scheduling.measured_angle import at_rest
from ..scheduling.step import speed_change
from ..scheduling.table import Compact
from .adaptive_step import AdaptiveStep
from .duty_and_directions import Trust

LOW_PASS_TIME = 0.01
"""Seconds by which an angle lags the measured one; their distance says whether the actuator moves at all."""
INFLATION_TIME = 1.0
"""Seconds over which innovations that are larger than expected raise the noise that is reckoned with."""
LARGEST_INFLATION = 1e4
"""Largest factor on the variances of that noise."""
_WIDE = 5.0
"""Deviation of a prediction, in deviations of rounding, beyond which rounding is as good as normal noise."""


@dataclass(frozen=True)
class FilterNoise:
    """What the filter does not know."""

    angle: float  # standard deviation of the measured angle in rad
    acceleration: float  # of what the equations miss, in rad/s²
    estimate: float  # of the estimate beyond what its states explain, in its unit
    safe_inputs: Mapping[str, float]  # size of each limited input up to which the drive surely gives it


class FilterEquations:
    """Writes the filter with the entries read from the table.

    ``step``: one step and its slopes along the slow states. ``trust``: how far the equations are trusted.
    ``noise``: what the filter does not know.
    """

    def __init__(self, step: AdaptiveStep, compact: Compact, trust: Trust, noise: FilterNoise) -> None:
        self.step, self.compact, self.trust, self.noise = step, compact, trust, noise
        self.plant = step.nominal.plant
        self.n, self.slow = len(self.plant.states), len(step.raised)
        self.angle, self.speed = self.plant.moving
        self.w = ca.SX.sym("w", len(compact.columns))
        time = step.nominal.sample_time
        # Units in which all covariances are near one: counts, counts per sample, sizes of inner states.
        self.units = self.plant.sizes.copy()
        self.units[self.angle], self.units[self.speed] = noise.angle, noise.angle / time
        self.smoothing_width = _speed_deviation(noise.angle, _white(noise.acceleration, trust, time), time)
        self.dead_band = _dead_band(
            self.plant.friction, float(self.plant.sizes[self.speed]), self.smoothing_width
        )

    # --- reading the table ------------------------------------------------------------------------------

    def _read(self, kind: str, i: int, j: int = 0) -> Expression:
        entry = self.compact.places[f"{kind}[{i}][{j}]"]
        return ca.SX(entry.factor) if entry.column is None else entry.factor * self.w[entry.column]

    def matrix(self, kind: str, rows: int, columns: int, slow: Expression) -> Expression:
        """Return a matrix of the step at the slow states."""
        total = ca.SX(rows, columns)
        for i in range(rows):
            for j in range(columns):
                parts = [self._read(kind, i, j)]
                parts += [slow[d] * self._read(f"{kind}.{d}", i, j) for d in range(self.slow)]
                total[i, j] = sum(parts, start=ca.SX(0))
                if self._accelerates(kind, i, j):
                    total[i, j] *= self._inertia_ratio(slow)
        return total

    def _accelerates(self, kind: str, i: int, j: int) -> bool:
        """Return whether an entry is what a torque does to angle or speed."""
        moves = i >= self.step.inner
        return moves and (
            kind in ("prior", "coupling") or (kind == "next" and (j < self.step.inner or j == self.n))
        )

    def _inertia_ratio(self, slow: Expression) -> Expression:
        """Return the declared inertia over that at the slow states."""
        slopes = [c if abs(c) > 1e-6 else 0.0 for c in self.step.inertia_slopes]
        return ca.exp(sum((c * slow[d] for d, c in enumerate(slopes) if c), start=ca.SX(0)))

    # --- the two halves of a sample ---------------------------------------------------------------------

    def expected_states(self, memory: Expression, slow: Expression) -> Expression:
        """Return the states expected at a sample: what the angle adds at its end, then friction."""
        state = memory + self.matrix("prior", self.n, 1, slow)
        inner = self.step.inner
        if inner:
            state += ca.mtimes(self.matrix("coupling", self.n, inner, slow), state[:inner])
        speed = ca.SX.sym("speed")
        length = ca.sqrt(speed**2 + self.smoothing_width**2)
        ahead, back = self.step.friction(length), self.step.friction(-length)
        if ahead is None or back is None:
            return state

        def smoothed(forward: Expression, backward: Expression) -> Expression:
            return (forward + backward) / 2.0 + (forward - backward) / 2.0 * speed / length

        nominal = smoothed(ahead[0], back[0])
        slopes = [smoothed(forward, backward) for forward, backward in zip(ahead[1], back[1], strict=True)]
        rate = self._inertia_ratio(slow) * (
            nominal + sum((slow[d] * slope for d, slope in enumerate(slopes)), start=ca.SX(0))
        )
        change = speed_change(rate, speed, self.step.nominal.sample_time)
        change = ca.substitute(change, speed, state[self.speed])
        state[self.angle] += self.step.nominal.sample_time / 2.0 * change
        state[self.speed] += change
        return state

    def _end(self, state: Expression, slow: Expression, u: Expression) -> Expression:
        """Return what goes on to the next sample."""
        count = self.n + 1 + len(self.plant.rows)
        matrix = self.matrix("next", self.n, count, slow)
        nominal, slopes = self.step.driven(u)
        pushed = self._inertia_ratio(slow) * (
            nominal + sum((slow[d] * slope for d, slope in enumerate(slopes)), start=ca.SX(0))
        )
        return ca.SX(ca.mtimes(matrix, ca.vertcat(state, 1, pushed)))

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

    def _direction(self, covariance: Expression, speed: Expression) -> tuple[Expression, Expression]:
        """Return what a change of the angle says of all states, and how far the actuator moves, 0 to 1."""
        moving = speed**2 / (speed**2 + self.dead_band**2) if self.dead_band else ca.SX(1)
        column = covariance[:, self.angle] / covariance[self.angle, self.angle]
        for i in range(self.n):
            if i not in (self.angle, self.speed):
                column[i] = 0
        column[self.n :] *= moving
        return column, moving

    def sample(self) -> ca.Function:
        """Return one sample as the equations of a discrete flat model."""
        n, count, plant = self.n, self.slow, self.plant
        size, time = n + count, self.step.nominal.sample_time
        memory, slow = ca.SX.sym("memory", n), ca.SX.sym("slow", count)
        packed, inflation = ca.SX.sym("covariance", size * (size + 1) // 2), ca.SX.sym("inflation")
        low_pass, angle, u = ca.SX.sym("low_pass"), ca.SX.sym(plant.angle), ca.SX.sym("u", len(plant.inputs))

        expected = self.expected_states(memory, slow)
        slopes = self._carried(expected, memory, slow)
        prior = ca.mtimes([slopes, _unpacked(packed, size), slopes.T])
        innovation = angle - expected[self.angle]
        seen_speed = (angle - low_pass) / LOW_PASS_TIME
        direction, moving = self._direction(
            prior, ca.fmin(ca.fabs(expected[self.speed]), ca.fabs(seen_speed))
        )
        nis = (innovation / self.noise.angle) ** 2 / (prior[self.angle, self.angle] + inflation)
        direction[n:] *= self._gate(nis)
        for i, v in enumerate(plant.inputs):
            if v.name in self.noise.safe_inputs:
                direction[n:] *= ca.fabs(u[i]) < self.noise.safe_inputs[v.name]
        step, posterior = self._corrected(prior, direction, innovation, inflation)
        state = expected + step[:n] * self.units
        slow_after = ca.fmin(ca.fmax(slow + step[n:], -self.trust.limit), self.trust.limit)

        forgetting = moving * (1.0 - math.exp(-2.0 * time / self.trust.drift_time))
        fading = ca.vertcat(ca.SX.ones(n, 1), ca.sqrt(1.0 - forgetting) * ca.SX.ones(count, 1))
        following, onward = self._onward(state, slow_after, u)
        onward = ca.mtimes(ca.diag(fading), onward)
        next_covariance = ca.mtimes([onward, posterior, onward.T]) + self._process_noise(
            forgetting, inflation, u
        )
        excess = ca.fmin(nis, self.trust.surprise**2) - 1.0
        inflated = inflation * (1.0 + time / INFLATION_TIME * excess)
        inflated = ca.fmin(ca.fmax(inflated, 1.0), LARGEST_INFLATION)
        filtered = angle + math.exp(-time / LOW_PASS_TIME) * (low_pass - angle)
        states = [following, slow_after * fading[n:], inflated, filtered, _packed(next_covariance)]

        estimate, slopes_of_estimate = self._estimate(state, slow_after)
        variance = ca.mtimes([slopes_of_estimate, posterior, slopes_of_estimate.T]) + self.noise.estimate**2
        shifted = state + self.matrix("shift", n, 1, slow_after)
        outputs = [estimate, ca.sqrt(variance), shifted, innovation, slow_after]
        carried = ca.vertcat(memory, slow, inflation, low_pass, packed)
        after, shown = ca.cse([ca.densify(ca.vertcat(*states)), ca.densify(ca.vertcat(*outputs))])
        return stated_equations(carried, ca.vertcat(angle, u), derivative=after, output=shown, table=self.w)

    def _gate(self, nis: Expression) -> Expression:
        """Return how much of a correction passes to the slow states, 0 to 1.

        An innovation beyond what noise gives teaches the less the larger it is: a drive at its limit or a
        jump of the encoder is no news of the rubber.
        """
        return ca.fmin(1.0, self.trust.surprise / ca.sqrt(nis + 1e-12))

    def _corrected(
        self, prior: Expression, direction: Expression, innovation: Expression, inflation: Expression
    ) -> tuple[Expression, Expression]:
        """Return the change of all states by one reading, and the covariance after it, in Joseph's form."""
        variance = prior[self.angle, self.angle]
        deviations = innovation / self.noise.angle / ca.sqrt(inflation)
        mean_shift, variance_ratio = truncated_update(deviations, variance / inflation)
        gain = direction * (1.0 - variance_ratio)
        complement = ca.SX.eye(prior.shape[0])
        complement[:, self.angle] -= gain
        spread = direction * ca.sqrt(variance_ratio * (1.0 - variance_ratio) * variance)
        posterior = ca.mtimes([complement, prior, complement.T]) + ca.mtimes(spread, spread.T)
        return direction * (mean_shift * ca.sqrt(inflation)), posterior

    def _onward(self, state: Expression, slow: Expression, u: Expression) -> tuple[Expression, Expression]:
        """Return what goes on to the next sample, and its slopes, at the corrected states."""
        x, s = ca.SX.sym("x", self.n), ca.SX.sym("s", self.slow)
        end = self._end(x, s, u)
        free, corrected = ca.vertcat(x, s), ca.vertcat(state, slow)
        return ca.substitute(end, free, corrected), ca.substitute(self._carried(end, x, s), free, corrected)

    def _estimate(self, state: Expression, slow: Expression) -> tuple[Expression, Expression]:
        """Return the estimated torque and its slopes, at the corrected states."""
        x, s = ca.SX.sym("x", self.n), ca.SX.sym("s", self.slow)
        torque = ca.mtimes(self.matrix("estimate", 1, self.n + 1, s), ca.vertcat(x, 1))
        free, corrected = ca.vertcat(x, s), ca.vertcat(state, slow)
        return ca.substitute(torque, free, corrected), ca.substitute(
            self.slopes(torque, x, s), free, corrected
        )

    def _process_noise(self, forgetting: Expression, inflation: Expression, u: Expression) -> Expression:
        """Return what one sample adds to the covariance.

        A torque that stays the same over the correlation time is, to a filter that takes it as white, one of
        2·correlation/sample times the variance. Of an input beyond what the drive surely gives, all that is
        beyond may be missing.
        """
        time = self.step.nominal.sample_time
        density = _white(self.noise.acceleration, self.trust, time)
        push = np.zeros(self.n)
        push[self.angle], push[self.speed] = time**2 / 2.0, time
        push /= self.units
        size = self.n + self.slow
        noise = ca.SX.zeros(size, size)
        missing = _missing(self.step, self.noise.safe_inputs, u) ** 2
        noise[: self.n, : self.n] = (inflation * density**2 + missing) * ca.DM(np.outer(push, push))
        for i in range(self.n):
            # Rounding of a small number beside large ones; without it single precision may lose its sign.
            noise[i, i] += 1e-6 if i in (self.angle, self.speed) else 1e-12
        for d in range(self.slow):
            noise[self.n + d, self.n + d] += forgetting
        return noise


def _white(deviation: float, trust: Trust, time: float) -> float:
    """Return what stays the same over the correlation time, to a filter that takes it as white."""
    return deviation * math.sqrt(max(2.0 * trust.correlation_time / time, 1.0))


def _missing(step: AdaptiveStep, safe: Mapping[str, float], u: Expression) -> Expression:
    """Return the acceleration that a limited drive may not give of what its inputs ask for."""
    missing = ca.SX(0)
    for i, v in enumerate(step.nominal.plant.inputs):
        if v.name in safe:
            missing += abs(_slope_of_drive(step, i)) * ca.fmax(ca.fabs(u[i]) - safe[v.name], 0.0)
    return missing


def _slope_of_drive(step: AdaptiveStep, index: int) -> float:
    """Return the acceleration per unit of an input, at its start value; zero where it gives none."""
    plant = step.nominal.plant
    rows = list(plant.rows)
    _, speed = plant.moving
    if speed not in rows:
        return 0.0
    u = ca.SX.sym("u", len(plant.inputs))
    slopes = ca.Function("slopes", [u], [ca.densify(ca.jacobian(step.driven(u)[0], u))])
    return float(slopes([v.start for v in plant.inputs])[rows.index(speed), index])


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


def _speed_deviation(angle: float, acceleration: float, time: float) -> float:
    """Return how well the speed of a free body is known from readings of its angle, before each reading.

    The dry friction of a speed that is known no better is a mean over its deviation: taken at the estimate,
    noise of the reading would be rectified, and learned as a torque of the spring.
    """
    carried = np.array([[1.0, time], [0.0, 1.0]])
    push = acceleration * np.array([[time**2 / 2.0], [time]])
    seen, tiny = np.array([[1.0, 0.0]]), 1e-12 * np.diag([angle, angle / time]) ** 2
    covariance = solve_discrete_are(carried.T, seen.T, push @ push.T + tiny, np.array([[angle**2]]))
    return math.sqrt(float(covariance[1, 1]))


def pairs(size: int) -> list[tuple[int, int]]:
    """Return the places of the upper triangle of a matrix, row by row."""
    return [(i, j) for i in range(size) for j in range(i, size)]


def _packed(matrix: Expression) -> Expression:
    """Return the upper triangle, row by row; symmetric by taking both halves."""
    size = matrix.shape[0]
    return ca.SX(ca.vertcat(*[(matrix[i, j] + matrix[j, i]) / 2.0 for i, j in pairs(size)]))


def _unpacked(packed: Expression, size: int) -> Expression:
    matrix = ca.SX(size, size)
    for k, (i, j) in enumerate(pairs(size)):
        matrix[i, j] = matrix[j, i] = packed[k]
    return matrix


def expected_inputs(filter_: FilterEquations) -> ca.Function:
    """Return (x, u, p, w) -> what is expected of each input: of the angle what the filter predicts."""
    memory, slow, _, arguments = _symbols(filter_)
    predicted = ca.SX(arguments[1])
    predicted[0] = filter_.expected_states(memory, slow)[filter_.angle]
    return ca.Function("expected", arguments, [predicted])


def first_states(filter_: FilterEquations) -> ca.Function:
    """Return (x, u, p, w) -> the states of a machine that rests at its first reading, and after a gap.

    What has been learned stays: after a gap only the angle follows the reading.
    """
    memory, slow, state, arguments = _symbols(filter_)
    n, count, inner = filter_.n, filter_.slow, filter_.step.inner
    angle, none = arguments[1][0], ca.SX.zeros(count, 1)
    following = filter_.matrix("next", n, n + 1 + len(filter_.plant.rows), none)
    prior = filter_.matrix("prior", n, 1, none)
    offset = [following[i, filter_.angle] * angle + following[i, n] + prior[i] for i in range(inner)]
    rest = at_rest([[following[i, j] for j in range(inner)] for i in range(inner)], offset)
    begun, resumed, at = ca.SX(state), ca.SX(state), ca.SX.zeros(n, 1)
    for i in range(inner):
        at[i] = rest[i]
    at[filter_.angle] = angle
    begun[:n] = at - prior
    if inner:
        begun[:n] -= ca.mtimes(filter_.matrix("coupling", n, inner, none), at[:inner])
    resumed[filter_.angle] += angle - filter_.expected_states(memory, slow)[filter_.angle]
    followed = n + count + 1
    begun[followed], resumed[followed] = angle, angle
    return ca.Function("begin", arguments, [begun, resumed])


def _symbols(filter_: FilterEquations) -> tuple[Expression, Expression, Expression, list[Expression]]:
    """Return memory, slow states, all states, and the arguments (x, u, p, w) of functions of a sample."""
    size = filter_.n + filter_.slow
    memory, slow = ca.SX.sym("memory", filter_.n), ca.SX.sym("slow", filter_.slow)
    others = ca.SX.sym("others", 2 + size * (size + 1) // 2)
    state = ca.SX(ca.vertcat(memory, slow, others))
    inputs = ca.SX.sym("u", 1 + len(filter_.plant.inputs))
    return memory, slow, state, [state, inputs, ca.SX(0, 1), filter_.w]
