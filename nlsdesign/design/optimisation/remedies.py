"""What would bring a design within its target: sizes to free, limits to move, other kinds of spring."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

from ...foundation.arrays import Array
from .design_search import Search
from .loosening import Freed, Give, Loosened
from .other_ways import Hollow, OtherSpring, hollow_contour, other_springs, percent

_LESS = 0.98
"""Share of the error that a name leaves from which freeing it counts as of no use."""


@dataclass(frozen=True)
class Remedies:
    """What was tried against a miss; each entry was solved for, not estimated."""

    enough: tuple[Freed, ...]  # smallest sets of names that, freed, bring the error within what is allowed
    better: tuple[Freed, ...]  # single names that, freed, lower the error, best first
    # gives: limits that would have to move, each with what has to be freed as well (nothing, for the first
    # kind)
    gives: tuple[tuple[Give, Freed | None], ...]
    everything: Freed | None  # error with all sizes free at once
    # others: other springs that were tried, where neither sizes nor one limit are enough
    others: tuple[OtherSpring, ...] = ()
    # hollow: where the contour would have to be hollow; None where that is not enough either, or was not
    # asked
    hollow: Hollow | None = None

    def sentences(self, largest: float, allowed: float) -> list[str]:
        """Return the advice as sentences; ``allowed``: the largest rms error in N·m."""
        sentences = [f"{freed}: {percent(freed.error, largest)}" for freed in self.enough]
        for give, also in self.gives:
            sentences.append(f"{give}" + ("" if also is None else f", and {also}"))
        others = [f"{one}: {percent(one.error, largest)}" for one in self.others if one.error <= allowed]
        if others and self.hollow is not None:
            sentences.append(str(self.hollow))
        sentences += others
        if sentences:
            return sentences
        tried = []
        if self.everything is not None:
            names, left = ", ".join(self.everything.names), percent(self.everything.error, largest)
            tried.append(f"with all sizes free ({names}) {left} is left")
        tried += [f"with {one.words} {percent(one.error, largest)} is left" for one in self.others]
        tried += [] if self.hollow is not None else ["no hollow contour was found that is enough"]
        none = (
            "no size is left to free" if self.everything is None else "no size and no single limit is enough"
        )
        return ["; ".join([none, *tried]), *([] if self.hollow is None else [str(self.hollow)])]


def find_remedies(
    search: Search, free: Sequence[str], best: Array, *, allowed: float, error: float, binding: Sequence[int]
) -> Remedies:
    """Return what would bring a design within its target.

    ``binding``: numbers of the limits that the design sits on, among those of the search.
    """
    loose = Loosened(search, free, largest_error=allowed, best=best)
    tried = loose.sizes_tried()
    better = sorted((one for one in tried.better if one.error < _LESS * error), key=lambda one: one.error)
    all_free = tried.everything
    everything = None
    if all_free is not None and all_free.solved:
        everything = loose.freed(loose.candidates, all_free)
    gives = () if tried.enough else _gives(loose, binding)
    # A limit that need not give shows that freeing all sizes is enough after all.
    enough = tried.enough + tuple(also for give, also in gives if also is not None and _nothing(give))[:1]
    gives = tuple((give, also) for give, also in gives if not _nothing(give))
    if enough or gives:
        return Remedies(enough, tuple(better), gives, everything)
    others = other_springs(search, free)
    return Remedies((), tuple(better), (), everything, others, hollow_contour(loose))


def _nothing(give: Give) -> bool:
    return give.amount <= 1e-4 * give.bound.scale


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
