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


@pytest.mark.parametrize(
    ("words", "said"),
    [
        (("simulate", "--deck", SOFT, "--stop", "-2 s"), "--stop '-2 s': must be above zero"),
        (("simulate", "--deck", SOFT, "--stop", "2"), "--stop: '2': has no unit -> write '2 s'"),
        (("simulate", "--deck", SOFT, "--stop", "nan s"), "--stop: nan s: a quantity must be finite"),
        ((*SIMULATE, "motor.current=2 A sine 5 kHz"), "0.2 rows to a period"),
        ((*SIMULATE, "motor.current=2 A step 5 s"), "comes after the run"),
        (("simulate", "--deck", SOFT, "--stop", "1 s", "--step", "2 s"), "--step 2 s: is longer than the run"),
        (("analyse", "loop", "--deck", CAM, "--law", "scheduled", "--bandwidth", "0 Hz"), "--bandwidth '0 Hz'"),
        (("fit", "--deck", SOFT, "--records", ".", "--window", "-1 s"), "--window '-1 s'"),
        (("diagnose", "--deck", SOFT, "--records", ".", "--sample-time", "0 s"), "--sample-time '0 s'"),
        (("cosimulate", "--fmu", "a=b", "--stop", "0 s", "--out", "x.csv"), "--stop '0 s'"),
        (("design", "--deck", CAM, *CURVE, "--seed", "-3"), "seed = -3"),
        (("design", "--deck", CAM, *CURVE, "--draws", "-3"), "draws = -3"),
        (("design", "--deck", CAM, *CURVE, "--draws", "5"), "draws = 5: a tolerance needs at least 20 draws"),
        (("design", "--deck", CAM, *CURVE, "--largest-error", "1"), 'write "1 %"'),
        (("design", "--deck", CAM), "no target: is given -> write --maximum"),
    ],
)
def test_a_number_without_sense_is_refused_by_its_name(
    run: Run, tmp_path: Path, words: tuple[str, ...], said: str
) -> None:
    status, out, err = run(*words)
    assert (status, out) == (2, "")
    assert said in err
    assert not list(tmp_path.iterdir())
