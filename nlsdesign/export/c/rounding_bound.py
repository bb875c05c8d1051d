"""Size of what rounding does to the outputs of a step over a recorded run, of first order.

Running error analysis after Higham, Accuracy and Stability of Numerical Algorithms, SIAM 2002, sec. 3.3:
each operation gives its result with a relative error of at most the unit roundoff. One sweep backwards
through the operations of a step, for all samples at once, gives how much each error moves each result; the
Jacobians of the steps carry it on. Errors are taken as independent with mean zero, after Higham and Mary, A
New Approach to Probabilistic Rounding Error Analysis, SIAM J. Sci. Comput. 41 (2019): then the sum of
c·δ with abs(δ) <= u exceeds λ·u·sqrt(sum of c²) with a probability of at most 2·exp(-λ²/2) (Hoeffding).
Stored numbers (constants, parameters, tables) have the same error at all samples and are carried as such.
"""

from __future__ import annotations

from collections.abc import Sequence
from functools import cache

import casadi as ca
import numpy as np
from numpy.typing import NDArray

from ...model.flat import FlatModel

Array = NDArray[np.float64]

ULPS = 4.0
"""Unit roundoffs of an elementary function, docs/targets.md; also of a number that is looked up."""
_BLOCK = 64

_EXACT = frozenset([
    ca.OP_FMIN, ca.OP_FMAX, ca.OP_LT, ca.OP_LE, ca.OP_EQ, ca.OP_NE, ca.OP_AND, ca.OP_OR, ca.OP_NOT, ca.OP_NEG,
    ca.OP_FABS, ca.OP_SIGN, ca.OP_IF_ELSE_ZERO, ca.OP_FLOOR, ca.OP_COPYSIGN, ca.OP_TWICE, ca.OP_ASSIGN,
    ca.OP_INPUT,
])  # fmt: skip
_ONE_ROUNDOFF = frozenset([ca.OP_ADD, ca.OP_SUB, ca.OP_MUL, ca.OP_DIV, ca.OP_SQ, ca.OP_INV, ca.OP_CONST])
_BINARY = frozenset([
    ca.OP_ADD, ca.OP_SUB, ca.OP_MUL, ca.OP_DIV, ca.OP_FMIN, ca.OP_FMAX, ca.OP_LT, ca.OP_LE, ca.OP_EQ,
    ca.OP_NE, ca.OP_AND, ca.OP_OR, ca.OP_POW, ca.OP_CONSTPOW, ca.OP_IF_ELSE_ZERO, ca.OP_COPYSIGN, ca.OP_FMOD,
    ca.OP_ATAN2, ca.OP_HYPOT, ca.OP_REMAINDER,
])  # fmt: skip


@cache
def _slopes(operation: int) -> ca.Function:
    """Return value and slopes of one operation."""
    x, y = ca.SX.sym("x"), ca.SX.sym("y")
    if operation in _BINARY:
        value = ca.SX.binary(operation, x, y)
        return ca.Function("slopes", [x, y], [value, ca.jacobian(value, x), ca.jacobian(value, y)])
    value = ca.SX.unary(operation, x)
    return ca.Function("slopes", [x], [value, ca.jacobian(value, x)])


class StepRounding:
    """The operations of a step with their values and slopes.

    Parameters
    ----------
    model
        Discrete model.
    """

    def __init__(self, model: FlatModel) -> None:
        s = model.symbols()
        self.groups = [s.state, s.input, s.parameter, s.table]
        results = [ca.densify(s.derivative), ca.densify(s.output)]
        step = ca.Function("step", self.groups, results, {"cse": True})
        self.offsets = np.cumsum([0, *(g.numel() for g in self.groups)])
        self.ends: list[tuple[int, int]] = []
        self.nodes: list[tuple[int, tuple[int, ...], int]] = []  # operation, operands, place of an argument
        values: list[ca.SX] = []
        slopes: list[ca.SX] = []
        work: dict[int, int] = {}
        for k in range(step.n_instructions()):
            operation = step.instruction_id(k)
            read, written = step.instruction_input(k), step.instruction_output(k)
            if operation == ca.OP_OUTPUT:
                self.ends.append((work[read[0]], written[1] + (len(model.states) if written[0] else 0)))
                continue
            if operation == ca.OP_INPUT:
                place = int(self.offsets[read[0]]) + read[1]
                node, parts = (operation, (), place), [self.groups[read[0]][read[1]]]
            elif operation == ca.OP_CONST:
                node, parts = (operation, (), -1), [ca.SX(step.instruction_constant(k))]
            else:
                operands = tuple(work[i] for i in read)
                node, parts = (
                    (operation, operands, -1),
                    _slopes(operation).call([values[i] for i in operands]),
                )
            self.nodes.append(node)
            values.append(parts[0])
            slopes += [*parts[1:], *[ca.SX(0)] * (3 - len(parts))]
            work[written[0]] = len(values) - 1
        both = [ca.densify(ca.vertcat(*values)), ca.densify(ca.vertcat(*slopes))]
        self.every = ca.Function("every", self.groups, both)
        self.count = len(model.states) + len(model.outputs)

    def deviations(self, columns: Sequence[Array], roundoff: float) -> Array:
        """Return the root of the summed squares of what roundings move, shape (samples, outputs).

        Parameters
        ----------
        columns
            States, inputs, parameters and looked-up numbers, each of shape (numbers, samples).
        roundoff
            Largest relative error of one operation.
        """
        own, stored, by_state = self._sweep(columns, roundoff)
        n = by_state.shape[2]
        spread, moved = np.zeros((n, n)), np.zeros((n, stored.shape[2]))
        rows = []
        for k in range(len(own)):
            jacobian = by_state[k]
            whole = jacobian @ spread @ jacobian.T + own[k]
            both = jacobian @ moved + stored[k]
            rows.append(np.sqrt(np.maximum(np.diag(whole)[n:], 0.0) + np.sum(both[n:] ** 2, axis=1)))
            spread, moved = whole[:n, :n], both[:n]
        return np.array(rows)

    def _sweep(self, columns: Sequence[Array], roundoff: float) -> tuple[Array, Array, Array]:
        """Return the squares of one step, what stored numbers move, and the slopes by the states."""
        samples, states = columns[0].shape[1], columns[0].shape[0]
        got = [self.every(*(c[:, k] for c in columns)) for k in range(samples)]
        values = np.array([np.array(g[0]).ravel() for g in got])
        slopes = np.array([np.array(g[1]).ravel() for g in got])
        own = np.zeros((samples, self.count, self.count))
        by_state = np.zeros((samples, self.count, states))
        block: list[Array] = []
        stored: list[Array] = []
        moved: dict[int, Array] = {}
        for node, result in self.ends:
            moved.setdefault(node, np.zeros((samples, self.count)))[:, result] += 1.0
        for i in range(len(self.nodes) - 1, -1, -1):
            weight = moved.pop(i, None)
            if weight is None:
                continue
            operation, operands, place = self.nodes[i]
            error = weight * (roundoff * np.abs(values[:, i]))[:, None]
            if operation == ca.OP_CONST or place >= self.offsets[2]:
                stored.append(error * (ULPS if place >= self.offsets[3] else 1.0))
            elif 0 <= place < states:
                by_state[:, :, place] += weight
            elif operation not in _EXACT:
                block.append(error * (1.0 if operation in _ONE_ROUNDOFF else ULPS))
            if len(block) == _BLOCK:
                both = np.stack(block, axis=2)
                own += both @ both.transpose(0, 2, 1)
                block.clear()
            for n, operand in enumerate(operands):
                slope = slopes[:, 2 * i + n]
                if slope.any():
                    # What moves no result does so whatever its slope, an infinite one too.
                    part = np.multiply(weight, slope[:, None], where=weight != 0.0, out=np.zeros_like(weight))
                    moved[operand] = moved[operand] + part if operand in moved else part
        if block:
            both = np.stack(block, axis=2)
            own += both @ both.transpose(0, 2, 1)
        kept = np.stack(stored, axis=2) if stored else np.zeros((samples, self.count, 0))
        return own, kept, by_state
