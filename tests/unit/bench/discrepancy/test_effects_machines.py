"""Effects of machines that are no actuators: a carriage on a guide, a strip in a tensile machine."""

from __future__ import annotations

from pathlib import Path

import pytest

from nlsdesign.bench.discrepancy.effects import (
    ALL,
    cable_slack,
    constant_force,
    coulomb_friction,
    load_dependent_friction,
    second_relaxation,
)
from nlsdesign.bench.discrepancy.selection.comparison import moved_numbers
from nlsdesign.components import (
    TRANSLATION,
    Assembly,
    Buckling,
    ConstantLoad,
    CoulombFriction,
    Dashpot,
    Driven,
    Fixed,
    FlowingChains,
    ForceSensor,
    LinearDrive,
    LinearElastic,
    LoadFriction,
    NeoHooke,
    specimen,
    tie,
)
from nlsdesign.components.assembly.deck_writer import deck_text, declare
from nlsdesign.components.assembly.named_parts import assembly
from nlsdesign.foundation.deck import load_deck, read_deck
from nlsdesign.model import flatten
from tests.effect_machines import KNOWN


def drive() -> Assembly:
    carriage = LinearDrive(mass=95.0, force_constant=35.0, voltage_limit=10.0)
    return assembly("drive", carriage=carriage, guide=tie(Dashpot(damping=200.0), "carriage"))


def strip(law: NeoHooke | LinearElastic) -> Assembly:
    return assembly(
        "strip",
        grip=Driven(domain=TRANSLATION),
        clamp=Fixed(domain=TRANSLATION),
        strip=tie(specimen(area=1e-5, rest_length=0.08, law=law), "grip", "clamp"),
        load_cell=ForceSensor(of="strip.force"),
    )


def test_what_acts_on_a_carriage_and_what_is_wrong_with_its_drive() -> None:
    assert {effect.__name__ for effect in ALL if effect(drive())} & KNOWN == {
        "coulomb_friction", "stribeck_friction", "quadratic_drag", "position_dependent_friction",
        "constant_force", "drive_delay", "torque_constant_saturation", "command_compression",
        "winding_heat", "torque_constant_drift", "backlash", "drivetrain_resonance", "torque_ripple",
    }  # fmt: skip


@pytest.mark.parametrize(
    ("effect", "kind", "body_force"),
    [(coulomb_friction, CoulombFriction, -3.0), (constant_force, ConstantLoad, -3.0)],
)
def test_the_force_on_a_carriage_is_the_stated_one(effect: object, kind: type, body_force: float) -> None:
    (found,) = effect(drive())  # type: ignore[operator]
    (number,) = found.unknowns
    model = flatten(found.assembly.with_values({number.name: 3.0}))
    (there,) = [p for _, p in found.assembly.parts if isinstance(getattr(p, "element", None), kind)]
    assert there.between == ("carriage",)
    moving = model.evaluate([0.0, 0.2])
    bare = flatten(drive()).evaluate([0.0, 0.2])
    change = 95.0 * (moving["carriage.acceleration"] - bare["carriage.acceleration"])
    assert change == pytest.approx(body_force)
    assert declare(read_deck(deck_text(found.assembly), Path("edited.toml"))) == found.assembly
    assert [c for c in effect(found.assembly) if c.location == "carriage"] == []  # type: ignore[operator]


def test_relaxation_at_large_stretch_is_offered_with_one_and_with_two_times() -> None:
    assert not any(
        isinstance(p, FlowingChains)
        for c in second_relaxation(strip(LinearElastic(modulus=1e5)))
        for _, p in c.assembly.walk()
    )
    offered = second_relaxation(strip(NeoHooke(shear_modulus=3e4)))
    counts = [sum(isinstance(p, FlowingChains) for _, p in c.assembly.walk()) for c in offered]
    assert sorted(counts) == [0, 1, 2]
    for found in offered:
        assert found.location == "strip"
        assert set(flatten(found.assembly).values) >= {u.name for u in found.unknowns}
        assert declare(read_deck(deck_text(found.assembly), Path("edited.toml"))) == found.assembly


def test_a_strip_that_buckles_is_read_outside() -> None:
    _, found = cable_slack(strip(NeoHooke(shear_modulus=3e4)))  # the other hangs slack in its grips
    element = found.assembly.element("strip")
    assert isinstance(element, Buckling)
    model = flatten(found.assembly)
    pushed = model.evaluate([], [-0.02, 0.0])
    pulled = model.evaluate([], [0.02, 0.0])
    assert pushed["load_cell.reading"] == pytest.approx(0.0, abs=1e-6)
    assert pulled["load_cell.reading"] == pytest.approx(
        flatten(strip(NeoHooke(shear_modulus=3e4))).evaluate([], [0.02, 0.0])["load_cell.reading"], abs=1e-6
    )
    assert cable_slack(found.assembly) == []


def test_a_strip_that_buckles_is_one_that_does_not_where_its_deciding_number_has_no_effect() -> None:
    """How sharp a corner is cannot tell whether it is there: at width zero a strip buckles most of all."""
    _, found = cable_slack(strip(NeoHooke(shear_modulus=3e4)))  # the other hangs slack in its grips
    (deciding,) = [u for u in found.unknowns if u.null is not None]
    without = flatten(found.assembly.with_values({deciding.name: deciding.null}))
    bare = flatten(strip(NeoHooke(shear_modulus=3e4)))
    for extension in (-0.02, -1e-6, 0.0, 0.02):
        assert without.evaluate([], [extension, 0.0])["load_cell.reading"] == pytest.approx(
            bare.evaluate([], [extension, 0.0])["load_cell.reading"], abs=1e-9
        )


def test_two_branches_of_one_law_keep_their_numbers_when_they_move() -> None:
    """Both branches hold the very same numbers; inside a wrapper each keeps its own."""
    (two,) = [c for c in second_relaxation(strip(NeoHooke(shear_modulus=3e4))) if len(c.unknowns) == 4]
    _, buckling = cable_slack(two.assembly)
    moved = moved_numbers(two.assembly, buckling.assembly)
    for unknown in two.unknowns:
        assert moved[unknown.name] == unknown.name.replace("strip.", "strip.piece.")


@pytest.mark.parametrize("name", ["xl330_pendulum", "dfki_pendulum"])
def test_a_weight_loads_what_carries_it_as_a_spring_does(name: str) -> None:
    servo = declare(load_deck(name))
    (candidate,) = load_dependent_friction(servo)
    assert candidate.location == "weight"
    assert isinstance(candidate.assembly.element("weight"), LoadFriction)
    # What has it is not offered it again.
    assert not load_dependent_friction(candidate.assembly)


def test_friction_of_a_load_that_never_changes_is_no_other_than_coulombs() -> None:
    load = tie(ConstantLoad(load=3.0), "carriage")
    assert not load_dependent_friction(drive().with_part("offset", load))
