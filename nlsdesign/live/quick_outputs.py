"""What is read from the solution of a quick program: curves, values of the limits, chosen numbers in SI."""

from __future__ import annotations

from collections.abc import Mapping
from functools import cached_property

import casadi as ca
import numpy as np

from ..foundation.arrays import Array
from .question import LiveQuestion
from .quick_rows import QuickRows


class QuickOutputs:
    """What follows from the unknowns of one program."""

    def __init__(self, rows: QuickRows) -> None:
        self._rows = rows

    def columns(self, unknowns: Array, question: LiveQuestion) -> dict[str, Array]:
        """Return curves, sums and values of the limits by name."""
        names, function = self._columns
        columns = function(unknowns, self._rows.numbers_of(question))
        return {name: np.array(c, dtype=float).ravel() for name, c in zip(names, columns, strict=True)}

    def chosen_values(self, unknowns: Array) -> dict[str, float]:
        """Return sizes and variables of the contour in SI by name."""
        values = np.array(self._in_si(unknowns)).ravel()
        return {v.name: float(value) for v, value in zip(self._rows.chosen, values, strict=True)}

    def scaled_values(self, values: Mapping[str, float]) -> dict[str, float]:
        """Return values in SI as this program scales them, those that it knows."""
        return {v.name: self._rows.scaled(v, values[v.name]) for v in self._rows.chosen if v.name in values}

    @cached_property
    def _in_si(self) -> ca.Function:
        values = ca.vertcat(*[v.value for v in self._rows.chosen])
        return ca.Function("chosen", [self._rows.problem.vector], [values])

    @cached_property
    def _columns(self) -> tuple[tuple[str, ...], ca.Function]:
        """Names, and the function of unknowns and numbers of the target that gives their values."""
        problem, target = self._rows.problem, self._rows.target
        design, contour = problem.design, problem.contour
        wanted = [target.torque_law(design.angles[i]) for i in range(design.angles.shape[0])]
        columns = {
            "angle": design.angles, "direction": design.directions, "lever_arm": design.lever_arms,
            "radius": design.radii, "radius_of_curvature": design.radii_of_curvature,
            "torque": design.torques, "wanted": ca.vertcat(*wanted), "stiffness": design.tangent_stiffness,
            "extension": design.extensions, "force": design.forces,
            "strains": ca.vertcat(*design.strains.values()),
            "stresses": ca.vertcat(*design.stresses.values()),
            "mean_square": design.mean_square_error, "volume": design.rubber_volume,
            "sizes": ca.vertcat(*[v.value for v in problem.scalars]),
            "first_slope": ca.SX(0) if contour is None else contour.first_slope.value,
            **{f"bound {i}": bound.expression for i, bound in enumerate(self._rows.shown_bounds)},
        }  # fmt: skip
        given, values = [problem.vector, target.symbols], [ca.SX(each) for each in columns.values()]
        return tuple(columns), ca.Function("outputs", given, values)
