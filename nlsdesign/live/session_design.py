"""What a page asks and what its session answers: messages in, messages out, the design between them."""

from __future__ import annotations

import functools
import math
from collections.abc import Callable, Mapping
from pathlib import Path
from typing import Any

from ..components.materials.library import materials
from ..errors import NlsError, ValueRangeError, brief, unknown_name
from .answers import LiveAnswer, to_json
from .edits import edit_from
from .gallery import gallery, gallery_question, question_of_deck
from .inbox import Inbox
from .live_design import LiveDesign
from .question import LiveQuestion
from .session_work import Outbox

FIRST = "cam-actuator"
"""With which a page begins that names no actuator."""
_TICK = 0.15
"""Seconds between two looks at work that runs."""


class SessionDesign:
    """The design of one session.

    Parameters
    ----------
    deck
        Name or file of the deck that it begins with; empty for the first of the gallery.
    folder
        That holds what is uploaded.
    outbox
        To page and server.
    """

    def __init__(self, deck: str, folder: str, outbox: Outbox) -> None:
        self._outbox = outbox
        self._folder = Path(folder)
        self._deck = deck
        self._design: LiveDesign | None = None
        self._angle: float | None = None
        self._trouble = ""
        self._asked: Mapping[str, Callable[[Mapping[str, Any]], None]] = {
            "show": self._show, "edit": self._edit, "angle": self._turn, "undo": self._undo, "redo": self._redo,
            "keep": self._keep, "forget": self._forget,
        }  # fmt: skip

    def run(self, inbox: Inbox) -> None:
        """Answer until no message can come any more.

        Parameters
        ----------
        inbox
            What is asked.

        Raises
        ------
        EOFError
            When the server has closed it.
        """
        try:
            self._design = LiveDesign(_question(self._deck))
        except NlsError as error:
            self._trouble = f"{error}; the page begins with {FIRST} instead"
            self._design = LiveDesign(gallery_question(FIRST))
        while True:
            message = inbox.take(None)
            if message is not None:
                self._answer(message)

    def _answer(self, message: Mapping[str, Any]) -> None:
        if "server" in message:
            self._serve(message["server"])
            return
        asked = message["page"]
        try:
            what = asked.get("what")
            if not isinstance(what, str) or what not in self._asked:
                raise unknown_name("message", str(what)[:80], self._asked)
            self._asked[what](asked)
        except NlsError as error:
            self._refuse(asked, error)
        except Exception as error:  # a fault of ours must not take the design with it
            self._refuse(asked, NlsError("a fault of the program", f"{type(error).__name__}: {error}"))

    def _refuse(self, asked: Mapping[str, Any], error: NlsError) -> None:
        self._outbox.page({"what": "refused", "number": _number(asked), "reason": str(error)})

    @property
    def _live(self) -> LiveDesign:
        assert self._design is not None
        return self._design

    # --- what a page asks ----------------------------------------------------------------------

    def _show(self, asked: Mapping[str, Any]) -> None:
        """Show everything, as to a page that was loaded just now."""
        self._say(self._live.answer, asked)
        self._say_kept()
        self._outbox.page({"what": "gallery", **_choices()})
        if self._trouble:
            self._outbox.page({"what": "refused", "number": None, "reason": self._trouble})

    def _edit(self, asked: Mapping[str, Any]) -> None:
        fields, drag = asked.get("edit"), asked.get("drag")
        if not isinstance(fields, dict):
            raise ValueRangeError("edit", "is no table", next_step="send its name and its fields")
        answer = self._live.apply(edit_from(fields), drag=drag if isinstance(drag, str) else None)
        self._say(answer, asked)

    def _undo(self, asked: Mapping[str, Any]) -> None:
        self._say(self._live.undo(), asked)

    def _redo(self, asked: Mapping[str, Any]) -> None:
        self._say(self._live.redo(), asked)

    def _turn(self, asked: Mapping[str, Any]) -> None:
        self._angle = _finite("angle", asked.get("angle"))
        self._outbox.page({"what": "at", "number": _number(asked), "at": to_json(self._live.at(self._angle))})

    def _keep(self, asked: Mapping[str, Any]) -> None:
        self._live.keep(str(asked.get("name", "")))
        self._say_kept(asked)

    def _forget(self, asked: Mapping[str, Any]) -> None:
        name = str(asked.get("name", ""))
        if name not in self._live.snapshots:
            raise unknown_name("kept design", name[:80], self._live.snapshots)
        del self._live.snapshots[name]
        self._say_kept(asked)

    def _say_kept(self, asked: Mapping[str, Any] | None = None) -> None:
        kept = [
            {
                "name": name, "title": each.question.title, "material": each.question.material,
                "design": to_json(each.answer.design),
            }
            for name, each in self._live.snapshots.items()
        ]  # fmt: skip
        self._outbox.page({"what": "kept", "number": _number(asked or {}), "kept": kept})

    def _say(self, answer: LiveAnswer, asked: Mapping[str, Any]) -> None:
        """Send an answer, with what holds at the angle that the page looks at."""
        at = None
        if answer.design is not None:
            last = float(answer.design.columns[0].values[-1])
            given = asked.get("angle")
            wanted = self._angle if given is None else _finite("angle", given)
            self._angle = min(0.6 * last if wanted is None else wanted, last)
            at = to_json(self._live.at(self._angle))
        self._outbox.page({"what": "answer", "number": _number(asked), "answer": to_json(answer), "at": at})

    # --- what the server asks ------------------------------------------------------------------

    def _serve(self, asked: Mapping[str, Any]) -> None:
        try:
            answer = self._answered(asked)
        except NlsError as error:
            answer = {"refused": str(error)}
        except Exception as error:
            answer = {"refused": f"a fault of the program: {type(error).__name__}: {error}"}
        self._outbox.server({"number": asked["number"], **answer})

    def _answered(self, asked: Mapping[str, Any]) -> dict[str, Any]:
        if asked["what"] == "open":
            self._design = LiveDesign(question_of_deck(asked["text"], "opened.toml"))
            self._angle = None
            self._say(self._live.answer, {})
            self._say_kept()
            return {}
        raise unknown_name("file", str(asked.get("kind"))[:40], ())


@functools.cache
def _choices() -> dict[str, Any]:
    """Return what a page lets choose from: actuators and rubbers."""
    return {"cards": [to_json(each) for each in gallery()], "materials": list(materials())}


def _question(deck: str) -> LiveQuestion:
    """Return the question that a deck begins with."""
    if deck.endswith(".toml") or "/" in deck or "\\" in deck:
        file = Path(deck)
        try:
            return question_of_deck(file.read_text(encoding="utf-8"), file.name)
        except (OSError, UnicodeDecodeError) as error:
            raise NlsError(str(file), f"cannot be read: {error}") from error
    return gallery_question(deck or FIRST)


def _number(asked: Mapping[str, Any]) -> int | None:
    number = asked.get("number")
    return number if isinstance(number, int) and not isinstance(number, bool) else None


def _finite(what: str, value: object) -> float:
    if isinstance(value, bool) or not isinstance(value, int | float) or not math.isfinite(value):
        raise ValueRangeError(f"{what} = {brief(value)}", "is no finite number", next_step="send it in SI")
    return float(value)
