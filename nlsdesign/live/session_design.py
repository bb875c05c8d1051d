"""The design of one session: questions of page and server in, answers out."""

from __future__ import annotations

import base64
import math
import time
from collections.abc import Callable, Mapping
from pathlib import Path
from typing import Any

from ..components.materials.material_law import missing_law
from ..design import CoilStock, RubberStock, Stock
from ..design.optimisation.stock import StockChoice
from ..foundation.errors import NlsError, ValueRangeError, brief, unknown_name
from ..foundation.rubber_library import materials
from .answers import WorkStage
from .background import warm_up
from .edits import edit, edit_from, take_from_stock
from .gallery import gallery_question, question_of_deck
from .live_design import LiveDesign, open_question
from .messages import Inbox, Outbox
from .question import LiveQuestion, finite_in
from .saved import archived, reopened, unarchived
from .session_news import TASKS, SessionNews, choices
from .sessions import plain_letters
from .tasks import add_record, record_of
from .views import in_words
from .work import Work

Asked = Mapping[str, Any]


class PageQuestions:
    """Does what a page asks.

    ``news``: the design, and how the page is told of it.
    """

    def __init__(self, news: SessionNews) -> None:
        self._news = news
        self._kinds: Mapping[str, Callable[[Asked], None]] = {
            "show": self._show, "edit": self._edit, "angle": self._turn, "step": self._step,
            "keep": self._keep, "work": self._work, "stock": self._stock,
        }  # fmt: skip

    def answer(self, asked: Asked) -> None:
        """Answer a message; what cannot be done is refused in words."""
        try:
            what = asked.get("what")
            if not isinstance(what, str) or what not in self._kinds:
                raise unknown_name("message", str(what)[:80], self._kinds)
            self._kinds[what](asked)
        except NlsError as error:
            self._news.refuse(str(error), _number(asked))
        except Exception as error:  # a fault of ours must not take the design with it
            self._news.refuse(f"a fault of the program: {type(error).__name__}: {error}", _number(asked))

    def _show(self, asked: Asked) -> None:
        self._news.everything(_number(asked))

    def _edit(self, asked: Asked) -> None:
        fields, drag, angle = asked.get("edit"), asked.get("drag"), _angle(asked)
        if not isinstance(fields, dict):
            raise ValueRangeError("edit", "is no table", next_step="send its name and its fields")
        drag, last = drag if isinstance(drag, str) else None, asked.get("last") is True
        answer = self._news.live.apply(edit_from(fields), drag=drag, last=last)
        self._news.answer(answer, _number(asked), angle)
        self._news.settle_soon()

    def _step(self, asked: Asked) -> None:
        angle, live = _angle(asked), self._news.live
        answer = live.undo() if asked.get("back") is True else live.redo()
        self._news.answer(answer, _number(asked), angle)
        self._news.settle_soon()

    def _turn(self, asked: Asked) -> None:
        angle = _angle(asked)
        if angle is None:
            raise ValueRangeError("angle", "is missing", next_step="send it in rad")
        self._news.turn(angle, _number(asked))

    def _keep(self, asked: Asked) -> None:
        name, live = str(asked.get("name", "")), self._news.live
        if asked.get("forget") is not True:
            live.keep(name)
        elif name in live.snapshots:
            del live.snapshots[name]
        else:
            raise unknown_name("kept design", name[:80], live.snapshots)
        self._news.kept(_number(asked))

    def _stock(self, asked: Asked) -> None:
        """Try what can be bought, or take one row of what was tried."""
        row, angle, news = asked.get("take"), _angle(asked), self._news
        if row is None:
            news.stock = stock_of(asked, news.live.question)
            news.work.start(Work.STOCK, news.stock)
            news.work_of(Work.STOCK, _number(asked))
            return
        if isinstance(row, bool) or not isinstance(row, int) or not news.stock:
            raise ValueRangeError(
                f"row {brief(row)} of the stock", "was not tried", next_step="try the stock first"
            )
        news.answer(news.live.apply(edit(take_from_stock, news.stock, row)), _number(asked), angle)
        news.settle_soon()

    def _work(self, asked: Asked) -> None:
        name = str(asked.get("name", ""))
        if name not in TASKS:
            raise unknown_name("work", name[:80], TASKS)
        if asked.get("stop") is True:
            self._news.work.stop(name)
        else:
            self._news.work.start(name)
        self._news.work_of(name, _number(asked))


def stock_of(asked: Asked, question: LiveQuestion) -> tuple[StockChoice, ...]:
    """Return what a page offers to choose from: all rubbers with a law, values of one size in SI."""
    choices: list[StockChoice] = []
    if asked.get("rubbers") is True:
        choices.append(RubberStock(tuple(n for n, each in materials().items() if not missing_law(each))))
    name, values = str(asked.get("size") or ""), asked.get("values")
    if name:
        size = question.number(name)
        given = values if isinstance(values, list) else []
        choices.append(
            Stock(
                name,
                tuple(
                    finite_in(name, each, lowest=size.minimum, highest=size.maximum, unit=size.unit)
                    for each in given
                ),
            )
        )
    if not choices:
        raise ValueRangeError("stock", "is empty", next_step="offer the rubbers, or values of a size")
    return tuple(choices)


def _number(asked: Asked) -> int | None:
    number = asked.get("number")
    return number if isinstance(number, int) and not isinstance(number, bool) else None


def _angle(asked: Asked) -> float | None:
    """Return the angle that the page looks at, if it says one."""
    value = asked.get("angle")
    if value is None:
        return None
    if isinstance(value, bool) or not isinstance(value, int | float) or not math.isfinite(value):
        raise ValueRangeError(f"angle = {brief(value)}", "is no finite number", next_step="send it in rad")
    return float(value)


FIRST = "cam-actuator"
"""With which a page begins that names no actuator."""
_EARLIER = "Last good design, of an earlier question: the question of now has no design ({})"
_BEFORE = "last_good_"
"""Begin of the name of a file of an earlier design."""
_TICK = 0.1
"""Seconds between two looks at work that runs."""
_NEWS = 0.5
"""Seconds after which work is looked at although messages keep coming."""


class SessionDesign:
    """The design of one session.

    ``deck``: name or file of the deck that it begins with; empty for the first of the gallery.
    """

    def __init__(self, deck: str, folder: str, outbox: Outbox) -> None:
        self._outbox = outbox
        self._records = Path(folder) / "records"
        self._file_for: int | None = None
        self._file_note = ""
        warm_up()
        try:
            self._begin(LiveDesign(_question(deck)))
        except NlsError as error:
            trouble = f"{error}; the page begins with {FIRST} instead"
            self._begin(LiveDesign(gallery_question(FIRST)), trouble)

    def run(self, inbox: Inbox) -> None:
        """Answer until no message can come any more."""
        if not inbox.waiting:
            choices()
        last_news = time.monotonic()
        while True:
            waits = self._news.idle and self._file_for is None
            message = inbox.take(None if waits else _TICK)
            if message is None:
                self._news.pause()
                self._send_file()
            elif "server" in message:
                asked = message["server"]
                try:
                    answer = self._served(asked)
                except NlsError as error:
                    answer = {"refused": in_words(str(error))}
                except Exception as error:
                    answer = {"refused": f"a fault of the program: {type(error).__name__}: {error}"}
                if answer is not None:
                    self._outbox.server({"number": asked["number"], **answer})
            else:
                self._questions.answer(message["page"])
            if time.monotonic() - last_news >= _NEWS:
                last_news = time.monotonic()
                self._news.news()

    def _begin(self, live: LiveDesign, trouble: str = "") -> None:
        self._news = SessionNews(live, self._records, self._outbox, trouble=trouble)
        self._questions = PageQuestions(self._news)

    def _served(self, asked: Mapping[str, Any]) -> dict[str, Any] | None:
        """Return an answer; nothing where it is given when a file is ready."""
        if asked["what"] == "open":
            # Go on from a saved design or a deck, one step that can be undone. What is open stays as it is
            # where the file cannot be read.
            content, name = base64.b64decode(asked["content"]), plain_letters(str(asked.get("name", "")))
            live = self._news.live
            if asked.get("kind") == "task":
                self._news.answer(live.apply(edit(add_record, name, record_of(content, name))), None, None)
                self._news.settle_soon()
                return {}
            if asked.get("kind") == "coils":
                self._records.parent.mkdir(parents=True, exist_ok=True)
                (self._records.parent / name).write_bytes(content)
                self._news.stock = (CoilStock(self._records.parent / name),)
                self._news.work.start(Work.STOCK, self._news.stock)
                self._news.work_of(Work.STOCK, None)
                return {}
            values: dict[str, float] = {}
            if content.startswith(b"PK"):
                question, values = reopened(unarchived(content))
            else:
                try:
                    text = content.decode("utf-8")
                except UnicodeDecodeError:
                    raise NlsError("deck", "is no text in UTF-8", next_step="open a deck (TOML)") from None
                question = question_of_deck(text, "deck.toml")
            open_question(self._news.live, question, values)
            self._refuse_file("another design was opened meanwhile")
            self._begin(self._news.live)
            self._news.everything(None)
            return {}
        if asked["kind"] == "design":
            return _file("design.zip", archived(self._news.live.saved()))
        self._refuse_file("another file was asked for meanwhile")
        answer = self._news.live.answer
        self._file_note = _EARLIER.format(answer.state) if answer.stale else ""
        self._news.live.start(Work.EXPORT, str(asked["kind"]), self._file_note)
        self._file_for = asked["number"]
        return None

    def _refuse_file(self, reason: str) -> None:
        if self._file_for is not None:
            self._outbox.server({"number": self._file_for, "refused": reason})
        self._file_for = None

    def _send_file(self) -> None:
        """Send the file that the server waits for once it is made."""
        state = self._news.work.export
        if self._file_for is None or state is None or state.state is WorkStage.COMPUTING:
            return
        made = state.value
        name = "" if made is None else f"{_BEFORE if self._file_note else ''}{made.name}"
        answer = _file(name, made.content) if made is not None else {"refused": in_words(state.message)}
        self._outbox.server({"number": self._file_for, **answer})
        self._file_for = None


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
