"""The law of the rubber: its units, its derivation, the printed equations, the printed parameters."""

from __future__ import annotations

import numpy as np
import sympy as sp
from matplotlib.figure import Figure

import nlsdesign as nls
from nlsdesign.presentation.report import Section, TableSection

from .._published import element_loop
from . import paper as p
from .finding import FAILS, HOLDS, NOTES, OPEN, PAPER, Finding, equal, step

# --- units ----------------------------------------------------------------------------------------

KG, M, S, AMPERE = sp.symbols("kg m s A", positive=True)
NEWTON, PASCAL = KG * M / S**2, KG / (M * S**2)
# A radian is a number where a torque meets an arc: r·θ is a length.
UNITS: dict[sp.Symbol, sp.Expr] = {
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

EQUATIONS: dict[str, tuple[sp.Expr, sp.Expr]] = {
    "a": (p.A, sp.Symbol("A_0") / sp.Symbol("L_0")),
    "F*": (p.F_STAR, p.A * sp.Symbol("k⋆_i") * sp.Symbol("H_i") * (p.DELTA - sp.Symbol("δ_i"))),
    "(1)": (p.F, p.STATED_FORCE),
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

TRANSCRIBED = p.STATED_FORCE.subs(p.FORCE_RATE, sp.Symbol("d²F/dt²"))


def terms(expression: sp.Expr) -> list[sp.Expr]:
    """Return the terms of a sum, all products multiplied out."""
    expanded = sp.expand(expression)
    return list(expanded.args) if expanded.is_Add else [expanded]


def unit_of(term: sp.Expr) -> sp.Expr:
    """Return the unit of a term without sums, in kg, m, s, A; its number is dropped."""
    product = sp.powsimp(sp.sympify(term).subs(UNITS))
    number, unit = product.as_independent(KG, M, S, AMPERE)
    return unit if number else product


def rows() -> list[tuple[str, str, str, bool]]:
    """Return equation, term, unit and agreement with the left side, term by term."""
    result = []
    for name, (left, right) in EQUATIONS.items():
        wanted = unit_of(left)
        for term in terms(right):
            unit = unit_of(term)
            result.append((name, str(term), str(unit), bool(sp.simplify(unit / wanted - 1) == 0)))
    return result


def _dimensions() -> list[Finding]:
    checked = rows()
    wrong = [row for row in checked if not row[3]]
    wanted = unit_of(p.F)
    odd = [term for term in terms(TRANSCRIBED) if sp.simplify(unit_of(term) / wanted - 1) != 0]
    return [
        Finding(
            "0.4",
            PAPER,
            statement="Every term of (1), (3) and (4) has the unit of its equation",
            verdict=FAILS if wrong else HOLDS,
            why=f"{len(checked)} terms of {len(EQUATIONS)} equations, multiplied out; the errors of items 1, "
            "2 and 5 are of a kind that units do not reveal.",
            steps=tuple(step(f"{name}:", equal(left, right)) for name, (left, right) in EQUATIONS.items()),
            numbers={
                "terms_checked": (float(len(checked)), "1"),
                "terms_of_another_unit": (float(len(wrong)), "1"),
            },
        ),
        Finding(
            "0.2",
            NOTES,
            statement="A second derivative of F in (1) and (3) is an error of transcription",
            verdict=HOLDS if len(odd) == 1 else FAILS,
            why="The term would be a force per time where the others are forces; and a network with one "
            "dashpot has one state, so its force obeys an equation of first order (item 0.1).",
            steps=(
                step("Transcribed:", equal(p.F, TRANSCRIBED)),
                *(step("Unit of the odd term:", equal(term, unit_of(term))) for term in odd),
            ),
            numbers={"odd_terms_of_the_transcription": (float(len(odd)), "1")},
        ),
    ]


def unit_table() -> Section:
    """Return the table of all terms and their units."""
    shown = tuple((name, term, unit, "agrees" if same else "differs") for name, term, unit, same in rows())
    columns = ("equation", "term", "unit", "with the left side")
    return TableSection("Units, term by term", columns, shown, caption="Show every term", folded=True)


# --- what follows from the network ----------------------------------------------------------------

STATED_FORCES = {0.2: "1.5", 1.06: "11.8", 1.78: "24.7", 3.5: "60.8", 5.0: "97", 9.04: "194", 12.0: "302"}
"""mm: N, with the digits as stated."""


def derived_force_rate() -> sp.Expr:
    """Return dF/dt from the network itself: Newton's and Hooke's law in series, F* beside them."""
    slip = sp.Symbol("dz/dt", real=True)  # rate of the dashpot's extension
    branch_rate = p.A * p.K * (p.RATE - slip)
    relaxing = branch_rate.subs(slip, sp.solve(sp.Eq(p.F_M, p.A * p.ETA * slip), slip)[0])
    return sp.expand(p.A * p.ENGAGED * p.RATE + relaxing.subs(p.F_M, p.F - p.STATIC_FORCE))


def _network() -> Finding:
    derived = derived_force_rate()
    difference = sp.simplify(derived - p.CORRECT_FORCE_RATE)
    stated = sp.solve(sp.Eq(p.F, p.STATED_FORCE), p.FORCE_RATE)[0].subs(p.F_STAR, p.STATIC_FORCE)
    rest = sp.simplify(stated - derived)
    return Finding(
        "0.1",
        NOTES,
        statement="F = F* + (η/k)·a·(k + Σk*H)·dδ/dt − (η/k)·dF/dt follows from the network",
        verdict=HOLDS if difference == 0 and rest == 0 else FAILS,
        why="Eliminating the extension of the dashpot gives the stated law, term by term.",
        steps=(
            step(
                "Spring k and dashpot η in series carry one force:",
                equal(sp.Symbol("dF_M/dt"), p.BRANCH_FORCE_RATE),
            ),
            step(
                "F* is a chain of straight pieces, so between two knots:",
                equal(sp.Symbol("dF*/dt", real=True), p.A * p.ENGAGED * p.RATE),
            ),
            step("The sum F = F* + F_M has the rate", equal(p.FORCE_RATE, derived)),
            step("The stated law, solved for dF/dt, less this:", equal(sp.Symbol("difference"), rest)),
        ),
        numbers={"network_difference": (float(abs(rest)), "1")},
    )


def _forces() -> Finding:
    forces = {x: float(p.static_force(x * 1e-3)[0]) for x in STATED_FORCES}
    agrees = all(f"{forces[x]:.{len(f.partition('.')[2])}f}" == f for x, f in STATED_FORCES.items())
    return Finding(
        "0.3",
        NOTES,
        statement="F* at 0.2/1.06/1.78/3.5/5/9.04/12 mm is 1.5/11.8/24.7/60.8/97/194/302 N",
        verdict=HOLDS if agrees else FAILS,
        why="Each number is the printed law, rounded.",
        steps=(
            step("Between knots", equal(p.F_STAR, p.STATIC_FORCE)),
            step("Values in N: " + ", ".join(f"{forces[x]:.2f} at {x} mm" for x in STATED_FORCES)),
        ),
        numbers={
            "static_force_at_3.5_mm_N": (forces[3.5], "N"),
            "static_force_at_12_mm_N": (forces[12.0], "N"),
        },
    )


def _passive() -> Finding:
    stored = p.F_M**2 / (2 * p.A * p.K)
    lost = sp.simplify(p.F_M * p.RATE - sp.diff(stored, p.F_M) * p.BRANCH_FORCE_RATE)
    return Finding(
        "8.2",
        NOTES,
        statement="A passive spring cannot have ∮F dδ < 0; the printed law is one",
        verdict=HOLDS if sp.simplify(lost - p.F_M**2 / (p.A * p.ETA)) == 0 else FAILS,
        why="Whatever the motion, the power put in is the change of a stored energy plus a square: a cycle "
        "of this law cannot give energy back, whatever its parameters.",
        steps=(
            step("Energy of F* and of the branch:", equal(sp.Symbol("E"), sp.Symbol("U*") + stored)),
            step("Power put in less the change of E:", equal(p.F * p.RATE - sp.Symbol("dE/dt"), lost)),
        ),
    )


# --- the printed equations (1) and (3) ------------------------------------------------------------


def _heaviside() -> Finding:
    quasi_static = sp.expand(p.ETA / p.K * ((p.PRINTED_FORCE_RATE - p.CORRECT_FORCE_RATE).subs(p.OFFSET, 0)))
    true = p.STIFFNESS_PER_MODULUS * p.VISCOSITY
    idle = float(p.MODULI.sum() - p.engaged(0.0)[0])
    spurious = p.VISCOSITY / p.BRANCH * p.STIFFNESS_PER_MODULUS * idle
    return Finding(
        "1.1",
        NOTES,
        statement="(3) and B lack the Heaviside in Σk*: a spurious dashpot of up to 20.5 N·s/m, true 3.3",
        verdict=HOLDS if abs(spurious - 20.5) < 0.05 and abs(true - 3.3) < 0.05 else FAILS,
        why="The moduli that are not engaged yet act as dashpots, six times the true one at small extension.",
        steps=(
            step("Slow motion, F near F*: the branch is a dashpot of", equal(sp.Symbol("c"), p.A * p.ETA)),
            step("(3) without Heaviside less the law, times η/k:", equal(sp.Symbol("ΔF"), quasi_static)),
            step("Largest just above zero, where only k₁* is engaged."),
        ),
        numbers={
            "true_dashpot_N_s_per_m": (true, "N·s/m"),
            "spurious_dashpot_N_s_per_m": (spurious, "N·s/m"),
        },
        figures={"Dashpots": (_dashpot_figure(), "Slow motion, printed parameters.")},
    )


def _offset() -> Finding:
    rest = sp.solve(sp.Eq(p.PRINTED_FORCE_RATE.subs(p.RATE, 0), 0), p.F)[0]
    held = {}
    for x in (3.5e-3, 12e-3):
        numbers = dict(zip((p.ENGAGED, p.OFFSET), p.engaged(x), strict=True))
        held[x] = float(rest.subs(numbers | {p.A: p.STIFFNESS_PER_MODULUS, p.DELTA: x}))
    return Finding(
        "2.1",
        NOTES,
        statement="E has the wrong sign: the printed matrices hold 107.8 N at 3.5 mm and 570 N at 12 mm",
        verdict=HOLDS if abs(held[3.5e-3] - 107.8) < 0.05 and abs(held[12e-3] - 570.0) < 0.5 else FAILS,
        why="At rest the printed matrices hold F* with the offsets of the knots added instead of taken away.",
        steps=(
            step("Rest of (3) as printed, dδ/dt = 0:", equal(p.F, rest)),
            step(
                "Rest of the network:",
                equal(p.F, sp.solve(sp.Eq(p.CORRECT_FORCE_RATE.subs(p.RATE, 0), 0), p.F)[0]),
            ),
        ),
        numbers={
            "printed_rest_at_3.5_mm_N": (held[3.5e-3], "N"),
            "printed_rest_at_12_mm_N": (held[12e-3], "N"),
        },
        figures={"Static force": (_force_figure(), "What is held at rest, per element.")},
    )


def _dashpot_figure() -> Figure:
    x = np.linspace(0.0, 12e-3, 481)
    idle = p.MODULI.sum() - np.array([p.engaged(v)[0] for v in x])
    factor = p.VISCOSITY / p.BRANCH * p.STIFFNESS_PER_MODULUS
    true = np.full_like(x, p.VISCOSITY * p.STIFFNESS_PER_MODULUS)
    return nls.figures.curves(
        {"spurious, (3) as printed": (1e3 * x, factor * idle), "true": (1e3 * x, true)},
        across="extension in mm",
        up="dashpot in N·s/m",
        words="Dashpots over the extension: the spurious one falls from 20.5 to 0, the true is 3.3 N·s/m.",
    )


def _force_figure() -> Figure:
    x = np.linspace(0.0, 12e-3, 481)
    on = np.array([p.engaged(v) for v in x])
    printed = p.STIFFNESS_PER_MODULUS * (on[:, 0] * x + on[:, 1])
    return nls.figures.curves(
        {"F* of the law": (1e3 * x, p.static_force(x)), "printed matrices": (1e3 * x, printed)},
        across="extension in mm",
        up="force in N",
        words="Static force over the extension: the law to 302 N at 12 mm, the printed matrices to 570 N.",
    )


# --- the printed parameters -----------------------------------------------------------------------


def _labels() -> Finding:
    other = sp.symbols("k_s", positive=True)
    return Finding(
        "5.2",
        NOTES,
        statement="The labels of k1 and k2 differ between (1) and Fig. 5",
        verdict=OPEN,
        why="The drawing is not part of the data of this project. What (1) itself says is unambiguous: its "
        "relaxation time is the constant η/k, so its k is the spring in series with the dashpot.",
        steps=(
            step("Spring k in series with η, F* beside (as in (1)): relaxation time", p.ETA / p.K),
            step(
                "The other reading, a spring k_s in series with (F* beside η):", p.ETA / (other + p.ENGAGED)
            ),
            step("The second changes with the extension; (1) has no such thing."),
        ),
    )


def _knots() -> Finding:
    reached = max(float(element_loop(d, kind)[0].max()) for d in (25, 45) for kind in ("measured", "model"))
    sensitivity = sp.diff(p.A * sp.Symbol("k_5*") * sp.Max(p.DELTA - sp.Symbol("δ_5"), 0), sp.Symbol("k_5*"))
    needed = float(p.static_force(p.KNOTS[4])[0])
    return Finding(
        "6.1",
        NOTES,
        statement="k5* and k6* engage beyond any extension shown: not identifiable there",
        verdict=HOLDS if reached < p.KNOTS[4] else FAILS,
        why="The derivative of the force with respect to both is zero over the whole of Fig. 6, so no "
        "record like it can say anything about them; and they differ by 0.01 mm in where they engage.",
        steps=(
            step("Sensitivity of the force, zero below the knot:", equal(sp.Symbol("dF/dk_5*"), sensitivity)),
            step(
                f"Largest extension shown {1e3 * reached:.2f} mm, fifth knot {1e3 * p.KNOTS[4]:.2f} mm at "
                f"F* = {needed:.0f} N."
            ),
        ),
        numbers={
            "largest_extension_shown_mm": (1e3 * reached, "mm"),
            "fifth_knot_mm": (1e3 * p.KNOTS[4], "mm"),
        },
    )


def findings() -> list[Finding]:
    """Return the findings of this chapter."""
    return [*_dimensions(), _network(), _forces(), _passive(), _heaviside(), _offset(), _labels(), _knots()]
