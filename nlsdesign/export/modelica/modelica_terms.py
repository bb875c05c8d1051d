"""What one operation of CasADi is in Modelica, with as few brackets as its grammar allows."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, replace

import casadi as ca

from ...foundation.errors import ExportError
from ...model.graph import operation_name

ATOM, POWER, PRODUCT, SUM, SIGNED, RELATION, AND, OR, CHOICE = range(8, -1, -1)
"""How strongly a text holds together; a sign is weaker than a sum, as ``a + -b`` is not allowed."""


@dataclass(frozen=True)
class Term:
    """Text of a value."""

    text: str
    strength: int = ATOM  # how strongly it holds together
    # opposite: of a truth value: text and strength of its negation; None for a number
    opposite: tuple[str, int] | None = None
    # events: whether a tool would look for events in it, which the equations are not meant to have
    events: bool = False
    size: int = 0  # number of operations in it
    # choice: of a number that is zero unless a condition holds: the condition, whether it is negated, the
    # number
    choice: tuple[str, bool, str] | None = None
    number: str = ""  # of a truth value that is kept in a variable: the variable, which is 1 or 0

    def inside(self, least: int) -> str:
        """Return the text, in brackets where it holds together less than is needed."""
        return self.text if self.strength >= least else f"({self.text})"

    def as_number(self) -> Term:
        """Return a truth value as the number 1 or 0, a number as it is."""
        if self.opposite is None:
            return self
        if self.number:
            return Term(self.number)
        return replace(self, text=f"if {self.text} then 1.0 else 0.0", strength=CHOICE, opposite=None)

    def as_truth(self) -> Term:
        """Return a number as whether it is not zero, a truth value as it is."""
        if self.opposite is not None:
            return self
        return replace(
            self, text=f"abs({self.text}) > 0", strength=RELATION, events=True, choice=None,
            opposite=(f"abs({self.text}) <= 0", RELATION),
        )  # fmt: skip

    def negated(self) -> Term:
        """Return the negation of a truth value."""
        truth = self.as_truth()
        text, strength = truth.opposite or ("", ATOM)
        return replace(truth, text=text, strength=strength, opposite=(truth.text, truth.strength), number="")


def kept(name: str, value: Term) -> Term:
    """Return the term of a variable that holds a value, a truth value as 1 or 0."""
    if value.opposite is None:
        return Term(name)
    return Term(f"{name} > 0.5", RELATION, (f"{name} <= 0.5", RELATION), events=True, number=name)


_FUNCTIONS = {
    ca.OP_EXP: "exp", ca.OP_LOG: "log", ca.OP_SQRT: "sqrt", ca.OP_SIN: "sin", ca.OP_COS: "cos",
    ca.OP_TAN: "tan", ca.OP_ASIN: "asin", ca.OP_ACOS: "acos", ca.OP_ATAN: "atan", ca.OP_SINH: "sinh",
    ca.OP_COSH: "cosh", ca.OP_TANH: "tanh", ca.OP_FABS: "abs", ca.OP_SIGN: "sign", ca.OP_FLOOR: "floor",
    ca.OP_CEIL: "ceil", ca.OP_FMIN: "min", ca.OP_FMAX: "max", ca.OP_ATAN2: "atan2",
}  # fmt: skip
_WITH_EVENTS = frozenset([ca.OP_FLOOR, ca.OP_CEIL])

_SMALL = "0.01"
# Near zero log(1 + x) and exp(x) - 1 lose digits; there the series is exact to 1e-17.
_LOG_SERIES = "1.0 - {0}*(1/2 - {0}*(1/3 - {0}*(1/4 - {0}*(1/5 - {0}*(1/6 - {0}*(1/7 - {0}/8))))))"
_EXP_SERIES = "1.0 + {0}/2*(1 + {0}/3*(1 + {0}/4*(1 + {0}/5*(1 + {0}/6))))"


def _near_zero(series: str, elsewhere: str) -> Callable[[Term], tuple[str, int]]:
    def text(x: Term) -> tuple[str, int]:
        near = f"{x.text}*({series.format(x.text)})"
        return f"if abs({x.text}) < {_SMALL} then {near} else {elsewhere.format(x.text)}", CHOICE

    return text


_ARITHMETIC: Mapping[int, Callable[..., tuple[str, int]]] = {
    ca.OP_ASSIGN: lambda a: (a.text, a.strength),
    ca.OP_ADD: lambda a, b: (f"{a.inside(SUM)} + {b.inside(PRODUCT)}", SUM),
    ca.OP_SUB: lambda a, b: (f"{a.inside(SUM)} - {b.inside(PRODUCT)}", SUM),
    ca.OP_MUL: lambda a, b: (f"{a.inside(PRODUCT)}*{b.inside(POWER)}", PRODUCT),
    ca.OP_DIV: lambda a, b: (f"{a.inside(PRODUCT)}/{b.inside(POWER)}", PRODUCT),
    ca.OP_NEG: lambda a: (f"-{a.inside(PRODUCT)}", SIGNED),
    ca.OP_TWICE: lambda a: (f"2.0*{a.inside(POWER)}", PRODUCT),
    ca.OP_INV: lambda a: (f"1.0/{a.inside(POWER)}", PRODUCT),
    ca.OP_SQ: lambda a: (f"{a.inside(ATOM)}^2", POWER),
    ca.OP_POW: lambda a, b: (f"{a.inside(ATOM)}^{b.inside(ATOM)}", POWER),
    ca.OP_CONSTPOW: lambda a, b: (f"{a.inside(ATOM)}^{b.inside(ATOM)}", POWER),
    ca.OP_LOG1P: _near_zero(_LOG_SERIES, "log(1.0 + {0})"),
    ca.OP_EXPM1: _near_zero(_EXP_SERIES, "exp({0}) - 1.0"),
}

# Real numbers are not compared for equality in equations of Modelica.
_RELATIONS: Mapping[int, tuple[str, str]] = {
    ca.OP_LT: ("{0} < {1}", "{0} >= {1}"),
    ca.OP_LE: ("{0} <= {1}", "{0} > {1}"),
    ca.OP_EQ: ("{0} >= {1} and {0} <= {1}", "{0} < {1} or {0} > {1}"),
    ca.OP_NE: ("{0} < {1} or {0} > {1}", "{0} >= {1} and {0} <= {1}"),
}
_STRENGTHS = {ca.OP_LT: (RELATION, RELATION), ca.OP_LE: (RELATION, RELATION), ca.OP_EQ: (AND, OR),
              ca.OP_NE: (OR, AND)}  # fmt: skip

SERIES = frozenset([ca.OP_LOG1P, ca.OP_EXPM1])
"""Operations whose text is so long that their value should have a name."""
WRITTEN_TWICE = SERIES | {ca.OP_EQ, ca.OP_NE}
"""Operations whose text holds an operand more than once, so that it should be a name."""


def term(operation: int, operands: Sequence[Term]) -> Term:
    """Return the text of an operation."""
    size = 1 + sum(each.size for each in operands)
    events = any(each.events for each in operands) or operation in _WITH_EVENTS
    if operation == ca.OP_NOT:
        return replace(operands[0].negated(), size=size)
    if operation in (ca.OP_AND, ca.OP_OR):
        a, b = (each.as_truth() for each in operands)
        not_a, not_b = a.negated(), b.negated()
        both = Term(f"{a.inside(AND)} and {b.inside(RELATION)}", AND)
        either = Term(f"{a.inside(OR)} or {b.inside(AND)}", OR)
        none = Term(f"{not_a.inside(AND)} and {not_b.inside(RELATION)}", AND)
        not_both = Term(f"{not_a.inside(OR)} or {not_b.inside(AND)}", OR)
        one, other = (both, not_both) if operation == ca.OP_AND else (either, none)
        joined = replace(one, opposite=(other.text, other.strength), events=True)
        return replace(joined, size=size)
    if operation == ca.OP_IF_ELSE_ZERO:
        condition = operands[0].as_truth()
        number = operands[1].as_number()
        opposite = (condition.opposite or ("", ATOM))[0]
        # The same condition and its negation are recognised by the alphabetically first of the two texts.
        negated = opposite < condition.text
        key = opposite if negated else condition.text
        text = f"if {condition.text} then {number.inside(OR)} else 0.0"
        return Term(text, CHOICE, events=True, size=size, choice=(key, negated, number.inside(OR)))
    numbers = [each.as_number() for each in operands]
    if operation in _RELATIONS:
        texts = [each.inside(SUM) for each in numbers]
        (yes, no), (strong, weak) = _RELATIONS[operation], _STRENGTHS[operation]
        return Term(yes.format(*texts), strong, (no.format(*texts), weak), events=True, size=size)
    if operation == ca.OP_ADD and (whole := _whole_choice(*numbers)):
        return Term(whole, CHOICE, events=True, size=size)
    if operation in _FUNCTIONS:
        return Term(
            f"{_FUNCTIONS[operation]}({', '.join(n.text for n in numbers)})", events=events, size=size
        )
    if operation not in _ARITHMETIC:
        raise ExportError(
            f"the function '{operation_name(operation)}' in the equations",
            "has no counterpart in Modelica",
            next_step="export an FMU, which Modelica tools import: nlsdesign export fmu",
        )
    text, strength = _ARITHMETIC[operation](*numbers)
    return Term(text, strength, events=events or operation in SERIES, size=size)


def _whole_choice(a: Term, b: Term) -> str | None:
    """Return one choice where two terms are its halves: CasADi adds what holds to what holds otherwise."""
    if a.choice is None or b.choice is None:
        return None
    (condition, first_negated, first), (other, second_negated, second) = a.choice, b.choice
    if condition != other or first_negated == second_negated:
        return None
    yes, no = (second, first) if first_negated else (first, second)
    return f"if {condition} then {yes} else {no}"
