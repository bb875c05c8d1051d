"""How far two hypotheses would be apart on a record, when each may adapt its numbers first.

The expected log of the ratio of likelihoods, as in the criteria of Hunter and Reiner 1965, Box and Hill 1967
and Atkinson and Fedorov 1975: data from one hypothesis, its numbers anywhere where the records so far leave
them, against the other one, refitted to those records and the new one. With residuals r in units of noise,
slopes S and the covariance C of the other one's numbers

    D² = δᵀ(δ − S·p),   p = (C⁻¹ + SᵀS)⁻¹·Sᵀδ,   δ = r_other − r_one,

so what a number of the other one can absorb, as far as the records so far leave it open, does not count.
"""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from typing import NamedTuple

import numpy as np
import scipy

from ....foundation.arrays import Array, Mask
from ....foundation.errors import ConvergenceError
from ...identification.equation_error.block import NoiseFloor
from ...identification.equation_error.block_response import DrivenBlock
from ...identification.equation_error.evidence import Bench, Evidence
from ...identification.least_squares import Fit
from ...identification.parameters import Parameter, box
from ...identification.records.measurement import Record
from ..effects.effect import Unknown
from ..selection.hypothesis import Hypothesis

Values = Mapping[str, float]

_OPEN = 0.3
"""Standard error in the fitted scale above which a number may be elsewhere: data may come from there, too."""
_POINTS, _MOST = 16, 3
"""Points that are tried for the numbers that are open, and how many of them are kept."""
_FURTHEST = 10.0
"""Half width of a number without bounds, in the fitted scale."""
_ALLOWED = 4.0
"""Growth of the sum of squares up to which other numbers are as good: two standard errors."""
_OUTLYING_SLOPE = 1e3
"""Where a body flies freely, a slope steeper than this is that of a contact just made or missed; such a row
tells hypotheses apart by chance alone."""


class BlockResponse(NamedTuple):
    """Residual of a block in units of the noise, shape (rows,), and slopes in the fitted scale."""

    residual: Array
    slope: Array
    driven: DrivenBlock


@dataclass(frozen=True, eq=False)
class ReadyHypothesis:
    """A hypothesis made ready to be evaluated on records that were not measured yet."""

    hypothesis: Hypothesis  # fitted
    driven: tuple[DrivenBlock, ...]  # its blocks
    # parameters: free numbers in the order of the covariance, by the name of the block
    parameters: Mapping[str, tuple[Parameter, ...]]
    # information: inverse covariance of the numbers, by the name of the block; blocks that share numbers
    # share it
    information: Mapping[str, Array]
    values: tuple[Values, ...]  # fitted numbers, and others with which it explains the records so far as well

    def responses(self, record: Record, floors: Mapping[str, NoiseFloor]) -> list[dict[str, BlockResponse]]:
        """Return what each block says of a record, for each of the numbers that the hypothesis may have.

        ``floors``: by the name of the block; blocks without one are left out.
        """
        return self.at(record, floors, self.values)

    def at(
        self, record: Record, floors: Mapping[str, NoiseFloor], values: Sequence[Values]
    ) -> list[dict[str, BlockResponse]]:
        """Return what each block says of a record, for each of some numbers."""
        result: list[dict[str, BlockResponse]] = [{} for _ in values]
        for driven in self.driven:
            name = driven.block.name
            if name not in floors:
                continue
            evidence = Evidence(driven, record, floors[name], driven.samples(record, values[0]))
            known: dict[tuple[float, ...], BlockResponse] = {}
            for each, own in zip(result, values, strict=True):
                key = tuple(own[n] for n in driven.free)
                if key not in known:
                    known[key] = self._response(evidence, own)
                each[name] = known[key]
        return result

    def _response(self, evidence: Evidence, values: Values) -> BlockResponse:
        driven = evidence.driven
        residual, slope = evidence.residual(values)
        free = self.parameters.get(driven.block.name, ())
        wide = np.zeros((len(residual), len(free)))
        place = {p.name: k for k, p in enumerate(free)}
        for j, number in enumerate(driven.free):
            if number in place:
                k = place[number]
                wide[:, k] = slope[:, j] * free[k].slope(values[number])
        return BlockResponse(residual, wide, driven)


def made_ready(
    hypothesis: Hypothesis, bench: Bench, driven: Sequence[DrivenBlock], noise: Values
) -> ReadyHypothesis:
    """Return a hypothesis ready to be evaluated, with the numbers that the records leave possible."""
    parameters, information = {}, {}
    for names, fit in hypothesis.fits.items():
        matrix = _information(fit)
        for name in names:
            parameters[name], information[name] = fit.parameters, matrix
    declared = {n: v for each in driven for n, v in each.block.model.values.items()}
    centre = {**declared, **hypothesis.values}
    alone = ReadyHypothesis(hypothesis, tuple(driven), parameters, information, (centre,))
    others = [v for fit in hypothesis.fits.values() for v in _as_good(alone, bench, noise, fit)]
    return replace(alone, values=(centre, *others))


def _box(parameters: Sequence[Parameter]) -> tuple[Array, Array]:
    """Return lower and upper bounds in the fitted scale, finite."""
    low, high, centre = box(parameters)
    return np.maximum(low, centre - _FURTHEST), np.minimum(high, centre + _FURTHEST)


def _information(fit: Fit) -> Array:
    """Return the inverse covariance; no number is less known than its bounds say."""
    if not fit.parameters:
        return np.zeros((0, 0))
    low, high = _box(fit.parameters)
    inverse = np.linalg.pinv(fit.covariance, rcond=1e-12, hermitian=True)
    return np.asarray(inverse + np.diag((0.5 * (high - low)) ** -2.0), dtype=np.float64)


def _as_good(rival: ReadyHypothesis, bench: Bench, noise: Values, fit: Fit) -> list[Values]:
    """Return numbers elsewhere in their bounds that explain the records so far as well.

    The numbers that an effect has brought and the records leave open are put all over their bounds, all
    others refitted to that by one linear step. The strongest come first: what is too weak for any record
    decides nothing.
    """
    own = {u.name for u in rival.hypothesis.unknowns}
    names = [p.name for p in fit.parameters]
    loose = [k for k, n in enumerate(names) if n in own and math.sqrt(fit.covariance[k, k]) > _OPEN]
    if not loose:
        return []
    low, high = _box(fit.parameters)
    blocks = {b for b, p in rival.parameters.items() if p is fit.parameters}
    centre = rival.values[0]
    least = _Total.of(rival, bench, noise, blocks, centre).squares
    kept: list[tuple[float, Values]] = []
    for point in scipy.stats.qmc.Sobol(len(loose), scramble=False).random(_POINTS):
        x = np.array([p.inward(centre[p.name]) for p in fit.parameters])
        x[loose] = low[loose] + point * (high - low)[loose]
        moved = _with_numbers(fit, centre, x)
        total = _Total.of(rival, bench, noise, blocks, moved)
        rest = [k for k in range(len(names)) if k not in loose]
        if rest and math.isfinite(total.squares):
            step = np.linalg.lstsq(total.matrix[np.ix_(rest, rest)], total.gradient[rest], rcond=1e-10)[0]
            x[rest] = np.clip(x[rest] - step, low[rest], high[rest])
            moved = _with_numbers(fit, centre, x)
            total = _Total.of(rival, bench, noise, blocks, moved)
        if total.squares <= least + _ALLOWED:
            kept.append((_strength(rival.hypothesis.unknowns, moved), moved))
    return [values for _, values in sorted(kept, key=lambda pair: -pair[0])[:_MOST]]


def _strength(unknowns: Sequence[Unknown], values: Values) -> float:
    """Return how far, on a logarithmic scale, numbers are from where their effect vanishes."""
    total = 0.0
    for each in unknowns:
        if each.null is None or each.name not in values:
            continue
        value = abs(values[each.name])
        away = 1.0 / max(value, 1e-300) if math.isinf(each.null) else abs(value - each.null)
        total += math.log(max(away, 1e-300))
    return total


def _with_numbers(fit: Fit, centre: Values, x: Array) -> dict[str, float]:
    return {
        **centre,
        **{
            p.name: float(np.clip(p.outward(v), p.lower, p.upper))
            for p, v in zip(fit.parameters, x, strict=True)
        },
    }


@dataclass(frozen=True, eq=False)
class _Total:
    """Sum of squares over the records so far in units of the noise, half its gradient, and JᵀJ."""

    squares: float
    gradient: Array
    matrix: Array

    @classmethod
    def of(
        cls, rival: ReadyHypothesis, bench: Bench, noise: Values, blocks: set[str], values: Values
    ) -> _Total:
        """Return it for some numbers; an infinite sum where there is no response."""
        parameters = rival.parameters[next(iter(blocks))]
        deviations = [
            (p.inward(values[p.name]) - p.inward(p.centre)) / p.sigma if math.isfinite(p.sigma) else 0.0
            for p in parameters
        ]
        weights = np.array([1.0 / p.sigma if math.isfinite(p.sigma) else 0.0 for p in parameters])
        total = float(np.sum(np.square(deviations)))
        gradient, matrix = weights * np.array(deviations), np.diag(weights**2)
        for record in bench.records.of("fit"):
            read = {b: bench.block_noise[b].floors for b in bench.block_noise if b in blocks}
            floors = {b: each[record.name] for b, each in read.items() if record.name in each}
            try:
                (answers,) = rival.at(record, floors, [values])
            except ConvergenceError:
                return cls(math.inf, gradient, matrix)  # numbers without a response are never taken
            for name, response in answers.items():
                total += float(response.residual @ response.residual) / noise[name]
                gradient = gradient + response.slope.T @ response.residual / noise[name]
                matrix = matrix + response.slope.T @ response.slope / noise[name]
        return cls(total, gradient, matrix)


class Apart(NamedTuple):
    """How far two hypotheses are apart on a record."""

    squares: float  # expected growth of the sum of squares, in units of the noise
    block: str  # where it is largest
    row: int  # row of the block's floor at which it is largest


def apart(
    one: Sequence[Mapping[str, BlockResponse]],
    other: Mapping[str, BlockResponse],
    rival: ReadyHypothesis,
    noise: Values,
) -> Apart:
    """Return how badly a hypothesis would explain what another one leaves, when it is refitted."""
    results = [_once(each, other, rival, noise) for each in one]
    best = max(results, key=lambda a: a.squares)
    # The mean of the logarithm: one set of numbers that is far away does not speak for the others.
    return Apart(float(np.expm1(np.mean([np.log1p(a.squares) for a in results]))), best.block, best.row)


def _once(
    one: Mapping[str, BlockResponse],
    other: Mapping[str, BlockResponse],
    rival: ReadyHypothesis,
    noise: Values,
) -> Apart:
    names = [n for n in one if n in other]
    groups: dict[int, list[str]] = {}
    for name in names:
        groups.setdefault(id(rival.information.get(name)), []).append(name)
    total, best = 0.0, Apart(0.0, names[0] if names else "", 0)
    for members in groups.values():
        rows, slopes = [], []
        for name in members:
            a, b, scale = one[name], other[name], 1.0 / np.sqrt(noise[name])
            delta, slope = (b.residual - a.residual) * scale, b.slope * scale
            outlying = _outlying(a) | _outlying(b)
            rows.append(np.where(outlying, 0.0, delta))
            slopes.append(np.where(outlying[:, None], 0.0, slope))
        delta, slope = np.concatenate(rows), np.vstack(slopes)
        left = delta
        if slope.shape[1]:
            step = np.linalg.solve(rival.information[members[0]] + slope.T @ slope, slope.T @ delta)
            left = delta - slope @ step
        total += max(float(delta @ left), 0.0)
        place = 0
        for name, part in zip(members, rows, strict=True):
            own = np.abs(left[place : place + len(part)])
            share = float(own @ own)
            if len(part) and share > best.squares:
                best = Apart(share, name, int(np.argmax(own)))
            place += len(part)
    return Apart(total, best.block, best.row)


def _outlying(response: BlockResponse) -> Mask:
    if not (response.driven.stiff and response.slope.shape[1]):
        return np.zeros(len(response.residual), dtype=bool)
    rows: Mask = np.abs(response.slope).max(axis=1) > _OUTLYING_SLOPE
    return rows
