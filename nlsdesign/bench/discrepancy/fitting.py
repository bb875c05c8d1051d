"""How the numbers of one hypothesis are fitted: where its fits begin, with which loss, and where they end.

Most effects are fitted plainly, from the starts that their unknowns name. Backlash is not to be fitted from
far away: its minimum is narrow and, where a body flies freely between contacts, many others lie beside it.
It brings a :class:`Continuation`: a simpler form of itself is fitted first. And wherever a model contains
contact, declared or added, its blocks are fitted :class:`RobustOverFreeFlight`: a contact that comes slightly
too late sends the body on another course, and the prediction of that record stays wrong, however right the
law. Slow motion does not depend on it. So the first look is at the slower records, and a quick record that is
not predicted is judged by the others.

An effect brings the strategy that suits it. Hypotheses are compared elsewhere.
"""

from __future__ import annotations

import math
from collections.abc import Collection, Mapping, Sequence
from dataclasses import dataclass, field, replace
from typing import NamedTuple, TypeAlias

import numpy as np

from ...components.assembly.named_parts import Assembly
from ...foundation.errors import ConvergenceError
from ...model import flatten
from ..identification.equation_error.evidence import Bench, Evidence
from ..identification.filters import derivative
from ..identification.least_squares import Fit, Promise, fit, gauss_newton_step, promised_costs
from ..identification.parameters import Parameter
from ..identification.residuals import rmse
from .tearing import blocks_of

Key: TypeAlias = tuple[str, str]
"""Names of a block and of a record."""

_RECORDS_PER_QUICK_ONE = 4
"""Of so many records one, the quickest, is left out of the first look and may be unpredictable: a quarter is
what a diagnosis can spare."""
_STANDS_OUT = 2.0
"""Mean square by which it must exceed that of every other record of the block: records of one law differ by
less."""


_MEMBERS, _NEIGHBOURHOOD = 4, 0.01
"""Size of an ensemble, and how far its members differ at most on the fitted scale."""
_DIVERGING = 0.5
"""Share of the squares of a record by which neighbours must differ; independent courses differ by one."""


class Tally(NamedTuple):
    """What one block leaves over on one record."""

    squares: float  # sum of squared residuals in units of the noise floor
    rows: int  # number of residuals
    effective_size: float  # how many independent residuals these are equivalent to, coloured as they are
    # segments: sum of squares where the numbers come from the other records, one for each piece of the record
    # in time. Empty where no record was left out.
    segments: tuple[float, ...] = ()
    # in_common: sum of squares with the numbers of all records, and what these cost the others
    in_common: float = 0.0

    @property
    def predicted(self) -> float:
        """Sum of squares where the numbers come from the other records."""
        return math.fsum(self.segments) if self.segments else self.squares


def quickest(evidence: Sequence[Evidence]) -> frozenset[str]:
    """Return the quickest quarter of the records, rounded down, by the acceleration of what moves."""
    size: dict[str, float] = {}
    for each in evidence:
        for drive in each.driven.block.drives.values():
            if drive.order > 0:
                rows = derivative(each.record.trace[drive.signal], each.record.step, order=2)
                size[each.record.name] = max(rmse(rows), size.get(each.record.name, 0.0))
    by_size = sorted(size, key=lambda name: -size[name])
    return frozenset(by_size[: len(size) // _RECORDS_PER_QUICK_ONE])


def unpredictable(
    before: Mapping[Key, Tally], after: Mapping[Key, Tally], quick: Collection[str]
) -> frozenset[Key]:
    """Return where a quick record is predicted worse than before, or far worse than every other one."""

    def mean_square(key: Key) -> float:
        return after[key].squares / after[key].rows

    def stands_out(key: Key) -> bool:
        others = [mean_square(k) for k in after if k[0] == key[0] and k[1] not in quick]
        return bool(others) and mean_square(key) > _STANDS_OUT * max(others)

    def is_worse(key: Key) -> bool:
        return after[key].squares > before[key].squares + after[key].rows

    return frozenset(key for key in after if key[1] in quick and (is_worse(key) or stands_out(key)))


def diverges(evidence: Evidence, best: Fit) -> bool:
    """Tell whether neighbours of the fitted numbers predict a record as differently as it is mispredicted.

    Only that proves a record unpredictable: a wrong law that fails on it fails in its neighbourhood too. The
    members of the ensemble differ by a standard error of each number, a hundredth at most, in directions
    drawn once for all.
    """
    random = np.random.default_rng(0)
    error = np.minimum(np.sqrt(np.diag(best.covariance)), _NEIGHBOURHOOD)
    residual = evidence.residual(best.values)[0]
    spread = []
    for _ in range(_MEMBERS):
        moved = {
            p.name: p.outward(p.inward(best.values[p.name]) + step)
            for p, step in zip(best.parameters, error * random.standard_normal(len(error)), strict=True)
        }
        try:
            spread.append(float(np.sum((evidence.residual(moved)[0] - residual) ** 2)))
        except ConvergenceError:
            spread.append(math.inf)
    return float(np.median(spread)) >= _DIVERGING * float(residual @ residual)


def like_the_others(tallies: Mapping[Key, Tally], unpredictable: Collection[Key]) -> dict[Key, Tally]:
    """Return tallies in which an unpredictable record is as well predicted as the others of its block.

    ``unpredictable``: blocks and records; none of them counts for more than it did.
    """
    result = dict(tallies)
    for block, record in unpredictable:
        others = [tallies[k] for k in tallies if k[0] == block and k not in unpredictable]
        share = sum(t.squares for t in others) / max(sum(t.rows for t in others), 1)
        own = tallies[block, record]
        factor = min(1.0, share * own.rows / max(own.squares, 1e-300))
        result[block, record] = own._replace(
            squares=factor * own.squares, segments=tuple(factor * s for s in own.segments)
        )
    return result


Start: TypeAlias = tuple[Parameter, ...]
"""The free numbers of a group of blocks, each with a value to begin at."""


@dataclass(frozen=True)
class Budget:
    """How much work fits may be: it counts evaluations and operations, never seconds.

    So every machine gives the same verdict.
    """

    # full_starts: so many starts are fitted to the end, the best by a linear look ahead; the others promise
    # less
    full_starts: int = 3
    # evaluations, coarse_evaluations: bounds of evaluations; fits of laws that suit the records end well
    # below them by themselves
    evaluations: int = 40
    coarse_evaluations: int = 20
    # long_evaluations: the same where a step takes so many operations that each evaluation lasts seconds
    long_evaluations: int = 6
    # coarse_tolerance: a coarse fit ends where it promises to gain less than this share of the cost: enough
    # to compare
    coarse_tolerance: float = 1e-3
    # polished_tolerance: the same for a fit to all samples of a hypothesis with effects; the declared model
    # is fitted to the end
    polished_tolerance: float = 2e-5
    # least_gain: where a body flies freely, a coarse fit ends too where it promises to gain less than this
    # share of the cost without the effect: more is not known there
    least_gain: float = 1e-3
    long_step: int = 30_000  # operations per step beyond which evaluations are few
    # expensive_step: operations per step beyond which a further effect is skipped: its fit would take minutes
    expensive_step: int = 100_000
    # most_starts: starts beyond which a further effect is skipped where a body flies freely, for the same
    # reason
    most_starts: int = 8
    # least_explained: share of the excess over the noise that a continuation must explain for the whole
    # effect to be fitted: a named effect explains at least half
    least_explained: float = 0.3


BUDGET = Budget()
_NOTHING, _FEW_STARTS = 0.005, 4
"""Share of the excess over the noise within which the linearised problem ends at what was left before, from
each of so few starts: more is not asked of what then explains nothing. Others take twice the time to ask."""
_HELD = 1e-4
"""Share by which a number that is held may move, because a fit needs an interval."""


@dataclass(frozen=True)
class Limits:
    """Where a fit may stop."""

    evaluations: int  # bound on the number of evaluations
    tolerance: float  # share of the cost below which a promised gain is not pursued
    least: float = 0.0  # gain of cost below which it is not either


@dataclass(frozen=True, eq=False)
class FitProblem:
    """The free numbers of a group of blocks, and everything that the records say of them."""

    bench: Bench  # records with filters and noise floors
    assembly: Assembly  # with the effect in it
    blocks: tuple[str, ...]  # names of the blocks; they share free numbers
    starts: tuple[Start, ...]  # where a fit may begin; all of the same numbers in the same order
    evidence: tuple[Evidence, ...]  # what all records say
    new: tuple[str, ...]  # names of the free numbers that the newest effect has brought
    # before: what was left over by block and record without the effect; empty where nothing was fitted yet
    before: Mapping[Key, Tally]
    unpredictable: frozenset[Key]  # blocks and records that no fit should follow
    effects: int  # number of effects in the assembly that were not declared
    beside_free_flight: bool  # whether a body flew freely without the newest effect already
    coarse: bool  # whether this is a first look at thinned records

    @property
    def fitted(self) -> list[Evidence]:
        """What the records say that fits may see."""
        return [e for e in self.evidence if e.record.role == "fit"]

    @property
    def predictable(self) -> list[Evidence]:
        """The same without what is unpredictable; all of it where nothing else is left."""
        kept = [e for e in self.fitted if (e.driven.block.name, e.record.name) not in self.unpredictable]
        return kept or self.fitted

    @property
    def has_free_flight(self) -> bool:
        """Whether a body flies freely between contacts, which is faster than the samples."""
        return any(e.driven.stiff for e in self.evidence)

    @property
    def instructions(self) -> int:
        """Operations per step of the block that takes most."""
        return max((e.driven.instructions for e in self.fitted), default=0)

    @property
    def cost_before(self) -> float:
        """Half the sum of squares without the newest effect, on the records that fits may see."""
        names = {e.record.name for e in self.fitted}
        return 0.5 * sum(t.squares for (b, r), t in self.before.items() if b in self.blocks and r in names)

    @property
    def limits(self) -> Limits:
        """Where a plain fit may stop."""
        if self.coarse:
            limits = Limits(BUDGET.coarse_evaluations, BUDGET.coarse_tolerance)
        else:
            limits = Limits(BUDGET.evaluations, BUDGET.polished_tolerance if self.effects else 0.0)
        if self.effects and self.instructions > BUDGET.long_step:
            limits = replace(limits, evaluations=BUDGET.long_evaluations)
        return limits


@dataclass(frozen=True)
class Strategy:
    """Where the fits of an effect begin: where its unknowns say, unless a subclass knows better."""

    # takes_long: whether its fits take much longer than others, as where the effect moves faster than the
    # samples, so that they are begun first
    takes_long: bool = field(default=False, kw_only=True)

    def beginnings(self, problem: FitProblem, slow: Sequence[Evidence]) -> list[Start]:
        """Return better starts than those of the unknowns; nothing where there are none."""
        return []


@dataclass(frozen=True)
class Continuation(Strategy):
    """Begin where a simpler form of the effect ends, fitted to slow motion, and beside that.

    Numbers of the same name and the same declared value carry over. Slow motion can hardly tell more of the
    effect from more of what it acts on, so each new number is held a little above as well: without the
    inertia behind it, backlash looks smaller than it is.
    """

    through: Assembly  # the assembly with the simpler form of the effect
    hold: float = 1.2  # multiple of each new number at which it is held while the others are fitted once more
    takes_long: bool = field(default=True, kw_only=True)  # two forms are fitted, one after the other

    def beginnings(self, problem: FitProblem, slow: Sequence[Evidence]) -> list[Start]:
        """Return the starts that the simpler form leaves; nothing where it has no response."""
        bench, first = problem.bench, problem.starts[0]
        every = blocks_of(flatten(self.through), bench.records.signals)
        blocks = [b for b in every if b.name in problem.blocks]
        values = {p.name: p.start for p in first}
        driven = [bench.driven(b, [n for n in values if n in b.model.values], values) for b in blocks]
        shared = {name for block in driven for name in block.free}
        starts = list(dict.fromkeys(tuple(p for p in s if p.name in shared) for s in problem.starts))
        names = {e.record.name for e in slow}
        records = [r for r in bench.records.of("fit") if r.name in names]
        evidence = [e for block in driven for e in bench.evidence(block, records, values, coarse=True)]
        limits = Limits(BUDGET.coarse_evaluations, BUDGET.coarse_tolerance)
        try:
            best = best_fit(evidence, starts, limits)
        except ConvergenceError:
            return []
        if not explains_enough(problem, best.misfit):
            raise ConvergenceError(
                "fit",
                f"its simpler form explains less than {100.0 * BUDGET.least_explained:.0f} % of what is left",
            )
        try:
            held = [_held(best, name, self.hold) for name in problem.new if name in shared]
            ended = [best, *[best_fit(evidence, [start], limits) for start in held]]
        except ConvergenceError:
            return []
        same = self._same_numbers(problem.assembly)
        left = [{n: v for n, v in each.values.items() if n.partition("[")[0] in same} for each in ended]
        return [tuple(replace(p, start=values.get(p.name, p.start)) for p in first) for values in left]

    def _same_numbers(self, assembly: Assembly) -> set[str]:
        """Return the names of the numbers that mean the same in both forms of the effect."""
        simple, whole = self.through.quantities(), assembly.quantities()
        return {name for name in simple if name in whole and simple[name].value == whole[name].value}


class Smooth:
    """How a group of blocks is fitted from its starts: least squares over all records."""

    def fit(self, problem: FitProblem, strategy: Strategy) -> Fit:
        """Fit to all records that are predictable."""
        return best_fit(problem.predictable, problem.starts, problem.limits)

    def set_aside(self, problem: FitProblem, best: Fit, after: Mapping[Key, Tally]) -> frozenset[Key]:
        """Return which blocks and records are to be judged by the others: what was set aside before."""
        return frozenset(key for key in problem.unpredictable if key in after)


class RobustOverFreeFlight(Smooth):
    """A fit in which no residual and no record decides alone, to the slower records first.

    Short implicit steps take long, so evaluations are few and begin where the strategy says.
    """

    def fit(self, problem: FitProblem, strategy: Strategy) -> Fit:
        """Fit to the slower records, then to all that are predictable, each bounded by what it was before."""
        limits = self._limits(problem)
        if not problem.coarse:
            return best_fit(problem.predictable, problem.starts, limits, known={})
        quick = quickest(problem.evidence)
        slow, starts = _without(problem.predictable, quick), list(problem.starts)
        if begun := strategy.beginnings(problem, _without(problem.fitted, quick)):
            costs = [fit(slow, start, evaluations=0, known={}).cost for start in begun]
            starts = [begun[costs.index(min(costs))]]
            if not self._explains_enough(problem.before, slow, min(costs)):
                limits = replace(limits, evaluations=0)
        least = BUDGET.least_gain * problem.cost_before if problem.new else 0.0
        best = best_fit(slow, starts, replace(limits, least=0.1 * least), known={})
        known = {key: tally.squares for key, tally in problem.before.items()}
        return fit(
            problem.predictable,
            [replace(p, start=best.values[p.name]) for p in best.parameters],
            evaluations=limits.evaluations // 2,
            tolerance=limits.tolerance,
            least=least,
            known=known,
        )

    def set_aside(self, problem: FitProblem, best: Fit, after: Mapping[Key, Tally]) -> frozenset[Key]:
        """Return the quick records that a new effect leaves unpredicted and whose neighbours diverge."""
        if not (problem.coarse and problem.new):
            return super().set_aside(problem, best, after)
        suspects = unpredictable(problem.before, after, quickest(problem.evidence))
        by_key = {(e.driven.block.name, e.record.name): e for e in problem.evidence}
        return frozenset(key for key in suspects if diverges(by_key[key], best))

    def _limits(self, problem: FitProblem) -> Limits:
        whole = problem.coarse and problem.effects < 2
        return replace(
            problem.limits, evaluations=BUDGET.long_evaluations if whole else BUDGET.long_evaluations // 3
        )

    def _explains_enough(self, before: Mapping[Key, Tally], slow: Sequence[Evidence], cost: float) -> bool:
        """Tell whether what a continuation has begun takes enough off the excess over the noise."""
        tallies = [before[e.driven.block.name, e.record.name] for e in slow]
        now = 0.5 * sum(t.squares for t in tallies)
        return now - cost >= BUDGET.least_explained * (now - 0.5 * sum(t.rows for t in tallies))


def refusal(problem: FitProblem) -> str:
    """Return why a further effect is not fitted at all; empty if it is."""
    starts = len(problem.starts)
    many = problem.beside_free_flight and starts > BUDGET.most_starts
    if problem.effects < 2 or not (many or problem.instructions > BUDGET.expensive_step):
        return ""
    return f"is too expensive to try: {problem.instructions} operations per step, {starts} starts"


def method_for(problem: FitProblem) -> Smooth:
    """Return how a group of blocks is fitted."""
    return RobustOverFreeFlight() if problem.has_free_flight else Smooth()


def fit_of_nothing(problem: FitProblem) -> Fit | None:
    """Return where a Gauss-Newton step leads, if from each start it ends at what was left without the effect.

    It is the score test of an effect beside what is there already (Rao 1948), taken from where the fits would
    begin: none of them promises to gain, and none is at a place that is far worse than no effect at all.
    """
    keys = [(e.driven.block.name, e.record.name) for e in problem.predictable]
    if len(problem.starts) > _FEW_STARTS or not problem.before.keys() >= set(keys):
        return None
    left = [problem.before[key] for key in keys]
    declared = [p for p in problem.starts[0] if math.isfinite(p.sigma)]
    prior = sum(((p.inward(p.start) - p.inward(p.centre)) / p.sigma) ** 2 for p in declared)
    now, noise = 0.5 * (prior + sum(t.squares for t in left)), 0.5 * sum(t.rows for t in left)
    try:
        steps = [gauss_newton_step(problem.predictable, start) for start in problem.starts]
    except ConvergenceError:
        return None
    if max(abs(cost - now) for cost, _ in steps) >= _NOTHING * (now - noise):
        return None
    return fit(problem.predictable, min(steps, key=lambda step: step[0])[1], evaluations=0)


def best_fit(
    evidence: Sequence[Evidence],
    starts: Sequence[Sequence[Parameter]],
    limits: Limits,
    *,
    known: Mapping[Key, float] | None = None,
) -> Fit:
    """Return the best of fits from several starts, the most promising first."""
    rows = [{p.name: p.start for p in start} for start in starts]
    several = {name for row in rows for name in row if row[name] != rows[0][name]}
    choices = [
        (promised_costs(evidence, start, several) if several else Promise(0.0, 0.0), start)
        for start in starts
    ]
    best: Fit | None = None
    failure = ConvergenceError("fit", "has no start")
    for promised, start in sorted(choices, key=lambda pair: pair[0].near)[: BUDGET.full_starts]:
        # What does not even promise to reach the best so far is left alone.
        if best is not None and promised.far >= best.cost:
            continue
        try:
            ended = fit(
                evidence,
                start,
                evaluations=limits.evaluations,
                tolerance=limits.tolerance,
                least=limits.least,
                known=known,
            )
        except ConvergenceError as error:
            failure = error  # one start in a place where there is no response says nothing of others
            continue
        best = ended if best is None or ended.cost < best.cost else best
    if best is None:
        raise failure
    return best


def explains_enough(problem: FitProblem, misfit: Mapping[Key, float]) -> bool:
    """Tell whether a fit takes enough off the excess over the noise of any block."""
    for block in problem.blocks:
        keys = [key for key in misfit if key[0] == block]
        now = 0.5 * sum(problem.before[key].squares for key in keys)
        excess = now - 0.5 * sum(problem.before[key].rows for key in keys)
        if excess > 0.0 and now - sum(misfit[key] for key in keys) >= BUDGET.least_explained * excess:
            return True
    return False


def _held(fitted: Fit, name: str, factor: float) -> Start:
    """Return the parameters of a fit where it ended, one of them held at a multiple of that."""
    start = []
    for each in fitted.parameters:
        value = fitted.values[each.name]
        if each.name == name:
            value = min(max(factor * value, each.lower), each.upper)
            each = replace(each, lower=value * (1.0 - _HELD), upper=value * (1.0 + _HELD))
        start.append(replace(each, start=value))
    return tuple(start)


def _without(evidence: Sequence[Evidence], quick: Collection[str]) -> list[Evidence]:
    """Return the evidence of the slower records; all of it where nothing else is left."""
    return [e for e in evidence if e.record.name not in quick] or list(evidence)
