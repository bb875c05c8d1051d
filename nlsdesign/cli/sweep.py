"""``nlsdesign sweep``: one question asked of many designs, draws or decks, on one machine or many."""

from __future__ import annotations

import os
import sys
import time
from pathlib import Path
from typing import TYPE_CHECKING, Any

import click

from ..errors import ValueRangeError
from .output import examples, json_option, show_json, show_table

if TYPE_CHECKING:
    from ..progress import Progress
    from ..sweeps import SweepTable, SweepTask
    from ..work_sharing import Executor

_EVERY = 30.0
"""Seconds between lines of progress where there is no terminal."""
_MOST_REASONS = 8


@click.command(
    epilog=examples(
        "nlsdesign sweep sweep.toml --out out/sweep",
        "nlsdesign sweep sweep.toml --out out/sweep --workers 2 --retry-failed",
        "nlsdesign sweep sweep.toml --out out/sweep --scheduler tcp://10.0.0.1:8786 --json",
        "nlsdesign sweep sweep.toml --dry-run",
    )
)
@click.argument("file", type=click.Path(path_type=Path, dir_okay=False), metavar="FILE")
@click.option(
    "--out", type=click.Path(path_type=Path, file_okay=False), default="out/sweep", show_default=True,
    help="Folder of the results; a run goes on where an earlier one in it ended.",
)  # fmt: skip
@click.option("--workers", type=click.IntRange(min=1), default=None,
              help="Processes of this machine, by default one for each core.")  # fmt: skip
@click.option("--scheduler", default=None, metavar="ADDRESS",
              help="Dask scheduler, tcp://HOST:PORT, or the file that it wrote.")  # fmt: skip
@click.option("--mpi", is_flag=True, help="Ranks of MPI, started by mpiexec -n N python -m mpi4py.futures.")
@click.option("--again", is_flag=True, help="Throw away what the folder holds of a sweep, compute anew.")
@click.option("--retry-failed", is_flag=True, help="Compute points again that failed.")
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
    from ..sweeps.sweep_file import read_sweep_file
    from ..sweeps.sweep_parts import libraries

    libraries()
    task = read_sweep_file(file)
    if given["dry_run"]:
        _show_plan(task, out, as_json)
        return
    table = _run(task, out, executor, given)
    failed = len(table) - int(table.done.sum())
    if as_json:
        content = {"points": len(table), "failed": failed, "reasons": dict(_reasons(table))}
        show_json({**content, "file": out / "results.parquet", "about": dict(table.about)})
    else:
        click.echo(f"{len(table)} points, {failed} failed: {out / 'results.parquet'}")
        if failed:
            rows = [(str(count), reason) for reason, count in _reasons(table)[:_MOST_REASONS]]
            show_table("Failed", ("points", "reason"), rows)
    ctx.exit(1 if failed else 0)


def _executor(given: dict[str, Any]) -> Executor:
    chosen = [name for name in ("workers", "scheduler", "mpi") if given[name]]
    if len(chosen) > 1:
        raise ValueRangeError(
            " and ".join(f"--{name}" for name in chosen), "name two places for the work",
            next_step="keep one of them",
        )  # fmt: skip
    from ..work_sharing import DaskScheduler, MpiRanks, Processes

    if given["mpi"]:
        return MpiRanks()
    if given["scheduler"]:
        address = str(given["scheduler"])
        return DaskScheduler(address) if "://" in address else DaskScheduler(file=Path(address))
    return Processes(given["workers"])


def _run(task: SweepTask, out: Path, executor: Executor, given: dict[str, Any]) -> SweepTable:
    from ..progress import Steps
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


def _reasons(table: SweepTable) -> list[tuple[str, int]]:
    from collections import Counter

    return Counter(table.values["reason"][~table.done].tolist()).most_common()
