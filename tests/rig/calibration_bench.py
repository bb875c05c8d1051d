"""Three calibrations of the published actuator on the rig: hung weight, load cell, free run.

The machine is simulated as in :mod:`tests.rig.bench`, with set-valued dry friction, and with no model code of
the package; numbers are named here on their own. What is hidden is drawn by the caller. The cam is the
spline of :mod:`tests.rig.published`, a little larger or smaller as a whole.
"""

from __future__ import annotations

from dataclasses import dataclass, replace
from math import exp, pi
from pathlib import Path

import numpy as np

from .bench import plain, prox
from .published import PUBLISHED, RUBBER

STEP = 1.0e-4  # s: slow motions, no contact
GRID = 5.0e-4  # rad
WEIGHTS = (0.0, 1.2, -1.2)  # N·m, on one side of the lever and on the other


@dataclass(frozen=True)
class Machine:
    """What is true of one machine, and of the instruments around it; SI."""

    inertia: float = 5.97e-4
    ratio: float = 4.0
    torque_constant: float = 0.055
    damping: float = 1.0e-3
    friction: float = 0.02
    lever: float = 1.0  # factor of the lever arm
    area: float = 1.0e-4
    length: float = 0.0125
    stiff: tuple[float, ...] = RUBBER.k_star
    strains: tuple[float, ...] = tuple(e / 0.0125 for e in RUBBER.engage)
    modulus: float = RUBBER.k
    viscosity: float = RUBBER.eta
    stiffness: float = 0.0  # N·m/rad: of a linear spring in the place of cam and rubber
    breakaway: float = 0.0  # beyond sliding friction, falls over 0.3 rad/s; nobody declares it
    zero: float = 0.0  # rad, of the encoder
    weight_factor: float = 1.0
    cell_factor: float = 1.0
    cell_offset: float = 0.0


@dataclass(frozen=True)
class Logger:
    """How the bench logs."""

    rate: float = 1000.0  # Hz
    counts: int = 8192  # per turn
    current_noise: float = 0.04  # A
    cell_noise: float = 0.005  # N·m
    spikes: int = 0  # samples of the encoder that are far off, in each record


def _tables(machine: Machine) -> tuple[np.ndarray, np.ndarray]:
    angles = GRID * np.arange(2600)
    lever = machine.lever * PUBLISHED.cam.lever_arm(angles)
    return machine.lever * PUBLISHED.cam.extension(angles), lever


def torque_curve(machine: Machine, angles: np.ndarray) -> np.ndarray:
    """Relaxed torque of the spring in N·m, two elements."""
    extension = machine.lever * PUBLISHED.cam.extension(np.abs(angles))
    past = np.maximum(extension[:, None] / machine.length - np.array(machine.strains), 0.0)
    force = machine.area * (past @ np.array(machine.stiff))
    return np.sign(angles) * 2.0 * machine.lever * PUBLISHED.cam.lever_arm(np.abs(angles)) * force


def _run(
    machine: Machine,
    wanted: np.ndarray | None,
    current: np.ndarray,
    weight: np.ndarray,
    *,
    spring: bool = True,
) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Angle, current and spring torque over time; with a wanted angle a servo adds to the current."""
    machine = plain(machine)
    extension, lever = (table.tolist() for table in _tables(machine))
    per_ampere = machine.ratio * machine.torque_constant
    nominal = 5.97e-4 * 60.0 / 0.22
    k_p, k_d = nominal * 60.0, 1.6 * nominal
    goals = current if wanted is None else wanted
    paces, hanging = np.gradient(goals, STEP).tolist(), (weight * machine.weight_factor).tolist()
    angle = speed = flow = 0.0
    ramps = list(zip(machine.stiff, machine.strains, strict=True))
    rows = []
    for i, goal, pace, load in zip(current.tolist(), goals.tolist(), paces, hanging, strict=True):
        if wanted is not None:
            i += k_p * (goal - angle) + k_d * (pace - speed)
            i = min(max(i, -20.0), 20.0)
        torque = machine.stiffness * angle if spring else 0.0
        if spring and not machine.stiffness:
            place = abs(angle) / GRID
            j = int(place)
            share = place - j
            arm = lever[j] + share * (lever[j + 1] - lever[j])
            strain = (extension[j] + share * (extension[j + 1] - extension[j])) / machine.length
            stress = sum(m * (strain - e) for m, e in ramps if strain > e)
            hung = machine.modulus * (strain - flow)  # spring and dashpot in series
            flow += STEP * hung / machine.viscosity
            torque = 2.0 * arm * machine.area * (stress + hung) * (1.0 if angle >= 0.0 else -1.0)
        rows.append((angle, i, torque))
        push = per_ampere * i - torque - load - machine.damping * speed
        level = machine.friction
        if machine.breakaway:
            level += machine.breakaway * exp(-((speed / 0.3) ** 2))
        speed = prox(speed + STEP * push / machine.inertia, STEP * level / machine.inertia)
        angle += STEP * speed
    angles, currents, torques = np.array(rows).T
    return angles, currents, torques


def _logged(
    machine: Machine, logger: Logger, channels: dict[str, np.ndarray], draw: np.random.Generator
) -> dict[str, np.ndarray]:
    every = round(1.0 / (logger.rate * STEP))
    seen = {name: values[::every].copy() for name, values in channels.items()}
    count = 2.0 * pi / logger.counts
    seen["angle_rad"] = count * np.round((seen["angle_rad"] + machine.zero) / count)
    for _ in range(logger.spikes):
        seen["angle_rad"][draw.integers(50, len(seen["angle_rad"]) - 50)] += 0.4
    seen["current_A"] += logger.current_noise * draw.standard_normal(len(seen["current_A"]))
    if "cell_Nm" in seen:
        noise = logger.cell_noise * draw.standard_normal(len(seen["cell_Nm"]))
        seen["cell_Nm"] = machine.cell_factor * seen["cell_Nm"] + machine.cell_offset + noise
    return {"t_s": np.arange(len(seen["angle_rad"])) / logger.rate, **seen}


def _sweep(time: np.ndarray, amplitude: float, frequency: float) -> np.ndarray:
    begun = np.clip((time - 0.3) / 0.5, 0.0, 1.0)
    return amplitude * begun**2 * (3.0 - 2.0 * begun) * np.sin(2.0 * pi * frequency * (time - 0.3))


def hung_weight(machine: Machine, logger: Logger, seed: int) -> dict[str, dict[str, np.ndarray]]:
    """A slow sweep by the servo for each weight."""
    draw, found = np.random.default_rng([seed, 1]), {}
    for k, hung in enumerate(WEIGHTS):
        time = STEP * np.arange(round(8.0 / STEP))
        weight = np.full(len(time), hung) * np.clip(time / 0.2, 0.0, 1.0)
        angle, current, _ = _run(machine, _sweep(time, 0.8, 0.25), 0.0 * time, weight)
        channels = {"angle_rad": angle, "current_A": current, "weight_Nm": weight}
        found[f"weight_{k}"] = _logged(machine, logger, channels, draw)
    return found


def load_cell(machine: Machine, logger: Logger, seed: int) -> dict[str, dict[str, np.ndarray]]:
    """Sweeps at several rates with a cell between output and ground."""
    draw, found = np.random.default_rng([seed, 2]), {}
    for frequency, seconds in ((0.25, 8.0), (1.0, 4.0), (5.0, 3.0)):
        time = STEP * np.arange(round(seconds / STEP))
        amplitude = 0.85 if frequency < 3.0 else 0.4
        angle, current, torque = _run(machine, _sweep(time, amplitude, frequency), 0.0 * time, 0.0 * time)
        channels = {"angle_rad": angle, "current_A": current, "cell_Nm": torque}
        found[f"sweep_{frequency:g}Hz"] = _logged(machine, logger, channels, draw)
    return found


def free_run(machine: Machine, logger: Logger, seed: int) -> dict[str, dict[str, np.ndarray]]:
    """Steps of current and coasting, to both sides, the spring taken off."""
    draw = np.random.default_rng([seed, 3])
    time = STEP * np.arange(round(9.0 / STEP))
    levels = (0.0, 0.4, 0.0, -0.5, 0.0, 0.25, -0.25, 0.5, 0.0)
    current = np.array([levels[min(int(t), len(levels) - 1)] for t in time])
    angle, driven, _ = _run(machine, None, current, 0.0 * time, spring=False)
    return {"steps": _logged(machine, logger, {"angle_rad": angle, "current_A": driven}, draw)}


def write_calibration_records(
    folder: Path, records: dict[str, dict[str, np.ndarray]], signals: dict[str, str]
) -> Path:
    """Write CSVs and a `records.toml` that maps their heads to signals."""
    folder.mkdir(parents=True, exist_ok=True)
    units = {"angle_rad": "rad", "current_A": "A", "weight_Nm": "N*m", "cell_Nm": "N*m"}
    for name, table in records.items():
        rows = np.array(list(table.values())).T
        np.savetxt(
            folder / f"{name}.csv", rows, fmt="%.7g", delimiter=",", header=",".join(table), comments=""
        )
    heads = [head for head in next(iter(records.values())) if head != "t_s"]
    text = "\n".join(f'[columns.{h}]\nsignal = "{signals[h]}"\nunit = "{units[h]}"\n' for h in heads)
    (folder / "records.toml").write_text(text, encoding="utf-8")
    return folder


def drawn_machine(seed: int) -> Machine:
    """A machine whose numbers deviate as the deck of the published actuator declares."""
    draw = np.random.default_rng([seed, 0])

    def around(value: float, spread: float) -> float:
        return float(value * np.exp(np.log1p(spread) * draw.standard_normal()))

    usual = Machine()
    return replace(
        usual,
        inertia=around(usual.inertia, 0.1),
        torque_constant=around(usual.torque_constant, 0.1),
        damping=around(usual.damping, 0.6),
        friction=around(usual.friction, 0.6),
        lever=around(1.0, 0.02),
        area=around(usual.area, 0.05),
        length=around(usual.length, 0.04),
        stiff=tuple(around(m, 0.1) for m in usual.stiff),
        strains=(usual.strains[0], *(around(e, 0.1) for e in usual.strains[1:])),
        modulus=around(usual.modulus, 0.1),
        viscosity=around(usual.viscosity, 0.3),
        zero=5e-3 * draw.standard_normal(),
        weight_factor=1.0 + 3e-3 * draw.standard_normal(),
        cell_factor=1.0 + 5e-3 * draw.standard_normal(),
    )
