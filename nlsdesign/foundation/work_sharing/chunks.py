"""Chunks of points, and what a worker does with one: each point is answered, and a failure is an answer."""

from __future__ import annotations

import functools
import os
import pickle
import socket
import threading
import time
import traceback
from collections.abc import Callable
from dataclasses import dataclass
from typing import Any, Final

from ..errors import NlsError
from ..processes import alone
from .identity import CodeIdentity, own_identity

_LONGEST_REASON: Final = 500
_one_at_a_time = threading.Lock()
"""Symbolic expressions are not safe among threads, so a worker with several computes one chunk at a time."""


@dataclass(frozen=True)
class Chunk:
    """Points that one worker computes in one go.

    Parameters
    ----------
    points
        Pairs of number and point.
    """

    points: tuple[tuple[int, Any], ...]


@dataclass(frozen=True)
class PointOutcome:
    """What came of one point.

    Parameters
    ----------
    number
        Of the point.
    value
        Answer; ``None`` where it failed.
    reason
        Why it failed; empty where it did not.
    seconds
        That it took.
    worker
        Machine and process that computed it.
    """

    number: int
    value: Any
    reason: str = ""
    seconds: float = 0.0
    worker: str = ""


@dataclass(frozen=True)
class ChunkLoss:
    """A chunk that came to no end.

    Parameters
    ----------
    reason
        What became of its worker.
    deaths
        Of workers that computed it; 0 where only the connection was lost.
    """

    reason: str
    deaths: int = 1


@dataclass(frozen=True)
class WorkerRefusal:
    """A worker whose code is another one."""

    worker: str
    identity: CodeIdentity


def here() -> str:
    """Return the name of this machine and the number of this process."""
    return f"{socket.gethostname()}:{os.getpid()}"


def computed(work: Callable[[Any], Any], chunk: Chunk) -> list[PointOutcome]:
    """Return the outcomes of a chunk; whatever a point raises is its reason."""
    worker = here()
    outcomes = []
    for number, point in chunk.points:
        begin = time.perf_counter()
        value, reason = None, ""
        try:
            value = work(point)
        except KeyboardInterrupt:
            raise
        except BaseException as error:  # a user's function may even leave by SystemExit
            reason = reason_of(error)
        outcomes.append(PointOutcome(number, value, reason, time.perf_counter() - begin, worker))
    return outcomes


def reason_of(error: BaseException) -> str:
    """Return why a point failed: the message of our errors, and kind, message and line of any other."""
    text = " ".join(str(error).split())
    if not isinstance(error, NlsError):
        last = traceback.extract_tb(error.__traceback__)[-1:]
        where = f" ({os.path.basename(last[0].filename)}, line {last[0].lineno})" if last else ""
        text = f"{type(error).__name__}: {text}{where}" if text else f"{type(error).__name__}{where}"
    return text if len(text) <= _LONGEST_REASON else f"{text[: _LONGEST_REASON - 3]}..."


def pickled(outcomes: list[PointOutcome]) -> bytes:
    """Return outcomes as bytes; where an answer cannot be pickled, that is why its point failed."""
    try:
        return pickle.dumps(outcomes, pickle.HIGHEST_PROTOCOL)
    except Exception:
        return pickle.dumps([_picklable(each) for each in outcomes], pickle.HIGHEST_PROTOCOL)


def _picklable(outcome: PointOutcome) -> PointOutcome:
    try:
        pickle.dumps(outcome.value)
    except Exception as error:
        reason = f"the answer cannot be sent back: {reason_of(error)}"
        return PointOutcome(outcome.number, None, reason, outcome.seconds, outcome.worker)
    return outcome


@functools.lru_cache(maxsize=4)
def _unpickled(payload: bytes) -> Callable[[Any], Any]:
    work: Callable[[Any], Any] = pickle.loads(payload)
    return work


def computed_elsewhere(payload: bytes, chunk: Chunk, expected: CodeIdentity) -> bytes | WorkerRefusal:
    """Return the outcomes of a chunk from a process that may run other code."""
    own = own_identity()
    if own != expected:
        return WorkerRefusal(here(), own)
    with _one_at_a_time, alone():
        return pickled(computed(_unpickled(payload), chunk))
