"""What a fuzzed case is, and how its outcome is called."""

from __future__ import annotations

import random
import traceback
from collections.abc import Callable
from dataclasses import dataclass, field
from pathlib import Path
from typing import NamedTuple, Protocol

from nlsdesign.foundation.errors import NlsError, visible

REFUSED, ACCEPTED = "refused", "accepted"
WRONG = ("traceback", "read back differently", "unreadable message", "too long", "crashed", "left over")
"""Outcomes that no case may have."""
_LONGEST_MESSAGE = 6000


class Outcome(NamedTuple):
    """How a case ended; equal details are the same fault."""

    kind: str
    detail: str = ""

    @property
    def wrong(self) -> bool:
        """Whether this is a fault of the project."""
        return self.kind in WRONG


@dataclass(frozen=True)
class Case:
    """Files by name, words of a command line, and what was done to them."""

    files: dict[str, bytes] = field(default_factory=dict)
    words: tuple[str, ...] = ()
    how: str = ""

    @property
    def size(self) -> int:
        return sum(len(content) for content in self.files.values()) + sum(len(word) for word in self.words)

    def written(self, folder: Path) -> None:
        for name, content in self.files.items():
            place = folder / name
            place.parent.mkdir(parents=True, exist_ok=True)
            place.write_bytes(content)


class Family(Protocol):
    """One kind of cases; ``made`` depends on seed and number alone."""

    limit: float

    def made(self, random: random.Random, number: int) -> Case: ...

    def judged(self, case: Case, folder: Path) -> Outcome: ...


def judged_by(use: Callable[[], Outcome]) -> Outcome:
    """Return how a use ends: what it says itself, a clear error, or a traceback."""
    try:
        return use()
    except NlsError as error:
        return _judged_message(str(error))
    except Exception as error:
        return Outcome("traceback", signature(error))


def _judged_message(text: str) -> Outcome:
    if visible(text) != text:
        return Outcome("unreadable message", f"holds control characters: {_kind_of(text)}")
    if len(text) > _LONGEST_MESSAGE:
        return Outcome("unreadable message", f"is too long: {_kind_of(text)}")
    return Outcome(REFUSED, "")


def _kind_of(text: str) -> str:
    """Return the rule of a message, without names and numbers, so that equal faults are one."""
    return "".join(c for c in text[-200:] if c.isalpha() or c == " ")[-60:]


def signature(error: BaseException) -> str:
    """Return type, and the last place in the project, of an error."""
    frames = traceback.extract_tb(error.__traceback__)
    own = [f for f in frames if "nlsdesign" in f.filename or "/models/" in f.filename]
    last = (own or frames)[-1]
    text = " ".join(str(error).split())[:80]
    name = last.filename.rpartition("nlsdesign/")[2]
    return f"{type(error).__name__} at {name}:{last.lineno} in {last.name}: {text if not own else ''}".rstrip(
        ": "
    )


def mixed(seed: int, number: int) -> random.Random:
    """Return the chance of one case."""
    return random.Random(seed * 1_000_003 + number)
