"""Ranks of MPI as workers, and any executor of the standard library's kind."""

from __future__ import annotations

import concurrent.futures
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from dataclasses import dataclass
from typing import Any

from ..errors import WorkSharingError, missing_library
from .chunks import (
    Chunk,
    ChunkLoss,
    WorkerRefusal,
    computed_elsewhere,
    outcomes_in,
    own_identity,
    reason_of,
    sendable,
)
from .teams import Finished, Team


@dataclass(frozen=True)
class MpiRanks:
    """Ranks of ``mpiexec -n RANKS python -m mpi4py.futures -m nlsdesign sweep ... --mpi``; one drives.

    MPI ends all ranks when one dies, so a death ends the run; the next one resumes.
    """

    @contextmanager
    def team(self, work: Callable[[Any], Any]) -> Iterator[Team]:
        """Yield the other ranks; ``work`` is pickled.

        Raises
        ------
        MissingLibraryError
            If mpi4py is not installed.
        WorkSharingError
            If there is no other rank.
        """
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
