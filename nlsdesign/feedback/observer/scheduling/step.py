"""One step of an observer, as matrices of the measured angle that become entries of a table.

A sample is discretised exactly by the matrix exponential, never by Euler: at 1 kHz forward Euler turns the
pole of the printed relaxation, −1411 1/s, into a factor −0.41 per sample instead of +0.24. Dry friction
follows in a step of its own. A gain rule chooses the correction at each angle: x̂ = x̂⁻ + M(θ)·(y − C·x̂⁻).
"""

from __future__ import annotations

import math
import re
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from functools import cached_property
from itertools import product
from typing import NamedTuple, Protocol, TypeAlias, runtime_checkable

import casadi as ca
import numpy as np
import scipy
from numpy.typing import NDArray

from ....foundation.arrays import Array
from ....foundation.errors import ValueRangeError, unknown_name
from ....foundation.symbolic import Expression
from ....model import Variable
from ...analysis.kalman import discrete_noise, steady_state_kalman
from .angle_form import AngleScheduledPlant
from .table import Entry


def held(a: Array, b: Array, sample_time: float) -> tuple[Array, Array]:
    """Return Φ and Γ of x⁺ = Φx + Γu for an input that is held over the sample.

    ``a``, ``b``: shapes (..., n, n) and (..., n, m); ẋ = A x + B u.
    """
    n, m = b.shape[-2:]
    block = np.zeros((*a.shape[:-2], n + m, n + m))
    block[..., :n, :n], block[..., :n, n:] = a, b
    whole = _exponentials(block * sample_time)
    return whole[..., :n, :n], whole[..., :n, n:]


def linear(a: Array, sample_time: float) -> tuple[Array, Array, Array]:
    """Return Φ, Γ₀ and Γ₁ of x⁺ = Φx + Γ₀g₀ + Γ₁g₁ for a drive that runs linearly from g₀ to g₁.

    ẋ = A x + g(t). Source: Van Loan 1978.
    """
    n = a.shape[-1]
    block = np.zeros((*a.shape[:-2], 3 * n, 3 * n))
    block[..., :n, :n] = a * sample_time
    block[..., :n, n : 2 * n] = np.eye(n) * sample_time
    block[..., n : 2 * n, 2 * n :] = np.eye(n)
    whole = _exponentials(block)
    end = whole[..., :n, 2 * n :]
    return whole[..., :n, :n], whole[..., :n, n : 2 * n] - end, end


def _exponentials(blocks: Array) -> Array:
    """Return the exponential of each matrix; those that are equal at all angles are computed once."""
    if (
        blocks.ndim == 3
        and len(blocks) > 1
        and np.array_equal(blocks, np.broadcast_to(blocks[0], blocks.shape))
    ):
        return np.broadcast_to(scipy.linalg.expm(blocks[0]), blocks.shape).copy()
    result: Array = scipy.linalg.expm(blocks)
    return result


def speed_change(rate: Expression, speed: Expression, sample_time: float) -> Expression:
    """Return what friction takes from a speed within one sample, as an expression of the speed before.

    Friction is stiff near zero speed: held at its value it would throw the speed from side to side. So it
    comes last (Lie splitting), its step is the exponential Rosenbrock–Euler one, Δω = T·f·(e^x − 1)/x with
    x = T·∂f/∂ω, which is exact where f is linear, and it may stop the speed but not turn it around. Here f is
    the rate that friction gives the speed. At rest the slope is that beside it: a speed of zero and one of
    1e-21 rad/s, which differ by rounding, must give the same covariance.
    """
    x = sample_time * ca.jacobian(rate, speed)
    # Away from zero, where the quotient is undefined; its limit there is one.
    x = x - 1e-9 * (ca.fabs(x) < 1e-9)
    after = speed + sample_time * rate * ca.expm1(x) / x
    return after * (after * speed >= 0) - speed


Spectrum: TypeAlias = NDArray[np.complex128]


@dataclass(frozen=True, eq=False)
class SampledPlant:
    """The plant at one angle over one sample."""

    angle: float  # in rad
    a: Array  # continuous, shape (n, n)
    transition: Array  # Φ = e^(AT), shape (n, n)
    output_matrix: Array  # C, shape (r, n); the angle comes first
    names: tuple[str, ...]
    sizes: Array  # typical sizes of the states, shape (n,)
    sample_time: float  # T in s
    speed: str  # name of the state that is the rate of the measured angle

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
        """Return the rule for each angle."""
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
    with dry friction; :func:`~nlsdesign.feedback.observer.check_stability` looks, and says what is left.

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

    A state that is measured besides the angle has a pole of its own, and its innovation takes from the others
    what they would inherit of its error. Of the rest the angle is the one output, so its gain is unique and
    follows from Ackermann's formula. Where that rest is not observable (at zero angle), it is decomposed as
    in the paper: the poles of the part that is seen are placed, the part that is not keeps its own and gets
    no correction.

    Notes
    -----
    The error is stable at every frozen angle. Nothing follows from that for an angle that moves, and near
    zero angle the gains grow without bound; that is why the other rules exist.

    Parameters
    ----------
    poles
        One per state, continuous time, in 1/s, with negative real part; complex ones in pairs. The last ones
        are those of what is measured besides the angle.
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
            If there is not one stable pole per state, one is beyond half the sample rate, or complex ones are
            not in pairs.
        """
        return self.with_slopes(plant)[0]

    def with_slopes(self, plant: SampledPlant) -> tuple[Array, Spectrum]:
        """Return M, and its slopes by each pole that is placed through the angle, shape (k, n, r).

        Those by a pair of complex poles are complex; what the pair does together is real.

        Raises
        ------
        ValueRangeError
            As :meth:`correction`.
        """
        output, time = plant.output_matrix, plant.sample_time
        beside = [int(np.argmax(row)) for row in output[1:]]
        chain = [i for i in range(len(plant.a)) if i not in beside]
        self._check(plant, [plant.names[i] for i in (*chain, *beside)])
        poles: Spectrum = np.array(self.poles, dtype=np.complex128)
        scale = plant.sizes[chain]
        a, c = plant.a[np.ix_(chain, chain)] * scale / scale[:, None], output[0, chain] * scale
        seen, hidden = _decomposed(a * time, c[None, :], self.condition_limit)
        moved = list(range(len(chain)))
        for eigenvalue in np.linalg.eigvals(hidden.T @ a @ hidden):
            real = [k for k in moved if not poles[k].imag] or moved
            moved.remove(min(real, key=lambda k: abs(poles[k] - eigenvalue)))
        if abs(np.sum(poles[moved].imag)) > 0.0:
            raise ValueRangeError(
                f"poles {self.poles}", f"are not in pairs of what is seen at {plant.angle:g} rad",
                next_step="give complex poles in pairs, and a real one for each state that may not be seen",
            )  # fmt: skip
        step = scipy.linalg.expm(seen.T @ a @ seen * time) - np.eye(len(moved))
        placed, slopes = _ackermann(step, c @ seen, np.expm1(poles[moved] * time))
        gain: Spectrum = np.zeros((1 + len(chain), *output.T.shape), dtype=np.complex128)
        gain[np.ix_([0], chain, [0])] = (scale * (seen @ placed))[None, :, None]
        paces = time * np.exp(poles[moved] * time)
        for k, pace, slope in zip(moved, paces, slopes, strict=True):
            gain[1 + k, chain, 0] = scale * (seen @ (pace * slope))
        for column, (state, pole) in enumerate(zip(beside, poles[len(chain) :], strict=True), start=1):
            gain[0, :, column] = plant.transition[:, state]
            gain[0, state, column] -= np.exp(pole * time)
        # The gain of the prediction, L = Φ M, is what is placed.
        both: Spectrum = np.asarray(np.linalg.solve(plant.transition, gain), dtype=np.complex128)
        return both[0].real, both[1:]

    def _check(self, plant: SampledPlant, order: Sequence[str]) -> None:
        """Refuse poles that are not one per state, not stable, or faster than the sample rate carries."""
        poles = np.array(self.poles)
        if len(poles) != len(order):
            raise ValueRangeError(
                f"poles {self.poles}",
                f"needs {len(order)} poles with negative real part, one per state: {', '.join(order)}",
            )
        wrong = [
            f"{p:g} for {n}" for n, p in zip(order, self.poles, strict=True) if not complex(p).real < 0.0
        ]
        if wrong:
            raise ValueRangeError(
                f"poles {self.poles}",
                f"needs negative real parts, not {', '.join(wrong)}; they stand for {', '.join(order)}",
            )
        fastest = math.pi / plant.sample_time
        if np.max(np.abs(poles)) > fastest:
            raise ValueRangeError(
                f"poles {self.poles}",
                f"are faster than the sample rate carries, {fastest:.4g} 1/s at one sample every "
                f"{plant.sample_time:g} s",
                next_step=f"ask for poles within {fastest:.3g} 1/s, or sample faster",
            )


def _decomposed(a: Array, c: Array, limit: float) -> tuple[Array, Array]:
    """Return orthonormal bases of what is seen and of what is not."""
    rows = [c]
    for _ in range(len(a) - 1):
        rows.append(rows[-1] @ a)
    _, singular, directions = np.linalg.svd(np.vstack(rows))
    rank = int(np.sum(singular > singular[0] / limit))
    return directions[:rank].T, directions[rank:].T


def _ackermann(a: Array, c: Array, poles: Spectrum) -> tuple[Array, list[Spectrum]]:
    """Return the gain that gives A − L·c these eigenvalues, and its slopes by each of them."""
    rows = [c]
    for _ in range(len(a) - 1):
        rows.append(rows[-1] @ a)
    last = np.linalg.solve(np.array(rows), np.eye(len(a))[-1]).astype(np.complex128)

    def factored(factors: Spectrum) -> Spectrum:
        """Return Π (A − μᵢ)·q over some eigenvalues."""
        value = last
        for eigenvalue in factors:
            value = a @ value - eigenvalue * value
        return value

    return np.real(factored(poles)), [-factored(np.delete(poles, k)) for k in range(len(poles))]


class _Titles(NamedTuple):
    """Rows (number, variable, start of the name) and columns (number, end of the name, unit) of a matrix."""

    rows: list[tuple[int, Variable, str]]
    columns: list[tuple[int, str, str]]


@dataclass(frozen=True, eq=False)
class ObserverStep:
    """What happens between two samples, written as matrices of the measured angle.

    With y the measured angle (and what follows from it), s the memory and e the innovation:
    x̂⁻ = s + γ₁(θ), then friction, e = y − C·x̂⁻, x̂ = x̂⁻ + M(θ)·e, estimate = t(θ)·x̂ + t₀(θ), and
    s⁺ = Φ(θ)·x̂ + γ₀(θ) + Γ(θ)·d(u) + Γ_δ(θ)·δ̇. What the angle drives runs linearly between samples: γ₀ is
    its part at the beginning of a sample, γ₁ at the end, which is known only when the next angle is. In the
    published form it is held instead, γ₁ = 0: there it is the offset of a tangent in the extension.
    """

    plant: AngleScheduledPlant  # in the form of an angle-scheduled plant
    gain: GainRule  # chooses M
    sample_time: float  # in s
    reference: Array  # angles over which typical sizes of the sums are taken

    def matrices(self, angles: Array) -> dict[str, Array]:
        """Return the matrices of the step at many angles."""
        correction = np.array([self.gain.correction(plant) for plant in self.sampled(angles)])
        return {**without_correction(self.plant, self.sample_time, angles), "correction": correction}

    def sampled(self, angles: Array) -> list[SampledPlant]:
        """Return the plant at each angle, for which a gain is chosen."""
        plant, a = self.plant, self.plant.at(angles).a
        transition, time = linear(a, self.sample_time)[0], self.sample_time
        return [
            SampledPlant(
                float(angles[k]), a[k], transition[k], plant.output_matrix, plant.names, plant.sizes, time,
                plant.speed,
            )
            for k in range(len(angles))
        ]  # fmt: skip

    def factors(self) -> dict[str, Array]:
        """Return the typical size of what the columns of each matrix multiply."""
        plant, sizes = self.plant, self.plant.sizes
        # How fast things happen; an innovation is at most what happens in one sample.
        angle, speed = plant.moving
        pace = sizes[speed] / sizes[angle]
        innovation = min(1.0, self.sample_time * pace) * np.abs(plant.output_matrix) @ sizes
        led = [sizes[plant.names.index(name)] for name in plant.measured] or [0.0]
        known = pace * np.concatenate([sizes[list(plant.rows)], led])
        return {
            "prior": np.ones(1),
            "correction": innovation,
            "next": np.concatenate([sizes, [1.0], known]),
            "estimate": np.concatenate([sizes, [1.0]]),
            "shift": np.ones(1),
            "measured": np.ones(1),
        }

    @cached_property
    def scales(self) -> dict[str, Array]:
        """Return the typical size of each sum: of what it adds in one sample, not of what it carries."""
        m, factor, sizes = self.matrices(self.reference), self.factors(), self.plant.sizes
        n = len(sizes)
        added = np.abs(m["next"] - np.eye(n, m["next"].shape[2])[None]) * factor["next"]
        step = np.maximum(np.max(added, axis=(0, 2)), np.max(np.abs(m["prior"]), axis=(0, 2)))
        step = np.where(step > 0.0, step, sizes)
        estimate = np.max(np.abs(m["estimate"]) * factor["estimate"], axis=(0, 2))
        measured = [sizes[self.plant.names.index(name)] for name in self.plant.measured]
        return {
            "prior": step, "correction": step, "next": step, "estimate": estimate, "shift": sizes,
            "measured": np.array(measured),
        }  # fmt: skip

    def entries(self, angles: Array) -> list[Entry]:
        """Return all entries at many angles, with the key ``<matrix>[i][j]``."""
        matrices, entries = self.matrices(angles), []
        # The estimate first: where entries share a column, it is one that the estimate needs exactly.
        for kind in ("estimate", "next", "prior", "correction", "shift", "measured"):
            values, weights, titles = matrices[kind], self._weights[kind], self._titles(kind)
            for (i, row, start), (j, end, unit) in product(titles.rows, titles.columns):
                name = f"{start}.{end}" if end else start
                total = row.name if kind not in ("shift", "measured") else start
                entries.append(
                    Entry(
                        f"{kind}[{i}][{j}]",
                        total,
                        name,
                        _per(row.unit, unit),
                        values[:, i, j],
                        float(weights[i, j]),
                    )
                )
        return entries

    def _titles(self, kind: str) -> _Titles:
        """Return how rows and columns of a matrix are called in the table."""
        plant = self.plant
        of = {v.name: v for v in plant.states}
        states = [(j, f"per.{v.name}", v.unit) for j, v in enumerate(plant.states)]
        seen = [of[name] for name in (plant.angle, *plant.measured)]
        pushes = [(plant.states[r].name, f"{plant.states[r].unit}/s") for r in plant.rows]
        pushes += [(f"{name}.rate", f"{of[name].unit}/s") for name in plant.measured] or [("rate", "1")]
        n = len(states)
        ends: dict[str, list[tuple[int, str, str]]] = {
            "estimate": [*states, (n, "offset", "1")],
            "next": [
                *states,
                (n, "drive", "1"),
                *((n + 1 + j, f"push.{name}", u) for j, (name, u) in enumerate(pushes)),
            ],
            "prior": [(0, "", "1")],
            "correction": [(j, f"per.{v.name}", v.unit) for j, v in enumerate(seen)],
            "shift": [(0, "", "1")],
            "measured": [(0, "", "1")],
        }
        rows = {"estimate": [plant.estimate], "measured": seen[1:]}.get(kind, list(plant.states))
        return _Titles([(i, v, f"{kind}.{v.name}") for i, v in enumerate(rows)], ends[kind])

    @cached_property
    def _weights(self) -> dict[str, Array]:
        factors, scales = self.factors(), self.scales
        # A sum that adds nothing has no size of its own.
        return {
            kind: factors[kind][None, :] / np.where(scales[kind] > 0.0, scales[kind], 1.0)[:, None]
            for kind in factors
        }


def _per(unit: str, other: str) -> str:
    """Return the unit of a quotient: everything in ``other`` changes sides of the fraction line."""
    if other == "1":
        return unit
    pieces = re.split(r"([*/])", other)
    signs = ["*", *pieces[1::2]]
    turned = "".join(
        ("/" if sign == "*" else "*") + atom
        for sign, atom in zip(signs, pieces[::2], strict=True)
        if atom != "1"
    )
    return f"{unit}{turned}"


def without_correction(plant: AngleScheduledPlant, sample_time: float, angles: Array) -> dict[str, Array]:
    """Return the matrices of the step at many angles that no gain decides."""
    c, n, count = plant.at(angles), len(plant.states), len(angles)
    transition, begin, end = linear(c.a, sample_time)
    if plant.measured:
        # Tangents at the angle of the sample: their offset belongs to their slope and is held with it.
        begin, end = begin + end, np.zeros_like(end)
    pushed = np.zeros((count, n, len(plant.rows) + 1))
    pushed[:, list(plant.rows), range(len(plant.rows))] = 1.0
    pushed[:, :, -1] = c.rate
    _, push = held(c.a, pushed, sample_time)
    drive = c.drive[:, :, None]
    return {
        "prior": end @ drive,
        "next": np.concatenate([transition, begin @ drive, push], axis=2),
        "estimate": c.estimate[:, None, :],
        "shift": c.shift[:, :, None],
        "measured": c.measured[:, :, None],
    }
