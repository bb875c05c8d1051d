"""Messages of commands name a next step that is right."""

from __future__ import annotations

from pathlib import Path

import pytest

from nlsdesign.bench.identification.records.table_files import table_files
from nlsdesign.cli.simulate import read_driving_signal
from nlsdesign.cli.typed_values import parse_number
from nlsdesign.components.core.part_numbers import ParameterInfo
from nlsdesign.design.curves.target_files import read_target
from nlsdesign.foundation.errors import MeasurementError, NlsError, ValueRangeError
from tests.command_line import Run, run

__all__ = ["run"]
DECK = "austin2015_soft_spring"


def test_the_number_that_was_given_is_kept_in_the_advice() -> None:
    with pytest.raises(NlsError, match=r"write '0\.3 kg'"):
        parse_number("0.3 m", "kg")
    with pytest.raises(NlsError, match=r"write '0\.5 A'"):
        read_driving_signal("0.5 V", "A")


def test_sixty_radians_were_degrees() -> None:
    about = ParameterInfo(unit="rad", description="last angle", minimum=0.0, maximum=6.3)
    with pytest.raises(ValueRangeError, match="was 'deg' meant"):
        about.checked("last_angle", 60.0)


def test_two_sines_are_for_a_file() -> None:
    with pytest.raises(ValueRangeError, match="--input-file"):
        read_driving_signal("1 A sine 0.1 Hz + 0.6 A sine 1.1 Hz", "A")


def test_target_curves_say_where_rows_begin(tmp_path: Path) -> None:
    file = tmp_path / "curve.csv"
    file.write_text("angle [deg],torque [N*m]\n-60,0\n0,0\n60,1\n", encoding="utf-8")
    with pytest.raises(ValueRangeError, match="rows begin at angle zero"):
        read_target(file)


def test_a_folder_is_offered_only_if_it_holds_records_and_is_alike(tmp_path: Path) -> None:
    for name in ("nodir", "nowhere_else", "record"):
        (tmp_path / name).mkdir()
        (tmp_path / name / "run.csv").touch()
    (tmp_path / "nowhere_else" / "run.csv").unlink()
    with pytest.raises(MeasurementError) as error:
        table_files(tmp_path / "nowhere")
    assert error.value.did_you_mean is None
    with pytest.raises(MeasurementError, match="did you mean 'record'"):
        table_files(tmp_path / "records")


def test_commands_show_forms_and_names(run: Run, tmp_path: Path) -> None:
    _, _, err = run("design", "--deck", DECK, "--target", "ExponentialTorque(maximum=0.3)")
    assert 'write ExponentialTorque = {maximum = "0.3 N*m"' in err
    _, _, err = run("observer", "--deck", DECK, "--kind", "cascad")
    assert "Did you mean 'cascade'?" in err
    words = ("deck", "new", "joint.toml", "--template", "geared-joint", "--yes")
    _, _, err = run(*words, "--set", "gear.efficiency=75")
    assert "template geared-joint: gear.efficiency" in err
    assert "joint.toml:" not in err
    words = ("deck", "new", "leg.toml", "--template", "cam-actuator", "--yes")
    _, _, err = run(*words, "--material", "PMC 770")
    assert "PMC-770" in err
    assert "leg.toml:" not in err
    assert list(tmp_path.iterdir()) == []


def test_a_folder_for_a_deck_names_the_deck_in_it(run: Run) -> None:
    Path("d1").mkdir()
    Path("d1/model.toml").touch()
    status, _, err = run("deck", "show", "d1")
    assert status == 2
    assert f"name the deck in it: {Path('d1/model.toml')}" in err
    Path("Prüfstand").mkdir()
    status, _, err = run("deck", "show", "Prüfstand")
    assert (status, "is a folder -> name a .toml file" in err) == (2, True)
    Path("Prüfstand/knie.toml").touch()
    assert f"name the deck in it: {Path('Prüfstand/knie.toml')}" in run("deck", "show", "Prüfstand")[2]
    Path("Prüfstand/hüfte.toml").touch()
    assert f"in it, for instance {Path('Prüfstand/hüfte.toml')}" in run("deck", "show", "Prüfstand")[2]


def test_a_study_that_does_not_run_leaves_no_empty_folder(run: Run) -> None:
    assert run("study", "run", "helo", "--out", "a/b")[0] == 2
    Path("stops.py").write_text("def main(out, fast=False):\n    raise KeyboardInterrupt\n", encoding="utf-8")
    assert run("study", "run", "stops.py", "--out", "a/b")[0] == 130
    assert not Path("a").exists()


def test_a_deck_without_cam_is_answered_in_terms_of_the_deck(run: Run) -> None:
    status, _, err = run("design", "--deck", "dfki_pendulum", "--maximum", "1 N*m", "--angle", "50 deg")
    assert status == 2
    assert "of the deck" in err
