"""Losses: how much a residual counts."""

from __future__ import annotations

import math
from abc import abstractmethod
from dataclasses import dataclass

import numpy as np

from ....foundation.arrays import Array


@dataclass(frozen=True)
class Loss:
    """Base of what turns residuals into a cost."""

    @abstractmethod
    def value(self, residual: Array) -> float:
        """Return the cost of all residuals together.

        Parameters
        ----------
        residual
            In standard deviations, shape (n,).
        """

    @abstractmethod
    def weight(self, residual: Array) -> Array:
        """Return the factor of each residual and its slope that makes least squares follow the loss.

        Parameters
        ----------
        residual
            In standard deviations, shape (n,).
        """


@dataclass(frozen=True)
class Squares(Loss):
    """Half the sum of squares: right where errors are noise."""

    def value(self, residual: Array) -> float:
        """Return ½·Σr²."""
        return 0.5 * float(residual @ residual)

    def weight(self, residual: Array) -> Array:
        """Return ones."""
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
