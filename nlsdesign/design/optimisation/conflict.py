"""Why no design keeps all limits: which are in conflict, how much each would have to give, what to free."""

from __future__ import annotations

from collections.abc import Iterable, Sequence

from ...foundation.arrays import Array
from ...foundation.errors import ConvergenceError, InfeasibleError
from .design_search import Search
from .limits import Bound
from .loosening import FEASIBLE, Freed, Give, Loosened
from .program import PROVED_INFEASIBLE

_INVOLVED = 1e-3
"""Price, in give of the whole per give of this limit, from which a limit counts as part of the conflict."""


def feasible_point(search: Search, free: Sequence[str]) -> Array:
    """Return unknowns that keep all limits, or say why there are none.

    Every limit gets a slack, and the sum of the slacks, each relative to the size of its limit, is made as
    small as possible. Where it does not vanish, each limit that has a price is relaxed alone, and each number
    that is held is freed alone.
    """
    loose = Loosened(search, free, largest_error=None, best=None)
    every = range(len(loose.bounds))
    best = loose.least((), every)
    if not best.solved:
        raise ConvergenceError(
            "design: search for a cam within the limits", "IPOPT found neither a cam nor a proof against it",
            next_step="leave out limits one by one, or start from a deck that is closer to the target",
        )  # fmt: skip
    if best.cost <= FEASIBLE * len(loose.bounds):
        return search.problem.completed(loose.open.problem.chosen(best.point))
    prices = best.prices[len(loose.open.problem.structure) :]
    involved = [i for i, price in enumerate(prices) if price > _INVOLVED]
    start = best.point[: loose.count]
    alone = loose.several([((), [i]) for i in involved], start)
    names = loose.several([([name], every) for name in loose.candidates], start)
    gives = [loose.give(i, outcome) for i, outcome in zip(involved, alone, strict=True) if outcome.solved]
    failed = {loose.bounds[i].limit: outcome for i, outcome in zip(involved, alone, strict=True)}
    failed = {limit: outcome for limit, outcome in failed.items() if not outcome.solved}
    undecided = [limit for limit, outcome in failed.items() if outcome.status != PROVED_INFEASIBLE]
    hopeless = [limit for limit in failed if limit not in undecided]
    cures = [
        loose.freed([name], outcome)
        for name, outcome in zip(loose.candidates, names, strict=True)
        if outcome.solved and outcome.cost <= FEASIBLE * len(loose.bounds)
    ]
    together = [give for give in (loose.give(i, best) for i in involved) if give.amount > 0.0]
    raise InfeasibleError(
        "limits " + ", ".join(names_of(loose.bounds[i] for i in involved)),
        "contradict each other" if len(involved) > 1 else "cannot be kept with what is free",
        next_step="; ".join(_advice(gives, together, cures=cures, hopeless=hopeless, undecided=undecided)),
    )


def names_of(bounds: Iterable[Bound]) -> list[str]:
    """Return the names of the limits of some bounds, each once."""
    return list(dict.fromkeys(bound.limit for bound in bounds))


def _advice(
    alone: Sequence[Give],
    together: Sequence[Give],
    *,
    cures: Sequence[Freed],
    hopeless: Sequence[str],
    undecided: Sequence[str],
) -> list[str]:
    sensible = [give for give in alone if give.sensible]
    no_use = [*hopeless, *names_of(give.bound for give in alone if not give.sensible)]
    sentences = []
    if sensible:
        sentences.append("one of these is enough: " + "; or ".join(str(give) for give in sensible))
    elif together and all(give.sensible for give in together):
        needed = [give for give in together if give.amount > FEASIBLE * give.bound.scale]
        sentences.append("no single one is enough; together: " + "; and ".join(str(give) for give in needed))
    if cures:
        sentences.append("enough without any give: " + "; or ".join(str(cure) for cure in cures))
    if no_use and sentences:
        sentences.append("no give of " + " or ".join(no_use) + " alone is enough, or none that makes sense")
    if undecided:
        listed = " or ".join(undecided)
        sentences.append(f"whether a give of {listed} alone is enough the solver could not decide")
    if not (sensible or cures):
        sentences.append("ask for a smaller torque or angle, more elements or another rubber")
    return sentences
