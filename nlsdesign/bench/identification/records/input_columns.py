"""Columns of a file that drive a machine: its inputs over time, in SI."""

from __future__ import annotations

from pathlib import Path

import numpy as np

from ....foundation.arrays import Array
from ....foundation.csv_tables import heads_with_units, read_csv
from ....foundation.errors import MeasurementError
from ....foundation.quantity import parse_unit, same_dimension, typeset_unit
from ....foundation.written_numbers import name_and_unit
from ....model import FlatModel
from .column_heads import times_among


def read_input_columns(file: Path, model: FlatModel) -> tuple[Array, dict[str, Array]]:
    """Return the times of a file in s, from zero, and the inputs among its columns in SI.

    Heads are ``time [s]`` and ``name [unit]``, as a simulation writes them; other columns are passed over.
    """
    table = read_csv(file)
    heads = dict(zip(heads_with_units(file.name, table.heads, table.units), table.heads, strict=True))
    times = times_among(list(heads))
    if not times:
        raise MeasurementError(file.name, "has no column of time", next_step="name it 'time [s]'")
    head, unit = times[0]
    time = table.columns[heads[head]] * parse_unit(unit).factor
    if len(time) < 2 or not np.all(np.isfinite(time)) or np.any(np.diff(time) <= 0.0):
        raise MeasurementError(
            f"{file.name}: column '{heads[head]}'", "needs at least two times that ascend",
            next_step="sort the rows, and leave out those that are double",
        )  # fmt: skip
    units = {v.name: v.unit for v in model.inputs}
    columns: dict[str, Array] = {}
    for head, in_file in heads.items():
        name, given = name_and_unit(head)
        if name not in units:
            continue
        where, values = f"{file.name}: column '{in_file}'", table.columns[in_file]
        if given is None or not same_dimension(given, units[name]):
            raise MeasurementError(
                where, f"is not in a unit like {typeset_unit(units[name]) or '1'}",
                next_step=f"write [{units[name]}] behind it",
            )  # fmt: skip
        if len(values) != len(time) or not np.all(np.isfinite(values)):
            raise MeasurementError(where, "is not a number in every row", next_step="fill the cells")
        columns[name] = values * parse_unit(given).factor
    if not columns:
        example = next((f"{v.name} [{v.unit}]" for v in model.inputs), "input [unit]")
        raise MeasurementError(
            file.name, f"has no column of an input of {model.name}", next_step=f"name a column '{example}'"
        )
    return time - time[0], columns
