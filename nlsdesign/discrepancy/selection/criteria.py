"""The decision: what is open, what an effect explains, which effect is taken, and when the search is done.

Everything here is a function of numbers: for each block the sum of squared residuals in units of the noise
floor on fitted and on held-out records, and how many numbers an effect brings. The *excess* of a block is
what that sum has beyond the number of residuals, which is what noise alone would leave.

An effect is added if it explains at least half of the excess of an open block, on the fitted records *and* on
the others, without spoiling the whole. Of several such effects the one with the fewest numbers is taken that
comes close to the best.
"""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import Generic, TypeVar

LEAST_EXCESS = 0.4
"""Mean square above the floor that is let pass: filters and rounding are known no better."""
SIGNIFICANT = 5.0
"""Standard deviations of a mean square of noise beyond which it is open: what noise alone never reaches."""
PRIOR_PER_NUMBER = 3.0
"""Mean squared departure of refitted numbers, in standard deviations of their prior, beyond which the
declared numbers are open: 3 is that of numbers which all stand at the edge of their declared range."""
LEAST_SHARE = 0.5
"""An effect must explain this share of the excess of some open block: less than half is a side of another."""
LEAST_FURTHER = 0.05
"""A further effect must explain this share of what that block lacked at first: forms are never exact."""
CLOSED_SHARE = 0.75
"""A block of which so much is explained counts as named, even if its form is not quite right."""
SAME = 0.02
"""A simpler hypothesis is taken if its excess is more by less than this share of the first excess."""
ALIAS = 0.003
"""Hypotheses whose excess differs by less than this share of the first excess cannot be told apart."""
NOISE_MARGIN = 50.0
"""Sum of squares, in units of the floor, by which equally good fits differ because of noise and of the limits
of a fit; beside the two shares, it counts where the whole excess is small."""
MOST_EFFECTS = 3
"""Effects that are looked for: a fourth would rest on what three inexact forms leave over."""
MOST_EFFECTS_IN_FREE_FLIGHT = 2
"""The same where a body flies freely: a third takes minutes to look for, and rests on less."""

DECLARED = "declared numbers"
"""Name of the block that stands for the declared numbers: refitted numbers should lie in their ranges."""


@dataclass(frozen=True)
class Excess:
    """How far a block is from its noise floor.

    Parameters
    ----------
    block
        Name of the block, or :data:`DECLARED`.
    unit
        Of the residual.
    floor
        Noise floor, root mean square over the records, in the unit.
    fit, held_out
        Root mean square of the residual on the records of each role, in the unit.
    chi2, rows
        Sum of squares in units of the floor, and number of residuals, over fit and held-out records.
    open
        Whether that is more than noise.
    """

    block: str
    unit: str
    floor: float
    fit: float
    held_out: float
    chi2: tuple[float, float]
    rows: tuple[int, int]
    open: bool

    @property
    def excess(self) -> tuple[float, float]:
        """Sum of squares beyond the floor, on fit and held-out records."""
        first, second = (max(0.0, c - n) for c, n in zip(self.chi2, self.rows, strict=True))
        return first, second

    @property
    def mean_square(self) -> float:
        """Mean square over all records in units of the floor."""
        return sum(self.chi2) / max(sum(self.rows), 1)


Excesses = Mapping[str, Excess]
"""By name of the block."""


def is_beyond_noise(mean_square: float, effective_size: float) -> bool:
    """Tell whether a mean square in units of the noise floor is more than noise.

    Parameters
    ----------
    mean_square
        Of the residuals of a block on the records of a role.
    effective_size
        How many independent residuals these are equivalent to.
    """
    return mean_square > 1.0 + max(LEAST_EXCESS, SIGNIFICANT * math.sqrt(2.0 / max(effective_size, 1.0)))


def is_beyond_prior(squares: float, count: int) -> bool:
    """Tell whether refitted numbers lie outside their declared ranges, taken together.

    Parameters
    ----------
    squares
        Sum of squared departures in standard deviations of the prior.
    count
        How many numbers.
    """
    return squares > PRIOR_PER_NUMBER * count


def total_excess(excesses: Excesses) -> float:
    """Return the sum of squares beyond the floor over all blocks and roles.

    Parameters
    ----------
    excesses
        Of one hypothesis.
    """
    return sum(sum(each.excess) for each in excesses.values())


def explained(before: Excesses, after: Excesses) -> dict[str, float]:
    """Return the explained share of each open block's excess: the smaller of fit and held-out records.

    A role on which a block had next to no excess says nothing.

    Parameters
    ----------
    before, after
        Of two hypotheses on the same rows.
    """
    shares = {}
    for name, one in before.items():
        if one.open:
            pairs = zip(one.excess, after[name].excess, one.rows, strict=True)
            shares[name] = min(1.0 - b / a for a, b, n in pairs if n and a > LEAST_EXCESS * n)
    return shares


def is_explained(first: Excesses, last: Excesses) -> bool:
    """Tell whether what was named accounts for every block that was open.

    Declared numbers that stay far from their values are no objection where a block was open: they are
    mentioned in ``where``.

    Parameters
    ----------
    first, last
        Of the refitted declared model and of the last hypothesis.
    """
    shares = explained(first, last)
    if len(shares) > 1:
        shares.pop(DECLARED, None)
    return all(not last[name].open or share >= CLOSED_SHARE for name, share in shares.items())


def most_effects(*, has_free_flight: bool) -> int:
    """Return how many effects are looked for.

    Parameters
    ----------
    has_free_flight
        Whether a body flies freely between contacts, so that predictions are never exact.
    """
    return MOST_EFFECTS_IN_FREE_FLIGHT if has_free_flight else MOST_EFFECTS


def lacking(first: Excesses, now: Excesses, *, has_free_flight: bool) -> list[str]:
    """Return the blocks that lack enough for a further effect to count, the largest excess first.

    Declared numbers that are open count only where no block is.

    Parameters
    ----------
    first, now
        Of the refitted declared model and of the present hypothesis.
    has_free_flight
        Whether a body flies freely in the latter: then what is closed is not searched for more.
    """
    least = 1.0 - CLOSED_SHARE if has_free_flight else LEAST_FURTHER
    names = [n for n, e in now.items() if e.open and sum(e.excess) >= least * sum(first[n].excess)]
    blocks = sorted((n for n in names if n != DECLARED), key=lambda n: -sum(now[n].excess))
    return blocks or names


def helps(first: Excesses, before: Excesses, after: Excesses) -> bool:
    """Tell whether an effect explains enough of some open block without spoiling the whole.

    Parameters
    ----------
    first, before, after
        Of the refitted declared model, of the hypothesis without the effect, and with it.
    """
    if total_excess(after) >= total_excess(before):
        return False
    for name, share in explained(before, after).items():
        gain = sum(before[name].excess) - sum(after[name].excess)
        if share >= LEAST_SHARE and gain >= LEAST_FURTHER * sum(first[name].excess):
            return True
    return False


def best_shares(before: Excesses, after: Excesses) -> tuple[float, float]:
    """Return the share explained on fitted and on held-out records, of the block that gains most.

    Parameters
    ----------
    before, after
        Of the hypotheses without and with an effect.
    """
    shares = explained(before, after)
    if not shares:
        return 0.0, 0.0
    block = max(shares, key=lambda name: shares[name])
    pairs = zip(before[block].excess, after[block].excess, strict=True)
    fitted, held = (1.0 - b / a if a > 0.0 else 1.0 for a, b in pairs)
    return fitted, held


def is_superfluous(first: Excesses, without: Excesses, with_it: Excesses) -> bool:
    """Tell whether the hypothesis without an effect is about as good as that with it.

    Parameters
    ----------
    first, without, with_it
        Of the refitted declared model, and of the two hypotheses.
    """
    return total_excess(without) <= total_excess(with_it) + SAME * total_excess(first) + NOISE_MARGIN


T = TypeVar("T")


@dataclass(frozen=True, eq=False)
class Rival(Generic[T]):
    """A hypothesis among others that each add one effect to the same hypothesis.

    Parameters
    ----------
    hypothesis
        Whatever stands for it.
    effect
        Identifier of the effect it adds.
    numbers
        How many numbers that brings.
    excesses
        What it leaves.
    """

    hypothesis: T
    effect: str
    numbers: int
    excesses: Excesses


@dataclass(frozen=True, eq=False)
class Choice(Generic[T]):
    """The rival that is taken, and those that the records cannot tell from it, one for each effect."""

    taken: Rival[T]
    equals: tuple[Rival[T], ...]


def choose(first: Excesses, before: Excesses, rivals: Sequence[Rival[T]], block: str) -> Choice[T] | None:
    """Return the simplest of the rivals that leave least in a block, without spoiling another.

    Parameters
    ----------
    first, before
        Of the refitted declared model, and of the hypothesis that all rivals add to.
    rivals
        In the order of the catalogue.
    block
        Where something is lacking.

    Returns
    -------
    Choice or None
        Nothing where none of them helps.
    """

    def left(rival: Rival[T]) -> float:
        after = rival.excesses.items()
        spoilt = sum(max(0.0, sum(e.excess) - sum(before[n].excess)) for n, e in after if n != block)
        return sum(rival.excesses[block].excess) + spoilt

    able = [rival for rival in rivals if helps(first, before, rival.excesses)]
    if not able:
        return None
    whole = sum(before[block].excess)
    near = min(left(rival) for rival in able) + SAME * whole + NOISE_MARGIN
    equal = [rival for rival in able if left(rival) <= near]
    best = min(equal, key=lambda rival: (rival.numbers, total_excess(rival.excesses)))
    margin = ALIAS * whole + NOISE_MARGIN
    limit, total_limit = left(best) + margin, total_excess(best.excesses) + margin
    alike = {
        rival.effect: rival
        for rival in reversed(equal)
        if rival.numbers <= best.numbers
        and left(rival) <= limit
        and total_excess(rival.excesses) <= total_limit
    }
    # Among what cannot be told apart the order of the catalogue decides, not the last digits of a fit.
    taken = alike.pop(next(reversed(alike)))
    return Choice(taken, tuple(alike.values()))
