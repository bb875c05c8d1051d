"""What a motion shows of the start of each state: the empirical Gramian of the model itself, not linearised.

A Gramian at rest holds for motions so small that nothing changes. Along a motion that is large, or that goes
through sticking, slack and dead zones, the model itself says what is seen: its start is moved a little in
each state, both ways, and the change of the measured outputs is summed up.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from ...foundation.errors import ValueRangeError, unknown_name
from ...model import FlatModel
from ...model.roles import measured_motion
from ...model.transform import with_outputs
from ...simulation import simulate
from ...simulation.input_signals import Drive
from .observability import in_words

Array = NDArray[np.float64]


@dataclass(frozen=True, eq=False)
class EmpiricalGramian:
    """The empirical Gramian of one motion, in units of the typical sizes.

    Parameters
    ----------
    states
        Names, in the order of the rows.
    matrix
        In s, shape (n, n): ∫|Δy/R|² dt per (Δx/S)².
    duration
        Of the motion in s.
    measured
        Names of what is measured.
    """

    states: tuple[str, ...]
    matrix: Array
    duration: float
    measured: tuple[str, ...]

    @property
    def eigenvalues(self) -> Array:
        """In s, ascending."""
        values: Array = np.maximum(np.linalg.eigvalsh(self.matrix), 0.0)
        return values

    @property
    def condition(self) -> float:
        """Largest over smallest eigenvalue; infinite where something is not seen at all."""
        values = self.eigenvalues
        return float(values[-1] / values[0]) if values[0] > 1e-15 * values[-1] else float("inf")

    @property
    def weakest(self) -> str:
        """The direction that is seen least, in words."""
        return in_words(np.linalg.eigh(self.matrix)[1][:, 0], self.states)

    def __str__(self) -> str:
        seen = "not seen" if self.condition == float("inf") else "seen least"
        return (
            f"empirical Gramian over {self.duration:g} s from {' and '.join(self.measured)}: condition "
            f"{self.condition:.3g}, {seen}: {self.weakest}"
        )


def empirical_gramian(
    model: FlatModel,
    times: Array,
    *,
    inputs: Mapping[str, Drive] | None = None,
    start: Mapping[str, float] | None = None,
    measured: Sequence[str] = (),
    sizes: Mapping[str, float] | None = None,
    share: float = 0.01,
) -> EmpiricalGramian:
    """Return the empirical Gramian of a model along a motion.

    W = 1/(2c²)·Σ± ∫Δyᵢ±·Δyⱼ± dt, with the outputs' changes Δyᵢ± where state i starts c·Sᵢ higher or lower.
    For a linear model it is ∫e^(Aᵀt)CᵀCe^(At) dt. Source: Lall et al. 2002.

    Parameters
    ----------
    model
        Continuous; sharp laws are simulated as such.
    times
        Of the samples in s, ascending, shape (N,); the integral is taken over them.
    inputs, start
        Of the motion, as for :func:`~nlsdesign.simulation.simulate`.
    measured
        States, signals or outputs; by default the motion of the driven body.
    sizes
        Of states and measured variables by name; by default the largest value along the motion, or 1.
    share
        c, the share of its size by which the start of a state is moved.

    Raises
    ------
    UnknownNameError
        If something measured or an input or a state does not exist.
    ValueRangeError
        If the share is not positive.
    ConvergenceError
        If a run stops early.
    ArrangementError
        If nothing measured is named and the structure does not say which body is driven.
    """
    if not 0.0 < share < np.inf:
        raise ValueRangeError(f"share {share:g}", "must be positive")
    names = tuple(measured) or (measured_motion(model),)
    model = with_outputs(model, list(names))
    states, begin = tuple(v.name for v in model.states), dict(start or {})
    for name in sizes or {}:
        if name not in {*states, *names}:
            raise unknown_name("state or measured variable", name, {*states, *names})

    def run(moved: Mapping[str, float]) -> dict[str, Array]:
        trace = simulate(model, times, inputs=inputs, start={**begin, **moved}, tolerance=1e-11)
        return {name: trace[name] for name in (*names, *states)}

    motion = run({})
    largest = {name: float(np.max(np.abs(values))) or 1.0 for name, values in motion.items()}
    size = largest | dict(sizes or {})
    total = np.zeros((len(states), len(states)))
    for sign in (1.0, -1.0):
        changes = []
        for name in states:
            moved_run = run({name: float(motion[name][0]) + sign * share * size[name]})
            changes.append(np.array([(moved_run[n] - motion[n]) / size[n] for n in names]))
        products = np.einsum("irt,jrt->ijt", np.array(changes), np.array(changes))
        total += np.trapezoid(products, times, axis=-1) / (2.0 * share**2)
    return EmpiricalGramian(states, (total + total.T) / 2.0, float(times[-1] - times[0]), names)
