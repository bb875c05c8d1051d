"""A table as small as a stated error of the estimated torque allows, and no larger than a stated size.

What a table costs is tried: the observer with exact functions of the angle runs beside the one that reads the
table. Both watch the same motions over the whole range, with the currents that would cause them, and the
largest and the root mean square difference of their torque estimates are taken. The observer with the table
lives with its own errors: what a wrong entry does to a state is carried on from sample to sample.
"""

from __future__ import annotations

from dataclasses import dataclass, replace

import casadi as ca
import numpy as np

from ....foundation.arrays import Array
from ....foundation.errors import ConvergenceError, ValueRangeError
from ....foundation.quantity import typeset_unit
from ....model import FlatModel
from .angle_form import AngleScheduledPlant
from .table import (
    NOTHING,
    ColumnPlace,
    Compact,
    Draft,
    Entries,
    Entry,
    FineEntries,
    Grid,
    TableTorqueError,
    check_range,
    linearly,
)

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


class TableTrial:
    """Compares tables with the exact functions of the angle, on the same motions.

    ``draft``: plant, and how an observer is written for a table.
    """

    def __init__(self, draft: Draft, fine: FineEntries) -> None:
        self.fine = fine
        separate = _separate(fine)
        observer = draft.write(separate)
        self._model = observer.model
        self.deciding = _deciding(self._model, separate.columns)
        self._columns = [separate.columns.index(entry) for entry in self.deciding]
        angles, inputs = _motions(draft.plant, float(self._model.sample_time or 1.0), fine)
        self._many, self._seen = angles.shape[1], angles.ravel()
        self._inputs = np.concatenate([angles[:, :, None], inputs], axis=2).reshape(angles.size, -1).T
        begin = [self._model.with_values(observer.start(float(a))) for a in angles[0]]
        self._start = np.array([each.start(each.states) for each in begin]).T
        s = self._model.symbols()
        step = ca.Function(
            "step", [s.state, ca.vertcat(s.input, s.table)],
            [ca.densify(s.derivative), ca.densify(s.output[0])],
        )  # fmt: skip
        self._step = step.map(self._many).mapaccum("samples", CHUNK, {"base": 10})
        values = np.array([entry.values for entry in self.deciding]).reshape(-1, len(fine.angles))
        self._exactly = linearly(fine.angles, values.T, self._seen)
        self._estimate = self._run(self._exactly)

    @property
    def full_scale(self) -> float:
        """Largest exact estimate over the motions."""
        return float(np.max(np.abs(self._estimate)))

    def error(self, table: Compact, *, only: str | None = None) -> TableTorqueError:
        """Return the torque error that a table causes.

        ``only``: sum whose entries are read from it while the others are exact; all by default.
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

    def _run(self, read: Array) -> Array:
        """Return the estimates with these entries, shape (N · motions,)."""
        many = self._many
        looked_up = np.zeros((self._model.equations.size1_in(4), read.shape[1]))
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


def _motions(plant: AngleScheduledPlant, sample_time: float, fine: FineEntries) -> tuple[Array, Array]:
    """Return swings over the whole range, runs between rests, and a mixture of frequencies.

    Angles (N, motions) and inputs (N, motions, inputs) at the samples.
    """
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
    return angles, _inputs(plant, angles, speed, acceleration)


def _smooth(time: Array, marks: Array, values: Array) -> Array:
    """Return a course through values at some times that is at rest at each of them."""
    cell = np.clip(np.searchsorted(marks, time, side="right") - 1, 0, len(marks) - 2)
    share = (time - marks[cell]) / (marks[cell + 1] - marks[cell])
    return values[cell] + (values[cell + 1] - values[cell]) * share**2 * (3.0 - 2.0 * share)


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


TORQUE_SHARE = 2e-4
"""Torque error that a table may cause where none is stated, as a share of the full scale."""
MOST_SHARE = 0.02
"""Torque error up to which a table is made coarser to meet a size where no error is stated."""
RESOLUTION = 0.1e-3
"""Width in rad to which jumps are narrowed down: an eighth of a count of a 13 bit encoder."""
OTHERS = 2e-3
"""Share of its size that any sum of the step may be off, as far as the size allows it."""
PROBE = 1e-2
"""Share of a sum by which all its entries may be off while its effect on the torque is measured."""
STEPS = 6
"""Trials of the search for the largest error of the sums that keeps the budget."""
HALVINGS = 14
"""Of the search for a size."""
SEARCH_BYTES = 20
"""Flash of one halving of the search among breakpoints, on an Arm Cortex-M."""


@dataclass(frozen=True)
class GridByTorqueError(Grid):
    """The smallest table whose effect on the estimated torque keeps a bound, uniform or by breakpoints.

    The effect is measured, not estimated: an observer with the table and one with the exact functions of the
    angle watch the same motions over the whole range, and the largest difference of their torques counts.
    How much the entries of one sum matter is measured in the same way, so that what hardly moves the torque
    is tabulated coarsely. A jump of an entry over the angle becomes a ramp of the width ``resolution``.

    Parameters
    ----------
    lower, upper
        Range in rad; beyond it the ends are held.
    torque_error
        Bound in the unit of the estimate; by default 0.02 % of the largest torque in the range.
    most_bytes
        The table takes at most so much flash; it is made coarser, to an error of ``torque_error``, or of 2 %
        of the largest torque where none is stated.
    resolution
        In rad; by default an eighth of a count of a 13 bit encoder.
    bytes_per_number
        Of the flash, 4 for ``float`` and 8 for ``double``.

    Raises
    ------
    ValueRangeError
        If the torque error or the number of bytes is not positive.
    """

    lower: float = -1.1
    upper: float = 1.1
    torque_error: float | None = None
    most_bytes: int | None = None
    resolution: float = RESOLUTION
    bytes_per_number: int = 4

    def __post_init__(self) -> None:
        check_range(self.lower, self.upper)
        for name, value in (("torque_error", self.torque_error), ("most_bytes", self.most_bytes)):
            if value is not None and not 0.0 < value < np.inf:
                raise ValueRangeError(f"{name} {value:g}", "must be positive")

    def compact(self, entries: Entries, draft: Draft | None = None) -> Compact:
        """Return the table; see :class:`Grid`.

        Raises
        ------
        ValueRangeError
            If there is no draft to measure the torque with.
        ConvergenceError
            If the bound cannot be kept, or not within the size: with what would be reached.
        """
        if draft is None:
            raise ValueRangeError(
                "grid by torque error", "needs the observer whose torque counts",
                next_step="take GridByTolerance for entries alone",
            )  # fmt: skip
        fine = FineEntries.of(entries, self.lower, self.upper, self.resolution)
        search = _Search(TableTrial(draft, fine), self.bytes_per_number)
        scale, unit = search.trial.full_scale, draft.plant.estimate.unit
        asked = TORQUE_SHARE * scale if self.torque_error is None else self.torque_error
        table = search.within(asked)
        if table is None:
            finest = search.judged(search.table(0.0))
            raise ConvergenceError(
                f"table of the observer with a torque error of {asked:.3g} {typeset_unit(unit)}",
                f"cannot be met; the finest table has {finest.size(self.bytes_per_number)} bytes and errs by "
                f"{largest_of(finest):.3g} {typeset_unit(unit)}",
                next_step="allow a larger torque error",
            )
        if self.most_bytes is None or table.size(self.bytes_per_number) <= self.most_bytes:
            return table
        each, most = self.bytes_per_number, self.most_bytes or 0
        largest = MOST_SHARE * search.trial.full_scale if self.torque_error is None else self.torque_error
        coarser = search.of_size(most)
        if coarser is not None and largest_of(coarser) <= largest:
            return coarser
        least = table if self.torque_error is not None else search.within(largest) or table
        cost = None if coarser is None else largest_of(coarser)
        raise TableTooLargeError(most, largest, cost, least.size(each), unit)


class TableTooLargeError(ConvergenceError):
    """A table cannot be as small as was asked for.

    ``allowed``: torque error that it may cause. ``cost``: torque error that the best table of that size would
    cause; ``None`` where there is none that small. ``least``: bytes of the smallest table found that keeps
    what is allowed.
    """

    def __init__(self, most: int, allowed: float, cost: float | None, least: int, unit: str) -> None:
        self.allowed, self.cost, self.least, self.unit = allowed, cost, least, typeset_unit(unit)
        super().__init__(
            f"table of the observer in {most} B",
            f"cannot be met: {self.words}; the smallest found that keeps this has {least} B",
            next_step=f"allow {least} B for the table, or a larger torque error",
        )

    @property
    def words(self) -> str:
        """What the size would cost."""
        if self.cost is None:
            return f"no table is that small within {self.allowed:.3g} {self.unit}"
        return f"it would cost {self.cost:.3g} {self.unit}, more than {self.allowed:.3g} {self.unit}"


class _Search:
    """Tables by one number: the error that the sums may cause together, in the unit of the estimate."""

    def __init__(self, watched: TableTrial, bytes_per_number: int) -> None:
        self.trial, self.fine, self.each = watched, watched.fine, bytes_per_number
        self._weights = np.array([e.weight if e.weight > 0.0 else 1.0 for e in self.fine.entries])
        rows = list(dict.fromkeys(e.row for e in watched.deciding))
        effects = [(row, self._effect(row) * len(rows)) for row in rows]
        self._effects = {row: effect for row, effect in effects if effect > 0.0}

    def _effect(self, row: str) -> float:
        """Return the torque error when all entries of one sum are read with the error of the probe."""
        in_row = np.array([e.row == row for e in self.fine.entries])
        table = self.fine.placed(np.where(in_row, PROBE, np.inf) / self._weights).with_breakpoints()
        return self.trial.error(table, only=row).largest

    def table(self, error: float, *, others: float = OTHERS) -> Compact:
        """Return the smaller table of a uniform grid and of breakpoints, for an error of the torque."""
        shares = {row: min(others, PROBE * error / effect) for row, effect in self._effects.items()}
        allowed = np.array([shares.get(e.row, others) for e in self.fine.entries]) / self._weights
        placed = self.fine.placed(allowed)
        uneven, even = placed.with_breakpoints(), placed.uniform()
        search = SEARCH_BYTES * int(np.ceil(np.log2(max(len(uneven.angles) - 1, 1))))
        larger = even is None or even.size(self.each) > uneven.size(self.each) + search
        return uneven if larger or even is None else even

    def judged(self, table: Compact) -> Compact:
        """Return the table with its torque error."""
        return replace(table, torque_error=self.trial.error(table))

    def within(self, error: float) -> Compact | None:
        """Return the smallest table that was tried whose torque error is at most a number."""
        kept, tried, before = None, error, 0
        for _ in range(STEPS):
            table = self.judged(self.table(tried))
            caused, size = largest_of(table), table.size(self.each)
            if caused <= error and (kept is None or size < kept.size(self.each)):
                kept = table
            if 0.8 * error <= caused <= error or (caused <= error and size == before):
                break
            before = size
            tried *= float(np.clip(0.92 * error / max(caused, 1e-9 * error), 0.02, 50.0))
        return kept

    def of_size(self, most: int) -> Compact | None:
        """Return the finest table found that takes at most so many bytes, with its torque error."""
        scale = self.trial.full_scale
        kept, low, high = None, 1e-5 * scale, 3.0 * scale
        for _ in range(HALVINGS):
            middle = float(np.sqrt(low * high))
            table = self.table(middle, others=max(OTHERS, 10.0 * middle / scale))
            if table.size(self.each) <= most:
                kept, high = table, middle
            else:
                low = middle
        return None if kept is None else self.judged(kept)


def largest_of(table: Compact) -> float:
    """Return the largest torque error of a table; infinite where it was not measured."""
    return table.torque_error.largest if table.torque_error is not None else np.inf
