"""Hypotheses about what is missing, each fitted to the same records in the same way."""

from __future__ import annotations

import itertools
from collections import Counter
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from ..identification.driven import DrivenBlock
from ..identification.evidence import Bench, Evidence
from ..identification.fit import Fit, Parameter, declared_parameter, fit, predicted_cost
from ..identification.residuals import effective_size
from ..model import Assembly, Variable
from .cuts import blocks_of
from .effects.candidate import Candidate, Unknown

Array = NDArray[np.float64]

_LONGEST_ROW = 12
_FULL_STARTS = 3
_EVALUATIONS, _COARSE_EVALUATIONS, _COARSE_TOLERANCE = 40, 20, 3e-4
"""So many starts are fitted to the end; where there are more, the best by a linear look ahead."""


@dataclass(frozen=True, eq=False)
class Hypothesis:
    """An assembly fitted to the records.

    Parameters
    ----------
    assembly
        With declared numbers, and the effects added so far.
    added
        The effects, in the order in which they were added.
    values
        Fitted numbers by name.
    fits
        One for each group of blocks that share parameters, by the names of the blocks.
    chi2
        Sum of squared residuals in units of the noise floor by block and record.
    rows
        Number of residuals by block and record.
    worth
        How many independent residuals these are worth, coloured as they are.
    coarse
        Whether it was fitted to thinned records only.
    """

    assembly: Assembly
    added: tuple[Candidate, ...]
    values: Mapping[str, float]
    fits: Mapping[tuple[str, ...], Fit]
    chi2: Mapping[tuple[str, str], float]
    rows: Mapping[tuple[str, str], int]
    worth: Mapping[tuple[str, str], float]
    coarse: bool = False

    @property
    def names(self) -> tuple[str, ...]:
        """Identifiers of the effects."""
        return tuple(c.effect for c in self.added)

    @property
    def unknowns(self) -> tuple[Unknown, ...]:
        """Numbers that the effects brought along."""
        return tuple(u for c in self.added for u in c.unknowns)

    @property
    def prior(self) -> float:
        """Sum of squared departures from declared numbers, in standard deviations of their spread."""
        return float(sum(s**2 for f in self.fits.values() for s in f.strain().values()))

    @property
    def fitted(self) -> Assembly:
        """The assembly with the fitted numbers."""
        return self.assembly.with_values(self.values)


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
        self._sizes = sizes

    def base(self, assembly: Assembly) -> Hypothesis:
        """Refit the declared assembly, so that a wrong number is not taken for a wrong structure.

        Parameters
        ----------
        assembly
            As declared.
        """
        blank = Hypothesis(assembly, (), {}, {}, {}, {}, {})
        return self._refitted(blank, _groups(self._driven(blank)))

    def coarsely(self, hypothesis: Hypothesis) -> Hypothesis:
        """Return a hypothesis as the coarse look sees it.

        Parameters
        ----------
        hypothesis
            Fitted.
        """
        return self._refitted(replace(hypothesis, coarse=True), _groups(self._driven(hypothesis)))

    def with_effect(self, hypothesis: Hypothesis, candidate: Candidate) -> Hypothesis:
        """Fit a hypothesis with one more effect; blocks that it does not touch stay as they are.

        Parameters
        ----------
        hypothesis
            Fitted, coarsely or not.
        candidate
            Made from ``hypothesis.assembly``.
        """
        renamed = _renamed(hypothesis, candidate.assembly)
        old = tuple(replace(u, name=renamed.get(u.name, u.name)) for u in hypothesis.unknowns)
        values = {renamed.get(n, n): v for n, v in hypothesis.values.items()}
        added = (*_with_unknowns(hypothesis.added, old), candidate)
        before = replace(hypothesis, assembly=candidate.assembly, added=added, values=values)
        return self._refitted(before, self._touched(before, candidate.unknowns), candidate.unknowns)

    def polished(self, hypothesis: Hypothesis) -> Hypothesis:
        """Refit a coarse hypothesis to all samples, from where it stands.

        Parameters
        ----------
        hypothesis
            Fitted coarsely.
        """
        return self._refitted(replace(hypothesis, coarse=False), _groups(self._driven(hypothesis)))

    def evidence(self, hypothesis: Hypothesis) -> list[Evidence]:
        """Return what all records say about all blocks of a hypothesis, on all samples.

        Parameters
        ----------
        hypothesis
            Fitted.
        """
        records = self.bench.records.records
        return [
            e for b in self._driven(hypothesis) for e in self.bench.evidence(b, records, hypothesis.values)
        ]

    def _driven(self, hypothesis: Hypothesis) -> list[DrivenBlock]:
        found = []
        for block in blocks_of(hypothesis.assembly, self.bench.records.signals):
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
        for group in groups:
            best, evidence = self._best_fit(before, group, new)
            values |= best.values
            names = tuple(b.block.name for b in group)
            fits = {k: f for k, f in fits.items() if not set(k) & set(names)} | {names: best}
            for each in evidence:
                key = each.driven.block.name, each.record.name
                residual = each.residual(values)[0]
                chi2[key], rows[key] = float(residual @ residual), len(residual)
                worth[key] = effective_size(residual)
        return replace(before, values=values, fits=fits, chi2=chi2, rows=rows, worth=worth)

    def _best_fit(
        self, before: Hypothesis, group: Sequence[DrivenBlock], new: Sequence[Unknown]
    ) -> tuple[Fit, list[Evidence]]:
        free = list(dict.fromkeys(name for b in group for name in b.free))
        mine = [u for u in new if u.name in free]
        variables = {v.name: v for b in group for v in b.block.model.parameters}
        known = {u.name: u for u in before.unknowns}
        starts = [
            dict(zip([u.name for u in mine], s, strict=True))
            for s in itertools.product(*[[v * self._scale(u) for v in u.starts] for u in mine])
        ]
        choices = [
            [self._parameter(variables[n], known.get(n), start.get(n, before.values.get(n))) for n in free]
            for start in starts
        ]
        begin = {p.name: p.start for p in choices[0]}
        everything = [
            e
            for b in group
            for e in self.bench.evidence(b, self.bench.records.records, begin, coarse=before.coarse)
        ]
        seen = [e for e in everything if e.record.role == "fit"]
        if len(choices) > _FULL_STARTS:
            choices = sorted(choices, key=lambda ps: predicted_cost(seen, ps))[:_FULL_STARTS]
        limits = (_COARSE_EVALUATIONS, _COARSE_TOLERANCE) if before.coarse else (_EVALUATIONS, 0.0)
        fits = (fit(seen, ps, evaluations=limits[0], tolerance=limits[1]) for ps in choices)
        return min(fits, key=lambda f: f.cost), everything

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
