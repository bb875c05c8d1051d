"""Calibrations of the rig's machine for tests: records written, read and estimated; what is true by name."""

from __future__ import annotations

import math
from collections.abc import Callable, Mapping
from functools import cache
from pathlib import Path

import numpy as np

from nlsdesign.bench.calibration import (
    FreeRunTest,
    HungWeightTest,
    LoadCellTest,
    load_calibration,
)
from nlsdesign.bench.calibration.bench_test import CalibrationTest
from nlsdesign.bench.calibration.estimate import CalibrationRecords, Estimate
from nlsdesign.components import Assembly
from nlsdesign.components.assembly.deck_writer import declare
from nlsdesign.foundation.deck import load_deck
from tests.rig.calibration_bench import (
    Logger,
    Machine,
    free_run,
    hung_weight,
    load_cell,
    write_calibration_records,
)

CAM, LINEAR = "austin2015_figure_consistent", "austin2015_stiff_spring"
SIGNALS = {
    "angle_rad": "motor_encoder.reading",
    "current_A": "motor.current",
    "weight_Nm": "hung_weight.torque",
    "cell_Nm": "load_cell.reading",
}
Runs = dict[str, dict[str, np.ndarray]]
BENCH: dict[str, tuple[CalibrationTest, Callable[[Machine, Logger, int], Runs]]] = {
    "hung_weight": (HungWeightTest(), hung_weight),
    "load_cell": (LoadCellTest(), load_cell),
    "free_run": (FreeRunTest(), free_run),
}


def unchanged(name: str) -> str:
    """The name as it is."""
    return name


@cache
def deck(name: str = CAM) -> Assembly:
    """A deck of the project."""
    return declare(load_deck(name))


def recorded(
    kind: str,
    folder: Path,
    machine: Machine,
    *,
    seed: int = 1,
    logger: Logger | None = None,
    name: Callable[[str], str] = unchanged,
) -> Path:
    """Write the records of a kind of calibration, for a machine whose parts may have other names."""
    runs = BENCH[kind][1](machine, logger or Logger(), seed)
    return write_calibration_records(folder / kind, runs, {k: name(v) for k, v in SIGNALS.items()})


def read(kind: str, folder: Path, actuator: Assembly) -> CalibrationRecords:
    """Read them."""
    return load_calibration(actuator, BENCH[kind][0], folder)


def truth(machine: Machine) -> dict[str, float]:
    """What is true, by the names of the decks."""
    true = {
        "motor.inertia": machine.inertia,
        "motor.torque_constant": machine.torque_constant,
        "bearing.damping": machine.damping,
        "dry_friction.sliding_effort": machine.friction,
    }
    if machine.stiffness:
        return true | {"spring.stiffness": machine.stiffness}
    true |= {
        "spring.rubber.area": machine.area,
        "spring.rubber.rest_length": machine.length,
        "spring.rubber.relaxing.spring.modulus": machine.modulus,
        "spring.rubber.relaxing.dashpot.viscosity": machine.viscosity,
        "spring.cam.lever_arm[2]": machine.lever * 0.956797e-3,
    }
    true |= {f"spring.rubber.stiff.modulus[{k}]": m for k, m in enumerate(machine.stiff, start=1)}
    return true | {
        f"spring.rubber.stiff.knots[{k}]": e for k, e in enumerate(machine.strains, start=1) if k > 1
    }


def misses(found: Estimate, true: Mapping[str, float], *, least: float = 0.9) -> dict[str, float]:
    """How far the truth lies from each number that became better known, in its standard deviations."""
    result = {}
    for name, value in true.items():
        k = found.after.place(name)
        if found.after.deviations[k] < least * found.before.deviations[k]:
            result[name] = math.log(value / found.after.values[k]) / found.after.deviations[k]
    return result
