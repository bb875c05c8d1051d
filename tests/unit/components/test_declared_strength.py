"""Section, strength and cable: numbers beside the law, by name, checked, and never fitted.

Independent road: areas and forces are multiplied out here; which numbers a block can fit is asked of the
structure of its equations.
"""

from __future__ import annotations

from pathlib import Path

import casadi as ca
import numpy as np
import pytest

from nlsdesign.bench.discrepancy.effects import cam_profile_error
from nlsdesign.bench.discrepancy.tearing import blocks_of
from nlsdesign.bench.identification.equation_error.block_response import free_in
from nlsdesign.components import (
    TRANSLATION,
    Area,
    Assembly,
    Cable,
    CamWithProfileError,
    Driven,
    LinearElastic,
    NotDeclared,
    OneSidedCam,
    Pulley,
    Specimen,
    Strip,
    TwoSidedCam,
    specimen,
    tie,
)
from nlsdesign.components.assembly.deck_writer import deck_problems, deck_text, declare
from nlsdesign.components.assembly.named_parts import assembly
from nlsdesign.components.materials.specimen import Strength
from nlsdesign.design.statics.declared_cam import cam_from_profile
from nlsdesign.design.statics.equilibrium import elastic_law
from nlsdesign.foundation.deck import load_deck, read_deck
from nlsdesign.foundation.errors import ArrangementError, NlsError, ValueRangeError
from nlsdesign.foundation.quantity import Quantity, quantity
from nlsdesign.model import flatten

STRENGTH = Strength(tensile_strength=5.17e6, elongation_at_break=5.0)
CABLE = Cable(cable_diameter=9e-4, cable_breaking_force=1285.0, cable_bend_ratio=5.0)
STRIP = Strip(width=quantity(30.0, "mm"), thickness=quantity(3.4, "mm"))
GUM = LinearElastic(modulus=0.9e6)
DECLARED = ("austin2015_as_printed", "austin2015_figure_consistent", "one_sided_cable_drive")


def pulled(piece: Specimen) -> Assembly:
    return assembly("bench", grip=Driven(domain=TRANSLATION), piece=tie(piece, "grip"))


def sized(deck: str) -> Assembly:
    """A deck whose piece of rubber is a strip of the same section as before."""
    made = declare(load_deck(deck))
    name = flatten(made).springs[0].cams[0].specimens[0].name
    old = made.element(name)
    assert isinstance(old, Specimen)
    strip = Strip(width=20e-3, thickness=old.cross_section.square_metres / 20e-3)
    new = specimen(section=strip, rest_length=old.rest_length, strength=old.strength, **dict(old.members))
    return made.with_part(name, new)


def test_the_force_of_a_strip_is_stress_times_width_times_thickness() -> None:
    piece = specimen(section=STRIP, rest_length=0.0125, gum=GUM)
    found = flatten(pulled(piece)).evaluate([], [0.005, 0.0])
    assert found["piece.force"] == pytest.approx(0.9e6 * (0.005 / 0.0125) * 0.030 * 0.0034, rel=1e-14)
    assert piece.cross_section.square_metres == pytest.approx(0.030 * 0.0034, rel=1e-15)
    assert specimen(area=2e-4, rest_length=0.1, gum=GUM).cross_section.square_metres == 2e-4


def test_design_divides_by_the_whole_section() -> None:
    """The stress in equilibrium at 4 mm of a strip of 20 mm: the same as where the same area is declared."""
    whole, strip = (elastic_law(flatten(a)) for a in (declare(load_deck(DECLARED[1])), sized(DECLARED[1])))
    for law in (whole, strip):
        start = [v.start for v in law.parameters]
        force, _, strain, stress = (float(value) for value in law.function(4e-3, start)[:4])
        assert stress == pytest.approx(force / 1e-4, rel=1e-12)
        assert strain == pytest.approx(4.0 / 12.5, rel=1e-12)


@pytest.mark.parametrize("strength", [NotDeclared(), STRENGTH])
@pytest.mark.parametrize("section", [Area(1e-4), STRIP])
def test_decks_hold_them_and_the_model_names_them(section: Area | Strip, strength: Strength) -> None:
    piece = specimen(section=section, rest_length=0.0125, strength=strength, gum=GUM)
    made = pulled(piece)
    assert declare(read_deck(deck_text(made), Path("a.toml"))) == made
    given = {v.name: v.start for v in flatten(made).parameters}
    assert ("piece.tensile_strength" in given) == isinstance(strength, Strength)
    assert given.get("piece.elongation_at_break", 5.0) == 5.0


@pytest.mark.parametrize("deck", DECLARED)
def test_names_around_a_cam_say_section_strength_and_cable(deck: str) -> None:
    for made in (declare(load_deck(deck)), sized(deck)):
        model = flatten(made)
        (cam,) = model.springs[0].cams
        (piece,) = cam.specimens
        assert np.prod([model.values[name] for name in piece.section]) == pytest.approx(1e-4, rel=1e-12)
        assert piece.tensile_strength is not None
        assert piece.elongation_at_break is not None
        assert cam.cable is not None
        assert model.values[piece.tensile_strength] == 5.17e6
        assert model.values[piece.elongation_at_break] == 5.0
        units = [model.variable(n).unit for n in (cam.cable.diameter, cam.cable.breaking_force)]
        assert units == ["m", "N"]
        assert model.values[cam.cable.bend_ratio] >= 1.0
        assert not {piece.tensile_strength, piece.elongation_at_break} & set(cam.numbers)
        assert set(piece.section) <= set(cam.numbers)


def test_without_them_nothing_is_named() -> None:
    model = flatten(declare(load_deck("test_rig")))
    (cam,) = model.springs[0].cams
    assert cam.cable is None
    assert (cam.specimens[0].tensile_strength, cam.specimens[0].elongation_at_break) == (None, None)
    words = ("cable", "strength", "break")
    assert not [v.name for v in model.parameters if any(w in v.name.rpartition(".")[2] for w in words)]


@pytest.mark.parametrize("deck", DECLARED)
def test_they_enter_no_equation_and_no_fit(deck: str) -> None:
    """Neither rates nor signals depend on them, so a diagnosis finds none of them in a block."""
    made = declare(load_deck(deck))
    made = made.with_values(
        {n: Quantity(q.value, q.unit, q.source, 0.3) for n, q in made.quantities().items()}
    )
    model = flatten(made)
    (cam,) = model.springs[0].cams
    (piece,) = cam.specimens
    assert cam.cable is not None
    beside = {
        piece.tensile_strength, piece.elongation_at_break,
        cam.cable.diameter, cam.cable.breaking_force, cam.cable.bend_ratio,
    }  # fmt: skip
    s = model.symbols()
    everything = ca.vertcat(s.derivative, s.output, s.signal)
    for i, v in enumerate(model.parameters):
        if v.name in beside:
            assert not ca.depends_on(everything, s.parameter[i]), v.name
    blocks = blocks_of(model, ["motor_encoder.reading", "motor.current", cam.force])
    fitted = {name for b in blocks for name in free_in(b, [v.name for v in b.model.parameters])}
    assert fitted, "nothing to fit at all"
    assert not fitted & beside


def test_a_cam_that_is_changed_keeps_its_cable() -> None:
    made = declare(load_deck("austin2015_figure_consistent"))
    old = made["spring.cam"]
    assert isinstance(old, TwoSidedCam)
    worn = cam_profile_error(made)[0].assembly["spring.cam"]
    assert isinstance(worn, CamWithProfileError)
    angles = np.linspace(0.0, 0.9, 30)
    drawn = cam_from_profile(angles, 0.01 + 0.0 * angles, like=old).cam
    assert worn.cable == drawn.cable == old.cable
    assert isinstance(old.cable, Cable)


TABLE = """
[grip]
component = "Driven"
domain = "translation"
[piece]
component = "Specimen"
between = ["grip"]
rest_length = {value = 12.5, unit = "mm", source = "drawing"}
SECTION
[piece.gum]
component = "LinearElastic"
modulus = {value = 0.9, unit = "MPa", source = "sheet"}
"""


def line(name: str, value: float, unit: str) -> str:
    return f'{name} = {{value = {value}, unit = "{unit}", source = "drawing"}}\n'


@pytest.mark.parametrize(
    ("section", "said"),
    [
        ("", "Specimen needs 'area'"),
        (line("width", 30, "mm"), "Specimen needs 'thickness'"),
        (
            line("area", 1, "cm^2") + line("width", 30, "mm"),
            "either area (Area); or width and thickness (Strip), not area and width",
        ),
        (line("area", 1, "cm^2") + line("tensile_strength", 5, "MPa"), "needs 'elongation_at_break'"),
        (
            line("area", 1, "cm^2")
            + line("tensile_strenght", 5, "MPa")
            + line("elongation_at_break", 5, "1"),
            "did you mean 'tensile_strength'",
        ),
        (line("area", 20, "m^2"), "was 'mm^2' meant? 20 mm² is in the range"),
    ],
)
def test_mistakes_in_a_deck_are_named(section: str, said: str) -> None:
    problems = deck_problems(read_deck(TABLE.replace("SECTION", section), Path("bench.toml")))
    assert len(problems) == 1, [str(p) for p in problems]
    assert said in str(problems[0])
    assert str(problems[0]).startswith("bench.toml:")


@pytest.mark.parametrize(
    ("make", "call"),
    [
        (lambda: specimen(area=Quantity(20, "mm^2"), rest_length=0.1, gum=GUM), 'quantity(20, "mm^2")'),
        (lambda: specimen(area=1e-4, rest_length=Quantity(25, "mm"), gum=GUM), 'quantity(25, "mm")'),
        (lambda: Strip(Quantity(30, "mm"), 3e-3).within(None), 'quantity(30, "mm")'),
        (lambda: Pulley(radius=Quantity(12, "mm")), 'quantity(12, "mm")'),
        (
            lambda: OneSidedCam(lever_arm=Quantity((6, 7, 8, 9, 10), "mm"), last_angle=1.0),
            'quantity((6, 7, 8, 9, ...), "mm")',
        ),
    ],
)
def test_a_number_in_the_shown_unit_taken_for_si_is_told_how_to_be_written(make: object, call: str) -> None:
    with pytest.raises(ValueRangeError) as caught:
        make()  # type: ignore[operator]
    assert f"write {call}" in str(caught.value)


@pytest.mark.parametrize(
    ("make", "said"),
    [
        (lambda: specimen(rest_length=0.1, gum=GUM), "has no cross-section"),
        (lambda: specimen(area=1e-4, section=STRIP, rest_length=0.1, gum=GUM), "has an area and a section"),
        (lambda: specimen(section=NotDeclared(), rest_length=0.1, gum=GUM), "one of Area(...), Strip(...)"),
        (
            lambda: Pulley(radius=0.01, cable=STRENGTH),
            "must be one of NotDeclared(...), Cable(...)",
        ),
        (
            lambda: specimen(area=1e-4, rest_length=0.1, strength=Strength(0.0, 5.0), gum=GUM),
            "nominal stress at break must lie in",
        ),
        (lambda: Pulley(radius=0.01, cable=Cable(-1e-3, 1e3, 5.0)), "diameter of the cable must lie in"),
    ],
)
def test_mistakes_in_python_are_named(make: object, said: str) -> None:
    with pytest.raises(NlsError) as caught:
        make()  # type: ignore[operator]
    assert said in str(caught.value)
    assert isinstance(caught.value, ArrangementError | ValueRangeError)
