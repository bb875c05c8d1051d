"""The search for what is missing: effects are added while a block stays open, dropped when superfluous.

What is tried, and in which order; :mod:`.criteria` decides.
"""

from __future__ import annotations

import itertools
import math
from collections.abc import Callable, Collection, Mapping, Sequence
from dataclasses import dataclass, field, replace

from ...errors import ConvergenceError
from ...processes import parallel_map
from ..effects.candidate import Candidate, EffectFunction
from .comparison import Comparison
from .criteria import (
    DECLARED,
    Criteria,
    Excesses,
    Gain,
    Rival,
    choose,
    explained,
    gain,
    gains_by_record,
    is_complete,
    is_superfluous,
    is_undecided,
    lacking,
    objections,
    predicts_records,
    total_excess,
    unexplained,
)
from .excess import excesses
from .hypothesis import Hypothesis
from .probability import distance_to_next
from .standing import standing_of

_PAIRED = 4
"""Where no effect helps alone, so many of the best are tried in pairs; so many are looked at twice. Six pairs
take about as long as the catalogue did."""
_NEARLY_CLOSED = 5.0
"""Mean square above the noise floor below which, beside other effects, nothing is tried that takes long: that
is mostly what inexact forms leave over."""
_MOST_EFFECTS_IN_FREE_FLIGHT = 2
"""Effects that are looked for where a body flies freely: a third takes minutes, and rests on less."""


_UNKNOWN_GAIN = Gain(math.nan, math.nan, math.nan)


@dataclass(frozen=True, eq=False)
class Step:
    """One effect that was added.

    Parameters
    ----------
    chosen
        Hypothesis with the effect in it.
    block
        In which something was lacking.
    share
        Share of the excess that was left in a block before, of the block of which it explains most.
    distance
        How many times as much the best other name leaves, natural logarithm.
    gain, gains
        What prediction gains by it, over all records and on each.
    equals
        Hypotheses with another last effect that predict as well with as few numbers.
    """

    chosen: Hypothesis
    block: str
    share: float
    distance: float = 0.0
    gain: Gain = _UNKNOWN_GAIN
    gains: Mapping[str, float] = field(default_factory=dict)
    equals: tuple[Hypothesis, ...] = ()

    @property
    def effect(self) -> str:
        """Identifier of what was added."""
        return self.chosen.newest.effect


@dataclass(frozen=True, eq=False)
class Tried:
    """A candidate that was fitted beside nothing else, and why it was not named.

    Parameters
    ----------
    hypothesis
        Fitted with it.
    share
        Share of the whole excess that it explains alone.
    objections
        Clauses of the rule that speak against it; empty for one that may be named.
    undecided
        Whether it explains what is missing, but the records do not determine its numbers.
    """

    hypothesis: Hypothesis
    share: float
    objections: tuple[str, ...]
    undecided: bool = False

    @property
    def candidate(self) -> Candidate:
        """The effect at its place."""
        return self.hypothesis.newest


@dataclass(frozen=True)
class Skipped:
    """A candidate that was left out of the comparison.

    Parameters
    ----------
    effect, location
        Which.
    beside
        Effects that had been added before.
    reason
        Too expensive, or not converged.
    """

    effect: str
    location: str
    beside: tuple[str, ...]
    reason: str

    def __str__(self) -> str:
        beside = f" beside {' and '.join(self.beside)}" if self.beside else ""
        return f"{self.effect} at {self.location}{beside}: {self.reason}"


@dataclass(frozen=True, eq=False)
class Outcome:
    """What the search ended with.

    Parameters
    ----------
    last
        Hypothesis with everything that may be named, fitted to all samples.
    steps
        One for each effect.
    tried
        What was tried first, the best first.
    complete
        Whether nothing is left beyond the noise.
    skipped
        What could not be compared, and why.
    """

    last: Hypothesis
    steps: tuple[Step, ...] = ()
    tried: tuple[Tried, ...] = ()
    complete: bool = False
    skipped: tuple[Skipped, ...] = ()


def search(
    comparison: Comparison,
    base: Hypothesis,
    catalogue: Sequence[EffectFunction],
    criteria: Criteria,
    progress: Callable[[str], None],
) -> Outcome:
    """Add effects to a hypothesis while a block stays open and one may be named.

    Parameters
    ----------
    comparison
        Fits hypotheses to the records.
    base
        Refitted declared model.
    catalogue
        Effects to try.
    criteria
        Of the decision.
    progress
        Told what is being tried.
    """
    return _Search(comparison, catalogue, criteria, progress).outcome(base)


@dataclass(eq=False)
class _Search:
    """Tries candidates on hypotheses, on all cores, and keeps account of what could not be tried."""

    comparison: Comparison
    catalogue: Sequence[EffectFunction]
    criteria: Criteria
    progress: Callable[[str], None]
    skipped: list[Skipped] = field(default_factory=list)
    tried: tuple[Tried, ...] = ()
    on_other_records: dict[Hypothesis, Excesses] = field(default_factory=dict)

    def outcome(self, base: Hypothesis) -> Outcome:
        start = self.comparison.coarsely(base)
        steps = self._enriched(start, self._backward(start, self._forward(start)))
        steps = self._explaining(start, steps)
        skipped = tuple(dict.fromkeys(self.skipped))
        if not steps:
            return Outcome(base, (), self.tried, is_complete(self._on_all(start)), skipped)
        self.progress("fitting what was named to all samples")
        last = self.comparison.polished(steps[-1].chosen)
        return Outcome(last, tuple(steps), self.tried, is_complete(self._excesses(last)), skipped)

    def _explaining(self, start: Hypothesis, steps: list[Step]) -> list[Step]:
        """Drop the effects of blocks that stay unexplained: there they stand for something else."""
        if not steps:
            return []
        left = unexplained(self.criteria, self._excesses(start), self._excesses(steps[-1].chosen))
        kept = [step for step in steps if step.block not in left]
        return steps if len(kept) == len(steps) else self._rebuilt(start, kept)

    def _excesses(self, hypothesis: Hypothesis) -> Excesses:
        return excesses(hypothesis, self.comparison.bench, self.criteria)

    def _on_all(self, hypothesis: Hypothesis) -> Excesses:
        return self._excesses(self.comparison.on_all_samples(hypothesis))

    def _forward(self, start: Hypothesis) -> list[Step]:
        """Return the effects that may be named, one after the other."""
        present, steps = start, list[Step]()
        while len(steps) < self._most_effects(present):
            open_blocks = self._lacking(start, present)
            if not open_blocks:
                break
            tried: list[Hypothesis] = []
            step = None
            for block in open_blocks:
                # Effects elsewhere wait for their turn: most blocks have an effect of their own.
                fresh = self._tried(present, block, tried)
                tried += fresh
                step = self._step(present, fresh, block)
                if step is not None:
                    break
            self.tried = self.tried or self._account(present, tried)
            further = [step] if step else []
            if not steps and not further:
                # Beside an effect that was named, most of what is left over is the inexactness of its form.
                further = self._pair(tried, present, open_blocks[0])
            if not further:
                break
            steps += further
            present = steps[-1].chosen
        return steps

    def _most_effects(self, present: Hypothesis) -> int:
        most = int(self.criteria.most_effects)
        return min(most, _MOST_EFFECTS_IN_FREE_FLIGHT) if present.has_free_flight else most

    def _backward(self, start: Hypothesis, steps: list[Step]) -> list[Step]:
        """Drop the effects that later ones have made superfluous, the first added first."""
        place = 0
        while len(steps) > 1 and place < len(steps) - 1:
            self.progress(f"trying without {steps[place].effect}")
            fewer = self._rebuilt(start, [s for k, s in enumerate(steps) if k != place])
            if fewer and is_superfluous(
                self.criteria, self._excesses(fewer[-1].chosen), self._excesses(steps[-1].chosen)
            ):
                steps = fewer
            else:
                place += 1
        return steps

    def _enriched(self, start: Hypothesis, steps: list[Step]) -> list[Step]:
        """Put the richer form of an effect in its place where it leaves much less.

        Beside effects that were not named yet the simpler form may have done.
        """
        if len(steps) < 2 or is_complete(self._excesses(steps[-1].chosen)):
            return steps
        for place, step in enumerate(steps):
            before = steps[place - 1].chosen if place else start
            for candidate in self._candidates(before):
                if step.effect in candidate.simpler and candidate.location == step.chosen.newest.location:
                    self.progress(f"trying {candidate.effect} in place of {step.effect}")
                    richer = self._rebuilt(start, steps, {place: candidate})
                    if richer and not is_superfluous(
                        self.criteria,
                        self._excesses(steps[-1].chosen),
                        self._excesses(richer[-1].chosen),
                    ):
                        steps = richer
        return steps

    def _lacking(self, start: Hypothesis, present: Hypothesis) -> list[str]:
        """Return the blocks in which all samples ask for a further effect."""
        now = self._on_all(present)
        blocks = lacking(now)
        if present.has_free_flight:
            # Predictions are never exact there, and every further fit takes long.
            shares = explained(self._on_all(start), now)
            blocks = [b for b in blocks if shares.get(b, 0.0) < self.criteria.closed_share]
        return blocks

    def _step(self, present: Hypothesis, fresh: Sequence[Hypothesis], block: str) -> Step | None:
        """Return the best of fresh fits; what is too weak for the coarse look is judged on all samples."""
        before, left = self._excesses(present), {h: self._excesses(h) for h in fresh}
        if not before[block].open:
            best = sorted(fresh, key=lambda h: self._excesses(h)[block].chi2)[:_PAIRED]
            before, left = self._on_all(present), {h: self._on_all(h) for h in best}
        while step := self._chosen(before, left, block):
            if self._predicts_records(present, step.chosen):
                return step
            del left[step.chosen]
        return None

    def _predicts_records(self, present: Hypothesis, chosen: Hypothesis) -> bool:
        """Tell whether an effect predicts whole records that its numbers were not fitted to."""
        before, after = self._on_other_records(present), self._on_other_records(chosen)
        return predicts_records(self.criteria, before, after)

    def _on_other_records(self, hypothesis: Hypothesis) -> Excesses:
        if hypothesis not in self.on_other_records:
            again = self.comparison.without_whole_records(hypothesis)
            self.on_other_records[hypothesis] = self._excesses(again)
        return self.on_other_records[hypothesis]

    def _candidates(self, present: Hypothesis) -> list[Candidate]:
        return [c for effect in self.catalogue for c in effect(present.assembly)]

    def _tried(self, present: Hypothesis, block: str, done: Sequence[Hypothesis]) -> list[Hypothesis]:
        """Return fits of the candidates that act on a block and were not tried before.

        What takes long is tried only where nothing else explains the block down to its noise.
        """
        known = {(h.newest.effect, h.newest.location) for h in done}
        tasks = [(present, c) for c in self._candidates(present) if (c.effect, c.location) not in known]
        wanted = () if block == DECLARED else (block,)
        quick = self._fits([task for task in tasks if not task[1].strategy.takes_long], wanted)
        long = [task for task in tasks if task[1].strategy.takes_long]
        if reason := self._why_not_long(present, quick, block):
            self.skipped += [Skipped(c.effect, c.location, present.names, reason) for _, c in long]
            return quick
        return quick + self._fits(long, wanted)

    def _why_not_long(self, present: Hypothesis, quick: Sequence[Hypothesis], block: str) -> str:
        """Return why what takes long is not tried; empty if it is."""
        if present.added and self._excesses(present)[block].mean_square < _NEARLY_CLOSED:
            return f"takes long, and {' and '.join(present.names)} leave little in the block"
        step = self._step(present, quick, block)
        if step is not None and not self._excesses(step.chosen)[block].open:
            return f"takes long, and {step.effect} explains the block down to its noise"
        return ""

    def _fits(
        self, tasks: Sequence[tuple[Hypothesis, Candidate]], wanted: Collection[str] = ()
    ) -> list[Hypothesis]:
        # What takes longest begins first, so that no core waits for it at the end.
        order = sorted(range(len(tasks)), key=lambda number: not tasks[number][1].strategy.takes_long)

        def fitted(place: int) -> Hypothesis | ConvergenceError | None:
            try:
                return self.comparison.with_effect(*tasks[order[place]], wanted)
            except ConvergenceError as error:
                return error  # no response anywhere near its starts, or too expensive: it explains nothing

        results: dict[int, Hypothesis] = {}
        skipped: dict[int, Skipped] = {}
        for number, result in zip(order, parallel_map(fitted, len(tasks)), strict=True):
            before, candidate = tasks[number]
            self.progress(f"trying {candidate.effect} at {candidate.location}")
            if isinstance(result, ConvergenceError):
                skipped[number] = Skipped(candidate.effect, candidate.location, before.names, result.rule)
                self.progress(f"left out: {result}")
            elif result:
                results[number] = result
        self.skipped += [skipped[number] for number in sorted(skipped)]
        return [results[number] for number in sorted(results)]

    def _pair(self, tried: Sequence[Hypothesis], present: Hypothesis, block: str) -> list[Step]:
        """Return two effects that help together where none helps alone."""
        best = sorted(tried, key=lambda h: total_excess(self._excesses(h)))[:_PAIRED]
        tasks = [
            (one, again)
            for one, other in itertools.combinations(best, 2)
            if (again := self._again(one, other.newest)) is not None
        ]
        before = self._excesses(present)
        step = self._chosen(before, {h: self._excesses(h) for h in self._fits(tasks)}, block)
        if step is None:
            return []
        alone = next(h for h in best if h.newest.effect == step.chosen.added[-2].effect)
        return [self._made(before, _rival(alone, self._excesses(alone)), block), step]

    def _again(self, hypothesis: Hypothesis, wanted: Candidate) -> Candidate | None:
        """Return the same effect at the same kind of place of another assembly."""
        size = len(wanted.unknowns)
        same = [
            c for c in self._candidates(hypothesis) if c.effect == wanted.effect and len(c.unknowns) == size
        ]
        ends = [c for c in same if c.location.split(".")[-1] == wanted.location.split(".")[-1]]
        return next(iter(ends or same), None)

    def _rebuilt(
        self, start: Hypothesis, steps: Sequence[Step], changed: Mapping[int, Candidate] | None = None
    ) -> list[Step]:
        """Return the steps anew, some perhaps changed; nothing if one of them no longer fits."""
        present, rebuilt = start, list[Step]()
        for place, step in enumerate(steps):
            candidate = self._again(present, (changed or {}).get(place, step.chosen.newest))
            if candidate is None:
                return []
            try:
                later = self.comparison.with_effect(present, candidate)
            except ConvergenceError:
                return []
            if later is None:
                return []
            rival = _rival(later, self._excesses(later))
            made = self._made(self._excesses(present), rival, step.block)
            rebuilt.append(replace(made, distance=step.distance, equals=step.equals))
            present = later
        return rebuilt

    def _chosen(self, before: Excesses, tried: Mapping[Hypothesis, Excesses], block: str) -> Step | None:
        """Return the best of some hypotheses, by what each leaves."""
        rivals = [_rival(h, after) for h, after in tried.items()]
        choice = choose(self.criteria, before, rivals, block)
        if choice is None:
            return None
        return replace(
            self._made(before, choice.taken, block),
            distance=distance_to_next(self.criteria, choice, rivals, block),
            equals=tuple(r.hypothesis for r in choice.equals),
        )

    def _made(self, before: Excesses, rival: Rival[Hypothesis], block: str) -> Step:
        share = max(explained(before, rival.excesses).values(), default=0.0)
        gained, gains = gain(before, rival.excesses), gains_by_record(before, rival.excesses)
        return Step(rival.hypothesis, block, share, gain=gained, gains=gains)

    def _account(self, present: Hypothesis, tried: Sequence[Hypothesis]) -> tuple[Tried, ...]:
        """Return how far each effect goes alone and what speaks against it, the best first."""
        whole = max(total_excess(self._excesses(present)), 1.0)
        every = [
            Tried(
                h,
                1.0 - total_excess(self._excesses(h)) / whole,
                self._objections(present, h),
                is_undecided(self.criteria, self._excesses(present), _rival(h, self._excesses(h))),
            )
            for h in tried
        ]
        return tuple(sorted(every, key=lambda each: -each.share))

    def _objections(self, present: Hypothesis, tried: Hypothesis) -> tuple[str, ...]:
        words = objections(self.criteria, self._excesses(present), _rival(tried, self._excesses(tried)))
        if tried in self.on_other_records and not self._predicts_records(present, tried):
            words = (*words, "it does not predict records that are left out as a whole")
        return words


def _rival(hypothesis: Hypothesis, after: Excesses) -> Rival[Hypothesis]:
    newest = hypothesis.newest
    return Rival(
        hypothesis,
        newest.effect,
        len(newest.unknowns),
        after,
        standing_of(newest.unknowns, hypothesis.fits.values()),
        newest.simpler,
    )
