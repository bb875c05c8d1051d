"""The cam: what follows from virtual work and energy alone."""

from __future__ import annotations

import sympy as sp

from . import _audit_paper as p
from ._audit_finding import FAILS, HOLDS, NOTES, Finding, equal, step

_TORQUE, _TORQUE_SLOPE, _SLOPE = sp.symbols("τ dτ/dθ K_t", real=True)


def _torque_slope() -> sp.Expr:
    """Return dτ/dθ of τ = N·h·F(δ(θ)) by the chain rule, with dδ/dθ = h."""
    torque = p.N * p.H * p.F
    return sp.expand(sp.diff(torque, p.H) * p.H_SLOPE + sp.diff(torque, p.F) * _SLOPE * p.H)


def _zero_stiffness() -> Finding:
    slope = _torque_slope()
    at_zero = slope.subs({p.F: 0})
    jump = sp.solve(sp.Eq(_TORQUE_SLOPE, at_zero), p.H)
    agrees = sp.simplify(at_zero - p.N * p.H**2 * _SLOPE) == 0
    return Finding(
        "B.1",
        NOTES,
        "No pretension: zero stiffness at θ = 0, or h(0+) must jump by √(τ'(0)/(N·K0))",
        HOLDS if agrees and slope.subs({p.F: 0, p.H: 0}) == 0 else FAILS,
        "With the cable through the centre h(0) = 0, and both terms of the stiffness vanish.",
        (
            step("Slope of τ = N·h·F(δ(θ)), K_t = dF/dδ:", equal(_TORQUE_SLOPE, slope)),
            step("Without pretension F(0) = 0:", equal(_TORQUE_SLOPE, at_zero)),
            step("solved for the lever arm:", equal(p.H, jump[-1])),
        ),
    )


def _pretension() -> Finding:
    slope = _torque_slope().subs(p.H, 0)
    return Finding(
        "B.2",
        NOTES,
        "A finite slope at zero needs pretension: τ'(0) = N·F0·h'(0)",
        HOLDS if sp.simplify(slope - p.N * p.F * p.H_SLOPE) == 0 else FAILS,
        "The second term of the slope is what is left at h = 0.",
        (step("Slope at h = 0, F = F0:", equal(_TORQUE_SLOPE, slope)),),
    )


def _knots() -> Finding:
    h_slope = sp.solve(sp.Eq(_TORQUE_SLOPE, _torque_slope()), p.H_SLOPE)[0]
    jump = sp.expand(sp.diff(h_slope, _SLOPE)) * sp.Symbol("ΔK")
    return Finding(
        "B.3",
        NOTES,
        "A piecewise-linear law gives a cam radius of curvature of −∞ at each knot",
        HOLDS if sp.simplify(jump + p.H**2 / p.F * sp.Symbol("ΔK")) == 0 else FAILS,
        "Where the slope of the rubber jumps up by ΔK, that of the lever arm jumps down; its "
        "derivative, and with it ρ = h + h'' (far anchor), is a negative pulse without bound.",
        (
            step("From the slope of the torque:", equal(p.H_SLOPE, h_slope)),
            step("Jump at a knot, with h > 0 and F > 0:", equal(sp.Symbol("Δh'"), jump)),
        ),
    )


def findings() -> list[Finding]:
    """Return what is found here."""
    return [_zero_stiffness(), _pretension(), _knots()]
