"""What the fitted numbers of an effect say about its existence."""

from __future__ import annotations

import math
from collections.abc import Iterable, Sequence

import numpy as np

from ...identification.least_squares import Fit
from ...identification.parameters import Parameter, box
from ..effects.candidate import Unknown
from .measures import EffectNumber, Standing

_CLOSE = 0.005
"""Share of the range of a search within which a number stands at its bound."""


def standing_of(unknowns: Sequence[Unknown], fits: Iterable[Fit]) -> Standing:
    """Return distance from "no effect", errors and covariance of the numbers that an effect has brought."""
    known = {u.name: u for u in unknowns}
    for fit in fits:
        places = [k for k, p in enumerate(fit.parameters) if p.name in known]
        if places:
            return _standing(known, fit, places)
    return Standing()


def _standing(known: dict[str, Unknown], fit: Fit, places: Sequence[int]) -> Standing:
    low, high, _ = box(fit.parameters)
    numbers, slopes, deciding = [], [], []
    for k in places:
        parameter = fit.parameters[k]
        value, null = fit.values[parameter.name], known[parameter.name].null
        distance, slope = _distance(parameter, value, null)
        at = parameter.inward(value)
        reach = _CLOSE * (high[k] - low[k]) if math.isfinite(low[k]) else 0.0
        numbers.append(
            EffectNumber(
                parameter.name,
                distance,
                null is not None,
                math.sqrt(fit.covariance[k, k]),
                bool(at - low[k] <= reach or high[k] - at <= reach),
            )
        )
        if null is not None:
            deciding.append(k)
            slopes.append(slope)
    return Standing(tuple(numbers), fit.covariance[np.ix_(deciding, deciding)] * np.outer(slopes, slopes))


def _distance(parameter: Parameter, value: float, null: float | None) -> tuple[float, float]:
    """Return the departure from no effect, and its derivative with respect to the fitted number."""
    if null is None:
        return 0.0, 0.0
    slope = parameter.slope(value)
    if math.isinf(null):
        return 1.0 / value, -slope / value**2
    return value - null, slope
