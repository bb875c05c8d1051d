"""Stability and stiffness of the model at rest."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from ..errors import unknown_name
from ..model import FlatModel, Variable
from ..model.roles import spring_torque
from .rest import rate_state
from .sweep import RestPoint, View

Array = NDArray[np.float64]


@dataclass(frozen=True)
class Stability(View):
    """Eigenvalues at rest and the two tangent stiffnesses of the spring.

    ``stiffness.slow``: slope of the rest torque, all inner states relaxed, ∂T/∂θ − T_z·A_zz⁻¹·A_zθ.
    ``stiffness.fast``: slope of the torque when the angle jumps, T_θ plus the jump of the inner states that
    follow the speed. ``decay``: the slowest real part of all eigenvalues, negative where the model is stable.

    Parameters
    ----------
    torque
        Output whose stiffness is wanted; by default the torque of the series spring.
    """

    torque: str | None = None

    def columns(self, model: FlatModel) -> tuple[Variable, ...]:
        """Return the columns.

        Raises
        ------
        UnknownNameError
            If the torque is no output of the model.
        """
        torque = spring_torque(model, self.torque)
        if torque not in {v.name for v in model.outputs}:
            raise unknown_name("output", torque, (v.name for v in model.outputs))
        unit = _stiffness_unit(model, torque)
        return (
            Variable("decay", "1/s", "largest real part of all eigenvalues at rest"),
            Variable("oscillation", "rad/s", "largest imaginary part of all eigenvalues at rest"),
            Variable(
                "damping_ratio",
                "1",
                "smallest damping ratio of the oscillating eigenvalues; 1 where there are none",
            ),
            Variable("stiffness.slow", unit, f"slope of {torque} at rest, all relaxed"),
            Variable("stiffness.fast", unit, f"slope of {torque} when the angle jumps"),
        )

    def at(self, point: RestPoint) -> tuple[tuple[float, ...], dict[str, str]]:
        """Return the numbers; no words but a warning where the model is unstable."""
        eigenvalues = np.linalg.eigvals(point.linear.A)
        moving = eigenvalues[np.abs(eigenvalues.imag) > 1e-9 * np.abs(eigenvalues)]
        damping = float(np.min(-moving.real / np.abs(moving))) if len(moving) else 1.0
        slow, fast = self._stiffness(point)
        decay = float(np.max(eigenvalues.real))
        text = "unstable" if decay > 1e-9 * float(np.max(np.abs(eigenvalues))) else "stable or at its limit"
        return (decay, float(np.max(np.abs(eigenvalues.imag))), damping, slow, fast), {"stability": text}

    def _stiffness(self, point: RestPoint) -> tuple[float, float]:
        linear, states = point.linear, list(point.linear.states)
        angle, speed = states.index(point.angle), states.index(rate_state(point.model, point.angle))
        inner = [i for i in range(len(states)) if i not in (angle, speed)]
        row = linear.C[list(linear.outputs).index(spring_torque(point.model, self.torque))]
        jump = float(row[angle] + row[inner] @ linear.A[inner, speed])
        if not inner:
            return jump, jump
        # All relaxed: A_zz dz + A_zθ dθ = 0. Least squares, because a free integrator has no rest of its own.
        relaxed = np.linalg.lstsq(linear.A[np.ix_(inner, inner)], linear.A[inner, angle], rcond=None)[0]
        return float(row[angle] - row[inner] @ relaxed), jump


def _stiffness_unit(model: FlatModel, torque: str) -> str:
    domains = [spring.domain for spring in model.springs if spring.effort == torque]
    return f"{domains[0].effort_unit}/{domains[0].motion_unit}" if domains else "N*m/rad"
