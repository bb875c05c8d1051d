"""Parallel map over processes, with results in order and independent of the number of processes."""

from __future__ import annotations

import contextlib
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
    # An interrupt between fork and the first line of a helper would end that helper, and the pool would wait
    # for it for ever. So none is delivered until all helpers ignore it, nor while they are ended.
    with _interrupts_held():
        pool = multiprocessing.get_context("fork").Pool(cores, initializer=_ignore_interrupts)
    try:
        yield from pool.imap(_call, range(count))
    finally:
        with _interrupts_held():
            pool.terminate()
            pool.join()


@contextlib.contextmanager
def _interrupts_held() -> Iterator[None]:
    """Hold interrupts back until the end of the block, where they are delivered."""
    before = signal.pthread_sigmask(signal.SIG_BLOCK, {signal.SIGINT})
    try:
        yield
    finally:
        signal.pthread_sigmask(signal.SIG_SETMASK, before)


def _ignore_interrupts() -> None:
    """Let the parent handle interruptions, and end when the parent ends."""
    signal.signal(signal.SIGINT, signal.SIG_IGN)
    if sys.platform == "linux":
        ctypes.CDLL(None).prctl(_DEATH_SIGNAL, signal.SIGTERM)


def _call(number: int) -> Any:
    assert _work is not None
    return _work(number)
