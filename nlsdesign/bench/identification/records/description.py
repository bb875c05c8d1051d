"""What a folder of records holds, as far as files and deck tell, and a mapping to begin with."""

from __future__ import annotations

import json
import tempfile
from collections.abc import Iterable, Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import NamedTuple

import numpy as np

from ....foundation.arrays import Array
from ....foundation.errors import NlsError
from ....foundation.quantity import parse_unit, same_dimension
from ....foundation.written_numbers import name_and_unit
from ....model import FlatModel
from ..residuals import noise_of, quantum_of
from .column_heads import signals_for, times_among, times_without_unit, torque_in_doubt
from .mapping import Inputs
from .measurement import RecordSet, load_records
from .quality import GAP
from .sampling import FORMS
from .table_files import RecordTable, read_table, table_files

_LONGEST_STEP = 0.5
"""Samples further apart than this, in the numbers of a clock without unit, are taken for milliseconds."""

_ROUNDING = 1e-12
_NOISIER, _FARTHER = 3.0, 30.0
"""Times the noise, and the size, of most files beyond which a file differs from them."""


@dataclass(frozen=True)
class DescribedColumn:
    """One column, by its head, in all files that have it."""

    # head, unit: as in the file; the unit is empty where the head has none
    head: str
    unit: str
    # signals: what it may hold; one name where that is certain, none where the deck reads nothing in this
    # unit
    signals: tuple[str, ...]
    # clock, clock_unit: head and unit of its time; the head is empty for the clock of most columns
    clock: str
    clock_unit: str
    rate: float  # usual samples a second; nan without a clock
    # noise, quantum: standard deviation of the white noise, of the files in the middle, and smallest step
    # between two values, in the unit of the file
    noise: float
    quantum: float
    # smallest, largest: ends of its values in all files, in the unit of the file
    smallest: float
    largest: float
    drives: bool  # whether it is an input of the model, or the reading of one
    doubt: str = ""  # what else it may be, beside the one signal in its unit
    differs: str = ""  # in which file it is much larger or noisier than in most; empty where in none


@dataclass(frozen=True)
class DescribedFile:
    """One file."""

    name: str
    rows: int  # of numbers on the clock of most columns
    # seconds, rate: length in s and usual samples a second; nan without a clock
    seconds: float
    rate: float
    gaps: int  # number of steps of the clock longer than 1.5 usual ones
    problem: str = ""  # why it cannot be read; empty where it can


@dataclass(frozen=True, eq=False)
class RecordsDescription:
    """What a folder of records holds."""

    # time, time_unit: head and unit of the clock; the head is empty where none was found
    time: str
    time_unit: str
    time_is_guessed: bool  # whether the unit of the clock is none that the head gives
    # files, columns: what was found
    files: tuple[DescribedFile, ...]
    columns: tuple[DescribedColumn, ...]
    records: RecordSet | None = None  # as load_records reads them with this mapping; None where it cannot
    problem: str = ""  # why it cannot; empty where it can

    @property
    def clocks(self) -> tuple[str, ...]:
        """Heads of further clocks."""
        return tuple(dict.fromkeys(c.clock for c in self.columns if c.clock))

    @property
    def undecided(self) -> tuple[DescribedColumn, ...]:
        """Columns that cannot be mapped by what heads and deck tell."""
        return tuple(column for column in self.columns if self.question(column))

    def question(self, column: DescribedColumn) -> str:
        """Return what is left to decide on a column of this description; empty where nothing is."""
        if not column.unit:
            return "its head names no unit"
        if column.clock and column.clock_unit != self.time_unit:
            own = f"its clock '{column.clock}' is in {column.clock_unit or 'no unit'}"
            return f"{own}, '{self.time}' is in {self.time_unit}: write both in one unit"
        alone = len(column.signals) == 1 and [c.signals for c in self.columns].count(column.signals) == 1
        if alone and not column.doubt:
            return ""
        return " or ".join(column.signals) + column.doubt or "no sensor of the deck reads in its unit"

    def mapping(self) -> str:
        """Return a ``records.toml`` to begin with; what is not certain is a comment."""
        lines = [
            "# What the heads and the deck tell. Lines that begin with # are choices that are left to you."
        ]
        if self.records is not None:
            held = [r.name for r in self.records.records if r.role == "held_out"]
            lines += [f"# held_out = {json.dumps(held, ensure_ascii=False)}    # the default"]
        # A column that is left out slows nobody down; who takes it in finds the rate beside it.
        used = [c for c in self.columns if not self.question(c)]
        if any(c.clock for c in used):
            lines += [f"resample_Hz = {_slowest(used):.4g}    # one clock for all columns"]
        unit = f"unit = {_quoted(self.time_unit)}"
        guessed = "    # guessed from the steps: correct it" if self.time_is_guessed else ""
        lines += ["", "[time]", f"column = {_quoted(self.time or 't_s')}", unit + guessed]
        for column in self.columns:
            lines += ["", *self._table(column)]
        return "\n".join(lines) + "\n"

    def _table(self, column: DescribedColumn) -> list[str]:
        question = self.question(column)
        mark = "# " if question else ""
        lines = [f"# '{column.head}': {question}"] if question else []
        signal = _quoted(column.signals[0] if column.signals else "")
        lines += [f"{mark}[columns.{_quoted(column.head)}]", f"{mark}signal = {signal}"]
        lines += [f"{mark}unit = {_quoted(column.unit)}"]
        if column.clock:
            lines += [f"{mark}time = {_quoted(column.clock)}"]
            lines += [f"# needs resample_Hz = {_slowest(self.columns):.4g} at the top"] if question else []
        lines += [f"# noise = {column.noise:.3g}    # as estimated", f"# quantum = {column.quantum:.4g}"]
        if column.drives:
            lines += ["# How it runs between its samples; where no line is chosen, the records are asked:"]
            lines += [f'# between_samples = "{form.name}"    # {form.words}' for form in FORMS]
        return lines


def _slowest(columns: Iterable[DescribedColumn]) -> float:
    return min(column.rate for column in columns if column.rate > 0.0)


def _quoted(text: str) -> str:
    return json.dumps(text, ensure_ascii=False)


def describe_records(folder: Path, model: FlatModel, *, joint: str | None = None) -> RecordsDescription:
    """Look at the files of a folder and tell what they hold, without refusing what is not clear.

    Parameters
    ----------
    folder
        Of records, as for :func:`~.measurement.load_records`; a ``records.toml`` in it is not read.
    model
        Whose signals may have been measured.
    joint
        Name of a joint in logs of a robot: only its columns are looked at.

    Returns
    -------
    RecordsDescription
        Its ``mapping()`` is a ``records.toml``.

    Raises
    ------
    MeasurementError
        If the folder does not exist or holds no table.
    """
    tables: dict[str, RecordTable] = {}
    problems: dict[str, str] = {}
    for file in table_files(Path(folder)):
        try:
            table = read_table(file)
            tables[file.name] = table if joint is None else table.of_joint(joint)
        except NlsError as error:
            problems[file.name] = str(error)
    whole = max(tables.values(), key=lambda table: len(table.heads), default=RecordTable("", {}))
    time, unit, guessed = _clock(whole)
    files = [_described(name, table, time, unit) for name, table in tables.items()]
    files += [DescribedFile(name, 0, np.nan, np.nan, 0, text) for name, text in problems.items()]
    columns = tuple(_columns(whole, tables, time, unit, model))
    description = RecordsDescription(time, unit, guessed, tuple(sorted(files, key=lambda f: f.name)), columns)
    records, problem = _tried(Path(folder), model, description, joint)
    return RecordsDescription(time, unit, guessed, description.files, description.columns, records, problem)


def _clock(table: RecordTable) -> tuple[str, str, bool]:
    """Return head and unit of the clock of a table, and whether the unit is guessed from the steps."""
    for head in table.heads:
        unit = table.units.get(head)
        if unit and same_dimension(unit, "s"):
            return head, unit, False
    named = times_among(table.heads)
    if named:
        return (*named[0], False)
    # Whatever it is called in a language that is not known here.
    for head in table.heads:
        if _is_clock(head, table):
            return head, name_and_unit(head)[1] or "s", False
    for head in times_without_unit(table.heads):
        step = float(np.median(np.diff(table.given[head])))
        return head, "ms" if step > _LONGEST_STEP else "s", True
    return "", "s", True


def _described(name: str, table: RecordTable, time: str, unit: str) -> DescribedFile:
    if time not in table.given:
        return DescribedFile(name, 0, np.nan, np.nan, 0, f"has no column '{time}'" if time else "has no time")
    clock = table.given[time] * parse_unit(unit).factor
    steps = np.diff(clock)
    usual = float(np.median(steps))
    if usual <= 0.0:
        return DescribedFile(name, len(clock), np.nan, np.nan, 0, f"its time '{time}' does not ascend")
    gaps = int(np.sum(steps > GAP * usual))
    return DescribedFile(name, len(clock), float(clock[-1] - clock[0]), 1.0 / usual, gaps)


def _columns(
    table: RecordTable, tables: Mapping[str, RecordTable], time: str, time_unit: str, model: FlatModel
) -> list[DescribedColumn]:
    """Return the columns that are no clocks; each belongs to the last clock before it of its own length."""
    given = Inputs.of(model)
    inputs = given.commanded | given.shown
    clocks = [head for head in table.heads if _is_clock(head, table)] or [time]
    result = []
    for place, head in enumerate(table.heads):
        if head in clocks or head == time:
            continue
        values = table.given[head]
        over = {name: each.given[head] for name, each in tables.items() if len(each.given.get(head, ()))}
        name, unit = name_and_unit(head)
        unit = unit or table.units.get(head, "")
        same = [c for c in clocks if c in table.given and len(table.given[c]) == len(values)]
        before = [c for c in same if table.heads.index(c) < place] or same or [time]
        signals = signals_for(name, unit, model) if unit else ()
        own = before[-1]
        clock_unit = time_unit if own == time else name_and_unit(own)[1] or table.units.get(own) or ""
        step = np.median(np.diff(table.given[own])) if own in table.given else 0.0
        result.append(
            DescribedColumn(
                head=head, unit=unit, signals=signals, clock="" if own == time else own,
                clock_unit=clock_unit,
                rate=float(1.0 / (step * parse_unit(clock_unit).factor)) if step > 0.0 else np.nan,
                drives=any(signal in inputs for signal in signals),
                doubt=torque_in_doubt(name, signals, model), **_over_files(over)._asdict(),
            )
        )  # fmt: skip
    return result


class _OverFiles(NamedTuple):
    """Numbers of one column over all files, as :class:`DescribedColumn` has them."""

    noise: float
    quantum: float
    smallest: float
    largest: float
    differs: str


def _over_files(values: Mapping[str, Array]) -> _OverFiles:
    """Return the numbers of a column, and in which file they are far from those of most."""
    if not values:
        return _OverFiles(np.nan, 0.0, np.nan, np.nan, "")
    sizes = {file: float(np.max(np.abs(column))) for file, column in values.items()}
    # Rounding of sums is no noise.
    noises = {f: n if (n := noise_of(v)) > _ROUNDING * np.ptp(v) else 0.0 for f, v in values.items()}
    noise, size = (float(np.median(list(group.values()))) for group in (noises, sizes))
    quantum = min((q for q in map(quantum_of, values.values()) if q), default=0.0)
    noisy = max(noises, key=noises.__getitem__)
    far = max(sizes, key=lambda file: max(sizes[file], size) / max(min(sizes[file], size), 1e-300))
    differs = []
    if noises[noisy] > _NOISIER * max(noise, quantum):
        differs.append(f"its noise is {noises[noisy]:.3g} in {noisy}, {noise:.3g} in most files")
    low, high = sorted((sizes[far], size))
    if high > _FARTHER * low:
        differs.append(f"it goes to {sizes[far]:.3g} in {far}, to {size:.3g} in most files")
    smallest, largest = (float(f([f(v) for v in values.values()])) for f in (np.min, np.max))
    return _OverFiles(noise, quantum, smallest, largest, "; ".join(differs))


def _is_clock(head: str, table: RecordTable) -> bool:
    """Tell whether a column is in a unit of time and ascends throughout."""
    unit = name_and_unit(head)[1] or table.units.get(head)
    values: Array = table.given[head]
    return bool(unit and same_dimension(unit, "s") and len(values) > 1 and np.all(np.diff(values) > 0.0))


def _tried(
    folder: Path, model: FlatModel, description: RecordsDescription, joint: str | None
) -> tuple[RecordSet | None, str]:
    """Return the records as they are read with the mapping that was found, or why they cannot be."""
    with tempfile.TemporaryDirectory() as scratch:
        mapping = Path(scratch) / "records.toml"
        mapping.write_text(description.mapping(), encoding="utf-8")
        try:
            return load_records(folder, model, mapping=mapping, joint=joint), ""
        except NlsError as error:
            return None, str(error)
