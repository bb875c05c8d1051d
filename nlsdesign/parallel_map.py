"""Independent pieces of work on all cores, with results in order, the same as one after the other."""

from __future__ import annotations

import ctypes
import multiprocessing
import os
import signal
import sys
from collections.abc import Callable, Iterator
from typing import Any, TypeVar

T = TypeVar("T")

_MOST = 4
_DEATH_SIGNAL = 1
"""PR_SET_PDEATHSIG of Linux."""
_work: Callable[[int], Any] | None = None


def parallel_map(work: Callable[[int], T], count: int) -> Iterator[T]:
    """Yield ``work(0)`` to ``work(count - 1)``, in order.

    Processes are forked, so that they see everything that the work refers to without copying it; only results
    travel. Where there is no fork, or one core, or this is such a process itself, the work is done here.

    Parameters
    ----------
    work
        Must raise nothing but what may end everything; its results must pickle.
    count
        Number of pieces.
    """
    global _work
    cores = min(_MOST, count, len(os.sched_getaffinity(0)) if hasattr(os, "sched_getaffinity") else 1)
    if cores < 2 or multiprocessing.current_process().daemon:
        yield from map(work, range(count))
        return
    _work = work
    with multiprocessing.get_context("fork").Pool(cores, initializer=_quiet) as pool:
        yield from pool.imap(_piece, range(count))


def _quiet() -> None:
    """Leave an interruption to the process that waits, and end with it, however it ends."""
    signal.signal(signal.SIGINT, signal.SIG_IGN)
    if sys.platform == "linux":
        ctypes.CDLL(None).prctl(_DEATH_SIGNAL, signal.SIGTERM)


def _piece(number: int) -> Any:
    assert _work is not None
    return _work(number)
