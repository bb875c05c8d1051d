"""Names, units and start values of an adaptive observer, and the observer as a flat model."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from ....model import FlatModel, Table, Variable
from ..scheduling.measured_angle import measured_angle
from ..scheduling.scheduled import ESTIMATE, INNOVATION, MEMORY
from .directions import UncertainDirections
from .filter_equations import FilterEquations, pairs
from .filter_start import expected_inputs, first_states

Array = NDArray[np.float64]

DEVIATION, SPREAD, UNREST = "deviation", "standard_deviation", "unrest"
"""Endings of the name of the estimate: slow states, the deviation that the filter expects, and the factor on
the noise that it reckons with."""
FIRST_READING = 2.0
"""Deviation of the angle at the start, in deviations of rounding: the filter begins at its first reading."""
FOLLOWED = "followed"
"""Ending of the name of the angle: its measured value behind a filter."""


def filter_model(filter_: FilterEquations, directions: UncertainDirections) -> FlatModel:
    """Return the observer as a discrete flat model.

    Parameters
    ----------
    filter_
        Its equations.
    directions
        What its slow states mean.
    """
    writer = _Variables(filter_, directions)
    return FlatModel(
        name=f"{filter_.plant.name}_observer",
        description=writer.description(),
        states=writer.states(),
        inputs=writer.inputs(),
        parameters=(),
        outputs=writer.outputs(),
        signals=(),
        equations=filter_.sample(),
        sample_time=filter_.step.nominal.sample_time,
        tables=writer.tables(),
        begin=first_states(filter_),
        expected=expected_inputs(filter_),
    )


class _Variables:
    """Groups of variables of one adaptive observer."""

    def __init__(self, filter_: FilterEquations, directions: UncertainDirections) -> None:
        self.filter, self.directions = filter_, directions
        self.plant, self.compact, self.trust = filter_.plant, filter_.compact, filter_.trust
        self.slow, self.angle, self.speed = filter_.slow, filter_.angle, filter_.speed
        self.units, self.step = filter_.units, filter_.step

    def description(self) -> str:
        """Return one sentence."""
        grid = self.compact.angles
        return (
            f"observer of {self.plant.estimate.name} that learns {self.slow} deviations from the deck, "
            f"{self.trust}, table of {len(grid)} angles from {grid[0]:.4g} to {grid[-1]:.4g} rad"
        )

    def _slow_names(self) -> list[str]:
        return [f"{self.plant.estimate.name}.{DEVIATION}[{d + 1}]" for d in range(self.slow)]

    def states(self) -> tuple[Variable, ...]:
        """Return what is carried on from sample to sample."""
        plant = self.plant
        states = [
            Variable(
                f"{v.name}.{MEMORY}", v.unit, f"what the estimate of {v.name} carries on", nominal=float(size)
            )
            for v, size in zip(plant.states, plant.sizes, strict=True)
        ]  # fmt: skip
        for d, name in enumerate(self._slow_names()):
            text = f"distance from the deck in standard deviations; one is {self.directions.in_words(d)}"
            states.append(Variable(f"{name}.{MEMORY}", "1", text))
        text = "factor on the variances of all noise, from innovations that were larger than expected"
        states.append(Variable(f"{plant.estimate.name}.{UNREST}", "1", text, 1.0))
        v = plant.states[self.angle]
        size = float(plant.sizes[self.angle])
        words = f"measured {v.name} behind a filter, which shows whether it moves"
        states.append(Variable(f"{v.name}.{FOLLOWED}", v.unit, words, nominal=size))
        initial = np.concatenate([self._initial_variances(), np.ones(self.slow)])
        names = [*plant.names, *self._slow_names()]
        for i, j in pairs(len(names)):
            start = float(initial[i]) if i == j else 0.0
            words = "covariance of the errors, in counts, counts per sample, typical sizes and deviations: "
            states.append(
                Variable(f"covariance[{i + 1},{j + 1}]", "1", f"{words}{names[i]} and {names[j]}", start)
            )
        return tuple(states)

    def _initial_variances(self) -> Array:
        """Return variances at the start: the angle is that of the first reading, the rest is little known.

        A variance as large as the range would lose the digits of single precision in the first correction.
        """
        sizes = self.plant.sizes / self.units
        first = (0.1 * sizes) ** 2
        first[self.angle] = FIRST_READING**2
        first[self.speed] = (0.03 * sizes[self.speed]) ** 2
        return np.asarray(first, dtype=np.float64)

    def inputs(self) -> tuple[Variable, ...]:
        """Return the measured angle and the known inputs."""
        return (measured_angle(self.plant, self.compact.angles), *self.plant.inputs)

    def outputs(self) -> tuple[Variable, ...]:
        """Return the estimate, its expected deviation, states, innovation and slow states."""
        plant, v = self.plant, self.plant.estimate
        size = float(np.max(np.abs(self.step.nominal.scales()["estimate"])))
        outputs = [
            Variable(v.name, v.unit, f"estimate of {v.name}", nominal=size),
            Variable(f"{v.name}.{SPREAD}", v.unit, "standard deviation that the filter expects of it"),
        ]
        for s in plant.states:
            name = f"{s.name}.{ESTIMATE}" if s.name == plant.angle else s.name
            outputs.append(Variable(name, s.unit, f"estimate of {s.name}"))
        angle = plant.states[self.angle]
        outputs.append(
            Variable(f"{angle.name}.{INNOVATION}", angle.unit, f"measured minus expected {angle.name}")
        )
        for d, name in enumerate(self._slow_names()):
            text = f"distance from the deck in standard deviations; one is {self.directions.in_words(d)}"
            outputs.append(Variable(name, "1", text))
        return tuple(outputs)

    def tables(self) -> tuple[Table, ...]:
        """Return the table over the angle."""
        table = self.compact.table(self.plant.angle)
        return () if table is None else (table,)
