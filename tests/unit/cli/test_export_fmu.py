"""``nlsdesign export fmu``: what is written, for whom, by whom."""

from __future__ import annotations

import re
import zipfile
from pathlib import Path

import fmpy
import numpy as np
import pytest
from fmpy.util import read_csv

from tests.command_line import Run, files_in, run, two_machines

__all__ = ["run", "two_machines"]  # the fixtures
pytestmark = pytest.mark.usefixtures("two_machines")

WORDS = ("export", "fmu", "--deck", "austin2015_figure_consistent", "--kind", "cascade")
LINEAR = "austin2015_soft_spring"
"""Margins over the spread of a linear spring are known in no time."""
ONLY_THE_RATE = re.compile(r"warning: largest_rate of the encoder of motor\.angle is 95 rad/s, .*\n")
"""The deck declares a smaller rate of its encoder than its drive can reach, and nothing else is remarked."""


def described(file: Path) -> fmpy.model_description.ModelDescription:
    return fmpy.read_model_description(str(file))


@pytest.mark.slow
def test_all_that_the_deck_allows_is_written_with_its_author_and_date(run: Run, tmp_path: Path) -> None:
    about = ("--author", "A. Maker", "--licence", "CC0", "--date", "2026-03-04T12:00:00Z")
    status, out, err = run(*WORDS, "--out", "o", *about)
    assert (status, ONLY_THE_RATE.fullmatch(err) is not None) == (0, True), err
    assert "left out" not in out
    names = files_in(tmp_path / "o")
    assert names == ["controller.fmu", "observer.fmu", "observer_and_controller.fmu", "plant.fmu"]
    for name in names:
        found = described(tmp_path / "o" / name)
        assert (found.author, found.license) == ("A. Maker", "CC0")
        assert found.generationDateAndTime == "2026-03-04T12:00:00Z"
    assert "speed by tangent stiffness" in described(tmp_path / "o" / "controller.fmu").description
    joint = described(tmp_path / "o" / "observer_and_controller.fmu")
    assert {v.name for v in joint.modelVariables if v.causality == "input"} == {
        "motor.angle",
        "spring.torque.desired",
    }
    first = (tmp_path / "o" / "plant.fmu").read_bytes()
    # Once more the same bytes, for the quickest of them.
    assert run(*WORDS, "--what", "plant", "--out", "again", *about)[0] == 0
    assert (tmp_path / "again" / "plant.fmu").read_bytes() == first


# The default in C: test_controller.py; in an FMU: the test above.
@pytest.mark.long_cases("pid", "default")
@pytest.mark.parametrize(
    ("law", "words"),
    [((), "speed by tangent stiffness"), (("--law", "pid"), "PID on the")],
    ids=["default", "pid"],
)
def test_the_law_is_that_of_the_c_code(run: Run, tmp_path: Path, law: tuple[str, ...], words: str) -> None:
    asked = ("--what", "controller", "--out", "o")
    assert run(*WORDS, "--deck", LINEAR, *asked, *law)[0] == 0
    assert words in described(tmp_path / "o" / "controller.fmu").description
    assert run("export", "c", "--deck", LINEAR, "--what", "controller", "--out", "c", *law)[0] == 0
    assert words in (tmp_path / "c" / "controller.h").read_text(encoding="utf-8")


@pytest.mark.slow
def test_what_is_asked_for_is_written_once_with_its_reference(run: Run, tmp_path: Path) -> None:
    asked = ("--what", "controller", "--what", "controller", "--reference", "--version", "2.0")
    status, out, err = run(*WORDS, "--out", "o", *asked)
    assert (status, ONLY_THE_RATE.fullmatch(err) is not None) == (0, True), err
    names = {"controller.fmu", "controller_in.csv", "controller_ref.csv", "controller_ref.opt"}
    assert set(files_in(tmp_path / "o")) == names
    assert all(name in out for name in names)
    reference = read_csv(str(tmp_path / "o" / "controller_ref.csv"))
    result = fmpy.simulate_fmu(
        str(tmp_path / "o" / "controller.fmu"),
        stop_time=1.0,
        output_interval=1e-3,
        input=read_csv(str(tmp_path / "o" / "controller_in.csv")),
        output=["motor.current"],
    )
    size = np.ptp(reference["motor.current"])
    assert size > 1.0
    assert np.abs(result["motor.current"] - reference["motor.current"]).max() < 1e-9 * size


def test_all_platforms_by_one_word(run: Run, tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    from nlsdesign.export.fmi import fmu as compiled_binaries

    def instead(sources, target, *, platform, **_):  # type: ignore[no-untyped-def]
        target.write_bytes(platform.name.encode())

    monkeypatch.setenv("NLSDESIGN_CACHE", str(tmp_path / "cache"))
    monkeypatch.setattr(compiled_binaries, "compile_library", instead)
    status, _, err = run(*WORDS, "--out", "o", "--what", "plant", "--platform", "all")
    assert (status, ONLY_THE_RATE.fullmatch(err) is not None) == (0, True), err
    with zipfile.ZipFile(tmp_path / "o" / "plant.fmu") as archive:
        folders = {name.split("/")[1] for name in archive.namelist() if name.startswith("binaries/")}
    assert folders == {"x86_64-linux", "aarch64-linux", "x86_64-windows", "x86_64-darwin", "aarch64-darwin"}


@pytest.mark.parametrize(
    ("words", "message"),
    [
        (("--what", "motor"), "'motor' is not one of"),
        (("--what", "plant", "--platform", "amiga"), "amiga"),
        (("--date", "yesterday"), "is no date"),
        (("--date", "2026-03-04"), "has no time zone"),
        (("--version", "1.0"), "'1.0' is not one of"),
    ],
)
def test_what_cannot_be_is_refused_and_leaves_nothing(
    run: Run, tmp_path: Path, words: tuple[str, ...], message: str
) -> None:
    status, _, err = run(*WORDS, "--out", "o", *words)
    assert status == 2
    assert message in err
    assert not (tmp_path / "o").exists()
