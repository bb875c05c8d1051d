"""Hypotheses about what is missing, each fitted to the same records in the same way."""

from __future__ import annotations

from collections import Counter
from collections.abc import Collection, Mapping, Sequence
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from ...errors import ConvergenceError
from ...identification.equation_error.block import Block
from ...identification.equation_error.block_response import DrivenBlock
from ...identification.equation_error.evidence import Bench, Evidence, Floor
from ...identification.estimation.least_squares import declared_parameter, fit
from ...identification.estimation.parameters import free_parameter
from ...identification.records.measurement import Record
from ...identification.statistics.residuals import effective_size
from ...model import Assembly, Variable, flatten
from ...parallel import shared_out
from ..blocks.tearing import blocks_of
from ..effects.candidate import Candidate, Unknown
from .hypothesis import Hypothesis
from .hypothesis_fit import Trials
from .unpredictable import astray, like_the_others

Array = NDArray[np.float64]

_LONGEST_ROW = 12
_FREE_REACH = 30.0
"""Factor to the bounds of a number of which nothing is taken as known."""


@dataclass(frozen=True, eq=False)
class Judged:
    """What a fitted hypothesis says of one record, seen by one block.

    Parameters
    ----------
    block, record, floor
        Which block, which record, and how it is read.
    predicted
        Unfiltered output over the record.
    residual
        Filtered error in units of the noise floor.
    """

    block: Block
    record: Record
    floor: Floor
    predicted: Array
    residual: Array

    @property
    def error(self) -> Array:
        """Filtered error in the unit of the block."""
        result: Array = self.residual * self.floor.sigma
        return result


class Comparison:
    """The records, and how hypotheses are fitted to them.

    Parameters
    ----------
    bench
        Records with filters and noise floors.
    sizes
        Largest value of each signal of the declared model on the records, by name.
    """

    def __init__(self, bench: Bench, sizes: Mapping[str, float]) -> None:
        self.bench = bench
        self._trials = Trials(bench, sizes)
        self._known: list[tuple[Hypothesis, tuple[Judged, ...]]] = []

    def base(self, assembly: Assembly) -> Hypothesis:
        """Refit the declared assembly, so that a wrong number is not taken for a wrong structure.

        Parameters
        ----------
        assembly
            As declared.
        """
        blank = Hypothesis(assembly, (), {}, {}, {}, {}, {})
        return self._refitted(blank, _groups(self._driven(blank)))

    def declared(self, assembly: Assembly) -> Hypothesis:
        """Return the declared assembly as it is, nothing fitted.

        Parameters
        ----------
        assembly
            As declared.
        """
        return self.on_all_samples(Hypothesis(assembly, (), {}, {}, {}, {}, {}))

    def coarsely(self, hypothesis: Hypothesis) -> Hypothesis:
        """Return a hypothesis as the coarse look sees it.

        Parameters
        ----------
        hypothesis
            Fitted.
        """
        return self._refitted(replace(hypothesis, coarse=True), _groups(self._driven(hypothesis)))

    def with_effect(
        self, hypothesis: Hypothesis, candidate: Candidate, wanted: Collection[str] = ()
    ) -> Hypothesis | None:
        """Fit a hypothesis with one more effect; blocks that it does not touch stay as they are.

        Parameters
        ----------
        hypothesis
            Fitted, coarsely or not.
        candidate
            Made from ``hypothesis.assembly``.
        wanted
            Names of blocks; ``None`` is returned for an effect that touches none of them.
        """
        before = _edited(hypothesis, candidate)
        groups = self._touched(before, candidate.unknowns)
        if wanted and not any(b.block.name in wanted for g in groups for b in g):
            return None
        return self._refitted(before, groups, candidate.unknowns)

    def polished(self, hypothesis: Hypothesis) -> Hypothesis:
        """Refit a coarse hypothesis to all samples, from where it stands.

        Parameters
        ----------
        hypothesis
            Fitted coarsely.
        """
        return self._refitted(replace(hypothesis, coarse=False), _groups(self._driven(hypothesis)))

    def freely(self, hypothesis: Hypothesis) -> Hypothesis:
        """Return a hypothesis with its declared numbers fitted as if nothing were known of them.

        Parameters
        ----------
        hypothesis
            Fitted, without effects. A fit that does not converge leaves its numbers as they are.
        """
        fits, values = dict(hypothesis.fits), dict(hypothesis.values)
        fitted = self.bench.records.of("fit")
        for group in _groups(self._driven(hypothesis)):
            variables = {v.name: v for b in group for v in b.block.model.parameters}
            free = [n for n in dict.fromkeys(n for b in group for n in b.free)]
            parameters = [
                free_parameter(variables[n], reach=_FREE_REACH)
                if variables[n].start > 0.0
                else declared_parameter(variables[n])
                for n in free
            ]
            start = {p.name: p.start for p in parameters}
            try:
                found = fit([e for b in group for e in self.bench.evidence(b, fitted, start)], parameters)
            except ConvergenceError:
                continue
            fits[tuple(b.block.name for b in group)] = found
            values |= found.values
        return self.on_all_samples(replace(hypothesis, fits=fits, values=values))

    def on_all_samples(self, hypothesis: Hypothesis) -> Hypothesis:
        """Return a coarsely fitted hypothesis, its numbers as they are, with what all samples say of it.

        Parameters
        ----------
        hypothesis
            Fitted.
        """
        chi2, rows, worth = {}, {}, {}
        for each in self.judged(hypothesis):
            key = each.block.name, each.record.name
            chi2[key], rows[key] = float(each.residual @ each.residual), len(each.residual)
            worth[key] = effective_size(each.residual)
        chi2 = like_the_others(chi2, rows, hypothesis.astray)
        return replace(hypothesis, chi2=chi2, rows=rows, worth=worth, coarse=False)

    def judged(self, hypothesis: Hypothesis) -> tuple[Judged, ...]:
        """Return what all records say about all blocks of a hypothesis, on all samples.

        Parameters
        ----------
        hypothesis
            Fitted; the answer is remembered.
        """
        if not any(known is hypothesis for known, _ in self._known):
            model, signals = flatten(hypothesis.fitted), self.bench.records.signals
            fitted = [DrivenBlock(b, ()) for b in blocks_of(model, signals)]
            seen = [e for b in fitted for e in self.bench.evidence(b, self.bench.records.records, {})]
            found = tuple(shared_out(lambda k: _judged(seen[k]), len(seen)))
            told = tuple(
                Judged(e.driven.block, e.record, e.floor, *pair) for e, pair in zip(seen, found, strict=True)
            )
            self._known.append((hypothesis, told))
        return next(told for known, told in self._known if known is hypothesis)

    def _driven(self, hypothesis: Hypothesis) -> list[DrivenBlock]:
        found = []
        for block in blocks_of(flatten(hypothesis.assembly), self.bench.records.signals):
            spread = [v.name for v in _refittable(block.model.parameters)]
            own = [u.name for u in hypothesis.unknowns if u.name in block.model.values]
            found.append(DrivenBlock(block, list(dict.fromkeys([*spread, *own]))))
        return found

    def _touched(self, hypothesis: Hypothesis, unknowns: Sequence[Unknown]) -> list[list[DrivenBlock]]:
        names = {u.name for u in unknowns}
        return [g for g in _groups(self._driven(hypothesis)) if any(names & set(b.free) for b in g)]

    def _refitted(
        self, before: Hypothesis, groups: Sequence[Sequence[DrivenBlock]], new: Sequence[Unknown] = ()
    ) -> Hypothesis:
        values, fits = dict(before.values), dict(before.fits)
        chi2, rows, worth = dict(before.chi2), dict(before.rows), dict(before.worth)
        done = shared_out(lambda k: self._trials.settled(before, groups[k], new), len(groups))
        rough, gone = before.rough, before.astray
        for group, (best, told, quick) in zip(groups, done, strict=True):
            if isinstance(best, ConvergenceError):
                raise best
            values |= best.values
            rough |= quick is not None
            names = tuple(b.block.name for b in group)
            fits = {k: f for k, f in fits.items() if not set(k) & set(names)} | {names: best}
            for key, (square, count, size) in told.items():
                chi2[key], rows[key], worth[key] = square, count, size
            if quick is not None and before.coarse and new:
                mine = {k: told[k][0] for k in told}, {k: told[k][1] for k in told}
                gone = frozenset(k for k in gone if k not in told) | astray(before.chi2, *mine, quick)
        chi2 = like_the_others(chi2, rows, gone)
        told_of = replace(before, chi2=chi2, rows=rows, worth=worth, rough=rough, astray=gone)
        return replace(told_of, values=values, fits=fits)


def _judged(evidence: Evidence) -> tuple[Array, Array]:
    output = evidence.predicted({})
    target = evidence.driven.block.target
    error = (evidence.record.trace[target] if target else 0.0) - output
    return output, (evidence.floor.filter @ error) / evidence.floor.sigma


def _edited(hypothesis: Hypothesis, candidate: Candidate) -> Hypothesis:
    """Return a hypothesis with the effect in its assembly, not fitted yet."""
    renamed = _renamed(hypothesis, candidate.assembly)
    old = tuple(replace(u, name=renamed.get(u.name, u.name)) for u in hypothesis.unknowns)
    values = {renamed.get(n, n): v for n, v in hypothesis.values.items()}
    # An edit may share a number out, for instance an inertia: what was fitted is shared out alike.
    then, now = hypothesis.assembly.quantities(), candidate.assembly.quantities()
    for name in values.keys() & then.keys() & now.keys():
        if then[name].value != now[name].value:
            values[name] *= now[name].number / then[name].number
    added = (*_with_unknowns(hypothesis.added, old), candidate)
    return replace(hypothesis, assembly=candidate.assembly, added=added, values=values)


def _refittable(parameters: Sequence[Variable]) -> list[Variable]:
    """Return the numbers with a spread; long rows are tables of a shape, not refitted point by point."""
    lengths = Counter(v.name.partition("[")[0] for v in parameters)
    return [v for v in parameters if v.spread > 0.0 and lengths[v.name.partition("[")[0]] <= _LONGEST_ROW]


def _groups(blocks: Sequence[DrivenBlock]) -> list[list[DrivenBlock]]:
    """Return blocks in groups that share no free parameter."""
    groups: list[list[DrivenBlock]] = []
    for block in blocks:
        joined = [g for g in groups if any(set(b.free) & set(block.free) for b in g)]
        groups = [g for g in groups if g not in joined] + [[*(b for g in joined for b in g), block]]
    return groups


def _renamed(hypothesis: Hypothesis, assembly: Assembly) -> dict[str, str]:
    """Return the new names of numbers that an edit has moved: same end, other beginning."""
    new = [n for n in assembly.quantities() if n not in hypothesis.assembly.quantities()]
    gone = [n for n in hypothesis.assembly.quantities() if n not in assembly.quantities()]
    found = {}
    for old in gone:
        pieces = old.split(".")
        for k in range(len(pieces), 0, -1):
            tail = "." + ".".join(pieces[-k:])
            matches = [n for n in new if n.endswith(tail) and n.split(".")[0] == pieces[0]]
            if len(matches) == 1:
                found[old] = matches[0]
                break
    rows = {}
    for name in hypothesis.values:
        row, bracket, index = name.partition("[")
        if row in found:
            rows[name] = found[row] + bracket + index
    return found | rows


def _with_unknowns(added: Sequence[Candidate], unknowns: Sequence[Unknown]) -> tuple[Candidate, ...]:
    left = list(unknowns)
    result = []
    for each in added:
        own, left = left[: len(each.unknowns)], left[len(each.unknowns) :]
        result.append(replace(each, unknowns=tuple(own)))
    return tuple(result)
