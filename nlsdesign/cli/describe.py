"""``nlsdesign records describe``: the first look at the files of a bench."""

from __future__ import annotations

import math
from dataclasses import asdict
from pathlib import Path
from typing import TYPE_CHECKING

import click

from ..foundation.text_files import write_text
from .options import deck_option, joint_option, json_option, machine_of
from .output import examples, next_command, show_json, show_table
from .overwriting import out_file_option
from .typed_values import NamedPath

if TYPE_CHECKING:
    from ..bench.identification import RecordsDescription


@click.group()
def records() -> None:
    """Look at the records of a bench before anything is fitted."""


@records.command(
    epilog=examples(
        "nlsdesign records describe bench --deck my.toml --out bench/records.toml",
        "nlsdesign records describe bench --deck my.toml --json",
    )
)
@click.argument("folder", type=NamedPath(example="bench"))
@deck_option
@joint_option
@out_file_option("out/records.toml", "File for a mapping to begin with.", ending=".toml")
@json_option
def describe(folder: Path, deck_name: str, joint: str | None, out: Path, as_json: bool) -> None:
    """Tell what files hold, and write a records.toml to edit. Columns, units, clocks, gaps, faults."""
    from ..bench.identification import describe_records
    from ..model import flatten

    description = describe_records(folder, flatten(machine_of(deck_name)), joint=joint)
    # Of files that cannot be read nothing is known that could be mapped.
    written = str(out) if description.columns else ""
    if written:
        write_text(out, description.mapping())
    if as_json:
        notes = (*description.records.findings, *description.records.remarks) if description.records else ()
        roles = {r.name: r.role for r in description.records.records} if description.records else {}
        content = {
            "time": description.time,
            "time_unit": description.time_unit,
            "files": [asdict(file) for file in description.files],
            "columns": [asdict(column) for column in description.columns],
            "records": roles,
            "remarks": [f"{note.place}: {note.text}" for note in notes],
            "undecided": [column.head for column in description.undecided],
            "problem": description.problem,
            "written": written,
        }
        show_json(content)
    else:
        _show(description)
        beside = written and Path(out).resolve() == (Path(folder) / "records.toml").resolve()
        if written:
            step = "" if beside else "; put it beside the records as records.toml, or name it by --mapping"
            click.echo(f"written: {out}{step}")
        if not description.problem:
            words = ["fit", "--deck", deck_name, "--records", folder]
            words += [] if beside else ["--mapping", out]
            words += ["--joint", joint] if joint else []
            click.echo(f"next: {next_command(*words)}")
    if description.problem or description.undecided:
        raise click.exceptions.Exit(1)


def _show(description: RecordsDescription) -> None:
    columns = ("file", "rows", "seconds", "samples/s", "gaps", "remark")
    rows = [
        (f.name, str(f.rows), *(_number(v) for v in (f.seconds, f.rate)), str(f.gaps), f.problem)
        for f in description.files
    ]
    show_table("Files", columns, rows)
    heads = ("column", "unit", "signal", "clock", "from", "to", "noise", "count")
    cells = [
        (
            *(c.head, c.unit or "none", " or ".join(c.signals) or "none", c.clock or description.time),
            *(_number(v) for v in (c.smallest, c.largest, c.noise, c.quantum)),
        )
        for c in description.columns
    ]
    if cells:
        show_table("Columns, in the units of the files", heads, cells)
    if description.records is not None:
        named = [(r.name, str(len(r.trace)), r.role.replace("_", " ")) for r in description.records.records]
        show_table("Records", ("record", "rows", "used for"), named)
        for note in (*description.records.findings, *description.records.remarks):
            click.echo(f"{note.place}: {note.text}")
    for column in description.columns:
        if column.differs:
            click.echo(f"column '{column.head}': {column.differs}")
    for column in description.undecided:
        click.echo(f"undecided: '{column.head}': {description.question(column)}")
    if description.problem:
        click.echo(f"cannot be read as it stands: {description.problem}")


def _number(value: float) -> str:
    return f"{value:.4g}" if math.isfinite(value) else ""
