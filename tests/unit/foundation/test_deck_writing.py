"""Writing decks: what is written reads back equal, bit for bit, and a failing write leaves the old file.

Independent road: equality of frozen dataclasses after a round trip through TOML text; the text itself is
read by ``tomllib`` once more, with exact decimal arithmetic.
"""

from __future__ import annotations

import os
import tomllib
from decimal import Decimal
from fractions import Fraction
from pathlib import Path

import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from nlsdesign.components import (
    TRANSLATION,
    Assembly,
    Driven,
    Encoder,
    Fixed,
    ForceSensor,
    GearedMotor,
    LinearElastic,
    Pulley,
    Spring,
    StrainStiffening,
    TransportDelay,
    TwoSidedCam,
    ViscousMaterial,
    parallel,
    pull_only,
    series,
    specimen,
    through,
    tie,
)
from nlsdesign.components.assembly.deck_writer import (
    deck_text,
    declare,
    numbers_of,
    require_same_numbers,
    write_deck,
)
from nlsdesign.components.assembly.named_parts import assembly
from nlsdesign.foundation.deck import deck_names, load_deck, read_deck
from nlsdesign.foundation.errors import DeckError, ExportError, NlsError
from nlsdesign.foundation.quantity import Quantity, parse_unit, quantity

HERE = Path("made.toml")


def large() -> Assembly:
    """Every kind of table: rows, nested parts, ties to the frame, sensors."""
    rubber = specimen(
        area=quantity(1.0, "cm^2", source="drawing 7", spread=0.05),
        rest_length=quantity(12.5, "mm"),
        stiff=StrainStiffening(modulus=(0.92e6, 0.58e6), knots=(0.0, 0.016)),
        relaxing=series(spring=LinearElastic(modulus=0.58e6), dashpot=ViscousMaterial(viscosity=411.0)),
    )
    chain = series(cable=pull_only(steel=Spring(stiffness=5e4)), rubber=rubber)
    cam = TwoSidedCam(lever_arm=(0.01, 0.011, 0.012, 0.013, 0.014), last_angle=quantity(65, "deg"))
    return assembly(
        "large",
        description='quotes " and \\ and\nlines',
        motor=GearedMotor(inertia=5.97e-4, gear_ratio=4, torque_constant=quantity(55.0, "mN*m/A")),
        load=Fixed(),
        spring=tie(through(cam, chain=chain, pretension=quantity(1.0, "mm")), "motor", "load"),
        second=tie(
            through(Pulley(radius=0.01), both=parallel(a=Spring(stiffness=1), b=Spring(stiffness=2))), "motor"
        ),
        encoder=Encoder(of="motor.angle", quantum=quantity(0.767, "mrad")),
        cell_delay=TransportDelay(of="spring.chain.rubber.force", delay=quantity(2, "ms")),
        cell=ForceSensor(of="cell_delay.reading"),
    )


def round_trip(made: Assembly) -> Assembly:
    return declare(read_deck(deck_text(made), HERE))


def test_a_large_assembly_comes_back_equal() -> None:
    made = large()
    assert round_trip(made) == made
    assert deck_text(round_trip(made)) == deck_text(made)


@pytest.mark.parametrize("name", deck_names())
def test_decks_of_the_project_come_back_equal(name: str) -> None:
    made = declare(load_deck(name))
    assert round_trip(made) == made


ANY = st.characters(exclude_categories=["Cs"])
"""What UTF-8 can write, as characters are by default; but that takes three seconds to list."""
units = st.sampled_from(["N/m", "kN/m", "N/mm", "mN/m", "N/cm", "kg/s^2", "MN/m"])


@given(
    st.floats(min_value=1e-5, max_value=1e11),
    units,
    st.floats(0.0, 2.0),
    st.text(ANY, min_size=1).filter(str.strip),
)
def test_any_number_comes_back_bit_for_bit(value: float, unit: str, spread: float, source: str) -> None:
    """Also where no float times the factor of the unit is the value: then more digits are written."""
    given_number = Quantity(value, unit, source, spread)
    made = assembly(
        "one", point=Driven(domain=TRANSLATION), spring=tie(Spring(stiffness=given_number), "point")
    )
    assert round_trip(made) == made


@settings(max_examples=settings.default.max_examples)
@given(
    st.lists(st.floats(min_value=-0.04, max_value=0.9), min_size=5, max_size=12),
    st.sampled_from(["mm", "cm", "µm", "m"]),
)
def test_any_row_comes_back_bit_for_bit(values: list[float], unit: str) -> None:
    cam = TwoSidedCam(lever_arm=Quantity(tuple(values), unit, "drawing"), last_angle=1.0)
    made = assembly(
        "row",
        m=GearedMotor(inertia=1, gear_ratio=1, torque_constant=1),
        s=tie(through(cam, k=Spring(stiffness=1)), "m"),
    )
    assert round_trip(made) == made


def test_numbers_are_written_short_where_that_is_exact() -> None:
    text = deck_text(large())
    for short in ("value = 12.5, unit", "value = 55.0, unit", "value = 0.767, unit", "value = 65.0, unit"):
        assert short in text


@given(st.floats(min_value=1e-6, max_value=1e6))
def test_written_text_is_the_number_to_half_a_digit(value: float) -> None:
    """Exact decimal reading of the text times the factor rounds to the value."""
    made = assembly(
        "one",
        point=Driven(domain=TRANSLATION),
        s=tie(Spring(stiffness=Quantity(value, "N/mm", "x")), "point"),
    )
    raw = tomllib.loads(deck_text(made), parse_float=Decimal)["s"]["stiffness"]["value"]
    assert float(Fraction(raw) * Fraction(parse_unit("N/mm").factor)) == value


@pytest.mark.parametrize("text", ["tab\there", "ümlaut ∂ 力", 'a "b" \\c', "two\nlines", "a\u200db"])
def test_any_text_comes_back(text: str) -> None:
    made = Assembly("a", (("point", Driven(domain=TRANSLATION)),), text)
    assert round_trip(made).description == text


@pytest.mark.parametrize(
    ("text", "shown"),
    [
        ("nul\x00", "nul\\x00"),
        ("bell\x07", "bell\\x07"),
        ("delete\x7f", "delete\\x7f"),
        ("red\x1b[31m", "red\\x1b[31m"),
        ("\x9b2J", "\\x9b2J"),
        ("\r\n", "\\x0d\n"),
        ("turned \u202egnp.exe", "turned \\u202egnp.exe"),
    ],
)
def test_control_characters_are_written_out_and_stay_so(text: str, shown: str) -> None:
    """In names, descriptions and sources, whether they come from Python or from a deck."""
    spring = Spring(stiffness=Quantity(1.0, "N/m", text))
    made = Assembly("a" + text, (("point", Driven(domain=TRANSLATION)), ("s", tie(spring, "point"))), text)
    assert made.name == "a" + shown
    assert made.description == shown
    assert made.quantities()["s.stiffness"].source == shown
    assert round_trip(made) == made


def test_write_makes_folders_and_leaves_no_draft(tmp_path: Path) -> None:
    target = tmp_path / "new" / "deck.toml"
    write_deck(large(), target)
    assert declare(load_deck(target)) == large()
    assert [path.name for path in target.parent.iterdir()] == ["deck.toml"]


@pytest.mark.parametrize("step", ["write_text", "replace"])
def test_a_failing_write_leaves_the_old_file(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, step: str
) -> None:
    target = tmp_path / "deck.toml"
    target.write_text("old", encoding="utf8")

    def full(*_: object, **__: object) -> None:
        raise OSError("no space left on device")

    if step == "replace":
        monkeypatch.setattr(os, "replace", full)
    else:
        monkeypatch.setattr(Path, "write_text", full)
    with pytest.raises(ExportError, match=r"cannot be written .no space"):
        write_deck(large(), target)
    monkeypatch.undo()
    assert target.read_text(encoding="utf8") == "old"
    assert [path.name for path in tmp_path.iterdir()] == ["deck.toml"]


def test_numbers_of_a_table_are_checked_against_the_component() -> None:
    deck = read_deck(deck_text(large()), HERE)
    assert numbers_of(deck, "motor", GearedMotor)["gear_ratio"].number == 4
    with pytest.raises(DeckError, match=r"made\.toml:\d+:\d+: spring\.cam: this model has a Pulley here"):
        numbers_of(deck, "spring.cam", Pulley)
    with pytest.raises(DeckError, match="this model has a Pulley here"):
        numbers_of(deck, "spring.nowhere", Pulley)
    slip = read_deck(deck_text(large()).replace("gear_ratio", "gear_ration"), HERE)
    with pytest.raises(DeckError) as caught:
        numbers_of(slip, "motor", GearedMotor)
    assert caught.value.did_you_mean == "gear_ratio"


def test_a_deck_with_more_numbers_than_the_model_is_refused() -> None:
    deck = read_deck(deck_text(large()), HERE)
    smaller = large().without_part("second")
    with pytest.raises(NlsError, match=r"second\."):
        require_same_numbers(smaller, deck)
    assert require_same_numbers(large(), deck) == large()
