"""Which friction it is: Coulomb's, one that falls with speed, grows with load, or has a place."""

from __future__ import annotations

import math
from pathlib import Path

import pytest

import nlsdesign as nls
from nlsdesign.bench.discrepancy import Verdict, diagnose
from nlsdesign.bench.discrepancy.effects.friction import with_resolved_signs
from nlsdesign.components import CoulombFriction, tie
from tests.effect_machines import joint, wheels
from tests.hand_machines import Level, Machine, made

_FRICTIONS = [
    nls.effects.coulomb_friction,
    nls.effects.stribeck_friction,
    nls.effects.load_dependent_friction,
    nls.effects.position_dependent_friction,
]


def named(machine: Machine, folder: Path) -> Verdict:
    return diagnose(*made(machine, folder, records=2), catalogue=_FRICTIONS)


def falling(rate: float, angle: float, load: float) -> float:
    return 0.1 + 0.1 * math.exp(-((rate / 0.1) ** 2))


@pytest.mark.long_cases("motor")
@pytest.mark.parametrize("body", ["motor", pytest.param("joint", marks=pytest.mark.slow)])
def test_sharp_friction_in_slow_motion_is_coulombs(body: str, tmp_path: Path) -> None:
    """A sign that is rounded more than the records resolve is sharpened by a Stribeck speed below it."""
    level: Level = lambda rate, angle, load: 0.12  # noqa: E731
    fields = {"friction": level} if body == "motor" else {"joint_friction": level}
    found = named(Machine(stiffness=60.0, weight=1.0, size=0.15, quickest=0.4, **fields), tmp_path)  # type: ignore[arg-type]
    (effect,) = found.effects
    assert (effect.name, effect.location) == ("coulomb_friction", body)
    ((_, (value, _, error)),) = effect.parameters.items()
    assert value == pytest.approx(0.12, abs=max(4.0 * error, 4e-4))
    assert found.complete


@pytest.mark.slow
def test_friction_that_falls_with_speed_keeps_its_numbers(tmp_path: Path) -> None:
    found = named(Machine(friction=falling, size=0.25, quickest=0.5), tmp_path)
    (effect,) = found.effects
    assert effect.name == "stribeck_friction"
    assert [value for value, _, _ in effect.parameters.values()] == pytest.approx([0.1, 0.1, 0.1], rel=0.02)


@pytest.mark.slow
def test_coulomb_and_load_friction_on_a_weight_of_one_sign_are_one_class_with_friction_of_a_place(
    tmp_path: Path,
) -> None:
    machine = Machine(weight=3.0, middle=1.4, friction=lambda rate, angle, load: 0.12 + 0.08 * abs(load))
    found = named(machine, tmp_path)
    assert [each.name for each in found.effects] == ["coulomb_friction", "load_dependent_friction"]
    values = [value for each in found.effects for value, _, _ in each.parameters.values()]
    assert values == pytest.approx([0.12, 0.08], rel=0.02)
    for each in found.effects:
        assert each.aliases == ("position_dependent_friction",)
        assert each.probability <= 0.5


EVEN = Machine(weight=3.0, middle=1.4, friction=lambda rate, angle, load: 0.25)


# That of friction everywhere and of a place the former is named: the sharp friction above.
@pytest.mark.slow
def test_even_friction_is_no_spot(tmp_path: Path) -> None:
    """A spot wider than the motion is friction everywhere."""
    found = named(EVEN, tmp_path)
    assert [each.name for each in found.effects] == ["coulomb_friction"]


def test_a_spot_says_that_friction_everywhere_is_simpler(tmp_path: Path) -> None:
    tried = nls.effects.position_dependent_friction(made(EVEN, tmp_path, records=1)[0])
    spot = next(c for c in tried if any(u.name.endswith(".width") for u in c.unknowns))
    assert spot.simpler == ("coulomb_friction",)


def test_the_width_of_a_sign_is_a_fraction_of_the_slowest_speed_that_records_resolve() -> None:
    (found,) = nls.effects.coulomb_friction(joint())
    width = "dry_friction.creep_speed"
    assert with_resolved_signs(joint(), found.assembly, {"motor": 0.005}).quantities()[width].number == 0.001
    # Records in a wrong unit may ask for less than a law takes.
    least = with_resolved_signs(joint(), found.assembly, {"motor": 1e-8}).quantities()[width]
    assert least.number == 1e-6
    # Where the records resolve little, or nothing is known, the law keeps its own width.
    for slowest in ({"motor": 3.0}, {}):
        same = with_resolved_signs(joint(), found.assembly, slowest)
        assert same.quantities()[width] == found.assembly.quantities()[width]


def test_a_declared_width_of_a_sign_stays() -> None:
    seal = tie(CoulombFriction(sliding_effort=0.1).smooth(0.05), "first")
    declared = wheels().with_part("seal", seal)
    (found,) = [c for c in nls.effects.stribeck_friction(declared) if c.location == "first"]
    changed = with_resolved_signs(declared, found.assembly, {"first": 0.001, "second": 0.001})
    assert changed.quantities()["seal.creep_speed"].number == 0.05
    assert {u.above for u in found.unknowns} == {"", "seal.creep_speed"}


def test_one_body_has_friction_of_a_place_once() -> None:
    for first in nls.effects.position_dependent_friction(joint()):
        assert list(nls.effects.position_dependent_friction(first.assembly)) == []
