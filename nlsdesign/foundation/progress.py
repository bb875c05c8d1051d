"""Progress of long work: shown on a terminal, silent elsewhere."""

from __future__ import annotations

import shutil
import sys
import time
from collections.abc import Iterator
from contextlib import contextmanager
from typing import Protocol, TextIO


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
    """Steps of a study: one line with the present step, and one with its duration at the end."""

    def __init__(self, stream: TextIO | None = None) -> None:
        self._stream = stream or sys.stderr
        self._label = ""

    def note(self, text: str) -> None:
        """Show the present activity within the step."""
        self._show(f"{self._label}: {text}")

    def _show(self, text: str) -> None:
        """Write over the present line; the cursor waits at its end."""
        if self._label and self._stream.isatty():
            width = shutil.get_terminal_size().columns - 1
            self._stream.write("\r" + " ".join(text.split())[:width].ljust(width))
            self._stream.flush()

    @contextmanager
    def step(self, label: str) -> Iterator[None]:
        """Run one step."""
        begin = time.perf_counter()
        self._label = label
        self._show(label)
        try:
            yield
        finally:
            self._show("")
            self._label = ""
        if self._stream.isatty():
            self._stream.write(f"\r  {time.perf_counter() - begin:6.1f} s  {label}\n")
