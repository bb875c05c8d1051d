"""How one hypothesis is fitted to one group of blocks that share free numbers."""

from __future__ import annotations

import itertools
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from typing import NamedTuple

from ....foundation.errors import ConvergenceError
from ....model import Variable
from ...identification.equation_error.block import Block
from ...identification.equation_error.evidence import Bench
from ...identification.least_squares import Fit
from ...identification.parameters import Parameter, declared_parameter, free_parameter
from ..effects.candidate import Unknown
from ..fitting.strategies import FitProblem, Plain, Start, explains_enough, method_for, refusal
from ..fitting.unpredictable import Key, Tally
from .cross_validation import Folds, by_pieces, tallies_of
from .hypothesis import Hypothesis

_FREE_REACH = 30.0
"""Factor to the bounds of a number of which nothing is taken as known."""


class FreeBlock(NamedTuple):
    """A block, and the names of its free numbers."""

    block: Block
    free: tuple[str, ...]


@dataclass(frozen=True, eq=False)
class GroupFit:
    """What fitting a group of blocks gave.

    Parameters
    ----------
    fit
        The numbers.
    tallies
        What is left over on each record, by block and record.
    has_free_flight
        Whether a body flies freely between contacts.
    unpredictable
        Which of the tallies should not count for more than the others.
    """

    fit: Fit
    tallies: Mapping[Key, Tally]
    has_free_flight: bool
    unpredictable: frozenset[Key]


class HypothesisFit:
    """Fits groups of blocks to the records.

    Parameters
    ----------
    bench
        Records with filters and noise floors.
    sizes
        Largest value of each signal of the declared model on the records, by name.
    """

    def __init__(self, bench: Bench, sizes: Mapping[str, float]) -> None:
        self._bench, self._sizes = bench, sizes

    def fitted(
        self, hypothesis: Hypothesis, group: Sequence[FreeBlock], new: Sequence[Unknown]
    ) -> GroupFit | ConvergenceError:
        """Fit a group of blocks.

        ``new``: numbers of the newest effect; nothing where none was added. Result: the error says why there
        is no fit; it is returned so that others go on beside it.
        """
        problem = self._problem(hypothesis, group, new)
        if reason := refusal(problem):
            return ConvergenceError(
                " with ".join(hypothesis.names),
                reason,
                next_step="declare one of them in the deck and diagnose what is left",
            )
        method, strategy = method_for(problem), hypothesis.newest.strategy if new else Plain()
        try:
            best = method.fit(problem, strategy)
            tallies = _tallies(problem, best, exact=not new or explains_enough(problem, best.misfit))
            aside = method.set_aside(problem, best, tallies)
        except ConvergenceError as error:
            return error
        return GroupFit(best, tallies, problem.has_free_flight, aside)

    def judged(
        self, hypothesis: Hypothesis, group: Sequence[FreeBlock], folds: Folds = by_pieces
    ) -> Mapping[Key, Tally]:
        """Return what a hypothesis leaves over, its numbers as they are.

        ``hypothesis``: fitted; on thinned records where it is coarse.
        """
        names = tuple(each.block.name for each in group)
        return _tallies(self._problem(hypothesis, group, ()), hypothesis.fits[names], folds)

    def _problem(
        self, hypothesis: Hypothesis, group: Sequence[FreeBlock], new: Sequence[Unknown]
    ) -> FitProblem:
        own = [u for u in new if any(u.name in each.free for each in group)]
        starts = self._starts(hypothesis, group, own)
        values = {p.name: p.start for p in starts[0]}
        driven = [self._bench.driven(each.block, each.free, values) for each in group]
        records = self._bench.records.records
        evidence = [
            e for d in driven for e in self._bench.evidence(d, records, values, coarse=hypothesis.coarse)
        ]
        return FitProblem(
            self._bench,
            hypothesis.assembly,
            tuple(each.block.name for each in group),
            starts,
            tuple(evidence),
            tuple(u.name for u in own),
            hypothesis.tallies,
            hypothesis.unpredictable,
            len(hypothesis.added),
            hypothesis.has_free_flight,
            hypothesis.coarse,
        )

    def _starts(
        self, hypothesis: Hypothesis, group: Sequence[FreeBlock], new: Sequence[Unknown]
    ) -> tuple[Start, ...]:
        """Return every combination of the starts of the new numbers, all others where they stand."""
        variables = {v.name: v for each in group for v in each.block.model.parameters}
        free = dict.fromkeys(name for each in group for name in each.free)
        known = {u.name: u for u in hypothesis.unknowns}
        combinations = itertools.product(*[[v * self._scale(u) for v in u.starts] for u in new])
        result = []
        for combination in combinations:
            begin = {**hypothesis.values, **dict(zip((u.name for u in new), combination, strict=True))}
            result.append(
                tuple(
                    _released(variables[n], begin.get(n))
                    if n in hypothesis.released
                    else self._parameter(variables[n], known.get(n), begin.get(n))
                    for n in free
                )
            )
        return tuple(result)

    def _scale(self, unknown: Unknown) -> float:
        return self._sizes.get(unknown.of, 1.0) if unknown.of else 1.0

    def _parameter(self, variable: Variable, unknown: Unknown | None, start: float | None) -> Parameter:
        if unknown is None:
            return declared_parameter(variable, start)
        scale = self._scale(unknown)
        low, high = unknown.lower * scale, unknown.upper * scale
        begin = variable.start if start is None else start
        log = unknown.lower > 0.0
        return Parameter(
            variable.name,
            variable.unit,
            begin,
            begin,
            float("inf"),
            max(low, variable.minimum),
            min(high, variable.maximum),
            "log" if log else "linear",
            1.0 if log else 0.1 * (high - low),
        )


def _released(variable: Variable, start: float | None) -> Parameter:
    free = free_parameter(variable, reach=_FREE_REACH)
    return free if start is None else replace(free, start=start)


def _tallies(
    problem: FitProblem, best: Fit, folds: Folds = by_pieces, *, exact: bool = True
) -> dict[Key, Tally]:
    # Behind a free flight a slope holds at its point only, so no step without a fold can be taken.
    return tallies_of(problem.evidence, best, None if problem.has_free_flight else folds, exact=exact)
