"""A table as small as a stated error of the estimated torque allows, and no larger than a stated size."""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from ....foundation.errors import ConvergenceError, ValueRangeError
from ....foundation.quantity import typeset_unit
from .breakpoints import FineEntries
from .table import Compact, Draft, Entries, Grid, check_range
from .table_trial import TableTrial

Array = NDArray[np.float64]

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
        return self._smaller(search, table, asked, unit)

    def _smaller(self, search: _Search, table: Compact, asked: float, unit: str) -> Compact:
        """Return a coarser table within the size, or refuse with what it would cost."""
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

    Parameters
    ----------
    most
        Bytes that it may take.
    allowed
        Torque error that it may cause.
    cost
        Torque error that the best table of that size would cause; ``None`` where there is none that small.
    least
        Bytes of the smallest table found that keeps what is allowed.
    unit
        Of the torque.
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
    """Return the largest torque error of a table; infinite where it was not measured.

    Parameters
    ----------
    table
        Any.
    """
    return table.torque_error.largest if table.torque_error is not None else np.inf
