"""What a table costs: the observer with exact functions of the angle beside the one that reads the table.

Both watch the same motions over the whole range, with the currents that would cause them, and the largest and
the root mean square difference of their torque estimates are taken. The observer with the table lives with
its own errors: what a wrong entry does to a state is carried on from sample to sample.
"""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property

import casadi as ca
import numpy as np
from numpy.typing import NDArray

from .breakpoints import FineEntries, read_from
from .plant import AngleScheduledPlant
from .table import NOTHING, ColumnPlace, Compact, Draft, Entry, TableTorqueError

Array = NDArray[np.float64]

SPAN = 2.0
"""Length of a motion in s."""
FEWEST = 1000
"""Samples of a motion, however slow the observer is sampled."""
SWINGS = (
    (0.5, 0.0, 1.0), (2.0, 0.0, 1.0), (5.0, 0.0, 0.5), (10.0, 0.0, 0.1),
    (3.0, 0.4, 0.2), (3.0, -0.4, 0.2), (1.0, 0.7, 0.3), (1.0, -0.7, 0.3),
)  # fmt: skip
"""Frequency in Hz; middle and amplitude as shares of half the range."""
HELD = ((0.0, 0.45), (0.03, -0.15), (0.9, -0.9), (-0.01, 0.6), (0.005, 0.0))
"""Angles as shares of half the range, between which a motion runs and at which it rests."""
CHUNK = 250


@dataclass(frozen=True, eq=False)
class _Motions:
    """Angles (N, motions) and inputs (N, motions, inputs) at the samples."""

    angles: Array
    inputs: Array


class TableTrial:
    """Compares tables with the exact functions of the angle, on the same motions.

    Parameters
    ----------
    draft
        Plant, and how an observer is written for a table.
    fine
        The exact entries.
    """

    def __init__(self, draft: Draft, fine: FineEntries) -> None:
        self.draft, self.fine = draft, fine
        self._table = _separate(fine)
        self._observer = draft.write(self._table)
        self._rows = [fine.entries.index(column) for column in self._table.columns]
        self._motions = _motions(draft.plant, float(self._observer.model.sample_time or 1.0), fine)
        self._step = self._stepped()
        self._exact = self._run(self._given(self.fine.at(self._seen)))

    @property
    def full_scale(self) -> float:
        """Largest exact estimate over the motions."""
        return float(np.max(np.abs(self._exact)))

    def error(self, table: Compact) -> TableTorqueError:
        """Return the torque error that a table causes.

        Parameters
        ----------
        table
            Of the same entries.
        """
        read = read_from(table.angles, table.values, dict(table.places), self.fine, self._seen)
        return self.error_of(read)

    def error_of(self, read: Array) -> TableTorqueError:
        """Return the torque error with other numbers in the place of the entries.

        Parameters
        ----------
        read
            What is read of each entry at the angles of the motions, shape (entries, angles).
        """
        off = self._run(self._given(read)) - self._exact
        if not np.all(np.isfinite(off)):
            return TableTorqueError(np.inf, np.inf, self.full_scale)
        return TableTorqueError(float(np.max(np.abs(off))), float(np.sqrt(np.mean(off**2))), self.full_scale)

    @property
    def angles(self) -> Array:
        """Angles of all motions one after another, at which :meth:`error_of` takes its entries."""
        return self._seen

    @cached_property
    def _seen(self) -> Array:
        return self._motions.angles.ravel()

    def _given(self, read: Array) -> Array:
        """Return inputs and looked-up numbers of all samples, shape (inputs + entries, N · motions)."""
        angles, inputs = self._motions.angles, self._motions.inputs
        given = np.concatenate([angles[:, :, None], inputs], axis=2)
        return np.vstack([given.reshape(angles.size, -1).T, read[self._rows]])

    def _stepped(self) -> ca.Function:
        model, many = self._observer.model, self._motions.angles.shape[1]
        s = model.symbols()
        step = ca.Function(
            "step", [s.state, ca.vertcat(s.input, s.table)],
            [ca.densify(s.derivative), ca.densify(s.output[0])],
        )  # fmt: skip
        return step.map(many).mapaccum("samples", CHUNK, {"base": 10})

    def _run(self, given: Array) -> Array:
        """Return the estimates, shape (N · motions,)."""
        model, many = self._observer.model, self._motions.angles.shape[1]
        begin = [model.with_values(self._observer.start(float(a))) for a in self._motions.angles[0]]
        state = np.array([each.start(each.states) for each in begin]).T
        shown = []
        for first in range(0, given.shape[1], CHUNK * many):
            course, output = self._step(state, given[:, first : first + CHUNK * many])
            state = np.array(course[:, -many:])
            shown.append(np.array(output))
        return np.concatenate(shown, axis=1)[0]


def _separate(fine: FineEntries) -> Compact:
    """Return a table in which every entry that changes at all has a column of its own."""
    columns: list[Entry] = []
    places: dict[str, ColumnPlace] = {}
    for entry in fine.entries:
        low, high = float(np.min(entry.values)), float(np.max(entry.values))
        if max(-low, high) * entry.weight <= NOTHING:
            places[entry.key] = ColumnPlace(0.0)
        elif (high - low) * entry.weight <= NOTHING:
            places[entry.key] = ColumnPlace((low + high) / 2.0)
        else:
            places[entry.key] = ColumnPlace(1.0, len(columns))
            columns.append(entry)
    values = np.array([column.values for column in columns]).reshape(len(columns), len(fine.angles)).T
    return Compact(fine.angles, tuple(columns), values, places, {}, 0.0, uniform=False)


def _motions(plant: AngleScheduledPlant, sample_time: float, fine: FineEntries) -> _Motions:
    """Return swings over the whole range, runs between rests, and a mixture of frequencies."""
    count = CHUNK * -(-max(FEWEST, round(SPAN / sample_time)) // CHUNK)
    time, low, high = sample_time * np.arange(count), float(fine.angles[0]), float(fine.angles[-1])
    end = float(time[-1])
    shares = [m + a * np.sin(2.0 * np.pi * f * time) for f, m, a in SWINGS]
    draw = np.random.default_rng(1)
    waves = [np.sin(2.0 * np.pi * (f * time + draw.uniform())) / f**0.5 for f in (0.7, 1.9, 4.3, 7.1, 11.3)]
    mixed = np.sum(waves, axis=0)
    shares.append(mixed / np.max(np.abs(mixed)))
    for held in zip(*HELD, strict=True):
        marks = np.linspace(0.0, end, 2 * len(held))
        shares.append(_smooth(time, marks, np.repeat(held, 2)))
    angles = (low + high) / 2.0 + (high - low) / 2.0 * np.array(shares).T
    speed = np.gradient(angles, sample_time, axis=0)
    acceleration = np.gradient(speed, sample_time, axis=0)
    return _Motions(angles, _inputs(plant, angles, speed, acceleration))


def _smooth(time: Array, marks: Array, values: Array) -> Array:
    """Return a course through values at some times that is at rest at each of them."""
    cell = np.clip(np.searchsorted(marks, time, side="right") - 1, 0, len(marks) - 2)
    share = (time - marks[cell]) / (marks[cell + 1] - marks[cell])
    course: Array = values[cell] + (values[cell + 1] - values[cell]) * share**2 * (3.0 - 2.0 * share)
    return course


def _inputs(plant: AngleScheduledPlant, angles: Array, speed: Array, acceleration: Array) -> Array:
    """Return about the inputs that cause a motion: exact but for what the inner states relax."""
    n, (_, place) = len(plant.inputs), plant.moving
    start = np.array([v.start for v in plant.inputs])
    given = np.tile(start, (*angles.shape, 1))
    if not n or place not in plant.rows:
        return given
    every = np.linspace(float(np.min(angles)), float(np.max(angles)), 257)
    c, rest = plant.at(every), plant.rest(every)
    at_rest = np.einsum("aj,aj->a", c.a[:, place], rest - c.shift) + c.drive[:, place]
    damping = float(np.median(c.a[:, place, place]))
    wanted = acceleration - np.interp(angles, every, at_rest) - damping * speed
    if plant.friction is not None:
        wanted -= np.array(plant.friction(speed.reshape(1, -1))).reshape(speed.shape)
    u = ca.SX.sym("u", n)
    slope = ca.Function("slope", [u], [ca.jacobian(ca.SX(plant.driven(u)), u)])
    row = np.array(slope(start))[plant.rows.index(place)]
    size = float(row @ row)
    if size > 0.0:
        given = given + wanted[:, :, None] * row / size
    low, high = np.array([v.minimum for v in plant.inputs]), np.array([v.maximum for v in plant.inputs])
    return np.asarray(np.clip(given, low, high))
