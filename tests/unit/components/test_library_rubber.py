"""A rubber of the library by its name in a deck, with numbers of one's own over those of the library."""

from __future__ import annotations

from pathlib import Path

import pytest

from nlsdesign.components import Assembly, Specimen, material
from nlsdesign.components.assembly.deck_writer import deck_problems, deck_text, declare
from nlsdesign.components.assembly.library_rubber import with_rubber
from nlsdesign.foundation.deck import read_deck
from tests.stretched import deck_head

HEAD = deck_head("strip", area=20)
MATERIAL = 'material = "PMC-770"\n'
ENGAGING = 'using = "engaging_moduli_2015"\n'
PLAIN = '[rubber.law]\ncomponent = "LinearElastic"\nmodulus = {value = 1, unit = "MPa", source = "test"}\n'


def declared(text: str) -> Assembly:
    return declare(read_deck(HEAD + text, Path("strip.toml")))


def problem(text: str) -> str:
    (error,) = deck_problems(read_deck(HEAD + text, Path("strip.toml")))
    return str(error)


@pytest.mark.parametrize(
    ("fields", "options"),
    [
        ("", {}),
        (ENGAGING, {"using": "engaging_moduli_2015"}),
        ('loss_tangent = "library"\n', {"loss_tangent": 0.125}),
        ('loss_tangent = {value = 10, unit = "%", source = "test"}\n', {"loss_tangent": 0.1}),
    ],
)
def test_the_name_stands_for_what_python_makes_of_the_rubber(
    fields: str, options: dict[str, str | float]
) -> None:
    made = declared(MATERIAL + fields)
    same = with_rubber(declared(PLAIN), material("PMC-770"), **options)  # type: ignore[arg-type]
    numbers, wanted = made.quantities(), same.quantities()
    assert list(numbers) == list(wanted)
    assert {n: q.value for n, q in numbers.items()} == {n: q.value for n, q in wanted.items()}
    assert declare(read_deck(deck_text(made), Path("again.toml"))) == made


def test_what_stands_in_the_deck_comes_before_the_library() -> None:
    plain = declared(MATERIAL + ENGAGING)
    changed = declared(
        MATERIAL + ENGAGING + 'tensile_strength = {value = 3, unit = "MPa", source = "own"}\n'
        "[rubber.relaxing.dashpot]\n"
        'viscosity = {value = 20, unit = "kPa*s", source = "own"}\n'
    )
    numbers, library = changed.quantities(), plain.quantities()
    own = {n for n, q in numbers.items() if q.source == "own"}
    assert own == {"rubber.tensile_strength", "rubber.relaxing.dashpot.viscosity"}
    assert numbers["rubber.relaxing.dashpot.viscosity"].number == 20e3
    others = {n: q for n, q in numbers.items() if n not in own}
    assert others == {n: q for n, q in library.items() if n not in own}
    assert [n for n, _ in changed.walk()] == [n for n, _ in plain.walk()], "the order of the library stays"


def test_another_law_of_the_same_name_replaces_that_of_the_library_and_a_new_one_is_added() -> None:
    text = (
        '\n[rubber.{}]\ncomponent = "LinearElastic"\nmodulus = {{value = 1, unit = "MPa", source = "own"}}\n'
    )
    made = declared(MATERIAL + text.format("stiff") + text.format("more"))
    piece = made["rubber"]
    inner = getattr(piece, "element", piece)
    assert isinstance(inner, Specimen)
    assert {name: type(law).__name__ for name, law in inner.members} == {
        "stiff": "LinearElastic",
        "more": "LinearElastic",
    }


@pytest.mark.parametrize(
    ("text", "said"),
    [
        ('material = "PMC_770"\n', ("strip.toml:12:1: rubber.material", "did you mean 'PMC-770'?")),
        ('material = "butyl_rubber"\n', ("has no elastic law", "take one with a measured curve")),
        ("material = 3\n", ("is 3, not a text", "nlsdesign materials")),
        (MATERIAL + 'using = "nominal_stress_2104"\n', ("did you mean 'nominal_stress_2014'?",)),
        (ENGAGING, ("rubber.using: belongs to a material", 'add material = "..."')),
        (MATERIAL + 'loss_tangent = "much"\n', ("neither a number nor", '"library"')),
        (MATERIAL + 'loss_tangent = {value = 3, unit = "1", source = "x"}\n', ("at most at 2",)),
        (MATERIAL + "[rubber.stiff]\nc9 = 3\n", ("has no field 'c9'",)),
    ],
)
def test_a_mistake_names_its_place_and_the_next_step(text: str, said: tuple[str, ...]) -> None:
    message = problem(text)
    assert [each for each in said if each not in message] == [], message
