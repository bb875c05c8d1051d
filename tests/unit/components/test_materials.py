"""The library of rubbers: complete, honest about its evidence, and strict about its form."""

from __future__ import annotations

import json
from pathlib import Path

import numpy as np
import pytest
from click.testing import CliRunner

from nlsdesign.cli.main import program
from nlsdesign.components import NeoHooke, Ogden, material, materials
from nlsdesign.foundation.errors import DeckError, UnitError, UnknownNameError
from nlsdesign.foundation.rubber_library import EVIDENCE
from nlsdesign.foundation.spread import RelativeSpread
from tests.stretched import pulled, stress_at

ASKED_FOR = (
    "PMC-770",
    "natural_rubber",
    "butadiene_rubber",
    "EPDM",
    "polyurethane",
    "silicone",
    "butyl_rubber",
)


def test_every_rubber_asked_for_is_there_with_source_and_evidence() -> None:
    known = materials()
    assert set(ASKED_FOR) <= set(known)
    for each in known.values():
        assert each.family
        assert each.grade
        for found in each.properties:
            assert found.evidence in EVIDENCE, (each.name, found.name)
            assert len(found.quantity.source) > 10
            assert found.measures
    graded = {p.evidence for m in known.values() for p in m.properties}
    assert graded == set(EVIDENCE), "each grade occurs"


@pytest.mark.parametrize(
    ("name", "low", "high"),
    [
        ("natural_rubber", 0.05, 0.15),
        ("butadiene_rubber", 0.03, 0.10),
        ("EPDM", 0.05, 0.15),
        ("polyurethane", 0.05, 0.20),
        ("silicone", 0.10, 0.30),
        ("butyl_rubber", 0.2, 0.5),
    ],
)
def test_typical_loss_tangents_are_of_the_lowest_grade(name: str, low: float, high: float) -> None:
    found = material(name)["loss_tangent"]
    assert found.quantity.values == (low, high)
    assert found.evidence == "range"
    assert "not traced" in found.quantity.source


def test_both_publications_of_the_published_rubber_stand_side_by_side() -> None:
    rubber = material("PMC-770")
    stress = rubber["nominal_stress_2014"]
    assert stress.quantity.values == (0.97e6, 1.54e6, 2.22e6, 2.98e6)
    assert stress.conditions["strain"].values == (0.5, 1.0, 2.0, 5.0)
    assert stress.quantity.spread == RelativeSpread(0.15)
    assert rubber["viscosity_2015"].quantity.number == 411.0
    # 2015: sum of engaged moduli at 28 % strain, by hand: 0.92·0.28 + 0.58·0.264 + 0.74·0.1952 + 0.77·0.068.
    moduli, knots = (
        rubber["engaging_moduli_2015"].quantity,
        rubber["engaging_moduli_2015"].conditions["strain"],
    )
    law = sum(k * max(0.28 - at, 0.0) for k, at in zip(moduli.values, knots.values, strict=True))
    assert law == pytest.approx((0.92 * 0.28 + 0.58 * 0.264 + 0.74 * 0.1952 + 0.77 * 0.068) * 1e6)


def test_constants_of_the_library_go_into_laws_with_their_source() -> None:
    """Ogden and neo-Hooke straight from the library follow the curve that stands beside them."""
    rubber = material("natural_rubber_treloar")
    measured = rubber["nominal_stress"]
    strain, stress = np.array(measured.conditions["strain"].values), np.array(measured.quantity.values)
    ogden = Ogden(moduli=rubber["ogden_moduli"].quantity, exponents=rubber["ogden_exponents"].quantity)
    assert "Ogden" in ogden.moduli.source
    inside = strain <= 6.0
    assert np.max(np.abs(stress_at(pulled(law=ogden), strain[inside]) / stress[inside] - 1)) < 0.12
    gauss = NeoHooke(shear_modulus=rubber["shear_modulus"].quantity)
    small = strain <= 0.4
    assert np.max(np.abs(stress_at(pulled(law=gauss), strain[small]) / stress[small] - 1)) < 0.10


def test_a_name_that_does_not_exist_gets_the_nearest() -> None:
    with pytest.raises(UnknownNameError, match="did you mean 'PMC-770'"):
        material("PMC-77")
    with pytest.raises(UnknownNameError, match="did you mean 'butyl_rubber'"):
        material("butyl rubber")
    with pytest.raises(UnknownNameError, match=r"PMC-770: property.*did you mean 'ultimate_stress'"):
        material("PMC-770")["ultimate_stres"]


SOUND = """[gum]
family = "natural rubber"
grade = "any"
remark = ""
[gum.loss_tangent]
measures = "loss tangent"
value = [0.05, 0.15]
unit = "1"
frequency = {value = [1, 10], unit = "Hz"}
source = "somebody who measured it"
evidence = "range"
"""


def read(folder: Path, text: str) -> dict[str, object]:
    file = folder / "rubbers.toml"
    file.write_text(text, encoding="utf8")
    return dict(materials(file))


def test_a_sound_file_of_ones_own_is_read(tmp_path: Path) -> None:
    read(tmp_path, SOUND)
    found = material("gum", tmp_path / "rubbers.toml")["loss_tangent"]
    assert found.shown == "0.05 to 0.15"
    assert found.at("frequency") == "1 to 10 Hz"
    assert found.at("temperature") == "–"


@pytest.mark.parametrize(
    ("old", "new", "message"),
    [
        ('evidence = "range"', 'evidence = "rang"', r"rubbers\.toml:11:1: .*evidence.*did you mean 'range'"),
        ('measures = "loss tangent"', 'mesures = "x"', r"rubbers\.toml:6:1: .*did you mean 'measures'"),
        ("[0.05, 0.15]", "[0.15, 0.05]", r"rubbers\.toml:7:1: .*two ascending numbers"),
        ("[1, 10]", "[1, 10, 20]", r"rubbers\.toml:9:1: .*has 3 numbers, the value has 2"),
        ('unit = "Hz"', 'unit = "m"', r"rubbers\.toml:9:1: .*'m' does not measure it.*'Hz'"),
        ('family = "natural rubber"', 'famly = "x"', r"rubbers\.toml:2:1: .*did you mean 'family'"),
        ('grade = "any"\n', "", r"rubbers\.toml:1:1: gum: has no text 'grade'"),
        ('source = "somebody who measured it"\n', "", r"rubbers\.toml:4:1|has no source"),
        (SOUND[SOUND.index("[gum.loss") :], "", "has no property"),
    ],
)
def test_what_is_wrong_is_named_with_its_place(tmp_path: Path, old: str, new: str, message: str) -> None:
    assert old in SOUND
    with pytest.raises(DeckError, match=message):
        read(tmp_path, SOUND.replace(old, new))


def test_a_unit_that_does_not_exist_and_a_missing_file_are_named(tmp_path: Path) -> None:
    with pytest.raises(UnitError, match=r"rubbers\.toml:9:1"):
        read(tmp_path, SOUND.replace('"Hz"', '"Hx"'))
    with pytest.raises(DeckError, match=r"nowhere\.toml: cannot be read"):
        materials(tmp_path / "nowhere.toml")


def test_the_tables_say_value_condition_and_evidence() -> None:
    everything = CliRunner().invoke(program, ["materials"], env={"COLUMNS": "400"})
    assert everything.exit_code == 0
    assert "butyl_rubber" in everything.output
    assert "0.2 to 0.5 (range)" in everything.output
    one = CliRunner().invoke(program, ["materials", "PMC-770", "--json"])
    shown = json.loads(one.output)["properties"]["nominal_stress_2014"]
    assert shown["value"] == "0.97, 1.54, 2.22, 2.98 MPa ± 15 %"
    assert shown["temperature"] == "–"
    text = str(material("PMC-770"))
    assert "strain 50, 100, 200, 500 %" in text
    assert "[data sheet]" in text
