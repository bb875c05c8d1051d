"""Numbers as they are typed where decimals have a comma and degrees are Grad."""

from __future__ import annotations

import pytest

from nlsdesign.foundation.errors import UnitError
from nlsdesign.foundation.quantity import parse_unit
from nlsdesign.foundation.written_numbers import split_number
from tests.command_line import Run, run

__all__ = ["run"]
DECK = "austin2015_soft_spring"


@pytest.mark.parametrize(
    ("text", "step"),
    [
        ("2,5 A", "write '2.5 A'"),
        ("0,02kg·m²", "write '0.02 kg·m²'"),
        ("-1,5e-3 m", "write '-1.5e-3 m'"),
        ("0,125", "write '0.125'"),
        ("1,500 N", "write '1.500 N' or '1500 N'"),
        ("1,234,567.8 N", "write it without commas"),
    ],
)
def test_a_comma_is_answered_with_what_to_write(text: str, step: str) -> None:
    with pytest.raises(UnitError) as caught:
        split_number(text)
    assert "has a comma" in str(caught.value)
    assert caught.value.next_step == step


@pytest.mark.parametrize(
    ("unit", "step"),
    [("Grad", "'deg'"), ("Grad/s", "'deg'"), ("U/min", "'rpm'"), ("qmm", "'mm^2'")],
)
def test_units_of_another_language_are_not_read_as_ours(unit: str, step: str) -> None:
    with pytest.raises(UnitError) as caught:
        parse_unit(unit)
    assert step in str(caught.value.next_step)


def test_units_as_they_are_typed_are_ours() -> None:
    for typed, ours in (("°", "deg"), ("mm²", "mm^2"), ("mm2", "mm^2"), ("N·m", "N*m"), ("mrad", "mrad")):
        assert parse_unit(typed).factor == parse_unit(ours).factor
        assert parse_unit(typed).exponents == parse_unit(ours).exponents


@pytest.mark.parametrize(
    ("words", "message"),
    [
        (("simulate", "--deck", DECK, "--stop", "0,5 s"), "--stop: '0,5 s': has a comma"),
        (
            ("simulate", "--deck", DECK, "--stop", "1 s", "--value", "motor.inertia=0,02 kg*m^2"),
            "0.02 kg*m^2",
        ),
        (("simulate", "--deck", DECK, "--stop", "1 s", "--input", "motor.current=2,5 A"), "write '2.5 A'"),
        (("simulate", "--deck", DECK, "--stop", "1 s", "--initial", "motor.angle=10 Grad"), "write 'deg'"),
        (("design", "--deck", DECK, "--maximum", "5 Nm", "--angle", "53°"), "--maximum: unit 'Nm'"),
        (
            ("design", "--deck", DECK, "--maximum", "5 N·m", "--angle", "53,5°"),
            "--angle: '53,5°': has a comma",
        ),
        (
            (
                *("design", "--deck", DECK, "--target"),
                'ExponentialTorque = {maximum = "4,3 N*m", angle = "9°", shape = 1}',
            ),
            "write '4.3 N*m'",
        ),
    ],
)
def test_the_option_is_named_beside_the_number(words: tuple[str, ...], message: str, run: Run) -> None:
    status, out, err = run(*words)
    assert (status, out) == (2, "")
    assert message in err
