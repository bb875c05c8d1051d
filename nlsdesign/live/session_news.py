"""What a session says to its page: answers, what holds at the angle, news of work, as plain data."""

from __future__ import annotations

import contextlib
import dataclasses
import functools
import time
from pathlib import Path
from typing import Any, Final

import numpy as np

from ..components.materials.material_law import missing_law
from ..design.curves.task import walking_tables
from ..design.optimisation.limits import limit_kinds
from ..design.optimisation.stock import StockChoice
from ..foundation.arrays import Array
from ..foundation.errors import NlsError
from ..foundation.rubber_library import materials
from .answers import AnswerSource, DesignView, LiveAnswer, WorkStage, to_json
from .at_angle import AngleView
from .background import WorkState
from .gallery import gallery_cards
from .live_design import LiveDesign
from .messages import Outbox
from .tasks import motor_over_tasks
from .views import in_words
from .work import FullDesign, Work

_DIGITS = 7
_MOST_POINTS = 140
"""Of a line in the picture of the mechanism."""


def design_data(design: DesignView | None) -> dict[str, Any] | None:
    """Return a design as plain data, without the contour, which the mechanism shows.

    ``design``: what is shown; none before the first.
    """
    if design is None:
        return None
    columns = [
        {"name": each.name, "unit": each.unit, "values": short_numbers(each.values)}
        for each in design.columns
    ]
    data: dict[str, Any] = to_json(dataclasses.replace(design, columns=(), contour=np.zeros((0, 2))))
    return {**data, "columns": columns}


def mechanism_data(shown: AngleView | None, angle: float | None) -> dict[str, Any]:
    """Return the mechanism at an angle, or why there is no picture of it.

    ``shown``: design; none before the first.
    """
    if shown is None or angle is None:
        return {"angle": angle, "mechanism": None, "reason": "there is no design yet"}
    try:
        mechanism = shown.mechanism(angle)
    except NlsError as error:
        # A contour of no radius has no outline; its torque is an answer all the same.
        return {"angle": angle, "mechanism": None, "reason": in_words(str(error))}
    lines = {
        name: [short_numbers(_fewer(each)) for each in getattr(mechanism, name)]
        for name in ("halves", "cables", "contacts", "guides", "rubbers", "edges")
    }
    extent = short_numbers(np.array(mechanism.extent))
    picture = {
        "angle": mechanism.angle, **lines, "extent": extent, "remark": mechanism.remark,
        "holes": mechanism.holes, "dimensions": mechanism.dimensions,
    }  # fmt: skip
    return {"angle": angle, "mechanism": picture, "reason": ""}


def short_numbers(values: Array) -> list[Any]:
    """Return numbers with seven digits; those that are not finite are ``None``."""
    finite = np.isfinite(values)
    kept = np.where(finite, values, 0.0)
    size = np.where(kept == 0.0, 1.0, np.abs(kept))
    # Division by a power of ten, not multiplication by its inverse, which is no decimal number.
    scale = 10.0 ** np.clip(_DIGITS - 1.0 - np.floor(np.log10(size)), -300.0, 300.0)
    rounded = np.round(kept * scale) / scale
    if bool(finite.all()):
        return list(rounded.tolist())
    shown = rounded.astype(object)
    shown[~finite] = None
    return list(shown.tolist())


def _fewer(points: Array) -> Array:
    """Return a line with fewer points; its ends, and every corner of a short one, stay."""
    if points.ndim < 2 or len(points) <= _MOST_POINTS:
        return points
    kept = np.unique(np.round(np.linspace(0, len(points) - 1, _MOST_POINTS)).astype(int))
    fewer: Array = points[kept]
    return fewer


TASKS: Final = (Work.SETTLE, Work.TOLERANCE, Work.LOOP, Work.DIAGNOSIS, Work.STOCK)
"""The kinds of work that a page may ask for."""
_MOST_STAGES = 60


class WorkNews:
    """News of the work of one design.

    ``records``: folder of the records that were uploaded.
    """

    def __init__(self, live: LiveDesign, records: Path) -> None:
        self._live = live
        self._records = records
        self._last: dict[str, tuple[Any, ...]] = {}
        self._stages: dict[str, list[str]] = {}
        self._states: dict[str, WorkState] = {}
        self._began_with: dict[str, tuple[Any, ...]] = {}

    @property
    def running(self) -> bool:
        """Whether any work runs."""
        return any(each.state is WorkStage.COMPUTING for each in self._live.work.states())

    def start(self, name: str, *settings: object) -> None:
        """Start work of a kind; a diagnosis takes the records, a stock what is offered."""
        if name == Work.DIAGNOSIS:
            self._records.mkdir(parents=True, exist_ok=True)
            settings = (self._records,)
        state = self._live.start(Work(name), *settings)
        self._stages[name] = []
        self._began_with[name] = self._basis(name)
        self._noted(state)

    def stop(self, name: str) -> None:
        """End work of a kind."""
        state = self._live.work.cancel(name)
        if state is not None:
            self._noted(state)

    @property
    def export(self) -> WorkState | None:
        """How far the file is that was asked for last."""
        return next((each for each in self._live.work.states() if each.name == Work.EXPORT), None)

    def changed(self) -> list[dict[str, Any]]:
        """Return the news of all work that has changed; a whole design that is done has become the answer."""
        news = []
        for state in self._live.poll():
            if state.name not in TASKS:
                continue
            now = self._noted(state)
            if self._last.get(state.name) != now:
                self._last[state.name] = now
                news.append(self.of(state.name))
        return news

    def all(self) -> list[dict[str, Any]]:
        """Return the news of all work, as for a page that was loaded just now or showed another design."""
        return [self.of(name) for name in TASKS]

    def of(self, name: str) -> dict[str, Any]:
        """Return the news of work of a kind."""
        state = self._states.get(name)
        if state is None:
            return {"name": name, "state": WorkStage.NOT_BEGUN, "message": "", "revision": 0, "seconds": 0.0,
                    "stages": [], "value": None, "old": False, **self._files(name)}  # fmt: skip
        # The whole design becomes the answer, and the loop is asked for angle by angle.
        shown = not isinstance(state.value, FullDesign) and name != Work.LOOP
        return {
            "name": name, "state": state.state, "message": state.message, "revision": state.revision,
            "seconds": state.seconds, "stages": self._stages.get(name, []),
            "value": to_json(state.value) if shown else None, "old": self._old(name), **self._files(name),
        }  # fmt: skip

    def _noted(self, state: WorkState) -> tuple[Any, ...]:
        """Keep a state and return what of it would be news."""
        self._states[state.name] = state
        stages = self._stages.setdefault(state.name, [])
        if state.state is WorkStage.COMPUTING and state.message and state.message not in stages[-1:]:
            stages.append(state.message)
            del stages[:-_MOST_STAGES]
        return state.state, state.message, state.revision, int(state.seconds), self._old(state.name)

    def _old(self, name: str) -> bool:
        """Tell whether work of a kind was begun for something else than what is there now."""
        return name in self._began_with and self._began_with[name] != self._basis(name)

    def _basis(self, name: str) -> tuple[Any, ...]:
        """Return what work of a kind is about: a diagnosis the records and the machine as it is declared."""
        live = self._live
        if name == Work.DIAGNOSIS:
            # Points and limits belong to the design, not to the machine.
            return (_listed(self._records), live.question.machine, dict(live.question.given))
        if name == Work.STOCK:
            return (live.answer.revision,)
        design = live.answer.design
        return live.answer.revision, design is not None and design.checked

    def _files(self, name: str) -> dict[str, Any]:
        if name != Work.DIAGNOSIS:
            return {}
        return {"files": [each[0] for each in _listed(self._records)]}


def _listed(folder: Path) -> list[tuple[str, int, int]]:
    """Return the records that are there: name, size and time; one that is being replaced is left out."""
    listed = []
    for file in sorted(folder.glob("*")):
        with contextlib.suppress(FileNotFoundError):
            seen = file.stat()
            listed.append((file.name, seen.st_size, seen.st_mtime_ns))
    return listed


_REST = 0.4
"""Seconds without an edit after which the whole design is begun: it would be in the way of a hand."""


class SessionNews:
    """The design of a session and what its page is told of it.

    ``records``: folder of the records that are uploaded. ``trouble``: why this is not the design that was
    asked for; empty if it is.
    """

    def __init__(self, live: LiveDesign, records: Path, outbox: Outbox, *, trouble: str = "") -> None:
        self.live = live
        self.work = WorkNews(live, records)
        self._outbox = outbox
        self._trouble = trouble
        self._angle: float | None = None
        self._settle_at: float | None = None
        self._look_due = False
        self.stock: tuple[StockChoice, ...] = ()  # what was tried last
        self._paid: tuple[object, ...] = ()  # question and design of which the page knows what the motor pays

    @property
    def idle(self) -> bool:
        """Whether nothing is left to do but to wait for the page."""
        return self._settle_at is None and not self._look_due and not self.work.running

    def everything(self, number: int | None) -> None:
        """Show everything, as to a page that was loaded just now."""
        self._paid = ()
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
        data = {
            **to_json(dataclasses.replace(answer, design=None)),
            "design": design_data(answer.design), "stale": answer.stale,
        }  # fmt: skip
        self._outbox.page({"what": "answer", "number": number, "answer": data, "at": at})

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
        quick = self.live.answer.source is AnswerSource.QUICK
        self._settle_at = time.monotonic() + _REST if quick else None
        self.live.work.cancel(Work.SETTLE)

    def pause(self) -> None:
        """Do what may wait while a hand moves: what holds at the angle, the whole design, news of work."""
        try:
            if self._look_due:
                self._look_due = False
                if self.live.shown is not None and self._angle is not None:
                    at = to_json(self.live.at(self._angle))
                    self._outbox.page({"what": "at", "number": None, "at": at})
                self.paid()
            if self._settle_at is not None and time.monotonic() >= self._settle_at:
                self._settle_at = None
                self.live.start(Work.SETTLE)
        except NlsError as error:
            self.refuse(str(error), None)
        self.news()

    def paid(self) -> None:
        """Say what the motor pays for the tasks, where there are some."""
        live = self.live
        design = None if live.answer.stale else live.answer.design
        asked = (live.question, design)
        if live.question.tasks and asked != self._paid:
            self._paid = asked
            answer = motor_over_tasks(live.question, design, live.answer.revision)
            self._outbox.page({"what": "motor", "motor": to_json(answer)})

    def news(self) -> None:
        """Say what has changed of work, also while a hand moves."""
        before = self.live.answer
        for each in self.work.changed():
            self._outbox.page({"what": "work", "work": each})
            if each["name"] == Work.LOOP:
                self._look_due = True
        if self.live.answer is not before:
            self.answer(self.live.answer, None, None)


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
        "joints": sorted(walking_tables()),
    }
