"""What a page asks of its session: each message is one method, and each is checked before it is done."""

from __future__ import annotations

import math
from collections.abc import Callable, Mapping
from typing import Any

from ..foundation.errors import NlsError, ValueRangeError, brief, unknown_name
from .edits import edit_from
from .session_news import SessionNews
from .work_news import TASKS

Asked = Mapping[str, Any]


class PageQuestions:
    """Does what a page asks.

    Parameters
    ----------
    news
        The design, and how the page is told of it.
    """

    def __init__(self, news: SessionNews) -> None:
        self._news = news
        self._kinds: Mapping[str, Callable[[Asked], None]] = {
            "show": self._show, "edit": self._edit, "angle": self._turn, "step": self._step,
            "keep": self._keep, "work": self._work,
        }  # fmt: skip

    def answer(self, asked: Asked) -> None:
        """Answer a message; what cannot be done is refused in words."""
        try:
            self._do(asked)
        except NlsError as error:
            self._news.refuse(str(error), _number(asked))
        except Exception as error:  # a fault of ours must not take the design with it
            self._news.refuse(f"a fault of the program: {type(error).__name__}: {error}", _number(asked))

    def _do(self, asked: Asked) -> None:
        what = asked.get("what")
        if not isinstance(what, str) or what not in self._kinds:
            raise unknown_name("message", str(what)[:80], self._kinds)
        self._kinds[what](asked)

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

    def _work(self, asked: Asked) -> None:
        name = str(asked.get("name", ""))
        if name not in TASKS:
            raise unknown_name("work", name[:80], TASKS)
        if asked.get("stop") is True:
            self._news.work.stop(name)
        else:
            self._news.work.start(name)
        self._news.work_of(name, _number(asked))


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
