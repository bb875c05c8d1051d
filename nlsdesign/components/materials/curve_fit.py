"""A law fitted to a measured curve of stress over strain; the form that follows the curve best is taken."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from itertools import chain, combinations

import numpy as np

from ...foundation.arrays import Array
from ...foundation.errors import ValueRangeError
from ...foundation.quantity import Quantity, significant
from ...foundation.spread import EXACT, Spread
from ..core.contacts import Rounded
from ..core.springs import FittedLaw, FittedRange, StrainStiffening
from .hyperelastic import Ogden, Yeoh

_EXPONENTS = (
    *(-8.0, -6.0, -5.0, -4.0, -3.0, -2.5, -2.0),
    *(1.0, 1.3, 1.6, 2.0, 2.5, 3.0, 4.0, 5.0, 6.0, 8.0, 10.0, 13.0, 16.0),
)
"""Exponents that Ogden's law is put together from: each alone gives a stress that never falls."""
_MOST = 3
"""Most pairs of Ogden's law, and most moduli of a piecewise law."""
_DIGITS = 6
"""Significant digits of fitted constants."""
_ROUNDING = 0.3
"""Width of the rounded knots over the least distance of measured strains."""
_DENSE = 400
"""Points between zero and the last strain at which a cubic has to rise."""


@dataclass(frozen=True)
class CurveFit:
    """A law and how far it is from the curve that it was fitted to."""

    law: FittedLaw  # with the range of the curve
    # rms_error, worst_error: of the stress, relative to the measured one, over the points
    rms_error: float
    worst_error: float


def fit_curve(strains: Sequence[float], stresses: Sequence[float], *, like: Quantity) -> CurveFit:
    """Return the law that follows a measured curve best: least squares of the relative error of the stress.

    Tried are Yeoh's cubic, Ogden's law and moduli that engage at rounded knots, with at most one constant for
    each point and three pairs or moduli. Each is linear in its constants once its exponents or knots are
    chosen, so the least of all choices is found, without a start. A law whose stress falls within the range
    is not taken. The law is stated to hold up to the last strain. Sources: Yeoh 1993; Ogden 1972; Austin et
    al. 2015, eq. (1); Lawson and Hanson 1974 (least squares with constants that are not negative).
    """
    strain, stress = np.asarray(strains, dtype=float), np.asarray(stresses, dtype=float)
    if len(strain) < 2 or len(strain) != len(stress) or np.any(np.diff(strain, prepend=0.0) <= 0.0):
        raise ValueRangeError(
            f"curve with {len(strain)} strains and {len(stress)} stresses",
            "a curve has two points at least, one stress for each strain, and strains that ascend from zero",
        )
    if np.any(stress <= 0.0):
        raise ValueRangeError("curve with stresses of zero or less", "rubber in tension has positive stress")
    forms = (_yeoh(strain, stress, like), _ogden(strain, stress, like), _engaging(strain, stress, like))
    fits = []
    for law, values in chain(*forms):
        errors = values / stress - 1.0
        fits.append(CurveFit(law, float(np.sqrt(np.mean(errors**2))), float(np.max(np.abs(errors)))))
    # To a tenth of a per mille, so that what is alike stays in the order above on every processor.
    return min(fits, key=lambda fit: round(fit.rms_error, 4))


def _yeoh(strain: Array, stress: Array, like: Quantity) -> Iterator[tuple[FittedLaw, Array]]:
    if len(strain) < _MOST:
        return
    columns = _yeoh_columns(strain)
    solution, *_ = np.linalg.lstsq(columns / stress[:, None], np.ones(len(stress)), rcond=None)
    constants = _short(np.asarray(solution, dtype=float))
    rising = np.diff(_yeoh_columns(np.linspace(0.0, strain[-1], _DENSE)) @ constants)
    if constants[0] > 0.0 and np.all(rising > 0.0):
        c1, c2, c3 = (_constant((float(c),), "Pa", like, row=False) for c in constants)
        yield Yeoh(c1=c1, c2=c2, c3=c3, data=_range(strain, like)), columns @ constants


def _yeoh_columns(strain: Array) -> Array:
    stretch = 1.0 + strain
    first, slope = stretch**2 + 2.0 / stretch - 3.0, 2.0 * stretch - 2.0 / stretch**2
    return np.stack([slope, 2.0 * first * slope, 3.0 * first**2 * slope], axis=1)


def _ogden(strain: Array, stress: Array, like: Quantity) -> Iterator[tuple[FittedLaw, Array]]:
    stretch, exponents = 1.0 + strain[:, None], np.array(_EXPONENTS)
    columns = np.sign(exponents) * (stretch ** (exponents - 1.0) - stretch ** (-exponents / 2.0 - 1.0))
    chosen, sizes = _fewest(columns, stress, first=())
    moduli = sizes * np.sign(exponents[chosen])
    law = Ogden(
        moduli=_constant(tuple(map(float, moduli)), "Pa", like),
        exponents=_constant(tuple(map(float, exponents[chosen])), "1", like, spread=EXACT),
        data=_range(strain, like),
    )
    yield law, columns[:, chosen] @ sizes


def _engaging(strain: Array, stress: Array, like: Quantity) -> Iterator[tuple[FittedLaw, Array]]:
    width = significant([_ROUNDING * float(np.min(np.diff(strain)))], 2)[0]
    knots = np.array([0.0, *strain[:-1]])
    rounded = _positive(strain[:, None] - knots, width) - _positive(-knots, width)
    columns = np.where(knots == 0.0, strain[:, None], rounded)
    chosen, sizes = _fewest(columns, stress, first=(0,))
    law = StrainStiffening(
        modulus=_constant(tuple(map(float, sizes)), "Pa", like),
        knots=_constant(tuple(map(float, knots[chosen])), "1", like, spread=EXACT),
        contact=Rounded(Quantity(width, "1", "assumed: a share of the distance of the measured strains")),
        data=_range(strain, like),
    )
    yield law, columns[:, chosen] @ sizes


def _positive(value: Array, width: float) -> Array:
    return width * np.logaddexp(0.0, value / width)


def _fewest(columns: Array, stress: Array, *, first: tuple[int, ...]) -> tuple[list[int], Array]:
    """Return the columns that follow a curve best with sizes that are not negative, and the sizes.

    ``columns``: shape (n, m).
    """
    from scipy.optimize import nnls  # a list of parts needs no SciPy

    count = max(1, min(_MOST, len(stress) // 2))
    relative, ones = columns / stress[:, None], np.ones(len(stress))
    rest = [i for i in range(columns.shape[1]) if i not in first]
    choices = [[*first, *more] for more in combinations(rest, max(0, count - len(first)))]
    chosen = min(choices, key=lambda choice: round(float(nnls(relative[:, choice], ones)[1]), 9))
    sizes, _ = nnls(relative[:, chosen], ones)
    kept = [(i, size) for i, size in zip(chosen, _short(sizes), strict=True) if size > 0.0]
    return [i for i, _ in kept], np.array([size for _, size in kept])


def _short(constants: Array) -> Array:
    """Return constants rounded each by itself: a small one can act at a large power."""
    return np.array([significant([constant], _DIGITS)[0] for constant in constants])


def _constant(
    values: tuple[float, ...], unit: str, like: Quantity, *, row: bool = True, spread: Spread | None = None
) -> Quantity:
    return Quantity(
        values if row else values[0], unit, like.source, like.spread if spread is None else spread
    )


def _range(strain: Array, like: Quantity) -> FittedRange:
    return FittedRange(Quantity(float(strain[-1]), "1", like.source))
