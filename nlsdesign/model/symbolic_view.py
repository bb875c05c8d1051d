"""Equations as SymPy and LaTeX, read from the instructions of a casadi.Function.

Every named signal becomes a symbol of its own, so that the equations read as they were declared instead of
as one long expression per state.

A notebook shows a flat model as a block with what goes in, what it keeps and what comes out, beside its
equations.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from html import escape
from typing import Any

import casadi as ca
import sympy
from sympy.core.relational import Relational
from sympy.logic.boolalg import BooleanAtom, BooleanFunction

from ..foundation.errors import ExportError
from .graph import Instruction, operation_name, read_graph

LONGEST = 60
"""A definition with more operations than this is shown as a function of what it depends on."""

_FUNCTIONS: dict[int, Callable[..., Any]] = {
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
    ca.OP_ERF: sympy.erf,
    ca.OP_FABS: sympy.Abs,
    ca.OP_SIGN: sympy.sign,
    ca.OP_FLOOR: sympy.floor,
    ca.OP_CEIL: sympy.ceiling,
    ca.OP_INV: lambda a: 1 / a,
    ca.OP_ADD: lambda a, b: a + b,
    ca.OP_SUB: lambda a, b: a - b,
    ca.OP_MUL: lambda a, b: a * b,
    ca.OP_DIV: lambda a, b: a / b,
    ca.OP_POW: lambda a, b: a**b,
    ca.OP_CONSTPOW: lambda a, b: a**b,
    ca.OP_FMIN: sympy.Min,
    ca.OP_FMAX: sympy.Max,
    ca.OP_ATAN2: sympy.atan2,
    ca.OP_LT: sympy.Lt,
    ca.OP_LE: sympy.Le,
    ca.OP_EQ: sympy.Eq,
    ca.OP_NE: sympy.Ne,
}
# In CasADi a condition is the number 1 or 0, in SymPy a truth value.
_LOGIC: dict[int, Callable[..., Any]] = {ca.OP_NOT: sympy.Not, ca.OP_AND: sympy.And, ca.OP_OR: sympy.Or}


_TRUTH_VALUES = (Relational, BooleanFunction, BooleanAtom)


def _number(value: Any) -> Any:
    return (
        sympy.Piecewise((1, value), (0, True), evaluate=False) if isinstance(value, _TRUTH_VALUES) else value
    )


def _truth(value: Any) -> Any:
    return value if isinstance(value, _TRUTH_VALUES) else sympy.Ne(value, 0)


def _value(operation: int, operands: list[Any]) -> Any:
    if operation in _LOGIC:
        return _LOGIC[operation](*map(_truth, operands))
    if operation == ca.OP_IF_ELSE_ZERO:
        # Not evaluated: SymPy would work out how conditions inside conditions may be merged.
        pair = (_number(operands[1]), _truth(operands[0]))
        return sympy.Piecewise(pair, (0, True), evaluate=False)
    return _FUNCTIONS[operation](*map(_number, operands))


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


@dataclass(frozen=True)
class _Term:
    """The value of an instruction, with the operations in it and what it depends on."""

    value: Any
    size: int
    uses: frozenset[sympy.Symbol]


def _symbol(name: str) -> sympy.Symbol:
    return sympy.Symbol(name, real=True)


def read_equations(
    function: ca.Function,
    inputs: list[list[str]],
    results: list[list[str]],
    *,
    discrete: bool,
    longest: float = LONGEST,
) -> Equations:
    """Return the equations of a function of named numbers."""
    reader = _Reader(function, inputs, longest)
    reader.run(results)
    derivatives = {n: reader.shown(reader.terms[reader.results[0, i]]) for i, n in enumerate(results[0])}
    return Equations(derivatives, reader.definitions, discrete)


class _Reader:
    """Runs through the instructions of an SX function and turns each into SymPy."""

    def __init__(self, function: ca.Function, inputs: list[list[str]], longest: float) -> None:
        self.function, self.inputs, self.longest = function, inputs, longest
        self.terms: list[_Term] = []
        self.results: dict[tuple[int, int], int] = {}
        self.definitions: dict[str, sympy.Expr] = {}

    def run(self, results: list[list[str]]) -> None:
        graph = read_graph(self.function)
        self.results = graph.results
        names: dict[int, list[str]] = {}
        for (port, index), number in self.results.items():
            if port in (1, 2) and results[port][index] not in names.setdefault(number, []):
                names[number].append(results[port][index])
        for number, step in enumerate(graph.steps):
            self.terms.append(self._defined(self._term(step), names.get(number, []), step.operation))

    def shown(self, term: _Term) -> Any:
        """Return a value; where it is too long, a function of what it depends on, rows named once."""
        if term.size <= self.longest:
            return _number(term.value)
        names = {str(s.name).partition("[")[0] for s in term.uses}
        return sympy.Function("f")(*[_symbol(name) for name in sorted(names)])

    def _defined(self, term: _Term, names: list[str], operation: int) -> _Term:
        """Note the names of a value; from then on it goes by the first of them, inputs by their own."""
        if names and operation not in (ca.OP_INPUT, ca.OP_CONST):
            own = _symbol(names[0])
            self.definitions[names.pop(0)] = self.shown(term)
            term = _Term(own, 0, frozenset([own]))
        self.definitions |= {name: term.value for name in names if name != str(term.value)}
        return term

    def _term(self, step: Instruction) -> _Term:
        operation, extra = step.operation, step.extra
        if operation == ca.OP_CONST:
            whole = extra.is_integer()
            return _Term(sympy.Integer(int(extra)) if whole else sympy.Float(extra), 0, frozenset())
        if operation == ca.OP_INPUT:
            symbol = _symbol(self.inputs[extra[0]][extra[1]])
            return _Term(symbol, 0, frozenset([symbol]))
        if operation not in {*_FUNCTIONS, *_LOGIC, ca.OP_IF_ELSE_ZERO}:
            raise ExportError(
                f"the function '{operation_name(operation)}' in the equations", "has no SymPy counterpart",
                next_step="write the law with elementary functions",
            )  # fmt: skip
        operands = [self.terms[i] for i in step.operands]
        size = 1 + sum(term.size for term in operands)
        # What is too long to be shown is not even built: written out, shared parts multiply.
        value = _value(operation, [term.value for term in operands]) if size <= self.longest else None
        return _Term(value, size, frozenset().union(*[term.uses for term in operands]))


LINE = 18.0
"""Height of a line in pixels."""
_STYLE = "fill:none;stroke:currentColor;stroke-width:1.5"
_WORDS = "font:12px system-ui,sans-serif;fill:currentColor"


def model_html(name: str, description: str, groups: Sequence[Sequence[str]], latex: str) -> str:
    """Return a model as HTML.

    ``latex``: equations, for the mathematics of the notebook; nothing if empty.
    """
    title = f"<p><b>{escape(name)}</b> {escape(description)}</p>"
    shown = f"<div>$${escape(latex)}$$</div>" if latex else ""
    return f"<div>{title}{block_svg(name, *groups)}{shown}</div>"


def block_svg(name: str, inputs: Sequence[str], states: Sequence[str], outputs: Sequence[str]) -> str:
    """Return a block diagram as SVG."""
    left, inside, right = (7.0 * max((len(v) for v in g), default=0) for g in (inputs, states, outputs))
    inside = max(inside, 90.0) + 24.0
    height = LINE * max(len(inputs), len(states) + 1, len(outputs)) + 20.0
    start, end = left + 40.0, left + 40.0 + inside
    width = end + 40.0 + right
    drawn = [
        f'<rect x="{start:.0f}" y="4" width="{inside:.0f}" height="{height:.0f}" rx="6" style="{_STYLE}"/>',
        _text(start + inside / 2, 20.0, "states" if states else "no states", "middle"),
    ]
    drawn += [_text(start + inside / 2, 20.0 + LINE * n, v, "middle") for n, v in enumerate(states, 1)]
    for group, edge, way, anchor in ((inputs, start, -1, "end"), (outputs, end, 1, "start")):
        for number, variable in enumerate(group):
            y = 20.0 + LINE * number
            drawn.append(_text(edge + way * 36.0, y, variable, anchor))
            tip = edge - 2.0 if way < 0 else edge + 30.0
            arrow = f"M{edge + way * 32:.0f} {y - 4:.0f}H{edge:.0f}M{tip - 6:.0f} {y - 8:.0f}l6 4l-6 4"
            drawn.append(f'<path style="{_STYLE}" d="{arrow}"/>')
    return (
        f'<svg xmlns="http://www.w3.org/2000/svg" width="{width:.0f}" height="{height + 8:.0f}" role="img" '
        f'viewBox="0 0 {width:.0f} {height + 8:.0f}" aria-label="Model {escape(name)}">{"".join(drawn)}</svg>'
    )


def _text(x: float, y: float, words: str, anchor: str) -> str:
    return f'<text x="{x:.0f}" y="{y:.0f}" text-anchor="{anchor}" style="{_WORDS}">{escape(words)}</text>'
