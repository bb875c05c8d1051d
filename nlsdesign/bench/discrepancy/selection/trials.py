"""Trials of candidates on a hypothesis: what is fitted, and what the rule says of it."""

from __future__ import annotations

import math
from collections.abc import Callable, Collection, Iterable, Mapping, Sequence
from dataclasses import dataclass, field, replace

from ....foundation.errors import ConvergenceError
from ....foundation.work_sharing import parallel_map
from ....model.structure import MovingBody
from ..effects.effect import Candidate, EffectFunction
from .comparison import Comparison
from .criteria import Change, Criteria, Rival, choose, imitates, next_name
from .hypothesis import Hypothesis, excesses
from .measures import DECLARED, Excesses, Gain, explained, gain, gains_by_record, standing_of, total_excess

_LOOKED_AT_TWICE = 4
"""So many of the best are judged on all samples where the coarse look sees nothing open."""
_UNKNOWN_GAIN = Gain(math.nan, math.nan, math.nan)


@dataclass(frozen=True, eq=False)
class Step:
    """One effect that was added."""

    chosen: Hypothesis  # hypothesis with the effect in it
    block: str  # of whose excess it explains most
    share: float  # that share of what was left there before
    # distance, next_name: how many times as much the best other name leaves, natural logarithm; that name
    distance: float = 0.0
    next_name: str = ""
    # gain, gains: what prediction gains by it, over all records and on each
    gain: Gain = _UNKNOWN_GAIN
    gains: Mapping[str, float] = field(default_factory=dict)
    # equals: hypotheses with another last effect, or that at another place, that predict as well
    equals: tuple[Hypothesis, ...] = ()

    @property
    def effect(self) -> str:
        """Identifier of what was added."""
        return self.chosen.newest.effect

    @property
    def aliases(self) -> tuple[str, ...]:
        """Identifiers of what predicts as well, with the place where that alone differs."""
        added = (each.newest for each in self.equals)
        return tuple(a.effect if a.effect != self.effect else f"{a.effect} at {a.location}" for a in added)


def without_twins(step: Step, bodies: Iterable[MovingBody]) -> Step:
    """Return a step without the same effect on what a rigid gear turns with its body: the same machine."""
    leads = {name: body.name for body in bodies for name in (body.name, *body.geared)}

    def named_at(hypothesis: Hypothesis) -> tuple[str, str]:
        newest = hypothesis.newest
        return newest.effect, leads.get(newest.location, newest.location)

    return replace(step, equals=tuple(h for h in step.equals if named_at(h) != named_at(step.chosen)))


@dataclass(frozen=True, eq=False)
class Tried:
    """A candidate that was fitted beside nothing else, and why it was not named."""

    hypothesis: Hypothesis  # fitted with it
    share: float  # share of the whole excess that it explains alone
    objections: tuple[str, ...]  # clauses of the rule that speak against it; empty for one that may be named
    # undecided: whether it explains what is missing, but the records do not determine its numbers
    undecided: bool = False

    @property
    def candidate(self) -> Candidate:
        """The effect at its place."""
        return self.hypothesis.newest


@dataclass(frozen=True)
class Skipped:
    """A candidate that was left out of the comparison."""

    effect: str
    location: str
    beside: tuple[str, ...]  # effects that had been added before
    reason: str  # too expensive, or not converged

    def __str__(self) -> str:
        beside = f" beside {' and '.join(self.beside)}" if self.beside else ""
        return f"{self.effect} at {self.location}{beside}: {self.reason}"


@dataclass(eq=False)
class Trials:
    """Fits candidates on all cores, asks the rule, and keeps account of what could not be fitted."""

    comparison: Comparison  # fits hypotheses to the records
    catalogue: Sequence[EffectFunction]  # effects to try
    criteria: Criteria
    progress: Callable[[str], None]  # told what is being tried
    skipped: list[Skipped] = field(default_factory=list)  # what could not be compared, and why
    # on_other_records: what hypotheses leave over on records that are left out as a whole, as far as that was
    # asked
    on_other_records: dict[Hypothesis, Excesses] = field(default_factory=dict)

    def excesses_of(self, hypothesis: Hypothesis) -> Excesses:
        """Return what a hypothesis leaves over, block by block."""
        return excesses(hypothesis, self.comparison.bench, self.criteria)

    def on_all(self, hypothesis: Hypothesis) -> Excesses:
        """Return what a hypothesis leaves over on all samples, its numbers as they are."""
        return self.excesses_of(self.comparison.on_all_samples(hypothesis))

    def candidates(self, present: Hypothesis) -> list[Candidate]:
        """Return what the catalogue has to offer beside what is named already."""
        return [c for effect in self.catalogue for c in effect(present.assembly)]

    def tried_on(
        self, present: Hypothesis, block: str, done: Sequence[Hypothesis], *, far: bool
    ) -> list[Hypothesis]:
        """Return fits of the candidates that act on a block and were not tried before.

        What takes long is tried only where nothing else explains the block down to its noise, and where more
        is left than the inexact form of an effect leaves.
        """
        known = {(h.newest.effect, h.newest.location) for h in done}
        tasks = [(present, c) for c in self.candidates(present) if (c.effect, c.location) not in known]
        wanted = () if block == DECLARED else (block,)
        quick = self.fits([task for task in tasks if not task[1].strategy.takes_long], wanted)
        long = [task for task in tasks if task[1].strategy.takes_long]
        if reason := self._why_not_long(present, quick, block, far=far):
            self.skipped += [Skipped(c.effect, c.location, present.names, reason) for _, c in long]
            return quick
        return quick + self.fits(long, wanted)

    def _why_not_long(
        self, present: Hypothesis, quick: Sequence[Hypothesis], block: str, *, far: bool
    ) -> str:
        """Return why what takes long is not tried; empty if it is."""
        if not far:
            leave = "leaves" if len(present.names) == 1 else "leave"
            return f"takes long, and {' and '.join(present.names)} {leave} little in the block"
        step = self.step(present, quick, block)
        if step is not None and not self.excesses_of(step.chosen)[block].open:
            return f"takes long, and {step.effect} explains the block down to its noise"
        return ""

    def fits(
        self, tasks: Sequence[tuple[Hypothesis, Candidate]], wanted: Collection[str] = ()
    ) -> list[Hypothesis]:
        """Return fits in the order of the tasks; what cannot be fitted is in :attr:`skipped`.

        ``wanted``: blocks of which a candidate must touch one; empty for any.
        """
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

    def step(self, present: Hypothesis, fresh: Sequence[Hypothesis], block: str) -> Step | None:
        """Return the best of fresh fits; what is too weak for the coarse look is judged on all samples."""
        before, left = self.excesses_of(present), {h: self.excesses_of(h) for h in fresh}
        if not before[block].open:
            best = sorted(fresh, key=lambda h: total_excess(left[h]))[:_LOOKED_AT_TWICE]
            # In the order of the catalogue, which decides among what cannot be told apart.
            before, left = self.on_all(present), {h: self.on_all(h) for h in fresh if h in best}
        return self.sound(present, before, left, block)

    def sound(
        self, present: Hypothesis, before: Excesses, tried: Mapping[Hypothesis, Excesses], block: str
    ) -> Step | None:
        """Return the best of some hypotheses that also predicts whole records and stands on all samples."""
        left, unknown = dict(tried), list[Rival[Hypothesis]]()
        while step := self._chosen(before, left, block):
            rival = rival_of(step.chosen, left.pop(step.chosen))
            if any(imitates(self.criteria, rival, each, block) for each in unknown):
                return None
            if not self.predicts_records(present, step.chosen):
                continue
            if self._stands_on_all(step.chosen):
                return step
            unknown.append(rival)
        return None

    def _stands_on_all(self, chosen: Hypothesis) -> bool:
        """Tell whether the numbers of the newest effect stand when they are fitted to all samples."""
        newest = chosen.newest
        try:
            fits = self.comparison.polished(chosen).fits.values()
            why = self.criteria.objections_of_numbers(standing_of(newest.unknowns, fits))
        except ConvergenceError as error:
            why = [error.rule]  # it cannot be named, but others may
        if why:
            reason = f"on all samples {'; '.join(why)}"
            self.skipped.append(Skipped(newest.effect, newest.location, chosen.names[:-1], reason))
        return not why

    def predicts_records(self, present: Hypothesis, chosen: Hypothesis) -> bool:
        """Tell whether an effect predicts whole records that its numbers were not fitted to."""
        for each in (present, chosen):
            if each not in self.on_other_records:
                again = self.comparison.without_whole_records(each)
                self.on_other_records[each] = self.excesses_of(again)
        before, after = self.on_other_records[present], self.on_other_records[chosen]
        return Change(self.criteria, before, after).predicts_records

    def _chosen(self, before: Excesses, tried: Mapping[Hypothesis, Excesses], block: str) -> Step | None:
        """Return the best of some hypotheses, by what each leaves."""
        rivals = [rival_of(h, after) for h, after in tried.items()]
        choice = choose(self.criteria, before, rivals, block)
        if choice is None:
            return None
        distance, name = next_name(self.criteria, choice, rivals, block)
        return replace(
            self.made(before, choice.taken, block),
            distance=distance,
            next_name=name,
            equals=tuple(r.hypothesis for r in choice.equals),
        )

    def made(self, before: Excesses, rival: Rival[Hypothesis], block: str) -> Step:
        """Return a step with what it gains.

        ``block``: where something is lacking; where it explains most stands in the step.
        """
        shares = explained(before, rival.excesses) or {block: 0.0}
        most = max(shares, key=lambda name: (shares[name], name == block))
        gained, gains = gain(before, rival.excesses), gains_by_record(before, rival.excesses)
        return Step(rival.hypothesis, most, shares[most], gain=gained, gains=gains)


def account(trials: Trials, present: Hypothesis, tried: Sequence[Hypothesis]) -> tuple[Tried, ...]:
    """Return how far each effect goes alone and what speaks against it, the best first."""
    before = trials.excesses_of(present)
    whole, every = max(total_excess(before), 1.0), []
    for each in tried:
        after = trials.excesses_of(each)
        rival = rival_of(each, after)
        words = rival.objections(trials.criteria, before)
        if each in trials.on_other_records and not trials.predicts_records(present, each):
            words = (*words, "it does not predict records that are left out as a whole")
        share = 1.0 - total_excess(after) / whole
        every.append(Tried(each, share, words, rival.is_undecided(trials.criteria, before)))
    return tuple(sorted(every, key=lambda each: -each.share))


def rival_of(hypothesis: Hypothesis, after: Excesses) -> Rival[Hypothesis]:
    """Return a hypothesis as the rule sees it."""
    newest = hypothesis.newest
    return Rival(
        hypothesis,
        newest.effect,
        len(hypothesis.unknowns),
        after,
        standing_of(newest.unknowns, hypothesis.fits.values()),
        newest.simpler,
        newest.location,
    )
