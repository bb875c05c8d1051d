"""Machines in ordinary use for hours, as compiled code: what a monitor beside the observer sees.

`watched_bench.c` holds plant and loop; this module gives it the numbers of the published actuator and of an
elastic joint with dry friction, and compiles it together with whatever looks at the readings.
"""

from __future__ import annotations

import subprocess
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path

import numpy as np

from nlsdesign.export.c.watch_code import WatchSource
from tests.compiling import compile_program
from tests.rig.bench import CAM_GRID, SERVO_BANDWIDTH, SERVO_DAMPING, _cam_tables
from tests.rig.kind_decks import NAMES, deck_of
from tests.rig.kinds import ELASTIC_JOINT
from tests.rig.published import PUBLISHED

HERE = Path(__file__).parent / "rig"
NUMBERS = (
    "friction",
    "stiffness",
    "inertia",
    "damping",
    "torque",
    "relaxation",
    "weight",
    "load_friction",
    "offset",
    "delay",
)
"""What can be changed: factors up to the weight, then sizes."""
_LOWEST, _GRID, _ROWS = -0.01, 1e-5, 4001
JOINT_FRICTION = 0.6  # N·m
PUBLISHED_FRICTION = 0.02  # N·m


def values(**changed: float) -> list[float]:
    """Return the numbers of a machine in the order of `NUMBERS`; what is not given is as declared."""
    return [changed.get(name, 1.0 if i < 7 else 0.0) for i, name in enumerate(NUMBERS)]


def _rows(name: str, numbers: Sequence[float]) -> str:
    return f"static const double {name}[] = {{{', '.join(f'{v:.17g}' for v in numbers)}}};"


def _defined(**numbers: float) -> list[str]:
    return [f"#define {name} {value:.17g}" for name, value in numbers.items()]


def published_machine() -> str:
    """Return the header of the published actuator: 1 kHz, 13 bit."""
    drive, rubber = PUBLISHED.drivetrain, PUBLISHED.rubber
    gain = drive.inertia * SERVO_BANDWIDTH / drive.torque_per_ampere
    extension, lever_arm = _cam_tables(PUBLISHED.cam, 0.0)
    force = rubber.equilibrium(_LOWEST + _GRID * np.arange(_ROWS))
    lines = _defined(
        CAM=1,
        RATE=1000.0,
        STEP=2e-4,
        CAM_GRID=CAM_GRID,
        LOWEST=_LOWEST,
        GRID=_GRID,
        COUNT=7.67e-4,
        LOAD_COUNT=1.0,
        RELAXATION_TIME=rubber.relaxation_time,
        BRANCH=rubber.shape * rubber.k,
        MOTOR_INERTIA=drive.inertia,
        VISCOUS=drive.viscosity,
        SLIDING=PUBLISHED_FRICTION,
        PER_AMPERE=drive.torque_per_ampere,
        LIMIT=20.0,
        CURRENT_NOISE=PUBLISHED.sensors.current_noise,
        PROPORTIONAL=gain * SERVO_BANDWIDTH,
        DERIVATIVE=2.0 * SERVO_DAMPING * gain,
        INTEGRAL=15.0 * gain * SERVO_BANDWIDTH,
        FEED=0.0,
        REACH=0.85,
        SHORTEST=0.4,
    )
    tables = {"extension": extension, "lever_arm": lever_arm, "equilibrium": force.tolist()}
    return "\n".join([*lines, *(_rows(name, row) for name, row in tables.items()), ""])


def joint_machine() -> str:
    """Return the header of the elastic joint with dry friction: 500 Hz, encoders on both sides."""
    plant, loop, logger = ELASTIC_JOINT.plant, ELASTIC_JOINT.controller(1.0), ELASTIC_JOINT.logger
    return (
        "\n".join(
            _defined(
                CAM=0,
                RATE=loop.rate,
                STEP=4e-4,
                COUNT=logger.quantum,
                LOAD_COUNT=logger.load_quantum,
                MOTOR_INERTIA=plant.inertia,
                VISCOUS=plant.damping,
                SLIDING=JOINT_FRICTION,
                PER_AMPERE=plant.effort_per_ampere,
                LOAD_INERTIA=plant.load_inertia,
                LOAD_VISCOUS=plant.load_damping,
                STIFF=plant.stiffness,
                SPRING_VISCOUS=plant.spring_damping,
                HEAVY=plant.weight,
                LIMIT=loop.limit,
                CURRENT_NOISE=logger.current_noise,
                PROPORTIONAL=loop.proportional,
                DERIVATIVE=loop.derivative,
                INTEGRAL=loop.integral,
                FEED=loop.feed,
                REACH=1.0,
                SHORTEST=0.5,
            )
        )
        + "\n"
    )


def joint_deck() -> str:
    """Return what the makers of the joint declare, its friction too."""
    friction = f'value = {JOINT_FRICTION}, unit = "N*m", source = "declared by its makers", spread = 0.3'
    creep = 'value = 0.002, unit = "rad/s", source = "assumed: some counts per sample"'
    return deck_of(ELASTIC_JOINT, (), NAMES[0], ELASTIC_JOINT.logger) + (
        '\n[dry_friction]\ncomponent = "CoulombFriction"\nbetween = ["motor"]\n'
        f"sliding_effort = {{{friction}}}\n"
        f"creep_speed = {{{creep}}}\n"
    )


MACHINES = {"published": published_machine, "joint": joint_machine}


def build(
    machine: str, folder: Path, *, look: Path = HERE / "watched_record.c", code: Sequence[Path] = ()
) -> Path:
    """Compile a machine with what looks at its readings, and the C that this calls; return the program."""
    folder.mkdir(parents=True, exist_ok=True)
    (folder / "machine.h").write_text(MACHINES[machine](), encoding="utf-8")
    return compile_program(
        [HERE / "watched_bench.c", look, *code], folder / machine, flags=["-I", str(folder)]
    )


_SHOWN = {"motor_encoder.reading": "motor", "encoder.reading": "motor", "load_encoder.reading": "load"}


def build_watched(machine: str, source: WatchSource) -> Path:
    """Compile a machine with its monitor beside the loop; the program lies beside the C of the monitor."""
    folder, writer = source.header.parent, source.residuals.writer
    lines = ['#include "watch.h"', f"#define COMPARED {len(source.plan.blocks)}"]
    wires = [f"inputs.{path} = read->{_SHOWN.get(v.name, 'current')};"
             for v, path in zip(writer.model.inputs, writer.paths.inputs, strict=True)]  # fmt: skip
    lines += [f"#define NUMBER {source.real}", "#define TAKE_READINGS " + " ".join(wires), ""]
    (folder / "watched_names.h").write_text("\n".join(lines), encoding="utf-8")
    return build(machine, folder, look=HERE / "watched_look.c", code=[source.source, source.residuals.source])


@dataclass(frozen=True)
class Use:
    """What a monitor said in use: time of the first word that says so, words that newly did, and the last
    one."""

    first: float  # s, infinite where there was none
    bits: int  # of that word
    alarms: int
    judged: int
    usable: float  # share of the judgements that had enough evidence


def use(
    program: Path,
    seed: int,
    seconds: float,
    *,
    change_at: float = 1e12,
    built: Mapping[str, float] | None = None,
    after: Mapping[str, float] | None = None,
    commission_at: float = 0.0,
    record: Path | None = None,
    current: tuple[int, float, float, int] | None = None,
) -> Use:
    """Let a machine be used; what is not given of the machine is as declared, or as built.

    A current that is given in place of the loop: which, its size in A, its frequency in Hz, whether it is
    not held.
    """
    first = dict(built or {})
    numbers = [*values(**first), *values(**first | dict(after or {}))]
    command = [str(program), str(seed), str(seconds), str(change_at), *map(repr, numbers), str(commission_at)]
    done = subprocess.run(
        [*command, str(record or ""), *map(str, current or ())],
        capture_output=True,
        text=True,
        check=True,
        timeout=36000,
    )
    time, bits, alarms, judged, usable = done.stdout.split()
    return Use(float(time), int(bits, 16), int(alarms), int(judged), int(usable) / max(int(judged), 1))
