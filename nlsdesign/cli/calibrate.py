"""``nlsdesign observer calibrate``: records of a calibration become smaller spreads in the deck."""

from __future__ import annotations

import json
from collections.abc import Callable, Mapping, Sequence
from pathlib import Path
from typing import TYPE_CHECKING, Any

import click

from ..foundation.errors import MeasurementError
from ..foundation.text_files import write_text
from .named_paths import NamedPath
from .output import deck_option, examples, json_option, next_command, show_json, show_table
from .overwriting import out_option

if TYPE_CHECKING:
    from ..bench.calibration import CalibrationPlan, CalibrationRecords, CalibrationTest
    from ..components import Assembly
    from ..simulation import Prior

KINDS = ("hung_weight", "load_cell", "free_run")
_file = NamedPath(dir_okay=False)


def _writes(given: Mapping[str, Any]) -> list[str]:
    """Return the names of the files that the options ask for."""
    if given["plan"]:
        return ["plan.json"]
    return ["joint_numbers.json", "calibration.json"]  # and the deck, whose name is read


@click.command(
    epilog=examples(
        "nlsdesign observer calibrate --deck austin2015_figure_consistent --plan",
        "nlsdesign observer calibrate --deck my.toml --kind hung_weight --records bench/weights",
    )
)
@deck_option
@click.option("--kind", "kinds", multiple=True, type=click.Choice(KINDS),
              help="What was done; repeatable, once for each --records.")  # fmt: skip
@click.option("--records", "folders", multiple=True, type=NamedPath(example="bench/weights"),
              help="Folder of records of that kind, with its records.toml; repeatable.")  # fmt: skip
@click.option("--known", type=_file, default=None,
              help="joint_numbers.json of an earlier calibration, as what is known before.")  # fmt: skip
@click.option("--plan", is_flag=True, help="Rank calibrations by what they would buy; needs no records.")
@out_option("out/calibration", writes=_writes)
@json_option
def calibrate(
    deck_name: str,
    kinds: tuple[str, ...],
    folders: tuple[Path, ...],
    known: Path | None,
    plan: bool,
    out: Path,
    as_json: bool,
) -> None:
    """Turn an afternoon at the bench into smaller spreads in the deck, or plan that afternoon."""
    from ..bench.calibration import (
        calibrated,
        estimate,
        load_calibration,
        read_joint_numbers,
        shown_numbers,
        what_calibration_buys,
        write_calibration,
    )
    from ..components.assembly.deck_writer import declare
    from ..foundation.deck import load_deck
    from ..foundation.progress import Steps

    if plan and folders:
        raise MeasurementError(
            "--records", "stands beside --plan, which reads none", next_step="leave one of both out"
        )
    deck = load_deck(deck_name)
    actuator = declare(deck)
    prior = read_joint_numbers(known) if known else None
    steps = Steps()
    if plan:
        chosen = [_kind(kind) for kind in kinds or KINDS]
        with steps.step("plan"):
            ranked = what_calibration_buys(actuator, chosen, prior=prior, errors=_while_running(actuator))
        file = out / "plan.json"
        write_text(file, json.dumps(ranked.to_dict(), indent=2, ensure_ascii=False) + "\n")
        _show_plan(ranked, as_json)
        if not as_json:
            following = ["--deck", deck_name, "--kind", "KIND", "--records", "FOLDER"]
            following += ["--known", str(known)] if known else []
            click.echo(f"written: {file}; next: {next_command('observer', 'calibrate', *following)}")
        return
    if not folders or len(kinds) != len(folders):
        raise MeasurementError(
            f"{len(kinds)} --kind and {len(folders)} --records",
            "each folder of records needs its kind",
            next_step=f"write --kind {KINDS[0]} --records FOLDER, or --plan to see what would help most",
        )
    with steps.step("read"):
        tests = [
            load_calibration(actuator, _kind(kind), folder)
            for kind, folder in zip(kinds, folders, strict=True)
        ]
    with steps.step("estimate"):
        result = calibrated(actuator, estimate(actuator, tests, prior=prior))
    paths = write_calibration(result, out, deck=deck.path)
    if as_json:
        show_json({**result.to_dict(), "deck": str(paths["deck"]), "joint": str(paths["joint"])})
        return
    heads = ("name", "before", "after", "unit", "moved, in spreads", "known from")
    show_table("Numbers", heads, shown_numbers(result.numbers))
    for sentence in (*_remarks(tests), *result.words()):
        click.echo(sentence)
    click.echo(f"written: {', '.join(map(str, paths.values()))}")


def _kind(name: str) -> CalibrationTest:
    from ..bench.calibration import FreeRunTest, HungWeightTest, LoadCellTest

    kinds: dict[str, CalibrationTest] = dict(
        zip(KINDS, (HungWeightTest(), LoadCellTest(), FreeRunTest()), strict=True)
    )
    return kinds[name]


def _while_running(actuator: Assembly) -> dict[str, Callable[[Prior], float]]:
    """Return the least error of the torque that any observer could have, where there is one to observe."""
    from ..feedback.observer import least_torque_error, observer_bench
    from ..foundation.errors import ArrangementError, ValueRangeError
    from ..model import flatten

    try:
        least = least_torque_error(observer_bench(flatten(actuator)))
    except (ArrangementError, ValueRangeError):
        # A drive without a spring, or without an encoder: the plan then speaks of the resting spring alone.
        return {}
    return {"torque while running, best estimate": least}


def _remarks(tests: Sequence[CalibrationRecords]) -> list[str]:
    """Return what was found in the files."""
    suspect = [f"suspect: {finding}" for test in tests for finding in test.records.findings]
    return suspect + [str(remark) for test in tests for remark in test.records.remarks]


def _show_plan(ranked: CalibrationPlan, as_json: bool) -> None:
    if as_json:
        show_json(ranked.to_dict())
        return
    show_table("What a calibration buys", ranked.heads, ranked.rows())
    for sentence in ranked.words():
        click.echo(sentence)
    for title, reason in ranked.left_out.items():
        click.echo(f"{title} is left out: {reason}")
