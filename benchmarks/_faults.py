"""Generated steps beside their machine while readings and commands fail: how soon a fault is forgotten.

Two machines with one step each are used alike, and one of them meets the faults. The C runs on this machine,
in the number type that is asked for; the processors of `benchmarks.targets` give the same bits.
"""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import dataclass
from typing import Final

import casadi as ca
import numpy as np

from nlsdesign.export import CSource
from nlsdesign.export.compilation.compiled_step import CompiledStep, natively
from nlsdesign.foundation.arrays import Array
from nlsdesign.model import FlatModel

LARGEST: Final = 5.0
"""Torque in N·m of which 1 % is allowed, as in docs/controller_code.md."""
ALLOWED: Final = 0.01
SETTLED, WATCHED = 300, 200
"""Samples after a fault from which it should be forgotten, and how many are looked at then."""
QUANTUM: Final = 0.767e-3
STOP: Final = 1.5
"""Angle in rad at which the frame stops the machine, as the deck declares; the blow takes all speed."""

Change = Callable[[float], float]
"""From a good value to what is read or commanded."""
REPORTED: Final = 8
"""First bit of a monitor's word that names a change."""


def _value(draw: np.random.Generator) -> tuple[int, Change]:
    bad = math.copysign(10.0 ** draw.uniform(-3.0, 38.0), draw.uniform(-1.0, 1.0))
    return 1, lambda good: good + bad


def _not_a_number(draw: np.random.Generator) -> tuple[int, Change]:
    bad = float(draw.choice([math.nan, math.inf, -math.inf]))
    return int(draw.integers(1, 151)), lambda good: bad


def _jump(draw: np.random.Generator) -> tuple[int, Change]:
    size = draw.uniform(-3.0, 3.0)
    return int(draw.integers(1, 41)), lambda good: good + size


def _frozen(draw: np.random.Generator) -> tuple[int, Change]:
    stands: list[float] = []

    def bad(good: float) -> float:
        stands.append(good)
        return stands[0]

    return int(draw.integers(1, 2001)), bad


READINGS: Final = (_value, _not_a_number, _jump, _frozen)
COMMANDS: Final = (_value, _not_a_number)


class Machine:
    """The machine over one sample: five steps of Runge and Kutta, the current held."""

    def __init__(self, plant: FlatModel) -> None:
        x, current = ca.MX.sym("x", len(plant.states)), ca.MX.sym("current")
        numbers, step, after = plant.start(plant.parameters), 2e-4, x

        def slope(at: ca.MX) -> ca.MX:
            return plant.equations(0.0, at, current, numbers, [])[0]

        for _ in range(5):
            one = slope(after)
            two = slope(after + step / 2.0 * one)
            three = slope(after + step / 2.0 * two)
            after = after + step / 6.0 * (one + 2.0 * two + 2.0 * three + slope(after + step * three))
        place = [v.name for v in plant.signals].index("spring.torque")
        torque = plant.equations(0.0, x, current, numbers, [])[2][place]
        self._advance = natively(ca.Function("advance", [x, current], [after, torque]).expand())
        self.start = np.array(plant.start(plant.states), dtype=float).ravel()
        names = [v.name for v in plant.states]
        self.angle, self._speed = names.index("motor.angle"), names.index("motor.speed")

    def advance(self, state: Array, current: float) -> tuple[Array, float]:
        """Return what follows, and the torque of the spring before."""
        following, torque = self._advance(state, current)
        following = np.array(following, dtype=float).ravel()
        if abs(following[self.angle]) > STOP:
            following[self.angle], following[self._speed] = math.copysign(STOP, following[self.angle]), 0.0
        return following, float(torque)


class Twin:
    """A machine with its step: an observer over a given current, or a loop that makes its own."""

    def __init__(self, machine: Machine, step: CompiledStep, model: FlatModel) -> None:
        self._machine, self._step = machine, step
        self._inputs = [v.name for v in model.inputs]
        names = [v.name for v in model.outputs]
        self._current = names.index("motor.current") if "motor.current" in names else None
        self._torque = names.index("spring.torque") if "spring.torque" in names else None
        self._state, self._acting = machine.start, 0.0
        self.step_finite, self.word = True, 0

    def sample(self, k: int, reading: Change, command: Change) -> float:
        """Go on by one sample; return what is judged.

        Of an observer that is its estimate, of a loop the machine's torque, of a monitor that it reports.
        """
        time = 1e-3 * k
        if self._current is None:
            self._acting = 8.0 * math.sin(8.2 * time) + 4.0 * math.sin(2.3 * time + 1.0)
        following, torque = self._machine.advance(self._state, self._acting)
        angle = QUANTUM * round(float(self._state[self._machine.angle]) / QUANTUM)
        given = {
            "motor.angle": reading(angle), "motor_encoder.reading": reading(angle),
            "motor.current": command(self._acting), "spring.torque": torque,
            "spring.torque.desired": command(2.0 * math.sin(8.2 * time)),
        }  # fmt: skip
        outputs, self.word = self._step([given[name] for name in self._inputs])
        self.step_finite = bool(np.isfinite(outputs).all())
        self._state = following
        if self._current is not None:
            self._acting = float(outputs[self._current])
            return torque
        return float(outputs[self._torque]) if self._torque is not None else float(self.word >> REPORTED > 0)


@dataclass(frozen=True)
class Forgotten:
    """What faults have left 0.3 s after they ended."""

    faults: int
    worst: float  # share of the largest torque, 0.3 s to 0.5 s after a fault
    beyond: int  # faults that were not forgotten then
    unflagged: int  # of these without a flag since they began
    not_finite: int  # samples

    def cells(self) -> str:
        """Return it as cells of a table."""
        counts = [n or "none" for n in (self.beyond, self.unflagged, self.not_finite)]
        return f"{self.faults} | {100.0 * self.worst:.2g} | {' | '.join(map(str, counts))}"


def forgotten(source: CSource, plant: FlatModel, faults: int, *, seed: int = 1) -> Forgotten:
    """Run a step with faults drawn by chance beside one without."""
    machine, draw, model = Machine(plant), np.random.default_rng(seed), source.model
    good, failing = (Twin(machine, CompiledStep(source), model) for _ in range(2))
    kinds = [(kind, True) for kind in READINGS] + [(kind, False) for kind in COMMANDS]

    def same(value: float) -> float:
        return value

    k, worst, beyond, unflagged, not_finite = 0, 0.0, 0, 0, 0
    for number in range(faults):
        kind, of_reading = kinds[number % len(kinds)]
        length, bad = kind(draw)
        pause, flagged, apart = 1000 if number == 0 else int(draw.integers(1, 50)), False, 0.0
        for j in range(-pause, length + SETTLED + WATCHED):
            faulty = bad if 0 <= j < length else same
            readings, commands = (faulty, same) if of_reading else (same, faulty)
            true, seen = good.sample(k, same, same), failing.sample(k, readings, commands)
            flagged |= j >= 0 and failing.word != 0
            not_finite += not failing.step_finite
            if j >= length + SETTLED:
                apart = max(apart, abs(seen - true) / LARGEST)
            k += 1
        worst = max(worst, apart)
        beyond, unflagged = beyond + (apart > ALLOWED), unflagged + (apart > ALLOWED and not flagged)
    return Forgotten(faults, worst, beyond, unflagged, not_finite)
