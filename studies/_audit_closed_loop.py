"""Closed loop: what the gains of Fig. 9 mean, and how stiff the spring is where it fails."""

from __future__ import annotations

import math

import sympy as sp

from . import _audit_paper as p
from ._audit_finding import FAILS, HOLDS, NOTES, OPEN, Finding, equal, step

AMPLITUDE = math.radians(10.0)


# Fig. 9, N·m rms at 0.5, 1 and 2 Hz: the two linear springs.
FIG9_LINEAR = {0.5: (0.00994, 0.01160), 1.0: (0.02304, 0.02396), 2.0: (0.04830, 0.04971)}


def _below_crossover() -> Finding:
    gain, stiffness = sp.symbols("K_p k_s", positive=True)
    s, load = sp.symbols("s θ_a")
    # Velocity command K_p·τ against the load's motion: τ = k_s·(θ_a − ∫K_p·τ dt).
    torque = sp.Symbol("τ")
    solved = sp.solve(sp.Eq(torque, stiffness * (load - gain * torque / s)), torque)[0]
    slow = sp.limit(solved / s, s, 0)
    found = {f: AMPLITUDE * 2 * math.pi * f / (math.sqrt(2) * 32.0) for f in FIG9_LINEAR}
    agree = all(min(abs(found[f] / v - 1) for v in FIG9_LINEAR[f]) < 0.08 for f in FIG9_LINEAR)
    free = stiffness not in slow.free_symbols
    return Finding(
        "C.4",
        NOTES,
        "Below crossover zero-torque RMS ≈ θ_a·ω/(√2·Kp), whatever the spring; Kp = 32 meets Fig. 9",
        HOLDS if agree and free else FAILS,
        "The stiffness drops out of the slow limit: the gain, not the spring, sets what Fig. 9 shows "
        "there. The amplitude of ±10° is assumed; only its ratio to Kp is tested.",
        (
            step("Spring k_s, motor driven by velocity K_p·τ, load moved by θ_a:", equal(torque, solved)),
            step("Slow limit of τ/s:", equal(sp.Symbol("lim τ/s"), slow)),
            step(
                "In N·m rms: "
                + ", ".join(
                    f"{v:.4f} at {f:g} Hz (Fig. 9: {FIG9_LINEAR[f][0]:.4f}, {FIG9_LINEAR[f][1]:.4f})"
                    for f, v in found.items()
                )
            ),
        ),
        {f"zero_torque_at_{f:g}_Hz_mNm": (1e3 * v, "mN·m") for f, v in found.items()},
    )


def _stiffening() -> Finding:
    angle = (2.8 / 4.35) ** (1 / 2.09)
    slopes = {"power law of Fig. 8": 2.09 * 2.8 / angle}
    for c in (1.0, 3.62):
        scale = p.TARGET_TORQUE / math.expm1(c * p.TARGET_ANGLE)
        slopes[f"exponential, c = {c:g}"] = c * (2.8 + scale)
    change = 20 * math.log10(18.0 / 5.7)
    low, high = min(slopes.values()), max(slopes.values())
    return Finding(
        "C.5",
        NOTES,
        "At 2.8 N·m the tangent stiffness is 5.7 to 18 N·m/rad, not 3.4; gain margin +4.9 → −5.2 dB",
        OPEN,
        "All laws that the figures allow lie above 3.4 and inside the stated range, but its upper end "
        "is not reached by any of them at rest. The fall of the margin is just the ratio of the two "
        "ends, so it stands or falls with them.",
        (
            step("At 2.8 N·m in N·m/rad: " + ", ".join(f"{v:.1f} ({n})" for n, v in slopes.items())),
            step(f"Ratio of the ends in dB: {change:.1f}; stated: 10.1."),
        ),
        {"smallest_stiffness_at_2.8_Nm": (low, "N·m/rad"), "largest_stiffness_at_2.8_Nm": (high, "N·m/rad")},
    )


def findings() -> list[Finding]:
    """Return what is found here."""
    return [_below_crossover(), _stiffening()]
