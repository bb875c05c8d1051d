"""One function asked of many points by a team of workers; outcomes as they come, and no point lost.

Points are taken from their source only when a worker is free, in chunks that take about the same time
whatever a point costs. A chunk that is lost with its worker is tried again point by point; a point that
ends workers twice on its own is recorded as failed. :func:`parallel_map` gives the results of one computation
in order by the same engine.
"""

from __future__ import annotations

import os
import pickle
import time
from collections import deque
from collections.abc import Callable, Iterable, Iterator
from contextlib import closing, contextmanager
from dataclasses import dataclass
from itertools import islice
from typing import Any, Final, TypeVar

from ..errors import WorkSharingError
from .chunks import Chunk, ChunkLoss, PointOutcome, is_worker, sendable
from .teams import Executor, Processes, Team, usable_cores

T = TypeVar("T")

_MOST_DEATHS: Final = 2
_TICK: Final = 0.5
"""Seconds after which the caller gets to do something even if nothing has come."""
_GROWTH: Final = 4
_LARGEST: Final = 4096


@dataclass(frozen=True)
class ChunkSizes:
    """How many points make a chunk."""

    # seconds: that a chunk is to take: short against what may be lost, long against what a message costs
    seconds: float = 1.0
    largest: int = _LARGEST  # most points of a chunk


def shared_map(
    work: Callable[[Any], Any],
    points: Iterable[tuple[int, Any]],
    executor: Executor,
    *,
    count: int | None = None,
    sizes: ChunkSizes | None = None,
    without_workers: Callable[[float], None] | None = None,
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
    without_workers
        Called before each list with the seconds for which no worker has been there, zero where one is.

    Raises
    ------
    WorkSharingError
        If workers run other code, or their scheduler is not there or does not come back.
    """
    with executor.team(work) as team:
        queue = _Queue(iter(points), sizes or ChunkSizes(), count)
        flying, last_seen = 0, time.monotonic()
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
            if without_workers is not None:
                now = time.monotonic()
                last_seen = now if team.workers() else last_seen
                without_workers(now - last_seen)
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


_MOST_PROCESSES: Final = 4
_executor: Executor | None = None
"""Of the innermost :func:`spread_over`."""


def parallel_map(work: Callable[[int], T], count: int) -> Iterator[T]:
    """Yield ``work(0)`` to ``work(count - 1)``, in order; the results do not depend on who computes them.

    Processes of this machine do it, one for each core and at most four. They are forked, so that they see all
    data of the work without copying; only results are pickled. Without fork, on one core, or in a worker the
    work is done in this process.

    Parameters
    ----------
    work
        An exception in it is raised here and ends the map. Its results must be picklable.
    count
        Number of results.

    Raises
    ------
    WorkSharingError
        If workers end over a piece of the work, or :func:`spread_over` names an executor that cannot do it.
    """
    executor = _executor or Processes(min(_MOST_PROCESSES, usable_cores()))
    if isinstance(executor, Processes):
        can_fork = hasattr(os, "sched_getaffinity")
        executor = Processes(max(1, min(count, executor.count or usable_cores())) if can_fork else 1)
    if executor == Processes(1) or is_worker():
        yield from map(work, range(count))
        return
    waiting: dict[int, PointOutcome] = {}
    following = 0
    points = enumerate(range(count))
    one_by_one = ChunkSizes(largest=1)
    with closing(shared_map(_Caller(work), points, executor, count=count, sizes=one_by_one)) as outcomes:  # type: ignore[type-var]
        for batch in outcomes:
            waiting.update((outcome.number, outcome) for outcome in batch)
            while following in waiting:
                outcome = waiting.pop(following)
                if outcome.reason:
                    raise WorkSharingError(
                        f"part {outcome.number + 1} of the work", f"came to no result: {outcome.reason}",
                        next_step="look at the memory of the workers, or let this process do the work "
                        "(--workers 1)",
                    )  # fmt: skip
                if isinstance(outcome.value, _Caught):
                    raise outcome.value.error
                yield outcome.value
                following += 1


@contextmanager
def spread_over(executor: Executor) -> Iterator[None]:
    """Let an executor do the work of :func:`parallel_map` until the block ends.

    That are the starts of a design, the refits of a diagnosis, the candidates for the next record, the draws
    of a regeneration and the causes of a tolerance analysis. The results are the same. Each map sends what it
    works on once, and begins with a connection, so this pays where a single result takes long. What a
    diagnosis works on cannot be sent: it takes processes of this machine, or its sets of records are the
    points of a sweep.

    Parameters
    ----------
    executor
        For instance :class:`DaskScheduler`. With ``Processes(1)`` this process does the work.

    Raises
    ------
    WorkSharingError
        Within the block, if the work cannot be sent to the workers or they come to no result.

    Examples
    --------
    >>> from nlsdesign.foundation.work_sharing import InThisProcess, parallel_map
    >>> with spread_over(InThisProcess()):
    ...     list(parallel_map(abs, 3))
    [0, 1, 2]
    """
    global _executor
    before, _executor = _executor, executor
    try:
        yield
    finally:
        _executor = before


@dataclass(frozen=True)
class _Caught:
    """What a call raised, so that it is raised here with its own kind."""

    error: Exception


@dataclass(frozen=True)
class _Caller:
    """Work whose exceptions come back as they are, not as the reason of a failure."""

    work: Callable[[int], Any]

    def __call__(self, number: int) -> Any:
        try:
            return self.work(number)
        except Exception as error:
            return _Caught(error)

    def __reduce__(self) -> tuple[Any, ...]:
        # Expressions that the work holds share nodes, which CasADi sends only within a context of its own.
        import casadi

        try:
            with casadi.global_pickle_context():
                return _received, (sendable(self.work),)
        except WorkSharingError as error:
            raise WorkSharingError(
                error.thing, error.rule,
                next_step="spread it over Processes, or make what differs the points of a sweep",
            ) from None  # fmt: skip


def _received(content: bytes) -> _Caller:
    import casadi

    with casadi.global_unpickle_context():
        return _Caller(pickle.loads(content))
