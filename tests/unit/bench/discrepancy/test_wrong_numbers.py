"""A number that was declared wrongly is said to be that, alone and beside an effect."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

import pytest

from nlsdesign.bench.discrepancy import ALL, Verdict, diagnose
from nlsdesign.bench.discrepancy.screening.wrong_numbers import is_explained_by_numbers
from nlsdesign.bench.discrepancy.selection.criteria import Criteria
from nlsdesign.bench.discrepancy.selection.measures import DECLARED, Excess
from nlsdesign.bench.identification import load_records
from nlsdesign.model import flatten
from tests.diagnosed import declared_rig
from tests.rig import ACTUATORS, make_records, write_declaration, write_records

MOTIONS = ("sine_15deg_5.0Hz", "sine_25deg_2.0Hz")
TWO = tuple(each for each in ALL if each.__name__ in ("coulomb_friction", "second_relaxation"))
MODULUS = "spring.cable.rubber.relaxing.spring.modulus"


def diagnosed(folder: Path, factor: float, hidden: dict[str, float]) -> Verdict:
    """Records of the arm, whose declared modulus of relaxation is wrong by a factor."""
    arm = ACTUATORS["arm"]
    mistaken = replace(arm, rubber=replace(arm.rubber, k=factor * arm.rubber.k))
    write_declaration(folder, mistaken)
    write_records(folder / "records", make_records(arm, hidden, 5, only=MOTIONS))
    rig = declared_rig(folder / "rig.toml", folder / "cam.csv")
    return diagnose(rig, load_records(folder / "records", flatten(rig)), catalogue=TWO)


@pytest.mark.parametrize("factor", [pytest.param(0.65, marks=pytest.mark.slow), 1.5])
def test_a_single_wrong_number_is_named_with_its_value(tmp_path: Path, factor: float) -> None:
    found = diagnosed(tmp_path, factor, {})
    assert found.verdict == "data_suspect"
    assert found.effects == ()
    (sentence,) = [each for each in found.where if "a declared number is probably wrong" in each]
    assert MODULUS in sentence
    assert "standard deviations away" in sentence
    values = {v.name: v.start for v in flatten(found.actuator).parameters}
    true = ACTUATORS["arm"].rubber.k
    # The rig is built within 6 % of what its makers declare.
    assert values[MODULUS] == pytest.approx(true, rel=0.1)


# That no number of a clean machine is called wrong: test_diagnosis_rig.py.
@pytest.mark.slow
def test_a_number_inside_its_declared_range_is_not_called_wrong(tmp_path: Path) -> None:
    found = diagnosed(tmp_path, 1.03, {})
    assert found.verdict == "none"
    assert found.where == ()


@pytest.mark.slow
def test_an_effect_beside_a_wrong_number_is_named_and_the_number_said(tmp_path: Path) -> None:
    found = diagnosed(tmp_path, 1.5, {"coulomb_friction": 1.0})
    assert found.verdict == "named"
    assert [e.name for e in found.effects] == ["coulomb_friction"]
    assert any(MODULUS in each for each in found.where)


# Ten seconds; a wrong number beside an effect is tried in every run.
@pytest.mark.slow
def test_a_wrong_torque_constant_beside_friction_is_not_taken_for_effects(tmp_path: Path) -> None:
    """A gain of the cell and a weight would do too, with more numbers and strained moduli."""
    arm = ACTUATORS["arm"]
    drive = replace(arm.drivetrain, torque_constant=0.7 * arm.drivetrain.torque_constant)
    write_declaration(tmp_path, replace(arm, drivetrain=drive))
    write_records(tmp_path / "records", make_records(arm, {"coulomb_friction": 1.0}, 5, only=MOTIONS))
    rig = declared_rig(tmp_path / "rig.toml", tmp_path / "cam.csv")
    some = ("coulomb_friction", "force_sensor_gain", "gravity_load", "second_relaxation")
    catalogue = tuple(each for each in ALL if each.__name__ in some)
    found = diagnose(rig, load_records(tmp_path / "records", flatten(rig)), catalogue=catalogue)
    assert [e.name for e in found.effects] == ["coulomb_friction"]
    assert any("motor.torque_constant" in each for each in found.where)


@pytest.mark.parametrize(
    ("effects", "numbers", "explained"),
    [(400.0, 3.0, True), (1000.0, 3.0, True), (5.0, 3.0, False), (400.0, 60.0, False), (0.0, 0.0, False)],
)
def test_numbers_that_leave_a_trace_are_preferred_to_effects_that_leave_much(
    effects: float, numbers: float, explained: bool
) -> None:
    """Friction that sticks leaves a trace whatever the numbers are; an effect must not be named for that."""

    def left(excess: float) -> dict[str, Excess]:
        strained = Excess(DECLARED, "1", 1.0, 3.0, 3.0, 9e9, 3, 3.0, open=True)
        return {
            DECLARED: strained,
            "slide": Excess("slide", "N", 1.0, 1.0, 1.0, 100.0 + excess, 100, 50.0, open=True),
        }

    assert is_explained_by_numbers(Criteria(), left(1000.0), left(effects), left(numbers)) is explained
