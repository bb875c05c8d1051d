"""Each effect is asked of each kind of machine: where it is offered, cannot be, or is still wanted."""

from __future__ import annotations

from functools import cache
from pathlib import Path

import pytest

from nlsdesign.bench.discrepancy.effects import ALL, Effect
from nlsdesign.bench.discrepancy.effects.places import effort_over_motion
from nlsdesign.components import Assembly, Tie
from nlsdesign.components.assembly.deck_writer import declare
from nlsdesign.foundation.deck import load_deck, read_deck
from nlsdesign.model import flatten
from tests.rig.kind_cases import ALL_KINDS, names_of
from tests.rig.kind_decks import deck_of
from tests.rig.kinds import KINDS
from tests.rig.specimens import strip_deck

COLUMNS = (
    "cam", "elastic_joint", "geared_joint", "direct_drive", "belt_axis", "screw_carriage", "rack_carriage",
    "specimen",
)  # fmt: skip
TABLE = """
    viscous_friction            .  x  x  x  x  x  x  .
    coulomb_friction            x  x  x  x  x  x  x  x
    stribeck_friction           x  x  x  x  x  x  x  x
    load_dependent_friction     x  x  x  .  x  .  x  x
    quadratic_drag              x  x  x  x  x  x  x  x
    position_dependent_friction x  x  x  x  x  x  x  .
    asymmetric_friction         .  .  .  .  .  .  .  .
    torque_ripple               x  x  x  x  x  x  x  .
    backlash                    x  x  x  x  x  x  x  .
    drivetrain_resonance        x  x  x  x  x  x  x  .
    spring_damping              .  x  .  .  x  .  x  .
    constant_torque             x  x  x  x  x  .  x  .
    constant_force              .  .  .  .  .  x  x  .
    gravity_load                x  x  x  x  x  .  x  .
    torque_constant_saturation  x  x  x  x  x  x  x  .
    drive_delay                 x  x  x  x  x  x  x  .
    command_compression         x  x  x  x  x  x  x  .
    winding_heat                x  x  x  x  x  x  x  .
    torque_constant_drift       x  x  x  x  x  x  x  .
    current_sensor_bias         x  x  x  x  x  .  x  .
    angle_sensor_bias           .  x  .  .  x  .  x  .
    angle_sensor_delay          .  x  .  .  x  .  x  .
    angle_sensor_eccentricity   x  x  x  x  x  .  x  .
    clock_drift                 x  x  x  x  x  .  x  x
    force_sensor_bias           x  .  .  .  .  .  .  x
    force_sensor_gain           x  .  .  .  .  .  .  x
    force_sensor_delay          x  .  .  .  .  .  .  x
    force_sensor_drift          x  .  .  .  .  .  .  x
    force_sensor_nonlinearity   x  .  .  .  .  .  .  x
    cable_compliance            x  .  .  .  .  .  .  .
    cable_friction              x  .  .  .  .  .  .  .
    cable_slack                 x  .  .  .  .  .  .  x
    cam_angle_offset            x  .  .  .  .  .  .  .
    cam_profile_error           x  .  .  .  .  .  .  .
    second_relaxation           x  x  .  .  x  .  x  x
    rate_independent_hysteresis x  x  .  .  x  .  x  x
    soft_windup                 .  x  .  .  x  .  x  .
    strain_stiffening           x  x  .  .  x  .  x  x
    stress_softening            x  x  .  .  x  .  x  x
    permanent_set               x  .  .  .  .  .  x  x
    self_heating                x  x  .  .  x  .  x  x
"""
"""``x`` is offered, ``.`` has nothing there to sit on.

On machines whose parts are all declared: an effect that a deck leaves out is asked of the deck without it,
``viscous_friction`` of one without a dashpot, ``spring_damping`` of one without a damper beside its spring.
"""
WHERE = {
    "coulomb_friction": {"elastic_joint": ("motor", "load"), "belt_axis": ("motor", "load")},
    "angle_sensor_eccentricity": {"elastic_joint": ("encoder", "load_encoder")},
    "load_dependent_friction": {"elastic_joint": ("spring", "arm"), "geared_joint": ("arm",)},
}
"""Roles of the parts at which an effect must be offered, where there are several."""
ROWS = {row[0]: row[1:] for line in TABLE.strip().splitlines() if (row := line.split())}

LEFT_OUT = frozenset({"viscous_friction", "spring_damping", "gravity_load"})


@cache
def machine(kind: str, without: str = "") -> Assembly:
    """What the makers of a kind declare, without what they left out."""
    if kind == "cam":
        return declare(load_deck("test_rig"))
    names = names_of(kind, 0)
    if kind == "specimen":
        return declare(read_deck(strip_deck(names), Path("specimen.toml")))
    given = KINDS[kind]
    return declare(read_deck(deck_of(given, (without,), names, given.logger), Path("kind.toml")))


def offered(effect: str, kind: str) -> list[str]:
    """Places at which an effect is offered."""
    row: Effect | None = next((row for row in ALL if row.identifier == effect), None)
    asked = machine(kind, effect if effect in LEFT_OUT else "")
    return [candidate.location for candidate in row(asked)] if row else []


@pytest.mark.parametrize("effect", ROWS)
def test_an_effect_is_offered_where_it_can_be(effect: str) -> None:
    for kind, cell in zip(COLUMNS, ROWS[effect], strict=True):
        places = offered(effect, kind)
        assert bool(places) == (cell == "x"), (effect, kind, places)
        roles = names_of(kind, 0) if kind != "cam" else {}
        for role in WHERE.get(effect, {}).get(kind, ()):
            assert roles[role] in {place.partition(".")[0] for place in places}, (effect, kind, role)


def test_the_table_has_every_effect_and_every_kind() -> None:
    assert {row.identifier for row in ALL} <= set(ROWS)
    own = {name for name in ALL_KINDS if not name.startswith("mujoco")}
    assert own | {"cam"} == set(COLUMNS)


def test_every_effect_of_a_case_is_one_of_the_table_or_said_to_be_in_no_list() -> None:
    alias = {
        "joint_coulomb_friction": "coulomb_friction",
        "joint_eccentricity": "angle_sensor_eccentricity",
        "soft_centre": "soft_windup",
    }
    for kind in KINDS.values():
        assert {alias.get(effect, effect) for effect in kind.effects} <= set(ROWS), kind.name
        assert not set(kind.not_listed) & set(ROWS), kind.name
        assert {effect for pair in kind.pairs for effect in pair} <= set(kind.effects), kind.name


@pytest.mark.parametrize("kind", ["elastic_joint", "rack_carriage"])
def test_within_a_gap_nothing_acts_between_two_bodies(kind: str) -> None:
    """A dashpot beside the spring is behind the gap too; no inertia lies between gap and spring."""
    names, row = names_of(kind, 0), next(row for row in ALL if row.identifier == "backlash")
    (candidate,) = (c for c in row(machine(kind)) if not c.strategy.takes_long)
    spring, place = names["spring"], "position" if kind == "rack_carriage" else "angle"
    assert (candidate.location, names["spring_damping"] in dict(candidate.assembly.parts)) == (spring, False)
    gap = candidate.assembly.quantities()[f"{spring}.gap"].number
    model, (effort, motion) = flatten(candidate.assembly), effort_over_motion(candidate.assembly, spring)

    def at(turn: float) -> tuple[float, float]:
        """Way and effort of the spring while the motor alone has turned, and both bodies move."""
        states = {v.name: 1.0 for v in model.states}
        states |= {
            f"{names['load']}.{place}": 0.0,
            f"{names['motor']}.angle": turn,
            f"{names['motor']}.speed": 2.0,
        }
        shown = model.evaluate([states[v.name] for v in model.states], [0.0] * len(model.inputs))
        return shown[motion], shown[effort]

    way = at(1.0)[0]
    (inside, nothing), (beyond, pull) = at(0.4 * gap / way), at(0.6 * gap / way)
    assert (inside, beyond) == pytest.approx((0.4 * gap, 0.6 * gap))
    assert abs(nothing) < 1e-3 * abs(pull)


def test_behind_the_play_of_a_gear_is_a_part_of_the_inertia_and_all_of_the_weight() -> None:
    """Nothing else is tied to the load; a body that a spring pulls at has its load behind the spring."""
    names, row = names_of("geared_joint", 0), next(row for row in ALL if row.identifier == "backlash")
    (candidate,) = row(machine("geared_joint"))
    assert (candidate.location, candidate.strategy.takes_long) == (names["motor"], True)
    load = "second_inertia"
    tied = {name: part.between for name, part in candidate.assembly.parts if isinstance(part, Tie)}
    assert tied == {
        names["bearing"]: (names["motor"],),
        names["arm"]: (load,),
        "shaft": (names["motor"], load),
    }
    whole, now = machine("geared_joint").quantities(), candidate.assembly.quantities()
    inertia = f"{names['motor']}.inertia"
    assert now[inertia].number + now[f"{load}.inertia"].number == pytest.approx(whole[inertia].number)
    springs = [c.location for c in row(machine("elastic_joint"))]
    assert springs == [names["spring"]] * 2
    assert not row(candidate.assembly), "a gear has play once"
