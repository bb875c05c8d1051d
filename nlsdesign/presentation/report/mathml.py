"""Equations as MathML, which browsers typeset without a library, with full names.

Every text is escaped here (SymPy's printer does not escape), products carry a visible dot because names have
several letters, and a long sum is a row of formulas, so that its lines wrap.
"""

from __future__ import annotations

import re
from collections.abc import Iterator
from html import escape
from typing import Any

import sympy
from sympy.core.function import AppliedUndef

from ...model.symbolic_view import Equations
from .sections import Html

_INDEXED = re.compile(r"^(?P<name>.+)\[(?P<index>\d+)\]$")
_RELATIONS = {"==": "=", "!=": "≠", "<=": "≤", ">=": "≥"}
_FUNCTIONS = {"Max": "max", "Min": "min", "log": "ln", "sign": "sgn"}
_FENCES = {"Abs": ("|", "|"), "floor": ("⌊", "⌋"), "ceiling": ("⌈", "⌉")}


def equation_rows(equations: Equations) -> tuple[list[list[Html]], list[list[Html]]]:
    """Return the derivatives (or next states) and the definitions, in pieces between which they may break."""
    left = _next if equations.discrete else _derivative
    states = [_row(left(name), e) for name, e in equations.derivatives.items()]
    return states, [_row(_name(name), e) for name, e in equations.definitions.items()]


def formula(expression: Any) -> Html:
    """Return a SymPy expression as one ``math`` element.

    ``expression``: any SymPy expression; one without a layout here is printed as by SymPy.
    """
    return _math(_layout(expression))


def _row(left: str, right: Any) -> list[Html]:
    """Return an equation as pieces between which the line may break."""
    pieces = [f"{left}<mo form='infix'>=</mo>"]
    if isinstance(right, AppliedUndef):
        # f(a, b, …); of a row of numbers a[1], a[2], … the name alone.
        names = list(dict.fromkeys(_INDEXED.sub(r"\g<name>", str(argument)) for argument in right.args))
        inside = [f"<mi>{escape(name)}</mi><mo>,</mo>" for name in names]
        pieces.append(f"<mi>{escape(str(right.func))}</mi><mo>(</mo>{inside[0]}")
        pieces += [*inside[1:], "<mo>…</mo><mo>)</mo>"]
    else:
        for number, (sign, term) in enumerate(_terms(right)):
            pieces.append(_signed(sign, first=number == 0) + _layout(term))
    return [_math(piece) for piece in pieces]


def _signed(sign: str, *, first: bool) -> str:
    if first:
        return "<mo form='prefix'>−</mo>" if sign == "−" else ""
    return f"<mo form='infix'>{sign}</mo>"


def _math(inner: str) -> Html:
    return Html(f"<math displaystyle='true'><mrow>{inner}</mrow></math>")


def _terms(expression: Any) -> Iterator[tuple[str, Any]]:
    for term in expression.as_ordered_terms() if expression.is_Add else [expression]:
        negative = term.could_extract_minus_sign() and not term.is_Add
        yield ("−", -term) if negative else ("+", term)


def _layout(e: Any) -> str:
    if e.is_Symbol:
        return _name(e.name)
    if e.is_Number:
        return _number(e)
    if e.is_Add:
        parts = [_signed(sign, first=n == 0) + _layout(term) for n, (sign, term) in enumerate(_terms(e))]
        return _group("".join(parts))
    if e.is_Mul or (e.is_Pow and e.exp.could_extract_minus_sign()):
        return _product(e)
    if e.is_Pow:
        if e.exp == sympy.Rational(1, 2):
            return f"<msqrt>{_layout(e.base)}</msqrt>"
        base = _layout(e.base) if e.base.is_Symbol or e.base.is_Function else _bracketed(e.base)
        return f"<msup>{base}{_layout(e.exp)}</msup>"
    if isinstance(e, sympy.Piecewise):
        rows = "".join(
            f"<mtr><mtd>{_layout(value)}</mtd><mtd>{_condition(condition)}</mtd></mtr>"
            for value, condition in e.args
        )
        return _group(f"<mo>{{</mo><mtable>{rows}</mtable>")
    if e.is_Relational:
        relation = escape(_RELATIONS.get(e.rel_op, e.rel_op))
        return _group(f"{_layout(e.lhs)}<mo>{relation}</mo>{_layout(e.rhs)}")
    if e.is_Function or isinstance(e, sympy.Max | sympy.Min):
        return _function(e)
    return f"<mtext>{escape(str(e))}</mtext>"


def _name(name: str) -> str:
    indexed = _INDEXED.match(name)
    if indexed:
        return f"<msub><mi>{escape(indexed['name'])}</mi><mn>{indexed['index']}</mn></msub>"
    return f"<mi>{escape(name)}</mi>"


def _derivative(name: str) -> str:
    above = f"<mrow><mi>d</mi><mspace width='0.1em'/>{_name(name)}</mrow>"
    return f"<mfrac>{above}<mrow><mi>d</mi><mi>t</mi></mrow></mfrac>"


def _next(name: str) -> str:
    return f"<msup>{_name(name)}<mo>+</mo></msup>"


def _number(e: Any) -> str:
    if e.is_negative:
        return _group(f"<mo form='prefix'>−</mo>{_number(-e)}")
    if e.is_Rational and not e.is_Integer:
        return f"<mfrac><mn>{e.p}</mn><mn>{e.q}</mn></mfrac>"
    mantissa, _, exponent = f"{float(e):.6g}".partition("e")
    if not exponent:
        return f"<mn>{mantissa}</mn>" if mantissa != "inf" else "<mi>∞</mi>"
    raised = str(int(exponent)).replace("-", "−")
    return _group(f"<mn>{mantissa}</mn><mo>⋅</mo><msup><mn>10</mn><mn>{raised}</mn></msup>")


def _product(e: Any) -> str:
    if e.could_extract_minus_sign() and e.is_Mul:
        return _group(f"<mo form='prefix'>−</mo>{_layout(-e)}")
    above, below = sympy.fraction(e, exact=True)
    if below != 1:
        return f"<mfrac>{_layout(above)}{_layout(below)}</mfrac>"
    factors = above.as_ordered_factors() if above.is_Mul else [above]
    return _group("<mo>⋅</mo>".join(_bracketed(f) if f.is_Add else _layout(f) for f in factors))


def _function(e: Any) -> str:
    name = type(e).__name__ if not hasattr(e, "name") else str(e.name)
    arguments = "<mo>,</mo>".join(_layout(a) for a in sorted(e.args, key=str)) if isinstance(
        e, sympy.Max | sympy.Min) else "<mo>,</mo>".join(_layout(a) for a in e.args)  # fmt: skip
    if name in _FENCES:
        opening, closing = _FENCES[name]
        return _group(f"<mo>{opening}</mo>{arguments}<mo>{closing}</mo>")
    return _group(f"<mi>{escape(_FUNCTIONS.get(name, name))}</mi><mo>(</mo>{arguments}<mo>)</mo>")


def _condition(condition: Any) -> str:
    if condition in (True, sympy.true):
        return "<mtext>otherwise</mtext>"
    return f"<mtext>where&#160;</mtext>{_layout(condition)}"


def _bracketed(e: Any) -> str:
    return _group(f"<mo>(</mo>{_layout(e)}<mo>)</mo>")


def _group(inner: str) -> str:
    return f"<mrow>{inner}</mrow>"
