"""One function makes a case: a folder with `deck.toml`, `records.toml`, a CSV for each record, and the truth.

    python -m tests.rig.kind_cases geared_joint coulomb_friction 1.0 3 FOLDER [--condition coarse]

An effect is one name, several with a plus between them, or `nothing`.
"""

from __future__ import annotations

import argparse
import json
from collections.abc import Mapping
from dataclasses import asdict, dataclass, replace
from pathlib import Path

import numpy as np

from . import specimens
from .cascade import journeys
from .digital_loop import Logger, Loop, Ticks, logged, run
from .kind_decks import NAMES, SLIDE_SHARE, deck_of, mapping_of
from .kinds import COMMAND, KINDS, NOISE, Kind, built, stream, wanted
from .two_bodies import Missing, Plant, TwoBodies

CONDITIONS = ("plain", "coarse", "coloured", "slow", "averaged")
CASCADED = "cascaded"
"""A condition of the loop, not of the log: a robot's cascade goes from point to point."""
ALL_KINDS = (*KINDS, "specimen")
_STRIP_NAMES = (
    ("grip", "clamp", "strip", "load_cell"),
    ("crosshead", "foot", "band", "cell"),
    ("upper_jaw", "lower_jaw", "sample", "force_gauge"),
)


@dataclass(frozen=True)
class Truth:
    """What is behind the records of a case.

    Parameters
    ----------
    kind, effects, strength, seed, condition
        Of the case.
    sizes
        True size by effect and last name of its number in the package.
    numbers
        True values of declared numbers by their name in the deck.
    """

    kind: str
    effects: tuple[str, ...]
    strength: float
    seed: int
    condition: str
    sizes: Mapping[tuple[str, str], float]
    numbers: Mapping[str, float]


def write_kind_case(
    folder: Path, kind: str, effects: tuple[str, ...], strength: float, seed: int, *,
    condition: str = "plain", says_held: bool = False,
) -> Truth:  # fmt: skip
    """Write a case and return the truth behind it, which is written beside the records too.

    Parameters
    ----------
    folder
        Becomes the case.
    kind
        One of :data:`ALL_KINDS`.
    effects
        What is hidden; empty for a clean machine.
    strength
        Of all of them; 1 is the usual size.
    seed
        Fixes machine, names of parts, motion and noise.
    condition
        One of :data:`CONDITIONS`, or :data:`CASCADED`.
    says_held
        Whether `records.toml` says that the current is held from row to row, where it is.

    Raises
    ------
    ValueError
        If the kind has no such effect.
    """
    folder.mkdir(parents=True, exist_ok=True)
    if kind == "specimen":
        _write_strip(folder, effects, strength, seed, condition)
    else:
        told = says_held and condition not in ("slow", "averaged")
        _write_machine(folder, KINDS[kind], effects, strength, seed, condition, says_held=told)
    truth = truth_of(kind, effects, strength, seed, condition=condition)
    shown = asdict(truth) | {"sizes": {".".join(key): size for key, size in truth.sizes.items()}}
    (folder / "truth.json").write_text(json.dumps(shown, indent=1), encoding="utf-8")
    return truth


def _write_machine(
    folder: Path, kind: Kind, effects: tuple[str, ...], strength: float, seed: int, condition: str, *,
    says_held: bool,
) -> None:  # fmt: skip
    plant, missing = built(kind, effects, strength, seed)
    logger, names = conditioned(kind, condition), names_of(kind.name, seed)
    (folder / "deck.toml").write_text(deck_of(kind, effects, names, logger), encoding="utf-8")
    (folder / "records.toml").write_text(
        mapping_of(kind, names, logger, says_held=says_held), encoding="utf-8"
    )
    made = simulated(kind, plant, missing, seed, logger.quantum, cascaded=condition == CASCADED)
    for number, (name, ticks) in enumerate(made.items()):
        draw = stream(seed, NOISE, number)
        table = logged(ticks, logger, missing, draw, disc_on_motor=kind.sides == 1)
        if kind.radius:
            table[:, 1] /= kind.radius
        heads = ["time", "place", *(["load_place"] if kind.sides == 2 else []), "current"]
        _write_table(folder / f"{name}.csv", table, [names[head] for head in heads])


def names_of(kind: str, seed: int) -> Mapping[str, str]:
    """Return the names that the parts of a machine have in its deck, by what they are.

    Parameters
    ----------
    kind, seed
        Of the case.
    """
    if kind == "specimen":
        roles = ("grip", "clamp", "strip", "cell")
        return dict(zip(roles, _STRIP_NAMES[seed % len(_STRIP_NAMES)], strict=True))
    return NAMES[seed % len(NAMES)]


def truth_of(
    kind: str, effects: tuple[str, ...], strength: float, seed: int, *, condition: str = "plain"
) -> Truth:
    """Return what is behind the records of a case, without making them.

    Parameters
    ----------
    kind, effects, strength, seed, condition
        As of :func:`write_kind_case`.
    """
    names = names_of(kind, seed)
    if kind == "specimen":
        sizes, numbers = _of_strip(effects, strength, seed, names["strip"])
    else:
        plant, missing = built(KINDS[kind], effects, strength, seed)
        sizes, numbers = _sizes(plant, missing, effects), _numbers(KINDS[kind], plant, effects, names)
        if KINDS[kind].radius:
            # Friction of the motor may be stated in N·m or in N: only what has one unit has a true size.
            alike = ("drive_delay", "current_sensor_bias", "angle_sensor_delay", "spring_damping")
            sizes = {key: size for key, size in sizes.items() if key[0] in alike}
    return Truth(kind, effects, strength, seed, condition, sizes, numbers)


def simulated(
    kind: Kind, plant: Plant, missing: Missing, seed: int, counts: float, step: float | None = None,
    *, cascaded: bool = False,
) -> dict[str, Ticks]:  # fmt: skip
    """Return the true signals of every record.

    Parameters
    ----------
    kind, plant, missing, seed
        Of the case.
    counts
        Of the encoder that the loop reads.
    step
        Of the simulation, s; that of the simulator where nothing is given.
    cascaded
        Whether a robot's cascade goes from point to point, in place of the loop that tracks sines.
    """
    made, draw = {}, stream(seed, COMMAND)
    loop: Loop = kind.controller(counts)
    told = {} if cascaded else wanted(kind, draw)
    if cascaded:
        # The lag of the current loop stays within what two channels may be late without a fault.
        loop = kind.cascade(counts, draw.uniform(0.1, 0.4) / kind.rate)
        told = journeys(kind.sines[0][0], kind.multisine[-1], kind.rate, draw)
    for name, command in told.items():
        if kind.simulator == "mujoco":
            from .mujoco_machines import MujocoBodies

            world: TwoBodies | MujocoBodies = MujocoBodies(plant, missing)
        else:
            world = TwoBodies(plant, missing, step) if step else TwoBodies(plant, missing)
        made[name] = run(
            world, loop, command, plant.effort_per_ampere, missing,
            step=world.step, disc_on_motor=kind.sides == 1,
        )  # fmt: skip
    return made


def conditioned(kind: Kind, condition: str) -> Logger:
    """Return the sensors and the log of a machine under a condition.

    Parameters
    ----------
    kind
        Of the machine.
    condition
        One of :data:`CONDITIONS`.
    """
    logger = kind.logger
    if condition == "coarse":
        return replace(logger, quantum=kind.coarse, load_quantum=kind.coarse if kind.sides == 2 else 0.0)
    if condition == "coloured":
        return replace(logger, coloured=1.5)
    if condition == "averaged":
        return replace(logger, averaged=True)
    if condition == "slow":
        return replace(logger, every=max(round(kind.rate / 100.0), 1))
    return logger


def _sizes(plant: Plant, missing: Missing, effects: tuple[str, ...]) -> dict[tuple[str, str], float]:
    """Return true sizes; friction of both bodies at once has none, since its name does not say which."""
    frictions = (
        [missing.friction or missing.joint_friction] if missing.friction * missing.joint_friction == 0 else []
    )
    sizes = {
        ("stribeck_friction", "sliding_effort"): missing.friction,
        ("load_dependent_friction", "ratio"): missing.load_friction,
        ("quadratic_drag", "drag"): missing.drag,
        ("torque_ripple", "order"): missing.ripple_order,
        ("backlash", "gap"): missing.gap,
        ("drive_delay", "delay"): missing.drive_delay,
        ("current_sensor_bias", "bias"): missing.current_bias,
        ("constant_torque", "load"): -missing.constant_effort,
        ("constant_force", "load"): -missing.constant_effort,
        ("viscous_friction", "damping"): plant.damping,
        ("spring_damping", "damping"): plant.spring_damping,
        ("gravity_load", "horizontal_torque"): plant.weight,
        ("angle_sensor_bias", "bias"): missing.encoder_bias,
        ("angle_sensor_delay", "delay"): missing.encoder_delay,
    }
    found = {key: size for key, size in sizes.items() if key[0] in effects}
    if {"coulomb_friction", "joint_coulomb_friction"} & set(effects) and frictions:
        found[("coulomb_friction", "sliding_effort")] = frictions[0]
    return found


def _numbers(
    kind: Kind, plant: Plant, effects: tuple[str, ...], names: Mapping[str, str]
) -> dict[str, float]:
    """Return true values of what the deck declares, but for what a hidden coupling divides."""
    motor = names["motor"]
    if "screw" in kind.name:
        numbers = {
            f"{motor}.mass": plant.inertia,
            f"{motor}.force_constant": plant.effort_per_ampere,
            f"{names['bearing']}.damping": plant.damping,
        }
    elif kind.radius:
        turning = (1.0 - SLIDE_SHARE) * plant.inertia
        numbers = {
            f"{motor}.inertia": turning * kind.radius**2,
            f"{motor}.torque_constant": plant.effort_per_ampere * kind.radius,
            f"{names['bearing']}.damping": plant.damping,
            f"{names['load']}.mass": plant.load_inertia,
        }
    else:
        numbers = {
            f"{motor}.inertia": plant.inertia,
            f"{motor}.torque_constant": plant.effort_per_ampere / plant.gear_ratio,
            f"{names['bearing']}.damping": plant.damping,
            f"{names['arm']}.horizontal_torque": plant.weight,
        }
    if kind.sides == 2:
        numbers |= {
            f"{names['load']}.inertia": plant.load_inertia,
            f"{names['load_bearing']}.damping": plant.load_damping,
            f"{names['spring']}.stiffness": plant.stiffness,
            f"{names['spring_damping']}.damping": plant.spring_damping,
        }
    divided = {f"{motor}.inertia", f"{motor}.mass"} if kind.sides == 1 and plant.load_inertia else set()
    if "drivetrain_resonance" in effects and kind.sides == 2:
        divided = {f"{names['load']}.inertia", f"{names['load']}.mass"}
    return {name: value for name, value in numbers.items() if name not in divided}


def _write_table(file: Path, table: np.ndarray, heads: list[str]) -> None:
    np.savetxt(file, table, fmt="%.9g", delimiter=",", header=",".join(heads), comments="")


def _write_strip(folder: Path, effects: tuple[str, ...], strength: float, seed: int, condition: str) -> None:
    names = names_of("specimen", seed)
    strip, cell = names["strip"], names["cell"]
    (folder / "deck.toml").write_text(specimens.strip_deck(names), encoding="utf-8")
    quantum = 1e-4 if condition == "coarse" else specimens.QUANTUM
    (folder / "records.toml").write_text(
        f'[time]\ncolumn = "t"\nunit = "s"\n\n[columns.way]\nsignal = "{strip}.extension"\nunit = "m"\n'
        f'quantum = {quantum:g}\n\n[columns.pull]\nsignal = "{cell}.reading"\nunit = "N"\n',
        encoding="utf-8",
    )
    for name, table in specimens.strip_records(effects, strength, seed, condition).items():
        _write_table(folder / f"{name}.csv", table, ["t", "way", "pull"])


def _of_strip(
    effects: tuple[str, ...], strength: float, seed: int, strip: str
) -> tuple[dict[tuple[str, str], float], dict[str, float]]:
    plain, missing = specimens.built_strip(effects, strength, seed)
    sizes = {
        ("force_sensor_bias", "bias"): missing.bias,
        ("force_sensor_delay", "delay"): missing.delay,
        ("force_sensor_drift", "drift"): missing.drift,
        ("coulomb_friction", "sliding_effort"): missing.grip_friction,
        ("second_relaxation", "modulus"): missing.second,
    }
    numbers = {
        f"{strip}.elastic.modulus": plain.modulus,
        f"{strip}.relaxing.spring.modulus": plain.branch,
        f"{strip}.relaxing.dashpot.viscosity": plain.viscosity,
    }
    return {key: size for key, size in sizes.items() if key[0] in effects}, numbers


def main() -> None:
    """Write one case."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawTextHelpFormatter)
    parser.add_argument("kind", choices=ALL_KINDS)
    parser.add_argument("effect")
    parser.add_argument("strength", type=float)
    parser.add_argument("seed", type=int)
    parser.add_argument("folder", type=Path)
    parser.add_argument("--condition", choices=(*CONDITIONS, CASCADED), default="plain")
    parser.add_argument("--says-held", action="store_true", help='write between_samples = "held"')
    given = parser.parse_args()
    effects = () if given.effect == "nothing" else tuple(given.effect.split("+"))
    truth = write_kind_case(
        given.folder, given.kind, effects, given.strength, given.seed,
        condition=given.condition, says_held=given.says_held,
    )  # fmt: skip
    print(truth)


if __name__ == "__main__":
    main()
