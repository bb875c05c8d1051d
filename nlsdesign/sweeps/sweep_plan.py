"""All points of a sweep: every row of each set of axes with every row of the others, one at a time."""

from __future__ import annotations

import hashlib
import json
import math
from collections import Counter
from collections.abc import Iterator, Sequence
from dataclasses import asdict
from typing import Any

from ..foundation.errors import ValueRangeError
from .axes import AxisSet
from .axis_values import Subject
from .changes import row_of_factor
from .sweep_columns import SALTELLI, SweepColumn

_PROBES = 64
_MOST_POINTS = 100_000_000


class PointPlan:
    """Points by number; the last set of axes changes first."""

    def __init__(self, axes: Sequence[AxisSet], subject: Subject) -> None:
        if not axes:
            raise ValueRangeError(
                "sweep", "has no axes", next_step="give one, such as GridAxis or SobolSample"
            )
        self._sets = [each.bound(subject) for each in axes]
        count = math.prod(each.count for each in self._sets)
        if count > _MOST_POINTS:
            raise ValueRangeError(
                f"sweep of {count:.4g} points", f"has more than {_MOST_POINTS}, for which no driver has room",
                next_step="split it by an axis, with a folder for each stretch",
            )  # fmt: skip
        self.columns: tuple[SweepColumn, ...] = tuple(c for each in self._sets for c in each.columns)
        # Refuse axes that change the same number.
        for name, times in Counter(column.name for column in self.columns).items():
            if times > 1:
                raise ValueRangeError(
                    f"axis '{name}'", f"stands {times} times: its points collide",
                    next_step="keep one of them",
                )  # fmt: skip
        names = {column.name for column in self.columns}
        for name in names:
            row = row_of_factor(name)
            inside = sorted(each for each in names if row is not None and each.partition("[")[0] == row)
            if inside:
                raise ValueRangeError(
                    f"axes '{name}' and '{inside[0]}'", "change the same number: their points collide",
                    next_step="keep one of them",
                )  # fmt: skip
        # Refuse a Saltelli plan that is crossed: crossed blocks are no plan, and what they give is no share.
        for plan in self._sets:
            others = [
                c.name for each in self._sets if each is not plan and each.count > 1 for c in each.columns
            ]
            if others and any(column.kind == SALTELLI for column in plan.columns):
                raise ValueRangeError(
                    f"Saltelli sample over {', '.join(column.name for column in plan.columns)}",
                    f"is crossed with axis {', '.join(others)}: shares of the variance need it to be alone",
                    next_step="put a number among its ranges, and give each word a sweep and a folder of its "
                    "own",
                )  # fmt: skip

    def __len__(self) -> int:
        return math.prod(each.count for each in self._sets)

    def point(self, number: int) -> tuple[Any, ...]:
        """Return the values of a point, in the order of the columns."""
        rows: list[tuple[Any, ...]] = []
        for each in reversed(self._sets):
            number, inner = divmod(number, each.count)
            rows.append(each.row(inner))
        return tuple(value for row in reversed(rows) for value in row)

    def points(self) -> Iterator[tuple[int, tuple[Any, ...]]]:
        """Yield all points with their numbers."""
        return ((number, self.point(number)) for number in range(len(self)))

    def words(self) -> dict[str, tuple[str, ...]]:
        """Return the words of each axis that holds words, each once, in their order."""
        known: dict[str, tuple[str, ...]] = {}
        for each in self._sets:
            for place, column in enumerate(each.columns):
                if column.lower is None:
                    rows = (str(each.row(k)[place]) for k in range(each.count))
                    known[column.name] = tuple(dict.fromkeys(rows))
        return known

    def digest(self) -> str:
        """Return the SHA-256 of the plan: its columns, its size, and points all over it."""
        count = len(self)
        probes = sorted({round(k * (count - 1) / (_PROBES - 1)) for k in range(_PROBES)})
        content = [[asdict(column) for column in self.columns], count, [each.count for each in self._sets]]
        content.append([[k, *map(repr, self.point(k))] for k in probes])
        for each in self._sets:
            if each.count <= _PROBES**2:
                content.append([list(map(repr, each.row(k))) for k in range(each.count)])
        return hashlib.sha256(json.dumps(content).encode()).hexdigest()
