"""Parallel map over processes, with results in order and independent of the number of processes."""

from __future__ import annotations

import contextlib
import ctypes
import multiprocessing
import os
import signal
import subprocess
import sys
from collections.abc import Callable, Iterator, Mapping, Sequence
from typing import TYPE_CHECKING, Any, TypeAlias, TypeVar

if TYPE_CHECKING:
    from multiprocessing.pool import IMapIterator

T = TypeVar("T")
Mapper: TypeAlias = Callable[[Callable[[int], Any], int], Iterator[Any]]
"""Takes what :func:`parallel_map` takes and yields what it yields."""

_MOST_PROCESSES = 4
_LONGEST_WAIT = 0.2
"""Seconds after which a signal is handled at the latest."""
_DEATH_SIGNAL = 1
"""PR_SET_PDEATHSIG of Linux."""
_work: Callable[[int], Any] | None = None
_alone = False
_asked_for: int | None = None
"""Processes that somebody asked for, in place of one for each core and at most :data:`_MOST_PROCESSES`."""
_mapper: Mapper | None = None


def parallel_map(work: Callable[[int], T], count: int) -> Iterator[T]:
    """Yield ``work(0)`` to ``work(count - 1)``, in order.

    Processes are forked, so that they see all data of the work without copying; only results are pickled.
    Without fork, on one core, or inside such a process or a worker of a sweep, the work is done in this
    process. Within :func:`mapped_by` it is done wherever that says.

    ``work``: an exception in it ends the whole map; its results must be picklable.
    """
    global _work
    if _mapper is not None and not _alone and not multiprocessing.current_process().daemon:
        yield from _mapper(work, count)
        return
    can_fork = hasattr(os, "sched_getaffinity")
    usual = min(_MOST_PROCESSES, len(os.sched_getaffinity(0))) if can_fork else 1
    cores = min(count, usual if _asked_for is None or not can_fork else _asked_for)
    if cores < 2 or _alone or multiprocessing.current_process().daemon:
        yield from map(work, range(count))
        return
    _work = work
    # An interrupt between fork and the first line of a helper would end that helper, and the pool would wait
    # for it for ever. A request to end that comes there is lost where this process handles such requests, for
    # after a fork Python forgets what it has not handled. So neither is delivered until helpers are ready.
    with signals_held():
        pool = multiprocessing.get_context("fork").Pool(cores, initializer=ready_as_helper)
    try:
        results = pool.imap(_call, range(count))
        for _ in range(count):
            yield _waited_for(results)
    finally:
        with signals_held():
            pool.terminate()
            pool.join()


def _waited_for(results: IMapIterator[T]) -> T:
    """Return the next result.

    A signal that comes just before a thread begins to wait for a lock does not wake it, and Python handles it
    only when the wait is over. So no wait is long.
    """
    while True:
        try:
            return results.next(timeout=_LONGEST_WAIT)
        except multiprocessing.TimeoutError:
            continue


@contextlib.contextmanager
def alone() -> Iterator[None]:
    """Do the work of :func:`parallel_map` in this process until the end of the block.

    A worker of many computes whole points, and its neighbours have the other cores.
    """
    global _alone
    before, _alone = _alone, True
    try:
        yield
    finally:
        _alone = before


@contextlib.contextmanager
def at_most(processes: int | None) -> Iterator[None]:
    """Let :func:`parallel_map` take so many processes until the end of the block; without fork it takes none.

    ``processes``: at least one, which is this process; ``None`` for the usual number.
    """
    global _asked_for
    before, _asked_for = _asked_for, processes
    try:
        yield
    finally:
        _asked_for = before


@contextlib.contextmanager
def mapped_by(mapper: Mapper) -> Iterator[None]:
    """Let another map do the work of :func:`parallel_map` until the end of the block.

    ``mapper``: takes work and count, and yields the results in order; what the work raises, it raises.
    """
    global _mapper
    before, _mapper = _mapper, mapper
    try:
        yield
    finally:
        _mapper = before


def run_to_end(
    command: Sequence[str], *, environment: Mapping[str, str] | None = None, seconds: float | None = None
) -> subprocess.CompletedProcess[str]:
    """Run a program and return what it printed; an interrupt ends it with all that it has started.

    ``environment``: of the program; this one's without it. ``seconds``: most time that it may take;
    ``subprocess.TimeoutExpired`` is raised beyond it.
    """
    group = None if sys.platform == "win32" else 0
    with signals_held():
        # It inherits that signals are held; a group of its own, which is killed, makes up for that.
        process = subprocess.Popen(
            command, env=environment, stdin=subprocess.DEVNULL, stdout=subprocess.PIPE,
            stderr=subprocess.PIPE, text=True, errors="replace", process_group=group,
        )  # fmt: skip
    try:
        out, errors = process.communicate(timeout=seconds)
    except BaseException:
        with signals_held(), contextlib.suppress(OSError):
            if group is not None:
                os.killpg(process.pid, signal.SIGKILL)
            process.kill()
        with signals_held():
            process.wait()
        raise
    return subprocess.CompletedProcess(command, process.returncode, out, errors)


@contextlib.contextmanager
def signals_held() -> Iterator[None]:
    """Hold interrupts and requests to end back until the end of the block, where they are delivered."""
    before = signal.pthread_sigmask(signal.SIG_BLOCK, {signal.SIGINT, signal.SIGTERM})
    try:
        yield
    finally:
        signal.pthread_sigmask(signal.SIG_SETMASK, before)


def ready_as_helper(at_death_of_parent: signal.Signals = signal.SIGTERM) -> None:
    """Let the parent handle interruptions, and end at once when it asks for it or ends itself."""
    signal.signal(signal.SIGINT, signal.SIG_IGN)
    signal.signal(signal.SIGTERM, signal.SIG_DFL)
    signal.pthread_sigmask(signal.SIG_UNBLOCK, {signal.SIGTERM})
    if sys.platform == "linux":
        ctypes.CDLL(None).prctl(_DEATH_SIGNAL, at_death_of_parent)


def _call(number: int) -> Any:
    assert _work is not None
    return _work(number)
