"""The discrete model in Python with the guards of the C code; the reference for its self-test."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from ...foundation.arrays import Array
from ...model.flat import FlatModel
from .c_text import DOUBLE, Real
from .reading_guard import ReadingGuard, mover, reading_numbers
from .status_bits import (
    INPUT_HELD,
    INPUT_SATURATED,
    OUT_OF_TABLE,
    OUTPUT_HELD,
    STATE_RESTARTED,
    WAITING,
    index_bit,
)


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
        model = self.model
        self.state: Array = model.start(model.states)
        self.begun = False
        self._inputs = [min(max(v.start, v.minimum), v.maximum) for v in model.inputs]
        self._outputs = first_outputs(model, self.real)
        self._parameters = model.start(model.parameters)
        self._guards: dict[int, ReadingGuard] = {}
        for i, v in enumerate(model.inputs):
            numbers = reading_numbers(v, float(model.sample_time or 0.0), self.real)
            if numbers is not None:
                self._guards[i] = ReadingGuard(numbers, self.real, self._inputs[i])
        self._movers = {i: mover(model, model.inputs[i]) for i in self._guards}

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
        status, resume = self._take(inputs)
        if not self.begun:
            if not all(guard.seen for guard in self._guards.values()):
                return list(self._outputs), status | WAITING
            self.state, self.begun = self._settled(self.model.start(self.model.states), 0), True
        elif resume:
            self.state = self._settled(self.state, 1)
        return self._advance(status)

    def _take(self, inputs: Sequence[float]) -> tuple[int, bool]:
        """Take the commands, then the readings; return flags and whether the model has to resume."""
        status, resume = 0, False
        for i, (variable, given) in enumerate(zip(self.model.inputs, inputs, strict=True)):
            if i in self._guards:
                continue
            if not abs(given) <= self.real.largest:
                status |= INPUT_HELD | index_bit(i)
                continue
            self._inputs[i] = min(max(given, variable.minimum), variable.maximum)
            if self._inputs[i] != given:
                status |= INPUT_SATURATED | index_bit(i)
        for i, guard in self._guards.items():
            moved = self._movers[i]
            driver = 0.0
            if moved is not None:
                driver = float((self._inputs if moved[0] == "inputs" else self.state)[moved[1]])
            self._inputs[i], flags, again = guard.take(inputs[i], driver)
            status |= flags | (index_bit(i) if flags else 0)
            resume = resume or again
        return status, resume

    def _settled(self, state: Array, which: int) -> Array:
        if self.model.begin is None:
            return state
        w = self.model.look_up(state.tolist(), self._inputs)
        return np.array(
            self.model.begin(state, self._inputs, self._parameters, w)[which], dtype=float
        ).ravel()

    def _advance(self, status: int) -> tuple[list[float], int]:
        model, used = self.model, list(self._inputs)
        w = model.look_up(self.state.tolist(), self._inputs)
        if model.expected is not None and any(guard.missed for guard in self._guards.values()):
            expected = np.array(model.expected(self.state, self._inputs, self._parameters, w)).ravel()
            for i, guard in self._guards.items():
                used[i] = float(expected[i]) if guard.missed else used[i]
        at = {v.name: float(x) for v, x in zip(model.states, self.state, strict=True)}
        at |= {v.name: u for v, u in zip(model.inputs, self._inputs, strict=True)}
        if any(not table.ends[0] <= at[table.argument] <= table.ends[1] for table in model.tables):
            status |= OUT_OF_TABLE
        f, y, _, _ = model.equations(0.0, self.state, used, self._parameters, w)
        following, outputs = np.array(f, dtype=float).ravel(), np.array(y, dtype=float).ravel()
        if np.all(np.abs(following) <= self.real.largest):
            self.state = following
        else:
            self.state, self.begun = model.start(model.states), False
            status |= STATE_RESTARTED
        if np.all(np.abs(outputs) <= self.real.largest):
            self._outputs = outputs.tolist()
        else:
            status |= OUTPUT_HELD
        return list(self._outputs), status
