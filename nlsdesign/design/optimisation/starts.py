"""Starting points: four that are always taken, and more drawn from a seed."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from typing import NamedTuple

import casadi as ca
import numpy as np

from .program import DesignVariable, scaled
from .shape import ContourVariables

_ALWAYS = ((0.5, 0.3), (0.8, 0.1), (0.3, 0.6), (0.6, 0.9))
"""Share of the size that is first slope, and share of the stretch that is pretension."""
_SIZES = 0.7
"""Standard deviation of the logarithm of a drawn size."""


class Start(NamedTuple):
    """Where a search begins.

    Parameters
    ----------
    slope_share
        First slope of the contour relative to its size.
    tight
        Pretension relative to the stretch of the closed form.
    factors
        Of the other sizes by name, relative to what they are now.
    contour_size
        Relative to the size of the closed form.
    """

    slope_share: float
    tight: float
    factors: dict[str, float]
    contour_size: float = 1.0


def starts(count: int, seed: int, sizes: Sequence[str]) -> Iterator[Start]:
    """Yield starts; the first four do not depend on the seed."""
    draw = np.random.default_rng(seed)
    for number in range(count):
        if number < len(_ALWAYS):
            yield Start(*_ALWAYS[number], {})
            continue
        slope, tight = draw.uniform(0.2, 0.9), draw.uniform(0.05, 1.2)
        factors = {name: float(np.exp(_SIZES * draw.normal())) for name in sizes}
        yield Start(float(slope), float(tight), factors, float(np.exp(0.4 * draw.normal())))


class StartSizes(NamedTuple):
    """What starts are relative to: largest lever arm and stretch in m, name of the pretension."""

    arm: float
    stretch: float
    pretension: str
    largest_arm: float


def start_values(
    start: Start,
    *,
    scalars: Sequence[DesignVariable],
    contour: ContourVariables | None,
    sizes: StartSizes,
) -> dict[str, float]:
    """Return the scaled values of the variables at a start by name."""
    values = {}
    for variable in scalars:
        values[variable.name] = variable.start
        if variable.name == sizes.pretension:
            values[variable.name] = scaled(variable, start.tight * sizes.stretch)
        elif variable.name in start.factors:
            now = float(ca.evalf(ca.substitute(variable.value, variable.symbol, variable.start)))
            values[variable.name] = scaled(variable, start.factors[variable.name] * now)
    if contour is None:
        return values
    values |= {v.name: v.start for v in contour.all()}
    # No start may reach to the anchor.
    size = min(start.contour_size, sizes.largest_arm / sizes.arm)
    slope = size * start.slope_share
    values |= {radius.name: size - 0.5 * slope for radius in contour.radii_of_curvature}
    values[contour.first_slope.name] = slope
    return values
