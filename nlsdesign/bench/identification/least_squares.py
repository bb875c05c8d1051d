"""Fits of parameters to several records and blocks at once, by least squares with exact derivatives.

Bounded nonlinear least squares: Levenberg–Marquardt, each step the exact minimum inside the box.

Positive numbers are fitted on a logarithmic scale, where most of what is nonlinear is mild. But many laws
are linear in their numbers: friction, drag, inertia. Where two such numbers can nearly stand for each
other and the records are far sharper than the model is right, the valley of the cost is narrow and bent
on that scale, and a step along its tangent leaves it. A step that fails is therefore tried once more as a
straight line in the numbers themselves, which follows such a valley to its end.

A profile tells how the cost grows when one number is held and all others are fitted again.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Collection, Mapping, Sequence
from dataclasses import dataclass, replace
from typing import NamedTuple

import numpy as np
import scipy

from ...foundation.arrays import Array, Mask
from ...foundation.errors import ConvergenceError
from .covariance import Piece, covariance_by_records, inverse_information, robust_covariance
from .equation_error.evidence import Evidence
from .parameters import Parameter as Parameter
from .parameters import box
from .parameters import declared_parameter as declared_parameter
from .residuals import autocorrelation

ENOUGH = 0.02
"""A predicted gain of half a sum of squares below this cannot matter to any decision on noisy data."""
_LONGEST = 1.5
_LONGEST_STRAIGHT = 3.0
"""Largest change of a logarithm in a step that is straight in the number itself."""
_STRAIGHT_FAILURES = 3
"""So many straight steps may fail in a row: then the model is not linear in its numbers."""
_ENDLESS = "has slopes that are not finite"
_FIRST_DAMPING, _LEAST_DAMPING, _MOST_DAMPING = 1e-4, 1e-9, 1e8
_UNDAMPED = 1e-7
"""Damping up to which a step promises what it does without, in any direction that residuals tell."""
_EVALUATIONS = 40
"""Bound of evaluations: a fit that has not ended by then is not going to."""
_LEAST_INFORMATION = 1e-6
"""Information on the fitted scale that is taken for granted, so that a covariance is never infinite."""
_OUTLYING_SLOPE = 1e3
"""Where a body flies freely, a slope that is steeper than this, in standard deviations of the noise, is that
of a contact just made or just missed: it holds at this point and nowhere around it."""
_HUBER = 3.0
"""Standard deviations beyond which, where a body flies freely, a residual counts as Huber says: noise stays
within."""
_WEAK = 0.3
"""A direction known no better than this (relative) is reported as not identified."""
_PLAIN_SHARE = 0.3
"""Share of a direction from which a number is mentioned in it."""


@dataclass(frozen=True)
class Loss:
    """What turns residuals into a cost: half the sum of squares, right where errors are noise."""

    def value(self, residual: Array) -> float:
        """Return the cost of all residuals together, ½·Σr².

        Parameters
        ----------
        residual
            In standard deviations, shape (n,).
        """
        return 0.5 * float(residual @ residual)

    def weight(self, residual: Array) -> Array:
        """Return the factor of each residual and its slope that makes least squares follow the loss.

        Parameters
        ----------
        residual
            In standard deviations, shape (n,).
        """
        return np.ones_like(residual)


@dataclass(frozen=True)
class Huber(Loss):
    """Squares up to some standard deviations, lines beyond: a few outliers do not decide.

    ρ(r) = ½·r² for |r| ≤ k, k·|r| − ½·k² beyond. Source: Huber 1964.

    Parameters
    ----------
    limit
        k in standard deviations; 1.345 keeps 95 % of the efficiency on normal noise.
    """

    limit: float = 1.345

    def value(self, residual: Array) -> float:
        """Return Σρ(r)."""
        size = np.abs(residual)
        return float(
            np.sum(np.where(size <= self.limit, 0.5 * size**2, self.limit * (size - 0.5 * self.limit)))
        )

    def weight(self, residual: Array) -> Array:
        """Return √(min(1, k/|r|))."""
        result: Array = np.sqrt(np.minimum(1.0, self.limit / np.maximum(np.abs(residual), 1e-300)))
        return result


def huber_rows(residual: Array, slope: Array, limit: float) -> tuple[Array, Array]:
    """Return residuals and slopes scaled so that half the sum of squares is Huber's loss.

    ``slope``: its derivatives, shape (n, parameters).
    """
    size = np.abs(residual)
    far = size > limit
    scaled = np.where(far, np.sqrt(np.maximum(2.0 * limit * size - limit**2, 0.0)), size)
    steepness = np.where(far, limit / np.maximum(scaled, 1e-300), 1.0)
    return np.sign(residual) * scaled, steepness[:, None] * slope


def bounded_total(residual: Array, slope: Array, bound: float) -> tuple[Array, Array]:
    """Return residuals and slopes scaled so that their sum of squares c counts as ρ(c) < 2·bound.

    ρ(c) = c up to the bound, bound·(2 − bound/c) beyond: smooth, and rising ever more slowly. For a whole
    record that a model may predict not at all, which must not decide over those that it predicts.

    ``slope``: its derivatives, shape (n, parameters).
    """
    total = float(residual @ residual)
    if total <= bound:
        return residual, slope
    share = bound / total
    scale = math.sqrt(share * (2.0 - share))
    # The derivative of the scale with respect to c = Σr², for the exact slope of scale·r.
    steepness = share * (share - 1.0) / (total * scale)
    return scale * residual, scale * slope + np.outer(2.0 * steepness * residual, residual @ slope)


Rows = Callable[[Array], tuple[Array, Array]]


class Minimum(NamedTuple):
    """Where the descent ended."""

    x: Array  # point inside the bounds
    cost: float  # half the sum of squares there
    converged: bool  # whether no step promised any more; otherwise the number of evaluations ran out


def minimise(
    rows: Rows,
    start: Array,
    box: tuple[Array, Array],
    *,
    evaluations: int,
    share: float = 0.0,
    least: float = 0.0,
    logarithmic: Mask | None = None,
) -> Minimum:
    """Return the minimum of half a sum of squares within bounds.

    ``evaluations``: at most so many; a point where there is no response counts as a bad one. ``logarithmic``:
    which coordinates are logarithms of positive numbers, in the shape of the start; by default none.
    """
    x, damping, used, undamped = start, _FIRST_DAMPING, 0, False
    residual, slope = rows(x)
    if not x.size:
        return Minimum(x, 0.5 * float(residual @ residual), True)  # what is known is all there is
    here = _linearised(residual, slope)
    if here is None:
        raise ConvergenceError("fit", _ENDLESS, next_step="narrow the bounds")
    logs = np.zeros(x.shape, dtype=bool) if logarithmic is None else logarithmic
    straight_left = _STRAIGHT_FAILURES if logs.any() else 0
    while used < evaluations:
        step = _step(here, damping, _walls(x, box))
        gain = here.gain(step)
        if gain < max(ENOUGH, share * here.cost, least) * (1.0 if damping <= 1.0 else 1e-2):
            # Damping shortens a step most along what is known least: the step without it has the last word.
            if undamped or damping <= _UNDAMPED:
                return Minimum(x, here.cost, True)
            undamped, damping = True, _LEAST_DAMPING
            continue
        used, there = used + 1, _better(rows, x + step, here)
        if there is None and straight_left and used < evaluations:
            straight = _step(here, damping, _straight_walls(x, box, logs))
            step, gain = (
                np.where(logs, np.log1p(np.where(logs, straight, 0.0)), straight),
                here.gain(straight),
            )
            used, there = used + 1, _better(rows, x + step, here)
            straight_left = _STRAIGHT_FAILURES if there else straight_left - 1
        if there is not None:
            good = (here.cost - there.cost) / gain
            x, here, undamped = x + step, there, False
            damping = max(damping * (0.1 if good > 0.5 else 1.0 if good > 0.1 else 4.0), _LEAST_DAMPING)
        else:
            damping *= 10.0
            if damping > _MOST_DAMPING:
                return Minimum(x, here.cost, True)
    return Minimum(x, here.cost, False)


class _Linearised(NamedTuple):
    """Half a sum of squares at a point, its gradient, and the curvature of the linearised residuals."""

    cost: float
    gradient: Array
    curvature: Array

    def gain(self, step: Array) -> float:
        """Return by how much the linearised residuals promise to lower the cost."""
        return -float(self.gradient @ step) - 0.5 * float(step @ self.curvature @ step)


def _linearised(residual: Array, slope: Array) -> _Linearised | None:
    """Return what is needed for a step; ``None`` where it overflows."""
    with np.errstate(over="ignore", invalid="ignore"):
        cost, gradient, curvature = 0.5 * float(residual @ residual), slope.T @ residual, slope.T @ slope
    finite = np.all(np.isfinite(gradient)) and np.all(np.isfinite(curvature))
    return _Linearised(cost, gradient, curvature) if finite else None


def _better(rows: Rows, x: Array, here: _Linearised) -> _Linearised | None:
    """Return what is at a point if the cost is lower there than here; no response is a bad one."""
    try:
        residual, slope = rows(x)
    except ConvergenceError:
        return None
    cost = 0.5 * float(residual @ residual)
    return _linearised(residual, slope) if np.isfinite(cost) and cost < here.cost else None


def _walls(x: Array, box: tuple[Array, Array]) -> tuple[Array, Array]:
    """Return the least and the largest step."""
    return np.maximum(box[0] - x, -_LONGEST), np.minimum(box[1] - x, _LONGEST)


def _straight_walls(x: Array, box: tuple[Array, Array], logs: Mask) -> tuple[Array, Array]:
    """Return the least and the largest step, of logarithms as shares of the number."""
    usual = _walls(x, box)
    far = np.maximum(box[0] - x, -_LONGEST_STRAIGHT), np.minimum(box[1] - x, _LONGEST_STRAIGHT)
    low, high = (np.where(logs, np.expm1(f), u) for f, u in zip(far, usual, strict=True))
    return low, high


def _step(here: _Linearised, damping: float, walls: tuple[Array, Array]) -> Array:
    """Return the step that minimises the damped quadratic model inside the box."""
    diagonal = np.diag(here.curvature)
    lower = _root(here.curvature + np.diag(damping * diagonal), float(diagonal.max()))
    target = -np.linalg.solve(lower, here.gradient)
    most = 20 * len(target)
    step: Array = scipy.optimize.lsq_linear(lower.T, target, walls, method="bvls", tol=1e-14, max_iter=most).x
    return step


def _root(matrix: Array, largest: float) -> Array:
    """Return a lower triangular root of a matrix, lifted where rounding has left it indefinite."""
    lift = 1e-12
    while lift < 1.0:
        try:
            return np.asarray(
                np.linalg.cholesky(matrix + (lift * largest + 1e-300) * np.eye(len(matrix))), dtype=np.float64
            )
        except np.linalg.LinAlgError:
            lift *= 100.0
    raise ConvergenceError("fit", _ENDLESS, next_step="narrow the bounds")


@dataclass(frozen=True, eq=False)
class Fit:
    """Fitted numbers and how well they are known."""

    parameters: tuple[Parameter, ...]  # in the order of the vectors
    values: Mapping[str, float]  # in SI by name
    # covariance: in the fitted scale, ordered as the parameters; from the scatter of the residuals as they
    # are, see robust_covariance
    covariance: Array
    cost: float  # half the sum of squares of residuals and priors
    # misfit: half the sum of squares of the residuals alone, per block and record
    misfit: Mapping[tuple[str, str], float]
    converged: bool  # whether the fit ended by itself
    # white: what the covariance would be if the residuals were white noise of unit size, the information
    # inverted; None where that is not told
    white: Array | None = None
    # by_records: the covariance where the residuals hold what a model lacks; None where that is not told
    by_records: Array | None = None

    def standard_error(self, name: str) -> float:
        """Return the standard error of a parameter in SI, with what no record tells from it."""
        i = [p.name for p in self.parameters].index(name)
        fitted = float(np.sqrt(self.covariance[i, i])) * abs(self.parameters[i].slope(self.values[name]))
        return math.hypot(fitted, self.parameters[i].confounded)

    def correlation(self) -> Array:
        """Return the correlation matrix of the parameters."""
        deviation = np.sqrt(np.diag(self.covariance))
        result: Array = self.covariance / np.outer(deviation, deviation)
        return result

    def prior_z_scores(self) -> dict[str, float]:
        """Return how far each parameter has moved from its declared value, in prior standard deviations."""
        return {
            p.name: (p.inward(self.values[p.name]) - p.inward(p.centre)) / p.sigma
            for p in self.parameters
            if math.isfinite(p.sigma)
        }

    def expected_prior_squares(self) -> float:
        """Return the sum of squared departures in standard deviations of the prior that noise alone leaves.

        With P the information of the priors and H that of all, numbers drawn from the priors are fitted with
        the variance P⁻¹ − 2H⁻¹ + V about the declared values, V being the covariance. Where noise is white, V
        is H⁻¹ and the sum no more than the count of the numbers. Coloured residuals count as independent in
        the fit and pull further than the priors allow for.
        """
        variances = np.diag(self.covariance)
        white = np.diag(self.white) if self.white is not None else variances
        beyond = [
            max(0.0, variance - 2.0 * own) / p.sigma**2
            for p, variance, own in zip(self.parameters, variances, white, strict=True)
            if math.isfinite(p.sigma)
        ]
        return len(beyond) + math.fsum(beyond)

    def unidentified(self) -> list[str]:
        """Return in words what the records cannot tell: combinations of parameters that they leave open."""
        spread, axes = np.linalg.eigh(self.covariance)
        sentences = []
        for deviation, axis in zip(np.sqrt(np.maximum(spread, 0.0)), axes.T, strict=True):
            if deviation < _WEAK:
                continue
            order = np.argsort(-np.abs(axis))
            # Of many numbers that share a direction evenly the largest are told.
            least = min(_PLAIN_SHARE, 0.9 * abs(axis[order[0]]))
            named = [(self.parameters[i].name, axis[i]) for i in order if abs(axis[i]) > least]
            first = np.sign(named[0][1])
            words = [f"{n} {'up' if a * first > 0 else 'down'}" for n, a in named]
            known = f"known to {100 * deviation:.0f} % only" if deviation < 3.0 else "not known at all"
            sentences.append(f"{' with '.join(words)}: {known}")
        return sentences


def fit(
    evidence: Sequence[Evidence],
    parameters: Sequence[Parameter],
    *,
    evaluations: int = _EVALUATIONS,
    tolerance: float = 0.0,
    least: float = 0.0,
    known: Mapping[tuple[str, str], float] | None = None,
) -> Fit:
    """Fit parameters to everything that the records say.

    ``parameters``: what is free; each must be free in at least one block or have a prior. ``known``: sum of
    squares by block and record that another model reaches. If this is given, then where a body flies freely
    outlying residuals count as Huber says, and a record that is worse than what is known counts ever less,
    see :func:`~.losses.bounded_total`. Without it every residual counts alike.
    """
    rows = StackedRows(evidence, parameters, known)
    low, high, start = box(parameters)
    if not parameters:
        fixed = rows(start)[0]
        ended = Minimum(start, 0.5 * float(fixed @ fixed), True)
    else:
        logarithmic = np.array([p.scale == "log" for p in parameters])
        ended = minimise(
            rows,
            start,
            (low, high),
            evaluations=evaluations,
            share=tolerance,
            least=least,
            logarithmic=logarithmic,
        )
    if not np.isfinite(ended.cost):
        raise ConvergenceError("fit", "ended without a finite cost", next_step="narrow the bounds")
    residual, slope = rows(ended.x)
    misfit, place, parts = {}, len(parameters), []
    for each in evidence:
        block, record = each.driven.block.name, each.record
        behind = place + len(each.floor.sigma)
        own = residual[place:behind]
        misfit[block, record.name] = 0.5 * float(own @ own)
        time = np.asarray(record.step * each.floor.places, dtype=np.float64)
        parts.append(Piece(block, record.name, time, own, slope[place:behind]))
        place = behind
    covariance = robust_covariance(parts, slope[: len(parameters)])
    by_records = covariance_by_records(parts, slope[: len(parameters)], covariance)
    white = inverse_information(slope.T @ slope)
    values = rows.values(ended.x)
    return Fit(tuple(parameters), values, covariance, ended.cost, misfit, ended.converged, white, by_records)


class Promise(NamedTuple):
    """What a linearised problem reaches from a start."""

    near: float  # cost with some numbers held at the start
    far: float  # cost with all numbers free


def promised_costs(
    evidence: Sequence[Evidence], parameters: Sequence[Parameter], held: Collection[str] = ()
) -> Promise:
    """Return the costs that the linearised problem reaches from a start, at the price of one evaluation.

    They are infinite where there is no response. ``held``: names of numbers in which the cost has several
    minima, so that its slopes say nothing of others.
    """
    low, high, start = box(parameters)
    try:
        residual, slope = StackedRows(evidence, parameters)(start)
    except ConvergenceError:
        return Promise(math.inf, math.inf)
    size = np.linalg.norm(slope, axis=0)
    used = size > 0.0
    step = np.linalg.lstsq(slope[:, used] / size[used], -residual, rcond=1e-10)[0] / size[used]
    step = np.clip(start[used] + step, low[used], high[used]) - start[used]
    far = 0.5 * float(np.sum((residual + slope[:, used] @ step) ** 2))
    free = used & [p.name not in held for p in parameters]
    if not free.any():
        return Promise(0.5 * float(residual @ residual), far)
    bounds = (low - start)[free] * size[free], (high - start)[free] * size[free]
    bounded = scipy.optimize.lsq_linear(slope[:, free] / size[free], -residual, bounds, method="bvls")
    return Promise(float(bounded.cost), far)


def gauss_newton_step(
    evidence: Sequence[Evidence], parameters: Sequence[Parameter]
) -> tuple[float, tuple[Parameter, ...]]:
    """Return the least cost of the linearised problem inside the bounds, and the parameters that reach it."""
    low, high, start = box(parameters)
    residual, slope = StackedRows(evidence, parameters)(start)
    size = np.maximum(np.linalg.norm(slope, axis=0), 1e-300)
    bounds = np.minimum((low - start) * size, -1e-12), np.maximum((high - start) * size, 1e-12)
    bounded = scipy.optimize.lsq_linear(slope / size, -residual, bounds, method="bvls")
    end = np.clip(start + bounded.x / size, low, high)
    moved = (replace(p, start=p.outward(value)) for p, value in zip(parameters, end, strict=True))
    return float(bounded.cost), tuple(moved)


class StackedRows:
    """Residuals of priors and evidence over the fitted scale, with the last evaluation remembered."""

    def __init__(
        self,
        evidence: Sequence[Evidence],
        parameters: Sequence[Parameter],
        known: Mapping[tuple[str, str], float] | None = None,
    ) -> None:
        self._evidence, self.parameters, self._known = evidence, tuple(parameters), known
        self._names = [p.name for p in parameters]
        self._prior = np.diag([1.0 / p.sigma for p in parameters])
        self._centre = np.array([p.inward(p.centre) if math.isfinite(p.sigma) else 0.0 for p in parameters])
        self._last: tuple[bytes, tuple[Array, Array]] | None = None

    def values(self, x: Array) -> dict[str, float]:
        """Return the numbers in SI by name."""
        # At a bound the last digit of a product may lie beyond it, and a part refuses such a value.
        return {
            p.name: min(max(p.outward(v), p.lower), p.upper) for p, v in zip(self.parameters, x, strict=True)
        }

    @property
    def prior_information(self) -> Array:
        """Information of the priors on the fitted scale, shape (parameters, parameters)."""
        return np.asarray(self._prior.T @ self._prior, dtype=np.float64)

    def prior_gradient(self, x: Array) -> Array:
        """Return the gradient of half the sum of squares of the priors."""
        return np.asarray(self.prior_information @ (x - self._centre), dtype=np.float64)

    def prior_rows(self, x: Array) -> tuple[Array, Array]:
        """Return residuals of the priors, shape (parameters,), and slopes, shape (parameters, parameters)."""
        return self._prior @ (x - self._centre), self._prior

    def __call__(self, x: Array) -> tuple[Array, Array]:
        """Return residuals and slopes of priors and evidence, one below the other."""
        if self._last is None or self._last[0] != x.tobytes():
            rows, slopes = ([each] for each in self.prior_rows(x))
            for each in self._evidence:
                residual, wide = self.of(each, x)
                if each.driven.stiff and self._known is not None:
                    residual, wide = huber_rows(residual, wide, _HUBER)
                    bound = self._known.get((each.driven.block.name, each.record.name), math.inf)
                    residual, wide = bounded_total(residual, wide, max(bound, float(len(residual))))
                rows.append(residual)
                slopes.append(wide)
            self._last = x.tobytes(), (np.concatenate(rows), np.vstack(slopes))
        return self._last[1]

    def of(self, each: Evidence, x: Array) -> tuple[Array, Array]:
        """Return residuals of one piece of evidence, shape (rows,), and slopes, shape (rows, parameters)."""
        values = self.values(x)
        residual, slope = each.residual(values)
        wide = np.zeros((len(residual), len(x)))
        for k, name in enumerate(each.driven.free):
            j = self._names.index(name)
            wide[:, j] = slope[:, k] * self.parameters[j].slope(values[name])
        if each.driven.stiff:
            wide[np.abs(wide).max(axis=1) > _OUTLYING_SLOPE] = 0.0
        return residual, wide


def covariance_of(residual: Array, slope: Array, priors: int) -> Array:
    """Return (JᵀJ)⁻¹ with the data's share of information reduced by the colour of the residuals."""
    data = slope[priors:]
    if len(residual) > 1:
        rho = autocorrelation(residual, min(200, len(residual) - 1))[1:]
        quiet = np.flatnonzero(rho < 2.0 / math.sqrt(len(residual)))
        colour = 1.0 + 2.0 * float(np.sum(rho[: quiet[0]] if len(quiet) else rho))
        size = max(1.0, float(np.mean(residual**2)))
    else:
        colour, size = 1.0, 1.0
    information = data.T @ data / (colour * size) + slope[:priors].T @ slope[:priors]
    # What the records leave open altogether gets a large variance, not an infinite one.
    strength, axes = np.linalg.eigh(information)
    result: Array = np.asarray((axes / np.maximum(strength, _LEAST_INFORMATION)) @ axes.T, dtype=np.float64)
    return result
