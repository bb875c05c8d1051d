"""Fig. 6: its frequency."""

from __future__ import annotations

import numpy as np
import sympy as sp

from . import _audit_paper as p
from ._audit_finding import AGAINST_FIGURES, FAILS, HOLDS, NOTES, PAPER, Finding, equal, step


def stretch_period(degrees: int) -> float:
    """Return the time between two stretches in s: rising flanks through half of the largest force."""
    time, force = p.points(f"fig06_measured_{degrees}deg_force_vs_time").T
    level = force.max() / 2
    up = np.flatnonzero((force[:-1] < level) & (force[1:] >= level))
    share = (level - force[up]) / (force[up + 1] - force[up])
    crossings = time[up] + share * (time[up + 1] - time[up])
    return float(crossings[-1] - crossings[0]) / (len(crossings) - 1)


def _frequency() -> list[Finding]:
    period = float(np.mean([stretch_period(d) for d in (25, 45)]))
    cam = 1.0 / (2.0 * period)
    steps = (
        step(
            "A cable through the centre stretches each element twice per cycle of the cam:",
            equal(sp.Symbol("f"), 1 / (2 * sp.Symbol("T"))),
        ),
        step(f"Time between two rising flanks on the printed axis: T = {1e3 * period:.2f} ms."),
    )
    return [
        Finding(
            "8.1",
            PAPER,
            "Fig. 6 was recorded at 4 Hz",
            AGAINST_FIGURES if abs(cam / p.FIG6_CAPTION_FREQUENCY - 1) > 0.1 else HOLDS,
            "At 4 Hz two stretches would lie 125 ms apart; counted once per cycle they would be 250 ms "
            "apart.",
            steps,
            {"fig6_cam_frequency_Hz": (cam, "Hz")},
        ),
        Finding(
            "8.3",
            NOTES,
            "The time axis of Fig. 6 gives 10.8 Hz",
            HOLDS if abs(cam - 10.8) < 0.2 else FAILS,
            "For the cam; each element is stretched at twice that rate.",
            steps,
            {"fig6_stretches_per_s": (1.0 / period, "1/s")},
        ),
    ]


def findings() -> list[Finding]:
    """Return what is found here."""
    return [*_frequency()]
