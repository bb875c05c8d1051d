"""``export c --block``, ``export block``, ``export a2l``, and blocks of calibrated decks."""

from __future__ import annotations

import json
import shutil

import pytest
from click.testing import CliRunner

from nlsdesign.cli.export import export
from nlsdesign.components import declare, write_deck
from nlsdesign.foundation.deck import load_deck
from tests.blocks import BETTER
from tests.calibrated import LINEAR, recorded
from tests.command_line import Run, files_in, run, two_machines
from tests.rig.calibration_bench import Machine

__all__ = ["run", "two_machines"]
DECK = "austin2015_figure_consistent"


@pytest.fixture(scope="module")
def exported(tmp_path_factory):
    """Export the observer of the published machine with blocks, once."""
    folder = tmp_path_factory.mktemp("exported")
    usual = ("c", "--deck", DECK, "--kind", "cascade", "--real", "float", "--out", str(folder / "code"))
    done = CliRunner().invoke(export, [*usual, "--block"])
    assert done.exit_code == 0, done.output
    return folder / "code"


@pytest.fixture
def code(exported, tmp_path):
    """Return that code in the folder of a test."""
    shutil.copytree(exported, tmp_path / "code")
    return "code/observer_block.json"


@pytest.mark.slow
def test_code_says_how_its_blocks_are_made(run: Run, code: str, tmp_path) -> None:
    better = tmp_path / "better.toml"
    write_deck(declare(load_deck(DECK)).with_values(BETTER), better)
    status, out, err = run("export", "block", "--code", code, "--deck", str(better), "--out", "b", "--json")
    assert status == 0, err
    assert files_in(tmp_path / "b") == [f"observer_numbers{ending}" for ending in (".bin", ".c", ".json")]
    written = json.loads((tmp_path / "b" / "observer_numbers.json").read_text())
    design = json.loads((tmp_path / code).read_text())
    assert written["digest"] == design["digest"] == json.loads(out)["digest"]
    assert written["checksum"] != design["checksum"]
    assert (tmp_path / "b" / "observer_numbers.bin").stat().st_size == int(out_size(tmp_path / "code"))
    again = ("--code", "b/observer_numbers.json", "--deck", DECK, "--out", "c")
    assert run("export", "block", *again)[0] == 0
    back = json.loads((tmp_path / "c" / "observer_numbers.json").read_text())
    assert back["checksum"] == design["checksum"]


def out_size(folder) -> str:
    """Return the size of a block that the header states."""
    text = (folder / "observer.h").read_text()
    return text.partition("OBSERVER_BLOCK_SIZE ")[2].partition("u")[0]


def test_what_is_wrong_is_said_and_nothing_written(run: Run, code: str, tmp_path) -> None:
    for words, says in (
        (("--value", "bandwidth"), "NAME=NUMBER"),
        (("--value", "controller.bandwidth=9"), "is no parameter of the block"),
        (("--deck", "austin2015_soft_spring"), "export the code again"),
    ):
        status, _, err = run("export", "block", "--code", code, *words, "--out", "b")
        assert (status, says in err) == (2, True), err
    text = (tmp_path / code).read_text()
    (tmp_path / code).write_text(text.replace('"checksum": "0x', '"checksum": "0x1', 1))
    status, _, err = run("export", "block", "--code", code, "--deck", DECK, "--out", "b")
    assert (status, "damaged or edited" in err) == (2, True), err
    assert not (tmp_path / "b").exists()


def test_a_description_has_the_symbols_of_the_program(run: Run, code: str, tmp_path) -> None:
    words = ("--block-symbol", "numbers", "--instance-symbol", "joint")
    assert run("export", "a2l", "--code", code, *words, "--out", "joint.a2l")[0] == 0
    text = (tmp_path / "joint.a2l").read_text()
    assert 'SYMBOL_LINK "numbers" ' in text
    assert 'SYMBOL_LINK "joint" ' in text
    status, _, err = run("export", "a2l", "--code", code, "--elf", code, "--out", "other.a2l")
    assert (status, "is no ELF file" in err) == (2, True)


# The deck of a calibration is that of test_calibrate.py, and the block of any deck is made above.
@pytest.mark.slow
@pytest.mark.usefixtures("two_machines")
def test_a_calibration_writes_the_block_of_its_deck(run: Run, tmp_path) -> None:
    usual = ("--deck", LINEAR, "--what", "controller", "--out", "code")
    assert run("export", "c", *usual, "--block")[0] == 0
    folder = recorded("free_run", tmp_path, Machine(stiffness=3.3, torque_constant=0.053))
    words = ("--kind", "free_run", "--records", str(folder), "--code", "code/controller_block.json")
    status, out, err = run("observer", "calibrate", "--deck", LINEAR, *words, "--out", "o")
    assert status == 0, err
    assert "controller_numbers.bin" in out
    block = json.loads((tmp_path / "o" / "controller_numbers.json").read_text())
    numbers = {row["name"]: row["value"] for row in block["parameters"]}
    deck = load_deck(tmp_path / "o" / f"{LINEAR}_calibrated.toml")
    assert numbers["motor.torque_constant"] == deck.quantity("motor.torque_constant").value
    assert block["deck"]["name"] == deck.name
