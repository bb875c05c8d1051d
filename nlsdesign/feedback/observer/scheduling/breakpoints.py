"""Where a table needs its grid points: the longest cells that keep what each entry may be off."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass, replace
from functools import cached_property

import numpy as np
from numpy.typing import NDArray

from ....foundation.errors import ConvergenceError
from .table import NOTHING, SHARE, ColumnPlace, Compact, Entries, Entry, place_of

Array = NDArray[np.float64]

FIRST_CELLS = 256
"""Cells in which kinks and jumps are looked for at first; a spike narrower than half a cell may be missed."""
FINE_TOLERANCE = 2e-5
"""Share of a sum to which the fine grid follows the entries, so that it can stand for them."""
STRAIGHT_CELLS = (8, 16, 32, 64, 128, 256, 512, 1024)
"""Cells of the uniform grids that are tried."""


@dataclass(frozen=True, eq=False)
class FineEntries:
    """The entries on a grid that is fine where they bend or jump.

    Parameters
    ----------
    angles
        Ascending, shape (n,).
    entries
        On these angles.
    resolution
        Width in rad to which jumps are narrowed down.
    """

    angles: Array
    entries: tuple[Entry, ...]
    resolution: float

    @staticmethod
    def of(entries: Entries, lower: float, upper: float, resolution: float) -> FineEntries:
        """Return entries on a grid that is divided until they run straight within its cells.

        Parameters
        ----------
        entries
            Takes angles of shape (N,) and returns the entries there.
        lower, upper
            Range in rad.
        resolution
            In rad.

        Raises
        ------
        ConvergenceError
            If an entry is not finite at some angle.
        """
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
        """Return where entries are read if each may be off by so much: as literals, alone or shared.

        Parameters
        ----------
        allowed
            By entry, in its unit, shape (entries,).
        """
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
    """Entries that know where they will be read, but not on which grid.

    Parameters
    ----------
    fine
        The entries.
    columns
        Those that became columns.
    places
        By key.
    allowed
        What each entry may be off, in its unit, shape (entries,).
    """

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
        factors, kept, exact, allowed = self._tabled
        if not len(kept):
            return True
        angles = self.fine.angles
        share = (angles[i : j + 1] - angles[i]) / (angles[j] - angles[i])
        ends = np.array([[c.values[i], c.values[j]] for c in self.columns])[kept] * factors
        read = ends[:, :1] + share * (ends[:, 1:] - ends[:, :1])
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

    Parameters
    ----------
    grid
        Ascending, shape (n,).
    values
        Shape (n, columns).
    at
        Angles, shape (N,).
    """
    held = np.clip(at, grid[0], grid[-1])
    left = np.clip(np.searchsorted(grid, held, side="right") - 1, 0, len(grid) - 2)
    share = (held - grid[left]) / (grid[left + 1] - grid[left])
    rows = values.T
    read: Array = rows[:, left] + share * (rows[:, left + 1] - rows[:, left])
    return read


def _finite(entries: Sequence[Entry]) -> Sequence[Entry]:
    for entry in entries:
        if not (np.all(np.isfinite(entry.values)) and math.isfinite(entry.weight)):
            raise ConvergenceError(f"table of the observer, '{entry.name}'", "is not finite at some angle")
    return entries
