"""A session of the live page without server and browser, and bench records to hand it."""

from __future__ import annotations

import base64
import io
import json
import time
from collections.abc import Callable, Iterator
from contextlib import contextmanager, suppress
from pathlib import Path
from typing import Any

import numpy as np

import nlsdesign as nls
from nlsdesign.components import ROTATION, Assembly, Spring
from nlsdesign.live.live_design import LiveDesign
from nlsdesign.live.messages import Inbox, Outbox
from nlsdesign.live.session_design import SessionDesign

Message = dict[str, Any]


class _EnoughError(Exception):
    """What a test waits for is there."""


class _Asked(Inbox):
    """The inbox of a session that runs as long as its test waits for something."""

    enough: Callable[[], bool]

    def take(self, seconds: float | None) -> Message | None:  # type: ignore[override]
        if self.enough():
            raise _EnoughError
        return super().take(0.02 if seconds is None else min(seconds, 0.02))  # type: ignore[return-value]


class Session:
    """A session, and what it has sent.

    Parameters
    ----------
    deck
        That it begins with; empty for the first of the gallery.
    folder
        Of its own; records stand in ``records`` below it.
    """

    def __init__(self, deck: str, folder: Path) -> None:
        self.folder = folder / "records"
        self.pages: list[Message] = []
        self._answers: dict[int, Message] = {}
        self._inbox = _Asked()
        self._number = 0
        self.design = SessionDesign(deck, str(folder), Outbox(self))  # type: ignore[arg-type]

    @property
    def live(self) -> LiveDesign:
        """What it is about."""
        return self.design._news.live

    def _run(self, enough: Callable[[], bool], seconds: float = 120.0) -> None:
        """Let the session run until something is there."""
        last = time.monotonic() + seconds

        def over() -> bool:
            assert time.monotonic() < last, "never came"
            return enough()

        self._inbox.enough = over
        with suppress(_EnoughError):
            self.design.run(self._inbox)

    def write(self, line: bytes) -> None:
        """Take a line, as the pipe to the server would."""
        message = json.loads(line[1:])
        if line.startswith(b"P"):
            self.pages.append(message)
        else:
            self._answers[message["number"]] = message

    def flush(self) -> None:
        """Nothing is held back."""

    def ask(self, **message: Any) -> Message:
        """Ask as a page does, and return the answer that has the number of the question.

        What was sent before is forgotten.
        """
        self.pages.clear()
        self._number += 1
        number = self._number
        self._inbox.put({"page": {**message, "number": number}})
        return self.until(lambda each: each.get("number") == number)

    def edit(self, edit: str, **fields: Any) -> Message:
        """Return the answer to an edit, or its refusal."""
        return self.ask(what="edit", edit={"edit": edit, **fields})

    def work(self, name: str, *, over: bool = True, **fields: Any) -> Message:
        """Start work, or stop it; return its news, where asked for only once it is over."""
        first: Message = self.ask(what="work", name=name, **fields)
        if first["what"] == "refused" or not over:
            return first
        return self.news(name, lambda work: work["state"] != "computing")

    def news(self, name: str, wanted: Callable[[Message], bool]) -> Message:
        """Return the last news of work of a kind once they are as wanted."""
        found = self.until(
            lambda each: each["what"] == "work" and each["work"]["name"] == name and wanted(each["work"])
        )
        return dict(found["work"])

    def until(self, wanted: Callable[[Message], bool]) -> Message:
        """Return the last message to the page that is wanted, since the last question."""
        found: list[Message] = []

        def there() -> bool:
            found[:] = [each for each in self.pages if wanted(each)][-1:]
            return bool(found)

        self._run(there)
        return found[0]

    def server(self, **question: Any) -> Message:
        """Ask as the server does."""
        self._number += 1
        number = self._number
        self._inbox.put({"server": {**question, "number": number}})
        self._run(lambda: number in self._answers)
        return self._answers.pop(number)

    def file(self, kind: str) -> tuple[str, bytes]:
        """Return name and content of a file that it makes."""
        answer = self.server(what="file", kind=kind)
        assert "refused" not in answer, answer
        return answer["name"], base64.b64decode(answer["content"])

    def open(self, content: bytes, **fields: str) -> str:
        """Hand over a deck, a saved design, a task or coils; return why it was refused, or nothing."""
        answer = self.server(what="open", content=base64.b64encode(content).decode(), **fields)
        return str(answer.get("refused", ""))


@contextmanager
def session(deck: str, folder: Path) -> Iterator[Session]:
    """Begin a session and show its design; its work has ended on leaving."""
    one = Session(deck, folder)
    try:
        one.ask(what="show")
        yield one
    finally:
        one.live.work.close()


def bench_records(machine: Assembly, amperes: float = 1.5) -> dict[str, dict[str, np.ndarray]]:
    """Return three simulated records by name, columns by head: a spring pulls that the deck does not declare.

    With 15 A the machine turns further than its cam, which makes the records suspect at once.
    """
    wires = nls.tie(Spring(stiffness=0.6, domain=ROTATION), "motor")
    built = machine.with_part("wires", wires)
    model = nls.flatten(built, outputs=["motor.angle"])
    time_of_run, records = np.arange(0.0, 2.0, 4e-3), {}
    for number, (hertz, share) in enumerate([(0.7, 1.0), (1.1, 0.6), (0.9, 0.8)], start=1):
        phase = 2.0 * np.pi * hertz * time_of_run
        rising = np.minimum(1.0, 2.0 * time_of_run)
        current = amperes * share * (np.sin(phase) + 0.3 * np.sin(2.7 * phase)) * rising
        run = nls.simulate(model, time_of_run, inputs={"motor.current": current})
        reading = nls.measure(run, built, seed=number)["motor_encoder.reading"]
        columns = {"t_s": time_of_run, "current_A": current, "angle_rad": reading}
        # As text has them, so that a record is the same in every format.
        records[f"run{number}"] = {name: np.round(values, 6) for name, values in columns.items()}
    return records


def as_csv(columns: dict[str, np.ndarray]) -> bytes:
    """Return a record as a text file."""
    stream = io.StringIO()
    rows = np.column_stack(list(columns.values()))
    np.savetxt(stream, rows, "%.6f", ",", header=",".join(columns), comments="")
    return stream.getvalue().encode()
