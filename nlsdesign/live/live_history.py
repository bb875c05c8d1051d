"""The moments of one session: the present one, those that can be undone, those that can be done again."""

from __future__ import annotations

from ..design.parametric.parametric_solver import ParametricSolver
from .full_design import FullDesign
from .live_moment import LiveMoment, first_moment, next_moment, opened_moment, settled_moment
from .question import LiveQuestion

MOST_UNDO = 200
"""Steps that can be undone."""


class LiveHistory:
    """The moments of one session; one whose program the solver has dropped goes on without it.

    Parameters
    ----------
    question
        With which it begins.
    values
        Numbers in SI of a design to begin beside, by name; empty without one.
    """

    def __init__(self, question: LiveQuestion, values: dict[str, float]) -> None:
        self._solver = ParametricSolver()
        self._grip: str | None = None
        self.past: list[LiveMoment] = []
        self.future: list[LiveMoment] = []
        self.now = first_moment(self._solver, question, values)

    def ask(self, question: LiveQuestion, drag: str | None, *, last: bool = False) -> None:
        """Make a changed question with its answer the present moment."""
        moment = next_moment(self._solver, question, self.now)
        if drag is None or drag != self._grip:
            self.past = [*self.past, self.now][-MOST_UNDO:]
        self._grip, self.future = None if last else drag, []
        self._go_to(moment)

    def open(self, question: LiveQuestion, values: dict[str, float]) -> None:
        """Make another question with its answer the present moment, one step by itself.

        ``values``: numbers in SI of a design to begin beside; empty without one.
        """
        moment = opened_moment(self._solver, question, self.now, values)
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
                    row[k] = each.without_program()
        self.now = moment.with_controls(can_undo=bool(self.past), can_redo=bool(self.future))
