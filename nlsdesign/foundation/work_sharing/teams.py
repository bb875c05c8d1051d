"""What every executor offers, and the two that need no library: this process, and processes of this machine.

A team of workers takes chunks and gives back outcomes or losses. Each process has a pipe of its own, so
that a dead one loses its own chunk only.

Ranks of MPI as workers, and any executor of the standard library's kind.
"""

from __future__ import annotations

import concurrent.futures
import contextlib
import multiprocessing
import os
import pickle
import signal
from collections.abc import Callable, Iterator
from contextlib import AbstractContextManager, contextmanager
from dataclasses import dataclass
from multiprocessing.connection import Connection, wait
from typing import Any, Protocol

from ..errors import ValueRangeError, WorkSharingError, missing_library
from ..processes import ready_as_helper, signals_held
from .chunks import (
    Chunk,
    ChunkLoss,
    PointOutcome,
    WorkerRefusal,
    alone,
    computed,
    computed_elsewhere,
    outcomes_in,
    own_identity,
    pickled,
    reason_of,
    sendable,
)

Finished = tuple[Chunk, list[PointOutcome] | ChunkLoss]


class Team(Protocol):
    """Workers that stand ready for one function."""

    def free(self) -> int:
        """Return how many more chunks can be given now."""
        ...

    def workers(self) -> int:
        """Return the number of workers."""
        ...

    def submit(self, chunk: Chunk) -> None:
        """Give one chunk to a worker."""
        ...

    def finished(self, seconds: float) -> list[Finished]:
        """Return what has come to an end; an empty list after that time."""
        ...


class Executor(Protocol):
    """Where work is done; chosen by the caller."""

    def team(self, work: Callable[[Any], Any]) -> AbstractContextManager[Team]:
        """Return workers for one function; they end with the block."""
        ...


@dataclass(frozen=True)
class InThisProcess:
    """No worker but this process; what a point breaks here ends the whole work."""

    @contextmanager
    def team(self, work: Callable[[Any], Any]) -> Iterator[Team]:
        """Yield this process as the one worker.

        Parameters
        ----------
        work
            Asked of each point.
        """
        yield _Itself(work)


class _Itself:
    def __init__(self, work: Callable[[Any], Any]) -> None:
        self._work = work
        self._waiting: list[Chunk] = []

    def free(self) -> int:
        return 1 - len(self._waiting)

    def workers(self) -> int:
        return 1

    def submit(self, chunk: Chunk) -> None:
        self._waiting.append(chunk)

    def finished(self, seconds: float) -> list[Finished]:
        del seconds
        chunks, self._waiting = self._waiting, []
        return [(chunk, computed(self._work, chunk)) for chunk in chunks]


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
            given = (theirs, work, inherited, os.getpid())
            self.process = context.Process(target=_serve, args=given, daemon=True)  # type: ignore[attr-defined]
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


def _serve(
    connection: Connection, work: Callable[[Any], Any], inherited: list[Connection], parent: int
) -> None:
    ready_as_helper(parent)
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
            worker = self._idle.pop() if self._idle else _Worker(self._work, [*self._idle, *self._busy])
            try:
                worker.connection.send(chunk)
            except OSError:  # it was killed while it had nothing to do
                worker.end()
                continue
            worker.chunk = chunk
            self._busy.append(worker)
            return

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


@dataclass(frozen=True)
class MpiRanks:
    """Ranks of ``mpiexec -n RANKS python -m mpi4py.futures -m nlsdesign sweep ... --mpi``; one drives.

    MPI ends all ranks when one dies, so a death ends the run; the next one resumes.
    """

    @contextmanager
    def team(self, work: Callable[[Any], Any]) -> Iterator[Team]:
        """Yield the other ranks; ``work`` is pickled."""
        try:
            from mpi4py import futures
        except ModuleNotFoundError:
            raise missing_library("work over MPI", "mpi4py", "mpi") from None
        with futures.MPIPoolExecutor() as pool:
            ranks = int(pool.num_workers)
            if ranks < 1:
                raise WorkSharingError(
                    "MPI", "has no rank beside the one that drives",
                    next_step="start it with: mpiexec -n 3 python -m mpi4py.futures -m nlsdesign sweep ...",
                )  # fmt: skip
            yield FuturesTeam(pool, work, ranks)


class FuturesTeam:
    """Workers behind an executor of ``concurrent.futures``."""

    def __init__(self, pool: concurrent.futures.Executor, work: Callable[[Any], Any], count: int) -> None:
        self._pool, self._count = pool, count
        self._payload = sendable(work)
        self._flying: dict[concurrent.futures.Future[bytes | WorkerRefusal], Chunk] = {}

    def free(self) -> int:
        """Return how many more chunks can be given now: one waits at each worker."""
        return 2 * self._count - len(self._flying)

    def workers(self) -> int:
        """Return the number of workers."""
        return self._count

    def submit(self, chunk: Chunk) -> None:
        """Give one chunk to the executor."""
        expected = own_identity()
        self._flying[self._pool.submit(computed_elsewhere, self._payload, chunk, expected)] = chunk

    def finished(self, seconds: float) -> list[Finished]:
        """Return what has come to an end."""
        ended, _ = concurrent.futures.wait(
            self._flying, seconds, return_when=concurrent.futures.FIRST_COMPLETED
        )
        return [(self._flying.pop(each), _outcome(each)) for each in ended]


def _outcome(future: concurrent.futures.Future[bytes | WorkerRefusal]) -> list[Any] | ChunkLoss:
    try:
        answer = future.result()
    except concurrent.futures.BrokenExecutor as error:
        raise WorkSharingError(
            "workers", f"are gone: {reason_of(error)}", next_step="run the same command again: it resumes"
        ) from None
    return outcomes_in(answer)
