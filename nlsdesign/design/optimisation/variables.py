"""The numbers that a solver chooses, each in SI as a function of a symbol of about size 1."""

from __future__ import annotations

import math
from typing import NamedTuple

import casadi as ca

from ...foundation.symbolic import Expression
from ...model import Variable


class DesignVariable(NamedTuple):
    """A number that the solver chooses; ``value`` is it in SI, a function of its symbol of about size 1."""

    name: str
    symbol: Expression
    value: Expression
    lower: float
    upper: float
    start: float


def scalar(variable: Variable, small: float) -> DesignVariable:
    """Return a single number: a length that may be zero in units of its size, all others as a logarithm."""
    symbol = ca.SX.sym(variable.name)
    now, low, high = variable.start, variable.minimum, variable.maximum
    if low > 0.0 and now > 0.0:
        ends = (math.log(low / now), math.log(high / now) if math.isfinite(high) else ca.inf)
        return DesignVariable(variable.name, symbol, now * ca.exp(symbol), *ends, 0.0)
    size = now or small
    return DesignVariable(variable.name, symbol, size * symbol, low / size, high / size, now / size)


class VariableScale(NamedTuple):
    """Value of a variable in SI where its symbol is zero, and where it is one."""

    at_zero: float
    at_one: float

    def position(self, value: float) -> float:
        """Return the symbol's value at which the variable has a value in SI."""
        if self.at_zero > 0.0:
            return math.log(max(value, 1e-300) / self.at_zero)
        return value / self.at_one


def scale_of(variable: DesignVariable) -> VariableScale:
    """Return the scale of a variable."""
    ends = (float(ca.evalf(ca.substitute(variable.value, variable.symbol, at))) for at in (0.0, 1.0))
    return VariableScale(*ends)


def scaled(variable: DesignVariable, value: float, scale: VariableScale | None = None) -> float:
    """Return the symbol's value at which a variable has a value in SI, within its range."""
    position = (scale or scale_of(variable)).position(value)
    return min(max(position, variable.lower), variable.upper)
