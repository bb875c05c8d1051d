"""How one hypothesis is fitted to one group of blocks: starts, limits, and what is reported of it."""

from __future__ import annotations

import itertools
from collections.abc import Collection, Mapping, Sequence
from dataclasses import dataclass, replace

from ...errors import ConvergenceError
from ...identification.equation_error.block_response import DrivenBlock
from ...identification.equation_error.evidence import Bench, Evidence
from ...identification.estimation.least_squares import Fit, Parameter, declared_parameter, fit, predicted_cost
from ...identification.statistics.residuals import effective_size
from ...model import Variable, flatten
from ..blocks.tearing import blocks_of
from ..effects.candidate import Unknown
from .hypothesis import Hypothesis
from .unpredictable import quickest

_FULL_STARTS = 3
"""So many starts are fitted to the end, the best by a linear look ahead."""
_EVALUATIONS, _COARSE_EVALUATIONS, _COARSE_TOLERANCE = 40, 20, 3e-4
_POLISHED, _DEAR = 2e-5, 6
_LONG = 30_000
"""Steps of so many operations are dear too."""
_TOO_DEAR = 100_000
_MOST_STARTS = 8
"""A further effect of dearer steps, or of more starts where a body coasts, is left out: it takes minutes."""
_BESIDE = (1.2,)
"""Multiples of what a sketch says of a new number that are tried as well."""
_HELD = 1e-4
"""Share by which a number that is held may move."""
_BEGUN = 0.3
"""Share of the excess over the noise that a sketch must explain for the whole to be fitted."""
_SMALL = 1e-3
"""A coarse fit ends when it promises to gain less than this share of the cost without the effect."""


@dataclass(frozen=True, eq=False)
class _Task:
    """Starts of the free numbers of a group of blocks, all evidence, and that which fits may see."""

    choices: list[list[Parameter]]
    everything: list[Evidence]
    seen: list[Evidence]


def _promise(seen: Sequence[Evidence], parameters: Sequence[Parameter]) -> float:
    """Return the cost that the linearised problem would reach; infinite where there is no response."""
    try:
        return predicted_cost(seen, parameters)
    except ConvergenceError:
        return float("inf")


def _best_of(
    seen: Sequence[Evidence],
    starts: Sequence[Sequence[Parameter]],
    limits: tuple[int, float],
    least: float,
    known: Mapping[tuple[str, str], float] | None = None,
) -> Fit:
    """Return the best of fits from several starts, the most promising first."""
    several = len(starts) > 1
    choices = [(_promise(seen, ps) if several else 0.0, ps) for ps in starts]
    best: Fit | None = None
    for promised, choice in sorted(choices, key=lambda pair: pair[0])[:_FULL_STARTS]:
        # What does not even promise to reach the best so far is left alone.
        if best is not None and promised >= best.cost:
            continue
        try:
            found = fit(seen, choice, evaluations=limits[0], tolerance=limits[1], least=least, known=known)
        except ConvergenceError as error:
            failed = error  # one start in a place where there is no response says nothing of others
            continue
        best = found if best is None or found.cost < best.cost else best
    if best is None:
        raise failed
    return best


def _pinned(fitted: Fit, name: str, factor: float) -> list[Parameter]:
    """Return the parameters of a fit where it ended, one of them held at a multiple of that."""
    found = []
    for each in fitted.parameters:
        value = fitted.values[each.name]
        if each.name == name:
            value = min(max(factor * value, each.lower), each.upper)
            each = replace(each, lower=value * (1.0 - _HELD), upper=value * (1.0 + _HELD))
        found.append(replace(each, start=value))
    return found


def _worth_a_fit(before: Hypothesis, slow: Sequence[Evidence], cost: float) -> bool:
    """Tell whether what a sketch has begun takes enough off the excess over the noise to be fitted."""
    keys = [(e.driven.block.name, e.record.name) for e in slow]
    now = 0.5 * sum(before.chi2[k] for k in keys)
    return now - cost >= _BEGUN * (now - 0.5 * sum(before.rows[k] for k in keys))


class Trials:
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

    def settled(
        self, before: Hypothesis, group: Sequence[DrivenBlock], new: Sequence[Unknown]
    ) -> tuple[
        Fit | ConvergenceError, dict[tuple[str, str], tuple[float, int, float]], frozenset[str] | None
    ]:
        """Fit a group of blocks.

        Parameters
        ----------
        before
            Hypothesis with the effect in its assembly.
        group
            Blocks that share free numbers.
        new
            Numbers that have starts of their own.

        Returns
        -------
        tuple
            The fit, or why there is none; sum of squares, rows and worth of each block and record; and
            the names of the quickest records where a body coasts between contacts, else None.
        """
        try:
            best, evidence = self._best_fit(before, group, new)
        except ConvergenceError as error:
            return error, {}, None
        told = {}
        for each in evidence:
            residual = each.residual(best.values)[0]
            told[each.driven.block.name, each.record.name] = (
                float(residual @ residual),
                len(residual),
                effective_size(residual),
            )
        coasts = any(each.driven.stiff for each in evidence)
        return best, told, quickest(evidence) if coasts else None

    def _best_fit(
        self, before: Hypothesis, group: Sequence[DrivenBlock], new: Sequence[Unknown]
    ) -> tuple[Fit, list[Evidence]]:
        task = self._task(before, group, new)
        dearest = max((e.driven.instructions for e in task.seen), default=0)
        further = len(before.added) > 1
        if further and (dearest > _TOO_DEAR or (before.rough and len(task.choices) > _MOST_STARTS)):
            raise ConvergenceError(
                " with ".join(before.names),
                f"is too dear to try: {dearest} operations per step, {len(task.choices)} starts",
                next_step="declare one of them in the deck and diagnose what is left",
            )
        limits = (
            (_COARSE_EVALUATIONS, _COARSE_TOLERANCE)
            if before.coarse
            else (_EVALUATIONS, _POLISHED if before.added else 0.0)
        )
        fitted, names = {r.name for r in self._bench.records.of("fit")}, {b.block.name for b in group}
        now = 0.5 * sum(c for (b, r), c in before.chi2.items() if b in names and r in fitted)
        least = _SMALL * now if before.coarse and new else 0.0
        if any(e.driven.stiff for e in task.seen):
            # Short steps are dear, and where a body flies freely the valley is rough at the bottom.
            limits = _DEAR if before.coarse and not further else _DEAR // 3, limits[1]
        elif before.added and dearest > _LONG:
            limits = _DEAR, limits[1]
        return self._settled_on(task, before, (group, new), limits, least), task.everything

    def _settled_on(
        self,
        task: _Task,
        before: Hypothesis,
        what: tuple[Sequence[DrivenBlock], Sequence[Unknown]],
        limits: tuple[int, float],
        least: float,
    ) -> Fit:
        """Fit; where a body coasts, from what a sketch or slower records say, and no record decides alone."""
        calm = [e for e in task.seen if (e.driven.block.name, e.record.name) not in before.astray]
        calm = calm or task.seen
        if not any(e.driven.stiff for e in task.seen):
            return _best_of(calm, task.choices, limits, least)
        if not before.coarse:
            return _best_of(calm, task.choices, limits, least, {})
        quick, known = quickest(task.everything), before.chi2
        slow = [e for e in calm if e.record.name not in quick] or calm
        starts = [
            [replace(p, start=values.get(p.name, p.start)) for p in task.choices[0]]
            for values in self._sketched(before, what, task.choices, quick)
        ]
        evaluations = limits[0]
        if starts:
            looks = [fit(slow, ps, evaluations=0, known={}).cost for ps in starts]
            starts = [starts[looks.index(min(looks))]]
            evaluations = evaluations if _worth_a_fit(before, slow, min(looks)) else 0
        best = _best_of(slow, starts or task.choices, (evaluations, limits[1]), 0.1 * least, {})
        begin = [replace(p, start=best.values[p.name]) for p in best.parameters]
        few = evaluations // 2
        return fit(calm, begin, evaluations=few, tolerance=limits[1], least=least, known=known)

    def _sketched(
        self,
        before: Hypothesis,
        what: tuple[Sequence[DrivenBlock], Sequence[Unknown]],
        choices: list[list[Parameter]],
        quick: Collection[str],
    ) -> list[dict[str, float]]:
        """Return what a simpler form of the newest effect says on the slower records, beside its valley too.

        Slow motion can hardly tell more of the effect from more of what it acts on, so each new number is
        held a little above as well: without inertia behind it, play looks smaller than it is.
        """
        group, new = what
        # A deck may declare play itself: then nothing is new, and there is no sketch.
        sketch, names = before.added[-1].sketch if new else None, {b.block.name for b in group}
        if sketch is None:
            return []
        blocks = [b for b in blocks_of(flatten(sketch), self._bench.records.signals) if b.name in names]
        free = [p.name for p in choices[0]]
        driven = [DrivenBlock(b, [n for n in free if n in b.model.values]) for b in blocks]
        shared = {n for d in driven for n in d.free}
        starts = list(dict.fromkeys(tuple(p for p in c if p.name in shared) for c in choices))
        begin = {p.name: p.start for p in starts[0]}
        fitted = self._bench.records.of("fit")
        records = [r for r in fitted if r.name not in quick] or fitted
        seen = [e for d in driven for e in self._bench.evidence(d, records, begin, coarse=True)]
        own, whole = sketch.quantities(), before.assembly.quantities()
        same = {n for n in own if n in whole and own[n].value == whole[n].value}
        limits = _COARSE_EVALUATIONS, _COARSE_TOLERANCE
        try:
            best = _best_of(seen, starts, limits, 0.0)
            pinned = [_pinned(best, u.name, f) for u in new if u.name in shared for f in _BESIDE]
            found = [best, *[_best_of(seen, [ps], limits, 0.0) for ps in pinned]]
        except ConvergenceError:
            return []
        return [{n: v for n, v in f.values.items() if n.partition("[")[0] in same} for f in found]

    def _task(self, before: Hypothesis, group: Sequence[DrivenBlock], new: Sequence[Unknown]) -> _Task:
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
            for e in self._bench.evidence(b, self._bench.records.records, begin, coarse=before.coarse)
        ]
        return _Task(choices, everything, [e for e in everything if e.record.role == "fit"])

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
