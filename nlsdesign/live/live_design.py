"""The session of one designer: state, edits, answers."""

from __future__ import annotations

import time
from dataclasses import dataclass, replace

from ..errors import ValueRangeError
from .answers import AngleAnswer, LiveAnswer
from .at_angle import AngleView
from .background import WorkState
from .edits import LiveEdit
from .full_design import FullDesign, angle_view_of, full_answer
from .question import LiveQuestion, finite_in
from .quick_design import DesignedNumbers, QuickDesign, QuickSolver
from .saved import SavedDesign, saved
from .views import controls_of
from .work import LiveTask, LiveWork

MOST_UNDO = 200
"""Steps that can be undone."""
MOST_SNAPSHOTS = 8
"""Designs that are kept side by side."""
_NAME = 60
_LARGEST_ANGLE = 6.3


@dataclass(frozen=True, eq=False)
class Snapshot:
    """A design that was kept under a name.

    Parameters
    ----------
    name
        Given by the designer.
    question
        What was asked.
    answer
        What was answered.
    """

    name: str
    question: LiveQuestion
    answer: LiveAnswer


@dataclass(frozen=True, eq=False)
class _Moment:
    """A question with its answer, and the last good design, which may be that of an earlier question."""

    question: LiveQuestion
    answer: LiveAnswer
    solved: QuickDesign | None
    numbers: DesignedNumbers | None
    shown: AngleView | None

    @property
    def values(self) -> dict[str, float]:
        """Numbers of that design in SI by name; empty without one."""
        return {} if self.numbers is None else self.numbers.values

    def without_program(self) -> _Moment:
        """Return the moment without the program of its design, which can be made again."""
        return replace(self, solved=None)


class LiveDesign:
    """State, edits and answers of one designer; one thread at a time.

    Each edit gives an answer at once, from the previous design. :meth:`settle` starts the whole design in a
    process of its own, whose answer replaces the quick one when :meth:`poll` finds it done.

    Parameters
    ----------
    question
        With which it begins, for instance ``gallery_question("cam-actuator")``.
    values
        Numbers in SI of a design to begin beside, as :func:`~.saved.reopened` gives them.
    """

    def __init__(self, question: LiveQuestion, values: dict[str, float] | None = None) -> None:
        self._solver = QuickSolver()
        self._past: list[_Moment] = []
        self._future: list[_Moment] = []
        self._revision = 0
        self._grip: str | None = None
        self.snapshots: dict[str, Snapshot] = {}
        self.work = LiveWork()
        self._now = self._answered(question, None, values or {})

    @property
    def question(self) -> LiveQuestion:
        """What is asked now."""
        return self._now.question

    @property
    def answer(self) -> LiveAnswer:
        """The answer to it."""
        return self._now.answer

    @property
    def shown(self) -> AngleView | None:
        """The last good design as it is looked at angle by angle; ``None`` before the first."""
        return self._now.shown

    def apply(self, edit: LiveEdit, *, drag: str | None = None) -> LiveAnswer:
        """Do an edit and return the answer.

        Parameters
        ----------
        edit
            What the designer does.
        drag
            Name of what is being dragged: edits with the same name, one after the other, are undone together.

        Raises
        ------
        NlsError
            If the edit cannot be done; nothing has changed then.
        """
        changed = edit.applied(self.question, self.shown)
        moment = self._answered(changed, self._now, self._now.values)
        if drag is None or drag != self._grip:
            self._past = [*self._past, self._now][-MOST_UNDO:]
        self._grip, self._future = drag, []
        return self._go_to(moment)

    def undo(self) -> LiveAnswer:
        """Take the last edit back; the design is that of before, to the last digit."""
        if self._past:
            self._future.append(self._now)
            self._grip = None
            return self._return_to(self._past.pop())
        return self.answer

    def redo(self) -> LiveAnswer:
        """Do the edit that was taken back again, with the design that it had."""
        if self._future:
            self._past.append(self._now)
            self._grip = None
            return self._return_to(self._future.pop())
        return self.answer

    def at(self, angle: float) -> AngleAnswer:
        """Return what holds at one angle for the last good design.

        Parameters
        ----------
        angle
            In rad.

        Raises
        ------
        ValueRangeError
            If the angle is out of range, or there is no design yet.
        """
        finite_in("angle", angle, -_LARGEST_ANGLE, _LARGEST_ANGLE)
        if self.shown is None:
            raise ValueRangeError("angle", "there is no design yet", next_step="widen a limit first")
        return self.shown.answer(angle, self.work.loop_at(angle, self.shown.view.revision))

    def start(self, task: LiveTask) -> WorkState:
        """Start a piece of long work on the design as it stands; one of its kind that runs is cancelled.

        Parameters
        ----------
        task
            For instance ``SettleDesign()`` or ``ToleranceCloud(draws=200)``.

        Raises
        ------
        ValueRangeError
            If it needs a design and there is none.
        """
        return self.work.start(task, self.question, self._revision, self.shown)

    def poll(self) -> tuple[WorkState, ...]:
        """Return how far all work is; a whole design that is done replaces the quick answer."""
        states = self.work.states()
        for state in states:
            if isinstance(state.value, FullDesign) and self._takes(state):
                self._settled(state.value)
        return states

    def keep(self, name: str) -> Snapshot:
        """Keep the design as it is under a name, to be shown beside others.

        Parameters
        ----------
        name
            Up to 60 characters; one of that name is replaced.

        Raises
        ------
        ValueRangeError
            If the name is empty or too long, or too many are kept.
        """
        if not 1 <= len(name.strip()) <= _NAME or not name.isprintable():
            raise ValueRangeError(
                f"name of a design '{name:.80}'", f"has 1 to {_NAME} printable characters",
                next_step="take a short name",
            )  # fmt: skip
        if name not in self.snapshots and len(self.snapshots) >= MOST_SNAPSHOTS:
            raise ValueRangeError(
                f"{len(self.snapshots)} designs kept", f"are the most, {MOST_SNAPSHOTS}",
                next_step="drop one of them",
            )  # fmt: skip
        self.snapshots[name] = Snapshot(name, self.question, self.answer)
        return self.snapshots[name]

    def saved(self) -> SavedDesign:
        """Return deck, design file and where the search stands, as text."""
        return saved(self.question, self._now.values)

    def _takes(self, state: WorkState) -> bool:
        return state.revision == self._revision and self.answer.source == "quick"

    def _settled(self, full: FullDesign) -> None:
        """Take the whole design as the answer; where it is better, the next drag begins from it."""
        quick = self._now.solved if self.answer.state == "solved" else None
        answer = full_answer(full, self.question, self.answer, quick)
        if full.design is None:
            self._now = replace(self._now, answer=answer)
            return
        shown = angle_view_of(answer.design, full.design, self.question) if answer.design else self.shown
        solved = self._solver.beside_design(self.question, full.design)
        numbers = self._now.numbers if solved is None else solved.numbers
        self._now = _Moment(self.question, answer, solved or self._now.solved, numbers, shown)

    def _go_to(self, moment: _Moment) -> LiveAnswer:
        for row in (self._past, self._future):
            for k, each in enumerate(row):
                if each.solved is not None and not self._solver.keeps(each.solved):
                    row[k] = each.without_program()
        controls = controls_of(moment.question, can_undo=bool(self._past), can_redo=bool(self._future))
        self._now = replace(moment, answer=replace(moment.answer, controls=controls))
        return self.answer

    def _return_to(self, moment: _Moment) -> LiveAnswer:
        """Make a moment of before the present one, under a revision of its own."""
        self._revision += 1
        stale, design = moment.answer.stale, moment.answer.design
        shown = moment.shown
        if design is not None and shown is not None and not stale:
            design = replace(design, revision=self._revision)
            shown = shown.seen_as(design)
        answer = replace(moment.answer, revision=self._revision, design=design, seconds=0.0)
        return self._go_to(replace(moment, answer=answer, shown=shown))

    def _answered(self, question: LiveQuestion, before: _Moment | None, values: dict[str, float]) -> _Moment:
        began = time.perf_counter()
        revision = self._revision + 1
        solved, outcome = self._solver.answer(question, before.solved if before else None, values)
        shown = before.shown if before else None
        message = outcome.words
        if solved is not None:
            shown = AngleView(solved.view(revision), solved.contour, question.cam, solved.numbers.machine)
            message = "; ".join([*([] if shown.view.met else [missed(shown)]), *not_kept(question)])
        controls = controls_of(question, can_undo=bool(self._past), can_redo=bool(self._future))
        self._revision = revision
        answer = LiveAnswer(
            revision=revision, state=outcome.state, message=message, source="quick",
            design=shown.view if shown else None, controls=controls,
            seconds=time.perf_counter() - began, conflicts=outcome.conflicts,
        )  # fmt: skip
        last, numbers = (before.solved, before.numbers) if before else (None, None)
        return _Moment(question, answer, solved or last, solved.numbers if solved else numbers, shown)


def missed(shown: AngleView) -> str:
    """Return how far a design misses its target, and which limits hold it.

    Parameters
    ----------
    shown
        The design.
    """
    view = shown.view
    held = f"held by {', '.join(view.active)}" if view.active else "no limit holds it"
    share = f"{100.0 * view.relative_error:.3g} %"
    return f"misses its target: {share} rms of the largest torque, 1 % allowed; {held}"


def not_kept(question: LiveQuestion) -> list[str]:
    """Return in words which limits are shown and not kept.

    Parameters
    ----------
    question
        As it stands.
    """
    names = [name for name, each in question.limit_values.items() if not question.keeps(each.kind)]
    return [f"the contour is held, so {', '.join(names)} is shown and not kept"] if names else []
