"""The decision rule: what is open, what an effect must show to be named, and which of several is named.

Everything here is a function of numbers. For each block and record they are sums of squared residuals in
units of the noise floor, *predicted*: with numbers that come from other pieces of the records, see
:mod:`.cross_validation`. Records with the role ``held_out`` are not among them. The *excess* of a block is
what its sum has beyond the number of residuals, which is what noise alone would leave. The rule in prose is
``docs/decision.md``, whose section 2 has these four as its eight clauses.

An effect may be named if
 1. it explains a share of the excess that is left in some open block, and more than noise explains;
 2. that gain in prediction does not rest on a single piece of a record;
 3. its numbers exclude "no effect", are known, and stand off the bounds of their search, and it does not
    drive declared numbers out of their ranges;
 4. no record is predicted worse than without it, unless still to within its noise, and records left out as a
    whole are predicted better.
Of several such effects the one that predicts best is taken, unless a simpler one predicts about as well.

The probability that a name is right is calibrated on cases with known answers:

    ln(p/(1 − p)) = a + b·ln(r) + c·m − d·ln(l),   r = (left by the best other + n)/(left by the named + n)

with what the rivals leave of the excess, the noise margin n, and m = 1 where nothing is left beyond the noise
(Platt 1999: a logistic curve through scores), and l, what is left in the block in multiples of its noise: the
right name may be in no list. What the records cannot tell apart shares the probability.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Sequence
from dataclasses import dataclass, field, fields
from typing import Any, Generic, TypeVar

from .measures import DECLARED, Excess, Excesses, Gain, Standing, common_gains, explained, gain, total_excess


def _criterion(default: float, meaning: str) -> Any:
    return field(default=default, metadata={"meaning": meaning})


@dataclass(frozen=True)
class Criteria:
    """The numbers of the decision rule; every verdict repeats them.

    They were set on the simulated bench of ``tests/rig``, seeds 200 to 289, and on the labelled practice
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
        "largest standard error of a number: as a share of it (1 is 100 %) where it cannot change its sign, "
        "in tenths of its range where it can",
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
        1.2, "where a block stays open, every other name must leave at least so many times as much"
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
        self, mean_square: float, effective_size: float, known_from: float = math.inf
    ) -> bool:
        """Tell whether the mean square of a block, in units of the noise floor, is more than noise.

        The floor is a mean square itself, of the squares that it is known from. The ratio of the
        two scatters by what both do.
        """
        scatter = self.significant * math.sqrt(2.0 / max(effective_size, 1.0) + 2.0 / max(known_from, 1.0))
        return mean_square > 1.0 + max(self.least_excess, scatter)

    def is_beyond_prior(self, squares: float, expected: float) -> bool:
        """Tell whether refitted numbers lie outside their declared spreads, taken together.

        Noise alone gives the expected sum of squares: one for each number, more where the noise is coloured.
        """
        return squares > self.prior_per_number * expected

    def is_more_than_noise(self, gained: Gain) -> bool:
        """Tell whether a gain in prediction is more than noise gives, and does not rest on a single piece."""
        return gained.rest >= self.noise_margin

    def is_outstanding(self, distance: float) -> bool:
        """Tell whether an effect explains so much more than any other that it is one, although much is left.

        The distance is the natural logarithm of how many times as much the best other name leaves.
        """
        return distance >= math.log(self.stands_out)

    def is_far_from_closed(self, first: Excess, now: Excess) -> bool:
        """Tell whether a block has more left than an inexact form of a named effect leaves."""
        return now.excess > self.inexact * first.excess

    def objections_of_numbers(self, standing: Standing) -> list[str]:
        """Return in words what the numbers of an effect have against it."""
        words = []
        if standing.exclusion < self.exclusion:
            words.append(f"its numbers are {standing.exclusion:.1f} standard errors from no effect")
        bounded = [n.name for n in standing.numbers if n.at_bound]
        unknown = [n.name for n in standing.numbers if n.error > self.widest and not n.at_bound]
        words += [f"{_listed(bounded)} at a bound of the search"] if bounded else []
        words += [f"{_listed(unknown)} not known"] if unknown else []
        return words


def _listed(names: Sequence[str]) -> str:
    more = f" and {len(names) - 1} more are" if len(names) > 1 else " is"
    return f"{names[0]}{more}"


@dataclass(frozen=True, eq=False)
class Change:
    """What a hypothesis leaves over, compared with another one on the same rows, as the rule sees it."""

    criteria: Criteria
    before: Excesses
    after: Excesses

    @property
    def gain(self) -> Gain:
        """Gain in prediction over all blocks."""
        return gain(self.before, self.after)

    @property
    def is_more_than_noise(self) -> bool:
        """Whether prediction gains more than noise gives."""
        return self.criteria.is_more_than_noise(self.gain)

    @property
    def shares(self) -> dict[str, float]:
        """Share of the excess of each open block that is explained."""
        return explained(self.before, self.after)

    @property
    def predicts_records(self) -> bool:
        """Whether whole records are predicted better, where each is judged by the numbers of the others.

        Nothing is asked where only declared numbers are open. A record may depend so sharply on the numbers
        that those of the others never predict it. Then the numbers of all records are judged, at what they
        cost the others; that gain must not rest on the record that gains most: the others need not know it.
        """
        if not any(one.open for name, one in self.before.items() if name != DECLARED):
            return True
        if self.gain.value >= self.criteria.noise_margin:
            return True
        gains = common_gains(self.before, self.after)
        return math.fsum(gains) - max(gains, default=0.0) >= self.criteria.noise_margin

    def records_made_worse(self) -> dict[str, float]:
        """Return the records that are predicted worse, with the factor by which their squares grow.

        One that is still predicted to within its noise in every block is not among them.
        """
        then, now, margin = (dict[str, float]() for _ in range(3))
        for name, one in self.before.items():
            for record, pieces in one.pieces.items():
                last = self.after[name]
                then[record] = then.get(record, 0.0) + sum(pieces)
                now[record] = now.get(record, 0.0) + sum(last.pieces[record])
                margin[record] = margin.get(record, 0.0) + self.criteria.noise_margin * last.colour
        return {
            record: now[record] / max(then[record], 1e-300)
            for record in then
            if now[record] > (1.0 + self.criteria.worse) * then[record] + margin[record]
            and not all(record in one.closed_on for one in self.after.values() if record in one.pieces)
        }

    def unexplained(self) -> list[str]:
        """Return the blocks that were open and of whose excess too little is accounted for.

        Declared numbers that stay far from their values are no objection where a block was open: they are
        mentioned in ``where``.
        """
        shares = self.shares
        if len(shares) > 1:
            shares.pop(DECLARED, None)
        return [n for n, share in shares.items() if self.after[n].open and share < self.criteria.closed_share]

    def is_superfluous(self) -> bool:
        """Tell whether the hypothesis without an effect predicts about as well as the one with it."""
        if not self.is_more_than_noise:
            return True
        return total_excess(self.before) <= self.criteria.richer * total_excess(self.after)

    def objections(self, standing: Standing) -> tuple[str, ...]:
        """Return in words why an effect may not be named, by what its numbers say too; nothing if it may."""
        words, shares = [], self.shares
        best, gained = max(shares.values(), default=0.0), self.gain
        if best < self.criteria.least_share or total_excess(self.after) >= total_excess(self.before):
            words.append(
                f"it explains {100.0 * max(best, 0.0):.0f} % of what is left, "
                f"less than {100.0 * self.criteria.least_share:.0f} %"
            )
        only_declared = all(name == DECLARED for name in shares)
        if not only_declared and not self.criteria.is_more_than_noise(gained):
            words.append(
                "without its best piece of a record the prediction gains "
                f"{gained.rest:.3g} squares of the noise"
            )
        words += self._strain()
        words += self.criteria.objections_of_numbers(standing)
        words += [
            f"record '{record}' is predicted worse, {factor:.2g} times the squares"
            for record, factor in sorted(self.records_made_worse().items())
        ]
        return tuple(words)

    def _strain(self) -> list[str]:
        """Return in words that declared numbers leave their ranges: it is another effect, then."""
        now = self.after.get(DECLARED)
        if now is None or not now.open:
            return []
        least = max(self.before[DECLARED].chi2, self.criteria.prior_per_number * now.rows)
        if now.chi2 <= self.criteria.strain * least:
            return []
        return [f"it drives the declared numbers {now.fit:.1f} standard deviations of their spread away"]

    def is_undecided(self, standing: Standing) -> bool:
        """Tell whether an effect explains what is left, but the records do not determine its numbers."""
        explains = max(self.shares.values(), default=0.0) >= self.criteria.closed_share
        unknown = self.criteria.objections_of_numbers(standing)
        return explains and bool(unknown) and list(self.objections(standing)) == unknown


def is_complete(last: Excesses) -> bool:
    """Tell whether nothing is left beyond the noise in any block."""
    return not any(each.open for name, each in last.items() if name != DECLARED)


def lacking(now: Excesses) -> list[str]:
    """Return the blocks that are open, the largest excess first; declared numbers only where no block is."""
    names = [n for n, e in now.items() if e.open]
    blocks = sorted((n for n in names if n != DECLARED), key=lambda n: -now[n].excess)
    return blocks or names


T = TypeVar("T")


@dataclass(frozen=True, eq=False)
class Rival(Generic[T]):
    """A hypothesis among others that each add one effect to the same hypothesis."""

    hypothesis: T  # whatever stands for it
    effect: str  # identifier of the effect it adds
    numbers: int  # how many numbers it and what it is added to have brought
    excesses: Excesses  # what it leaves
    standing: Standing = field(default_factory=Standing)  # what the fitted numbers say
    simpler: tuple[str, ...] = ()  # effects of which it is a richer form
    place: str = ""  # where the effect sits

    def left_in(self, block: str) -> float:
        """Return the excess that it leaves in a block."""
        return self.excesses[block].excess

    def change(self, criteria: Criteria, before: Excesses) -> Change:
        """Return what it changes in what the hypothesis that it adds to leaves over."""
        return Change(criteria, before, self.excesses)

    def objections(self, criteria: Criteria, before: Excesses) -> tuple[str, ...]:
        """Return in words why it may not be named; nothing if it may."""
        return self.change(criteria, before).objections(self.standing)

    def is_undecided(self, criteria: Criteria, before: Excesses) -> bool:
        """Tell whether it explains what is left, but the records do not determine its numbers."""
        return self.change(criteria, before).is_undecided(self.standing)


@dataclass(frozen=True, eq=False)
class Choice(Generic[T]):
    """The rival that is taken, and those that the records cannot tell from it.

    One for each other effect, and one for each other place of its own.
    """

    taken: Rival[T]
    equals: tuple[Rival[T], ...]


def choose(criteria: Criteria, before: Excesses, rivals: Sequence[Rival[T]], block: str) -> Choice[T] | None:
    """Return the simplest of the rivals that predict a block about as well as the best, and may be named.

    Result: nothing where none of them may be named.
    """

    def left(rival: Rival[T]) -> float:
        after = rival.excesses.items()
        spoilt = sum(max(0.0, e.excess - before[n].excess) for n, e in after if n != block)
        return rival.left_in(block) + spoilt

    def in_all(rival: Rival[T]) -> tuple[float, float]:
        return left(rival), total_excess(rival.excesses)

    able = [rival for rival in rivals if not rival.objections(criteria, before)]
    able = [rival for rival in able if explained(before, rival.excesses).get(block, 0.0) > 0.0] or able
    if not able:
        return None
    best = min(able, key=lambda rival: (left(rival), rival.excesses[block].chi2))

    near = [rival for rival in able if predict_alike(criteria, rival, best, block, left)]
    simplest = min(rival.numbers for rival in near)
    alike = dict[str, Rival[T]]()
    for rival in reversed(near):
        # Of several forms or places of one effect the best is told, by what it leaves elsewhere if need be.
        if rival.numbers == simplest and in_all(rival) <= in_all(alike.get(rival.effect, rival)):
            alike[rival.effect] = rival
    # Among what cannot be told apart the order of the catalogue decides, not the last digits of a fit.
    taken = alike.pop(next(reversed(alike)))
    unknown = [rival for rival in rivals if rival.is_undecided(criteria, before)]
    if any(imitates(criteria, taken, rival, block) for rival in unknown):
        return None
    elsewhere = {r.place: r for r in near if r.effect == taken.effect and r.numbers == simplest}
    elsewhere.pop(taken.place, None)
    return Choice(taken, (*alike.values(), *elsewhere.values()))


def predict_alike(
    criteria: Criteria, rival: Rival[T], best: Rival[T], block: str, left: Callable[[Rival[T]], float]
) -> bool:
    """Tell whether a rival predicts about as well as the best: within noise, or in proportion.

    What it gains in another block does not make up for what it leaves in this one. Below the floor no excess
    tells two apart; but what the best one leaves is not less than the noise, so the floor of the block is too
    high then, and the squares themselves stand in the proportion.
    """
    here, there = ({block: each.excesses[block]} for each in (rival, best))
    gains = gain(here, there), gain(rival.excesses, best.excesses)
    within = not any(criteria.is_more_than_noise(each) for each in gains)
    factor = criteria.richer if rival.effect in best.simpler else criteria.equal
    squares = rival.excesses[block].chi2 <= factor * best.excesses[block].chi2
    return within or (squares and left(rival) <= factor * left(best))


def imitates(criteria: Criteria, taken: Rival[T], other: Rival[T], block: str) -> bool:
    """Tell whether an effect only imitates another, whose numbers are not known but that explains far more.

    What it leaves shows that it is the other one.
    """
    here, there = ({block: each.excesses[block]} for each in (taken, other))
    less = criteria.richer * other.left_in(block) < taken.left_in(block)
    return less and Change(criteria, here, there).is_more_than_noise


@dataclass(frozen=True)
class Calibration:
    """Numbers of the curve, fitted to the calibration seeds of ``docs/decision.md``."""

    # offset, distance, complete, left: a, b, c and d of the module's formula
    offset: float = 1.0
    distance: float = 1.05
    complete: float = 1.25
    left: float = 0.5
    most: float = 0.99  # no more is stated: so many cases cannot show that one in a hundred is wrong

    def probability(self, distance: float, *, complete: bool, times_noise: float = 1.0) -> float:
        """Return the probability that a name is right."""
        score = self.offset + self.distance * distance + self.complete * complete
        score -= self.left * math.log(times_noise)
        return min(self.most, 1.0 / (1.0 + math.exp(-score)))


CALIBRATION = Calibration()


def next_name(
    criteria: Criteria, choice: Choice[T], rivals: Sequence[Rival[T]], block: str
) -> tuple[float, str]:
    """Return ln(r), how many times as much as the one that is taken the best other name leaves, and it."""
    names = {choice.taken.effect, *(each.effect for each in choice.equals), *choice.taken.simpler}
    # A form that contains it is no other name for what is there.
    forms = {rival.effect for rival in rivals if choice.taken.effect in rival.simpler}
    others = [rival for rival in rivals if rival.effect not in names | forms]
    if not others:
        return 0.0, ""
    best, margin = min(others, key=lambda rival: rival.left_in(block)), criteria.noise_margin
    return math.log((best.left_in(block) + margin) / (choice.taken.left_in(block) + margin)), best.effect
