"""The search for what is missing: effects are added while a block stays open, dropped when superfluous.

What is tried, and in which order; :mod:`.trials` fits it, :mod:`.criteria` decides.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, replace

from ..effects.candidate import EffectFunction
from .comparison import Comparison
from .criteria import (
    Criteria,
    is_complete,
    is_far_from_closed,
    lacking,
    stands_out,
    unexplained,
)
from .hypothesis import Hypothesis
from .measures import explained, total_excess
from .revision import Revision, objections_of_all, same_again
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
    """Add effects to a hypothesis while a block stays open and one may be named."""
    return _Search(Trials(comparison, catalogue, criteria, progress)).outcome(base)


@dataclass(eq=False)
class _Search:
    """The order in which effects are added, dropped and exchanged."""

    trials: Trials
    tried: tuple[Tried, ...] = ()

    def outcome(self, base: Hypothesis) -> Outcome:
        start = self.trials.comparison.coarsely(base)
        revision = Revision(self.trials, start)
        steps = revision.simplified(revision.backward(self._forward(start)))
        steps = self._explaining(start, steps)
        last = self._fitted_to_all(start, steps)
        skipped = tuple(dict.fromkeys(self.trials.skipped))
        if last is None:
            return Outcome(base, (), self.tried, is_complete(self.trials.on_all(start)), skipped)
        steps = revision.weighed(steps)
        done = self.trials.excesses_of(last)
        return Outcome(last, tuple(steps), self.tried, is_complete(done), skipped)

    def _fitted_to_all(self, start: Hypothesis, steps: list[Step]) -> Hypothesis | None:
        """Return the last hypothesis fitted to all samples, without effects whose numbers fail there."""
        while steps:
            self.trials.progress("fitting what was named to all samples")
            last = self.trials.comparison.polished(steps[-1].chosen)
            words = objections_of_all(self.trials.criteria, last)
            if not any(words):
                return last
            for step, why in zip(steps, words, strict=True):
                reason = f"on all samples {'; '.join(why)}"
                added = step.chosen.newest
                self.trials.skipped += [Skipped(added.effect, added.location, (), reason)] if why else []
            kept = [step for step, why in zip(steps, words, strict=True) if not why]
            steps[:] = Revision(self.trials, start).rebuilt(kept)
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
        return Revision(self.trials, start).rebuilt(kept)

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
            steps = Revision(self.trials, start).enriched(steps + further)
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
            if (again := same_again(self.trials, one, other.newest)) is not None
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


def _with_objection(tried: Tried, why: Mapping[tuple[str, str], str]) -> Tried:
    """Return what was tried with the reason why its effect was dropped again, if it was."""
    reason = why.get((tried.candidate.effect, tried.candidate.location))
    return replace(tried, objections=(reason,)) if reason and not tried.objections else tried
