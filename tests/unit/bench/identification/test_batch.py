"""Functions over many samples give what CasADi gives sample by sample."""

from __future__ import annotations

import casadi as ca
import numpy as np
import pytest

from nlsdesign.bench.identification.equation_error.batch import ChainFunction, ColumnFunction, PointFunction

_X, _Y = ca.SX.sym("x"), ca.SX.sym("y")
_RESULTS = {
    "arithmetic": [_X + _Y, _X - _Y, _X * _Y, _X / _Y, -_X, 2 * _X, _X * _X, 1 / _X, _X**3, _X**_Y],
    "roots and powers": [ca.sqrt(_X), ca.exp(_X), ca.log(_X), ca.log1p(_X), ca.expm1(_X), ca.hypot(_X, _Y)],
    "angles": [
        *[f(_X) for f in (ca.sin, ca.cos, ca.tan, ca.asin, ca.acos, ca.atan)],
        ca.atan2(_X, _Y),
    ],
    "hyperbolic": [f(_X) for f in (ca.sinh, ca.cosh, ca.tanh, ca.asinh, ca.acosh, ca.atanh, ca.erf)],
    "parts": [
        *[f(_X) for f in (ca.floor, ca.ceil, ca.fabs, ca.sign)],
        *[f(_X, _Y) for f in (ca.fmod, ca.remainder, ca.fmin, ca.fmax, ca.copysign)],
    ],
    "truth": [
        *[_X < _Y, _X <= _Y, _X == _Y, _X != _Y, ca.logic_not(_X < 0)],
        ca.logic_and(_X < 0.5, _Y < 0.5),
        ca.logic_or(_X < 0, _Y < 0),
        (_X < 0.5) + (_Y < 0.5),
        ca.if_else(_X < _Y, _X, 2 * _Y),
        ca.if_else(_X < 0, ca.log(_X), 1.0),
    ],
}


@pytest.mark.parametrize("kind", _RESULTS)
@pytest.mark.parametrize("count", [1, 7, 9001])
def test_columns_are_what_casadi_computes(kind: str, count: int) -> None:
    function = ca.Function("f", [_X, _Y], [ca.densify(ca.vertcat(*_RESULTS[kind], 3.0))])
    random = np.random.default_rng(3)
    x, y = (np.concatenate([[0.5], random.uniform(-0.9, 0.9, count - 1)])[None] for _ in range(2))
    expected = function.map(count)(x, y).full()
    np.testing.assert_allclose(ColumnFunction(function)(count, [x, y]), expected, rtol=1e-13, atol=1e-15)


def test_a_column_may_be_the_same_for_all_samples() -> None:
    p, u = ca.SX.sym("p", 2), ca.SX.sym("u")
    function = ca.Function("f", [u, p], [ca.vertcat(p[0] * u, p[1])])
    result = ColumnFunction(function)(3, [np.array([[1.0, 2.0, 3.0]]), np.array([4.0, 5.0])])
    np.testing.assert_array_equal(result, [[4.0, 8.0, 12.0], [5.0, 5.0, 5.0]])


@pytest.mark.parametrize("count", [1, 250, 613])
def test_a_chain_goes_on_from_what_the_step_before_gave(count: int) -> None:
    x, u, p = ca.SX.sym("x", 2), ca.SX.sym("u"), ca.SX.sym("p")
    step = ca.Function("f", [x, u, p], [ca.vertcat(p * x[0] + u, x[1] + x[0])])
    driven = np.random.default_rng(1).standard_normal((1, count))
    path, place = np.zeros((2, count)), np.array([1.0, 0.0])
    for k in range(count):
        place = path[:, k] = np.array([0.9 * place[0] + driven[0, k], place[1] + place[0]])
    result = ChainFunction(step)(count, [np.array([1.0, 0.0]), driven, np.array([0.9])])
    np.testing.assert_allclose(result, path, rtol=1e-12)


def test_a_point_gives_all_outputs_in_their_shape() -> None:
    x, y = ca.SX.sym("x", 2), ca.SX.sym("y")
    matrix = ca.densify(ca.horzcat(x, x * y, x + y))
    point = PointFunction(ca.Function("f", [x, y, ca.SX.sym("none", 0)], [x * x, matrix]))
    column, table = point(np.array([1.0, 2.0]), 3.0, np.zeros(0))
    np.testing.assert_array_equal(column, [[1.0], [4.0]])
    np.testing.assert_array_equal(table, [[1.0, 3.0, 4.0], [2.0, 6.0, 5.0]])
    point(np.array([0.0, 0.0]), 0.0, np.zeros(0))
    assert table[0, 1] == 3.0  # what was given out stays what it was
