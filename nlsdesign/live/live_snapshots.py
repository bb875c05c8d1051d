"""Designs that are kept under a name, to be shown beside others."""

from __future__ import annotations

from dataclasses import dataclass

from ..foundation.errors import ValueRangeError
from .answers import LiveAnswer
from .question import LiveQuestion

MOST_SNAPSHOTS = 8
"""Designs that are kept side by side."""
_NAME = 60


@dataclass(frozen=True, eq=False)
class Snapshot:
    """A design that was kept under a name."""

    name: str
    question: LiveQuestion
    answer: LiveAnswer


class Snapshots(dict[str, Snapshot]):
    """The designs that are kept, by name."""

    def keep(self, name: str, question: LiveQuestion, answer: LiveAnswer) -> Snapshot:
        """Keep a design under a name; one of that name is replaced."""
        if answer.design is None or answer.stale:
            raise ValueRangeError(
                f"design '{name:.80}'", "is not there: what is shown belongs to an earlier question",
                next_step="widen a limit until there is a design, or take the edit back",
            )  # fmt: skip
        if not 1 <= len(name.strip()) <= _NAME or not name.isprintable():
            raise ValueRangeError(
                f"name of a design '{name:.80}'", f"has 1 to {_NAME} printable characters",
                next_step="take a short name",
            )  # fmt: skip
        if name not in self and len(self) >= MOST_SNAPSHOTS:
            raise ValueRangeError(
                f"{len(self)} designs kept", f"are the most, {MOST_SNAPSHOTS}",
                next_step="drop one of them",
            )  # fmt: skip
        self[name] = Snapshot(name, question, answer)
        return self[name]
