"""Progress of long work: shown on a terminal, silent elsewhere."""

from __future__ import annotations

import sys
import time
from collections.abc import Iterator
from contextlib import contextmanager
from typing import Protocol

from rich.console import Console
from rich.status import Status


class Progress(Protocol):
    """Receives messages of long work while it runs."""

    def note(self, text: str) -> None:
        """Show the present activity."""
        ...


class Quiet:
    """Progress that is not shown."""

    def note(self, text: str) -> None:
        """Show nothing."""


class Steps:
    """Steps of a study: a spinner with the present step, and a line with its duration at the end.

    Parameters
    ----------
    console
        Where to print; standard error by default, so that standard output stays clean for ``--json``.
    """

    def __init__(self, console: Console | None = None) -> None:
        self._console = console or Console(file=sys.stderr, highlight=False)
        self._status: Status | None = None
        self._label = ""

    def note(self, text: str) -> None:
        """Show the present activity within the step."""
        if self._status is not None:
            self._status.update(f"{self._label}: {text}")

    @contextmanager
    def step(self, label: str) -> Iterator[None]:
        """Run one step.

        Parameters
        ----------
        label
            Name of the step.
        """
        begin = time.perf_counter()
        self._label = label
        if not self._console.is_terminal:
            yield
            return
        with self._console.status(label) as status:
            self._status = status
            try:
                yield
            finally:
                self._status = None
        self._console.print(f"  {time.perf_counter() - begin:6.1f} s  {label}")
