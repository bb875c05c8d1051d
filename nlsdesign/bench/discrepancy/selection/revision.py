"""What was added to a hypothesis looked at again: dropped, in a richer form, in a simpler one."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, field, replace

from ....foundation.errors import ConvergenceError
from ..effects.candidate import Candidate
from .criteria import Criteria, is_complete, is_superfluous, objections_of_numbers
from .hypothesis import Hypothesis
from .measures import gain, gains_by_record
from .standing import standing_of
from .trials import Step, Trials, rival_of


@dataclass(frozen=True, eq=False)
class Revision:
    """Builds steps anew from where they began, and keeps what the rule prefers."""

    trials: Trials
    start: Hypothesis
    _fewer: dict[tuple[Step, ...], list[Step]] = field(default_factory=dict, repr=False)

    def weighed(self, steps: list[Step]) -> list[Step]:
        """Return the steps with what prediction gains by each effect beside all others that are named.

        A step says what it gained when it was added. What was added later may have taken most of that over.
        """
        if len(steps) < 2:
            return steps
        every = self.trials.excesses_of(steps[-1].chosen)
        weighed = list[Step]()
        for place, step in enumerate(steps):
            fewer = self._without(steps, place)
            if fewer:
                without = self.trials.excesses_of(fewer[-1].chosen)
                step = replace(step, gain=gain(without, every), gains=gains_by_record(without, every))
            weighed.append(step)
        return weighed

    def _without(self, steps: Sequence[Step], place: int) -> list[Step]:
        """Return the steps anew without one of them; nothing if one of the others no longer fits."""
        kept = tuple(step for k, step in enumerate(steps) if k != place)
        if place == len(steps) - 1:
            return list(kept)
        if kept not in self._fewer:
            self._fewer[kept] = self.rebuilt(kept)
        return list(self._fewer[kept])

    def backward(self, steps: list[Step]) -> list[Step]:
        """Drop the effects that later ones have made superfluous, the first added first."""
        place = 0
        while len(steps) > 1 and place < len(steps) - 1:
            self.trials.progress(f"trying without {steps[place].effect}")
            fewer = self._without(steps, place)
            if fewer and self._is_superfluous(fewer, steps):
                steps = self.enriched(fewer)
            else:
                place += 1
        return steps

    def enriched(self, steps: list[Step]) -> list[Step]:
        """Put a richer form of an effect in its place where it leaves much less.

        A form of the same effect with more numbers is one too. Beside effects that were not named yet the
        simpler form may have done.
        """
        if len(steps) < 2 or is_complete(self.trials.excesses_of(steps[-1].chosen)):
            return steps

        def is_better(richer: list[Step], now: list[Step]) -> bool:
            words = objections_of_all(self.trials.criteria, richer[-1].chosen)
            return not any(words) and not self._is_superfluous(now, richer)

        return self._exchanged(steps, _is_richer, is_better)

    def simplified(self, steps: list[Step]) -> list[Step]:
        """Put a simpler form of an effect in its place where that predicts about as well.

        Before the other effects were named, the richer form may have stood for a part of them.
        """
        if len(steps) < 2:
            return steps
        return self._exchanged(
            steps,
            lambda candidate, named: (
                candidate.effect in named.simpler and candidate.location == named.location
            ),
            self._is_superfluous,
        )

    def _exchanged(
        self,
        steps: list[Step],
        fits: Callable[[Candidate, Candidate], bool],
        is_better: Callable[[list[Step], list[Step]], bool],
    ) -> list[Step]:
        """Try what fits in the place of each step, and keep it where it is better."""
        for place in range(len(steps)):
            before = steps[place - 1].chosen if place else self.start
            for candidate in self.trials.candidates(before):
                if fits(candidate, steps[place].chosen.newest):
                    self.trials.progress(f"trying {candidate.effect} in place of {steps[place].effect}")
                    other = self.rebuilt(steps, {place: candidate})
                    if other and is_better(other, steps):
                        steps = other
        return steps

    def _is_superfluous(self, without: list[Step], with_it: list[Step]) -> bool:
        after = (self.trials.excesses_of(each[-1].chosen) for each in (without, with_it))
        return is_superfluous(self.trials.criteria, *after)

    def rebuilt(self, steps: Sequence[Step], changed: Mapping[int, Candidate] | None = None) -> list[Step]:
        """Return the steps anew, some perhaps changed; nothing if one of them no longer fits."""
        present, rebuilt = self.start, list[Step]()
        for place, step in enumerate(steps):
            candidate = same_again(self.trials, present, (changed or {}).get(place, step.chosen.newest))
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


def same_again(trials: Trials, hypothesis: Hypothesis, wanted: Candidate) -> Candidate | None:
    """Return the same form of an effect at the same kind of place of another assembly."""
    same = [
        c for c in trials.candidates(hypothesis) if c.effect == wanted.effect and _kinds(c) == _kinds(wanted)
    ]
    ends = [c for c in same if c.location.split(".")[-1] == wanted.location.split(".")[-1]]
    return next(iter(ends or same), None)


def objections_of_all(criteria: Criteria, last: Hypothesis) -> list[list[str]]:
    """Return what the numbers of each effect have against it, all effects together."""
    return [
        objections_of_numbers(criteria, standing_of(each.unknowns, last.fits.values())) for each in last.added
    ]


def _kinds(candidate: Candidate) -> list[str]:
    """Return what the numbers of a candidate are, wherever it stands: forms of one effect differ in that."""
    return [unknown.name.rpartition(".")[2] for unknown in candidate.unknowns]


def _is_richer(candidate: Candidate, named: Candidate) -> bool:
    """Tell whether a candidate is a richer form of what is named, at its place."""
    more = candidate.effect == named.effect and len(candidate.unknowns) > len(named.unknowns)
    return (more or named.effect in candidate.simpler) and candidate.location == named.location
