"""A fitted number says to which records, on which day, and what was declared before any fit."""

from __future__ import annotations

from nlsdesign.bench.discrepancy.reporting.fitted_numbers import with_records_named
from nlsdesign.components import Inertia, assembly
from nlsdesign.foundation.quantity import quantity


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


def test_what_no_fit_has_marked_is_left_alone() -> None:
    earlier = "fitted to bench records a in bench/march, 2026-03-02; declared: data sheet"
    assert source_of("data sheet", ["b"]) == "data sheet"
    assert source_of(earlier, ["b"]) == earlier
