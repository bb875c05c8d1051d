"""Sizes in which starts and bounds of effects are counted: of signals, efforts and times in the records."""

from __future__ import annotations

import re
from collections.abc import Iterator, Mapping

QUICKEST = "quickest motion"
"""Time in s in which the quickest measured motion changes by its own size: 1/ω of a sine."""
LONGEST = "longest record"
"""Duration in s."""
MIDDLE = "middle of the longest record"
"""Time in s from its beginning: what grows with time is there as large as it is on average."""
SHIFT = "shift of channels"
"""Time in s by which two channels may be shifted against each other: half a sample of each."""


def efforts_on(body: str) -> str:
    """Return the name of the largest effort on a body: of a tie, of its drive, or of its inertia."""
    return f"efforts on {body}"


def span_of(motion: str) -> str:
    """Return the name of the distance between both ends of a measured motion."""
    return f"span of {motion}"


class Sizes(Mapping[str, float]):
    """The largest value of each signal on the records, and products and quotients of them.

    ``"piece.force * piece.extension"`` is asked for as units are written; a name may be the number 1. An
    element that an edit has put inside another keeps its size: of ``"spring.slack.rubber.force"`` the size is
    that of ``"spring.rubber.force"`` where only that was declared.

    Examples
    --------
    >>> sizes = Sizes({"spring.rubber.force": 8.0, "spring.rubber.extension": 0.02, LONGEST: 10.0})
    >>> sizes["spring.slack.rubber.force / spring.rubber.extension"], sizes["1 / longest record"]
    (400.0, 0.1)
    """

    def __init__(self, known: Mapping[str, float]) -> None:
        self._known = dict(known)

    def __getitem__(self, name: str) -> float:
        """Return a size; ``KeyError`` if one of its factors is not known."""
        factors = re.split(r" ([*/]) ", name)
        size = self._one(factors[0])
        for sign, factor in zip(factors[1::2], factors[2::2], strict=True):
            size = size * self._one(factor) if sign == "*" else size / self._one(factor)
        return size

    def __iter__(self) -> Iterator[str]:
        """Iterate over the names of single sizes."""
        return iter(self._known)

    def __len__(self) -> int:
        """Return the number of single sizes."""
        return len(self._known)

    def _one(self, name: str) -> float:
        if name == "1":
            return 1.0
        if name in self._known:
            return self._known[name]
        wanted = name.split(".")
        without = (n for n in self._known if n.count(".") < len(wanted) - 1 and _within(n.split("."), wanted))
        nearest = max(without, key=lambda n: n.count("."), default=None)
        if nearest is None:
            raise KeyError(name)
        return self._known[nearest]


def _within(path: list[str], longer: list[str]) -> bool:
    """Tell whether a path is a longer one without some of its inner names."""
    if (path[0], path[-1]) != (longer[0], longer[-1]):
        return False
    rest = iter(longer)
    return all(name in rest for name in path)
