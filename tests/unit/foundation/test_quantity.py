"""Units and quantities: parsing against factors typed by hand from the SI brochure, and round trips.

Independent road: the table EXPECTED is written as plain arithmetic here, not read from the package.
"""

from __future__ import annotations

import math
import pickle

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from nlsdesign.foundation.errors import UnitError, ValueRangeError
from nlsdesign.foundation.quantity import (
    Quantity,
    degrees,
    parse_unit,
    quantity,
    same_dimension,
    significant,
    sources,
    typeset_unit,
    with_unit,
)

KG, M, S, A, K, RAD = range(6)

EXPECTED = {
    # symbols that could be read in two ways
    "m": (1.0, {M: 1}),
    "mm": (1e-3, {M: 1}),
    "min": (60.0, {S: 1}),
    "h": (3600.0, {S: 1}),
    "Pa": (1.0, {KG: 1, M: -1, S: -2}),
    "mPa": (1e-3, {KG: 1, M: -1, S: -2}),
    "MPa": (1e6, {KG: 1, M: -1, S: -2}),
    "rad/s": (1.0, {RAD: 1, S: -1}),
    "mrad": (1e-3, {RAD: 1}),
    "kg": (1.0, {KG: 1}),
    "g": (1e-3, {KG: 1}),
    "mg": (1e-6, {KG: 1}),
    "cm^2": (1e-4, {M: 2}),
    "mm^2": (1e-6, {M: 2}),
    "cm²": (1e-4, {M: 2}),
    "kg·m²": (1.0, {KG: 1, M: 2}),
    "1/min": (1 / 60.0, {S: -1}),
    "rpm": (2 * math.pi / 60.0, {RAD: 1, S: -1}),
    "deg": (math.pi / 180.0, {RAD: 1}),
    "°": (math.pi / 180.0, {RAD: 1}),
    "%": (0.01, {}),
    "1": (1.0, {}),
    "N*m/rad": (1.0, {KG: 1, M: 2, S: -2, RAD: -1}),
    "mN*m/A": (1e-3, {KG: 1, M: 2, S: -2, A: -1}),
    "kPa*s": (1e3, {KG: 1, M: -1, S: -1}),
    "N*s/m": (1.0, {KG: 1, S: -1}),
    "1/N/s": (1.0, {KG: -1, M: -1, S: 1}),
    "m/s^2": (1.0, {M: 1, S: -2}),
    "m·s⁻²": (1.0, {M: 1, S: -2}),
    "mV": (1e-3, {KG: 1, M: 2, S: -3, A: -1}),
    "mH": (1e-3, {KG: 1, M: 2, S: -2, A: -2}),
    "kHz": (1e3, {S: -1}),
    "mOhm": (1e-3, {KG: 1, M: 2, S: -3, A: -2}),
    "W/K": (1.0, {KG: 1, M: 2, S: -3, K: -1}),
    " N * m ": (1.0, {KG: 1, M: 2, S: -2}),
}
PREFIXES = {"G": 1e9, "M": 1e6, "k": 1e3, "c": 1e-2, "m": 1e-3, "µ": 1e-6, "u": 1e-6, "n": 1e-9}
PREFIXED = ("g", "m", "s", "A", "N", "Pa", "J", "W", "V", "Hz", "rad", "Ohm", "H", "K")


@pytest.mark.parametrize("text", EXPECTED)
def test_unit_has_factor_and_dimension(text: str) -> None:
    factor, exponents = EXPECTED[text]
    unit = parse_unit(text)
    assert unit.factor == pytest.approx(factor, rel=1e-15)
    assert unit.exponents == tuple(exponents.get(i, 0) for i in range(6))


@pytest.mark.parametrize("prefix", PREFIXES)
@pytest.mark.parametrize("symbol", PREFIXED)
def test_every_prefix_multiplies(prefix: str, symbol: str) -> None:
    if prefix + symbol == "Grad":  # the German degree, which nobody means as a giga-radian
        with pytest.raises(UnitError, match="write 'deg'"):
            parse_unit("Grad")
        return
    plain, prefixed = parse_unit(symbol), parse_unit(prefix + symbol)
    assert prefixed.factor == pytest.approx(PREFIXES[prefix] * plain.factor, rel=1e-15)
    assert prefixed.exponents == plain.exponents


@pytest.mark.parametrize(("alike", "plain"), [("\u03bcm", "\u00b5m"), ("\u2126", "Ohm"), ("k\u2126", "kOhm")])
def test_letters_that_look_the_same_mean_the_same(alike: str, plain: str) -> None:
    """The Greek mu and the ohm sign are other characters than the micro sign and the Greek omega."""
    assert parse_unit(alike).factor == parse_unit(plain).factor
    assert parse_unit(alike).exponents == parse_unit(plain).exponents


TYPESET = {
    "1": "",
    "N*m": "N·m",
    "N*m*s^2/rad^2": "N·m·s²/rad²",
    "kg*m2": "kg·m²",
    "1/s": "1/s",
    "m*s^-2": "m·s⁻²",
    " N * m / rad": "N·m/rad",
    "mOhm": "mΩ",
    "kg·m²": "kg·m²",
    "%": "%",
    "°": "°",
}


@pytest.mark.parametrize("unit", TYPESET)
def test_a_unit_is_typeset_for_people(unit: str) -> None:
    assert typeset_unit(unit) == TYPESET[unit]
    assert with_unit("7", unit) == f"7 {TYPESET[unit]}".strip()


@pytest.mark.parametrize("unit", sorted(set(EXPECTED) - {"1"}))
def test_a_typeset_unit_reads_back_as_the_same(unit: str) -> None:
    shown = typeset_unit(unit)
    assert not set("*^ ") & set(shown)
    assert parse_unit(shown).factor == parse_unit(unit).factor
    assert parse_unit(shown).exponents == parse_unit(unit).exponents


@pytest.mark.parametrize(
    ("wrong", "near"), [("Newton", None), ("MPA", "MPa"), ("N*mm/radd", "rad"), ("sec", "s"), ("kgg", "kg")]
)
def test_unknown_unit_names_the_symbol_and_the_nearest(wrong: str, near: str | None) -> None:
    with pytest.raises(UnitError) as caught:
        parse_unit(wrong)
    assert wrong in str(caught.value)
    assert caught.value.next_step
    if near:
        assert caught.value.did_you_mean == near


@pytest.mark.parametrize(
    "wrong", ["", "N**m", "N*", "/m", "m^", "m^x", "3", "2*m", "m^1.5", "kkg", "mmin", "Pa²²x"]
)
def test_text_that_is_no_unit(wrong: str) -> None:
    with pytest.raises(UnitError):
        parse_unit(wrong)


finite = st.floats(min_value=-1e9, max_value=1e9, allow_nan=False).filter(lambda v: v == 0 or abs(v) > 1e-9)
units = st.sampled_from(sorted(EXPECTED))


@given(finite, units)
def test_shown_number_is_the_one_that_was_given(value: float, unit: str) -> None:
    assert quantity(value, unit).shown == pytest.approx(value, rel=1e-14, abs=0.0)


@given(st.lists(st.tuples(st.sampled_from(PREFIXED), st.integers(-3, 3)), min_size=1, max_size=4))
def test_products_and_quotients_add_exponents(factors: list[tuple[str, int]]) -> None:
    """Written with ``/`` or with negative powers, the unit is the same; exponents add."""
    first, *rest = factors
    quotient = f"{first[0]}^{first[1]}" + "".join(f"/{s}^{-p}" if p < 0 else f"*{s}^{p}" for s, p in rest)
    product = "*".join(f"{s}^{p}" for s, p in factors)
    sums = [sum(p * parse_unit(s).exponents[i] for s, p in factors) for i in range(6)]
    assert parse_unit(quotient).exponents == parse_unit(product).exponents == tuple(sums)
    assert parse_unit(quotient).factor == pytest.approx(parse_unit(product).factor, rel=1e-12)


def test_radian_counts_as_a_dimension() -> None:
    assert not same_dimension("N*m", "N*m/rad")
    assert not same_dimension("Hz", "rad/s")
    assert parse_unit("N*m").mechanical == parse_unit("N*m/rad").mechanical


@pytest.mark.parametrize("value", [math.nan, math.inf, -math.inf, (1.0, math.nan), ()])
def test_a_quantity_is_finite_and_not_empty(value: float | tuple[float, ...]) -> None:
    with pytest.raises(ValueRangeError):
        Quantity(value, "m")


@pytest.mark.parametrize("spread", [-0.1, math.nan])
def test_a_spread_is_not_negative(spread: float) -> None:
    with pytest.raises(ValueRangeError):
        Quantity(1.0, "m", spread=spread)


@pytest.mark.parametrize("given", [[1, 2.5], (1, 2.5), np.array([1, 2.5])])
def test_any_row_becomes_a_tuple_of_floats(given: object) -> None:
    for made in (Quantity(given, "m"), quantity(given, "m")):  # type: ignore[arg-type]
        assert made.value == (1.0, 2.5)
        assert all(type(v) is float for v in made.values)


@pytest.mark.parametrize("given", [3, np.float64(3), np.array(3.0)])
def test_any_number_becomes_a_float(given: object) -> None:
    made = quantity(given, "km")  # type: ignore[arg-type]
    assert made.value == 3000.0
    assert type(made.value) is float
    assert made.number == 3000.0


def test_a_row_is_not_one_number() -> None:
    with pytest.raises(ValueRangeError, match="row"):
        _ = Quantity((1.0, 2.0), "m").number


def test_a_copy_keeps_what_is_not_changed() -> None:
    first = quantity(12.5, "mm", source="bench", spread=0.04)
    unsourced = "not stated; changed from 12.5 mm: bench"
    assert first.with_value(0.02) == Quantity(0.02, "mm", unsourced, 0.04)
    assert first.with_value(0.0125) == first, "the same number keeps its source"
    assert first.with_value(0.02, "fit").source == "fit"
    assert first.value == 0.0125


def test_a_number_changed_without_a_source_says_so() -> None:
    first = quantity(12.5, "mm", source="Austin 2015, Table I")
    twice = first.with_value(0.02).with_value(0.03)
    assert twice.source == "not stated; changed from 12.5 mm: Austin 2015, Table I"
    assert twice.assumed
    assert not first.assumed
    assert quantity(1.0, "m").with_value(2.0).source == "not stated"
    row = quantity(tuple(float(i) for i in range(6)), "mm", source="table")
    changed = row.with_value((0.0,) * 6)
    assert changed.source == "not stated; changed from 6 numbers in mm: table"
    assert twice.with_value(0.02, "measured").source == "measured"


@pytest.mark.parametrize(
    ("source", "assumed"),
    [("assumed: order of magnitude", True), ("Assumed", True), ("not stated", True), ("Austin 2015", False)],
)
def test_assumption_is_told_from_evidence(source: str, assumed: bool) -> None:
    assert Quantity(1.0, "m", source).assumed is assumed


def test_share_of_assumed_numbers() -> None:
    numbers = {"a": Quantity(1.0, "m", "assumed: x"), "b": Quantity(1.0, "m", "bench"), "c": Quantity(1.0)}
    assert sources(numbers) == {"assumed": pytest.approx(2 / 3), "sourced": pytest.approx(1 / 3)}


def test_quantities_pickle_and_print() -> None:
    given = quantity((1.0, 2.0), "MPa", source="bench", spread=0.1)
    assert pickle.loads(pickle.dumps(given)) == given
    assert str(given) == "(1, 2) MPa"
    assert str(quantity(0.5, "1")) == "0.5"
    assert str(quantity(0.5, "N*m/rad")) == "0.5 N·m/rad"
    assert degrees(180.0) == pytest.approx(math.pi, rel=1e-15)


@pytest.mark.parametrize("noise", [0.0, 3e-16, -5e-15])
def test_what_is_written_does_not_depend_on_the_last_digits(noise: float) -> None:
    row = [0.016396776846523842, 0.0115, 1e-19]
    assert significant([v * (1.0 + noise) + noise * 1e-3 for v in row]) == (0.0163967768, 0.0115, 0.0)


def test_significant_digits_count_from_the_largest_number_of_a_row() -> None:
    assert significant([123456.0, -1.26], 6) == (123456.0, -1.0)
    assert significant([0.0, 0.0]) == (0.0, 0.0)
    assert significant([math.inf, 1.23456], 3) == (math.inf, 1.23)
