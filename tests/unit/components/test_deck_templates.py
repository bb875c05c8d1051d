"""A deck from nothing: templates, what may be given, the wizard for inertias, and files that are there."""

from __future__ import annotations

import json
import math
import re
from pathlib import Path

import pytest
from click.testing import CliRunner

from nlsdesign.cli import deck_new
from nlsdesign.cli.main import program
from nlsdesign.components import Specimen
from nlsdesign.components.assembly.deck_reader import component_classes
from nlsdesign.components.assembly.deck_remarks import deck_remarks
from nlsdesign.components.assembly.deck_template import (
    MotorInertia,
    load_template,
    motor_inertia,
)
from nlsdesign.components.assembly.deck_writer import declare
from nlsdesign.foundation.deck import load_deck, read_deck, template_names
from nlsdesign.foundation.quantity import quantity
from nlsdesign.foundation.spread import RelativeSpread
from nlsdesign.regeneration import readiness
from tests.command_line import Run
from tests.command_line import run as run
from tests.undrawn import undrawn

__all__ = ["undrawn"]
pytestmark = pytest.mark.usefixtures("undrawn")

TEMPLATES = template_names()


def test_there_is_a_template_for_each_kind_of_machine() -> None:
    assert [
        *("cam-actuator", "geared-joint", "linear-spring", "one-sided-finger", "positioning-drive"),
        "specimen",
    ] == TEMPLATES


@pytest.mark.long_cases("one-sided-finger")
@pytest.mark.parametrize("name", TEMPLATES)
def test_a_template_is_ready_for_each_command_that_it_names_and_holds_no_slip(
    run: Run, tmp_path: Path, name: str
) -> None:
    status, out, err = run("deck", "new", "own", "--template", name)
    assert (status, err) == (0, "")
    deck = load_deck(tmp_path / "own.toml")
    machine = declare(deck)
    commands = {each.command: each for each in readiness(machine)}
    claimed = load_template(name).ready_for
    assert [str(commands[each].reason) for each in claimed if not commands[each].ready] == []
    assert claimed == tuple(name for name, each in commands.items() if each.ready), "and no other"
    shown = ", ".join(deck_new.shown_command(each.command) for each in commands.values() if each.ready)
    assert f"ready for {shown}\n" in out
    assert f"ready for: {shown}\n" in run("deck", "check", "own.toml")[1]
    assert deck_remarks(machine) == []
    assert deck.name == "own"


@pytest.mark.parametrize("name", TEMPLATES)
def test_a_new_deck_is_commented_and_every_number_says_where_it_is_from(name: str) -> None:
    template = load_template(name)
    text = template.filled("own")
    assert "Asked:" not in text
    comments = [line for line in text.splitlines() if line.startswith("# ")]
    assert len(comments) >= 6 + len(template.questions())
    numbers = template.deck.numbers()
    assert all(template.deck.quantity(each).source.startswith("assumed: ") for each in numbers)
    assert any(template.deck.quantity(each).spread for each in numbers)
    assert len(template.questions()) >= 4


def test_numbers_rubber_and_name_are_put_in_place_of_those_of_the_template(run: Run, tmp_path: Path) -> None:
    words = ("--template", "cam-actuator", "--material", "Dragon_Skin_30", "--yes")
    status, _, err = run(
        "deck", "new", "my leg.toml", *words, "--set", "spring.rubber.area=25 mm^2",
        "--set", "motor.current_limit = 12A",
    )  # fmt: skip
    assert (status, err) == (0, "")
    machine = declare(load_deck(tmp_path / "my leg.toml"))
    numbers = machine.quantities()
    assert machine.name == "my_leg"
    assert numbers["spring.rubber.area"].number == pytest.approx(25e-6)
    assert numbers["spring.rubber.area"].spread == RelativeSpread(0.05), "what the template assumes stays"
    assert numbers["spring.rubber.area"].assumed
    assert numbers["motor.current_limit"].number == 12.0
    piece = machine["spring.rubber"]
    assert isinstance(piece, Specimen)
    assert any("Dragon_Skin_30" in q.source for n, q in numbers.items() if n.startswith("spring.rubber."))
    assert not any("PMC-770" in q.source for q in numbers.values())


def test_an_inertia_is_converted_from_the_rotor_and_from_the_output(run: Run, tmp_path: Path) -> None:
    cam = ("deck", "new", "a", "--template", "cam-actuator", "--set", "motor.gear_ratio=20")
    assert run(*cam, "--inertia", "3 g*cm^2", "--inertia-at", "rotor")[0] == 0
    inertia = declare(load_deck(tmp_path / "a.toml")).quantities()["motor.inertia"]
    assert inertia.number == pytest.approx(3e-7 * 400, rel=1e-12)
    assert "3 g·cm² at the rotor, times the gear ratio squared, 20^2" in inertia.source
    assert run(*cam, "--inertia", "3 kg*cm^2", "--inertia-at", "output", "--force")[0] == 0
    inertia = declare(load_deck(tmp_path / "a.toml")).quantities()["motor.inertia"]
    assert inertia.number == pytest.approx(3e-4, rel=1e-12)
    assert "at the output" in inertia.source
    joint = ("deck", "new", "b", "--template", "geared-joint")
    assert run(*joint, "--inertia", "0.05 kg*m^2", "--inertia-at", "output")[0] == 0
    inertia = declare(load_deck(tmp_path / "b.toml")).quantities()["motor.inertia"]
    assert inertia.number == pytest.approx(0.05 / 2500, rel=1e-12)
    assert "divided by the gear ratio squared, 50^2" in inertia.source


def test_another_gear_ratio_carries_the_count_of_an_encoder_on_the_rotor_with_it(
    run: Run, tmp_path: Path
) -> None:
    words = ("deck", "new", "a", "--template", "cam-actuator", "--set", "motor.gear_ratio=50")
    at_rotor = ("--inertia", "140 g*cm^2", "--inertia-at", "rotor")
    for more in ((), at_rotor):
        assert run(*words, *more, "--force")[0] == 0
        count = declare(load_deck(tmp_path / "a.toml")).quantities()["motor_encoder.quantum"]
        assert count.number == pytest.approx(2.0 * math.pi / 4096 / 50, rel=5e-3), (
            "4096 counts, over the gear"
        )
        assert count.source.endswith("times 10/50, for another gear ratio")
    assert run(*words, "--set", "motor_encoder.quantum=1 mrad", "--force")[0] == 0
    assert declare(load_deck(tmp_path / "a.toml")).quantities()["motor_encoder.quantum"].number == 1e-3


def test_another_gear_ratio_carries_the_inertia_at_the_output_with_it(run: Run, tmp_path: Path) -> None:
    template = load_template("cam-actuator")
    assert run("deck", "new", "a", "--template", template.name, "--set", "motor.gear_ratio=30")[0] == 0
    new = declare(load_deck(tmp_path / "a.toml")).quantities()["motor.inertia"]
    assert new.number == pytest.approx(9.0 * template.deck.quantity("motor.inertia").number)
    assert "(30/10)^2" in new.source
    joint = load_template("geared-joint")
    at = motor_inertia(declare(joint.deck))
    assert at == MotorInertia("motor.inertia", "rotor", "gear.ratio")
    assert joint.carried(at, {"gear.ratio": quantity(5.0, "1")}) == {}, "no gear changes a rotor"
    assert motor_inertia(declare(load_template("specimen").deck)) is None


@pytest.mark.parametrize(
    ("words", "status", "said"),
    [
        (("--template", "cam-actuatr"), 2, "did you mean 'cam-actuator'"),
        ((), 2, "templates are: cam-actuator"),
        (("--template", "cam-actuator", "--material", "PMC_770"), 2, "did you mean 'PMC-770'"),
        (("--template", "cam-actuator", "--material", "butyl_rubber"), 2, "has no elastic law"),
        (("--template", "linear-spring", "--material", "PMC-770"), 2, "has no piece of rubber"),
        (("--template", "cam-actuator", "--set", "motor.gearratio=3"), 2, "did you mean 'motor.gear_ratio'"),
        (("--template", "cam-actuator", "--set", "motor.gear_ratio=3 kg"), 2, "write '3'"),
        (("--template", "cam-actuator", "--set", "motor.gear_ratio"), 2, "NAME=VALUE"),
        (("--template", "cam-actuator", "--set", "motor.gear_ratio="), 2, "--set motor.gear_ratio: ''"),
        (
            ("--template", "cam-actuator", "--set", "motor.gear_ratio=0"),
            2,
            "motor.gear_ratio: gear_ratio = 0",
        ),
        (
            ("--template", "cam-actuator", "--set", "motor.gear_ratio=5", "--set", "motor.gear_ratio=6"),
            2,
            "'motor.gear_ratio' is set twice",
        ),
        (("--template", "cam-actuator", "--set", "motor.inertia=3"), 2, "has no unit"),
        (("--template", "cam-actuator", "--set", "spring.cam.lever_arm=3 mm"), 2, "row of numbers"),
        (("--template", "cam-actuator", "--set", "spring.cam.last_angle=9 rad"), 2, "must lie in"),
        (("--template", "cam-actuator", "--inertia", "3 g*cm^2"), 2, "belong together"),
        (("--template", "specimen", "--inertia", "3 g*cm^2", "--inertia-at", "rotor"), 2, "leave --inertia"),
        (
            ("--template", "cam-actuator", "--inertia", "9 gcm^2", "--inertia-at", "rotor"),
            2,
            "--inertia: unit",
        ),
    ],
)
def test_what_cannot_be_is_refused_and_nothing_is_written(
    run: Run, tmp_path: Path, words: tuple[str, ...], status: int, said: str
) -> None:
    result, _, err = run("deck", "new", "own.toml", *words)
    assert (result, said in err) == (status, True), err
    assert list(tmp_path.iterdir()) == []


@pytest.mark.parametrize("name", [".", "", "folder/", "leg.toml/"])
def test_what_is_no_name_of_a_file_is_refused(run: Run, tmp_path: Path, name: str) -> None:
    status, _, err = run("deck", "new", name, "--template", "specimen")
    assert (status, list(tmp_path.iterdir())) == (2, [])
    assert "is no name of a file" in err


def test_the_next_command_can_be_copied_where_the_name_has_blanks(run: Run) -> None:
    status, out, _ = run("deck", "new", "my leg", "--template", "specimen")
    assert status == 0
    assert "next: nlsdesign deck check 'my leg.toml'" in out
    assert run("deck", "copy", "test_rig", "my rig.toml")[1].endswith("deck check 'my rig.toml'\n")


def test_a_file_that_is_there_is_replaced_by_force_alone(run: Run, tmp_path: Path) -> None:
    mine = tmp_path / "own.toml"
    mine.write_text("mine", encoding="utf8")
    for words in (("new", "own", "--template", "specimen"), ("copy", "test_rig", "own.toml")):
        status, _, err = run("deck", *words)
        assert (status, mine.read_text(encoding="utf8")) == (2, "mine")
        assert "is there already" in err
        assert "--force" in err
    assert run("deck", "copy", "test_rig", "own.toml", "--force")[0] == 0
    assert declare(load_deck(mine)) == declare(load_deck("test_rig"))
    long = "n" * 300
    status, _, err = run("deck", "new", long, "--template", "specimen")
    assert status == 2
    assert "shorter name" in err


def test_the_terminal_is_asked_with_unit_and_usual_value(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.chdir(tmp_path)
    monkeypatch.setattr(deck_new, "on_terminal", lambda: True)
    # Template, rubber (once misspelt), ratio, constant (once in a wrong unit), eight as usual, inertia.
    answers = ["", "PMC", "Dragon_Skin_30", "25", "3 kg", "41", *[""] * 8, "rotor", "2"]
    result = CliRunner().invoke(program, ["deck", "new", "leg"], input="\n".join(answers) + "\n")
    assert result.exit_code == 0, result.output
    assert "did you mean 'PMC-770'" in result.output
    assert "Torque of the motor per current, in front of the gear (mN·m/A) [30 mN·m/A]" in result.output
    assert "'kg' is not a unit like" in result.output
    numbers = declare(load_deck(tmp_path / "leg.toml")).quantities()
    assert numbers["motor.gear_ratio"].number == 25.0
    assert numbers["motor.torque_constant"].number == pytest.approx(0.041)
    assert numbers["motor.inertia"].number == pytest.approx(2e-7 * 625, rel=1e-12)
    assert numbers["spring.rubber.rest_length"] == load_template("cam-actuator").deck.quantity(
        "spring.rubber.rest_length"
    )


def test_a_copy_keeps_the_comments_and_the_listing_names_files(run: Run, tmp_path: Path) -> None:
    assert run("deck", "new", "own", "--template", "geared-joint")[0] == 0
    assert run("deck", "copy", "own.toml", "again.toml")[0] == 0
    text = (tmp_path / "own.toml").read_text(encoding="utf8")
    assert (tmp_path / "again.toml").read_text(encoding="utf8") == text
    assert run("deck", "show", "again.toml", "--toml")[1] == text
    assert run("deck", "copy", "test_rig", "again.txt")[0] == 2
    status, out, _ = run("deck", "list", "--json")
    listed = json.loads(out)
    assert status == 0
    assert set(listed["templates"]) == set(TEMPLATES)
    assert Path(listed["decks"]["test_rig"]["file"]).is_file()


def test_the_deck_of_the_page_on_the_format_is_one(root: Path) -> None:
    page = (root / "docs" / "deck_format.md").read_text(encoding="utf8")
    text = page.partition("```toml\n")[2].partition("```")[0]
    machine = declare(read_deck(text, Path("leg.toml")))
    assert machine["spring.rubber"].title().startswith("Specimen")
    tables = page.split("## What stands where")[1]
    kinds = {name for name in re.findall(r"`([A-Z]\w+)`", tables)}
    assert kinds <= set(component_classes()), kinds - set(component_classes())
