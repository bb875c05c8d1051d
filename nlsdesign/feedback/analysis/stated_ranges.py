"""Where a machine at rest leaves the ranges in which its laws are stated to hold."""

from __future__ import annotations

import math
from typing import NamedTuple

import casadi as ca
import numpy as np
from numpy.typing import NDArray

from ...foundation.quantity import with_unit
from ...model import FlatModel
from .rest import evaluate_rows, rest_states

Array = NDArray[np.float64]
_ROUNDING = 1e-9
"""Excess over a range that is rounding, relative to the nominal size."""


class RangeAtRest(NamedTuple):
    """A signal that leaves the stated range of its law at some angles.

    Parameters
    ----------
    name, unit
        Of the signal.
    first, last
        Nearest to zero and furthest from it of the angles outside, in rad.
    furthest
        Value furthest outside.
    minimum, maximum
        The range.
    """

    name: str
    unit: str
    first: float
    last: float
    furthest: float
    minimum: float
    maximum: float

    @property
    def part(self) -> str:
        """Full name of the part that holds the law."""
        return self.name.rpartition(".")[0]

    def __str__(self) -> str:
        limits = with_unit(f"[{self.minimum:g}, {self.maximum:g}]", self.unit)
        angles = [f"{math.degrees(angle):.3g}" for angle in (self.first, self.last)]
        where = f"at {angles[0]}°" if angles[0] == angles[1] else f"from {angles[0]}° to {angles[1]}°"
        return (
            f"{self.name} leaves {limits}, where its law is stated to hold, {where} "
            f"and reaches {with_unit(f'{self.furthest:.3g}', self.unit)}"
        )


def ranges_at_rest(model: FlatModel, angles: Array, *, angle: str) -> tuple[RangeAtRest, ...]:
    """Return the laws that are used outside of their stated range while the machine rests at some angles.

    Parameters
    ----------
    model
        Continuous.
    angles
        Shape (N,), in rad.
    angle
        State that is swept.

    Raises
    ------
    ValueRangeError
        If an angle is not finite.
    ConvergenceError
        If the model does not come to rest.
    """
    bounded = [(i, v) for i, v in enumerate(model.signals) if v.bounded]
    if not bounded:
        return ()
    s = model.symbols()
    watched = ca.vertcat(*[s.signal[i] for i, _ in bounded])
    function = ca.Function("watched", [s.time, s.state, s.input, s.parameter], [ca.densify(watched)])
    states = rest_states(model, angles, angle=angle)
    (values,) = evaluate_rows(function, states, model.start(model.inputs), model.start(model.parameters))
    result = []
    for (_, v), row in zip(bounded, values.T, strict=True):
        over = np.maximum(v.minimum - row, row - v.maximum)
        outside = angles[over > _ROUNDING * v.nominal]
        if outside.size:
            near = outside[np.argsort(np.abs(outside))]
            furthest = float(row[int(np.argmax(over))])
            result.append(
                RangeAtRest(v.name, v.unit, float(near[0]), float(near[-1]), furthest, v.minimum, v.maximum)
            )
    return tuple(result)
