"""SSP archives: valid against the schema, read back as the same system, run by another tool."""

from __future__ import annotations

import math
import re
import tempfile
import zipfile
from collections.abc import Callable, Iterator
from dataclasses import replace
from pathlib import Path

import fmpy.ssp.ssd
import numpy as np
import pytest
from fmpy.ssp.simulation import simulate_ssp

from nlsdesign import quantity
from nlsdesign.export import Late, Wire, cosimulate, export_fmu, read_ssp, write_ssp
from nlsdesign.export.cosimulation.ssp import STRUCTURE_FILE
from nlsdesign.foundation.errors import ExportError, NlsError, UnitError, UnknownNameError, ValueRangeError
from nlsdesign.foundation.quantity import Quantity
from nlsdesign.model.flat import FlatModel
from tests.hand_built import controller, observer, plant

DESIRED = "controller.torque.desired"
WIRES: dict[str, str | Wire] = {
    "observer.motor.angle": "plant.motor.angle",
    "observer.motor.current": Late("controller.motor.current", gain=1.0),
    "controller.torque.actual": Wire("observer.spring.torque", gain=quantity(0.9, "1")),
    "plant.motor.current": Wire("controller.motor.current", gain=0.5, delay=1.5e-3),
}
ORDER = ("observer", "controller", "plant")
PARAMETERS = {"plant.motor.inertia": 7e-4, "plant.motor.angle": 0.2, "controller.gain.integral": 30.0}


def at_rest() -> FlatModel:
    """The plant from angle zero, where all outputs are zero at the start."""
    model = plant()
    return replace(model, states=tuple(replace(state, start=0.0) for state in model.states))


@pytest.fixture(scope="module", params=["2.0", "3.0"])
def fmus(request: pytest.FixtureRequest, tmp_path_factory: pytest.TempPathFactory) -> dict[str, Path]:
    folder = tmp_path_factory.mktemp("system")
    models = {"plant": at_rest(), "observer": observer(), "controller": controller()}
    return {n: export_fmu(m, folder / f"{n}.fmu", version=request.param) for n, m in models.items()}


@pytest.fixture(autouse=True)
def _nothing_left(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Iterator[None]:
    folder = tmp_path / "temporary"
    folder.mkdir()
    monkeypatch.setattr(tempfile, "tempdir", str(folder))
    yield
    assert list(folder.iterdir()) == []


def desired(time: float) -> float:
    return 0.5 * math.sin(6.0 * time)


@pytest.mark.long_cases("2.0-1.0", "3.0-1.0")
@pytest.mark.parametrize("version", ["1.0", "2.0"])
def test_what_is_written_is_read_and_run_as_the_same_system(
    version: str, fmus: dict[str, Path], tmp_path: Path
) -> None:
    written = write_ssp(
        tmp_path / "loop.ssp", fmus=fmus, wires=WIRES, parameters=PARAMETERS, order=ORDER, version=version
    )
    # What the standard has no place for is said.
    assert len(written.notes) == 3
    assert "the delay of 0.0015 s from controller.motor.current to plant.motor.current" in written.notes
    system = read_ssp(written.path, tmp_path / "unpacked")
    assert system.order == ORDER
    run = system.run(inputs={DESIRED: desired}, stop=0.2)
    given = {"fmus": fmus, "wires": WIRES, "order": ORDER, "parameters": PARAMETERS}
    expected = cosimulate(**given, inputs={DESIRED: desired}, stop=0.2)
    assert np.ptp(expected["plant.motor.angle"]) > 0.1
    for name in expected.trace.signals:
        np.testing.assert_array_equal(run[name], expected[name])


def test_it_is_valid_and_the_same_bytes_each_time(fmus: dict[str, Path], tmp_path: Path) -> None:
    given = {"fmus": fmus, "wires": WIRES, "parameters": PARAMETERS, "inputs": [DESIRED]}
    files = [write_ssp(tmp_path / folder / "loop.ssp", **given).path for folder in ("one", "other")]
    assert files[0].read_bytes() == files[1].read_bytes()
    # fmpy validates against the schemas of SSP 1.0.
    structure = fmpy.ssp.ssd.read_ssd(str(files[0]))
    assert [each.name for each in structure.system.elements] == ["plant", "observer", "controller"]
    assert len(structure.system.connections) == len(WIRES) + 1
    values = fmpy.ssp.ssd.read_ssv(str(files[0]), "resources/plant.ssv")
    assert {p.name: float(p.value) for p in values.parameters} == {"motor.inertia": 7e-4, "motor.angle": 0.2}
    text = structure_of(files[0])
    assert '<ssc:LinearTransformation factor="0.5"' in text
    assert '<ssc:BaseUnit kg="1" m="2" s="-2" rad="-1" />' in text


def test_another_master_runs_it_to_the_same_result(fmus: dict[str, Path], tmp_path: Path) -> None:
    """fmpy's: all read, then all step, zero at first; a signal from outside arrives a step later."""
    if not structure_is_fmi2(fmus):
        pytest.skip("that master knows FMI 2.0 only")
    wires = {
        "observer.motor.angle": "plant.motor.angle",
        "observer.motor.current": "controller.motor.current",
        "controller.torque.actual": "observer.spring.torque",
        "plant.motor.current": "controller.motor.current",
    }
    file = write_ssp(tmp_path / "loop.ssp", fmus=fmus, wires=wires, inputs=[DESIRED]).path
    other = simulate_ssp(
        str(file), stop_time=0.2, step_size=1e-3, input={"controller_torque.desired": desired}
    )
    late = {DESIRED: lambda t: desired(t - 1e-3) if t > 5e-4 else 0.0}
    run = cosimulate(fmus=fmus, wires=wires, inputs=late, stop=0.2)
    count = len(run.time) - 1
    assert np.ptp(run["plant.motor.angle"]) > 0.05
    # Its row k shows the end of step k.
    np.testing.assert_allclose(other["plant.motor.angle"][:count], run["plant.motor.angle"][1:], atol=1e-9)
    np.testing.assert_allclose(
        other["observer.spring.torque"][:count], run["observer.spring.torque"][:-1], atol=1e-9
    )


def structure_is_fmi2(fmus: dict[str, Path]) -> bool:
    return fmpy.read_model_description(str(fmus["plant"])).fmiVersion == "2.0"


def structure_of(file: Path) -> str:
    with zipfile.ZipFile(file) as archive:
        return archive.read(STRUCTURE_FILE).decode()


def changed(file: Path, target: Path, change: Callable[[str], str], entry: str = STRUCTURE_FILE) -> Path:
    with zipfile.ZipFile(file) as old, zipfile.ZipFile(target, "w") as new:
        for name in old.namelist():
            content = old.read(name)
            if name == entry:
                text = change(content.decode())
                assert text != content.decode()
                content = text.encode()
            new.writestr(name, content)
    return target


# --- archives of other tools ----------------------------------------------------------------------


@pytest.fixture
def written(fmus: dict[str, Path], tmp_path: Path) -> Path:
    return write_ssp(tmp_path / "loop.ssp", fmus=fmus, wires=WIRES, parameters=PARAMETERS).path


def test_start_and_end_of_a_connection_say_nothing_of_its_direction(written: Path, tmp_path: Path) -> None:
    def turned(text: str) -> str:
        line = next(each for each in text.splitlines() if 'startConnector="motor.angle"' in each)
        other = line.replace("start", "#").replace("end", "start").replace("#", "end")
        return text.replace(line, other)

    here = read_ssp(written, tmp_path / "one")
    there = read_ssp(changed(written, tmp_path / "turned.ssp", turned), tmp_path / "other")
    assert dict(there.wires) == dict(here.wires)


def test_units_are_converted_unless_that_is_suppressed(written: Path, tmp_path: Path) -> None:
    def degrees(text: str) -> str:
        return re.sub(r'(kind="output">\s*<ssc:Real unit=)"rad"', r'\1"deg"', text, count=1)

    def as_it_is(text: str) -> str:
        marked = 'startConnector="motor.angle" suppressUnitConversion="true"'
        return degrees(text).replace('startConnector="motor.angle"', marked)

    plain = read_ssp(changed(written, tmp_path / "as_it_is.ssp", as_it_is), tmp_path / "other")
    wire = plain.wires["observer.motor.angle"]
    assert isinstance(wire, Wire)
    assert isinstance(wire.gain, Quantity)
    # One degree is then read as one radian.
    assert wire.gain.number == pytest.approx(180.0 / math.pi)
    system = read_ssp(changed(written, tmp_path / "degrees.ssp", degrees), tmp_path / "one")
    wire = system.wires["observer.motor.angle"]
    assert isinstance(wire, Wire)
    assert wire.gain == quantity(1.0, "1")


REFUSED: dict[str, tuple[str, str, str]] = {
    "another version": ('version="1.0"', 'version="3.0"', "of SSP version '3.0'"),
    "no XML": ("<ssd:System ", "<ssd:System <", "is no valid XML"),
    "a system within": ("ssd:Component", "ssd:System", "System 'plant': only FMUs are read"),
    "another component": ("application/x-fmu-sharedlibrary", "application/x-matlab", "only FMUs are read"),
    "an offset": ('factor="0.5"', 'factor="0.5" offset="1"', "has an offset"),
    "a factor that is no number": ('factor="0.5"', 'factor="half"', "factor='half' is no number"),
    "a file elsewhere": ("resources/plant.fmu", "../../plant.fmu", "is no file of the archive"),
    "a missing file": ("resources/plant.fmu", "resources/none.fmu", "is no file of the archive"),
    "an unknown component": ('startElement="plant"', 'startElement="plan"', "unknown component 'plan'"),
    "an unknown connector": ('startConnector="motor.angle"', 'startConnector="x"', "has no connector 'x'"),
    "two outputs": (
        'name="motor.angle" kind="input"',
        'name="motor.angle" kind="output"',
        "no output with an input",
    ),
    "another transformation": (
        "ssc:LinearTransformation",
        "ssc:BooleanMappingTransformation",
        "only a Linear",
    ),
    "nothing": ("ssd:Elements", "ssd:Nothing", "holds no FMU"),
}


@pytest.mark.long_cases(*(f"3.0-{case}" for case in REFUSED if case != "nothing"))
@pytest.mark.parametrize("case", REFUSED)
def test_what_is_not_read_is_named(case: str, written: Path, tmp_path: Path) -> None:
    old, new, words = REFUSED[case]
    bad = changed(written, tmp_path / "bad.ssp", lambda text: text.replace(old, new))
    with pytest.raises(ExportError, match=r"^system .*bad\.ssp") as caught:
        read_ssp(bad, tmp_path / "unpacked")
    assert words in str(caught.value)


def test_a_damaged_archive_or_value_is_named(written: Path, tmp_path: Path) -> None:
    (tmp_path / "cut.ssp").write_bytes(written.read_bytes()[:5000])
    with pytest.raises(ExportError, match=r"^system .*cut\.ssp: is not a valid archive"):
        read_ssp(tmp_path / "cut.ssp", tmp_path / "one")
    bad = changed(
        written, tmp_path / "bad.ssp", lambda t: t.replace("0.0007", "heavy"), "resources/plant.ssv"
    )
    with pytest.raises(ExportError, match="value='heavy' is no number"):
        read_ssp(bad, tmp_path / "two")


@pytest.mark.parametrize(
    ("changes", "error", "words"),
    [
        ({"version": "1.5"}, ValueRangeError, "is none of 1.0, 2.0"),
        ({"order": ("plant",)}, ValueRangeError, "each of"),
        ({"wires": {"plant.motor.current": "controller.motor.curent"}}, UnknownNameError, "did you mean"),
        ({"wires": {"plant.motor.current": "observer.spring.torque"}}, UnitError, "N*m/rad"),
        ({"parameters": {"plant.motor.inertai": 1.0}}, UnknownNameError, "plant.motor.inertia"),
        ({"inputs": ["plant.motor.current"]}, ExportError, "by a wire and by a signal"),
        ({"inputs": ["plant.motor.curent"]}, UnknownNameError, "plant.motor.current"),
    ],
)
def test_a_mistake_is_named_and_nothing_is_written(
    changes: dict[str, object], error: type[NlsError], words: str, fmus: dict[str, Path], tmp_path: Path
) -> None:
    given = {"fmus": fmus, "wires": WIRES} | changes
    with pytest.raises(error) as caught:
        write_ssp(tmp_path / "loop.ssp", **given)  # type: ignore[arg-type]
    assert words in str(caught.value)
    assert not (tmp_path / "loop.ssp").exists()
