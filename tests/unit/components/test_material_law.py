"""Rubber of the library as laws: against the published curves, in numbers taken from the finished parts.

Independent road: stresses come from the flat model of a piece that is pulled, curves from the library's
file, made curves from formulas typed here.
"""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

from nlsdesign.components import (
    Assembly,
    FittedRange,
    LinearElastic,
    Material,
    NotDeclared,
    Ogden,
    Series,
    Specimen,
    StrainStiffening,
    Yeoh,
    material,
    materials,
    rubber_of,
    specimen,
    with_rubber,
)
from nlsdesign.components.assembly.deck_writer import deck_text, declare
from nlsdesign.components.assembly.named_parts import assembly
from nlsdesign.components.materials.material_law import fit_curve, law_of, material_laws
from nlsdesign.components.materials.specimen import Strength
from nlsdesign.foundation.deck import load_deck, read_deck
from nlsdesign.foundation.errors import ArrangementError, NlsError, UnknownNameError, ValueRangeError
from nlsdesign.foundation.quantity import Quantity
from nlsdesign.model import flatten
from nlsdesign.simulation import simulate
from tests.stretched import LENGTH, pulled, stress_at

LIKE = Quantity(1.0, "MPa", "made for this test", 0.1)
CURVES = {
    "PMC-770": ("nominal_stress_2014", Yeoh, 0.001),
    "natural_rubber_treloar": ("nominal_stress", Ogden, 0.021),
    "Dragon_Skin_30": ("nominal_stress", StrainStiffening, 0.013),
    "Ecoflex_00-30": ("nominal_stress", Ogden, 0.03),
}


def errors(made: Material) -> np.ndarray:
    """Stress of the part over that of the curve, less one, at the points of the curve."""
    law = law_of(made)
    curve = made[law.using]
    strain, stress = np.array(curve.conditions["strain"].values), np.array(curve.quantity.values)
    return stress_at(pulled(**dict(law.members)), strain) / stress - 1.0


@pytest.mark.parametrize("name", CURVES)
def test_the_law_follows_the_published_curve_as_far_as_it_says(name: str) -> None:
    using, form, bound = CURVES[name]
    law = law_of(material(name))
    assert law.using == using
    assert isinstance(law.members[0][1], form)
    found = errors(material(name))
    assert law.rms_error == pytest.approx(np.sqrt(np.mean(found**2)), rel=1e-9)
    assert law.worst_error == pytest.approx(np.max(np.abs(found)), rel=1e-9)
    assert law.rms_error < bound
    last = material(name)[using].conditions["strain"].values[-1]
    assert law.strains[1] == min(last, {Yeoh: 5.0, Ogden: 6.0, StrainStiffening: np.inf}[form])
    assert f"{100 * law.rms_error:.2g} % rms" in str(law)


@pytest.mark.parametrize("name", CURVES)
def test_the_stress_rises_from_zero_to_the_end_of_the_range(name: str) -> None:
    law = law_of(material(name))
    stresses = stress_at(pulled(**dict(law.members)), np.linspace(0.0, law.strains[1], 301))
    assert abs(stresses[0]) < 1e-6 * stresses[-1]
    assert np.all(np.diff(stresses) > 0.0)


def test_the_fit_beats_the_published_constants_and_any_near_it() -> None:
    """Ogden's own constants, and the fitted moduli changed at random, are further from Treloar's points."""
    rubber = material("natural_rubber_treloar")
    curve = rubber["nominal_stress"]
    strain, stress = np.array(curve.conditions["strain"].values), np.array(curve.quantity.values)

    def rms(law: Ogden) -> float:
        return float(np.sqrt(np.mean((stress_at(pulled(law=law), strain) / stress - 1.0) ** 2)))

    fitted = law_of(rubber)
    published = law_of(rubber, using="ogden_moduli").members[0][1]
    assert isinstance(published, Ogden)
    assert fitted.rms_error is not None
    assert rms(published) > 2.0 * fitted.rms_error
    mine, random = fitted.members[0][1], np.random.default_rng(7)
    assert isinstance(mine, Ogden)
    for _ in range(20):
        moduli = np.array(mine.moduli.values) * np.exp(0.02 * random.normal(size=len(mine.moduli.values)))
        other = Ogden(moduli=tuple(moduli), exponents=mine.exponents)
        assert rms(other) > fitted.rms_error


def ogden_points(strain: np.ndarray) -> np.ndarray:
    stretch = 1.0 + strain
    return 0.3e6 * (stretch - stretch**-2) + 2e3 * (stretch**3 - stretch**-3)


def knotted_points(strain: np.ndarray) -> np.ndarray:
    soft = 0.06 * np.logaddexp(0.0, (strain - 0.4) / 0.06) - 0.06 * np.logaddexp(0.0, -0.4 / 0.06)
    return 0.2e6 * strain + 0.9e6 * soft


def yeoh_points(strain: np.ndarray) -> np.ndarray:
    stretch = 1.0 + strain
    first = stretch**2 + 2.0 / stretch - 3.0
    return 2.0 * (stretch - stretch**-2) * (0.2e6 - 2.0 * 1e3 * first + 3.0 * 30.0 * first**2)


@pytest.mark.parametrize(
    ("points", "form", "expected"),
    [
        (ogden_points, Ogden, {2.0: 0.3e6, 4.0: 2e3}),
        (knotted_points, StrainStiffening, {0.0: 0.2e6, 0.4: 0.9e6}),
        (yeoh_points, Yeoh, {"c1": 0.2e6, "c2": -1e3, "c3": 30.0}),
    ],
)
def test_a_curve_of_a_known_law_gives_back_its_constants(
    points: object, form: type, expected: dict[object, float]
) -> None:
    strain = np.arange(0.2, 2.6, 0.2)
    fit = fit_curve(tuple(strain), tuple(points(strain)), like=LIKE)  # type: ignore[operator]
    law = fit.law
    assert isinstance(law, form)
    assert fit.worst_error < 1e-5
    if isinstance(law, Ogden):
        found: dict[object, float] = dict(zip(law.exponents.values, law.moduli.values, strict=True))
    elif isinstance(law, StrainStiffening):
        found = dict(zip(law.knots.values, law.modulus.values, strict=True))
    else:
        found = {name: getattr(law, name).number for name in ("c1", "c2", "c3")}
    large = {key: value for key, value in found.items() if abs(value) > 1e-4 * max(map(abs, found.values()))}
    assert {round(k, 9) if isinstance(k, float) else k for k in large} >= set(expected)
    for key, value in expected.items():
        near = next(
            v for k, v in found.items() if k == key or (isinstance(k, float) and k == pytest.approx(key))
        )
        assert near == pytest.approx(value, rel=1e-4)
    assert law.valid[1] == pytest.approx(2.4)
    assert law.parameters()[next(iter(law.parameters()))].source == "made for this test"


def test_a_form_whose_stress_falls_between_the_points_is_not_taken() -> None:
    """Points that rise, with a dip of the cubic through them that nobody measured."""
    strain = np.array([0.5, 1.0, 4.0])
    stretch = 1.0 + strain
    first = stretch**2 + 2.0 / stretch - 3.0
    cubic = 2.0 * (stretch - stretch**-2) * (0.5e6 - 2.0 * 4.2e4 * first + 3.0 * 1.3e3 * first**2)
    assert np.all(np.diff(cubic) > 0.0)
    law = fit_curve(tuple(strain), tuple(cubic), like=LIKE).law
    assert np.all(np.diff(stress_at(pulled(law=law), np.linspace(0.0, 4.0, 200))) > 0.0)


def test_few_points_give_few_constants() -> None:
    """Two points: one constant, for two could follow any two points."""
    fit = fit_curve((0.5, 1.0), (0.3e6, 0.5e6), like=LIKE)
    assert sum(len(q.values) for n, q in fit.law.parameters().items() if q.unit == "Pa") == 1


@pytest.mark.parametrize(
    ("strains", "stresses", "said"),
    [
        ((0.5,), (1e6,), "two points at least"),
        ((0.5, 0.4), (1e6, 2e6), "ascend from zero"),
        ((0.0, 0.4), (0.0, 2e6), "ascend from zero"),
        ((0.5, 0.6), (1e6,), "one stress for each strain"),
        ((0.5, 0.6), (1e6, -1e6), "positive stress"),
    ],
)
def test_a_curve_that_is_none_is_named(
    strains: tuple[float, ...], stresses: tuple[float, ...], said: str
) -> None:
    with pytest.raises(ValueRangeError, match=said):
        fit_curve(strains, stresses, like=LIKE)


def test_engaging_moduli_come_with_the_branch_and_the_range_of_their_publication() -> None:
    law = law_of(material("PMC-770"), using="engaging_moduli_2015")
    stiff, relaxing = (member for _, member in law.members)
    assert [name for name, _ in law.members] == ["stiff", "relaxing"]
    assert isinstance(stiff, StrainStiffening)
    assert isinstance(relaxing, Series)
    deck = declare(load_deck("austin2015_as_printed"))["spring.rubber"]
    assert isinstance(deck, Specimen)
    printed = dict(deck.members)["stiff"]
    assert isinstance(printed, StrainStiffening)
    assert stiff.modulus.values == printed.modulus.values
    assert stiff.knots.values == printed.knots.values
    # At rest, at 28 % strain, by hand: 0.92·0.28 + 0.58·0.264 + 0.74·0.1952 + 0.77·0.068 MPa.
    by_hand = (0.92 * 0.28 + 0.58 * 0.264 + 0.74 * 0.1952 + 0.77 * 0.068) * 1e6
    assert stress_at(pulled(stiff=stiff), [0.28])[0] == pytest.approx(by_hand, rel=1e-12)
    assert law.strains == (0.0, 0.28)
    assert law.rms_error is None
    assert dict(relaxing.members)["dashpot"].parameters()["viscosity"].number == 411.0


def test_constants_become_their_laws_with_their_own_range() -> None:
    rubber = material("natural_rubber_treloar")
    gauss = law_of(rubber, using="shear_modulus")
    stretch = 1.3
    by_hand = 0.3923e6 * (stretch - stretch**-2)
    assert stress_at(pulled(**dict(gauss.members)), [0.3])[0] == pytest.approx(by_hand, rel=1e-12)
    assert gauss.strains == (-0.4, 0.4)
    assert law_of(rubber, using="ogden_moduli").strains == (-0.6, 6.0)


def test_strength_is_that_of_the_library_or_the_end_of_the_curve() -> None:
    published = law_of(material("PMC-770")).strength
    assert isinstance(published, Strength)
    assert published.tensile_strength.number == 5.17e6
    assert published.elongation_at_break.number == 5.0
    assert "at least" in published.elongation_at_break.source
    assert not published.tensile_strength.assumed
    silicone = law_of(material("Dragon_Skin_30")).strength
    assert isinstance(silicone, Strength)
    assert (silicone.tensile_strength.number, silicone.elongation_at_break.number) == (3.45e6, 6.0)
    assert silicone.tensile_strength.assumed


OWN = """[gum]
family = "natural rubber"
grade = "any"
remark = ""
[gum.shear_modulus]
measures = "shear modulus"
value = 0.4
unit = "MPa"
source = "somebody who measured it"
evidence = "data sheet"
"""
ULTIMATE = """[gum.ultimate_stress]
measures = "nominal stress at break"
value = 20
unit = "MPa"
source = "somebody who broke it"
evidence = "data sheet"
[gum.ultimate_strain]
measures = "strain at break"
value = 600
unit = "%"
source = "somebody who broke it"
evidence = "data sheet"
"""


def test_a_library_of_ones_own_gives_laws_too(tmp_path: Path) -> None:
    file = tmp_path / "rubbers.toml"
    file.write_text(OWN, encoding="utf8")
    assert material_laws(file)["gum"].strength == NotDeclared()
    file.write_text(OWN + ULTIMATE, encoding="utf8")
    strength = material_laws(file)["gum"].strength
    assert isinstance(strength, Strength)
    assert (strength.tensile_strength.number, strength.elongation_at_break.number) == (20e6, 6.0)


def test_rubbers_without_an_elastic_law_are_refused_with_those_that_have_one() -> None:
    having = material_laws()
    assert set(having) == set(CURVES)
    for name, other in materials().items():
        if name in having:
            continue
        with pytest.raises(ArrangementError) as caught:
            law_of(other)
        assert "loss tangent" in str(caught.value)
        assert all(each in (caught.value.next_step or "") for each in having)
    with pytest.raises(UnknownNameError, match="did you mean 'nominal_stress_2014'"):
        law_of(material("PMC-770"), using="nominal_stress_2015")
    with pytest.raises(UnknownNameError):
        law_of(material("PMC-770"), using="viscosity_2015")


def test_a_piece_has_sizes_laws_and_strength_and_says_where_the_range_is_left() -> None:
    piece = rubber_of(material("Dragon_Skin_30"), area=2e-4, rest_length=LENGTH)
    assert piece.cross_section.square_metres == 2e-4
    assert isinstance(piece.strength, Strength)
    law = dict(piece.members)["stiff"]
    assert isinstance(law, StrainStiffening)
    model = pulled(stiff=law)
    assert model.variable("rubber.stiff.strain").maximum == 6.0
    far = {"grip.position": lambda t: 6.5 * LENGTH * t, "grip.speed": lambda t: 6.5 * LENGTH}
    trace = simulate(model, np.linspace(0.0, 1.0, 41), inputs=far)
    assert any("rubber.stiff.strain" in str(warning) for warning in trace.warnings)


def test_an_actuator_gets_another_rubber_in_the_old_sizes() -> None:
    published = declare(load_deck("austin2015_figure_consistent"))
    made = with_rubber(published, material("Ecoflex_00-30"))
    old, new = published["spring.rubber"], made["spring.rubber"]
    assert isinstance(old, Specimen)
    assert isinstance(new, Specimen)
    assert (new.section, new.rest_length) == (old.section, old.rest_length)
    assert new.strength != old.strength
    assert [name for name, _ in new.members] == ["stiff"]
    assert with_rubber(made, material("Ecoflex_00-30"), piece="spring.rubber") == made
    assert declare(read_deck(deck_text(made), Path("a.toml"))) == made
    curve = material("Ecoflex_00-30")["nominal_stress"]
    model = flatten(made)
    half = curve.quantity.values[1]
    angles = np.linspace(0.0, 1.1, 200)
    found = [model.evaluate([a, 0.0], [0.0]) for a in angles]
    strains = np.array([f["spring.rubber.strain"] for f in found])
    forces = np.array([f["spring.rubber.force"] for f in found])
    assert np.interp(0.5, strains, forces) == pytest.approx(1e-4 * half, rel=0.06)
    assert {n for n in made.quantities() if n.startswith("spring.cam")} == {
        n for n in published.quantities() if n.startswith("spring.cam")
    }


def two_pieces() -> Assembly:
    published = declare(load_deck("austin2015_as_printed"))
    second = specimen(area=1e-4, rest_length=0.02, gum=LinearElastic(modulus=1e6))
    with_second = published.element("spring")
    return assembly(
        "two",
        **dict(published.parts),
        other=dict(assembly("x", **dict(published.parts)).parts)["spring"].around(  # type: ignore[attr-defined]
            with_second.with_children({**with_second.children(), "rubber": second})
        ),
    )


@pytest.mark.parametrize(
    ("make", "said"),
    [
        (
            lambda: with_rubber(declare(load_deck("austin2015_soft_spring")), material("PMC-770")),
            "has no piece of rubber",
        ),
        (
            lambda: with_rubber(two_pieces(), material("PMC-770")),
            "one of: spring.rubber, other.rubber",
        ),
        (
            lambda: with_rubber(two_pieces(), material("PMC-770"), piece="spring.ruber"),
            "did you mean 'spring.rubber'",
        ),
        (lambda: rubber_of(material("PMC-770"), rest_length=0.02), "has no cross-section"),
        (lambda: rubber_of(material("EPDM"), area=1e-4, rest_length=0.02), "has no elastic law"),
    ],
)
def test_what_cannot_be_swapped_is_named(make: object, said: str) -> None:
    with pytest.raises(NlsError) as caught:
        make()  # type: ignore[operator]
    assert said in str(caught.value)


def test_the_range_of_the_data_never_widens_that_of_the_form() -> None:
    for far, high in ((3.0, 3.0), (10.0, 6.0)):
        law = Ogden(moduli=(1e6,), exponents=(2.0,), data=FittedRange(fitted_strain=far))
        assert law.valid == (-0.6, high)
