"""What an integrator does while a limit holds back what it asks for."""

from __future__ import annotations

from abc import ABC, abstractmethod
from dataclasses import dataclass
from typing import NamedTuple

from ....foundation.errors import ValueRangeError
from ....foundation.symbolic import Expression
from .law_writer import LawWriter


class Integration(NamedTuple):
    """One integrator of a controller at one sample.

    Parameters
    ----------
    name
        Own name of the loop that it belongs to, for settings: ``torque`` or ``velocity``.
    value
        What the integrator holds.
    error
        What it integrates, before its gain; its sign is that of the growth.
    rate
        Error times gain: growth per second.
    beyond
        By how much what it asks for exceeds each limit behind it; positive at the upper limit.
    nearest
        The excess over the nearest limit in the unit of the integrator, for back-calculation.
    """

    name: str
    value: Expression
    error: Expression
    rate: Expression
    beyond: tuple[Expression, ...]
    nearest: Expression


class AntiWindup(ABC):
    """How integrators are kept from winding up behind a limit."""

    @abstractmethod
    def following(self, writer: LawWriter, one: Integration) -> Expression:
        """Return what the integrator holds one sample later.

        Parameters
        ----------
        writer
            Of the controller.
        one
            The integrator.
        """


@dataclass(frozen=True)
class ConditionalIntegration(AntiWindup):
    """The integrator stands still while it pushes further into a limit, and only then.

    Source: Åström and Hägglund 2006 (conditional integration).
    """

    def following(self, writer: LawWriter, one: Integration) -> Expression:
        """Return x + T·ẋ, or x while error and excess have the same sign."""
        free = one.error * one.beyond[0] <= 0
        for beyond in one.beyond[1:]:
            free = free * (one.error * beyond <= 0)
        return one.value + writer.sample_time * one.rate * free


@dataclass(frozen=True)
class BackCalculation(AntiWindup):
    """The integrator is led back by the excess over the limit: ẋ = K·e − excess/T_t.

    Source: Åström and Hägglund 2006.

    Parameters
    ----------
    tracking_time
        T_t in s: after so long 63 % of what is beyond the limit is given up. Not below the sample time.

    Raises
    ------
    ValueRangeError
        If the time is not positive.
    """

    tracking_time: float = 0.02

    def __post_init__(self) -> None:
        if not 0.0 < self.tracking_time < float("inf"):
            raise ValueRangeError(f"tracking_time {self.tracking_time:g} s", "must be positive and finite")

    def following(self, writer: LawWriter, one: Integration) -> Expression:
        """Return x + T·(ẋ − excess/T_t).

        Raises
        ------
        ValueRangeError
            If the tracking time is below the sample time.
        """
        if self.tracking_time < writer.sample_time:
            raise ValueRangeError(
                f"tracking_time {self.tracking_time:g} s",
                f"is below the sample time of {writer.sample_time:g} s, so the integrator would overshoot",
                next_step="take a few sample times at least",
            )
        time = writer.setting(
            f"{one.name}_tracking_time", "s", f"{one.name} loop: time in which an excess is given up",
            self.tracking_time,
        )  # fmt: skip
        return one.value + writer.sample_time * (one.rate - one.nearest / time)
