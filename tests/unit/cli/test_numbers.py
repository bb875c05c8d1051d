"""Bad numbers of options are refused before any work, by the name of the option."""

from __future__ import annotations

from pathlib import Path

import pytest

from tests.command_line import Run, run

__all__ = ["run"]
SOFT = "austin2015_soft_spring"
CAM = "austin2015_figure_consistent"
CURVE = ("--maximum", "5 N*m", "--angle", "53 deg")
SIMULATE = ("simulate", "--deck", SOFT, "--stop", "1 s", "--input")


def error_of(run: Run, words: tuple[str, ...], folder: Path) -> str:
    """What a refused command says; it prints nothing else and writes nothing."""
    status, out, err = run(*words)
    assert (status, out) == (2, "")
    assert not list(folder.iterdir())
    return err


@pytest.mark.parametrize(
    ("words", "said"),
    [
        (("simulate", "--deck", SOFT, "--stop", "-2 s"), "--stop '-2 s': must be above zero"),
        (("simulate", "--deck", SOFT, "--stop", "2"), "--stop: '2': has no unit -> write '2 s'"),
        (("simulate", "--deck", SOFT, "--stop", "nan s"), "--stop: nan s: a quantity must be finite"),
        ((*SIMULATE, "motor.current=2 A sine 5 kHz"), "0.2 rows to a period"),
        ((*SIMULATE, "motor.current=2 A step 5 s"), "comes after the run"),
        (
            ("simulate", "--deck", SOFT, "--stop", "1 s", "--step", "2 s"),
            "--step 2 s: is longer than the run",
        ),
        (
            ("analyse", "loop", "--deck", CAM, "--law", "scheduled", "--bandwidth", "0 Hz"),
            "--bandwidth '0 Hz'",
        ),
        (("analyse", "loop", "--deck", CAM, "--delay", "100000"), "'--delay': 100000 is not in the range"),
        (("analyse", "--deck", SOFT, "--count", "1000000"), "'--count': 1000000 is not in the range"),
        (("analyse", "--deck", SOFT, "--to", "1e9 deg"), "--to 1e+09°: is more than 5730°"),
        (("analyse", "--deck", SOFT, "--from", "10 deg", "--to", "5 deg"), "--to: must lie above --from"),
        (("fit", "--deck", SOFT, "--records", ".", "--window", "-1 s"), "--window '-1 s'"),
        (("diagnose", "--deck", SOFT, "--records", ".", "--sample-time", "0 s"), "--sample-time '0 s'"),
        (("diagnose", "--deck", SOFT, "--records", ".", "--sample-time", "5 s"), "must be at most 1000 ms"),
        (("cosimulate", "--fmu", "a=b", "--stop", "0 s", "--out", "x.csv"), "--stop '0 s'"),
        (("design", "--deck", CAM, *CURVE, "--seed", "-3"), "seed = -3"),
        (("design", "--deck", CAM, *CURVE, "--draws", "-3"), "draws = -3"),
        (
            ("design", "--deck", CAM, *CURVE, "--draws", "5"),
            "draws = 5: a tolerance needs 20 to 100000 draws",
        ),
        (("design", "--deck", CAM, *CURVE, "--draws", "100000000"), "draws = 100000000"),
        (("design", "--deck", CAM, *CURVE, "--starts", "100000000"), "starts = 100000000"),
        (("design", "--deck", CAM, *CURVE, "--largest-error", "1"), 'write "1 %"'),
        (("design", "--deck", CAM), "no target: is given -> write --maximum"),
    ],
)
def test_a_number_without_sense_is_refused_by_its_name(
    run: Run, tmp_path: Path, words: tuple[str, ...], said: str
) -> None:
    assert said in error_of(run, words, tmp_path)


@pytest.mark.parametrize(
    ("words", "said"),
    [
        (("observer", "--deck", CAM, "--draws", "8"), "--draws belongs to --errors"),
        (("observer", "calibrate", "--deck", CAM, "--plan", "--records", "."), "stands beside --plan"),
        (
            ("export", "modelica", "--deck", "dfki_pendulum", "--out", "x.txt"),
            "must end in .mo -> name it x.mo",
        ),
        (("export", "ssp", "--fmu", "a=b.fmu", "--out", "x.zip"), "must end in .ssp -> name it x.ssp"),
        (("analyse", "loop", "--deck", CAM, "--proportional", "1 A/(N*m)"), "'A/N/m' for 'A/(N*m)'"),
    ],
)
def test_what_would_be_ignored_or_misread_is_refused(
    run: Run, tmp_path: Path, words: tuple[str, ...], said: str
) -> None:
    assert said in error_of(run, words, tmp_path)


def test_a_path_with_quotes_is_a_path(run: Run, tmp_path: Path) -> None:
    curve = "angle [deg],torque [N*m]\n0,0\n10,1\n20,3\n"
    (tmp_path / 'o\'brien "x".csv').write_text(curve, encoding="utf8")
    status, _, err = run("design", "--deck", CAM, "--target-file", 'o\'brien "x".csv', "--dry-run")
    assert (status, err) == (0, "")


def test_a_mapping_that_is_not_there_or_none_is_said_so(run: Run, tmp_path: Path) -> None:
    (tmp_path / "a.csv").write_text("t_s,current_A\n0,0\n", encoding="utf8")
    (tmp_path / "deck.toml").write_text("[deck]\nname = 'a'\n", encoding="utf8")
    words = ("simulate", "--deck", SOFT, "--record", "a.csv", "--mapping")
    assert "-> name a records.toml" in run(*words, "no.toml")[2]
    assert "no such field -> use one of: time, columns" in run(*words, "deck.toml")[2]
