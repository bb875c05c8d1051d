"""Work with foreign libraries in a process of its own, so that their crash or hang ends nothing else.

The process is forked: it sees all data of the work without copying, starts in milliseconds, and fills an
array in shared memory. It is the head of a process group that is ended as a whole. Where the system has no
fork, the work is done in this process.
"""

from __future__ import annotations

import contextlib
import faulthandler
import json
import mmap
import os
import select
import signal
import time
import traceback
from collections.abc import Callable, Sequence
from dataclasses import dataclass, field
from enum import IntEnum
from pathlib import Path
from typing import Any, NoReturn

import numpy as np

from ...foundation import errors
from ...foundation.arrays import Array
from ...foundation.errors import ExportError, NlsError
from ...foundation.processes import ready_as_helper, signals_held
from ...foundation.progress import Progress
from .fmu_description import fit_to_show

_LOOK = 0.05
"""Seconds between two looks at the process."""
_GRACE = 1.0
"""Seconds for a process that has closed its end of the pipe to end by itself."""
OUTPUT_FILE = "output.txt"
"""What the libraries print, in the folder of the work."""


class Activity(IntEnum):
    """What an instance is asked to do."""

    WAITING = 0
    LOADING = 1
    INSTANTIATING = 2
    INITIALIZING = 3
    SETTING = 4
    STEPPING = 5
    READING = 6
    ROLLING_BACK = 7
    ENDING = 8


_WORDS = {
    Activity.WAITING: "before it was asked anything",
    Activity.LOADING: "while its library was loaded",
    Activity.INSTANTIATING: "while it was instantiated",
    Activity.INITIALIZING: "during initialization",
    Activity.SETTING: "while its inputs were set",
    Activity.STEPPING: "during a step",
    Activity.READING: "while its outputs were read",
    Activity.ROLLING_BACK: "while its state was kept or restored",
    Activity.ENDING: "while it was ended",
}


@dataclass(frozen=True, eq=False)
class Watch:
    """What is being done, in memory that the process and its owner share."""

    names: tuple[str, ...]
    # cells: shared integers: number of the instance, activity, row, and a counter of calls
    cells: Any = field(default_factory=lambda: memoryview(mmap.mmap(-1, 32)).cast("q"))

    def __call__(self, instance: int, activity: int) -> None:
        """Note a call that begins."""
        cells = self.cells
        cells[0] = instance
        cells[1] = activity
        cells[3] += 1

    def at_row(self, row: int) -> None:
        """Note how far the work is."""
        self.cells[2] = row

    @property
    def thing(self) -> str:
        """The instance that was called last."""
        return f"instance '{self.names[self.cells[0]]}'"

    @property
    def doing(self) -> str:
        """What it was asked."""
        return _WORDS[Activity(self.cells[1])]


@dataclass(frozen=True, eq=False)
class IsolatedWork:
    """Work that fills an array, in a process of its own."""

    work: Callable[[Array], None]  # fills the array that it is given
    watch: Watch  # which the work tells what it does
    times: Array  # time of each row in s, for messages
    columns: int
    folder: Path  # the process works there, and what it prints goes there; its owner removes it
    patience: float  # most seconds for one call into a library
    progress: Progress  # told how far the work is

    def result(self) -> Array:
        """Do the work and return the array, shape (rows, columns)."""
        rows = len(self.times)
        memory = mmap.mmap(-1, max(1, 8 * rows * self.columns))
        array: Array = np.frombuffer(memory, dtype=np.float64, count=rows * self.columns)
        array = array.reshape(rows, self.columns)
        if not hasattr(os, "fork"):
            self.work(array)
            return array
        child: _Child | None = None
        try:
            with signals_held():
                ours, child = self._started(array)
            answer = self._wait(child, ours)
        finally:
            # An interrupt that comes here waits until nothing of the process is left.
            with signals_held():
                if child is not None:
                    child.end()
                    os.close(ours)
        if answer is None:
            status = child.status
            if os.WIFSIGNALED(status):
                number = os.WTERMSIG(status)
                reason = f"its library crashed ({signal.Signals(number).name})"
            else:
                reason = f"its library ended the process (exit status {os.waitstatus_to_exitcode(status)})"
            raise ExportError(
                self.watch.thing,
                f"{reason} {self._when()}{self._printed()}",
                next_step="the binary is damaged or has a fault: get or export it again",
            )
        if answer:
            _reraise(json.loads(answer))
        return array

    def _started(self, array: Array) -> tuple[int, _Child]:
        """Start the process; return where it tells how it went, and the process."""
        ours, theirs = os.pipe()
        owner, process = os.getpid(), os.fork()
        if process == 0:
            os.close(ours)
            self._work_and_end(array, theirs, owner)
        os.close(theirs)
        with contextlib.suppress(OSError):  # it did so itself, or has ended
            os.setpgid(process, process)
        return ours, _Child(process)

    def _wait(self, child: _Child, pipe: int) -> bytes | None:
        """Return what the process says at its end, ``None`` if it says nothing or not in time."""
        text = b""
        calls, since = -1, time.monotonic()
        while True:
            ready, _, _ = select.select([pipe], [], [], _LOOK)
            if ready:
                piece = os.read(pipe, 65536)
                text += piece
                if not piece:
                    break
                continue
            if child.ended():
                # A process that the library started may hold the pipe open.
                break
            now = time.monotonic()
            if self.watch.cells[3] != calls:
                calls, since = self.watch.cells[3], now
                row = min(self.watch.cells[2], len(self.times) - 1)
                self.progress.note(f"{self.times[row]:.3f} of {self.times[-1]:g} s")
            elif now - since > self.patience:
                raise ExportError(
                    self.watch.thing,
                    f"did not return within {self.patience:g} s {self._when()}",
                    next_step="if it is only slow, give it more: step=Stepping(patience=SECONDS)",
                )
        if text.endswith(b"\n"):
            return text[:-1]
        # Wait for its end, so that its own way to end is known.
        until = time.monotonic() + _GRACE
        while not child.ended() and time.monotonic() < until:
            time.sleep(0.001)
        return None

    def _when(self) -> str:
        row = min(self.watch.cells[2], len(self.times) - 1)
        at = f" from {self.times[row]:g} s" if self.watch.cells[1] == Activity.STEPPING else ""
        return self.watch.doing + at

    def _printed(self) -> str:
        """Return the last line that the libraries printed."""
        try:
            lines = (self.folder / OUTPUT_FILE).read_bytes()[-2000:].decode("utf-8", "replace").splitlines()
        except OSError:
            return ""  # the process ended before it had opened the file
        last = next((line.strip() for line in reversed(lines) if line.strip()), "")
        return f"; it printed: {fit_to_show(last)}" if last else ""

    def _work_and_end(self, array: Array, pipe: int, owner: int) -> NoReturn:
        """Work in the new process, say at the end how it went, and never return."""
        answer: dict[str, Any] | None
        try:
            # Make the new process one that can crash quietly and leaves interruptions to its owner.
            with contextlib.suppress(OSError):  # its owner did so already
                os.setpgid(0, 0)
            ready_as_helper(owner, signal.SIGKILL)
            faulthandler.disable()
            import resource

            resource.setrlimit(resource.RLIMIT_CORE, (0, resource.getrlimit(resource.RLIMIT_CORE)[1]))
            os.chdir(self.folder)
            printed = os.open(self.folder / OUTPUT_FILE, os.O_WRONLY | os.O_CREAT | os.O_APPEND, 0o600)
            nothing = os.open(os.devnull, os.O_RDONLY)
            for descriptor, place in ((0, nothing), (1, printed), (2, printed)):
                os.dup2(place, descriptor)
            self.work(array)
            answer = None
        except NlsError as error:
            answer = {
                "kind": type(error).__name__,
                "words": [error.thing, error.rule, error.did_you_mean, error.next_step],
            }
        except BaseException:
            # A mistake of this package: its owner raises it with the place where it came from.
            answer = {"kind": "", "words": [traceback.format_exc()]}
        try:
            text = b"" if answer is None else json.dumps(answer).encode()
            os.write(pipe, text + b"\n")
        finally:
            os._exit(0)


class _Child:
    """A process, and how it ended."""

    def __init__(self, number: int) -> None:
        self._number = number
        self._ended = False
        self.status = 0

    def ended(self) -> bool:
        """Tell whether it has ended."""
        if not self._ended:
            number, status = os.waitpid(self._number, os.WNOHANG)
            if number:
                self._ended, self.status = True, status
        return self._ended

    def end(self) -> None:
        """End it and all processes that it started."""
        with contextlib.suppress(OSError):  # none of them is left
            os.killpg(self._number, signal.SIGKILL)
        if not self._ended:
            _, self.status = os.waitpid(self._number, 0)
            self._ended = True


def _reraise(answer: dict[str, Any]) -> NoReturn:
    words: Sequence[Any] = answer["words"]
    if not answer["kind"]:
        raise RuntimeError(f"in the process of the FMUs:\n{words[0]}")
    kind: type[NlsError] = getattr(errors, answer["kind"])
    raise kind(words[0], words[1], did_you_mean=words[2], next_step=words[3])
