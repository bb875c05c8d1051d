"""A designed, fitted, diagnosed or calibrated deck has another name, and says what it was made from."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

from nlsdesign.components import Assembly
from nlsdesign.components.assembly.deck_writer import deck_digest, deck_text, declare, write_deck
from nlsdesign.foundation.deck import load_deck, read_deck
from nlsdesign.model import flatten
from nlsdesign.model.origin import derived, digits_in_name
from tests.command_line import Run, run

__all__ = ["run"]
LINEAR = "austin2015_soft_spring"


def declared() -> Assembly:
    return declare(load_deck(LINEAR))


def changed(made: Assembly, inertia: float) -> Assembly:
    return made.with_values({"motor.inertia": inertia})


def test_the_name_says_from_what_how_and_with_which_content() -> None:
    made = derived(changed(declared(), 7e-4), declared(), "diagnosed")
    assert made.name == f"{LINEAR}_diagnosed_{deck_digest(made)[:8]}"
    assert made.parent is not None
    assert (made.parent.name, made.parent.digest) == (LINEAR, deck_digest(declared()))
    other = derived(changed(declared(), 8e-4), declared(), "diagnosed")
    assert other.name != made.name
    again = declare(read_deck(deck_text(made), Path("model.toml")))
    assert again == made
    origin = flatten(again).origin
    assert origin is not None
    assert (origin.deck, origin.parent) == (made.name, made.parent)
    assert digits_in_name(again) == deck_digest(again)[:8]


def test_what_was_not_changed_keeps_its_name() -> None:
    assert (
        derived(changed(declared(), declared().quantities()["motor.inertia"].number), declared(), "x").name
        == LINEAR
    )
    assert digits_in_name(declared()) == ""


def test_the_name_does_not_grow_but_the_line_of_parents_does() -> None:
    first = derived(changed(declared(), 7e-4), declared(), "designed")
    second = derived(changed(first, 8e-4), first, "diagnosed")
    assert second.name == f"{LINEAR}_diagnosed_{deck_digest(second)[:8]}"
    assert second.parent is not None
    assert [p.name for p in second.parent.line()] == [first.name, LINEAR]
    assert [p.change for p in second.parent.line()] == ["diagnosed", "designed"]
    # A name that a person gave stays whole, whatever it ends with.
    given = replace(declared(), name="arm_left_0badcafe")
    assert derived(changed(given, 7e-4), given, "refitted").name.startswith("arm_left_0badcafe_refitted_")


def test_a_derived_deck_that_was_edited_is_found(run: Run, tmp_path: Path) -> None:
    made = derived(changed(declared(), 7e-4), declared(), "diagnosed")
    write_deck(made, tmp_path / "model.toml")
    assert run("export", "check", str(tmp_path))[0] == 0
    write_deck(changed(made, 7.1e-4), tmp_path / "model.toml")
    status, output, _ = run("export", "check", str(tmp_path))
    assert status == 1
    assert f"its name says {deck_digest(made)[:8]}" in output


def test_a_folder_with_a_deck_and_its_parent_says_so(run: Run, tmp_path: Path) -> None:
    made = derived(changed(declared(), 7e-4), declared(), "diagnosed")
    write_deck(made, tmp_path / "model.toml")
    write_deck(declared(), tmp_path / "declared.toml")
    status, output, _ = run("export", "check", str(tmp_path))
    assert status == 1
    assert f"{made.name} was made from {LINEAR}." in output
