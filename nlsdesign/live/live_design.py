"""The design of one designer: state, edits, answers, what can be undone, designs kept under a name."""

from __future__ import annotations

import time
from dataclasses import dataclass, replace

from ..design.parametric.parametric_solver import DesignedNumbers, ParametricDesign, ParametricSolver
from ..foundation.errors import ValueRangeError
from .answers import AngleAnswer, AnswerSource, AnswerState, LiveAnswer
from .at_angle import AngleView
from .background import WorkState
from .edits import LiveEdit
from .question import LiveQuestion, finite_in
from .saved import SavedDesign, saved
from .views import controls_of, holding, not_kept, quick_view_of
from .work import FullDesign, LiveWork, Work, full_answer

MOST_SNAPSHOTS = 8
"""Designs that are kept side by side."""
_NAME = 60


@dataclass(frozen=True, eq=False)
class Snapshot:
    """A design that was kept under a name."""

    name: str
    question: LiveQuestion
    answer: LiveAnswer


class Snapshots(dict[str, Snapshot]):
    """The designs that are kept, by name."""

    def keep(self, name: str, question: LiveQuestion, answer: LiveAnswer) -> Snapshot:
        """Keep a design under a name; one of that name is replaced."""
        if answer.design is None or answer.stale:
            raise ValueRangeError(
                f"design '{name:.80}'", "is not there: what is shown belongs to an earlier question",
                next_step="widen a limit until there is a design, or take the edit back",
            )  # fmt: skip
        if not 1 <= len(name.strip()) <= _NAME or not name.isprintable():
            raise ValueRangeError(
                f"name of a design '{name:.80}'", f"has 1 to {_NAME} printable characters",
                next_step="take a short name",
            )  # fmt: skip
        if name not in self and len(self) >= MOST_SNAPSHOTS:
            raise ValueRangeError(
                f"{len(self)} designs kept", f"are the most, {MOST_SNAPSHOTS}",
                next_step="drop one of them",
            )  # fmt: skip
        self[name] = Snapshot(name, question, answer)
        return self[name]


@dataclass(frozen=True, eq=False)
class LiveMoment:
    """A question with its answer, and the last good design, which may be that of an earlier question."""

    question: LiveQuestion  # what was asked
    answer: LiveAnswer  # what was answered
    # solved: the last good design; None before the first, and where its program is not kept
    solved: ParametricDesign | None
    numbers: DesignedNumbers | None  # its numbers, which stay without the program
    shown: AngleView | None  # that design angle by angle

    @property
    def values(self) -> dict[str, float]:
        """Numbers of that design in SI by name; empty without one."""
        return {} if self.numbers is None else self.numbers.values

    def under_revision(self, revision: int) -> LiveMoment:
        """Return a moment of before as the present one."""
        design, shown = self.answer.design, self.shown
        if design is not None and shown is not None and not self.answer.stale:
            design = replace(design, revision=revision)
            shown = shown.seen_as(design)
        answer = replace(self.answer, revision=revision, design=design, seconds=0.0)
        return replace(self, answer=answer, shown=shown)


def settled_moment(solver: ParametricSolver, moment: LiveMoment, full: FullDesign) -> LiveMoment:
    """Return the moment with the whole design as its answer, beside which the next drag begins."""
    question = moment.question
    quick = moment.solved if moment.answer.state is AnswerState.SOLVED else None
    answer = full_answer(full, question, moment.answer, quick)
    if full.design is None:
        return replace(moment, answer=answer)
    shown, finished = moment.shown, full.design
    if answer.design:
        shown = AngleView(
            answer.design, finished.contour, question.cam, lambda: finished.actuator, full.mounting
        )
    solved = solver.beside_design(question, full.design)
    numbers = moment.numbers if solved is None else solved.numbers
    return LiveMoment(question, answer, solved or moment.solved, numbers, shown)


def _answered(
    solver: ParametricSolver,
    question: LiveQuestion,
    before: LiveMoment | None,
    beside: ParametricDesign | None,
    values: dict[str, float],
) -> LiveMoment:
    """Return the moment of a question.

    ``beside``, or else ``values`` in SI by name, is the design from which it is answered; a question that was
    opened, and the first one, are answered as if nothing had been before.
    """
    began = time.perf_counter()
    revision = before.answer.revision + 1 if before else 1
    solved, outcome = solver.answer(question, beside, values)
    shown = before.shown if before else None
    message = outcome.words
    if solved is not None:
        shown = AngleView(
            quick_view_of(question, revision, solved), solved.contour, question.cam, solved.numbers.machine
        )
        sentences = [*shown.view.beyond, *([] if shown.view.met else [missed(question, shown)])]
        message = "; ".join([*sentences, *not_kept(question, shown.view.margins)])
    controls = controls_of(question, can_undo=before is not None, can_redo=False)
    answer = LiveAnswer(
        revision=revision, state=AnswerState(outcome.state), message=message, source=AnswerSource.QUICK,
        design=shown.view if shown else None, controls=controls,
        seconds=time.perf_counter() - began, conflicts=outcome.conflicts,
    )  # fmt: skip
    last, numbers = (before.solved, before.numbers) if before else (None, None)
    return LiveMoment(question, answer, solved or last, solved.numbers if solved else numbers, shown)


def missed(question: LiveQuestion, shown: AngleView) -> str:
    """Return how far a design misses its target, and which limits hold it."""
    view = shown.view
    holders = holding(question, view.margins)
    held = f"held by {', '.join(holders)}" if holders else "no limit holds it"
    share = f"{100.0 * view.relative_error:.3g} %"
    return f"misses its target: {share} rms of the largest torque, 1 % allowed; {held}"


MOST_UNDO = 200
"""Steps that can be undone."""


class LiveHistory:
    """The moments of one session; one whose program the solver has dropped goes on without it.

    ``values``: numbers in SI of a design to begin beside, by name; empty without one.
    """

    def __init__(self, question: LiveQuestion, values: dict[str, float]) -> None:
        self._solver = ParametricSolver()
        self._grip: str | None = None
        self.past: list[LiveMoment] = []
        self.future: list[LiveMoment] = []
        self.now = _answered(self._solver, question, None, None, values)

    def ask(self, question: LiveQuestion, drag: str | None, *, last: bool = False) -> None:
        """Make a changed question with its answer the present moment."""
        moment = _answered(self._solver, question, self.now, self.now.solved, self.now.values)
        if drag is None or drag != self._grip:
            self.past = [*self.past, self.now][-MOST_UNDO:]
        self._grip, self.future = None if last else drag, []
        self._go_to(moment)

    def open(self, question: LiveQuestion, values: dict[str, float]) -> None:
        """Make another question with its answer the present moment, one step by itself.

        ``values``: numbers in SI of a design to begin beside; empty without one.
        """
        moment = _answered(self._solver, question, self.now, None, values)
        self.past, self.future, self._grip = [*self.past, self.now][-MOST_UNDO:], [], None
        self._go_to(moment)

    def undo(self) -> None:
        """Make the moment before the present one, where there is one."""
        self._step(self.past, self.future)

    def redo(self) -> None:
        """Make the moment after the present one, where there is one."""
        self._step(self.future, self.past)

    def settle(self, full: FullDesign) -> None:
        """Take the whole design as the answer of the present moment."""
        self.now = settled_moment(self._solver, self.now, full)

    def _step(self, source: list[LiveMoment], left: list[LiveMoment]) -> None:
        if source:
            left.append(self.now)
            self._grip = None
            self._go_to(source.pop().under_revision(self.now.answer.revision + 1))

    def _go_to(self, moment: LiveMoment) -> None:
        for row in (self.past, self.future):
            for k, each in enumerate(row):
                if each.solved is not None and not self._solver.keeps(each.solved):
                    row[k] = replace(each, solved=None)
        controls = controls_of(moment.question, can_undo=bool(self.past), can_redo=bool(self.future))
        self.now = replace(moment, answer=replace(moment.answer, controls=controls))


_LARGEST_ANGLE = 6.3


class LiveDesign:
    """State, edits and answers of one designer; one thread at a time.

    Each edit gives an answer at once, from the previous design. :meth:`start` begins the whole design
    (``Work.SETTLE``) in a process of its own; its answer replaces the quick one when
    :meth:`poll` finds it done.

    ``question``: with which it begins, for instance ``gallery_question("cam-actuator")``. ``values``: numbers
    in SI of a design to begin beside, as :func:`~.saved.reopened` gives them.
    """

    def __init__(self, question: LiveQuestion, values: dict[str, float] | None = None) -> None:
        self._history = LiveHistory(question, values or {})
        self.snapshots = Snapshots()
        self.work = LiveWork()

    @property
    def question(self) -> LiveQuestion:
        """What is asked now."""
        return self._history.now.question

    @property
    def answer(self) -> LiveAnswer:
        """The answer to it."""
        return self._history.now.answer

    @property
    def shown(self) -> AngleView | None:
        """The last good design as it is looked at angle by angle; ``None`` before the first."""
        return self._history.now.shown

    def apply(self, edit: LiveEdit, *, drag: str | None = None, last: bool = False) -> LiveAnswer:
        """Do an edit and return the answer."""
        question = edit.applied(self.question, self.shown)
        if edit.begins_anew:
            self._history.open(question, {})
        else:
            self._history.ask(question, drag, last=last)
        return self.answer

    def undo(self) -> LiveAnswer:
        """Take the last edit back; the design is that of before, to the last digit."""
        self._history.undo()
        return self.answer

    def redo(self) -> LiveAnswer:
        """Do the edit that was taken back again, with the design that it had."""
        self._history.redo()
        return self.answer

    def at(self, angle: float) -> AngleAnswer:
        """Return what holds at one angle for the last good design."""
        finite_in("angle", angle, lowest=-_LARGEST_ANGLE, highest=_LARGEST_ANGLE, unit="rad")
        if self.shown is None:
            raise ValueRangeError("angle", "there is no design yet", next_step="widen a limit first")
        return self.shown.answer(angle, self.work.loop_at(angle, self.shown))

    def start(self, name: Work, *settings: object) -> WorkState:
        """Start long work of a kind on the design as it stands; one of its kind that runs is cancelled."""
        if name is Work.TOLERANCE and self.answer.stale:
            raise ValueRangeError(
                "tolerance cloud", "would hold an earlier design against the target of now",
                next_step="widen a limit until there is a design",
            )  # fmt: skip
        return self.work.start(name, self.question, self.answer.revision, self.shown, *settings)

    def poll(self) -> tuple[WorkState, ...]:
        """Return how far all work is; a whole design that is done replaces the quick answer."""
        states = self.work.states()
        for state in states:
            present = state.revision == self.answer.revision and self.answer.source is AnswerSource.QUICK
            if isinstance(state.value, FullDesign) and present:
                self._history.settle(state.value)
        return states

    def keep(self, name: str) -> Snapshot:
        """Keep the design as it is under a name, to be shown beside others.

        ``name``: up to 60 characters; one of that name is replaced.
        """
        return self.snapshots.keep(name, self.question, self.answer)

    def saved(self) -> SavedDesign:
        """Return deck, design file and where the search stands, as text."""
        return saved(self.question, self._history.now.values)


def open_question(live: LiveDesign, question: LiveQuestion, values: dict[str, float]) -> LiveAnswer:
    """Go on with another question, one step that can be undone; what was computed before is forgotten.

    ``values``: numbers in SI of a design to begin beside; empty without one.
    """
    live._history.open(question, values)
    live.work.forget()
    return live.answer
