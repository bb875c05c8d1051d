"""The decision rule: what is open, what an effect must show to be named, and which of several is named.

Everything here is a function of numbers. For each block and record they are sums of squared residuals in
units of the noise floor, *predicted*: with numbers that come from other pieces of the records, see
:mod:`.cross_validation`. Records with the role ``held_out`` are not among them. The *excess* of a block is
what its sum has beyond the number of residuals, which is what noise alone would leave. The rule in prose is
``docs/decision.md``.

An effect may be named if
 1. it explains a share of the excess that is left in some open block, and more than noise explains;
 2. that gain in prediction does not rest on a single piece of a record;
 3. its numbers exclude "no effect", are known, and stand off the bounds of their search, and it does not
    drive declared numbers out of their ranges;
 4. no record is predicted worse than without it, and records left out as a whole are predicted better.
Of several such effects the one that predicts best is taken, unless a simpler one predicts about as well.

Probability that a name is right, calibrated on cases with known answers.

    ln(p/(1 − p)) = a + b·ln(r) + c·m,   r = (left by the best other name + n)/(left by the named + n)

with what the rivals leave of the excess, the noise margin n, and m = 1 where nothing is left beyond the noise
(Platt 1999: a logistic curve through scores). What the records cannot tell apart shares the probability.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass, field, fields
from typing import Any, Generic, TypeVar

from .measures import DECLARED, Excess, Excesses, Gain, Standing, explained, gain, total_excess


def _criterion(default: float, meaning: str) -> Any:
    return field(default=default, metadata={"meaning": meaning})


@dataclass(frozen=True)
class Criteria:
    """The numbers of the decision rule; every verdict repeats them.

    They were set on the simulated bench of ``tests/rig``, seeds 200 to 299, and on the labelled practice
    records, see ``docs/decision.md``; the meaning of each stands in its field and in ``verdict.json``.
    """

    least_excess: float = _criterion(
        0.4, "mean square above the noise floor that is let pass: the floor is known no better"
    )
    significant: float = _criterion(
        5.0,
        "standard deviations of a mean square of noise, in effective samples, from which a block is open",
    )
    prior_per_number: float = _criterion(
        3.0,
        "squared departure of refitted numbers in standard deviations of their spread, at most, for each "
        "that noise alone gives: one a number, more where noise is coloured",
    )
    least_share: float = _criterion(
        0.5, "share of the excess that is left in an open block which an effect must explain"
    )
    noise_margin: float = _criterion(
        25.0,
        "gain in prediction, in effective squares of the noise, that is more than noise or a fit's end gives",
    )
    exclusion: float = _criterion(
        4.0, "standard errors by which the numbers of an effect must exclude the value without effect"
    )
    widest: float = _criterion(
        1.0,
        "largest standard error of a number on the fitted scale: natural logarithm, or tenths of the range",
    )
    worse: float = _criterion(
        0.25,
        "share by which an effect may let the squares of a record grow, besides the noise margin",
    )
    strain: float = _criterion(
        2.0,
        "times by which an effect may let squared departures of declared numbers grow beyond their ranges",
    )
    richer: float = _criterion(
        2.0,
        "a simpler effect is taken if it leaves at most so many times what its richer form leaves",
    )
    equal: float = _criterion(
        1.25, "effects that leave at most so many times the least excess are equally good"
    )
    most_effects: int = _criterion(
        3, "effects that are looked for: a fourth would rest on what three inexact forms leave over"
    )
    inexact: float = _criterion(
        0.05, "share of the excess of a block that the inexact form of a named effect may leave in it"
    )
    stands_out: float = _criterion(
        1.5, "where a block stays open, every other name must leave at least so many times as much"
    )
    closed_share: float = _criterion(
        0.75, "share of the excess of a block that all effects in it together must explain for a name"
    )

    def described(self) -> list[dict[str, Any]]:
        """Return name, value and meaning of each criterion, for reports."""
        return [
            {"name": f.name, "value": getattr(self, f.name), "meaning": f.metadata["meaning"]}
            for f in fields(self)
        ]


def is_beyond_noise(
    criteria: Criteria, mean_square: float, effective_size: float, known_from: float = math.inf
) -> bool:
    """Tell whether a mean square in units of the noise floor is more than noise.

    The floor is a mean square itself; the ratio of two scatters by what both do.

    Parameters
    ----------
    criteria
        Of the rule.
    mean_square
        Of the residuals of a block.
    effective_size
        How many independent residuals these are equivalent to.
    known_from
        How many independent squares of noise the floor is known from.
    """
    scatter = criteria.significant * math.sqrt(2.0 / max(effective_size, 1.0) + 2.0 / max(known_from, 1.0))
    return mean_square > 1.0 + max(criteria.least_excess, scatter)


def is_beyond_prior(criteria: Criteria, squares: float, expected: float) -> bool:
    """Tell whether refitted numbers lie outside their declared ranges, taken together.

    Parameters
    ----------
    criteria
        Of the rule.
    squares
        Sum of squared departures in standard deviations of the prior.
    expected
        What noise alone gives: one for each number, more where the noise is coloured.
    """
    return squares > criteria.prior_per_number * expected


def is_more_than_noise(criteria: Criteria, gained: Gain) -> bool:
    """Tell whether a gain in prediction is more than noise gives, and does not rest on a single piece.

    Parameters
    ----------
    criteria
        Of the rule.
    gained
        From one hypothesis to another.
    """
    return gained.rest >= criteria.noise_margin


def predicts_records(criteria: Criteria, before: Excesses, after: Excesses) -> bool:
    """Tell whether whole records are predicted better with an effect, its numbers fitted to the others.

    Parameters
    ----------
    criteria
        Of the rule.
    before, after
        Of the hypotheses without and with the effect, each record with the numbers of the others. Nothing is
        asked where only declared numbers are open.
    """
    if not any(one.open for name, one in before.items() if name != DECLARED):
        return True
    return gain(before, after).value >= criteria.noise_margin


def records_made_worse(criteria: Criteria, before: Excesses, after: Excesses) -> dict[str, float]:
    """Return the records that are predicted worse than before, with the factor by which their squares grow.

    Parameters
    ----------
    criteria
        Of the rule.
    before, after
        Of the hypotheses without and with an effect.
    """
    squares = {"before": dict[str, float](), "after": dict[str, float](), "margin": dict[str, float]()}
    for name, one in before.items():
        for record, pieces in one.pieces.items():
            for when, value in (
                ("before", sum(pieces)),
                ("after", sum(after[name].pieces[record])),
                ("margin", criteria.noise_margin * after[name].colour),
            ):
                squares[when][record] = squares[when].get(record, 0.0) + value
    then, now = squares["before"], squares["after"]
    return {
        record: now[record] / max(then[record], 1e-300)
        for record in then
        if now[record] > (1.0 + criteria.worse) * then[record] + squares["margin"][record]
    }


def unexplained(criteria: Criteria, first: Excesses, last: Excesses) -> list[str]:
    """Return the blocks that were open and of whose excess too little is accounted for.

    Declared numbers that stay far from their values are no objection where a block was open: they are
    mentioned in ``where``.

    Parameters
    ----------
    criteria
        Of the rule.
    first, last
        Of the refitted declared model and of the last hypothesis.
    """
    shares = explained(first, last)
    if len(shares) > 1:
        shares.pop(DECLARED, None)
    return [n for n, share in shares.items() if last[n].open and share < criteria.closed_share]


def stands_out(criteria: Criteria, distance: float) -> bool:
    """Tell whether an effect explains so much more than any other that it is one, although much is left.

    Parameters
    ----------
    criteria
        Of the rule.
    distance
        How many times as much the best other name leaves, natural logarithm.
    """
    return distance >= math.log(criteria.stands_out)


def is_far_from_closed(criteria: Criteria, first: Excess, now: Excess) -> bool:
    """Tell whether a block has more left than an inexact form of a named effect leaves.

    Parameters
    ----------
    criteria
        Of the rule.
    first, now
        What the refitted declared model leaves, and what the present hypothesis leaves.
    """
    return now.excess > criteria.inexact * first.excess


def is_complete(last: Excesses) -> bool:
    """Tell whether nothing is left beyond the noise in any block.

    Parameters
    ----------
    last
        Of the last hypothesis.
    """
    return not any(each.open for name, each in last.items() if name != DECLARED)


def lacking(now: Excesses) -> list[str]:
    """Return the blocks that are open, the largest excess first; declared numbers only where no block is.

    Parameters
    ----------
    now
        Of the present hypothesis.
    """
    names = [n for n, e in now.items() if e.open]
    blocks = sorted((n for n in names if n != DECLARED), key=lambda n: -now[n].excess)
    return blocks or names


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
        How many numbers it and what it is added to have brought.
    excesses
        What it leaves.
    standing
        What the fitted numbers say.
    simpler
        Effects of which it is a richer form.
    """

    hypothesis: T
    effect: str
    numbers: int
    excesses: Excesses
    standing: Standing = field(default_factory=Standing)
    simpler: tuple[str, ...] = ()


def left_by(rival: Rival[T], block: str) -> float:
    """Return the excess that a rival leaves in a block.

    Parameters
    ----------
    rival
        Of several.
    block
        Name.
    """
    return rival.excesses[block].excess


def is_undecided(criteria: Criteria, before: Excesses, rival: Rival[T]) -> bool:
    """Tell whether an effect explains what is left, but the records do not determine its numbers.

    Parameters
    ----------
    criteria
        Of the rule.
    before
        Of the hypothesis without the effect.
    rival
        With it.
    """
    explains = max(explained(before, rival.excesses).values(), default=0.0) >= criteria.closed_share
    unknown = objections_of_numbers(criteria, rival.standing)
    return explains and bool(unknown) and list(objections(criteria, before, rival)) == unknown


def objections(criteria: Criteria, before: Excesses, rival: Rival[T]) -> tuple[str, ...]:
    """Return in words why an effect may not be named; nothing if it may.

    Parameters
    ----------
    criteria
        Of the rule.
    before
        Of the hypothesis without the effect.
    rival
        With it.
    """
    words, after = [], rival.excesses
    shares = explained(before, after)
    best = max(shares.values(), default=0.0)
    gained = gain(before, after)
    if best < criteria.least_share or total_excess(after) >= total_excess(before):
        words.append(
            f"it explains {100.0 * max(best, 0.0):.0f} % of what is left, "
            f"less than {100.0 * criteria.least_share:.0f} %"
        )
    if not all(name == DECLARED for name in shares) and not is_more_than_noise(criteria, gained):
        words.append(
            f"without its best piece of a record the prediction gains {gained.rest:.3g} squares of the noise"
        )
    words += _strained(criteria, before, after)
    return (*words, *objections_of_numbers(criteria, rival.standing), *_worse(criteria, before, after))


def _strained(criteria: Criteria, before: Excesses, after: Excesses) -> list[str]:
    """Return in words whether an effect drives declared numbers out of their ranges: it is another, then."""
    now = after.get(DECLARED)
    if now is None or not now.open:
        return []
    least = max(before[DECLARED].chi2, criteria.prior_per_number * now.rows)
    if now.chi2 <= criteria.strain * least:
        return []
    return [f"it drives the declared numbers {now.fit:.1f} standard deviations of their spread away"]


def objections_of_numbers(criteria: Criteria, standing: Standing) -> list[str]:
    """Return in words what the numbers of an effect have against it.

    Parameters
    ----------
    criteria
        Of the rule.
    standing
        Of the fitted numbers.
    """
    words = []
    if standing.exclusion < criteria.exclusion:
        words.append(f"its numbers are {standing.exclusion:.1f} standard errors from no effect")
    bounded = [n.name for n in standing.numbers if n.at_bound]
    unknown = [n.name for n in standing.numbers if n.error > criteria.widest and not n.at_bound]
    words += [f"{_listed(bounded)} at a bound of the search"] if bounded else []
    words += [f"{_listed(unknown)} not known"] if unknown else []
    return words


def _listed(names: Sequence[str]) -> str:
    more = f" and {len(names) - 1} more are" if len(names) > 1 else " is"
    return f"{names[0]}{more}"


def _worse(criteria: Criteria, before: Excesses, after: Excesses) -> list[str]:
    worse = records_made_worse(criteria, before, after)
    return [f"record '{r}' is predicted worse, {f:.2g} times the squares" for r, f in sorted(worse.items())]


def is_superfluous(criteria: Criteria, without: Excesses, with_it: Excesses) -> bool:
    """Tell whether the hypothesis without an effect predicts about as well as that with it.

    Parameters
    ----------
    criteria
        Of the rule.
    without, with_it
        Of the two hypotheses.
    """
    if not is_more_than_noise(criteria, gain(without, with_it)):
        return True
    return total_excess(without) <= criteria.richer * total_excess(with_it)


@dataclass(frozen=True, eq=False)
class Choice(Generic[T]):
    """The rival that is taken, and those that the records cannot tell from it, one for each effect."""

    taken: Rival[T]
    equals: tuple[Rival[T], ...]


def choose(criteria: Criteria, before: Excesses, rivals: Sequence[Rival[T]], block: str) -> Choice[T] | None:
    """Return the simplest of the rivals that predict a block about as well as the best, and may be named.

    Parameters
    ----------
    criteria
        Of the rule.
    before
        Of the hypothesis that all rivals add to.
    rivals
        In the order of the catalogue.
    block
        Where something is lacking.

    Returns
    -------
    Choice or None
        Nothing where none of them may be named.
    """

    def left(rival: Rival[T]) -> float:
        after = rival.excesses.items()
        spoilt = sum(max(0.0, e.excess - before[n].excess) for n, e in after if n != block)
        return left_by(rival, block) + spoilt

    able = [rival for rival in rivals if not objections(criteria, before, rival)]
    able = [rival for rival in able if explained(before, rival.excesses).get(block, 0.0) > 0.0] or able
    if not able:
        return None
    best = min(able, key=left)

    def is_near(rival: Rival[T]) -> bool:
        """Tell whether a rival predicts about as well as the best: within noise, or in proportion.

        What it gains in another block does not make up for what it leaves in this one.
        """
        here, there = ({block: each.excesses[block]} for each in (rival, best))
        gains = gain(here, there), gain(rival.excesses, best.excesses)
        within = not any(is_more_than_noise(criteria, each) for each in gains)
        nested = rival.effect in best.simpler
        return within or left(rival) <= (criteria.richer if nested else criteria.equal) * left(best)

    near = [rival for rival in able if is_near(rival)]
    simplest = min(rival.numbers for rival in near)
    alike = dict[str, Rival[T]]()
    for rival in reversed(near):
        # Of several forms or places of one effect the best is told.
        if rival.numbers == simplest and left(rival) <= left(alike.get(rival.effect, rival)):
            alike[rival.effect] = rival
    # Among what cannot be told apart the order of the catalogue decides, not the last digits of a fit.
    taken = alike.pop(next(reversed(alike)))
    unknown = [rival for rival in rivals if is_undecided(criteria, before, rival)]
    if any(imitates(criteria, taken, rival, block) for rival in unknown):
        return None
    return Choice(taken, tuple(alike.values()))


def imitates(criteria: Criteria, taken: Rival[T], other: Rival[T], block: str) -> bool:
    """Tell whether an effect only imitates another, whose numbers are not known but that explains far more.

    What it leaves shows that it is the other one.

    Parameters
    ----------
    criteria
        Of the rule.
    taken
        Effect that may be named.
    other
        Effect that may not, because of its numbers alone.
    block
        Where something is lacking.
    """
    here, there = ({block: each.excesses[block]} for each in (taken, other))
    less = criteria.richer * left_by(other, block) < left_by(taken, block)
    return less and is_more_than_noise(criteria, gain(here, there))


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
        """Return the probability that a name is right.

        Parameters
        ----------
        distance
            ln(r).
        complete
            Whether nothing is left beyond the noise.
        """
        score = self.offset + self.distance * distance + self.complete * complete
        return min(self.most, 1.0 / (1.0 + math.exp(-score)))


CALIBRATION = Calibration()


def distance_to_next(criteria: Criteria, choice: Choice[T], rivals: Sequence[Rival[T]], block: str) -> float:
    """Return ln(r): how many times as much the best other name leaves as the one that is taken.

    Parameters
    ----------
    criteria
        Of the rule.
    choice
        What is taken, and what cannot be told from it.
    rivals
        All that were compared.
    block
        Where something was lacking.
    """
    names = {choice.taken.effect, *(each.effect for each in choice.equals), *choice.taken.simpler}
    # A form that contains it is no other name for what is there.
    forms = {rival.effect for rival in rivals if choice.taken.effect in rival.simpler}
    others = [left_by(rival, block) for rival in rivals if rival.effect not in names | forms]
    margin = criteria.noise_margin
    own = left_by(choice.taken, block)
    return math.log((min(others) + margin) / (own + margin)) if others else 0.0
