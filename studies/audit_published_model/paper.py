"""What the paper prints, as numbers, symbols and equations.

Austin, Schepelmann, Geyer, IROS 2015. The equations (1), (3) and (4) stand here as the project's design notes
transcribe them; where a printed form is known by its consequences only (a sign, a missing factor) the audit
rebuilds it and tests the consequence.
"""

from __future__ import annotations

import numpy as np
import sympy as sp

from nlsdesign.foundation.arrays import Array

AREA, REST_LENGTH = 1e-4, 0.0125  # m², m
STIFFNESS_PER_MODULUS = AREA / REST_LENGTH  # a, m
BRANCH, VISCOSITY = 0.58e6, 411.0  # Pa, Pa·s
MODULI = np.array([0.92, 0.58, 0.74, 0.77, 0.47, 1.06]) * 1e6  # Pa
KNOTS = np.array([0.0, 0.20, 1.06, 2.65, 9.04, 9.05]) * 1e-3  # m
ELEMENTS, FORCE_SCALE = 2, 2.55
FIG6_CAPTION_FREQUENCY = 4.0  # Hz
TARGET_TORQUE, TARGET_ANGLE = 5.0, float(np.radians(53.0))  # N·m, rad; 2014
POWER_LAW = 4.35, 2.09  # factor in N·m and power of the torque over the angle in rad through Fig. 8
BEST_SHAPE = 3.62  # of the exponential of 2014 through Fig. 8
GEARED_CONSTANT, CURRENT_LIMIT = 0.220, 20.0  # N·m/A, A

F, F_M, F_STAR, DELTA, RATE, FORCE_RATE = sp.symbols("F F_M F* δ dδ/dt dF/dt", real=True)
ETA, K, A = sp.symbols("η k a", positive=True)
ENGAGED, OFF, OFFSET = sp.symbols("K K_off D", nonnegative=True)
"""Σ kᵢ*·H(δ−δᵢ); Σ kᵢ* of those not engaged; Σ kᵢ*·H(δ−δᵢ)·δᵢ."""
THETA, OMEGA, H, H_SLOPE, CURRENT = sp.symbols("θ ω h dh/dθ I", real=True)
INERTIA, GEAR, CONSTANT, N = sp.symbols("J n k_T N", positive=True)

STATIC_FORCE = A * (ENGAGED * DELTA - OFFSET)
"""F* between two knots, a·(K·δ − D)."""
BRANCH_FORCE_RATE = A * K * RATE - K / ETA * F_M
"""dF_M/dt of the spring k and the dashpot η in series."""
CORRECT_FORCE_RATE = A * (K + ENGAGED) * RATE + K / ETA * (STATIC_FORCE - F)
"""dF/dt of the network."""
STATED_FORCE = F_STAR + ETA / K * A * (K + ENGAGED) * RATE - ETA / K * FORCE_RATE
"""F as (1) has it."""
PRINTED_FORCE_RATE = A * (K + ENGAGED + OFF) * RATE + K / ETA * (A * (ENGAGED * DELTA + OFFSET) - F)
"""dF/dt as (3) with its matrices A, B and E has it: no Heaviside in B, the other sign in E."""


def static_force(extension: Array | float) -> Array:
    """Return F* of the printed law in N."""
    x = np.atleast_1d(np.asarray(extension, dtype=float))
    return STIFFNESS_PER_MODULUS * (MODULI @ np.clip(x[None, :] - KNOTS[:, None], 0.0, None))


def static_energy(extension: Array | float) -> Array:
    """Return the energy that the printed law stores, ∫F* dδ, in J."""
    x = np.atleast_1d(np.asarray(extension, dtype=float))
    return STIFFNESS_PER_MODULUS * (MODULI @ np.clip(x[None, :] - KNOTS[:, None], 0.0, None) ** 2) / 2


def engaged(extension: float) -> tuple[float, float]:
    """Return Σ k* and Σ k*·δᵢ over the moduli that are engaged at an extension; a knot itself counts."""
    on = extension >= KNOTS
    return float(MODULI[on].sum()), float((MODULI * KNOTS)[on].sum())
