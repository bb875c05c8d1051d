"""One law in several domains and readings: what decides them, how decks say them, what is refused."""

from __future__ import annotations

from pathlib import Path

import pytest

from nlsdesign import components
from nlsdesign.components import (
    MATERIAL,
    ROTATION,
    TRANSLATION,
    Backlash,
    CapstanFriction,
    CoulombFriction,
    Driven,
    EndStop,
    Fixed,
    Guide,
    Inertia,
    Inertial,
    LinearElastic,
    Mass,
    Part,
    Regularised,
    Rounded,
    Sharp,
    Slack,
    Spring,
    StribeckFriction,
    WrapProduct,
    assembly,
    smoothed,
    tie,
)
from nlsdesign.components.assembly.deck_writer import deck_problems, deck_text, declare
from nlsdesign.components.assembly.part_text import COMPONENTS, NUMBERS
from nlsdesign.foundation.deck import Deck, read_deck
from nlsdesign.foundation.errors import ArrangementError, UnitError, UnknownNameError
from nlsdesign.foundation.quantity import Quantity
from nlsdesign.model import flatten

STIFFNESS = Quantity(3.4, "N*m/rad", "bench")


def deck(text: str) -> Deck:
    return read_deck("[deck]\nname = 'a'\n" + text, Path("a.toml"))


def number(value: float, unit: str) -> str:
    return f"{{value = {value}, unit = '{unit}', source = 'bench'}}"


def table(name: str, component: str, **fields: str) -> str:
    return "\n".join(
        [f"[{name}]", f"component = '{component}'", *(f"{k} = {v}" for k, v in fields.items()), ""]
    )


WHEEL = table("wheel", "Inertia", inertia=number(1e-3, "kg*m^2"))
CART = table("cart", "Mass", mass=number(1.0, "kg"))


# --- what decides the domain ----------------------------------------------------------------------


def test_the_domain_is_stated_or_told_by_the_units_or_the_usual_one() -> None:
    assert Spring(stiffness=3.4, domain=ROTATION).stiffness.unit == "N*m/rad"
    assert Spring(stiffness=STIFFNESS).domain == ROTATION
    assert Spring(stiffness=3.4).domain == TRANSLATION
    # A bare number beside one with a unit is taken in the same domain.
    friction = StribeckFriction(sliding_effort=Quantity(2.0, "N"), breakaway=1.0, stribeck_speed=0.1)
    assert (friction.domain, friction.breakaway.unit, friction.stribeck_speed.unit) == (
        TRANSLATION,
        "N",
        "m/s",
    )


def test_a_wrapper_takes_the_domain_of_what_it_holds() -> None:
    def wrapped(stiffness: Quantity | float) -> Backlash:
        return Backlash(gap=0.01, members=(("s", Spring(stiffness=stiffness)),), contact=Rounded(width=1e-3))

    turning, sliding = wrapped(STIFFNESS), wrapped(3.4)
    assert (turning.gap.unit, turning.contact.width.unit) == ("rad", "rad")
    assert (sliding.gap.unit, sliding.contact.width.unit) == ("m", "m")


def test_units_of_two_domains_give_one_error_that_names_the_odd_one() -> None:
    mixed = {"sliding_effort": Quantity(0.02, "N*m"), "stribeck_speed": Quantity(0.5, "rad/s")}
    with pytest.raises(UnitError, match=r"breakaway = 3 N: 'N' does not measure .* in rotation -> .*'N\*m'"):
        StribeckFriction(**mixed, breakaway=Quantity(3.0, "N"))
    with pytest.raises(UnitError, match=r"stiffness = 3\.4 N·m/rad.*in translation"):
        Spring(stiffness=STIFFNESS, domain=TRANSLATION)
    with pytest.raises(ArrangementError, match="must be one of translation, rotation"):
        Spring(stiffness=1.0, domain=MATERIAL)


def test_a_law_is_no_wrapper_of_another_domain() -> None:
    law = (("law", LinearElastic(modulus=1e6)),)
    with pytest.raises(ArrangementError, match="Backlash acts on angle and torque or extension and force"):
        Backlash(gap=0.01, members=law)
    with pytest.raises(ArrangementError, match=r"WorkHeat.*put it around the specimen"):
        components.SelfHeating(members=law, heat=components.WorkHeat(halving_work=1.0, cooling_time=1.0))
    with pytest.raises(ArrangementError, match=r"contact = Inertial.*must be one of Sharp"):
        Slack(length=0.1, members=(("s", Spring(stiffness=1.0)),), contact=Inertial(inertia=1.0))


# --- decks ----------------------------------------------------------------------------------------


def test_a_deck_tells_the_domain_by_units_and_states_it_where_no_number_has_one() -> None:
    made = assembly(
        "a",
        grip=Driven(domain=TRANSLATION), clamp=Fixed(domain=TRANSLATION), wheel=Inertia(inertia=1.0),
        bench=Fixed(), pull=tie(Spring(stiffness=2.0), "grip", "clamp"),
        twist=tie(Spring(stiffness=2.0, domain=ROTATION), "wheel", "bench"),
    )  # fmt: skip
    text = deck_text(made)
    assert text.count('domain = "translation"') == text.count("domain =") == 2
    assert declare(read_deck(text, Path("a.toml"))) == made
    wrong = deck(table("grip", "Driven", domain="'sideways'"))
    (problem,) = deck_problems(wrong)
    assert "not a domain of Driven" in str(problem)
    assert "rotation, translation" in str(problem)


def test_a_deck_tells_the_reading_by_the_numbers_that_are_there() -> None:
    effort = number(0.02, "N*m")
    sharp = declare(deck(WHEEL + table("rub", "CoulombFriction", between="['wheel']", sliding_effort=effort)))
    assert sharp.element("rub") == CoulombFriction(sliding_effort=Quantity(0.02, "N*m", "bench"))
    creeping = table(
        "rub",
        "CoulombFriction",
        between="['wheel']",
        sliding_effort=effort,
        creep_speed=number(0.02, "rad/s"),
    )
    read = declare(deck(WHEEL + creeping))
    assert isinstance(read.element("rub").contact, Regularised)  # type: ignore[attr-defined]
    assert "rub.creep_speed" in read.quantities()
    for made in (sharp, read):
        assert declare(read_deck(deck_text(made), Path("a.toml"))) == made


def test_numbers_of_two_readings_are_refused_with_both_named() -> None:
    inner = table("backlash.s", "Spring", stiffness=number(3.4, "N*m/rad"))
    both = {"width": number(1e-3, "rad"), "inertia": number(1e-4, "kg*m^2")}
    text = table("backlash", "Backlash", between="['wheel']", gap=number(0.01, "rad"), **both) + inner
    (problem,) = deck_problems(deck(WHEEL + text))
    assert "width (Rounded); or inertia and contact_time (Inertial), not inertia and width" in str(problem)


def test_a_reading_without_default_is_asked_for() -> None:
    inner = table("soft.s", "Spring", stiffness=number(3.4, "N/m"))
    (problem,) = deck_problems(deck(CART + table("soft", "StressSoftening", between="['cart']") + inner))
    assert "StressSoftening needs 'softening'" in str(problem)


def test_numbers_of_a_reading_change_with_the_others() -> None:
    made = assembly(
        "a", m=Mass(mass=1.0), rub=tie(CoulombFriction(sliding_effort=Quantity(2.0, "N")).smooth(), "m")
    )
    changed = made.with_values({"rub.creep_speed": 0.5, "rub.sliding_effort": 3.0})
    assert flatten(changed).values["rub.creep_speed"] == 0.5
    assert changed.element("rub").parameters()["sliding_effort"].number == 3.0
    assert made.quantities()["rub.creep_speed"].number == 1e-3


def test_smooth_forms_are_the_same_law_with_another_contact() -> None:
    inside = (("s", Spring(stiffness=STIFFNESS)),)
    laws = {
        "rub": CoulombFriction(sliding_effort=0.1),
        "gap": Backlash(gap=0.01, members=inside),
        "stop": EndStop(lower=-1.0, upper=1.0, stiffness=10.0, damping=0.0),
    }
    made = assembly("a", wheel=Inertia(inertia=1e-3), **{n: tie(law, "wheel") for n, law in laws.items()})
    smooth = smoothed(made, {"gap": 2e-3})
    for name, law in laws.items():
        assert isinstance(law.contact, Sharp)
        assert type(smooth.element(name)) is type(law)
        assert smooth.element(name).is_smooth
    assert smooth.quantities()["gap.width"].number == 2e-3
    assert smoothed(smooth) == smooth


def test_the_capstan_takes_friction_and_angle_or_their_product() -> None:
    members = (("s", Spring(stiffness=2.0)),)
    apart = CapstanFriction(members=members, guide=Guide(friction=0.2, wrap_angle=0.5))
    product = CapstanFriction(members=members, guide=WrapProduct(wrap=0.1))
    state, rate = {"it.extension": 0.1}, 0.3

    def force(law: CapstanFriction) -> float:
        model = flatten(assembly("a", grip=Driven(domain=TRANSLATION), it=tie(law, "grip")))
        return float(model.evaluate([], [state["it.extension"], rate])["it.force"])

    assert force(apart) == pytest.approx(force(product), rel=1e-15)
    assert force(apart) > 0.2


# --- old names ------------------------------------------------------------------------------------


@pytest.mark.parametrize("old", COMPONENTS)
def test_an_old_component_name_says_the_new_one(old: str) -> None:
    new = COMPONENTS[old].partition(",")[0].split()[0]
    assert issubclass(getattr(components, new), Part)
    with pytest.raises(UnknownNameError, match=f"component '{old}'.*write {new}"):
        getattr(components, old)
    (problem,) = deck_problems(deck(WHEEL + table("x", old, between="['wheel']")))
    assert f"write {new}" in str(problem)
    assert "line" in str(problem) or ":" in str(problem)


@pytest.mark.parametrize("old", NUMBERS)
def test_an_old_name_of_a_number_says_the_new_one(old: str) -> None:
    text = table("x", "CoulombFriction", between="['wheel']", **{old: number(0.1, "N*m")})
    (problem,) = deck_problems(deck(WHEEL + text))
    assert f"has no field '{old}'" in str(problem)
    assert NUMBERS[old] in str(problem)


def test_a_name_that_never_was_is_an_ordinary_mistake() -> None:
    with pytest.raises(AttributeError, match="Sprung"):
        components.Sprung  # noqa: B018


def test_a_reading_that_is_none_is_refused_by_its_name() -> None:
    with pytest.raises(ArrangementError, match=r"contact = .sharp.*must be one of Sharp"):
        CoulombFriction(sliding_effort=1.0, contact="sharp")
