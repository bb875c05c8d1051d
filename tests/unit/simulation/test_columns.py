"""Functions evaluated by columns: every operation gives the numbers of CasADi, compiled and with NumPy."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace

import casadi as ca
import numpy as np
import pytest

from nlsdesign.export import natively
from nlsdesign.export.compilation import compiled_step
from nlsdesign.simulation import column_runs
from nlsdesign.simulation.buffered import Translate, as_it_is
from nlsdesign.simulation.column_graph import ARITHMETIC, NotByColumnsError, Operation, column_graph
from nlsdesign.simulation.column_runs import ColumnEvaluator
from nlsdesign.simulation.numpy_columns import NumpyColumns
from nlsdesign.simulation.sample_writer import looked_up
from tests.unit.cli.test_flash import over_breakpoints

RANDOM = np.random.default_rng(5)
SPECIAL = np.array([0.0, -0.0, 1.0, -1.0, 2.0, 0.5, 1e300, -1e-300, np.inf, -np.inf, np.nan])
A, B = (grid.ravel() for grid in np.meshgrid(SPECIAL, SPECIAL))
FIRST = np.concatenate([A, RANDOM.normal(0.0, 1.0, 200), RANDOM.uniform(-40.0, 40.0, 60)])
SECOND = np.concatenate([B, RANDOM.normal(0.0, 1.0, 200), RANDOM.integers(-3, 4, 60)])

ONE: dict[str, Callable[[ca.SX], ca.SX]] = {
    "negative": lambda a: -a, "square": lambda a: a**2, "twice": lambda a: 2 * a, "inverse": lambda a: 1 / a,
    "root": ca.sqrt, "exp": ca.exp, "log": ca.log, "log1p": ca.log1p, "expm1": ca.expm1, "sin": ca.sin,
    "cos": ca.cos, "tan": ca.tan, "asin": ca.asin, "acos": ca.acos, "atan": ca.atan, "sinh": ca.sinh,
    "cosh": ca.cosh, "tanh": ca.tanh, "asinh": ca.asinh, "acosh": ca.acosh, "atanh": ca.atanh,
    "erf": ca.erf, "floor": ca.floor, "ceil": ca.ceil, "size": ca.fabs, "sign": ca.sign,
    "not": ca.logic_not, "power of a constant": lambda a: a**2.5,
}  # fmt: skip
TWO: dict[str, Callable[[ca.SX, ca.SX], ca.SX]] = {
    "sum": lambda a, b: a + b, "difference": lambda a, b: a - b, "product": lambda a, b: a * b,
    "quotient": lambda a, b: a / b, "power": lambda a, b: a**b, "atan2": ca.atan2, "hypot": ca.hypot,
    "less": lambda a, b: a < b, "at most": lambda a, b: a <= b, "equal": lambda a, b: a == b,
    "other": lambda a, b: a != b, "and": ca.logic_and, "or": ca.logic_or, "fmod": ca.fmod,
    "copysign": ca.copysign, "least": ca.fmin, "most": ca.fmax,
    "if a number": lambda a, b: ca.if_else(a, b, 0), "if less": lambda a, b: ca.if_else(a < b, 1 / b, 0),
    "truth as a number": lambda a, b: (a < b) * b + (b < a),
}  # fmt: skip


def everything() -> ca.Function:
    a, b, p = ca.SX.sym("a"), ca.SX.sym("b"), ca.SX.sym("p")
    results = [each(a) for each in ONE.values()] + [each(a, b) for each in TWO.values()]
    fixed = ca.if_else(p > 0, ca.sqrt(p) / 3, ca.exp(p))
    return ca.Function("everything", [a, b, p], [ca.densify(ca.vertcat(*results, fixed * a, fixed))])


def by_columns(function: ca.Function, translate: Translate) -> np.ndarray:
    numbers = np.linspace(-2.0, 3.0, len(FIRST))
    (values,) = ColumnEvaluator(function, 2, translate=translate)([FIRST[None], SECOND[None], numbers[None]])
    return values


@pytest.fixture(scope="module")
def reference() -> np.ndarray:
    function = everything()
    numbers = np.linspace(-2.0, 3.0, len(FIRST))
    return np.array([np.array(function(*row)).ravel() for row in zip(FIRST, SECOND, numbers, strict=True)]).T


def test_every_operation_that_is_known_is_tried() -> None:
    used = {step.code for step in column_graph(everything(), fixed=[2]).steps if isinstance(step, Operation)}
    assert used == ARITHMETIC


@pytest.mark.parametrize(("translate", "digits"), [(natively, 0.0), (as_it_is, 4.0)])
def test_every_operation_gives_the_number_of_casadi(
    reference: np.ndarray, translate: Translate, digits: float
) -> None:
    """The same bits compiled; NumPy has elementary functions of its own, whose last digits may differ."""
    values = by_columns(everything(), translate)
    names = [*ONE, *TWO, "fixed times a", "fixed"]
    assert values.shape == reference.shape
    for name, ours, theirs in zip(names, values, reference, strict=True):
        same = (ours == theirs) | (np.isnan(ours) & np.isnan(theirs))
        with np.errstate(invalid="ignore"):
            near = np.abs(ours - theirs) <= digits * np.spacing(np.abs(theirs))
        wrong = np.flatnonzero(~(same | near))
        assert not len(wrong), (name, FIRST[wrong[0]], SECOND[wrong[0]], ours[wrong[0]], theirs[wrong[0]])


def test_few_columns_and_many_give_the_same(monkeypatch: pytest.MonkeyPatch) -> None:
    """Few are evaluated by CasADi, many by NumPy; matrices are taken column by column."""
    a, matrix, p = ca.SX.sym("a", 2), ca.SX.sym("m", 2, 3), ca.SX.sym("p")
    function = ca.Function("f", [a, matrix, p], [ca.densify(matrix.T @ a * p), ca.densify(a - p)])
    given = [RANDOM.normal(size=(2, 5)), RANDOM.normal(size=(6, 5)), RANDOM.normal(size=(1, 5))]
    expected = [
        sum(given[1][2 * k + i] * given[0][i] for i in range(2)) * given[2][0] for k in range(3)
    ]  # fmt: skip
    for least in (1, 100):
        monkeypatch.setattr(column_runs, "MANY", least)
        product, difference = ColumnEvaluator(function, 2, translate=as_it_is)(given)
        assert np.allclose(product, expected, rtol=1e-14)
        assert np.array_equal(difference, given[0] - given[2])


@pytest.mark.parametrize("even", [True, False])
def test_a_table_is_read_as_by_casadi(even: bool) -> None:
    model = over_breakpoints()
    (uneven,) = model.tables
    table = replace(uneven, lower=-1.0, step=0.35, breakpoints=None) if even else uneven
    assert (table.breakpoints is None) == even
    x, u, p = ca.MX.sym("x", 0), ca.MX.sym("u"), ca.MX.sym("p", 0)
    look = ca.Function("look", [x, u, p], [ca.MX(0, 1), looked_up(table, model, ca.MX(1, 1), u, name="t")])
    at = np.concatenate([table.grid, [-3.0, 3.0], RANDOM.uniform(-1.2, 1.0, 83)])
    expected = np.array([np.array(look(np.zeros(0), v, np.zeros(0))[1]).ravel() for v in at]).T
    graph = column_graph(look, fixed=[2], tables={"t": table})
    nothing = np.zeros((0, len(at)))
    for run in (NumpyColumns(graph), natively.columns(graph)):
        assert np.array_equal(run(nothing, at[None, None], nothing)[1][0], expected)


def test_parts_of_vectors_are_followed() -> None:
    """Elements that are taken, set and joined, and functions that are called, also within others."""
    a, b = ca.MX.sym("a", 3), ca.MX.sym("b")
    s, t = ca.SX.sym("s", 2), ca.SX.sym("t")
    inner = ca.Function("inner", [s, t], [s * t, s[0] - s[1]])
    m = ca.MX.sym("m", 2)
    outer = ca.Function("outer", [m, b], [ca.vertcat(*inner(m, b + 1))])
    changed = a * b
    changed[1] = b
    changed[[0, 2]] = outer(a[1:], b)[1:]
    whole = ca.Function("whole", [a, b, ca.MX.sym("p", 0)], [ca.vertcat(changed, outer(a[:2], 2)), a[::2]])
    # Columns that were chosen from others stand in memory the other way round.
    given = [RANDOM.normal(size=(3, 20))[:, :7:-2], RANDOM.normal(size=(1, 20))[:, :7:-2], np.zeros((0, 6))]
    given = [np.asfortranarray(each) for each in given]
    ours = np.concatenate(ColumnEvaluator(whole, 0, translate=natively)(given))
    for i in range(6):
        expected = np.concatenate([np.array(r).ravel() for r in whole(given[0][:, i], given[1][:, i], [])])
        assert np.array_equal(ours[:, i], expected)


def test_what_is_not_known_by_columns_is_evaluated_one_by_one() -> None:
    a, p = ca.MX.sym("a", 2, 2), ca.MX.sym("p", 2)
    solved = ca.Function("solved", [a, p], [ca.solve(a, p)])
    with pytest.raises(NotByColumnsError):
        column_graph(solved)
    given = [np.array([[2.0, 4.0], [0.0, 0.0], [0.0, 0.0], [1.0, 8.0]]), np.array([[1.0, 1.0], [3.0, 4.0]])]
    (values,) = ColumnEvaluator(solved, 1, translate=as_it_is)(given)
    assert np.allclose(values, [[0.5, 0.25], [3.0, 0.5]])


def test_code_for_another_processor_is_not_taken(monkeypatch: pytest.MonkeyPatch) -> None:
    """The folder of compiled code may be shared by machines that know different instructions."""
    text = "#include <stdint.h>\nint64_t seven(void) { return 7; }\n"
    here = compiled_step._built(text, ("-std=c99",), this_processor=True)
    assert compiled_step._built(text, ("-std=c99",), this_processor=True) == here
    monkeypatch.setattr(compiled_step, "_processor", lambda: "another one")
    elsewhere = compiled_step._built(text, ("-std=c99",), this_processor=True)
    assert elsewhere != here
    elsewhere.unlink()
    here.unlink()


@pytest.mark.parametrize("count", [1, 6, 8])
def test_compiled_code_gets_arrays_in_its_order(count: int) -> None:
    """Row by row, filled up to a multiple of eight by the last column, however they stood in memory."""
    values = np.asfortranarray(RANDOM.normal(size=(3, count)))
    for given in (values, values[None], values[::-1], np.concatenate([values, values])[None]):
        filled = compiled_step._filled_up(given)
        assert filled.flags.c_contiguous
        assert filled.shape[-1] == 8
        assert np.array_equal(filled[..., :count], given)
        assert np.array_equal(filled[..., count:], np.repeat(given[..., -1:], 8 - count, axis=-1))
