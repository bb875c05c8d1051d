"""The published state: what is redundant in it."""

from __future__ import annotations

import sympy as sp

from . import _audit_paper as p
from ._audit_finding import FAILS, HOLDS, NOTES, Finding, equal, step


def observability(a: sp.Matrix, c: sp.Matrix) -> sp.Matrix:
    """Return the observability matrix [C; CA; CA²; …]."""
    return sp.Matrix.vstack(*[c * a**power for power in range(a.rows)])


def _virtual_work() -> Finding:
    angle, run, r, beta = sp.symbols("θ ds/dθ r β", real=True)
    cx, cy, tx, ty = sp.symbols("c_x c_y t_x t_y", real=True)
    turn = sp.Matrix([[sp.cos(angle), -sp.sin(angle)], [sp.sin(angle), sp.cos(angle)]])
    tangent = turn * sp.Matrix([tx, ty])
    # The contact point turns with the cam and wanders along it; the cable leaves along the tangent.
    motion = turn.diff(angle) * sp.Matrix([cx, cy]) + tangent * run
    free = sp.simplify(-(tangent.T * motion)[0])
    whole = sp.simplify((free + run).subs(tx, sp.sqrt(1 - ty**2)))
    moment = sp.simplify((cx * ty - cy * tx).subs(tx, sp.sqrt(1 - ty**2)))
    rest = sp.simplify(whole + moment)
    return Finding(
        "3.1",
        NOTES,
        "dδ/dθ = r sin β by virtual work, for an inextensible cable: one function, not two tables",
        HOLDS if rest == 0 and run not in whole.free_symbols else FAILS,
        "The wandering of the contact point drops out because the cable leaves along the tangent; what "
        "is left is the moment of the cable about the centre. A table for δ and another for r sin β can "
        "only disagree.",
        (
            step(
                "Contact point c on the cam, unit tangent t there, s the arc. The free cable changes by",
                equal(sp.Symbol("dℓ/dθ"), free),
            ),
            step("With the arc that is wound, and t a unit vector:", equal(sp.Symbol("d(ℓ + s)/dθ"), whole)),
            step("Moment of a unit force along the cable:", equal(r * sp.sin(beta), cx * ty - cy * tx)),
            step("Sum of the last two, with the same t:", equal(sp.Symbol("remainder"), rest)),
        ),
        {"virtual_work_remainder": (float(abs(rest)), "1")},
    )


def _redundant() -> Finding:
    slope = sp.Symbol("dδ/dθ", real=True)
    drift = p.RATE - slope * p.OMEGA
    rest = drift.subs({p.RATE: p.H * p.OMEGA, slope: p.H})
    return Finding(
        "3.2",
        NOTES,
        "δ is computed from θ, so the state (F, δ, θ, ω) is redundant",
        HOLDS if sp.simplify(rest) == 0 else FAILS,
        "The constraint δ = δ(θ) is kept by the equations themselves; four numbers describe three degrees of "
        "freedom, and an observer that corrects δ and θ apart leaves the constraint.",
        (
            step("Rate of δ − δ(θ):", equal(sp.Symbol("d(δ − δ(θ))/dt"), drift)),
            step("With dδ/dt = h·ω and h = dδ/dθ:", equal(sp.Symbol("remainder"), rest)),
        ),
    )


def _minimal() -> Finding:
    a = sp.Matrix([
        [-p.K / p.ETA, p.A * p.K * p.H_SLOPE * p.OMEGA, p.A * p.K * p.H],
        [0, 0, 1],
        [-p.N * p.H / p.INERTIA, -p.N * sp.Symbol("κ") / p.INERTIA, 0],
    ])  # fmt: skip
    determinant = sp.factor(observability(a, sp.Matrix([[0, 1, 0]])).det())
    one = determinant.subs(p.N, 1)
    return Finding(
        "3.3",
        NOTES,
        "(F_M, θ, ω) is minimal; its observability determinant is −h/J",
        HOLDS if sp.simplify(one + p.H / p.INERTIA) == 0 else FAILS,
        "So it is for the force that acts at the lever arm; counted per element it is −N·h/J with N = 2.",
        (
            step("Rows θ, dθ/dt, d²θ/dt² in (F_M, θ, ω):", equal(sp.Symbol("det O"), determinant)),
            step("It vanishes with h alone: at angles where sin β = 0."),
        ),
    )


def _hidden_coupling() -> Finding:
    coupled = sp.diff(p.CORRECT_FORCE_RATE.subs(p.RATE, p.H * p.OMEGA), p.OMEGA)
    return Finding(
        "3.4",
        NOTES,
        "The coupling A14 = a·(k + ΣHk*)·dδ/dθ hides in the input dδ/dt",
        HOLDS if sp.simplify(coupled - p.A * (p.K + p.ENGAGED) * p.H) == 0 else FAILS,
        "dδ/dt is no input: it is h·ω, and ω is a state.",
        (step("Derivative of dF/dt by ω with dδ/dt = h·ω:", equal(sp.Symbol("A_14"), coupled)),),
    )


def findings() -> list[Finding]:
    """Return what is found here."""
    return [_virtual_work(), _redundant(), _minimal(), _hidden_coupling()]
