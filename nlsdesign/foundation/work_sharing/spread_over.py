"""The maps within one computation spread over an executor: starts of a design, refits, causes."""

from __future__ import annotations

import pickle
from collections.abc import Callable, Iterator
from contextlib import closing, contextmanager
from dataclasses import dataclass
from typing import Any

from ..errors import WorkSharingError
from ..processes import mapped_by
from .chunks import PointOutcome
from .refusals import sendable
from .shared_map import shared_map
from .team import Executor


@contextmanager
def spread_over(executor: Executor) -> Iterator[None]:
    """Let an executor do what is otherwise mapped over processes of this machine, until the block ends.

    These are the starts of a design, the refits of a diagnosis, the candidates for the next record, the draws
    of a regeneration and the causes of a tolerance analysis. The results are the same. Each map sends what it
    works on once, and begins with a connection, so this pays where a single result takes long. What a
    diagnosis works on cannot be sent: it takes processes of this machine, or its sets of records are the
    points of a sweep.

    Parameters
    ----------
    executor
        For instance :class:`DaskScheduler`.

    Raises
    ------
    WorkSharingError
        Within the block, if the work cannot be sent to the workers or they come to no result.

    Examples
    --------
    >>> from nlsdesign.foundation.processes import parallel_map
    >>> from nlsdesign.foundation.work_sharing import InThisProcess
    >>> with spread_over(InThisProcess()):
    ...     list(parallel_map(abs, 3))
    [0, 1, 2]
    """
    with mapped_by(lambda work, count: _in_order(work, count, executor)):
        yield


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


def _in_order(work: Callable[[int], Any], count: int, executor: Executor) -> Iterator[Any]:
    """Yield the results in order, each as soon as it and all before it are there."""
    waiting: dict[int, PointOutcome] = {}
    following = 0
    with closing(shared_map(_Caller(work), enumerate(range(count)), executor, count=count)) as outcomes:  # type: ignore[type-var]
        for batch in outcomes:
            waiting.update((each.number, each) for each in batch)
            while following in waiting:
                yield _result(waiting.pop(following))
                following += 1


def _result(outcome: PointOutcome) -> Any:
    if outcome.reason:
        raise WorkSharingError(
            f"part {outcome.number + 1} of the work", f"came to no result: {outcome.reason}",
            next_step="look at the workers, or leave the executor out to use this machine",
        )  # fmt: skip
    if isinstance(outcome.value, _Caught):
        raise outcome.value.error
    return outcome.value
