"""Errors: the four things that a message says, nearest names, and the way through a process pool."""

from __future__ import annotations

import pickle

import pytest

from nlsdesign.foundation import errors
from nlsdesign.foundation.errors import NlsError, nearest, unknown_name

KINDS = [c for c in vars(errors).values() if isinstance(c, type) and issubclass(c, NlsError)]


@pytest.mark.parametrize("kind", KINDS)
def test_every_error_pickles_with_all_it_says(kind: type[NlsError]) -> None:
    made = kind("deck.toml:3:1: spring.area", "is too large", did_you_mean="areas", next_step="divide")
    copy = pickle.loads(pickle.dumps(made))
    assert type(copy) is kind
    assert (copy.thing, copy.rule, copy.did_you_mean, copy.next_step) == (
        "deck.toml:3:1: spring.area",
        "is too large",
        "areas",
        "divide",
    )
    assert (
        str(copy) == str(made) == "deck.toml:3:1: spring.area: is too large; did you mean 'areas'? -> divide"
    )


def test_place_goes_in_front_and_the_kind_stays() -> None:
    made = errors.UnitError("area = 3 s", "wrong", next_step="mend").at("deck.toml:7:1: spring.area")
    assert type(made) is errors.UnitError
    assert str(made) == "deck.toml:7:1: spring.area: area = 3 s: wrong -> mend"


@pytest.mark.parametrize(
    ("name", "expected"),
    [
        ("motr", "motor"),
        ("spring.ruber.area", "spring.rubber.area"),
        ("viscositi", "spring.rubber.relaxing.dashpot.viscosity"),
        ("zzz", None),
    ],
)
def test_nearest_name(name: str, expected: str | None) -> None:
    valid = ["motor", "spring.rubber.area", "spring.rubber.relaxing.dashpot.viscosity"]
    assert nearest(name, valid) == expected


def test_unknown_name_lists_what_there_is_but_not_without_end() -> None:
    few = unknown_name("part", "x", ["b", "a"])
    assert few.next_step == "use one of: a, b"
    many = unknown_name("part", "x", [f"name{i}" for i in range(100)])
    assert many.next_step is not None
    assert many.next_step.endswith("...")
    assert len(many.next_step) < 200
    assert unknown_name("part", "x", []).next_step is None
