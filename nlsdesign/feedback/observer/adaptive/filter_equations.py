"""The filter of an adaptive observer: two halves of a sample, their slopes, and the correction between.

What an adaptive observer makes of its first reading and of one after a gap, and what it expects next.
"""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import dataclass

import casadi as ca
import numpy as np
from scipy.linalg import solve_discrete_are

from ....foundation.symbolic import Expression
from ..scheduling.measured_angle import at_rest
from ..scheduling.table import Compact
from .adaptive_step import AdaptiveStep
from .duty_and_directions import Trust

FOLLOWING_TIME = 0.01
"""Seconds by which an angle lags the measured one; their distance says whether the actuator moves at all."""
UNREST_TIME = 1.0
"""Seconds over which innovations that are larger than expected raise the noise that is reckoned with."""
MOST_UNREST = 1e4
"""Largest factor on the variances of that noise."""
_WIDE = 5.0
"""Deviation of a prediction, in deviations of rounding, beyond which rounding is as good as normal noise."""


@dataclass(frozen=True)
class FilterNoise:
    """What the filter does not know.

    Parameters
    ----------
    angle
        Standard deviation of the measured angle in rad.
    acceleration
        Of what the equations miss, in rad/s².
    estimate
        Of the estimate beyond what its states explain, in its unit.
    safe_inputs
        Size of each limited input up to which the drive surely gives it.
    """

    angle: float
    acceleration: float
    estimate: float
    safe_inputs: Mapping[str, float]


class FilterEquations:
    """Writes the filter with the entries read from the table.

    Parameters
    ----------
    step
        One step and its slopes along the slow states.
    compact
        Its table.
    trust
        How far the equations are trusted.
    noise
        What the filter does not know.
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
        self.blur = _speed_deviation(noise.angle, _white(noise.acceleration, trust, time), time)
        self.calm = _calm_speed(self.plant.friction, float(self.plant.sizes[self.speed]), self.blur)

    # --- reading the table ------------------------------------------------------------------------------

    def _read(self, kind: str, i: int, j: int = 0) -> Expression:
        place = self.compact.places[f"{kind}[{i}][{j}]"]
        return ca.SX(place.factor) if place.column is None else place.factor * self.w[place.column]

    def matrix(self, kind: str, rows: int, columns: int, slow: Expression) -> Expression:
        """Return a matrix of the step at the slow states.

        Parameters
        ----------
        kind
            Of :meth:`AdaptiveStep.matrices`.
        rows, columns
            Its shape.
        slow
            Slow states.
        """
        total = ca.SX(rows, columns)
        for i in range(rows):
            for j in range(columns):
                parts = [self._read(kind, i, j)]
                parts += [slow[d] * self._read(f"{kind}.{d}", i, j) for d in range(self.slow)]
                total[i, j] = sum(parts, start=ca.SX(0))
                if self._accelerates(kind, i, j):
                    total[i, j] *= self._lightness(slow)
        return total

    def _accelerates(self, kind: str, i: int, j: int) -> bool:
        """Return whether an entry is what a torque does to angle or speed."""
        moves = i >= self.step.inner
        return moves and (
            kind in ("prior", "coupling") or (kind == "next" and (j < self.step.inner or j == self.n))
        )

    def _lightness(self, slow: Expression) -> Expression:
        """Return the declared inertia over that at the slow states."""
        slopes = [c if abs(c) > 1e-6 else 0.0 for c in self.step.lightness]
        return ca.exp(sum((c * slow[d] for d, c in enumerate(slopes) if c), start=ca.SX(0)))

    # --- the two halves of a sample ---------------------------------------------------------------------

    def expected_states(self, memory: Expression, slow: Expression) -> Expression:
        """Return the states expected at a sample: what the angle adds at its end, then friction.

        Parameters
        ----------
        memory
            What the estimates carry on.
        slow
            Slow states.
        """
        state = memory + self.matrix("prior", self.n, 1, slow)
        inner = self.step.inner
        if inner:
            state += ca.mtimes(self.matrix("coupling", self.n, inner, slow), state[:inner])
        friction_of = self.step.friction
        speed = ca.SX.sym("speed")
        length = ca.sqrt(speed**2 + self.blur**2)
        ahead, back = friction_of(length), friction_of(-length)
        if ahead is None or back is None:
            return state

        def blurred(forward: Expression, backward: Expression) -> Expression:
            return (forward + backward) / 2.0 + (forward - backward) / 2.0 * speed / length

        own = blurred(ahead[0], back[0])
        slopes = [blurred(one, other) for one, other in zip(ahead[1], back[1], strict=True)]
        rate = self._lightness(slow) * (
            own + sum((slow[d] * slope for d, slope in enumerate(slopes)), start=ca.SX(0))
        )
        time = self.step.nominal.sample_time
        # The exponential Rosenbrock–Euler step of the scheduled observers: it stops but never turns around.
        x = time * ca.jacobian(rate, speed)
        x = x - 1e-9 * (ca.fabs(x) < 1e-9)
        left = speed + time * rate * ca.expm1(x) / x
        change = ca.substitute(left * (left * speed > 0) - speed, speed, state[self.speed])
        state[self.angle] += time / 2.0 * change
        state[self.speed] += change
        return state

    def _end(self, state: Expression, slow: Expression, u: Expression) -> Expression:
        """Return what goes on to the next sample."""
        count = self.n + 1 + len(self.plant.rows)
        matrix = self.matrix("next", self.n, count, slow)
        own, slopes = self.step.driven(u)
        pushed = self._lightness(slow) * (
            own + sum((slow[d] * slope for d, slope in enumerate(slopes)), start=ca.SX(0))
        )
        return ca.SX(ca.mtimes(matrix, ca.vertcat(state, 1, pushed)))

    def _slopes(self, expression: Expression, of: Expression, slow: Expression) -> Expression:
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
        upper = ca.mtimes(ca.diag(1.0 / self.units), self._slopes(expression, of, slow))
        return ca.SX(ca.vertcat(upper, ca.horzcat(ca.SX(self.slow, self.n), ca.SX.eye(self.slow))))

    def _direction(self, covariance: Expression, speed: Expression) -> tuple[Expression, Expression]:
        """Return what a change of the angle says of all states, and how far the actuator moves, 0 to 1."""
        moving = speed**2 / (speed**2 + self.calm**2) if self.calm else ca.SX(1)
        column = covariance[:, self.angle] / covariance[self.angle, self.angle]
        for i in range(self.n):
            if i not in (self.angle, self.speed):
                column[i] = 0
        column[self.n :] *= moving
        return column, moving

    def sample(self) -> ca.Function:
        """Return one sample as the equations of a discrete flat model."""
        n, slow_count, plant = self.n, self.slow, self.plant
        size = n + slow_count
        memory, slow = ca.SX.sym("memory", n), ca.SX.sym("slow", slow_count)
        packed, unrest = ca.SX.sym("covariance", size * (size + 1) // 2), ca.SX.sym("unrest")
        angle, u = ca.SX.sym(plant.angle), ca.SX.sym("u", len(plant.inputs))
        slopes = self._carried(self.expected_states(memory, slow), memory, slow)
        before = ca.mtimes([slopes, _unpacked(packed, size), slopes.T])
        expected = self.expected_states(memory, slow)
        innovation = angle - expected[self.angle]
        off, variance_of_angle = innovation / self.noise.angle, before[self.angle, self.angle]
        followed = ca.SX.sym("followed")
        seen_speed = (angle - followed) / FOLLOWING_TIME
        direction, moving = self._direction(
            before, ca.fmin(ca.fabs(expected[self.speed]), ca.fabs(seen_speed))
        )
        # A surprise beyond what noise gives teaches the less the larger it is: a drive at its limit or a
        # jump of the encoder is no news of the rubber.
        squared = off**2 / (variance_of_angle + unrest)
        surprise = ca.sqrt(squared + 1e-12)
        direction[n:] *= ca.fmin(1.0, self.trust.surprise / surprise)
        for i, v in enumerate(plant.inputs):
            if v.name in self.noise.safe_inputs:
                direction[n:] *= ca.fabs(u[i]) < self.noise.safe_inputs[v.name]
        moved, kept = within_a_count(off / ca.sqrt(unrest), variance_of_angle / unrest)
        moved *= ca.sqrt(unrest)
        step, gain = direction * moved, direction * (1.0 - kept)
        state = expected + step[:n] * self.units
        slow_after = ca.fmin(ca.fmax(slow + step[n:], -self.trust.limit), self.trust.limit)
        keep = ca.SX.eye(size)
        keep[:, self.angle] -= gain
        spread = direction * ca.sqrt(kept * (1.0 - kept) * variance_of_angle)
        after = ca.mtimes([keep, before, keep.T]) + ca.mtimes(spread, spread.T)
        s, free = ca.SX.sym("s", n), ca.SX.sym("free", slow_count)
        end = self._end(s, free, u)
        following = ca.substitute(end, ca.vertcat(s, free), ca.vertcat(state, slow_after))
        onward = ca.substitute(
            self._carried(end, s, free), ca.vertcat(s, free), ca.vertcat(state, slow_after)
        )
        forget = moving * (1.0 - math.exp(-2.0 * self.step.nominal.sample_time / self.trust.drift_time))
        fading = ca.vertcat(ca.SX.ones(n, 1), ca.sqrt(1.0 - forget) * ca.SX.ones(slow_count, 1))
        onward = ca.mtimes(ca.diag(fading), onward)
        next_covariance = ca.mtimes([onward, after, onward.T]) + self._process_noise(forget, unrest, u)
        row = self.matrix("estimate", 1, n + 1, free)
        wanted = ca.mtimes(row, ca.vertcat(s, 1))
        slopes_of_estimate = self._slopes(wanted, s, free)
        both = (ca.vertcat(s, free), ca.vertcat(state, slow_after))
        estimate, row_at = ca.substitute(wanted, *both), ca.substitute(slopes_of_estimate, *both)
        variance = ca.mtimes([row_at, after, row_at.T]) + self.noise.estimate**2
        shown = state + self.matrix("shift", n, 1, slow_after)
        outputs = [estimate, ca.sqrt(variance), shown, innovation, slow_after]
        excess = ca.fmin(squared, self.trust.surprise**2) - 1.0
        restless = unrest * (1.0 + self.step.nominal.sample_time / UNREST_TIME * excess)
        restless = ca.fmin(ca.fmax(restless, 1.0), MOST_UNREST)
        behind = angle + math.exp(-self.step.nominal.sample_time / FOLLOWING_TIME) * (followed - angle)
        states = [following, slow_after * fading[n:], restless, behind, _packed(next_covariance)]
        arguments = [
            ca.SX.sym("time"),
            ca.vertcat(memory, slow, unrest, followed, packed),
            ca.vertcat(angle, u),
            ca.SX(0, 1),
        ]
        results = ca.cse([ca.densify(ca.vertcat(*states)), ca.densify(ca.vertcat(*outputs))])
        return ca.Function(
            "equations",
            [*arguments, self.w],
            [*results, ca.SX(0, 1), ca.SX(0, 1)],
            ["time", "state", "input", "parameter", "table"], ["derivative", "output", "signal", "residual"],
        )  # fmt: skip

    def _process_noise(self, forget: Expression, unrest: Expression, u: Expression) -> Expression:
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
        noise[: self.n, : self.n] = (unrest * density**2 + missing) * ca.DM(np.outer(push, push))
        for i in range(self.n):
            # Rounding of a small number beside large ones; without it single precision may lose its sign.
            noise[i, i] += 1e-6 if i in (self.angle, self.speed) else 1e-12
        for d in range(self.slow):
            noise[self.n + d, self.n + d] += forget
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


def _slope_of_drive(step: AdaptiveStep, place: int) -> float:
    """Return the acceleration per unit of an input, at its start value; zero where it gives none."""
    plant = step.nominal.plant
    rows = list(plant.rows)
    _, speed = plant.moving
    if speed not in rows:
        return 0.0
    u = ca.SX.sym("u", len(plant.inputs))
    slopes = ca.Function("slopes", [u], [ca.densify(ca.jacobian(step.driven(u)[0], u))])
    return float(slopes([v.start for v in plant.inputs])[rows.index(speed), place])


def within_a_count(off: Expression, variance: Expression) -> tuple[Expression, Expression]:
    """Return what one reading says of the angle: the change of its mean, and the share of variance left.

    A reading does not say "this angle, with an error": it says that the angle lies within one count. So a
    prediction inside the count is neither corrected nor believed more, and what is learned at the edges is
    not taken for white noise, which a drive that follows the counts would turn into a wrong inertia. Mean and
    variance are those of the normal distribution of the prediction, cut off at the edges. Where the
    prediction is much wider than a count, that is the Kalman filter with the variance of rounding; three
    deviations outside, the correction goes on as there.

    Parameters
    ----------
    off
        Reading minus predicted angle, in units of the deviation of rounding, a count over √12.
    variance
        Of the prediction, in the square of that unit.
    """
    half = math.sqrt(3.0)
    narrow = ca.sqrt(ca.fmin(variance, _WIDE**2))
    size = ca.fabs(off)
    near = ca.fmin(size, half + 3.0 * narrow)
    low, high = (near - half) / narrow, (near + half) / narrow
    mass = (ca.erf(high / math.sqrt(2.0)) - ca.erf(low / math.sqrt(2.0))) / 2.0
    at_low, at_high = (ca.exp(-(ca.fmin(edge**2, 100.0)) / 2.0) for edge in (low, high))
    root = math.sqrt(2.0 * math.pi)
    mean = (at_low - at_high) / (root * mass)
    left = 1.0 + (low * at_low - high * at_high) / (root * mass) - mean**2
    plain = variance / (variance + 1.0)
    wide = variance > _WIDE**2
    moved = ca.if_else(wide, plain * size, narrow * mean + plain * (size - near))
    kept = ca.if_else(wide, 1.0 - plain, ca.fmin(ca.fmax(left, 0.0), 1.0))
    return ca.SX(ca.sign(off) * moved), ca.SX(kept)


def _calm_speed(friction: ca.Function | None, size: float, blur: float) -> float:
    """Return a speed below which dry friction is not at its level, as the filter sees it; 0 for none.

    That is twice the speed at which 90 % of it are reached.
    """
    if friction is None:
        return 0.0
    speeds = size * np.logspace(-7.0, 0.0, 400)
    level = np.abs(friction.map(len(speeds))(speeds[None, :]).full().ravel())
    reached = np.flatnonzero(level >= 0.9 * np.max(level))
    return 2.0 * max(float(speeds[reached[0]]), 2.0 * blur)


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
    """Return the places of the upper triangle of a matrix, row by row.

    Parameters
    ----------
    size
        Number of rows.
    """
    return [(i, j) for i in range(size) for j in range(i, size)]


def _packed(matrix: Expression) -> Expression:
    """Return the upper triangle, row by row; symmetric by taking both halves."""
    size = matrix.shape[0]
    return ca.SX(ca.vertcat(*[(matrix[i, j] + matrix[j, i]) / 2.0 for i, j in pairs(size)]))


def _unpacked(packed: Expression, size: int) -> Expression:
    matrix = ca.SX(size, size)
    for place, (i, j) in enumerate(pairs(size)):
        matrix[i, j] = packed[place]
        matrix[j, i] = packed[place]
    return matrix


def expected_inputs(filter_: FilterEquations) -> ca.Function:
    """Return (x, u, p, w) -> what is expected of each input: of the angle what the filter predicts.

    Parameters
    ----------
    filter_
        Its equations.
    """
    memory, slow, _, arguments = _symbols(filter_)
    predicted = ca.SX(arguments[1])
    predicted[0] = filter_.expected_states(memory, slow)[filter_.angle]
    return ca.Function("expected", arguments, [predicted])


def first_states(filter_: FilterEquations) -> ca.Function:
    """Return (x, u, p, w) -> the states of a machine that rests at its first reading, and after a gap.

    What has been learned stays: after a gap only the angle follows the reading.

    Parameters
    ----------
    filter_
        Its equations.
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
