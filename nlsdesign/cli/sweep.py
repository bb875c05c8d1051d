"""``nlsdesign sweep`` and ``report``: one question asked of many designs, draws or decks, and its page."""

from __future__ import annotations

import sys
import time
from pathlib import Path
from typing import TYPE_CHECKING, Any

import click

from ..foundation.errors import ExportError, NlsError, ValueRangeError
from .options import json_option
from .output import examples, next_command, show_json, show_table, show_written
from .overwriting import can_be_made, kept, out_option
from .typed_values import NamedPath, parse_number

if TYPE_CHECKING:
    from ..foundation.progress import Progress
    from ..foundation.work_sharing import Executor
    from ..sweeps import SweepTable, SweepTask

_EVERY = 30.0
"""Seconds between lines of progress where there is no terminal."""
_MOST_REASONS = 8


@click.command(
    epilog=examples(
        "nlsdesign sweep sweep.toml --out out/sweep",
        "nlsdesign sweep sweep.toml --out out/sweep --report out/sweep_report",
        "nlsdesign sweep sweep.toml --out out/sweep --workers 2 --retry-failed",
        "nlsdesign sweep sweep.toml --out out/sweep --scheduler tcp://10.0.0.1:8786 --json",
        "nlsdesign sweep sweep.toml --dry-run",
    )
)
@click.argument("file", type=NamedPath(dir_okay=False, example="sweep.toml"), metavar="FILE")
@click.option(
    "--out", type=NamedPath(file_okay=False), default="out/sweep", show_default=True,
    help="Folder of the results; a run goes on where an earlier one in it ended.",
)  # fmt: skip
@click.option("--workers", type=click.IntRange(min=1), default=None,
              help="Processes of this machine, by default one for each core.")  # fmt: skip
@click.option("--scheduler", default=None, metavar="ADDRESS",
              help="Dask scheduler, tcp://HOST:PORT, or the file that it wrote.")  # fmt: skip
@click.option("--mpi", is_flag=True, help="Ranks of MPI, started by mpiexec -n N python -m mpi4py.futures.")
@click.option("--again", is_flag=True, help="Throw away what the folder holds of a sweep, compute anew.")
@click.option("--retry-failed", is_flag=True, help="Compute points again that failed.")
@click.option("--report", type=NamedPath(file_okay=False, example="out/page"), default=None,
              metavar="FOLDER", callback=can_be_made,
              help="Write the page of the sweep into this folder at the end, as nlsdesign report "
              "does.")  # fmt: skip
@click.option("--dry-run", is_flag=True, help="Only check the sweep, and say how many points stand already.")
@json_option
@click.pass_context
def sweep(ctx: click.Context, /, file: Path, out: Path, as_json: bool, **given: Any) -> None:
    """Ask one question of every point of a sweep file. Exit status 1 if points failed.

    Results come as Parquet: the table in results.parquet, one row per point. What was finished when a run was
    stopped, in whatever way, is not computed again.
    """
    executor = _executor(given)
    from ..foundation.progress import Steps
    from ..sweeps import SweepSettings, libraries, read_sweep_file, run_task

    libraries()
    task = read_sweep_file(file)
    if given["dry_run"]:
        _show_plan(task, out, as_json)
        return
    pages: Path | None = given["report"]
    if pages is not None:
        # Refuse, before any point is computed, a page that would replace what somebody has changed.
        from ..foundation.text_files import WORDS, file_state

        for path in (pages / name for name in ("sweep.html", "points.csv")):
            state = file_state(path)
            if state not in ("new", "as written"):
                raise ExportError(
                    str(path), WORDS[state],
                    next_step="nothing was computed; name another folder for --report, "
                    "or move that file away",
                )  # fmt: skip
    settings = SweepSettings(again=given["again"], retry_failed=given["retry_failed"])
    steps = Steps()
    progress: Progress = steps if sys.stderr.isatty() else _Lines()
    with steps.step("sweep"):
        table = run_task(task, out, executor=executor, settings=settings, progress=progress)
    page = None
    if pages is not None:
        from ..presentation.sweep_report import write_sweep_report

        with kept(pages, []):
            page = write_sweep_report(table, pages, source=out).page
    _show_result(table, out, page, as_json=as_json)
    ctx.exit(0 if table.done.all() else 1)


def _show_result(table: SweepTable, out: Path, page: Path | None, *, as_json: bool) -> None:
    """Show how many points there are, why some failed, and the commands that come next."""
    # The commands that come next, each with what it does.
    following = {}
    if page is None:
        following[next_command("report", out)] = "the page: points, reasons of failures, causes, decks"
    if not table.done.all():
        first = int(table.values["point"][~table.done][0])
        following[next_command("report", out, "--deck-of", first)] = "the deck behind a point that failed"
    file, reasons = out / "results.parquet", table.failures()
    failed = len(table) - int(table.done.sum())
    if as_json:
        content = {"points": len(table), "failed": failed, "reasons": {r: n for r, n, _ in reasons}}
        firsts = {reason: first for reason, _, first in reasons}
        show_json({**content, "first_failed": firsts, "file": file, "page": page,
                   "next": list(following), "about": dict(table.about)})  # fmt: skip
        return
    click.echo(f"{len(table)} points, {failed} failed: {file}")
    if failed:
        rows = [(str(count), str(first), reason) for reason, count, first in reasons[:_MOST_REASONS]]
        show_table("Failed", ("points", "first", "reason"), rows)
        left = reasons[_MOST_REASONS:]
        if left:
            click.echo(f"and {sum(count for _, count, _ in left)} points for {len(left)} other reasons")
    if page is not None:
        click.echo(f"written: {page}")
    for command, what in following.items():
        click.echo(f"next: {command}    # {what}")


def _executor(given: dict[str, Any]) -> Executor:
    chosen = [name for name in ("workers", "scheduler", "mpi") if given[name]]
    if len(chosen) > 1:
        raise ValueRangeError(
            " and ".join(f"--{name}" for name in chosen), "name two places for the work",
            next_step="keep one of them",
        )  # fmt: skip
    from ..foundation.work_sharing import DaskScheduler, MpiRanks, Processes

    if given["mpi"]:
        return MpiRanks()
    if given["scheduler"]:
        address = str(given["scheduler"])
        return DaskScheduler(address) if "://" in address else DaskScheduler(file=Path(address))
    return Processes(given["workers"])


class _Lines:
    """Progress as a line now and then, for the log of a batch job."""

    def __init__(self) -> None:
        self._last = time.monotonic()

    def note(self, text: str) -> None:
        """Print the text if the last line is old enough."""
        if time.monotonic() - self._last >= _EVERY:
            self._last = time.monotonic()
            click.echo(text, err=True)


def _show_plan(task: SweepTask, out: Path, as_json: bool) -> None:
    from ..sweeps import standing_points

    standing = standing_points(out, task.about, task.columns, plan=task.plan)
    rows = [
        (c.name, c.kind, "words" if c.lower is None else f"{c.lower:.6g} to {c.upper:.6g} {c.unit}".rstrip())
        for c in task.plan.columns
    ]
    if as_json:
        show_json({"points": len(task.plan), "standing": standing, "axes": rows, "about": dict(task.about)})
        return
    show_table("Axes", ("axis", "kind", "range in SI"), rows)
    click.echo(f"{len(task.plan)} points, {standing} of them stand in {out}; nothing was computed")


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
    """Write the page of a sweep. What was asked, failures, the best points with their decks, figures.

    FOLDER is what `nlsdesign sweep` wrote, also where the sweep is not finished.

    Which values are better is never guessed: without --smaller, --larger or --near there is no front. Where a
    sweep has an answer `met`, a point that has not met its target is a miss, unless --at-most or --at-least
    say what a miss is.
    """
    from ..foundation.text_files import write_text
    from ..sweeps import Preference, Requirement, point_deck_text, read_sweep

    table = read_sweep(folder)
    if deck_of:
        texts = {
            out / f"point_{point}.toml": point_deck_text(table, point) for point in dict.fromkeys(deck_of)
        }
        for file, text in texts.items():
            write_text(file, text)
        show_written(as_json, [], list(texts))
        return
    from ..presentation.sweep_report import write_sweep_report

    preferences = [
        *(Preference.smaller(name) for name in given["smaller"]),
        *(Preference.larger(name) for name in given["larger"]),
        *(Preference.near(*_answer_value(table, text, "--near")) for text in given["near"]),
    ]
    requirements = [
        *(Requirement.at_most(*_answer_value(table, text, "--at-most")) for text in given["at_most"]),
        *(Requirement.at_least(*_answer_value(table, text, "--at-least")) for text in given["at_least"]),
    ]
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


def _answer_value(table: SweepTable, text: str, option: str) -> tuple[str, float]:
    """Read ``NAME=VALUE`` with a unit like that of the answer; gives the value in SI."""
    name, sign, value = text.rpartition("=")
    if not sign:
        raise NlsError(f"{option} '{text}'", "has no value", next_step=f"write {option} 'ANSWER=5 mm'")
    unit = table.column(name.strip()).unit or "1"
    return name.strip(), parse_number(value.strip(), unit).number
