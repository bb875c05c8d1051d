"""Bad input to rubber laws and networks: each error names the thing, the rule and the place."""

from __future__ import annotations

import re
from collections.abc import Callable
from pathlib import Path

import pytest

from nlsdesign.components import (
    ROTATION,
    Dashpot,
    Driven,
    Element,
    HeatBalance,
    LinearElastic,
    NeoHooke,
    OgdenRoxburgh,
    Rounded,
    SelfHeating,
    Sharp,
    Spring,
    Springpot,
    StrainStiffening,
    StressSoftening,
    ViscousMaterial,
    Yeoh,
    burgers,
    generalised_maxwell,
    kelvin_voigt,
    maxwell,
    parallel,
    series,
    specimen,
    standard_linear_solid,
    tie,
)
from nlsdesign.components.assembly.deck_writer import deck_problems, declare
from nlsdesign.components.assembly.named_parts import assembly
from nlsdesign.foundation.deck import read_deck
from nlsdesign.foundation.errors import ArrangementError, NlsError, UnitError, ValueRangeError
from nlsdesign.foundation.quantity import quantity
from nlsdesign.model import flatten
from tests.stretched import deck_head

OUT_OF_RANGE: dict[str, tuple[Callable[[], Element], str]] = {
    "negative stiffness": (lambda: Spring(stiffness=-100.0), "stiffness = -100 N/m"),
    "negative modulus": (lambda: LinearElastic(modulus=-1e6), r"modulus = -1e\+06 Pa|modulus = -1000000 Pa"),
    "negative shear modulus": (lambda: NeoHooke(shear_modulus=-1e5), "shear_modulus = -100000 Pa"),
    "negative first constant": (lambda: Yeoh(c1=-1e5, c2=0.0, c3=0.0), "c1 = -100000 Pa"),
    "viscosity of zero": (lambda: ViscousMaterial(viscosity=0.0), "viscosity = 0 Pa"),
    "viscosity of zero in series": (lambda: maxwell(modulus=1e6, viscosity=0.0), "viscosity = 0 Pa"),
    "viscosity of zero in parallel": (lambda: kelvin_voigt(modulus=1e6, viscosity=0.0), "viscosity = 0 Pa"),
    "flow without viscosity": (
        lambda: burgers(modulus=1e6, flow=0.0, delayed_modulus=1e6, delayed_viscosity=1e3),
        "viscosity = 0 Pa",
    ),
    "relaxation time of zero": (
        lambda: generalised_maxwell(1e6, moduli=(1e5,), times=(0.0,)), "viscosity = 0 Pa",
    ),
    "negative branch": (
        lambda: standard_linear_solid(1e6, modulus=-1e5, viscosity=1e3), "modulus = -100000 Pa",
    ),
    "order of a dashpot": (
        lambda: Springpot(modulus=1e6, order=1.0, lower=0.1, upper=10.0), "order = 1",
    ),
    "no softening left": (
        lambda: StressSoftening(members=(("g", NeoHooke(shear_modulus=1e5)),),
            curve=OgdenRoxburgh(strength=0.5, scale=1e5)),
        "strength = 0.5",
    ),
    "heat capacity of zero": (
        lambda: SelfHeating(
            members=(("g", NeoHooke(shear_modulus=1e5)),),
            heat=HeatBalance(heat_capacity=0.0, cooling=0.0, softening=0.0)
        ),
        "heat_capacity = 0",
    ),
}  # fmt: skip


@pytest.mark.parametrize("name", OUT_OF_RANGE)
def test_a_number_that_no_rubber_has_is_named_with_its_range(name: str) -> None:
    make, message = OUT_OF_RANGE[name]
    with pytest.raises(ValueRangeError, match=message) as caught:
        make()
    assert "must lie in [" in str(caught.value)


@pytest.mark.parametrize("contact", [Sharp(), Rounded(width=0.01)])
def test_crossing_knots_are_named_with_both(contact: Sharp | Rounded) -> None:
    with pytest.raises(ValueRangeError, match=r"knots 0\.3 and 0\.1: knots cross.*sort"):
        StrainStiffening(modulus=(1e6, 1e6, 1e6), knots=(0.0, 0.3, 0.1), contact=contact)
    with pytest.raises(ValueRangeError, match=r"knots \(1\) and modulus \(2\)"):
        StrainStiffening(modulus=(1e6, 1e6), knots=(0.0,), contact=contact)


def test_an_impossible_unit_is_named() -> None:
    with pytest.raises(UnitError, match=r"shear_modulus = 3 N: 'N' does not measure shear modulus"):
        NeoHooke(shear_modulus=quantity(3.0, "N"))
    with pytest.raises(UnitError, match="'s' does not measure viscosity"):
        maxwell(modulus=1e6, viscosity=quantity(3.0, "s"))


def test_a_dashpot_of_zero_in_series_is_found_where_it_is() -> None:
    chain = series(k=Spring(stiffness=1.0, domain=ROTATION), oil=Dashpot(damping=0.0, domain=ROTATION))
    made = assembly(
        "a",
        shaft=Driven(),
        left=tie(Spring(stiffness=2.0, domain=ROTATION), "shaft"),
        right=tie(chain, "shaft"),
    )
    with pytest.raises(
        ArrangementError, match=r"singular: der\(right\.oil\.angle\).*zero stiffness in series"
    ):
        flatten(made)


OVER_CONSTRAINED: dict[str, tuple[Callable[[], object], str]] = {
    "law of stress beside a spring": (
        lambda: parallel(a=Spring(stiffness=1e3), b=LinearElastic(modulus=1e6)),
        "Parallel member 'b'.*relates strain and stress, the others extension and force",
    ),
    "spring inside a specimen": (
        lambda: specimen(area=1e-4, rest_length=0.01, a=Spring(stiffness=1e3)),
        "Specimen member 'a'.*Specimen acts on strain and stress.*LinearElastic instead of Spring",
    ),
    "two laws of one name": (
        lambda: series(**{"k": Spring(stiffness=1e3), "component": Spring(stiffness=1e3)}),
        "name 'component'.*is taken",
    ),
    "nothing in parallel": (lambda: parallel(), "needs at least one element"),
    "dashpot that cannot soften": (
        lambda: StressSoftening(
            members=(("d", ViscousMaterial(viscosity=1e3)),), curve=OgdenRoxburgh(strength=2.0, scale=1e5)
        ),
        "Softening member 'd': is a ViscousMaterial, which does not say its strain energy",
    ),
}


@pytest.mark.parametrize("name", OVER_CONSTRAINED)
def test_arrangements_without_a_solution_are_named(name: str) -> None:
    make, message = OVER_CONSTRAINED[name]
    with pytest.raises(ArrangementError, match=message):
        make()


DECK = (
    deck_head("gum", area=100)
    + """[rubber.law]
component = "Ogden"
moduli = {value = [0.6, 0.001], unit = "MPa", source = "test"}
exponents = {value = [1.3, 5.0], unit = "1", source = "test"}
"""
)


def problem(old: str, new: str) -> NlsError:
    assert old in DECK
    (found,) = deck_problems(read_deck(DECK.replace(old, new), Path("gum.toml")))
    return found


def test_a_deck_of_large_stretch_is_sound() -> None:
    assert flatten(declare(read_deck(DECK, Path("gum.toml")))).name == "gum"


@pytest.mark.parametrize(
    ("old", "new", "message"),
    [
        ('component = "Ogden"', 'component = "Ogdne"', r"gum\.toml:13:1: .*did you mean 'Ogden'"),
        ("[1.3, 5.0]", "[1.3, -5.0]", r"gum\.toml:12:1: .*modulus 1000 Pa with exponent -5.*same sign"),
        ("[1.3, 5.0]", "[1.3]", r"gum\.toml:12:1: .*one exponent per modulus"),
        ('unit = "MPa"', 'unit = "kN"', r"gum\.toml:14:1: .*'kN' does not measure moduli"),
        ("exponents =", "exponent =", r"gum\.toml:15:1: .*did you mean 'exponents'"),
    ],
)
def test_a_deck_says_file_line_and_field(old: str, new: str, message: str) -> None:
    assert re.search(message, str(problem(old, new)))
