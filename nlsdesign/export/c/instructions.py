"""CasADi's arithmetic printed as C99, operation by operation.

``casadi.CodeGenerator`` is not used: its text is one work vector overwritten again and again, with
``double`` literals whatever the target, ``fmin`` and ``fmax`` as library calls and every ``if_else`` as a
sum of two, and each of these would have to be patched in foreign text. The instruction sequence of an SX
function is public and small, so it is printed from there: each value a constant of its own, short values
inside their only use, float literals for float, ``c ? a : b`` for a choice.
"""

from __future__ import annotations

from collections import Counter
from collections.abc import Collection, Sequence
from dataclasses import dataclass, field

import casadi as ca

from ...foundation.errors import ExportError
from ...model.graph import fold, read_graph
from .c_text import Real

_INLINE = 64  # longest text that is written inside another expression
# Precedence of operators, highest first.
_ATOM, _CALL, _UNARY, _PRODUCT, _SUM, _RELATION, _JUNCTION, _CHOICE = range(8)
_SELECT = -1  # condition ? this : that; not an operation of CasADi

_FUNCTIONS = {
    getattr(ca, f"OP_{name.upper()}"): name
    for line in (
        "exp log sqrt sin cos tan asin acos atan floor ceil fmod fabs copysign erf sinh cosh tanh",
        "asinh acosh atanh atan2 log1p expm1 hypot remainder pow",
    )
    for name in line.split()
} | {ca.OP_CONSTPOW: "pow"}
_BINARY = {
    ca.OP_ADD: ("+", _SUM),
    ca.OP_SUB: ("-", _SUM),
    ca.OP_MUL: ("*", _PRODUCT),
    ca.OP_DIV: ("/", _PRODUCT),
}
_COMPARED = {ca.OP_LT: "<", ca.OP_LE: "<=", ca.OP_EQ: "==", ca.OP_NE: "!="}
_JOINED = {ca.OP_AND: "&&", ca.OP_OR: "||"}
_LOGICAL = frozenset([*_COMPARED, *_JOINED, ca.OP_NOT])
# Operations that use an operand twice; the operand becomes a constant with a name.
_TWICE_NAMED = frozenset([ca.OP_SQ, ca.OP_SIGN, ca.OP_FMIN, ca.OP_FMAX, ca.OP_EQ, ca.OP_NE])


@dataclass(frozen=True)
class _Node:
    operation: int
    operands: tuple[int, ...] = ()
    text: str = ""  # of an input
    value: float = 0.0  # of a constant


@dataclass(frozen=True)
class _Text:
    text: str
    strength: int
    logical: bool = False

    def within(self, strength: int) -> str:
        return self.text if self.strength <= strength else f"({self.text})"


class _Graph:
    """Values in the order of CasADi's computation, each written once."""

    def __init__(self, function: ca.Function, inputs: Sequence[Sequence[str]]) -> None:
        self.nodes: list[_Node] = []
        self.results = fold(
            read_graph(function),
            lambda argument, element: self._added(_Node(ca.OP_INPUT, text=inputs[argument][element])),
            lambda value: self._added(_Node(ca.OP_CONST, value=value)),
            combined=lambda operation, operands: self._added(self._choice(_Node(operation, tuple(operands)))),
        )

    def _added(self, node: _Node) -> int:
        self.nodes.append(node)
        return len(self.nodes) - 1

    def _choice(self, node: _Node) -> _Node:
        """Return one choice for the sum of two half choices with opposite conditions."""
        if node.operation != ca.OP_ADD:
            return node
        one, other = (self.nodes[i] for i in node.operands)
        if one.operation != ca.OP_IF_ELSE_ZERO or other.operation != ca.OP_IF_ELSE_ZERO:
            return node
        for first, second in ((one, other), (other, one)):
            opposite = self.nodes[second.operands[0]]
            if opposite.operation == ca.OP_NOT and opposite.operands[0] == first.operands[0]:
                return _Node(_SELECT, (first.operands[0], first.operands[1], second.operands[1]))
        return node

    def uses(self) -> Counter[int]:
        """Return the number of uses of each value; values that no result needs are left out."""
        count: Counter[int] = Counter(self.results.values())
        for index in range(len(self.nodes) - 1, -1, -1):
            if count[index]:
                weight = 2 if self.nodes[index].operation in _TWICE_NAMED else 1
                for operand in self.nodes[index].operands:
                    count[operand] += weight
        return count


@dataclass
class _Printer:
    """Writes values as C text; ``texts`` holds what stands for each value, ``lines`` the named constants."""

    real: Real
    own: Collection[str]
    texts: dict[int, _Text] = field(default_factory=dict)
    lines: list[str] = field(default_factory=list)

    def number(self, index: int, strength: int) -> str:
        """Return a value as a number."""
        text = self.texts[index]
        if not text.logical:
            return text.within(strength)
        one, zero = self.real.literal(1.0), self.real.literal(0.0)
        return f"({text.within(_RELATION)} ? {one} : {zero})"

    def condition(self, index: int) -> str:
        """Return a value as a condition, bracketed unless it is a name."""
        text = self.texts[index]
        if text.logical:
            return text.within(_UNARY)
        zero, number = self.real.literal(0.0), text.within(_SUM)
        # Not zero; NaN is not. Written without a comparison for equality, which compilers warn of.
        return f"!({number} <= {zero} && {number} >= {zero})"

    def expression(self, node: _Node) -> _Text:
        """Return the C text of one operation."""
        operation, operands = node.operation, node.operands
        if operation == ca.OP_INPUT:
            return _Text(node.text, _ATOM)
        if operation == ca.OP_CONST:
            return _Text(self.real.literal(node.value), _UNARY if node.value < 0 else _ATOM)
        if operation in _BINARY:
            sign, strength = _BINARY[operation]
            left, right = self.number(operands[0], strength), self.number(operands[1], strength - 1)
            return _Text(f"{left} {sign} {right}", strength)
        if operation in _FUNCTIONS:
            name, arguments = _FUNCTIONS[operation], ", ".join(self.number(i, _CHOICE) for i in operands)
            prefix = "portable_" if name in self.own else ""
            return _Text(f"{prefix}{self.real.function(name)}({arguments})", _CALL)
        if operation in _LOGICAL:
            return self._logical(operation, operands)
        return self._special(operation, operands)

    def _logical(self, operation: int, operands: tuple[int, ...]) -> _Text:
        if operation == ca.OP_NOT:
            return _Text("!" + self.condition(operands[0]), _UNARY, logical=True)
        if operation in _JOINED:
            left, right = self.condition(operands[0]), self.condition(operands[1])
            return _Text(f"{left} {_JOINED[operation]} {right}", _JUNCTION, logical=True)
        left, right = (self.number(i, _SUM) for i in operands)
        if operation in (ca.OP_EQ, ca.OP_NE):
            equal = f"{left} <= {right} && {left} >= {right}"
            if operation == ca.OP_NE:
                return _Text(f"!({equal})", _UNARY, logical=True)
            return _Text(equal, _JUNCTION, logical=True)
        return _Text(f"{left} {_COMPARED[operation]} {right}", _RELATION, logical=True)

    def _special(self, operation: int, operands: tuple[int, ...]) -> _Text:
        zero = self.real.literal(0.0)
        if operation in (_SELECT, ca.OP_IF_ELSE_ZERO):
            branches = [self.number(i, _SUM) for i in operands[1:]] + [zero]
            return _Text(f"{self.condition(operands[0])} ? {branches[0]} : {branches[1]}", _CHOICE)
        first = self.number(operands[0], _UNARY)
        if operation == ca.OP_NEG:
            return _Text(f"-({first})" if first.startswith("-") else f"-{first}", _UNARY)
        if operation == ca.OP_SQ:
            return _Text(f"{first} * {first}", _PRODUCT)
        if operation == ca.OP_TWICE:
            return _Text(f"{self.real.literal(2.0)} * {first}", _PRODUCT)
        if operation == ca.OP_INV:
            return _Text(f"{self.real.literal(1.0)} / {self.number(operands[0], _UNARY)}", _PRODUCT)
        if operation == ca.OP_SIGN:
            return _Text(f"({self.real})(({first} > {zero}) - ({first} < {zero}))", _UNARY)
        if operation in (ca.OP_FMIN, ca.OP_FMAX):
            # One machine instruction; fmin() of math.h is a library call because of its rule for NaN.
            second, sign = self.number(operands[1], _UNARY), "<" if operation == ca.OP_FMIN else ">"
            return _Text(f"{first} {sign} {second} ? {first} : {second}", _CHOICE)
        if operation in (ca.OP_ASSIGN, ca.OP_LIFT):
            return self.texts[operands[0]]
        raise ExportError(
            f"operation {operation} of CasADi",
            "has no counterpart in C99",
            next_step="write the law with elementary functions",
        )

    def name(self, index: int) -> None:
        """Write a value as a named constant."""
        text = self.texts[index]
        kind = "int" if text.logical else self.real
        self.lines.append(f"const {kind} a{index} = {text.text};")
        self.texts[index] = _Text(f"a{index}", _ATOM, text.logical)


def print_statements(
    function: ca.Function,
    inputs: Sequence[Sequence[str]],
    targets: Sequence[Sequence[str]],
    *,
    real: Real,
    own: Collection[str] = (),
) -> list[str]:
    """Return C statements that compute the structural nonzeros of all results of an SX function.

    The nonzeros of its arguments are given as C text. Those of its results get left-hand sides such as
    ``"f[0]"`` or ``"const double y0"``; they are written last, so that a result may overwrite an argument.
    Intermediate values are called ``a<i>``; functions among ``own`` are those of :mod:`.elementary`.
    An operation or a constant without a counterpart in C is an ``ExportError``.
    """
    graph = _Graph(function, inputs)
    printer, uses, results = _Printer(real, own), graph.uses(), set(graph.results.values())
    for index, node in enumerate(graph.nodes):
        if not uses[index]:
            continue
        text = printer.texts[index] = printer.expression(node)
        given = node.operation in (ca.OP_INPUT, ca.OP_CONST) or text.strength == _ATOM
        only_result = uses[index] == 1 and index in results
        if not given and not only_result and (uses[index] > 1 or len(text.text) > _INLINE):
            printer.name(index)
    stored = [
        f"{targets[result][nonzero]} = {printer.number(index, _CHOICE)};"
        for (result, nonzero), index in sorted(graph.results.items())
    ]
    return printer.lines + stored
