"""The printed parameters: their labels, and which of them the figures can tell."""

from __future__ import annotations

import sympy as sp

from . import _audit_paper as p
from ._audit_finding import FAILS, HOLDS, NOTES, OPEN, Finding, equal, step


def _labels() -> Finding:
    other = sp.symbols("k_s", positive=True)
    return Finding(
        "5.2",
        NOTES,
        "The labels of k1 and k2 differ between (1) and Fig. 5",
        OPEN,
        "The drawing is not part of the data of this project. What (1) itself says is unambiguous: its "
        "relaxation time is the constant η/k, so its k is the spring in series with the dashpot.",
        (
            step("Spring k in series with η, F* beside (as in (1)): relaxation time", p.ETA / p.K),
            step(
                "The other reading, a spring k_s in series with (F* beside η):", p.ETA / (other + p.ENGAGED)
            ),
            step("The second changes with the extension; (1) has no such thing."),
        ),
    )


def _knots() -> Finding:
    reached = max(float(p.element_loop(d, kind)[0].max()) for d in (25, 45) for kind in ("measured", "model"))
    sensitivity = sp.diff(p.A * sp.Symbol("k_5*") * sp.Max(p.DELTA - sp.Symbol("δ_5"), 0), sp.Symbol("k_5*"))
    needed = float(p.static_force(p.KNOTS[4])[0])
    return Finding(
        "6.1",
        NOTES,
        "k5* and k6* engage beyond any extension shown: not identifiable there",
        HOLDS if reached < p.KNOTS[4] else FAILS,
        "The derivative of the force with respect to both is zero over the whole of Fig. 6, so no "
        "record like it can say anything about them; and they differ by 0.01 mm in where they engage.",
        (
            step("Sensitivity of the force, zero below the knot:", equal(sp.Symbol("dF/dk_5*"), sensitivity)),
            step(
                f"Largest extension shown {1e3 * reached:.2f} mm, fifth knot {1e3 * p.KNOTS[4]:.2f} mm at "
                f"F* = {needed:.0f} N."
            ),
        ),
        {"largest_extension_shown_mm": (1e3 * reached, "mm"), "fifth_knot_mm": (1e3 * p.KNOTS[4], "mm")},
    )


def findings() -> list[Finding]:
    """Return what is found here."""
    return [_labels(), _knots()]
