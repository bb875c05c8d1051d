"""``nlsdesign export controller``: what is written, and bad input named before anything is."""

from __future__ import annotations

from pathlib import Path

import pytest

from tests.command_line import Run, files_in, run, two_machines

__all__ = ["run", "two_machines"]  # the fixtures
pytestmark = pytest.mark.usefixtures("two_machines")
DECK = "austin2015_figure_consistent"


@pytest.mark.long_cases("pid-PID on the")  # quick: test_export_fmu.py
@pytest.mark.parametrize(
    ("law", "told"), [("scheduled", "speed by tangent stiffness"), ("pid", "PID on the")]
)
def test_the_controller_is_written_as_c(run: Run, tmp_path: Path, law: str, told: str) -> None:
    status, out, err = run(
        "export", "controller", "--deck", DECK, "--law", law, "--out", "c", "--real", "float"
    )
    assert status == 0, err
    assert told in out
    assert "largest torque that the drive can hold: 4.379 N·m" in out
    assert set(files_in(tmp_path / "c")) == {
        "controller.c", "controller.h", "controller_selftest.c",
    }  # fmt: skip
    header = (tmp_path / "c" / "controller.h").read_text(encoding="utf-8")
    assert "dry_friction" in header
    assert "sliding_effort" in header


# Quicker: unit/cli/test_export_fmu.py
@pytest.mark.slow
def test_an_fmu_stands_beside_it(run: Run, tmp_path: Path) -> None:
    status, _, err = run("export", "controller", "--deck", "austin2015_soft_spring", "--out", "c", "--fmu")
    assert status == 0, err
    assert (tmp_path / "c" / "controller.fmu").stat().st_size > 10_000


@pytest.mark.parametrize(
    ("words", "said"),
    [
        (("--deck", DECK, "--bandwidth", "-5 Hz"), "bandwidth"),
        (("--deck", DECK, "--bandwidth", "300 Hz"), "100 Hz"),
        (("--deck", DECK, "--law", "pid", "--bandwidth", "5 Hz"), "has gains and no bandwidth"),
        (("--deck", DECK, "--velocity-bandwidth", "60 Hz", "--sample-time", "2 ms"), "50 Hz"),
        (("--deck", "vhb4910_specimen"), "no body free to move"),
        (("--deck", "xl330_pendulum"), "there is no spring"),
    ],
)
def test_bad_input_is_named_and_nothing_written(
    run: Run, tmp_path: Path, words: tuple[str, ...], said: str
) -> None:
    status, _, err = run("export", "controller", *words, "--out", "c")
    assert status == 2
    assert said in err
    assert not (tmp_path / "c").exists()
