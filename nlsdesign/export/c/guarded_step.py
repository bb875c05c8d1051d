"""The discrete model in Python with the guards of the C code; the reference for its self-test."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from ...model.flat import FlatModel
from .c_text import DOUBLE, Real

INPUT_HELD = 1 << 0
INPUT_SATURATED = 1 << 1
STATE_HELD = 1 << 2
OUTPUT_HELD = 1 << 3
PARAMETER_REFUSED = 1 << 4
FIRST_INDEX_BIT, LAST_INDEX_BIT = 8, 30

STATUS_BITS = {
    "INPUT_HELD": (INPUT_HELD, "an input was not finite, its last good value was used"),
    "INPUT_SATURATED": (INPUT_SATURATED, "an input was outside its range, the limit was used"),
    "STATE_HELD": (STATE_HELD, "the next state was not finite, the state was kept"),
    "OUTPUT_HELD": (OUTPUT_HELD, "an output was not finite, the last good outputs were given"),
    "PARAMETER_REFUSED": (
        PARAMETER_REFUSED,
        "a parameter was not finite or outside its range, it was not taken",
    ),
}


def index_bit(index: int) -> int:
    """Return the bit of the status word that names an input or parameter.

    Parameters
    ----------
    index
        Number of the input or parameter, from 0; all from 22 on share the last bit.
    """
    return 1 << min(FIRST_INDEX_BIT + index, LAST_INDEX_BIT)


def first_outputs(model: FlatModel, real: Real = DOUBLE) -> list[float]:
    """Return the outputs held before the first finite ones: those at the start, or 0.

    Parameters
    ----------
    model
        Discrete model.
    real
        Number type of the C code.
    """
    start = model.evaluate(model.start(model.states).tolist(), model.start(model.inputs).tolist())
    values = [real.round(start[each.name]) for each in model.outputs]
    return [value if math.isfinite(value) else 0.0 for value in values]


@dataclass
class GuardedModel:
    """One running instance of a discrete model, evaluated by CasADi, with the guards of the C code.

    Parameters
    ----------
    model
        Discrete model; its parameter and start values are used.
    real
        Number type whose range counts as finite.
    """

    model: FlatModel
    real: Real = DOUBLE

    def __post_init__(self) -> None:
        self.state: NDArray[np.float64] = self.model.start(self.model.states)
        self._inputs = [each.start for each in self.model.inputs]
        self._outputs = first_outputs(self.model, self.real)
        self._parameters = self.model.start(self.model.parameters)

    def step(self, inputs: Sequence[float]) -> tuple[list[float], int]:
        """Advance by one sample.

        Parameters
        ----------
        inputs
            Shape (inputs,); any numbers, NaN and infinity too.

        Returns
        -------
        tuple
            The outputs, shape (outputs,), and the status word.
        """
        status = 0
        for i, (variable, given) in enumerate(zip(self.model.inputs, inputs, strict=True)):
            if not math.isfinite(given):
                status |= INPUT_HELD | index_bit(i)
                continue
            self._inputs[i] = min(max(given, variable.minimum), variable.maximum)
            if self._inputs[i] != given:
                status |= INPUT_SATURATED | index_bit(i)
        w = self.model.look_up(self.state.tolist(), self._inputs)
        f, y, _, _ = self.model.equations(0.0, self.state, self._inputs, self._parameters, w)
        following, outputs = np.array(f, dtype=float).ravel(), np.array(y, dtype=float).ravel()
        if np.all(np.abs(following) <= self.real.largest):
            self.state = following
        else:
            status |= STATE_HELD
        if np.all(np.abs(outputs) <= self.real.largest):
            self._outputs = outputs.tolist()
        else:
            status |= OUTPUT_HELD
        return list(self._outputs), status
