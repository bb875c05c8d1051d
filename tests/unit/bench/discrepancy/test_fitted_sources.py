"""A fitted number says to which records, on which day, and what was declared before any fit."""

from __future__ import annotations

import math

import numpy as np
import pytest

from nlsdesign.bench.discrepancy.effects.effect import Candidate, Unknown
from nlsdesign.bench.discrepancy.reporting.fitted_numbers import with_records_named
from nlsdesign.bench.discrepancy.reporting.refit import sourced
from nlsdesign.bench.discrepancy.selection.hypothesis import Hypothesis
from nlsdesign.bench.identification.least_squares import Fit
from nlsdesign.bench.identification.parameters import Parameter, declared_parameter
from nlsdesign.components import CoulombFriction, Inertia, assembly, tie
from nlsdesign.foundation.quantity import quantity
from nlsdesign.foundation.spread import NormalSpread, RelativeSpread
from nlsdesign.model import flatten


def body(source: str) -> object:
    return assembly("arm", motor=Inertia(inertia=quantity(1e-3, "kg*m^2", source=source)))


def source_of(before: str, names: list[str]) -> str:
    named = with_records_named(body(before), "bench/april", names, day="2026-04-20")
    return named.quantities()["motor.inertia"].source


def test_the_records_are_named_and_many_are_counted() -> None:
    names = ["a", "b", "c", "d", "e"]
    assert source_of("fitted to bench records", names[:2]) == (
        "fitted to bench records a, b in bench/april, 2026-04-20"
    )
    assert "records a, b, c and 2 more in" in source_of("fitted to bench records; a table, no law", names)


def test_after_a_second_fit_the_first_declaration_stays() -> None:
    once = source_of("fitted to bench records; declared: data sheet", ["a"])
    twice = source_of(f"fitted to bench records; declared: {once}", ["b"])
    assert twice == "fitted to bench records b in bench/april, 2026-04-20; declared: data sheet"


def test_a_number_of_which_records_tell_nothing_says_so() -> None:
    inertia = quantity(1e-3, "kg*m^2", source="data sheet", spread=0.1)
    made = assembly("arm", motor=Inertia(inertia=inertia))
    (variable,) = (v for v in flatten(made).parameters if v.name == "motor.inertia")
    known = declared_parameter(variable, 1.01e-3)
    for share, words in ((0.97, ", which leave 97 % of its spread"), (0.8, "")):
        covariance = np.diag([(share * known.sigma) ** 2])
        fit = Fit((known,), {known.name: 1.01e-3}, covariance, 0.0, {}, converged=True)
        marked = sourced(Hypothesis(made, (), dict(fit.values), {("motor",): fit}))
        named = with_records_named(marked, "bench", ["a"], day="2026-04-20").quantities()["motor.inertia"]
        assert named.source == f"fitted to bench records a in bench, 2026-04-20{words}; declared: data sheet"


def test_what_no_fit_has_marked_is_left_alone() -> None:
    earlier = "fitted to bench records a in bench/march, 2026-03-02; declared: data sheet"
    assert source_of("data sheet", ["b"]) == "data sheet"
    assert source_of(earlier, ["b"]) == earlier


def test_a_number_is_as_known_as_the_records_leave_it_where_nothing_is_missing() -> None:
    inertia = quantity(1e-3, "kg*m^2", source="data sheet", spread=0.1)
    friction = CoulombFriction(sliding_effort=quantity(0.05, "N*m")).smooth()
    made = assembly("arm", motor=Inertia(inertia=inertia), rubbing=tie(friction, "motor"))
    variables = {v.name: v for v in flatten(made).parameters}
    known = declared_parameter(variables["motor.inertia"], 1.1e-3)
    new = Parameter("rubbing.sliding_effort", "N*m", 0.08, 0.08, math.inf, 1e-4, 2.0, "log", 1.0)
    fit = Fit(
        (known, new), {known.name: 1.1e-3, new.name: 0.08}, np.diag([(0.25 * known.sigma) ** 2, 0.01**2]),
        0.0, {}, converged=True,
    )  # fmt: skip
    unknown = Unknown(new.name, (0.05,), 1e-4, 2.0)
    candidate = Candidate("coulomb_friction", "motor", made, (unknown,), "signature", "source")
    found = Hypothesis(made, (candidate,), dict(fit.values), {("motor",): fit})
    narrow, wide = (sourced(found, narrowed=each).quantities() for each in (True, False))
    # A quarter of the deviation of the logarithm, ln(1 + s).
    spread = narrow["motor.inertia"].spread
    assert isinstance(spread, RelativeSpread)
    assert math.log1p(spread.relative) == pytest.approx(0.25 * math.log(1.1))
    assert wide["motor.inertia"].spread == inertia.spread
    assert "declared: data sheet" in narrow["motor.inertia"].source
    for each in (narrow, wide):
        number = each["rubbing.sliding_effort"]
        assert number.spread == NormalSpread(fit.standard_error(new.name))
        assert number.source == "fitted to bench records"
