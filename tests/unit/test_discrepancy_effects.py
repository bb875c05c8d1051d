"""The catalogue: each effect edits an assembly as it says, and only where it can sit."""

from __future__ import annotations

from pathlib import Path

import pytest

from nlsdesign.components import (
    Assembly,
    Inertia,
    Spring,
    TorqueSensor,
    TorsionSpring,
    assembly,
    parallel,
    tie,
)
from nlsdesign.components.declare import deck_text, declare
from nlsdesign.deck import load_deck, read_deck
from nlsdesign.discrepancy.effects import ALL, Candidate, Effect, Unknown, wrapped
from nlsdesign.discrepancy.effects.cable import stretched
from nlsdesign.model import flatten

CATALOGUE = [
    "coulomb_friction",
    "stribeck_friction",
    "load_dependent_friction",
    "quadratic_drag",
    "torque_ripple",
    "backlash",
    "drive_delay",
    "current_sensor_bias",
    "torque_constant_saturation",
    "cable_compliance",
    "cable_slack",
    "cable_friction",
    "cam_angle_offset",
    "cam_profile_error",
    "second_relaxation",
    "rate_independent_hysteresis",
    "stress_softening",
    "self_heating",
    "permanent_set",
    "strain_stiffening",
    "force_sensor_bias",
    "force_sensor_gain",
    "force_sensor_delay",
    "force_sensor_drift",
    "angle_sensor_eccentricity",
]


@pytest.fixture(scope="module")
def rig() -> Assembly:
    return declare(load_deck("test_rig"))


def bare() -> Assembly:
    return assembly("swing", wheel=Inertia(inertia=1e-3), spring=tie(TorsionSpring(stiffness=2.0), "wheel"))


@pytest.mark.parametrize("effect", ALL, ids=lambda e: e.__name__)
def test_an_effect_is_a_whole_assembly_with_its_own_numbers(effect: Effect, rig: Assembly) -> None:
    declared = deck_text(rig)
    candidates = effect(rig)
    assert candidates
    for found in candidates:
        assert found.effect == effect.__name__
        assert found.effect in CATALOGUE
        assert found.signature
        assert found.source
        assert found.location in dict(rig.walk())
        numbers = flatten(found.assembly).values
        for unknown in found.unknowns:
            assert unknown.name in numbers
            assert all(unknown.lower <= start <= unknown.upper for start in unknown.starts)
        # The deck of the edited assembly is one that every command reads.
        text = deck_text(found.assembly)
        assert declare(read_deck(text, Path("edited.toml"))) == found.assembly
    assert deck_text(rig) == declared


@pytest.mark.parametrize("effect", ALL, ids=lambda e: e.__name__)
def test_an_effect_is_not_added_twice_at_the_same_place(effect: Effect, rig: Assembly) -> None:
    found, *_ = effect(rig)
    bent = {
        u.name: (2.0 if u.name.endswith(".gain") else 0.01)
        for u in found.unknowns
        if u.name in rig.quantities()
    }
    again = [c for c in effect(found.assembly.with_values(bent)) if c.location == found.location]
    if effect.__name__ == "torque_ripple":
        # A ripple may have several orders: the second is another part.
        assert {u.name for u in again[0].unknowns}.isdisjoint(u.name for u in found.unknowns)
    else:
        assert again == []


def test_effects_stay_away_from_what_cannot_have_them() -> None:
    able = {effect.__name__ for effect in ALL if effect(bare())}
    assert able == {
        "coulomb_friction", "stribeck_friction", "load_dependent_friction", "quadratic_drag", "torque_ripple", "backlash",  # noqa: E501
    }  # fmt: skip


def test_sensors_go_on_reading_what_they_read(rig: Assembly) -> None:
    model = flatten(rig)
    state = [0.4 if v.name == "motor.angle" else 0.0 for v in model.states]
    before = model.evaluate(state)["force_sensor.reading"]
    for effect in ALL:
        found, *_ = effect(rig)
        if found.effect in ("cam_angle_offset", "backlash", "load_dependent_friction"):
            neutral = {u.name: 0.0 for u in found.unknowns}
            edited = flatten(found.assembly.with_values(neutral))
            same = [0.4 if v.name == "motor.angle" else 0.0 for v in edited.states]
            assert edited.evaluate(same)["force_sensor.reading"] == pytest.approx(before, rel=1e-3)


def test_what_a_cam_stretches_is_found_inside_its_cable(rig: Assembly) -> None:
    assert stretched(rig) == ["spring.cable.rubber"]
    assert stretched(bare()) == []


def test_a_wrapper_takes_its_place_among_its_neighbours() -> None:
    both = parallel(left=TorsionSpring(stiffness=1.0), right=TorsionSpring(stiffness=2.0))
    declared = assembly(
        "two",
        wheel=Inertia(inertia=1e-3),
        spring=tie(both, "wheel"),
        cell=TorqueSensor(of="spring.left.torque"),
    )
    found = wrapped(declared, "spring.left", "pair", lambda name, old: parallel(**{name: old}))
    assert [path for path, _ in found.walk()][:5] == [
        "wheel",
        "spring",
        "spring.pair",
        "spring.pair.left",
        "spring.right",
    ]
    assert found.sensors()["cell"].of == "spring.pair.left.torque"


def test_a_user_adds_an_effect_with_one_function() -> None:
    def soft_mount(declared: Assembly) -> list[Candidate]:
        edited = declared.with_part("mount", tie(TorsionSpring(stiffness=1.0), "wheel"))
        return [
            Candidate("soft_mount", "wheel", edited, (Unknown("mount.stiffness", (1.0,), 0.1, 10.0),), "", "")
        ]

    effect: Effect = soft_mount
    (found,) = effect(bare())
    assert "mount.stiffness" in flatten(found.assembly).values
    assert isinstance(found.assembly.element("mount"), TorsionSpring)
    assert not isinstance(found.assembly.element("mount"), Spring)
