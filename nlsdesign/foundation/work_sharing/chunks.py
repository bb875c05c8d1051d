"""Chunks of points, what a worker does with one, and which code answers.

Each point of a chunk is answered, and a failure is an answer. Work that cannot be sent, and workers that
run other code, are refused.
"""

from __future__ import annotations

import contextlib
import functools
import hashlib
import multiprocessing
import os
import pickle
import socket
import threading
import time
import traceback
from collections.abc import Callable, Iterator, Mapping
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any, Final

from ..errors import NlsError, WorkSharingError
from ..locations import folder, version

_PACKAGE: Final = Path(__file__).resolve().parents[2]
_SHOWING: Final = ("cli", "presentation", "live", "_bundled", "__pycache__")
"""Rooms that show results. No room that computes may import them, so no answer depends on them."""
_SUFFIXES: Final = (".py", ".toml", ".csv", ".json")
_SHOWN_DIGITS: Final = 12


@dataclass(frozen=True)
class CodeIdentity:
    """Version and digest of the code that computes.

    Parameters
    ----------
    version
        Of the package.
    digest
        SHA-256 of its files.
    files
        Digest of each file by its place.
    """

    version: str
    digest: str
    files: Mapping[str, str] = field(default_factory=dict, compare=False, repr=False)

    def __str__(self) -> str:
        return f"nlsdesign {self.version} (code {self.digest[:_SHOWN_DIGITS]})"


@functools.cache
def code_identity(package: Path = _PACKAGE) -> CodeIdentity:
    """Return the identity of the package as it stands on disk, read once in each process."""
    files = dict(_digests(package))
    text = "\n".join(f"{name} {digest}" for name, digest in sorted(files.items()))
    return CodeIdentity(version(package=package), hashlib.sha256(text.encode()).hexdigest(), files)


def own_identity() -> CodeIdentity:
    """Return the identity of this process without its list of files, as a worker is asked for it."""
    self = code_identity()
    return CodeIdentity(self.version, self.digest)


def _digests(package: Path) -> Iterator[tuple[str, str]]:
    models = folder("models", package=package)
    for top, prefix in ((package, "nlsdesign"), (models, "models")):
        for path in sorted(top.rglob("*")):
            inside = path.relative_to(top)
            if path.suffix not in _SUFFIXES or set(inside.parts) & set(_SHOWING):
                continue
            # Decks are part of what is asked; they have a digest of their own.
            if prefix == "models" and inside.parts[0] in ("decks", "templates"):
                continue
            yield f"{prefix}/{inside.as_posix()}", hashlib.sha256(path.read_bytes()).hexdigest()


_LONGEST_REASON: Final = 500
_alone = False
_one_at_a_time = threading.Lock()
"""Symbolic expressions are not safe among threads, so a worker with several computes one chunk at a time."""


@dataclass(frozen=True)
class Chunk:
    """Points that one worker computes in one go."""

    points: tuple[tuple[int, Any], ...]  # pairs of number and point


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
    """A chunk that came to no end."""

    reason: str  # what became of its worker
    deaths: int = 1  # of workers that computed it; 0 where only the connection was lost


@dataclass(frozen=True)
class WorkerRefusal:
    """A worker whose code is another one."""

    worker: str
    identity: CodeIdentity


@contextlib.contextmanager
def alone() -> Iterator[None]:
    """Let this process do maps by itself until the end of the block: other workers have the other cores."""
    global _alone
    before, _alone = _alone, True
    try:
        yield
    finally:
        _alone = before


def is_worker() -> bool:
    """Tell whether this process is a worker, which shares its work with no other."""
    return _alone or multiprocessing.current_process().daemon


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


def refused(refusal: WorkerRefusal) -> WorkSharingError:
    """Return the error for a worker whose code is another one; it names both."""
    return WorkSharingError(
        f"worker {refusal.worker}",
        f"runs {refusal.identity}, and this program {code_identity()}: their answers must not be mixed",
        next_step="install the same version at the workers and here, and start the workers again",
    )


def outcomes_in(answer: bytes | WorkerRefusal) -> list[Any]:
    """Return the outcomes of a chunk that came from elsewhere; those of other code are refused."""
    if isinstance(answer, WorkerRefusal):
        raise refused(answer)
    outcomes: list[Any] = pickle.loads(answer)
    return outcomes


def sendable(work: Callable[[Any], Any]) -> bytes:
    """Return work as bytes for another machine; functions of a script or notebook go with their code."""
    try:
        import cloudpickle as library
    except ModuleNotFoundError:
        library = pickle
    try:
        content: bytes = library.dumps(work, protocol=pickle.HIGHEST_PROTOCOL)
    except WorkSharingError:  # of a part of it, which says more
        raise
    except Exception as error:  # whatever an object answers to being pickled
        raise WorkSharingError(
            "the work", f"cannot be sent to workers: {reason_of(error)}",
            next_step="take a function of a module, without open files, locks or connections",
        ) from None  # fmt: skip
    return content
