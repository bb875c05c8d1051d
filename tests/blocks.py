"""Generated code with blocks of numbers, compiled and run in this process."""

from __future__ import annotations

import ctypes
from collections.abc import Sequence
from dataclasses import replace
from functools import cache
from pathlib import Path

import numpy as np

from nlsdesign.components import Assembly, declare
from nlsdesign.components.assembly.deck_writer import deck_text
from nlsdesign.export import CSource, ParameterBlock, export_c_with_blocks
from nlsdesign.export.c.writer import paths_in_memory
from nlsdesign.feedback.control import ScheduledTorque, torque_controller
from nlsdesign.feedback.observer import designed_observer
from nlsdesign.foundation.deck import load_deck
from nlsdesign.model import FlatModel, flatten
from nlsdesign.regeneration import CodeRecipe, SameTable
from tests.compiling import compile_program

BETTER = {
    "spring.rubber.relaxing.spring.modulus": 1.6e6,
    "spring.rubber.relaxing.dashpot.viscosity": 25e3,
    "spring.pretension": 1e-4,
    "motor.torque_constant": 0.05,
    "dry_friction.sliding_effort": 0.03,
}
"""Numbers of a better deck: of spring, drive and friction."""


def controller(plant: FlatModel) -> FlatModel:
    """Return the torque controller of a plant."""
    return torque_controller(plant, law=ScheduledTorque(), sample_time=1e-3)


@cache
def machine(name: str = "austin2015_figure_consistent") -> Assembly:
    """Return a declared machine."""
    return declare(load_deck(name))


@cache
def recipe(kind: str = "cascade") -> CodeRecipe:
    """Return how observer and controller of the published machine are designed as one step."""
    first = designed_observer(flatten(machine()), kind=kind)
    table = SameTable.of(first.design.compact)
    return CodeRecipe("both", kind, 1e-3, None, None, table, {}, deck_text(machine()))


@cache
def loadable(kind: str = "cascade"):
    """Return the joined step with its coefficients."""
    return recipe(kind).loadable(flatten(machine()), controller)


def exported(folder: Path, real: str, kind: str = "cascade") -> tuple[CSource, ParameterBlock]:
    """Write the joined step, and return the block of its design."""
    source, layout = export_c_with_blocks(loadable(kind), folder, real=real, name="joint")
    return source, replace(layout.default, recipe=recipe(kind).to_dict())


class Running:
    """One instance of a step; its inputs and outputs are rows in the order of the model."""

    def __init__(self, source: CSource, folder: Path) -> None:
        library = folder / f"{source.source.stem}.so"
        compile_program([source.source], library, flags=["-shared", "-fPIC"])
        self.code, self.name = ctypes.CDLL(str(library)), source.name
        self.kind = np.float32 if source.real == "float" else np.float64
        model = source.model
        self.rows = [self._places(group) for group in (model.inputs, model.outputs)]
        self.state = np.zeros(1 << 17, np.uint64)
        self.results = np.zeros(len(model.outputs), self.kind)

    @staticmethod
    def _places(group) -> list[int]:
        in_memory = list(paths_in_memory(group))
        return [in_memory.index(v.name) for v in group]

    def call(self, function: str, *given: np.ndarray | bytes | None) -> int:
        """Call a function with the state and further pointers; return its word."""
        further = [g.ctypes.data_as(ctypes.c_void_p) if isinstance(g, np.ndarray) else g for g in given]
        return getattr(self.code, f"{self.name}_{function}")(
            self.state.ctypes.data_as(ctypes.c_void_p), *further
        )

    def load(self, block: bytes) -> int:
        """Load a block; return what was wrong with it."""
        return self.call("load", np.frombuffer(block, np.uint8).copy())

    def steps(self, inputs: Sequence[Sequence[float]]) -> np.ndarray:
        """Return the outputs of some samples, shape (samples, outputs)."""
        rows = np.zeros((len(inputs), len(self.rows[1])), self.kind)
        given = np.zeros(len(self.rows[0]), self.kind)
        for k, row in enumerate(inputs):
            given[self.rows[0]] = row
            self.call("step", given, self.results)
            rows[k] = self.results[self.rows[1]]
        return rows


def motion(samples: int, first: int = 0) -> np.ndarray:
    """Return angles and wanted torques that stay within all guards, shape (samples, 2)."""
    time = 1e-3 * np.arange(first, first + samples)
    angle = 0.5 * np.sin(2.0 * np.pi * 1.5 * time) + 0.2 * np.sin(2.0 * np.pi * 6.0 * time)
    return np.column_stack([np.round(angle / 0.767e-3) * 0.767e-3, 1.5 * np.sin(2.0 * np.pi * 0.9 * time)])
