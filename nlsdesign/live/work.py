"""Long work on a design: the whole design, tolerance cloud, torque loop, diagnosis; each in a process."""

from __future__ import annotations

from abc import ABC, abstractmethod
from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np

from ..components.assembly.named_parts import Assembly
from ..design import Target, ToleranceResult, tolerance_analysis
from ..foundation.arrays import Array
from ..foundation.errors import ValueRangeError
from .answers import Lazy, LoopResponse
from .at_angle import AngleView, loop_responses
from .background import BackgroundWork, WorkState
from .full_design import whole_design
from .question import LiveQuestion

MOST_DRAWS = 2000
_FEWEST_DRAWS = 20
_MOST_FILES = 60
_MOST_BYTES = 200_000_000


@dataclass(frozen=True)
class LiveTask(ABC):
    """Base of the kinds of long work; of each kind one runs at a time."""

    @abstractmethod
    def call(
        self, question: LiveQuestion, shown: AngleView | None
    ) -> tuple[Callable[..., Any], tuple[Any, ...]]:
        """Return the function that does it and its arguments, picklable."""


@dataclass(frozen=True)
class SettleDesign(LiveTask):
    """The whole design of the question: :class:`~.full_design.FullDesign`."""

    def call(
        self, question: LiveQuestion, shown: AngleView | None
    ) -> tuple[Callable[..., Any], tuple[Any, ...]]:
        """Return the whole design."""
        asked = (question.actuator, question.target, question.free, question.keep)
        return whole_design, (*asked, question.held_contour)


@dataclass(frozen=True)
class ToleranceCloud(LiveTask):
    """Torque of made springs around the design: :class:`CloudAnswer`."""

    draws: int = 200
    seed: int = 1

    def call(
        self, question: LiveQuestion, shown: AngleView | None
    ) -> tuple[Callable[..., Any], tuple[Any, ...]]:
        """Return the analysis on the finished assembly."""
        for what, number, least, most in (
            ("draws", self.draws, _FEWEST_DRAWS, MOST_DRAWS),
            ("seed", self.seed, 0, 2**31 - 1),
        ):
            if isinstance(number, bool) or not isinstance(number, int) or not least <= number <= most:
                raise ValueRangeError(
                    f"{what} = {number!r:.40}", f"must be a whole number from {least} to {most}",
                    next_step="take 200 draws",
                )  # fmt: skip
        view = _designed(shown)
        return tolerance_cloud, (view.machine, question.target, self.draws, self.seed)


@dataclass(frozen=True)
class TorqueLoop(LiveTask):
    """The torque loop over the angle: angles, and a :class:`~.answers.LoopResponse` at each."""

    def call(
        self, question: LiveQuestion, shown: AngleView | None
    ) -> tuple[Callable[..., Any], tuple[Any, ...]]:
        """Return the responses of the loop."""
        view = _designed(shown)
        return loop_responses, (view.machine, float(view.view.columns[0].values[-1]))


@dataclass(frozen=True)
class DiagnoseRecords(LiveTask):
    """What bench records say that the declared machine lacks: :class:`DiagnosisAnswer`.

    Parameters
    ----------
    folder
        Of the records, as for ``load_records``; bounded in number and size of files.
    """

    folder: Path

    def call(
        self, question: LiveQuestion, shown: AngleView | None
    ) -> tuple[Callable[..., Any], tuple[Any, ...]]:
        """Return the diagnosis of the machine as it is declared, not as it is designed."""
        files = [file for file in Path(self.folder).iterdir() if file.is_file()]
        size = sum(file.stat().st_size for file in files)
        if not 1 <= len(files) <= _MOST_FILES or size > _MOST_BYTES:
            raise ValueRangeError(
                f"{len(files)} files of records, {size / 1e6:.1f} MB",
                f"must be 1 to {_MOST_FILES} files and at most {_MOST_BYTES / 1e6:.0f} MB",
                next_step="take some records out, or use nlsdesign diagnose",
            )
        return diagnosis, (question.actuator, Path(self.folder))


class LiveWork:
    """The long work of one session, by kind."""

    def __init__(self) -> None:
        self._running: dict[str, BackgroundWork] = {}
        self._designs: dict[str, AngleView | None] = {}

    def start(
        self, task: LiveTask, question: LiveQuestion, revision: int, shown: AngleView | None
    ) -> WorkState:
        """Start a task; one of its kind that runs is cancelled."""
        work, arguments = task.call(question, shown)
        name = type(task).__name__
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
        work, revision = self._running.get(TorqueLoop.__name__), shown.view.revision
        state = None if work is None else work.state()
        begun = self._designs.get(TorqueLoop.__name__)
        # A checked design has the revision of the quick one whose place it takes, but not its contour.
        if state is None or begun is None or begun.contour is not shown.contour:
            return Lazy("asked for later", revision)
        if state.state != "done":
            return Lazy(state.state, revision, None, state.message)
        angles: Array = state.value[0]
        responses: list[LoopResponse] = state.value[1]
        nearest = int(np.argmin(np.abs(angles - abs(angle))))
        words = f"at {np.degrees(angles[nearest]):.1f}°, the nearest of {len(angles)} angles"
        return Lazy("done", revision, responses[nearest], words)


@dataclass(frozen=True, eq=False)
class CloudAnswer:
    """What the spreads of all numbers do to the torque.

    Parameters
    ----------
    angles
        In rad.
    nominal
        Torque without deviations in N·m.
    band
        Torque below which 5, 50 and 95 % of the springs lie, shape (3, angles).
    errors
        Rms error of each draw in N·m.
    rows
        Summary: pairs of text.
    """

    angles: Array
    nominal: Array
    band: Array
    errors: Array
    rows: tuple[tuple[str, str], ...]


def tolerance_cloud(
    stage: Callable[[str], None], machine: Assembly, target: Target, draws: int, seed: int
) -> CloudAnswer:
    """Return the tolerance analysis of a design."""
    stage(f"computes {draws} made springs")
    result: ToleranceResult = tolerance_analysis(machine, target=target, draws=draws, seed=seed)
    return CloudAnswer(result.angles, result.nominal, result.band, result.errors, tuple(result.rows()))


@dataclass(frozen=True, eq=False)
class DiagnosisAnswer:
    """What a diagnosis came to.

    Parameters
    ----------
    verdict
        ``none``, ``named``, ``unknown``, ``undecidable`` or ``data_suspect``.
    effects
        What was named, in words.
    gap
        Block, role of the records, and error before and after with noise floor and signal, in the unit.
    course
        A held-out record over time: name, quantity, unit, time, measured, before, after.
    words
        The whole verdict as text.
    deck
        The better model as a deck.
    """

    verdict: str
    effects: tuple[str, ...]
    gap: dict[str, Any]
    course: dict[str, Any]
    words: str
    deck: str


def diagnosis(stage: Callable[[str], None], actuator: Assembly, folder: Path) -> DiagnosisAnswer:
    """Return what the records of a folder say."""
    from ..bench.discrepancy import diagnose
    from ..bench.identification import load_records
    from ..components.assembly.deck_writer import deck_text
    from ..model import flatten

    stage("reads the records")
    records = load_records(folder, flatten(actuator))
    verdict = diagnose(actuator, records, progress=stage)
    course = verdict.course
    every = max(1, len(course.time) // 1000)
    return DiagnosisAnswer(
        verdict=verdict.verdict,
        effects=tuple(each.headline(verdict.actuator) for each in verdict.effects),
        gap=verdict.gap()._asdict(),
        course={
            "record": course.record, "quantity": course.quantity, "unit": course.unit, "role": course.role,
            "time": course.time[::every], "measured": course.measured[::every],
            "before": course.before[::every], "after": course.after[::every],
        },
        words=str(verdict),
        deck=deck_text(verdict.actuator),
    )  # fmt: skip


def _designed(shown: AngleView | None) -> AngleView:
    if shown is None:
        raise ValueRangeError("design", "there is none yet", next_step="widen a limit first")
    return shown
