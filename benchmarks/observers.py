"""LMI co-design, errors over the spread, and the default observer, against peers in the same run.

The matrix inequality of ``CertifiedGain`` (the same corners, decays and condition) is also given to SciPy's
SLSQP on the entries of P and Y, with the least eigenvalue of each matrix as a constraint and the same cost:
what a script without a solver for semidefinite programs would do. Its time counts only if its point keeps all
inequalities; where it does not, no ratio is printed.

The draws of ``observer_errors`` are also run one by one with ``solve_ivp`` on the same plant between the
samples and the same observer and servo, evaluated sample by sample. The peer takes a part of one run and is
scaled by the number of samples and runs, which it takes at an even pace. CPU seconds, compiler included.
Printed, not asserted: ``python -m benchmarks.observers``.
"""

from __future__ import annotations

import os
from collections.abc import Callable
from typing import TypeVar

import numpy as np
from scipy.integrate import solve_ivp
from scipy.optimize import minimize

import nlsdesign as nls
from nlsdesign.export import natively
from nlsdesign.feedback.observer import (
    CascadeGain,
    CertifiedGain,
    ObserverBench,
    certify,
    design_observer_with_details,
    observer_bench,
    observer_errors,
    verify,
)
from nlsdesign.feedback.observer.certificates import co_design
from nlsdesign.feedback.observer.certificates.co_design import Inequality, minimised
from nlsdesign.simulation.sampled_batch import PLANT

DECKS = ("austin2015_figure_consistent", "austin2015_as_printed")
DRAWS, PEER_SAMPLES = 64, 200
GOAL, REPEATS = 5.0, 10
Result = TypeVar("Result")


def timed(task: Callable[[], Result]) -> tuple[Result, float]:
    """Return a result and the CPU seconds that it took."""
    begin = spent()
    result = task()
    return result, spent() - begin


def spent() -> float:
    """Return CPU seconds of this process and of those that it ran."""
    return sum(os.times()[:4])


def recorded(model: nls.FlatModel) -> tuple[np.ndarray, list[Inequality], np.ndarray]:
    """Return cost, inequalities and solution of the last program that the co-design solves."""
    seen: list[tuple[np.ndarray, list[Inequality], np.ndarray]] = []

    def listening(cost: np.ndarray, inequalities: list[Inequality]) -> np.ndarray | None:
        found = minimised(cost, inequalities)
        if found is not None:
            seen.append((cost, inequalities, found))
        return found

    co_design.minimised = listening
    try:
        design_observer_with_details(model, gain=CertifiedGain())
    finally:
        co_design.minimised = minimised
    return seen[-1]


def least_eigenvalues(x: np.ndarray, inequalities: list[Inequality]) -> np.ndarray:
    """Return the least eigenvalue of each matrix."""
    return np.array([np.linalg.eigvalsh(i.constant + np.tensordot(x, i.factors, 1))[0] for i in inequalities])


def peer_program(cost: np.ndarray, inequalities: list[Inequality]) -> tuple[float, np.ndarray]:
    """Solve the same program by SLSQP; return cost and least eigenvalues of its point."""

    def slopes(x: np.ndarray) -> np.ndarray:
        rows = []
        for i in inequalities:
            vector = np.linalg.eigh(i.constant + np.tensordot(x, i.factors, 1))[1][:, 0]
            rows.append(i.factors @ vector @ vector)
        return np.array(rows)

    keep = {"type": "ineq", "fun": lambda x: least_eigenvalues(x, inequalities), "jac": slopes}
    # P = 10·1, Y = 0.
    ten = 10.0 * np.eye(len(inequalities[0].constant))
    start = np.linalg.lstsq(inequalities[0].factors.reshape(len(cost), -1).T, ten.ravel(), rcond=None)[0]
    found = minimize(
        lambda x: float(cost @ x), start, jac=lambda _: cost, constraints=[keep], method="SLSQP",
        options={"maxiter": 500, "ftol": 1e-9},
    )  # fmt: skip
    return float(found.fun), least_eigenvalues(found.x, inequalities)


def co_designs(deck: str, model: nls.FlatModel) -> None:
    """Print times of co-design, certificate and check, and those of the peer on one program."""
    design, designing = timed(lambda: design_observer_with_details(model, gain=CertifiedGain()))
    certificate, certifying = timed(lambda: certify(model, design))
    verdict, checking = timed(lambda: verify(certificate, model=model))
    print(
        f"{deck}: co-design {designing:.2f} s, certify {certifying:.2f} s, verify {checking:.2f} s "
        f"({'holds' if verdict.holds else 'DOES NOT HOLD'}); goal {GOAL:g} s each",
        flush=True,
    )
    cost, inequalities, ours = recorded(model)
    _, alone = timed(lambda: [minimised(cost, inequalities) for _ in range(REPEATS)])
    ((theirs, least), *_), taken = timed(lambda: [peer_program(cost, inequalities) for _ in range(REPEATS)])
    alone, taken = alone / REPEATS, taken / REPEATS
    size = f"{len(cost)} unknowns, {len(inequalities)} matrices"
    if np.min(least) < -1e-6:
        outcome = f"stopped with an eigenvalue of {np.min(least):.1g}, so it found no gain; no ratio"
    else:
        outcome = f"cost {theirs / float(cost @ ours):.4g} times ours, ratio {taken / alone:.1f}"
    times = f"{1e3 * alone:.1f} ms; SLSQP on eigenvalues {1e3 * taken:.1f} ms"
    print(f"  its last program ({size}) {times}: {outcome}", flush=True)


def stepwise(trial: ObserverBench, observer: nls.FlatModel) -> tuple[float, int]:
    """Run the bench sample by sample with ``solve_ivp``; return seconds for a sample and all samples."""
    system = trial.system({"observer": observer})
    plant, parts = system.plant, {"observer": observer, "servo": trial.servo}
    numbers = {name: m.start(m.parameters) for name, m in parts.items()}
    states = {name: m.start(m.states) for name, m in parts.items()}
    x, p, step = plant.start(plant.states), plant.start(plant.parameters), float(trial.servo.sample_time)
    place = [v.name for v in plant.signals].index(trial.reading)
    driven, acting = [v.name for v in plant.inputs].index(system.driven), plant.start(plant.inputs)

    def rate(t: float, at: np.ndarray) -> np.ndarray:
        return np.array(plant.equations(t, at, acting, p, [])[0]).ravel()

    begin = spent()
    for k in range(PEER_SAMPLES):
        read = float(np.array(plant.equations(0.0, x, acting, p, [])[2]).ravel()[place])
        given = {f"{PLANT}.{trial.reading}": read, f"{PLANT}.{system.driven}": float(acting[driven])}
        given |= {name: float(course[k]) for name, course in trial.inputs.items()}
        outputs = {}
        for name, model in parts.items():
            u = [given[system.sources[f"{name}.{v.name}"]] for v in model.inputs]
            w = model.look_up(list(states[name]), u)
            after = model.equations(0.0, states[name], u, numbers[name], w)
            states[name], outputs[name] = (np.array(each).ravel() for each in after[:2])
        x = solve_ivp(rate, (0.0, step), x, rtol=1e-6, atol=1e-9).y[:, -1]
        acting[driven] = outputs["servo"][0]
    return (spent() - begin) / PEER_SAMPLES, round(trial.stop / step)


def errors(deck: str, model: nls.FlatModel) -> None:
    """Print the time of the errors over draws, and that of the peer."""
    trial, observer = observer_bench(model), nls.design_observer(model, gain=CascadeGain())
    found, ours = timed(
        lambda: observer_errors({"cascade": observer}, trial, draws=DRAWS, bounded=0, translate=natively)
    )
    each, samples = stepwise(trial, observer)
    runs = DRAWS - found.lost
    theirs = each * samples * runs
    print(
        f"{deck}: errors of the cascade over {DRAWS} draws and for each cause {ours:.1f} s with compilation; "
        f"the {runs} draws alone by solve_ivp sample by sample {theirs:.0f} s (extrapolated from "
        f"{PEER_SAMPLES} of {samples} samples of one run), ratio {theirs / ours:.0f}",
        flush=True,
    )


def main() -> None:
    """Print all times."""
    load, cores = os.getloadavg()[0], os.cpu_count() or 1
    print(f"load {load:.1f} on {cores} cores before; CPU seconds, which a busy machine lengthens a little")
    for deck in DECKS:
        model = nls.flatten(nls.declare(nls.load_deck(deck)))
        co_designs(deck, model)
        errors(deck, model)
        _, taken = timed(lambda model=model: nls.design_observer(model))
        print(f"{deck}: design_observer, by the error over the spread {taken:.1f} s", flush=True)


if __name__ == "__main__":
    main()
