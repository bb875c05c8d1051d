"""Cases of the score: which effects are hidden in the records of which actuator, drawn from which seed."""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass

from tests.rig import ACTUATORS, EFFECTS, OUTSIDE_ANY_CATALOGUE, STRENGTHS

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
KINDS = ("single", "clean", "outside", "pair")


@dataclass(frozen=True)
class Case:
    """One set of records to diagnose.

    Parameters
    ----------
    kind
        ``single``, ``pair``, ``clean`` or ``outside``.
    actuator
        Name of the rig's actuator.
    effects
        What is hidden.
    strength
        Word of :data:`tests.rig.STRENGTHS`; clean sets have none.
    seed
        Of the rig.
    """

    kind: str
    actuator: str
    effects: tuple[str, ...]
    strength: str
    seed: int

    @property
    def name(self) -> str:
        """Unique name, by which a run goes on where it was interrupted."""
        hidden = "+".join(self.effects) or "clean"
        return ":".join(filter(None, [hidden, self.strength, self.actuator, str(self.seed)]))

    @property
    def hidden(self) -> Mapping[str, float]:
        """What the rig is told to hide."""
        return {effect: STRENGTHS[self.strength] for effect in self.effects}


def cases(
    seeds: Sequence[int], *, strengths: Sequence[str] = tuple(STRENGTHS), kinds: Sequence[str] = KINDS
) -> list[Case]:
    """Return every case of some seeds; from case to case the actuator changes, and the pair with the seed.

    Parameters
    ----------
    seeds
        Each gives every effect at every strength; of each of the other kinds, one case per strength.
    strengths
        Words of :data:`tests.rig.STRENGTHS`.
    kinds
        Some of :data:`KINDS`.
    """
    found = [case for seed in seeds for case in _of_seed(seed, strengths)]
    return [case for case in found if case.kind in kinds]


def _of_seed(seed: int, strengths: Sequence[str]) -> Iterator[Case]:
    actuators = list(ACTUATORS)
    singles = [e for e in EFFECTS if e != "none"]
    for s, strength in enumerate(strengths):
        turn = seed * len(strengths) + s
        for i, effect in enumerate(singles):
            yield Case("single", actuators[(turn + i) % 2], (effect,), strength, seed)
        yield Case("clean", actuators[turn % 2], (), "", seed) if s < 2 else _nothing(seed)
        outside = OUTSIDE_ANY_CATALOGUE[turn % len(OUTSIDE_ANY_CATALOGUE)]
        yield Case("outside", actuators[(turn + 1) % 2], (outside,), strength, seed)
        yield Case("pair", actuators[turn % 2], PAIRS[turn % len(PAIRS)], strength, seed)


def _nothing(seed: int) -> Case:
    raise ValueError(f"seed {seed}: more than two strengths need more than two actuators for clean sets")


def sample(seeds: Sequence[int], strength: str, others: int) -> list[Case]:
    """Return each effect once, and so many cases of each other kind, spread over seeds and actuators.

    Parameters
    ----------
    seeds
        Used in turn.
    strength
        Of everything that is hidden.
    others
        Number of clean sets, of sets with an effect outside the catalogue, and of pairs.
    """
    actuators = list(ACTUATORS)
    chosen = [("single", (effect,)) for effect in EFFECTS if effect != "none"]
    # The other kinds stand in between, so that a run that is broken off has some of each.
    apart = max(len(chosen) // (others + 1), 1)
    for i in reversed(range(others)):
        outside = (OUTSIDE_ANY_CATALOGUE[i % len(OUTSIDE_ANY_CATALOGUE)],)
        place = (i + 1) * apart
        chosen[place:place] = [("clean", ()), ("outside", outside), ("pair", PAIRS[i % len(PAIRS)])]
    found, n, clean = [], len(seeds), 0
    for i, (kind, effects) in enumerate(chosen):
        k = i if effects else clean
        clean += not effects
        actuator = actuators[(k + (k // n if n % 2 == 0 else 0)) % 2]
        found.append(Case(kind, actuator, effects, strength if effects else "", seeds[k % n]))
    return found
