"""One function asked of many points by a team of workers; outcomes as they come, and no point lost.

Points are taken from their source only when a worker is free, in chunks that take about the same time
whatever a point costs. A chunk that is lost with its worker is tried again point by point; a point that ends
workers twice on its own is recorded as failed.
"""

from __future__ import annotations

from collections import deque
from collections.abc import Callable, Iterable, Iterator
from dataclasses import dataclass
from itertools import islice
from typing import Any, Final

from .chunks import Chunk, ChunkLoss, PointOutcome
from .team import Executor, Team

_MOST_DEATHS: Final = 2
_TICK: Final = 0.5
"""Seconds after which the caller gets to do something even if nothing has come."""
_GROWTH: Final = 4
_LARGEST: Final = 4096


@dataclass(frozen=True)
class ChunkSizes:
    """How many points make a chunk.

    Parameters
    ----------
    seconds
        That a chunk is to take: short against what may be lost, long against what a message costs.
    largest
        Most points of a chunk.
    """

    seconds: float = 1.0
    largest: int = _LARGEST


def shared_map(
    work: Callable[[Any], Any],
    points: Iterable[tuple[int, Any]],
    executor: Executor,
    *,
    count: int | None = None,
    sizes: ChunkSizes | None = None,
) -> Iterator[list[PointOutcome]]:
    """Yield the outcomes of all points as they come, in lists; an empty one now and then while none comes.

    Whoever stops taking from it ends the workers.

    Parameters
    ----------
    work
        Picklable pure function of a point.
    points
        Pairs of number and point; taken when a worker is free, never all at once.
    executor
        Where the work is done.
    count
        Number of points where it is known, so that the last chunks are small enough for all workers.
    sizes
        Of chunks.

    Raises
    ------
    WorkSharingError
        If workers run other code, or their scheduler is not there or does not come back.
    """
    with executor.team(work) as team:
        queue = _Queue(iter(points), sizes or ChunkSizes(), count)
        flying = 0
        while True:
            while team.free() > 0 and (chunk := queue.next(team)) is not None:
                team.submit(chunk)
                flying += 1
            if not flying:
                return
            outcomes: list[PointOutcome] = []
            for chunk, outcome in team.finished(_TICK):
                flying -= 1
                if isinstance(outcome, ChunkLoss):
                    outcomes += queue.tried_again(chunk, outcome)
                else:
                    queue.learn(outcome)
                    outcomes += outcome
            yield outcomes


class _Queue:
    """Points that wait, those that are tried again first."""

    def __init__(self, points: Iterator[tuple[int, Any]], sizes: ChunkSizes, count: int | None) -> None:
        self._points, self._sizes, self._left = points, sizes, count
        self._again: deque[Chunk] = deque()
        self._deaths: dict[int, int] = {}
        self._cost: float | None = None
        self._size = 1

    def next(self, team: Team) -> Chunk | None:
        if self._again:
            return self._again.popleft()
        size = self._size
        if self._left is not None:  # the last ones are shared evenly
            size = max(1, min(size, -(-self._left // (2 * max(1, team.workers())))))
        taken = tuple(islice(self._points, size))
        if self._left is not None:
            self._left -= len(taken)
        return Chunk(taken) if taken else None

    def learn(self, outcomes: list[PointOutcome]) -> None:
        """Fit the size of chunks to what points cost."""
        cost = sum(each.seconds for each in outcomes) / len(outcomes)
        self._cost = cost if self._cost is None else 0.7 * self._cost + 0.3 * cost
        fitting = self._sizes.seconds / max(self._cost, 1e-7)
        self._size = max(1, min(int(fitting), self._size * _GROWTH, self._sizes.largest))

    def tried_again(self, chunk: Chunk, loss: ChunkLoss) -> list[PointOutcome]:
        """Put the points of a lost chunk back, each on its own; return those that are given up."""
        if len(chunk.points) > 1 or not loss.deaths:
            # Nobody knows which of several points it was, and a lost connection is no point's fault.
            pieces = [(each,) for each in chunk.points] if loss.deaths else [chunk.points]
            self._again.extend(Chunk(piece) for piece in pieces)
            return []
        number = chunk.points[0][0]
        deaths = self._deaths.get(number, 0) + loss.deaths
        if deaths >= _MOST_DEATHS:
            self._deaths.pop(number, None)
            return [PointOutcome(number, None, f"given up after {deaths} workers: {loss.reason}")]
        self._deaths[number] = deaths
        self._again.append(chunk)
        return []
