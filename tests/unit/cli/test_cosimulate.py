"""``nlsdesign cosimulate`` on FMUs of hand-built models: the same run as from Python, and bad wires named."""

from __future__ import annotations

import csv
import json
import re
from pathlib import Path

import numpy as np
import pytest

from nlsdesign import quantity
from nlsdesign.export import FmuSystem, Late, SamplesOf, Wire, cosimulate, export_fmu
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
    for target, source in ({BACK[0]: f"late:{BACK[1]}"} | WIRES | changed).items():
        found += ["--wire", f"{target}={source}"]
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
    assert "1 ms" in out
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
        (["--wire", "a.b=c.d@soon"], "is neither a time nor a number of samples"),
        (["--wire", "a.b=c.d@2 kg"], "is not a unit like 'ms'"),
        (["--wire", "a.b=c.d*much"], "does not start with a number"),
        (["--wire", "a.b=*2"], "is not FROM[*GAIN][@DELAY]"),
        (["--wire", "a.b=late:c.d@1ms"], "is not FROM[*GAIN][@DELAY]"),
        (["--system", "nothing.ssp"], "holds the FMUs already"),
    ],
)
def test_a_mistake_is_named_and_nothing_is_written(
    run: Run, fmus: dict[str, Path], tmp_path: Path, extra: list[str], said: str
) -> None:
    status, _, err = run(*words(fmus), *extra)
    assert status == 2
    assert said in err
    assert not (tmp_path / "y.csv").exists()


@pytest.mark.parametrize("number", ["nan", "1@inf", "x"])
def test_an_input_that_is_no_finite_number_is_refused(run: Run, fmus: dict[str, Path], number: str) -> None:
    call = ("cosimulate", "--fmu", f"plant={fmus['plant']}", "--stop", "0.05 s", "--out", "y.csv")
    status, _, err = run(*call, "--input", f"plant.motor.current={number}")
    assert status == 2
    assert f"'{number}' cannot be read" in err


def test_a_sine_between_the_steps_is_refused_and_one_with_four_is_not(
    run: Run, fmus: dict[str, Path], tmp_path: Path
) -> None:
    call = ("cosimulate", "--fmu", f"plant={fmus['plant']}", "--stop", "0.01 s", "--out", "y.csv")
    status, _, err = run(*call, "--input", "plant.motor.current=1@5000", "--step", "1 ms")
    assert status == 2
    assert "5000 Hz: has 0.2 steps to a period" in err
    assert not (tmp_path / "y.csv").exists()
    assert run(*call, "--input", "plant.motor.current=1@250", "--step", "1 ms")[0] == 0


def test_inputs_and_outputs_are_listed_and_other_signals_on_request(
    run: Run, fmus: dict[str, Path], tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    call = ("cosimulate", "--fmu", f"plant={fmus['plant']}", "--stop", "0.05 s", "--out", "y.csv")
    status, out, err = run(*call)
    assert status == 0, err
    heads = (tmp_path / "y.csv").read_text(encoding="utf-8").partition("\n")[0]
    inner = [head.partition(" [")[0] for head in heads.split(",") if "der(" in head]
    assert inner, "inner signals are in the file"
    assert not any(name in out for name in inner)
    assert "plant.motor.angle" in out
    left = int(re.search(r"and (\d+) more signals in y.csv", out)[1])
    assert left >= len(inner)
    out = run(*call, "--force", "--signals", "plant.der(*")[1]
    assert inner[0] in out
    monkeypatch.setattr(FmuSystem, "run", lambda *_, **__: pytest.fail("the name comes before the work"))
    status, _, err = run(*call, "--force", "--signals", "plant.nothing*")
    assert status == 2
    assert "--signals 'plant.nothing*': no such name" in err


def test_an_fmu_that_is_read_is_not_written_over(run: Run, fmus: dict[str, Path], tmp_path: Path) -> None:
    copy = tmp_path / "plant.csv"
    copy.write_bytes(fmus["plant"].read_bytes())
    call = ("cosimulate", "--fmu", f"plant={copy}", "--stop", "0.1 s", "--out", "plant.csv")
    assert run(*call)[0] == 2
    status, _, err = run(*call, "--force")
    assert status == 2
    assert "is an FMU or a system that is read" in err
    assert copy.read_bytes() == fmus["plant"].read_bytes()


def test_gain_and_delay_of_a_wire_are_those_of_the_library(run: Run, fmus: dict[str, Path]) -> None:
    written = {
        BACK[0]: f"{BACK[1]}*-0.5@2.5ms",
        "observer.motor.current": "controller.motor.current*1e3 mA/A@2samples:controller",
        "controller.torque.actual": "observer.spring.torque@0.5sample",
    }
    status, out, err = run(*words(fmus, **written), "--json")
    assert status == 0, err
    wires = {
        **WIRES,
        BACK[0]: Wire(BACK[1], gain=-0.5, delay=2.5e-3),
        "observer.motor.current": Wire(
            "controller.motor.current", gain=quantity(1e3, "mA/A"), delay=SamplesOf("controller", 2)
        ),
        "controller.torque.actual": Wire("observer.spring.torque", delay=SamplesOf(count=0.5)),
    }
    expected = cosimulate(fmus=fmus, wires=wires, inputs={DESIRED: Sine(0.5, 1.0)}, stop=0.5, order=ORDER)
    found = json.loads(out)
    assert found["delays"] == dict(expected.delays)
    assert found["delays"][BACK[0]] == 2.5e-3
    assert found["signals"]["plant.motor.angle"]["last"] == expected["plant.motor.angle"][-1]
    assert found["signals"]["plant.motor.angle"]["rms"] > 0.01


def test_a_driven_plant_shows_its_error_and_how_it_converges(run: Run, fmus: dict[str, Path]) -> None:
    called = ["cosimulate", "--fmu", f"plant={fmus['plant']}", "--stop", "0.05 s", "--step", "1 ms"]
    called += ["--input", "plant.motor.current=1@10", "--out", "y.csv", "--halvings", "3"]
    status, out, err = run(*called, "--json")
    assert status == 0, err
    found = json.loads(out)
    assert found["convergence"]["steps"] == [1e-3, 5e-4, 2.5e-4, 1.25e-4]
    angle = found["convergence"]["signals"]["plant.motor.angle"]
    assert angle["orders"] == pytest.approx([2.0, 2.0], abs=0.2)
    assert found["signals"]["plant.motor.angle"]["error"] == pytest.approx(4 / 3 * angle["differences"][0])
    _, out, _ = run(*called)
    assert "Change when the step is halved" in out
    assert "coupling error" in out


def test_a_system_is_written_and_run(run: Run, fmus: dict[str, Path], tmp_path: Path) -> None:
    given = words(fmus)
    stop, out, drive = given.index("--stop"), given.index("--out"), given.index("--input")
    described = [
        w for i, w in enumerate(given) if i not in {0, stop, stop + 1, out, out + 1, drive, drive + 1}
    ]
    status, _, err = run("export", "ssp", *described, "--out", "loop.ssp")
    assert status == 0
    assert "an annotation, which other tools may ignore: the delay of 0.001 s" in err
    called = ["cosimulate", "--system", "loop.ssp", "--stop", "0.5 s", "--input", f"{DESIRED}=0.5@1"]
    status, _, err = run(*called, "--out", "system.csv")
    assert status == 0, err
    status, _, err = run(*given)
    assert status == 0, err
    assert (tmp_path / "system.csv").read_bytes() == (tmp_path / "y.csv").read_bytes()
    status, _, err = run("cosimulate", "--stop", "1 s", "--out", "z.csv")
    assert status == 2
    assert "no FMU" in err
