"""Saltelli's plan: the points that Sobol indices with totals need, and how to see that points are one."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from typing import NamedTuple

import numpy as np

from ..foundation.arrays import Array
from ..foundation.errors import ValueRangeError, missing_library
from .axes import MOST_HELD, AxisSet, BoundAxes, require_fractions, require_seed
from .axis_values import Given, Subject
from .sweep_columns import SALTELLI


class SaltelliForm(NamedTuple):
    """The form of a Saltelli plan."""

    blocks: int  # whole blocks
    # rows: points of a block: one of the first sample, one per axis with that axis from the second sample,
    # with second order also the reverse, and one of the second sample
    rows: int
    second_order: bool  # whether blocks hold the reverse exchanges


def saltelli_plan(points: Array) -> SaltelliForm | None:
    """Return the form of the plan, none where the points are not one; a last block that is cut is left out.

    ``points``: shape (n, d), in their order.
    """
    count, axes = points.shape
    for second_order in (False, True):
        rows = (2 * axes + 2) if second_order else (axes + 2)
        blocks = count // rows
        # Two of four axes and one of ten may have blocks of the same length: the exchanges decide.
        if blocks >= 2 and _exchanged(points[: blocks * rows].reshape(blocks, rows, axes), second_order):
            return SaltelliForm(blocks, rows, second_order)
    return None


def _exchanged(blocks: Array, second_order: bool) -> bool:
    axes = blocks.shape[2]
    first, second = blocks[:, 0], blocks[:, -1]
    if np.all(first == second):
        return False
    for axis in range(axes):
        expected = first.copy()
        expected[:, axis] = second[:, axis]
        if not np.array_equal(blocks[:, 1 + axis], expected):
            return False
        reverse = second.copy()
        reverse[:, axis] = first[:, axis]
        if second_order and not np.array_equal(blocks[:, 1 + axes + axis], reverse):
            return False
    return True


_MOST_BLOCKS = 2**24


@dataclass(frozen=True)
class SaltelliSample(AxisSet):
    """Blocks of points of Saltelli's plan, from a scrambled Sobol sequence of twice as many dimensions.

    A block has two points more than there are axes; with second order two more than twice the axes. The page
    of the sweep sees the plan in the points, so it must be the only set of axes with more than one row.

    Parameters
    ----------
    ranges
        Lower and upper end by name.
    count
        Number of blocks, a power of two.
    second_order
        Whether blocks also hold the reverse exchanges, which shares of pairs of axes need.
    seed
        Of the scrambling, 0 or larger.
    """

    ranges: Mapping[str, tuple[Given, Given]]
    count: int
    second_order: bool = False
    seed: int = 0

    def bound(self, subject: Subject) -> BoundAxes:
        """Return the axes; see :meth:`AxisSet.bound`.

        Raises
        ------
        ValueRangeError
            If the number of blocks is no power of two, or a range is empty.
        MissingLibraryError
            If SALib is not installed.
        NlsError
            If a name does not exist, or a value does not fit it.
        """
        whole = isinstance(self.count, int) and not isinstance(self.count, bool)
        if not whole or not 2 <= self.count <= _MOST_BLOCKS or self.count & (self.count - 1):
            raise ValueRangeError(
                f"Saltelli sample: count = {self.count}", "must be a power of two, from 2 on",
                next_step="take for instance 256; the number of points is that times the axes plus two",
            )  # fmt: skip
        require_seed("Saltelli sample", self.seed)
        rows_each = (2 if self.second_order else 1) * len(self.ranges) + 2
        if self.count * rows_each > MOST_HELD:
            raise ValueRangeError(
                f"Saltelli sample: count = {self.count}", f"makes {self.count * rows_each} points, "
                f"at most {MOST_HELD} stand in memory", next_step="take fewer blocks",
            )  # fmt: skip
        try:
            from SALib.sample import sobol
        except ModuleNotFoundError:
            raise missing_library("a Saltelli sample", "SALib", "sensitivity") from None
        columns, ends = [], []
        for name, given in self.ranges.items():
            column, values = subject.column(name, tuple(given), SALTELLI)
            if column.lower is None or len(values) != 2 or not values[0] < values[1]:
                raise ValueRangeError(
                    f"range of {name}", "must be two ascending numbers", next_step='write ["1 mm", "2 mm"]'
                )
            require_fractions(subject, name)
            columns.append(column)
            ends.append([float(value) for value in values])
        if not columns:
            raise ValueRangeError(
                "Saltelli sample", "has no ranges", next_step='write ranges = {"NAME" = [1, 2]}'
            )
        unit = {"num_vars": len(columns), "names": list(self.ranges), "bounds": [[0.0, 1.0]] * len(columns)}
        generator = np.random.default_rng(self.seed)
        points = sobol.sample(unit, self.count, calc_second_order=self.second_order, seed=generator)
        low, high = np.array(ends).T
        rows = low + (high - low) * points
        return BoundAxes(tuple(columns), len(rows), lambda number: tuple(rows[number].tolist()))
