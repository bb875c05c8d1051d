"""Fig. 1: the viscosity that its loops ask for, and how large the loops are."""

from __future__ import annotations

import numpy as np
from scipy.optimize import brentq

from . import _audit_paper as p
from ._audit_cycle import Cam, fig8_energy, loss
from ._audit_finding import AGAINST_FIGURES, HOLDS, NOTES, OPEN, PAPER, Finding, step
from ._audit_loops import fig1_loop


def needed_viscosity(degrees: int, frequency: float) -> float:
    """Return the η that gives the area of a loop of Fig. 1, force scale 2.55, cam by energy."""
    amplitude, area = fig1_loop(degrees)
    cam = Cam(fig8_energy, p.FORCE_SCALE)

    def miss(viscosity: float) -> float:
        return loss(cam, amplitude, frequency, viscosity, p.FORCE_SCALE)[0] - abs(area)

    return float(brentq(miss, 100.0, 6e4, rtol=1e-6))


def _viscosity() -> Finding:
    found = {f: needed_viscosity(45, f) for f in (0.5, 0.7, 1.0, 2.0)}
    return Finding(
        "7.4",
        NOTES,
        "A loop width like Fig. 1 needs η of 10–30 kPa·s",
        OPEN,
        "It holds if Fig. 1 was driven at 0.7 to 2 Hz: the viscosity goes with one over the frequency, "
        "which is not printed. At 1 Hz it is 21 kPa·s, fifty times the printed number.",
        (step("Needed: " + ", ".join(f"{1e-3 * v:.1f} kPa·s at {f:g} Hz" for f, v in found.items())),),
        {"viscosity_for_fig1_at_1_Hz_kPa_s": (1e-3 * found[1.0], "kPa·s")},
    )


def _both_loops() -> Finding:
    small, large = needed_viscosity(25, 1.0), needed_viscosity(45, 1.0)
    return Finding(
        "7.5",
        NOTES,
        "One viscosity meets both loops of Fig. 1",
        AGAINST_FIGURES if abs(large / small - 1.0) > 0.1 else HOLDS,
        "The loops of the figure widen less with the amplitude than those of one relaxation time: with "
        "the viscosity of the 45° loop that of 25° is a quarter too large. The figure-consistent deck "
        "has this flaw.",
        (step(f"Needed at 1 Hz: {1e-3 * small:.1f} kPa·s at 25°, {1e-3 * large:.1f} kPa·s at 45°."),),
        {"viscosity_of_45_over_25_deg": (large / small, "1")},
    )


def loss_share(x: p.Array, y: p.Array) -> float:
    """Return energy lost over energy put in of a loop in per cent, in whichever order it is lossy."""
    put = np.array([(y + np.roll(y, -1)) / 2 * (np.roll(x, -1) - x)]).ravel()
    lost = abs(float(put.sum()))
    return 100.0 * lost / float(max(put.clip(min=0.0).sum(), (-put).clip(min=0.0).sum()))


def _size_of_loops() -> Finding:
    shares = {
        f"Fig. {figure}, {d}°": loss_share(*loop)
        for d in (25, 45)
        for figure, loop in ((1, p.points(f"fig01_mean_torque_{d}deg").T), (6, p.element_loop(d)))
    }
    return Finding(
        "7.9",
        PAPER,
        "The loops are of 17 %",
        OPEN,
        "By energy the loops of the figures lose 8 to 13 % of what is put in. What the 17 % are a share of "
        "is not in the notes.",
        (step("Lost over put in: " + ", ".join(f"{v:.1f} % ({n})" for n, v in shares.items())),),
        {
            "smallest_loss_of_the_figures_percent": (min(shares.values()), "%"),
            "largest_loss_of_the_figures_percent": (max(shares.values()), "%"),
        },
    )


def findings() -> list[Finding]:
    """Return what is found here."""
    return [_viscosity(), _both_loops(), _size_of_loops()]
