"""What a session says to its page: answers, what holds at the angle, news of work."""

from __future__ import annotations

import functools
import time
from pathlib import Path
from typing import Any

from ..components.materials.library import materials
from ..components.materials.material_law import missing_law
from ..design.optimisation.limits import limit_kinds
from ..foundation.errors import NlsError
from .answers import LiveAnswer, to_json
from .gallery import gallery_cards
from .limit_words import in_words
from .live_design import LiveDesign
from .outbox import Outbox
from .page_data import angle_data, answer_data, design_data, mechanism_data
from .work import SettleDesign, TorqueLoop
from .work_news import WorkNews

_REST = 0.4
"""Seconds without an edit after which the whole design is begun: it would be in the way of a hand."""


class SessionNews:
    """The design of a session and what its page is told of it.

    Parameters
    ----------
    live
        The design.
    records
        Folder of the records that are uploaded.
    outbox
        To the page.
    trouble
        Why this is not the design that was asked for; empty if it is.
    """

    def __init__(self, live: LiveDesign, records: Path, outbox: Outbox, *, trouble: str = "") -> None:
        self.live = live
        self.work = WorkNews(live, records)
        self._outbox = outbox
        self._trouble = trouble
        self._angle: float | None = None
        self._settle_at: float | None = None
        self._look_due = False

    @property
    def idle(self) -> bool:
        """Whether nothing is left to do but to wait for the page."""
        return self._settle_at is None and not self._look_due and not self.work.running

    def everything(self, number: int | None) -> None:
        """Show everything, as to a page that was loaded just now."""
        self.answer(self.live.answer, number, None)
        self.kept(number)
        self._outbox.page({"what": "gallery", **choices()})
        for each in self.work.all():
            self._outbox.page({"what": "work", "work": each})
        if self._trouble:
            self.refuse(self._trouble, number)
        self.settle_soon()

    def answer(self, answer: LiveAnswer, number: int | None, angle: float | None) -> None:
        """Send an answer with the mechanism; what takes longer at the angle follows on a pause.

        ``angle``: that the page looks at in rad; that of before for ``None``.
        """
        at = None
        if answer.design is not None:
            last = float(answer.design.columns[0].values[-1])
            wanted = self._angle if angle is None else angle
            self._angle = min(0.6 * last if wanted is None else wanted, last)
            at = mechanism_data(self.live.shown, self._angle)
            self._look_due = True
        self._outbox.page({"what": "answer", "number": number, "answer": answer_data(answer), "at": at})

    def turn(self, angle: float, number: int | None) -> None:
        """Show the mechanism at another angle."""
        self._angle = angle
        at = mechanism_data(self.live.shown, angle)
        self._outbox.page({"what": "at", "number": number, "at": at})
        self._look_due = True

    def kept(self, number: int | None) -> None:
        """Send the designs that are kept."""
        kept = [
            {
                "name": name, "title": each.question.title, "material": each.question.machine.material,
                "design": design_data(each.answer.design),
            }
            for name, each in self.live.snapshots.items()
        ]  # fmt: skip
        self._outbox.page({"what": "kept", "number": number, "kept": kept})

    def work_of(self, name: str, number: int | None) -> None:
        """Send the state of work of a kind."""
        self._outbox.page({"what": "work", "number": number, "work": self.work.of(name)})

    def refuse(self, reason: str, number: int | None) -> None:
        """Say why something was not done."""
        words = in_words(reason, self.live.question.limit_values)
        self._outbox.page({"what": "refused", "number": number, "reason": words})

    def settle_soon(self) -> None:
        """Begin the whole design once the hand rests; one that runs is of no use any more."""
        quick = self.live.answer.source == "quick"
        self._settle_at = time.monotonic() + _REST if quick else None
        self.live.work.cancel(SettleDesign.__name__)

    def pause(self) -> None:
        """Do what may wait while a hand moves: what holds at the angle, the whole design, news of work."""
        try:
            if self._look_due:
                self._look_due = False
                self._look()
            if self._settle_at is not None and time.monotonic() >= self._settle_at:
                self._settle_at = None
                self.live.start(SettleDesign())
        except NlsError as error:
            self.refuse(str(error), None)
        self.news()

    def news(self) -> None:
        """Say what has changed of work, also while a hand moves."""
        before = self.live.answer
        for each in self.work.changed():
            self._outbox.page({"what": "work", "work": each})
            if each["name"] == TorqueLoop.__name__:
                self._look_due = True
        if self.live.answer is not before:
            self.answer(self.live.answer, None, None)

    def _look(self) -> None:
        if self.live.shown is not None and self._angle is not None:
            at = angle_data(self.live.at(self._angle))
            self._outbox.page({"what": "at", "number": None, "at": at})


@functools.cache
def choices() -> dict[str, Any]:
    """Return what a page lets choose from: actuators, rubbers, limits."""
    kinds = [
        {"name": each.name, "words": each.words, "unit": each.unit, "upper": each.upper}
        for each in limit_kinds().values()
    ]
    return {
        "cards": [to_json(each) for each in gallery_cards()],
        "materials": [{"name": n, "reason": missing_law(each)} for n, each in materials().items()],
        "limits": kinds,
    }
