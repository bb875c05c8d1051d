"""Declared numbers after a refit: how well they are known, and how far each has moved."""

from __future__ import annotations

import math
from collections.abc import Sequence
from typing import NamedTuple

from ....foundation.quantity import to_resolution
from ...identification.least_squares import Fit
from ...identification.parameters import Parameter


class FittedNumber(NamedTuple):
    """One refitted number.

    Parameters
    ----------
    name, unit
        Full name and SI unit.
    declared, fitted, standard_error
        In SI.
    strain
        How far it went, in declared ranges (spreads): 1 is the edge of what was declared, 2 where the fit
        stops.
    spread
        Declared spread, one-sided and relative: 0.15 means ± 15 %.
    """

    name: str
    unit: str
    declared: float
    fitted: float
    standard_error: float
    strain: float
    spread: float = 0.0


def fitted_numbers(fits: Sequence[Fit]) -> tuple[FittedNumber, ...]:
    """Return the refitted numbers of which something was declared, in the order of the fits."""
    return tuple(_number(fit, p) for fit in fits for p in fit.parameters if math.isfinite(p.sigma))


def _number(fit: Fit, parameter: Parameter) -> FittedNumber:
    value = fit.values[parameter.name]
    moved = parameter.inward(value) - parameter.inward(parameter.centre)
    # The prior of a range of half width w has the standard deviation w/√3.
    width = math.sqrt(3.0) * parameter.sigma
    error = fit.standard_error(parameter.name)
    return FittedNumber(
        parameter.name,
        parameter.unit,
        parameter.centre,
        to_resolution(value, error),
        error,
        moved / width,
        math.expm1(width) if parameter.scale == "log" else width,
    )
