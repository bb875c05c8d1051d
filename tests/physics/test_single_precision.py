"""Single against double precision: the difference stays below a bound that is derived, and not far below it.

Running error analysis of first order, after Higham, Accuracy and Stability of Numerical Algorithms, SIAM
2002, sec. 3.3: each operation of the step gives its result with a relative error of at most the unit
roundoff. Every value of CasADi's instruction sequence is rebuilt here as value·(1 + δ); the sum of
|∂result/∂δ| times the roundoff bounds the error of one step. What a step has left behind goes on through
the product of the steps' Jacobians, whose absolute value is taken last.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from functools import cache
from pathlib import Path

import casadi as ca
import numpy as np
import pytest

import nlsdesign as nls
from nlsdesign.export.c.guarded_step import GuardedModel
from nlsdesign.export.compilation.compiled_step import CompiledStep
from nlsdesign.feedback.control import PidTorque, joined
from nlsdesign.feedback.observer import design_observer_with_details
from nlsdesign.model.graph import applied, as_results, fold, read_graph
from tests.unguarded import unguarded

ROUNDOFF = 2.0**-24
LIBRARY = {ca.OP_EXP, ca.OP_EXPM1, ca.OP_TANH, ca.OP_SQRT, ca.OP_LOG, ca.OP_POW, ca.OP_CONSTPOW}
ULPS = 4.0  # of an elementary function, docs/targets.md
EXACT = {
    ca.OP_FMIN, ca.OP_FMAX, ca.OP_LT, ca.OP_LE, ca.OP_EQ, ca.OP_NE, ca.OP_AND, ca.OP_OR, ca.OP_NOT, ca.OP_NEG,
    ca.OP_FABS, ca.OP_SIGN, ca.OP_IF_ELSE_ZERO, ca.OP_FLOOR, ca.OP_COPYSIGN, ca.OP_TWICE, ca.OP_ASSIGN,
}  # fmt: skip


@cache
def machine(which: str) -> nls.FlatModel:
    plant = nls.flatten(nls.declare(nls.load_deck("austin2015_figure_consistent")))
    observer = design_observer_with_details(plant).model
    controller = nls.torque_controller(plant, law=PidTorque())
    return unguarded(observer if which == "observer" else joined(observer, controller))


def rounded(function: ca.Function, arguments: list[ca.SX]) -> tuple[list[ca.SX], ca.SX, list[float]]:
    """Return the results with a relative error δ on every value, the δ, and how many roundoffs each has."""
    errors: list[ca.SX] = []
    sizes: list[float] = []

    def erring(value: ca.SX, size: float) -> ca.SX:
        errors.append(ca.SX.sym(f"d{len(errors)}"))
        sizes.append(size)
        return value * (1 + errors[-1])

    def combined(operation: int, operands: Sequence[ca.SX]) -> ca.SX:
        value = applied(operation, operands)
        return value if operation in EXACT else erring(value, ULPS if operation in LIBRARY else 1.0)

    values = fold(
        read_graph(function),
        lambda argument, element: arguments[argument][element],
        lambda value: erring(ca.SX(value), 1.0),
        combined=combined,
    )
    return as_results(function, values), ca.vertcat(*errors), sizes


class Bound:
    """The bound of a run, sample by sample."""

    def __init__(self, model: nls.FlatModel) -> None:
        self.model, s = model, model.symbols()
        arguments = [s.state, s.input, s.parameter, s.table]
        step = ca.Function("step", arguments, [ca.densify(s.derivative), ca.densify(s.output)], {"cse": True})
        results, errors, sizes = rounded(step, arguments)
        own = ca.fabs(ca.jacobian(ca.vertcat(*results), errors)) @ ca.DM(sizes)
        exact = ca.vertcat(s.derivative, s.output)
        by_state, by_number, by_table = (
            ca.jacobian(exact, group) for group in (s.state, s.parameter, s.table)
        )
        numbers = ca.fabs(by_number) @ ca.fabs(s.parameter)  # rounded when they are stored
        every = [own + numbers, ca.densify(by_state), ca.densify(ca.fabs(by_table))]
        every = ca.substitute(every, [errors], [ca.DM.zeros(errors.numel())])
        self.local = ca.Function("local", arguments, every)
        self.states = len(model.states)
        self.left: list[np.ndarray] = []
        self.carried = np.zeros((0, self.states, self.states))

    def step(self, x: np.ndarray, u: list[float], p: np.ndarray) -> np.ndarray:
        """Return the bound of the outputs, and carry that of the states on."""
        w = self.model.look_up(x.tolist(), u)
        own, by_state, by_table = (np.array(m) for m in self.local(x, u, p, w))
        local = ROUNDOFF * own.ravel() + by_table @ self.table(x, u, w)
        bound = local[self.states :]
        if self.left:
            onward = np.abs(by_state[self.states :] @ self.carried)
            bound = bound + np.einsum("kij,kj->i", onward, np.array(self.left))
        # The next states are stored in single precision too.
        self.left.append(local[: self.states] + ROUNDOFF * np.abs(x))
        moved = by_state[: self.states] @ self.carried
        self.carried = np.concatenate([moved, np.eye(self.states)[None]])
        return bound

    def table(self, x: np.ndarray, u: list[float], w: np.ndarray) -> np.ndarray:
        """Return the bound of what is looked up: stored numbers, and the place between two of them."""
        at = dict(zip([v.name for v in self.model.states], x, strict=True))
        at |= dict(zip([v.name for v in self.model.inputs], u, strict=True))
        parts = []
        for table in self.model.tables:
            grid, where = table.grid, at[table.argument]
            left = min(max(int(np.searchsorted(grid, where, side="right")) - 1, 0), len(grid) - 2)
            cell = grid[left + 1] - grid[left]
            rows = np.abs(table.values[left]) + np.abs(table.values[left + 1])
            step = np.abs(table.values[left + 1] - table.values[left])
            # Argument, ends of the cell, two differences and a quotient: five roundoffs of the ends' size.
            place = 3.0 + 5.0 * max(abs(grid[0]), abs(grid[-1])) / cell
            parts.append(ROUNDOFF * (3.0 * rows + step * place))
        return np.concatenate(parts) if parts else np.zeros(len(w))


@pytest.mark.long_cases("observer")
@pytest.mark.parametrize("which", ["observer", "both"])
def test_single_precision_keeps_a_derived_bound(which: str, tmp_path: Path) -> None:
    model = machine(which)
    step = CompiledStep(nls.export_c(model, tmp_path, real="float"))
    run, bound = GuardedModel(model), Bound(model)
    parameters, draw = model.start(model.parameters), np.random.default_rng(5)
    seen, allowed = [], []
    for k in range(300):
        reading = float(np.float32(0.5 * math.sin(0.01 * k) + 1e-3 * draw.normal()))
        other = float(np.float32(math.sin(0.007 * k) + (2.0 if which == "observer" else 0.5)))
        before = run.state.copy()
        expected, _ = run.step([reading, other])
        allowed.append(bound.step(before, [reading, other], parameters))
        seen.append(np.abs(np.array(step([reading, other])[0]) - expected))
    difference, limits = np.array(seen), np.array(allowed)
    assert np.all(difference <= limits)
    # A bound that says something: every output comes within a hundredth of it, and the torque's is small.
    assert np.all(np.max(difference / np.maximum(limits, 1e-30), axis=0) > 0.01)
    names = [v.name for v in model.outputs]
    assert np.max(limits[:, names.index("spring.torque")]) < 1e-4
