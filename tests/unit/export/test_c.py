"""The generated controller: same numbers as the flat model, nothing hidden, finite whatever comes in."""

from __future__ import annotations

import math
import re
import shutil
import struct
import subprocess
from dataclasses import replace
from pathlib import Path

import casadi as ca
import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from nlsdesign.components.assembly.deck_writer import declare
from nlsdesign.export import export_c
from nlsdesign.export.c.guarded_step import (
    COMMAND_SLOWED,
    INPUT_HELD,
    INPUT_SATURATED,
    NOT_STARTED,
    OUT_OF_TABLE,
    OUTPUT_HELD,
    PARAMETER_REFUSED,
    STATE_RESTARTED,
    GuardedModel,
    index_bit,
)
from nlsdesign.export.compilation.compiled_step import CompiledStep
from nlsdesign.export.compilation.cross_compiler import STRICT, run_compiler
from nlsdesign.feedback.control import ScheduledTorque, joined, torque_controller
from nlsdesign.feedback.observer import design_corrected_observer, designed_observer
from nlsdesign.foundation.deck import load_deck
from nlsdesign.foundation.errors import ExportError
from nlsdesign.model import flatten
from nlsdesign.model.flat import FlatModel, Table, Variable
from tests.compiling import compile_program
from tests.hand_built import controller, observer, plant

MODELS = {"observer": observer(), "controller": controller()}
REALS = ("double", "float")


@pytest.fixture(scope="module")
def running(tmp_path_factory):
    """Give a fresh instance of a compiled model."""
    folder = tmp_path_factory.mktemp("c")
    sources = {
        (name, real): export_c(model, folder / real, real=real)
        for name, model in MODELS.items()
        for real in REALS
    }

    def fresh(name: str, real: str = "double", parameters=None) -> CompiledStep:
        return CompiledStep(sources[name, real], parameters)

    return fresh


@pytest.fixture(scope="module")
def long_lived(running):
    """One instance of each, that lives through all examples: what came before must not matter either."""
    return [running(name, real) for name in MODELS for real in REALS]


def record(model: FlatModel, samples: int = 2000) -> np.ndarray:
    """Inputs inside their ranges, rough enough to visit every cell of the table."""
    generator = np.random.default_rng(5)
    k = np.arange(samples)[:, None]
    wave = 0.7 * np.sin(0.01 * k * (1 + np.arange(len(model.inputs)))) + 0.2 * generator.uniform(
        -1, 1, (samples, 1)
    )
    return wave * np.array([min(v.maximum, 3.0) for v in model.inputs])


@pytest.mark.parametrize("name", MODELS)
def test_double_agrees_with_the_flat_model_to_1e_12(name, running):
    model, step = MODELS[name], running(name)
    inputs, state = record(model), model.start(model.states)
    found, expected = [], []
    for u in inputs.tolist():
        f, y, _, _ = model.equations(
            0.0, state, u, model.start(model.parameters), model.look_up(state.tolist(), u)
        )
        outputs, status = step(u)
        assert status == 0
        found.append([*outputs, *step.states])
        state = np.array(f).ravel()
        expected.append([*np.array(y).ravel(), *state])
    size = np.abs(expected).max(axis=0)
    assert np.all(size > 0)
    assert np.all(np.abs(np.array(found) - expected) <= 1e-12 * size)


@pytest.mark.parametrize("name", MODELS)
def test_float_agrees_with_double_as_far_as_its_rounding_allows(name, running):
    # A step rounds by at most 6e-8 of its terms, and the terms of the torque are up to ten times larger than
    # their sum; poles at 0.8 to 0.98 sum that over up to fifty samples: 6e-8 · 10 · 50 = 3e-5.
    # The integrator of the controller does not forget: 2000 samples, rounded by half of 6e-8 each, in random
    # direction: 6e-8 · √2000 = 3e-6.
    model, double, single = MODELS[name], running(name), running(name, "float")
    inputs = record(model).astype(np.float32).astype(float)
    pairs = [(double(u)[0], single(u)[0]) for u in inputs.tolist()]
    one, other = (np.array(side) for side in zip(*pairs, strict=True))
    difference = np.abs(one - other).max(axis=0) / np.abs(one).max(axis=0)
    assert np.all(difference > 0)
    assert np.all(difference < 3e-5)


@pytest.mark.long_cases("controller-double", "observer-double", "controller-float")
@pytest.mark.parametrize("real", REALS)
@pytest.mark.parametrize("name", MODELS)
def test_the_self_test_passes_and_can_fail(name, real, tmp_path):
    source = export_c(MODELS[name], tmp_path, real=real)
    program = compile_program([source.source, source.selftest], tmp_path / "selftest")
    assert subprocess.run([program], check=False).returncode == 0

    # One output wrong by a thousandth.
    text, changes = re.subn(r"(const \w+ y0 = )(.*);", r"\1 1.001f * (\2);", source.source.read_text())
    assert changes == 1
    source.source.write_text(text)
    wrong = compile_program([source.source, source.selftest], tmp_path / "wrong", flags=["-std=c99"])
    assert subprocess.run([wrong], check=False, capture_output=True).returncode != 0


@pytest.mark.long_cases("double--O3", "double--O0", "double--O2", "float--O0", "float--O3")
@pytest.mark.parametrize("optimised", ["-O0", "-O2", "-O3"])
@pytest.mark.parametrize("real", REALS)
def test_gcc_finds_nothing_to_complain_about(real, optimised, tmp_path):
    if shutil.which("gcc") is None:
        # The code is C99 for any compiler; these are the warnings of one that need not be on every machine.
        pytest.skip("gcc is not installed")
    for model in MODELS.values():
        source = export_c(model, tmp_path, real=real)
        done = subprocess.run(
            ["gcc", *STRICT, optimised, source.source, source.selftest, "-lm", "-o", tmp_path / "selftest"],
            capture_output=True,
            text=True,
            check=False,
        )
        assert (done.returncode, done.stderr) == (0, "")
        assert subprocess.run([tmp_path / "selftest"], check=False).returncode == 0


def test_the_header_serves_cplusplus(tmp_path):
    source = export_c(observer(), tmp_path)
    (tmp_path / "use.cpp").write_text(
        f'#include "{source.header.name}"\n'
        f"double torque({source.name}_state *s) {{ return s->outputs.spring.torque; }}\n"
    )
    run_compiler(
        ["-x", "c++", "-std=c++17", "-Wall", "-Werror", "-c", tmp_path / "use.cpp", "-o", tmp_path / "use.o"],
        about="the header in C++",
    )
    assert (tmp_path / "use.o").stat().st_size > 0


def sections_and_needs(object_file: Path) -> tuple[dict[str, int], set[str]]:
    """Sizes of the sections and undefined symbols of a 64-bit ELF object."""
    data = object_file.read_bytes()
    assert data[:5] == b"\x7fELF\x02"
    start, (size, count, names) = (
        struct.unpack_from("<Q", data, 0x28)[0],
        struct.unpack_from("<HHH", data, 0x3A),
    )
    heads = [struct.unpack_from("<IIQQQQIIQQ", data, start + k * size) for k in range(count)]

    def text(table: int, at: int) -> str:
        begin = heads[table][4] + at
        return data[begin : data.index(b"\0", begin)].decode()

    sizes = {text(names, head[0]): head[5] for head in heads}
    (symbols,) = [head for head in heads if head[1] == 2]
    needs = set()
    for at in range(symbols[4] + 24, symbols[4] + symbols[5], 24):
        name, _, _, section = struct.unpack_from("<IBBH", data, at)
        if section == 0:
            needs.add(text(symbols[6], name))
    return sizes, needs


@pytest.mark.parametrize("real", REALS)
def test_nothing_mutable_is_outside_the_callers_structure_and_nothing_is_called(real, tmp_path):
    source = export_c(observer(), tmp_path, real=real)
    target = ["-target", "x86_64-linux-gnu.2.17"]
    run_compiler(
        [*target, "-O2", *STRICT, "-fno-sanitize=undefined", "-c", source.source, "-o", tmp_path / "one.o"],
        about="the object",
    )
    sizes, needs = sections_and_needs(tmp_path / "one.o")
    mutable = {
        name: n for name, n in sizes.items() if re.match(r"\.(data|bss|tdata|tbss|ldata|lbss)", name) and n
    }
    assert mutable == {}
    assert needs - {"memcpy"} == set()
    assert sizes[".text"] > 0
    assert not re.search(r"\b(for|while|do|goto)\b", _code(source.source.read_text()))


def _code(text: str) -> str:
    return re.sub(r"/\*.*?\*/", "", text, flags=re.DOTALL)


@pytest.mark.parametrize("real", REALS)
def test_nan_and_infinity_are_held_and_excess_is_saturated(real, running):
    step, reference = running("observer", real), GuardedModel(observer())
    sequence = [
        ([0.5, 1.0], 0),
        ([math.nan, 1.0], INPUT_HELD | index_bit(0)),
        ([0.5, math.inf], INPUT_HELD | index_bit(1)),
        ([-math.inf, math.nan], INPUT_HELD | index_bit(0) | index_bit(1)),
        ([9.0, 1.0], INPUT_SATURATED | index_bit(0)),
        ([-9.0, -1e9], INPUT_SATURATED | index_bit(0) | index_bit(1)),
        ([math.nan, 50.0], INPUT_HELD | INPUT_SATURATED | index_bit(0) | index_bit(1)),
        ([0.25, -1.0], 0),
    ]
    for inputs, word in sequence:
        outputs, status = step(inputs)
        expected, expected_status = reference.step(inputs)
        assert status == word == expected_status
        assert outputs == pytest.approx(expected, rel=2e-4, abs=1e-4)

    # Held means: the same as if the last good value had come again; saturated: as if the limit had come.
    one, other = running("observer", real), running("observer", real)
    for bad, good in (
        ([0.5, 1.0], [0.5, 1.0]),
        ([math.nan, math.inf], [0.5, 1.0]),
        ([7.0, -21.0], [1.5, -20.0]),
    ):
        assert one(bad)[0].tolist() == other(good)[0].tolist()


@pytest.mark.parametrize("real", REALS)
def test_a_command_is_followed_as_fast_as_it_can_be(real, tmp_path):
    """0.5 per sample of 0.25 s from the second sample on; numbers are exact in both types."""
    wish = Variable("wish", "1", "Command", 0.0, 1.0, -4.0, 3.0, largest_rate=2.0)
    u, nothing = ca.SX.sym("u"), ca.SX(0, 1)
    equations = ca.Function(
        "e", [ca.SX.sym("t"), ca.SX.sym("x", 0), u, ca.SX.sym("p", 0), ca.SX.sym("w", 0)],
        [nothing, 2 * u, nothing, nothing],
    )  # fmt: skip
    model = FlatModel(
        "follower", "Follows", (), (wish,), (), (Variable("y", "1", "Twice"),), (), equations, 0.25
    )
    step, reference = CompiledStep(export_c(model, tmp_path, real=real)), GuardedModel(model)
    slowed, saturated = COMMAND_SLOWED | index_bit(0), INPUT_SATURATED | index_bit(0)
    sequence = [
        (2.0, 2.0, 0),
        (2.5, 2.5, 0),
        (540.0, 3.0, saturated),
        (1.0, 2.5, slowed),
        (2.0, 2.0, 0),
        (-1e9, 1.5, saturated | slowed),
        (math.nan, 1.5, INPUT_HELD | index_bit(0)),
        (1.25, 1.25, 0),
        (1.875, 1.75, slowed),
    ]
    for wished, used, word in sequence:
        for outputs, status in (step([wished]), reference.step([wished])):
            assert (list(outputs), status) == ([2.0 * used], word)


number = st.floats(allow_nan=True, allow_infinity=True)


@given(st.lists(st.tuples(number, number), min_size=1, max_size=30))
def test_outputs_and_states_stay_finite_whatever_comes_in(long_lived, rows):
    for step in long_lived:
        for row in rows:
            outputs, _ = step(row)
            assert np.all(np.isfinite(outputs))
            assert np.all(np.isfinite(step.states))


def growing() -> FlatModel:
    """x doubles its exponent at every sample: overflows after a few."""
    x, u, p = ca.SX.sym("x"), ca.SX.sym("u"), ca.SX.sym("p")
    equations = ca.Function(
        "e",
        [ca.SX.sym("t"), x, u, p, ca.SX.sym("w", 0)],
        [x * x * p + u, x * 1e200, ca.SX(0, 1), ca.SX(0, 1)],
    )
    return FlatModel(
        "growing",
        "Overflows",
        (Variable("x", "1", "State", 3.0),),
        (Variable("u", "1", "Input without range"),),
        (Variable("gain", "1", "Gain", 1.0, 1.0, 0.5, 2.0),),
        (Variable("y", "1", "Output"),),
        (),
        equations,
        0.1,
    )


@pytest.mark.parametrize("real", REALS)
def test_an_overflow_holds_state_and_outputs_and_says_so(real, tmp_path):
    if real == "float":
        model = growing()
        with pytest.raises(ExportError, match="too large for float"):
            export_c(model, tmp_path, real=real)
        return
    step, reference = CompiledStep(export_c(growing(), tmp_path, real=real)), GuardedModel(growing())
    words = set()
    for _ in range(20):
        (y,), status = step([0.0])
        expected, expected_status = reference.step([0.0])
        assert math.isfinite(y)
        assert [y] == expected
        assert status == expected_status
        words.add(status)
    assert {0, OUTPUT_HELD, STATE_RESTARTED | OUTPUT_HELD} <= words


def test_parameters_are_taken_at_run_time_or_refused(running):
    model = observer()
    names = [v.name for v in model.parameters]
    plain, tuned = running("observer"), running("observer")
    values = {"correction.scale": 0.5, "cam.lever_arm": 0.02, "cam.corner": 0.3}
    assert tuned.set_parameters([values[name] for name in names]) == 0
    reference = GuardedModel(model.with_values(values))
    for u in record(model, 50).tolist():
        expected, _ = reference.step(u)
        assert tuned(u)[0] == pytest.approx(expected, rel=1e-12)
        assert plain(u)[0] != pytest.approx(expected, rel=1e-3)

    refused = running("observer")
    word = refused.set_parameters([math.nan, 5.0, 0.4])
    assert word == PARAMETER_REFUSED | index_bit(0) | index_bit(1)
    reference = GuardedModel(model.with_values({"cam.corner": 0.4}))
    assert refused([0.7, 1.0])[0] == pytest.approx(reference.step([0.7, 1.0])[0], rel=1e-12)
    assert running("observer", "double", [3.0, 0.015, 0.2]).first_status == PARAMETER_REFUSED | index_bit(0)


def test_refused_parameters_that_share_a_bit_are_those_the_state_differs_in(tmp_path):
    u, p, nothing = ca.SX.sym("u"), ca.SX.sym("p", 20), ca.SX(0, 1)
    arguments = [ca.SX.sym("t"), nothing, u, p, nothing]
    equations = ca.Function("e", arguments, [nothing, ca.vertcat(u, p), nothing, nothing])
    names = [f"p{i}" for i in range(20)]
    model = FlatModel(
        "many", "Shows its parameters", (), (Variable("u", "1", "Input"),),
        tuple(Variable(name, "1", "Number", 1.0, 1.0, 0.0, 2.0) for name in names),
        tuple(Variable(f"y{i}", "1", "Shown") for i in range(21)), (), equations, 0.1,
    )  # fmt: skip
    source = export_c(model, tmp_path)
    step, given = CompiledStep(source), [1.5] * 20
    given[15], given[18] = 3.0, math.nan
    assert step.set_parameters(given) == PARAMETER_REFUSED | index_bit(14) == PARAMETER_REFUSED | 1 << 30
    assert [i for i, v in enumerate(step([0.0])[0][1:]) if v != given[i]] == [15, 18]
    assert "that differ from the state's afterwards" in source.header.read_text()


@pytest.mark.long_cases(
    "0-double", "1-double", "1-float", "127-double", "165-double", "165-float", "255-float"
)
@pytest.mark.parametrize("real", REALS)
@pytest.mark.parametrize("filling", [0x00, 0x01, 0x7F, 0xA5, 0xFF])
def test_a_step_before_init_gives_zeros_and_says_so(filling, real, running):
    """A state that was never started: zeroed memory, or what a memory without start-up code holds."""
    step = running("controller", real)
    step.fill(filling)
    for _ in range(3):
        outputs, status = step([1.0, 0.2])
        assert (set(outputs.tolist()), status) == ({0.0}, NOT_STARTED)
    assert step.set_parameters([v.start for v in MODELS["controller"].parameters]) == NOT_STARTED
    assert step([1.0, 0.2])[1] == NOT_STARTED
    assert step.init() == 0
    fresh = running("controller", real)
    assert step([1.0, 0.2])[0].tolist() == fresh([1.0, 0.2])[0].tolist()


def test_two_instances_do_not_know_of_each_other(running):
    alone, one, other = running("observer"), running("observer"), running("observer")
    inputs = record(observer(), 100)
    expected = [alone(u)[0].tolist() for u in inputs.tolist()]
    found = []
    for u in inputs.tolist():
        found.append(one(u)[0].tolist())
        other((-np.array(u)).tolist())
    assert found == expected


@pytest.mark.parametrize("real", REALS)
def test_the_table_is_read_at_its_points_between_them_and_beyond_its_ends(real, tmp_path):
    values = np.array([[1.0, 10.0], [2.0, 8.0], [4.0, -8.0], [3.0, 0.5]])
    columns = (Variable("a", "1", "First"), Variable("b", "1", "Second"))
    tables = (
        Table("u", -1.0, 0.5, columns, values),
        Table("u", -1.0, 0.5, columns[:1], values[:, 1:]),
        Table("x", 0.0, 2.0, columns[1:], values[:2, :1]),
    )
    x, u, w = ca.SX.sym("x"), ca.SX.sym("u"), ca.SX.sym("w", 4)
    equations = ca.Function(
        "e", [ca.SX.sym("t"), x, u, ca.SX.sym("p", 0), w], [u, w, ca.SX(0, 1), ca.SX(0, 1)]
    )
    outputs = tuple(Variable(f"y[{k}]", "1", "Looked up") for k in range(1, 5))
    model = FlatModel(
        "tables", "Three", (Variable("x", "1", "Last input"),), (Variable("u", "1", "Argument"),), (),
        outputs, (), equations, 0.1, tables,
    )  # fmt: skip
    step, reference = CompiledStep(export_c(model, tmp_path, real=real)), GuardedModel(model)
    for at in [-1.0, -0.5, 0.0, 0.5, -0.75, 0.2, 0.499999, 0.500001, -1.1, 0.6, -1e30, 1e30, 0.5, 1.0, 0.0]:
        expected, reference_status = reference.step([at])
        found, status = step([at])
        assert status == reference_status
        assert found == pytest.approx(expected, rel=1e-14 if real == "double" else 3e-6)
    assert found[0] == pytest.approx(4.0, rel=1e-6)


def looked_up(*tables: Table) -> FlatModel:
    """A model that shows what it reads from tables over its input ``u``."""
    columns = sum(len(table.columns) for table in tables)
    u, w = ca.SX.sym("u"), ca.SX.sym("w", columns)
    nothing = ca.SX(0, 1)
    equations = ca.Function(
        "e", [ca.SX.sym("t"), ca.SX.sym("x", 0), u, ca.SX.sym("p", 0), w], [nothing, w, nothing, nothing]
    )
    outputs = tuple(Variable(f"y[{k + 1}]", "1", "Looked up") for k in range(columns))
    return FlatModel(
        "tables", "Some", (), (Variable("u", "1", "Argument"),), (), outputs, (), equations, 0.1, tables
    )


@pytest.mark.long_cases(
    "2-double", "3-double", "3-float", "5-double", "5-float", "33-float", "100-double", "400-float"
)  # fmt: skip
@pytest.mark.parametrize("real", REALS)
@pytest.mark.parametrize("points", [2, 3, 5, 33, 100, 400])
def test_breakpoints_are_found_by_any_number_of_them(points, real, tmp_path):
    """Reference: ``Table.look_up``; equal bit for bit in double, for the operations are the same."""
    draw = np.random.default_rng(points)
    # The second is crowded at its beginning: many of its cells meet one part of the range.
    grids = [
        np.cumsum(draw.uniform(0.01, 1.0, points) * crowd).astype(np.float32).astype(float)
        for crowd in (1.0, np.linspace(0.1, 1.0, points) ** 2)
    ]
    columns = (Variable("a", "1", "First"), Variable("b", "1", "Second"))
    tables = [Table.over("u", g, columns, draw.normal(size=(points, 2))) for g in grids]
    model = looked_up(*tables)
    step, reference = CompiledStep(export_c(model, tmp_path, real=real)), GuardedModel(model)
    last = float(grids[0][-1])
    near = [np.nextafter(grids[1].astype(np.float32), np.float32(to)) for to in (-np.inf, np.inf)]
    for at in [*grids[0], *grids[1], *near[0], *near[1], *draw.uniform(-1.0, last + 1.0, 50), -1e30, 1e30]:
        argument = float(np.float32(at))
        expected, _ = reference.step([argument])
        found, status = step([argument])
        assert status & ~OUT_OF_TABLE == 0
        if real == "double":
            assert list(found) == list(expected)
        assert found == pytest.approx(expected, rel=2e-5, abs=2e-5)


def test_breakpoints_that_float_cannot_tell_apart_are_refused(tmp_path):
    points, columns = np.array([0.0, 1.0, 1.0 + 1e-9]), (Variable("a", "1", "First"),)
    model = looked_up(Table.over("u", points, columns, np.ones((3, 1))))
    export_c(model, tmp_path, real="double")
    with pytest.raises(ExportError, match="two breakpoints near 1 are one number in float"):
        export_c(model, tmp_path / "float", real="float")
    assert not (tmp_path / "float").exists()


def test_models_without_parameters_states_or_outputs_compile(tmp_path):
    nothing = ca.SX(0, 1)
    t, u = ca.SX.sym("t"), ca.SX.sym("u", 2)
    for name, outputs, result in (
        ("gain", (Variable("y", "1", "Output"),), u[0] * 2),
        ("silent", (), nothing),
    ):
        equations = ca.Function(
            "e",
            [t, ca.SX.sym("x", 0), u, ca.SX.sym("p", 0), ca.SX.sym("w", 0)],
            [nothing, result, nothing, nothing],
        )
        inputs = (Variable("a", "1", "Used"), Variable("b", "1", "Without influence", maximum=1.0))
        model = FlatModel(name, "Small", (), inputs, (), outputs, (), equations, 0.1)
        source = export_c(model, tmp_path)
        program = compile_program([source.source, source.selftest], tmp_path / name)
        assert subprocess.run([program], check=False).returncode == 0
        found, status = CompiledStep(source)([2.5, 3.0])
        assert found.tolist() == ([5.0] if outputs else [])
        assert status == INPUT_SATURATED | index_bit(1)


def test_names_are_kept_and_clashes_are_named(tmp_path):
    text = export_c(observer(), tmp_path).header.read_text()
    for path in (["spring", "torque"], ["motor", "angle"], ["correction", "scale"]):
        assert re.search(rf"double {path[1]};.*(?:\n.*)*}} {path[0]};", text)
    base = controller()
    odd = [
        Variable("switch.case", "1", "Words of C"),
        Variable("a", "1", "Beginning of another name"),
        Variable("a.b[1]", "1", "Row"),
    ]
    x = ca.SX.sym("x", 3)
    p, w = ca.SX.sym("p", 2), ca.SX.sym("w", 0)
    equations = ca.Function(
        "e", [ca.SX.sym("t"), x, ca.SX.sym("u", 2), p, w], [x, x[0], ca.SX(0, 1), ca.SX(0, 1)]
    )
    model = replace(base, states=tuple(odd), equations=equations)
    source = export_c(model, tmp_path, name="odd names")
    assert source.name == "odd_names"
    compile_program([source.source, source.selftest], tmp_path / "odd")
    assert "double a_;" in source.header.read_text()
    assert "double b_1;" in source.header.read_text()

    clash = replace(model, states=(odd[0], odd[2], Variable("a.b_1", "1", "Same member")))
    with pytest.raises(ExportError, match=r"'a.b\[1\]' and 'a.b_1'"):
        export_c(clash, tmp_path)


def test_what_cannot_be_exported_is_refused_before_anything_is_written(tmp_path):
    with pytest.raises(ExportError, match="is continuous") as caught:
        export_c(plant(), tmp_path / "new")
    assert "FMU" in (caught.value.next_step or "")
    t, x = ca.SX.sym("t"), ca.SX.sym("x")
    timed = ca.Function(
        "e",
        [t, x, ca.SX.sym("u", 2), ca.SX.sym("p", 2), ca.SX.sym("w", 0)],
        [x + t, x, ca.SX(0, 1), ca.SX(0, 1)],
    )
    with pytest.raises(ExportError, match="depends on time"):
        export_c(replace(controller(), equations=timed), tmp_path / "new")
    with pytest.raises(ExportError, match="must be 'double' or 'float'"):
        export_c(controller(), tmp_path / "new", real="single")
    assert not (tmp_path / "new").exists()

    (tmp_path / "file").write_text("not a folder")
    with pytest.raises(ExportError, match="cannot be written"):
        export_c(controller(), tmp_path / "file" / "below")


def test_files_are_written_whole_or_not_at_all(tmp_path, monkeypatch):
    export_c(controller(), tmp_path)
    before = {path.name: path.read_bytes() for path in tmp_path.iterdir()}
    original = Path.write_text

    def full_disk(self, text, *args, **kwargs):
        if "selftest" in self.name:
            raise OSError(28, "No space left on device")
        return original(self, text, *args, **kwargs)

    monkeypatch.setattr(Path, "write_text", full_disk)
    tuned = controller().with_values({"gain.integral": 1.0})
    with pytest.raises(ExportError, match="No space left"):
        export_c(tuned, tmp_path)
    assert {path.name: path.read_bytes() for path in tmp_path.iterdir()} == before


@pytest.mark.slow
@pytest.mark.parametrize("name", ["figure_consistent", "as_printed", "stiff_spring"])
def test_the_default_observer_in_float_passes_its_own_self_test(name, tmp_path):
    """Quick, of the soft spring and joined with its controller: the test below."""
    plant = flatten(declare(load_deck(f"austin2015_{name}")))
    source = export_c(design_corrected_observer(plant).model, tmp_path, real="float")
    program = compile_program([source.source, source.selftest], tmp_path / "selftest")
    assert subprocess.run([program], check=False).returncode == 0


def test_the_self_test_allows_what_the_rounding_of_the_states_makes_and_no_more_than_ten_times(tmp_path):
    """Slow states that stay small carry the rounding of their whole range; it once failed at two samples."""
    plant = flatten(declare(load_deck("austin2015_soft_spring")))
    loop = joined(design_corrected_observer(plant).model, torque_controller(plant, law=ScheduledTorque()))
    source = export_c(loop, tmp_path, real="float")
    program = compile_program([source.source, source.selftest], tmp_path / "selftest")
    assert subprocess.run([program], check=False).returncode == 0
    # A division costs as much as a dozen products, and eight of them had a constant below.
    assert re.findall(r" / -?[0-9.e+-]+f\b", source.source.read_text()) == []
    # Code of the robot stays with another kind of observer: `torque` was `torque_` here once.
    simple = joined(
        designed_observer(plant, kind="cascade").model, torque_controller(plant, law=ScheduledTorque())
    )
    paths, usual = source.writer.paths, export_c(simple, tmp_path / "cascade", real="float").writer.paths
    assert paths.inputs == usual.inputs
    assert set(usual.outputs) - set(paths.outputs) == {"motor.angle.unexplained"}
    # A slow state that is wrong by a hundredth of its size is found.
    names = [v.name for v in loop.outputs]
    place = names.index("correction.factor[2]")
    text, changes = re.subn(rf"(const \w+ y{place} = )(.*);", r"\1 1.01f * (\2);", source.source.read_text())
    assert changes == 1
    source.source.write_text(text)
    wrong = compile_program([source.source, source.selftest], tmp_path / "wrong")
    assert subprocess.run([wrong], check=False, capture_output=True).returncode != 0
