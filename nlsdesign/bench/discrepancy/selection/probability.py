"""Probability that a name is right, calibrated on cases with known answers.

    ln(p/(1 − p)) = a + b·ln(r) + c·m,   r = (left by the best other name + n)/(left by the named + n)

with what the rivals leave of the excess, the noise margin n, and m = 1 where nothing is left beyond the noise
(Platt 1999: a logistic curve through scores). What the records cannot tell apart shares the probability.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass
from typing import TypeVar

from .criteria import Choice, Criteria, Rival, left_by

T = TypeVar("T")


@dataclass(frozen=True)
class Calibration:
    """Numbers of the curve, fitted to the calibration seeds of ``docs/decision.md``.

    Parameters
    ----------
    offset, distance, complete
        a, b and c of the module's formula.
    most
        No more is stated: so many cases cannot show that one in a hundred is wrong.
    """

    offset: float = 1.0
    distance: float = 1.05
    complete: float = 1.25
    most: float = 0.99

    def probability(self, distance: float, *, complete: bool) -> float:
        """Return the probability that a name is right."""
        score = self.offset + self.distance * distance + self.complete * complete
        return min(self.most, 1.0 / (1.0 + math.exp(-score)))


CALIBRATION = Calibration()


def distance_to_next(criteria: Criteria, choice: Choice[T], rivals: Sequence[Rival[T]], block: str) -> float:
    """Return ln(r): how many times as much the best other name leaves as the one that is taken."""
    names = {choice.taken.effect, *(each.effect for each in choice.equals), *choice.taken.simpler}
    # A form that contains it is no other name for what is there.
    forms = {rival.effect for rival in rivals if choice.taken.effect in rival.simpler}
    others = [left_by(rival, block) for rival in rivals if rival.effect not in names | forms]
    margin = criteria.noise_margin
    own = left_by(choice.taken, block)
    return math.log((min(others) + margin) / (own + margin)) if others else 0.0
