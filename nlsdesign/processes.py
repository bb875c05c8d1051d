"""Parallel map over processes, with results in order and independent of the number of processes."""

from __future__ import annotations

import ctypes
import multiprocessing
import os
import signal
import sys
from collections.abc import Callable, Iterator
from typing import Any, TypeVar

T = TypeVar("T")

_MOST_PROCESSES = 4
_DEATH_SIGNAL = 1
"""PR_SET_PDEATHSIG of Linux."""
_work: Callable[[int], Any] | None = None


def parallel_map(work: Callable[[int], T], count: int) -> Iterator[T]:
    """Yield ``work(0)`` to ``work(count - 1)``, in order.

    Processes are forked, so that they see all data of the work without copying; only results are pickled.
    Without fork, on one core, or inside such a process, the work is done in this process.

    Parameters
    ----------
    work
        An exception in it ends the whole map; its results must be picklable.
    count
        Number of calls.
    """
    global _work
    cores = min(
        _MOST_PROCESSES, count, len(os.sched_getaffinity(0)) if hasattr(os, "sched_getaffinity") else 1
    )
    if cores < 2 or multiprocessing.current_process().daemon:
        yield from map(work, range(count))
        return
    _work = work
    with multiprocessing.get_context("fork").Pool(cores, initializer=_ignore_interrupts) as pool:
        yield from pool.imap(_call, range(count))


def _ignore_interrupts() -> None:
    """Let the parent handle interruptions, and end when the parent ends."""
    signal.signal(signal.SIGINT, signal.SIG_IGN)
    if sys.platform == "linux":
        ctypes.CDLL(None).prctl(_DEATH_SIGNAL, signal.SIGTERM)


def _call(number: int) -> Any:
    assert _work is not None
    return _work(number)
