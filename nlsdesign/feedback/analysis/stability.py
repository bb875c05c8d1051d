"""Poles of the plant in each of its modes, and stiffness, over the angle."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from ...foundation.arrays import Array
from ...foundation.errors import ValueRangeError, unknown_name
from ...model import Variable
from ...model.roles import spring_torque
from .rest_points import PlantMode, RestPoints
from .sweep import Columns, View

_STILL = 1e-9
"""Share of the size of an eigenvalue below which its real or imaginary part counts as zero."""


@dataclass(frozen=True)
class Stability(View):
    """Eigenvalues of the plant in each mode, and the two tangent stiffnesses of the spring.

    A machine with dry friction has two modes: ``sliding``, friction at its sliding level, and ``stuck``, the
    speed held at zero while the inner states go on; one without has the mode ``free``. Of each mode
    ``MODE.decay`` is the slowest real part, negative where the mode is stable; ``MODE.frequency`` and
    ``MODE.damping_ratio`` are those of the least damped oscillation, 0 and 1 where nothing oscillates.

    ``stiffness.slow``: slope of the rest torque, all inner states relaxed, ∂T/∂θ − T_z·A_zz⁻¹·A_zθ.
    ``stiffness.fast``: slope of the torque when the angle jumps, T_θ plus the jump of the inner states that
    follow the speed.

    Parameters
    ----------
    torque
        Output whose stiffness is wanted; by default the torque of the series spring.
    """

    torque: str | None = None

    def over(self, points: RestPoints) -> Columns:
        """Return the numbers; in words whether each mode is stable, and what was linearised.

        Raises
        ------
        UnknownNameError
            If the torque is no output of the model.
        """
        torque = spring_torque(points.model, self.torque)
        if torque not in points.output_names:
            raise unknown_name("output", torque, points.output_names)
        domains = [spring.domain for spring in points.model.springs if spring.effort == torque]
        unit = f"{domains[0].effort_unit}/{domains[0].motion_unit}" if domains else "N*m/rad"
        columns: list[Variable] = []
        values: list[Array] = []
        for mode in points.modes:
            name, of = mode.name, f"of the mode {mode.name!r} ({mode.words})"
            columns += [
                Variable(f"{name}.decay", "1/s", f"largest real part of the eigenvalues {of}"),
                Variable(f"{name}.frequency", "Hz", f"frequency of the least damped oscillation {of}"),
                Variable(
                    f"{name}.damping_ratio", "1", f"its damping ratio, 1 where nothing oscillates, {of}"
                ),
            ]
            values += least_damped(mode.eigenvalues)
        columns += [
            Variable("stiffness.slow", unit, f"slope of {torque} at rest, all relaxed"),
            Variable("stiffness.fast", unit, f"slope of {torque} when the angle jumps"),
        ]
        values += _stiffness(points, torque)
        words = {f"{mode.name}.stability": _verdicts(mode) for mode in points.modes}
        return Columns(tuple(columns), np.column_stack(values), words)


def least_damped(eigenvalues: NDArray[np.complex128]) -> tuple[Array, Array, Array]:
    """Return slowest real part in 1/s, and frequency in Hz and damping ratio of the least damped oscillation.

    ``eigenvalues``: of a continuous system, shape (N, n) with n > 0. Result: each of shape (N,); frequency 0
    and damping ratio 1 where nothing oscillates.
    """
    size = np.abs(eigenvalues)
    swings = np.abs(eigenvalues.imag) > _STILL * np.max(size, axis=-1, keepdims=True)
    ratios = np.where(swings, -eigenvalues.real / np.where(swings, size, 1.0), np.inf)
    least = np.argmin(ratios, axis=-1)[:, None]
    ratio, imaginary = (np.take_along_axis(e, least, axis=-1)[:, 0] for e in (ratios, eigenvalues.imag))
    any_ = np.any(swings, axis=-1)
    frequency = np.where(any_, np.abs(imaginary) / (2.0 * np.pi), 0.0)
    return np.max(eigenvalues.real, axis=-1), frequency, np.where(any_, ratio, 1.0)


def sampled_poles(matrices: Array, sample_time: float) -> tuple[Array, tuple[Array, Array, Array]]:
    """Return spectral radius of sampled systems, and what :func:`least_damped` says of the same in time.

    For the error of an observer give the matrices that
    :func:`~nlsdesign.feedback.observer.scheduling.scheduled.error_matrices` takes from it. An eigenvalue z
    counts as
    ln(z)/T; one at zero is gone after one sample, which counts as the decay to the rounding of a number.

    Parameters
    ----------
    matrices
        Of x⁺ = Φ·x, shape (N, n, n).
    sample_time
        T in s.

    Raises
    ------
    ValueRangeError
        If the sample time is not positive.
    """
    if not 0.0 < sample_time < np.inf:
        raise ValueRangeError(f"sample time {sample_time:g} s", "must be positive")
    eigenvalues = np.linalg.eigvals(matrices).astype(complex)
    radius = np.max(np.abs(eigenvalues), axis=-1)
    vanished = np.abs(eigenvalues) < np.finfo(float).eps
    in_time = np.log(np.where(vanished, np.finfo(float).eps, eigenvalues)) / sample_time
    return radius, least_damped(np.asarray(in_time, dtype=complex))


def _verdicts(mode: PlantMode) -> tuple[str, ...]:
    eigenvalues = mode.eigenvalues
    limit = _STILL * np.max(np.abs(eigenvalues), axis=-1)
    unstable = np.max(eigenvalues.real, axis=-1) > limit
    return tuple("unstable" if each else "stable or at its limit" for each in unstable)


def _stiffness(points: RestPoints, torque: str) -> tuple[Array, Array]:
    states = list(points.state_names)
    angle, speed = states.index(points.angle), states.index(points.rate)
    inner = [i for i in range(len(states)) if i not in (angle, speed)]
    row = points.c[:, points.output_names.index(torque)]
    jump = row[:, angle] + np.einsum("Ni,Ni->N", row[:, inner], points.a[:, inner, speed])
    if not inner:
        return jump, jump
    # All relaxed: A_zz dz + A_zθ dθ = 0. By pseudo-inverse, because a free integrator has no rest of its own.
    own = np.linalg.pinv(points.a[:, inner][:, :, inner])
    relaxed = np.einsum("Nij,Nj->Ni", own, points.a[:, inner, angle])
    return row[:, angle] - np.einsum("Ni,Ni->N", row[:, inner], relaxed), jump
