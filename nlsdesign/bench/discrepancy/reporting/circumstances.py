"""Under which circumstances a diagnosis was made: records, deck, day, command, and the rule that decided."""

from __future__ import annotations

import inspect
import re
from collections.abc import Iterator
from dataclasses import asdict, dataclass, fields
from typing import Any, NamedTuple

from ...identification.records.measurement import RecordSet


class RecordOfRun(NamedTuple):
    """One record as it was read."""

    # name, role, source: name, what it was used for, and the file with the changes made to its samples
    name: str
    role: str
    source: str
    # samples, duration, rate: number of samples, length in s, and samples per second
    samples: int
    duration: float
    rate: float


@dataclass(frozen=True)
class DiagnosisRun:
    """One run of a diagnosis."""

    # deck, folder: deck and folder of records, as given
    deck: str
    folder: str
    date: str  # day and time, ISO 8601
    command: str  # command line that repeats it
    version: str
    records: tuple[RecordOfRun, ...] = ()  # in the order in which they were read

    def to_dict(self) -> dict[str, Any]:
        """Return it for ``verdict.json``."""
        return {**asdict(self), "records": [each._asdict() for each in self.records]}


def records_of_run(records: RecordSet) -> tuple[RecordOfRun, ...]:
    """Return what there is to say of records."""
    return tuple(
        RecordOfRun(
            each.name,
            each.role,
            each.source,
            len(each.trace),
            float(each.trace.time[-1] - each.trace.time[0]),
            1.0 / each.step,
        )
        for each in records.records
    )


class Setting(NamedTuple):
    """One field of a frozen set of criteria, with what it means."""

    name: str
    value: Any
    meaning: str


def settings_of(criteria: Any) -> tuple[Setting, ...]:
    """Return the fields of a dataclass with their meanings, from their metadata or its docstring.

    ``criteria``: a dataclass whose fields say their ``meaning``, or its docstring does below ``Parameters``;
    ``None`` has no fields.
    """
    if criteria is None:
        return ()
    meaning = dict(_described(inspect.getdoc(type(criteria)) or ""))
    return tuple(
        Setting(
            field.name,
            getattr(criteria, field.name),
            str(field.metadata.get("meaning", meaning.get(field.name, ""))),
        )
        for field in fields(criteria)
    )


def _described(docstring: str) -> Iterator[tuple[str, str]]:
    """Yield each name below ``Parameters`` with its description in one line."""
    section = re.search(r"^Parameters\n-+\n(.*?)(?:\n\n\S+\n-+\n|\Z)", docstring, re.DOTALL | re.MULTILINE)
    names: list[str] = []
    lines: list[str] = []
    for line in [*(section[1].splitlines() if section else []), "end"]:
        if line and not line[0].isspace():
            text = " ".join(" ".join(lines).split())
            yield from ((name, text) for name in names if text)
            names, lines = [name.strip() for name in line.partition(":")[0].split(",")], []
        else:
            lines.append(line)
