"""What an actuator does while it is observed: the motion over which errors of estimates are compared."""

from __future__ import annotations

import math
from dataclasses import dataclass

import casadi as ca
import numpy as np
from numpy.typing import NDArray

from ....foundation.errors import ArrangementError, ValueRangeError
from ...analysis.rest import evaluate_rows
from ..scheduling.angle_form import AngleForm

Array = NDArray[np.float64]

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
        If torque or a frequency is not positive, or there is no frequency.
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
    """States and inputs along a duty, in which inner states rest.

    Parameters
    ----------
    angles
        Shape (n,), in rad.
    states
        In the order of the model, shape (n, states).
    inputs
        Shape (n, inputs).
    carried
        Inner states as the observer carries them after a jump from zero angle, shape (n, states).
    pulsations
        2π times the frequencies, in rad/s.
    inertia
        What the torque of the spring accelerates, in kg·m².
    amplitude
        Of the angle, in rad.
    torque
        Amplitude of the torque at rest.
    """

    angles: Array
    states: Array
    inputs: Array
    carried: Array
    pulsations: tuple[float, ...]
    inertia: float
    amplitude: float
    torque: float


def operating_points(form: AngleForm, duty: Duty) -> OperatingPoints:
    """Return states and inputs along a duty.

    Parameters
    ----------
    form
        Of the model as declared.
    duty
        What the actuator does.

    Raises
    ------
    ArrangementError
        If the torque of the spring does not move the measured body.
    ValueRangeError
        If the spring does not reach the torque within the range of angles.
    """
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
    """Return the inertia that the torque of the spring accelerates, from the model at rest, in kg·m².

    Parameters
    ----------
    form
        Of a model.

    Raises
    ------
    ArrangementError
        If the torque of the spring does not move the measured body.
    """
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

    Parameters
    ----------
    form
        Of a model.

    Returns
    -------
    tuple
        Slope, and place among the inputs of the model; ``None`` where no input moves the body.
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
