"""Simulation with located events against ``scipy.integrate.solve_ivp`` with events, on the same equations.

The published actuator with dry friction that sticks, backlash with a damped contact between motor and shaft,
and an encoder, driven by a sine current and seen every millisecond. The peer integrates the same equations,
called through CasADi, with one terminal event per switch, and starts again after each; what it has just
computed at one point it does not compute twice. Each peer gets a ladder of tolerances; of the runs that are
at least as exact as the package's the fastest counts, so the ratio is at equal error. Errors are those of the
motor's angle relative to its largest value, against the peer with a relative tolerance of 1e-12. A peer that
loses an event is far off and does not count.

Run: ``python -m benchmarks.bench_events [--seconds 10] [--tolerance 1e-8]``.
"""

from __future__ import annotations

import argparse
import math
import time
from collections.abc import Callable, Iterator

import numpy as np
from scipy.integrate import solve_ivp

from nlsdesign.components import ROTATION, Backlash, CoulombFriction, Dashpot, Inertia, Spring, tie
from nlsdesign.components.assembly.deck_writer import declare
from nlsdesign.export import natively
from nlsdesign.foundation.arrays import Array
from nlsdesign.foundation.deck import load_deck
from nlsdesign.model import FlatModel, flatten
from nlsdesign.simulation import Sine, simulate

DECK = "austin2015_figure_consistent"
LADDER = (1e-6, 1e-7, 1e-8, 1e-9)
PEERS = ("DOP853", "RK45", "LSODA")
CURRENT = Sine(2.0, 2.0)


def bench() -> FlatModel:
    """The published actuator with dry friction, backlash and encoder."""
    made = declare(load_deck(DECK))
    contact = (
        ("spring", Spring(stiffness=500.0, domain=ROTATION)),
        ("damper", Dashpot(damping=0.02, domain=ROTATION)),
    )
    made = made.with_part("dry_friction", CoulombFriction(sliding_effort=0.02))
    made = made.with_part("shaft", Inertia(inertia=5e-5))
    made = made.with_part("backlash", tie(Backlash(gap=0.01, members=contact), "motor", "shaft"))
    made = made.with_part("spring", tie(made.element("spring"), "shaft"))
    return flatten(made, inputs=["motor.current"], outputs=["motor_encoder.reading"])


class Peer:
    """The same model for ``solve_ivp``: right-hand side, one event per switch, what happens there."""

    def __init__(self, model: FlatModel) -> None:
        laws = model.switching
        assert laws is not None
        self._laws, self._parameters = laws, model.start(model.parameters)
        self._start = model.start(model.states)
        self._speed = [v.name for v in model.states].index("motor.speed")
        self.modes = np.array(laws.natural(0.0, self._start, CURRENT(0.0), self._parameters)).ravel()
        self._begin, self._at, self._seen = 0.0, (math.nan, np.zeros(0)), np.zeros(0)

    def rate(self, t: float, x: Array) -> Array:
        return np.array(self._laws.branch(t, x, CURRENT(t), self._parameters, self.modes)[0]).ravel()

    def events(self) -> Iterator[Callable[[float, Array], float]]:
        for number in range(len(self.modes)):

            def lasts(t: float, x: Array, number: int = number) -> float:
                # At its beginning a piece is where its last one ended: rounding may not tell the side.
                return 1.0 if t == self._begin else float(self.lasts(t, x)[number])

            lasts.terminal, lasts.direction = True, -1.0  # type: ignore[attr-defined]
            yield lasts

    def lasts(self, t: float, x: Array) -> Array:
        if self._at[0] != t or not np.array_equal(self._at[1], x):
            found = self._laws.branch(t, x, CURRENT(t), self._parameters, self.modes)[1]
            self._at, self._seen = (t, x.copy()), np.array(found).ravel()
        return self._seen

    def passed(self, number: int, t: float, x: Array) -> None:
        """Change the mode that has ended; friction is the only switch that holds something here."""
        self._at = (math.nan, x)
        if not self._laws.holds[number]:
            self.modes[number] *= -1.0
            return
        if self.modes[number]:
            x[self._speed], self.modes[number] = 0.0, 0.0
            if self.lasts(t, x)[number] >= 0.0:
                return
        landing = self._laws.landing(t, x, CURRENT(t), self._parameters, self.modes)
        self.modes[number] = float(landing[2][number])
        self._at = (math.nan, x)

    def run(self, times: Array, method: str, tolerance: float) -> tuple[Array, int]:
        """Return the motor's angle and the number of events."""
        x, angle, count, tests = self._start.copy(), np.zeros(len(times)), 0, list(self.events())
        angle[0] = x[0]
        while True:
            ahead = times[times > self._begin]
            found = solve_ivp(
                self.rate, (self._begin, times[-1]), x, method=method, events=tests, t_eval=ahead,
                rtol=tolerance, atol=tolerance * 1e-2,
            )  # fmt: skip
            if len(found.t):
                angle[np.searchsorted(times, found.t)] = found.y[0]
            if found.status != 1:
                return angle, count
            number = next(i for i, moments in enumerate(found.t_events) if len(moments))
            self._begin, x = float(found.t_events[number][0]), found.y_events[number][0].copy()
            self.passed(number, self._begin, x)
            count += 1


def timed(run: Callable[[], tuple[Array, int]], repeats: int) -> tuple[float, Array, int]:
    """Return the shortest processor time of a few runs, and the last result."""
    best = math.inf
    for _ in range(repeats):
        begin = time.process_time()
        angle, count = run()
        best = min(best, time.process_time() - begin)
    return best, angle, count


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0] if __doc__ else None)
    parser.add_argument("--seconds", type=float, default=2.0)
    parser.add_argument("--tolerance", type=float, default=1e-8)
    options = parser.parse_args()
    times = np.linspace(0.0, options.seconds, round(1000 * options.seconds) + 1)
    model = bench()
    exact, expected = Peer(model).run(times, "DOP853", 1e-12)
    print(
        f"bench with friction, backlash and encoder, {options.seconds:g} s, {expected} events, processor time"
    )

    def error(angle: Array) -> float:
        return float(np.max(np.abs(angle - exact)) / np.max(np.abs(exact)))

    def package(**more: object) -> tuple[Array, int]:
        drive = {"motor.current": CURRENT}
        run = simulate(model, times, inputs=drive, tolerance=options.tolerance, **more)  # type: ignore[arg-type]
        return run["motor.angle"], len(run.events)

    begin = time.time()
    package(translate=natively)
    print(f"  first run of the compiled step, with its compilation: {time.time() - begin:.1f} s of the clock")
    own = {"package": timed(package, 3), "compiled": timed(lambda: package(translate=natively), 3)}
    for name, (spent, angle, count) in own.items():
        print(f"  {name:9s} {spent:8.3f} s   error {error(angle):.1e}   {count} events, all signals")
    bound = max(error(angle) for _, angle, _ in own.values())
    for method in PEERS:
        fastest, told = math.inf, "no tolerance of the ladder is as exact"
        for tolerance in LADDER:
            spent, angle, count = timed(lambda m=method, t=tolerance: Peer(model).run(times, m, t), 1)  # type: ignore[misc]
            if error(angle) <= bound and spent < fastest:
                fastest = spent
                ratios = ", ".join(f"{spent / own[name][0]:.0f} times {name}" for name in own)
                told = f"{ratios}   rtol {tolerance:g}, error {error(angle):.1e}, {count} events"
        print(f"  {method:9s} {fastest:8.3f} s   {told}")


if __name__ == "__main__":
    main()
