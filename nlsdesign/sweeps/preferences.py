"""What is better in an answer of a sweep, and what a point must keep: objects that the user chooses."""

from __future__ import annotations

from abc import ABC, abstractmethod
from dataclasses import dataclass

import numpy as np

from ..foundation.arrays import Array, Mask
from ..foundation.quantity import three_digits, with_unit


@dataclass(frozen=True)
class Preference(ABC):
    """Which values of an answer are better.

    Parameters
    ----------
    answer
        Full name of the column.
    """

    answer: str

    @abstractmethod
    def cost(self, values: Array) -> Array:
        """Return numbers of which the smaller is the better one; not a number stays so.

        Parameters
        ----------
        values
            Of the answer, in SI.
        """

    @abstractmethod
    def words(self, unit: str) -> str:
        """Return the direction as text.

        Parameters
        ----------
        unit
            Of the answer.
        """


@dataclass(frozen=True)
class SmallerIsBetter(Preference):
    """The smaller, the better; minus ten is better than one."""

    def cost(self, values: Array) -> Array:
        """Return the values."""
        return np.asarray(values, dtype=float)

    def words(self, unit: str) -> str:
        """Return the direction as text."""
        return "smaller is better"


@dataclass(frozen=True)
class LargerIsBetter(Preference):
    """The larger, the better."""

    def cost(self, values: Array) -> Array:
        """Return the negative values."""
        return -np.asarray(values, dtype=float)

    def words(self, unit: str) -> str:
        """Return the direction as text."""
        return "larger is better"


@dataclass(frozen=True)
class NearIsBetter(Preference):
    """The nearer to a value, on either side, the better.

    Parameters
    ----------
    value
        Wanted, in SI.
    """

    value: float

    def cost(self, values: Array) -> Array:
        """Return the distances from the value."""
        return np.abs(np.asarray(values, dtype=float) - self.value)

    def words(self, unit: str) -> str:
        """Return the direction as text."""
        return f"nearer to {with_unit(three_digits(self.value), unit or '1')} is better"


@dataclass(frozen=True)
class Requirement(ABC):
    """What an answer must keep, so that a point is no miss.

    Parameters
    ----------
    answer
        Full name of the column.
    value
        In SI.
    """

    answer: str
    value: float

    @abstractmethod
    def kept(self, values: Array) -> Mask:
        """Return which values keep it; one that is not a number does not.

        Parameters
        ----------
        values
            Of the answer, in SI.
        """

    @abstractmethod
    def words(self, unit: str) -> str:
        """Return it as text.

        Parameters
        ----------
        unit
            Of the answer.
        """


@dataclass(frozen=True)
class NotAbove(Requirement):
    """The answer is at most a value."""

    def kept(self, values: Array) -> Mask:
        """Return which values are at most this one."""
        return np.asarray(np.asarray(values, dtype=float) <= self.value)

    def words(self, unit: str) -> str:
        """Return it as text."""
        return f"at most {with_unit(three_digits(self.value), unit or '1')}"


@dataclass(frozen=True)
class NotBelow(Requirement):
    """The answer is at least a value."""

    def kept(self, values: Array) -> Mask:
        """Return which values are at least this one."""
        return np.asarray(np.asarray(values, dtype=float) >= self.value)

    def words(self, unit: str) -> str:
        """Return it as text."""
        return f"at least {with_unit(three_digits(self.value), unit or '1')}"
