"""What an adaptive observer is designed for, and how far it trusts its equations."""

from __future__ import annotations

import math
from dataclasses import dataclass, field

from ....foundation.errors import ValueRangeError
from ....simulation.prior import Prior
from .duty import Duty


@dataclass(frozen=True)
class Trust:
    """How far the filter trusts its equations.

    Parameters
    ----------
    unmodelled
        Torque that the equations miss, one standard deviation, as a share of the torque of the duty.
    correlation_time
        Time in s over which it stays the same.
    drift_time
        Time in s of motion after which the machine may lie anywhere within its spreads again, as rubber
        creeps and warms up. At standstill nothing is forgotten.
    counts
        Standard deviation of the measured angle in units of that of an ideal encoder, quantum/√12.
    limit
        Largest distance of a slow state from the deck, in standard deviations.
    surprise
        Innovation in standard deviations from which on it corrects the slow states no further.
    smallest
        Smallest torque that a slow state moves per standard deviation, as a share of that of the duty.
    most
        Largest number of slow states.

    Raises
    ------
    ValueRangeError
        If a number is not positive.
    """

    unmodelled: float = 0.005
    correlation_time: float = 0.02
    drift_time: float = 60.0
    counts: float = 1.0
    limit: float = 2.5
    surprise: float = 3.0
    smallest: float = 0.0004
    most: int = 12

    def __post_init__(self) -> None:
        for name in (
            "unmodelled",
            "correlation_time",
            "drift_time",
            "counts",
            "limit",
            "surprise",
            "smallest",
            "most",
        ):
            value = getattr(self, name)
            if not (math.isfinite(value) and value > 0):
                raise ValueRangeError(f"{name} {value:g}", "must be positive")


@dataclass(frozen=True, eq=False)
class AdaptiveSettings:
    """What an adaptive observer is designed for.

    Parameters
    ----------
    prior
        What is known of the numbers; the spreads of the deck by default.
    duty
        What the actuator does.
    trust
        How far the equations are trusted.
    """

    prior: Prior | None = None
    duty: Duty = field(default_factory=Duty)
    trust: Trust = field(default_factory=Trust)
