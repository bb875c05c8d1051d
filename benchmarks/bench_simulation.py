"""Simulation of the bench against ``scipy.integrate.solve_ivp`` on the same equations, in one run.

The published actuator with its load side held, driven by a sine current for 5 s, seen every millisecond. The
peers integrate the same equations, written by hand in plain Python (scalars and ``math``, which is faster
than small NumPy arrays). Each peer gets a ladder of tolerances; of the runs that are at least as exact as
the package's the fastest counts, so the ratio is at equal error. Errors are those of the motor's angle
relative to its largest value, against a reference with a relative tolerance of 1e-13 that is integrated
from tenth to tenth of a second.

Run: ``python -m benchmarks.bench_simulation [--seconds 5]``.
"""

from __future__ import annotations

import argparse
import math
import time
from bisect import bisect_right
from collections.abc import Callable
from itertools import pairwise

import numpy as np
from scipy.integrate import solve_ivp

from nlsdesign.components.assembly.deck_writer import declare
from nlsdesign.foundation.arrays import Array
from nlsdesign.foundation.deck import load_deck
from nlsdesign.model import FlatModel, flatten
from nlsdesign.simulation import simulate

DECK = "austin2015_figure_consistent"
AMPLITUDE, FREQUENCY = 2.0, 2.0
PEERS = {
    "LSODA": (1e-7, 1e-8, 1e-9, 1e-10, 1e-11, 1e-12),
    "Radau": (1e-6, 1e-7, 1e-8, 1e-9, 1e-10, 1e-11),
    "RK45": (1e-6, 1e-7, 1e-8, 1e-9, 1e-10, 1e-11),
    "DOP853": (1e-6, 1e-7, 1e-8, 1e-9, 1e-10, 1e-11),
}


def current(t: float) -> float:
    return AMPLITUDE * math.sin(2.0 * math.pi * FREQUENCY * t)


def by_hand(model: FlatModel) -> Callable[[float, Array], list[float]]:
    """The equations in plain Python; state (angle, speed, strain of the dashpot)."""
    p = model.values

    def row(name: str) -> list[float]:
        return [v for n, v in p.items() if n.startswith(name + "[")]

    arms, moduli, knots = (
        row("spring.cam.lever_arm"),
        row("spring.rubber.stiff.modulus"),
        row("spring.rubber.stiff.knots"),
    )
    spans, corner = len(arms) - 3, p["spring.cam.changeover"]
    step = p["spring.cam.last_angle"] / spans
    sums = [0.0]
    for arm in arms:
        sums.append(sums[-1] + arm)
    before = 23 * arms[0] + 12 * arms[1] + arms[2]
    slopes = [sum(moduli[: i + 1]) for i in range(len(moduli))]
    offsets = [sum(k * at for k, at in zip(moduli[: i + 1], knots, strict=False)) for i in range(len(moduli))]
    area, length = p["spring.rubber.area"], p["spring.rubber.rest_length"]
    branch, viscosity = (
        p["spring.rubber.relaxing.spring.modulus"],
        p["spring.rubber.relaxing.dashpot.viscosity"],
    )
    push = p["motor.gear_ratio"] * p["motor.torque_constant"]
    inertia, viscous = p["motor.inertia"], p["bearing.damping"]
    coulomb, creep, elements = (
        p["dry_friction.sliding_effort"],
        p["dry_friction.creep_speed"],
        p["spring.cam.elements"],
    )

    def rate(t: float, x: Array) -> list[float]:
        angle, speed, inner = x.tolist()
        root = math.sqrt(angle * angle + corner * corner)
        u = angle * angle / (root + corner) / step
        i = min(int(u), spans - 1)
        r = u - i
        q = 1.0 - r
        a, b, c, d = arms[i : i + 4]
        arm = (
            (a * q**3 + b * (4 - 3 * r * r * (2 - r)) + c * (4 - 3 * q * q * (2 - q)) + d * r**3)
            / 6
            * angle
            / root
        )
        inside = a * (24 - q**4) + b * (12 + r * (16 - r * r * (8 - 3 * r)))
        inside += c * (12 - q * (16 - q * q * (8 - 3 * q))) + d * r**4
        strain = step * (sums[i] + (inside - before) / 24) / length
        engaged = bisect_right(knots, strain) - 1
        stiff = slopes[engaged] * strain - offsets[engaged] if engaged >= 0 else 0.0
        relaxing = branch * (strain - inner)
        torque = elements * arm * area * (stiff + relaxing)
        friction = viscous * speed + coulomb * math.tanh(speed / creep)
        return [speed, (push * current(t) - torque - friction) / inertia, relaxing / viscosity]

    return rate


def reference(rate: Callable[[float, Array], list[float]], marks: Array) -> Array:
    states = [np.zeros(3)]
    for begin, end in pairwise(marks):
        piece = solve_ivp(rate, (begin, end), states[-1], method="DOP853", rtol=1e-13, atol=1e-15)
        states.append(piece.y[:, -1])
    return np.array(states).T


def timed(run: Callable[[], Array], repeats: int) -> tuple[float, Array]:
    """Return the shortest processor time of a few runs, and the last result."""
    best, result = math.inf, np.zeros(0)
    for _ in range(repeats):
        begin = time.process_time()
        result = run()
        best = min(best, time.process_time() - begin)
    return best, result


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0] if __doc__ else None)
    parser.add_argument("--seconds", type=float, default=5.0)
    parser.add_argument("--tolerance", type=float, default=1e-9)
    options = parser.parse_args()
    times = np.linspace(0.0, options.seconds, round(1000 * options.seconds) + 1)
    marks = np.arange(0, len(times), 100)
    model = flatten(declare(load_deck(DECK)), outputs=["spring.torque"])
    rate = by_hand(model)
    exact = reference(rate, times[marks])[0]

    def error(angle: Array) -> float:
        return float(np.max(np.abs(angle[marks] - exact)) / np.max(np.abs(exact)))

    def package() -> Array:
        drive = {"motor.current": current}
        return simulate(model, times, inputs=drive, tolerance=options.tolerance)["motor.angle"]

    own, angle = timed(package, 3)
    bound = error(angle)
    print(f"bench, {options.seconds:g} s, {len(times)} samples, processor time")
    print(f"  package, tolerance {options.tolerance:g}: {own:8.3f} s   error {bound:.1e}   all signals")
    for method, ladder in PEERS.items():
        fastest, told = math.inf, ""
        for tolerance in ladder:

            def peer(method: str = method, tolerance: float = tolerance) -> Array:
                span, start = (0.0, float(times[-1])), np.zeros(3)
                found = solve_ivp(
                    rate, span, start, method=method, t_eval=times, rtol=tolerance, atol=tolerance * 1e-2
                )
                return np.asarray(found.y[0])

            spent, angle = timed(peer, 1)
            if error(angle) <= bound and spent < fastest:
                fastest, told = spent, f"rtol {tolerance:g}, error {error(angle):.1e}"
        ratio = (
            f"{fastest / own:6.1f} times the package's time"
            if told
            else "no tolerance of the ladder is as exact"
        )
        print(f"  {method:7s} {fastest:8.3f} s   {ratio}   {told}")


if __name__ == "__main__":
    main()
