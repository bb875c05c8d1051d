"""The duty over which errors of estimates are compared, and what its numbers do along it.

Every number of the prior is p = p₀·exp(x) with x = L·ξ and independent ξ of unit variance. The effects of a
machine along the duty are torques:

- the torque of the spring at rest, over the angles of the duty;
- the part of it that relaxes at the frequencies of the duty, and what another rate of relaxation does to it;
- what the drive adds: torque by which the balance of the driven body changes along the duty.
"""

from __future__ import annotations

import math
from dataclasses import dataclass
from functools import lru_cache

import casadi as ca
import numpy as np

from ....foundation.arrays import Array
from ....foundation.errors import ArrangementError, ValueRangeError
from ...analysis.rest import evaluate_rows
from ..scheduling.angle_form import AngleForm

POINTS = 96
"""Operating points along one period of each frequency."""
SHARE = 0.5
"""Torque of a duty that states none, as a share of the torque at the end of the range of angles."""


@dataclass(frozen=True)
class Duty:
    """Sines of the torque, one after the other.

    Parameters
    ----------
    torque
        Amplitude in N·m; by default half of the torque at rest at the end of the cam's contour.
    frequencies
        In Hz.

    Raises
    ------
    ValueRangeError
        If one is not positive.
    """

    torque: float | None = None
    frequencies: tuple[float, ...] = (2.0, 5.0)

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
    slopes = _slopes_of_inputs(form.rates_and_estimate)
    at_rest = evaluate_rows(slopes, form.rest_in_model_order(np.zeros(1)), form.u, form.p)[0]
    row = at_rest.reshape(-1, len(form.u))[form.speed, form.free_inputs]
    moving = np.flatnonzero(row)
    return (float(row[moving[0]]), form.free_inputs[int(moving[0])]) if len(moving) else (0.0, None)


@lru_cache(maxsize=32)
def _slopes_of_inputs(rates: ca.Function) -> ca.Function:
    """Return the slopes of the rates in the inputs, as a function of the same arguments."""
    arguments = [rates.sx_in(i) for i in range(4)]
    return ca.Function("slopes", arguments, [ca.jacobian(rates.call(arguments)[0], arguments[2])])


STEP = 0.5
"""Change of each ξ for its effect: half a standard deviation to both sides, so that curvature cancels."""


def root_of(covariance: Array) -> Array:
    """Return R with R·Rᵀ = covariance, a column for each uncertain direction, shape (numbers, ξ)."""
    if np.array_equal(covariance, np.diag(np.diag(covariance))):
        # Independent numbers keep their own directions.
        return np.diag(np.sqrt(np.diag(covariance)))
    values, vectors = np.linalg.eigh(covariance)
    kept = values > 1e-12 * float(values[-1])
    root: Array = vectors[:, kept] * np.sqrt(values[kept])
    return root


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
