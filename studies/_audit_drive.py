"""Drivetrain: inertia from the rise times of 2014, and the encoder."""

from __future__ import annotations

import math

import sympy as sp
from scipy.integrate import solve_ivp

from . import _audit_paper as p
from ._audit_finding import FAILS, HOLDS, NOTES, OPEN, PAPER, Finding, equal, step

RISE_TIMES = (16.0e-3, 18.3e-3)  # s, printed 2014


PRINTED_INERTIA, NOTED_INERTIA = 8.83e-5, 5.97e-4  # kg·m²


def rise_time(inertia: float, load: str) -> float:
    """Return the time to 53° at full current from rest, against nothing, the target or a straight line."""
    torque = p.GEARED_CONSTANT * p.CURRENT_LIMIT

    def against(angle: float) -> float:
        if load == "none":
            return 0.0
        share = angle / p.TARGET_ANGLE
        return p.TARGET_TORQUE * (share if load == "line" else math.expm1(angle) / math.expm1(p.TARGET_ANGLE))

    def there(_: float, x: p.Array) -> float:
        return float(x[0] - p.TARGET_ANGLE)

    there.terminal = True  # type: ignore[attr-defined]
    run = solve_ivp(
        lambda _, x: [x[1], (torque - against(x[0])) / inertia],
        (0.0, 0.2),
        [0.0, 0.0],
        events=there,
        rtol=1e-8,
    )
    return float(run.t_events[0][0])


def _inertia() -> list[Finding]:
    loads = ("none", "target", "line")
    printed = {load: rise_time(PRINTED_INERTIA, load) for load in loads}
    # The time goes with the root of the inertia.
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
            "J = 8.83e-5 kg·m² (2014) goes with rise times of 16 and 18.3 ms",
            FAILS if max(printed.values()) < 0.6 * min(RISE_TIMES) else HOLDS,
            "With that inertia and 4.4 N·m the drive would be there in 6 to 7 ms, whatever it works against.",
            steps,
            {"rise_time_with_printed_inertia_ms": (1e3 * max(printed.values()), "ms")},
        ),
        Finding(
            "C.2",
            NOTES,
            "The rise times give J = 5.97e-4 kg·m² with n·kT = 0.220 N·m/A and 20 A",
            OPEN,
            "5.97e-4 lies inside what 16 and 18.3 ms allow; unloaded it takes 15.8 ms. What the times "
            "were measured against, and to which angle, is not in the notes: anything from 4.7e-4 to "
            "8.0e-4 can be had.",
            steps,
            {
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
        "Encoders of 13 bit count 0.767 mrad",
        HOLDS if abs(count - 0.767) < 5e-4 else FAILS,
        "One turn over 8192 counts.",
        (step("In mrad:", equal(sp.Symbol("q"), 2000 * sp.pi / 8192)),),
        {"encoder_count_mrad": (count, "mrad")},
    )


def findings() -> list[Finding]:
    """Return what is found here."""
    return [*_inertia(), _encoder()]
