"""Numbers to be fitted: starts, bounds, priors and scales."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass
from typing import Literal

import numpy as np

from ...foundation.arrays import Array
from ...foundation.spread import EXACT, RelativeSpread, Spread, UniformSpread
from ...model import Variable

_REACH = 3.0
"""Standard deviations of the prior at which a fit stops: one sound number in 400 lies beyond."""

_AT_END = 0.01
"""Share of the range of a number within which it stands at the end."""


@dataclass(frozen=True)
class Parameter:
    """A number to be fitted.

    Parameters
    ----------
    name, unit
        Full name and SI unit.
    start
        Where the fit begins.
    centre, sigma
        Declared value and standard deviation of the prior around it, in the fitted scale; an infinite sigma
        means that nothing is known before.
    lower, upper
        Bounds in SI.
    scale
        ``log`` for positive numbers, whose spread is a factor; ``linear`` otherwise.
    size
        Typical size, for the linear scale.
    spread
        As declared; exact where nothing is known before.
    confounded
        Standard deviation, in SI, of what no record tells from it and is not fitted beside it, as a shift of
        channels within a sample is beside a delay.
    """

    name: str
    unit: str
    start: float
    centre: float
    sigma: float
    lower: float
    upper: float
    scale: Literal["log", "linear"]
    size: float = 1.0
    spread: Spread = EXACT
    confounded: float = 0.0

    @property
    def known(self) -> bool:
        """Whether something is known of the number before it is fitted."""
        return bool(self.spread)

    def at_end(self, value: float) -> bool:
        """Tell whether a fitted value stands at one of its bounds."""
        width = self.inward(self.upper) - self.inward(self.lower)
        here = self.inward(value)
        return min(here - self.inward(self.lower), self.inward(self.upper) - here) <= _AT_END * width

    def inward(self, value: float) -> float:
        """Return a value in the fitted scale."""
        return math.log(value) if self.scale == "log" else value / self.size

    def outward(self, fitted: float) -> float:
        """Return the value in SI."""
        return math.exp(fitted) if self.scale == "log" else fitted * self.size

    def slope(self, value: float) -> float:
        """Return the derivative of the value in SI with respect to the fitted one."""
        return value if self.scale == "log" else self.size


def declared_parameter(variable: Variable, start: float | None = None) -> Parameter:
    """Return a parameter of the model with the prior that its declared spread stands for.

    A positive number with a relative spread s is fitted as its logarithm, with the standard deviation
    ln(1 + s); a negative one in a straight line, with the same standard deviation to first order; one whose
    spread has a unit in a straight line too; one of a range within that range, each value as likely. Other
    fits stop at three standard deviations.

    ``variable``: parameter of a flat model that is not known exactly. ``start``: where to begin; at the
    declared value by default.
    """
    value, spread = variable.start, variable.spread
    logarithmic = value > 0.0 and isinstance(spread, RelativeSpread)
    error = spread.standard_error(value)
    if isinstance(spread, UniformSpread):
        sigma, ends = math.inf, (value - spread.half_width, value + spread.half_width)
    elif logarithmic:
        sigma = spread.deviation
        ends = (value * math.exp(-_REACH * sigma), value * math.exp(_REACH * sigma))
    else:
        sigma, ends = 1.0, (value - _REACH * error, value + _REACH * error)
    return Parameter(
        variable.name,
        variable.unit,
        value if start is None else start,
        value,
        sigma,
        max(ends[0], variable.minimum),
        min(ends[1], variable.maximum),
        "log" if logarithmic else "linear",
        error,
        spread,
    )


def free_parameter(variable: Variable, *, reach: float = 10.0) -> Parameter:
    """Return a parameter of which nothing is known but a start.

    Parameters
    ----------
    variable
        Parameter of a flat model. A number that its law wants positive is fitted on a logarithmic scale, one
        that may have either sign in a straight line.
    reach
        Factor from the start to the bounds; on the linear scale, so many times its size to either side.
    """
    value = variable.start
    size = abs(value) or 1.0
    positive = value > 0.0 and variable.minimum >= 0.0
    if positive:
        low, high = value / reach, value * reach
    else:
        low, high = value - reach * size, value + reach * size
    return Parameter(
        variable.name,
        variable.unit,
        value,
        value,
        math.inf,
        max(low, variable.minimum),
        min(high, variable.maximum),
        "log" if positive else "linear",
        size,
    )


def box(parameters: Sequence[Parameter]) -> tuple[Array, Array, Array]:
    """Return lower bounds, upper bounds and a start inside them, in the fitted scale."""
    low = np.array(
        [p.inward(p.lower) if p.scale == "linear" or p.lower > 0.0 else -np.inf for p in parameters]
    )
    high = np.array([p.inward(p.upper) for p in parameters])
    start = np.array([p.inward(p.start) for p in parameters])
    inside: Array = np.clip(start, low + 1e-9, high - 1e-9)
    return low, high, inside
