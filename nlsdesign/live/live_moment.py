"""A question with its answer, and the design that it leaves to the next one."""

from __future__ import annotations

import time
from dataclasses import dataclass, replace

from ..design.parametric.parametric_solver import DesignedNumbers, ParametricDesign, ParametricSolver
from .answers import LiveAnswer
from .at_angle import AngleView
from .full_design import FullDesign, angle_view_of, full_answer
from .limit_words import holding
from .question import LiveQuestion
from .views import controls_of, not_kept, quick_view_of


@dataclass(frozen=True, eq=False)
class LiveMoment:
    """A question with its answer, and the last good design, which may be that of an earlier question.

    Parameters
    ----------
    question
        What was asked.
    answer
        What was answered.
    solved
        The last good design; ``None`` before the first, and where its program is not kept.
    numbers
        Its numbers, which stay without the program.
    shown
        That design angle by angle.
    """

    question: LiveQuestion
    answer: LiveAnswer
    solved: ParametricDesign | None
    numbers: DesignedNumbers | None
    shown: AngleView | None

    @property
    def values(self) -> dict[str, float]:
        """Numbers of that design in SI by name; empty without one."""
        return {} if self.numbers is None else self.numbers.values

    def without_program(self) -> LiveMoment:
        """Return the moment without the program of its design, which can be made again."""
        return replace(self, solved=None)

    def with_controls(self, *, can_undo: bool, can_redo: bool) -> LiveMoment:
        """Return the moment with controls that offer the steps there are."""
        controls = controls_of(self.question, can_undo=can_undo, can_redo=can_redo)
        return replace(self, answer=replace(self.answer, controls=controls))

    def under_revision(self, revision: int) -> LiveMoment:
        """Return a moment of before as the present one."""
        design, shown = self.answer.design, self.shown
        if design is not None and shown is not None and not self.answer.stale:
            design = replace(design, revision=revision)
            shown = shown.seen_as(design)
        answer = replace(self.answer, revision=revision, design=design, seconds=0.0)
        return replace(self, answer=answer, shown=shown)


def first_moment(solver: ParametricSolver, question: LiveQuestion, values: dict[str, float]) -> LiveMoment:
    """Return the moment with which a session begins.

    ``values``: numbers in SI of a design to begin beside, by name; empty without one.
    """
    return _answered(solver, question, None, None, values)


def next_moment(solver: ParametricSolver, question: LiveQuestion, before: LiveMoment) -> LiveMoment:
    """Return the moment of a changed question, answered from the design of the one before."""
    return _answered(solver, question, before, before.solved, before.values)


def opened_moment(
    solver: ParametricSolver, question: LiveQuestion, before: LiveMoment, values: dict[str, float]
) -> LiveMoment:
    """Return the moment of a question that was opened, answered as if nothing had been before.

    ``values``: numbers in SI of a design to begin beside, by name; empty without one.
    """
    return _answered(solver, question, before, None, values)


def settled_moment(solver: ParametricSolver, moment: LiveMoment, full: FullDesign) -> LiveMoment:
    """Return the moment with the whole design as its answer, beside which the next drag begins."""
    question = moment.question
    quick = moment.solved if moment.answer.state == "solved" else None
    answer = full_answer(full, question, moment.answer, quick)
    if full.design is None:
        return replace(moment, answer=answer)
    shown = angle_view_of(answer.design, full.design, question) if answer.design else moment.shown
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
        revision=revision, state=outcome.state, message=message, source="quick",
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
