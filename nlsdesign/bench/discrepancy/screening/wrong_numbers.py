"""Declared numbers that the records contradict: let go, they explain what is left.

A refit stops at twice the declared range. Where a number stands there and something is left over, the number
may have been declared wrongly, alone or beside a missing effect. It is then fitted as if nothing were known
of it, and that is kept only if the numbers end far outside their declared ranges and explain enough.
"""

from __future__ import annotations

import math

from ....foundation.errors import ConvergenceError
from ....foundation.quantity import with_unit
from ..selection.comparison import Comparison
from ..selection.criteria import Criteria, is_complete, is_more_than_noise, objections_of_numbers
from ..selection.excess import excesses
from ..selection.hypothesis import Hypothesis
from ..selection.measures import DECLARED, Excesses, gain
from ..selection.standing import standing_of

AT_END = 3.4
"""Prior standard deviations at which a refit is stopped: twice the declared range is 3.46."""
_OUTSIDE = 2.0
"""Declared ranges from the declared value beyond which a number was declared wrongly; a refit stops there."""
_CERTAIN = 2.0
"""Standard errors by which it must lie beyond."""


def with_numbers_let_go(
    comparison: Comparison, hypothesis: Hypothesis, criteria: Criteria
) -> Hypothesis | None:
    """Return a hypothesis with the numbers let go at whose ends a refit was stopped, if they explain enough.

    Result: refitted; nothing where no block is open or no number stands at its end, where letting go explains
    less than an effect would have to, or where the numbers end near their declared ranges.
    """
    stuck, every = stuck_numbers(hypothesis), excesses(hypothesis, comparison.bench, criteria)
    if not stuck or is_complete(every):
        return None
    try:
        free = comparison.polished(hypothesis, released=stuck)
    except ConvergenceError:
        return None  # numbers without a response explain nothing; the hypothesis stays as it is
    before, after = _blocks(every), _blocks(excesses(free, comparison.bench, criteria))
    left, now = (sum(e.excess for e in each.values()) for each in (before, after))
    if now > (1.0 - criteria.least_share) * left or not is_more_than_noise(criteria, gain(before, after)):
        return None
    stands = [
        not objections_of_numbers(criteria, standing_of(c.unknowns, free.fits.values())) for c in free.added
    ]
    return free if all(stands) and wrong_numbers(free) else None


def stuck_numbers(hypothesis: Hypothesis) -> list[str]:
    """Return the names of the positive declared numbers that stand at the end of what their spread allows."""
    scores = {n: z for f in hypothesis.fits.values() for n, z in f.prior_z_scores().items()}
    return [n for n in positive_numbers(hypothesis) if abs(scores.get(n, 0.0)) >= AT_END]


def positive_numbers(hypothesis: Hypothesis) -> list[str]:
    """Return the names of the fitted numbers that are positive by nature."""
    return [p.name for f in hypothesis.fits.values() for p in f.parameters if p.scale == "log"]


def wrong_numbers(hypothesis: Hypothesis) -> list[str]:
    """Return in words the numbers that were let go and lie outside what their declared spread allows."""
    words = []
    for fit in hypothesis.fits.values():
        for p in fit.parameters:
            if p.name not in hypothesis.released:
                continue
            width = math.log1p(hypothesis.assembly.quantities()[p.name.partition("[")[0]].spread)
            moved, error = math.log(fit.values[p.name] / p.centre), fit.standard_error(p.name)
            if abs(moved) - _CERTAIN * error / fit.values[p.name] <= _OUTSIDE * width:
                continue
            numbers = [with_unit(f"{each:.4g}", p.unit) for each in (p.centre, fit.values[p.name])]
            words.append(
                f"{p.name} is declared as {numbers[0]}, but the records say {numbers[1]}, "
                f"{abs(moved) / width:.1f} declared spreads away"
            )
    return words


def is_explained_by_numbers(
    criteria: Criteria, before: Excesses, with_effects: Excesses, with_numbers: Excesses
) -> bool:
    """Tell whether numbers let go explain plainly more than effects do, although not all.

    What is left may be as little as the inexact form of an effect may leave: a bench has friction that sticks
    or counts that round, which leave a trace whatever the numbers are. A wrong number that explains all but
    that is no reason to name an effect that explains less.
    """
    first, effects, numbers = (
        sum(each.excess for each in _blocks(every).values()) for every in (before, with_effects, with_numbers)
    )
    return numbers <= criteria.inexact * first and criteria.richer * numbers < effects


def _blocks(every: Excesses) -> Excesses:
    return {name: each for name, each in every.items() if name != DECLARED}


def sentence_of(hypothesis: Hypothesis) -> str:
    """Return one sentence on the wrong numbers of a hypothesis; empty where there are none."""
    words = wrong_numbers(hypothesis)
    return f"a declared number is probably wrong: {'; '.join(words)}" if words else ""
