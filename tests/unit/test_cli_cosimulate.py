"""``nlsdesign cosimulate`` on FMUs of hand-built models: the same run as from Python, and bad wires named."""

from __future__ import annotations

import csv
import json
from pathlib import Path

import numpy as np
import pytest

from nlsdesign.export import Late, cosimulate, export_fmu
from nlsdesign.simulation import Sine
from tests.command_line import Run, run
from tests.hand_built import controller, observer, plant

__all__ = ["run"]
WIRES = {
    "observer.motor.angle": "plant.motor.angle",
    "observer.motor.current": "controller.motor.current",
    "controller.torque.actual": "observer.spring.torque",
}
BACK = ("plant.motor.current", "controller.motor.current")
ORDER = ("observer", "controller", "plant")
DESIRED = "controller.torque.desired"


@pytest.fixture(scope="module")
def fmus(tmp_path_factory: pytest.TempPathFactory) -> dict[str, Path]:
    folder = tmp_path_factory.mktemp("loop")
    models = {"plant": plant(), "observer": observer(), "controller": controller()}
    return {name: export_fmu(model, folder / f"{name}.fmu") for name, model in models.items()}


def words(fmus: dict[str, Path], **changed: str) -> list[str]:
    """Return the command line of the closed loop, some wires changed."""
    found = ["cosimulate", "--stop", "0.5 s", "--out", "y.csv", "--input", f"{DESIRED}=0.5@1"]
    for name, file in fmus.items():
        found += ["--fmu", f"{name}={file}"]
    for target, source in (WIRES | changed).items():
        found += ["--wire", f"{target}={source}"]
    found += ["--wire", "=late:".join(BACK)]
    for name in ORDER:
        found += ["--order", name]
    return found


def test_the_run_is_that_of_the_library(run: Run, fmus: dict[str, Path], tmp_path: Path) -> None:
    status, out, err = run(*words(fmus), "--json")
    assert status == 0, err
    told = json.loads(out)
    wires = {**WIRES, BACK[0]: Late(BACK[1])}
    expected = cosimulate(fmus=fmus, wires=wires, inputs={DESIRED: Sine(0.5, 1.0)}, stop=0.5, order=ORDER)
    assert told["step"] == expected.step
    assert told["delays"] == dict(expected.delays)
    with (tmp_path / "y.csv").open(newline="", encoding="utf8") as stream:
        head, *rows = csv.reader(stream)
    table = np.array(rows, dtype=float)
    torque = next(i for i, name in enumerate(head) if name.startswith("plant.spring.torque"))
    np.testing.assert_array_equal(table[:, torque], expected["plant.spring.torque"])
    assert np.ptp(table[:, torque]) > 0.1
    assert told["signals"]["plant.spring.torque"]["last"] == expected["plant.spring.torque"][-1]


def test_people_see_the_wires_and_the_signals(run: Run, fmus: dict[str, Path]) -> None:
    status, out, _ = run(*words(fmus))
    assert status == 0
    assert "delay in steps" in out
    assert "plant.motor.current" in out
    assert "written: y.csv" in out


@pytest.mark.parametrize(
    ("extra", "said"),
    [
        (["--wire", "observer.motor.angel=plant.motor.angle"], "did you mean 'observer.motor.angle'"),
        (["--input", "plant.motor.current=1@fast"], "'1@fast' cannot be read -> give a number, or"),
        (["--input", "plant.motor.current"], "is not NAME=VALUE"),
        (["--set", "plant.motor.inertia=heavy"], "'heavy' cannot be read"),
        (["--wire", "observer.motor.angle=plant.motor.speed"], "'observer.motor.angle' is given twice"),
        (["--input", f"{BACK[0]}=1"], "is driven by a wire and by a signal"),
        (["--fmu", "other=nothing.fmu", "--order", "other"], "nothing.fmu"),
    ],
)
def test_a_mistake_is_named_and_nothing_is_written(
    run: Run, fmus: dict[str, Path], tmp_path: Path, extra: list[str], said: str
) -> None:
    status, _, err = run(*words(fmus), *extra)
    assert status == 2
    assert said in err
    assert not (tmp_path / "y.csv").exists()
