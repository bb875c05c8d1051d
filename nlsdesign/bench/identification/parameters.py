"""Numbers to be fitted: starts, bounds, priors and scales."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass
from typing import Literal

import numpy as np

from ...foundation.arrays import Array
from ...model import Variable

_REACH = 2.0


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

    A one-sided spread s is read as the uniform range from v/(1 + s) to v·(1 + s), whose standard deviation is
    ln(1 + s)/√3 on the logarithmic scale. The bounds are twice as wide as the range.

    Parameters
    ----------
    variable
        Parameter of a flat model with a positive spread.
    start
        Where to begin; at the declared value by default.
    """
    value, width = variable.start, math.log1p(variable.spread)
    begin = value if start is None else start
    if value > 0.0:
        factor = math.exp(_REACH * width)
        return Parameter(
            variable.name,
            variable.unit,
            begin,
            value,
            width / math.sqrt(3.0),
            max(value / factor, variable.minimum),
            min(value * factor, variable.maximum),
            "log",
        )
    size = abs(value) or 1.0
    reach = _REACH * variable.spread * size
    return Parameter(
        variable.name,
        variable.unit,
        begin,
        value,
        variable.spread / math.sqrt(3.0),
        max(value - reach, variable.minimum),
        min(value + reach, variable.maximum),
        "linear",
        size,
    )


def free_parameter(variable: Variable, *, reach: float = 10.0) -> Parameter:
    """Return a parameter of which nothing is known but a start.

    Parameters
    ----------
    variable
        Parameter of a flat model. A number above zero is fitted on a logarithmic scale.
    reach
        Factor from the start to the bounds; on the linear scale, so many times its size to either side.
    """
    value = variable.start
    size = abs(value) or 1.0
    if value > 0.0:
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
        "log" if value > 0.0 else "linear",
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
