"""``nlsdesign report``: the page of a sweep, and the decks behind its points."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING

import click

from ..foundation.errors import NlsError
from .named_paths import NamedPath
from .output import examples, json_option, show_written
from .overwriting import out_option
from .units import parse_number

if TYPE_CHECKING:
    from ..sweeps import SweepTable
    from ..sweeps.preferences import Preference, Requirement


@click.command(
    epilog=examples(
        "nlsdesign report out/sweep --smaller torque_error_rms --smaller cam_radius",
        "nlsdesign report out/sweep --larger bandwidth --at-most 'strain=3'",
        "nlsdesign report out/sweep --deck-of 17 --deck-of 42 --out out/chosen --json",
    )
)
@click.argument("folder", metavar="FOLDER", type=NamedPath(example="out/sweep"))
@click.option("--smaller", multiple=True, metavar="ANSWER", help="The smaller, the better; repeatable.")
@click.option("--larger", multiple=True, metavar="ANSWER", help="The larger, the better; repeatable.")
@click.option("--near", multiple=True, metavar="ANSWER=VALUE", help="The nearer, the better; repeatable.")
@click.option(
    "--at-most", multiple=True, metavar="ANSWER=VALUE", help="A point beyond it is a miss; repeatable."
)
@click.option(
    "--at-least", multiple=True, metavar="ANSWER=VALUE", help="A point below it is a miss; repeatable."
)
@click.option("--deck-of", multiple=True, type=int, metavar="POINT",
              help="Write only the deck behind a point, no page; repeatable.")  # fmt: skip
@out_option("out/sweep_report", writes=("sweep.html", "points.csv"))
@json_option
def report(
    folder: Path, deck_of: tuple[int, ...], out: Path, as_json: bool, **given: tuple[str, ...]
) -> None:
    """Write the page of a sweep: what was asked, failures, the best points with their decks, figures.

    FOLDER is what `nlsdesign sweep` wrote, also where the sweep is not finished.

    Which values are better is never guessed: without --smaller, --larger or --near there is no front. Where a
    sweep has an answer `met`, a point that has not met its target is a miss, unless --at-most or --at-least
    say what a miss is.
    """
    from ..sweeps import read_sweep

    table = read_sweep(folder)
    if deck_of:
        _decks(table, deck_of, out=out, as_json=as_json)
        return
    from ..presentation.sweep_report import write_sweep_report

    preferences, requirements = _preferences(table, given), _requirements(table, given)
    written = write_sweep_report(
        table, out, preferences=preferences, requirements=requirements or None, source=folder
    )
    failed = int((~table.done).sum())
    sentences = [f"{len(table)} points, {failed} of them failed", *written.remarks]
    if preferences:
        shown = ", ".join(map(str, written.front[:10])) + (", ..." if len(written.front) > 10 else "")
        sentences.insert(1, f"{len(written.front)} points on the front: {shown or 'none'}")
    else:
        sentences.insert(
            1, "no direction is stated, so there is no front; --smaller, --larger, --near state one"
        )
    show_written(
        as_json, sentences, [written.page, written.points, *written.decks.values()],
        points=len(table), failed=failed, front=list(written.front),
    )  # fmt: skip


def _decks(table: SweepTable, points: tuple[int, ...], *, out: Path, as_json: bool) -> None:
    from ..foundation.text_files import write_text
    from ..sweeps.point_deck import point_deck_text

    texts = {point: point_deck_text(table, point) for point in dict.fromkeys(points)}
    files = []
    for point, text in texts.items():
        files.append(out / f"point_{point}.toml")
        write_text(files[-1], text)
    show_written(as_json, [], files)


def _preferences(table: SweepTable, given: dict[str, tuple[str, ...]]) -> list[Preference]:
    from ..sweeps.preferences import LargerIsBetter, NearIsBetter, SmallerIsBetter

    return [
        *(SmallerIsBetter(name) for name in given["smaller"]),
        *(LargerIsBetter(name) for name in given["larger"]),
        *(NearIsBetter(*_answer_value(table, text, "--near")) for text in given["near"]),
    ]


def _requirements(table: SweepTable, given: dict[str, tuple[str, ...]]) -> list[Requirement]:
    from ..sweeps.preferences import NotAbove, NotBelow

    return [
        *(NotAbove(*_answer_value(table, text, "--at-most")) for text in given["at_most"]),
        *(NotBelow(*_answer_value(table, text, "--at-least")) for text in given["at_least"]),
    ]


def _answer_value(table: SweepTable, text: str, option: str) -> tuple[str, float]:
    """Read ``NAME=VALUE`` with a unit like that of the answer; gives the value in SI."""
    name, sign, value = text.rpartition("=")
    if not sign:
        raise NlsError(f"{option} '{text}'", "has no value", next_step=f"write {option} 'ANSWER=5 mm'")
    unit = table.column(name.strip()).unit or "1"
    return name.strip(), parse_number(value.strip(), unit).number
