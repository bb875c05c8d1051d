"""A piece of a model that is driven by measured signals and has a residual of its own.

A signal may come late: the block then reads it ahead, by a number that may be fitted.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, replace
from typing import NamedTuple

import casadi as ca
import numpy as np

from ....foundation.arrays import Array
from ....model import FlatModel


class Drive(NamedTuple):
    """How an input of a block follows from a record."""

    signal: str  # full name of the measured signal
    order: int = 0  # 0 for its value, 1 for its rate, 2 for the derivative of that
    late_by: tuple[str, ...] = ()  # names of the parameters whose sum says by how much the signal comes late
    # stretched_by: names of the parameters whose sum says by how much per time it becomes late
    stretched_by: tuple[str, ...] = ()

    @property
    def shifted_by(self) -> tuple[str, ...]:
        """Names of all parameters that shift the signal in time."""
        return self.late_by + self.stretched_by


@dataclass(frozen=True, eq=False)
class Block:
    """A model whose inputs are measured, and what its output must equal."""

    name: str  # where it is, for instance "spring"
    model: FlatModel  # all inputs that are not driven rest at their start value
    drives: Mapping[str, Drive]  # by name of the input
    output: str  # name of the model's only output
    target: str | None  # full name of the measured signal that the output must equal; None if it must vanish
    # moving: name of the input that must be well away from zero for the block to say anything (dry friction
    # at rest can be anything); None if there is no such input
    moving: str | None = None
    # effort_per_drive: constant factor in the output, where that is the error of a measured signal shown as
    # an effort
    effort_per_drive: float = 1.0

    def scaled_to(self, effort_per_drive: float) -> Block:
        """Return the block with another constant factor in its output."""
        if effort_per_drive == self.effort_per_drive:
            return self
        s, model = self.model.symbols(), self.model
        columns = [s.time, s.state, s.input, s.parameter, s.table]
        output = s.output * (effort_per_drive / self.effort_per_drive)
        equations = ca.Function("equations", columns, [s.derivative, output, s.signal, s.residual])
        return replace(self, model=replace(model, equations=equations), effort_per_drive=effort_per_drive)

    def at_rest(self, count: int) -> Array:
        """Return the inputs of the model where nothing drives them, shape (inputs, count)."""
        return np.repeat(self.model.start(self.model.inputs)[:, None], count, axis=1)

    @property
    def unit(self) -> str:
        """Unit of the residual."""
        return self.model.outputs[0].unit
