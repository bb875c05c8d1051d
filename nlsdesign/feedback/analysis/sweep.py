"""Properties of a model over its angle: one table, one row per angle, one column per property."""

from __future__ import annotations

from abc import ABC, abstractmethod
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from ...foundation.data_frames import Axis, data_frame, data_set
from ...foundation.errors import unknown_name
from ...foundation.quantity import typeset_unit
from ...foundation.writing import write_table
from ...model import FlatModel, Variable
from ...model.roles import measured_motion
from .rest_points import RestPoint, RestPoints, rest_points

Array = NDArray[np.float64]


class Columns(NamedTuple):
    """What a view gives over all angles.

    ``columns``: name, unit and description of each number; ``values``, shape (N, columns); ``words``: by
    name, one text per angle.
    """

    columns: tuple[Variable, ...]
    values: Array
    words: Mapping[str, tuple[str, ...]]


class View(ABC):
    """A property over the angle; final classes say which numbers and words they give."""

    @abstractmethod
    def over(self, points: RestPoints) -> Columns:
        """Return the numbers at all angles, and findings in words.

        Parameters
        ----------
        points
            The model at rest at each angle.
        """


class PointView(View):
    """A property that is computed angle by angle, the simplest way to write one of your own."""

    @abstractmethod
    def columns(self, model: FlatModel) -> tuple[Variable, ...]:
        """Return name, unit and description of each number.

        Parameters
        ----------
        model
            The model that is swept.
        """

    @abstractmethod
    def at(self, point: RestPoint) -> tuple[tuple[float, ...], dict[str, str]]:
        """Return the numbers, in the order of the columns, and findings in words.

        Parameters
        ----------
        point
            The model at rest at one angle.
        """

    def over(self, points: RestPoints) -> Columns:
        """Return what :meth:`at` gives at each angle."""
        columns = self.columns(points.model)
        values, words = np.zeros((len(points.at), len(columns))), dict[str, list[str]]()
        for row in range(len(points.at)):
            values[row], texts = self.at(points.point(row))
            for name, text in texts.items():
                words.setdefault(name, []).append(text)
        return Columns(columns, values, {name: tuple(texts) for name, texts in words.items()})


@dataclass(frozen=True, eq=False)
class Chart:
    """Columns of numbers over one argument, with units, and findings in words.

    Parameters
    ----------
    argument
        What was swept.
    at
        Its values, shape (n,), in SI.
    columns
        Name, unit and description of each column.
    values
        Shape (n, columns).
    words
        By name: one text per row.
    """

    argument: Variable
    at: Array
    columns: tuple[Variable, ...]
    values: Array
    words: Mapping[str, tuple[str, ...]]

    def __getitem__(self, name: str) -> Array:
        """Return one column.

        Parameters
        ----------
        name
            Name of the column or of the argument.
        """
        if name == self.argument.name:
            return self.at
        names = [v.name for v in self.columns]
        if name not in names:
            raise unknown_name("column", name, names)
        column: Array = self.values[:, names.index(name)]
        return column

    def to_frame(self) -> Any:
        """Return a ``pandas.DataFrame`` indexed by the argument; units are in its ``attrs``; needs pandas."""
        data = {v.name: self.values[:, i] for i, v in enumerate(self.columns)} | dict(self.words)
        return data_frame(data, units=self._units(), index=self._axis())

    def to_xarray(self) -> Any:
        """Return an ``xarray.Dataset`` over the argument, each column with its unit; needs xarray."""
        over = (self.argument.name,)
        data: dict[str, tuple[tuple[str, ...], Any]] = {
            v.name: (over, self.values[:, i]) for i, v in enumerate(self.columns)
        }
        data |= {name: (over, np.array(texts)) for name, texts in self.words.items()}
        return data_set(data, axes=[self._axis()], units=self._units())

    def _units(self) -> dict[str, str]:
        return {v.name: v.unit for v in self.columns}

    def _axis(self) -> Axis:
        return Axis(self.argument.name, self.argument.unit, self.at)

    def write_csv(self, path: Path) -> None:
        """Write ``name [unit]`` columns, words last; nothing is left behind if writing fails.

        Parameters
        ----------
        path
            File to write.
        """
        header = [f"{v.name} [{v.unit}]" for v in (self.argument, *self.columns)] + list(self.words)
        rows = [header]
        for i, at in enumerate(self.at):
            numbers = [repr(float(value)) for value in (at, *self.values[i])]
            rows.append(numbers + [text[i] for text in self.words.values()])
        write_table(path, rows)

    def __str__(self) -> str:
        names = [f"{v.name} [{typeset_unit(v.unit) or '1'}]" for v in (self.argument, *self.columns)]
        widths = [max(len(name), 11) for name in names]
        lines = ["  ".join(name.rjust(w) for name, w in zip(names, widths, strict=True))]
        for i, at in enumerate(self.at):
            row = zip((at, *self.values[i]), widths, strict=True)
            lines.append("  ".join(f"{value:.5g}".rjust(w) for value, w in row))
        return "\n".join(lines)


def over_angle(
    model: FlatModel,
    views: Sequence[View],
    *,
    angles: Sequence[float] | Array,
    angle: str | None = None,
    consistent: Mapping[str, str] | None = None,
) -> Chart:
    """Evaluate views of a model at rest over its angle.

    Parameters
    ----------
    model
        Continuous.
    views
        For instance ``[Observability(), Stability()]``.
    angles
        Shape (n,), in rad.
    angle
        State that is swept; by default the motion of the driven body.
    consistent
        States that have to agree with a signal, as for :func:`~nlsdesign.feedback.analysis.rest.rest_states`.

    Raises
    ------
    ValueRangeError
        If an angle is not finite, the model has no finite slope at one, or it is not continuous.
    ConvergenceError
        If the model does not come to rest.
    ArrangementError
        If no angle is named and the structure does not say which body is driven.
    """
    angle = measured_motion(model, angle)
    points = rest_points(model, np.asarray(angles, dtype=float), angle=angle, consistent=consistent)
    parts = [view.over(points) for view in views]
    columns = tuple(column for each in parts for column in each.columns)
    values = np.column_stack([np.zeros((len(points.at), 0)), *(each.values for each in parts)])
    words = {name: texts for each in parts for name, texts in each.words.items()}
    return Chart(model.variable(angle), points.at, columns, values, words)
