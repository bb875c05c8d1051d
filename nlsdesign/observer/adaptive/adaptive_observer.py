"""An observer that learns what the deck does not know exactly, as a discrete flat model.

It carries the states of the plant and, as slow states, how far the machine lies from its deck along a few
directions in the space of the uncertain numbers (:mod:`~nlsdesign.observer.adaptive.directions`). Given the
measured angle everything is linear in the other states, so the filter is a Kalman filter of a system that
varies with the angle; its covariance is part of its memory. How far rubber and current are trusted is therefore
not a gain that somebody chose: it follows from the spreads of the deck, and from what the motion has shown so
far. Three rules go beyond the textbook:

- The inner states of the rubber get no correction. They are driven by the measured angle alone, as in the
  cascade, so the estimate stays bounded whatever current and friction do.
- Near standstill dry friction can carry anything up to its limit, so there the current says nothing of the
  rubber: the slow states get no correction while the estimated speed is small.
- Slow states are held within a stated number of deviations, so the torque is at most that far from the deck's.

Source: Kalman 1960; Joseph's form of the covariance, which holds for any gain: Bucy and Joseph 1968.
"""

from __future__ import annotations

import math
from dataclasses import dataclass, field, replace

import casadi as ca
import numpy as np
from numpy.typing import NDArray

from ...errors import ArrangementError, ValueRangeError
from ...model import FlatModel, Table, Variable
from ...model.roles import measured_motion, spring_torque
from ...simulation.prior import Prior, declared_prior
from ...symbolic import Expression
from ..scheduling.forms import finished, minimal_form
from ..scheduling.gains import CascadeGain
from ..scheduling.scheduled import ESTIMATE, INNOVATION, MEMORY, whole_contour
from ..scheduling.step import ObserverStep
from ..scheduling.table import Compact, Grid
from .adaptive_step import AdaptiveStep, adaptive_step
from .directions import UncertainDirections, uncertain_directions
from .duty import Duty, operating_points

Array = NDArray[np.float64]

DEVIATION, SPREAD = "deviation", "standard_deviation"
"""What is added to the name of the estimate for the slow states, and for the deviation that the filter expects."""


@dataclass(frozen=True)
class Trust:
    """How far the filter trusts its equations.

    Parameters
    ----------
    unmodelled
        Torque that the equations miss, one standard deviation, as a share of the torque of the duty.
    correlation_time
        Time in s over which it stays the same.
    drift_time
        Time in s of motion after which the machine may lie anywhere within its spreads again, as rubber creeps
        and warms up. At standstill nothing is forgotten.
    counts
        Standard deviation of the measured angle in units of that of an ideal encoder, quantum/√12.
    limit
        Largest distance of a slow state from the deck, in standard deviations.
    surprise
        Innovation in standard deviations from which on it corrects the slow states no further.
    smallest
        Smallest torque that a slow state moves per standard deviation, as a share of that of the duty.
    most
        Largest number of slow states.

    Raises
    ------
    ValueRangeError
        If a number is not positive.
    """

    unmodelled: float = 0.005
    correlation_time: float = 0.02
    drift_time: float = 600.0
    counts: float = 1.0
    limit: float = 4.0
    surprise: float = 3.0
    smallest: float = 0.0004
    most: int = 12

    def __post_init__(self) -> None:
        for name in (
            "unmodelled",
            "correlation_time",
            "drift_time",
            "counts",
            "limit",
            "surprise",
            "smallest",
            "most",
        ):
            value = getattr(self, name)
            if not (math.isfinite(value) and value > 0):
                raise ValueRangeError(f"{name} {value:g}", "must be positive")


@dataclass(frozen=True, eq=False)
class AdaptiveDesign:
    """An adaptive observer and what went into it.

    Parameters
    ----------
    model
        The observer: discrete, scheduled over one table.
    step
        Its step as exact functions of the angle.
    compact
        Its table, and the error that the table makes.
    directions
        What the slow states mean.
    duty, trust
        Over which, and with which settings it was designed.
    """

    model: FlatModel
    step: AdaptiveStep
    compact: Compact
    directions: UncertainDirections
    duty: Duty
    trust: Trust

    def start(self, angle: float) -> dict[str, float]:
        """Return the start values of an observer that begins while the actuator rests at an angle.

        Parameters
        ----------
        angle
            In rad.
        """
        plant, at = self.step.nominal.plant, np.array([angle])
        matrices = self.step.matrices(at)
        state = plant.rest(at)[0] - matrices["shift"][0, :, 0]
        memory = state - matrices["prior"][0, :, 0] - matrices["coupling"][0] @ state[: self.step.inner]
        return {f"{n}.{MEMORY}": float(m) for n, m in zip(plant.names, memory, strict=True)}

    def __str__(self) -> str:
        grid = self.compact.angles
        estimate = self.step.nominal.plant.estimate
        lines = [
            f"Adaptive observer of {estimate.name} every {self.step.nominal.sample_time:g} s",
            f"  table: {len(grid)} angles from {grid[0]:.4g} to {grid[-1]:.4g} rad, "
            f"{len(self.compact.columns)} columns",
            "  slow states, with the torque that one deviation moves:",
        ]
        for d, effect in enumerate(self.directions.effect):
            where = "spring" if self.directions.torque_share[d] > 0.5 else "drive"
            words = self.directions.in_words(d)
            lines.append(f"    [{d + 1}] {1e3 * effect:.3g} m{estimate.unit}, {where}: {words}")
        return "\n".join([*lines, f"  left out: {1e3 * self.directions.left_out:.2g} m{estimate.unit}"])


def design_adaptive_observer(
    model: FlatModel,
    *,
    estimate: str | None = None,
    measured: str | None = None,
    sample_time: float = 1e-3,
    settings: AdaptiveSettings | None = None,
    grid: Grid | None = None,
) -> AdaptiveDesign:
    """Design an observer that estimates a torque, and what the deck does not know exactly, from one angle.

    Inputs and outputs are those of :func:`~nlsdesign.observer.design_observer`; added to the outputs are the
    standard deviation that the filter expects of its estimate, and the slow states.

    Parameters
    ----------
    model
        Continuous, load fixed.
    estimate
        Output or signal that is wanted; by default the torque of the series spring.
    measured
        State that is measured; by default the motion of the driven body.
    sample_time
        In s.
    settings
        What is known, what the actuator does, and how far the equations are trusted.
    grid
        Range and number of grid points; the whole contour of the cam by default.

    Raises
    ------
    ArrangementError
        If no number of the deck is uncertain enough to matter, no encoder of the angle is declared, or the
        equations cannot be scheduled over one angle.
    ValueRangeError
        If the estimate is far from linear in the inner states, or a setting is out of range.
    ConvergenceError
        If the table does not keep its error bound.
    """
    if not 0.0 < sample_time < 1.0:
        raise ValueRangeError(f"sample_time {sample_time:g} s", "must lie between 0 and 1 s")
    settings = settings or AdaptiveSettings()
    estimate, measured = spring_torque(model, estimate), measured_motion(model, measured)
    trust, over = settings.trust, grid or whole_contour(model)
    noise = trust.counts * encoder_quantum(model, measured) / math.sqrt(12.0)
    reference = np.linspace(over.lower, over.upper, 65)
    form, sizes = minimal_form(model, estimate=estimate, angle=measured, angles=reference)
    plant = finished(form, sizes, ())
    points = operating_points(form, settings.duty)
    resolution = trust.unmodelled * points.torque
    prior = settings.prior or declared_prior(model)
    directions = uncertain_directions(
        form,
        prior,
        settings.duty,
        resolution=trust.smallest * points.torque,
        most=trust.most,
    )
    step = adaptive_step(
        form, ObserverStep(plant, CascadeGain(), sample_time, reference), directions, form.model.values
    )
    compact = over.compact(step.entries)
    missed = math.hypot(resolution, directions.left_out)
    filter_ = _Filter(
        step,
        compact,
        directions,
        trust,
        _Noise(noise, missed / points.inertia, missed),
        safe_inputs(model, prior),
    )
    observed = tuple(body for body in model.bodies if body.motion == measured)
    design = AdaptiveDesign(
        replace(filter_.model(), bodies=observed), step, compact, directions, settings.duty, trust
    )
    return replace(design, model=design.model.with_values(design.start(0.0)))


@dataclass(frozen=True, eq=False)
class AdaptiveSettings:
    """What an adaptive observer is designed for.

    Parameters
    ----------
    prior
        What is known of the numbers; the spreads of the deck by default.
    duty
        What the actuator does.
    trust
        How far the equations are trusted.
    """

    prior: Prior | None = None
    duty: Duty = field(default_factory=Duty)
    trust: Trust = field(default_factory=Trust)


def encoder_quantum(model: FlatModel, measured: str) -> float:
    """Return the angle of one count of the encoder that shows a motion, in rad.

    Parameters
    ----------
    model
        Flat model with its sensors.
    measured
        State that the encoder shows.

    Raises
    ------
    ArrangementError
        If no encoder of that motion is declared.
    """
    for reading in model.readings:
        if reading.measured == measured:
            for sensor in reading.sensors:
                if f"{sensor}.quantum" in model.values:
                    return model.values[f"{sensor}.quantum"]
    raise ArrangementError(
        f"model '{model.name}'", f"declares no encoder of '{measured}', so its resolution is not known",
        next_step=f'add a part with component = "Encoder" and of = "{measured}"',
    )  # fmt: skip


def safe_inputs(model: FlatModel, prior: Prior) -> dict[str, float]:
    """Return the size of each limited input up to which the drive surely gives it: two deviations inside.

    Parameters
    ----------
    model
        Flat model with its motors.
    prior
        What is known of the limits.
    """
    safe = {}
    for body in model.bodies:
        motor = body.motor
        if motor is not None and motor.command is not None and motor.current_limit is not None:
            name = motor.current_limit
            spread = float(prior.deviations[prior.place(name)]) if name in prior.names else 0.0
            safe[motor.command] = model.values[name] * math.exp(-2.0 * spread)
    return safe


@dataclass(frozen=True)
class _Noise:
    """Deviations: of the measured angle in rad, of the acceleration in rad/s², of the estimate."""

    angle: float
    acceleration: float
    estimate: float


class _Filter:
    """Writes the filter with the entries read from the table."""

    def __init__(
        self,
        step: AdaptiveStep,
        compact: Compact,
        directions: UncertainDirections,
        trust: Trust,
        noise: _Noise,
        safe_inputs: Mapping[str, float],
    ) -> None:
        self.step, self.compact, self.trust, self.noise = step, compact, trust, noise
        self.safe_inputs = safe_inputs
        self.plant = step.nominal.plant
        self.directions = directions
        self.n, self.slow = len(self.plant.states), len(directions.effect)
        self.angle, self.speed = self.plant.moving
        self.w = ca.SX.sym("w", len(compact.columns))
        time = step.nominal.sample_time
        # Units in which all covariances are near one: counts, counts per sample, sizes of inner states.
        self.units = self.plant.sizes.copy()
        self.units[self.angle], self.units[self.speed] = noise.angle, noise.angle / time
        self.calm = _calm_speed(self.plant.friction, float(self.plant.sizes[self.speed]))

    # --- reading the table ------------------------------------------------------------------------------

    def _read(self, kind: str, i: int, j: int = 0) -> Expression:
        place = self.compact.places[f"{kind}[{i}][{j}]"]
        return ca.SX(place.factor) if place.column is None else place.factor * self.w[place.column]

    def _matrix(self, kind: str, rows: int, columns: int, slow: Expression) -> Expression:
        """Return a matrix of the step at the slow states."""
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

    def _begin(self, memory: Expression, slow: Expression) -> Expression:
        """Return the states expected at a sample: what the angle adds at its end, then friction."""
        state = memory + self._matrix("prior", self.n, 1, slow)
        inner = self.step.inner
        if inner:
            state += ca.mtimes(self._matrix("coupling", self.n, inner, slow), state[:inner])
        friction_of = self.step.friction
        speed = ca.SX.sym("speed")
        given = friction_of(speed)
        if given is None:
            return state
        own, slopes = given
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
        matrix = self._matrix("next", self.n, count, slow)
        own, slopes = self.step.driven(u)
        pushed = self._lightness(slow) * (
            own + sum((slow[d] * slope for d, slope in enumerate(slopes)), start=ca.SX(0))
        )
        return ca.SX(ca.mtimes(matrix, ca.vertcat(state, 1, pushed)))

    def _carried(self, expression: Expression, of: Expression, slow: Expression) -> Expression:
        """Return the slopes of a half in the units of the filter, slow states below the others.

        They are taken at the deck, not at the estimate: what no motion can tell apart (a drive, a rubber and
        an inertia that are all ten per cent larger) must be the same direction at every sample, or the filter
        would believe to have seen it. Source: Huang et al. 2010 (first-estimates Jacobian).
        """
        jacobian = ca.substitute(
            ca.jacobian(expression, ca.vertcat(of, slow)), slow, ca.SX.zeros(self.slow, 1)
        )
        scale = np.concatenate([self.units, np.ones(self.slow)])
        upper = ca.mtimes([ca.diag(1.0 / self.units), jacobian, ca.diag(scale)])
        return ca.SX(ca.vertcat(upper, ca.horzcat(ca.SX(self.slow, self.n), ca.SX.eye(self.slow))))

    def _gain(
        self, covariance: Expression, speed: Expression, surprise: Expression
    ) -> tuple[Expression, Expression]:
        """Return the gain, and how far the actuator moves: 0 at standstill, 1 in motion.

        A surprise, the squared innovation over its variance, beyond what noise gives teaches the less the
        larger it is: a drive at its limit or a jump of the encoder is no news of the rubber.
        """
        moving = speed**2 / (speed**2 + self.calm**2) if self.calm else ca.SX(1)
        column = covariance[:, self.angle] / (covariance[self.angle, self.angle] + 1.0)
        for i in range(self.n):
            if i not in (self.angle, self.speed):
                column[i] = 0
        column[self.n :] *= moving * ca.fmin(1.0, self.trust.surprise / ca.sqrt(surprise + 1e-12))
        return column, moving

    def _within_limit(self, u: Expression) -> Expression:
        """Return 1 while no input is near a limit of the drive that is not known exactly, else 0."""
        inside = ca.SX(1)
        for i, v in enumerate(self.plant.inputs):
            if v.name in self.safe_inputs:
                inside *= ca.fabs(u[i]) < self.safe_inputs[v.name]
        return inside

    def model(self) -> FlatModel:
        """Return the observer."""
        n, slow_count, plant = self.n, self.slow, self.plant
        size = n + slow_count
        memory, slow = ca.SX.sym("memory", n), ca.SX.sym("slow", slow_count)
        packed = ca.SX.sym("covariance", size * (size + 1) // 2)
        angle, u = ca.SX.sym(plant.angle), ca.SX.sym("u", len(plant.inputs))
        slopes = self._carried(self._begin(memory, slow), memory, slow)
        before = ca.mtimes([slopes, _unpacked(packed, size), slopes.T])
        expected = self._begin(memory, slow)
        innovation = angle - expected[self.angle]
        surprise = (innovation / self.noise.angle) ** 2 / (before[self.angle, self.angle] + 1.0)
        gain, moving = self._gain(before, expected[self.speed], surprise)
        gain[n:] *= self._within_limit(u)
        step = gain * (innovation / self.noise.angle)
        state = expected + step[:n] * self.units
        slow_after = ca.fmin(ca.fmax(slow + step[n:], -self.trust.limit), self.trust.limit)
        keep = ca.SX.eye(size)
        keep[:, self.angle] -= gain
        after = ca.mtimes([keep, before, keep.T]) + ca.mtimes(gain, gain.T)
        s, free = ca.SX.sym("s", n), ca.SX.sym("free", slow_count)
        end = self._end(s, free, u)
        following = ca.substitute(end, ca.vertcat(s, free), ca.vertcat(state, slow_after))
        onward = ca.substitute(
            self._carried(end, s, free), ca.vertcat(s, free), ca.vertcat(state, slow_after)
        )
        forget = moving * (1.0 - math.exp(-2.0 * self.step.nominal.sample_time / self.trust.drift_time))
        fading = ca.vertcat(ca.SX.ones(n, 1), ca.sqrt(1.0 - forget) * ca.SX.ones(slow_count, 1))
        onward = ca.mtimes(ca.diag(fading), onward)
        next_covariance = ca.mtimes([onward, after, onward.T]) + self._process_noise(forget)
        row = self._matrix("estimate", 1, n + 1, free)
        wanted = ca.mtimes(row, ca.vertcat(s, 1))
        told = self._carried_row(wanted, s, free)
        both = (ca.vertcat(s, free), ca.vertcat(state, slow_after))
        estimate, row_at = ca.substitute(wanted, *both), ca.substitute(told, *both)
        variance = ca.mtimes([row_at, after, row_at.T]) + self.noise.estimate**2
        shown = state + self._matrix("shift", n, 1, slow_after)
        outputs = [estimate, ca.sqrt(variance), shown, innovation, slow_after]
        states = [following, slow_after * fading[n:], _packed(next_covariance)]
        arguments = [ca.SX.sym("time"), ca.vertcat(memory, slow, packed), ca.vertcat(angle, u), ca.SX(0, 1)]
        results = ca.cse([ca.densify(ca.vertcat(*states)), ca.densify(ca.vertcat(*outputs))])
        equations = ca.Function(
            "equations",
            [*arguments, self.w],
            [*results, ca.SX(0, 1), ca.SX(0, 1)],
            ["time", "state", "input", "parameter", "table"], ["derivative", "output", "signal", "residual"],
        )  # fmt: skip
        return FlatModel(
            name=f"{plant.name}_observer",
            description=self._description(),
            states=self._states(),
            inputs=self._inputs(),
            parameters=(),
            outputs=self._outputs(),
            signals=(),
            equations=equations,
            sample_time=self.step.nominal.sample_time,
            tables=self._tables(),
        )

    def _carried_row(self, wanted: Expression, s: Expression, slow: Expression) -> Expression:
        scale = np.concatenate([self.units, np.ones(self.slow)])
        jacobian = ca.substitute(ca.jacobian(wanted, ca.vertcat(s, slow)), slow, ca.SX.zeros(self.slow, 1))
        return ca.SX(ca.mtimes(jacobian, ca.diag(scale)))

    def _process_noise(self, forget: Expression) -> Expression:
        """Return what one sample adds to the covariance.

        A torque that stays the same over the correlation time is, to a filter that takes it as white, one of
        2·correlation/sample times the variance.
        """
        time = self.step.nominal.sample_time
        density = self.noise.acceleration * math.sqrt(max(2.0 * self.trust.correlation_time / time, 1.0))
        push = np.zeros(self.n)
        push[self.angle], push[self.speed] = density * time**2 / 2.0, density * time
        push /= self.units
        size = self.n + self.slow
        noise = ca.SX.zeros(size, size)
        noise[: self.n, : self.n] = ca.DM(np.outer(push, push))
        for i in range(self.n):
            # Rounding of a small number beside large ones; without it single precision may lose its sign.
            noise[i, i] += 1e-6 if i in (self.angle, self.speed) else 1e-12
        for d in range(self.slow):
            noise[self.n + d, self.n + d] += forget
        return noise

    # --- names ------------------------------------------------------------------------------------------

    def _description(self) -> str:
        grid = self.compact.angles
        return (
            f"observer of {self.plant.estimate.name} that learns {self.slow} deviations from the deck, "
            f"{self.trust}, table of {len(grid)} angles from {grid[0]:.4g} to {grid[-1]:.4g} rad"
        )

    def _slow_names(self) -> list[str]:
        return [f"{self.plant.estimate.name}.{DEVIATION}[{d + 1}]" for d in range(self.slow)]

    def _states(self) -> tuple[Variable, ...]:
        plant = self.plant
        states = [
            Variable(
                f"{v.name}.{MEMORY}", v.unit, f"what the estimate of {v.name} carries on", nominal=float(size)
            )
            for v, size in zip(plant.states, plant.sizes, strict=True)
        ]  # fmt: skip
        for d, name in enumerate(self._slow_names()):
            text = f"distance from the deck in standard deviations; one is {self.directions.in_words(d)}"
            states.append(Variable(f"{name}.{MEMORY}", "1", text))
        initial = np.concatenate([self._initial_variances(), np.ones(self.slow)])
        names = [*plant.names, *self._slow_names()]
        for i, j in _pairs(len(names)):
            start = float(initial[i]) if i == j else 0.0
            words = "covariance of the errors, in counts, counts per sample, typical sizes and deviations: "
            states.append(
                Variable(f"covariance[{i + 1},{j + 1}]", "1", f"{words}{names[i]} and {names[j]}", start)
            )
        return tuple(states)

    def _initial_variances(self) -> Array:
        """Return variances at the start: nothing is known of the angle, little of speed and inner states."""
        sizes = self.plant.sizes / self.units
        first = (0.1 * sizes) ** 2
        first[self.angle] = sizes[self.angle] ** 2
        first[self.speed] = (0.03 * sizes[self.speed]) ** 2
        return np.asarray(first, dtype=np.float64)

    def _inputs(self) -> tuple[Variable, ...]:
        grid, v = self.compact.angles, self.plant.states[self.angle]
        text = (
            f"measured {v.name}; the table reaches from {grid[0]:.4g} to {grid[-1]:.4g} rad and holds its "
            "ends beyond"
        )
        size = float(self.plant.sizes[self.angle])
        return (Variable(v.name, v.unit, text, nominal=size), *self.plant.inputs)

    def _outputs(self) -> tuple[Variable, ...]:
        plant, v = self.plant, self.plant.estimate
        size = float(np.max(np.abs(self.step.nominal.scales()["estimate"])))
        outputs = [
            Variable(v.name, v.unit, f"estimate of {v.name}", nominal=size),
            Variable(f"{v.name}.{SPREAD}", v.unit, "standard deviation that the filter expects of it"),
        ]
        for s in plant.states:
            name = f"{s.name}.{ESTIMATE}" if s.name == plant.angle else s.name
            outputs.append(Variable(name, s.unit, f"estimate of {s.name}"))
        angle = plant.states[self.angle]
        outputs.append(
            Variable(f"{angle.name}.{INNOVATION}", angle.unit, f"measured minus expected {angle.name}")
        )
        for d, name in enumerate(self._slow_names()):
            text = f"distance from the deck in standard deviations; one is {self.directions.in_words(d)}"
            outputs.append(Variable(name, "1", text))
        return tuple(outputs)

    def _tables(self) -> tuple[Table, ...]:
        if not self.compact.columns:
            return ()
        grid = self.compact.angles
        columns = tuple(
            Variable(c.name, c.unit, f"entry {c.key} of the step, in the sum of {c.row}")
            for c in self.compact.columns
        )
        step = float(grid[1] - grid[0])
        return (Table(self.plant.angle, float(grid[0]), step, columns, self.compact.values),)


def _calm_speed(friction: ca.Function | None, size: float) -> float:
    """Return a speed below which dry friction is not at its level: twice that of 90 % of it; 0 for none."""
    if friction is None:
        return 0.0
    speeds = size * np.logspace(-7.0, 0.0, 400)
    level = np.abs(friction.map(len(speeds))(speeds[None, :]).full().ravel())
    reached = np.flatnonzero(level >= 0.9 * np.max(level))
    return float(2.0 * speeds[reached[0]])


def _pairs(size: int) -> list[tuple[int, int]]:
    return [(i, j) for i in range(size) for j in range(i, size)]


def _packed(matrix: Expression) -> Expression:
    """Return the upper triangle, row by row; symmetric by taking both halves."""
    size = matrix.shape[0]
    return ca.SX(ca.vertcat(*[(matrix[i, j] + matrix[j, i]) / 2.0 for i, j in _pairs(size)]))


def _unpacked(packed: Expression, size: int) -> Expression:
    matrix = ca.SX(size, size)
    for place, (i, j) in enumerate(_pairs(size)):
        matrix[i, j] = packed[place]
        matrix[j, i] = packed[place]
    return matrix
