"""``nlsdesign diagnose``: bench records against a deck."""

from __future__ import annotations

import json
import sys
from collections.abc import Mapping
from dataclasses import replace
from datetime import datetime
from pathlib import Path
from typing import TYPE_CHECKING, Any

import click

from ..foundation.command_words import typed_command
from .exported_machine import MACHINE, export_machine, export_option
from .named_paths import NamedPath
from .output import deck_option, examples, json_option, measured_option, show_json, spring_option
from .overwriting import c_names, out_option
from .range_remarks import warn
from .units import Number
from .workers import workers_option

if TYPE_CHECKING:
    from ..bench.discrepancy import Verdict
    from ..bench.identification import RecordSet
    from ..model import FlatModel
    from ..presentation.report.sections import Section
    from ..regeneration import Regeneration

_file = NamedPath(dir_okay=False)
_mapping = click.option("--mapping", type=_file, default=None, help="TOML that maps columns to signals.")

_OF_THIS_RUN_ALONE = ("next_record.csv", "regeneration.json")
"""Not every diagnosis writes these; one of an earlier run in the same folder would contradict the verdict."""


def _writes(given: Mapping[str, Any]) -> list[str]:
    """Return the names of the files that the options ask for."""
    names = ["verdict.json", "model.toml", "report.html", *_OF_THIS_RUN_ALONE]
    parts = [*(["observer"] if given["again"] else []), *(MACHINE if given["exports"] else [])]
    for part in dict.fromkeys(parts):
        names += [f"{part}.fmu", *(f"c/{name}" for name in c_names(part) if part != "plant")]
    return names


@click.command(
    epilog=examples(
        "nlsdesign diagnose --deck my.toml --records bench --out out/diagnosis",
        "nlsdesign diagnose --deck my.toml --records bench --hold-out 'last*' --regenerate --json",
    )
)
@deck_option
@click.option("--records", type=NamedPath(example="bench"), required=True, help="Folder of CSV files.")
@click.option("--hold-out", multiple=True, help="Glob of record names that no fit may use; repeatable.")
@_mapping
@click.option(
    "--regenerate",
    "again",
    is_flag=True,
    help="Design the torque observer again from the better model, write it as C and FMU, and compare it.",
)
@export_option
@click.option("--sample-time", type=Number("ms", above=0.0, up_to=1.0), default="1 ms", show_default=True,
              help="Of the observer.")  # fmt: skip
@spring_option
@measured_option
@workers_option
@out_option("out/diagnosis", writes=_writes)
@json_option
def diagnose(deck_name: str, records: Path, out: Path, as_json: bool, **options: Any) -> None:
    """Refit, locate, name and add the effects that the deck lacks; judge them on held-out records."""
    from ..bench.discrepancy import (
        DiagnosisRun,
        records_of_run,
        with_records_named,
        write_command,
        write_verdict,
    )
    from ..bench.discrepancy import diagnose as find_what_is_missing
    from ..bench.identification import load_records
    from ..components.assembly.deck_writer import declare
    from ..foundation.deck import load_deck
    from ..foundation.locations import version
    from ..foundation.progress import Steps
    from ..foundation.text_files import discard, make_folder
    from ..model import flatten
    from ..presentation.report import verdict_sections, write_report

    command = typed_command("nlsdesign", *sys.argv[1:])
    date = datetime.now().astimezone().isoformat(" ", "minutes")
    actuator = declare(load_deck(deck_name))
    mapping, hold_out = options["mapping"], options["hold_out"]
    measured = load_records(records, flatten(actuator), mapping=mapping, hold_out=hold_out)
    steps = Steps()
    with steps.step("diagnosis"):
        verdict = find_what_is_missing(actuator, measured, progress=steps.note)
    run = DiagnosisRun(deck_name, str(records), date, command, version(), records_of_run(measured))
    fitted_to = [each.name for each in measured.of("fit")]
    better = with_records_named(verdict.actuator, str(records), fitted_to, day=date[:10])
    verdict = replace(verdict, run=run, actuator=better)
    make_folder(out)
    for left_over in _OF_THIS_RUN_ALONE:
        discard(out / left_over)
    write_verdict(verdict, out)
    if verdict.experiment is not None:
        write_command(verdict.experiment, out / "next_record.csv")
    content, text = verdict.to_dict(str(out / "model.toml")), str(verdict)
    sections = verdict_sections(verdict)
    facts = {"deck": f"`{deck_name}`", "records": f"`{records}`", "date": date}
    title = f"{actuator.name}: what is missing"
    write_report(out / "report.html", *sections, title=title, facts=facts)
    remarks = _ranges_left(verdict, measured)
    content |= {"warnings": remarks}
    observer = None
    if options["again"]:
        # The diagnosis stands in its files already, whatever happens to the observer.
        with steps.step("observer"):
            result = _regenerated(flatten(actuator), verdict, measured, options)
            data, words, chapter = _written(result, out)
        observer = result.observer
        content, text = {**content, "regeneration": data}, f"{text}\n{words}"
        write_report(out / "report.html", *sections, *chapter, title=title, facts=facts)
    if options["exports"]:
        with steps.step("export"):
            machine = export_machine(flatten(verdict.actuator), out, observer=observer, **_chosen(options))
        content, text = content | machine.content(), "\n".join([text, *machine.words()])
    warn(remarks)
    if as_json:
        show_json(content)
        return
    click.echo(text)
    if verdict.experiment is not None:
        click.echo(f"command of the next record: {out / 'next_record.csv'}")
    click.echo(f"report: {out / 'report.html'}")


def _chosen(options: Mapping[str, Any]) -> dict[str, Any]:
    return {name: options[name] for name in ("sample_time", "spring", "measured")}


def _ranges_left(verdict: Verdict, measured: RecordSet) -> list[str]:
    """Return which laws of the better model the records take out of their stated range."""
    from ..bench.discrepancy import ranges_left
    from ..foundation.errors import NlsError

    try:
        left = ranges_left(verdict.actuator, measured)
    except NlsError:  # the verdict stands, and says itself what cannot be simulated
        return []
    step = "take a law that is stated to hold so far, or leave such motions out of the records"
    return [f"record {name}: {warning} -> {step}" for name, warning in left]


def _regenerated(
    declared: FlatModel, verdict: Verdict, records: RecordSet, options: Mapping[str, Any]
) -> Regeneration:
    """Design the observer of the better model, and compare it."""
    from ..model import flatten
    from ..regeneration import ObserverChoice, regenerate

    choice = ObserverChoice(**_chosen(options))
    return regenerate(declared, flatten(verdict.actuator), records, fits=verdict.fits, choice=choice)


def _written(result: Regeneration, out: Path) -> tuple[dict[str, Any], str, list[Section]]:
    """Write the observer of the better model; return data, text and sections on it."""
    from ..foundation.text_files import write_text
    from ..presentation.report import regeneration_sections
    from ..regeneration import write_regeneration

    files, lacking = write_regeneration(result, out)
    result = replace(result, reasons=(*result.reasons, *lacking))
    content = {**result.to_dict(), "files": [str(path) for path in files]}
    write_text(out / "regeneration.json", json.dumps(content, indent=2, ensure_ascii=False) + "\n")
    lines = [*result.words(), *result.reasons]
    if files:
        lines.append(f"written: {', '.join(content['files'])}")
    return content, "\n".join(lines), regeneration_sections(result, files)
