"""Which further sensor, or which finer one, would help the estimate of the torque most.

For each candidate the steady-state Kalman deviation of the torque is computed at many angles, once with every
number exactly known and once over the spread of the declared numbers. Over the spread the numbers are slow
states: each wanders within its declared spread over ``wander`` seconds, so an estimator may learn of them
what the sensors show, and no more. It is the best that any linear estimator can reach at that angle, so it
ranks sensors; it is not the error of a given observer.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, field
from typing import NamedTuple

import casadi as ca
import numpy as np

from ...foundation.arrays import Array
from ...foundation.errors import ArrangementError, ValueRangeError
from ...foundation.quantity import typeset_unit
from ...model import FlatModel
from ...model.roles import measured_motion, spring_torque
from ...model.transform import with_outputs
from .kalman import NoiseAssumptions, best_covariances, declared_deviation, deviation_of
from .rest import evaluate_rows
from .rest_points import RestPoints, limit_at_zero_speed, rest_points

Sizes = Callable[[str], float]


@dataclass(frozen=True)
class SensorCandidate:
    """A change of what is measured.

    Parameters
    ----------
    name
        Shown in the table.
    measurement
        Standard deviation of a sample of each further sensor, by the name of the state, signal or output
        that it shows, in SI; ``"current"`` stands for the current of the drive.
    finer
        Share of its present count that the sensor of the angle then has.
    faster
        Share of the present sample time.

    Raises
    ------
    ValueRangeError
        If a noise or a share is not positive.
    """

    name: str
    measurement: Mapping[str, float] = field(default_factory=dict)
    finer: float = 1.0
    faster: float = 1.0

    def __post_init__(self) -> None:
        if not (self.finer > 0.0 and self.faster > 0.0 and all(v > 0.0 for v in self.measurement.values())):
            raise ValueRangeError(f"candidate '{self.name}'", "noise and shares must be positive")


@dataclass(frozen=True)
class SensorGain:
    """What a candidate makes of the estimate: standard deviations of the torque, in its unit."""

    candidate: SensorCandidate  # what is changed
    # exact: median and largest over the angles, every number exactly known; infinite without a steady state
    exact: tuple[float, float]
    spread: tuple[float, float]  # the same over the spread of the declared numbers


@dataclass(frozen=True, eq=False)
class SensorRanking:
    """Candidates in order of what they leave over the spread, best first.

    Parameters
    ----------
    present
        What is reached with the angle alone.
    gains
        Of the candidates, in order of the median over the spread.
    condition
        Under which assumptions.
    left_out
        Candidates that make no sense for this machine, with the reason.
    unit
        Of the torque.
    """

    present: SensorGain
    gains: tuple[SensorGain, ...]
    condition: str
    left_out: tuple[str, ...]
    unit: str

    def rows(self) -> list[list[str]]:
        """Return the table as text: name, gain over the spread, four deviations."""
        factor = 1e3 if self.unit == "N*m" else 1.0
        rows = []
        for gain in (*self.gains, self.present):
            share = _share(self.present.spread[0], gain.spread[0])
            numbers = [f"{factor * value:.3g}" for value in (*gain.spread, *gain.exact)]
            rows.append([gain.candidate.name, share, *numbers])
        return rows

    @property
    def headings(self) -> list[str]:
        """Headings of :meth:`rows`."""
        unit = "mN·m" if self.unit == "N*m" else typeset_unit(self.unit)
        return [
            "sensor", "times better",
            f"median, spread [{unit}]", f"worst, spread [{unit}]",
            f"median, exact [{unit}]", f"worst, exact [{unit}]",
        ]  # fmt: skip

    def __str__(self) -> str:
        table = [self.headings, *self.rows()]
        widths = [max(len(row[i]) for row in table) for i in range(len(table[0]))]
        lines = [
            "  ".join(cell.ljust(w) for cell, w in zip(row, widths, strict=True)).rstrip() for row in table
        ]
        return "\n".join([*lines, self.condition, *(f"left out: {each}" for each in self.left_out)])


@dataclass(frozen=True)
class RankingAssumptions:
    """What is taken of a machine of which nothing more is known; shares are of its own sizes."""

    noise: NoiseAssumptions = field(default_factory=NoiseAssumptions)
    wander: float = 100.0  # time in s over which the declared numbers may wander within their spread
    # current_error: standard deviation of the error of the drive's current, as a share of the largest current
    # that holds the spring
    current_error: float = 0.02
    current_time: float = 0.01  # time in s over which that error changes
    # torque_sensor, current_sensor, tachometer: noise of such a sensor, as a share of the largest torque, of
    # the largest holding current, of the speed of a swing over the whole range
    torque_sensor: float = 0.005
    current_sensor: float = 0.005
    tachometer: float = 0.01


CURRENT = "current"
"""Name by which a candidate measures the current of the drive."""


def rank_sensors(
    model: FlatModel,
    *,
    angles: Sequence[float] | Array,
    angle: str | None = None,
    estimate: str | None = None,
    candidates: Sequence[SensorCandidate] | None = None,
    assumptions: RankingAssumptions | None = None,
) -> SensorRanking:
    """Rank further sensors by the deviation of the torque estimate that they leave.

    Parameters
    ----------
    model
        Continuous; the spreads of its parameters count, and what its sensor of the angle declares.
    angles
        Shape (N,), in rad, at which the deviation is taken.
    angle
        State that is measured; by default the motion of the driven body.
    estimate
        What is wanted; by default the torque of the series spring.
    candidates
        What is compared; by default a torque sensor, a current sensor, a tachometer, an encoder of the load,
        finer counts, faster sampling, and the other sensors that the deck declares.
    assumptions
        Noise and times that no deck declares.

    Returns
    -------
    SensorRanking
        Prints as a table with its condition.

    Raises
    ------
    UnknownNameError
        If something that is to be measured does not exist.
    ValueRangeError
        If no sensor of the angle declares its resolution, or an angle is not finite.
    ConvergenceError
        If the model does not come to rest.
    ArrangementError
        If the structure leaves open what is measured or wanted, or a current is measured without a motor.
    """
    given = assumptions or RankingAssumptions()
    angle, estimate = measured_motion(model, angle), spring_torque(model, estimate)
    at = np.asarray(angles, dtype=float)
    first = rest_points(with_outputs(model, [angle, estimate]), at, angle=angle)
    left_out: tuple[str, ...] = ()
    if candidates is None:
        candidates, left_out = _usual(first, estimate, given)
    signals = [name for each in candidates for name in each.measurement if name != CURRENT]
    points = rest_points(
        with_outputs(model, list(dict.fromkeys([angle, estimate, *signals]))), at, angle=angle
    )
    bench = _Bench(points, estimate, given, declared_deviation(model, angle))
    present = bench.gain(SensorCandidate("present sensors"))
    gains = sorted((bench.gain(each) for each in candidates), key=lambda gain: (gain.spread, gain.exact))
    condition = (
        f"{given.noise}; current of the drive known to {given.current_error:.2g} of the largest holding "
        f"current within {1e3 * given.current_time:g} ms; declared numbers wander within their spread over "
        f"{given.wander:g} s; counts as white noise; sliding forward, {len(at)} angles"
    )
    unit = model.variable(estimate).unit
    return SensorRanking(present, tuple(gains), condition, left_out, unit)


# --- inside ---------------------------------------------------------------------------------------


class _Plant(NamedTuple):
    """Slopes, densities of noise and rows of one augmented plant, shapes (N, m, m), (N, m, m), (N, r, m)."""

    a: Array
    density: Array
    rows: Array


class _Bench:
    """The machine at all angles, with the error of the current and with or without its numbers as states."""

    def __init__(
        self, points: RestPoints, estimate: str, given: RankingAssumptions, resolution: float
    ) -> None:
        self.points, self.given, self.resolution = points, given, resolution
        self.estimate = points.output_names.index(estimate)
        self.drive, self.hold = holding_current(points)
        self.exact, self.spread = (self._plant(each) for each in (False, True))

    def gain(self, candidate: SensorCandidate) -> SensorGain:
        """Return what a candidate leaves."""
        deviations = []
        for plant in (self.exact, self.spread):
            names = self.points.output_names
            measured = {self.points.angle: candidate.finer * self.resolution, **candidate.measurement}
            rows = [
                self._current_row(plant) if n == CURRENT else plant.rows[:, names.index(n)] for n in measured
            ]
            step = candidate.faster * self.given.noise.sample_time
            spread = np.array(list(measured.values()))
            covariance, _ = best_covariances(plant.a, plant.density, (np.stack(rows, axis=1), spread), step)
            deviation = deviation_of(plant.rows[:, self.estimate], covariance)
            deviations.append((float(np.median(deviation)), float(np.max(deviation))))
        return SensorGain(candidate, deviations[0], deviations[1])

    def _plant(self, over_spread: bool) -> _Plant:
        points, given, n = self.points, self.given, len(self.points.state_names)
        count = len(points.at)
        offsets = (
            spread_offsets(points, self.hold) if over_spread else np.zeros((count, n + points.c.shape[1], 0))
        )
        m = n + 1 + offsets.shape[-1]
        a, density = np.zeros((count, m, m)), np.zeros((count, m, m))
        rows = np.zeros((count, points.c.shape[1], m))
        a[:, :n, :n], rows[:, :, :n] = points.moving.a, points.moving.c
        a[:, n, n] = -1.0 / given.current_time
        if self.drive is not None:
            error = given.current_error * float(np.max(np.abs(self.hold)))
            a[:, :n, n], rows[:, :, n] = points.moving.b[:, :, self.drive], points.d[:, :, self.drive]
            density[:, n, n] = 2.0 * error**2 / given.current_time
        a[:, :n, n + 1 :], rows[:, :, n + 1 :] = offsets[:, :n], offsets[:, n:]
        slow = np.arange(n + 1, m)
        a[:, slow, slow], density[:, slow, slow] = -1.0 / given.wander, 2.0 / given.wander
        process = given.noise.process(points)
        for i, name in enumerate(points.state_names):
            density[:, i, i] = process.get(name, 0.0) ** 2
        return _Plant(a, density, rows)

    def _current_row(self, plant: _Plant) -> Array:
        if self.drive is None:
            raise ArrangementError(
                f"model '{self.points.model.name}'", "has no motor whose current could be measured",
                next_step="leave out candidates that measure the current",
            )  # fmt: skip
        row = np.zeros((len(plant.a), plant.a.shape[-1]))
        row[:, len(self.points.state_names)] = 1.0
        return row


def holding_current(points: RestPoints) -> tuple[int | None, Array]:
    """Return the place of the drive's input and what it has to be to hold the spring at each angle.

    Result: place among the inputs, ``None`` where nothing drives the body; and shape (N,).
    """
    body = next((b for b in points.model.bodies if b.motion == points.angle), None)
    inputs = [v.name for v in points.model.inputs]
    place = next((inputs.index(name) for name in (body.drives if body else ()) if name in inputs), None)
    if place is None:
        return None, np.zeros(len(points.at))
    rate = points.state_names.index(points.rate)
    effect = points.moving.b[:, rate, place]
    if not np.all(effect):
        return None, np.zeros(len(points.at))
    return place, -points.moving.rates[:, rate] / effect


def spread_offsets(points: RestPoints, hold: Array) -> Array:
    """Return what one standard deviation of the numbers does to rates and outputs, in independent directions.

    The items of one quantity vary together, as it has one spread. Of all numbers only what they do to rates
    and outputs counts, so their joint covariance is written in as few directions as it has.

    Result: shape (N, n + r, k).
    """
    model = points.model
    groups: dict[str, dict[int, float]] = {}
    for i, v in enumerate(model.parameters):
        if v.uncertain:
            groups.setdefault(v.name.partition("[")[0], {})[i] = v.spread.standard_error(v.start)
    s = model.symbols()
    sizes = np.zeros((len(model.parameters), len(groups)))
    for column, group in enumerate(groups.values()):
        sizes[list(group), column] = list(group.values())
    result = ca.vertcat(s.derivative, s.output)
    slopes = ca.densify(ca.mtimes(ca.jacobian(result, s.parameter), ca.DM(sizes)))
    function = ca.Function("offsets", [s.time, s.state, s.input, s.parameter], [slopes])
    inputs = np.tile(model.start(model.inputs), (len(points.at), 1))
    place, _ = holding_current(points)
    if place is not None:
        inputs[:, place] += hold
    rate = points.state_names.index(points.rate)

    def at_speed(speed: float) -> Array:
        moved = points.states.copy()
        moved[:, rate] = speed
        rows = evaluate_rows(function, moved, inputs, model.start(model.parameters))[0]
        return rows.reshape(len(points.at), result.shape[0], len(groups))

    offsets = limit_at_zero_speed(at_speed, points.typical_speed)
    offsets = np.where(np.isfinite(offsets), offsets, 0.0)
    # As many directions as rows are enough: L·Lᵀ is the same.
    left, size, _ = np.linalg.svd(offsets, full_matrices=False)
    kept = int(np.max(np.sum(size > 1e-12 * np.max(size, initial=0.0), axis=-1), initial=0))
    factor: Array = left[:, :, :kept] * size[:, None, :kept]
    return factor


def _usual(
    points: RestPoints, estimate: str, given: RankingAssumptions
) -> tuple[list[SensorCandidate], tuple[str, ...]]:
    left_out: list[str] = []
    torque = float(np.max(np.abs(points.outputs[:, points.output_names.index(estimate)])))
    drive, hold = holding_current(points)
    current = float(np.max(np.abs(hold)))
    candidates = [
        SensorCandidate("encoder with half the count", finer=0.5),
        SensorCandidate("encoder with a quarter of the count", finer=0.25),
        SensorCandidate("sampling twice as fast", faster=0.5),
        SensorCandidate("sampling four times as fast", faster=0.25),
        SensorCandidate("tachometer", {points.rate: given.tachometer * points.typical_speed}),
    ]
    if torque > 0.0:
        candidates.append(SensorCandidate("torque sensor", {estimate: given.torque_sensor * torque}))
    else:
        left_out.append("torque sensor: the spring has no torque at these angles")
    if drive is not None and current > 0.0:
        candidates.append(SensorCandidate("current sensor", {CURRENT: given.current_sensor * current}))
    else:
        left_out.append("current sensor: nothing drives the measured body by a current here")
    model = points.model
    others = [b for b in model.bodies if not b.prescribed and b.motion != points.angle]
    if not others:
        left_out.append("encoder of the load: no other body moves freely, its angle is known")
    resolution = declared_deviation(model, points.angle)
    of_the_load = [SensorCandidate(f"encoder of {b.name}", {b.motion: resolution}) for b in others]
    candidates += of_the_load + _declared(points, estimate)
    return candidates, tuple(left_out)


def _declared(points: RestPoints, estimate: str) -> list[SensorCandidate]:
    """Return the other sensors that the deck declares, of what the equations know."""
    model = points.model
    known = {v.name for v in model.states + model.signals}
    candidates = []
    for reading in model.readings:
        if reading.measured == points.angle or reading.measured not in known:
            continue
        if any(model.values.get(f"{s}.{n}", 0.0) for s in reading.sensors for n in ("noise", "quantum")):
            deviation = declared_deviation(model, reading.measured)
            name = f"{reading.sensors[0]}, as declared, of {reading.measured}"
            candidates.append(SensorCandidate(name, {reading.measured: deviation}))
    return candidates


def _share(present: float, now: float) -> str:
    if not np.isfinite(now):
        return "no steady state"
    return f"{present / now:.3g}" if now > 0.0 else "exact"
