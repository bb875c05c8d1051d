"""Fig. 1: its loops against those of the printed viscosity."""

from __future__ import annotations

from typing import Any

import numpy as np

import nlsdesign as nls

from . import _audit_paper as p
from ._audit_cycle import Cam, cycle, fig8_energy, loss
from ._audit_finding import AGAINST_FIGURES, HOLDS, OPEN, PAPER, Finding, step


def fig1_loop(degrees: int) -> tuple[float, float]:
    """Return amplitude in rad and area per whole cycle in J; the 25° loop shows one side only."""
    angle, torque = p.points(f"fig01_mean_torque_{degrees}deg").T
    area = p.closed_integral(angle, torque)
    return float(angle.max()), area * (1.0 if angle.min() < -0.1 else 2.0)


def _cannot() -> Finding:
    amplitude, area = fig1_loop(45)
    cam = Cam(fig8_energy, p.FORCE_SCALE)
    found = {
        f: loss(cam, amplitude, f, p.VISCOSITY * p.FORCE_SCALE, p.FORCE_SCALE)[0] for f in (0.5, 1.0, 2.0)
    }
    shares = {f: lost / abs(area) for f, lost in found.items()}
    most = 100.0 * max(shares.values())
    return Finding(
        "7.3",
        PAPER,
        "η = 411 Pa·s gives the loops of Fig. 1",
        AGAINST_FIGURES if most < 50.0 else HOLDS,
        "Even if the force scale is put into the viscosity too, the loop of the law has a tenth of the "
        "drawn area at most; visible creep and instability cannot come from it either.",
        (
            step(f"Area of the 45° loop of Fig. 1: {1e3 * abs(area):.0f} mJ."),
            step(
                "Area of the law at 0.5, 1 and 2 Hz in per cent of it: "
                + ", ".join(f"{100 * v:.1f}" for v in shares.values())
            ),
        ),
        {"fig1_loop_45_deg_mJ": (1e3 * abs(area), "mJ"), "law_over_fig1_area_percent": (most, "%")},
        {"Loop of Fig. 1, 45°": (_fig1_figure(), "Law at 1 Hz, force scale 2.55, cam by energy.")},
    )


def _fig1_figure() -> Any:
    amplitude, _ = fig1_loop(45)
    cam = Cam(fig8_energy, p.FORCE_SCALE)
    measured = p.points("fig01_mean_torque_45deg")
    lines = {"Fig. 1": (np.degrees(measured[:, 0]), measured[:, 1])}
    for viscosity in (p.VISCOSITY * p.FORCE_SCALE, 20.8e3):
        run = cycle(cam, amplitude, 1.0, viscosity, p.FORCE_SCALE)
        # Torque from power: τ·ω = N·F·dδ/dt, with ω from the sine; at the turning points it is left out.
        speed = 2 * np.pi * amplitude * np.cos(2 * np.pi * np.arange(len(run["rate"])) / len(run["rate"]))
        torque = np.where(np.abs(speed) > 0.1, p.ELEMENTS * run["force"] * run["rate"] / speed, np.nan)
        lines[f"law, {1e-3 * viscosity:.1f} kPa·s"] = (np.degrees(run["angle"]), torque)
    return nls.figures.curves(
        lines,
        across="angle in degrees",
        up="torque in N·m",
        words="Torque over angle at 45°: the loop of Fig. 1 and that of the law with two viscosities.",
    )


def _fig1_sign() -> Finding:
    areas = {d: 1e3 * fig1_loop(d)[1] for d in (25, 45)}
    return Finding(
        "7.8",
        PAPER,
        "The loops of Fig. 1 are run through as those of a passive spring",
        OPEN,
        "In drawing order both are run through the wrong way, as those of Fig. 6; but they are means "
        "over cycles and the figure has no time axis, so the order in which they were drawn need not be "
        "that of time.",
        (
            step(
                "Areas in drawing order in mJ per cycle: "
                + ", ".join(f"{v:.0f} ({d}°)" for d, v in areas.items())
            ),
        ),
        {
            "fig1_loop_25_deg_drawing_order_mJ": (areas[25], "mJ"),
            "fig1_loop_45_deg_drawing_order_mJ": (areas[45], "mJ"),
        },
    )


def findings() -> list[Finding]:
    """Return what is found here."""
    return [_cannot(), _fig1_sign()]
