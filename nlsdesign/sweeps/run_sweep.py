"""The run of a sweep: points go out, rows come in, parts are written, and at the end the table.

Batches within a point run as compiled code where there is a compiler, else in CasADi, with the same bits.
NumPy has elementary functions of its own, so a table would depend on who computed it.
"""

from __future__ import annotations

import contextlib
import math
import time
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any, Final

import casadi as ca

from ..components.assembly.named_parts import Assembly
from ..export import natively, quickest
from ..foundation.errors import ArrangementError, ExportError, NlsError, ValueRangeError
from ..foundation.progress import Progress, Quiet
from ..foundation.work_sharing import Executor, PointOutcome, Processes, shared_map
from ..simulation.column_graph import ColumnGraph, NotByColumnsError
from ..simulation.column_runs import ColumnRun
from .axes import AxisSet
from .axis_values import DECK, Subject
from .sweep_columns import DONE, FAILED, RESULTS_FILE, STATE_COLUMNS, SweepColumn, libraries
from .sweep_folder import PointPlan, about_sweep, contents_of, only_run, opened, written_about
from .sweep_question import PointWork, SweepQuestion
from .sweep_table import SweepTable, read_sweep

_FIRST_PART: Final = 2.0
_LATEST_PART: Final = 15.0
"""Seconds after which a part is written: at first soon, then as seldom as a kill may cost."""
_MOST_ROWS: Final = 4096


@dataclass(frozen=True)
class SweepSettings:
    """What becomes of earlier results in the folder."""

    again: bool = False  # whether they are thrown away; by default the run goes on where the last one ended
    retry_failed: bool = False  # whether points that failed are computed again


_GO_ON: Final = SweepSettings()


@dataclass(frozen=True, eq=False)
class SweepTask:
    """A sweep that was checked and not yet run.

    Parameters
    ----------
    assemblies
        By the name of their deck; the first is swept.
    plan
        Its points.
    question
        What is asked of each.
    columns
        Of the table.
    about
        What ``sweep.json`` will say.
    """

    assemblies: Mapping[str, Assembly]
    plan: PointPlan
    question: SweepQuestion
    columns: tuple[SweepColumn, ...]
    about: Mapping[str, Any]

    @property
    def work(self) -> PointWork:
        """What a worker does with a point."""
        axes = tuple((c.name, c.unit) for c in self.plan.columns)
        return PointWork(self.assemblies, self.question, axes, _answers(self.columns))


def _answers(columns: Sequence[SweepColumn]) -> tuple[str, ...]:
    return tuple(column.name for column in columns if column.role == "answer")


def sweep_task(
    actuator: Assembly | Mapping[str, Assembly], *, axes: Sequence[AxisSet], ask: SweepQuestion
) -> SweepTask:
    """Check a sweep before anything is computed."""
    assemblies = {actuator.name: actuator} if isinstance(actuator, Assembly) else dict(actuator)
    if not assemblies:
        raise ArrangementError("sweep", "has no deck", next_step="give an assembly")
    plan = PointPlan(axes, Subject(assemblies, ask))
    if len(assemblies) > 1 and all(column.name != DECK for column in plan.columns):
        raise ArrangementError(
            f"decks {', '.join(assemblies)}", f"no axis '{DECK}' says which decks the points are of",
            next_step=f"add an axis '{DECK}' that lists them (Listed), or name one deck",
        )  # fmt: skip
    base = next(iter(assemblies.values()))
    answers = ask.answers(base)
    taken = {c.name for c in (*plan.columns, *STATE_COLUMNS)}
    names = [column.name for column in answers]
    for name in names:
        if name in taken or names.count(name) > 1:
            raise ValueRangeError(
                f"answer '{name}'", "has the name of an axis, a state or another answer",
                next_step="give it another name",
            )  # fmt: skip
    seeds = [int(each.seed) for each in axes if hasattr(each, "seed")]
    about = about_sweep(assemblies, plan, question=type(ask).__name__, asked=ask.describe(), seeds=seeds)
    about["contents"] = contents_of(plan.words(), ask.stands_for)
    point, *states = STATE_COLUMNS
    return SweepTask(assemblies, plan, ask, (point, *plan.columns, *answers, *states), about)


def require_askable(task: SweepTask) -> None:
    """Refuse a question that fits no deck of a sweep, nor its first point, whose structure may differ."""
    first: NlsError | None = None
    for assembly in task.assemblies.values():
        try:
            task.question.require_fit(assembly)
            return
        except NlsError as error:
            first = first or error
    try:
        question, assembly = task.work.at(task.plan.point(0))
        question.require_fit(assembly)
    except NlsError:
        if first is not None:
            raise first from None
        raise


def sweep(
    actuator: Assembly | Mapping[str, Assembly],
    *,
    axes: Sequence[AxisSet],
    ask: SweepQuestion,
    out: Path | str,
    executor: Executor | None = None,
    settings: SweepSettings = _GO_ON,
    progress: Progress | None = None,
) -> SweepTable:
    """Ask one question of every point, and write the answers into a folder as they come.

    A run that was stopped in any way goes on where it ended when it is started again. Points that fail are
    kept with their reason. The table is the same to the byte whoever computed it.

    Parameters
    ----------
    actuator
        Assembly that is swept; or several by name, for an axis ``deck``.
    axes
        Sets of axes; every row of one is crossed with every row of the others.
    ask
        The question, a pure function of the changed assembly.
    out
        Folder.
    executor
        Where points are computed; by default processes of this machine, one for each core.
    settings
        What becomes of earlier results.
    progress
        Told how far it is.

    Returns
    -------
    SweepTable
        All points.

    Raises
    ------
    NlsError
        If a name does not exist or a value does not fit it.
    ExportError
        If the folder cannot be written, is full, or holds another sweep.
    WorkSharingError
        If workers run other code, or their scheduler is not there.
    MissingLibraryError
        If pyarrow is not installed.
    """
    libraries()
    task = sweep_task(actuator, axes=axes, ask=ask)
    require_askable(task)
    return run_task(
        task, Path(out),
        executor=executor or Processes(), settings=settings, progress=progress or Quiet(),
    )  # fmt: skip


def run_task(
    task: SweepTask, folder: Path, *, executor: Executor, settings: SweepSettings, progress: Progress
) -> SweepTable:
    """Run a checked sweep; see :func:`sweep`."""
    with only_run(folder):
        parts = opened(folder, task.about, task.columns, task.plan, again=settings.again)
        written_about(folder, task.about, task.columns, task.assemblies)
        standing = parts.standing(len(task.plan), with_failed=not settings.retry_failed)
        left = len(task.plan) - int(standing.sum())
        results = folder / RESULTS_FILE
        if left:
            results.unlink(missing_ok=True)
            points = ((k, task.plan.point(k)) for k in range(len(task.plan)) if not standing[k])
            watch = _Watch(progress, len(task.plan), left)
            rows: list[dict[str, Any]] = []
            begin = written = time.monotonic()
            outcomes = shared_map(
                task.work, points, executor, count=watch.left, without_workers=watch.without_workers
            )
            try:
                with contextlib.closing(outcomes):  # type: ignore[type-var]
                    for batch in outcomes:
                        rows += [_row(task, each) for each in batch]
                        watch.count(batch)
                        now = time.monotonic()
                        patience = min(_LATEST_PART, max(_FIRST_PART, 0.02 * (now - begin)))
                        if len(rows) >= _MOST_ROWS or now - written > patience:
                            parts.write(rows)
                            rows, written = [], now
            finally:
                # Also when the run is interrupted: what has come is not computed again.
                parts.write(rows)
        if left or not results.exists():
            progress.note("writing the table")
            parts.finish()
    return read_sweep(folder)


def _row(task: SweepTask, outcome: PointOutcome) -> dict[str, Any]:
    answers = _answers(task.columns)
    values = outcome.value if not outcome.reason else (math.nan,) * len(answers)
    return {
        "point": outcome.number,
        **{c.name: v for c, v in zip(task.plan.columns, task.plan.point(outcome.number), strict=True)},
        **dict(zip(answers, values, strict=True)),
        "status": FAILED if outcome.reason else DONE,
        "reason": outcome.reason,
        "(seconds)": outcome.seconds,
        "(worker)": outcome.worker,
    }


class _Watch:
    """How far a run is, and how long it will take."""

    def __init__(self, progress: Progress, total: int, left: int) -> None:
        self._progress, self._total, self.left = progress, total, left
        self._failed, self._done = 0, 0
        self._begin = time.monotonic()
        self._alone = 0.0

    def without_workers(self, seconds: float) -> None:
        """Note for how long there has been nobody to compute."""
        self._alone = seconds

    def count(self, batch: Sequence[PointOutcome]) -> None:
        self._done += len(batch)
        self._failed += sum(1 for each in batch if each.reason)
        over = self._total - self.left + self._done
        text = f"{over} of {self._total} points"
        if self._failed:
            text += f", {self._failed} failed"
        if self._alone > 0.0:  # what is left would take for ever
            since = time.localtime(time.time() - self._alone)
            text += f", no worker since {time.strftime('%H:%M:%S', since)}"
        elif self._done:
            seconds = (time.monotonic() - self._begin) / self._done * (self.left - self._done)
            text += f", about {duration(seconds)} left"
        self._progress.note(text)


def duration(seconds: float) -> str:
    """Return a time in words of two units at most.

    Examples
    --------
    >>> duration(8.2), duration(754), duration(7600), duration(200000)
    ('8 s', '12 min 34 s', '2 h 6 min', '2 d 7 h')
    """
    whole = round(seconds)
    for large, small, size in (("d", "h", 86400), ("h", "min", 3600), ("min", "s", 60)):
        if whole >= size:
            part = {"h": 3600, "min": 60, "s": 1}[small]
            return f"{whole // size} {large} {whole % size // part} {small}"
    return f"{whole} s"


@dataclass(frozen=True)
class SameBits:
    """Compiled code where that is to be had, and CasADi where it is not: a worker may lack a compiler."""

    def __call__(self, function: ca.Function) -> ca.Function:
        """Return a function as compiled code, or as it is."""
        if quickest() is not natively:
            return function
        try:
            return natively(function)
        except ExportError:  # the cache of a worker may be full
            return function

    def columns(self, graph: ColumnGraph) -> ColumnRun:
        """Return compiled code that runs samples of many columns."""
        if quickest() is not natively:
            raise NotByColumnsError
        try:
            return natively.columns(graph)
        except ExportError:
            raise NotByColumnsError from None


same_bits = SameBits()
"""What questions of a sweep give to batches."""
