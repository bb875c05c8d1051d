"""What an adaptive observer is designed for: a duty, its trust in the equations, few uncertain directions.

The duty is the motion over which errors of estimates are compared. The directions are those combinations of
uncertain numbers that a machine notices on it: few in the space of all of them.

Every number of the prior is p = p₀·exp(x) with x = L·ξ and independent ξ of unit variance. Most ξ change
nothing that matters, and many change the same: the moduli of a rubber, its section and its length all scale
the torque. The effects of the ξ, each in N·m, are the columns of one matrix:

- the torque of the spring at rest, over the angles of the duty;
- the part of it that relaxes at the frequencies of the duty, and what another rate of relaxation does to it;
- what the drive adds: torque by which the balance of the driven body changes along the duty.

Its singular value decomposition gives orthonormal directions in ξ, so each has unit variance and they stay
independent, in the order of the torque that they move. Those below a stated torque are left out, and their
sum is stated: no observer of this form can know that part.
"""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import dataclass, field

import casadi as ca
import numpy as np

from ....foundation.arrays import Array
from ....foundation.errors import ArrangementError, ValueRangeError
from ....simulation.prior import Prior
from ...analysis.rest import evaluate_rows
from ..scheduling.angle_form import AngleForm

POINTS = 96
"""Operating points along one period of each frequency."""
SHARE = 0.5
"""Torque of a duty that states none, as a share of the torque at the end of the range of angles."""


@dataclass(frozen=True)
class Duty:
    """Sines of the torque, one after the other."""

    # torque: amplitude in N·m; by default half of the torque at rest at the end of the cam's contour
    torque: float | None = None
    frequencies: tuple[float, ...] = (2.0, 5.0)  # in Hz

    def __post_init__(self) -> None:
        if self.torque is not None and not self.torque > 0.0:
            raise ValueRangeError(f"torque {self.torque:g} N·m of a duty", "must be positive")
        if not self.frequencies or not all(f > 0.0 and math.isfinite(f) for f in self.frequencies):
            raise ValueRangeError(f"frequencies {self.frequencies} Hz of a duty", "must be positive")


@dataclass(frozen=True, eq=False)
class OperatingPoints:
    """States and inputs along a duty, in which inner states rest."""

    angles: Array  # shape (n,), in rad
    states: Array  # in the order of the model, shape (n, states)
    inputs: Array  # shape (n, inputs)
    # carried: inner states as the observer carries them after a jump from zero angle, shape (n, states)
    carried: Array
    pulsations: tuple[float, ...]  # 2π times the frequencies, in rad/s
    inertia: float  # what the torque of the spring accelerates, in kg·m²
    amplitude: float  # of the angle, in rad
    torque: float  # amplitude of the torque at rest


def operating_points(form: AngleForm, duty: Duty) -> OperatingPoints:
    """Return states and inputs along a duty."""
    amplitude, torque = _amplitude(form, duty)
    phase = 2.0 * np.pi * (np.arange(POINTS) + 0.5) / POINTS
    pulsations = tuple(2.0 * math.pi * f for f in duty.frequencies)
    angles = np.concatenate([amplitude * np.sin(phase) for _ in pulsations])
    speeds = np.concatenate([amplitude * w * np.cos(phase) for w in pulsations])
    wanted = np.concatenate([-amplitude * w**2 * np.sin(phase) for w in pulsations])
    inertia = spring_inertia(form)
    x = form.rest_in_model_order(angles)
    x[:, form.speed_state] = speeds
    u = np.tile(form.u, (len(angles), 1))
    rate, _ = evaluate_rows(form.rates_and_estimate, x, u, form.p)
    slope, place = push(form)
    if place is not None:
        u[:, place] += (wanted - rate[:, form.speed]) / slope
    before = form.rest(np.zeros(1)) - form.at(np.zeros(1)).shift
    carried = form.rest(angles) - form.at(angles).shift - before
    return OperatingPoints(angles, x, u, carried, pulsations, inertia, amplitude, torque)


def spring_inertia(form: AngleForm) -> float:
    """Return the inertia that the torque of the spring accelerates, from the model at rest, in kg·m²."""
    x = form.rest_in_model_order(form.layout.angles)
    rate, wanted = evaluate_rows(form.rates_and_estimate, x, np.tile(form.u, (len(x), 1)), form.p)
    largest = int(np.argmax(np.abs(wanted[:, 0])))
    acceleration = float(rate[largest, form.speed])
    if acceleration == 0.0:
        raise ArrangementError(
            f"model '{form.model.name}'", "has a spring whose torque does not move the measured body",
            next_step="measure the angle of the body that the spring acts on",
        )  # fmt: skip
    return float(-wanted[largest, 0] / acceleration)


def _amplitude(form: AngleForm, duty: Duty) -> tuple[float, float]:
    """Return the amplitudes of angle and torque, the spring at rest."""
    ends = form.layout.angles
    grid = np.linspace(0.0, min(-float(ends[0]), float(ends[-1])) or float(ends[-1]), 201)
    c = form.at(grid)
    torque = np.einsum("aj,aj->a", c.estimate[:, :-1], form.rest(grid) - c.shift) + c.estimate[:, -1]
    size = np.abs(torque - torque[0])
    wanted = SHARE * float(np.max(size)) if duty.torque is None else duty.torque
    beyond = np.flatnonzero(size >= wanted)
    if not len(beyond):
        raise ValueRangeError(
            f"torque {wanted:g} N·m of a duty",
            f"the spring has at most {np.max(size):.3g} N·m at rest within {np.degrees(grid[-1]):.3g}°",
        )
    return float(np.interp(wanted, size[: beyond[0] + 1], grid[: beyond[0] + 1])), wanted


def push(form: AngleForm) -> tuple[float, int | None]:
    """Return what the first input that moves the body adds to its acceleration per unit, and its place.

    Result: slope, and place among the inputs of the model; ``None`` where no input moves the body.
    """
    driven, rows = form.driven()
    if form.speed not in rows:
        return 0.0, None
    u = ca.SX.sym("u", len(form.free_inputs))
    slopes = ca.Function("slopes", [u], [ca.jacobian(ca.SX(driven(u)), u)])
    start = np.array([form.u[i] for i in form.free_inputs])
    row = slopes(start).full()[rows.index(form.speed)]
    moving = np.flatnonzero(row)
    return (float(row[moving[0]]), form.free_inputs[int(moving[0])]) if len(moving) else (0.0, None)


@dataclass(frozen=True)
class Trust:
    """How far the filter trusts its equations.

    Parameters
    ----------
    unmodelled
        Torque that the equations miss, one standard deviation, as a share of the torque of the duty.
    correlation_time
        Time in s over which it stays the same.
    drift_time
        Time in s of motion after which the machine may lie anywhere within its spreads again, as rubber
        creeps and warms up. At standstill nothing is forgotten.
    counts
        Standard deviation of the measured angle in units of that of an ideal encoder, quantum/√12.
    limit
        Largest distance of a slow state from the deck, in standard deviations.
    surprise
        Innovation in standard deviations from which on it corrects the slow states no further.
    smallest
        Smallest torque that a slow state moves per standard deviation, as a share of that of the duty.
    most
        Largest number of slow states.

    Raises
    ------
    ValueRangeError
        If a number is not positive.
    """

    unmodelled: float = 0.02
    correlation_time: float = 0.02
    drift_time: float = 60.0
    counts: float = 4.0
    limit: float = 2.5
    surprise: float = 3.0
    smallest: float = 0.0004
    most: int = 12

    def __post_init__(self) -> None:
        for name in (
            "unmodelled",
            "correlation_time",
            "drift_time",
            "counts",
            "limit",
            "surprise",
            "smallest",
            "most",
        ):
            value = getattr(self, name)
            if not (math.isfinite(value) and value > 0):
                raise ValueRangeError(f"{name} {value:g}", "must be positive")


@dataclass(frozen=True, eq=False)
class AdaptiveSettings:
    """What an adaptive observer is designed for.

    Parameters
    ----------
    prior
        What is known of the numbers; the spreads of the deck by default.
    duty
        What the actuator does.
    trust
        How far the equations are trusted.
    """

    prior: Prior | None = None
    duty: Duty = field(default_factory=Duty)
    trust: Trust = field(default_factory=Trust)


STEP = 0.5
"""Change of each ξ for its effect: half a standard deviation to both sides, so that curvature cancels."""


@dataclass(frozen=True, eq=False)
class UncertainDirections:
    """Directions in the space of uncertain numbers, each with unit variance."""

    names: tuple[str, ...]  # numbers that move, in the order of the rows
    # slopes: change of the logarithm of each number per unit of each direction, shape (numbers, directions)
    slopes: Array
    # effect: root mean square torque that each direction moves per standard deviation, in the unit of the
    # torque, descending, shape (directions,)
    effect: Array
    # torque_share: part of that effect that is one on the estimated torque itself, not on the drive, shape
    # (directions,)
    torque_share: Array
    left_out: float  # root mean square torque of all directions that were left out

    def values(self, nominal: Mapping[str, float], at: Array) -> dict[str, float]:
        """Return the numbers at a point."""
        factors = np.exp(self.slopes @ at)
        return {name: nominal[name] * float(f) for name, f in zip(self.names, factors, strict=True)}

    def in_words(self, direction: int) -> str:
        """Return the numbers that change most along a direction, per standard deviation."""
        column = self.slopes[:, direction]
        order = np.argsort(-np.abs(column))
        largest = [int(i) for i in order if abs(column[i]) >= 0.3 * abs(column[order[0]])][:4]
        parts = [f"{self.names[i]} {np.expm1(column[i]):+.1%}" for i in largest]
        return ", ".join(parts) + (", …" if len(order) > len(largest) else "")


def uncertain_directions(
    form: AngleForm, prior: Prior, duty: Duty, *, resolution: float, most: int
) -> UncertainDirections:
    """Return the directions that move more torque than a resolution, the largest first."""
    known = prior.only([name for name in prior.names if name in form.model.values])
    count = 0
    if np.any(known.deviations):
        root = root_of(known.covariance)
        features, own = _features(form, operating_points(form, duty), known, root)
        left, singular, right = np.linalg.svd(features, full_matrices=False)
        count = min(int(np.sum(singular > resolution)), most)
    if count == 0:
        raise ArrangementError(
            f"model '{form.model.name}'",
            f"has no uncertain numbers that move the torque by more than {resolution:.2g}",
            next_step="an observer without slow states is enough: leave the adaptation out",
        )
    slopes = root @ right[:count].T
    # The sign of a singular vector is arbitrary: the largest change is upward.
    signs = np.sign(slopes[np.argmax(np.abs(slopes), axis=0), np.arange(count)])
    share = np.linalg.norm(left[:own, :count], axis=0)
    moved = np.flatnonzero(np.max(np.abs(slopes), axis=1) > 1e-6)
    return UncertainDirections(
        tuple(known.names[i] for i in moved),
        (slopes * signs)[moved],
        singular[:count],
        share,
        float(np.linalg.norm(singular[count:])),
    )


def root_of(covariance: Array) -> Array:
    """Return R with R·Rᵀ = covariance, a column for each uncertain direction, shape (numbers, ξ)."""
    if np.array_equal(covariance, np.diag(np.diag(covariance))):
        # Independent numbers keep their own directions.
        return np.diag(np.sqrt(np.diag(covariance)))
    values, vectors = np.linalg.eigh(covariance)
    kept = values > 1e-12 * float(values[-1])
    root: Array = vectors[:, kept] * np.sqrt(values[kept])
    return root


def _features(form: AngleForm, points: OperatingPoints, prior: Prior, root: Array) -> tuple[Array, int]:
    """Return the effects in units of torque, shape (rows, ξ), and how many rows are of the torque itself."""
    columns = []
    for k in range(root.shape[1]):
        effects = []
        for sign in (1.0, -1.0):
            shifted = prior.numbers(sign * STEP * root[:, k])
            changed = form.with_values(dict(zip(prior.names, shifted, strict=True)))
            effects.append(effects_of(changed, points))
        up, down = effects
        columns.append([(a - b) / (2.0 * STEP) for a, b in zip(up, down, strict=True)])
    own = np.array([column[0] for column in columns]).T
    drive = np.array([column[1] for column in columns]).T
    return np.vstack([own, drive]), len(own)


def effects_of(form: AngleForm, points: OperatingPoints) -> tuple[Array, Array]:
    """Return what the spring gives and what the drive adds, as torques along the duty."""
    k, c = form.inner, form.at(points.angles)
    rest = np.einsum("aj,aj->a", c.estimate[:, :-1], form.rest(points.angles) - c.shift) + c.estimate[:, -1]
    rows = [rest]
    jump = c.estimate[:, :k] * points.carried[:, :k]
    rates = np.maximum(np.abs(np.einsum("aii->ai", c.a[:, :k, :k])), 1e-12)
    for omega in points.pulsations:
        # A relaxing part that follows a sine: jω/(jω + a) of its jump, with a the rate of relaxation.
        passed = 1j * omega / (1j * omega + rates) / np.sqrt(len(points.pulsations))
        rows.extend((jump * passed.real).T)
        rows.extend((jump * passed.imag).T)
    own = np.concatenate(rows) / np.sqrt(len(points.angles))
    rate, wanted = evaluate_rows(form.rates_and_estimate, points.states, points.inputs, form.p)
    drive = (points.inertia * rate[:, form.speed] + wanted[:, 0]) / np.sqrt(len(rate))
    return own, drive
