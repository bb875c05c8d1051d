"""Whether the points of a sweep are a Saltelli plan, seen from the points themselves."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from ..foundation.arrays import Array


class SaltelliForm(NamedTuple):
    """The form of a Saltelli plan.

    Parameters
    ----------
    blocks
        Whole blocks.
    rows
        Points of a block: one of the first sample, one per axis with that axis from the second sample, with
        second order also the reverse, and one of the second sample.
    second_order
        Whether blocks hold the reverse exchanges.
    """

    blocks: int
    rows: int
    second_order: bool


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
