"""The numbers that a solver chooses, each in SI as a function of a symbol of about size 1."""

from __future__ import annotations

import math
from typing import NamedTuple

import casadi as ca

from ...model import Variable
from ...symbolic import Expression


class DesignVariable(NamedTuple):
    """A number that the solver chooses; ``value`` is it in SI, a function of its symbol of about size 1."""

    name: str
    symbol: Expression
    value: Expression
    lower: float
    upper: float
    start: float


def scalar(variable: Variable, small: float) -> DesignVariable:
    """Return a single number: a length that may be zero in units of its size, all others as a logarithm.

    Parameters
    ----------
    variable
        Parameter of the flat model, with its range.
    small
        Size in SI of a number that is zero now.
    """
    symbol = ca.SX.sym(variable.name)
    now, low, high = variable.start, variable.minimum, variable.maximum
    if low > 0.0 and now > 0.0:
        ends = (math.log(low / now), math.log(high / now) if math.isfinite(high) else ca.inf)
        return DesignVariable(variable.name, symbol, now * ca.exp(symbol), *ends, 0.0)
    size = now or small
    return DesignVariable(variable.name, symbol, size * symbol, low / size, high / size, now / size)


def scaled(variable: DesignVariable, value: float) -> float:
    """Return the symbol's value at which a variable has a value in SI, within its range.

    Parameters
    ----------
    variable
        As made by :func:`scalar`.
    value
        In SI.
    """
    at_zero = float(ca.evalf(ca.substitute(variable.value, variable.symbol, 0.0)))
    if at_zero > 0.0:
        position = math.log(max(value, 1e-300) / at_zero)
    else:
        position = value / float(ca.evalf(ca.substitute(variable.value, variable.symbol, 1.0)))
    return min(max(position, variable.lower), variable.upper)
