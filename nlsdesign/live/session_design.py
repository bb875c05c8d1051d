"""What a page asks and what its session answers: messages in, messages out, the design between them."""

from __future__ import annotations

import base64
import functools
import math
import time
from collections.abc import Callable, Mapping
from pathlib import Path
from typing import Any

from ..components.materials.library import materials
from ..errors import NlsError, ValueRangeError, brief, unknown_name
from .answers import LiveAnswer, to_json
from .archive import archived, unarchived
from .background import warm_up
from .edits import edit_from
from .exports import ExportDesign
from .gallery import gallery, gallery_question, question_of_deck
from .inbox import Inbox
from .limit_kinds import LIMIT_KINDS
from .live_design import LiveDesign
from .page_data import angle_data, answer_data, design_data, mechanism_data
from .question import LiveQuestion
from .saved import reopened
from .session_work import Outbox
from .uploads import plain_letters
from .work import SettleDesign, TorqueLoop
from .work_news import TASKS, WorkNews

FIRST = "cam-actuator"
"""With which a page begins that names no actuator."""
_TICK = 0.1
"""Seconds between two looks at work that runs."""
_NEWS = 0.5
"""Seconds after which work is looked at although messages keep coming."""
_REST = 0.4
"""Seconds without an edit after which the whole design is begun: it would be in the way of a hand."""


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
        self._angle: float | None = None
        self._trouble = ""
        self._settle_at: float | None = None
        self._look_due = False
        self._file_for: int | None = None
        warm_up()
        try:
            self._live = LiveDesign(_question(deck))
        except NlsError as error:
            self._trouble = f"{error}; the page begins with {FIRST} instead"
            self._live = LiveDesign(gallery_question(FIRST))
        self._news = WorkNews(self._live, self._folder / "records")

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
        if not inbox.waiting:
            _choices()
        told = time.monotonic()
        while True:
            idle = self._settle_at is None and not self._look_due and not self._news.running
            message = inbox.take(None if idle else _TICK)
            if message is not None:
                self._answer(message)
            else:
                self._on_a_pause()
            if time.monotonic() - told >= _NEWS:
                told = time.monotonic()
                self._tell_news()

    def _answer(self, message: Mapping[str, Any]) -> None:
        if "server" in message:
            self._serve(message["server"])
            return
        asked = message["page"]
        try:
            self._do(asked)
        except NlsError as error:
            self._refuse(asked, str(error))
        except Exception as error:  # a fault of ours must not take the design with it
            self._refuse(asked, f"a fault of the program: {type(error).__name__}: {error}")

    def _refuse(self, asked: Mapping[str, Any], reason: str) -> None:
        self._outbox.page({"what": "refused", "number": _number(asked), "reason": reason})

    # --- what a page asks ----------------------------------------------------------------------

    def _do(self, asked: Mapping[str, Any]) -> None:
        what = asked.get("what")
        kinds: Mapping[str, Callable[[Mapping[str, Any]], None]] = {
            "show": self._show, "edit": self._edit, "angle": self._turn, "step": self._step,
            "keep": self._keep, "work": self._work,
        }  # fmt: skip
        if not isinstance(what, str) or what not in kinds:
            raise unknown_name("message", str(what)[:80], kinds)
        kinds[what](asked)

    def _show(self, asked: Mapping[str, Any]) -> None:
        """Show everything, as to a page that was loaded just now."""
        self._say(self._live.answer, asked)
        self._say_kept({})
        self._outbox.page({"what": "gallery", **_choices()})
        for each in self._news.all():
            self._outbox.page({"what": "work", "work": each})
        if self._trouble:
            self._refuse({}, self._trouble)
        if self._live.answer.source == "quick":
            self._settle_soon()

    def _edit(self, asked: Mapping[str, Any]) -> None:
        fields, drag = asked.get("edit"), asked.get("drag")
        if not isinstance(fields, dict):
            raise ValueRangeError("edit", "is no table", next_step="send its name and its fields")
        answer = self._live.apply(edit_from(fields), drag=drag if isinstance(drag, str) else None)
        self._say(answer, asked)
        self._settle_soon()

    def _step(self, asked: Mapping[str, Any]) -> None:
        answer = self._live.undo() if asked.get("back") is True else self._live.redo()
        self._say(answer, asked)
        if answer.source == "quick":
            self._settle_soon()

    def _turn(self, asked: Mapping[str, Any]) -> None:
        self._angle = _finite("angle", asked.get("angle"))
        said = mechanism_data(self._live.shown, self._angle)
        self._outbox.page({"what": "at", "number": _number(asked), "at": said})
        self._look_due = True

    def _keep(self, asked: Mapping[str, Any]) -> None:
        name = str(asked.get("name", ""))
        if asked.get("forget") is not True:
            self._live.keep(name)
        elif name in self._live.snapshots:
            del self._live.snapshots[name]
        else:
            raise unknown_name("kept design", name[:80], self._live.snapshots)
        self._say_kept(asked)

    def _work(self, asked: Mapping[str, Any]) -> None:
        name = str(asked.get("name", ""))
        if name not in TASKS:
            raise unknown_name("work", name[:80], TASKS)
        self._news.stop(name) if asked.get("stop") is True else self._news.start(name)
        self._outbox.page({"what": "work", "number": _number(asked), "work": self._news.of(name)})

    # --- what is said --------------------------------------------------------------------------

    def _say(self, answer: LiveAnswer, asked: Mapping[str, Any]) -> None:
        """Send an answer with the mechanism; what takes longer at the angle follows on a pause."""
        at = None
        if answer.design is not None:
            last = float(answer.design.columns[0].values[-1])
            given = asked.get("angle")
            wanted = self._angle if given is None else _finite("angle", given)
            self._angle = min(0.6 * last if wanted is None else wanted, last)
            at = mechanism_data(self._live.shown, self._angle)
            self._look_due = True
        said = answer_data(answer)
        self._outbox.page({"what": "answer", "number": _number(asked), "answer": said, "at": at})

    def _say_kept(self, asked: Mapping[str, Any]) -> None:
        kept = [
            {
                "name": name, "title": each.question.title, "material": each.question.machine.material,
                "design": design_data(each.answer.design),
            }
            for name, each in self._live.snapshots.items()
        ]  # fmt: skip
        self._outbox.page({"what": "kept", "number": _number(asked), "kept": kept})

    def _settle_soon(self) -> None:
        self._settle_at = time.monotonic() + _REST
        self._live.work.cancel(SettleDesign.__name__)

    def _on_a_pause(self) -> None:
        """Do what may wait while a hand moves: what holds at the angle, the whole design, news of work."""
        now = time.monotonic()
        if self._look_due:
            self._look_due = False
            self._look()
        if self._settle_at is not None and now >= self._settle_at:
            self._settle_at = None
            self._live.start(SettleDesign())
        self._tell_news()

    def _tell_news(self) -> None:
        """Say what has changed of work, also while a hand moves."""
        before = self._live.answer
        for each in self._news.changed():
            self._outbox.page({"what": "work", "work": each})
            if each["name"] == TorqueLoop.__name__:
                self._look_due = True
        self._send_file()
        if self._live.answer is not before:
            self._say(self._live.answer, {})

    def _look(self) -> None:
        if self._live.shown is None or self._angle is None:
            return
        try:
            self._outbox.page({"what": "at", "number": None, "at": angle_data(self._live.at(self._angle))})
        except NlsError as error:
            self._refuse({}, str(error))

    # --- what the server asks ------------------------------------------------------------------

    def _serve(self, asked: Mapping[str, Any]) -> None:
        try:
            answer = self._served(asked)
        except NlsError as error:
            answer = {"refused": str(error)}
        except Exception as error:
            answer = {"refused": f"a fault of the program: {type(error).__name__}: {error}"}
        if answer is not None:
            self._outbox.server({"number": asked["number"], **answer})

    def _served(self, asked: Mapping[str, Any]) -> dict[str, Any] | None:
        """Return an answer; nothing where it is given when a file is ready."""
        if asked["what"] == "open":
            self._opened(base64.b64decode(asked["content"]))
            return {}
        if asked["kind"] == "design":
            return _file("design.zip", archived(self._live.saved()))
        if self._file_for is not None:
            self._outbox.server({"number": self._file_for, "refused": "another file was asked for meanwhile"})
        self._file_for = None
        self._live.start(ExportDesign(str(asked["kind"])))
        self._file_for = asked["number"]
        return None

    def _opened(self, content: bytes) -> None:
        """Begin anew from a saved design or a deck; what is open stays where it cannot be read."""
        if content.startswith(b"PK"):
            question, values = reopened(unarchived(content))
            live = LiveDesign(question, values)
        else:
            try:
                text = content.decode("utf-8")
            except UnicodeDecodeError:
                raise NlsError("deck", "is no text in UTF-8", next_step="open a deck (TOML)") from None
            live = LiveDesign(question_of_deck(text, "deck.toml"))
        self._live.work.close()
        self._live, self._angle, self._trouble = live, None, ""
        self._news = WorkNews(live, self._folder / "records")
        self._show({})

    def _send_file(self) -> None:
        """Send the file that the server waits for once it is made."""
        state = self._news.export
        if self._file_for is None or state is None or state.state == "computing":
            return
        made = state.value
        answer = _file(made.name, made.content) if made is not None else {"refused": state.message}
        self._outbox.server({"number": self._file_for, **answer})
        self._file_for = None


@functools.cache
def _choices() -> dict[str, Any]:
    """Return what a page lets choose from: actuators, rubbers, limits."""
    kinds = [
        {"name": each.name, "words": each.words, "unit": each.unit, "upper": each.upper}
        for each in LIMIT_KINDS.values()
    ]
    return {"cards": [to_json(each) for each in gallery()], "materials": list(materials()), "limits": kinds}


def _question(deck: str) -> LiveQuestion:
    """Return the question that a deck begins with."""
    if deck.endswith(".toml") or "/" in deck or "\\" in deck:
        file = Path(deck)
        try:
            return question_of_deck(file.read_text(encoding="utf-8"), file.name)
        except (OSError, UnicodeDecodeError) as error:
            raise NlsError(str(file), f"cannot be read: {error}") from error
    return gallery_question(deck or FIRST)


def _file(name: str, content: bytes) -> dict[str, Any]:
    return {"name": plain_letters(name), "content": base64.b64encode(content).decode()}


def _number(asked: Mapping[str, Any]) -> int | None:
    number = asked.get("number")
    return number if isinstance(number, int) and not isinstance(number, bool) else None


def _finite(what: str, value: object) -> float:
    if isinstance(value, bool) or not isinstance(value, int | float) or not math.isfinite(value):
        raise ValueRangeError(f"{what} = {brief(value)}", "is no finite number", next_step="send it in SI")
    return float(value)
