"""Gears and motors: what they refuse, with names and places, and that they travel through a deck."""

from __future__ import annotations

import re
from pathlib import Path

import pytest

from nlsdesign.components import (
    Assembly,
    CurrentDrivenMotor,
    Driven,
    Fixed,
    Gear,
    Inertia,
    LossyGear,
    Mass,
    Part,
    VoltageDrivenMotor,
)
from nlsdesign.components.assembly.deck_writer import deck_problems, deck_text, declare
from nlsdesign.components.assembly.named_parts import assembly
from nlsdesign.foundation.deck import read_deck
from nlsdesign.foundation.errors import (
    ArrangementError,
    NlsError,
    UnitError,
    UnknownNameError,
    ValueRangeError,
)
from nlsdesign.foundation.quantity import quantity
from nlsdesign.model import flatten
from tests.parts.cable import WINDING


def geared(one: Part, other: Part, **gears: Gear) -> Assembly:
    return assembly(
        "a", one=one, other=other, **(gears or {"gear": Gear(between=("one", "other"), ratio=4.0)})
    )


WHEEL = Inertia(inertia=1e-3)

OVER_CONSTRAINED = {
    "two driven bodies": (lambda: geared(Driven(), Driven()), r"'one' and 'other' are both prescribed.*over"),
    "driven and fixed": (lambda: geared(Driven(), Fixed()), r"gear 'gear'.*both prescribed"),
    "driven and free": (
        lambda: geared(Driven(), WHEEL),
        r"'one' is prescribed, so nothing is left to move 'other'.*prescribe 'other' itself",
    ),
    "free and fixed": (lambda: geared(WHEEL, Fixed()), r"'other' is prescribed.*move 'one'"),
    "two gears side by side": (
        lambda: geared(
            WHEEL,
            WHEEL,
            first=Gear(between=("one", "other"), ratio=2.0),
            second=Gear(between=("other", "one"), ratio=0.5),
        ),
        r"gear 'second'.*'other' and 'one' are geared to each other already: over-constrained",
    ),
    "a body with itself": (
        lambda: geared(WHEEL, WHEEL, gear=Gear(between=("one", "one"), ratio=2.0)),
        r"gear 'gear'.*geared to each other already",
    ),
    "a sliding body": (
        lambda: geared(WHEEL, Mass(mass=1.0)),
        r"joins an angle and an angle; .*'other' has a position -> take Rack or Screw",
    ),
    "one end": (lambda: Gear(between=("one",), ratio=2.0), r"has 1 ends; a gear has two"),  # type: ignore[arg-type]
}


@pytest.mark.parametrize(("make", "message"), OVER_CONSTRAINED.values(), ids=list(OVER_CONSTRAINED))
def test_an_over_constrained_train_is_named(make: object, message: str) -> None:
    with pytest.raises(ArrangementError, match=message):
        make()  # type: ignore[operator]


def test_a_ring_of_three_is_over_constrained() -> None:
    gears = {
        "ab": Gear(between=("a", "b"), ratio=2.0),
        "bc": Gear(between=("b", "c"), ratio=2.0),
        "ca": Gear(between=("c", "a"), ratio=0.25),
    }
    with pytest.raises(ArrangementError, match="gear 'ca'"):
        assembly("ring", a=WHEEL, b=WHEEL, c=WHEEL, **gears)


def test_an_end_that_does_not_exist_is_named_with_the_nearest() -> None:
    with pytest.raises(UnknownNameError, match=r"'gear': body 'othr'.*did you mean 'other'"):
        geared(WHEEL, WHEEL, gear=Gear(between=("one", "othr"), ratio=2.0))


NUMBERS = {
    "no inertia": (lambda: CurrentDrivenMotor(**{**WINDING, "inertia": 0.0}), ValueRangeError, "inertia = 0"),
    "negative resistance": (
        lambda: VoltageDrivenMotor(**{**WINDING, "resistance": -0.3}, inductance=1e-4),
        ValueRangeError,
        "resistance = -0.3 Ω",
    ),
    "no inductance": (lambda: VoltageDrivenMotor(**WINDING, inductance=0.0), ValueRangeError, "inductance"),
    "ohms for henries": (
        lambda: VoltageDrivenMotor(**WINDING, inductance=quantity(0.1, "mOhm")),
        UnitError,
        r"inductance = 0\.1 mΩ.*like 'H'",
    ),
    "volts for amperes": (
        lambda: CurrentDrivenMotor(**{**WINDING, "current_limit": quantity(24.0, "V")}),
        UnitError,
        r"current_limit = 24 V.*like 'A'",
    ),
    "no ratio": (lambda: Gear(between=("a", "b"), ratio=0.0), ValueRangeError, "ratio zero moves nothing"),
    "more than all": (
        lambda: LossyGear(between=("a", "b"), ratio=2.0, efficiency=1.2, back_efficiency=0.8),
        ValueRangeError,
        r"efficiency = 1\.2.*\[0\.01, 1\]",
    ),
    "nothing back": (
        lambda: LossyGear(between=("a", "b"), ratio=2.0, efficiency=0.9, back_efficiency=0.0),
        ValueRangeError,
        "back_efficiency = 0",
    ),
}


@pytest.mark.parametrize(("make", "kind", "message"), NUMBERS.values(), ids=list(NUMBERS))
def test_a_number_that_cannot_be_is_named(make: object, kind: type[NlsError], message: str) -> None:
    with pytest.raises(kind, match=message):
        make()  # type: ignore[operator]


def drive() -> Assembly:
    return assembly(
        "drive",
        motor=VoltageDrivenMotor(**WINDING, inductance=8.2e-5),
        wheel=Inertia(inertia=1e-3),
        gear=LossyGear(between=("motor", "wheel"), ratio=4.0, efficiency=0.8, back_efficiency=0.7),
    )


def test_a_gear_travels_through_a_deck() -> None:
    again = declare(read_deck(deck_text(drive()), Path("drive.toml")))
    assert again.parts == drive().parts
    assert "motor ══ [gear] ══ wheel   LossyGear(ratio = 4" in str(again)
    assert len(flatten(again).states) == 3


@pytest.mark.parametrize(
    ("old", "new", "message"),
    [
        ('between = ["motor", "wheel"]\n', "", r"drive\.toml:\d+:\d+: gear: LossyGear needs 'between'"),
        ('["motor", "wheel"]', '["motor"]', r"gear: LossyGear needs 'between'.*\[\"motor\", \"wheel\"\]"),
        ('["motor", "wheel"]', '["motor", "whel"]', r"gear\.between.*'whel'.*did you mean 'wheel'"),
        (
            'component = "Inertia"\ninertia = {value = 0.001, unit = "kg*m^2", source = "not stated"}',
            'component = "Driven"',
            r"gear\.between.*'wheel' is prescribed",
        ),
        ("[wheel]", "[wheel]\nbetween = 3", r"wheel\.between.*no field 'between'"),
    ],
)
def test_a_mistake_in_the_deck_of_a_gear_has_its_place(old: str, new: str, message: str) -> None:
    text = deck_text(drive())
    assert old in text
    problems = deck_problems(read_deck(text.replace(old, new), Path("drive.toml")))
    assert any(re.search(message, str(problem)) for problem in problems), [str(p) for p in problems]
