"""The search for what is missing: effects are added while a block stays open, dropped when superfluous.

What is tried, and in which order; :mod:`.trials` fits it, :mod:`.criteria` decides. What was added is looked
at again: can it be dropped, is a richer form of it better, is a simpler one as good? Last comes what has no
name: a smooth, passive table in place of an effect, if it predicts what it has not seen.
"""

from __future__ import annotations

import itertools
import math
from collections.abc import Callable, Iterator, Mapping, Sequence
from dataclasses import dataclass, field, replace
from typing import TypeAlias

from ....foundation.errors import ConvergenceError
from ..effects.effect import Candidate, EffectFunction
from ..effects.unnamed_tables import unnamed_part
from .comparison import Comparison
from .criteria import Change, Criteria, is_complete, lacking, predict_alike
from .hypothesis import Hypothesis, excesses
from .measures import Standing, explained, gain, gains_by_record, standing_of, total_excess
from .trials import Skipped, Step, Trials, Tried, account, rival_of


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

    def sound(self, steps: list[Step]) -> list[Step]:
        """Drop the effects that do not hold every clause beside all others, the last added first.

        A fault of a sensor that bends a reading leaves too where a smooth law of what is read does as much.
        """
        place, excesses_of = len(steps) - 1, self.trials.excesses_of
        while len(steps) > 1 and place >= 0:
            if fewer := self._without(steps, place):
                without, every = fewer[-1].chosen, steps[-1].chosen
                added = every.added[place]
                # Its numbers are asked on all samples.
                change = Change(self.trials.criteria, excesses_of(without), excesses_of(every))
                why = list(change.objections(Standing()))
                if added.bends_reading and self._is_smooth_law(steps, place, without):
                    why.append("a smooth law of what is read explains as much")
                if why:
                    reason = "; ".join(why)
                    self.trials.skipped.append(Skipped(added.effect, added.location, without.names, reason))
                    steps, place = fewer, len(fewer)
            place -= 1
        return steps

    def _is_smooth_law(self, steps: Sequence[Step], place: int, fewer: Hypothesis) -> bool:
        """Tell whether a table over the motion does what a sensor's fault does, beside a named law."""
        block, sensors = steps[place].block, fewer.assembly.sensors()
        laws = [s for s in steps if s.block == block and s.chosen.newest.location not in sensors]
        fit = next((f for names, f in fewer.fits.items() if block in names), None)
        comparison = self.trials.comparison
        table = unnamed_part(fewer.assembly, fit, comparison.bench, block) if laws and fit else None
        try:
            smooth = comparison.with_effect(fewer, table) if table else None
        except ConvergenceError:
            return False
        if smooth is None:
            return False
        law, fault = (self.trials.excesses_of(h)[block].excess for h in (smooth, steps[-1].chosen))
        return law <= self.trials.criteria.equal * fault

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

    def with_richer(self, steps: Sequence[Step]) -> Iterator[list[Step]]:
        """Yield the steps anew, in each case with a richer form of one effect."""
        for place, step in enumerate(steps):
            before = steps[place - 1].chosen if place else self.start
            for candidate in self.trials.candidates(before):
                if _is_richer(candidate, step.chosen.newest):
                    self.trials.progress(f"trying {candidate.effect} in place of {step.effect}")
                    if other := self.rebuilt(steps, {place: candidate}):
                        yield other

    def _is_superfluous(self, without: list[Step], with_it: list[Step]) -> bool:
        after = (self.trials.excesses_of(each[-1].chosen) for each in (without, with_it))
        return Change(self.trials.criteria, *after).is_superfluous()

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
            rebuilt.append(
                replace(made, distance=step.distance, next_name=step.next_name, equals=step.equals)
            )
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
        criteria.objections_of_numbers(standing_of(each.unknowns, last.fits.values())) for each in last.added
    ]


def _kinds(candidate: Candidate) -> list[str]:
    """Return what the numbers of a candidate are, wherever it stands: forms of one effect differ in that."""
    return [unknown.name.rpartition(".")[2] for unknown in candidate.unknowns]


def _is_richer(candidate: Candidate, named: Candidate) -> bool:
    """Tell whether a candidate is a richer form of what is named, at its place."""
    more = candidate.effect == named.effect and len(candidate.unknowns) > len(named.unknowns)
    return (more or named.effect in candidate.simpler) and candidate.location == named.location


_MOST_EFFECTS_IN_FREE_FLIGHT = 2
"""Effects that are looked for where a body flies freely: a third takes minutes, and rests on less."""
_LEADERS, _PARTNERS = 2, 6
"""Where no effect may be named alone, each of so many of the best is tried together with others among so many
of the best; these pairs take about as long as the catalogue did."""


@dataclass(frozen=True, eq=False)
class Outcome:
    """What the search ended with."""

    last: Hypothesis  # hypothesis with everything that may be named, fitted to all samples
    steps: tuple[Step, ...] = ()  # one for each effect
    tried: tuple[Tried, ...] = ()  # what was tried first, the best first
    complete: bool = False  # whether nothing is left beyond the noise
    skipped: tuple[Skipped, ...] = ()  # what could not be compared, and why
    stopped: bool = False  # whether the search was given up for one that reads the records otherwise


Stop: TypeAlias = Callable[[Hypothesis], bool]
"""Tells beside which names a search is given up."""


def never(hypothesis: Hypothesis) -> bool:
    """Let a search go on to its end."""
    return False


def search(
    comparison: Comparison,
    base: Hypothesis,
    catalogue: Sequence[EffectFunction],
    criteria: Criteria,
    progress: Callable[[str], None],
    *,
    stop: Stop = never,
) -> Outcome:
    """Add effects to a hypothesis while a block stays open and one may be named."""
    return _Search(Trials(comparison, catalogue, criteria, progress), stop).outcome(base)


@dataclass(eq=False)
class _Search:
    """The order in which effects are added, dropped and exchanged."""

    trials: Trials
    stop: Stop = never  # asked beside what is named so far
    tried: tuple[Tried, ...] = ()
    stopped: bool = False

    def outcome(self, base: Hypothesis) -> Outcome:
        start = self.trials.comparison.coarsely(base)
        revision = Revision(self.trials, start)
        # The order matters. What is dropped need not be simplified, and a simpler form can only be judged
        # beside the effects that stay. Only then is it known what all of them leave, and whether a block
        # with much left may have a name at all. Fits to all samples are the dearest, so they come after
        # that. What each effect gains is asked of the final set, because dropping any other one changes it.
        steps = self._forward(start)
        if self.stopped:
            return Outcome(steps[-1].chosen, tuple(steps), self.tried, stopped=True)
        steps = revision.simplified(revision.backward(steps))
        steps = self._explaining(start, revision.sound(steps))
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
            # What the search began beside, such as a delay of a motion, is no name and is not asked.
            words = objections_of_all(self.trials.criteria, last)[len(start.added) :]
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
        excesses_of, criteria = self.trials.excesses_of, self.trials.criteria
        first, last = (excesses_of(each) for each in (start, steps[-1].chosen))
        left = Change(criteria, first, last).unexplained()

        def stands_out(step: Step) -> bool:
            """Tell whether an effect explains plainly more than any other, and than those in its class."""
            own = excesses_of(step.chosen)[step.block].excess
            others = (each for each in step.equals if each.newest.effect != step.effect)
            alike = (excesses_of(each)[step.block].excess / max(own, 1.0) for each in others)
            nearest = min(alike, default=math.inf)
            return criteria.is_outstanding(min(step.distance, math.log(max(nearest, 1e-300))))

        kept = [s for s in steps if s.block not in left or stands_out(s)]
        if len(kept) == len(steps):
            return steps
        shares, least = explained(first, last), criteria.closed_share
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
            further = self._further(start, present, len(steps))
            if not further:
                steps, further = self._beside_richer(start, steps)
            if not further:
                break
            # A richer form of what is named comes before one more name.
            steps = Revision(self.trials, start).enriched(steps + further)
            present = steps[-1].chosen
            self.stopped = self.stop(present)
            if self.stopped:
                break
        return steps

    def _further(self, start: Hypothesis, present: Hypothesis, named: int) -> list[Step]:
        """Return what may be named beside what is: one effect, two that only help together, or nothing."""
        open_blocks = self._lacking(start, present)
        tried: list[Hypothesis] = []
        for block in open_blocks:
            # Effects elsewhere wait for their turn: most blocks have an effect of their own.
            far = self._is_far_from_closed(start, present, block)
            tried += self.trials.tried_on(present, block, tried, far=far)
            # What acts on several blocks was fitted when the first of them was looked at.
            if step := self.trials.step(present, tried, block):
                self.tried = self.tried or account(self.trials, present, tried)
                return self._plainer(step, tried, present, block)
        if not open_blocks:
            return []
        self.tried = self.tried or account(self.trials, present, tried)
        if self._most_effects(present) - named < 2 or not self._is_far_from_closed(
            start, present, open_blocks[0]
        ):
            return []
        return self._pair(tried, present, open_blocks[0])

    def _beside_richer(self, start: Hypothesis, steps: list[Step]) -> tuple[list[Step], list[Step]]:
        """Return the steps with a richer form of one, and what may be named beside that alone.

        Alone the simpler form is named where it leaves little more, because something else is missing too.
        What it leaves may hide that. If nothing comes of it the steps stay as they are.
        """
        if not steps or not (open_blocks := self._lacking(start, steps[-1].chosen)):
            return steps, []
        if not self._is_far_from_closed(start, steps[-1].chosen, open_blocks[0]):
            return steps, []
        excesses_of, revision = self.trials.excesses_of, Revision(self.trials, start)
        richer = [
            other
            for other in revision.with_richer(steps)
            if not any(objections_of_all(self.trials.criteria, other[-1].chosen))
            and Change(
                self.trials.criteria, *(excesses_of(each[-1].chosen) for each in (steps, other))
            ).is_more_than_noise
        ]
        if not richer:
            return steps, []
        best = min(richer, key=lambda other: total_excess(excesses_of(other[-1].chosen)))
        further = self._further(start, best[-1].chosen, len(best))
        return (best, further) if further else (steps, [])

    def _is_far_from_closed(self, start: Hypothesis, present: Hypothesis, block: str) -> bool:
        """Tell whether what is left is worth a long search.

        Beside an effect that was named, what little is left over is the inexactness of its form.
        """
        first, now = (self.trials.excesses_of(each)[block] for each in (start, present))
        return not present.added or self.trials.criteria.is_far_from_closed(first, now)

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

    def _plainer(
        self, step: Step, tried: Sequence[Hypothesis], present: Hypothesis, block: str
    ) -> list[Step]:
        """Return a step, or two simpler effects that predict as well with no more numbers."""
        chosen = step.chosen.newest
        forms = {chosen.effect, *chosen.simpler}
        plain = [
            h for h in tried if h.newest.effect in chosen.simpler and h.newest.location == chosen.location
        ]
        others = [h for h in self._best_of_each(tried) if h.newest.effect not in forms][:_PARTNERS]
        room = self._most_effects(present) - len(present.added)
        tasks = [
            (one, again)
            for one, other in itertools.product(plain if room > 1 else [], others)
            if len(one.newest.unknowns) + len(other.newest.unknowns) <= len(chosen.unknowns)
            and (again := same_again(self.trials, one, other.newest)) is not None
        ]
        before = self.trials.excesses_of(present)
        fitted = [h for h in self.trials.fits(tasks) if not any(objections_of_all(self.trials.criteria, h))]
        pair = self.trials.sound(
            present, before, {h: self.trials.excesses_of(h) for h in (*fitted, step.chosen)}, block
        )
        if pair is None or pair.chosen is step.chosen:
            return [step]
        # What both leave alike is one class, with the richer form in it.
        single = rival_of(step.chosen, self.trials.excesses_of(step.chosen))
        best = rival_of(pair.chosen, self.trials.excesses_of(pair.chosen))
        alike = predict_alike(self.trials.criteria, single, best, block, lambda each: each.left_in(block))
        equals = (step.chosen,) if alike else ()
        (alone,) = {one for one, _ in tasks if one.newest.effect == pair.chosen.added[-2].effect}
        first = self.trials.made(before, rival_of(alone, self.trials.excesses_of(alone)), block)
        return [
            replace(each, distance=step.distance, next_name=step.next_name, equals=equals)
            for each in (first, pair)
        ]

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


def with_what_has_no_name(comparison: Comparison, hypothesis: Hypothesis, criteria: Criteria) -> Hypothesis:
    """Return a hypothesis with a table for what each open block leaves over, where one predicts it.

    The clauses are those of an effect that ask for prediction; no share is asked for, since nothing is named.
    What is named keeps the numbers that it was judged with.
    """
    present, named = hypothesis.with_names_held(), len(hypothesis.added)
    for block in lacking(excesses(hypothesis, comparison.bench, criteria)):
        before = excesses(present, comparison.bench, criteria)
        fit = next((f for names, f in present.fits.items() if block in names), None)
        held = {u.name for each in present.added[:named] for u in each.unknowns}
        candidate = unnamed_part(present.assembly, fit, comparison.bench, block, held) if fit else None
        if candidate is None:
            continue
        try:
            tried = comparison.with_effect(present, candidate)
        except ConvergenceError:
            continue  # the block stays open, and the verdict says so as its remainder
        if tried is None:
            continue
        after = excesses(tried, comparison.bench, criteria)
        change = Change(criteria, before, after)
        if change.is_more_than_noise and not change.records_made_worse():
            present = tried
    return present
