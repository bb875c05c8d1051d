"""Processes of this machine, each with a pipe of its own, so that a dead one loses its own chunk only.

The pool of the standard library gives up all that is in flight when one process dies, and does not tell
whose chunk it was; that is why these are our own.
"""

from __future__ import annotations

import contextlib
import multiprocessing
import os
import pickle
import signal
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from dataclasses import dataclass
from multiprocessing.connection import Connection, wait
from typing import Any

from ..errors import ValueRangeError
from ..processes import alone, ready_as_helper, signals_held
from .chunks import Chunk, ChunkLoss, computed, pickled
from .team import Finished, Team


@dataclass(frozen=True)
class Processes:
    """Processes of this machine.

    Parameters
    ----------
    count
        How many; by default one for each core that this process may use.

    Raises
    ------
    ValueRangeError
        If it is less than one.
    """

    count: int | None = None

    def __post_init__(self) -> None:
        if self.count is not None and self.count < 1:
            raise ValueRangeError(f"{self.count} workers", "are none", next_step="give 1 or more")

    @contextmanager
    def team(self, work: Callable[[Any], Any]) -> Iterator[Team]:
        """Yield the processes; they end with the block, and with this process however it ends.

        Parameters
        ----------
        work
            Asked of each point; it is forked where the system can, so it need not be picklable there.
        """
        team = _Team(work, self.count or usable_cores())
        try:
            yield team
        finally:
            team.end()


def usable_cores() -> int:
    """Return the number of cores that this process may use."""
    return len(os.sched_getaffinity(0)) if hasattr(os, "sched_getaffinity") else os.cpu_count() or 1


class _Worker:
    """One process and this end of its pipe."""

    def __init__(self, work: Callable[[Any], Any], others: list[_Worker]) -> None:
        forks = "fork" in multiprocessing.get_all_start_methods()
        context = multiprocessing.get_context("fork" if forks else "spawn")
        # An interrupt between fork and the first line of a worker would be handled as in this program.
        with signals_held():
            self.connection, theirs = context.Pipe()
            inherited = [each.connection for each in (*others, self)] if forks else []
            self.process = context.Process(target=_serve, args=(theirs, work, inherited), daemon=True)  # type: ignore[attr-defined]
            self.process.start()
            theirs.close()
        self.chunk: Chunk | None = None

    def outcome(self) -> list[Any] | ChunkLoss:
        """Return what the worker sent, or how it ended."""
        try:
            if self.connection.poll():
                answers: list[Any] = pickle.loads(self.connection.recv_bytes())
                return answers
        except (EOFError, OSError, pickle.UnpicklingError):
            pass
        self.process.join(5.0)
        return ChunkLoss(_ending(self.process.exitcode))

    def end(self) -> None:
        """End the process, whatever it does."""
        with contextlib.suppress(OSError):
            self.connection.close()
        self.process.kill()
        self.process.join()


def _ending(status: int | None) -> str:
    if status is None or status >= 0:
        return f"its worker process ended by itself, with exit status {status}"
    name = signal.Signals(-status).name if -status in set(signal.Signals) else "of no name"
    why = ": killed, often because memory ran out" if -status == signal.SIGKILL else ""
    return f"its worker process was ended by signal {-status} ({name}){why}"


def _serve(connection: Connection, work: Callable[[Any], Any], inherited: list[Connection]) -> None:
    ready_as_helper()
    for each in inherited:
        each.close()
    with contextlib.suppress(EOFError, OSError), alone():
        while True:
            connection.send_bytes(pickled(computed(work, connection.recv())))


class _Team:
    def __init__(self, work: Callable[[Any], Any], count: int) -> None:
        self._work, self._count = work, count
        self._idle: list[_Worker] = []
        self._busy: list[_Worker] = []

    def free(self) -> int:
        return self._count - len(self._busy)

    def workers(self) -> int:
        return self._count

    def submit(self, chunk: Chunk) -> None:
        while True:
            worker = self._idle.pop() if self._idle else self._new()
            try:
                worker.connection.send(chunk)
            except OSError:  # it was killed while it had nothing to do
                worker.end()
                continue
            worker.chunk = chunk
            self._busy.append(worker)
            return

    def _new(self) -> _Worker:
        return _Worker(self._work, [*self._idle, *self._busy])

    def finished(self, seconds: float) -> list[Finished]:
        ends: list[Any] = [end for each in self._busy for end in (each.connection, each.process.sentinel)]
        ready = set(wait(ends, seconds))
        finished: list[Finished] = []
        for worker in [w for w in self._busy if {w.connection, w.process.sentinel} & ready]:
            outcome, chunk = worker.outcome(), worker.chunk
            assert chunk is not None
            self._busy.remove(worker)
            if isinstance(outcome, ChunkLoss):
                worker.end()
            else:
                self._idle.append(worker)
            finished.append((chunk, outcome))
        return finished

    def end(self) -> None:
        with signals_held():
            for worker in (*self._idle, *self._busy):
                worker.end()
            self._idle, self._busy = [], []
