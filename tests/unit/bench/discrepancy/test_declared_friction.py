"""Dry friction that a deck declares may still fall with speed, or come round with the angle."""

from __future__ import annotations

from pathlib import Path

import pytest

from nlsdesign.bench.discrepancy import ALL, Verdict, diagnose
from nlsdesign.bench.discrepancy.effects.effect import Candidate
from nlsdesign.bench.identification import load_records
from nlsdesign.components import Assembly
from nlsdesign.components.assembly.deck_template import load_template
from nlsdesign.components.assembly.deck_writer import declare
from nlsdesign.foundation.deck import load_deck
from nlsdesign.model import flatten
from tests.rig.machines import MACHINES, write_machine_set

_DRY = """
[seal]
component = "CoulombFriction"
between = ["motor"]
sliding_effort = {value = 0.1, unit = "N*m", source = "declared: a seal", spread = 0.6}
creep_speed = {value = 0.02, unit = "rad/s", source = "declared: a seal"}
"""


def declared(template: str, folder: Path) -> Assembly:
    deck = folder / f"{template}.toml"
    deck.write_text(load_template(template).filled("machine"), encoding="utf-8")
    return declare(load_deck(deck))


def candidates(effect: str, machine: Assembly) -> list[Candidate]:
    (found,) = [each for each in ALL if each.__name__ == effect]
    return list(found(machine))


@pytest.mark.parametrize("template", ["linear-spring", "positioning-drive"])
def test_declared_friction_may_fall_with_speed(template: str, tmp_path: Path) -> None:
    machine = declared(template, tmp_path)
    (found,) = candidates("stribeck_friction", machine)
    unknowns = [each.name for each in found.unknowns]
    assert unknowns == ["dry_friction.breakaway", "dry_friction.stribeck_speed"]
    level = machine.quantities()["dry_friction.sliding_effort"]
    assert found.assembly.quantities()["dry_friction.sliding_effort"] == level
    falling = found.assembly.with_values(dict(zip(unknowns, (2.0 * level.number, 0.3), strict=True)))
    model, friction = flatten(falling), {}
    (rate,) = (body.rate for body in model.bodies if body.rate in {v.name for v in model.states})
    for speed in (0.05, 3.0):
        state = [speed if v.name == rate else 0.0 for v in model.states]
        now = model.evaluate(state, [0.0] * len(model.inputs))
        friction[speed] = now.get("dry_friction.torque", now.get("dry_friction.force", 0.0))
    assert friction[3.0] == pytest.approx(level.number, rel=1e-3)
    assert friction[0.05] > 2.5 * level.number
    assert not candidates("stribeck_friction", falling)


def test_declared_friction_may_come_round_with_the_angle(tmp_path: Path) -> None:
    machine = declared("linear-spring", tmp_path)
    found = [c for c in candidates("position_dependent_friction", machine) if len(c.unknowns) == 2]
    assert [[u.name for u in c.unknowns] for c in found] == [["dry_friction.sine", "dry_friction.cosine"]]
    assert all("dry_friction.sine" in c.assembly.quantities() for c in found)


def test_friction_that_an_effect_has_added_has_its_own_richer_form(tmp_path: Path) -> None:
    """Otherwise one friction would be named twice, as Coulomb's and as Stribeck's."""
    machine = declared("linear-spring", tmp_path).without_part("dry_friction")
    (even,) = candidates("coulomb_friction", machine)
    assert not candidates("stribeck_friction", even.assembly)
    (richer,) = candidates("stribeck_friction", machine)
    assert richer.simpler == ("coulomb_friction",)
    assert len(richer.unknowns) == 3


def diagnosed(folder: Path, hidden: dict[str, float], *names: str, inertia: float = 1.0) -> Verdict:
    """The spindle of the bench with dry friction in its deck, perhaps a wrong inertia, its drive known."""
    spindle = MACHINES["spindle"]
    write_machine_set(folder / "set", spindle, hidden, 3)
    deck = folder / "set" / "deck.toml"
    text = deck.read_text(encoding="utf-8").replace(
        f"inertia = {{value = {spindle.inertia:.9g}", f"inertia = {{value = {inertia * spindle.inertia:.9g}"
    )
    before, name, after = text.partition("torque_constant")
    deck.write_text(before + name + after.replace(", spread = 0.06", "", 1) + _DRY, encoding="utf-8")
    machine = declare(load_deck(deck))
    records = load_records(folder / "set", flatten(machine))
    return diagnose(machine, records, catalogue=[each for each in ALL if each.__name__ in names])


@pytest.mark.slow
def test_friction_that_falls_with_speed_is_named_beside_declared_friction(tmp_path: Path) -> None:
    found = diagnosed(
        tmp_path,
        {"stribeck_friction": 1.0},
        "stribeck_friction",
        "quadratic_drag",
        "position_dependent_friction",
    )
    assert found.verdict == "named"
    assert [each.name for each in found.effects] == ["stribeck_friction"]


@pytest.mark.slow
def test_declared_friction_that_is_all_there_is_has_no_other_name(tmp_path: Path) -> None:
    found = diagnosed(tmp_path, {"coulomb_friction": 1.0}, "stribeck_friction", "position_dependent_friction")
    assert found.effects == ()


@pytest.mark.slow
def test_a_wrong_inertia_is_said_and_no_saturation_named(tmp_path: Path) -> None:
    names = ("torque_constant_saturation", "command_compression", "torque_constant_drift", "drive_delay")
    found = diagnosed(tmp_path, {"coulomb_friction": 1.0}, *names, inertia=0.6)
    assert found.verdict == "data_suspect"
    assert any("motor.inertia is declared as" in each for each in found.where)
