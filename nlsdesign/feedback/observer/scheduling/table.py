"""From functions of the angle to a table as small as a stated error allows.

An entry is a number that multiplies something in the step of the observer and depends on the angle. Entries
that do not change become literals; entries that are proportional share a column. Grid points stand where the
longest cells that keep the stated errors end.
"""

from __future__ import annotations

import math
from abc import ABC, abstractmethod
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, replace
from functools import cached_property
from typing import Protocol

import numpy as np

from ....foundation.arrays import Array
from ....foundation.errors import ConvergenceError, ValueRangeError
from ....foundation.quantity import typeset_unit
from ....model import FlatModel, Table, Variable
from .angle_form import AngleScheduledPlant

SHARE = 0.1
"""Part of the tolerance that may be spent on making an entry a literal or letting it share a column."""
NOTHING = 1e-9
"""Share of a sum below which an entry is nothing, and deviations of it are rounding."""
CHECKS = 4
"""Points between two grid points at which the error is measured while a grid is chosen."""


@dataclass(frozen=True, eq=False)
class Entry:
    """A function of the angle and the weight of its error."""

    key: str  # where it is read in the step
    row: str  # the sum in which it stands, for instance the next speed
    # name, unit: of the column that it may become
    name: str
    unit: str
    values: Array  # shape (N,)
    # weight: typical size of what it multiplies over the typical size of the sum: error = weight × deviation
    weight: float


Entries = Callable[[Array], Sequence[Entry]]


@dataclass(frozen=True)
class ColumnPlace:
    """Where an entry is read: ``factor`` × column, or ``factor`` alone where ``column`` is ``None``."""

    factor: float
    column: int | None = None


@dataclass(frozen=True)
class TableTorqueError:
    """What reading a table costs: torque with the table minus torque with exact functions of the angle."""

    largest: float  # over all motions, in the unit of the estimate
    rms: float  # root mean square over all motions
    full_scale: float  # largest exact torque over all motions

    @property
    def share(self) -> float:
        """Largest error over the full scale."""
        return self.largest / self.full_scale if self.full_scale > 0.0 else 0.0


@dataclass(frozen=True, eq=False)
class Compact:
    """A table and how to read each entry from it."""

    angles: Array  # grid, shape (n,)
    columns: tuple[Entry, ...]  # the entries that became columns
    values: Array  # shape (n, columns)
    places: Mapping[str, ColumnPlace]  # by key of the entry
    # error: by row: largest error at the checked points, share of the typical size of the sum
    error: Mapping[str, float]
    angle_error: float  # angle in rad within which the exact function may be read to judge the error
    uniform: bool = True  # whether the grid points lie equally far apart
    torque_error: TableTorqueError | None = None  # what the table costs; None where it was not measured

    def size(self, bytes_per_number: int) -> int:
        """Return the flash that values and breakpoints take, in bytes."""
        if not self.columns:
            return 0
        return bytes_per_number * (self.values.size + (0 if self.uniform else len(self.angles)))

    def cost(self, unit: str) -> str:
        """Return what the table costs in torque, as the end of a sentence; empty if not measured."""
        if self.torque_error is None:
            return ""
        return f", which move the torque by at most {self.torque_error.largest:.2g} {typeset_unit(unit)}"

    def table(self, argument: str) -> Table | None:
        """Return the table of a flat model; ``None`` where every entry is a literal."""
        if not self.columns:
            return None
        columns = tuple(
            Variable(c.name, c.unit, f"entry {c.key} of the step, in the sum of {c.row}")
            for c in self.columns
        )
        if not self.uniform:
            return Table.over(argument, self.angles, columns, self.values)
        step = float(self.angles[1] - self.angles[0])
        return Table(argument, float(self.angles[0]), step, columns, self.values)


class ObserverWithTable(Protocol):
    """An observer that was written for a table."""

    @property
    def model(self) -> FlatModel:
        """Discrete."""
        ...

    def start(self, angle: float) -> dict[str, float]:
        """Return the start values at rest at an angle."""
        ...


@dataclass(frozen=True, eq=False)
class Draft:
    """An observer that still lacks its table."""

    plant: AngleScheduledPlant  # on which it is designed
    write: Callable[[Compact], ObserverWithTable]  # writes it for a table


class Grid(ABC):
    """A range of the angle and a rule for the number of grid points."""

    lower: float
    upper: float

    @abstractmethod
    def compact(self, entries: Entries, draft: Draft | None = None) -> Compact:
        """Return the table of some entries.

        Parameters
        ----------
        entries
            Takes angles of shape (N,) and returns the entries there.
        draft
            The observer, for grids that measure what a table does to its torque.
        """


def check_range(lower: float, upper: float) -> None:
    """Refuse a range that is not finite or not ascending."""
    if not (np.isfinite(lower) and np.isfinite(upper) and lower < upper):
        raise ValueRangeError(f"range {lower:g} to {upper:g} rad", "must be finite and ascending")


@dataclass(frozen=True)
class GridByTolerance(Grid):
    """The coarsest of the grids with 33, 65, 129, … points whose interpolation error keeps a bound.

    The error of a sum is that of its entries, each weighted with the typical size of what it multiplies, as
    a share of the typical size of the sum. Where an entry jumps, as the lever arm does at zero angle of a cam
    without dead zone, no grid has a small error; so an entry counts as exact where it equals the exact one
    at an angle within ``angle_tolerance``, by default one count of a 13 bit encoder, which nothing can tell
    apart.

    Parameters
    ----------
    lower, upper
        Range in rad; beyond it the ends are held.
    tolerance
        Bound on the error of each sum.
    angle_tolerance
        In rad.
    most_points
        Where the bound is not kept with so many points, an error is raised.

    Raises
    ------
    ValueRangeError
        If the tolerance is not positive.
    """

    lower: float = -1.1
    upper: float = 1.1
    tolerance: float = 2e-3
    angle_tolerance: float = 0.767e-3
    most_points: int = 4097

    def __post_init__(self) -> None:
        check_range(self.lower, self.upper)
        if not self.tolerance > 0.0:
            raise ValueRangeError(f"tolerance {self.tolerance:g}", "must be positive")

    def compact(self, entries: Entries, draft: Draft | None = None) -> Compact:
        """Return the table; see :class:`Grid`.

        Raises
        ------
        ConvergenceError
            If the bound is not kept with the largest number of points.
        """
        cells, fine = 32, entries(np.linspace(self.lower, self.upper, 32 * CHECKS + 1))
        while True:
            angles = np.linspace(self.lower, self.upper, cells * CHECKS + 1)
            table = compacted(
                angles, fine, every=CHECKS, tolerance=self.tolerance, angle_error=self.angle_tolerance
            )
            worst = max(table.error, key=lambda row: table.error[row])
            if table.error[worst] <= self.tolerance:
                return table
            if 2 * cells + 1 > self.most_points:
                raise ConvergenceError(
                    f"table of the observer with {cells + 1} points",
                    f"'{worst}' is off by {table.error[worst]:.2g} of its size, more than {self.tolerance:g}",
                    next_step="allow a larger error or more points, or take FixedGrid and read its error",
                )
            middle = (angles[1:] + angles[:-1]) / 2
            fine, cells = _interleaved(fine, entries(middle)), 2 * cells


@dataclass(frozen=True)
class FixedGrid(Grid):
    """A stated number of grid points; the error is reported, not bounded.

    Parameters
    ----------
    lower, upper
        Range in rad; beyond it the ends are held.
    points
        Number of grid points.

    Raises
    ------
    ValueRangeError
        If there are fewer than two points.
    """

    lower: float = -1.1
    upper: float = 1.1
    points: int = 221

    def __post_init__(self) -> None:
        check_range(self.lower, self.upper)
        if self.points < 2:
            raise ValueRangeError(f"{self.points} points", "a grid has at least two")

    def compact(self, entries: Entries, draft: Draft | None = None) -> Compact:
        """Return the table; see :class:`Grid`."""
        angles = np.linspace(self.lower, self.upper, (self.points - 1) * CHECKS + 1)
        return compacted(angles, entries(angles), every=CHECKS, tolerance=0.0, angle_error=0.0)


def compacted(
    angles: Array, fine: Sequence[Entry], *, every: int, tolerance: float, angle_error: float
) -> Compact:
    """Return the table of entries known on a fine grid, of which every so many points are kept.

    ``tolerance``: of a sum; a share of it may be spent on literals and shared columns.
    """
    columns: list[Entry] = []
    places: dict[str, ColumnPlace] = {}
    error: dict[str, float] = {}
    grid, spare = angles[::every], max(SHARE * tolerance, NOTHING)
    for entry in _finite(fine):
        largest = float(np.max(np.abs(entry.values)))
        if largest * entry.weight <= NOTHING:
            place = ColumnPlace(0.0)
        else:
            place = place_of(entry, columns, spare / entry.weight)
        places[entry.key] = place
        kept = np.ones(len(grid)) if place.column is None else columns[place.column].values[::every]
        read = np.interp(angles, grid, place.factor * kept)
        off = entry.weight * _deviation(read, entry.values, angles, angle_error)
        error[entry.row] = error.get(entry.row, 0.0) + float(np.max(off))
    values = np.array([column.values[::every] for column in columns]).reshape(len(columns), len(grid)).T
    return Compact(grid, tuple(columns), np.ascontiguousarray(values), places, error, angle_error)


def place_of(entry: Entry, columns: list[Entry], allowed: float) -> ColumnPlace:
    """Return where an entry goes; it is added to the columns where it needs one of its own.

    ``columns``: so far; may grow.
    """
    low, high = float(np.min(entry.values)), float(np.max(entry.values))
    if (high - low) / 2.0 <= allowed:
        return ColumnPlace((high + low) / 2.0)
    for i, column in enumerate(columns):
        factor = float(entry.values @ column.values / (column.values @ column.values))
        if np.max(np.abs(entry.values - factor * column.values)) <= allowed:
            return ColumnPlace(factor, i)
    columns.append(entry)
    return ColumnPlace(1.0, len(columns) - 1)


def _deviation(read: Array, exact: Array, angles: Array, angle_error: float) -> Array:
    """Return the distance of what is read from the exact values within the angle error."""
    if angle_error <= 0.0:
        return np.abs(read - exact)
    low, high = exact.copy(), exact.copy()
    step = angles[1] - angles[0]
    offsets = [k * step for k in range(1, int(angle_error / step) + 1)] + [angle_error]
    for offset in offsets:
        for sign in (-1.0, 1.0):
            near = np.interp(angles + sign * offset, angles, exact)
            np.minimum(low, near, out=low)
            np.maximum(high, near, out=high)
    return np.maximum(np.maximum(low - read, read - high), 0.0)


def _interleaved(coarse: Sequence[Entry], middle: Sequence[Entry]) -> list[Entry]:
    result = []
    for one, other in zip(coarse, middle, strict=True):
        values = np.empty(len(one.values) + len(other.values))
        values[::2], values[1::2] = one.values, other.values
        result.append(replace(one, values=values))
    return result


FIRST_CELLS = 256
"""Cells in which kinks and jumps are looked for at first; a spike narrower than half a cell may be missed."""
FINE_TOLERANCE = 2e-5
"""Share of a sum to which the fine grid follows the entries, so that it can stand for them."""
STRAIGHT_CELLS = (8, 16, 32, 64, 128, 256, 512, 1024)
"""Cells of the uniform grids that are tried."""


@dataclass(frozen=True, eq=False)
class FineEntries:
    """The entries on a grid that is fine where they bend or jump."""

    angles: Array  # ascending, shape (n,)
    entries: tuple[Entry, ...]  # on these angles
    resolution: float  # width in rad to which jumps are narrowed down

    @staticmethod
    def of(entries: Entries, lower: float, upper: float, resolution: float) -> FineEntries:
        """Return entries on a grid that is divided until they run straight within its cells."""
        angles = np.linspace(lower, upper, FIRST_CELLS + 1)
        known = _finite(entries(angles))
        values, weights = np.array([e.values for e in known]), np.array([[e.weight] for e in known])
        narrowest = max(resolution, 1e-6 * (upper - lower))
        left = np.arange(FIRST_CELLS)
        while len(left):
            middle = (angles[left] + angles[left + 1]) / 2.0
            values_between = np.array([e.values for e in _finite(entries(middle))])
            straight = (values[:, left] + values[:, left + 1]) / 2.0
            is_bent = np.max(weights * np.abs(values_between - straight), axis=0) > FINE_TOLERANCE
            divided = is_bent & (angles[left + 1] - angles[left] > 2.0 * narrowest)
            angles = np.insert(angles, left + 1, middle)
            values = np.insert(values, left + 1, values_between, axis=1)
            moved = left + np.arange(len(left))
            left = np.sort(np.concatenate([moved[divided], moved[divided] + 1]))
        fine = tuple(replace(e, values=v) for e, v in zip(known, values, strict=True))
        return FineEntries(angles, fine, resolution)

    @cached_property
    def values(self) -> Array:
        """All entries, shape (entries, n)."""
        return np.array([e.values for e in self.entries])

    def placed(self, allowed: Array) -> PlacedEntries:
        """Return where entries are read if each may be off by so much: as literals, alone or shared."""
        columns: list[Entry] = []
        places: dict[str, ColumnPlace] = {}
        for entry, off in zip(self.entries, allowed, strict=True):
            largest = float(np.max(np.abs(entry.values)))
            nothing = largest * entry.weight <= NOTHING
            places[entry.key] = (
                ColumnPlace(0.0) if nothing else place_of(entry, columns, max(SHARE * off, NOTHING * largest))
            )
        return PlacedEntries(self, tuple(columns), places, allowed)


@dataclass(frozen=True, eq=False)
class PlacedEntries:
    """Entries that know where they will be read, but not on which grid."""

    fine: FineEntries
    columns: tuple[Entry, ...]
    places: dict[str, ColumnPlace]
    allowed: Array

    @cached_property
    def _tabled(self) -> tuple[Array, Array, Array, Array]:
        """Return of all entries that are read from columns: factor, column, exact values, allowed."""
        rows = [i for i, e in enumerate(self.fine.entries) if self.places[e.key].column is not None]
        places = [self.places[self.fine.entries[i].key] for i in rows]
        factors = np.array([p.factor for p in places])[:, None]
        kept = np.array([p.column for p in places], dtype=int)
        return factors, kept, self.fine.values[rows], self.allowed[rows][:, None]

    @cached_property
    def _read(self) -> Array:
        """Return what the columns give for all entries that are read from them, shape (entries, n)."""
        factors, kept, _, _ = self._tabled
        read: Array = np.array([c.values for c in self.columns])[kept] * factors
        return read

    def with_breakpoints(self) -> Compact:
        """Return the table with the longest cells, from the lower end on, that keep what is allowed."""
        count, start, kept = len(self.fine.angles), 0, [0]
        while start < count - 1:
            good, tried = start + 1, start + 2
            while tried < count and self._keeps(start, tried):
                good, tried = tried, start + 2 * (tried - start)
            low, high = good, min(tried, count)
            while high - low > 1:
                middle = (low + high) // 2
                low, high = (middle, high) if self._keeps(start, middle) else (low, middle)
            start = low
            kept.append(start)
        return self._compact(self.fine.angles[kept], uniform=False)

    def uniform(self) -> Compact | None:
        """Return the table on the coarsest uniform grid that keeps what is allowed; ``None`` for none."""
        angles = self.fine.angles
        for cells in STRAIGHT_CELLS:
            grid = np.linspace(angles[0], angles[-1], cells + 1)
            if self._kept_on(grid):
                return self._compact(grid, uniform=True)
        return None

    def _columns_at(self, angles: Array) -> Array:
        values = np.array([c.values for c in self.columns]).reshape(-1, len(self.fine.angles))
        return linearly(self.fine.angles, values.T, angles)

    def _kept_on(self, grid: Array) -> bool:
        factors, kept, exact, allowed = self._tabled
        if not len(kept):
            return True
        read = linearly(grid, self._columns_at(grid).T, self.fine.angles)
        return bool(np.all(np.abs(factors * read[kept] - exact) <= allowed))

    def _keeps(self, i: int, j: int) -> bool:
        _, kept, exact, allowed = self._tabled
        if not len(kept):
            return True
        angles, first = self.fine.angles, self._read[:, i, None]
        share = (angles[i : j + 1] - angles[i]) / (angles[j] - angles[i])
        read = first + share * (self._read[:, j, None] - first)
        return bool(np.all(np.abs(read - exact[:, i : j + 1]) <= allowed))

    def _compact(self, grid: Array, *, uniform: bool) -> Compact:
        values = np.ascontiguousarray(self._columns_at(grid).T)
        read = linearly(grid, values, self.fine.angles)
        places = [self.places[entry.key] for entry in self.fine.entries]
        rows = [p.factor * (np.ones(read.shape[1]) if p.column is None else read[p.column]) for p in places]
        off = np.max(np.abs(np.array(rows) - self.fine.values), axis=1)
        error: dict[str, float] = {}
        for entry, largest in zip(self.fine.entries, off, strict=True):
            error[entry.row] = error.get(entry.row, 0.0) + entry.weight * float(largest)
        return Compact(grid, self.columns, values, self.places, error, 0.0, uniform)


def linearly(grid: Array, values: Array, at: Array) -> Array:
    """Return columns at many angles, linear between grid points and held at the ends, shape (columns, N).

    ``values``: shape (n, columns).
    """
    held = np.clip(at, grid[0], grid[-1])
    left = np.clip(np.searchsorted(grid, held, side="right") - 1, 0, len(grid) - 2)
    share = (held - grid[left]) / (grid[left + 1] - grid[left])
    rows = values.T
    return rows[:, left] + share * (rows[:, left + 1] - rows[:, left])


def _finite(entries: Sequence[Entry]) -> Sequence[Entry]:
    for entry in entries:
        if not (np.all(np.isfinite(entry.values)) and math.isfinite(entry.weight)):
            raise ConvergenceError(f"table of the observer, '{entry.name}'", "is not finite at some angle")
    return entries
