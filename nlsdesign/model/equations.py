"""The equations of a flat model as SymPy and LaTeX.

Every named signal becomes a symbol of its own, so that the equations read as they were declared instead of
as one long expression per state.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from typing import Any

import casadi as ca
import sympy

from ..errors import ExportError
from .flat import FlatModel

LONGEST = 60
"""A definition with more operations than this is shown as a function of what it depends on."""

_UNARY: dict[int, Callable[[Any], Any]] = {
    ca.OP_ASSIGN: lambda a: a,
    ca.OP_NEG: lambda a: -a,
    ca.OP_EXP: sympy.exp,
    ca.OP_LOG: sympy.log,
    ca.OP_LOG1P: lambda a: sympy.log(1 + a),
    ca.OP_EXPM1: lambda a: sympy.exp(a) - 1,
    ca.OP_SQRT: sympy.sqrt,
    ca.OP_SQ: lambda a: a**2,
    ca.OP_TWICE: lambda a: 2 * a,
    ca.OP_SIN: sympy.sin,
    ca.OP_COS: sympy.cos,
    ca.OP_TAN: sympy.tan,
    ca.OP_ASIN: sympy.asin,
    ca.OP_ACOS: sympy.acos,
    ca.OP_ATAN: sympy.atan,
    ca.OP_SINH: sympy.sinh,
    ca.OP_COSH: sympy.cosh,
    ca.OP_TANH: sympy.tanh,
    ca.OP_ATANH: sympy.atanh,
    ca.OP_FABS: sympy.Abs,
    ca.OP_SIGN: sympy.sign,
    ca.OP_FLOOR: sympy.floor,
    ca.OP_CEIL: sympy.ceiling,
    ca.OP_INV: lambda a: 1 / a,
    ca.OP_NOT: lambda a: 1 - a,
}
_BINARY: dict[int, Callable[[Any, Any], Any]] = {
    ca.OP_ADD: lambda a, b: a + b,
    ca.OP_SUB: lambda a, b: a - b,
    ca.OP_MUL: lambda a, b: a * b,
    ca.OP_DIV: lambda a, b: a / b,
    ca.OP_POW: lambda a, b: a**b,
    ca.OP_CONSTPOW: lambda a, b: a**b,
    ca.OP_FMIN: sympy.Min,
    ca.OP_FMAX: sympy.Max,
    ca.OP_ATAN2: sympy.atan2,
    ca.OP_LT: lambda a, b: sympy.Piecewise((1, a < b), (0, True)),
    ca.OP_LE: lambda a, b: sympy.Piecewise((1, a <= b), (0, True)),
    ca.OP_EQ: lambda a, b: sympy.Piecewise((1, sympy.Eq(a, b)), (0, True)),
    ca.OP_NE: lambda a, b: sympy.Piecewise((1, sympy.Ne(a, b)), (0, True)),
    ca.OP_AND: lambda a, b: a * b,
    ca.OP_OR: sympy.Max,
    ca.OP_IF_ELSE_ZERO: lambda a, b: sympy.Piecewise((b, sympy.Ne(a, 0)), (0, True)),
}


@dataclass(frozen=True)
class Equations:
    """Derivatives (or next states) and definitions of signals and outputs.

    Parameters
    ----------
    derivatives
        Right-hand side by state.
    definitions
        Right-hand side by signal or output, in the order of computation.
    discrete
        Whether the left-hand sides are next states.
    """

    derivatives: dict[str, sympy.Expr]
    definitions: dict[str, sympy.Expr]
    discrete: bool

    def latex(self) -> str:
        """Return an aligned LaTeX block of all equations."""
        left = r"{}^{{+}}" if self.discrete else r"\dot{{{}}}"
        rows = [
            f"{left.format(_tex(n))} &= {sympy.latex(e, symbol_names=_names(e))}"
            for n, e in self.derivatives.items()
        ]
        rows += [
            f"{_tex(n)} &= {sympy.latex(e, symbol_names=_names(e))}" for n, e in self.definitions.items()
        ]
        return "\\begin{aligned}\n" + " \\\\\n".join(rows) + "\n\\end{aligned}"

    def _repr_latex_(self) -> str:
        return f"${self.latex()}$"

    def __str__(self) -> str:
        mark = "next({})" if self.discrete else "der({})"
        rows = [f"{mark.format(n)} = {e}" for n, e in self.derivatives.items()]
        return "\n".join(rows + [f"{n} = {e}" for n, e in self.definitions.items()])


def _tex(name: str) -> str:
    return r"\mathrm{" + name.replace("_", r"\_") + "}"


def _names(expression: sympy.Expr) -> dict[sympy.Symbol, str]:
    return {s: _tex(s.name) for s in expression.free_symbols}


def equations(model: FlatModel) -> Equations:
    """Return the equations of a flat model as SymPy expressions.

    Parameters
    ----------
    model
        Continuous or discrete.

    Raises
    ------
    ExportError
        If a law uses an operation that has no SymPy counterpart here.
    """
    columns = [v for table in model.tables for v in table.columns]
    inputs = [
        ["time"],
        *([v.name for v in g] for g in (model.states, model.inputs, model.parameters, columns)),
    ]
    results = [[v.name for v in group] for group in (model.states, model.outputs, model.signals)]
    reader = _Reader(model.equations, inputs)
    reader.run(results)
    derivatives = {name: reader.shown(reader.results[0, i]) for i, name in enumerate(results[0])}
    return Equations(derivatives, reader.definitions, model.sample_time is not None)


class _Reader:
    """Runs through the instructions of an SX function and turns each into SymPy."""

    def __init__(self, function: ca.Function, inputs: list[list[str]]) -> None:
        self.function, self.inputs = function, inputs
        self.values: list[Any] = []
        self.results: dict[tuple[int, int], int] = {}
        self.named: dict[int, str] = {}
        self.definitions: dict[str, sympy.Expr] = {}

    def run(self, results: list[list[str]]) -> None:
        steps = self._steps()
        for (port, index), step in self.results.items():
            if port in (1, 2) and steps[step][0] not in (ca.OP_INPUT, ca.OP_CONST):
                self.named.setdefault(step, results[port][index])
        for number, (operation, operands, extra) in enumerate(steps):
            value = self._value(operation, [self.symbol(i) for i in operands], extra)
            self.values.append(value)
            if number in self.named:
                self.definitions[self.named[number]] = self._short(value)

    def _steps(self) -> list[tuple[int, list[int], Any]]:
        """Return the instructions with each operand as the number of the instruction that made it."""
        steps: list[tuple[int, list[int], Any]] = []
        held: dict[int, int] = {}
        f = self.function
        for k in range(f.n_instructions()):
            operation, out, into = f.instruction_id(k), f.instruction_output(k), f.instruction_input(k)
            if operation == ca.OP_OUTPUT:
                self.results[out[0], out[1]] = held[into[0]]
                continue
            extra = f.instruction_constant(k) if operation == ca.OP_CONST else into
            operands = [] if operation in (ca.OP_CONST, ca.OP_INPUT) else [held[i] for i in into]
            steps.append((operation, operands, extra))
            held[out[0]] = len(steps) - 1
        return steps

    def _value(self, operation: int, operands: list[Any], extra: Any) -> Any:
        if operation == ca.OP_CONST:
            return sympy.nsimplify(extra) if float(extra).is_integer() else sympy.Float(extra, 6)
        if operation == ca.OP_INPUT:
            return sympy.Symbol(self.inputs[extra[0]][extra[1]], real=True)
        if operation in _UNARY:
            return _UNARY[operation](*operands[:1])
        if operation in _BINARY:
            return _BINARY[operation](*operands)
        raise ExportError(
            f"operation {operation}", "has no SymPy counterpart", next_step="add it in equations.py"
        )

    def symbol(self, step: int) -> Any:
        """Return the value of an instruction, or its name where it has one."""
        return sympy.Symbol(self.named[step], real=True) if step in self.named else self.values[step]

    def shown(self, step: int) -> Any:
        """Return the expression to show on the right-hand side."""
        return self.symbol(step) if step in self.named else self._short(self.values[step])

    def _short(self, value: Any) -> Any:
        if value.count_ops() <= LONGEST:
            return value
        return sympy.Function("f")(*sorted(value.free_symbols, key=lambda s: str(s.name))[:6])
