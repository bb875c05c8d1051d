"""The search for what is missing: one effect after the other, while a block stays open."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass

from ..errors import ConvergenceError
from .compare import Comparison, Hypothesis
from .effects.candidate import Candidate, Effect
from .locate import DECLARED, Excess, excesses, explained, total_excess

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
_MOST_EFFECTS = 3


@dataclass(frozen=True, eq=False)
class Step:
    """One effect that was added.

    Parameters
    ----------
    chosen
        Hypothesis with the effect in it.
    share_fit, share_held_out
        Share of the excess of the block that it explains best.
    aliases
        Identifiers of effects that explain as much with as few numbers.
    tried
        All hypotheses of this step.
    """

    chosen: Hypothesis
    share_fit: float
    share_held_out: float
    aliases: tuple[str, ...]
    tried: tuple[Hypothesis, ...]


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
    present, bench = comparison.coarsely(base), comparison.bench
    first = before = excesses(present, bench)
    steps: list[Step] = []
    ranking: tuple[tuple[Candidate, float], ...] = ()
    while any(e.open for e in before.values()) and len(steps) < _MOST_EFFECTS:
        tried = _tried(comparison, present, catalogue, progress)
        ranking = ranking or _ranked(comparison, before, tried)
        step = _best_step(comparison, (first, before), tried)
        if step is None:
            break
        present, steps = step.chosen, [*steps, step]
        before = excesses(present, bench)
    steps = _without_superfluous(comparison, steps, first)
    if not steps:
        return Outcome(base, (), ranking, not any(e.open for e in first.values()))
    progress("fitting what was found to all samples")
    last = comparison.polished(steps[-1].chosen)
    return Outcome(last, tuple(steps), ranking, is_explained(first, excesses(steps[-1].chosen, bench)))


def _tried(
    comparison: Comparison, present: Hypothesis, catalogue: Sequence[Effect], progress: Callable[[str], None]
) -> list[Hypothesis]:
    found = []
    for effect in catalogue:
        for candidate in effect(present.assembly):
            progress(f"trying {candidate.effect} at {candidate.location}")
            try:
                found.append(comparison.with_effect(present, candidate))
            except ConvergenceError:
                continue  # no response anywhere near its starts: it explains nothing
    return found


def _best_step(
    comparison: Comparison, known: tuple[dict[str, Excess], dict[str, Excess]], tried: Sequence[Hypothesis]
) -> Step | None:
    first, before = known
    looks = [(h, excesses(h, comparison.bench)) for h in tried]
    able = [(h, after) for h, after in looks if _helps(first, before, after)]
    if not able:
        return None
    least = min(total_excess(after) for _, after in able)
    margin = SAME * total_excess(before) + _NOISE
    equal = [(h, after) for h, after in able if total_excess(after) <= least + margin]
    chosen, after = min(equal, key=lambda pair: (len(pair[0].added[-1].unknowns), total_excess(pair[1])))
    size = len(chosen.added[-1].unknowns)
    aliases = [h.added[-1].effect for h, _ in equal if h is not chosen and len(h.added[-1].unknowns) <= size]
    return Step(chosen, *_best_shares(before, after), tuple(dict.fromkeys(aliases)), tuple(tried))


def _best_shares(before: dict[str, Excess], after: dict[str, Excess]) -> tuple[float, float]:
    """Return the share explained on fitted and on held-out records, of the block that gains most."""
    shares = explained(before, after)
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


def _without_superfluous(comparison: Comparison, steps: list[Step], first: dict[str, Excess]) -> list[Step]:
    """Drop the first effect if a later one, alone, explains as much as all of them together."""
    if len(steps) < 2:
        return steps
    bench = comparison.bench
    enough = total_excess(excesses(steps[-1].chosen, bench)) + SAME * total_excess(first) + _NOISE
    later = {s.chosen.added[-1].effect for s in steps[1:]}
    for alone in steps[0].tried:
        after = excesses(alone, bench)
        if alone.added[-1].effect in later and total_excess(after) <= enough:
            return [Step(alone, *_best_shares(first, after), (), steps[0].tried)]
    return steps


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
