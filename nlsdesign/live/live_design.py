"""The session of one designer: state, edits, answers."""

from __future__ import annotations

import time
from dataclasses import dataclass

from ..design import CamDesign, DesignSettings, design_cam
from ..errors import ConvergenceError, InfeasibleError, ValueRangeError
from ..model import flatten
from ..model.roles import series_cam
from .answers import AngleAnswer, DesignView, Lazy, LiveAnswer
from .at_angle import AngleView
from .edits import Edit
from .question import LiveQuestion, finite_in
from .views import controls_of, view_of

MOST_UNDO = 200
"""Steps that can be undone."""
MOST_SNAPSHOTS = 8
"""Designs that are kept side by side."""
_FULL = DesignSettings(look_for_size_ranges=False, look_for_remedies=False, draws=0)
_NAME = 60


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


class LiveDesign:
    """State, edits and answers of one designer; one thread at a time.

    Parameters
    ----------
    question
        With which it begins, for instance ``gallery_question("cam-actuator")``.
    """

    def __init__(self, question: LiveQuestion) -> None:
        self._question = question
        self._past: list[LiveQuestion] = []
        self._future: list[LiveQuestion] = []
        self._revision = 0
        self._shown: AngleView | None = None
        self._grip: str | None = None
        self.snapshots: dict[str, Snapshot] = {}
        self.answer = self._answered()

    @property
    def question(self) -> LiveQuestion:
        """What is asked now."""
        return self._question

    def apply(self, edit: Edit, *, drag: str | None = None) -> LiveAnswer:
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
        changed = edit.applied(self._question)
        changed.limit_values, changed.numbers, changed.target  # noqa: B018 - refused before anything changes
        if drag is None or drag != self._grip:
            self._past = [*self._past, self._question][-MOST_UNDO:]
        self._grip, self._future = drag, []
        return self._ask(changed)

    def undo(self) -> LiveAnswer:
        """Take the last edit back and return the answer to the question before it, as it was."""
        if self._past:
            self._future.append(self._question)
            self._grip = None
            return self._ask(self._past.pop())
        return self.answer

    def redo(self) -> LiveAnswer:
        """Do the edit that was taken back again."""
        if self._future:
            self._past.append(self._question)
            self._grip = None
            return self._ask(self._future.pop())
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
        if self._shown is None:
            raise ValueRangeError("angle", "there is no design yet", next_step="widen a limit first")
        finite_in("angle", angle, -6.3, 6.3)
        return self._shown.answer(angle, self._loop_at(angle))

    def _loop_at(self, angle: float) -> Lazy:
        return Lazy("asked for later", self._shown.view.revision if self._shown else 0)

    def keep(self, name: str) -> Snapshot:
        """Keep the design as it is under a name.

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
        self.snapshots[name] = Snapshot(name, self._question, self.answer)
        return self.snapshots[name]

    def _ask(self, question: LiveQuestion) -> LiveAnswer:
        self._question = question
        self._revision += 1
        self.answer = self._answered()
        return self.answer

    def _answered(self) -> LiveAnswer:
        began = time.perf_counter()
        state, message, conflicts = "solved", "", ()
        try:
            q = self._question
            design = design_cam(
                q.actuator,
                target=q.target,
                free=q.free,
                keep=q.keep,
                settings=DesignSettings(
                    starts=1, look_for_size_ranges=False, look_for_remedies=False, draws=0
                ),
            )
            self._shown = angle_view(view_of(q, self._revision, design), design)
            message = "" if design.miss is None else str(design.miss)
        except InfeasibleError as error:
            state, message = "infeasible", str(error)
        except ConvergenceError as error:
            state, message = "not solved", str(error)
        return LiveAnswer(
            revision=self._revision,
            state=state,
            message=message,
            source="quick",
            design=self._shown.view if self._shown else None,
            controls=controls_of(self._question, can_undo=bool(self._past), can_redo=bool(self._future)),
            seconds=time.perf_counter() - began,
            conflicts=conflicts,
        )


def angle_view(view: DesignView, design: CamDesign) -> AngleView:
    """Return a finished design as it is looked at angle by angle.

    Parameters
    ----------
    view
        What is shown of it.
    design
        Finished.
    """
    model = flatten(design.actuator)
    pieces = series_cam(model, design.drive).specimens
    length = model.values[pieces[0].rest_length] if pieces else 2.0 * float(design.contour.radii.max())
    return AngleView(view, design.contour, length, design.actuator)
