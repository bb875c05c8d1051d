"""The torque of an adaptive observer with slow states that are given: what its table does to the estimate.

How the filter moves its slow states depends on every small difference, so that two runs of the whole filter
drift apart for reasons that are not the table's. With given slow states the estimate rests on the measured
angle alone, and the error that is left is that of the table.
"""

from __future__ import annotations

import math
from collections.abc import Iterable
from dataclasses import dataclass

import casadi as ca
import numpy as np

from ....foundation.symbolic import Expression
from ....model import FlatModel, Variable
from ..scheduling.table import Compact
from .adaptive_step import AdaptiveStep

SLOWEST, STEP = 0.4, 0.23
"""Of the slow states through ± one deviation, in Hz: frequency of the first, and from each to the next."""


@dataclass(frozen=True, eq=False)
class HeldObserver:
    """Inner states and torque estimate of an adaptive observer whose slow states are given courses of time.

    Parameters
    ----------
    model
        Discrete; its first input is the angle, its only output the estimate.
    step
        Of the adaptive observer.
    """

    model: FlatModel
    step: AdaptiveStep

    def start(self, angle: float) -> dict[str, float]:
        """Return the start values at rest at an angle.

        Parameters
        ----------
        angle
            In rad.
        """
        plant, at = self.step.nominal.plant, np.array([angle])
        matrices = self.step.matrices(at)
        memory = plant.rest(at)[0] - matrices["shift"][0, :, 0] - matrices["prior"][0, :, 0]
        values = [*memory[: self.step.inner], angle, 0.0]
        return {v.name: float(value) for v, value in zip(self.model.states, values, strict=True)}


def held_observer(step: AdaptiveStep, compact: Compact) -> HeldObserver:
    """Return the part of an adaptive observer on which its torque rests, for a table.

    Parameters
    ----------
    step
        Of the adaptive observer.
    compact
        Its table.
    """
    plant, inner, time = step.nominal.plant, step.inner, step.nominal.sample_time
    slow = len(step.raised)
    w = ca.SX.sym("w", len(compact.columns))
    memory, before, count = ca.SX.sym("memory", inner), ca.SX.sym("before"), ca.SX.sym("count")
    angle, other = ca.SX.sym("angle"), ca.SX.sym("other", len(plant.inputs))
    given = [ca.cos(2.0 * math.pi * (SLOWEST + STEP * d) * time * count + d) for d in range(slow)]

    def read(kind: str, i: int, j: int) -> Expression:
        keys = [f"{kind}[{i}][{j}]", *(f"{kind}.{d}[{i}][{j}]" for d in range(slow))]
        parts = []
        for factor, key in zip([ca.SX(1), *given], keys, strict=True):
            place = compact.places[key]
            parts.append(factor * place.factor * (1 if place.column is None else w[place.column]))
        return sum(parts, start=ca.SX(0))

    state = [memory[i] + read("prior", i, 0) for i in range(inner)]
    state += [ca.SX(0), ca.SX(0)]
    state[plant.moving[1]] = (angle - before) / time
    known = [*state, ca.SX(1)]
    following = [_sum(read("next", i, j) * x for j, x in enumerate(known)) for i in range(inner)]
    estimate = _sum(read("estimate", 0, j) * x for j, x in enumerate(known))
    nothing = ca.SX(0, 1)
    equations = ca.Function(
        "held",
        [
            ca.SX.sym("time"), ca.vertcat(memory, before, count), ca.vertcat(angle, other), ca.SX(0, 1), w
        ],
        [ca.vertcat(*following, angle, count + 1), estimate, nothing, nothing],
        ["time", "state", "input", "parameter", "table"], ["derivative", "output", "signal", "residual"],
    )  # fmt: skip
    names = [Variable(f"{v.name}.memory", v.unit, "inner state") for v in plant.states[:inner]]
    states = (*names, Variable("before", "rad", "last angle"), Variable("samples", "1", "since the start"))
    model = FlatModel(
        name=f"{plant.name}_held", description="estimate with given slow states", states=states,
        inputs=(Variable(plant.angle, "rad", "measured angle"), *plant.inputs), parameters=(),
        outputs=(plant.estimate,), signals=(), equations=equations, sample_time=time,
    )  # fmt: skip
    return HeldObserver(model, step)


def _sum(parts: Iterable[Expression]) -> Expression:
    return sum(parts, start=ca.SX(0))
