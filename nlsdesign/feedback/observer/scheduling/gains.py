"""Rules that choose the correction of an observer at one angle: x̂ = x̂⁻ + M(θ)·(y − C·x̂⁻)."""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import dataclass
from typing import TYPE_CHECKING, Protocol, TypeAlias, runtime_checkable

import numpy as np
from numpy.typing import NDArray
from scipy.linalg import expm
from scipy.signal import place_poles

from ....foundation.errors import ConvergenceError, ValueRangeError, unknown_name
from ...analysis.kalman import discrete_noise, steady_state_kalman

if TYPE_CHECKING:
    from .plant import AngleScheduledPlant

Array = NDArray[np.float64]
Spectrum: TypeAlias = NDArray[np.complex128]


@dataclass(frozen=True, eq=False)
class SampledPlant:
    """The plant at one angle over one sample.

    Parameters
    ----------
    angle
        In rad.
    a
        Continuous, shape (n, n).
    transition
        Φ = e^(AT), shape (n, n).
    output_matrix
        C, shape (r, n); the angle comes first.
    names
        Of the states.
    sizes
        Typical sizes of the states, shape (n,).
    sample_time
        T in s.
    speed
        Name of the state that is the rate of the measured angle.
    """

    angle: float
    a: Array
    transition: Array
    output_matrix: Array
    names: tuple[str, ...]
    sizes: Array
    sample_time: float
    speed: str

    @property
    def moving(self) -> tuple[int, int]:
        """Places of the angle and of its speed among the states."""
        return int(np.argmax(self.output_matrix[0])), self.names.index(self.speed)


class GainRule(Protocol):
    """What chooses the correction."""

    def correction(self, plant: SampledPlant) -> Array:
        """Return M, shape (n, r).

        Parameters
        ----------
        plant
            The plant at one angle.
        """
        ...


@runtime_checkable
class FittedGain(Protocol):
    """What chooses the correction for all angles together, from the whole plant."""

    def fitted(self, plant: AngleScheduledPlant, sample_time: float, angles: Array) -> GainRule:
        """Return the rule for each angle.

        Parameters
        ----------
        plant
            In the form that an observer is designed on.
        sample_time
            T in s.
        angles
            Angles that stand for the range, shape (N,).
        """
        ...


@dataclass(frozen=True)
class ConstantGain:
    """One correction for every angle.

    Raises
    ------
    ValueRangeError
        If the rows are not of one length, or a number is not finite.

    Parameters
    ----------
    rows
        M, one row per state, one number per measured output.
    """

    rows: tuple[tuple[float, ...], ...]

    def __post_init__(self) -> None:
        widths = {len(row) for row in self.rows}
        if len(widths) != 1 or not all(math.isfinite(v) for row in self.rows for v in row):
            raise ValueRangeError("constant gain", "needs rows of one length with finite numbers")

    def correction(self, plant: SampledPlant) -> Array:
        """Return M; see :class:`GainRule`.

        Raises
        ------
        ValueRangeError
            If it is not made for so many states and outputs.
        """
        m = np.array(self.rows)
        if m.shape != plant.output_matrix.T.shape:
            states, outputs = plant.output_matrix.T.shape
            raise ValueRangeError(
                f"constant gain with {m.shape[0]} rows and {m.shape[1]} columns",
                f"the observer has {states} states and {outputs} measured outputs",
            )
        return m

    def __str__(self) -> str:
        rows = "; ".join(" ".join(f"{v:.6g}" for v in row) for row in self.rows)
        return f"constant gain [{rows}]"


@dataclass(frozen=True)
class CascadeGain:
    """The elementary structure whose stability needs no computation: nothing corrects the inner states.

    M is zero in the rows of the inner states ζ, one where a state is itself measured (the published
    extension), and constant in the rows of angle and speed, such that their own error has the double pole
    e^(−2πfT).

    Raises
    ------
    ValueRangeError
        If the bandwidth is not positive and finite.

    Notes
    -----
    Argument. The inner states are driven by the measured angle alone, ζ⁺ = Φ_ζ ζ + (known), so their error
    obeys e_ζ⁺ = Φ_ζ e_ζ: no correction enters, and Φ_ζ = e^(A_ζ T) is a contraction, for the printed rubber
    the number e^(−kT/η). In the published form this is L11 = a12(θ), L12 = 0: the estimate of the extension
    that drives the force is replaced by the measured one. The error of angle and speed obeys
    e_m⁺ = F e_m + G(θ) e_ζ with F constant, stable, and G bounded, because the lever arm is. A stable
    constant system driven by an exponentially vanishing error vanishes exponentially. No step asks how the
    angle moves, so the whole error vanishes exponentially for every θ(t), also where the angle says nothing
    about the force. It holds between the grid points of the table too: entries of Φ_ζ and F are the same
    number at all of them. What does not vanish is what the model has wrong.

    It needs that Φ_ζ and F do not depend on the angle. Φ_ζ does for rubber behind a soft cable, F for a drive
    with dry friction; :func:`~nlsdesign.feedback.observer.scheduling.check.check_stability` looks, and says
    what is left.

    Parameters
    ----------
    bandwidth
        f in Hz.
    """

    bandwidth: float = 30.0

    def __post_init__(self) -> None:
        if not 0.0 < self.bandwidth < math.inf:
            raise ValueRangeError(f"bandwidth {self.bandwidth:g} Hz", "must be positive")

    def correction(self, plant: SampledPlant) -> Array:
        """Return M; see :class:`GainRule`."""
        n, c = len(plant.a), plant.output_matrix
        pole = math.exp(-2.0 * math.pi * self.bandwidth * plant.sample_time)
        angle, speed = plant.moving
        run, keep = plant.transition[angle, speed], plant.transition[speed, speed]
        # F = [[1, run], [0, keep]](I − m·[1, 0]): trace 1 − m₁ − run·m₂ + keep, determinant keep(1 − m₁).
        m = np.zeros((n, len(c)))
        m[angle, 0] = 1.0 - pole**2 / keep
        m[speed, 0] = (pole - keep) ** 2 / (keep * run)
        for output in range(1, len(c)):
            m[int(np.argmax(c[output])), output] = 1.0
        return m


@dataclass(frozen=True)
class SteadyStateKalman:
    """Steady-state Kalman filter of the plant frozen at each angle.

    Parameters
    ----------
    process
        Density of white process noise of each state by name, in unit of the state per √s.
    measurement
        Standard deviation of each measured output, the angle first, in SI; an encoder has quantum/√12.
    """

    process: Mapping[str, float]
    measurement: tuple[float, ...]

    def correction(self, plant: SampledPlant) -> Array:
        """Return M; see :class:`GainRule`.

        Raises
        ------
        UnknownNameError
            If a state does not exist.
        ValueRangeError
            If there is not one standard deviation per output.
        ConvergenceError
            If there is no steady state.
        """
        for name in self.process:
            if name not in plant.names:
                raise unknown_name("state", name, plant.names)
        if len(self.measurement) != len(plant.output_matrix) or min(self.measurement) <= 0.0:
            raise ValueRangeError(
                f"measurement {self.measurement}",
                f"needs one positive standard deviation for each of the {len(plant.output_matrix)} outputs",
            )
        density = np.diag([self.process.get(name, 0.0) ** 2 for name in plant.names])
        _, noise = discrete_noise(plant.a, density, plant.sample_time)
        spread = np.array(self.measurement)
        return steady_state_kalman(plant.transition, plant.output_matrix, noise, spread)[0]


@dataclass(frozen=True)
class PolePlacement:
    """The published rule: the same poles at every angle, by a gain that is computed anew for each.

    Where the plant is not observable (at zero angle), it is decomposed as in the paper: the poles of the
    part that is seen are placed, the part that is not keeps its own and gets no correction.

    Notes
    -----
    The error is stable at every frozen angle. Nothing follows from that for an angle that moves, and near
    zero angle the gains grow without bound; that is why the other rules exist.

    Parameters
    ----------
    poles
        One per state, continuous time, in 1/s, with negative real part; complex ones in pairs.
    condition_limit
        Scaled condition of the observability matrix beyond which a direction counts as not seen.
    """

    poles: tuple[complex, ...]
    condition_limit: float = 1e6

    def correction(self, plant: SampledPlant) -> Array:
        """Return M; see :class:`GainRule`.

        Raises
        ------
        ValueRangeError
            If there is not one stable pole per state, one is beyond half the sample rate, or they cannot be
            placed.
        """
        n = len(plant.a)
        poles: Spectrum = np.array(self.poles, dtype=np.complex128)
        if len(poles) != n or np.any(poles.real >= 0.0):
            raise ValueRangeError(
                f"poles {self.poles}",
                f"needs {n} poles with negative real part, one per state: {', '.join(plant.names)}",
            )
        fastest = math.pi / plant.sample_time
        if np.max(np.abs(poles)) > fastest:
            raise ValueRangeError(
                f"poles {self.poles}",
                f"are faster than the sample rate carries, {fastest:.4g} 1/s at one sample every "
                f"{plant.sample_time:g} s",
                next_step=f"ask for poles within {fastest:.3g} 1/s, or sample faster",
            )
        scale = plant.sizes
        a = plant.a * scale[None, :] / scale[:, None]
        c = plant.output_matrix * scale[None, :]
        seen, hidden = _decomposed(a * plant.sample_time, c, self.condition_limit)
        if hidden.shape[1]:
            own = np.linalg.eigvals(hidden.T @ a @ hidden).astype(complex)
            poles = _without_nearest(poles, own)
        inner: Array = expm(seen.T @ a @ seen * plant.sample_time)
        gain = seen @ _placed(inner, c @ seen, np.exp(poles * plant.sample_time))
        # The gain of the prediction, L = Φ M, is what is placed.
        result: Array = np.asarray(np.linalg.solve(plant.transition, gain * scale[:, None]), dtype=np.float64)
        return result


def _decomposed(a: Array, c: Array, limit: float) -> tuple[Array, Array]:
    """Return orthonormal bases of what is seen and of what is not."""
    rows = [c]
    for _ in range(len(a) - 1):
        rows.append(rows[-1] @ a)
    _, singular, directions = np.linalg.svd(np.vstack(rows))
    rank = int(np.sum(singular > singular[0] / limit))
    return directions[:rank].T, directions[rank:].T


def _without_nearest(poles: Spectrum, taken: Spectrum) -> Spectrum:
    left = list(poles)
    for eigenvalue in taken:
        left.pop(int(np.argmin([abs(pole - eigenvalue) for pole in left])))
    return np.array(left)


def _placed(a: Array, c: Array, poles: Spectrum) -> Array:
    # Both methods place the poles exactly; their iterations only seek well-conditioned eigenvectors.
    method = "YT" if np.any(poles.imag) else "KNV0"
    try:
        placed = place_poles(
            a.T, c.T, poles if method == "YT" else poles.real, method=method, maxiter=10, rtol=1e-2
        )
    except ValueError as error:
        raise ValueRangeError(
            f"poles {np.round(np.asarray(poles), 6)}",
            f"cannot be placed: {error}",
            next_step="keep the poles apart",
        ) from error
    gain: Array = np.asarray(np.real(placed.gain_matrix).T, dtype=np.float64)
    reached = np.sort_complex(np.linalg.eigvals(a - gain @ c))
    if np.max(np.abs(reached - np.sort_complex(np.asarray(poles)))) > 1e-3:
        raise ConvergenceError("pole placement", f"reached {reached} instead of {poles}")
    return gain
