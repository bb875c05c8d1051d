"""``nlsdesign sweep``: one question asked of many designs, draws or decks, on one machine or many."""

from __future__ import annotations

import os
import sys
import time
from pathlib import Path
from typing import TYPE_CHECKING, Any

import click

from ..foundation.errors import ExportError, ValueRangeError
from .named_paths import NamedPath
from .output import examples, json_option, next_command, show_json, show_table
from .overwriting import folder_option, kept

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
@folder_option(
    "--report", "Write the page of the sweep into this folder at the end, as nlsdesign report does."
)
@click.option("--dry-run", is_flag=True, help="Only check the sweep, and say how many points stand already.")
@json_option
@click.pass_context
def sweep(ctx: click.Context, /, file: Path, out: Path, as_json: bool, **given: Any) -> None:
    """Ask one question of every point of a sweep file; exit status 1 if points failed.

    Results come as Parquet: the table in results.parquet, one row per point. What was finished when a run was
    stopped, in whatever way, is not computed again.
    """
    # Many processes share the cores; threads of the linear algebra within each would only be in the way.
    for name in ("OMP_NUM_THREADS", "OPENBLAS_NUM_THREADS"):
        os.environ.setdefault(name, "1")
    executor = _executor(given)
    from ..sweeps.sweep_columns import libraries
    from ..sweeps.sweep_file import read_sweep_file

    libraries()
    task = read_sweep_file(file)
    if given["dry_run"]:
        _show_plan(task, out, as_json)
        return
    pages: Path | None = given["report"]
    if pages is not None:
        _require_room(pages)
    table = _run(task, out, executor, given)
    page = None if pages is None else _page(table, pages, out)
    _show_result(table, out, page, as_json=as_json)
    ctx.exit(0 if table.done.all() else 1)


def _require_room(folder: Path) -> None:
    """Refuse, before any point is computed, a page that would replace what somebody has changed."""
    from ..foundation.text_files import WORDS, file_state

    for path in (folder / name for name in ("sweep.html", "points.csv")):
        state = file_state(path)
        if state not in ("new", "as written"):
            raise ExportError(
                str(path), WORDS[state],
                next_step="nothing was computed; name another folder for --report, or move that file away",
            )  # fmt: skip


def _page(table: SweepTable, folder: Path, source: Path) -> Path:
    from ..presentation.sweep_report import write_sweep_report

    with kept(folder, []):
        return write_sweep_report(table, folder, source=source).page


def _show_result(table: SweepTable, out: Path, page: Path | None, *, as_json: bool) -> None:
    """Show how many points there are, why some failed, and the commands that come next."""
    file, reasons, following = out / "results.parquet", _reasons(table), _following(table, out, page)
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


def _following(table: SweepTable, out: Path, page: Path | None) -> dict[str, str]:
    """Return the commands that come next, each with what it does."""
    commands = {}
    if page is None:
        commands[next_command("report", out)] = "the page: points, reasons of failures, causes, decks"
    if not table.done.all():
        first = int(table.values["point"][~table.done][0])
        commands[next_command("report", out, "--deck-of", first)] = "the deck behind a point that failed"
    return commands


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


def _run(task: SweepTask, out: Path, executor: Executor, given: dict[str, Any]) -> SweepTable:
    from ..foundation.progress import Steps
    from ..sweeps.run_sweep import SweepSettings, run_task

    settings = SweepSettings(again=given["again"], retry_failed=given["retry_failed"])
    steps = Steps()
    progress: Progress = steps if sys.stderr.isatty() else _Lines()
    with steps.step("sweep"):
        return run_task(task, out, executor=executor, settings=settings, progress=progress)


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
    from ..sweeps.sweep_folder import standing_points

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


def _reasons(table: SweepTable) -> list[tuple[str, int, int]]:
    """Return each reason of failures, the most frequent first, with its number of points and the first."""
    counts: dict[str, list[int]] = {}
    failed = ~table.done
    for point, reason in zip(table.values["point"][failed], table.values["reason"][failed], strict=True):
        counts.setdefault(str(reason), [0, int(point)])[0] += 1
    return sorted(
        ((reason, count, first) for reason, (count, first) in counts.items()), key=lambda each: -each[1]
    )
