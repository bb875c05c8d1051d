"""Long work on a design: whole design, tolerance cloud, torque loop, diagnosis, stock, files."""

from __future__ import annotations

import io
import tempfile
import zipfile
from collections.abc import Callable, Mapping
from dataclasses import dataclass, replace
from enum import StrEnum
from functools import partial
from pathlib import Path
from typing import Any

import numpy as np

from ..components.assembly.deck_writer import deck_text
from ..components.assembly.named_parts import Assembly
from ..design import (
    CamDesign,
    Contour,
    DesignSettings,
    Limit,
    Target,
    ToleranceResult,
    design_cam,
    tolerance_analysis,
    write_drawings,
)
from ..design.drawing.making import Mounting
from ..design.jobs.written_design import declared_edge
from ..design.optimisation.stock import StockChoice, combinations
from ..design.parametric.parametric_solver import ParametricDesign
from ..foundation.arrays import Array
from ..foundation.errors import ConvergenceError, InfeasibleError, ValueRangeError, unknown_name
from ..foundation.written_numbers import prefixed
from ..model import flatten
from ..model.roles import measured_motion, series_cam, series_spring
from ..model.transform import with_outputs
from .answers import (
    AnswerSource,
    AnswerState,
    DesignView,
    Lazy,
    LiveAnswer,
    LoopResponse,
    WorkStage,
)
from .at_angle import AngleView, loop_responses
from .background import BackgroundWork, WorkState
from .lights import Light, lights_of, mounting_of
from .question import LiveQuestion
from .views import in_words, not_kept, unkept, view_of

Stage = Callable[[str], None]
"""Told in words what is done now."""

_CLOUD_DRAWS = 200
_MOST_FILES = 60
_MOST_BYTES = 200_000_000


class Work(StrEnum):
    """The kinds of long work, by the names that messages of the page give them."""

    SETTLE = "SettleDesign"  # the whole design of the question: FullDesign
    TOLERANCE = "ToleranceCloud"  # torque of made springs around the design
    LOOP = "TorqueLoop"  # the torque loop over the angle: angles, and a LoopResponse at each
    DIAGNOSIS = "DiagnoseRecords"  # what records say that the declared machine lacks
    STOCK = "TryStock"  # what can be bought: a row for each combination
    EXPORT = "ExportDesign"  # the design as a file: ExportedDesign


Call = tuple[Callable[..., Any], tuple[Any, ...]]
"""The function that does long work and its arguments, picklable."""


def _settled(question: LiveQuestion, _: AngleView | None) -> Call:
    asked = (question.actuator, question.target, question.free, question.keep)
    return whole_design, (*asked, question.held_contour)


def _tolerance(question: LiveQuestion, shown: AngleView | None) -> Call:
    return tolerance_cloud, (_designed(shown).machine, question.target, _CLOUD_DRAWS, 1)


def _loop(_: LiveQuestion, shown: AngleView | None) -> Call:
    view = _designed(shown)
    return loop_responses, (view.machine, float(view.view.columns[0].values[-1]))


def _diagnosis(question: LiveQuestion, _: AngleView | None, folder: Path) -> Call:
    """Return the diagnosis of the machine as it is declared, not as it is designed."""
    files = [file for file in folder.iterdir() if file.is_file()]
    size = sum(file.stat().st_size for file in files)
    if not 1 <= len(files) <= _MOST_FILES or size > _MOST_BYTES:
        raise ValueRangeError(
            f"{len(files)} files of records, {size / 1e6:.1f} MB",
            f"must be 1 to {_MOST_FILES} files and at most {_MOST_BYTES / 1e6:.0f} MB",
            next_step="take some records out, or use nlsdesign diagnose",
        )
    return diagnosis, (question.actuator, folder)


def _stock(question: LiveQuestion, _: AngleView | None, choices: tuple[StockChoice, ...]) -> Call:
    """Return the design from each combination of what can be bought; a size that is chosen so is not free."""
    combinations(question.actuator, choices)  # what does not fit the machine is refused at once
    chosen = {each.chosen for each in choices}
    free = tuple(name for name in question.free if name not in chosen)
    # What follows from the strength of a rubber, or the travel of a coil, is that of each.
    follow = {name for name, each in question.limit_values.items() if each.by_default}
    keep = tuple(
        each
        for each in question.keep
        if type(each).__name__ not in follow and getattr(each, "name", "") not in chosen
    )
    return through_stock, (question.actuator, question.target, free, keep, choices, question.held_contour)


def _export(_: LiveQuestion, shown: AngleView | None, what: str, note: str) -> Call:
    """Return the export of the last good design; ``note``: what the head of the file says."""
    if what not in EXPORTS:
        raise unknown_name("export", what[:80], EXPORTS)
    if shown is None:
        raise ValueRangeError("export", "there is no design yet", next_step="widen a limit first")
    return EXPORTS[what], (shown.machine, shown.contour, note)


_CALLS: Mapping[Work, Callable[..., Call]] = {
    Work.SETTLE: _settled,
    Work.TOLERANCE: _tolerance,
    Work.LOOP: _loop,
    Work.DIAGNOSIS: _diagnosis,
    Work.STOCK: _stock,
    Work.EXPORT: _export,
}
"""How each kind of work is called for a question and the design that is shown, with its settings."""


class LiveWork:
    """The long work of one session, by kind."""

    def __init__(self) -> None:
        self._running: dict[str, BackgroundWork] = {}
        self._designs: dict[str, AngleView | None] = {}

    def start(
        self, name: Work, question: LiveQuestion, revision: int, shown: AngleView | None, *settings: object
    ) -> WorkState:
        """Start work of a kind with its settings; one of its kind that runs is cancelled."""
        work, arguments = _CALLS[name](question, shown, *settings)
        self.cancel(name)
        self._running[name] = BackgroundWork(name, revision, work, arguments)
        self._designs[name] = shown
        return self._running[name].state()

    def states(self) -> tuple[WorkState, ...]:
        """Return how far all work is; never waits."""
        return tuple(each.state() for each in self._running.values())

    def wait(self, name: str, seconds: float) -> WorkState | None:
        """Return the state of work once it is over, or after that time; ``None`` if it never began."""
        return self._running[name].wait(seconds) if name in self._running else None

    def cancel(self, name: str) -> WorkState | None:
        """End work of a kind; ``None`` if it never began."""
        return self._running[name].cancel() if name in self._running else None

    def close(self) -> None:
        """End all work."""
        for each in self._running.values():
            each.cancel()

    def forget(self) -> None:
        """End all work and forget what came of it."""
        self.close()
        self._running.clear()
        self._designs.clear()

    def loop_at(self, angle: float, shown: AngleView) -> Lazy:
        """Return the torque loop at one angle, where it was asked for and computed for this design."""
        work, revision = self._running.get(Work.LOOP), shown.view.revision
        state = None if work is None else work.state()
        begun = self._designs.get(Work.LOOP)
        # A checked design has the revision of the quick one whose place it takes, but not its contour.
        if state is None or begun is None or begun.contour is not shown.contour:
            return Lazy(WorkStage.LATER, revision)
        if state.state is not WorkStage.DONE:
            return Lazy(state.state, revision, None, state.message)
        angles: Array = state.value[0]
        responses: list[LoopResponse] = state.value[1]
        nearest = int(np.argmin(np.abs(angles - abs(angle))))
        words = f"at {np.degrees(angles[nearest]):.1f}°, the nearest of {len(angles)} angles"
        return Lazy(WorkStage.DONE, revision, responses[nearest], words)


def tolerance_cloud(stage: Stage, machine: Assembly, target: Target, draws: int, seed: int) -> dict[str, Any]:
    """Return what the spreads of all numbers do to the torque of a design.

    ``band``: torque below which 5, 50 and 95 % of the springs lie, shape (3, angles); ``errors``: rms error
    of each draw in N·m; ``rows``: summary, pairs of text.
    """
    stage(f"computes {draws} made springs")
    result: ToleranceResult = tolerance_analysis(machine, target=target, draws=draws, seed=seed)
    numbers = {name: getattr(result, name) for name in ("angles", "nominal", "band", "errors")}
    return {**numbers, "rows": tuple(result.rows())}


def diagnosis(stage: Stage, actuator: Assembly, folder: Path) -> dict[str, Any]:
    """Return what the records of a folder say: verdict, effects in words, gap, a course, words, better deck.

    ``gap``: block, role of the records, and error before and after with noise floor and signal, in the unit;
    ``course``: a held-out record over time.
    """
    from ..bench.discrepancy import diagnose
    from ..bench.identification import load_records
    from ..components.assembly.deck_writer import deck_text
    from ..model import flatten

    stage("reads the records")
    records = load_records(folder, flatten(actuator))
    verdict = diagnose(actuator, records, progress=stage)
    course = verdict.course
    every = max(1, len(course.time) // 1000)
    return {
        "verdict": verdict.verdict,
        "effects": [each.headline(verdict.actuator) for each in verdict.effects],
        "gap": verdict.gap()._asdict(),
        "course": {
            "record": course.record, "quantity": course.quantity, "unit": course.unit, "role": course.role,
            "time": course.time[::every], "measured": course.measured[::every],
            "before": course.before[::every], "after": course.after[::every],
        },
        "words": str(verdict),
        "deck": deck_text(verdict.actuator),
    }  # fmt: skip


def through_stock(
    stage: Stage,
    actuator: Assembly,
    target: Target,
    free: tuple[str, ...],
    keep: tuple[Limit, ...],
    choices: tuple[StockChoice, ...],
    contour: Contour | None,
) -> dict[str, Any]:
    """Return what became of each combination of a stock: ``rows`` of label, rms error, met, reason."""
    count, done = len(combinations(actuator, choices)), 0

    def progress() -> None:
        nonlocal done
        done += 1
        stage(f"{done} of {count} designed")

    stage(f"designs {count} springs")
    settings = DesignSettings(
        starts=1, look_for_size_ranges=False, look_for_remedies=False, draws=0, progress=progress,
        contour=contour,
    )  # fmt: skip
    design = design_cam(actuator, target=target, free=(*free, *choices), keep=keep, settings=settings)
    return {"rows": [(each.choice, each.rms, each.met, each.reason) for each in design.alternatives]}


def _designed(shown: AngleView | None) -> AngleView:
    if shown is None:
        raise ValueRangeError("design", "there is none yet", next_step="widen a limit first")
    return shown


STARTS = 12
_DRAWS = 200
"""Made springs of the check; of as many normal errors the 95 % quantile is known to 13 %, 19 times of 20."""
_DEARER = 1e-3
"""Relative difference of costs, and cost, from which two solutions are different optima."""
_WEIGHED = " (torque error, rubber and smoothness together)"
_DIFFERS = 1e-3
"""Difference of two rms errors relative to the largest torque from which it is stated."""


@dataclass(frozen=True, eq=False)
class FullDesign:
    """What the whole design came to."""

    state: AnswerState
    design: CamDesign | None
    message: str = ""
    lights: tuple[Light, ...] = ()
    mounting: Mounting | None = None  # the part with its bolts, where one can be made


def whole_design(
    stage: Stage,
    actuator: Assembly,
    target: Target,
    free: tuple[str, ...],
    keep: tuple[Limit, ...],
    contour: Contour | None = None,
) -> FullDesign:
    """Return the whole design.

    ``actuator``, ``target``, ``free``, ``keep``: as for :func:`~nlsdesign.design.design_cam`; the limits are
    all that hold.
    """
    done = 0

    def progress() -> None:
        nonlocal done
        done += 1
        stage(f"start {done} is solved, of {STARTS} at most; then the finish, and what would help")

    stage(f"solves from {STARTS} starts at most, until the best was found twice")
    settings = DesignSettings(
        starts=STARTS, defaults=(), look_for_size_ranges=False, draws=_DRAWS, progress=progress,
        contour=contour,
    )  # fmt: skip
    try:
        design = design_cam(actuator, target=target, free=free, keep=keep, settings=settings)
        stage("asks whether it can be made, will hold and be known")
        mounting = mounting_of(design)
        lights = lights_of(design, keep, mounting)
        part = None if isinstance(mounting, str) else mounting
        return FullDesign(AnswerState.SOLVED, design, lights=lights, mounting=part)
    except InfeasibleError as error:
        return FullDesign(AnswerState.INFEASIBLE, None, str(error))
    except ConvergenceError as error:
        return FullDesign(AnswerState.NOT_SOLVED, None, str(error))


def full_answer(
    full: FullDesign, question: LiveQuestion, quick: LiveAnswer, solved: ParametricDesign | None
) -> LiveAnswer:
    """Return the answer that replaces the quick one, with what differs between the two in its message.

    ``solved``: its design; ``None`` where it had none of its own.
    """
    limits = question.limit_values
    if full.design is None and solved is None:
        return replace(
            quick, state=full.state, source=AnswerSource.FULL, message=in_words(full.message, limits)
        )
    if full.design is None:
        reason = in_words(full.message, limits)
        sentence = f"the whole design came to no answer: {reason}; shown is the quick answer, unchecked"
        return replace(quick, source=AnswerSource.FULL, message=sentence)
    view = replace(view_of(question, quick.revision, full.design), lights=full.lights)
    missed = full.design.miss
    sentences = [*view.beyond, *([] if missed is None else [f"misses its target: {missed.words}"])]
    if missed is not None and missed.advice:
        sentences.append(f"what would help: {', or '.join(missed.advice)}")
    if solved is not None and quick.design is not None:
        sentences += _differences(full.design, solved, quick.design)
    elif quick.state is not AnswerState.SOLVED:
        sentences.append("the quick answer had no design for this question")
    if quick.state is AnswerState.SOLVED and quick.design is not None:
        # The whole search knows nothing of limits that nothing can change; they are shown all the same.
        view = replace(view, margins=(*view.margins, *unkept(question, quick.design.margins)))
    sentences += not_kept(question, view.margins)
    sentences += full.design.remarks
    message = in_words("; ".join(sentences), limits)
    return replace(
        quick, state=AnswerState.SOLVED, source=AnswerSource.FULL, message=message, design=view, conflicts=()
    )


def _differences(design: CamDesign, solved: ParametricDesign, quick: DesignView) -> list[str]:
    """Return in words where the quick answer was another optimum, or the finished assembly is another."""
    cost, largest, sentences = design.starts[design.taken].cost, design.target.largest, []
    was, there = (f"{prefixed(each)} rms" for each in (quick.rms_error, design.predicted_rms))
    if solved.cost > cost * (1.0 + _DEARER) + _DEARER:
        sentences.append(
            f"the quick answer was a worse local optimum{_WEIGHED}: {was} against {there} now, both "
            "before the finish"
        )
    elif cost > solved.cost * (1.0 + _DEARER) + _DEARER:
        sentences.append(
            f"the quick answer was a better local optimum{_WEIGHED} that none of {len(design.starts)} starts "
            f"reaches: {was} against {there} now; undo and redo bring it back"
        )
    if abs(design.rms - quick.rms_error) > _DIFFERS * largest:
        sentences.append(
            f"the finished assembly gives {prefixed(design.rms)} rms where the quick answer gave "
            f"{prefixed(quick.rms_error)}: its cam sets in over an angle, and knots of its rubber are "
            "sharp"
        )
    return sentences


_SAMPLE_TIME = 1e-3
_OLD = (1980, 1, 1, 0, 0, 0)
"""Date of files in an archive, so that the same design gives the same bytes."""


@dataclass(frozen=True)
class ExportedDesign:
    """One file."""

    name: str
    content: bytes


def exported_deck(_: Stage, machine: Assembly, __: Contour, note: str) -> ExportedDesign:
    """Return the machine as a deck."""
    text = f"# {note}\n{deck_text(machine)}" if note else deck_text(machine)
    return ExportedDesign(f"{machine.name}.toml", text.encode())


def exported_c(stage: Stage, machine: Assembly, _: Contour, note: str) -> ExportedDesign:
    """Return cascade observer and torque controller as C, in an archive."""
    from ..export import export_c
    from ..feedback.control import joined, torque_controller
    from ..feedback.observer import CascadeGain, design_observer

    whole = flatten(machine)
    plant = with_outputs(whole, [measured_motion(whole), series_spring(whole).effort])
    stage("designs observer and controller")
    observer = design_observer(plant, sample_time=_SAMPLE_TIME, gain=CascadeGain())
    both = joined(observer, torque_controller(plant, sample_time=_SAMPLE_TIME))
    stage("writes C")
    with tempfile.TemporaryDirectory() as folder:
        files = export_c(both, folder, name="observer_and_controller")
        head = f"/* {note} */\n" if note else ""
        buffer = io.BytesIO()
        with zipfile.ZipFile(buffer, "w", zipfile.ZIP_DEFLATED) as archive:
            for file in [files.header, files.source, files.selftest]:
                archive.writestr(zipfile.ZipInfo(file.name, _OLD), head.encode() + file.read_bytes())
        content = buffer.getvalue()
    return ExportedDesign("observer_and_controller.zip", content)


def exported_fmu(stage: Stage, machine: Assembly, _: Contour, note: str) -> ExportedDesign:
    """Return the plant as an FMU for co-simulation."""
    from ..export import export_fmu

    stage("compiles the plant")
    with tempfile.TemporaryDirectory() as folder:
        plant = flatten(machine)
        if note:
            plant = replace(plant, description=f"{note}. {plant.description}")
        file = export_fmu(plant, Path(folder) / "plant.fmu")
        return ExportedDesign("plant.fmu", file.read_bytes())


def exported_drawing(
    _: Stage, machine: Assembly, contour: Contour, remark: str, *, ending: str
) -> ExportedDesign:
    """Return the drawing of the cam, without the edge where the cable is not declared."""
    kind, radius = declared_edge(machine, series_cam(flatten(machine)))
    machined = None if radius is None else kind(**{"cable_radius": radius})  # type: ignore[arg-type]
    centre = "" if machined else "the cable is not declared: this is the curve of its centre line"
    note = "; ".join(filter(None, (remark, centre)))
    with tempfile.TemporaryDirectory() as folder:
        files = write_drawings(Path(folder), contour, machined=machined, note=note, formats=(ending,))
        content = next(file for file in files if file.suffix == f".{ending}").read_bytes()
    return ExportedDesign(f"cam.{ending}", content)


EXPORTS: dict[str, Callable[[Stage, Assembly, Contour, str], ExportedDesign]] = {
    "deck": exported_deck,
    "svg": partial(exported_drawing, ending="svg"),
    "dxf": partial(exported_drawing, ending="dxf"),
    "c": exported_c,
    "fmu": exported_fmu,
}
"""What a design can be saved as."""
