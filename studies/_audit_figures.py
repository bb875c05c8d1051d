"""Fig. 6: the sign of its loops."""

from __future__ import annotations

import numpy as np
import sympy as sp

import nlsdesign as nls

from . import _audit_paper as p
from ._audit_finding import AGAINST_FIGURES, FAILS, HOLDS, NOTES, PAPER, Finding, equal, step

SAMPLE = 0.4e-3  # s; distance of the points of Fig. 6 on its time axis


def matched_steps(drawn: p.Array, timed: p.Array) -> float:
    """Return the share of the steps of one sequence that the other has in the same order.

    Longest common subsequence; two steps are the same within the reading accuracy of the figure.
    """
    one, other = np.diff(drawn), np.diff(timed)
    same = np.abs(one[:, None] - other[None, :]) < 0.03 + 0.01 * np.abs(one[:, None])
    longest = np.zeros((len(one) + 1, len(other) + 1), dtype=int)
    for i in range(len(one)):
        for j in range(len(other)):
            skipped = max(longest[i, j + 1], longest[i + 1, j])
            longest[i + 1, j + 1] = longest[i, j] + 1 if same[i, j] else skipped
    return float(longest[-1, -1]) / len(one)


def _sign() -> Finding:
    areas, lags, orders = {}, {}, {}
    for degrees in (25, 45):
        x, force = p.element_loop(degrees)
        areas[degrees] = p.closed_integral(x, force)
        shifted = np.array([p.closed_integral(x, np.roll(force, -k)) for k in range(8)])
        first = int(np.argmax(shifted > 0.0))
        lags[degrees] = SAMPLE * (first - shifted[first] / (shifted[first] - shifted[first - 1]))
        timed = p.points(f"fig06_measured_{degrees}deg_force_vs_time")[: len(force) + 3, 1]
        orders[degrees] = matched_steps(force, timed), matched_steps(force[::-1], timed)
    in_time = all(forward > 0.9 and backward < 0.5 for forward, backward in orders.values())
    x, force = p.element_loop(45)
    figure = nls.figures.curves(
        {"45°": (1e3 * x, force), "25°": tuple(np.array(p.element_loop(25)) * [[1e3], [1.0]])},
        across="extension in mm",
        up="force in N",
        words="Measured loops of Fig. 6: on the way out the force lies below that on the way back.",
    )
    return Finding(
        "8.4",
        NOTES,
        "In drawing order the force of Fig. 6 lags the extension: ∮F dδ < 0",
        HOLDS if max(areas.values()) < 0.0 and in_time else FAILS,
        "The drawing order is that of time: the forces of the loop come in the same order as on the "
        f"time axis of the same figure. A force that is read {1e3 * min(lags.values()):.1f} to "
        f"{1e3 * max(lags.values()):.1f} ms late is enough to turn the sign, so the records were not "
        "aligned to that.",
        (
            step(
                "Polygon in drawing order:",
                equal(sp.Symbol("W"), sp.Symbol("Σ ½(F_j + F_{j+1})(δ_{j+1} − δ_j)")),
            ),
            step(
                "Steps of the loop found in the same order on the time axis: "
                + "; ".join(
                    f"{100 * f:.0f} % forward, {100 * b:.0f} % backward ({d}°)"
                    for d, (f, b) in orders.items()
                )
            ),
        ),
        {
            "fig6_loop_25_deg_mJ": (1e3 * areas[25], "mJ"),
            "fig6_loop_45_deg_mJ": (1e3 * areas[45], "mJ"),
            "lag_that_empties_the_loop_25_deg_ms": (1e3 * lags[25], "ms"),
            "lag_that_empties_the_loop_45_deg_ms": (1e3 * lags[45], "ms"),
        },
        {"Fig. 6, measured": (figure, "A passive spring runs through its loop the other way.")},
    )


def _model_sign() -> Finding:
    areas = {d: p.closed_integral(*p.element_loop(d, "model")) for d in (25, 45)}
    return Finding(
        "8.5",
        PAPER,
        "The model curves of Fig. 6 are those of the printed law",
        AGAINST_FIGURES if max(areas.values()) < 0.0 else HOLDS,
        "They too are run through the wrong way, which item 8.2 excludes for every choice of parameters. An "
        "observer that was fed with the measured records inherits their misalignment.",
        (step("Item 8.2 over a cycle:", equal(sp.Symbol("W"), sp.Symbol("∫ F_M²/(a·η) dt"))),),
        {
            "fig6_model_loop_25_deg_mJ": (1e3 * areas[25], "mJ"),
            "fig6_model_loop_45_deg_mJ": (1e3 * areas[45], "mJ"),
        },
    )


def findings() -> list[Finding]:
    """Return what is found here."""
    return [_sign(), _model_sign()]
