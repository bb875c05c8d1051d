"""The search for what is missing: effects are added while a block stays open, dropped when superfluous.

What is tried, and in which order; :mod:`.trials` fits it, :mod:`.criteria` decides.
"""

from __future__ import annotations

import itertools
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, replace

from ...errors import ConvergenceError
from ..effects.candidate import Candidate, EffectFunction
from .comparison import Comparison
from .criteria import Criteria, is_complete, is_superfluous, lacking, objections_of_numbers, unexplained
from .hypothesis import Hypothesis
from .measures import explained, total_excess
from .standing import standing_of
from .trials import PAIRED, Skipped, Step, Trials, Tried, rival_of

_MOST_EFFECTS_IN_FREE_FLIGHT = 2
"""Effects that are looked for where a body flies freely: a third takes minutes, and rests on less."""


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
    return _Search(Trials(comparison, catalogue, criteria, progress)).outcome(base)


@dataclass(eq=False)
class _Search:
    """The order in which effects are added, dropped and exchanged."""

    trials: Trials
    tried: tuple[Tried, ...] = ()

    def outcome(self, base: Hypothesis) -> Outcome:
        start = self.trials.comparison.coarsely(base)
        steps = self._enriched(start, self._backward(start, self._forward(start)))
        steps = self._explaining(start, steps)
        last = self._fitted_to_all(start, steps)
        skipped = tuple(dict.fromkeys(self.trials.skipped))
        if last is None:
            return Outcome(base, (), self.tried, is_complete(self.trials.on_all(start)), skipped)
        done = self.trials.excesses_of(last)
        return Outcome(last, tuple(steps), self.tried, is_complete(done), skipped)

    def _fitted_to_all(self, start: Hypothesis, steps: list[Step]) -> Hypothesis | None:
        """Return the last hypothesis fitted to all samples, without effects whose numbers fail there."""
        while steps:
            self.trials.progress("fitting what was named to all samples")
            last = self.trials.comparison.polished(steps[-1].chosen)
            words = [
                objections_of_numbers(self.trials.criteria, standing_of(each.unknowns, last.fits.values()))
                for each in last.added
            ]
            if not any(words):
                return last
            for step, why in zip(steps, words, strict=True):
                reason = f"on all samples {'; '.join(why)}"
                added = step.chosen.newest
                self.trials.skipped += [Skipped(added.effect, added.location, (), reason)] if why else []
            kept = [step for step, why in zip(steps, words, strict=True) if not why]
            steps[:] = self._rebuilt(start, kept)
        return None

    def _explaining(self, start: Hypothesis, steps: list[Step]) -> list[Step]:
        """Drop the effects of blocks that stay unexplained: there they stand for something else."""
        if not steps:
            return []
        first, last = (self.trials.excesses_of(each) for each in (start, steps[-1].chosen))
        left = unexplained(self.trials.criteria, first, last)
        kept = [step for step in steps if step.block not in left]
        if len(kept) == len(steps):
            return steps
        shares, least = explained(first, last), self.trials.criteria.closed_share
        why = {
            (step.chosen.newest.effect, step.chosen.newest.location): (
                f"all that was found leaves more of '{step.block}' than a name may: it explains "
                f"{100.0 * shares[step.block]:.0f} % of the excess, less than {100.0 * least:.0f} %"
            )
            for step in steps
            if step.block in left
        }
        self.tried = tuple(_with_objection(each, why) for each in self.tried)
        return self._rebuilt(start, kept)

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
                fresh = self.trials.tried_on(present, block, tried)
                tried += fresh
                step = self.trials.step(present, fresh, block)
                if step is not None:
                    break
            self.tried = self.tried or self.trials.account(present, tried)
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
        most = int(self.trials.criteria.most_effects)
        return min(most, _MOST_EFFECTS_IN_FREE_FLIGHT) if present.has_free_flight else most

    def _backward(self, start: Hypothesis, steps: list[Step]) -> list[Step]:
        """Drop the effects that later ones have made superfluous, the first added first."""
        place = 0
        while len(steps) > 1 and place < len(steps) - 1:
            self.trials.progress(f"trying without {steps[place].effect}")
            fewer = self._rebuilt(start, [s for k, s in enumerate(steps) if k != place])
            if fewer and is_superfluous(
                self.trials.criteria,
                self.trials.excesses_of(fewer[-1].chosen),
                self.trials.excesses_of(steps[-1].chosen),
            ):
                steps = fewer
            else:
                place += 1
        return steps

    def _enriched(self, start: Hypothesis, steps: list[Step]) -> list[Step]:
        """Put the richer form of an effect in its place where it leaves much less.

        Beside effects that were not named yet the simpler form may have done.
        """
        if len(steps) < 2 or is_complete(self.trials.excesses_of(steps[-1].chosen)):
            return steps
        for place, step in enumerate(steps):
            before = steps[place - 1].chosen if place else start
            for candidate in self.trials.candidates(before):
                if step.effect in candidate.simpler and candidate.location == step.chosen.newest.location:
                    self.trials.progress(f"trying {candidate.effect} in place of {step.effect}")
                    richer = self._rebuilt(start, steps, {place: candidate})
                    if richer and not is_superfluous(
                        self.trials.criteria,
                        self.trials.excesses_of(steps[-1].chosen),
                        self.trials.excesses_of(richer[-1].chosen),
                    ):
                        steps = richer
        return steps

    def _lacking(self, start: Hypothesis, present: Hypothesis) -> list[str]:
        """Return the blocks in which all samples ask for a further effect."""
        now = self.trials.on_all(present)
        blocks = lacking(now)
        if present.has_free_flight:
            # Predictions are never exact there, and every further fit takes long.
            shares = explained(self.trials.on_all(start), now)
            blocks = [b for b in blocks if shares.get(b, 0.0) < self.trials.criteria.closed_share]
        return blocks

    def _pair(self, tried: Sequence[Hypothesis], present: Hypothesis, block: str) -> list[Step]:
        """Return two effects that help together where none helps alone."""
        best = sorted(tried, key=lambda h: total_excess(self.trials.excesses_of(h)))[:PAIRED]
        tasks = [
            (one, again)
            for one, other in itertools.combinations(best, 2)
            if (again := self._again(one, other.newest)) is not None
        ]
        before = self.trials.excesses_of(present)
        step = self.trials.chosen(
            before, {h: self.trials.excesses_of(h) for h in self.trials.fits(tasks)}, block
        )
        if step is None:
            return []
        alone = next(h for h in best if h.newest.effect == step.chosen.added[-2].effect)
        return [self.trials.made(before, rival_of(alone, self.trials.excesses_of(alone)), block), step]

    def _again(self, hypothesis: Hypothesis, wanted: Candidate) -> Candidate | None:
        """Return the same effect at the same kind of place of another assembly."""
        size = len(wanted.unknowns)
        same = [
            c
            for c in self.trials.candidates(hypothesis)
            if c.effect == wanted.effect and len(c.unknowns) == size
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
                later = self.trials.comparison.with_effect(present, candidate)
            except ConvergenceError:
                return []  # who asks keeps its steps, or names nothing
            if later is None:
                return []
            rival = rival_of(later, self.trials.excesses_of(later))
            made = self.trials.made(self.trials.excesses_of(present), rival, step.block)
            rebuilt.append(replace(made, distance=step.distance, equals=step.equals))
            present = later
        return rebuilt


def _with_objection(tried: Tried, why: Mapping[tuple[str, str], str]) -> Tried:
    """Return what was tried with the reason why its effect was dropped again, if it was."""
    reason = why.get((tried.candidate.effect, tried.candidate.location))
    return replace(tried, objections=(reason,)) if reason and not tried.objections else tried
