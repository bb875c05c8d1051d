"""Long work of one designer in processes of their own: seen, and ended, from outside."""

from __future__ import annotations

import contextlib
import multiprocessing
import os
import pickle
import signal
import sys
import time
from collections.abc import Callable
from dataclasses import dataclass
from multiprocessing.connection import Connection
from typing import Any

from ..foundation.errors import NlsError
from ..foundation.extensions import extended_by, extension_names, load_extension
from ..foundation.processes import signals_held
from .answers import WorkStage

_ENDED = "its process ended without an answer"
_PATIENCE = 2.0
"""Seconds for a process to end by itself after it has been asked to."""


@dataclass(frozen=True)
class WorkState:
    """How far a piece of work is."""

    name: str
    revision: int  # of the design that it is for
    state: WorkStage  # how far it is
    message: str  # stage, or why it failed
    seconds: float  # since it began
    value: Any = None  # what came out


class BackgroundWork:
    """One call in a process of its own.

    ``revision``: of the design that it is for. ``work``: function of a module, called with a function that
    takes a stage in words, and with the arguments.
    """

    def __init__(
        self, name: str, revision: int, work: Callable[..., Any], arguments: tuple[Any, ...]
    ) -> None:
        self._name, self._revision = name, revision
        self._began, self._took = time.monotonic(), 0.0
        self._state, self._message, self._value = WorkStage.COMPUTING, "begins", None
        context = _context()
        self._end, other = context.Pipe(duplex=False)
        # Not a daemon: a design has helpers of its own. It ends by itself when its pipe is closed.
        # What a part of another package is made of is unknown there until that package is loaded.
        packed = extension_names(), pickle.dumps((work, arguments))
        self._process = context.Process(target=_run, args=(other, *packed), daemon=False)  # type: ignore[attr-defined]
        with signals_held():
            self._process.start()
        other.close()

    def state(self) -> WorkState:
        """Return how far it is; never waits."""
        while self._state is WorkStage.COMPUTING and self._end.poll():
            self._hear()
        if self._state is WorkStage.COMPUTING and not self._process.is_alive() and not self._end.poll():
            self._over(WorkStage.FAILED, _ENDED)
        took = self._took or time.monotonic() - self._began
        return WorkState(self._name, self._revision, self._state, self._message, took, self._value)

    def wait(self, seconds: float) -> WorkState:
        """Return how far it is once it is over, or after that time."""
        last = time.monotonic() + seconds
        while self._state is WorkStage.COMPUTING and (left := last - time.monotonic()) > 0.0:
            if self._end.poll(min(left, 0.2)):
                self._hear()
            elif not self._process.is_alive():
                break
        return self.state()

    def cancel(self) -> WorkState:
        """End it, with all that it has started, and return what became of it."""
        if self.state().state is WorkStage.COMPUTING:
            self._over(WorkStage.CANCELLED, "cancelled")
        return self.state()

    def _hear(self) -> None:
        try:
            kind, content = self._end.recv()
        except (EOFError, OSError):
            self._over(WorkStage.FAILED, _ENDED)
            return
        if kind is WorkStage.COMPUTING:
            self._message = content
        elif kind is WorkStage.DONE:
            self._value = content
            self._over(kind, "")
        else:
            self._over(kind, content)

    def _over(self, state: WorkStage, message: str) -> None:
        self._took = time.monotonic() - self._began
        self._state, self._message = state, message
        if state is WorkStage.CANCELLED:
            self._kill()
        self._process.join(_PATIENCE)
        if self._process.is_alive():
            self._kill()
            self._process.join()
        self._end.close()

    def _kill(self) -> None:
        # The process leads a group of its own from its first line on; before that it has no helpers.
        pid = self._process.pid
        if pid is not None and sys.platform != "win32":
            with contextlib.suppress(OSError):
                if os.getpgid(pid) == pid:
                    os.killpg(pid, signal.SIGKILL)
        self._process.kill()


def _context() -> multiprocessing.context.BaseContext:
    """Return how processes are started: from a server that has loaded the rooms, where there can be one."""
    if "forkserver" not in multiprocessing.get_all_start_methods():
        return multiprocessing.get_context("spawn")
    context = multiprocessing.get_context("forkserver")
    context.set_forkserver_preload([__name__.rpartition(".")[0] + ".work"])
    return context


def warm_up() -> None:
    """Start the process from which work is forked, so that the first piece of work does not wait for it."""
    if _context().get_start_method() == "forkserver":
        from multiprocessing import forkserver

        forkserver.ensure_running()


def _run(pipe: Connection, packages: tuple[str, ...], packed: bytes) -> None:
    """Call the work, within the packages that the session is extended by, and send what came out."""
    if sys.platform != "win32":
        os.setpgid(0, 0)
    if sys.platform == "linux":
        import ctypes

        ctypes.CDLL(None).prctl(1, signal.SIGKILL)  # PR_SET_PDEATHSIG
        if os.getppid() == 1:
            os._exit(1)
    signal.signal(signal.SIGINT, signal.SIG_IGN)

    def stage(words: str) -> None:
        pipe.send((WorkStage.COMPUTING, words))

    try:
        with extended_by(*map(load_extension, packages)):
            work, arguments = pickle.loads(packed)
            answer = (WorkStage.DONE, work(stage, *arguments))
    except NlsError as error:
        answer = (WorkStage.FAILED, str(error))
    except MemoryError:
        answer = (WorkStage.FAILED, "there is not enough memory for it")
    except Exception as error:
        answer = (WorkStage.FAILED, f"{type(error).__name__}: {error}")
    with contextlib.suppress(OSError):
        pipe.send(answer)
