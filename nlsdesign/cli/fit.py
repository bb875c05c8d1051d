"""``nlsdesign fit``: the declared numbers refitted to bench records."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import replace
from datetime import datetime
from pathlib import Path
from typing import Any

import click

from ..foundation.quantity import typeset_unit
from ..foundation.written_numbers import with_error
from .exported_machine import MACHINE, ExportedMachine, export_machine, export_option
from .named_paths import NamedPath
from .observer import sample_time_option
from .output import (
    deck_option,
    examples,
    json_option,
    measured_option,
    next_command,
    show_json,
    show_table,
    spring_option,
)
from .overwriting import c_names, out_option
from .units import Number

_file = NamedPath(dir_okay=False)


def _writes(given: Mapping[str, Any]) -> list[str]:
    """Return the names of the files that the options ask for."""
    names = ["fit.json", "model.toml", "report.html"]
    for part in MACHINE if given["exports"] else ():
        names += [f"{part}.fmu", *(f"c/{name}" for name in c_names(part) if part != "plant")]
    return names


@click.command(
    epilog=examples(
        "nlsdesign fit --deck my.toml --records bench --out out/fit",
        "nlsdesign fit --deck my.toml --records bench --hold-out 'last*' --window '1 s' --json",
    )
)
@deck_option
@click.option("--records", type=NamedPath(example="bench"), required=True, help="Folder of records.")
@click.option("--hold-out", multiple=True, help="Glob of record names that no fit may use; repeatable.")
@click.option("--mapping", type=_file, default=None, help="TOML that maps columns to signals.")
@click.option("--window", type=Number("s", above=0.0), default=None,
              help="Simulate the whole model over windows instead, for instance '1 s'.")  # fmt: skip
@export_option
@sample_time_option
@spring_option
@measured_option
@out_option("out/fit", writes=_writes)
@json_option
def fit(deck_name: str, records: Path, out: Path, as_json: bool, **options: Any) -> None:
    """Refit the numbers that the deck declares with a spread; nothing is added to the model."""
    from ..bench.discrepancy import refit, with_records_named, write_refit
    from ..bench.identification import load_records
    from ..components.assembly.deck_writer import declare
    from ..foundation.deck import load_deck
    from ..foundation.progress import Steps
    from ..model import flatten
    from ..presentation.report import write_fit_report

    actuator = declare(load_deck(deck_name))
    mapping, hold_out = options["mapping"], options["hold_out"]
    measured = load_records(records, flatten(actuator), mapping=mapping, hold_out=hold_out)
    steps = Steps()
    with steps.step("fit"):
        result = refit(actuator, measured, window=options["window"], progress=steps.note)
    fitted_to = [each.name for each in measured.of("fit")]
    day = datetime.now().astimezone().date().isoformat()
    result = replace(result, actuator=with_records_named(result.actuator, str(records), fitted_to, day=day))
    file, deck = write_refit(result, out)
    facts = {"deck": f"`{deck_name}`", "records": f"`{records}`"}
    page = write_fit_report(out / "report.html", result, facts=facts, files=(file, deck))
    machine = ExportedMachine({}, ())
    if options["exports"]:
        with steps.step("export"):
            chosen = {name: options[name] for name in ("sample_time", "spring", "measured")}
            machine = export_machine(flatten(result.actuator), out, **chosen)
    if as_json:
        show_json(
            {**result.to_dict(str(deck)), "report": page, **(machine.content() if options["exports"] else {})}
        )
        return
    numbers = [
        (
            n.name,
            f"{n.declared:.4g}",
            with_error(n.fitted, n.standard_error),
            typeset_unit(n.unit),
            f"{n.strain:+.2f}",
        )
        for n in result.numbers
    ]
    show_table("Numbers", ("name", "declared", "fitted", "unit", "moved, in spreads"), numbers)
    errors = [
        (e.block, e.role.replace("_", " "), *(f"{v:.3g}" for v in e[2:5]), typeset_unit(e.unit))
        for e in result.errors()
    ]
    show_table("Errors, rms", ("block", "records", "declared", "fitted", "noise floor", "unit"), errors)
    for sentence in result.words():
        click.echo(sentence)
    for sentence in machine.words():
        click.echo(sentence)
    click.echo(f"report: {page}")
    following = next_command("diagnose", "--deck", deck, "--records", records, *_as_read(mapping, hold_out))
    click.echo(f"written: {file} and {deck}; next: {following}")


def _as_read(mapping: Path | None, hold_out: Sequence[str]) -> list[str]:
    """Return the options with which another command reads the same records in the same way."""
    words = [item for name in hold_out for item in ("--hold-out", name)]
    return words if mapping is None else [*words, "--mapping", str(mapping)]
