"""What to free, or which limit to move, where a design misses its target."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

from ...foundation.arrays import Array
from .design_search import Search
from .loosening import Freed, Give, Loosened

_ENOUGH = 1.0 + 1e-3


@dataclass(frozen=True)
class Remedies:
    """What was tried against a miss; each entry was solved for, not estimated.

    Parameters
    ----------
    enough
        Smallest sets of names that, freed, bring the error within what is allowed.
    better
        Single names that, freed, lower the error, best first.
    gives
        Limits that would have to move, each with what has to be freed as well (nothing, for the first kind).
    everything
        Error with all sizes free at once.
    """

    enough: tuple[Freed, ...]
    better: tuple[Freed, ...]
    gives: tuple[tuple[Give, Freed | None], ...]
    everything: Freed | None

    def sentences(self, largest: float) -> list[str]:
        """Return the advice as sentences."""
        sentences = [f"{freed}: {_percent(freed.error, largest)}" for freed in self.enough]
        for give, also in self.gives:
            sentences.append(f"{give}" + ("" if also is None else f", and {also}"))
        if sentences:
            return sentences
        if self.everything is not None and self.everything.error is not None:
            sentences.append(
                f"no size and no single limit is enough; with all sizes free "
                f"({', '.join(self.everything.names)}) {_percent(self.everything.error, largest)} is left: "
                "ask for another target, more elements or another rubber"
            )
        else:
            sentences.append(
                "no size is left to free: ask for another target, more elements or another rubber"
            )
        return sentences


def _percent(error: float | None, largest: float) -> str:
    return "" if error is None else f"{100.0 * error / largest:.2g} % of the largest torque"


def find_remedies(
    search: Search, free: Sequence[str], best: Array, *, allowed: float, error: float, binding: Sequence[int]
) -> Remedies:
    """Return what would bring a design within its target."""
    loose = Loosened(search, free, largest_error=allowed, best=best)
    assert loose.error is not None
    outcomes = loose.several([([name], [loose.error]) for name in loose.candidates])
    singles = [
        loose.freed([name], outcome)
        for name, outcome in zip(loose.candidates, outcomes, strict=True)
        if outcome.solved
    ]
    better = sorted((one for one in singles if _error(one) < 0.98 * error), key=_error)
    enough = [
        loose.designed([name], outcome)
        for name, outcome in zip(loose.candidates, outcomes, strict=True)
        if outcome.solved and _error(loose.freed([name], outcome)) <= _ENOUGH * allowed
    ]
    everything = None
    if loose.candidates and not enough:
        everything = _freed(loose, loose.candidates)
        if everything is not None and _error(everything) <= _ENOUGH * allowed:
            enough = [_smallest(loose, [one.names[0] for one in better], allowed) or everything]
    gives = () if enough else _gives(loose, binding)
    # A limit that need not give shows that freeing all sizes is enough after all.
    enough += [also for give, also in gives if also is not None and _nothing(give)][:1]
    gives = tuple((give, also) for give, also in gives if not _nothing(give))
    return Remedies(tuple(enough), tuple(better), gives, everything)


def _nothing(give: Give) -> bool:
    return give.amount <= 1e-4 * give.bound.scale


def _error(freed: Freed) -> float:
    return float("inf") if freed.error is None else freed.error


def _freed(loose: Loosened, names: Sequence[str]) -> Freed | None:
    assert loose.error is not None
    outcome = loose.least(names, [loose.error])
    return None if not outcome.solved else loose.freed(names, outcome)


def _smallest(loose: Loosened, ranked: Sequence[str], allowed: float) -> Freed | None:
    """Return the first of the best two, best three, ... names that is enough."""
    for count in range(2, len(ranked) + 1):
        kept = _freed(loose, ranked[:count])
        if kept is not None and _error(kept) <= _ENOUGH * allowed:
            return kept
    return None


def _gives(loose: Loosened, binding: Sequence[int]) -> tuple[tuple[Give, Freed | None], ...]:
    """Return limits that are enough alone, or else together with all sizes freed."""
    for names in ((), loose.candidates):
        answers = loose.several([(names, [i]) for i in binding])
        kept = [
            (loose.give(i, outcome), loose.freed(names, outcome) if names else None)
            for i, outcome in zip(binding, answers, strict=True)
            if outcome.solved and loose.give(i, outcome).sensible
        ]
        if kept:
            return tuple(kept)
    return ()
