"""The command line: exit status, one clear message, nothing half-written."""

from __future__ import annotations

import json
from pathlib import Path

import pytest

from nlsdesign.cli import studies
from tests.command_line import Run, files_in, run
from tests.undrawn import undrawn

__all__ = ["run", "undrawn"]
pytestmark = pytest.mark.usefixtures("undrawn")
DECK = "austin2015_figure_consistent"


def spoilt(root: Path, folder: Path, old: str, new: str) -> str:
    """Write a deck in which one piece of text is another, and return its path."""
    text = (root / "models" / "decks" / f"{DECK}.toml").read_text(encoding="utf8")
    assert old in text
    (folder / "spoilt.toml").write_text(text.replace(old, new, 1), encoding="utf8")
    return str(folder / "spoilt.toml")


SPOILT = {
    "misspelt field": ("viscosity =", "viscositi =", "did you mean 'viscosity'?"),
    "missing unit": ('unit = "Pa*s", ', "", "has no unit"),
    "millimetres for metres": ('value = 12.5, unit = "mm"', 'value = 12.5, unit = "m"', "was 'mm' meant?"),
    "unknown component": ('"LinearElastic"', '"LinearElastik"', "did you mean 'LinearElastic'?"),
    "unknown body": ('between = ["motor", "load"]', 'between = ["motor", "lode"]', "did you mean 'load'?"),
    "impossible arrangement": ('between = ["motor", "load"]', 'between = ["load"]', "can never move"),
}


@pytest.mark.parametrize("case", SPOILT)
@pytest.mark.parametrize("command", [("deck", "check"), ("observer", "--out", "o", "--deck")])
def test_bad_deck_is_named_and_nothing_is_written(
    case: str, command: tuple[str, ...], run: Run, root: Path, tmp_path: Path
) -> None:
    old, new, hint = SPOILT[case]
    path = spoilt(root, tmp_path, old, new)
    status, out, err = run(*command, path)
    assert status == 2
    assert out == ""
    assert err.startswith("error: spoilt.toml")
    assert hint in err
    assert len(err.strip().splitlines()) == 1
    assert [p.name for p in tmp_path.iterdir()] == ["spoilt.toml"]


def test_good_deck_passes(run: Run) -> None:
    status, out, err = run("deck", "check", DECK, "--json")
    assert (status, err) == (0, "")
    found = json.loads(out)
    assert found["numbers"] == 29
    # Twelve numbers of the drive, and the four limits of the readings.
    assert found["assumed"] == pytest.approx(16 / 29)


def test_unknown_deck_names_the_nearest(run: Run) -> None:
    status, _, err = run("deck", "show", "austin2015_soft")
    assert status == 2
    assert "did you mean 'austin2015_soft_spring'?" in err


@pytest.mark.slow
def test_infeasible_limits_are_named(run: Run, tmp_path: Path) -> None:
    words = ["--maximum", "5 N*m", "--angle", "53 deg"]
    words += ["--limit", 'MinimumRadiusOfCurvature = {radius = "30 mm"}']
    words += ["--limit", 'MaximumCamRadius = {radius = "5 mm"}']
    status, _, err = run("design", "--deck", DECK, "--starts", "1", *words)
    assert status == 2
    assert "MinimumRadiusOfCurvature" in err
    assert "MaximumCamRadius" in err
    assert list(tmp_path.iterdir()) == []


def test_number_without_unit_is_refused(run: Run) -> None:
    status, _, err = run("design", "--deck", DECK, "--maximum", "5", "--angle", "53 deg")
    assert status == 2
    assert "has no unit" in err


@pytest.mark.slow
def test_a_design_that_misses_is_no_success(run: Run, tmp_path: Path) -> None:
    """The contour alone cannot give the published actuator 5 N·m: the rubber would tear."""
    words = [
        "--target",
        'PowerTorque = {coefficient = 3.4, exponent = 1.0, angle = "50 deg"}',
        *("--draws", "0", "--starts", "1"),
    ]
    words += ["--free", "spring.cam.contour", "--free", "spring.pretension", "--out", "o"]
    status, out, err = run("design", "--deck", "austin2015_as_printed", *words)
    assert status == 1, err
    assert "MISSES ITS TARGET" in out
    assert "what would help" in out
    assert "no drawings are written" in out
    assert not list((tmp_path / "o").glob("*.dxf"))
    page = (tmp_path / "o" / "report.html").read_text(encoding="utf-8")
    assert "The design misses its target: " in page
    assert "Missed:" not in page, "it misses is said twice in one sentence"
    assert "Torque against the target" in page
    assert json.loads((tmp_path / "o" / "design.json").read_text(encoding="utf-8"))["met"] is False


@pytest.mark.slow
def test_a_design_file_is_followed_and_a_part_drawn(run: Run, tmp_path: Path) -> None:
    text = """
    free = ["spring.cam.contour", "spring.pretension", "spring.rubber.area", "spring.rubber.rest_length"]
    [target]
    ExponentialTorque = {maximum = "5 N*m", angle = "53 deg", shape = 1.0}
    [limits]
    MaximumCamRadius = {radius = "18 mm"}
    [drawing]
    thickness = "6 mm"
    """
    (tmp_path / "job.toml").write_text(text, encoding="utf-8")
    call = ["design", "--deck", "austin2015_as_printed", "--task", "job.toml", "--draws", "0", "--out", "o"]
    status, out, err = run(*call)
    assert status == 0, err
    assert "meets its target" in out
    names = {path.name for path in (tmp_path / "o").iterdir()}
    assert {"model.toml", "cam.dxf", "drawing.pdf", "picture.svg", "data_sheet.pdf", "design.json"} <= names
    page = (tmp_path / "o" / "report.html").read_text(encoding="utf-8")
    assert all(part in page for part in ("Torque against the target", "Use of each limit", "drawing.pdf"))
    # Another design into the same folder: nothing of the first one stays beside it.
    words = ["--target", 'PowerTorque = {coefficient = 3.4, exponent = 1.0, angle = "50 deg"}']
    status, _, _ = run("design", "--deck", "austin2015_as_printed", *words, "--draws", "0", "--out", "o")
    assert status == 1
    assert not {"cam.dxf", "cam.csv", "drawing.pdf"} & {path.name for path in (tmp_path / "o").iterdir()}
    status, _, err = run(*call, "--maximum", "5 N*m")
    assert status == 2
    assert "--maximum: stand beside --task" in err


def test_a_fast_study_is_not_blamed_for_what_it_leaves_out(run: Run, monkeypatch: pytest.MonkeyPatch) -> None:
    claimed = {name: studies.Claim(1.0, 0.1, "1", "for the test") for name in "ab"}
    monkeypatch.setattr(studies, "claims", lambda _: claimed)
    monkeypatch.setattr(studies, "run_study", lambda *_, **__: {"a": 2.0})
    status, _, err = run("study", "run", "hello", "--fast", "--out", "fast")
    assert status == 0
    assert "a = 2" in err
    assert "was not computed" not in err
    status, _, err = run("study", "run", "hello", "--out", "whole")
    assert status == 1
    assert "b was not computed" in err


def test_unknown_study_is_named(run: Run) -> None:
    status, _, err = run("study", "run", "austin2014")
    assert status == 2
    assert "did you mean 'austin2015'?" in err


def test_another_rig_needs_only_what_its_makers_declare(
    run: Run, root: Path, shared_folder: Path, tmp_path: Path
) -> None:
    rig = (shared_folder / "practice" / "rig.toml").read_text(encoding="utf8")
    (tmp_path / "rig.toml").write_text(rig.replace("A0_m2 = 0.0001", "A0_m2 = 0.0002"), encoding="utf8")
    cam = str(shared_folder / "practice" / "cam.csv")
    status, out, _ = run("deck", "from-rig", "rig.toml", cam, "--out", "other.toml")
    assert status == 0
    assert "other.toml" in out
    ours = (root / "models" / "decks" / "test_rig.toml").read_text(encoding="utf8").splitlines()
    other = (tmp_path / "other.toml").read_text(encoding="utf8").splitlines()
    assert [new for old, new in zip(ours, other, strict=True) if old != new] == [
        next(line for line in other if line.startswith("area = "))
    ]
    (tmp_path / "rig.toml").write_text(rig.replace("k_Pa", "k_pascal"), encoding="utf8")
    status, _, err = run("deck", "from-rig", "rig.toml", cam, "--out", "third.toml")
    assert status == 2
    assert "rubber.k_Pa" in err
    assert not (tmp_path / "third.toml").exists()


def test_every_part_that_a_deck_can_name_is_listed_with_its_law(run: Run) -> None:
    status, out, _ = run("parts", "--json")
    listed = json.loads(out)
    assert status == 0
    assert listed["TwoSidedCam"]["kind"] == "cam"
    assert all(entry["law"] for entry in listed.values())
    assert "Rack (gear)" in run("parts", "Rack")[1]
    _, out, _ = run("parts", "StribeckFriction")
    assert "Sources: Stribeck 1902" in out
    assert "stribeck_speed" in out
    assert "Armstrong-Hélouvry, B. (1991): Control of Machines with Friction" in out
    status, _, err = run("parts", "StribekFriction")
    assert status == 2
    assert "did you mean 'StribeckFriction'?" in err


@pytest.mark.parametrize("deck", ["janot2019_positioning_drive", "vhb4910_specimen"])
def test_a_plant_that_is_no_actuator_is_exported_alone(run: Run, deck: str, tmp_path: Path) -> None:
    status, out, err = run("export", "fmu", "--deck", deck, "--out", "fmu")
    assert (status, err) == (0, ""), err
    assert "plant.fmu" in out
    assert out.count("left out: ") == 3
    assert files_in(tmp_path / "fmu") == ["plant.fmu"]
    status, _, err = run("export", "c", "--deck", deck, "--out", "c")
    assert status == 2
    assert "needs the series spring" in err or "needs the driven body" in err
    assert "export fmu --what plant writes the plant alone" in err
    assert not (tmp_path / "c").exists()


@pytest.mark.slow
def test_a_drive_without_an_observer_is_exported_as_its_plant_alone(run: Run, tmp_path: Path) -> None:
    words = ("export", "fmu", "--deck", "one_sided_cable_drive", "--out", "o")
    status, _, err = run(*words, "--what", "plant", "--what", "observer")
    assert status != 0
    assert "has no observer" in err
    assert not (tmp_path / "o").exists(), "nothing half-written"
    status, out, _ = run(*words)
    assert status == 0
    assert "left out: observer" in out
    assert "has no observer" in out
    assert (tmp_path / "o" / "plant.fmu").exists()
    assert not (tmp_path / "o" / "observer.fmu").exists()


@pytest.mark.slow
def test_a_drive_with_a_gear_is_analysed_over_the_angle_of_its_motor(run: Run, tmp_path: Path) -> None:
    over = ("--to", "700 deg", "--count", "3", "--out", "o", "--json")
    status, out, _ = run("analyse", "--deck", "one_sided_cable_drive", *over)
    assert status == 0
    chart = json.loads(out)
    assert chart["observability.rank"][1:] == [3, 3]
    assert chart["stiffness.slow"][0] < chart["stiffness.slow"][1] < chart["stiffness.slow"][2]
    assert (tmp_path / "o" / "over_angle.csv").exists()


def test_a_folder_that_cannot_be_made_after_all_is_one_message(
    run: Run, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """It was asked for before the work; some file systems say no only when it is made."""

    def refuse(*_: object, **__: object) -> None:
        raise OSError(30, "Read-only file system")

    monkeypatch.setattr(Path, "mkdir", refuse)
    status, _, err = run("analyse", "--deck", DECK, "--out", str(tmp_path / "new"))
    assert status == 2
    assert "new: cannot be made (Read-only file system) -> name another folder" in err


@pytest.mark.parametrize(
    ("words", "said"),
    [
        ((), "Missing option '--deck'"),
        (("unheard-of",), "No such command 'unheard-of'"),
    ],
)
def test_the_observer_asks_for_a_deck_or_a_command_that_exists(
    words: tuple[str, ...], said: str, run: Run
) -> None:
    status, out, err = run("observer", *words)
    assert (status, out) == (2, "")
    assert said in err


@pytest.mark.slow
def test_analyse_without_a_command_goes_over_the_angle(
    run: Run, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setenv("COLUMNS", "400")  # no cell is wrapped
    words = ("--deck", DECK, "--from", "-10 deg", "--to", "45 deg", "--count", "2", "--out", "o")
    short, named = (run("analyse", *more, *words) for more in ((), ("angle",)))
    assert short == named
    status, out, _ = short
    assert status == 0
    assert "not seen at 0° (spring.cam.lever_arm_now is zero), decays with -70.4 1/s: detectable" in out
    assert "not seen while the machine sticks" in out
    assert "verdict: detectable at every angle from motor.angle" in out
    assert "sliding: dry friction at its sliding level" in out
    # Headings stand whole, one word to a line.
    assert {"condition", "frequency", "stiffness"} <= set(out.split())
    assert out.index("torque sensor") < out.index("present sensors")
    files = set(files_in(tmp_path / "o"))
    assert files == {"over_angle.csv", "poles.svg", "observability.svg", "report.html"}
    page = (tmp_path / "o" / "report.html").read_text(encoding="utf-8")
    assert "decays with −70.4 1/s: detectable" in page
    assert "Which sensor would help the torque most" in page


def test_analyse_as_json_says_what_is_not_seen_and_of_which_mode_each_pole_is(run: Run) -> None:
    status, out, _ = run("analyse", "--deck", DECK, "--to", "45 deg", "--count", "2", "--out", "o", "--json")
    assert status == 0
    content = json.loads(out)
    (drop,) = content["unseen"]
    assert drop["first"] == drop["last"] == 0.0
    assert drop["direction"] == "spring.rubber.relaxing.dashpot.strain"
    assert drop["eigenvalues"] == [[pytest.approx(-1.479e6 / 21e3), 0.0]]
    assert content["detectable"] is True
    assert content["sliding.frequency"][1] == pytest.approx(18.2, abs=0.1)
    assert "sliding level" in content["descriptions"]["sliding.decay"]
    assert content["sensors"]["rows"][0]["sensor"] == "torque sensor"


def test_analyse_names_what_is_wrong_with_a_range(run: Run, tmp_path: Path) -> None:
    status, _, err = run("analyse", "--deck", DECK, "--from", "20 deg", "--to", "10 deg", "--out", "o")
    assert status == 2
    assert "must lie above --from" in err
    assert run("analyse", "--deck", DECK, "--count", "1", "--out", "o")[0] == 2
    assert run("analyse", "lop")[0] == 2
    assert not (tmp_path / "o").exists()
