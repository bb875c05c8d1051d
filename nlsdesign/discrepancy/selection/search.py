"""The search for what is missing: effects are added while a block stays open, dropped when superfluous.

What is tried, and in which order; :mod:`.criteria` decides.
"""

from __future__ import annotations

import itertools
from collections.abc import Callable, Collection, Mapping, Sequence
from dataclasses import dataclass, field

from ...errors import ConvergenceError
from ...processes import parallel_map
from ..effects.candidate import Candidate, EffectFunction
from .comparison import Comparison
from .criteria import (
    DECLARED,
    Excesses,
    Rival,
    best_shares,
    choose,
    is_explained,
    is_superfluous,
    lacking,
    most_effects,
    total_excess,
)
from .excess import excesses
from .hypothesis import Hypothesis

_PAIRED = 4
"""Where no effect helps alone, so many of the best are tried in pairs; so many are looked at twice. Six pairs
take about as long as the catalogue did."""


@dataclass(frozen=True, eq=False)
class Step:
    """One effect that was added.

    Parameters
    ----------
    chosen
        Hypothesis with the effect in it.
    share_fit, share_held_out
        Share of the excess of the block that it explains best.
    equals
        Hypotheses with another last effect that explain as much with as few numbers.
    """

    chosen: Hypothesis
    share_fit: float
    share_held_out: float
    equals: tuple[Hypothesis, ...] = ()

    @property
    def effect(self) -> str:
        """Identifier of what was added."""
        return self.chosen.newest.effect


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
        Hypothesis with everything that was named, fitted to all samples.
    steps
        One for each effect.
    ranking
        What was tried first, with the share of the whole excess that each explains alone.
    explained
        Whether that accounts for every block that was open.
    skipped
        What could not be compared, and why.
    """

    last: Hypothesis
    steps: tuple[Step, ...] = ()
    ranking: tuple[tuple[Candidate, float], ...] = ()
    explained: bool = False
    skipped: tuple[Skipped, ...] = ()


def search(
    comparison: Comparison,
    base: Hypothesis,
    catalogue: Sequence[EffectFunction],
    progress: Callable[[str], None],
) -> Outcome:
    """Add effects to a hypothesis while a block stays open and one helps.

    Parameters
    ----------
    comparison
        Fits hypotheses to the records.
    base
        Refitted declared model.
    catalogue
        Effects to try.
    progress
        Told what is being tried.
    """
    return _Search(comparison, catalogue, progress).outcome(base)


@dataclass(eq=False)
class _Search:
    """Tries candidates on hypotheses, on all cores, and keeps account of what could not be tried."""

    comparison: Comparison
    catalogue: Sequence[EffectFunction]
    progress: Callable[[str], None]
    skipped: list[Skipped] = field(default_factory=list)
    ranking: tuple[tuple[Candidate, float], ...] = ()

    def outcome(self, base: Hypothesis) -> Outcome:
        start = self.comparison.coarsely(base)
        first = self._excesses(start)
        steps = self._backward(start, self._forward(start))
        if not steps:
            return Outcome(
                base,
                (),
                self.ranking,
                not any(e.open for e in first.values()),
                tuple(dict.fromkeys(self.skipped)),
            )
        self.progress("fitting what was named to all samples")
        last = self.comparison.polished(steps[-1].chosen)
        done = is_explained(first, self._excesses(steps[-1].chosen))
        return Outcome(last, tuple(steps), self.ranking, done, tuple(dict.fromkeys(self.skipped)))

    def _excesses(self, hypothesis: Hypothesis) -> Excesses:
        return excesses(hypothesis, self.comparison.bench)

    def _forward(self, start: Hypothesis) -> list[Step]:
        """Return the effects that help, one after the other."""
        first, present, steps = self._excesses(start), start, list[Step]()
        while len(steps) < most_effects(has_free_flight=present.has_free_flight):
            open_blocks = self._lacking(start, present)
            if not open_blocks:
                break
            tried: list[Hypothesis] = []
            step = None
            for block in open_blocks:
                # Effects elsewhere wait for their turn: most blocks have an effect of their own.
                fresh = self._tried(present, block, tried)
                tried += fresh
                step = self._step(start, present, fresh, block)
                if step is not None:
                    break
            before = self._excesses(present)
            self.ranking = self.ranking or _ranked(before, {h: self._excesses(h) for h in tried})
            further = [step] if step else self._pair(tried, first, before, open_blocks[0])
            if not further:
                break
            steps += further
            present = steps[-1].chosen
        return steps

    def _backward(self, start: Hypothesis, steps: list[Step]) -> list[Step]:
        """Drop the effects that later ones have made superfluous, the first added first."""
        first, place = self._excesses(start), 0
        while len(steps) > 1 and place < len(steps) - 1:
            self.progress(f"trying without {steps[place].effect}")
            fewer = self._rebuilt(start, [s for k, s in enumerate(steps) if k != place])
            if fewer and is_superfluous(
                first, self._excesses(fewer[-1].chosen), self._excesses(steps[-1].chosen)
            ):
                steps = fewer
            else:
                place += 1
        return steps

    def _lacking(self, start: Hypothesis, present: Hypothesis) -> list[str]:
        """Return the blocks in which all samples ask for a further effect."""
        full = self.comparison.on_all_samples
        first, now = self._excesses(full(start)), self._excesses(full(present))
        return lacking(first, now, has_free_flight=present.has_free_flight)

    def _step(
        self, start: Hypothesis, present: Hypothesis, fresh: Sequence[Hypothesis], block: str
    ) -> Step | None:
        """Return the best of fresh fits; what is too weak for the coarse look is judged on all samples."""
        first, before = self._excesses(start), self._excesses(present)
        if before[block].open:
            return _chosen(first, before, {h: self._excesses(h) for h in fresh}, block)
        full = self.comparison.on_all_samples
        best = sorted(fresh, key=lambda h: sum(self._excesses(h)[block].chi2))[:_PAIRED]
        on_all = {h: self._excesses(full(h)) for h in best}
        return _chosen(self._excesses(full(start)), self._excesses(full(present)), on_all, block)

    def _candidates(self, present: Hypothesis) -> list[Candidate]:
        return [c for effect in self.catalogue for c in effect(present.assembly)]

    def _tried(self, present: Hypothesis, block: str, done: Sequence[Hypothesis]) -> list[Hypothesis]:
        """Return fits of the candidates that act on a block and were not tried before."""
        known = {(h.newest.effect, h.newest.location) for h in done}
        tasks = [(present, c) for c in self._candidates(present) if (c.effect, c.location) not in known]
        return self._fits(tasks, () if block == DECLARED else (block,))

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

    def _pair(self, tried: Sequence[Hypothesis], first: Excesses, before: Excesses, block: str) -> list[Step]:
        """Return two effects that help together where none helps alone."""
        best = sorted(tried, key=lambda h: total_excess(self._excesses(h)))[:_PAIRED]
        tasks = [
            (one, again)
            for one, other in itertools.combinations(best, 2)
            if (again := self._again(one, other.newest)) is not None
        ]
        pairs = {h: self._excesses(h) for h in self._fits(tasks)}
        step = _chosen(first, before, pairs, block)
        if step is None:
            return []
        alone = next(h for h in best if h.newest.effect == step.chosen.added[-2].effect)
        return [Step(alone, *best_shares(before, self._excesses(alone))), step]

    def _again(self, hypothesis: Hypothesis, wanted: Candidate) -> Candidate | None:
        """Return the same effect at the same kind of place of another assembly."""
        size = len(wanted.unknowns)
        same = [
            c for c in self._candidates(hypothesis) if c.effect == wanted.effect and len(c.unknowns) == size
        ]
        ends = [c for c in same if c.location.split(".")[-1] == wanted.location.split(".")[-1]]
        return next(iter(ends or same), None)

    def _rebuilt(self, start: Hypothesis, steps: Sequence[Step]) -> list[Step]:
        """Return the steps anew on another beginning; nothing if one of them no longer fits."""
        present, rebuilt = start, list[Step]()
        for step in steps:
            candidate = self._again(present, step.chosen.newest)
            if candidate is None:
                return []
            try:
                later = self.comparison.with_effect(present, candidate)
            except ConvergenceError:
                return []
            if later is None:
                return []
            shares = best_shares(self._excesses(present), self._excesses(later))
            rebuilt.append(Step(later, *shares, step.equals))
            present = later
        return rebuilt


def _chosen(
    first: Excesses, before: Excesses, tried: Mapping[Hypothesis, Excesses], block: str
) -> Step | None:
    """Return the best of some hypotheses, by what each leaves."""
    rivals = [Rival(h, h.newest.effect, len(h.newest.unknowns), after) for h, after in tried.items()]
    choice = choose(first, before, rivals, block)
    if choice is None:
        return None
    shares = best_shares(before, choice.taken.excesses)
    return Step(choice.taken.hypothesis, *shares, tuple(r.hypothesis for r in choice.equals))


def _ranked(before: Excesses, tried: Mapping[Hypothesis, Excesses]) -> tuple[tuple[Candidate, float], ...]:
    """Return how far each effect goes alone, the best first."""
    whole = max(total_excess(before), 1.0)
    shares = [(h.newest, 1.0 - total_excess(after) / whole) for h, after in tried.items()]
    return tuple(sorted(shares, key=lambda pair: -pair[1]))
