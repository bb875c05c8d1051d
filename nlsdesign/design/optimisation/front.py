"""The front of two or three goals as data."""

from __future__ import annotations

from dataclasses import dataclass, field
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np

from ...foundation.arrays import Array
from ...foundation.data_frames import Axis, data_frame
from ...foundation.errors import ValueRangeError
from ...foundation.quantity import parse_unit, typeset_unit
from ...foundation.text_files import write_table
from ..curves.target import Target
from .finish import SolvedSearch, finished
from .result import CamDesign

_SHOWN_IN = {"m": "mm", "m^2": "mm^2"}


class FrontPoint(NamedTuple):
    """One design of a front.

    Parameters
    ----------
    values
        The goals, in SI.
    numbers
        Free numbers in SI by full name, besides the contour.
    units
        SI units of these.
    binding
        Names of the limits on which the design sits.
    """

    values: tuple[float, ...]
    numbers: tuple[tuple[str, float], ...]
    units: tuple[str, ...]
    binding: tuple[str, ...]


class LeftOut(NamedTuple):
    """Bounds for which the front has no point, in words, and why."""

    bounds: str
    reason: str

    def __str__(self) -> str:
        return f"{self.bounds}: {self.reason}"


@dataclass(frozen=True, eq=False)
class ParetoFront:
    """Designs that no other design betters in all goals, in ascending order of the first.

    Parameters
    ----------
    target
        Torque curve.
    goals
        What they are about, in words.
    units
        In which they are shown.
    points
        The designs.
    left_out
        What the solver did not find, or another point betters.
    sources
        What whole designs are made from.
    """

    target: Target
    goals: tuple[str, ...]
    units: tuple[str, ...]
    points: tuple[FrontPoint, ...]
    left_out: tuple[LeftOut, ...]
    sources: tuple[SolvedSearch, ...] = field(repr=False)

    @property
    def values(self) -> Array:
        """The goals in SI, shape (points, goals)."""
        return np.array([point.values for point in self.points])

    @property
    def shown(self) -> Array:
        """The goals in the units in which they are shown, shape (points, goals)."""
        factors = np.array([parse_unit(unit).factor for unit in self.units])
        result: Array = self.values / factors
        return result

    def design(self, number: int) -> CamDesign:
        """Return one point as a whole design, measured on an assembly flattened anew.

        Parameters
        ----------
        number
            Of the point, from zero.

        Raises
        ------
        ValueRangeError
            If there is no such point.
        """
        if not 0 <= number < len(self.points):
            raise ValueRangeError(
                f"point {number}", f"the front has points 0 to {len(self.points) - 1}",
                next_step="print the front for its table",
            )  # fmt: skip
        return finished(self.sources[number])

    def write_csv(self, path: Path) -> None:
        """Write one row for each point: goals, free numbers, binding limits.

        Parameters
        ----------
        path
            File; its folder is made if needed.

        Raises
        ------
        ExportError
            If the file cannot be written.
        """
        head, rows = self._table()
        write_table(path, [head, *rows])

    def to_frame(self) -> Any:
        """Return a ``pandas.DataFrame``, one row for each point, units in its ``attrs``; needs pandas.

        Goals are in the units in which they are shown, free numbers in SI.
        """
        columns: dict[str, Any] = {goal: self.shown[:, k] for k, goal in enumerate(self.goals)}
        units = dict(zip(self.goals, self.units, strict=True))
        first = self.points[0]
        for k, (name, _) in enumerate(first.numbers):
            columns[name] = [point.numbers[k][1] for point in self.points]
        columns["binding limits"] = ["; ".join(point.binding) for point in self.points]
        numbers = {name: unit for (name, _), unit in zip(first.numbers, first.units, strict=True)}
        return data_frame(columns, units=units | numbers, index=Axis("point", "", range(len(self.points))))

    def _table(self) -> tuple[list[str], list[list[str]]]:
        first = self.points[0]
        units = [_SHOWN_IN.get(unit, unit) for unit in first.units]
        head = [f"{goal} [{unit}]" for goal, unit in zip(self.goals, self.units, strict=True)]
        head += [f"{name} [{unit}]" for (name, _), unit in zip(first.numbers, units, strict=True)]
        rows = []
        for point, shown in zip(self.points, self.shown, strict=True):
            numbers = [v / parse_unit(u).factor for (_, v), u in zip(point.numbers, units, strict=True)]
            row = [f"{value:.9g}" for value in (*shown, *numbers)]
            rows.append([*row, "; ".join(point.binding)])
        return [*head, "binding limits"], rows

    def __str__(self) -> str:
        heads = [
            f"{goal} in {typeset_unit(unit) or '1'}"
            for goal, unit in zip(self.goals, self.units, strict=True)
        ]
        lines = [" | ".join(["point", *heads, "binding limits"])]
        for number, (point, shown) in enumerate(zip(self.points, self.shown, strict=True)):
            cells = [f"{value:.4g}".rjust(len(head)) for value, head in zip(shown, heads, strict=True)]
            lines.append(" | ".join([f"{number:5d}", *cells, ", ".join(point.binding) or "none"]))
        return "\n".join([*lines, *(f"left out: {each}" for each in self.left_out)])
