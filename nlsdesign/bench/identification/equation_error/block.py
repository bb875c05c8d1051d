"""A piece of a model that is driven by measured signals and has a residual of its own.

A signal may come late: the block then reads it ahead, by a number that may be fitted.
"""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import dataclass, field, replace
from typing import NamedTuple

import casadi as ca
import numpy as np
from numpy.typing import NDArray

from ....foundation.arrays import Array
from ....model import FlatModel
from ..filters import Smoothing


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
    cold: tuple[str, ...] = ()  # names of the states that begin at their start values, not at rest

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


class Filters(NamedTuple):
    """How a block reads its records."""

    width: float  # standard deviation in s of the zero-phase Gaussian filter that every term passes
    span: float  # time in s over which rates are taken
    spacing: float  # time in s from one row to the next
    straightened: tuple[str, ...] = ()  # names of the inputs whose noise the block rectifies, see rectified


@dataclass(frozen=True, eq=False)
class NoiseFloor:
    """What a block makes of the noise of a record: the filter it reads through, and the floor behind it.

    ``filter`` is a zero-phase filter, thinned, without the rows that say nothing; its shape is (rows, n).
    ``sigma`` is the noise floor of each row in the unit of the block, ``raw_sigma`` that of each unfiltered
    sample, shape (n,), which only blocks with a target use. Its own noise makes at most ``independent``
    independent rows of them. The floor is known from ``known`` effective squares of that noise. Both are
    infinite where the noise is white. The rows hold the share ``covered`` of the power of the motion.
    """

    filter: Smoothing
    sigma: Array
    raw_sigma: Array
    independent: float = math.inf
    known: float = math.inf
    covered: float = 1.0
    # shares: of the variance of the floor, from the noise of each signal that is taken as it is
    shares: Mapping[str, float] = field(default_factory=dict)
    width: float = 0.0  # standard deviation of the filter in s
    acceleration: tuple[float, float] = (0.0, 0.0)  # power of its noise and of all of it, in squares of sigma

    @property
    def typical(self) -> float:
        """Noise floor over the rows, root mean square, in the unit of the block."""
        return float(np.sqrt(np.mean(self.sigma**2)))

    @property
    def places(self) -> NDArray[np.int64]:
        """Index of the sample in the middle of each row."""
        return self.filter.places


@dataclass(frozen=True, eq=False)
class BlockNoise:
    """How a block reads the records of a bench, and what it makes of their noise.

    ``floors``: by name of the record; one that says nothing of the block has none.
    """

    block: Block
    filters: Filters
    floors: Mapping[str, NoiseFloor]

    @property
    def typical(self) -> float:
        """Noise floor over all records, root mean square, in the unit of the block."""
        rows = np.concatenate([floor.sigma for floor in self.floors.values()])
        return float(np.sqrt(np.mean(rows**2)))

    @property
    def known(self) -> float:
        """Effective squares of noise from which the floor is known."""
        # One estimate of the noise serves all records, so more of them make it no better.
        doubt = float(np.mean([1.0 / floor.known for floor in self.floors.values()]))
        return 1.0 / doubt if doubt else math.inf

    def read_by(self, block: Block) -> BlockNoise:
        """Return the same of another model of the block, in the scale of the declared one."""
        return replace(self, block=block.scaled_to(self.block.effort_per_drive))
