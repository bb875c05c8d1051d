"""Units that are run together or foreign are answered with what to write."""

from __future__ import annotations

import pytest

from nlsdesign.foundation.errors import UnitError
from nlsdesign.foundation.quantity import parse_unit


@pytest.mark.parametrize(
    ("wrong", "right"),
    [
        ("mNm", "mN*m"),
        ("Nm/rad", "N*m/rad"),
        ("kgcm2", "kg*cm^2"),
        ("gcm²", "g*cm^2"),
        ("kgm^2", "kg*m^2"),
        ("Nmm", "N*mm"),
        ("Nms/rad", "N*m*s/rad"),
        ("mNm/A", "mN*m/A"),
        ("kPas", "kPa*s"),
    ],
)
def test_products_need_their_sign(wrong: str, right: str) -> None:
    with pytest.raises(UnitError) as caught:
        parse_unit(wrong)
    assert caught.value.next_step == f"write '{right}'"
    assert parse_unit(right).factor > 0.0


@pytest.mark.parametrize(
    ("wrong", "step"),
    [("psi", "6.895 kPa"), ("lbf", "4.448 N"), ("in", "25.4 mm"), ("°C", "293.15 K"), ("N*turn", "'rev'")],
)
def test_foreign_units_are_given_in_the_si(wrong: str, step: str) -> None:
    with pytest.raises(UnitError) as caught:
        parse_unit(wrong)
    assert step in str(caught.value)
    assert caught.value.did_you_mean is None


@pytest.mark.parametrize(
    ("word", "factor"), [("psi", 6894.757), ("lbf", 4.448222), ("lb", 0.4535924), ("hp", 745.6999)]
)
def test_the_factors_that_are_named_are_right(word: str, factor: float) -> None:
    with pytest.raises(UnitError) as caught:
        parse_unit(word)
    number, unit = str(caught.value).partition("write ")[2].split()[:2]
    assert float(number) * parse_unit(unit).factor == pytest.approx(factor, rel=2e-4)
