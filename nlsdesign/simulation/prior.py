"""What is known of the numbers of a model: declared values, and how far each may lie from them.

Every number is ``spread.number(value, x)`` (:mod:`nlsdesign.foundation.spread`), and the x are jointly normal
with zero mean. A number with a relative spread is its declared value times exp(x): no draw changes its sign
or makes a stiffness vanish, products and quotients of numbers are as simple as the numbers themselves (the
logarithm of a torque constant over an inertia is a difference), and the covariance of the x is that of
relative errors where these are small. The x of a number whose spread has a unit counts standard deviations.
"""

from __future__ import annotations

from collections import Counter
from collections.abc import Sequence
from dataclasses import dataclass, field, replace

import numpy as np

from ..foundation.arrays import Array
from ..foundation.errors import ValueRangeError, unknown_name
from ..foundation.spread import RelativeSpread, Spread
from ..model import FlatModel

LONGEST_ROW = 12
"""Numbers of a row beyond which it is the table of a shape, whose numbers share one factor: the contour of a
cam is a little too large or too small, its points do not scatter on their own."""
_LEAST_STRENGTH = 1e-12
"""Smallest eigenvalue of a correlation matrix that is more than rounding."""


def _unbounded() -> Array:
    return np.zeros(0)


@dataclass(frozen=True, eq=False)
class Prior:
    """What is known of some numbers of a model.

    Parameters
    ----------
    names
        Full names of the numbers.
    values
        In SI, shape (numbers,). The median of each number.
    covariance
        Of the coordinates x of the numbers, shape (numbers, numbers). It may be singular: numbers that share
        one factor move together.
    minimum, maximum
        Ranges in which the laws are stated to hold, in SI, shape (numbers,); empty for none.
    kinds
        What x is of each number; relative spreads where it is left out.

    Raises
    ------
    ValueRangeError
        If the shapes do not fit, a value is not finite, a relative spread is that of zero, or the covariance
        is none.
    """

    names: tuple[str, ...]
    values: Array
    covariance: Array
    minimum: Array = field(default_factory=_unbounded)
    maximum: Array = field(default_factory=_unbounded)
    kinds: tuple[Spread, ...] = ()

    def __post_init__(self) -> None:
        count = len(self.names)
        if not self.kinds:
            kinds = tuple(map(RelativeSpread, np.expm1(self.deviations).tolist()))
            object.__setattr__(self, "kinds", kinds)
        if self.values.shape != (count,) or self.covariance.shape != (count, count):
            raise ValueRangeError(
                f"{count} names with {self.values.shape} values and {self.covariance.shape} covariances",
                "there must be one value and one row and column of the covariance for each name",
            )
        for name, value, kind in zip(self.names, self.values, self.kinds, strict=True):
            if not np.isfinite(value) or (value == 0.0 and isinstance(kind, RelativeSpread)):
                raise ValueRangeError(
                    f"{name} = {value:g}", "has no relative spread", next_step="give its spread a unit"
                )
        size = float(np.max(np.diag(self.covariance), initial=0.0))
        even = np.allclose(self.covariance, self.covariance.T, rtol=0.0, atol=1e-9 * size)
        if not even or np.min(np.linalg.eigvalsh(self.covariance), initial=0.0) < -1e-9 * size:
            raise ValueRangeError(
                "covariance of a prior", "is not symmetric with eigenvalues of at least zero"
            )

    @property
    def deviations(self) -> Array:
        """Standard deviation of the coordinate of each number, shape (numbers,)."""
        return np.sqrt(np.maximum(np.diag(self.covariance), 0.0))

    def spread_of(self, name: str) -> Spread:
        """Return the spread of a number as a deck states it.

        Parameters
        ----------
        name
            Full name.
        """
        k = self.place(name)
        kind = self.kinds[k]
        return kind.narrowed(float(self.deviations[k]) / kind.deviation) if kind else kind

    def spreads(self) -> dict[str, float]:
        """Return the spread of each number by name, relative to the number."""
        return {n: self.spread_of(n).share(v) for n, v in zip(self.names, self.values.tolist(), strict=True)}

    def numbers(self, x: Array) -> Array:
        """Return the numbers at coordinates, not held inside any range.

        Parameters
        ----------
        x
            Shape (..., numbers).

        Returns
        -------
        numpy.ndarray
            In SI, of the shape of ``x``.
        """
        columns = [
            kind.number(v, x[..., k]) for k, (kind, v) in enumerate(zip(self.kinds, self.values, strict=True))
        ]
        return np.stack(columns, axis=-1) if columns else np.array(x, dtype=float)

    def correlation(self, first: str, second: str) -> float:
        """Return the correlation of the coordinates of two numbers; zero if one of them is known exactly.

        Parameters
        ----------
        first, second
            Full names.
        """
        i, j = self.place(first), self.place(second)
        size = float(self.deviations[i] * self.deviations[j])
        return float(self.covariance[i, j]) / size if size > 0.0 else 0.0

    @property
    def root(self) -> Array:
        """R with R·Rᵀ = covariance, shape (numbers, numbers): the x are R times independent unit normals."""
        # For the correlation it is the symmetric one, which follows the covariance without jumps: the same
        # random numbers draw comparable values before and after something was learned.
        size = np.sqrt(np.maximum(np.diag(self.covariance), 0.0))
        scale = np.where(size > 0.0, size, 1.0)
        strength, axes = np.linalg.eigh(self.covariance / np.outer(scale, scale))
        strength = np.where(strength > _LEAST_STRENGTH, strength, 0.0)
        result: Array = size[:, None] * ((axes * np.sqrt(strength)) @ axes.T)
        return result

    def place(self, name: str) -> int:
        """Return the place of a number in the vectors.

        Parameters
        ----------
        name
            Full name.

        Raises
        ------
        UnknownNameError
            If nothing is stated of a number of that name.
        """
        if name not in self.names:
            raise unknown_name("number with a spread", name, self.names)
        return self.names.index(name)

    def only(self, names: Sequence[str]) -> Prior:
        """Return what is known of some of the numbers, in the order given.

        Parameters
        ----------
        names
            Full names.
        """
        places = [self.place(name) for name in names]
        low, high = (end[places] if len(end) else end for end in (self.minimum, self.maximum))
        covariance = self.covariance[np.ix_(places, places)]
        kinds = tuple(self.kinds[k] for k in places)
        return Prior(tuple(names), self.values[places], covariance, low, high, kinds)

    def draws(self, count: int, seed: int) -> dict[str, Array]:
        """Return numbers drawn at random, held inside the ranges of their laws.

        Parameters
        ----------
        count
            How many of each.
        seed
            The same seed gives the same numbers.

        Returns
        -------
        dict
            Values in SI by name, each of shape (count,).
        """
        normal = np.random.default_rng(seed).standard_normal((count, len(self.names)))
        drawn = self.numbers(normal @ self.root.T)
        if len(self.minimum):
            drawn = np.maximum(drawn, self.minimum)
        if len(self.maximum):
            drawn = np.minimum(drawn, self.maximum)
        return {name: drawn[:, k].copy() for k, name in enumerate(self.names)}

    def after(self, information: Array) -> Prior:
        """Return what is known once measurements have added information; the values stay.

        Parameters
        ----------
        information
            Fisher information on the coordinates of the numbers, shape (numbers, numbers): the slopes of
            whitened measurements, J, give JᵀJ.
        """
        root = self.root
        gained = np.eye(root.shape[1]) + root.T @ information @ root
        covariance = root @ np.linalg.solve(gained, root.T)
        return replace(self, covariance=0.5 * (covariance + covariance.T))

    def deviation_of(self, slopes: Array) -> Array:
        """Return the standard deviation of quantities that depend on the numbers, to first order.

        Parameters
        ----------
        slopes
            Derivatives of the quantities with respect to the coordinates of the numbers, shape
            (quantities, numbers).

        Returns
        -------
        numpy.ndarray
            Shape (quantities,), in the units of the quantities.
        """
        result: Array = np.sqrt(np.maximum(np.einsum("qi,ij,qj->q", slopes, self.covariance, slopes), 0.0))
        return result


def declared_prior(model: FlatModel, longest_row: int = LONGEST_ROW) -> Prior:
    """Return what a deck states of its numbers: a spread of 0.15 is a factor of 1.15 per standard deviation.

    The numbers are independent, but for those of a row that is longer than ``longest_row``, which deviate
    together. Numbers without a spread are taken as exact and are left out, as are zeros, which a relative
    spread leaves as they are.

    Parameters
    ----------
    model
        Flat model of the machine.
    longest_row
        Most numbers of a row that deviate each on its own.

    Examples
    --------
    >>> from nlsdesign import quantity
    >>> from nlsdesign.components import Inertia, assembly
    >>> from nlsdesign.model import flatten
    >>> wheel = Inertia(inertia=quantity(1e-3, "kg*m^2", source="assumed", spread=0.1))
    >>> known = declared_prior(flatten(assembly("wheel", wheel=wheel)))
    >>> known.names, known.deviations.round(4).tolist()
    (('wheel.inertia',), [0.0953])
    """
    rows = Counter(_row(v.name) for v in model.parameters)
    free = [v for v in model.parameters if v.uncertain]
    deviations = np.array([v.spread.deviation for v in free], dtype=float)
    shapes = [_row(v.name) if rows[_row(v.name)] > longest_row else v.name for v in free]
    together = np.array([[a == b for b in shapes] for a in shapes], dtype=float).reshape(len(free), len(free))
    return Prior(
        tuple(v.name for v in free),
        np.array([v.start for v in free], dtype=float),
        together * np.outer(deviations, deviations),
        np.array([v.minimum for v in free], dtype=float),
        np.array([v.maximum for v in free], dtype=float),
        tuple(v.spread for v in free),
    )


def _row(name: str) -> str:
    return name.partition("[")[0]
