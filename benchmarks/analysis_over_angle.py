"""All views over the angle at 2,001 angles, against a loop over SciPy's and NumPy's calls angle by angle.

Both get the same model, rest states and noise, and Jacobians by CasADi. The peer does at each angle what a
script would: the Jacobian, ``eigvals``, ``svd`` of the observability matrix, ``expm`` for Gramian and noise
(Van Loan), ``solve_discrete_are`` for the Kalman filter. CPU seconds of one process. Printed, not asserted:
``python -m benchmarks.analysis_over_angle``.
"""

from __future__ import annotations

import time

import numpy as np
from scipy.linalg import expm, solve_discrete_are

import nlsdesign as nls
from nlsdesign.feedback.analysis import (
    EstimateDeviation,
    NoiseAssumptions,
    Observability,
    Stability,
    rest_points,
)
from nlsdesign.feedback.analysis.kalman import declared_deviation
from nlsdesign.model.linear import jacobian_function

COUNT, LAST, STEP, HORIZON = 2001, 0.9, 1e-3, 0.1
DECKS = ("austin2015_as_printed", "austin2015_figure_consistent", "one_sided_cable_drive")


def ours(model: nls.FlatModel, angles: np.ndarray) -> np.ndarray:
    """Return the standard deviation of the torque, computed with everything else."""
    views = [Observability(measured=("motor.angle",)), Stability(), EstimateDeviation()]
    return nls.over_angle(model, views, angles=angles, angle="motor.angle")["deviation.best"]


def peer(model: nls.FlatModel, angles: np.ndarray) -> np.ndarray:
    """Return the same from a loop; not a number where SciPy finds no solution.

    The slopes at the sliding speed are taken at one speed; sizes and noise are given.
    """
    points = rest_points(model, angles, angle="motor.angle")
    process = NoiseAssumptions().process(points)
    states, (angle, speed) = points.state_names, ("motor.angle", points.rate)
    density = np.diag([process.get(name, 0.0) ** 2 for name in states])
    spread, n = declared_deviation(model, angle), len(states)
    size = np.array([points.sizes[name] for name in states])
    jacobian, u, p = jacobian_function(model), model.start(model.inputs), model.start(model.parameters)
    result = np.full(len(angles), np.nan)
    for row, state in enumerate(points.states):
        moved = state.copy()
        moved[states.index(speed)] = points.typical_speed
        a, _, outputs, _ = (np.array(each) for each in jacobian(0.0, moved, u, p, []))
        c = outputs[:1]
        np.linalg.eigvals(a)
        scaled = 1e-3 * a * size / size[:, None]
        powers = [c * size / size[states.index(angle)]]
        for _ in range(n - 1):
            powers.append(powers[-1] @ scaled)
        np.linalg.svd(np.vstack(powers))
        expm(np.block([[-a.T, c.T @ c], [np.zeros((n, n)), a]]) * HORIZON / 50.0)
        whole = expm(np.block([[-a, density], [np.zeros((n, n)), a.T]]) * STEP)
        phi = whole[n:, n:].T
        noise = phi @ whole[:n, n:]
        unit = np.sqrt(np.where(np.diag(noise) > 0.0, np.diag(noise), 1.0))
        seen = c * unit / spread
        scaled_noise = (noise + noise.T) / 2.0 / np.outer(unit, unit)
        try:
            prior = solve_discrete_are((phi * unit / unit[:, None]).T, seen.T, scaled_noise, np.eye(1))
        except np.linalg.LinAlgError:
            continue  # the pencil is too close to the unit circle for it; the angle stays not a number
        posterior = prior - prior @ seen.T @ seen @ prior / (1.0 + float((seen @ prior @ seen.T).item()))
        wanted = outputs[1] * unit
        result[row] = np.sqrt(max(float(wanted @ posterior @ wanted), 0.0))
    return result


def main() -> None:
    """Print times, their ratio, and how far the results differ."""
    for deck in DECKS:
        model = nls.flatten(nls.declare(nls.load_deck(deck)), outputs=["motor.angle", "spring.torque"])
        angles = np.linspace(0.01, LAST, COUNT)
        ours(model, angles[:3])
        begin = time.process_time()
        own = ours(model, angles)
        middle = time.process_time()
        other = peer(model, angles)
        end = time.process_time()
        both = np.isfinite(own) & np.isfinite(other)
        gap = float(np.max(np.abs(own - other)[both]) / np.max(own[both]))
        print(
            f"{deck}: {COUNT} angles, all views in {middle - begin:.2f} s; loop over SciPy and NumPy "
            f"{end - middle:.1f} s, {(end - middle) / (middle - begin):.0f} times as long; deviations of the "
            f"torque differ by at most {gap:.1g} of the largest, the loop failed at {np.sum(~both)} angles",
            flush=True,
        )


if __name__ == "__main__":
    main()
