"""What no single relaxation time can do, and three can."""

from __future__ import annotations

import numpy as np
import sympy as sp
from scipy.optimize import nnls

import nlsdesign as nls

from . import _audit_paper as p
from ._audit_finding import FAILS, HOLDS, NOTES, Finding, equal, step


def loss_tangent(w: p.Array, times: p.Array, moduli: p.Array) -> p.Array:
    """Return tan δ of unit equilibrium modulus beside Maxwell branches."""
    x = w[:, None] * times[None, :]
    storage = 1.0 + (moduli * x**2 / (1.0 + x**2)).sum(axis=1)
    return np.asarray((moduli * x / (1.0 + x**2)).sum(axis=1) / storage)


def _prony() -> Finding:
    w, x, d = sp.symbols("ω T d", positive=True)
    tangent = d * w * x / (1 + (1 + d) * w**2 * x**2)
    peak = 1 / (x * sp.sqrt(1 + d))
    slope = sp.simplify(sp.diff(tangent, w).subs(w, peak))
    ratio = sp.simplify(tangent.subs(w, 10 * peak) / tangent.subs(w, peak))
    band = np.geomspace(0.1, 10.0, 201)
    # One branch: tan δ = 0.17 in the middle of the two decades, geometric mean of the band.
    best = min(
        (float(np.ptp(t := loss_tangent(band, np.array([tau]), np.array([m]))) / t.mean()), m, tau)
        for m in np.geomspace(0.1, 2.0, 25)
        for tau in np.geomspace(0.05, 20.0, 25)
        if abs(loss_tangent(band, np.array([tau]), np.array([m])).mean() - 0.17) < 0.02
    )
    times = np.array([0.06, 1.0, 16.0])
    branch = band[:, None] * times / (1.0 + (band[:, None] * times) ** 2)
    store = (band[:, None] * times) ** 2 / (1.0 + (band[:, None] * times) ** 2)
    moduli, _ = nnls(branch - 0.17 * store, np.full(len(band), 0.17))
    three = loss_tangent(band, times, moduli)
    ripple = float(np.abs(three / 0.17 - 1.0).max())
    figure = nls.figures.curves(
        {
            "one relaxation time": (band, loss_tangent(band, np.array([best[2]]), np.array([best[1]]))),
            "three": (band, three),
        },
        across="frequency, middle of the band = 1",
        up="tan δ",
        logarithmic=True,
        words="Loss tangent over two decades: one relaxation time varies manifold, three stay near 0.17.",
    )
    return Finding(
        "7.6",
        NOTES,
        "No single relaxation time gives about 17 % over two decades; three Prony terms do",
        HOLDS if slope == 0 and best[0] > 0.5 and ripple < 0.15 else FAILS,
        "A decade away from its peak the loss tangent of one branch has fallen to a fifth, whatever its "
        "strength.",
        (
            step("One branch of relative strength d:", equal(sp.Symbol("tan δ"), tangent)),
            step("Its slope vanishes at", equal(w, peak)),
            step("where it is", equal(sp.Symbol("d tan δ/dω"), slope)),
            step("A decade beside the peak, relative to it:", equal(sp.Symbol("ratio"), ratio)),
        ),
        {"spread_of_the_best_single_time": (best[0], "1"), "largest_deviation_of_three": (ripple, "1")},
        {"Loss tangent": (figure, "Two decades; the wanted value is 0.17.")},
    )


def findings() -> list[Finding]:
    """Return what is found here."""
    return [_prony()]
