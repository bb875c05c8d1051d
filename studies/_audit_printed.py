"""The printed equations (1) and (3): what they have instead of the law."""

from __future__ import annotations

from typing import Any

import numpy as np
import sympy as sp

import nlsdesign as nls

from . import _audit_paper as p
from ._audit_finding import FAILS, HOLDS, NOTES, Finding, equal, step


def _heaviside() -> Finding:
    quasi_static = sp.expand(p.ETA / p.K * ((p.PRINTED_FORCE_RATE - p.CORRECT_FORCE_RATE).subs(p.OFFSET, 0)))
    true = p.STIFFNESS_PER_MODULUS * p.VISCOSITY
    idle = float(p.MODULI.sum() - p.engaged(0.0)[0])
    spurious = p.VISCOSITY / p.BRANCH * p.STIFFNESS_PER_MODULUS * idle
    return Finding(
        "1.1",
        NOTES,
        "(3) and B lack the Heaviside in Σk*: a spurious dashpot of up to 20.5 N·s/m, true 3.3",
        HOLDS if abs(spurious - 20.5) < 0.05 and abs(true - 3.3) < 0.05 else FAILS,
        "The moduli that are not engaged yet act as dashpots, six times the true one at small extension.",
        (
            step("Slow motion, F near F*: the branch is a dashpot of", equal(sp.Symbol("c"), p.A * p.ETA)),
            step("(3) without Heaviside less the law, times η/k:", equal(sp.Symbol("ΔF"), quasi_static)),
            step("Largest just above zero, where only k₁* is engaged."),
        ),
        {"true_dashpot_N_s_per_m": (true, "N·s/m"), "spurious_dashpot_N_s_per_m": (spurious, "N·s/m")},
        {"Dashpots": (_dashpot_figure(), "Slow motion, printed parameters.")},
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
        "E has the wrong sign: the printed matrices hold 107.8 N at 3.5 mm and 570 N at 12 mm",
        HOLDS if abs(held[3.5e-3] - 107.8) < 0.05 and abs(held[12e-3] - 570.0) < 0.5 else FAILS,
        "At rest the printed matrices hold F* with the offsets of the knots added instead of taken away.",
        (
            step("Rest of (3) as printed, dδ/dt = 0:", equal(p.F, rest)),
            step(
                "Rest of the network:",
                equal(p.F, sp.solve(sp.Eq(p.CORRECT_FORCE_RATE.subs(p.RATE, 0), 0), p.F)[0]),
            ),
        ),
        {"printed_rest_at_3.5_mm_N": (held[3.5e-3], "N"), "printed_rest_at_12_mm_N": (held[12e-3], "N")},
        {"Static force": (_force_figure(), "What is held at rest, per element.")},
    )


def _dashpot_figure() -> Any:
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


def _force_figure() -> Any:
    x = np.linspace(0.0, 12e-3, 481)
    on = np.array([p.engaged(v) for v in x])
    printed = p.STIFFNESS_PER_MODULUS * (on[:, 0] * x + on[:, 1])
    return nls.figures.curves(
        {"F* of the law": (1e3 * x, p.static_force(x)), "printed matrices": (1e3 * x, printed)},
        across="extension in mm",
        up="force in N",
        words="Static force over the extension: the law to 302 N at 12 mm, the printed matrices to 570 N.",
    )


def findings() -> list[Finding]:
    """Return what is found here."""
    return [_heaviside(), _offset()]
