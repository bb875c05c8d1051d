"""What a reading of a sensor can be: beyond it a controller does not use the reading."""

from __future__ import annotations

import math
from dataclasses import dataclass

from ..foundation.errors import ValueRangeError


@dataclass(frozen=True)
class Plausibility:
    """How fast a measured input can change, and how long it can stay the same.

    The range in which a reading can lie is ``minimum`` to ``maximum`` of its variable. An input without
    plausibility is a command: outside its range it is taken at the limit.

    Parameters
    ----------
    largest_rate
        Largest rate of the measured quantity, in its unit per second.
    resolution
        Change from sample to sample that is always possible, such as two counts, in the unit.
    stale_time
        Time in s after which a reading that has not changed at all counts as stale, if meanwhile what moves
        the machine has changed.
    moved_by
        Name of the input or state that moves the machine, for instance the current of its motor; ``None``
        where that is not known: then a reading is stale after the time in any case.
    noticeable
        Change of ``moved_by`` that a working sensor cannot fail to show.

    Raises
    ------
    ValueRangeError
        If a number is not positive; only the resolution may be zero.
    """

    largest_rate: float = math.inf
    resolution: float = 0.0
    stale_time: float = math.inf
    moved_by: str | None = None
    noticeable: float = 0.0

    def __post_init__(self) -> None:
        small = 0.0 <= self.resolution < math.inf and 0.0 <= self.noticeable < math.inf
        if not (self.largest_rate > 0.0 and self.stale_time > 0.0 and small):
            rule = "needs a positive rate and time; resolution and noticeable change must not be negative"
            raise ValueRangeError(f"{self}", rule)
