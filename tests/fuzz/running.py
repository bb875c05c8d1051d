"""Cases in worker processes, with a limit of time and memory for each."""

from __future__ import annotations

import contextlib
import json
import os
import resource
import select
import shutil
import signal
import sys
import tempfile
import time
from collections.abc import Callable, Iterable, Iterator
from pathlib import Path

from .cases import Case, Family, Outcome, judged_by, mixed

MEMORY = 6 * 2**30
"""Bytes of address space of a worker: a case that asks for more gets a MemoryError."""


def outcome_of(family: Family, case: Case) -> Outcome:
    """Return the outcome of a case in this process, in a folder of its own."""
    with tempfile.TemporaryDirectory(prefix="fuzz-case-") as name:
        folder = Path(name)
        case.written(folder)
        return judged_by(lambda: family.judged(case, folder))


def outcomes(
    family: Family, cases: Callable[[int], Case], numbers: Iterable[int]
) -> Iterator[tuple[int, Outcome]]:
    """Yield number and outcome of each case; a worker that dies or takes too long is replaced."""
    left = list(numbers)
    while left:
        answered = 0
        for number, outcome in _one_worker(family, cases, left):
            answered += 1
            yield number, outcome
        left = left[answered:]


def _one_worker(
    family: Family, cases: Callable[[int], Case], numbers: list[int]
) -> Iterator[tuple[int, Outcome]]:
    """Yield outcomes until one worker has done all, has died, or was ended because a case took too long."""
    sys.stdout.flush()
    scratch = tempfile.mkdtemp(prefix="fuzz-worker-")
    ours, theirs = os.pipe()
    process = os.fork()
    if process == 0:
        os.close(ours)
        _work(family, cases, numbers, theirs, scratch)
    os.close(theirs)
    done = 0
    try:
        with os.fdopen(ours, "rb", buffering=0) as stream:
            for line in _lines(stream, family.limit):
                yield numbers[done], Outcome(*json.loads(line))
                done += 1
                if done == len(numbers):
                    break
    except TimeoutError:
        kind = "still at work" if getattr(family, "patient", False) else "too long"
        yield numbers[done], Outcome(kind, f"over {family.limit:g} s")
        return
    finally:
        with contextlib.suppress(ProcessLookupError):
            os.killpg(process, signal.SIGKILL)
        _, status = os.waitpid(process, 0)
        shutil.rmtree(scratch, ignore_errors=True)
    if done < len(numbers):
        yield numbers[done], Outcome("crashed", f"wait status {status}")


def _lines(stream: object, limit: float) -> Iterator[bytes]:
    """Yield lines of an unbuffered stream; raise where the next one does not come in time."""
    text, number = b"", stream.fileno()  # type: ignore[attr-defined]
    until = time.monotonic() + limit
    while True:
        ready, _, _ = select.select([number], [], [], max(0.0, until - time.monotonic()))
        if not ready:
            raise TimeoutError
        piece = os.read(number, 65536)
        if not piece:
            return
        text += piece
        while b"\n" in text:
            line, _, text = text.partition(b"\n")
            yield line
            until = time.monotonic() + limit


def _work(family: Family, cases: Callable[[int], Case], numbers: list[int], pipe: int, scratch: str) -> None:
    try:
        os.setpgid(0, 0)
        resource.setrlimit(resource.RLIMIT_AS, (MEMORY, MEMORY))
        resource.setrlimit(resource.RLIMIT_CORE, (0, 0))
        tempfile.tempdir = os.environ["TMPDIR"] = scratch
        nothing = os.open(os.devnull, os.O_RDWR)
        for descriptor in (0, 1, 2):
            os.dup2(nothing, descriptor)
        for number in numbers:
            os.write(pipe, json.dumps(outcome_of(family, cases(number))).encode() + b"\n")
    finally:
        os._exit(0)


def shrunk(family: Family, case: Case, outcome: Outcome, seconds: float = 20.0) -> Case:
    """Return a smaller case with the same outcome: pieces of its files are left out as long as it stays."""
    until = time.monotonic() + seconds
    for name, content in list(case.files.items()):
        if not name.endswith((".toml", ".csv")):
            continue
        share = 2
        while share <= 64 and time.monotonic() < until:
            lines = content.splitlines(keepends=True)
            size = max(1, len(lines) // share)
            smaller = None
            for start in range(0, len(lines), size):
                kept = b"".join(lines[:start] + lines[start + size :])
                attempt = Case({**case.files, name: kept}, case.words, case.how)
                ((_, again),) = outcomes(family, lambda _, one=attempt: one, [0])
                if again == outcome:
                    smaller = attempt
                    break
                if time.monotonic() > until:
                    break
            if smaller is None:
                share *= 2
            else:
                case, content = smaller, smaller.files[name]
    return case


def made_by(family: Family, seed: int) -> Callable[[int], Case]:
    """Return the function from number to case for a seed."""
    return lambda number: family.made(mixed(seed, number), number)
