"""The readings of an observer: its measured angle and plausible inputs, its first reading, a whole record."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import replace

import numpy as np

from ....foundation.arrays import Array
from ....foundation.errors import MeasurementError, ValueRangeError
from ....model import FlatModel, Plausibility, Variable
from ....model.roles import declared_reading
from ....simulation import Trace, simulate
from .angle_form import AngleScheduledPlant

FASTER = 2.0
"""Times the typical speed that a motion has at most where the deck does not declare a largest rate."""
COUNTS = 2.0
"""Counts that a reading may always change by."""
SURELY = 2.0
"""Times what dry friction and two counts of the spring hold: a larger change of the drive must show."""


def measured_angle(plant: AngleScheduledPlant, angles: Array) -> Variable:
    """Return the input of the measured angle."""
    v, size = plant.states[plant.moving[0]], float(plant.sizes[plant.moving[0]])
    text = (
        f"measured {v.name}; the table reaches from {angles[0]:.4g} to {angles[-1]:.4g} rad and holds its "
        "ends beyond"
    )
    return Variable(v.name, v.unit, text, nominal=size)


def with_plausible_inputs(
    observer: FlatModel, model: FlatModel, plant: AngleScheduledPlant, angles: Array
) -> FlatModel:
    """Return an observer whose inputs state what they can be.

    Range, largest rate and stale time of the angle are those that the deck declares with the encoder. Where
    it does not, the angle may lie beyond the table by its whole width, move at twice the typical speed, and
    stay as long as it likes. The current lies within the limit of the motor.

    ``observer``: discrete; its first input is the angle.
    """
    angle, *others = observer.inputs
    time = float(observer.sample_time or 0.0)
    declared = declared_reading(model, angle.name)
    width, speed = float(angles[-1] - angles[0]), float(plant.sizes[plant.moving[1]])
    usual = (float(angles[0]) - width, float(angles[-1]) + width, FASTER * speed, float("inf"))
    lowest, highest, rate, stale = declared.limits or usual
    _check_sampling(angle.name, rate, stale, declared.quantum, time)
    drive = next((v.name for v in plant.inputs if _command_limit(v.name, model) is not None), None)
    can = Plausibility(
        rate,
        COUNTS * declared.quantum,
        stale,
        drive,
        0.0 if drive is None else noticeable_change(plant, drive, angles, COUNTS * declared.quantum),
    )
    measured = replace(angle, minimum=lowest, maximum=highest, plausibility=can)
    return replace(observer, inputs=(measured, *(_limited(v, model) for v in others)))


def _check_sampling(name: str, rate: float, stale: float, quantum: float, sample_time: float) -> None:
    """Refuse limits that no reading could keep at this sample time."""
    if rate * sample_time < quantum:
        raise ValueRangeError(
            f"largest rate of '{name}' {rate:g} rad/s",
            f"is less than one count per sample of {sample_time:g} s",
            next_step=f"declare at least {quantum / sample_time:.3g} rad/s, or sample slower",
        )
    if stale < 2.0 * sample_time:
        raise ValueRangeError(
            f"stale time of '{name}' {stale:g} s",
            f"is shorter than two samples of {sample_time:g} s",
            next_step="declare a longer one, or sample faster",
        )


def _limited(variable: Variable, model: FlatModel) -> Variable:
    limit = _command_limit(variable.name, model)
    if limit is None:
        return variable
    text = f"{variable.description} over the sample that begins with this reading, computed one sample ago"
    return replace(variable, description=text, minimum=-limit, maximum=limit, nominal=limit)


def _command_limit(name: str, model: FlatModel) -> float | None:
    for body in model.bodies:
        motor = body.motor
        if motor is not None and motor.command == name and motor.current_limit is not None:
            return model.values[motor.current_limit]
    return None


def noticeable_change(plant: AngleScheduledPlant, drive: str, angles: Array, resolution: float) -> float:
    """Return the change of an input that the angle of a fixed machine cannot fail to show.

    Dry friction holds twice its torque, and the spring what a motion below the resolution needs; a change of
    the drive by more than twice both together moves the reading.
    """
    place = [v.name for v in plant.inputs].index(drive)
    start = np.array([v.start for v in plant.inputs])
    step = np.zeros(len(start))
    step[place] = 1.0
    rows = list(plant.rows)
    gain = np.array(plant.driven(start + step)).ravel() - np.array(plant.driven(start)).ravel()
    _, speed = plant.moving
    pushed = abs(float(gain[rows.index(speed)])) if speed in rows else 0.0
    if pushed == 0.0:
        return 0.0
    c, rest = plant.at(angles), plant.rest(angles)
    pull = np.einsum("aj,aj->a", c.a[:, speed, :-2], (rest - c.shift)[:, :-2]) + c.drive[:, speed]
    slope = float(np.max(np.abs(np.diff(pull) / np.diff(angles))))
    held = 0.0
    if plant.friction is not None:
        speeds = np.linspace(0.0, float(plant.sizes[speed]), 33)
        held = max(abs(float(plant.friction(s))) for s in speeds)
    return SURELY * (2.0 * held + slope * resolution) / pushed


def observe(
    observer: FlatModel,
    trace: Trace,
    *,
    readings: Mapping[str, str] | None = None,
    start: Mapping[str, float] | None = None,
) -> Trace:
    """Return what an observer makes of a simulated or measured record.

    Parameters
    ----------
    observer
        Discrete.
    trace
        Sampled at the observer's sample time.
    readings
        Input of the observer to signal of the trace where the names differ, for instance
        ``{"motor.angle": "motor_encoder.reading"}``.
    start
        Start values of the memory, for instance those of :meth:`ObserverDesign.start`; by default those of a
        machine that rests at the first readings.

    Returns
    -------
    Trace
        Inputs, memory and outputs of the observer.

    Raises
    ------
    ValueRangeError
        If the trace is not sampled at the sample time of the observer.
    MeasurementError
        If the trace does not have what the observer measures.
    """
    if observer.sample_time is None:
        raise ValueRangeError(f"model '{observer.name}'", "is not a discrete observer")
    if np.any(np.abs(np.diff(trace.time) / observer.sample_time - 1.0) > 1e-6):
        raise ValueRangeError(
            f"record '{trace.name}'", f"must be sampled every {observer.sample_time:g} s",
            next_step="resample it with Trace.at",
        )  # fmt: skip
    wires = {v.name: v.name for v in observer.inputs} | dict(readings or {})
    missing = [signal for signal in wires.values() if signal not in trace]
    if missing:
        raise MeasurementError(
            f"record '{trace.name}'", f"has no signal '{missing[0]}', which the observer needs"
        )
    inputs = {name: trace[signal] for name, signal in wires.items()}
    begun = start if start is not None else _begun(observer, {n: float(v[0]) for n, v in inputs.items()})
    return simulate(observer, trace.time, inputs=inputs, start=begun)


def _begun(observer: FlatModel, first: Mapping[str, float]) -> dict[str, float]:
    """Return the states with which an observer begins at its first readings, as generated code does."""
    if observer.begin is None:
        return {}
    x, u = observer.start(observer.states), [first[v.name] for v in observer.inputs]
    w = observer.look_up(x.tolist(), u)
    begun = np.array(observer.begin(x, u, observer.start(observer.parameters), w)[0], dtype=float).ravel()
    return {v.name: float(value) for v, value in zip(observer.states, begun, strict=True)}
