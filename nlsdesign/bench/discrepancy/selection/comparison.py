"""Hypotheses about what is missing, each fitted to the same records in the same way.

A hypothesis is fitted in groups of blocks that share free numbers.
"""

from __future__ import annotations

import itertools
import math
from collections import Counter
from collections.abc import Callable, Collection, Mapping, Sequence
from dataclasses import dataclass, replace
from typing import NamedTuple
from weakref import WeakKeyDictionary

from ....components.assembly.named_parts import Assembly
from ....foundation.arrays import Array
from ....foundation.errors import ConvergenceError, unknown_name
from ....foundation.quantity import Quantity
from ....foundation.work_sharing import parallel_map
from ....model import Variable, flatten
from ...identification.equation_error.block import Block, NoiseFloor
from ...identification.equation_error.block_response import free_in
from ...identification.equation_error.evidence import Bench, Evidence
from ...identification.least_squares import Fit
from ...identification.parameters import Parameter, declared_parameter, free_parameter
from ...identification.records.measurement import Record
from ..effects.effect import Candidate, Unknown
from ..effects.friction import with_resolved_signs
from ..fitting import (
    FitProblem,
    Key,
    Start,
    Strategy,
    Tally,
    explains_enough,
    fit_of_nothing,
    method_for,
    refusal,
)
from ..tearing import blocks_of, measured_signals
from .cross_validation import Folds, by_pieces, by_records, tallies_of
from .hypothesis import Hypothesis

_ABOVE = 3.0
"""Times as much as the number that it stands above a number is at least."""
_FREE_REACH = 30.0
"""Factor to the bounds of a number of which nothing is taken as known."""


class FreeBlock(NamedTuple):
    """A block, and the names of its free numbers."""

    block: Block
    free: tuple[str, ...]


@dataclass(frozen=True, eq=False)
class GroupFit:
    """What fitting a group of blocks gave."""

    fit: Fit
    tallies: Mapping[Key, Tally]  # what is left over on each record, by block and record
    has_free_flight: bool  # whether a body flies freely between contacts
    unpredictable: frozenset[Key]  # which of the tallies should not count for more than the others


class HypothesisFit:
    """Fits groups of blocks to the records of a :class:`Comparison`."""

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
        method, strategy = method_for(problem), hypothesis.newest.strategy if new else Strategy()
        try:
            screened = bool(new) and problem.coarse and not problem.has_free_flight
            if screened and (none := fit_of_nothing(problem)):
                left = {key: tally for key, tally in problem.before.items() if key[0] in problem.blocks}
                return GroupFit(none, left, False, method.set_aside(problem, none, left))
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
                    else self._parameter(variables, n, known.get(n), begin.get(n))
                    for n in free
                )
            )
        return tuple(result)

    def _scale(self, unknown: Unknown) -> float:
        return self._sizes.get(unknown.of, 1.0) if unknown.of else 1.0

    def _parameter(
        self, variables: Mapping[str, Variable], name: str, unknown: Unknown | None, start: float | None
    ) -> Parameter:
        variable = variables[name]
        if unknown is None:
            return declared_parameter(variable, start)
        scale = self._scale(unknown)
        low, high = unknown.lower * scale, unknown.upper * scale
        begin = variable.start if start is None else start
        least = self._sizes.get(unknown.beyond, 0.0) if unknown.beyond else 0.0
        if unknown.beyond and begin < 0.0:  # a number of either sign keeps that of its start
            high = min(high, -least)
        elif unknown.beyond:
            low = max(low, least)
        if unknown.above:
            low = max(low, _ABOVE * variables[unknown.above].start)
        begin = min(max(begin, low), high)
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
            # Up to that size something plainer may be a part of the number, each size as likely.
            confounded=least / math.sqrt(3.0),
        )


def _released(variable: Variable, start: float | None) -> Parameter:
    free = free_parameter(variable, reach=_FREE_REACH)
    return free if start is None else replace(free, start=start)


def _tallies(
    problem: FitProblem, best: Fit, folds: Folds = by_pieces, *, exact: bool = True
) -> dict[Key, Tally]:
    # Behind a free flight a slope holds at its point only, so no step without a fold can be taken.
    return tallies_of(problem.evidence, best, None if problem.has_free_flight else folds, exact=exact)


_LONGEST_ROW = 12
"""Points of a row of numbers beyond which it is the table of a shape, of which no point is refitted alone."""


@dataclass(frozen=True, eq=False)
class Judged:
    """What a fitted hypothesis says of one record, seen by one block."""

    # block, record, floor: which block, which record, and how it is read
    block: Block
    record: Record
    floor: NoiseFloor
    predicted: Array  # unfiltered output over the record
    residual: Array  # filtered error in units of the noise floor

    @property
    def error(self) -> Array:
        """Filtered error in the unit of the block."""
        result: Array = self.residual * self.floor.sigma
        return result


class Comparison:
    """The records, and how hypotheses are fitted to them.

    ``bench``: records with filters and noise floors. ``sizes``: largest value of each signal of the declared
    model on the records, by name.
    """

    def __init__(self, bench: Bench, sizes: Mapping[str, float]) -> None:
        self.bench, self.sizes = bench, sizes
        self._slowest: dict[str, float] = {}  # least speed that the records resolve, by the name of the body
        self._fit = HypothesisFit(bench, sizes)
        self._polished: WeakKeyDictionary[Hypothesis, Hypothesis] = WeakKeyDictionary()
        self._judged: WeakKeyDictionary[Hypothesis, tuple[Judged, ...]] = WeakKeyDictionary()

    def base(self, assembly: Assembly) -> Hypothesis:
        """Refit the declared assembly, so that a wrong number is not taken for a wrong structure."""
        blank = Hypothesis(assembly)
        return self._refitted(blank, self._groups(blank))

    def coarsely(self, hypothesis: Hypothesis) -> Hypothesis:
        """Return a hypothesis as the coarse look sees it."""
        return self._refitted(replace(hypothesis, coarse=True), self._groups(hypothesis))

    def with_effect(
        self, hypothesis: Hypothesis, candidate: Candidate, wanted: Collection[str] = ()
    ) -> Hypothesis | None:
        """Fit a hypothesis with one more effect; blocks that it does not touch stay as they are.

        ``wanted``: names of blocks; ``None`` is returned for an effect that touches none of them.
        """
        known = candidate.assembly.quantities()
        for unknown in candidate.unknowns:
            if unknown.name.partition("[")[0] not in known:
                raise unknown_name(f"effect '{candidate.effect}': number", unknown.name, known)
        if not self._slowest:
            speeds = self.bench.slowest()
            motions = measured_signals(flatten(hypothesis.assembly), self.bench.records.signals)
            self._slowest = {m.body.name: speeds[m.signal] for m in motions if m.body and m.signal in speeds}
        signed = with_resolved_signs(hypothesis.assembly, candidate.assembly, self._slowest)
        before = _edited(hypothesis, replace(candidate, assembly=signed))
        names = {u.name for u in candidate.unknowns}
        groups = [g for g in self._groups(before) if any(names & set(each.free) for each in g)]
        if wanted and not any(each.block.name in wanted for g in groups for each in g):
            return None
        acts_in = frozenset(each.block.name for g in groups for each in g if names & set(each.free))
        newest = replace(before.newest, acts_in=acts_in)
        return self._refitted(replace(before, added=(*before.added[:-1], newest)), groups, candidate.unknowns)

    def polished(self, hypothesis: Hypothesis, *, released: Collection[str] = ()) -> Hypothesis:
        """Refit a hypothesis to all samples, from where it stands.

        ``hypothesis``: fitted, coarsely or not; without anything released the answer is remembered as long as
        it is.
        """
        if not released and hypothesis in self._polished:
            return self._polished[hypothesis]
        free = replace(hypothesis, released=hypothesis.released | frozenset(released), coarse=False)
        result = self._refitted(free, self._groups(free))
        if not released:
            self._polished[hypothesis] = result
        return result

    def on_all_samples(self, hypothesis: Hypothesis) -> Hypothesis:
        """Return a coarsely fitted hypothesis, its numbers as they are, with what all samples say of it."""
        return self._rejudged(replace(hypothesis, coarse=False), by_pieces)

    def without_whole_records(self, hypothesis: Hypothesis) -> Hypothesis:
        """Return a hypothesis with what it leaves over on each record when that is left out."""
        return self._rejudged(hypothesis, by_records)

    def _rejudged(self, hypothesis: Hypothesis, folds: Folds) -> Hypothesis:
        groups = self._groups(hypothesis)
        results = parallel_map(lambda k: self._fit.judged(hypothesis, groups[k], folds), len(groups))
        return hypothesis.judged_by({key: tally for result in results for key, tally in result.items()})

    def judged(self, hypothesis: Hypothesis) -> tuple[Judged, ...]:
        """Return what all records say about all blocks of a hypothesis, on all samples.

        ``hypothesis``: fitted; the answer is remembered as long as the hypothesis is.
        """
        if hypothesis not in self._judged:
            signals, records = self.bench.records.signals, self.bench.records.records
            blocks = blocks_of(flatten(hypothesis.fitted), signals)
            driven = [self.bench.driven(block, ()) for block in blocks]
            evidence = [e for each in driven for e in self.bench.evidence(each, records, {})]
            pairs = parallel_map(lambda k: _prediction(evidence[k]), len(evidence))
            self._judged[hypothesis] = tuple(
                Judged(e.driven.block, e.record, e.floor, *pair)
                for e, pair in zip(evidence, pairs, strict=True)
            )
        return self._judged[hypothesis]

    def _groups(self, hypothesis: Hypothesis) -> list[list[FreeBlock]]:
        """Return the blocks of a hypothesis in groups that share no free number."""
        blocks = []
        for block in blocks_of(flatten(hypothesis.assembly), self.bench.records.signals):
            spread = [v.name for v in _refittable(block.model.parameters)]
            own = [u.name for u in hypothesis.unknowns if u.name in block.model.values]
            wanted = [n for n in dict.fromkeys([*spread, *own]) if n not in hypothesis.held]
            blocks.append(FreeBlock(block, free_in(block, wanted)))
        return _groups(blocks)

    def _refitted(
        self, before: Hypothesis, groups: Sequence[Sequence[FreeBlock]], new: Sequence[Unknown] = ()
    ) -> Hypothesis:
        values, fits, tallies = dict(before.values), dict(before.fits), dict(before.tallies)
        has_free_flight, unpredictable = before.has_free_flight, before.unpredictable
        results = parallel_map(lambda k: self._fit.fitted(before, groups[k], new), len(groups))
        for group, result in zip(groups, results, strict=True):
            if isinstance(result, ConvergenceError):
                raise result
            values |= result.fit.values
            names = tuple(each.block.name for each in group)
            fits = {k: f for k, f in fits.items() if not set(k) & set(names)} | {names: result.fit}
            tallies |= result.tallies
            has_free_flight |= result.has_free_flight
            others = frozenset(key for key in unpredictable if key not in result.tallies)
            unpredictable = others | result.unpredictable
        after = replace(
            before,
            values=values,
            fits=fits,
            has_free_flight=has_free_flight,
            unpredictable=unpredictable,
        )
        return after.judged_by(tallies)


def _prediction(evidence: Evidence) -> tuple[Array, Array]:
    """Return the unfiltered output, and the filtered error in units of the noise floor."""
    output = evidence.predicted({})
    target = evidence.driven.block.target
    error = (evidence.record.as_computed(target) if target else 0.0) - output
    return output, (evidence.floor.filter @ error) / evidence.floor.sigma


def _edited(hypothesis: Hypothesis, candidate: Candidate) -> Hypothesis:
    """Return a hypothesis with the effect in its assembly, not fitted yet."""
    moved = moved_numbers(hypothesis.assembly, candidate.assembly)

    def renamed(name: str) -> str:
        row, bracket, index = name.partition("[")
        return moved.get(row, row) + bracket + index

    old = tuple(replace(u, name=renamed(u.name), above=renamed(u.above)) for u in hypothesis.unknowns)
    values = {renamed(n): v for n, v in hypothesis.values.items()}
    # An edit may share a number out, for instance an inertia: what was fitted is shared out alike.
    then, now = hypothesis.assembly.quantities(), candidate.assembly.quantities()
    for name in values.keys() & then.keys() & now.keys():
        if then[name].value != now[name].value:
            values[name] *= now[name].number / then[name].number
    added = (*_with_unknowns(hypothesis.added, old), candidate)
    fits = {blocks: _renamed(fit, renamed) for blocks, fit in hypothesis.fits.items()}
    released, held = (frozenset(map(renamed, names)) for names in (hypothesis.released, hypothesis.held))
    return replace(
        hypothesis,
        assembly=candidate.assembly,
        added=added,
        values=values,
        fits=fits,
        released=released,
        held=held,
    )


def _renamed(fit: Fit, renamed: Callable[[str], str]) -> Fit:
    """Return a fit under the names that its numbers have after an edit."""
    parameters = tuple(replace(p, name=renamed(p.name)) for p in fit.parameters)
    return replace(fit, parameters=parameters, values={renamed(n): v for n, v in fit.values.items()})


def _refittable(parameters: Sequence[Variable]) -> list[Variable]:
    """Return the numbers with a spread; long rows are tables of a shape, not refitted point by point."""
    lengths = Counter(v.name.partition("[")[0] for v in parameters)
    return [v for v in parameters if v.uncertain and lengths[v.name.partition("[")[0]] <= _LONGEST_ROW]


def _groups(blocks: Sequence[FreeBlock]) -> list[list[FreeBlock]]:
    """Return blocks in groups that share no free parameter."""
    groups: list[list[FreeBlock]] = []
    for block in blocks:
        joined = [g for g in groups if any(set(b.free) & set(block.free) for b in g)]
        groups = [g for g in groups if g not in joined] + [[*(b for g in joined for b in g), block]]
    return groups


def moved_numbers(before: Assembly, after: Assembly) -> dict[str, str]:
    """Return the new name of each number that an edit has moved, by its old one.

    An edit that puts an element inside another keeps its numbers, as the very same objects.
    """
    old, new = before.quantities(), after.quantities()
    departed = _by_identity({name: quantity for name, quantity in old.items() if name not in new})
    arrived = _by_identity({name: quantity for name, quantity in new.items() if name not in old})
    # One object may stand at several places, as where one law makes two branches: they keep their order.
    moved: dict[str, str] = {}
    for key, names in departed.items():
        others = arrived.get(key, [])
        if len(names) == len(others):
            moved |= dict(zip(names, others, strict=True))
    return moved


def _by_identity(quantities: Mapping[str, Quantity]) -> dict[int, list[str]]:
    places: dict[int, list[str]] = {}
    for name, quantity in quantities.items():
        places.setdefault(id(quantity), []).append(name)
    return places


def _with_unknowns(added: Sequence[Candidate], unknowns: Sequence[Unknown]) -> tuple[Candidate, ...]:
    left = list(unknowns)
    result = []
    for each in added:
        own, left = left[: len(each.unknowns)], left[len(each.unknowns) :]
        result.append(replace(each, unknowns=tuple(own)))
    return tuple(result)
