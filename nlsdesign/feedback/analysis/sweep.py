"""Properties of a model over its angle: one table, one row per angle, one column per property.

Below it stands the linear algebra of small systems at many angles at once: exponential, Gramian, Riccati
equation. All take stacks of matrices, shape (N, n, n), and work by doubling: what is known of a short time
gives twice that time in a few products. So a thousand angles cost little more than one.

Poles of the plant in each of its modes, and stiffness, over the angle.
"""

from __future__ import annotations

from abc import ABC, abstractmethod
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from ...foundation.arrays import Array, Mask
from ...foundation.csv_tables import Axis, data_frame, data_set
from ...foundation.errors import ValueRangeError, unknown_name
from ...foundation.quantity import typeset_unit
from ...foundation.text_files import write_table
from ...model import FlatModel, Variable
from ...model.roles import measured_motion, spring_torque
from .rest_points import PlantMode, RestPoints, rest_points


class Columns(NamedTuple):
    """What a view gives over all angles.

    ``columns``: name, unit and description of each number; ``values``, shape (N, columns); ``words``: by
    name, one text per angle.
    """

    columns: tuple[Variable, ...]
    values: Array
    words: Mapping[str, tuple[str, ...]]


class View(ABC):
    """A property over the angle; final classes say which numbers and words they give."""

    @abstractmethod
    def over(self, points: RestPoints) -> Columns:
        """Return the numbers at all angles, and findings in words.

        Parameters
        ----------
        points
            The model at rest at each angle.
        """


@dataclass(frozen=True, eq=False)
class Chart:
    """Columns of numbers over one argument, with units, and findings in words.

    Parameters
    ----------
    argument
        What was swept.
    at
        Its values, shape (n,), in SI.
    columns
        Name, unit and description of each column.
    values
        Shape (n, columns).
    words
        By name: one text per row.
    """

    argument: Variable
    at: Array
    columns: tuple[Variable, ...]
    values: Array
    words: Mapping[str, tuple[str, ...]]

    def __getitem__(self, name: str) -> Array:
        """Return one column."""
        if name == self.argument.name:
            return self.at
        names = [v.name for v in self.columns]
        if name not in names:
            raise unknown_name("column", name, names)
        return self.values[:, names.index(name)]

    def to_frame(self) -> Any:
        """Return a ``pandas.DataFrame`` indexed by the argument; units are in its ``attrs``; needs pandas."""
        data = {v.name: self.values[:, i] for i, v in enumerate(self.columns)} | dict(self.words)
        return data_frame(data, units=self._units(), index=self._axis())

    def to_xarray(self) -> Any:
        """Return an ``xarray.Dataset`` over the argument, each column with its unit; needs xarray."""
        over = (self.argument.name,)
        data: dict[str, tuple[tuple[str, ...], Any]] = {
            v.name: (over, self.values[:, i]) for i, v in enumerate(self.columns)
        }
        data |= {name: (over, np.array(texts)) for name, texts in self.words.items()}
        return data_set(data, axes=[self._axis()], units=self._units())

    def _units(self) -> dict[str, str]:
        return {v.name: v.unit for v in self.columns}

    def _axis(self) -> Axis:
        return Axis(self.argument.name, self.argument.unit, self.at)

    def write_csv(self, path: Path) -> None:
        """Write ``name [unit]`` columns, words last; nothing is left behind if writing fails.

        Parameters
        ----------
        path
            File to write.
        """
        header = [f"{v.name} [{v.unit}]" for v in (self.argument, *self.columns)] + list(self.words)
        rows = [header]
        for i, at in enumerate(self.at):
            numbers = [repr(float(value)) for value in (at, *self.values[i])]
            rows.append(numbers + [text[i] for text in self.words.values()])
        write_table(path, rows)

    def __str__(self) -> str:
        names = [f"{v.name} [{typeset_unit(v.unit) or '1'}]" for v in (self.argument, *self.columns)]
        widths = [max(len(name), 11) for name in names]
        lines = ["  ".join(name.rjust(w) for name, w in zip(names, widths, strict=True))]
        for i, at in enumerate(self.at):
            row = zip((at, *self.values[i]), widths, strict=True)
            lines.append("  ".join(f"{value:.5g}".rjust(w) for value, w in row))
        return "\n".join(lines)


def over_angle(
    model: FlatModel,
    views: Sequence[View],
    *,
    angles: Sequence[float] | Array,
    angle: str | None = None,
    consistent: Mapping[str, str] | None = None,
) -> Chart:
    """Evaluate views of a model at rest over its angle.

    Parameters
    ----------
    model
        Continuous.
    views
        For instance ``[Observability(), Stability()]``.
    angles
        Shape (n,), in rad.
    angle
        State that is swept; by default the motion of the driven body.
    consistent
        States that have to agree with a signal, as for :func:`~nlsdesign.feedback.analysis.rest.rest_states`.

    Raises
    ------
    ValueRangeError
        If an angle is not finite, the model has no finite slope at one, or it is not continuous.
    ConvergenceError
        If the model does not come to rest.
    ArrangementError
        If no angle is named and the structure does not say which body is driven.
    """
    angle = measured_motion(model, angle)
    points = rest_points(model, np.asarray(angles, dtype=float), angle=angle, consistent=consistent)
    parts = [view.over(points) for view in views]
    columns = tuple(column for each in parts for column in each.columns)
    values = np.column_stack([np.zeros((len(points.at), 0)), *(each.values for each in parts)])
    words = {name: texts for each in parts for name, texts in each.words.items()}
    return Chart(model.variable(angle), points.at, columns, values, words)


_TERMS = 14
"""Terms of the power series over the shortest time, where the norm is at most 1/8: exact to rounding."""
_DOUBLINGS = 60
"""At most this many doublings towards a steady state: 2^60 samples."""


def transposed(a: Array) -> Array:
    """Return each matrix transposed.

    ``a``: shape (N, n, m).
    """
    return np.swapaxes(a, -1, -2)


def symmetric(a: Array) -> Array:
    """Return the symmetric part of each matrix.

    ``a``: shape (N, n, n).
    """
    return (a + transposed(a)) / 2.0


def exponential_and_gramian(a: Array, weight: Array, horizon: float) -> tuple[Array, Array]:
    """Return e^(A·T) and ∫₀ᵀ e^(Aᵀt)·W·e^(At) dt of each matrix.

    A power series over a short time, then doubling: W(2t) = W(t) + e^(Aᵀt)·W(t)·e^(At). Sums of what is not
    negative, so nothing cancels. With Aᵀ for A it is the covariance of white noise. Source: Van Loan 1978.

    ``a``, ``weight``: shape (N, n, n), A in 1/s and W symmetric.
    """
    norm = float(np.max(np.sum(np.abs(a), axis=-1), initial=0.0)) * horizon
    doublings = max(0, int(np.ceil(np.log2(max(norm, 1e-300) / 0.125))))
    step = horizon / 2.0**doublings
    whole = np.broadcast_to(np.eye(a.shape[-1]), a.shape).copy()
    total = np.zeros(np.broadcast_shapes(a.shape, weight.shape))
    power, moment = whole, np.broadcast_to(weight, total.shape)
    # d/dt of e^(Aᵀt)·W·e^(At) is Aᵀ(·) + (·)A, so its k-th derivative at zero follows from the one before.
    for k in range(1, _TERMS + 1):
        total = total + moment * step / k
        moment = (transposed(a) @ moment + moment @ a) * (step / k)
        power = power @ a * (step / k)
        whole = whole + power
    for _ in range(doublings):
        total = total + transposed(whole) @ total @ whole
        whole = whole @ whole
    return whole, symmetric(total)


def covariance_without_measurement(transition: Array, noise: Array) -> Array:
    """Return P = Φ·P·Φᵀ + Q of each pair by doubling; infinite where it grows without bound.

    ``transition``, ``noise``: Φ and Q, shape (N, n, n).
    """
    total, power = noise, transition
    with np.errstate(over="ignore", invalid="ignore"):  # what grows overflows, and is said to be infinite
        for _ in range(_DOUBLINGS):
            more = power @ total @ transposed(power)
            total, power = total + more, power @ power
            if not np.any(np.abs(more) > 1e-17 * np.max(np.abs(total), axis=(-1, -2), keepdims=True)):
                break
    radius = np.max(np.abs(np.linalg.eigvals(transition)), axis=-1, initial=0.0)
    return np.where((radius < 1.0)[:, None, None], symmetric(total), np.inf)


def riccati(transition: Array, information: Array, noise: Array) -> tuple[Array, Mask]:
    """Return the steady prior covariance of each Kalman filter, and whether there is one.

    P = Φ·(P − P·Cᵀ(C·P·Cᵀ + R)⁻¹C·P)·Φᵀ + Q by structure-preserving doubling: after k steps it is the
    covariance after 2^k samples from a known start. There is no steady state where something that does not
    decay is not seen. Source: Anderson 1978.

    ``transition``: Φ, shape (N, n, n). ``information``: CᵀR⁻¹C, shape (N, n, n). ``noise``: Q, shape (N, n,
    n). Result: P, shape (N, n, n), not a number where there is none; and shape (N,), whether there is one.
    """
    size = transition.shape[-1]
    identity = np.eye(size)
    a, g, h = transposed(transition).copy(), information.copy(), noise.copy()
    settled, open_ = np.zeros(len(a), dtype=bool), np.arange(len(a))
    with np.errstate(over="ignore", invalid="ignore"):  # what grows overflows, and has no steady state
        for _ in range(_DOUBLINGS):
            an, gn, hn = a[open_], g[open_], h[open_]
            solved = np.linalg.solve(identity + gn @ hn, np.concatenate([an, gn], axis=-1))
            wa, wg = solved[..., :size], solved[..., size:]
            more = symmetric(transposed(an) @ hn @ wa)
            a[open_], g[open_] = an @ wa, symmetric(gn + an @ wg @ transposed(an))
            h[open_] = hn + more
            largest, added = (np.max(np.abs(each), axis=(-1, -2)) for each in (h[open_], more))
            settled[open_] = np.isfinite(largest) & (added <= 1e-14 * largest)
            open_ = open_[np.isfinite(largest) & ~settled[open_]]
            if not len(open_):
                break
    # Whether the error of each filter decays: Φ·(I + P·CᵀR⁻¹C)⁻¹ has all eigenvalues inside 1.
    error = transition @ np.linalg.inv(
        np.eye(transition.shape[-1]) + np.where(settled[:, None, None], h, 0.0) @ information
    )
    radius = np.max(np.abs(np.linalg.eigvals(error)), axis=-1, initial=0.0)
    decays: Mask = radius < 1.0 - 1e-12
    settled &= decays
    return np.where(settled[:, None, None], h, np.nan), settled


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
