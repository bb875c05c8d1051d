"""Programs that are started, and what an interrupt leaves behind.

``__main__`` runs the program in :func:`guarded` before anything else is imported. An interrupt is raised in
the main thread as usual, so that every part of the package cleans up. What a library swallows, or does not
let through in time, a watch ends: it ends the processes that were started and removes what is temporary. All
temporary folders of a run stand in one whose name is known before it exists.
"""

from __future__ import annotations

import contextlib
import ctypes
import os
import shutil
import signal
import subprocess
import sys
import tempfile
import threading
import time
from collections.abc import Callable, Iterator, Mapping, Sequence
from pathlib import Path
from types import FrameType

from .text_files import remove_drafts

_DEATH_SIGNAL = 1
"""PR_SET_PDEATHSIG of Linux."""


def run_to_end(
    command: Sequence[str], *, environment: Mapping[str, str] | None = None, seconds: float | None = None
) -> subprocess.CompletedProcess[str]:
    """Run a program and return what it printed; an interrupt ends it with all that it has started.

    ``environment``: of the program; this one's without it. ``seconds``: most time that it may take;
    ``subprocess.TimeoutExpired`` is raised beyond it.
    """
    group = None if sys.platform == "win32" else 0
    with signals_held():
        # It inherits that signals are held; a group of its own, which is killed, makes up for that.
        process = subprocess.Popen(
            command, env=environment, stdin=subprocess.DEVNULL, stdout=subprocess.PIPE,
            stderr=subprocess.PIPE, text=True, errors="replace", process_group=group,
        )  # fmt: skip
    try:
        out, errors = process.communicate(timeout=seconds)
    except BaseException:
        with signals_held(), contextlib.suppress(OSError):
            if group is not None:
                os.killpg(process.pid, signal.SIGKILL)
            process.kill()
        with signals_held():
            process.wait()
        raise
    return subprocess.CompletedProcess(command, process.returncode, out, errors)


@contextlib.contextmanager
def signals_held() -> Iterator[None]:
    """Hold interrupts and requests to end back until the end of the block, where they are delivered."""
    before = signal.pthread_sigmask(signal.SIG_BLOCK, {signal.SIGINT, signal.SIGTERM})
    try:
        yield
    finally:
        signal.pthread_sigmask(signal.SIG_SETMASK, before)


THREADS_OF_LINEAR_ALGEBRA = (
    "OMP_NUM_THREADS", "OPENBLAS_NUM_THREADS", "MKL_NUM_THREADS", "VECLIB_MAXIMUM_THREADS",
)  # fmt: skip


def use_one_thread() -> None:
    """Give the linear algebra, which must not be loaded yet, one thread unless the environment says how many.

    Matrices of this package have a few rows: threads wait for each other longer than they compute, and
    several processes that share the cores already would each bring as many.
    """
    if not any(name in os.environ for name in THREADS_OF_LINEAR_ALGEBRA):
        os.environ.update(dict.fromkeys(THREADS_OF_LINEAR_ALGEBRA, "1"))


def ready_as_helper(parent: int, at_death_of_parent: signal.Signals = signal.SIGTERM) -> None:
    """Let the parent handle interruptions, and end at once when it asks for it or ends itself.

    ``parent``: number of its process; it may have ended since this one began.
    """
    signal.signal(signal.SIGINT, signal.SIG_IGN)
    signal.signal(signal.SIGTERM, signal.SIG_DFL)
    signal.pthread_sigmask(signal.SIG_UNBLOCK, {signal.SIGTERM})
    if sys.platform == "linux":
        ctypes.CDLL(None).prctl(_DEATH_SIGNAL, at_death_of_parent)
        if os.getppid() != parent:
            os.kill(os.getpid(), at_death_of_parent)


_PATIENCE = 1.0
"""Seconds that the parts of the package have to clean up by themselves."""
_usual_folder: str | None = None
_received = threading.Event()


def was_interrupted() -> bool:
    """Tell whether this run was asked to end: an error that comes then may be of the interrupt's making."""
    return _received.is_set()


def usual_temporary_folder() -> Path:
    """Return the folder of the system for what is temporary, which outlives this run."""
    return Path(_usual_folder or tempfile.gettempdir())


def guarded(run: Callable[[], None]) -> None:
    """Run the program; SIGINT ends it with status 130, SIGTERM with 143.

    ``run``: the program; it may leave by :class:`SystemExit`.
    """
    guard = _Guard()
    try:
        run()
    except SystemExit as leaving:
        if guard.received and leaving.code not in (0, 1, None):
            guard.end(announced=leaving.code == 130)
        raise
    except BaseException:
        # A library may have turned the interrupt into an error of its own.
        if guard.received:
            guard.end()
        raise
    finally:
        try:
            guard.leave()
        except KeyboardInterrupt:
            guard.end()


class _Guard:
    """Handlers of both signals, a folder for all that is temporary, and a watch."""

    def __init__(self) -> None:
        global _usual_folder
        self.received = 0
        self._ending = threading.Lock()
        self._leaving = False
        _usual_folder = tempfile.gettempdir()
        self._folder = Path(_usual_folder) / f"nlsdesign-run-{os.getpid()}-{time.time_ns():x}"
        for number in (signal.SIGINT, signal.SIGTERM):
            # Who starts a command in the background has interrupts ignored, and means it.
            if signal.getsignal(number) is not signal.SIG_IGN:
                signal.signal(number, self._handle)
        with contextlib.suppress(OSError):  # then each part says itself that it cannot write there
            self._folder.mkdir(mode=0o700)
            tempfile.tempdir = str(self._folder)
        self._process = os.getpid()
        sys.unraisablehook = self._unraisable

    @staticmethod
    def _unraisable(unraisable: sys.UnraisableHookArgs) -> None:
        """Say nothing of an interrupt that came while an object was let go of; the watch ends the program."""
        if unraisable.exc_type is not KeyboardInterrupt:
            sys.__unraisablehook__(unraisable)

    def _handle(self, number: int, _: FrameType | None) -> None:
        if self.received or self._leaving:
            return
        self.received = number
        _received.set()
        threading.Thread(target=self._watch, daemon=True).start()
        raise KeyboardInterrupt

    def _watch(self) -> None:
        time.sleep(_PATIENCE)
        if not self._leaving:
            self.end()

    def end(self, *, announced: bool = False) -> None:
        """End the processes that were started, remove what is temporary, and end this process."""
        self._ending.acquire()  # never released: whoever comes second waits for the end
        parents: dict[int, list[int]] = {}
        with contextlib.suppress(OSError):
            for entry in os.listdir("/proc"):
                with contextlib.suppress(OSError, ValueError, IndexError):
                    fields = (
                        Path("/proc", entry, "stat").read_text(encoding="utf-8").rpartition(")")[2].split()
                    )
                    parents.setdefault(int(fields[1]), []).append(int(entry))
        below, left = [], [os.getpid()]
        while left:
            left = [child for one in left for child in parents.get(one, [])]
            below += left
        for number in below:  # none where the system does not list them
            with contextlib.suppress(OSError):
                os.kill(number, signal.SIGKILL)
        self._sweep()
        with contextlib.suppress(OSError, ValueError):
            sys.stdout.flush()
        with contextlib.suppress(OSError, ValueError):
            sys.stderr.write("" if announced else "interrupted\n")
            sys.stderr.flush()
        os._exit(128 + self.received)

    def leave(self) -> None:
        """Remove what is temporary; from here on interrupts change nothing."""
        if os.getpid() == self._process:
            self._leaving = True
            for number in (signal.SIGINT, signal.SIGTERM):
                # At its very end Python gives handlers back to the system, which would end it by the signal;
                # what is ignored stays ignored.
                signal.signal(number, signal.SIG_IGN)
            self._sweep()

    def _sweep(self) -> None:
        remove_drafts()
        for _ in range(10):
            shutil.rmtree(self._folder, ignore_errors=True)
            if not self._folder.exists():
                return
            time.sleep(0.02)  # a process that was ended just now may still have written
