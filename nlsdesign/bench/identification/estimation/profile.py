"""Profile likelihood: how the cost grows when one number is held and all others are fitted again."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np

from ....foundation.arrays import Array
from ....foundation.errors import ValueRangeError
from .least_squares import Fit

_95 = 1.9207
"""Half of the 95 % quantile of χ² with one degree of freedom."""


@dataclass(frozen=True, eq=False)
class Profile:
    """The profile of one number.

    Parameters
    ----------
    name
        Of the number.
    value, rise
        Held values in SI, ascending, and how much the cost lies above its minimum; shape (n,).
    lower, upper
        Ends of the 95 % interval, where the rise passes 1.92; infinite where it never does: there the records
        leave the number open.
    """

    name: str
    value: Array
    rise: Array
    lower: float
    upper: float

    def words(self) -> str:
        """Return what the records say of the number, in a sentence."""
        sides = [s for s, end in (("below", self.lower), ("above", self.upper)) if not np.isfinite(end)]
        if not sides:
            return f"{self.name}: between {self.lower:.4g} and {self.upper:.4g} (95 %)"
        known = "" if len(sides) == 2 else f", {'at least' if np.isfinite(self.lower) else 'at most'} "
        known += "" if len(sides) == 2 else f"{self.lower if np.isfinite(self.lower) else self.upper:.4g}"
        return f"{self.name}: not bounded {' or '.join(sides)} by the records{known}"


def profile_of(
    fit: Fit, name: str, refit: Callable[[str, float], Fit], *, points: int = 9, reach: float = 3.0
) -> Profile:
    """Hold a number at several values and fit the others again."""
    names = [p.name for p in fit.parameters]
    if name not in names or points < 5:
        raise ValueRangeError(f"profile of '{name}' with {points} points", "needs a fitted number and five")
    parameter = fit.parameters[names.index(name)]
    centre = parameter.inward(fit.values[name])
    width = fit.standard_error(name) / abs(parameter.slope(fit.values[name]))
    values = [parameter.outward(centre + reach * width * k) for k in np.linspace(-1.0, 1.0, points)]
    inside = [v for v in values if parameter.lower <= v <= parameter.upper]
    rise = np.array([refit(name, v).cost - fit.cost for v in inside])
    value = np.array(inside)
    return Profile(name, value, rise, _end(value, rise, -1), _end(value, rise, 1))


def _end(value: Array, rise: Array, side: int) -> float:
    """Return where the rise passes its limit on one side; its root runs nearly straight."""
    best = int(np.argmin(rise))
    rows = range(best, len(value) if side > 0 else -1, side)
    root = np.sqrt(np.maximum(rise, 0.0))
    limit = float(np.sqrt(_95))
    for one, other in zip(rows, list(rows)[1:], strict=False):
        if root[other] >= limit:
            share = (limit - root[one]) / (root[other] - root[one])
            return float(value[one] + share * (value[other] - value[one]))
    return side * float("inf")
