"""Properties of a model over its angle: one table, one row per angle, one column per property."""

from __future__ import annotations

from abc import ABC, abstractmethod
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from ..errors import ValueRangeError, unknown_name
from ..model import FlatModel, Variable
from ..model.linear import LinearModel, jacobian_function
from ..model.roles import measured_motion
from ..quantity import typeset_unit
from ..writing import write_table
from .rest import rest_states, typical_sizes

Array = NDArray[np.float64]


@dataclass(frozen=True, eq=False)
class RestPoint:
    """The model at rest at one angle.

    Parameters
    ----------
    model
        Whole model.
    angle
        Name of the state that is swept.
    state
        Rest state, shape (states,).
    linear
        Exact linearisation there.
    sizes
        Typical size of states and outputs over the sweep.
    """

    model: FlatModel
    angle: str
    state: Array
    linear: LinearModel
    sizes: Mapping[str, float]


class View(ABC):
    """A property of a point; final classes say which numbers and words they give."""

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
        """Return a ``pandas.DataFrame`` indexed by the argument; needs pandas."""
        import pandas as pd

        data = {v.name: self.values[:, i] for i, v in enumerate(self.columns)} | dict(self.words)
        return pd.DataFrame(data, index=pd.Index(self.at, name=self.argument.name))

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
        States that have to agree with a signal, as for :func:`~nlsdesign.analysis.rest.rest_states`.

    Raises
    ------
    ValueRangeError
        If an angle is not finite, or the model has no finite slope at one.
    ConvergenceError
        If the model does not come to rest.
    ArrangementError
        If no angle is named and the structure does not say which body is driven.
    """
    angle = measured_motion(model, angle)
    at = np.asarray(angles, dtype=float)
    if at.ndim != 1 or len(at) == 0 or not np.all(np.isfinite(at)):
        raise ValueRangeError("angles", "must be a row of finite numbers in rad")
    states = rest_states(model, at, angle=angle, consistent=consistent)
    sizes = _sizes(model, states) if consistent else typical_sizes(model, at, angle=angle)
    columns = tuple(column for view in views for column in view.columns(model))
    values, words = np.zeros((len(at), len(columns))), dict[str, list[str]]()
    for row, linear in enumerate(_linearised(model, states)):
        views_here = [view.at(RestPoint(model, angle, states[row], linear, sizes)) for view in views]
        values[row] = [number for numbers, _ in views_here for number in numbers]
        for _, texts in views_here:
            for name, text in texts.items():
                words.setdefault(name, []).append(text)
    return Chart(model.variable(angle), at, columns, values, {name: tuple(t) for name, t in words.items()})


def _sizes(model: FlatModel, states: Array) -> dict[str, float]:
    largest = np.max(np.abs(states), axis=0)
    return {v.name: float(size) if size > 0.0 else 1.0 for v, size in zip(model.states, largest, strict=True)}


def _linearised(model: FlatModel, states: Array) -> list[LinearModel]:
    function = jacobian_function(model)
    u, p = model.start(model.inputs), model.start(model.parameters)
    names = [tuple(v.name for v in group) for group in (model.states, model.inputs, model.outputs)]
    result = []
    for x in states:
        a, b, c, d = (np.array(m, dtype=float) for m in function(0.0, x, u, p, []))
        if not all(np.all(np.isfinite(m)) for m in (a, b, c, d)):
            raise ValueRangeError(
                f"linearisation of {model.name} at {x.tolist()}", "the slope is not finite there",
                next_step="move away from the corner or use the smooth form of the law",
            )  # fmt: skip
        result.append(LinearModel(a, b, c, d, names[0], names[1], names[2], model.sample_time))
    return result
