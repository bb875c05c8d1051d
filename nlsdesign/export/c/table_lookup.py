"""Table look-up in C: linear, held at the ends, in a fixed number of operations, defined for NaN.

A uniform grid needs no search. Of breakpoints, those near the argument are known by its part of the range;
they are searched in halves, always the same number of times.
"""

from __future__ import annotations

import textwrap
from collections.abc import Mapping
from dataclasses import dataclass

import numpy as np

from ...foundation.arrays import Array
from ...foundation.errors import ExportError
from ...model.flat import FlatModel, Table
from .c_text import Real, wrapped

_SEARCHED_WHOLE = 4
"""Cells up to which all are searched."""
_PARTS = (16, 32, 64, 128, 256)
"""Equal parts of a range, each of which knows its first cell."""


@dataclass(frozen=True)
class IndexedTable:
    """A table with the index of its first column in the looked-up numbers of the model.

    Parameters
    ----------
    table
        The numbers.
    number
        Number of the table in the model.
    first
        Index of its first column in the vector w.
    """

    table: Table
    number: int
    first: int

    @property
    def grid(self) -> tuple[str, float, float, int, int | None]:
        """Argument, lower end, step and number of points; tables that share them share one index.

        Breakpoints belong to one table: its number is the last item.
        """
        table, own = self.table, None if self.table.breakpoints is None else self.number
        return (table.argument, table.lower, table.step, table.values.shape[0], own)

    def columns(self, used: set[int]) -> list[int]:
        """Return the columns that are used.

        Parameters
        ----------
        used
            Indices into w.
        """
        return [c for c in range(len(self.table.columns)) if self.first + c in used]


def indexed_tables(model: FlatModel) -> list[IndexedTable]:
    """Return the tables of a model with their indices.

    Parameters
    ----------
    model
        Any model.
    """
    result, first = [], 0
    for number, table in enumerate(model.tables):
        result.append(IndexedTable(table, number, first))
        first += len(table.columns)
    return result


def table_data(each: IndexedTable, real: Real) -> list[str]:
    """Return the definition of one table, row by row, and of its breakpoints where it has some.

    Parameters
    ----------
    each
        The table.
    real
        Number type.

    Raises
    ------
    ExportError
        If two breakpoints are the same number in this type.
    """
    rows, columns = each.table.values.shape
    names = ", ".join(f"{variable.name} [{variable.unit}]" for variable in each.table.columns)
    if each.table.breakpoints is None:
        title = f"Over {each.table.argument} from {each.table.lower!r} by {each.table.step!r}: {names}"
    else:
        title = f"Over {each.table.argument} at breakpoints_{each.number}: {names}"
    lines = [
        *_breakpoints(each, real),
        *wrapped(title),
        f"static const {real.name} table_{each.number}[{rows}][{columns}] = {{",
    ]
    lines += ["    {" + ", ".join(real.literal(float(v)) for v in row) + "}," for row in each.table.values]
    return [*lines, "};"]


def look_up(model: FlatModel, real: Real, arguments: Mapping[str, str], used: set[int]) -> list[str]:
    """Return the statements that define ``w<i>`` for the looked-up numbers that are used.

    Parameters
    ----------
    model
        The model.
    real
        Number type.
    arguments
        C text of each state and input by name.
    used
        Indices into w.
    """
    lines: list[str] = []
    indexed: dict[tuple[str, float, float, int, int | None], int] = {}
    for each in indexed_tables(model):
        columns = each.columns(used)
        if not columns:
            continue
        if each.grid not in indexed:
            indexed[each.grid] = each.number
            lines += _index(each, real, arguments[each.table.argument])
        k = indexed[each.grid]
        n = f"row_{each.number}"
        lines.append(f"const {real.name} *const {n} = table_{each.number}[left_{k}];")
        lines.append(f"const {real.name} *const {n}_next = table_{each.number}[left_{k} + 1];")
        lines += [
            f"const {real.name} w{each.first + c} = {n}[{c}] + share_{k} * ({n}_next[{c}] - {n}[{c}]);"
            for c in columns
        ]
    return lines


def look_up_slopes(model: FlatModel, real: Real, arguments: Mapping[str, str], used: set[int]) -> list[str]:
    """Return the statements that define ``slope<i>``, the slope of ``w<i>`` over the argument of its table.

    They stand behind those of :func:`look_up`. Beyond the ends of a table, where it is held, slopes are 0.

    Parameters
    ----------
    model
        The model.
    real
        Number type.
    arguments
        C text of each state and input by name.
    used
        Indices into w.
    """
    lines: list[str] = []
    widths: dict[tuple[str, float, float, int, int | None], int] = {}
    zero = real.literal(0.0)
    for each in indexed_tables(model):
        columns = each.columns(used)
        if not columns:
            continue
        k, b, last = each.number, f"breakpoints_{each.number}", each.table.values.shape[0] - 1
        if each.grid not in widths:
            widths[each.grid] = k
            at = arguments[each.table.argument]
            placed = each.table.step != 0.0
            inside = (
                f"raw_{k} > {zero} && raw_{k} < {real.literal(float(last))}"
                if placed
                else f"{at} > {b}[0] && {at} < {b}[{last}]"
            )
            per = (
                real.literal(1.0 / each.table.step)
                if placed
                else f"{real.literal(1.0)} / ({b}[left_{k} + 1] - {b}[left_{k}])"
            )
            lines.append(f"const {real.name} per_{k} = {inside} ? {per} : {zero};")
        n, per = f"row_{k}", f"per_{widths[each.grid]}"
        lines += [
            f"const {real.name} slope{each.first + c} = ({n}_next[{c}] - {n}[{c}]) * {per};" for c in columns
        ]
    return lines


def table_bytes(model: FlatModel, real: Real) -> int:
    """Return the flash that the tables of a model take in C, in bytes: numbers and breakpoints.

    Parameters
    ----------
    model
        Any model.
    real
        Number type.
    """
    size = 4 if real.name == "float" else 8
    numbers = [t.values.size + (0 if t.breakpoints is None else len(t.breakpoints)) for t in model.tables]
    searched = [
        _starts(each, real)[0] for each in indexed_tables(model) if each.table.breakpoints is not None
    ]
    return size * sum(numbers) + sum(len(starts) * _start_bytes(starts) for starts in searched)


def _breakpoints(each: IndexedTable, real: Real) -> list[str]:
    points = each.table.breakpoints
    if points is None:
        return []
    kept = [real.round(float(v)) for v in points]
    for one, other, point in zip(kept, kept[1:], points[1:], strict=False):
        if not one < other:
            raise ExportError(
                f"table over '{each.table.argument}'",
                f"two breakpoints near {point:.9g} are one number in {real.name}",
                next_step="export with real='double', or keep breakpoints further apart",
            )
    rows = textwrap.wrap(", ".join(real.literal(v) for v in kept) + ",", 100, break_on_hyphens=False)
    numbers = [f"    {row}" for row in rows]
    title = f"Grid points of table_{each.number} over {each.table.argument}"
    head = f"static const {real.name} breakpoints_{each.number}[{len(kept)}] = {{"
    lines = [*wrapped(title), head, *numbers, "};"]
    starts, _ = _starts(each, real)
    if starts:
        kind = f"uint{8 * _start_bytes(starts)}_t"
        rows = textwrap.wrap(", ".join(f"{v}u" for v in starts) + ",", 100)
        lines += [
            *wrapped(f"First of the cells that meet equal parts of the range of breakpoints_{each.number}")
        ]
        lines += [f"static const {kind} start_{each.number}[{len(starts)}] = {{"]
        lines += [*(f"    {row}" for row in rows), "};"]
    return lines


def _index(each: IndexedTable, real: Real, argument: str) -> list[str]:
    return _searched(each, real, argument) if each.table.step == 0.0 else _placed(each, real, argument)


def _searched(each: IndexedTable, real: Real, argument: str) -> list[str]:
    """Return the statements that find the cell among breakpoints, by the same halvings for every argument."""
    k, cells = each.number, each.table.values.shape[0] - 1
    b, (starts, span) = f"breakpoints_{k}", _starts(each, real)
    lines = [
        f"const {real.name} above_{k} = {argument} > {b}[0] ? {argument} : {b}[0]; "
        "/* NaN becomes the lower end */",
        f"const {real.name} place_{k} = above_{k} < {b}[{cells}] ? above_{k} : {b}[{cells}];",
    ]
    if starts:
        scale = real.literal(_scale(each, real, len(starts) - 1))
        lines.append(f"int32_t left_{k} = start_{k}[(int32_t)((place_{k} - {b}[0]) * {scale})];")
    else:
        lines.append(f"int32_t left_{k} = 0;")
    while span > 1:
        half = span // 2
        lines.append(f"left_{k} += (place_{k} >= {b}[left_{k} + {half}]) ? {half} : 0;")
        span -= half
    width = f"({b}[left_{k} + 1] - {b}[left_{k}])"
    return [*lines, f"const {real.name} share_{k} = (place_{k} - {b}[left_{k}]) / {width};"]


def _start_bytes(starts: list[int]) -> int:
    return 1 if max(starts, default=0) < 256 else 2


def _scale(each: IndexedTable, real: Real, parts: int) -> float:
    """Return parts per unit of the argument, such that the last point falls into the last part."""
    points = each.table.breakpoints
    assert points is not None
    first, last = real.round(float(points[0])), real.round(float(points[-1]))
    return real.round(parts / (last - first))


def _starts(each: IndexedTable, real: Real) -> tuple[list[int], int]:
    """Return the first cell to be searched for equal parts of the range, and how many cells may follow it.

    As few parts are taken as leave the fewest halvings; a few cells are searched without.
    """
    points = each.table.breakpoints
    assert points is not None
    kept = np.array([real.round(float(v)) for v in points])
    cells = len(kept) - 1
    trials = (
        [([], cells)] if cells <= _SEARCHED_WHOLE else [_parted(kept, each, real, parts) for parts in _PARTS]
    )
    return min(trials, key=lambda pair: ((pair[1] - 1).bit_length(), len(pair[0])))


def _parted(kept: Array, each: IndexedTable, real: Real, parts: int) -> tuple[list[int], int]:
    cells = len(kept) - 1
    edges = np.arange(-1, parts + 2) / _scale(each, real, parts) + kept[0]
    # Rounding may place an argument into the neighbouring part: one thousandth of a part is allowed for.
    slack = 1e-3 * (edges[1] - edges[0])
    lower = np.searchsorted(kept, edges[1:-1] - slack, side="right") - 1
    upper = np.searchsorted(kept, edges[2:] + slack, side="right") - 1
    lower, upper = np.clip(lower, 0, cells - 1), np.clip(upper, 0, cells - 1)
    span = int((upper - lower).max()) + 1
    return [int(v) for v in np.minimum(lower, cells - span)], span


def _placed(each: IndexedTable, real: Real, argument: str) -> list[str]:
    k, last = each.number, each.table.values.shape[0] - 1
    low, high = real.literal(0.0), real.literal(float(last))
    lower = each.table.lower
    distance = f"{argument} {'-' if lower >= 0 else '+'} {real.literal(abs(lower))}"
    scaled = f"({distance}) * {real.literal(1.0 / each.table.step)}"
    return [
        f"const {real.name} raw_{k} = {scaled};",
        f"const {real.name} above_{k} = raw_{k} > {low} ? raw_{k} : {low}; /* NaN becomes the lower end */",
        f"const {real.name} place_{k} = above_{k} < {high} ? above_{k} : {high};",
        f"const int32_t floor_{k} = (int32_t)place_{k};",
        f"const int32_t left_{k} = floor_{k} < {last - 1} ? floor_{k} : {last - 1};",
        f"const {real.name} share_{k} = place_{k} - ({real.name})left_{k};",
    ]
