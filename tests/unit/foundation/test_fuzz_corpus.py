"""Every kind of input that once ended in a traceback, by name: each is one clear error now."""

from __future__ import annotations

import json
import struct
from pathlib import Path

import numpy as np
import pytest

from nlsdesign.bench.calibration import read_joint_numbers
from nlsdesign.bench.identification.records.table_files import read_table
from nlsdesign.components.assembly.deck_writer import declare
from nlsdesign.design.jobs.job_file import job_of
from nlsdesign.export.fmi.fmu_documentation import Authorship
from nlsdesign.foundation.deck import read_deck
from nlsdesign.foundation.errors import MeasurementError, NlsError
from nlsdesign.foundation.locations import bundled
from nlsdesign.foundation.quantity import parse_unit
from nlsdesign.foundation.text_files import text_of, write_text
from tests.command_line import Run, run
from tests.fuzz.commands import STUDIES
from tests.fuzz.records import _RIG, Records

__all__ = ["run"]
NUMBER = '[motor]\ncomponent = "Inertia"\ninertia = {{value = {}, unit = "{}", source = "x", spread = {}}}\n'


def number(value: str = "1", unit: str = "kg*m^2", spread: str = "0.1") -> str:
    return NUMBER.format(value, unit, spread)


DECKS = {
    "lists 500 deep": ("x = " + "[" * 500 + "]" * 500, "more than 64 deep"),
    "a dotted key of 900 names": (".".join("a" * 900) + " = 1", "more than 64 deep"),
    "a dotted key of 20000 names": (".".join("a" * 20000) + " = 1", "more than 64 deep"),
    "a header of 900 names": ("[x." + ".".join("a" * 900) + "]\nb = 1", "more than 64 deep"),
    "series 100 deep": (
        "".join(f'[n{".m" * k}]\ncomponent = "Series"\n' for k in range(100)), "more than 64 deep",
    ),
    "an integer of 5000 digits": (number("9" * 5000), "more than 1000 digits"),
    "a hexadecimal of 5000 digits as component": ("[a]\ncomponent = 0x" + "f" * 5000, "thousands of digits"),
    "an integer of 400 digits": (number("9" * 400), "too large to compute with"),
    "a spread of 400 digits": (number(spread="9" * 400), "too large to compute with"),
    "a fraction of 5000 digits": (number("0." + "3" * 5000), "more than 1000 digits"),
    "a value that overflows in SI": (number("1e308", "Gg*m^2"), "too large to compute with"),
    "a power of a unit beyond reason": (number(unit="m^9999999"), "no power of a unit"),
    "a unit that vanishes in SI": (number(unit="nm^20*nm^20"), "too large or too small a multiple"),
    "a domain that is a list": (
        '[motor]\ncomponent = "Fixed"\n[spring]\ncomponent = "Spring"\n'
        'between = ["motor"]\ndomain = ["rotation"]\n',
        "not a domain of Spring",
    ),
    "an escape in a name": ('["motor\\u001b[2J"]\ncomponent = "Fixed"\n', r"\\x1b"),
}  # fmt: skip


@pytest.mark.parametrize("name", DECKS)
def test_deck(name: str) -> None:
    text, rule = DECKS[name]
    with pytest.raises(NlsError, match=rule) as caught:
        declare(read_deck(text, Path("deck.toml")))
    assert "deck.toml" in str(caught.value)
    assert len(str(caught.value)) < 4000


@pytest.mark.parametrize("unit", ["m^21", "kg^-21", "m^" + "9" * 5000])
def test_powers_of_units_are_bounded(unit: str) -> None:
    with pytest.raises(NlsError, match="no power of a unit"):
        parse_unit(unit)
    assert parse_unit("m^20").exponents[1] == 20


TARGET = '[target]\nExponentialTorque = {maximum = "5 N*m", angle = "53 deg", shape = 1.0}\n'
JOBS = {
    "starts that are a table": (TARGET + "[search]\nstarts = {value = 1}\n", "search.starts"),
    "starts without end": (TARGET + "[search]\nstarts = inf\n", "search.starts"),
    "a stock of dates": (TARGET + '[stock]\n"a.b" = [1979-05-27]\n', "stock"),
    "a shape that is a date": (TARGET.replace("1.0", "1979-05-27"), "ExponentialTorque"),
    "an angle of 400 digits": (TARGET.replace('"53 deg"', "9" * 400), "ExponentialTorque"),
    "a shape that is true": (TARGET.replace("1.0", "true"), "shape"),
}  # fmt: skip


@pytest.mark.parametrize("name", JOBS)
def test_design_file(name: str) -> None:
    text, place = JOBS[name]
    with pytest.raises(NlsError, match=rf"job\.toml:\d+:\d+: .*{place}"):
        job_of(text, Path("job.toml"))


RIGS = {
    "lists without end": (_RIG + "x = " + "[" * 900 + "]" * 900, "more than 64 deep"),
    "a text for a number": (_RIG.replace("0.0302", '"text"'), "kT_Nm_per_A: 'text' is no number"),
    "a table that is none": ("drivetrain = 5\n" + _RIG.replace("[drivetrain]", "[other]"), "is not a table"),
    "a number without end": (_RIG.replace("0.0302", "inf"), "is no number"),
}  # fmt: skip


@pytest.mark.parametrize("name", RIGS)
def test_file_of_a_rig(name: str, tmp_path: Path) -> None:
    text, rule = RIGS[name]
    (tmp_path / "rig.toml").write_text(text, encoding="utf8")
    with pytest.raises(NlsError, match=rule):
        bundled("models", "test_rig").test_rig_deck(tmp_path / "rig.toml", tmp_path / "cam.csv")


def test_a_rig_whose_rubber_has_no_length(tmp_path: Path) -> None:
    (case,) = (case for case in Records().undamaged() if case.how == "rig")
    case.written(tmp_path)
    write_text(tmp_path / "rig.toml", _RIG.replace("L0_m = 0.0125", "L0_m = 0"))
    with pytest.raises(NlsError, match=r"rig\.toml: rubber\.L0_m: 0 m is no length"):
        bundled("models", "test_rig").test_rig_deck(tmp_path / "rig.toml", tmp_path / "cam.csv")


@pytest.mark.parametrize("cam", [b"\xff\xfe", b"", b"theta_rad,delta_m,lever_arm_m\n" + b"0,0\n" * 60])
def test_table_of_a_cam(cam: bytes, tmp_path: Path) -> None:
    (tmp_path / "rig.toml").write_text(_RIG, encoding="utf8")
    (tmp_path / "cam.csv").write_bytes(cam)
    with pytest.raises(NlsError, match=r"cam\.csv"):
        bundled("models", "test_rig").test_rig_deck(tmp_path / "rig.toml", tmp_path / "cam.csv")


@pytest.mark.parametrize("text", ["[" * 20000, json.dumps({"names": ["a"]}), "5", '{"covariance": "x"}'])
def test_numbers_of_a_calibration(text: str, tmp_path: Path) -> None:
    (tmp_path / "joint.json").write_text(text, encoding="utf8")
    with pytest.raises(MeasurementError, match="holds no numbers that are known jointly"):
        read_joint_numbers(tmp_path / "joint.json")


def test_a_device_and_a_folder_are_no_text_files(tmp_path: Path) -> None:
    for place in (Path("/dev/zero"), tmp_path):
        with pytest.raises(MeasurementError, match="cannot be read: it is a folder or a device"):
            text_of(place, MeasurementError)
    with pytest.raises(MeasurementError, match="cannot be read"):
        text_of(tmp_path / ("x" * 300), MeasurementError)


WORDS = {
    "a deck of 300 characters": ("deck", "check", "x" * 300),
    "a deck file of 300 characters": ("deck", "check", "x" * 300 + ".toml"),
    "a deck that is no text": ("deck", "show", "\udcff.toml"),
    "a deck that is a device": ("analyse", "--deck", "/dev/null"),
    "a folder of 300 characters": ("fit", "--deck", "test_rig", "--records", "x" * 300),
    "an export of 300 characters": ("export", "check", "x" * 300),
    "a folder of thousands of levels": ("fit", "--deck", "dfki_pendulum", "--records", "a/" * 2500),
    "a count below zero": ("analyse", "--deck", "dfki_pendulum", "--count", "-3"),
    "a mapping that is a device": ("simulate", "--deck", "test_rig", "--record", "a.csv", "--out", "x.csv",
                                   "--mapping", "/dev/zero"),
}  # fmt: skip


@pytest.mark.parametrize("name", WORDS)
def test_command_line(name: str, run: Run, tmp_path: Path) -> None:
    (tmp_path / "a.csv").write_text("t_s,force_N\n", encoding="utf8")
    status, _, errors = run(*WORDS[name])
    assert status == 2
    assert errors.strip()
    assert "Traceback" not in errors


MISTAKES = {
    "no_main.py": "no_main.py: has no function main -> write def main",
    "main_is_five.py": "main_is_five.py: has no function main",
    "out_only.py": "out_only.py: main: cannot be called so: got an unexpected keyword argument 'fast'",
    "broken.py": "broken.py:1: SyntaxError: expected ':'",
    "raises.py": "raises.py:2: ZeroDivisionError: division by zero",
    "raises_early.py": "raises_early.py:1: ModuleNotFoundError",
    "number.py": "main() returned int",
    "texts.py": "its number 'a' is 'b', not a float",
    "leaves.py": "leaves.py:3: ends the program by itself (exit status 3)",
    "not_text.py": "no text in UTF-8",
    "null.py": "null bytes",
}


@pytest.mark.parametrize("name", MISTAKES)
def test_study_of_ones_own(name: str, run: Run, tmp_path: Path) -> None:
    (tmp_path / name).write_bytes(STUDIES[name])
    status, _, errors = run("study", "run", name)
    assert (status, MISTAKES[name] in errors) == (2, True), errors


def test_a_study_without_numbers_says_so_and_names_no_report(run: Run, tmp_path: Path) -> None:
    (tmp_path / "none.py").write_bytes(STUDIES["none.py"])
    status, out, _ = run("study", "run", "none.py")
    assert status == 0
    assert "main returns None" in out
    assert "report:" not in out


def test_a_study_named_as_one_of_the_project_claims_nothing(run: Run, tmp_path: Path) -> None:
    text = "class R:\n    numbers = {'a': 1.0}\ndef main(out, fast=False):\n    return R()\n"
    (tmp_path / "austin2015.py").write_text(text, encoding="utf8")
    status, out, errors = run("study", "run", "austin2015.py")
    assert (status, errors) == (0, "")
    assert "report:" not in out


def test_what_no_command_expected_is_one_message_and_a_file(
    run: Run, monkeypatch: pytest.MonkeyPatch
) -> None:
    def broken() -> list[str]:
        return [][0]

    monkeypatch.setattr("nlsdesign.cli.studies.study_names", broken)
    status, _, errors = run("study", "run", "hello")
    assert status == 70
    assert "IndexError" in errors
    written = Path(errors.strip().rpartition(" ")[2])
    text = written.read_text(encoding="utf8")
    written.unlink()
    assert "Traceback" in text
    assert "nlsdesign study run hello" in text


def test_a_column_of_no_type_in_a_mat_file(tmp_path: Path) -> None:
    """The library looks such a type up outside its table and may end the whole process."""
    pytest.importorskip("scipy.io").savemat(tmp_path / "a.mat", {"t_s": np.arange(60.0)})
    content = (tmp_path / "a.mat").read_bytes()
    head = struct.pack("<II", 9, 480)
    assert content.count(head) == 1
    for code in (0, 14, 15, 3081):
        (tmp_path / "b.mat").write_bytes(content.replace(head, struct.pack("<II", code, 480)))
        with pytest.raises(MeasurementError, match=rf"b\.mat: cannot be read: {code} is the code of no type"):
            read_table(tmp_path / "b.mat")
    assert read_table(tmp_path / "a.mat").heads == ("t_s",)


def test_what_is_no_character_is_written_as_in_json_or_refused(tmp_path: Path) -> None:
    write_text(tmp_path / "a.json", '"\udcff.toml"')
    assert json.loads((tmp_path / "a.json").read_text(encoding="utf8")) == "\udcff.toml"
    with pytest.raises(NlsError, match=r"licence .*udcff.*: holds what is no character"):
        Authorship(licence="\udcff")
