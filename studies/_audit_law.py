"""The law of the rubber: what follows from the network."""

from __future__ import annotations

import sympy as sp

from . import _audit_paper as p
from ._audit_finding import FAILS, HOLDS, NOTES, Finding, equal, step

STATED_FORCES = {0.2: "1.5", 1.06: "11.8", 1.78: "24.7", 3.5: "60.8", 5.0: "97", 9.04: "194", 12.0: "302"}
"""mm: N, with the digits as stated."""


_SLOPE_OF_F_STAR = sp.Symbol("dF*/dt", real=True)


def derived_force_rate() -> sp.Expr:
    """Return dF/dt from the network itself: Newton's and Hooke's law in series, F* beside them."""
    slip = sp.Symbol("dz/dt", real=True)  # rate of the dashpot's extension
    branch_rate = p.A * p.K * (p.RATE - slip)
    relaxing = branch_rate.subs(slip, sp.solve(sp.Eq(p.F_M, p.A * p.ETA * slip), slip)[0])
    static = p.A * (p.ENGAGED * p.DELTA - p.OFFSET)
    return sp.expand(p.A * p.ENGAGED * p.RATE + relaxing.subs(p.F_M, p.F - static))


def _network() -> Finding:
    derived = derived_force_rate()
    difference = sp.simplify(derived - p.CORRECT_FORCE_RATE)
    stated = p.F_STAR + p.ETA / p.K * p.A * (p.K + p.ENGAGED) * p.RATE - p.ETA / p.K * p.FORCE_RATE
    from_it = sp.solve(sp.Eq(p.F, stated), p.FORCE_RATE)[0].subs(
        p.F_STAR, p.A * (p.ENGAGED * p.DELTA - p.OFFSET)
    )
    rest = sp.simplify(from_it - derived)
    return Finding(
        "0.1",
        NOTES,
        "F = F* + (η/k)·a·(k + Σk*H)·dδ/dt − (η/k)·dF/dt follows from the network",
        HOLDS if difference == 0 and rest == 0 else FAILS,
        "Eliminating the extension of the dashpot gives the stated law, term by term.",
        (
            step(
                "Spring k and dashpot η in series carry one force:",
                equal(sp.Symbol("dF_M/dt"), p.A * p.K * p.RATE - p.K / p.ETA * p.F_M),
            ),
            step(
                "F* is a chain of straight pieces, so between two knots:",
                equal(_SLOPE_OF_F_STAR, p.A * p.ENGAGED * p.RATE),
            ),
            step("The sum F = F* + F_M has the rate", equal(p.FORCE_RATE, derived)),
            step("The stated law, solved for dF/dt, less this:", equal(sp.Symbol("difference"), rest)),
        ),
        {"network_difference": (float(abs(rest)), "1")},
    )


def _forces() -> Finding:
    found = {x: float(p.static_force(x * 1e-3)[0]) for x in STATED_FORCES}
    agrees = all(f"{found[x]:.{len(f.partition('.')[2])}f}" == f for x, f in STATED_FORCES.items())
    return Finding(
        "0.3",
        NOTES,
        "F* at 0.2/1.06/1.78/3.5/5/9.04/12 mm is 1.5/11.8/24.7/60.8/97/194/302 N",
        HOLDS if agrees else FAILS,
        "Each number is the printed law, rounded.",
        (
            step("Between knots", equal(p.F_STAR, p.A * (p.ENGAGED * p.DELTA - p.OFFSET))),
            step("Values in N: " + ", ".join(f"{found[x]:.2f} at {x} mm" for x in STATED_FORCES)),
        ),
        {"static_force_at_3.5_mm_N": (found[3.5], "N"), "static_force_at_12_mm_N": (found[12.0], "N")},
    )


def _passive() -> Finding:
    stored = p.F_M**2 / (2 * p.A * p.K)
    branch_rate = p.A * p.K * p.RATE - p.K / p.ETA * p.F_M
    lost = sp.simplify(p.F_M * p.RATE - sp.diff(stored, p.F_M) * branch_rate)
    return Finding(
        "8.2",
        NOTES,
        "A passive spring cannot have ∮F dδ < 0; the printed law is one",
        HOLDS if sp.simplify(lost - p.F_M**2 / (p.A * p.ETA)) == 0 else FAILS,
        "Whatever the motion, the power put in is the change of a stored energy plus a square: a cycle "
        "of this law cannot give energy back, whatever its parameters.",
        (
            step("Energy of F* and of the branch:", equal(sp.Symbol("E"), sp.Symbol("U*") + stored)),
            step("Power put in less the change of E:", equal(p.F * p.RATE - sp.Symbol("dE/dt"), lost)),
        ),
    )


def findings() -> list[Finding]:
    """Return what is found here."""
    return [_network(), _forces(), _passive()]
