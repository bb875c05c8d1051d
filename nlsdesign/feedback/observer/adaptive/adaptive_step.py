"""The step of an observer and its slopes along uncertain directions, as entries of one table over the angle.

The inner states are driven by the measured angle alone, so what they do to angle and speed is known at both
ends of a sample, like the torque at rest: it runs linearly between a(θ_k)·z_k and a(θ_{k+1})·z_{k+1}. Held
at the beginning instead, it would be late by half a sample, and a filter that learns would take that for
damping.

Torques are linear in the slow states, but what they do to the speed is divided by the inertia, which may be
uncertain too: the product of ten per cent here and ten there is one per cent of the whole torque. So all that
accelerates is kept per inertia, and the inertia is an exact factor, exp(−Σ cᵢ·sᵢ).

What a table costs is measured with slow states that are given. How the filter moves them depends on every
small difference, so that two runs of the whole filter drift apart for reasons that are not the table's. With
given slow states the estimate rests on the measured angle alone, and the error that is left is the table's.
"""

from __future__ import annotations

import math
from collections.abc import Iterable, Iterator
from dataclasses import dataclass, replace
from typing import NamedTuple

import casadi as ca
import numpy as np

from ....foundation.arrays import Array
from ....foundation.symbolic import Expression
from ....model import FlatModel, Variable
from ....model.flat import stated_equations
from ..scheduling.angle_form import AngleForm, AngleScheduledPlant
from ..scheduling.step import ObserverStep, held, linear
from ..scheduling.table import Compact, Entry
from .duty_and_directions import UncertainDirections, spring_inertia

KINDS = ("estimate", "next", "prior", "coupling", "shift")
NEGLIGIBLE = 1e-4
"""Share of the typical size of a sum below which its slope along a direction is left out of the table."""


class _Side(NamedTuple):
    """A plant with other numbers, and its inertia over the declared one."""

    plant: AngleScheduledPlant
    relative_inertia: float


@dataclass(frozen=True, eq=False)
class AdaptiveStep:
    """One step as exact functions of the angle, nominal and with each direction a deviation up and down."""

    nominal: ObserverStep  # the step with the declared numbers; its gain is not used
    # raised, lowered: the plant with each direction at +1 and −1, and its inertia over the declared one
    raised: tuple[_Side, ...]
    lowered: tuple[_Side, ...]

    @property
    def inertia_slopes(self) -> list[float]:
        """Slope of the logarithm of one over the inertia along each direction."""
        return [
            (math.log(down.relative_inertia) - math.log(up.relative_inertia)) / 2.0
            for up, down in zip(self.raised, self.lowered, strict=True)
        ]

    def entries(self, angles: Array) -> list[Entry]:
        """Return all entries at many angles: nominal ``kind[i][j]``, slopes ``kind.d[i][j]``."""
        time, inner = self.nominal.sample_time, self.inner
        own = self.matrices(angles)
        named = {e.key: e for e in self.nominal.entries(angles) if e.key.partition("[")[0] in KINDS}
        for i in range(len(self.nominal.plant.states)):
            for j in range(inner):
                like = named[f"next[{i}][{j}]"]
                key = f"coupling[{i}][{j}]"
                named[key] = replace(like, key=key, name=like.name.replace("next.", "coupling.", 1))
        entries = [
            replace(named[f"{kind}[{i}][{j}]"], values=values)
            for kind in KINDS
            for (i, j), values in _each(own[kind])
        ]
        for d, (up, down) in enumerate(zip(self.raised, self.lowered, strict=True)):
            high, low = (_matrices(side, time, angles, inner) for side in (up, down))
            for kind in KINDS:
                for (i, j), values in _each((high[kind] - low[kind]) / 2.0):
                    like = named[f"{kind}[{i}][{j}]"]
                    if np.max(np.abs(values)) * like.weight <= NEGLIGIBLE:
                        values = np.zeros_like(values)
                    name = f"{like.name}.per.deviation[{d + 1}]"
                    entries.append(replace(like, key=f"{kind}.{d}[{i}][{j}]", name=name, values=values))
        return entries

    def matrices(self, angles: Array) -> dict[str, Array]:
        """Return the matrices of the step with the declared numbers."""
        return _matrices(_Side(self.nominal.plant, 1.0), self.nominal.sample_time, angles, self.inner)

    @property
    def inner(self) -> int:
        """Number of inner states."""
        return len(self.nominal.plant.states) - 2

    def driven(self, u: ca.SX) -> tuple[ca.SX, list[ca.SX]]:
        """Return what the inputs add to the rates, and its slope along each direction."""
        return ca.SX(self.nominal.plant.driven(u)), [
            (
                up.relative_inertia * ca.SX(up.plant.driven(u))
                - down.relative_inertia * ca.SX(down.plant.driven(u))
            )
            / 2.0
            for up, down in zip(self.raised, self.lowered, strict=True)
        ]

    def friction(self, speed: ca.SX) -> tuple[ca.SX, list[ca.SX]] | None:
        """Return the rate that friction gives a speed, and its slope along each direction; or ``None``."""
        own = self.nominal.plant.friction
        if own is None:
            return None
        slopes = []
        for up, down in zip(self.raised, self.lowered, strict=True):
            rates = [
                ca.SX(0)
                if side.plant.friction is None
                else side.relative_inertia * ca.SX(side.plant.friction(speed))
                for side in (up, down)
            ]
            slopes.append((rates[0] - rates[1]) / 2.0)
        return ca.SX(own(speed)), slopes


def _each(matrices: Array) -> Iterator[tuple[tuple[int, int], Array]]:
    for i in range(matrices.shape[1]):
        for j in range(matrices.shape[2]):
            yield (i, j), matrices[:, i, j]


def _matrices(side: _Side, time: float, angles: Array, inner: int) -> dict[str, Array]:
    """Return the matrices of the step, inner states first; see the top of this module."""
    plant = side.plant
    c, n = plant.at(angles), len(plant.states)
    # What accelerates, times the inertia over the declared one.
    pulled = side.relative_inertia * c.a[:, inner:, :inner]
    given = side.relative_inertia * c.drive[:, inner:, None]
    within, begin_inner, end_inner = linear(c.a[:, :inner, :inner], time)
    moving, begin, end = linear(c.a[:, inner:, inner:], time)
    count = len(angles)
    push = np.zeros((count, n, len(plant.rows)))
    for part, block in (
        (slice(None, inner), c.a[:, :inner, :inner]),
        (slice(inner, None), c.a[:, inner:, inner:]),
    ):
        pushed = np.zeros((count, n, len(plant.rows)))
        pushed[:, list(plant.rows), range(len(plant.rows))] = 1.0
        push[:, part] = held(block, pushed[:, part], time)[1]
    following, prior, coupling = (
        np.zeros((count, n, n + 1)),
        np.zeros((count, n, 1)),
        np.zeros((count, n, inner)),
    )
    following[:, :inner, :inner] = within
    following[:, :inner, n:] = begin_inner @ c.drive[:, :inner, None]
    following[:, inner:, inner:n] = moving
    following[:, inner:, :inner] = begin @ pulled
    following[:, inner:, n:] = begin @ given
    prior[:, :inner] = end_inner @ c.drive[:, :inner, None]
    prior[:, inner:] = end @ given
    coupling[:, inner:] = end @ pulled
    return {
        "estimate": c.estimate[:, None, :],
        "next": np.concatenate([following, push], axis=2),
        "prior": prior,
        "coupling": coupling,
        "shift": c.shift[:, :, None],
    }


def adaptive_step(
    form: AngleForm, nominal: ObserverStep, directions: UncertainDirections, declared: dict[str, float]
) -> AdaptiveStep:
    """Return the step with its neighbours along the directions."""
    count, inertia = len(directions.effect), spring_inertia(form)
    sides: list[list[_Side]] = []
    for sign in (1.0, -1.0):
        plants = []
        for d in range(count):
            at = np.zeros(count)
            at[d] = sign
            other = form.with_values(directions.values(declared, at))
            driven, _ = other.driven()
            plant = replace(
                nominal.plant, at=other.at, rest=other.rest, driven=driven, friction=other.friction()
            )
            plants.append(_Side(plant, spring_inertia(other) / inertia))
        sides.append(plants)
    return AdaptiveStep(nominal, tuple(sides[0]), tuple(sides[1]))


SLOWEST, STEP = 0.4, 0.23
"""Of the slow states through ± one deviation, in Hz: frequency of the first, and from each to the next."""


@dataclass(frozen=True, eq=False)
class HeldObserver:
    """Inner states and torque estimate of an adaptive observer with given courses of its slow states."""

    model: FlatModel  # discrete; its first input is the angle, its only output the estimate
    step: AdaptiveStep

    def start(self, angle: float) -> dict[str, float]:
        """Return the start values at rest at an angle."""
        plant, at = self.step.nominal.plant, np.array([angle])
        matrices = self.step.matrices(at)
        memory = plant.rest(at)[0] - matrices["shift"][0, :, 0] - matrices["prior"][0, :, 0]
        values = [*memory[: self.step.inner], angle, 0.0]
        return {v.name: float(value) for v, value in zip(self.model.states, values, strict=True)}


def held_observer(step: AdaptiveStep, compact: Compact) -> HeldObserver:
    """Return the part of an adaptive observer on which its torque rests, for a table."""
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
    equations = stated_equations(
        ca.vertcat(memory, before, count), ca.vertcat(angle, other),
        derivative=ca.vertcat(*following, angle, count + 1), output=estimate, table=w,
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
