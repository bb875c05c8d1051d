"""The session of one designer: state, edits, answers."""

from __future__ import annotations

from ..foundation.errors import ValueRangeError
from .answers import AngleAnswer, LiveAnswer
from .at_angle import AngleView
from .background import WorkState
from .edits import LiveEdit
from .full_design import FullDesign
from .live_history import LiveHistory
from .live_snapshots import Snapshot, Snapshots
from .question import LiveQuestion, finite_in
from .saved import SavedDesign, saved
from .work import LiveTask, LiveWork, ToleranceCloud

_LARGEST_ANGLE = 6.3


class LiveDesign:
    """State, edits and answers of one designer; one thread at a time.

    Each edit gives an answer at once, from the previous design. :meth:`start` begins the whole design
    (``SettleDesign()``) in a process of its own; its answer replaces the quick one when
    :meth:`poll` finds it done.

    Parameters
    ----------
    question
        With which it begins, for instance ``gallery_question("cam-actuator")``.
    values
        Numbers in SI of a design to begin beside, as :func:`~.saved.reopened` gives them.
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

    def start(self, task: LiveTask) -> WorkState:
        """Start a piece of long work on the design as it stands; one of its kind that runs is cancelled."""
        if isinstance(task, ToleranceCloud) and self.answer.stale:
            raise ValueRangeError(
                "tolerance cloud", "would hold an earlier design against the target of now",
                next_step="widen a limit until there is a design",
            )  # fmt: skip
        return self.work.start(task, self.question, self.answer.revision, self.shown)

    def poll(self) -> tuple[WorkState, ...]:
        """Return how far all work is; a whole design that is done replaces the quick answer."""
        states = self.work.states()
        for state in states:
            present = state.revision == self.answer.revision and self.answer.source == "quick"
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
