"""``nlsdesign simulate`` forward: what is typed is what drives, and what is written can be read again."""

from __future__ import annotations

import csv
import json
import math
from pathlib import Path

import numpy as np
import pytest
from numpy.typing import NDArray

from nlsdesign.cli.simulate import read_driving_signal
from nlsdesign.foundation.errors import NlsError
from nlsdesign.simulation import Sine, StepAt
from tests.command_line import Run, run
from tests.undrawn import undrawn

__all__ = ["run", "undrawn"]
pytestmark = pytest.mark.usefixtures("undrawn")
DECK = "austin2015_soft_spring"
QUICK = ("simulate", "--table-only")
STIFFNESS, TORQUE_CONSTANT, SLIDING = 1.7, 4 * 0.055, 0.02
"""In N·m/rad, N·m/A behind the gear, and N·m: numbers of the deck."""


def columns(file: Path) -> dict[str, NDArray[np.float64]]:
    with file.open(encoding="utf-8", newline="") as stream:
        rows = list(csv.reader(stream))
    numbers = np.array(rows[1:], dtype=float)
    return {head: numbers[:, i] for i, head in enumerate(rows[0])}


@pytest.mark.parametrize(
    ("text", "signal"),
    [
        ("2", Sine(0.0, 0.0, 2.0)),
        ("-2.5 mA", Sine(0.0, 0.0, -2.5e-3)),
        ("2@5", Sine(2.0, 5.0)),
        ("2 A @ 5 Hz", Sine(2.0, 5.0)),
        ("200 mA sine 5 kHz", Sine(0.2, 5000.0)),
        ("1 A + 2 A sine 5", Sine(2.0, 5.0, 1.0)),
        ("2 A step 100 ms", StepAt(2.0, 0.1)),
    ],
)
def test_a_signal_is_read_as_it_is_typed(text: str, signal: Sine | StepAt) -> None:
    read = read_driving_signal(text, "A")
    assert type(read) is type(signal)
    assert [read(t) for t in (0.0, 0.03, 0.2)] == pytest.approx([signal(t) for t in (0.0, 0.03, 0.2)])


@pytest.mark.parametrize(
    "text", ["2 N", "A", "2 A sine", "2 A sine 5 A", "1 A + 2 A", "2@3@4", "nan", "inf A"]
)
def test_what_is_no_signal_is_refused(text: str) -> None:
    with pytest.raises(NlsError):
        read_driving_signal(text, "A")


def test_current_alone_drives_a_machine_to_where_its_spring_balances_it(run: Run, tmp_path: Path) -> None:
    words = ("--deck", DECK, "--input", "motor.current=8 A", "--stop", "3 s", "--out", "o/run.csv", "--json")
    status, out, err = run("simulate", *words)
    assert (status, err) == (0, "")
    content = json.loads(out)
    angle = content["signals"]["motor.angle"]
    # Smooth friction creeps until the spring carries the whole torque.
    assert angle["last"] == pytest.approx(8.0 * TORQUE_CONSTANT / STIFFNESS, rel=0.02)
    assert angle["unit"] == "rad"
    assert {Path(each).name for each in content["files"]} == {"run.csv", "run.svg", "run.html"}
    table = columns(tmp_path / "o" / "run.csv")
    assert table["time [s]"][-1] == 3.0
    assert table["motor.angle [rad]"][-1] == angle["last"]
    assert np.max(table["spring.torque [N*m]"]) == content["signals"]["spring.torque"]["largest"]
    assert "<svg" in (tmp_path / "o" / "run.html").read_text(encoding="utf-8")


def test_sharp_friction_sticks_where_smooth_friction_creeps(run: Run) -> None:
    """Released within the dead band of the friction: it stays, or creeps back."""
    angle = 0.5 * SLIDING / STIFFNESS
    words = (*QUICK, "--deck", DECK, "--initial", f"motor.angle={angle} rad", "--stop", "0.5 s", "--json")
    stuck, creeping = (json.loads(run(*words, "--friction", kind)[1]) for kind in ("sharp", "smooth"))
    assert stuck["signals"]["motor.angle"]["last"] == pytest.approx(angle, abs=1e-12)
    assert creeping["signals"]["motor.angle"]["last"] < 0.9 * angle
    words = (*QUICK, "--deck", DECK, "--input", "motor.current=2@1", "--stop", "1 s", "--json")
    events = json.loads(run(*words, "--friction", "sharp")[1])["events"]
    # It slips when the current has overcome the friction, to the microsecond.
    slips = math.asin(SLIDING / TORQUE_CONSTANT / 2.0) / (2.0 * math.pi)
    assert events[0]["name"] == "dry_friction"
    assert events[0]["time"] == pytest.approx(slips, abs=1e-6)


def test_the_speed_of_a_prescribed_motion_follows_from_it(run: Run, tmp_path: Path) -> None:
    words = ("--deck", "vhb4910_specimen", "--input", "grip.position=10 mm + 5 mm sine 1 Hz", "--stop", "1 s")
    assert run(*QUICK, *words, "--out", "run.csv")[0] == 0
    table = columns(tmp_path / "run.csv")
    slope = np.gradient(table["grip.position [m]"], table["time [s]"])
    assert table["grip.speed [m/s]"][1:-1] == pytest.approx(slope[1:-1], abs=1e-6)
    words = ("--deck", "vhb4910_specimen", "--input", "grip.position=10 mm step 0.1 s", "--stop", "1 s")
    status, _, err = run(*QUICK, *words)
    assert status == 2
    assert "cannot jump" in err


def test_a_written_run_drives_the_machine_again_and_other_numbers_change_it(run: Run, tmp_path: Path) -> None:
    drive = ("--input", "motor.current=1 A + 2 A sine 3 Hz", "--stop", "1 s")
    assert run(*QUICK, "--deck", DECK, *drive, "--out", "first.csv")[0] == 0
    again = (*QUICK, "--deck", DECK, "--input-file", "first.csv")
    assert run(*again, "--out", "second.csv")[0] == 0
    one, other = columns(tmp_path / "first.csv"), columns(tmp_path / "second.csv")
    # The file is linear between its rows, 1 ms apart.
    assert other["motor.angle [rad]"] == pytest.approx(one["motor.angle [rad]"], abs=1e-4)
    changed = (*again, "--value", "spring.stiffness=3400 mN*m/rad", "--signals", "motor.angle")
    assert run(*changed, "--out", "third.csv")[0] == 0
    stiff = columns(tmp_path / "third.csv")
    assert list(stiff) == ["time [s]", "motor.angle [rad]"]
    assert np.max(stiff["motor.angle [rad]"]) < 0.8 * np.max(one["motor.angle [rad]"])
    status, _, err = run(*again, "--out", "first.csv")
    assert status == 2
    assert "is the file that is read" in err


def test_readings_are_records_from_which_the_numbers_come_back(run: Run, tmp_path: Path) -> None:
    for seed, drive in enumerate(("1 A sine 1 Hz", "2 A sine 2 Hz", "3 A sine 3 Hz")):
        words = (
            "--input",
            f"motor.current={drive}",
            "--stop",
            "2 s",
            "--value",
            "motor.inertia=0.0007 kg*m^2",
        )
        file = f"runs/{seed}.csv"
        assert run(*QUICK, "--deck", DECK, *words, "--readings", str(seed), "--out", file)[0] == 0
    table = columns(tmp_path / "runs" / "0.csv")
    assert set(table) == {"time [s]", "motor_encoder.reading [rad]", "motor.current [A]"}
    counts = table["motor_encoder.reading [rad]"] / 0.767e-6
    assert counts == pytest.approx(np.round(counts), abs=1e-6)
    status, out, err = run("fit", "--deck", DECK, "--records", "runs", "--json")
    assert status == 0, err
    fitted = {each["name"]: each["fitted"] for each in json.loads(out)["numbers"]}
    assert fitted["motor.inertia"] / fitted["spring.stiffness"] == pytest.approx(7e-4 / STIFFNESS, rel=0.01)
    status, out, _ = run("simulate", "--deck", DECK, "--record", "runs/0.csv", "--out", "y.csv", "--json")
    assert status == 0
    content = json.loads(out)
    band = content["in_band"]["motor.unbalanced"]
    # Counts differentiated twice drown it; in the band of a fit the wrong inertia shows, above the noise.
    assert content["rms"]["motor.unbalanced"] > 10.0 * band["error"]
    assert band["error"] > 2.0 * band["noise_floor"]


def test_limits_that_are_reached_are_warned_of(run: Run) -> None:
    words = (
        "--input",
        "motor.current=30 A step 0.1 s",
        "--stop",
        "0.3 s",
        "--value",
        "motor.current_limit=4 A",
    )
    status, out, _ = run(*QUICK, "--deck", DECK, *words)
    assert status == 0
    assert "warning: motor.current reaches 30 A, beyond 4 A from t = 0.1 s: motor.current_limit" in out
    assert "beyond -4 A" not in out
    words = ("--input", "motor.current=15 A", "--stop", "1 s", "--json")
    _, out, _ = run(*QUICK, "--deck", "austin2015_figure_consistent", *words)
    assert any("the contour of spring.cam ends" in each for each in json.loads(out)["warnings"])
    quiet = json.loads(run(*QUICK, "--deck", DECK, "--stop", "0.1 s", "--json")[1])
    assert quiet["warnings"] == []
    assert quiet["signals"]["motor.angle"]["rms"] == 0.0


@pytest.mark.slow
def test_a_supply_at_its_limit_is_warned_of_and_its_current_predicted(run: Run) -> None:
    """The speed bends sharply where the supply sets in; over a long span of the rate it is blurred."""
    assert run("deck", "new", "joint.toml", "--template", "geared-joint", "--yes")[0] == 0
    words = ("--deck", "joint.toml", "--input", "motor.current=1.2 A sine 0.2 Hz", "--stop", "5 s")
    status, out, _ = run("simulate", *words, "--readings", "2", "--table-only", "--out", "r.csv")
    assert status == 0
    assert "warning: motor.voltage is at its limit of 24 V from t = " in out
    _, out, _ = run("simulate", "--deck", "joint.toml", "--record", "r.csv", "--out", "y.csv", "--json")
    current = json.loads(out)["in_band"]["current_sensor.reading"]
    assert current["error"] < 1.5 * current["noise_floor"]


def test_a_cable_that_is_left_is_warned_of_on_both_sides(run: Run) -> None:
    assert run("deck", "new", "finger.toml", "--template", "one-sided-finger", "--yes")[0] == 0
    words = ("--input", "motor.current=1 A sine 1 Hz", "--stop", "1 s")
    status, out, _ = run("simulate", "--deck", "finger.toml", *words, "--table-only", "--out", "f.csv")
    assert status == 0
    assert "beyond 1.047 rad from t = 0.117 s: the contour of spring.cam ends" in out
    assert "beyond -1.047 rad" in out
    assert "spring.cam has no lever arm on this side, nothing pulls back" in out


@pytest.mark.parametrize(
    ("words", "rule"),
    [
        (("--input", "motor.curent=2 A", "--stop", "1 s"), "did you mean 'motor.current'?"),
        (("--input", "motor.current=2 N", "--stop", "1 s"), "is not in a unit like A"),
        (("--input", "motor.current", "--stop", "1 s"), "is not NAME=VALUE"),
        (("--input", "motor.current=1 A", "--input", "motor.current=1 A", "--stop", "1 s"), "is given twice"),
        (("--input", "motor.current=2 A"), "--stop: is not given"),
        (("--stop", "-1 s"), "must be above zero"),
        (("--stop", "1 s", "--step", "0 s"), "must be above zero"),
        (("--stop", "1e9 s"), "take a longer --step"),
        (("--stop", "1 s", "--initial", "motor.angel=1 rad"), "did you mean 'motor.angle'?"),
        (("--stop", "1 s", "--value", "motor.inertai=1 kg*m^2"), "did you mean 'motor.inertia'?"),
        (("--stop", "1 s", "--value", "motor.inertia=1 kg"), "motor.inertia"),
        (("--stop", "1 s", "--value", "motor.torque_constant=55"), "write '55 mN·m/A' if that is meant"),
        (("--stop", "1 s", "--value", "motor.inertia=much"), "write for instance '0.000597 kg·m²'"),
        (("--stop", "1 s", "--signals", "motr.*"), "--signals 'motr.*': no such name"),
        (("--stop", "1 s", "--input-file", "none.csv"), "cannot be read"),
        (("--stop", "1 s", "--mapping", "map.toml"), "--mapping is of a --record"),
        (("--stop", "1 s", "--record", "r.csv"), "stands beside --record"),
    ],
)
def test_what_cannot_be_simulated_is_named_before_anything_is_written(
    words: tuple[str, ...], rule: str, run: Run, tmp_path: Path
) -> None:
    status, out, err = run(*QUICK, "--deck", DECK, *words)
    assert (status, out) == (2, "")
    assert rule in err
    assert list(tmp_path.iterdir()) == []


def test_a_number_without_a_unit_is_in_that_of_the_model_and_the_run_says_what_it_took(run: Run) -> None:
    words = (*QUICK, "--deck", DECK, "--stop", "0.01 s")
    bare = (*words, "--value", "spring.stiffness=3", "--initial", "motor.angle=0.25")
    status, out, _ = run(*bare)
    assert status == 0
    assert out.splitlines()[:2] == [
        "with spring.stiffness = 3 N·m/rad in place of 1.7 N·m/rad",
        "begins at motor.angle = 0.25 rad",
    ]
    by_unit = (*words, "--value", "spring.stiffness=3000 mN*m/rad", "--initial", "motor.angle=250 mrad")
    first, second = (json.loads(run(*each, "--json")[1]) for each in (bare, by_unit))
    assert first["signals"] == second["signals"]
    assert first["initial"] == second["initial"] == {"motor.angle": "0.25 rad"}
    assert first["values"] == {"spring.stiffness": "3 N·m/rad in place of 1.7 N·m/rad"}


@pytest.mark.parametrize(
    ("text", "rule"),
    [
        ("motor.current [A]\n1\n2\n", "has no column of time"),
        ("time [s],motor.current [N]\n0,1\n1,2\n", "is not in a unit like A"),
        ("time [s],motor.current [A]\n1,1\n0,2\n", "times that ascend"),
        ("time [s],motor.current [A]\n0,1\n1,nan\n", "not a number"),
        ("time [s],motor.speed [rad/s]\n0,1\n1,2\n", "has no column of an input"),
    ],
)
def test_a_file_of_inputs_that_cannot_drive_is_named(text: str, rule: str, run: Run, tmp_path: Path) -> None:
    (tmp_path / "drive.csv").write_text(text, encoding="utf-8")
    status, _, err = run(*QUICK, "--deck", DECK, "--input-file", "drive.csv")
    assert status == 2
    assert rule in err
    assert "drive.csv" in err


def test_a_file_of_inputs_has_units_of_its_own(run: Run, tmp_path: Path) -> None:
    (tmp_path / "drive.csv").write_text("t [ms];motor.current [mA]\n1000;0\n1500;2000\n", encoding="utf-8")
    status, out, _ = run(*QUICK, "--deck", DECK, "--input-file", "drive.csv", "--json")
    assert status == 0
    assert json.loads(out)["signals"]["motor.current"]["last"] == pytest.approx(2.0)
