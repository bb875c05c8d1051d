"""The monitor beside an observer: its C, and ``nlsdesign watch``, what it has seen."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import asdict
from pathlib import Path
from typing import Any

import click

from .options import deck_option, json_option, machine_of, sample_time_option
from .output import examples, show_json, show_lines, show_written
from .typed_values import NamedPath

WATCH = "watch"
FINDING = 1
"""Exit status where something changed or may have."""


_OF_A_STEP = ("kind", "flash", "budget", "table_error", "examples", "package", "prove", "with_block")


def export_monitor(
    deck_name: str, sample_time: float, out: Path, real: str, as_json: bool, chosen: Mapping[str, Any]
) -> None:  # fmt: skip
    """Write the monitor of a deck."""
    from ..components import smoothed
    from ..export import export_watch, write_watch_a2l
    from ..model import flatten
    from ..regeneration import watch_plan

    given = [f"--{name.removeprefix('with_').replace('_', '-')}" for name in _OF_A_STEP if chosen.get(name)]
    if given:
        raise click.BadParameter(
            f"{given[0]} is of an observer or controller; leave it out for --what {WATCH}"
        )
    plan = watch_plan(flatten(smoothed(machine_of(deck_name))), sample_time)
    source = export_watch(plan, out, real=real)
    words = [f"{block.name}: {', '.join(block.changes)}" for block in plan.blocks]
    words += _left_out(plan.unseen)
    show_written(
        as_json,
        (f"monitor of {plan.model.name.removesuffix('_residuals')}", *words),
        (*source.files, write_watch_a2l(source, out / f"{source.name}.a2l")),
        name=source.name,
    )


@click.group()
def watch() -> None:
    """Read what the monitor beside an observer has seen."""


@watch.command(
    "read",
    epilog=examples(
        "nlsdesign watch read watch.bin --deck austin2015_figure_consistent",
        "nlsdesign watch read watch.bin --deck my.toml --sample-time '2 ms' --json",
    ),
)
@click.argument("file", type=NamedPath(dir_okay=False, example="watch.bin"))
@deck_option
@sample_time_option
@json_option
def read_evidence(file: Path, deck_name: str, sample_time: float, as_json: bool) -> int:
    """Name the number of the deck that has changed, or say why not.

    FILE holds the record of the monitor that `export c --what watch` wrote. Exit status 0 if nothing changed,
    1 if something did or too little was seen, 2 if the file cannot be read.
    """
    from ..components import smoothed
    from ..export import read_watch_record
    from ..model import flatten
    from ..regeneration import read_watch, watch_plan

    plan = watch_plan(flatten(smoothed(machine_of(deck_name))), sample_time)
    verdict = read_watch(read_watch_record(file, plan), plan)
    if as_json:
        named = [change.name for change in verdict.named]
        show_json({"file": file, **asdict(verdict), "named": named, "not_watched": plan.unseen})
    else:
        show_lines((*verdict.words(), *_left_out(plan.unseen)))
    return 0 if verdict.verdict == "none" and not verdict.is_of_before else FINDING


def _left_out(names: Sequence[str]) -> list[str]:
    """Return in words what a monitor does not watch."""
    return [f"not watched, because these readings do not show it: {', '.join(names)}"] if names else []
