"""Our own elementary functions in C: their stated errors, their special values, and only what is used."""

from __future__ import annotations

import ctypes
import math
import re
import subprocess
from pathlib import Path

import mpmath
import numpy as np
import pytest

from nlsdesign.export.c.c_text import Real
from nlsdesign.export.c.elementary import elementary_functions, own_functions
from nlsdesign.export.compilation.cross_compiler import STRICT, compile_library
from tests.compiling import compile_program
from tests.selection import quick_only

REALS = (Real.FLOAT, Real.DOUBLE)
OF_TWO = ("pow", "atan2", "hypot")
OF_ONE = (
    *("exp", "expm1", "log", "log1p", "sinh", "cosh", "tanh", "asinh", "acosh", "atanh"),
    *("sin", "cos", "tan", "asin", "acos", "atan", "erf"),
)
CIRCULAR = ("sin", "cos", "tan")
# Beyond them sin, cos and tan take off full turns of a rounded 2π.
LIMIT = {"float": 3000.0, "double": 1e6}
# Type, its bits, a wider type, digits, least exponent of frexp for a normal number.
KINDS = {
    "float": ("float", "uint32_t", "double", 24, -125, ""),
    "double": ("double", "uint64_t", "long double", 53, -1021, "l"),
}


def definitions(real: Real, names) -> str:
    return "\n".join(elementary_functions(real, [f"portable_{name}{real.suffix}(x)" for name in names]))


def stated(name: str, real: Real) -> float:
    """The bound that the comment above a function states, in units of the last place."""
    (text,) = re.findall(
        rf"/\* (?:(?!\*/).)*?at most ([\d.]+) (?:(?!\*/).)*?\*/\nstatic \w+ portable_{name}{real.suffix}\(",
        definitions(real, [name]),
        flags=re.DOTALL,
    )
    return float(text)


def program(real: Real, folder: Path, flags=()) -> Path:
    kind, bits, wide, digits, least, end = KINDS[real]
    rows = [
        f'{{"{name}", portable_{name}{real.suffix}, {name}{end}, '
        f"{LIMIT[real] if name in CIRCULAR else 'HUGE_VAL'}}},"
        for name in OF_ONE
    ]
    (folder / "functions.c").write_text(definitions(real, OF_ONE))
    (folder / "rows.c").write_text("\n".join(rows))
    (folder / "ulp.c").write_text((Path(__file__).parents[2] / "ulp.c").read_text())
    macros = [f"-DREAL={kind}", f"-DBITS={bits}", f"-DWIDE={wide}", f"-DDIGITS={digits}", f"-DLEAST={least}"]
    largest = f"-DLARGEST={real.largest!r}"
    return compile_program([folder / "ulp.c"], folder / "ulp", flags=["-std=c99", *macros, largest, *flags])


def errors(program: Path, stride: int, *names: str) -> dict[str, float]:
    done = subprocess.run([program, str(stride), *names], capture_output=True, text=True, check=True)
    return {line.split()[0]: float(line.split()[1]) for line in done.stdout.splitlines()}


@pytest.mark.long_cases("double")
@pytest.mark.parametrize("real", quick_only(REALS, [Real.DOUBLE]), ids=str)
def test_no_error_is_larger_than_its_comment_says_and_none_is_far_smaller(real, tmp_path):
    if real is Real.DOUBLE and np.finfo(np.longdouble).nmant < 63:
        pytest.skip("long double has no more digits here than double: nothing to compare with")
    stride = 20011 if real is Real.FLOAT else (2**64 - 1) // 200_003
    # A sampled number may stay away from the worst one, but not by much.
    undefined = ("-fsanitize=undefined", "-fno-sanitize-recover=all")
    found = errors(program(real, tmp_path, undefined), stride)
    assert set(found) == set(OF_ONE)
    for name, error in found.items():
        assert 0.4 * stated(name, real) < error <= stated(name, real), name


@pytest.mark.slow
@pytest.mark.parametrize("name", OF_ONE)
def test_over_all_floats_no_error_is_larger_than_its_comment_says(name, tmp_path):
    (error,) = errors(program(Real.FLOAT, tmp_path), 1, name).values()
    assert 0.6 * stated(name, Real.FLOAT) < error <= stated(name, Real.FLOAT)


@pytest.fixture(scope="module", params=REALS, ids=str)
def library(request, tmp_path_factory):
    """All functions, to be called from Python."""
    real = request.param
    folder = tmp_path_factory.mktemp("functions")
    kind = ctypes.c_float if real is Real.FLOAT else ctypes.c_double
    text = "#include <math.h>\n#include <stdint.h>\n"
    text += definitions(real, [*OF_ONE, *OF_TWO])
    for name in (*OF_ONE, *OF_TWO):
        head = f"{real} call_{name}({real} x, {real} y)"
        given = "x, y" if name in OF_TWO else "x"
        text += f'__attribute__((visibility("default"))) {head};\n'
        text += f"{head}\n{{\n    (void)y;\n    return portable_{name}{real.suffix}({given});\n}}\n"
    (folder / "functions.c").write_text(text)
    built = ctypes.CDLL(str(compile_library([folder / "functions.c"], folder / "f.so", flags=STRICT)))

    def call(name: str, x: float, y: float = 0.0) -> float:
        function = getattr(built, f"call_{name}")
        function.restype, function.argtypes = kind, [kind, kind]
        return function(x, y)

    return real, call


def same(one: float, other: float) -> bool:
    """Equal in bits, but for the sign of NaN."""
    if math.isnan(one) or math.isnan(other):
        return math.isnan(one) and math.isnan(other)
    return one == other and math.copysign(1.0, one) == math.copysign(1.0, other)


def test_special_values_are_those_of_c99(library):
    _, call = library
    nan, inf = math.nan, math.inf
    for name in OF_ONE:
        assert math.isnan(call(name, nan)), name
    odd = set(OF_ONE) - {"exp", "cosh", "log", "acosh", "cos", "acos"}
    for name in odd:
        assert same(call(name, -0.0), 0.0 if name == "expm1" else -0.0), name
        assert same(call(name, 0.0), 0.0), name
    ends = {
        "exp": (0.0, inf), "expm1": (-1.0, inf), "log": (nan, inf), "log1p": (nan, inf),
        "sinh": (-inf, inf), "cosh": (inf, inf), "tanh": (-1.0, 1.0), "asinh": (-inf, inf),
        "acosh": (nan, inf), "atanh": (nan, nan), "sin": (nan, nan), "cos": (nan, nan), "tan": (nan, nan),
        "asin": (nan, nan), "acos": (nan, nan), "erf": (-1.0, 1.0),
    }  # fmt: skip
    for name, (low, high) in ends.items():
        assert same(call(name, -inf), low), name
        assert same(call(name, inf), high), name
    for name, at, value in (
        ("log", 0.0, -inf), ("log", -0.0, -inf), ("log", -1.0, nan), ("log1p", -1.0, -inf),
        ("log1p", -1.5, nan), ("atanh", 1.0, inf), ("atanh", -1.0, -inf), ("atanh", 1.5, nan),
        ("acosh", 1.0, 0.0), ("acosh", 0.5, nan), ("asin", 1.5, nan), ("acos", 1.0, 0.0), ("acos", -1.5, nan),
        ("exp", 0.0, 1.0), ("cos", 0.0, 1.0), ("cosh", -0.0, 1.0), ("exp", 1e3, inf), ("exp", -1e3, 0.0),
    ):  # fmt: skip
        assert same(call(name, at), value), (name, at)
    assert call("asin", 1.0) == pytest.approx(math.pi / 2, rel=1e-7)
    assert call("acos", -1.0) == pytest.approx(math.pi, rel=1e-7)


def test_far_angles_stay_within_the_circle(library):
    real, call = library
    for x in (1e7, -3.3e20, real.largest):
        assert abs(call("sin", x)) <= 1.0
        assert call("sin", x) ** 2 + call("cos", x) ** 2 == pytest.approx(1.0, rel=1e-6)


SPECIAL = (0.0, -0.0, 1.0, -1.0, 0.5, -0.5, 2.0, -2.0, 3.0, -3.0, math.inf, -math.inf, math.nan)


def by_c99(name: str, x: float, y: float) -> float:
    """What the library of Python gives, which follows C99 but raises where C gives an infinity or NaN."""
    try:
        return float(getattr(math, name)(x, y))
    except ValueError:
        # Zero to a negative power, or a negative number to one that is not whole.
        whole = math.isfinite(y) and y % 2 == 1.0
        return (math.copysign(math.inf, x) if whole else math.inf) if x == 0 else math.nan


@pytest.mark.parametrize("name", OF_TWO)
def test_functions_of_two_numbers_agree_with_c99_at_special_ones(name, library):
    real, call = library
    for x in SPECIAL:
        for y in SPECIAL:
            found, expected = call(name, x, y), by_c99(name, x, y)
            if math.isfinite(expected) and expected != 0:
                assert found == pytest.approx(expected, rel=4 * real.epsilon), (x, y)
            else:
                assert same(found, expected), (x, y, found, expected)


@pytest.mark.parametrize("name", OF_TWO)
def test_errors_of_functions_of_two_numbers(name, library):
    real, call = library
    bound = stated(name, real)
    generator = np.random.default_rng(8)
    draws = generator.uniform(-20.0, 20.0, (3000, 2)) * 10.0 ** generator.uniform(-3, 1, (3000, 2))
    worst = 0.0
    with mpmath.workdps(40):
        for x, y in np.vectorize(real.round)(draws).tolist():
            base = abs(x) if name == "pow" else x
            found, exact = call(name, base, y), getattr(mpmath, {"pow": "power"}.get(name, name))(base, y)
            if not 1e-30 < abs(exact) < 1e30:
                continue
            ulp = mpmath.mpf(2) ** (math.frexp(float(exact))[1] - (24 if real is Real.FLOAT else 53))
            growth = 2 * abs(y * mpmath.log(base)) if name == "pow" else 0
            worst = max(worst, float(abs(mpmath.mpf(found) - exact) / ulp / (bound + growth)))
    assert 0.2 < worst <= 1.0


def test_only_what_is_called_is_written_and_nothing_else_is_left_to_the_library():
    text = definitions(Real.FLOAT, ["tanh"])
    heads = re.findall(r"^static \w+ (\w+)\(", text, flags=re.MULTILINE)
    assert heads[-2:] == ["portable_expm1_insidef", "portable_tanhf"]
    assert not [
        head for head in heads if re.search("sin|log|exp_?f|erf", head.replace("binary_exponent", ""))
    ]
    assert definitions(Real.FLOAT, []) == ""
    assert "tanh" in own_functions()
    # One right answer each: every library gives the same bits.
    for name in ("sqrt", "fabs", "floor", "ceil", "fmod", "copysign", "remainder"):
        assert name not in own_functions()
