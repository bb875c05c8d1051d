"""A task: joint angle and torque over one period of a motion, as a smooth periodic curve."""

from __future__ import annotations

from dataclasses import dataclass, replace
from pathlib import Path

import numpy as np
from numpy.typing import ArrayLike

from ...foundation.arrays import Array
from ...foundation.errors import MeasurementError, ValueRangeError, unknown_name
from ...foundation.locations import folder
from ...foundation.quantity import Quantity, same_dimension
from .numbers import in_si
from .target_files import read_columns

_WORST_MISFIT = 0.05
"""Largest misfit of a record that passes as periodic, rms over its range; noise and rounding are below."""
_WALKING = "bovi2011"
_LEAST_SHARE = 0.01


@dataclass(frozen=True, eq=False)
class TaskCycle:
    """A task at equally spaced times of one period; arrays of shape (n,), with exact derivatives."""

    time: Array  # in s, from zero; the period's end is left out, it is the start of the next one
    # angle, speed, acceleration: of the joint, in rad, rad/s and rad/s²
    angle: Array
    speed: Array
    acceleration: Array
    # torque, torque_rate, torque_acceleration: on the joint, in N·m, N·m/s and N·m/s²
    torque: Array
    torque_rate: Array
    torque_acceleration: Array
    period: float  # in s

    def over_period(self, values: Array) -> float:
        """Return the integral over the period; exact to rounding for smooth periodic values."""
        return float(np.mean(values)) * self.period


@dataclass(frozen=True, eq=False, kw_only=True)
class Task:
    """Angle and torque of a joint over one period: what an actuator has to do.

    The torque is that of the actuator on the joint, positive along the angle, so torque times speed is the
    power that goes into the joint. A Fourier series through the record by least squares makes it periodic
    and gives the derivatives.

    Parameters
    ----------
    time
        Ascending, in s, shape (n,).
    angle
        In rad.
    torque
        In N·m.
    period
        In s; ``None`` where the last row is the same instant of the cycle as the first.
    harmonics
        Largest number of harmonics of the series; fewer where the record has too few rows for them.

    Raises
    ------
    MeasurementError
        If the record has too few rows, time does not ascend, a number is missing, or the record is not
        periodic: the series leaves more than 5 % of the range (rms).

    Examples
    --------
    >>> import numpy as np
    >>> time = np.linspace(0.0, 1.0, 51)
    >>> task = Task(time=time, angle=0.3 * np.sin(2 * np.pi * time), torque=5.0 * np.cos(2 * np.pi * time))
    >>> round(task.work, 3), task.period
    (4.712, 1.0)
    """

    time: ArrayLike
    angle: ArrayLike
    torque: ArrayLike
    period: float | None = None
    harmonics: int = 12

    def __post_init__(self) -> None:
        for name in ("time", "angle", "torque"):
            object.__setattr__(self, name, np.array(getattr(self, name), dtype=float))
        time, angle, torque = self._columns
        if not (time.ndim == 1 and time.shape == angle.shape == torque.shape and len(time) >= 8):
            raise MeasurementError(
                f"task of {time.size} times, {angle.size} angles and {torque.size} torques",
                "needs at least eight rows, one angle and one torque for each time",
            )
        for name, column in (("time", time), ("angle", angle), ("torque", torque)):
            if not np.all(np.isfinite(column)):
                row = int(np.argmin(np.isfinite(column))) + 1
                raise MeasurementError(f"task, row {row}, column '{name}'", "is no finite number")
        if np.any(np.diff(time) <= 0.0):
            row = int(np.argmax(np.diff(time) <= 0.0)) + 2
            raise MeasurementError(
                f"task, row {row}, column 'time'",
                "time must ascend",
                next_step="give one period of the motion",
            )
        span = float(time[-1] - time[0])
        period = span if self.period is None else float(self.period)
        if not (period > 0.0 and span <= period * (1.0 + 1e-9)):
            raise MeasurementError(
                f"task with a period of {period:g} s", f"its rows cover {span:g} s",
                next_step="give one period; leave period out if the last row repeats the first",
            )  # fmt: skip
        object.__setattr__(self, "period", period)
        object.__setattr__(self, "harmonics", max(1, min(int(self.harmonics), (len(time) - 2) // 2)))
        for name, column in (("angle", angle), ("torque", torque)):
            left = self._misfit(column)
            if left > _WORST_MISFIT:
                raise MeasurementError(
                    f"task, column '{name}'",
                    f"is not periodic: {self.harmonics} harmonics leave {100 * left:.0f} % of its range",
                    next_step="cut the record to one period, or allow more harmonics",
                )

    @property
    def _columns(self) -> tuple[Array, Array, Array]:
        return np.asarray(self.time), np.asarray(self.angle), np.asarray(self.torque)

    @property
    def _period(self) -> float:
        assert self.period is not None
        return self.period

    def _basis(self, time: Array, derivative: int = 0) -> Array:
        """Return the columns 1, cos, sin, … of the series or of a derivative of it, shape (n, 1 + 2·H)."""
        order = np.arange(1, self.harmonics + 1)
        turns = 2.0 * np.pi * order / self._period
        phase = np.outer(time, turns) + derivative * np.pi / 2.0
        scale = turns**derivative
        first = np.full((len(time), 1), 1.0 if derivative == 0 else 0.0)
        return np.hstack([first, scale * np.cos(phase), scale * np.sin(phase)], dtype=np.float64)

    def _coefficients(self, values: Array) -> Array:
        time = self._columns[0]
        return np.asarray(np.linalg.lstsq(self._basis(time - time[0]), values, rcond=None)[0], dtype=float)

    def _misfit(self, values: Array) -> float:
        time = self._columns[0]
        left = values - self._basis(time - time[0]) @ self._coefficients(values)
        return float(np.sqrt(np.mean(left**2)) / max(np.ptp(values), 1e-300))

    @property
    def misfit(self) -> tuple[float, float]:
        """What the series leaves of angle and torque: rms as a share of the range."""
        return self._misfit(self._columns[1]), self._misfit(self._columns[2])

    def sampled(self, count: int = 1200) -> TaskCycle:
        """Return the smooth periodic motion and torque at equally spaced times.

        Parameters
        ----------
        count
            Number of times in a period; at least four for each harmonic, or quadrature is not exact.
        """
        count = max(count, 8 * self.harmonics)
        time = self._period * np.arange(count) / count
        basis = [self._basis(time, derivative) for derivative in range(3)]
        angle, torque = (self._coefficients(column) for column in self._columns[1:])
        (a, b, c), (d, e, f) = ([each @ solution for each in basis] for solution in (angle, torque))
        return TaskCycle(time, a, b, c, d, e, f, self._period)

    @property
    def work(self) -> float:
        """Net work of the actuator on the joint in a period, in J."""
        cycle = self.sampled()
        return cycle.over_period(cycle.torque * cycle.speed)

    @property
    def peak_power(self) -> float:
        """Largest power into or out of the joint in W."""
        cycle = self.sampled()
        return float(np.max(np.abs(cycle.torque * cycle.speed)))

    def scaled(self, share: float) -> Task:
        """Return the same motion with a share of the torque: what an assisting actuator carries of it.

        Parameters
        ----------
        share
            Positive.

        Raises
        ------
        ValueRangeError
            If the share is not positive.
        """
        if not 0.0 < share < float("inf"):
            raise ValueRangeError(f"share = {share:g}", "must be positive")
        return replace(self, torque=share * self._columns[2])


@dataclass(frozen=True, eq=False)
class MixedTask:
    """Several tasks of one joint, each for its share of the time: what an actuator has to do over a day.

    Energies are means over one second, so that they are powers in W.

    Parameters
    ----------
    shares
        Each task with its share; the shares are scaled so that they add up to one.

    Raises
    ------
    ValueRangeError
        If there is no task, or a share is less than a hundredth of all.

    Examples
    --------
    >>> ankle, knee = (walking_task(joint, body_mass=75.0).scaled(0.05) for joint in ("ankle", "knee"))
    >>> mixed = MixedTask(((ankle, 3.0), (knee, 1.0))).sampled()
    >>> round(float(mixed.torque.max() / ankle.sampled().torque.max()), 3)
    1.0
    """

    shares: tuple[tuple[Task, float], ...]

    def __post_init__(self) -> None:
        whole = sum(share for _, share in self.shares)
        for number, (_, share) in enumerate(self.shares, start=1):
            if not _LEAST_SHARE * whole <= share <= whole:
                raise ValueRangeError(
                    f"share {number} of the time = {share:g}", f"must be at least {_LEAST_SHARE:g} of all",
                    next_step="leave the task out",
                )  # fmt: skip
        if not self.shares:
            raise ValueRangeError("mixed task", "holds no task", next_step="give one with its share")

    def sampled(self, count: int = 1200) -> TaskCycle:
        """Return all tasks one after the other, with as many times each as its share is large.

        Parameters
        ----------
        count
            Number of times; more where the smallest share has too few of them for its harmonics.
        """
        whole, most = sum(share for _, share in self.shares), max(t.harmonics for t, _ in self.shares)
        count = max(count, int(np.ceil(8 * most * whole / min(share for _, share in self.shares))))
        cycles = [task.sampled(round(count * share / whole)) for task, share in self.shares]
        names = ("angle", "speed", "acceleration", "torque", "torque_rate", "torque_acceleration")
        columns = {name: np.concatenate([getattr(cycle, name) for cycle in cycles]) for name in names}
        return TaskCycle(time=np.arange(len(columns["angle"])) / len(columns["angle"]), period=1.0, **columns)


def read_task(
    path: Path | str,
    *,
    body_mass: Quantity | float | None = None,
    period: Quantity | float | None = None,
    harmonics: int = 12,
) -> Task:
    """Read a task from a CSV file with the columns ``time``, ``angle`` and ``torque``.

    Parameters
    ----------
    path
        Of the file; the first row has names and units: ``time [s],angle [deg],torque [N*m]``. Torque may be
        in N*m/kg, as in tables of walking.
    body_mass
        In kg, for a torque per body mass.
    period
        In s; ``None`` where the last row is the same instant of the cycle as the first.
    harmonics
        As for :class:`Task`.

    Raises
    ------
    MeasurementError
        If the file cannot be read, a column or cell is missing or wrong, or the record is not periodic.
    UnitError
        If a unit is missing or of another dimension.
    ValueRangeError
        If the torque is per body mass and there is none, or the other way round.
    """
    columns = {"time": ("s",), "angle": ("rad",), "torque": ("N*m", "N*m/kg")}
    table = read_columns(path, columns, least_rows=8)
    for name, (unit, *_) in columns.items():
        if name not in table.values:
            raise MeasurementError(
                table.file, f"has no column '{name}'", next_step=f"name it '{name} [{unit}]'"
            )
    time = table.values["time"]
    if np.any(np.diff(time) <= 0.0):
        raise MeasurementError(
            table.cell(int(np.argmax(np.diff(time) <= 0.0)) + 1, "time"), "time must ascend",
            next_step="give one period of the motion, in the order of time",
        )  # fmt: skip
    known = None if period is None else in_si("period", period, "s", minimum=1e-3, maximum=1e5)
    per_mass = same_dimension(table.units["torque"], "N*m/kg")
    if per_mass == (body_mass is None):
        raise ValueRangeError(
            f"{table.file}, column 'torque' in {table.units['torque']}",
            "needs a body mass" if per_mass else "is not per body mass",
            next_step="give body_mass, for instance quantity(75, 'kg')"
            if per_mass
            else "leave out body_mass",
        )
    mass = 1.0 if body_mass is None else in_si("body_mass", body_mass, "kg", minimum=1.0, maximum=500.0)
    torque = table.values["torque"] * mass
    try:
        return Task(time=time, angle=table.values["angle"], torque=torque, period=known, harmonics=harmonics)
    except MeasurementError as error:
        raise error.at(table.file) from None


def walking_tables() -> dict[str, Path]:
    """Return the files of walking by joint."""
    files = (folder("models") / "gait").glob(f"{_WALKING}_*.csv")
    return {file.stem.partition("_")[2]: file for file in files}


def walking_task(joint: str, *, body_mass: Quantity | float) -> Task:
    """Return one stride of walking at a natural speed, means of 20 healthy adults.

    Extension and plantarflexion are positive. The tables stand in ``models/gait`` with what they are.
    Source: Bovi et al. 2011.

    Parameters
    ----------
    joint
        ``"hip"``, ``"knee"`` or ``"ankle"``.
    body_mass
        In kg.

    Raises
    ------
    UnknownNameError
        If there is no table of that joint.

    Examples
    --------
    >>> round(walking_task("ankle", body_mass=75.0).period, 3)
    1.101
    """
    tables = walking_tables()
    if joint not in tables:
        raise unknown_name("joint", joint, tables)
    return read_task(tables[joint], body_mass=body_mass)
