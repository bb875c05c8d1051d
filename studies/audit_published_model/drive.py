"""Drivetrain and closed loop: inertia, encoder, the gains of Fig. 9, stiffness and gain margin."""

from __future__ import annotations

import math

import sympy as sp
from scipy.integrate import solve_ivp

from nlsdesign.foundation.arrays import Array

from . import paper as p
from .finding import FAILS, HOLDS, NOTES, OPEN, PAPER, Finding, equal, step

RISE_TIMES = (16.0e-3, 18.3e-3)  # s, printed 2014
PRINTED_INERTIA, NOTED_INERTIA = 8.83e-5, 5.97e-4  # kg·m²


def rise_time(inertia: float, load: str) -> float:
    """Return the time in s from rest to 53° at full current."""
    torque = p.GEARED_CONSTANT * p.CURRENT_LIMIT

    def against(angle: float) -> float:
        if load == "none":
            return 0.0
        share = angle / p.TARGET_ANGLE
        return p.TARGET_TORQUE * (share if load == "line" else math.expm1(angle) / math.expm1(p.TARGET_ANGLE))

    def arrival(_: float, x: Array) -> float:
        return float(x[0] - p.TARGET_ANGLE)

    arrival.terminal = True  # type: ignore[attr-defined]
    run = solve_ivp(
        lambda _, x: [x[1], (torque - against(x[0])) / inertia],
        (0.0, 0.2),
        [0.0, 0.0],
        events=arrival,
        rtol=1e-8,
    )
    return float(run.t_events[0][0])


def _inertia() -> list[Finding]:
    loads = ("none", "target", "line")
    printed = {load: rise_time(PRINTED_INERTIA, load) for load in loads}
    # The time is proportional to the square root of the inertia.
    implied = {(load, t): PRINTED_INERTIA * (t / printed[load]) ** 2 for load in loads for t in RISE_TIMES}
    t, j, angle = sp.symbols("t J θ_m", positive=True)
    steps = (
        step("Full torque from rest, unloaded:", equal(t, sp.sqrt(2 * j * angle / sp.Symbol("n·k_T·I")))),
        step("With 8.83e-5 kg·m²: " + ", ".join(f"{1e3 * v:.1f} ms against {n}" for n, v in printed.items())),
        step(
            "Inertia for 16 and 18.3 ms in 1e-4 kg·m²: "
            + ", ".join(f"{1e4 * v:.2f}" for v in implied.values())
        ),
    )
    return [
        Finding(
            "C.1",
            PAPER,
            statement="J = 8.83e-5 kg·m² (2014) goes with rise times of 16 and 18.3 ms",
            verdict=FAILS if max(printed.values()) < 0.6 * min(RISE_TIMES) else HOLDS,
            why="With that inertia and 4.4 N·m the drive takes 6 to 7 ms, whatever it works against.",
            steps=steps,
            numbers={"rise_time_with_printed_inertia_ms": (1e3 * max(printed.values()), "ms")},
        ),
        Finding(
            "C.2",
            NOTES,
            statement="The rise times give J = 5.97e-4 kg·m² with n·kT = 0.220 N·m/A and 20 A",
            verdict=OPEN,
            why="5.97e-4 lies inside what 16 and 18.3 ms allow; unloaded it takes 15.8 ms. What the times "
            "were measured against, and to which angle, is not in the notes: any inertia from 4.7e-4 to "
            "8.0e-4 is possible.",
            steps=steps,
            numbers={
                "smallest_inertia_from_rise_times_kg_m2": (min(implied.values()), "kg·m²"),
                "largest_inertia_from_rise_times_kg_m2": (max(implied.values()), "kg·m²"),
                "unloaded_rise_time_ms": (1e3 * rise_time(NOTED_INERTIA, "none"), "ms"),
            },
        ),
    ]


def _encoder() -> Finding:
    count = 2e3 * math.pi / 2**13
    return Finding(
        "C.3",
        NOTES,
        statement="Encoders of 13 bit count 0.767 mrad",
        verdict=HOLDS if abs(count - 0.767) < 5e-4 else FAILS,
        why="One turn over 8192 counts.",
        steps=(step("In mrad:", equal(sp.Symbol("q"), 2000 * sp.pi / 8192)),),
        numbers={"encoder_count_mrad": (count, "mrad")},
    )


# --- closed loop ----------------------------------------------------------------------------------

AMPLITUDE = math.radians(10.0)  # rad; assumed
# Fig. 9, N·m rms at 0.5, 1 and 2 Hz: the two linear springs.
FIG9_LINEAR = {0.5: (0.00994, 0.01160), 1.0: (0.02304, 0.02396), 2.0: (0.04830, 0.04971)}


def _below_crossover() -> Finding:
    gain, stiffness = sp.symbols("K_p k_s", positive=True)
    s, load = sp.symbols("s θ_a")
    # Velocity command K_p·τ against the load's motion: τ = k_s·(θ_a − ∫K_p·τ dt).
    torque = sp.Symbol("τ")
    solved = sp.solve(sp.Eq(torque, stiffness * (load - gain * torque / s)), torque)[0]
    slow = sp.limit(solved / s, s, 0)
    torques = {f: AMPLITUDE * 2 * math.pi * f / (math.sqrt(2) * 32.0) for f in FIG9_LINEAR}
    agree = all(min(abs(torques[f] / v - 1) for v in FIG9_LINEAR[f]) < 0.08 for f in FIG9_LINEAR)
    free = stiffness not in slow.free_symbols
    return Finding(
        "C.4",
        NOTES,
        statement="Below crossover zero-torque RMS ≈ θ_a·ω/(√2·Kp), whatever the spring; "
        "Kp = 32 meets Fig. 9",
        verdict=HOLDS if agree and free else FAILS,
        why="The stiffness drops out of the slow limit: the gain, not the spring, sets what Fig. 9 shows "
        "there. The amplitude of ±10° is assumed; only its ratio to Kp is tested.",
        steps=(
            step("Spring k_s, motor driven by velocity K_p·τ, load moved by θ_a:", equal(torque, solved)),
            step("Slow limit of τ/s:", equal(sp.Symbol("lim τ/s"), slow)),
            step(
                "In N·m rms: "
                + ", ".join(
                    f"{v:.4f} at {f:g} Hz (Fig. 9: {FIG9_LINEAR[f][0]:.4f}, {FIG9_LINEAR[f][1]:.4f})"
                    for f, v in torques.items()
                )
            ),
        ),
        numbers={f"zero_torque_at_{f:g}_Hz_mNm": (1e3 * v, "mN·m") for f, v in torques.items()},
    )


def _stiffening() -> Finding:
    factor, power = p.POWER_LAW
    angle = (2.8 / factor) ** (1 / power)
    slopes = {"power law of Fig. 8": power * 2.8 / angle}
    for c in (1.0, p.BEST_SHAPE):
        scale = p.TARGET_TORQUE / math.expm1(c * p.TARGET_ANGLE)
        slopes[f"exponential, c = {c:g}"] = c * (2.8 + scale)
    change = 20 * math.log10(18.0 / 5.7)
    low, high = min(slopes.values()), max(slopes.values())
    return Finding(
        "C.5",
        NOTES,
        statement="At 2.8 N·m the tangent stiffness is 5.7 to 18 N·m/rad, not 3.4; "
        "gain margin +4.9 → −5.2 dB",
        verdict=OPEN,
        why="All laws that the figures allow lie above 3.4 and inside the stated range, but its upper end "
        "is not reached by any of them at rest. The fall of the margin is the ratio of the two ends, "
        "so it holds only if they do.",
        steps=(
            step("At 2.8 N·m in N·m/rad: " + ", ".join(f"{v:.1f} ({n})" for n, v in slopes.items())),
            step(f"Ratio of the ends in dB: {change:.1f}; stated: 10.1."),
        ),
        numbers={
            "smallest_stiffness_at_2.8_Nm": (low, "N·m/rad"),
            "largest_stiffness_at_2.8_Nm": (high, "N·m/rad"),
        },
    )


def findings() -> list[Finding]:
    """Return the findings of this chapter."""
    return [*_inertia(), _encoder(), _below_crossover(), _stiffening()]
