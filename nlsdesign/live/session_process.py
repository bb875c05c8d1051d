"""The process behind one designer's page, seen from the server: lines of JSON over two pipes.

A design holds the processor for tens of milliseconds and a diagnosis for seconds; in a process of its own
neither delays the server or another session, and it can be ended whatever it does.
"""

from __future__ import annotations

import asyncio
import base64
import contextlib
import itertools
import json
import os
import shutil
import signal
import sys
import tempfile
from collections.abc import Awaitable, Callable, Mapping
from pathlib import Path
from typing import Any

from ..foundation.errors import NlsError
from ..foundation.processes import THREADS_OF_LINEAR_ALGEBRA

Listener = Callable[[str], Awaitable[None]]

_LONGEST_LINE = 1 << 26
"""Most bytes of one answer; an FMU as text is the longest."""
_WAIT = 300.0
"""Most seconds until a file that was asked for is there."""


class SessionProcess:
    """A process that holds the design of one session.

    ``deck``: name or file of the deck that it begins with; empty for the first of the gallery. ``packages``:
    what the program was extended by, as named on the command line.
    """

    def __init__(self, deck: str, packages: tuple[str, ...] = ()) -> None:
        self._deck, self._packages = deck, packages
        self.folder = Path(tempfile.mkdtemp(prefix="nlsdesign-session-"))
        self._listener: Listener | None = None
        self._waiting: dict[int, asyncio.Future[dict[str, Any]]] = {}
        self._numbers = itertools.count(1)
        self._process: asyncio.subprocess.Process | None = None
        self._relay: asyncio.Task[None] | None = None

    async def start(self) -> None:
        """Start the process; it reads its libraries while the page is being painted."""
        root = str(Path(__file__).resolve().parents[2])
        path = os.pathsep.join(filter(None, (root, os.environ.get("PYTHONPATH", ""))))
        threads = dict.fromkeys(THREADS_OF_LINEAR_ALGEBRA, "1")
        self._process = await asyncio.create_subprocess_exec(
            sys.executable, "-P", "-m", "nlsdesign.live.session_work",
            stdin=asyncio.subprocess.PIPE, stdout=asyncio.subprocess.PIPE,
            limit=_LONGEST_LINE, start_new_session=sys.platform != "win32",
            env={**os.environ, **threads, "PYTHONPATH": path, "TMPDIR": str(self.folder)},
        )  # fmt: skip
        self._relay = asyncio.create_task(self._read())
        # Where packages were found stands here too: the folder of the command may be one of the places.
        places = [os.path.abspath(each) for each in sys.path] if self._packages else []
        begin = {"deck": self._deck, "packages": self._packages, "places": places}
        await self._send({**begin, "folder": str(self.folder)})

    @property
    def alive(self) -> bool:
        """Whether the process runs."""
        return self._process is not None and self._process.returncode is None

    def listen(self, listener: Listener | None) -> None:
        """Hand what the process says to a page from now on, to none for ``None``."""
        self._listener = listener

    async def tell(self, text: str) -> None:
        """Tell the page that listens now something; one that is not there misses nothing.

        ``text``: a message of JSON. A page that comes back is shown the whole state.
        """
        if self._listener is not None:
            with contextlib.suppress(Exception):
                await self._listener(text)

    async def from_page(self, message: Mapping[str, Any]) -> None:
        """Hand over a message of the page.

        ``message``: parsed; the process judges what it says.
        """
        await self._send({"page": dict(message)})

    async def ask(self, question: Mapping[str, Any]) -> dict[str, Any]:
        """Ask for something and wait for it."""
        number = next(self._numbers)
        future: asyncio.Future[dict[str, Any]] = asyncio.get_running_loop().create_future()
        self._waiting[number] = future
        try:
            await self._send({"server": {**question, "number": number}})
            return await asyncio.wait_for(future, _WAIT)
        except TimeoutError:
            raise NlsError("session", f"did not answer within {_WAIT:g} s", next_step="try again") from None
        finally:
            self._waiting.pop(number, None)

    def kill(self) -> None:
        """End the process and all that it has started, and remove its folder."""
        if self._process is not None and self._process.returncode is None:
            with contextlib.suppress(OSError):
                if sys.platform == "win32":
                    self._process.kill()
                else:
                    os.killpg(self._process.pid, signal.SIGKILL)
        if self._relay is not None:
            self._relay.cancel()
        self._fail_waiting()
        shutil.rmtree(self.folder, ignore_errors=True)

    async def gone(self) -> None:
        """Wait until a process that was ended is gone."""
        if self._process is not None:
            await self._process.wait()

    async def _send(self, message: Mapping[str, Any]) -> None:
        if self._process is None or self._process.stdin is None or not self.alive:
            raise NlsError("session", "its process has ended", next_step="load the page again")
        self._process.stdin.write(json.dumps(message).encode() + b"\n")
        with contextlib.suppress(ConnectionError):
            await self._process.stdin.drain()

    async def _read(self) -> None:
        """Relay what the process says until it ends."""
        assert self._process is not None
        assert self._process.stdout is not None
        try:
            while line := await self._process.stdout.readline():
                if line.startswith(b"S"):
                    answer = json.loads(line[1:])
                    future = self._waiting.get(answer["number"])
                    if future is not None and not future.done():
                        future.set_result(answer)
                elif line.startswith(b"P"):
                    await self.tell(line[1:].decode())
        except ValueError as error:  # a line beyond the limit
            await self.tell(json.dumps({"what": "ended", "reason": f"an answer was too long: {error}"}))
        else:
            await self.tell(json.dumps({"what": "ended", "reason": "the process of this session has ended"}))
        finally:
            self._fail_waiting()

    def _fail_waiting(self) -> None:
        for future in self._waiting.values():
            if not future.done():
                future.set_exception(NlsError("session", "its process has ended"))


def content_of(answer: Mapping[str, Any]) -> tuple[str, bytes]:
    """Return name and bytes of a file that a process has answered with."""
    if "refused" in answer:
        raise NlsError("file", str(answer["refused"]))
    return str(answer["name"]), base64.b64decode(answer["content"])
