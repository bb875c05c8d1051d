"""The process of one session: ``python -m nlsdesign.live.session_work``, lines of JSON on its two pipes.

It ends when the server closes its input, however the server has ended, with all that it has started.
"""

from __future__ import annotations

import contextlib
import os
import signal
import sys
import threading

from .messages import Inbox, Outbox


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
    sys.path.extend(each for each in begin["places"] if each not in sys.path)
    from ..foundation.extensions import extended_by, load_extension
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
