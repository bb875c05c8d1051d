"""``nlsdesign fit``, ``diagnose`` and ``observer calibrate``: what records from the bench say of a deck."""

from __future__ import annotations

import sys
from collections.abc import Mapping, Sequence
from datetime import datetime
from pathlib import Path
from typing import TYPE_CHECKING, Any

import click

from ..foundation.errors import MeasurementError, typed_command
from ..foundation.quantity import typeset_unit, with_error
from .export_block import block_option, written_block
from .options import (
    DECK_HELP,
    deck_option,
    export_option,
    hold_out_option,
    joint_option,
    json_option,
    machine_of,
    mapping_option,
    measured_option,
    sample_time_option,
    spring_option,
    workers_option,
)
from .output import examples, next_command, show_json, show_lines, show_table, warn
from .overwriting import c_names, out_option
from .typed_values import NamedPath, Number

if TYPE_CHECKING:
    from ..bench.calibration import CalibrationPlan

_PARTS = ("plant", "observer", "controller", "torque_loop")
"""What --export writes; the library that does it is not loaded for an option."""
CALIBRATIONS = ("hung_weight", "load_cell", "free_run")
"""As :data:`nlsdesign.bench.calibration.KINDS`, which is not loaded for an option."""


def _part_files(parts: Sequence[str]) -> list[str]:
    """Return the names of the files of parts of a machine: an FMU of each, C of those that are sampled."""
    return [
        name
        for part in dict.fromkeys(parts)
        for name in (f"{part}.fmu", *(f"c/{file}" for file in c_names(part) if part != "plant"))
    ]


@click.command(
    epilog=examples(
        "nlsdesign fit --deck my.toml --records bench --out out/fit",
        "nlsdesign fit --deck my.toml --records bench --hold-out 'last*' --window '1 s' --json",
    )
)
@deck_option
@click.option("--records", type=NamedPath(example="bench"), required=True, help="Folder of records.")
@hold_out_option
@mapping_option
@joint_option
@click.option("--window", type=Number("s", above=0.0), default=None,
              help="Simulate the whole model over windows instead, for instance '1 s'.")  # fmt: skip
@export_option
@sample_time_option
@spring_option
@measured_option
@out_option(
    "out/fit",
    writes=lambda given: [
        *("fit.json", "model.toml", "report.html"),
        *_part_files(_PARTS if given["exports"] else ()),
    ],
)
@json_option
def fit(deck_name: str, records: Path, out: Path, as_json: bool, **options: Any) -> None:
    """Refit the numbers that have a spread. Nothing is added to the model."""
    from ..bench.discrepancy import refit, refit_of_run, write_refit
    from ..bench.identification import load_records
    from ..foundation.progress import Steps
    from ..model import flatten
    from ..presentation.report import write_fit_report
    from ..regeneration import export_machine

    actuator = machine_of(deck_name)
    reading = {name: options[name] for name in ("mapping", "hold_out", "joint")}
    measured = load_records(records, flatten(actuator), **reading)
    steps = Steps()
    with steps.step("fit"):
        result = refit(actuator, measured, window=options["window"], progress=steps.note)
    day = datetime.now().astimezone().date().isoformat()
    result = refit_of_run(result, measured, folder=str(records), day=day)
    file, deck = write_refit(result, out)
    facts = {"deck": f"`{deck_name}`", "records": f"`{records}`"}
    page = write_fit_report(out / "report.html", result, facts=facts, files=(file, deck))
    machine = None
    if options["exports"]:
        with steps.step("export"):
            machine = export_machine(flatten(result.actuator), out, **_roles(options))
        write_fit_report(page, result, facts=facts, files=(file, deck, *machine.files))
    if as_json:
        exported = {} if machine is None else machine.content()
        show_json({**result.to_dict(str(deck)), "report": page, **exported})
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
        (
            e.block,
            e.role.replace("_", " "),
            *(f"{v:.3g}" for v in e[2:5]),
            typeset_unit(e.unit),
            "" if e.relative is None else f"{e.relative:.3g}",
        )
        for e in result.errors()
    ]
    heads = ("block", "records", "declared", "fitted", "noise floor", "unit", "relative, %")
    show_table("Errors, rms, and average relative error of the fitted", heads, errors)
    show_lines(result.words())
    show_lines(machine.findings() if machine else ())
    click.echo(f"report: {page}")
    following = next_command("diagnose", "--deck", deck, "--records", records, *as_read(**reading))
    click.echo(f"written: {file} and {deck}; next: {following}")


def as_read(mapping: Path | None, hold_out: Sequence[str], joint: str | None = None) -> list[str]:
    """Return the options with which another command reads the same records in the same way."""
    options = [item for name in hold_out for item in ("--hold-out", name)]
    options += [] if mapping is None else ["--mapping", str(mapping)]
    return options if joint is None else [*options, "--joint", joint]


def _roles(options: Mapping[str, Any]) -> dict[str, Any]:
    """Return what observer and controller are designed for."""
    return {name: options[name] for name in ("sample_time", "spring", "measured")}


def _diagnosis_files(given: Mapping[str, Any]) -> list[str]:
    """Return the names of the files that the options ask for, and of what an earlier diagnosis has left."""
    parts = [*(["observer", "controller"] if given["again"] else []), *(_PARTS if given["exports"] else [])]
    names = [
        "verdict.json",
        "model.toml",
        "report.html",
        "next_record.csv",
        "regeneration.json",
        *_part_files(parts),
    ]
    joints = [joint.partition("=")[0] for joint in given["joints"] if "=" in joint]
    return [f"{joint}/{name}" for joint in joints for name in names] or names


def _questions(deck: str | None, joints: Sequence[str], out: Path) -> list[tuple[str | None, str, Path]]:
    """Return joint, deck and folder of what is to be diagnosed: one, or joints of a log with their decks."""
    several = [joint.partition("=") for joint in joints]
    if len(joints) <= 1 and not any(sign for _, sign, _ in several):
        if deck is None:
            raise MeasurementError("--deck", "is missing", next_step="name the deck: --deck my.toml")
        return [(joints[0] if joints else None, deck, out)]
    for name, sign, named in several:
        if not (name and sign and named) or deck is not None or [n for n, _, _ in several].count(name) > 1:
            raise MeasurementError(
                f"--joint {name}{sign}{named}", "is not one joint with its deck among others",
                next_step="write --joint elbow=elbow.toml --joint knee=knee.toml, without --deck",
            )  # fmt: skip
    return [(name, named, out / name) for name, _, named in several]


@click.command(
    epilog=examples(
        "nlsdesign diagnose --deck my.toml --records bench --out out/diagnosis",
        "nlsdesign diagnose --deck my.toml --records bench --hold-out 'last*' --regenerate --json",
        "nlsdesign diagnose --joint elbow=elbow.toml --joint knee=knee.toml --records logs",
    )
)
@click.option("--deck", "deck_name", default=None, metavar="DECK", help=DECK_HELP)
@click.option("--records", type=NamedPath(example="bench"), required=True, help="Folder of tables or logs.")
@hold_out_option
@mapping_option
@click.option("--joint", "joints", multiple=True, metavar="NAME[=DECK]",
              help="Joint of a log of a robot: read only its columns; with its deck repeatable.")  # fmt: skip
@click.option(
    "--regenerate",
    "again",
    is_flag=True,
    help="Design torque observer and controller again from the better model, write and compare them.",
)
@export_option
@click.option("--sample-time", type=Number("ms", above=0.0, up_to=1.0), default="1 ms", show_default=True,
              help="Of the observer.")  # fmt: skip
@spring_option
@measured_option
@workers_option
@block_option
@out_option("out/diagnosis", writes=_diagnosis_files)
@json_option
def diagnose(
    deck_name: str | None, records: Path, joints: tuple[str, ...], out: Path, as_json: bool, **options: Any
) -> None:
    """Name and add the effects that a deck lacks. They are judged on held-out records."""
    contents: dict[str, dict[str, Any]] = {}
    questions = _questions(deck_name, joints, out)
    for _, deck, _ in questions:
        machine_of(deck)  # before hours of work on the first, whether the last can be read
    for joint, deck, folder in questions:
        content, sentences = _diagnosed(deck, records, folder, joint, options)
        contents[joint or ""] = content
        warn(content["warnings"])
        if not as_json:
            click.echo("\n".join([*([f"{joint}:"] if len(joints) > 1 else []), *sentences]))
    if as_json:
        show_json(contents if len(contents) > 1 else content)


def _diagnosed(
    deck_name: str, records: Path, out: Path, joint: str | None, options: Mapping[str, Any]
) -> tuple[dict[str, Any], list[str]]:
    """Return what is found and written of one machine, as content and as sentences."""
    from ..bench.discrepancy import diagnose as find_what_is_missing
    from ..bench.discrepancy import range_findings, verdict_of_run, write_verdict
    from ..bench.identification import load_records
    from ..foundation.progress import Steps
    from ..model import flatten
    from ..presentation.report import write_diagnosis_report
    from ..regeneration import ObserverChoice, export_machine, regenerate, write_regeneration

    command = typed_command("nlsdesign", *sys.argv[1:])
    date = datetime.now().astimezone().isoformat(" ", "minutes")
    actuator = machine_of(deck_name)
    plant, roles = flatten(actuator), _roles(options)
    reading = {name: options[name] for name in ("mapping", "hold_out")}
    measured = load_records(records, plant, joint=joint, **reading)
    steps = Steps()
    with steps.step("diagnosis" + (f" of {joint}" if joint else "")):
        verdict = find_what_is_missing(actuator, measured, progress=steps.note)
    verdict = verdict_of_run(
        verdict, measured, deck=deck_name, folder=str(records), command=command, date=date
    )
    write_verdict(verdict, out)
    page, facts = out / "report.html", {"deck": f"`{deck_name}`", "records": f"`{records}`", "date": date}
    write_diagnosis_report(page, verdict, facts=facts)
    content = {**verdict.to_dict(str(out / "model.toml")), "warnings": range_findings(verdict, measured)}
    sentences: list[str] = [str(verdict)]
    models: dict[str, Any] = {}
    regenerated = None
    if options["again"]:
        # The diagnosis stands in its files already, whatever happens to the observer.
        with steps.step("observer"):
            better, choice = flatten(verdict.actuator), ObserverChoice(**roles)
            result = regenerate(plant, better, measured, fits=verdict.fits, choice=choice)
            result, files = regenerated = write_regeneration(result, out)
            write_diagnosis_report(page, verdict, facts=facts, regenerated=regenerated)
        names = [str(path) for path in files]
        models = {"observer": result.observer}
        if result.controller:
            models["controller"] = result.controller.controller
        content["regeneration"] = {**result.to_dict(), "files": names}
        sentences += [*result.words(), *result.reasons, *([f"written: {', '.join(names)}"] if names else [])]
    if options["exports"]:
        with steps.step("export"):
            machine = export_machine(flatten(verdict.actuator), out, **models, **roles)
            write_diagnosis_report(
                page, verdict, facts=facts, regenerated=regenerated, exported=machine.files
            )
        content |= machine.content()
        sentences += machine.findings()
    blocks, lacking = written_block(options["code"], verdict.actuator, out)
    content |= _named(options["code"], blocks, lacking)
    sentences += [*([f"block: {', '.join(map(str, blocks))}"] if blocks else []), *lacking]
    if verdict.experiment is not None:
        sentences.append(f"command of the next record: {out / 'next_record.csv'}")
    return content, [*sentences, f"report: {page}"]


@click.command(
    epilog=examples(
        "nlsdesign observer calibrate --deck austin2015_figure_consistent --plan",
        "nlsdesign observer calibrate --deck my.toml --kind hung_weight --records bench/weights",
    )
)
@deck_option
@click.option("--kind", "kinds", multiple=True, type=click.Choice(CALIBRATIONS),
              help="What was done; repeatable, once for each --records.")  # fmt: skip
@click.option("--records", "folders", multiple=True, type=NamedPath(example="bench/weights"),
              help="Folder of records of that kind, with its records.toml; repeatable.")  # fmt: skip
@click.option("--known", type=NamedPath(dir_okay=False), default=None,
              help="joint_numbers.json of an earlier calibration, as what is known before.")  # fmt: skip
@click.option("--plan", is_flag=True, help="Rank calibrations by what they would buy; needs no records.")
@block_option
@out_option(
    "out/calibration",  # and the deck, whose name is read
    writes=lambda given: ["plan.json"] if given["plan"] else ["joint_numbers.json", "calibration.json"],
)
@json_option
def calibrate(
    deck_name: str,
    kinds: tuple[str, ...],
    folders: tuple[Path, ...],
    known: Path | None,
    plan: bool,
    as_json: bool,
    **files: Path,
) -> None:
    """Turn bench tests into smaller spreads, or plan them. An afternoon is enough."""
    from ..bench.calibration import (
        KINDS,
        calibrated,
        estimate,
        load_calibration,
        read_joint_numbers,
        record_findings,
        shown_numbers,
        what_calibration_buys,
        write_calibration,
        write_plan,
    )
    from ..components import declare
    from ..foundation.deck import load_deck
    from ..foundation.progress import Steps
    from ..regeneration import errors_while_running

    _check_calibration(kinds, folders, plan)
    out, code = files["out"], files["code"]
    deck = load_deck(deck_name)
    actuator = declare(deck)
    prior = read_joint_numbers(known) if known else None
    steps = Steps()
    if plan:
        chosen = [KINDS[kind] for kind in kinds or KINDS]
        with steps.step("plan"):
            errors = errors_while_running(actuator)
            ranked = what_calibration_buys(actuator, chosen, prior=prior, errors=errors)
        _show_plan(ranked, write_plan(ranked, out), as_json, deck_name, known)
        return
    with steps.step("read"):
        tests = [
            load_calibration(actuator, KINDS[kind], folder)
            for kind, folder in zip(kinds, folders, strict=True)
        ]
    with steps.step("estimate"):
        result = calibrated(actuator, estimate(actuator, tests, prior=prior))
    paths = write_calibration(result, out, deck=deck.path)
    blocks, lacking = written_block(code, result.actuator, out)
    if as_json:
        named = {"deck": str(paths["deck"]), "joint": str(paths["joint"]), **_named(code, blocks, lacking)}
        show_json({**result.to_dict(), **named})
        return
    heads = ("name", "before", "after", "unit", "moved, in spreads", "known from")
    show_table("Numbers", heads, shown_numbers(result.numbers))
    show_lines((*record_findings(tests), *result.words(), *lacking))
    click.echo(f"written: {', '.join(map(str, [*paths.values(), *blocks]))}")


def _named(code: Path | None, blocks: Sequence[Path], lacking: Sequence[str]) -> dict[str, list[str]]:
    """Return the files of a block for JSON, and why there are none; nothing where none was asked for."""
    return {} if code is None else {"block": list(map(str, blocks)), "no_block": list(lacking)}


def _check_calibration(kinds: tuple[str, ...], folders: tuple[Path, ...], plan: bool) -> None:
    """Refuse records beside a plan, and folders of records without their kinds."""
    if plan and folders:
        raise MeasurementError(
            "--records", "stands beside --plan, which reads none", next_step="leave one of both out"
        )
    if not plan and (not folders or len(kinds) != len(folders)):
        raise MeasurementError(
            f"{len(kinds)} --kind and {len(folders)} --records",
            "each folder of records needs its kind",
            next_step=f"write --kind {CALIBRATIONS[0]} --records FOLDER, or --plan to see what would help "
            "most",
        )


def _show_plan(
    ranked: CalibrationPlan, file: Path, as_json: bool, deck_name: str, known: Path | None
) -> None:
    if as_json:
        show_json(ranked.to_dict())
        return
    show_table("What a calibration buys", ranked.heads, ranked.rows())
    show_lines(ranked.words())
    for title, reason in ranked.left_out.items():
        click.echo(f"{title} is left out: {reason}")
    following = ["--deck", deck_name, "--kind", "KIND", "--records", "FOLDER"]
    following += ["--known", str(known)] if known else []
    click.echo(f"written: {file}; next: {next_command('observer', 'calibrate', *following)}")
