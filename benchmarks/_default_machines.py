"""Machines of the comparison of observers: numbers of a deck in the order of ``default_machine.c``."""

from __future__ import annotations

import ctypes
import math
from collections.abc import Mapping
from dataclasses import dataclass
from functools import lru_cache
from pathlib import Path
from typing import Any

import numpy as np

import nlsdesign as nls
from nlsdesign.export.compilation.compiled_step import CompiledStep
from nlsdesign.export.compilation.cross_compiler import compile_library
from nlsdesign.foundation.arrays import Array
from nlsdesign.simulation.prior import Prior

TIME, PARTS, BANDWIDTH, TORQUE = 1e-3, 10, 2.0 * math.pi * 25.0, 2.8
FREQUENCIES, LEARNING, COUNTED, RAMP = (2.0, 5.0), 1.5, 1.0, 0.3
MOST = 80
RUBBER = "spring.rubber"
SINGLE = (
    "motor.inertia", "drive", "motor.current_limit", "spring.pretension", "spring.cam.elements",
    "spring.cam.last_angle", "spring.cam.changeover", f"{RUBBER}.area", f"{RUBBER}.rest_length",
    "bearing.damping", "dry_friction.sliding_effort", "dry_friction.creep_speed", "motor_encoder.quantum",
    f"{RUBBER}.relaxing.spring.modulus", "second.modulus", f"{RUBBER}.relaxing.dashpot.viscosity",
    "second.viscosity", "knots", "arms",
)  # fmt: skip
"""Numbers of the structure in C before its rows."""
ROWS = (f"{RUBBER}.stiff.knots", f"{RUBBER}.stiff.modulus", "spring.cam.lever_arm")
JOINT = (
    "motor.inertia", "drive", "bearing.damping", "dry_friction.sliding_effort", f"{RUBBER}.area",
    f"{RUBBER}.rest_length", f"{RUBBER}.relaxing.spring.modulus", f"{RUBBER}.relaxing.dashpot.viscosity",
    *(f"{ROWS[1]}[{k + 1}]" for k in range(4)), *(f"{ROWS[0]}[{k + 1}]" for k in range(1, 4)),
)  # fmt: skip
"""Numbers that the joint extended Kalman filter estimates."""


@dataclass(frozen=True, eq=False)
class Run:
    """What a machine did: counted angle, current and torque, each of shape (samples,)."""

    angle: Array
    current: Array
    torque: Array


@lru_cache(maxsize=1)
def program(folder: Path) -> Any:
    """The machine in C, compiled for this processor."""
    source = Path(__file__).parent / "default_machine.c"
    library = ctypes.CDLL(
        str(compile_library([source], folder / "default_machine.so", flags=("-std=c99", "-O2")))
    )
    library.torque_at_rest.restype = ctypes.c_double
    return library


def numbers(values: Mapping[str, float]) -> Array:
    """The structure in C, from numbers by name."""
    rows = [[v for n, v in values.items() if n.startswith(f"{row}[")] for row in ROWS]
    given = {
        "drive": values["motor.gear_ratio"] * values["motor.torque_constant"], "second.modulus": 0.0,
        "second.viscosity": 1.0, "knots": float(len(rows[0])), "arms": float(len(rows[2])), **values,
    }  # fmt: skip
    row_parts = [np.pad(np.array(row), (0, MOST - len(row))) for row in rows]
    return np.concatenate([np.array([given[name] for name in SINGLE]), *row_parts])


def place(name: str) -> int:
    """Place of a number in the structure."""
    if name in SINGLE:
        return SINGLE.index(name)
    row, _, rest = name.partition("[")
    return len(SINGLE) + MOST * ROWS.index(row) + int(rest[:-1]) - 1


def pointer(array: Array) -> Any:
    return array.ctypes.data_as(ctypes.POINTER(ctypes.c_double))


class Course:
    """Sines of the torque, one frequency after the other, as a declared machine would need them."""

    def __init__(self, model: nls.FlatModel, folder: Path) -> None:
        self.library, self.declared, self.parts = program(folder), numbers(model.values), PARTS
        self.drive = self.declared[1] / self.declared[0]
        self.torque_constant = model.values["motor.torque_constant"]
        grid = np.linspace(0.0, model.values["spring.cam.last_angle"], 2001)
        at = [self.at_rest(self.declared, angle) for angle in grid]
        parts, self.stretches, begin = [], [], 0.0
        for f in FREQUENCIES:
            learning = math.ceil(LEARNING * f) / f
            t = TIME * np.arange(round((learning + COUNTED) / TIME))
            parts.append(TORQUE * np.minimum(t / RAMP, 1.0) * np.sin(2.0 * np.pi * f * t))
            self.stretches.append(
                slice(round((begin + learning) / TIME), round((begin + learning + COUNTED) / TIME))
            )
            begin += learning + COUNTED
        torque = np.concatenate(parts)
        angle = np.sign(torque) * np.interp(np.abs(torque), at, grid)
        for _ in range(2):
            angle = np.convolve(np.pad(angle, 4, mode="edge"), np.ones(9) / 9.0, mode="valid")
        rate = np.gradient(angle, TIME)
        push = np.gradient(rate, TIME) + torque / self.declared[0]
        self.wanted = np.ascontiguousarray(np.column_stack([angle, rate, push]))

    def at_rest(self, machine: Array, angle: float) -> float:
        """Torque of the spring after complete relaxation."""
        return float(self.library.torque_at_rest(pointer(machine), ctypes.c_double(angle)))

    def run(self, machine: Array, current: Array | None = None) -> Run:
        """Let a machine follow the course; or let given currents act on it."""
        samples = len(self.wanted)
        angle, torque = np.zeros(samples), np.zeros(samples)
        acting = np.zeros(samples) if current is None else current.copy()
        self.library.run(
            pointer(machine), samples, ctypes.c_double(TIME), self.parts,
            ctypes.c_double(BANDWIDTH if current is None else 0.0), ctypes.c_double(self.drive),
            pointer(self.wanted), pointer(angle), pointer(acting), pointer(torque),
        )  # fmt: skip
        return Run(angle, acting, torque)

    def joint(self, prior: Prior, run: Run, push: float) -> tuple[Array, Array]:
        """Torque and deviation that a joint extended Kalman filter makes of a run."""
        deviations = prior_deviations(prior)
        names = [name for name in JOINT if name in deviations]
        places = np.array([place(name) for name in names], dtype=np.int32)
        sizes = np.array([deviations[name] for name in names])
        torque, said, declared = self._results(), self._results(), self.declared.copy()
        self.library.joint_filter(
            pointer(declared), len(names), places.ctypes.data_as(ctypes.POINTER(ctypes.c_int)),
            pointer(sizes), len(run.angle), ctypes.c_double(TIME), ctypes.c_double(push), pointer(run.angle),
            pointer(run.current), pointer(torque), pointer(said),
        )  # fmt: skip
        return torque, said

    def watched(self, step: CompiledStep, run: Run) -> tuple[Array, Array]:
        """First two outputs of an observer in generated C along a run."""
        torque, said = self._results(), self._results()
        state = (ctypes.c_double * (step._library.adapter_size() // 8 + 1))()
        step._library.adapter_init(state, None)
        self.library.watch(
            step._library.adapter_step, state, len(run.angle), pointer(run.angle), pointer(run.current),
            pointer(torque), pointer(said),
        )  # fmt: skip
        return torque, said

    def _results(self) -> Array:
        return np.zeros(len(self.wanted))


def prior_deviations(prior: Prior) -> dict[str, float]:
    """Standard deviations of the logarithms by name; the drive is that of the torque constant."""
    known = dict(zip(prior.names, prior.deviations.tolist(), strict=True))
    return known | {"drive": known["motor.torque_constant"]}
