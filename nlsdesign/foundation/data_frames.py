"""Columns with units as data frames of pandas and data sets of xarray; both are optional libraries."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import Any, NamedTuple

from .errors import missing_library

_EXTRA = "tables"


class Axis(NamedTuple):
    """What rows are numbered by."""

    # name, unit: for instance "time" and "s"; no unit for words
    name: str
    unit: str
    values: Any  # one for each row


def data_frame(
    columns: Mapping[str, Any], *, units: Mapping[str, str] | None = None, index: Axis | None = None
) -> Any:
    """Return a ``pandas.DataFrame`` whose ``attrs["units"]`` holds the units by name.

    ``index``: what the rows are numbered by; by their number where none is given.
    """
    try:
        import pandas
    except ModuleNotFoundError:
        raise missing_library("a data frame", "pandas", _EXTRA) from None
    rows = None if index is None else pandas.Index(index.values, name=index.name)
    frame = pandas.DataFrame(dict(columns), index=rows)
    named = {index.name: index.unit} if index is not None and index.unit else {}
    frame.attrs["units"] = named | dict(units or {})
    return frame


def data_set(
    variables: Mapping[str, tuple[Sequence[str], Any]], *, axes: Sequence[Axis], units: Mapping[str, str]
) -> Any:
    """Return an ``xarray.Dataset`` whose variables and coordinates have their unit in ``attrs["units"]``."""
    try:
        import xarray
    except ModuleNotFoundError:
        raise missing_library("a data set", "xarray", _EXTRA) from None
    data = {n: (tuple(of), v, {"units": units[n]} if n in units else {}) for n, (of, v) in variables.items()}
    coordinates = {a.name: ((a.name,), a.values, {"units": a.unit} if a.unit else {}) for a in axes}
    return xarray.Dataset(data, coords=coordinates)
