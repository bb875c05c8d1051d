"""What every executor offers: a team of workers that takes chunks and gives back outcomes or losses."""

from __future__ import annotations

from collections.abc import Callable
from contextlib import AbstractContextManager
from typing import Any, Protocol

from .chunks import Chunk, ChunkLoss, PointOutcome

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
        """Return workers for one function; they end with the block.

        Parameters
        ----------
        work
            Asked of each point.
        """
        ...
