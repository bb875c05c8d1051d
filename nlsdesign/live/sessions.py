"""The sessions of a server: one design for each tab, a bounded number, ended when nobody comes back."""

from __future__ import annotations

import secrets
import time
from collections.abc import Callable
from dataclasses import dataclass, field

from .session_process import SessionProcess
from .uploads import Uploads

MOST = 8
"""Sessions at once; each is a process of about 200 MB."""
ALONE = 15 * 60.0
"""Seconds after which a session ends that no tab shows."""
UNTOUCHED = 12 * 3600.0
"""Seconds after which a session ends in whose tab nobody has changed anything."""

QUIET = 10.0
"""Seconds without a change after which the process of the next session is prepared."""


@dataclass(eq=False)
class Session:
    """The design of one tab.

    Parameters
    ----------
    name
        Random; the tab keeps it.
    process
        That computes.
    shown
        Number of the socket that shows it, zero for none.
    touched
        When something was last done with it, in seconds of a steady clock.
    """

    name: str
    process: SessionProcess
    shown: int = 0
    touched: float = field(default_factory=time.monotonic)

    def __post_init__(self) -> None:
        self.uploads = Uploads(self.process.folder / "records")


class Sessions:
    """All sessions of one server.

    Parameters
    ----------
    begin
        Returns a process that is not started yet.
    clock
        Steady, in seconds.
    """

    def __init__(
        self, begin: Callable[[], SessionProcess], clock: Callable[[], float] = time.monotonic
    ) -> None:
        self._begin, self._clock = begin, clock
        self._sessions: dict[str, Session] = {}
        self._spare: SessionProcess | None = None

    def __len__(self) -> int:
        return len(self._sessions)

    @property
    def quiet(self) -> bool:
        """Whether nobody has changed anything for a while, so that the processor may be used otherwise."""
        now = self._clock()
        return all(now - each.touched > QUIET for each in self._sessions.values())

    async def prepare(self) -> None:
        """Start the process of the next session before anybody asks for it."""
        if self._spare is None and len(self._sessions) < MOST:
            self._spare = self._begin()
            await self._spare.start()

    def get(self, name: str) -> Session | None:
        """Return a session that is there."""
        session = self._sessions.get(name)
        if session is not None:
            session.touched = self._clock()
        return session

    async def new(self) -> Session | None:
        """Return a new session; ``None`` where the largest number is open, each in a tab of its own."""
        if len(self._sessions) >= MOST:
            alone = sorted((each for each in self._sessions.values() if not each.shown), key=_touched)
            if not alone:
                return None
            self.end(alone[0])
        process, self._spare = self._spare, None
        if process is None or not process.alive:
            process = self._begin()
            await process.start()
        session = Session(secrets.token_urlsafe(16), process, touched=self._clock())
        self._sessions[session.name] = session
        return session

    def end(self, session: Session) -> None:
        """End a session with its process."""
        self._sessions.pop(session.name, None)
        session.process.kill()

    def end_the_idle(self) -> None:
        """End the sessions whose time is over."""
        now = self._clock()
        for each in list(self._sessions.values()):
            if now - each.touched > (UNTOUCHED if each.shown else ALONE):
                self.end(each)

    def end_all(self) -> list[SessionProcess]:
        """End every session and the process that waits for the next; returns their processes."""
        processes = [each.process for each in self._sessions.values()]
        if self._spare is not None:
            processes.append(self._spare)
        self._sessions.clear()
        self._spare = None
        for each in processes:
            each.kill()
        return processes


def _touched(session: Session) -> float:
    return session.touched
