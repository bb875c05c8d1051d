"""A bench on which observers are compared: sines of the torque, one frequency after the other, load fixed.

The motor is led along the angles that the declared machine would have, by a position servo with feedforward
from declared numbers, so that machines with other numbers move nearly alike. Every observer reads the same
encoder and the same current; none is part of the loop.
"""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import dataclass

import casadi as ca
import numpy as np

from ....foundation.arrays import Array
from ....foundation.errors import ArrangementError
from ....model import FlatModel, Variable
from ....model.flat import stated_equations
from ....model.roles import measured_motion, spring_torque
from ....simulation.sampled_batch import PLANT, SampledSystem
from ..corrected.duty import Duty, operating_points, push, spring_inertia
from ..scheduling.angle_form import minimal_form
from ..scheduling.scheduled import whole_contour

SERVO = "servo"
BANDWIDTH = 25.0
"""Of the position servo in Hz: far above the duty, far below the sample rate."""
LEARNING, EVALUATED, RAMP = 1.5, 1.0, 0.3
"""Seconds of each frequency that do not count, that count, and over which the amplitude grows."""


@dataclass(frozen=True, eq=False)
class ObserverBench:
    """One run for all observers.

    Parameters
    ----------
    model
        Plant, with the load fixed.
    estimate, measured
        What the observers estimate, and the state whose reading they get.
    reading
        Full name of that reading.
    servo
        Discrete model that leads the motor.
    inputs
        Its courses at the samples, by full name.
    stop
        Last time in s.
    stretches
        Frequency in Hz, first and last time that count, for each part.
    torque
        Amplitude in N·m.
    """

    model: FlatModel
    estimate: str
    measured: str
    reading: str
    servo: FlatModel
    inputs: Mapping[str, Array]
    stop: float
    stretches: tuple[tuple[float, float, float], ...]
    torque: float

    def system(self, observers: Mapping[str, FlatModel], substeps: int = 6) -> SampledSystem:
        """Return the bench with observers that listen.

        Parameters
        ----------
        observers
            By name; their inputs are the measured angle and inputs of the plant.
        substeps
            Runge–Kutta steps of the plant per sample.
        """
        sources = {}
        for name, observer in observers.items():
            for v in observer.inputs:
                heard = self.reading if v.name == self.measured else v.name
                sources[f"{name}.{v.name}"] = f"{PLANT}.{heard}"
        for v in self.servo.inputs:
            own = f"{SERVO}.{v.name}"
            sources[own] = f"{PLANT}.{self.reading}" if v.name == self.measured else own
        return SampledSystem(
            plant=self.model,
            blocks={**observers, SERVO: self.servo},
            sources=sources,
            driven=self.servo.outputs[0].name,
            substeps=substeps,
        )


def observer_bench(
    model: FlatModel,
    *,
    duty: Duty | None = None,
    estimate: str | None = None,
    measured: str | None = None,
    sample_time: float = 1e-3,
) -> ObserverBench:
    """Return the bench for a machine.

    Parameters
    ----------
    model
        Continuous, load fixed.
    duty
        Frequencies and amplitude; those of :class:`~nlsdesign.feedback.observer.Duty` by default.
    estimate, measured
        As for :func:`~nlsdesign.feedback.observer.design_observer`.
    sample_time
        In s.

    Raises
    ------
    ArrangementError
        If no input moves the measured body.
    ValueRangeError
        If the spring does not reach the torque of the duty.
    """
    duty = duty or Duty()
    estimate, measured = spring_torque(model, estimate), measured_motion(model, measured)
    over = whole_contour(model)
    form, _ = minimal_form(
        model, estimate=estimate, angle=measured, angles=np.linspace(over.lower, over.upper, 65)
    )
    points = operating_points(form, duty)
    slope, place = push(form)
    if place is None:
        raise ArrangementError(
            f"model '{model.name}'", f"has no input that moves '{measured}'",
            next_step="keep the current of the motor among the inputs",
        )  # fmt: skip
    time, torque, stretches = _torque_course(duty, points.torque, sample_time)
    grid = np.linspace(0.0, points.amplitude, 400)
    c = form.at(grid)
    static = np.einsum("aj,aj->a", c.estimate[:, :-1], form.rest(grid) - c.shift) + c.estimate[:, -1]
    angle = np.sign(torque) * np.interp(np.abs(torque), np.abs(static), grid) * np.sign(static[-1])
    # A spring without stiffness at zero angle has a corner in the angle there: no motor follows it.
    angle = _smoothed(angle, sample_time)
    rate = np.gradient(angle, sample_time)
    acceleration = np.gradient(rate, sample_time) + torque / spring_inertia(form)
    reading = next(
        (r.signal for r in model.readings if r.measured == measured and r.signal != measured), measured
    )
    servo = _servo(form.model.inputs[place], model.variable(measured), slope, sample_time)
    courses = {"angle": angle, "rate": rate, "acceleration": acceleration}
    return ObserverBench(
        model, estimate, measured, reading, servo,
        {f"{SERVO}.{measured}.wanted.{name}": values for name, values in courses.items()},
        float(time[-1]), stretches, points.torque,
    )  # fmt: skip


def _torque_course(
    duty: Duty, torque: float, sample_time: float
) -> tuple[Array, Array, tuple[tuple[float, float, float], ...]]:
    parts, stretches, begin = [], [], 0.0
    for f in duty.frequencies:
        # Whole periods, so that each part ends where it began.
        learning = math.ceil(max(LEARNING, 3.0 / f) * f) / f
        length = learning + math.ceil(max(EVALUATED, 1.0 / f) * f) / f
        t = sample_time * np.arange(round(length / sample_time))
        parts.append(torque * np.minimum(t / RAMP, 1.0) * np.sin(2.0 * np.pi * f * t))
        stretches.append((f, begin + learning, begin + length))
        begin += length
    whole = np.concatenate([*parts, np.zeros(1)])
    return sample_time * np.arange(float(len(whole))), whole, tuple(stretches)


def _smoothed(angle: Array, sample_time: float) -> Array:
    """Return the course behind two moving means over 8 ms, without a lag."""
    width = 2 * round(4e-3 / sample_time) + 1
    kernel = np.ones(width) / width
    for _ in range(2):
        angle = np.convolve(np.pad(angle, width // 2, mode="edge"), kernel, mode="valid")
    return angle


def _servo(driven: Variable, angle: Variable, slope: float, time: float) -> FlatModel:
    """Return the position servo: u = u₀ + (a + 2ω(v − ω̂) + ω²(θ* − θ))/slope."""
    pulsation = 2.0 * math.pi * BANDWIDTH
    before, read, wanted, rate, acceleration = (
        ca.SX.sym(n) for n in ("before", "read", "wanted", "rate", "acceleration")
    )
    speed = (read - before) / time
    push_ = acceleration + 2.0 * pulsation * (rate - speed) + pulsation**2 * (wanted - read)
    name = f"{angle.name}.wanted"
    equations = stated_equations(
        before, ca.vertcat(read, wanted, rate, acceleration),
        derivative=read, output=driven.start + push_ / slope,
    )  # fmt: skip
    return FlatModel(
        name="bench_servo",
        description="position servo of the bench on which observers are compared",
        states=(Variable(f"{angle.name}.previous", angle.unit, "measured angle one sample ago"),),
        inputs=(
            Variable(angle.name, angle.unit, "measured angle"),
            Variable(f"{name}.angle", angle.unit, "wanted angle"),
            Variable(f"{name}.rate", f"{angle.unit}/s", "wanted speed"),
            Variable(f"{name}.acceleration", f"{angle.unit}/s^2", "wanted acceleration, spring included"),
        ),
        parameters=(),
        outputs=(driven,),
        signals=(),
        equations=equations,
        sample_time=time,
    )
