"""The search for what is missing: effects are added while a block stays open, dropped when superfluous.

What is tried, and in which order; :mod:`.trials` fits it, :mod:`.criteria` decides.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, replace

from ...errors import ConvergenceError
from ..effects.candidate import Candidate, EffectFunction
from .comparison import Comparison
from .criteria import (
    Criteria,
    is_complete,
    is_far_from_closed,
    is_superfluous,
    lacking,
    objections_of_numbers,
    stands_out,
    unexplained,
)
from .hypothesis import Hypothesis
from .measures import explained, total_excess
from .standing import standing_of
from .trials import Skipped, Step, Trials, Tried, account, rival_of

_MOST_EFFECTS_IN_FREE_FLIGHT = 2
"""Effects that are looked for where a body flies freely: a third takes minutes, and rests on less."""
_LEADERS, _PARTNERS = 2, 6
"""Where no effect may be named alone, each of so many of the best is tried together with others among so many
of the best; these pairs take about as long as the catalogue did."""


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
        steps = self._backward(start, self._forward(start))
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
            words = self._objections_of_numbers(last)
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
        """Drop the effects of blocks that stay unexplained: there they stand for something else.

        Unless they stand out from all other names: then there is something else beside them.
        """
        if not steps:
            return []
        first, last = (self.trials.excesses_of(each) for each in (start, steps[-1].chosen))
        left = unexplained(self.trials.criteria, first, last)
        kept = [s for s in steps if s.block not in left or stands_out(self.trials.criteria, s.distance)]
        if len(kept) == len(steps):
            return steps
        shares, least = explained(first, last), self.trials.criteria.closed_share
        why = {
            (step.chosen.newest.effect, step.chosen.newest.location): (
                f"all that was found leaves more of '{step.block}' than a name may: it explains "
                f"{100.0 * shares[step.block]:.0f} % of the excess, less than {100.0 * least:.0f} %"
            )
            for step in steps
            if step not in kept
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
                far = self._is_far_from_closed(start, present, block)
                tried += self.trials.tried_on(present, block, tried, far=far)
                # What acts on several blocks was fitted when the first of them was looked at.
                step = self.trials.step(present, tried, block)
                if step is not None:
                    break
            self.tried = self.tried or account(self.trials, present, tried)
            further = [step] if step else []
            room = self._most_effects(present) - len(steps)
            if room > 1 and not further and self._is_far_from_closed(start, present, open_blocks[0]):
                further = self._pair(tried, present, open_blocks[0])
            if not further:
                break
            # A richer form of what is named comes before one more name.
            steps = self._enriched(start, steps + further)
            present = steps[-1].chosen
        return steps

    def _is_far_from_closed(self, start: Hypothesis, present: Hypothesis, block: str) -> bool:
        """Tell whether what is left is worth a long search.

        Beside an effect that was named, what little is left over is the inexactness of its form.
        """
        first, now = (self.trials.excesses_of(each)[block] for each in (start, present))
        return not present.added or is_far_from_closed(self.trials.criteria, first, now)

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
                steps = self._enriched(start, fewer)
            else:
                place += 1
        return steps

    def _enriched(self, start: Hypothesis, steps: list[Step]) -> list[Step]:
        """Put a richer form of an effect in its place where it leaves much less.

        A form of the same effect with more numbers is one too. Beside effects that were not named yet the
        simpler form may have done.
        """
        if len(steps) < 2 or is_complete(self.trials.excesses_of(steps[-1].chosen)):
            return steps
        for place, step in enumerate(steps):
            before = steps[place - 1].chosen if place else start
            for candidate in self.trials.candidates(before):
                if _is_richer(candidate, steps[place].chosen.newest):
                    self.trials.progress(f"trying {candidate.effect} in place of {step.effect}")
                    richer = self._rebuilt(start, steps, {place: candidate})
                    if (
                        richer
                        and not any(self._objections_of_numbers(richer[-1].chosen))
                        and not is_superfluous(
                            self.trials.criteria,
                            self.trials.excesses_of(steps[-1].chosen),
                            self.trials.excesses_of(richer[-1].chosen),
                        )
                    ):
                        steps = richer
        return steps

    def _objections_of_numbers(self, last: Hypothesis) -> list[list[str]]:
        """Return what the numbers of each effect have against it, all effects together."""
        return [
            objections_of_numbers(self.trials.criteria, standing_of(each.unknowns, last.fits.values()))
            for each in last.added
        ]

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
        best = self._best_of_each(tried)[:_PARTNERS]
        tasks = [
            (one, again)
            for place, one in enumerate(best[:_LEADERS])
            for other in best[place + 1 :]
            if (again := self._again(one, other.newest)) is not None
        ]
        before = self.trials.excesses_of(present)
        fitted = {h: self.trials.excesses_of(h) for h in self.trials.fits(tasks)}
        step = self.trials.sound(present, before, fitted, block)
        if step is None:
            return []
        alone = next(h for h in best if h.newest.effect == step.chosen.added[-2].effect)
        return [self.trials.made(before, rival_of(alone, self.trials.excesses_of(alone)), block), step]

    def _best_of_each(self, tried: Sequence[Hypothesis]) -> list[Hypothesis]:
        """Return the best form and place of each effect, the best effect first."""
        best: dict[str, Hypothesis] = {}
        for each in sorted(tried, key=lambda h: total_excess(self.trials.excesses_of(h))):
            best.setdefault(each.newest.effect, each)
        return list(best.values())

    def _again(self, hypothesis: Hypothesis, wanted: Candidate) -> Candidate | None:
        """Return the same form of an effect at the same kind of place of another assembly."""
        same = [
            c
            for c in self.trials.candidates(hypothesis)
            if c.effect == wanted.effect and _kinds(c) == _kinds(wanted)
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


def _kinds(candidate: Candidate) -> list[str]:
    """Return what the numbers of a candidate are, wherever it stands: forms of one effect differ in that."""
    return [unknown.name.rpartition(".")[2] for unknown in candidate.unknowns]


def _is_richer(candidate: Candidate, named: Candidate) -> bool:
    """Tell whether a candidate is a richer form of what is named, at its place."""
    more = candidate.effect == named.effect and len(candidate.unknowns) > len(named.unknowns)
    return (more or named.effect in candidate.simpler) and candidate.location == named.location


def _with_objection(tried: Tried, why: Mapping[tuple[str, str], str]) -> Tried:
    """Return what was tried with the reason why its effect was dropped again, if it was."""
    reason = why.get((tried.candidate.effect, tried.candidate.location))
    return replace(tried, objections=(reason,)) if reason and not tried.objections else tried
