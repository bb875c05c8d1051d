"""The sessions of a server, one for each tab and a bounded number, and the files that tabs hand over."""

from __future__ import annotations

import re
import secrets
import time
from collections.abc import AsyncIterator, Callable
from dataclasses import dataclass, field
from pathlib import Path

from ..foundation.errors import NlsError
from .session_process import SessionProcess

FILE_BYTES = 64 << 20
"""Most bytes of one file of records."""
DECK_BYTES = 1 << 20
"""Most bytes of a deck or of a design that was saved."""
ALL_BYTES = 256 << 20
"""Most bytes of all files of one session."""
FILES = 40
"""Most files of one session."""
ENDINGS = (".csv", ".parquet", ".mat", ".h5", ".hdf5", ".toml")
"""What :func:`nlsdesign.bench.identification.load_records` reads, and ``records.toml``."""


class TooLargeError(NlsError):
    """More was handed over than is taken."""


@dataclass
class Uploads:
    """The files that one session was handed."""

    folder: Path
    _sizes: dict[str, int] = field(default_factory=dict)
    _names: dict[str, str] = field(default_factory=dict)

    async def keep(self, name: str, parts: AsyncIterator[bytes], announced: int | None) -> str:
        """Write one file and return the name under which it stands.

        ``name``: as the page calls it; letters that a name of ours may not have are replaced, and no path is
        left. ``announced``: its length in bytes, where the page says it.
        """
        kept = plain_name(name)
        # Refuse a file that would take the place of another: one of two records would be lost unseen.
        other = self._names.get(kept, name) if kept in self._sizes else name
        if other != name:
            raise NlsError(
                f"file '{name[:80]}'", f"would take the place of '{other[:80]}': here both are called {kept}",
                next_step="rename one of them, with letters of English, digits, '-' and '_'",
            )  # fmt: skip
        others = sum(size for each, size in self._sizes.items() if each != kept)
        if kept not in self._sizes and len(self._sizes) >= FILES:
            raise TooLargeError(
                "files", f"{FILES} of them are there, which is the most", next_step="remove some"
            )
        most = min(FILE_BYTES, ALL_BYTES - others)
        if announced is not None and announced > most:
            raise too_large(kept, most)
        self.folder.mkdir(parents=True, exist_ok=True)
        place, size = self.folder / kept, 0
        # Counted from its first byte on, so that several files at once keep to the same limit.
        try:
            with place.open("wb") as stream:
                async for part in parts:
                    size += len(part)
                    self._sizes[kept] = size
                    if size > FILE_BYTES or sum(self._sizes.values()) > ALL_BYTES:
                        raise too_large(kept, most)
                    stream.write(part)
        except BaseException:
            place.unlink(missing_ok=True)
            self._sizes.pop(kept, None)
            raise
        self._sizes[kept], self._names[kept] = size, name
        return kept

    def clear(self) -> None:
        """Remove all files."""
        for name in self._sizes:
            (self.folder / name).unlink(missing_ok=True)
        self._sizes.clear()


def too_large(name: str, most: int) -> TooLargeError:
    """Return the error of a file that is too large."""
    return TooLargeError(
        name, f"is larger than {most / 2**20:.4g} MiB, the most that the live page takes",
        next_step="shorten the record, or diagnose from the command line: nlsdesign diagnose",
    )  # fmt: skip


def plain_name(name: str) -> str:
    """Return the name of a file of records without any path, in letters that every system takes."""
    last = re.split(r"[/\\]", name)[-1]
    _, dot, ending = last.rpartition(".")
    if dot + ending.lower() not in ENDINGS:
        raise NlsError(
            f"file '{last}'", "is no table of records", next_step=f"take one of {', '.join(ENDINGS)}"
        )
    return "records.toml" if ending.lower() == "toml" else plain_letters(last)


def plain_letters(name: str) -> str:
    """Return the name of a file in letters that every system takes, and that end no header."""
    stem, dot, ending = name.rpartition(".")
    # Points within a name stay: sine_2.0Hz is how records.toml calls it too.
    kept = (re.sub(r"[^A-Za-z0-9_.-]+", "_", part).strip("_.")[:80] for part in (stem, ending.lower()))
    return f"{next(kept) or 'record'}{dot}{next(kept)}"


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
    """The design of one tab."""

    name: str  # random; the tab keeps it
    process: SessionProcess  # that computes
    shown: int = 0  # number of the socket that shows it, zero for none
    # touched: when something was last done with it, in seconds of a steady clock
    touched: float = field(default_factory=time.monotonic)

    def __post_init__(self) -> None:
        self.uploads = Uploads(self.process.folder / "records")


class Sessions:
    """All sessions of one server.

    ``begin``: returns a process that is not started yet.
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
            alone = sorted(
                (each for each in self._sessions.values() if not each.shown), key=lambda each: each.touched
            )
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
