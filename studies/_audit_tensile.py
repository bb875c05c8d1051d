"""The tensile curve of 2014, and the cam that was designed on it."""

from __future__ import annotations

import numpy as np
import sympy as sp

from . import _audit_paper as p
from ._audit_finding import FAILS, HOLDS, NOTES, Finding, equal, step

# Average tensile curve of PMC-770, Schepelmann, Geberth, Geyer, ICRA 2014, Fig. 3: stretch, force in N.
TENSILE = np.array([
    (1.0206, 11.4), (1.0552, 21.7), (1.1012, 33.0), (1.1473, 42.2), (1.1934, 51.5), (1.2971, 68.9),
    (1.4123, 85.9), (1.4930, 96.2), (1.6082, 110.6), (1.8156, 134.2), (2.0229, 156.8), (2.2303, 176.9),
    (2.4032, 189.2), (2.5990, 203.6), (2.7949, 213.9), (3.0023, 222.1),
])  # fmt: skip


def _design_2014() -> Finding:
    stretch = np.linspace(1.0, 3.0, 20_001)
    shape = TENSILE[:, 0] - TENSILE[:, 0] ** -2
    strength = float(shape @ TENSILE[:, 1] / (shape @ shape))
    force = strength * (stretch - stretch**-2)
    stored = p.ELEMENTS * strength * p.REST_LENGTH * (stretch**2 / 2 + 1 / stretch - 1.5)
    end = p.TARGET_ANGLE
    work = p.TARGET_TORQUE / np.expm1(end) * (np.expm1(end) - end)
    at = float(np.interp(work, stored, stretch))
    pull = float(np.interp(at, stretch, force))
    arm, delta = 1e3 * p.TARGET_TORQUE / (p.ELEMENTS * pull), 1e3 * p.REST_LENGTH * (at - 1)
    near = max(abs(arm / 17.42 - 1), abs(pull / 144 - 1), abs(delta / 11.98 - 1))
    x = sp.Symbol("λ", positive=True)
    return Finding(
        "B.7",
        NOTES,
        "2014 law, N = 2, c = 1: h(53°) = 17.42 mm, F = 144 N, δ = 11.98 mm (printed 17 mm, 147 N)",
        HOLDS if near < 0.01 else FAILS,
        "From the published tensile curve read as neo-Hookean; within 1 %, which is what the end of the "
        "fit does.",
        (
            step(
                "Energy of two elements, f the fitted strength:",
                equal(
                    sp.Symbol("E"),
                    p.N * sp.Symbol("f") * sp.Symbol("L_0") * (x**2 / 2 + 1 / x - sp.Rational(3, 2)),
                ),
            ),
            step(f"equals the work of the target, {work:.4f} J, at the stretch {at:.4f}; then h = τ/(N·F)."),
        ),
        {"lever_arm_2014_mm": (arm, "mm"), "force_2014_N": (pull, "N"), "extension_2014_mm": (delta, "mm")},
    )


def _concave() -> Finding:
    at = np.array([3.5e-3, 12e-3])
    old = np.interp(1 + at / p.REST_LENGTH, TENSILE[:, 0], TENSILE[:, 1])
    new = p.static_force(at)
    concave = old[1] / old[0] < at[1] / at[0] < new[1] / new[0]
    return Finding(
        "B.8",
        NOTES,
        "The 2014 tensile curve is concave (66 and 150 N at 3.5 and 12 mm), F* of 2015 convex (61, 302 N)",
        HOLDS if concave and abs(old[0] - 66) < 1.5 and abs(old[1] - 150) < 5 else FAILS,
        "The same rubber cannot do both; a stiffening that starts at small extension looks like slack "
        "being taken up.",
        (
            step(
                "Forces at 3.5 and 12 mm in N: 2014 "
                + ", ".join(f"{v:.1f}" for v in old)
                + "; 2015 "
                + ", ".join(f"{v:.1f}" for v in new)
            ),
        ),
        {"tensile_2014_at_3.5_mm_N": (float(old[0]), "N"), "tensile_2014_at_12_mm_N": (float(old[1]), "N")},
    )


def findings() -> list[Finding]:
    """Return what is found here."""
    return [_design_2014(), _concave()]
