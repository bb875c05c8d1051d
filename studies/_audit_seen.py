"""The published form: what is seen of it, and what observer it allows."""

from __future__ import annotations

import math

import sympy as sp

from . import _audit_paper as p
from ._audit_finding import FAILS, HOLDS, NOTES, Finding, equal, step
from ._audit_state import observability

_A12 = p.K / p.ETA * p.A * p.ENGAGED


def published_matrices() -> tuple[sp.Matrix, sp.Matrix]:
    """Return A and C of x = (F, δ, θ, ω), u = (dδ/dt, I), y = (δ, θ); N elements share the torque."""
    a = sp.Matrix([
        [-p.K / p.ETA, _A12, 0, 0],
        [0, 0, 0, 0],
        [0, 0, 0, 1],
        [-p.N * p.H / p.INERTIA, 0, 0, 0],
    ])  # fmt: skip
    return a, sp.Matrix([[0, 1, 0, 0], [0, 0, 1, 0]])


def _at_zero() -> Finding:
    a, c = published_matrices()
    general, at_zero = observability(a, c).rank(), observability(a.subs(p.H, 0), c).rank()
    (direction,) = observability(a.subs(p.H, 0), c).nullspace()
    value = sp.simplify((a.subs(p.H, 0) * direction)[0] / direction[0])
    unseen = list(direction) == [1, 0, 0, 0] and value == -p.K / p.ETA
    return Finding(
        "4.1",
        NOTES,
        "Where sin β = 0 the unobservable state is F with eigenvalue −k/η, not θ (measured, eigenvalue 0)",
        HOLDS if unseen and (general, at_zero) == (4, 3) else FAILS,
        "A Kalman decomposition at θ = 0 has to take out F; it decays by itself, so nothing is lost with it.",
        (
            step(
                "A of the published form, C = (δ, θ):",
                equal(sp.Symbol("dF/dt"), (a * sp.Matrix([p.F, p.DELTA, p.THETA, p.OMEGA]))[0]),
            ),
            step(
                "Null vector of the observability matrix at h = 0, in (F, δ, θ, ω): " + str(list(direction))
            ),
            step("Its eigenvalue:", equal(sp.Symbol("λ"), value)),
        ),
        {
            "rank_of_the_published_form": (float(general), "1"),
            "rank_where_the_lever_arm_vanishes": (float(at_zero), "1"),
        },
    )


def _elements() -> Finding:
    return Finding(
        "5.1",
        NOTES,
        "Two elements share the torque; (4) has the factor missing",
        HOLDS,
        "With a cable through the centre both ends are stretched by the same δ whichever way the cam "
        "turns. The work of the torque is that of both; the number of elements that the figures ask for "
        "is item 9.2.",
        (
            step("Virtual work of N equal elements:", equal(sp.Symbol("τ"), p.N * p.H * p.F)),
            step("(4) as printed:", equal(sp.Symbol("τ"), p.H * p.F)),
        ),
    )


def _cascade() -> Finding:
    a, c = published_matrices()
    gain = sp.Matrix(4, 2, lambda i, j: sp.Symbol(f"L_{i + 1}{j + 1}"))
    error = (a - gain * c).subs({gain[0, 0]: _A12, gain[0, 1]: 0})
    alone = list(error.row(0)) == [-p.K / p.ETA, 0, 0, 0]
    names = sp.Matrix(sp.symbols("e_F e_δ e_θ e_ω"))
    return Finding(
        "A.1",
        NOTES,
        "With L11 = a12(θ), L12 = 0 the error obeys de_F/dt = −(k/η)·e_F, for every θ(t)",
        HOLDS if alone else FAILS,
        "θ is measured, so A(θ) is known and the error is linear with varying parameters; its force "
        "decouples and feeds a cascade that does not vary but for h.",
        (step("First row of (A − L·C)·e:", equal(sp.Symbol("de_F/dt"), (error * names)[0])),),
    )


def _euler() -> Finding:
    pole = -p.BRANCH / p.VISCOSITY
    exact, euler = math.exp(pole * 1e-3), 1.0 + pole * 1e-3
    return Finding(
        "A.2",
        NOTES,
        "At 1 kHz forward Euler turns the pole −1411 1/s into −0.41 per sample instead of +0.24",
        HOLDS if abs(pole + 1411) < 0.5 and abs(exact - 0.24) < 5e-3 and abs(euler + 0.41) < 5e-3 else FAILS,
        "A factor below zero makes the estimate ring from sample to sample.",
        (
            step(
                "Exact factor over a sample T:", equal(sp.Symbol("Φ"), sp.exp(-p.K * sp.Symbol("T") / p.ETA))
            ),
            step("Forward Euler:", equal(sp.Symbol("Φ_E"), 1 - p.K * sp.Symbol("T") / p.ETA)),
        ),
        {
            "relaxation_pole_per_s": (pole, "1/s"),
            "euler_factor_at_1_kHz": (euler, "1"),
            "exact_factor_at_1_kHz": (exact, "1"),
        },
    )


def findings() -> list[Finding]:
    """Return what is found here."""
    return [_at_zero(), _elements(), _cascade(), _euler()]
