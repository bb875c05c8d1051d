"""The one reader of CasADi's instructions gives what CasADi computes."""

from __future__ import annotations

import casadi as ca
import numpy as np
import pytest

from nlsdesign.model.graph import applied, as_results, fold, operation_name, read_graph
from nlsdesign.simulation.column_graph import ARITHMETIC

X, Y = ca.SX.sym("x"), ca.SX.sym("y")
FUNCTION = ca.Function(
    "f", [X, Y], [ca.vertcat(ca.if_else(X < Y, ca.sin(X), -Y), 2.0 * X), ca.vertcat(X * X, 0, Y - X / 3)]
)

TWO_OPERANDS = {
    ca.OP_ADD, ca.OP_SUB, ca.OP_MUL, ca.OP_DIV, ca.OP_POW, ca.OP_CONSTPOW, ca.OP_HYPOT, ca.OP_ATAN2,
    ca.OP_FMOD, ca.OP_COPYSIGN, ca.OP_FMIN, ca.OP_FMAX, ca.OP_LT, ca.OP_LE, ca.OP_EQ, ca.OP_NE,
    ca.OP_AND, ca.OP_OR, ca.OP_IF_ELSE_ZERO,
}  # fmt: skip


def test_a_function_that_is_written_again_is_the_same() -> None:
    arguments = [ca.SX.sym("a"), ca.SX.sym("b")]
    values = fold(read_graph(FUNCTION), lambda i, k: arguments[i].nz[k], ca.SX, combined=applied)
    again = ca.Function("again", arguments, as_results(FUNCTION, values))
    for point in ((0.3, 0.7), (0.7, 0.3)):
        for one, other in zip(again(*point), FUNCTION(*point), strict=True):
            np.testing.assert_array_equal(np.array(one), np.array(other))
    assert [again.sparsity_out(i) == FUNCTION.sparsity_out(i) for i in range(2)] == [True, True]


def test_each_value_names_what_computed_it() -> None:
    graph = read_graph(FUNCTION)
    for number, step in enumerate(graph.steps):
        assert all(operand < number for operand in step.operands)
    given = [step.extra for step in graph.steps if step.operation == ca.OP_INPUT]
    assert sorted(set(given)) == [(0, 0), (1, 0)]


def test_a_value_is_let_go_after_its_last_use_and_not_before() -> None:
    graph = read_graph(FUNCTION)
    later = {operand: k for k, step in enumerate(graph.steps) for operand in step.operands}
    let_go = {operand: k for k, released in enumerate(graph.last_uses) for operand in released}
    assert let_go == {i: k for i, k in later.items() if i not in graph.results.values()}


@pytest.mark.parametrize("operation", sorted(ARITHMETIC))
def test_an_operation_takes_as_many_values_as_it_needs(operation: int) -> None:
    count = 2 if operation in TWO_OPERANDS else 1
    value = applied(operation, [X, Y][:count])
    steps = read_graph(ca.Function("f", [X, Y], [value])).steps
    assert [len(step.operands) for step in steps if step.operation == value.op()] == [count]


def test_operations_go_by_the_names_of_casadi() -> None:
    assert operation_name(ca.OP_FMIN) == "fmin"
    assert operation_name(-7) == "number -7"
