"""Every operation of CasADi that a law may use becomes C that computes the same."""

from __future__ import annotations

import ast
import ctypes

import casadi as ca
import numpy as np
import pytest

from nlsdesign.export import files
from nlsdesign.export.c.c_text import Real, comment, identifier, string
from nlsdesign.export.c.instructions import print_statements
from nlsdesign.export.compilation.cross_compiler import STRICT, compile_library
from nlsdesign.foundation.errors import ExportError
from nlsdesign.foundation.symbolic import positive_part, solve_monotone, uniform_spline

X = ca.SX.sym("x", 3)
A, B, C = ca.vertsplit(X)

EXPRESSIONS = {
    "sum": A + B - C,
    "right hand brackets": A - (B - C) - (A - B),
    "quotients": A / (B / C) / (A * C),
    "negative": -A - -B * -C,
    "negative constant": A * -3.0 - (-2.5),
    "square": (A + B) ** 2,
    "powers": ca.fabs(A) ** 2.5 + B**3 + ca.fabs(C) ** -1,
    "variable power": ca.fabs(A) ** B,
    "inverse and twice": 1 / A + 2 * B,
    "exponentials": ca.exp(A) + ca.log(ca.fabs(B)) + ca.log1p(ca.fabs(C)) + ca.expm1(A),
    "root": ca.sqrt(ca.fabs(A)),
    "circular": ca.sin(A) + ca.cos(B) + ca.tan(0.3 * C),
    "arcs": ca.asin(ca.sin(A)) + ca.acos(ca.cos(B)) + ca.atan(C) + ca.atan2(A, B),
    "hyperbolic": ca.sinh(A) + ca.cosh(B) + ca.tanh(C),
    "areas": ca.asinh(A) + ca.acosh(1 + ca.fabs(B)) + ca.atanh(0.9 * ca.tanh(C)),
    "rounding": ca.floor(A) + 10 * ca.ceil(B) + 100 * ca.fmod(C, 0.7),
    "remainder": ca.remainder(A, 0.7),
    "absolute and sign": ca.fabs(A) + 10 * ca.sign(B) + ca.copysign(C, A),
    "least and greatest": ca.fmin(A, B) - 3 * ca.fmax(B, C) + ca.fmax(A * B, 0.5),
    "error function": ca.erf(A),
    "length": ca.hypot(A, B),
    "comparison as number": (A < B) + 2 * (B <= C) + 4 * (A == 1.0) + 8 * (C != 1.0),
    "equality": (A == B) + 2 * (B != C) + 4 * ca.logic_not(A - B) + ca.if_else(A * B == C, A, B),
    "logic": ca.logic_and(A < B, ca.logic_not(B < C)) + 2 * ca.logic_or(A < 0, C < 0),
    "logic of a number": ca.logic_not(A) + ca.logic_and(A, B),
    "choice": ca.if_else(A < B, ca.sin(A), ca.cos(B)),
    "nested choice": ca.if_else(A < B, ca.if_else(B < C, 1.0, A), ca.if_else(C < 0, B, 3.0)),
    "half a choice": ca.if_else(A < B, C, 0),
    "constant": ca.SX(4.25) + 0 * A,
    "smooth positive part": positive_part(A - B, 0.1),
    "spline": uniform_spline([A, B, C, A * B, C], -1.0, 0.7, A),
    "implicit equation": solve_monotone(lambda z: z + z**3 + ca.tanh(z - A) - B, ca.SX.sym("z"), A),
}


def compiled(expressions: list[ca.SX], real: Real, folder) -> ctypes.CDLL:
    function = ca.Function("f", [X], expressions, {"cse": True})
    lines = print_statements(
        function, [["x[0]", "x[1]", "x[2]"]], [[f"y[{k}]"] for k in range(len(expressions))], real=real
    )
    text = "\n".join(
        [
            "#include <math.h>",
            f"void f(const {real} x[], {real} y[]);",
            '__attribute__((visibility("default")))',
            f"void f(const {real} x[], {real} y[])",
            "{",
            *lines,
            "}",
            "",
        ]
    )
    (folder / f"{real}.c").write_text(text)
    library = compile_library([folder / f"{real}.c"], folder / f"{real}.so", flags=STRICT)
    return ctypes.CDLL(str(library))


@pytest.mark.long_cases("float")
@pytest.mark.parametrize(
    ("real", "tolerance"), [(Real.DOUBLE, 2e-14), (Real.FLOAT, 3e-5)], ids=["double", "float"]
)
def test_every_operation_computes_what_casadi_computes(real, tolerance, tmp_path):
    names, expressions = list(EXPRESSIONS), list(EXPRESSIONS.values())
    library = compiled(expressions, real, tmp_path)
    kind = ctypes.c_double if real is Real.DOUBLE else ctypes.c_float
    reference = ca.Function("f", [X], expressions)
    points = np.random.default_rng(3).uniform(-1.8, 1.8, (200, 3))
    points = np.vstack([points, [[1.0, 1.0, 1.0], [0.5, -0.5, 1.5], [-1.0, 0.25, 0.25]]])
    points = np.vectorize(real.round)(points)
    for point in points:
        given, found = (kind * 3)(*point), (kind * len(names))()
        library.f(given, found)
        for name, one, other in zip(names, reference(point), found, strict=True):
            scale = 1.0 if name != "areas" else 10.0
            assert abs(float(one) - other) <= scale * tolerance * (1 + abs(float(one))), (name, point)


def text_of(expression: ca.SX, real: Real = Real.DOUBLE) -> str:
    return "\n".join(
        print_statements(ca.Function("f", [X], [expression]), [["p", "q", "r"]], [["y"]], real=real)
    )


def test_a_choice_is_one_choice_and_limits_are_no_library_calls():
    text = text_of(ca.if_else(A < B, A, C))
    assert text == "y = (p < q) ? p : r;"
    assert text_of(ca.fmin(A, B)) == "y = p < q ? p : q;"


def test_float_text_has_only_float_numbers_and_functions():
    text = text_of(2.5 * ca.tanh(A) + ca.fabs(B) ** 1.5, Real.FLOAT)
    assert text == "y = 2.5f * tanhf(p) + powf(fabsf(q), 1.5f);"


def test_what_no_result_needs_is_not_written():
    function = ca.Function("f", [X], [A + 1, ca.exp(B)])
    text = "\n".join(print_statements(function, [["p", "q", "r"]], [["y"], ["z"]], real=Real.DOUBLE))
    assert text == "y = p + 1.0;\nz = exp(q);" or text == "y = 1.0 + p;\nz = exp(q);"
    assert "r" not in text.replace("exp", "")


def test_an_operation_without_counterpart_is_named_as_such():
    with pytest.raises(ExportError, match="no counterpart in C99"):
        text_of(ca.erfinv(A))


def test_literals_read_back_as_the_same_number():
    values = [0.1, 1.0, -2.0, 1e300, 5e-324, 1 / 3, 123456789.0, 1e16]
    assert [float(Real.DOUBLE.literal(v)) for v in values] == values
    for value in (0.1, 1.0, 3.4e38, 1e-40, 1 / 3, 16777216.0):
        assert np.float32(Real.FLOAT.literal(value)[:-1]) == np.float32(value)
        assert Real.FLOAT.literal(value).endswith("f")
        assert set(Real.FLOAT.literal(value)) & set(".e")


def test_a_constant_that_float_cannot_hold_is_refused():
    with pytest.raises(ExportError, match="too large for float") as caught:
        Real.FLOAT.literal(1e39)
    assert "double" in (caught.value.next_step or "")
    with pytest.raises(ExportError, match="NaN"):
        Real.DOUBLE.literal(float("nan"))


def test_an_unknown_number_type_is_refused_with_the_nearest():
    with pytest.raises(ExportError, match="did you mean 'float'"):
        Real.named("float32")


def test_names_and_comments_cannot_break_the_c_text():
    assert identifier("spring rubber-1") == "spring_rubber_1"
    assert identifier("switch") == "switch_"
    assert identifier("3d") == "_3d"
    assert identifier("") == "_"
    assert comment("a */ b /* c ??/ d\ne\\") == "a * / b / * c ? ?/ d e"
    assert string('say "a\\b"') == '"say \\"a\\\\b\\""'


def test_a_shell_is_filled_by_texts_and_rows(monkeypatch):
    text = "int @name@_size;\n    @rows@\n@none@\nend @name@\n"
    monkeypatch.setattr(files, "template", lambda name: text)
    values = {"name": "@rows@", "rows": ["a = 1;", "", "b = @name@;"], "none": []}
    assert files.filled("a.c", values) == "int @rows@_size;\n    a = 1;\n\n    b = @name@;\nend @rows@\n"
    with pytest.raises(ExportError, match="placeholder 'rows' without a value"):
        files.filled("a.c", {"name": "x"})


def test_functions_of_c_stand_in_templates(root):
    """Python fills rows: no text in it is an include, a loop, a return or the head of a fixed function."""
    quoted = ("#include", "return ", "for (", "int main", "static void", "void ", "if (", "} else")
    found = [
        f"{file.name}:{node.lineno}: {node.value!r}"
        for file in sorted((root / "nlsdesign" / "export").rglob("*.py"))
        for node in ast.walk(ast.parse(file.read_text("utf-8")))
        if isinstance(node, ast.Constant) and isinstance(node.value, str)
        if node.value.lstrip().startswith(quoted)
    ]
    assert not found
