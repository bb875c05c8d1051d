"""One fit of twelve parameters: multiple shooting against least squares around an integrator.

The peer is what one writes with SciPy alone: ``least_squares`` with finite differences around ``solve_ivp``.
Both get the same records, the same starts and bounds, and the same residuals; the first states are known to
the peer and free here. Times are those of the process, the costs half the sum of squares in standard
deviations of the noise. Printed, not asserted.
"""

from __future__ import annotations

import time

import numpy as np
from scipy.integrate import solve_ivp
from scipy.optimize import least_squares

from nlsdesign.bench.identification import Record, Shots, Weights, fit_by_simulation, free_parameter
from nlsdesign.components import TRANSLATION, CoulombFriction, Dashpot, Mass, Regularised, Spring, tie
from nlsdesign.components.assembly.named_parts import assembly
from nlsdesign.foundation.arrays import Array
from nlsdesign.model import FlatModel, flatten
from nlsdesign.simulation import Trace

STEP, SECONDS, NOISE, CREEP = 0.01, 8.0, 2e-3, 0.05
TRUE = {
    "a.mass": 1.0, "b.mass": 0.6, "c.mass": 1.5,
    "ground_a.stiffness": 120.0, "a_b.stiffness": 80.0, "b_c.stiffness": 60.0, "c_ground.stiffness": 90.0,
    "damp_a.damping": 0.8, "damp_a_b.damping": 0.5, "damp_b_c.damping": 0.4, "damp_c.damping": 1.1,
    "dry.sliding_effort": 0.5,
}  # fmt: skip
MEASURED = ("a.position", "b.position", "c.position")
START_OFF = 1.6


def chain() -> FlatModel:
    """Three masses between two walls, with dry friction on the first; every number off by a factor."""
    signs = np.random.default_rng(5).choice([-1.0, 1.0], len(TRUE))
    value = {n: v * START_OFF**s for (n, v), s in zip(TRUE.items(), signs, strict=True)}
    return flatten(
        assembly(
            "chain",
            a=Mass(mass=value["a.mass"]),
            b=Mass(mass=value["b.mass"]),
            c=Mass(mass=value["c.mass"]),
            ground_a=tie(Spring(stiffness=value["ground_a.stiffness"]), "a"),
            a_b=tie(Spring(stiffness=value["a_b.stiffness"]), "a", "b"),
            b_c=tie(Spring(stiffness=value["b_c.stiffness"]), "b", "c"),
            c_ground=tie(Spring(stiffness=value["c_ground.stiffness"]), "c"),
            damp_a=tie(Dashpot(damping=value["damp_a.damping"]), "a"),
            damp_a_b=tie(Dashpot(damping=value["damp_a_b.damping"]), "a", "b"),
            damp_b_c=tie(Dashpot(damping=value["damp_b_c.damping"]), "b", "c"),
            damp_c=tie(Dashpot(damping=value["damp_c.damping"]), "c"),
            dry=tie(
                CoulombFriction(
                    sliding_effort=value["dry.sliding_effort"],
                    contact=Regularised(creep_speed=CREEP),
                    domain=TRANSLATION,
                ),
                "a",
            ),
        )
    )


def simulated(numbers: Array, grid: Array, push: Array, tolerance: float) -> Array:
    """Return the three positions over time by SciPy, from rest; shape (3, n)."""
    ma, mb, mc, k0, k1, k2, k3, c0, c1, c2, c3, dry = numbers

    def rate(t: float, x: Array) -> list[float]:
        a, b, c, va, vb, vc = x
        force = np.interp(t, grid, push)
        ab, bc = k1 * (b - a) + c1 * (vb - va), k2 * (c - b) + c2 * (vc - vb)
        friction = dry * np.tanh(va / CREEP)
        return [
            va, vb, vc,
            (force - k0 * a - c0 * va - friction + ab) / ma, (bc - ab) / mb, (-k3 * c - c3 * vc - bc) / mc,
        ]  # fmt: skip

    found = solve_ivp(
        rate, (0.0, grid[-1]), np.zeros(6), t_eval=grid, rtol=tolerance, atol=tolerance * 1e-2, max_step=0.05
    )
    return np.asarray(found.y[:3])


def records() -> list[Record]:
    """Return two records of the true chain, pushed by sums of sines, with noise."""
    grid = np.arange(0.0, SECONDS, STEP)
    found = []
    for seed in (1, 2):
        rng = np.random.default_rng(seed)
        lines = [(f, rng.uniform(0.0, 2.0 * np.pi)) for f in (0.3, 0.7, 1.1, 1.6, 2.3, 3.1)]
        push = np.sum([2.5 * np.sin(2.0 * np.pi * f * grid + p) for f, p in lines], axis=0)
        seen = simulated(np.array(list(TRUE.values())), grid, push, 1e-8)
        seen += NOISE * rng.standard_normal(seen.shape)
        signals = {"a.force": push, **dict(zip(MEASURED, seen, strict=True))}
        units = {"a.force": "N", **dict.fromkeys(MEASURED, "m")}
        found.append(Record(f"run {seed}", Trace(grid, signals, units, f"run {seed}")))
    return found


def peer(runs: list[Record], start: Array) -> tuple[Array, float, float, int]:
    """Return numbers, cost, seconds and simulations of least squares with finite differences."""
    count = 0

    def residual(logarithm: Array) -> Array:
        nonlocal count
        count += len(runs)
        rows = []
        for run in runs:
            seen = np.array([run.trace[n] for n in MEASURED])
            rows.append(simulated(np.exp(logarithm), run.trace.time, run.trace["a.force"], 1e-5) - seen)
        return np.concatenate([r.ravel() for r in rows]) / NOISE

    begin = time.process_time()
    bounds = np.log(start) - np.log(10.0), np.log(start) + np.log(10.0)
    found = least_squares(residual, np.log(start), bounds=bounds, diff_step=1e-4, xtol=1e-5, ftol=1e-6)
    return np.exp(found.x), float(found.cost), time.process_time() - begin, count


def main() -> None:
    """Fit both ways and print times, costs and how far the numbers are from the truth."""
    runs, model = records(), chain()
    free = [free_parameter(model.variable(name)) for name in TRUE]
    weights = Weights(dict.fromkeys(MEASURED, NOISE))
    begin = time.process_time()
    own = fit_by_simulation(model, runs, free, shots=Shots(1.0), weights=weights)
    seconds = time.process_time() - begin
    numbers, cost, slow, count = peer(runs, np.array([p.start for p in free]))
    true = np.array(list(TRUE.values()))
    off = np.array([own.fit.values[n] for n in TRUE]) / true - 1.0
    samples = sum(len(r.trace) for r in runs)
    print(f"{len(TRUE)} parameters, {len(runs)} records, {samples} samples of {len(MEASURED)} positions")
    print("                                     seconds      cost   rms error of the numbers")
    ours = f"multiple shooting, {own.iterations:3d} steps      {seconds:10.2f} {own.fit.cost:10.1f}"
    print(f"{ours}   {_rms(off)}")
    print(f"least_squares, {count:5d} simulations {slow:10.2f} {cost:10.1f}   {_rms(numbers / true - 1.0)}")
    print(f"ratio of the times {slow / seconds:.0f} (goal: at least 20, below 5 s, at equal or lower cost)")


def _rms(off: Array) -> str:
    return f"{100.0 * float(np.sqrt(np.mean(off**2))):.2f} %"


if __name__ == "__main__":
    main()
