"""Table look-up in C: linear, held at the ends, in a fixed number of operations, defined for NaN.

A uniform grid needs no search. Of breakpoints, those near the argument are known by its part of the range;
they are searched in halves, always the same number of times.
"""

from __future__ import annotations

import textwrap
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from functools import cached_property

import numpy as np

from ...foundation.arrays import Array
from ...foundation.errors import ExportError
from ...model.flat import FlatModel, Table
from .c_text import Real, wrapped

_SEARCHED_WHOLE = 4
"""Cells up to which all are searched."""
_PARTS = (16, 32, 64, 128, 256)
"""Equal parts of a range, each of which knows its first cell."""

_Grid = tuple[str, float, float, int, int | None]


@dataclass(frozen=True)
class CTable:
    """A table of a model in C.

    ``number`` is that of the table in the model, ``first`` the index of its first column in the looked-up
    numbers of the model. ``owner`` is what its values are a member of; nothing where they are constants.
    """

    table: Table
    number: int
    first: int
    real: Real
    owner: str = ""

    @property
    def grid(self) -> _Grid:
        """Argument, lower end, step and number of points; tables that share them share one index.

        Breakpoints belong to one table: its number is the last item.
        """
        table, number = self.table, None if self.table.breakpoints is None else self.number
        return (table.argument, table.lower, table.step, table.values.shape[0], number)

    def columns(self, used: set[int]) -> list[int]:
        """Return the columns among the looked-up numbers that are used."""
        return [c for c in range(len(self.table.columns)) if self.first + c in used]

    def data(self) -> list[str]:
        """Return the definition of the table, row by row, and of its breakpoints where it has some.

        Two breakpoints that are the same number in this type are an ``ExportError``.
        """
        table, k = self.table, self.number
        if self.owner:
            return self._breakpoint_data() if table.breakpoints is not None else []
        names = ", ".join(f"{variable.name} [{variable.unit}]" for variable in table.columns)
        if table.breakpoints is None:
            grid = f"from {table.lower!r} by {table.step!r}"
        else:
            grid = f"at breakpoints_{k}"
        return [
            *(self._breakpoint_data() if table.breakpoints is not None else []),
            *wrapped(f"Over {table.argument} {grid}: {names}"),
            f"static const {self.real} table_{k}[{len(table.values)}][{len(table.columns)}] = {{",
            *("    {" + ", ".join(self.real.literal(v) for v in row) + "}," for row in table.values.tolist()),
            "};",
        ]

    def index(self, argument: str) -> list[str]:
        """Return the statements that find the row below an argument, and the share of the next row."""
        if self.table.step == 0.0:
            return self._searched(argument)
        k, real, last = self.number, self.real, self.table.values.shape[0] - 1
        low, high = real.literal(0.0), real.literal(float(last))
        lower = self.table.lower
        distance = f"{argument} {'-' if lower >= 0 else '+'} {real.literal(abs(lower))}"
        scaled = f"({distance}) * {real.literal(1.0 / self.table.step)}"
        return [
            f"const {real} raw_{k} = {scaled};",
            f"const {real} above_{k} = raw_{k} > {low} ? raw_{k} : {low}; /* NaN becomes the lower end */",
            f"const {real} place_{k} = above_{k} < {high} ? above_{k} : {high};",
            f"const int32_t floor_{k} = (int32_t)place_{k};",
            f"const int32_t left_{k} = floor_{k} < {last - 1} ? floor_{k} : {last - 1};",
            f"const {real} share_{k} = place_{k} - ({real})left_{k};",
        ]

    def per_unit(self, argument: str) -> str:
        """Return rows per unit of the argument: 0 beyond the ends, where the table is held."""
        k, real, last = self.number, self.real, self.table.values.shape[0] - 1
        zero, b = real.literal(0.0), f"breakpoints_{k}"
        if self.table.step != 0.0:
            inside = f"raw_{k} > {zero} && raw_{k} < {real.literal(float(last))}"
            per = real.literal(1.0 / self.table.step)
        else:
            inside = f"{argument} > {b}[0] && {argument} < {b}[{last}]"
            per = f"{real.literal(1.0)} / ({b}[left_{k} + 1] - {b}[left_{k}])"
        return f"{inside} ? {per} : {zero}"

    @cached_property
    def _points(self) -> Array:
        """Breakpoints as this type holds them."""
        assert self.table.breakpoints is not None
        return np.array([self.real.round(float(v)) for v in self.table.breakpoints])

    def _breakpoint_data(self) -> list[str]:
        points, k = self._points, self.number
        for i in np.flatnonzero(~(points[:-1] < points[1:])):
            assert self.table.breakpoints is not None
            raise ExportError(
                f"table over '{self.table.argument}'",
                f"two breakpoints near {self.table.breakpoints[i + 1]:.9g} are one number in {self.real}",
                next_step="export with real='double', or keep breakpoints further apart",
            )
        lines = [
            *wrapped(f"Grid points of table_{k} over {self.table.argument}"),
            *_row(f"{self.real} breakpoints_{k}", [self.real.literal(float(v)) for v in points]),
        ]
        starts, _ = self._starts
        if starts:
            lines += wrapped(f"First of the cells that meet equal parts of the range of breakpoints_{k}")
            kind = "uint8_t" if max(starts) < 256 else "uint16_t"
            lines += _row(f"{kind} start_{k}", [f"{v}u" for v in starts])
        return lines

    def _searched(self, argument: str) -> list[str]:
        """Return the statements that find the cell among breakpoints, by the same halvings always."""
        k, cells, real = self.number, self.table.values.shape[0] - 1, self.real
        b, (starts, span) = f"breakpoints_{k}", self._starts
        lines = [
            f"const {real} above_{k} = {argument} > {b}[0] ? {argument} : {b}[0]; "
            "/* NaN becomes the lower end */",
            f"const {real} place_{k} = above_{k} < {b}[{cells}] ? above_{k} : {b}[{cells}];",
        ]
        if starts:
            scale = real.literal(self._scale(len(starts) - 1))
            lines.append(f"int32_t left_{k} = start_{k}[(int32_t)((place_{k} - {b}[0]) * {scale})];")
        else:
            lines.append(f"int32_t left_{k} = 0;")
        while span > 1:
            half = span // 2
            lines.append(f"left_{k} += (place_{k} >= {b}[left_{k} + {half}]) ? {half} : 0;")
            span -= half
        width = f"({b}[left_{k} + 1] - {b}[left_{k}])"
        return [*lines, f"const {real} share_{k} = (place_{k} - {b}[left_{k}]) / {width};"]

    @cached_property
    def _starts(self) -> tuple[list[int], int]:
        """First cell to be searched for equal parts of the range, and how many cells may follow it.

        As few parts are taken as leave the fewest halvings; a few cells are searched without.
        """
        cells = len(self._points) - 1
        if cells <= _SEARCHED_WHOLE:
            return [], cells
        return min(
            (self._parted(parts) for parts in _PARTS),
            key=lambda pair: ((pair[1] - 1).bit_length(), len(pair[0])),
        )

    def _parted(self, parts: int) -> tuple[list[int], int]:
        points, cells = self._points, len(self._points) - 1
        edges = np.arange(-1, parts + 2) / self._scale(parts) + points[0]
        # Rounding may place an argument into the neighbouring part: one thousandth of a part is allowed for.
        slack = 1e-3 * (edges[1] - edges[0])
        lower = np.searchsorted(points, edges[1:-1] - slack, side="right") - 1
        upper = np.searchsorted(points, edges[2:] + slack, side="right") - 1
        lower, upper = np.clip(lower, 0, cells - 1), np.clip(upper, 0, cells - 1)
        span = int((upper - lower).max()) + 1
        return [int(v) for v in np.minimum(lower, cells - span)], span

    def _scale(self, parts: int) -> float:
        """Return parts per unit of the argument, such that the last point falls into the last part."""
        return self.real.round(parts / float(self._points[-1] - self._points[0]))


def c_tables(model: FlatModel, real: Real, *, owner: str = "") -> list[CTable]:
    """Return the tables of a model, in order, as constants or as members of something."""
    tables, first = [], 0
    for number, table in enumerate(model.tables):
        tables.append(CTable(table, number, first, real, owner))
        first += len(table.columns)
    return tables


def look_up(tables: Sequence[CTable], arguments: Mapping[str, str], used: set[int]) -> list[str]:
    """Return the statements that define ``w<i>`` for the looked-up numbers that are used.

    States and inputs are given as C text by name.
    """
    lines: list[str] = []
    indexed: dict[_Grid, int] = {}
    for table in tables:
        columns, real = table.columns(used), table.real
        if not columns:
            continue
        if table.grid not in indexed:
            indexed[table.grid] = table.number
            lines += table.index(arguments[table.table.argument])
        k, n = indexed[table.grid], f"row_{table.number}"
        lines.append(f"const {real} *const {n} = {table.owner}table_{table.number}[left_{k}];")
        lines.append(f"const {real} *const {n}_next = {table.owner}table_{table.number}[left_{k} + 1];")
        lines += [
            f"const {real} w{table.first + c} = {n}[{c}] + share_{k} * ({n}_next[{c}] - {n}[{c}]);"
            for c in columns
        ]
    return lines


def look_up_slopes(tables: Sequence[CTable], arguments: Mapping[str, str], used: set[int]) -> list[str]:
    """Return the statements that define ``slope<i>``, the slope of ``w<i>`` over the argument of its table.

    They stand behind those of :func:`look_up`.
    """
    lines: list[str] = []
    widths: dict[_Grid, int] = {}
    for table in tables:
        columns, k = table.columns(used), table.number
        if not columns:
            continue
        if table.grid not in widths:
            widths[table.grid] = k
            lines.append(f"const {table.real} per_{k} = {table.per_unit(arguments[table.table.argument])};")
        n, per = f"row_{k}", f"per_{widths[table.grid]}"
        lines += [
            f"const {table.real} slope{table.first + c} = ({n}_next[{c}] - {n}[{c}]) * {per};"
            for c in columns
        ]
    return lines


def _row(declaration: str, cells: Sequence[str]) -> list[str]:
    """Return the definition of a row of constants."""
    lines = textwrap.wrap(", ".join(cells) + ",", 100, break_on_hyphens=False)
    return [f"static const {declaration}[{len(cells)}] = {{", *(f"    {line}" for line in lines), "};"]
