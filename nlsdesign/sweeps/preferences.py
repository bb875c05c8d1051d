"""What is better in an answer of a sweep, what a point must keep, and the order of the points."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass

import numpy as np

from ..foundation.arrays import Array, Indices, Mask
from ..foundation.errors import ValueRangeError, unknown_name
from ..foundation.quantity import three_digits, with_unit


@dataclass(frozen=True)
class Preference:
    """Which values of an answer are better: the smaller, the larger, or those near a value.

    Parameters
    ----------
    answer
        Full name of the column.
    sign
        1 where the smaller, −1 where the larger is the better; minus ten is smaller than one.
    value
        In SI: the nearer to it, on either side, the better; ``None`` for no such value.
    """

    answer: str
    sign: float
    value: float | None = None

    @classmethod
    def smaller(cls, answer: str) -> Preference:
        """The smaller, the better.

        Parameters
        ----------
        answer
            Full name of the column.
        """
        return cls(answer, 1.0)

    @classmethod
    def larger(cls, answer: str) -> Preference:
        """The larger, the better.

        Parameters
        ----------
        answer
            Full name of the column.
        """
        return cls(answer, -1.0)

    @classmethod
    def near(cls, answer: str, value: float) -> Preference:
        """The nearer to a value, on either side, the better.

        Parameters
        ----------
        answer
            Full name of the column.
        value
            In SI.
        """
        return cls(answer, 1.0, value)

    def cost(self, values: Array) -> Array:
        """Return numbers of which the smaller is the better one; not a number stays so.

        Parameters
        ----------
        values
            Answers in SI.
        """
        given = np.asarray(values, dtype=float)
        return self.sign * given if self.value is None else np.abs(given - self.value)

    def words(self, unit: str) -> str:
        """Return the direction as text.

        Parameters
        ----------
        unit
            Of the answer.
        """
        if self.value is not None:
            return f"nearer to {with_unit(three_digits(self.value), unit or '1')} is better"
        return f"{'smaller' if self.sign > 0.0 else 'larger'} is better"


@dataclass(frozen=True)
class Requirement:
    """What an answer must keep, so that a point is no miss: at most or at least a value.

    Parameters
    ----------
    answer
        Full name of the column.
    value
        In SI.
    sign
        1 where it is the largest, −1 where it is the smallest value that keeps it.
    """

    answer: str
    value: float
    sign: float

    @classmethod
    def at_most(cls, answer: str, value: float) -> Requirement:
        """The answer is at most a value.

        Parameters
        ----------
        answer
            Full name of the column.
        value
            In SI.
        """
        return cls(answer, value, 1.0)

    @classmethod
    def at_least(cls, answer: str, value: float) -> Requirement:
        """The answer is at least a value.

        Parameters
        ----------
        answer, value
            Column by its full name, and number in SI.
        """
        return cls(answer, value, -1.0)

    def kept(self, values: Array) -> Mask:
        """Return which values keep it; one that is not a number does not.

        Parameters
        ----------
        values
            Answers in SI.
        """
        return np.asarray(self.sign * np.asarray(values, dtype=float) <= self.sign * self.value)

    def words(self, unit: str) -> str:
        """Return it as text.

        Parameters
        ----------
        unit
            Of the answer.
        """
        side = "most" if self.sign > 0.0 else "least"
        return f"at {side} {with_unit(three_digits(self.value), unit or '1')}"


@dataclass(frozen=True, eq=False)
class RankedPoints:
    """Which points are on the front, and which do not count."""

    preferences: tuple[Preference, ...]
    requirements: tuple[Requirement, ...]
    failed: Mask  # points without an answer, shape (n,)
    missed: Mask  # points with an answer that does not keep a requirement
    incomplete: Mask  # points that keep all requirements, with an answer to compare that is no finite number
    # front: indices of the points on which no other improves in all preferences, the best in the first one
    # first; empty without preferences
    front: Indices
    misses: tuple[int, ...]  # how many points miss each requirement, in their order

    @property
    def judged(self) -> tuple[str, ...]:
        """Names of the answers with a direction or a requirement, each once."""
        names = [each.answer for each in self.preferences] + [each.answer for each in self.requirements]
        return tuple(dict.fromkeys(names))

    @property
    def compared(self) -> Mask:
        """Points that were compared with one another."""
        return ~(self.failed | self.missed | self.incomplete)


def rank_points(
    answers: Mapping[str, Array],
    done: Mask,
    *,
    preferences: Sequence[Preference] = (),
    requirements: Sequence[Requirement] = (),
) -> RankedPoints:
    """Return on which points no other improves; failures, misses and what is no finite number are set aside.

    ``preferences``: what is better; a point is on the front where no other is at least as good in all and
    better in one.
    """
    named = [each.answer for each in preferences]
    for name in (*named, *(each.answer for each in requirements)):
        if name not in answers:
            raise unknown_name("answer", name, answers)
    for name in named:
        if named.count(name) > 1:
            raise ValueRangeError(f"answer '{name}'", "has two directions", next_step="state one of them")
    done = np.asarray(done, dtype=bool)
    kept = [each.kept(answers[each.answer]) for each in requirements]
    missed = done & ~np.all(kept, axis=0) if kept else np.zeros_like(done)
    costs = (
        np.array([each.cost(answers[each.answer]) for each in preferences]).reshape(len(named), len(done)).T
    )
    whole = np.all(np.isfinite(costs), axis=1) if named else done
    incomplete = done & ~missed & ~whole
    rows = np.flatnonzero(done & ~missed & ~incomplete)
    front = rows[nondominated(costs[rows])] if named else np.zeros(0, dtype=np.intp)
    if len(front):
        front = front[np.lexsort((front, costs[front, 0]))]
    counts = tuple(int(np.sum(done & ~each)) for each in kept)
    return RankedPoints(tuple(preferences), tuple(requirements), ~done, missed, incomplete, front, counts)


def nondominated(costs: Array) -> Indices:
    """Return the rows that no other row betters: at most as large in each column and smaller in one.

    Equal rows are kept together.

    ``costs``: finite numbers, shape (n, k); the smaller, the better.
    """
    unique, places = np.unique(np.asarray(costs, dtype=float), axis=0, return_inverse=True)
    # In the order of the columns a later row never betters an earlier one.
    best = np.empty_like(unique)
    kept: list[int] = []
    for number, row in enumerate(unique):
        if not np.any(np.all(best[: len(kept)] <= row, axis=1)):
            best[len(kept)] = row
            kept.append(number)
    return np.flatnonzero(np.isin(places.ravel(), kept))
