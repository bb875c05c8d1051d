"""The search for what is missing: effects are added while a block stays open, dropped when superfluous."""

from __future__ import annotations

import itertools
from collections.abc import Callable, Collection, Sequence
from dataclasses import dataclass, replace

from ...errors import ConvergenceError
from ...parallel import parallel_map
from ..effects.candidate import Candidate, Effect
from .comparison import Comparison
from .excess import DECLARED, Excess, excesses, explained, total_excess
from .hypothesis import Hypothesis

LEAST_SHARE = 0.5
"""An effect must explain this share of the excess of some open block, on fit and on held-out records."""
LEAST_SECOND = 0.05
"""A further effect must explain this share of what that block lacked at first: forms are never exact."""
CLOSED_SHARE = 0.75
"""A block of which so much is explained counts as named, even if its form is not quite right."""
SAME = 0.02
"""A simpler hypothesis is taken if its excess is more by less than this share of the first excess."""
ALIAS = 0.003
"""Hypotheses whose excess differs by less than this share of the first excess cannot be told apart."""
_NOISE = 50.0
_MOST_EFFECTS, _MOST_ROUGH = 3, 2
"""Where a body coasts a third effect takes minutes to look for, and would rest on what is not quite right."""
_PAIRED = 4
"""Where no effect helps alone, so many of the best are tried in pairs; so many are looked at twice."""


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
        return self.chosen.added[-1].effect


@dataclass(frozen=True, eq=False)
class Outcome:
    """What the search ended with.

    Parameters
    ----------
    last
        Hypothesis with everything that was found, fitted to all samples.
    steps
        One for each effect.
    ranking
        What was tried first, with the share of the whole excess that each explains alone.
    explained
        Whether that accounts for every block that was open.
    """

    last: Hypothesis
    steps: tuple[Step, ...]
    ranking: tuple[tuple[Candidate, float], ...]
    explained: bool


def search(
    comparison: Comparison, base: Hypothesis, catalogue: Sequence[Effect], progress: Callable[[str], None]
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
    seeker = _Seeker(comparison, catalogue, progress)
    start = comparison.coarsely(base)
    first = excesses(start, comparison.bench)
    steps, ranking = seeker.forward(start)
    steps = seeker.backward(start, steps)
    if not steps:
        return Outcome(base, (), ranking, not any(e.open for e in first.values()))
    progress("fitting what was found to all samples")
    last = comparison.polished(steps[-1].chosen)
    found = excesses(steps[-1].chosen, comparison.bench)
    return Outcome(last, tuple(steps), ranking, is_explained(first, found))


class _Seeker:
    """Tries candidates on hypotheses, on all cores."""

    def __init__(
        self, comparison: Comparison, catalogue: Sequence[Effect], progress: Callable[[str], None]
    ) -> None:
        self._comparison, self._catalogue, self._progress = comparison, catalogue, progress

    def forward(self, start: Hypothesis) -> tuple[list[Step], tuple[tuple[Candidate, float], ...]]:
        """Return the effects that help, one after the other, and how far each goes alone."""
        bench = self._comparison.bench
        first = before = excesses(start, bench)
        steps: list[Step] = []
        ranking: tuple[tuple[Candidate, float], ...] = ()
        present = start
        while (lacking := self._lacking(start, present)) and len(steps) < _most(present):
            tried: list[Hypothesis] = []
            step = None
            for block in lacking:
                # Effects elsewhere wait for their turn: most blocks have an effect of their own.
                fresh = self._tried(present, block, tried)
                tried += fresh
                step = self._step(start, present, fresh, block)
                if step is not None:
                    break
            ranking = ranking or _ranked(self._comparison, before, tried)
            steps += [step] if step else self._pair(tried, (first, before), lacking[0])
            if not steps or steps[-1].chosen is present:
                break
            present = steps[-1].chosen
            before = excesses(present, bench)
        return steps, ranking

    def _step(
        self, start: Hypothesis, present: Hypothesis, fresh: Sequence[Hypothesis], block: str
    ) -> Step | None:
        """Return the best of fresh fits; what is too weak for the coarse look is judged on all samples."""
        bench = self._comparison.bench
        first, before = excesses(start, bench), excesses(present, bench)
        if before[block].open:
            return _best_step(self._comparison, (first, before), fresh, block)
        full = self._comparison.on_all_samples
        best = sorted(fresh, key=lambda h: sum(excesses(h, bench)[block].chi2))[:_PAIRED]
        sharp = [full(h) for h in best]
        seen = {id(f): h for f, h in zip(sharp, best, strict=True)}
        known = excesses(full(start), bench), excesses(full(present), bench)
        found = _best_step(self._comparison, known, sharp, block)
        return replace(found, chosen=seen[id(found.chosen)]) if found else None

    def backward(self, start: Hypothesis, steps: list[Step]) -> list[Step]:
        """Drop the effects that later ones have made superfluous, the first added first."""
        bench, place = self._comparison.bench, 0
        first = excesses(start, bench)
        while len(steps) > 1 and place < len(steps) - 1:
            self._progress(f"trying without {steps[place].effect}")
            rest = [s for k, s in enumerate(steps) if k != place]
            fewer = self._rebuilt(start, rest)
            enough = total_excess(excesses(steps[-1].chosen, bench)) + SAME * total_excess(first) + _NOISE
            if fewer and total_excess(excesses(fewer[-1].chosen, bench)) <= enough:
                steps = fewer
            else:
                place += 1
        return steps

    def _lacking(self, start: Hypothesis, present: Hypothesis) -> list[str]:
        """Return the blocks that lack enough for a further effect to count, the largest excess first.

        Strained numbers count only where no block does.
        """
        bench, full = self._comparison.bench, self._comparison.on_all_samples
        first, now = excesses(full(start), bench), excesses(full(present), bench)
        # Where a body coasts, predictions are never exact: what is closed is not searched for more.
        least = 1.0 - CLOSED_SHARE if present.rough else LEAST_SECOND
        lack = [n for n, e in now.items() if e.open and sum(e.excess) >= least * sum(first[n].excess)]
        blocks = sorted((n for n in lack if n != DECLARED), key=lambda n: -sum(now[n].excess))
        return blocks or lack

    def _candidates(self, present: Hypothesis) -> list[Candidate]:
        return [c for effect in self._catalogue for c in effect(present.assembly)]

    def _tried(self, present: Hypothesis, block: str, done: Sequence[Hypothesis]) -> list[Hypothesis]:
        """Return fits of the candidates that act on a block and were not tried before."""
        known = {(h.added[-1].effect, h.added[-1].location) for h in done}
        tasks = [(present, c) for c in self._candidates(present) if (c.effect, c.location) not in known]
        return self._fits(tasks, () if block == DECLARED else (block,))

    def _fits(
        self, tasks: Sequence[tuple[Hypothesis, Candidate]], wanted: Collection[str] = ()
    ) -> list[Hypothesis]:
        # What takes longest begins first, so that no core waits for it at the end.
        order = sorted(range(len(tasks)), key=lambda number: tasks[number][1].sketch is None)

        def fitted(place: int) -> Hypothesis | ConvergenceError | None:
            try:
                return self._comparison.with_effect(*tasks[order[place]], wanted)
            except ConvergenceError as error:
                return error  # no response anywhere near its starts, or too dear: it explains nothing

        found = {}
        for number, one in zip(order, parallel_map(fitted, len(tasks)), strict=True):
            candidate = tasks[number][1]
            self._progress(f"trying {candidate.effect} at {candidate.location}")
            if isinstance(one, ConvergenceError):
                self._progress(f"left out: {one}")
            elif one:
                found[number] = one
        return [found[number] for number in sorted(found)]

    def _pair(
        self, tried: Sequence[Hypothesis], known: tuple[dict[str, Excess], dict[str, Excess]], block: str
    ) -> list[Step]:
        """Return two effects that help together where none helps alone."""
        bench = self._comparison.bench
        best = sorted(tried, key=lambda h: total_excess(excesses(h, bench)))[:_PAIRED]
        tasks = [
            (one, again)
            for one, other in itertools.combinations(best, 2)
            for again in [self._again(one, other.added[-1])]
            if again is not None
        ]
        pairs = self._fits(tasks)
        step = _best_step(self._comparison, known, pairs, block)
        if step is None:
            return []
        lone = next(h for h in best if h.added[-1].effect == step.chosen.added[-2].effect)
        before = known[1]
        return [Step(lone, *_best_shares(before, excesses(lone, bench))), step]

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
        bench, present, found = self._comparison.bench, start, []
        for step in steps:
            candidate = self._again(present, step.chosen.added[-1])
            if candidate is None:
                return []
            try:
                later = self._comparison.with_effect(present, candidate)
            except ConvergenceError:
                return []
            if later is None:
                return []
            before, after = excesses(present, bench), excesses(later, bench)
            found.append(Step(later, *_best_shares(before, after), step.equals))
            present = later
        return found


def _best_step(
    comparison: Comparison,
    known: tuple[dict[str, Excess], dict[str, Excess]],
    tried: Sequence[Hypothesis],
    block: str,
) -> Step | None:
    """Return the simplest of the hypotheses that leave least in a block, without spoiling another."""
    first, before = known
    looks = [(h, excesses(h, comparison.bench)) for h in tried]
    able = [(h, after) for h, after in looks if _helps(first, before, after)]
    if not able:
        return None

    def left(after: dict[str, Excess]) -> float:
        spoilt = sum(max(0.0, sum(e.excess) - sum(before[n].excess)) for n, e in after.items() if n != block)
        return sum(after[block].excess) + spoilt

    least, whole = min(left(after) for _, after in able), sum(before[block].excess)
    equal = [(h, after) for h, after in able if left(after) <= least + SAME * whole + _NOISE]
    chosen, after = min(equal, key=lambda pair: (len(pair[0].added[-1].unknowns), total_excess(pair[1])))
    size = len(chosen.added[-1].unknowns)
    limits = left(after) + ALIAS * whole + _NOISE, total_excess(after) + ALIAS * whole + _NOISE
    alike = {
        h.added[-1].effect: (h, other)
        for h, other in reversed(equal)
        if len(h.added[-1].unknowns) <= size and left(other) <= limits[0] and total_excess(other) <= limits[1]
    }
    # Among what cannot be told apart the order of the catalogue decides, not the last digits of a fit.
    chosen, after = alike.pop(next(reversed(alike)))
    return Step(chosen, *_best_shares(before, after), tuple(h for h, _ in alike.values()))


def _most(present: Hypothesis) -> int:
    return _MOST_ROUGH if present.rough else _MOST_EFFECTS


def _best_shares(before: dict[str, Excess], after: dict[str, Excess]) -> tuple[float, float]:
    """Return the share explained on fitted and on held-out records, of the block that gains most."""
    shares = explained(before, after)
    if not shares:
        return 0.0, 0.0
    block = max(shares, key=lambda name: shares[name])
    pairs = zip(before[block].excess, after[block].excess, strict=True)
    fitted, held = (1.0 - b / a if a > 0.0 else 1.0 for a, b in pairs)
    return fitted, held


def _helps(first: dict[str, Excess], before: dict[str, Excess], after: dict[str, Excess]) -> bool:
    """Tell whether an effect explains enough of some open block without spoiling the whole."""
    if total_excess(after) >= total_excess(before):
        return False
    for name, share in explained(before, after).items():
        gone = sum(before[name].excess) - sum(after[name].excess)
        if share >= LEAST_SHARE and gone >= LEAST_SECOND * sum(first[name].excess):
            return True
    return False


def _ranked(
    comparison: Comparison, before: dict[str, Excess], tried: Sequence[Hypothesis]
) -> tuple[tuple[Candidate, float], ...]:
    whole = max(total_excess(before), 1.0)
    shares = [(h.added[-1], 1.0 - total_excess(excesses(h, comparison.bench)) / whole) for h in tried]
    return tuple(sorted(shares, key=lambda pair: -pair[1]))


def is_explained(first: dict[str, Excess], last: dict[str, Excess]) -> bool:
    """Tell whether what was found accounts for every block that was open.

    Declared numbers that stay strained are no objection where a block was open: they are said in ``where``.

    Parameters
    ----------
    first, last
        Of the refitted declared model and of the last hypothesis.
    """
    shares = explained(first, last)
    if len(shares) > 1:
        shares.pop(DECLARED, None)
    return all(not last[name].open or share >= CLOSED_SHARE for name, share in shares.items())
