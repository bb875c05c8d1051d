"""Many draws at once against one call per draw: the published loop, errors of observers, simulations.

Ours is a batch of 1,000 draws of the spread of the deck, numbers as columns: compiled, eight columns at
once, and with NumPy where there is no compiler. The first peer is our own call for one draw,
``ClosedLoop.run`` of the plant with the drawn numbers, which is what a script writes; beside it the same
compiled. The second is ``solve_ivp`` of SciPy for the plant from sample to sample with the same observer and
controller, evaluated sample by sample. Peers take a part of the draws or samples and are scaled by their
number, which they take at an even pace. CPU seconds; compilation stands beside them.
Printed, not asserted: ``python -m benchmarks.batches``.
"""

from __future__ import annotations

import os
from collections.abc import Callable
from dataclasses import replace
from typing import TypeVar

import casadi as ca
import numpy as np
from scipy.integrate import solve_ivp

import nlsdesign as nls
from benchmarks.closed_loop import published_loop
from nlsdesign.export import natively
from nlsdesign.feedback.control import ClosedLoop
from nlsdesign.feedback.observer import CascadeGain, observer_bench, observer_errors
from nlsdesign.simulation import Sine, declared_prior, simulate, simulate_batch
from nlsdesign.simulation.sampled_batch import PLANT, run_batch

DRAWS, STOP, AMPLITUDE, FREQUENCY = 1000, 1.0, 0.8, 1.0
ALONE, PEER_SAMPLES, SIMULATED = 8, 60, 300
Result = TypeVar("Result")


def one_by_one(function: ca.Function) -> ca.Function:
    """Return a compiled function that is called for one draw after the other."""
    return natively(function)


def spent() -> float:
    """Return CPU seconds of this process and of those that it ran."""
    return sum(os.times()[:4])


def timed(task: Callable[[], Result]) -> tuple[Result, float]:
    """Return a result and the CPU seconds that it took."""
    begin = spent()
    result = task()
    return result, spent() - begin


def wanted(time: float) -> float:
    """Return the desired torque in N·m."""
    return AMPLITUDE * float(np.sin(2.0 * np.pi * FREQUENCY * time))


def stepwise(loop: ClosedLoop) -> float:
    """Return the seconds that ``solve_ivp`` takes for one sample of the loop."""
    system, parts = loop.system([loop.desired]), {"observer": loop.observer, "controller": loop.controller}
    plant, step = loop.plant, loop.sample_time
    reading = next(r.signal for r in plant.readings)
    place = [v.name for v in plant.signals].index(reading)
    numbers = {name: m.start(m.parameters) for name, m in parts.items()}
    states = {name: m.start(m.states) for name, m in parts.items()}
    x, p, acting = plant.start(plant.states), plant.start(plant.parameters), plant.start(plant.inputs)

    def rate(t: float, at: np.ndarray) -> np.ndarray:
        return np.array(plant.equations(t, at, acting, p, [])[0]).ravel()

    begin = spent()
    for k in range(PEER_SAMPLES):
        read = float(np.array(plant.equations(0.0, x, acting, p, [])[2]).ravel()[place])
        known = {f"{PLANT}.{reading}": read, f"{PLANT}.{loop.names.current}": float(acting[0])}
        known[loop.desired] = wanted(k * step)
        for name, model in parts.items():
            u = [known[system.sources[f"{name}.{v.name}"]] for v in model.inputs]
            w = model.look_up(list(states[name]), u)
            states[name], outputs = (
                np.array(each).ravel() for each in model.equations(0.0, states[name], u, numbers[name], w)[:2]
            )
            known |= {f"{name}.{v.name}": float(y) for v, y in zip(model.outputs, outputs, strict=True)}
        x = solve_ivp(rate, (0.0, step), x, rtol=1e-6, atol=1e-9).y[:, -1]
        acting[0] = known[f"controller.{loop.names.current}"]
    return (spent() - begin) / PEER_SAMPLES


def loops() -> None:
    """Print the times of the published loop."""
    loop = published_loop()
    system, kept = loop.system([loop.desired]), (loop.torque, loop.estimate)
    drawn = declared_prior(loop.plant).draws(DRAWS, 1)
    columns = {f"{PLANT}.{name}": values for name, values in drawn.items()}

    def batch(**how: object) -> object:
        return run_batch(system, STOP, inputs={loop.desired: wanted}, parameters=columns, keep=kept, **how)

    def alone(i: int) -> nls.Trace:
        numbers = {name: float(values[i]) for name, values in drawn.items()}
        return replace(loop, plant=loop.plant.with_values(numbers)).run(STOP, inputs={loop.desired: wanted})

    def alone_compiled(i: int) -> object:
        one = {name: values[i : i + 1] for name, values in columns.items()}
        return run_batch(system, STOP, inputs={loop.desired: wanted}, parameters=one, keep=kept,
                         translate=one_by_one)  # fmt: skip

    _, first = timed(lambda: batch(translate=natively))
    ours, compiled = timed(lambda: batch(translate=natively))
    _, interpreted = timed(batch)
    runs, single = timed(lambda: [alone(i) for i in range(ALONE)])
    alone_compiled(0)
    _, quick = timed(lambda: [alone_compiled(i) for i in range(ALONE)])
    single, quick = single * DRAWS / ALONE, quick * DRAWS / ALONE
    pairs = [(ours[name][i], run[name]) for i, run in enumerate(runs) for name in kept]
    difference = max(float(np.max(np.abs(a - b))) for a, b in pairs)
    samples = round(STOP / loop.sample_time) + 1
    theirs = stepwise(loop) * samples * DRAWS
    print(f"published loop, {DRAWS:,} draws of {samples} samples")
    print(f"batch compiled: {compiled:.2f} s ({first - compiled:.1f} s more with compilation); "
          f"with NumPy: {interpreted:.1f} s")  # fmt: skip
    print(f"one call per draw: {single:.0f} s, batch compiled ratio {single / compiled:.0f}, "
          f"batch with NumPy ratio {single / interpreted:.1f}")  # fmt: skip
    print(f"one compiled call per draw: {quick:.1f} s, against the batch {quick / compiled:.1f} times")
    print(f"solve_ivp from sample to sample: {theirs:.0f} s, against the batch {theirs / compiled:.0f} times")
    print(
        f"largest difference between batch and single call {difference:.1g} N·m in {ALONE} draws", flush=True
    )


def observers() -> None:
    """Print the times of errors over the spread, with the observer of choice in the run."""
    model = nls.flatten(nls.declare(nls.load_deck("austin2015_figure_consistent")))
    compared = {
        "chosen": nls.design_observer(model),
        "cascade": nls.design_observer(model, gain=CascadeGain()),
    }
    bench = observer_bench(model)

    def errors(translate: object) -> object:
        return observer_errors(compared, bench, draws=64, bounded=0, translate=translate)

    for how in (natively, one_by_one):
        errors(how)
    batch, ours = timed(lambda: errors(natively))
    single, theirs = timed(lambda: errors(one_by_one))
    same = float(np.max(np.abs(batch.drawn - single.drawn)))
    print(
        f"errors of two observers over 64 draws: batch {ours:.2f} s, one compiled run after the other "
        f"{theirs:.1f} s, {theirs / ours:.0f} times; largest difference {same:.1g} N·m", flush=True,
    )  # fmt: skip


def simulations(deck: str, how: dict, words: str) -> None:
    """Print the times of open simulations with error control."""
    times, drive = np.linspace(0.0, STOP, 1001), {"motor.current": Sine(2.0, 2.0)}
    model = nls.flatten(nls.declare(nls.load_deck(deck)))
    drawn = declared_prior(model).draws(SIMULATED, 1)
    given = {"inputs": drive, "tolerance": 1e-8, **how}

    def alone(i: int) -> np.ndarray:
        numbers = {name: float(values[i]) for name, values in drawn.items()}
        return simulate(model.with_values(numbers), times, **given)["spring.torque"]

    simulate_batch(model, times, draws=drawn, keep=["spring.torque"], **given)
    alone(0)
    many, ours = timed(lambda: simulate_batch(model, times, draws=drawn, keep=["spring.torque"], **given))
    runs, theirs = timed(lambda: [alone(i) for i in range(ALONE)])
    theirs *= SIMULATED / ALONE
    events = sum(len(each) for each in many.events) / SIMULATED
    wrong = max(float(np.max(np.abs(many["spring.torque"][i] - run))) for i, run in enumerate(runs))
    print(
        f"{deck}, {SIMULATED} simulations with {events:.0f} events each, {words}: batch {ours:.1f} s, "
        f"one by one {theirs:.1f} s, {theirs / ours:.1f} times; difference {wrong:.1g} N·m", flush=True,
    )  # fmt: skip


def main() -> None:
    """Print all times."""
    load, cores = os.getloadavg()[0], os.cpu_count() or 1
    print(f"load {load:.1f} on {cores} cores before; casadi {ca.__version__}", flush=True)
    loops()
    observers()
    for deck in ("austin2015_soft_spring", "austin2015_figure_consistent"):
        simulations(deck, {}, "interpreted")
        simulations(deck, {"translate": natively}, "compiled")


if __name__ == "__main__":
    main()
