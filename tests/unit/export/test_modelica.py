"""Modelica text: an independent compiler reads the same model, and what cannot be said is refused."""

from __future__ import annotations

import re
from dataclasses import replace
from pathlib import Path
from typing import Any

import casadi as ca
import numpy as np
import pytest

from nlsdesign.components import CoulombFriction, Inertia, assembly, smoothed, tie
from nlsdesign.components.assembly.deck_writer import declare
from nlsdesign.export import export_modelica
from nlsdesign.export.c.c_text import identifier
from nlsdesign.export.modelica.modelica_model import (
    KEYWORDS,
    literal,
    modelica_text,
    modelica_unit,
    quoted_names,
    string,
)
from nlsdesign.foundation.deck import deck_names, load_deck
from nlsdesign.foundation.errors import ExportError, NlsError
from nlsdesign.foundation.quantity import parse_unit
from nlsdesign.model import FlatModel, Variable, flatten
from tests.command_line import Run, run
from tests.unit.components.test_conformance import EXAMPLES, around

__all__ = ["run"]

LARGE = {"austin2015_as_printed", "one_sided_cable_drive", "test_rig"}
"""Decks that pymoca reads for seconds; the thorough run reads them, one like them the quick one."""
DECKS = [
    pytest.param(name, marks=pytest.mark.slow) if name in LARGE else name for name in sorted(deck_names())
]
# Powers, an arc tangent, an exponential.
EXAMPLE_PARTS = ("BoucWen-rotation", "GradualSaturation", "LuGreFriction-rotation")
WITHOUT_TEXT = {"StressSoftening-OgdenRoxburgh-material": "erf"}
"""Parts with a function that Modelica does not have."""


def deck(name: str) -> FlatModel:
    return flatten(declare(load_deck(name)))


def smooth_model(part: Any) -> FlatModel:
    """The part in the smallest system, rounded where it is sharp."""
    model = flatten(around(part))
    jumps = model.switching is not None and model.switching.jumps
    return flatten(smoothed(around(part))) if jumps else model


def read_back(text: str) -> Any:
    pytest.importorskip("pymoca", reason="pymoca, which reads Modelica, is not installed")
    from tests.modelica_reading import ReadModel

    return ReadModel(text)


def assert_same_equations(model: FlatModel, read: Any) -> None:
    """At random points everything that the text computes is what the model computes, to 1e-12."""
    generator = np.random.default_rng(1)
    for size in (0.0, 1.0, 1.0, 1.0):  # the start values themselves, where relations hold as equalities
        x = [generator.normal(v.start, 0.3 * size * v.nominal) for v in model.states]
        u = [generator.normal(v.start, 0.5 * size * v.nominal) for v in model.inputs]
        p = [v.start * generator.uniform(0.97, 1.03) for v in model.parameters]
        time = generator.uniform(0.0, 5.0)
        f, y, s, _ = (np.array(each).ravel().tolist() for each in model.equations(time, x, u, p, []))
        rates = {f"der({v.name})": value for v, value in zip(model.states, f, strict=True)}
        shown = {v.name: value for v, value in zip((*model.outputs, *model.signals), (*y, *s), strict=True)}
        given = {v.name for v in (*model.states, *model.inputs, *model.parameters)}
        expected = rates | {name: value for name, value in shown.items() if name not in given}
        got = read.values(time, x, u, p)
        assert set(expected) <= set(got)
        for name, value in expected.items():
            assert got[name] == pytest.approx(value, rel=1e-12, abs=1e-30), name


@pytest.mark.long_cases("austin2015_figure_consistent", "austin2015_soft_spring")
@pytest.mark.parametrize("name", DECKS)
def test_an_independent_compiler_reads_the_same_equations(name: str) -> None:
    model = deck(name)
    assert_same_equations(model, read_back(modelica_text(model)))


@pytest.mark.parametrize("name", EXAMPLE_PARTS)
def test_laws_are_read_as_the_same_equations(name: str) -> None:
    model = smooth_model(EXAMPLES[name])
    assert_same_equations(model, read_back(modelica_text(model)))


@pytest.mark.slow
@pytest.mark.parametrize("name", sorted(set(EXAMPLES) - set(WITHOUT_TEXT)))
def test_every_part_is_read_as_the_same_equations(name: str) -> None:
    model = smooth_model(EXAMPLES[name])
    assert_same_equations(model, read_back(modelica_text(model)))


@pytest.mark.parametrize(("name", "function"), WITHOUT_TEXT.items())
def test_a_function_that_the_language_lacks_is_named(name: str, function: str) -> None:
    with pytest.raises(ExportError, match=f"the function '{function}' .* no counterpart in Modelica.*fmu"):
        modelica_text(smooth_model(EXAMPLES[name]))


def test_numbers_units_and_words_are_read_back() -> None:
    model = deck("janot2019_positioning_drive")
    m = read_back(modelica_text(model)).model
    groups = ((m.parameters, model.parameters, "value"), (m.states, model.states, "start"))
    for read, declared, number in groups:
        assert [v.symbol.name() for v in read] == [f"'{v.name}'" for v in declared]
        assert [getattr(v, number) for v in read] == [v.start for v in declared]
        assert [v.unit for v in read] == [modelica_unit(v.unit) for v in declared]
    assert [v.symbol.name() for v in m.inputs] == ["'carriage.voltage'"]
    assert [name.strip("'") for name in m.outputs] == [v.name for v in model.outputs]
    assert all(v.fixed for v in m.states)


def test_a_state_may_be_an_output() -> None:
    model = flatten(declare(load_deck("dfki_pendulum")), outputs=["arm.angle"])
    read = read_back(modelica_text(model))
    assert read.model.outputs == ["'arm.angle'"]
    assert_same_equations(model, read)


def hand_built(expression: Any, x: Any, u: Any) -> FlatModel:
    """One state whose derivative is the expression of x and u."""
    nothing, empty = ca.SX(0, 1), ca.SX.sym("w", 0)
    equations = ca.Function(
        "f", [ca.SX.sym("t"), x, u, ca.SX.sym("p", 0), empty], [expression, nothing, nothing, nothing]
    )
    state, given = Variable("x", "1", ""), Variable("u", "1", "")
    return FlatModel("made by hand", "", (state,), (given,), (), (), (), equations)


@pytest.mark.parametrize(
    "law",
    [
        lambda x, u: x - (u - (x + u)),
        lambda x, u: x / ((2 + u) / (x / (3 + u))) - (-(x + u)) * 2 - ca.sin(-(x + u)),
        lambda x, u: ca.if_else(ca.logic_not(x <= u), 1, 2),
        lambda x, u: -(x * -u) - (-x) * (-3.5),
        lambda x, u: (x**2) ** u + 2 ** (-u * u) - (-x) ** 2,
        lambda x, u: ca.if_else(ca.logic_and(x < u, ca.logic_not(u <= 0)), x, u) + ca.if_else(x, 2, 3),
        lambda x, u: ca.if_else(ca.logic_or(x == u, ca.logic_not(ca.logic_and(x < 0, u > 0))), -x, u * 3),
        lambda x, u: (x < u) + 2 * (u <= x) - (x != u) * x,
        lambda x, u: (
            ca.log1p(x * x) - ca.expm1(u) + ca.log1p(1e-9 * x * x) / 1e-9 + ca.expm1(1e-9 * u) / 1e-9
        ),
        lambda x, u: ca.fmin(ca.fabs(x), ca.sign(u)) * ca.floor(x * 4) - ca.ceil(u) / (4 + ca.atan2(x, u)),
        lambda x, u: ca.if_else(x > 0, ca.if_else(u > 0, 1, x), u) + ca.if_else(x > 0, 5, (u - x) ** 2),
        lambda x, u: ca.fmax(-ca.inf, x) + ca.fmin(u, ca.inf),
        lambda x, u: (
            ca.asin(ca.tanh(x)) - ca.acos(ca.cos(u)) * ca.atan(x * u) + ca.sinh(x) * ca.sqrt(ca.cosh(u))
        ),
    ],
)
def test_brackets_and_choices_keep_the_meaning(law: Any) -> None:
    x, u = ca.SX.sym("x"), ca.SX.sym("u")
    model = hand_built(law(x, u), x, u)
    assert_same_equations(model, read_back(modelica_text(model)))


def test_real_numbers_are_not_compared_for_equality_and_relations_make_no_events() -> None:
    for name in ("austin2015_figure_consistent", "one_sided_cable_drive"):
        equations = re.split(r"^equation$", modelica_text(deck(name)), flags=re.MULTILINE)[1]
        assert "==" not in equations
        assert "<>" not in equations
        statements = equations.partition("annotation")[0].split(";")
        for each in statements:
            if re.search(r"[<>]|floor\(|ceil\(", each):
                assert "= noEvent(" in " ".join(each.split()), each


def test_a_sharp_law_is_refused_with_the_next_step_and_its_smooth_form_is_not(tmp_path: Path) -> None:
    rub = tie(CoulombFriction(sliding_effort=0.05), "wheel")
    rubbing = assembly("rubbing", wheel=Inertia(inertia=1e-3), rub=rub)
    with pytest.raises(ExportError, match=r"'rub': is sharp.*--smooth"):
        export_modelica(flatten(rubbing), tmp_path / "a.mo")
    assert not list(tmp_path.iterdir())
    path = export_modelica(flatten(smoothed(rubbing)), tmp_path / "a.mo")
    assert "tanh('wheel.speed'/'rub.creep_speed')" in path.read_text(encoding="utf-8")


def test_a_sampled_model_is_refused() -> None:
    x, u = ca.SX.sym("x"), ca.SX.sym("u")
    with pytest.raises(ExportError, match=r"is sampled.*nlsdesign export fmu"):
        modelica_text(replace(hand_built(u, x, u), sample_time=1e-3))


@pytest.mark.parametrize(
    ("unit", "text"),
    [("1", "1"), ("N*m*s/rad", "N.m.s/rad"), ("1/s", "1/s"), ("V/rad/s", "V/(rad.s)"), ("m/s^2", "m/s2"),
     ("kg·m^2", "kg.m2"), ("Ω", "Ohm"), ("N*m/A*s", "N.m.s/A")],
)  # fmt: skip
def test_units_follow_the_grammar_of_the_language(unit: str, text: str) -> None:
    assert modelica_unit(unit) == text


def test_every_unit_of_every_deck_means_the_same_in_the_grammar_of_the_language() -> None:
    units = {v.unit for name in deck_names() for v in everything(deck(name))}
    assert len(units) > 15
    for unit in units:
        above, _, below = modelica_unit(unit).partition("/")
        assert re.fullmatch(r"[A-Za-z0-9.]+", above)
        assert re.fullmatch(r"|[A-Za-z]+\d*|\([A-Za-z0-9.]+\)", below)
        again = above.replace(".", "*") + "".join(f"/{each}" for each in below.strip("()").split(".") if each)
        assert parse_unit(again).exponents == parse_unit(unit).exponents, unit


def everything(model: FlatModel) -> tuple[Variable, ...]:
    return (*model.states, *model.inputs, *model.parameters, *model.outputs, *model.signals)


def test_hostile_words_stay_inside_their_strings_comments_and_names() -> None:
    assert string("a\\") == '"a\\\\ "'
    assert string('a "b" \\ c\nd') == '"a \\"b\\" \\\\ c d"'
    names = quoted_names(["a b", "a_b", "a'b", "x\\y", "motor.angle[3]"])
    assert list(names.values()) == ["'a_b'", "'a_b_2'", "'a_b_3'", "'x_y'", "'motor.angle[3]'"]
    assert [identifier(text, KEYWORDS) for text in ("model", "2 cams", "", "aus-tin")] == [
        "model_", "_2_cams", "_", "aus_tin",
    ]  # fmt: skip
    model = deck("dfki_pendulum")
    first = replace(model.parameters[0], description='"); end x; //', source="*/ \n end x;")
    evil = replace(model, parameters=(first, *model.parameters[1:]), description='*/ " \\')
    assert_same_equations(evil, read_back(modelica_text(evil)))


def test_numbers_read_back_and_nan_is_refused() -> None:
    for value in (0.1, -1e-300, 12345678.9, 3.0):
        assert float(literal(value)) == value
    largest = "1.7976931348623157e+308"
    assert [literal(float(v)) for v in ("inf", "-inf")] == [largest, f"-{largest}"]
    with pytest.raises(ExportError, match="NaN"):
        literal(float("nan"))


def test_the_command_writes_one_file_that_names_its_deck(run: Run, tmp_path: Path) -> None:
    status, out, _ = run(
        "export", "modelica", "--deck", "dfki_pendulum", "--output", "arm.speed", "--out", "folder/p.mo"
    )
    assert (status, out.split()) == (0, ["written:", str(Path("folder") / "p.mo")])
    text = (tmp_path / "folder" / "p.mo").read_text(encoding="utf-8")
    assert "output Real 'arm.speed'" in text
    status, out, _ = run("export", "check", "folder", "--deck", "dfki_pendulum")
    assert (status, "Modelica" in out, "belong" in out) == (0, True, True)
    edited = text.replace("StopTime = 1.0", "StopTime = 2.0")
    (tmp_path / "folder" / "p.mo").write_text(edited, encoding="utf-8")
    status, out, _ = run("export", "check", "folder", "--deck", "dfki_pendulum")
    assert (status, "edited" in out) == (1, True)


def test_a_misspelt_output_is_bad_input(run: Run, tmp_path: Path) -> None:
    deck_and_output = ("--deck", "dfki_pendulum", "--output", "arm.sped")
    status, _, err = run("export", "modelica", *deck_and_output, "--out", "p.mo")
    assert (status, "did you mean 'arm.speed'" in err) == (2, True)
    assert not list(tmp_path.iterdir())
    assert issubclass(ExportError, NlsError)
