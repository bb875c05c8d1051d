"""The process of one session: ``python -m nlsdesign.live.session_work``, lines of JSON on its two pipes.

It ends when the server closes its input, however the server has ended, with all that it has started.
"""

from __future__ import annotations

import contextlib
import json
import os
import signal
import sys
import threading
from collections.abc import Mapping
from typing import IO, Any

from .inbox import Inbox


class Outbox:
    """Lines to the server: ``P`` for the page, ``S`` for the server itself.

    Parameters
    ----------
    stream
        To the server.
    """

    def __init__(self, stream: IO[bytes]) -> None:
        self._stream = stream

    def page(self, message: Mapping[str, Any]) -> None:
        """Say something to the page.

        Parameters
        ----------
        message
            Plain data; numbers are finite or ``None``.
        """
        self._write(b"P", message)

    def server(self, message: Mapping[str, Any]) -> None:
        """Answer a question of the server.

        Parameters
        ----------
        message
            Plain data with the ``number`` of the question.
        """
        self._write(b"S", message)

    def _write(self, kind: bytes, message: Mapping[str, Any]) -> None:
        line = json.dumps(message, allow_nan=False, ensure_ascii=True, separators=(",", ":"))
        self._stream.write(kind + line.encode() + b"\n")
        self._stream.flush()


def main() -> None:
    """Serve one session until the input ends."""
    with contextlib.suppress(ValueError):
        signal.signal(signal.SIGINT, signal.SIG_IGN)  # Ctrl-C is for the server, which ends this process
    # What a library prints must not come between the lines.
    out = os.fdopen(os.dup(1), "wb")
    os.dup2(2, 1)
    inbox = Inbox()
    threading.Thread(target=_read, args=(inbox,), daemon=True).start()
    begin = inbox.take(None)
    assert begin is not None
    from ..extensions import extended_by, load_extension
    from .session_design import SessionDesign

    with contextlib.suppress(EOFError), extended_by(*map(load_extension, begin["packages"])):
        SessionDesign(begin["deck"], begin["folder"], Outbox(out)).run(inbox)
    _end()


def _read(inbox: Inbox) -> None:
    inbox.read(sys.stdin.buffer)
    _end()


def _end() -> None:
    """End this process with all that it has started, whatever it does at the moment."""
    if sys.platform != "win32" and os.getpgid(0) == os.getpid():
        os.killpg(0, signal.SIGKILL)
    os._exit(0)


if __name__ == "__main__":
    main()
