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

from ....model import FlatModel
from .breakpoints import FineEntries, linearly
from .plant import AngleScheduledPlant
from .table import NOTHING, ColumnPlace, Compact, Draft, Entry, TableTorqueError

Array = NDArray[np.float64]

SPAN = 2.0
"""Length of a motion in s."""
FEWEST = 1000
"""Samples of a motion, however slow the observer is sampled."""
SWINGS = ((0.5, 0.0, 1.0), (3.0, 0.0, 0.8), (10.0, 0.0, 0.1), (3.0, 0.5, 0.4), (2.0, -0.6, 0.4))
"""Frequency in Hz; middle and amplitude as shares of half the range."""
HELD = ((0.0, 0.45), (0.03, -0.15), (0.9, -0.9), (-0.01, 0.6), (0.005, 0.0))
"""Angles as shares of half the range, between which a motion runs and at which it rests."""
CHUNK = 250
"""Samples that one call computes."""


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
        self.fine = fine
        separate = _separate(fine)
        observer = draft.write(separate)
        self._model = observer.model
        self.deciding = _deciding(self._model, separate.columns)
        self._columns = [separate.columns.index(entry) for entry in self.deciding]
        self._motions = _motions(draft.plant, float(self._model.sample_time or 1.0), fine)
        begin = [self._model.with_values(observer.start(float(a))) for a in self._motions.angles[0]]
        self._start = np.array([each.start(each.states) for each in begin]).T
        self._step = self._stepped()
        values = np.array([entry.values for entry in self.deciding]).reshape(-1, len(fine.angles))
        self._exactly = linearly(fine.angles, values.T, self._seen)
        self._estimate = self._run(self._exactly)

    @property
    def full_scale(self) -> float:
        """Largest exact estimate over the motions."""
        return float(np.max(np.abs(self._estimate)))

    def error(self, table: Compact, *, only: str | None = None) -> TableTorqueError:
        """Return the torque error that a table causes.

        Parameters
        ----------
        table
            Of the same entries.
        only
            Sum whose entries are read from it while the others are exact; all by default.
        """
        columns = linearly(table.angles, table.values, self._seen)
        read = self._exactly.copy()
        for k, entry in enumerate(self.deciding):
            if only in (None, entry.row):
                place = table.places[entry.key]
                read[k] = place.factor * (1.0 if place.column is None else columns[place.column])
        off = self._run(read) - self._estimate
        if not np.all(np.isfinite(off)):
            return TableTorqueError(np.inf, np.inf, self.full_scale)
        return TableTorqueError(float(np.max(np.abs(off))), float(np.sqrt(np.mean(off**2))), self.full_scale)

    @cached_property
    def _seen(self) -> Array:
        return self._motions.angles.ravel()

    @cached_property
    def _inputs(self) -> Array:
        angles, inputs = self._motions.angles, self._motions.inputs
        return np.concatenate([angles[:, :, None], inputs], axis=2).reshape(angles.size, -1).T

    def _stepped(self) -> ca.Function:
        many, s = self._motions.angles.shape[1], self._model.symbols()
        step = ca.Function(
            "step", [s.state, ca.vertcat(s.input, s.table)],
            [ca.densify(s.derivative), ca.densify(s.output[0])],
        )  # fmt: skip
        return step.map(many).mapaccum("samples", CHUNK, {"base": 10})

    def _run(self, read: Array) -> Array:
        """Return the estimates with these entries, shape (N · motions,)."""
        many = self._motions.angles.shape[1]
        looked_up = np.zeros((self._model.symbols().table.numel(), read.shape[1]))
        looked_up[self._columns] = read
        given = np.vstack([self._inputs, looked_up])
        state, shown = self._start, []
        for first in range(0, given.shape[1], CHUNK * many):
            course, output = self._step(state, given[:, first : first + CHUNK * many])
            state = np.array(course[:, -many:])
            shown.append(np.array(output))
        torque: Array = np.concatenate(shown, axis=1)[0]
        return torque


def _deciding(model: FlatModel, columns: tuple[Entry, ...]) -> tuple[Entry, ...]:
    """Return the entries that can change the estimate, now or later."""
    s = model.symbols()
    estimate, states = s.output[0], model.states
    into = np.array(ca.DM(ca.jacobian_sparsity(s.derivative, s.state))).astype(bool)
    needed = np.array(ca.DM(ca.jacobian_sparsity(estimate, s.state))).astype(bool).ravel()
    for _ in states:
        needed = needed | into[needed].any(axis=0)
    rows = [s.derivative[int(i)] for i in np.flatnonzero(needed)]
    used = set(ca.jacobian_sparsity(ca.vertcat(estimate, *rows), s.table).get_triplet()[1])
    return tuple(column for k, column in enumerate(columns) if k in used)


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
    time, low, high = sample_time * np.arange(float(count)), float(fine.angles[0]), float(fine.angles[-1])
    end = float(time[-1])
    shares = [m + a * np.sin(2.0 * np.pi * f * time) for f, m, a in SWINGS]
    draw = np.random.default_rng(1)
    waves = [np.sin(2.0 * np.pi * (f * time + draw.uniform())) / f**0.5 for f in (0.7, 1.9, 4.3, 7.1, 11.3)]
    mixed = np.sum(waves, axis=0)
    shares.append(mixed / np.max(np.abs(mixed)))
    for held in zip(*HELD, strict=True):
        marks: Array = np.linspace(0.0, end, 2 * len(held)).astype(np.float64)
        shares.append(_smooth(time, marks, np.repeat(np.array(held, dtype=np.float64), 2)))
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
