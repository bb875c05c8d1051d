"""Dimensional audit: every term of every printed equation, with the units carried symbolically."""

from __future__ import annotations

from typing import Any

import sympy as sp

import nlsdesign as nls

from . import _audit_paper as p
from ._audit_finding import FAILS, HOLDS, NOTES, PAPER, Finding, equal, step

KG, M, S, AMPERE, RAD = sp.symbols("kg m s A rad", positive=True)
NEWTON, PASCAL = KG * M / S**2, KG / (M * S**2)
# A radian is a number where a torque meets an arc: r·θ is a length.
UNITS: dict[Any, Any] = {
    p.F: NEWTON, p.F_M: NEWTON, p.F_STAR: NEWTON, p.DELTA: M, p.RATE: M / S, p.FORCE_RATE: NEWTON / S,
    p.ETA: PASCAL * S, p.K: PASCAL, p.A: M, p.ENGAGED: PASCAL, p.OFF: PASCAL, p.OFFSET: PASCAL * M,
    p.THETA: 1, p.OMEGA: 1 / S, p.H: M, p.CURRENT: AMPERE, p.INERTIA: KG * M**2, p.GEAR: 1,
    p.CONSTANT: NEWTON * M / AMPERE, p.N: 1,
    sp.Symbol("A_0"): M**2, sp.Symbol("L_0"): M, sp.Symbol("r"): M, sp.Symbol("sin β"): 1,
    sp.Symbol("dω/dt"): 1 / S**2, sp.Symbol("dδ/dθ"): M, sp.Symbol("τ"): NEWTON * M,
    sp.Symbol("δ_i"): M, sp.Symbol("k⋆_i"): PASCAL, sp.Symbol("H_i"): 1, sp.Symbol("dθ/dt"): 1 / S,
    sp.Symbol("d²F/dt²"): NEWTON / S**2,
}  # fmt: skip

_R, _SIN, _TAU = sp.Symbol("r"), sp.Symbol("sin β"), sp.Symbol("τ")

EQUATIONS: dict[str, tuple[Any, Any]] = {
    "a": (p.A, sp.Symbol("A_0") / sp.Symbol("L_0")),
    "F*": (p.F_STAR, p.A * sp.Symbol("k⋆_i") * sp.Symbol("H_i") * (p.DELTA - sp.Symbol("δ_i"))),
    "(1)": (p.F, p.F_STAR + p.ETA / p.K * p.A * (p.K + p.ENGAGED) * p.RATE - p.ETA / p.K * p.FORCE_RATE),
    "(3), row F": (p.FORCE_RATE, p.PRINTED_FORCE_RATE),
    "(3), row δ": (p.RATE, p.RATE),
    "(3), row θ": (sp.Symbol("dθ/dt"), p.OMEGA),
    "(3), row ω": (
        sp.Symbol("dω/dt"),
        p.GEAR * p.CONSTANT / p.INERTIA * p.CURRENT - _R * _SIN * p.F / p.INERTIA,
    ),
    "(4)": (_TAU, _R * _SIN * p.F),
    "lever arm": (sp.Symbol("dδ/dθ"), _R * _SIN),
}  # fmt: skip
"""Left and right side of each equation that the audit handles, by its number in the paper."""

TRANSCRIBED = p.F_STAR + p.ETA / p.K * p.A * (p.K + p.ENGAGED) * p.RATE - p.ETA / p.K * sp.Symbol("d²F/dt²")


def terms(expression: Any) -> list[Any]:
    """Return the terms of a sum, all products multiplied out."""
    expanded = sp.expand(expression)
    return list(expanded.args) if expanded.is_Add else [expanded]


def unit_of(term: Any) -> Any:
    """Return the unit of a term without sums, in kg, m, s, A; its number is dropped."""
    found = sp.powsimp(sp.sympify(term).subs(UNITS))
    number, unit = found.as_independent(KG, M, S, AMPERE)
    return unit if number else found


def rows() -> list[tuple[str, str, str, bool]]:
    """Return equation, term, unit and agreement with the left side, term by term."""
    result = []
    for name, (left, right) in EQUATIONS.items():
        wanted = unit_of(left)
        for term in terms(right):
            found = unit_of(term)
            result.append((name, str(term), str(found), bool(sp.simplify(found / wanted - 1) == 0)))
    return result


def findings() -> list[Finding]:
    """Return the dimensional audit of the equations, and that of the transcription with d²F/dt²."""
    checked = rows()
    wrong = [row for row in checked if not row[3]]
    wanted = unit_of(p.F)
    odd = [term for term in terms(TRANSCRIBED) if sp.simplify(unit_of(term) / wanted - 1) != 0]
    return [
        Finding(
            "0.4",
            PAPER,
            "Every term of (1), (3) and (4) has the unit of its equation",
            FAILS if wrong else HOLDS,
            f"{len(checked)} terms of {len(EQUATIONS)} equations, multiplied out; the errors of items 1, "
            "2 and 5 are of a kind that units cannot show.",
            tuple(step(f"{name}:", equal(left, right)) for name, (left, right) in EQUATIONS.items()),
            {"terms_checked": (float(len(checked)), "1"), "terms_of_another_unit": (float(len(wrong)), "1")},
        ),
        Finding(
            "0.2",
            NOTES,
            "A second derivative of F in (1) and (3) is an error of transcription",
            HOLDS if len(odd) == 1 else FAILS,
            "The term would be a force per time where the others are forces; and a network with one "
            "dashpot has one state, so its force obeys an equation of first order (item 0.1).",
            (
                step("Transcribed:", equal(p.F, TRANSCRIBED)),
                *(step("Unit of the odd term:", equal(term, unit_of(term))) for term in odd),
            ),
            {"odd_terms_of_the_transcription": (float(len(odd)), "1")},
        ),
    ]


def unit_table() -> nls.report.Section:
    """Return the table of all terms and their units."""
    shown = tuple((name, term, unit, "agrees" if same else "differs") for name, term, unit, same in rows())
    columns = ("equation", "term", "unit", "with the left side")
    return nls.report.TableSection(
        "Units, term by term", columns, shown, caption="Show every term", folded=True
    )
