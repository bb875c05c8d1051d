"""Cases of the score: which effects are hidden in which records of which machine, drawn from which seed."""

from __future__ import annotations

from collections import Counter
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass
from itertools import cycle, islice, zip_longest

import numpy as np

from nlsdesign.bench.discrepancy.effects import ALL
from tests.rig import ACTUATORS, COUNTS, EFFECTS, LATER_EFFECTS, OUTSIDE_ANY_CATALOGUE, Conditions
from tests.rig.machines import MACHINES

CATALOGUE = frozenset(effect.__name__ for effect in ALL)
PAIRS = (
    ("coulomb_friction", "second_relaxation"),
    ("torque_ripple", "cable_compliance"),
    ("stribeck_friction", "rate_independent_hysteresis"),
    ("backlash", "force_sensor_delay"),
    ("load_dependent_friction", "second_relaxation"),
    ("coulomb_friction", "cable_slack"),
    ("torque_constant_saturation", "force_sensor_bias"),
    ("drive_delay", "rate_independent_hysteresis"),
    ("quadratic_drag", "strain_stiffening"),
    ("cable_friction", "second_relaxation"),
    ("coulomb_friction", "stress_softening"),
    ("current_sensor_bias", "self_heating"),
)
TRIPLES = (
    ("coulomb_friction", "second_relaxation", "force_sensor_bias"),
    ("torque_ripple", "rate_independent_hysteresis", "force_sensor_gain"),
    ("coulomb_friction", "cable_compliance", "current_sensor_bias"),
    ("stribeck_friction", "second_relaxation", "torque_ripple"),
    ("backlash", "second_relaxation", "force_sensor_bias"),
    ("quadratic_drag", "cable_slack", "force_sensor_delay"),
    ("load_dependent_friction", "strain_stiffening", "torque_ripple"),
    ("drive_delay", "coulomb_friction", "stress_softening"),
)
ACCEPTED: Mapping[str, frozenset[str]] = {
    "rubbing_spot": frozenset({"position_dependent_friction"}),
    "winding_heat": frozenset({"winding_heat", "torque_constant_drift"}),
    "sensor_lowpass": frozenset({"force_sensor_delay"}),
    "constant_torque": frozenset({"constant_torque", "constant_force", "current_sensor_bias"}),
    "constant_force": frozenset({"constant_torque", "constant_force", "current_sensor_bias"}),
    "current_sensor_bias": frozenset({"current_sensor_bias", "constant_torque", "constant_force"}),
    "joint_coulomb_friction": frozenset({"coulomb_friction@load"}),
    "soft_centre": frozenset({"soft_windup"}),
    "gravity_load": frozenset({"gravity_load@load"}),
    "angle_sensor_bias": frozenset({"angle_sensor_bias@load"}),
    "angle_sensor_delay": frozenset({"angle_sensor_delay@load"}),
    "joint_eccentricity": frozenset({"angle_sensor_eccentricity@load"}),
    "drivetrain_resonance": frozenset({"drivetrain_resonance@load"}),
}
"""Names that describe a hidden thing truly although they are not its own: equal laws, or a wider one.

``@load`` marks what was found behind the spring of a machine with two bodies.
"""
NOISES: Mapping[str, Conditions] = {
    "white": Conditions(),
    "coloured": Conditions(coloured=1.5),
    "flicker": Conditions(flicker=1.5),
    "spikes": Conditions(spikes=3),
    **{f"counts {n}": Conditions(counts=n) for n in COUNTS},
}
STRONG, HALF = 1.0, 0.5
TIERS = (
    "single", "single half", "pair", "pair half", "triple", "triple half",
    "clean white", "clean coloured", "clean flicker", "clean coarse", "clean spikes",
    "disturbed", "three records", "wrong number", "outside", "machine", "machine half", "machine clean",
)  # fmt: skip
"""
``disturbed`` hides one effect in records with coloured noise, spikes or coarse counts; ``three records``
leaves two to fit; ``wrong number`` hides nothing, one declared number is wrong; ``machine`` and the like
have no cam.
"""

KIND_TIERS = ("kind clean", "kind single", "kind single half", "kind pair", "kind not listed")
"""Tiers of the machines under a digital loop, kind by kind."""


@dataclass(frozen=True)
class Case:
    """One set of records to diagnose.

    Parameters
    ----------
    tier
        One of :data:`TIERS` or :data:`KIND_TIERS`.
    machine
        Name of the rig's machine, or of a kind.
    effects
        What is hidden.
    strength
        Of all that is hidden.
    seed
        Of the rig.
    noise
        Name in :data:`NOISES`, or a condition of a kind.
    """

    tier: str
    machine: str
    effects: tuple[str, ...]
    strength: float
    seed: int
    noise: str = "white"

    @property
    def name(self) -> str:
        """Unique name, by which a run goes on where it was interrupted."""
        hidden = "+".join(self.effects) or "nothing"
        noise = "" if self.noise in ("white", "plain") else self.noise
        return ":".join(
            filter(None, [self.tier, hidden, f"{self.strength:g}", noise, self.machine, str(self.seed)])
        )

    @property
    def hidden(self) -> Mapping[str, float]:
        """What the rig hides, and how strong."""
        return {effect: self.strength for effect in self.effects}


def known_effects() -> tuple[str, ...]:
    """Return what the rig can hide behind a cam and the catalogue knows."""
    return tuple(e for e in (*EFFECTS, *LATER_EFFECTS) if e in CATALOGUE)


def cases(seeds: Sequence[int], tiers: Sequence[str] = TIERS) -> list[Case]:
    """Return every case of some seeds; machine, pair, triple and noise change from case to case.

    Parameters
    ----------
    seeds
        Each gives every effect at two strengths on one machine each, and some of every other tier.
    tiers
        Some of :data:`TIERS`.
    """
    return [case for seed in seeds for case in _of_seed(seed) if case.tier in tiers]


def _of_seed(seed: int) -> Iterator[Case]:
    known, actuators = known_effects(), list(ACTUATORS)
    noises = [n for n in NOISES if n != "white"]

    def actuator(number: int) -> str:
        return actuators[(seed + number) % len(actuators)]

    def turn(options: Sequence[tuple[str, ...]], each: int) -> Iterator[tuple[str, ...]]:
        return islice(cycle(options), seed * each % len(options), seed * each % len(options) + each)

    for i, effect in enumerate(known):
        yield Case("single", actuator(i), (effect,), STRONG, seed)
        yield Case("single half", actuator(i + 1), (effect,), HALF, seed)
    for i, pair in enumerate(turn(PAIRS, 4)):
        yield Case("pair", actuator(i), pair, STRONG, seed)
        yield Case("pair half", actuator(i + 1), pair, HALF, seed)
    for i, triple in enumerate(turn(TRIPLES, 3)):
        yield Case("triple", actuator(i), triple, STRONG, seed)
        yield Case("triple half", actuator(i + 1), triple, HALF, seed)
    for i, noise in enumerate(NOISES):
        tier = "clean coarse" if noise.startswith("counts") else f"clean {noise}"
        yield Case(tier, actuator(i), (), 0.0, seed, noise)
    for i in range(6):
        effect = known[(6 * seed + i) % len(known)]
        yield Case("disturbed", actuator(i), (effect,), STRONG, seed, noises[i])
        effect = known[(6 * seed + i + 3) % len(known)]
        yield Case("three records", actuator(i), (effect,), STRONG, seed)
    yield Case("wrong number", actuator(0), (), 0.0, seed)
    for i, effect in enumerate(e for e in OUTSIDE_ANY_CATALOGUE if e not in CATALOGUE):
        yield Case("outside", actuator(i), (effect,), STRONG, seed)
    for machine in MACHINES.values():
        for effect in (e for e in machine.effects if e in CATALOGUE):
            yield Case("machine", machine.name, (effect,), STRONG, seed)
            yield Case("machine half", machine.name, (effect,), HALF, seed)
        yield Case("machine clean", machine.name, (), 0.0, seed)


def sample(pool: Sequence[Case], count: int) -> list[Case]:
    """Return so many cases, spread evenly over tiers and kinds, in each over what is hidden; always the same.

    Parameters
    ----------
    pool
        To draw from.
    count
        How many; more than there are give all.
    """
    draw = np.random.default_rng(2026)
    queues = []
    groups = [
        (case.tier, case.machine if case.tier in KIND_TIERS and case.machine not in ACTUATORS else "")
        for case in pool
    ]
    for group in dict.fromkeys(groups):
        own = [case for case, of in zip(pool, groups, strict=True) if of == group]
        times: Counter[tuple[str, ...]] = Counter()
        ranked = []
        for i in draw.permutation(len(own)):
            times[own[i].effects] += 1
            ranked.append((times[own[i].effects], own[i]))
        # What this tier has hidden less often comes first.
        queues.append([case for _, case in sorted(ranked, key=lambda row: row[0])])
    spread = [case for row in zip_longest(*queues) for case in row if case is not None]
    return spread[:count]
