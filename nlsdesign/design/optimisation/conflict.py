"""Why no design keeps all limits: which are in conflict, how much each would have to give, what to free."""

from __future__ import annotations

from collections.abc import Iterable, Sequence

from ...foundation.arrays import Array
from ...foundation.errors import ConvergenceError, InfeasibleError
from .design_search import Search
from .limits import Bound
from .loosening import FEASIBLE, Loosened
from .other_ways import percent, tried_otherwise
from .program import PROVED_INFEASIBLE, Solution

_INVOLVED = 1e-3
"""Price, in give of the whole per give of this limit, from which a limit counts as part of the conflict."""


def feasible_point(search: Search, free: Sequence[str]) -> Array:
    """Return unknowns that keep all limits, or say why there are none.

    Every limit gets a slack, and the sum of the slacks, each relative to the size of its limit, is made as
    small as possible. Where it does not vanish, each limit that has a price is relaxed alone, and each number
    that is held is freed alone.
    """
    loose = Loosened(search, free, largest_error=None, best=None)
    best = loose.least((), loose.every)
    if not best.solved:
        raise ConvergenceError(
            "design: search for a cam within the limits", "IPOPT found neither a cam nor a proof against it",
            next_step="leave out limits one by one, or start from a deck that is closer to the target",
        )  # fmt: skip
    if loose.kept(best):
        return search.problem.completed(loose.open.problem.chosen(best.point))
    prices = best.prices[len(loose.open.problem.structure) :]
    involved = [i for i, price in enumerate(prices) if price > _INVOLVED]
    raise InfeasibleError(
        "limits " + ", ".join(names_of(loose.bounds[i] for i in involved)),
        "contradict each other" if len(involved) > 1 else "cannot be kept with what is free",
        next_step="; ".join(what_would_help(loose, best, involved, search, free)),
    )


def what_would_help(
    loose: Loosened, best: Solution, involved: Sequence[int], search: Search, free: Sequence[str]
) -> list[str]:
    """Return in words how much limits would have to give, which sizes to free, and what else was tried."""
    start = best.point[: loose.count]
    alone = loose.several([((), [i]) for i in involved], start)
    gives = [loose.give(i, outcome) for i, outcome in zip(involved, alone, strict=True) if outcome.solved]
    failed = {loose.bounds[i].limit: o for i, o in zip(involved, alone, strict=True) if not o.solved}
    undecided = [limit for limit, outcome in failed.items() if outcome.status != PROVED_INFEASIBLE]
    hopeless = [limit for limit in failed if limit not in undecided]
    tried = loose.sizes_tried(start)
    largest = search.question.target.largest
    together = [give for give in (loose.give(i, best) for i in involved) if give.amount > 0.0]
    sensible = [give for give in gives if give.sensible]
    no_use = [*hopeless, *names_of(give.bound for give in gives if not give.sensible)]
    sentences = []
    if sensible:
        sentences.append("one of these is enough: " + "; or ".join(str(give) for give in sensible))
    elif together and all(give.sensible for give in together):
        needed = [give for give in together if give.amount > FEASIBLE * give.bound.scale]
        sentences.append("no single one is enough; together: " + "; and ".join(str(give) for give in needed))
    if tried.enough:
        cures = [f"{cure}, which leaves {percent(cure.error, largest)}" for cure in tried.enough]
        sentences.append("enough without any give: " + "; or ".join(cures))
    if no_use and sentences:
        sentences.append("no give of " + " or ".join(no_use) + " alone is enough, or none that makes sense")
    if undecided:
        listed = " or ".join(undecided)
        sentences.append(f"whether a give of {listed} alone is enough the solver could not decide")
    return sentences if sensible or tried.enough else [*sentences, *tried_otherwise(loose, search, free)]


def names_of(bounds: Iterable[Bound]) -> list[str]:
    """Return the names of the limits of some bounds, each once."""
    return list(dict.fromkeys(bound.limit for bound in bounds))
