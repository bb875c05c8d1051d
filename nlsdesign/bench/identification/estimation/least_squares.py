"""Fits of parameters to several records and blocks at once, by least squares with exact derivatives."""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass

import numpy as np

from ....foundation.arrays import Array
from ....foundation.errors import ConvergenceError
from ..equation_error.evidence import Evidence
from ..statistics.losses import bounded_total, huber_rows
from ..statistics.residuals import autocorrelation
from .covariance import Piece, inverse_information, robust_covariance
from .levenberg_marquardt import Minimum, minimise
from .parameters import Parameter as Parameter
from .parameters import box
from .parameters import declared_parameter as declared_parameter

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


@dataclass(frozen=True, eq=False)
class Fit:
    """Fitted numbers and how well they are known.

    Parameters
    ----------
    parameters
        In the order of the vectors.
    values
        In SI by name.
    covariance
        In the fitted scale, ordered as the parameters; from the scatter of the residuals as they are, see
        :func:`~.covariance.robust_covariance`.
    cost
        Half the sum of squares of residuals and priors.
    misfit
        Half the sum of squares of the residuals alone, per block and record.
    converged
        Whether the fit ended by itself.
    white
        What the covariance would be if the residuals were white noise of unit size, the information inverted;
        ``None`` where that is not told.
    """

    parameters: tuple[Parameter, ...]
    values: Mapping[str, float]
    covariance: Array
    cost: float
    misfit: Mapping[tuple[str, str], float]
    converged: bool
    white: Array | None = None

    def standard_error(self, name: str) -> float:
        """Return the standard error of a parameter in SI."""
        i = [p.name for p in self.parameters].index(name)
        return float(np.sqrt(self.covariance[i, i])) * abs(self.parameters[i].slope(self.values[name]))

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
    white = inverse_information(slope.T @ slope)
    values = rows.values(ended.x)
    return Fit(tuple(parameters), values, covariance, ended.cost, misfit, ended.converged, white)


def predicted_cost(evidence: Sequence[Evidence], parameters: Sequence[Parameter]) -> float:
    """Return the cost that the linearised problem reaches from a start, at the price of one evaluation."""
    low, high, start = box(parameters)
    residual, slope = StackedRows(evidence, parameters)(start)
    size = np.linalg.norm(slope, axis=0)
    used = size > 0.0
    step = np.linalg.lstsq(slope[:, used] / size[used], -residual, rcond=1e-10)[0] / size[used]
    step = np.clip(start[used] + step, low[used], high[used]) - start[used]
    return 0.5 * float(np.sum((residual + slope[:, used] @ step) ** 2))


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
            self._last = x.tobytes(), self._evaluated(x)
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

    def _evaluated(self, x: Array) -> tuple[Array, Array]:
        rows, slopes = ([each] for each in self.prior_rows(x))
        for each in self._evidence:
            residual, wide = self.of(each, x)
            if each.driven.stiff and self._known is not None:
                residual, wide = huber_rows(residual, wide, _HUBER)
                bound = self._known.get((each.driven.block.name, each.record.name), math.inf)
                residual, wide = bounded_total(residual, wide, max(bound, float(len(residual))))
            rows.append(residual)
            slopes.append(wide)
        return np.concatenate(rows), np.vstack(slopes)


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
