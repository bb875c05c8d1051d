"""Work done in this process, one point after the other."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from contextlib import contextmanager
from dataclasses import dataclass
from typing import Any

from .chunks import Chunk, computed
from .team import Finished, Team


@dataclass(frozen=True)
class InThisProcess:
    """No worker but this process; what a point breaks here ends the whole work."""

    @contextmanager
    def team(self, work: Callable[[Any], Any]) -> Iterator[Team]:
        """Yield this process as the one worker.

        Parameters
        ----------
        work
            Asked of each point.
        """
        yield _Itself(work)


class _Itself:
    def __init__(self, work: Callable[[Any], Any]) -> None:
        self._work = work
        self._waiting: list[Chunk] = []

    def free(self) -> int:
        return 1 - len(self._waiting)

    def workers(self) -> int:
        return 1

    def submit(self, chunk: Chunk) -> None:
        self._waiting.append(chunk)

    def finished(self, seconds: float) -> list[Finished]:
        del seconds
        chunks, self._waiting = self._waiting, []
        return [(chunk, computed(self._work, chunk)) for chunk in chunks]
