"""The FMUs keep the standard: files, description, phases, values, copies, steps, messages."""

from __future__ import annotations

import math
import shutil
import subprocess
import zipfile
from dataclasses import replace
from pathlib import Path

import casadi as ca
import fmpy
import numpy as np
import pytest
from fmpy.validation import validate_fmu
from lxml import etree

from nlsdesign.export import ALL_PLATFORMS, export_fmu
from nlsdesign.export.c.guarded_step import INPUT_HELD, INPUT_SATURATED, GuardedModel, index_bit
from nlsdesign.export.compilation.cross_compiler import (
    BASELINE,
    PLATFORMS,
    STRICT,
    host_platform,
    run_compiler,
)
from nlsdesign.export.fmi import fmu
from nlsdesign.export.fmi.fmu import fmi_headers, universal_binary
from nlsdesign.foundation.errors import ExportError, UnknownNameError, ValueRangeError
from nlsdesign.foundation.quantity import parse_unit
from nlsdesign.model.flat import FlatModel, Variable
from tests.fmu_unit import VERSIONS, Refused, Unit, both, exported, opened, unpacked
from tests.hand_built import SAMPLE_TIME, controller, observer, plant

MODELS = {
    "plant": plant(outputs=("motor.angle", "spring.torque", "motor.power")),
    "observer": observer(),
    "controller": controller(),
}
SCHEMAS = Path(fmpy.__file__).parent / "schema"


@pytest.fixture(scope="module")
def units(tmp_path_factory) -> dict[tuple[str, str], Path]:
    return exported(MODELS, tmp_path_factory.mktemp("fmu"))


each_model = pytest.mark.parametrize("name", MODELS)


# --- files and description ------------------------------------------------------------------------


@both
@each_model
def test_fmpy_finds_no_problem_and_simulates(name, version, units):
    assert validate_fmu(str(units[name, version])) == []
    result = fmpy.simulate_fmu(str(units[name, version]), stop_time=0.1)
    assert result["time"][-1] == pytest.approx(0.1)
    assert all(np.all(np.isfinite(result[column])) for column in result.dtype.names)


@both
@each_model
def test_the_archive_holds_what_the_standard_names(name, version, units):
    with zipfile.ZipFile(units[name, version]) as archive:
        names, text = set(archive.namelist()), archive.read("modelDescription.xml")
        page = archive.read("documentation/index.html").decode()
        icon = archive.read("model.png" if version == "2.0" else "terminalsAndIcons/icon.png")
        licence = archive.read("documentation/licenses/license.txt").decode()
        extra = {n: archive.read(n) for n in names if n.endswith(".xml")}
    folder = "fmi2" if version == "2.0" else "fmi3"
    schema(folder, f"{folder}ModelDescription.xsd").assertValid(etree.fromstring(text))
    if version == "3.0":
        schema("fmi3", "fmi3BuildDescription.xsd").assertValid(
            etree.fromstring(extra["sources/buildDescription.xml"])
        )
        schema("fmi3", "fmi3TerminalsAndIcons.xsd").assertValid(
            etree.fromstring(extra["terminalsAndIcons/terminalsAndIcons.xml"])
        )
    (offers,) = etree.fromstring(text).iter("CoSimulation")
    word = "providesDirectionalDerivative" + ("" if version == "2.0" else "s")
    assert offers.get(word) == "true"
    assert icon.startswith(b"\x89PNG\r\n\x1a\n")
    assert "MIT License" in licence
    for variable in (*MODELS[name].inputs, *MODELS[name].parameters, *MODELS[name].outputs):
        assert f"<td>{variable.name}</td>" in page
    assert len([n for n in names if n.startswith("binaries/")]) == 1


def schema(folder: str, name: str) -> etree.XMLSchema:
    return etree.XMLSchema(etree.parse(str(SCHEMAS / folder / name)))


@pytest.mark.slow
@pytest.mark.long_cases("plant-2.0", "observer-2.0", "controller-2.0", "observer-3.0", "controller-3.0")
@both
@each_model
def test_the_sources_in_the_archive_compile_without_a_warning(name, version, units, tmp_path):
    with unpacked(units[name, version]) as folder:
        main = Path(folder) / "sources" / ("fmi2.c" if version == "2.0" else "fmi3.c")
        target = ["-target", PLATFORMS[host_platform()].target, *BASELINE]
        common = [*STRICT, "-O2", "-fPIC", "-shared", "-isystem", str(fmi_headers()), str(main)]
        run_compiler([*target, "-s", *common, "-o", str(tmp_path / "zig.so")], about=name)
        if shutil.which("gcc"):
            done = subprocess.run(
                ["gcc", *common, "-o", tmp_path / "gcc.so", "-lm"], capture_output=True, check=False
            )
            assert (done.returncode, done.stderr) == (0, b"")


@both
def test_the_same_model_gives_the_same_bytes_and_another_one_another_token(version, tmp_path, monkeypatch):
    monkeypatch.setenv("SOURCE_DATE_EPOCH", "1700000000")
    one, again = (export_fmu(plant(), tmp_path / f"{k}.fmu", version=version) for k in ("a", "b"))
    assert one.read_bytes() == again.read_bytes()
    token = fmpy.read_model_description(str(one)).guid
    changed = export_fmu(plant().with_values({"motor.inertia": 6e-4}), tmp_path / "c.fmu", version=version)
    assert fmpy.read_model_description(str(changed)).guid != token
    with unpacked(one) as folder, pytest.raises(Exception, match="instantiate"):
        Unit(folder, token="{not-the-token}")


@both
@each_model
def test_names_units_ranges_and_starts_are_those_of_the_flat_model(name, version, units):
    model = MODELS[name]
    description = fmpy.read_model_description(str(units[name, version]))
    found = {v.name: v for v in description.modelVariables}
    factors = {u.name: u for u in description.unitDefinitions}
    for kind, group in (("input", model.inputs), ("parameter", model.parameters), (None, model.states)):
        for variable in group:
            v = found[variable.name]
            assert kind is None or v.causality == kind
            assert float(v.start) == variable.start
            assert float(v.min or "-inf") == variable.minimum
            assert float(v.max or "inf") == variable.maximum
            assert variable.description in v.description
            assert v.unit == variable.unit
    for variable in model.outputs:
        assert found[variable.name].causality == "output"
    for unit in factors.values():
        base, parsed = unit.baseUnit, parse_unit(unit.name)
        assert tuple(getattr(base, n) for n in ("kg", "m", "s", "A", "K", "rad")) == parsed.exponents
        assert float(base.factor) == parsed.factor
    angle = found["motor.angle" if name != "controller" else "torque.desired"]
    if name != "controller":
        assert angle.displayUnit == "deg"
        (shown,) = factors["rad"].displayUnits
        assert float(shown.factor) == pytest.approx(180 / math.pi, rel=1e-15)
    expected = "continuous" if model.sample_time is None else "discrete"
    assert {found[v.name].variability for v in (*model.inputs, *model.outputs)} == {expected}
    assert {found[v.name].variability for v in model.parameters} == {
        "fixed" if model.sample_time is None else "tunable"
    }


@both
def test_the_model_structure_tells_the_true_dependencies(version, units):
    model = MODELS["plant"]
    description = fmpy.read_model_description(str(units["plant", version]))
    knowns = [v.name for v in (*model.states, *model.inputs)]
    generator = np.random.default_rng(2)
    point = {
        v.name: v.start + 0.3 * v.nominal * generator.uniform(0.2, 1) for v in (*model.states, *model.inputs)
    }

    def values(changed: str | None) -> dict[str, float]:
        at = point | ({changed: point[changed] + 1e-3 * abs(point[changed])} if changed else {})
        return model.evaluate([at[v.name] for v in model.states], [at[v.name] for v in model.inputs])

    base = values(None) | point
    unknowns = {
        u.variable.name: {d.name for d in u.dependencies}
        for u in description.outputs + description.derivatives
    }
    assert set(unknowns) == {v.name for v in model.outputs} | {f"der({v.name})" for v in model.states}
    for unknown, dependencies in unknowns.items():
        felt = {k for k in knowns if unknown not in point and values(k)[unknown] != base[unknown]}
        assert dependencies == (felt or {unknown}), unknown
    kinds = {
        (u.variable.name, d.name): kind
        for u in description.derivatives
        for d, kind in zip(u.dependencies, u.dependenciesKind, strict=True)
    }
    assert kinds["der(motor.angle)", "motor.speed"] == "constant"
    assert kinds["der(motor.speed)", "motor.current"] == "fixed"
    assert kinds["der(motor.speed)", "motor.angle"] == "dependent"

    # The torque of the observer feels the angle only through the law, the innovation also through the table.
    observed = fmpy.read_model_description(str(units["observer", version]))
    felt_by = {u.variable.name: {d.name for d in u.dependencies} for u in observed.outputs}
    assert felt_by == {"spring.torque": {"motor.angle"}, "motor.speed": set()}


def written_down(sources, target, *, platform, **_) -> Path:
    """Stands for the compiler: a library that is nothing but its first bytes."""
    target.write_bytes(
        {".so": b"\x7fELF", ".dll": b"MZ", ".dylib": b"\xcf\xfa\xed\xfe"}[platform.extension] + bytes(64)
    )
    return target


@pytest.mark.parametrize("compiles", [False, pytest.param(True, marks=pytest.mark.slow)])
def test_binaries_for_all_platforms_stand_where_importers_look(compiles, tmp_path, monkeypatch):
    """What the compiler makes for each platform is the matter of ``test_compile.py``."""
    if not compiles:
        monkeypatch.setenv("NLSDESIGN_CACHE", str(tmp_path / "cache"))
        monkeypatch.setattr(fmu, "compile_library", written_down)
    expected = {
        "2.0": {"linux64/%.so", "aarch64-linux/%.so", "win64/%.dll", "darwin64/%.dylib"},
        "3.0": {
            f"{n}/%{e}"
            for n, e in zip(ALL_PLATFORMS, (".so", ".so", ".dll", ".dylib", ".dylib"), strict=True)
        },
    }
    for version in VERSIONS:
        unit = export_fmu(controller(), tmp_path / "all.fmu", version=version, platforms=ALL_PLATFORMS)
        with zipfile.ZipFile(unit) as archive:
            found = {n for n in archive.namelist() if n.startswith("binaries/")}
            if version == "2.0":
                library = archive.read("binaries/darwin64/torque_controller.dylib")
        assert found == {"binaries/" + path.replace("%", "torque_controller") for path in expected[version]}
    assert library.startswith(b"\xca\xfe\xba\xbe\0\0\0\2")


def test_a_universal_binary_holds_its_parts_whole_and_aligned():
    parts = {"x86_64-darwin": b"x" * 20000, "aarch64-darwin": b"a" * 5}
    data = universal_binary(parts)
    found = {}
    for k in range(int.from_bytes(data[4:8], "big")):
        processor, _, offset, size, align = (
            int.from_bytes(data[8 + 20 * k + 4 * i : 12 + 20 * k + 4 * i], "big") for i in range(5)
        )
        assert offset % (1 << align) == 0
        found[processor] = data[offset : offset + size]
    assert found == {0x01000007: parts["x86_64-darwin"], 0x0100000C: parts["aarch64-darwin"]}


# --- what is refused ------------------------------------------------------------------------------


def test_what_cannot_be_exported_is_refused_and_leaves_nothing(tmp_path):
    base = plant()
    with pytest.raises(ExportError, match=r"must be '2\.0' or '3\.0'"):
        export_fmu(base, tmp_path / "a.fmu", version="1.0")
    with pytest.raises(UnknownNameError, match="platform"):
        export_fmu(base, tmp_path / "a.fmu", platforms=["amiga"])
    with pytest.raises(ValueRangeError, match="positive"):
        export_fmu(base, tmp_path / "a.fmu", step=0.0)
    odd = replace(base, inputs=(replace(base.inputs[0], name="motor current"),))
    with pytest.raises(ExportError, match="structured name"):
        export_fmu(odd, tmp_path / "a.fmu")
    twice = replace(base, inputs=(replace(base.inputs[0], name="motor.angle"),))
    with pytest.raises(ExportError, match="name of a state"):
        export_fmu(twice, tmp_path / "a.fmu")
    wrong = replace(base, outputs=(base.outputs[0], replace(base.outputs[1], name="motor.speed")))
    with pytest.raises(ExportError, match=r"'motor\.speed': names an output and something else"):
        export_fmu(wrong, tmp_path / "a.fmu")
    given_back = replace(base, outputs=(replace(base.outputs[0], name="motor.current"), base.outputs[1]))
    with pytest.raises(ExportError, match="is an input as well"):
        export_fmu(given_back, tmp_path / "a.fmu")
    assert list(tmp_path.iterdir()) == []

    (tmp_path / "file").write_text("in the way")
    with pytest.raises(ExportError, match="cannot be written"):
        export_fmu(base, tmp_path / "file" / "a.fmu")


@both
def test_a_value_out_of_range_is_refused_and_nothing_is_set(version, units):
    with opened(units["plant", version]) as unit:
        before = unit.get("motor.inertia", "spring.cam.lever_arm")
        for bad in (-1.0, 5.0, math.nan, math.inf):
            with pytest.raises(Refused):
                unit.set(spring__cam__lever_arm=0.02, motor__inertia=bad)
            status, category, message = unit.log[-1]
            assert (status, category) == (3, "logStatusError")
            assert message.startswith("motor.inertia = ")
            assert "must lie in [1e-05, 0.1]" in message
        assert unit.get("motor.inertia", "spring.cam.lever_arm") == before
        unit.begin()
        with pytest.raises(Refused):
            unit.set(solver__relative_tolerance=1.0)
        unit.set(motor__inertia=1e-3)
        unit.run()
        with pytest.raises(Refused):
            unit.set(motor__inertia=2e-3)  # fixed
        assert "cannot be set in this phase" in unit.log[-1][2]
        assert unit.get("motor.inertia") == [1e-3]


@both
def test_an_unknown_or_computed_variable_is_refused(version, units):
    with opened(units["plant", version]) as unit:
        unit.begin().run()
        with pytest.raises(Refused):
            unit.get_references([999])
        assert "value reference 999" in unit.log[-1][2]
        with pytest.raises(Refused):
            unit.get_integer(unit.references["motor.angle"])
        for name in ("time", "spring.torque", "der(motor.speed)"):
            with pytest.raises(Refused):
                unit.put({name: 0.0})
            assert "computed and cannot be set" in unit.log[-1][2]
        unit.step(1e-3)


@both
def test_inputs_of_a_plant_must_be_finite_and_are_warned_of_outside_their_range(version, units):
    with opened(units["plant", version]) as unit:
        unit.begin().run()
        for bad in (math.nan, math.inf):
            with pytest.raises(Refused):
                unit.set(motor__current=bad)
        unit.set(motor__current=30.0)
        assert unit.log[-1][:2] == (1, "logStatusWarning")
        assert unit.get("motor.current") == [30.0]
        unit.step(1e-3)
        assert np.all(np.isfinite(unit.get("motor.angle", "spring.torque")))


@both
def test_steps_that_make_no_sense_are_refused(version, units):
    with opened(units["plant", version]) as unit:
        with pytest.raises(Refused):
            unit.step(1e-3)
        assert "not allowed in this phase" in unit.log[-1][2]
        unit.begin(start=1.0, stop=1.01).run()
        for length in (0.0, -1e-3, math.nan, math.inf):
            with pytest.raises(Refused):
                unit.raw.doStep(currentCommunicationPoint=1.0, communicationStepSize=length)
        with pytest.raises(Refused):
            unit.raw.doStep(currentCommunicationPoint=1.5, communicationStepSize=1e-3)
        assert "the model stands at 1 s" in unit.log[-1][2]
        unit.step(0.01)
        with pytest.raises(Refused):
            unit.step(1e-3)
        assert "beyond the stop time" in unit.log[-1][2]
        unit.raw.terminate()
        with pytest.raises(Refused):
            unit.step(1e-3)


def exploding() -> FlatModel:
    """dx/dt = x² reaches infinity at t = 1."""
    x, nothing = ca.SX.sym("x"), ca.SX(0, 1)
    equations = ca.Function(
        "e",
        [ca.SX.sym("t"), x, ca.SX.sym("u", 0), ca.SX.sym("p", 0), ca.SX.sym("w", 0)],
        [x**2, x, nothing, nothing],
    )
    state = Variable("x", "1", "State", 1.0)
    return FlatModel("exploding", "Has no solution after 1 s", (state,), (), (), (state,), (), equations)


@both
def test_a_step_that_cannot_be_integrated_is_an_error_and_not_a_number(version, tmp_path):
    unit_file = export_fmu(exploding(), tmp_path / "x.fmu", version=version)
    assert validate_fmu(str(unit_file)) == []
    with opened(unit_file) as unit:
        unit.begin().run()
        unit.step(0.5)
        (kept,) = unit.get("x")
        assert kept == pytest.approx(2.0, rel=1e-6)
        with pytest.raises(Refused) as refused:
            unit.step(1.0)
        assert refused.value.status == 3
        assert unit.log[-1][0] == 3
        assert "no step size gives the relative tolerance 1e-08 at time" in unit.log[-1][2]
        at = float(unit.log[-1][2].split("at time ")[1].split(" ")[0])
        assert at == pytest.approx(1.0, abs=1e-3)
        assert unit.get("x") == [kept]  # the last good state, not something like a result
        with pytest.raises(Refused):
            unit.step(1e-3)  # failed is failed
        unit.raw.reset()
        unit.begin().run()
        unit.step(0.5)
        assert unit.get("x") == [kept]


# --- instances and copies -------------------------------------------------------------------------


def drive(unit: Unit, count: int, first: int = 0) -> list[list[float]]:
    """Step with a rough input and return what is shown after each step."""
    shown = [v.name for v in unit.description.modelVariables if v.causality in ("output", "local")]
    shown = [n for n in shown if n != "sample.status"]
    inputs = [v.name for v in unit.description.modelVariables if v.causality == "input"]
    rows = []
    for k in range(first, first + count):
        unit.put({name: 0.4 * math.sin(0.1 * k * (i + 1)) + 0.3 for i, name in enumerate(inputs)})
        unit.step(SAMPLE_TIME * (1 + k % 3) / 2)
        rows.append(unit.get(*shown))
    return rows


@both
@each_model
def test_two_instances_at_once_are_as_two_alone(name, version, units):
    with opened(units[name, version]) as alone:
        expected = drive(alone.begin().run(), 60)
    with unpacked(units[name, version]) as folder:
        one, other = Unit(folder, name="one"), Unit(folder, name="other")
        try:
            one.begin().run()
            found = drive(one, 30)
            other.begin().run()
            drive(other, 40, first=500)
            found += drive(one, 30, first=30)
        finally:
            for unit in (one, other):
                unit.raw.freeInstance()
    assert found == expected


@both
@each_model
def test_a_restored_copy_goes_on_bit_by_bit(name, version, units):
    with opened(units[name, version]) as unit:
        unit.begin().run()
        drive(unit, 20)
        copy, time = unit.raw.getFMUState(), unit.time
        written = unit.raw.serializeFMUState(copy)
        first = drive(unit, 30)
        unit.raw.setFMUState(copy)
        unit.time = time
        assert drive(unit, 30) == first
        unit.raw.freeFMUState(copy)

        with opened(units[name, version]) as other:
            read = other.raw.deserializeFMUState(written)
            other.raw.setFMUState(read)
            other.time = time
            assert drive(other, 30) == first
            assert other.raw.serializeFMUState(read) == written
            other.raw.freeFMUState(read)
            with pytest.raises(Refused):
                other.raw.deserializeFMUState(b"x" + written[1:])
            with pytest.raises(Refused):
                other.raw.deserializeFMUState(written[:-1])


@each_model
def test_both_versions_compute_the_same_bits(name, units):
    rows = []
    for version in VERSIONS:
        with opened(units[name, version]) as unit:
            rows.append(drive(unit.begin().run(), 80))
    assert rows[0] == rows[1]
    assert np.ptp(np.array(rows[0]), axis=0).max() > 0


@both
def test_many_instances_and_reset(version, units):
    with unpacked(units["plant", version]) as folder:
        many = [Unit(folder, name=f"number {k}").begin().run() for k in range(25)]
        rows = [drive(unit, 5) for unit in many]
        many[0].raw.reset()
        many[0].begin().run()
        again = drive(many[0], 5)
        for unit in many:
            unit.raw.freeInstance()
    assert all(row == rows[0] for row in [*rows, again])


# --- derivatives and logging ----------------------------------------------------------------------


@both
def test_directional_derivatives_are_those_of_the_equations(version, units):
    model = MODELS["plant"]
    s = model.symbols()
    knowns = [v.name for v in (*model.states, *model.inputs, *model.parameters)]
    unknowns = [f"der({v.name})" for v in model.states] + [v.name for v in (*model.outputs, *model.signals)]
    everything = ca.vertcat(s.state, s.input, s.parameter)
    jacobian = ca.Function(
        "j", [everything], [ca.jacobian(ca.vertcat(s.derivative, s.output, s.signal), everything)]
    )
    point = [0.4e-3, 0.3, -2.0, 1.5, *model.start(model.parameters)]
    with opened(units["plant", version]) as unit:
        unit.begin()
        unit.put(dict(zip(knowns, point, strict=True)))
        unit.run()
        expected = np.array(jacobian(point))
        seed = np.random.default_rng(4).uniform(-1, 1, len(knowns)) * np.abs(point)
        found = unit.derivative(unknowns, knowns, seed.tolist())
        np.testing.assert_allclose(found, expected @ seed, rtol=1e-12, atol=1e-12)
        for column, known in enumerate(knowns):
            np.testing.assert_allclose(
                unit.derivative(unknowns, [known], [1.0]), expected[:, column], rtol=1e-12, atol=1e-12
            )
        with pytest.raises(Refused):
            unit.derivative(["spring.torque"], ["der(motor.speed)"], [1.0])


@both
def test_logging_follows_its_categories(version, units):
    with opened(units["plant", version]) as unit:
        categories = {c.name for c in unit.description.logCategories}
        assert categories == {"logStatusError", "logStatusWarning", "logSolver"}
        unit.begin().run()
        unit.step(1e-3)
        assert unit.log == []
        unit.raw.setDebugLogging(True, ["logSolver"])
        unit.step(1e-3)
        ((status, category, message),) = unit.log
        assert (status, category) == (0, "logSolver")
        assert "steps" in message
        unit.raw.setDebugLogging(True, ["logStatusError"])
        unit.step(1e-3)
        assert len(unit.log) == 1
    with opened(units["plant", version], logging=True) as unit:
        unit.begin().run()
        unit.step(1e-3)
        assert [entry[1] for entry in unit.log] == ["logSolver"]


# --- sampled models -------------------------------------------------------------------------------


@both
def test_a_sampled_model_holds_its_outputs_between_samples(version, units):
    reference = GuardedModel(observer())
    with opened(units["observer", version]) as unit:
        unit.begin()
        unit.set(motor__angle=0.3, motor__current=1.0)
        at_start = unit.get("spring.torque")
        assert at_start == pytest.approx(GuardedModel(observer()).step([0.3, 1.0])[0][:1], rel=1e-13)
        unit.run()
        assert unit.get("spring.torque") == at_start
        for k in range(40):
            inputs = [0.3 + 0.01 * k, math.sin(k)]
            unit.put(dict(zip(("motor.angle", "motor.current"), inputs, strict=True)))
            unit.step(0.2 * SAMPLE_TIME)  # holds the sample of this instant
            expected, _ = reference.step(inputs)
            first = unit.get("spring.torque", "motor.speed")
            assert first == pytest.approx(expected, rel=1e-12)
            unit.set(motor__angle=-1.0)
            for _ in range(4):
                unit.step(0.2 * SAMPLE_TIME)
                assert unit.get("spring.torque", "motor.speed") == first


@both
@pytest.mark.parametrize("parts", [1, 3, 7, 10])
def test_samples_are_counted_whatever_the_communication_step(version, parts, tmp_path):
    unit_file = export_fmu(counter(), tmp_path / "count.fmu", version=version)
    with opened(unit_file) as unit:
        unit.begin(start=0.3).run()
        # Communication points as an importer makes them, by adding up: their rounding must not matter.
        for k in range(3000 * parts):
            unit.step(SAMPLE_TIME / parts)
            if k % parts == 0:
                assert unit.get("count") == [k // parts]
        unit.step(2.5 * SAMPLE_TIME)
        assert unit.get("count") == [3002.0]


def counter() -> FlatModel:
    """The output is the number of samples before this one."""
    x, nothing = ca.SX.sym("x"), ca.SX(0, 1)
    equations = ca.Function(
        "e",
        [ca.SX.sym("t"), x, ca.SX.sym("u", 0), ca.SX.sym("p", 0), ca.SX.sym("w", 0)],
        [x + 1, x, nothing, nothing],
    )
    count = Variable("count", "1", "Samples before this one")
    return FlatModel("counter", "Counts", (count,), (), (), (count,), (), equations, SAMPLE_TIME)


@both
def test_a_sampled_model_takes_nan_as_its_controller_does(version, units):
    reference = GuardedModel(observer())
    with opened(units["observer", version]) as unit:
        word = unit.references["sample.status"]
        unit.begin().run()
        for inputs, expected in (
            ([0.5, 1.0], 0),
            ([math.nan, 1.0], INPUT_HELD | index_bit(0)),
            ([0.5, 99.0], INPUT_SATURATED | index_bit(1)),
        ):
            unit.put(dict(zip(("motor.angle", "motor.current"), inputs, strict=True)))
            unit.step(SAMPLE_TIME)
            assert unit.get_integer(word) == expected
            assert unit.get("spring.torque") == pytest.approx(reference.step(inputs)[0][:1], rel=1e-12)


@both
def test_a_controller_can_be_tuned_while_it_runs(version, units):
    with opened(units["controller", version]) as unit:
        unit.begin().run()
        unit.set(torque__desired=0.5)
        unit.step(SAMPLE_TIME)
        assert unit.get("motor.current") == [pytest.approx(1.0)]
        unit.set(gain__proportional=4.0)
        unit.step(SAMPLE_TIME)
        assert unit.get("motor.current") == [pytest.approx(2.0 + 0.5 * SAMPLE_TIME * 40.0)]
        with pytest.raises(Refused):
            unit.set(gain__proportional=-1.0)
        assert unit.get("gain.proportional") == [4.0]


@both
def test_signals_of_a_sampled_model_belong_to_its_sample(version, units):
    with opened(units["observer", version]) as unit:
        unit.begin().run()
        for angle in (0.2, 0.5, 0.3):
            unit.set(motor__angle=angle)
            unit.step(SAMPLE_TIME)
            innovation, estimate = unit.get("innovation", "estimate.angle")
            assert innovation == pytest.approx(angle - estimate, abs=1e-15)
