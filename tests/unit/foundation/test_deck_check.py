"""``deck check``: which commands a deck is ready for, in agreement with the commands, and likely slips."""

from __future__ import annotations

import json
from pathlib import Path

import pytest

from nlsdesign.components.assembly.deck_remarks import deck_remarks
from nlsdesign.components.assembly.deck_template import load_template
from nlsdesign.components.assembly.deck_writer import declare
from nlsdesign.foundation.deck import Deck, deck_names, load_deck, read_deck, template_names
from nlsdesign.foundation.errors import DeckError
from nlsdesign.regeneration import readiness
from tests.command_line import Run
from tests.command_line import run as run
from tests.undrawn import undrawn

__all__ = ["undrawn"]
pytestmark = pytest.mark.usefixtures("undrawn")

DECKS = [*deck_names(), *template_names()]
COMMANDS: dict[str, tuple[str, ...]] = {
    "design": ("--maximum", "0.5 N*m", "--angle", "30 deg", "--starts", "1", "--draws", "0"),
    "analyse angle": ("--to", "20 deg", "--count", "3"),
    "analyse loop": ("--to", "20 deg", "--amplitude", "0.07 N*m"),
    "observer": (),
    "export c": ("--kind", "cascade"),
    "export controller": (),
    "export fmu": ("--what", "plant"),
}


def deck_of(name: str) -> Deck:
    return load_template(name).deck if name in template_names() else load_deck(name)


def agrees(run: Run, name: str, commands: list[str]) -> dict[str, tuple[bool, str]]:
    """Return what commands do against what was said of them, where these differ."""
    deck = Path("own.toml")
    if name in template_names():
        deck.write_text(load_template(name).filled(load_template(name).deck.name), encoding="utf8")
    known = {each.command: each for each in readiness(declare(deck_of(name)))}
    differing = {}
    for command in commands:
        words = (*command.split(), "--deck", str(deck) if deck.exists() else name, *COMMANDS[command])
        out = f"out/{command.replace(' ', '_')}" + (".csv" if command == "simulate" else "")
        status, _, err = run(*words, "--out", out)
        # A design that misses its target and a loop that limit-cycles are findings, not refusals.
        if known[command].ready != (status in (0, 1)):
            differing[command] = known[command].ready, err
        elif not known[command].ready:
            assert str(known[command].reason).partition(" -> ")[0] in err, "the same words"
    return differing


@pytest.mark.slow
@pytest.mark.parametrize("name", DECKS)
def test_every_command_agrees_with_what_was_said_of_it(run: Run, name: str) -> None:
    assert agrees(run, name, list(COMMANDS)) == {}


@pytest.mark.parametrize("name", ["dfki_pendulum", "specimen"])
def test_refused_commands_give_the_reason_that_was_said(run: Run, name: str) -> None:
    refused = [each.command for each in readiness(declare(deck_of(name))) if not each.ready]
    assert refused
    assert agrees(run, name, refused) == {}


@pytest.mark.parametrize("command", [pytest.param("export c", marks=pytest.mark.slow), "export controller"])
def test_a_ready_command_runs(run: Run, command: str) -> None:
    assert agrees(run, "linear-spring", [command]) == {}


def test_the_table_says_what_to_do_and_json_says_the_same(run: Run) -> None:
    status, out, _ = run("deck", "check", "one_sided_cable_drive")
    assert status == 0
    assert "ready for: simulate, design (with a target), analyse angle" in out
    assert "CapstanFriction" in " ".join(out.split()), "what is in the way is named"
    content = json.loads(run("deck", "check", "one_sided_cable_drive", "--json")[1])
    ready = {name for name, each in content["commands"].items() if each["ready"]}
    assert ready == {
        "simulate",
        "design",
        "analyse angle",
        "export controller",
        "export fmu",
        "fit",
        "diagnose",
    }
    assert "take the friction out of the spring" in content["commands"]["observer"]["reason"]
    assert content["warnings"] == []
    assert len(content["digest"]) == 64


@pytest.mark.parametrize("name", DECKS)
def test_decks_of_the_project_hold_no_likely_slip(name: str) -> None:
    assert deck_remarks(declare(deck_of(name))) == []


def test_a_rubber_whose_curve_has_no_spread_is_named_until_one_is_written() -> None:
    template = load_template("cam-actuator")
    text = template.filled("own", material="natural_rubber_treloar")
    machine = declare(read_deck(text, Path("own.toml")))
    (said,) = deck_remarks(machine)
    assert said.startswith("spring.rubber.stiff: its curve has no spread")
    assert "write its constants into [spring.rubber.stiff] with a spread" in said
    row = ", ".join(map(repr, machine.quantities()["spring.rubber.stiff.moduli"].values))
    spread = f'moduli = {{value = [{row}], unit = "Pa", source = "assumed: batches differ", spread = 0.1}}'
    written = f"{text}\n[spring.rubber.stiff]\n{spread}\n"
    assert deck_remarks(declare(read_deck(written, Path("own.toml")))) == []


def test_a_file_that_is_no_deck_is_not_looked_for_as_a_name(tmp_path: Path) -> None:
    (tmp_path / "run1.csv").write_text("t_s\n0\n", encoding="utf8")
    with pytest.raises(DeckError, match=r"run1\.csv'.*does not end in \.toml"):
        load_deck(tmp_path / "run1.csv")


def slips(old: str, new: str, *, template: str = "cam-actuator") -> list[str]:
    text = load_template(template).text
    assert old in text
    return deck_remarks(declare(read_deck(text.replace(old, new), Path("own.toml"))))


def test_a_rotor_inertia_at_the_output_is_told_by_what_the_rotor_would_do() -> None:
    assert slips("value = 0.00146,", "value = 0.000146,") == [], "an order of magnitude is no proof"
    (said,) = slips("value = 0.00146,", "value = 0.0000146,")
    assert said.startswith("motor.inertia: 1.46e-05 kg·m² is that at the gear's output")
    assert "write 0.00146 kg·m², times 10^2" in said


def test_an_output_inertia_at_the_rotor_is_told_too() -> None:
    (said,) = slips("value = 140.0,", "value = 350000.0,", template="geared-joint")
    assert "is that of the rotor, in front of the gear" in said
    assert "write 140 g·cm², divided by 50^2" in said


def test_a_gear_that_speeds_up_is_named() -> None:
    (said,) = slips("gear_ratio = {value = 10.0", "gear_ratio = {value = 0.02")
    assert said.startswith(
        "motor.gear_ratio: 0.02 motor turns per output turn make the output 50 times as fast"
    )
    assert said.endswith("-> if 50 motor turns per output turn were meant, write 50")
    (said,) = slips("ratio = {value = 50.0", "ratio = {value = -0.02", template="geared-joint")
    assert said.startswith("gear.ratio: 0.02 motor turns")
    assert slips("gear_ratio = {value = 10.0", "gear_ratio = {value = 1.0") == [], "a direct drive"


def test_a_new_deck_is_written_with_what_is_likely_a_slip(run: Run) -> None:
    words = ("--template", "cam-actuator", "--set", "motor.gear_ratio=0.02", "--yes")
    status, out, err = run("deck", "new", "own", *words)
    assert (status, err) == (0, "")
    assert "warning: motor.gear_ratio: 0.02 motor turns per output turn" in out
    content = json.loads(run("deck", "new", "other", *words, "--json")[1])
    assert content["warnings"][0].startswith("motor.gear_ratio: 0.02 motor turns")
    assert json.loads(run("deck", "new", "third", *words[:2], "--json")[1])["warnings"] == []


def test_ends_of_a_spring() -> None:
    pair = 'between = ["motor", "load"]'
    (swapped,) = slips(pair, 'between = ["load", "motor"]')
    assert f"write {pair} for a positive one" in swapped
    (alone,) = slips(pair, 'between = ["motor"]')
    assert "'load' does not feel it" in alone
    assert f"write {pair}" in alone


def test_spreads_in_per_cent_are_refused_or_named() -> None:
    text = load_template("cam-actuator").text
    with pytest.raises(
        Exception, match=r"motor.inertia: spread = 15: means a factor of 16 up or down"
    ) as caught:
        declare(read_deck(text.replace("spread = 0.15", "spread = 15"), Path("own.toml")))
    assert "write spread = 0.15 if 15 % was meant" in str(caught.value)
    (said,) = slips("spread = 0.15", "spread = 3")
    assert said.startswith("motor.inertia: spread = 3 means a factor of 4")
    assert slips("spread = 0.15", "spread = 1.5") == [], "an assumed order of magnitude"


def test_half_an_element_and_two_laws_behind_a_cam_are_refused(run: Run, tmp_path: Path) -> None:
    text = load_template("cam-actuator").text
    half = text.replace("elements = {value = 1.0", "elements = {value = 1.5")
    second = '\n[spring.second]\ncomponent = "Spring"\nstiffness = {value = 1, unit = "N/m", source = "x"}\n'
    said = {"must be a whole number -> write 1 or 2": half, 'component = "Parallel"': text + second}
    for rule, wrong in said.items():
        (tmp_path / "own.toml").write_text(wrong, encoding="utf8")
        status, _, err = run("deck", "check", "own.toml")
        assert (status, rule in err) == (2, True), err


@pytest.mark.parametrize("thing", ["deck", "part"])
def test_long_names_are_refused(thing: str) -> None:
    text, long = load_template("linear-spring").text, "n" * 101
    old, new = ('name = "linear_spring"', f'name = "{long}"') if thing == "deck" else ("[load]", f"[{long}]")
    if thing == "part":
        text = text.replace('"load"', f'"{long}"')
    with pytest.raises(Exception, match="101 letters, more than 100"):
        declare(read_deck(text.replace(old, new), Path("own.toml")))


def test_what_a_terminal_would_obey_is_written_out(run: Run, tmp_path: Path) -> None:
    text = load_template("linear-spring").text
    hostile = text.replace('"linear_spring"', '"x\\u001b[2J"').replace(
        "assumed: 4 N*m", "\\u001b]0;t\\u0007 4"
    )
    (tmp_path / "own.toml").write_text(hostile, encoding="utf8")
    # Click takes some escapes out of what goes into a pipe, so that what is printed proves too little.
    machine = declare(load_deck(tmp_path / "own.toml"))
    texts = [str(machine), machine.name, *(q.source for q in machine.quantities().values())]
    assert not [each for each in "".join(texts) if ord(each) < 32 and each != "\n"]
    for words in (("show",), ("check",), ("show", "--json"), ("check", "--json"), ("show", "--toml")):
        status, out, err = run("deck", words[0], "own.toml", *words[1:])
        assert status == 0, err
        assert not [each for each in out + err if ord(each) < 32 and each not in "\n\t"]
    assert r"\x1b]0;t\x07 4" in run("deck", "show", "own.toml")[1]
