"""Messages of a session: what a page has asked for and is not answered yet, and what the session says."""

from __future__ import annotations

import json
import threading
from collections import deque
from collections.abc import Mapping
from typing import IO, Any

MOST = 200
"""Most messages that wait; a person makes fewer, and a page that sends more is not answered."""


class Inbox:
    """Messages in the order in which they came.

    A message of the page that has a ``drag`` takes the place of an earlier one of the same drag that is
    still waiting, so that a hand which is faster than the computation never builds a queue.
    """

    def __init__(self) -> None:
        self._waiting: deque[Mapping[str, Any]] = deque()
        self._condition = threading.Condition()
        self._closed = False

    def put(self, message: Mapping[str, Any]) -> None:
        """Add a message."""
        with self._condition:
            drag = _drag(message)
            last = self._waiting[-1] if self._waiting else {}
            if drag is not None and drag == _drag(last):
                self._waiting[-1] = (
                    message  # nothing came between the two that could depend on the earlier one
                )
            elif "server" in message or len(self._waiting) < MOST:
                self._waiting.append(message)
            self._condition.notify()

    @property
    def waiting(self) -> bool:
        """Whether a message waits."""
        return bool(self._waiting)

    def take(self, seconds: float | None) -> Mapping[str, Any] | None:
        """Return the next message; ``None`` where none came in time.

        ``seconds``: to wait; without end for ``None``.
        """
        with self._condition:
            self._condition.wait_for(lambda: self._waiting or self._closed, seconds)
            if self._waiting:
                return self._waiting.popleft()
            if self._closed:
                raise EOFError
            return None

    def read(self, stream: IO[bytes]) -> None:
        """Read messages, one to a line, until the stream ends."""
        for line in stream:
            self.put(json.loads(line))
        with self._condition:
            self._closed = True
            self._waiting.clear()
            self._condition.notify()


def _drag(message: Mapping[str, Any]) -> str | None:
    inner = message.get("page", {})
    drag = inner.get("drag") if isinstance(inner, dict) else None
    return drag if isinstance(drag, str) else None


class Outbox:
    """Lines to the server: ``P`` for the page, ``S`` for the server itself."""

    def __init__(self, stream: IO[bytes]) -> None:
        self._stream = stream

    def page(self, message: Mapping[str, Any]) -> None:
        """Say something to the page.

        ``message``: plain data; numbers are finite or ``None``.
        """
        self._write(b"P", message)

    def server(self, message: Mapping[str, Any]) -> None:
        """Answer a question of the server."""
        self._write(b"S", message)

    def _write(self, kind: bytes, message: Mapping[str, Any]) -> None:
        line = json.dumps(message, allow_nan=False, ensure_ascii=True, separators=(",", ":"))
        self._stream.write(kind + line.encode() + b"\n")
        self._stream.flush()
