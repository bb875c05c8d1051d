"""The actuator against the points of Figs 1, 6 and 8 of the paper."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass

import numpy as np

import nlsdesign as nls
from nlsdesign.bench.identification import Agreement, agreement
from nlsdesign.components import TRANSLATION, Driven
from nlsdesign.foundation.arrays import Array

from .._published import element_loop, figure_points

FIG1_FREQUENCY = 1.0  # Hz; assumed, the paper does not print it
FIG6_FREQUENCY = 10.8  # Hz; from its time axis, the caption says 4 Hz
AMPLITUDES = (25, 45)  # degrees


@dataclass(frozen=True, eq=False)
class StaticCurve:
    """Fig. 8, shape (n,): angle in rad; torque in N·m as measured, of the model at rest, of Hooke's law."""

    angle: Array
    measured: Array
    model: Array
    hooke: Array


@dataclass(frozen=True, eq=False)
class HysteresisLoop:
    """Angle in rad and torque in N·m of one loop of Fig. 1, measured and simulated."""

    measured: tuple[Array, Array]
    simulated: tuple[Array, Array]

    @property
    def area_ratio(self) -> float:
        """Area of the simulated loop over that of the measured one."""
        return abs(nls.figures.loop_area(*self.simulated) / nls.figures.loop_area(*self.measured))


@dataclass(frozen=True, eq=False)
class ElementLoop:
    """Force in N of one rubber element over the extensions of Fig. 6, measured and of the model."""

    measured: Array
    model: Array

    @property
    def agreement(self) -> Agreement:
        """In the metrics of the paper."""
        return agreement(self.measured, self.model)


@dataclass(frozen=True, eq=False)
class FigureComparison:
    """The model against Fig. 8, and by amplitude against Figs 1 and 6."""

    static: StaticCurve
    loops: Mapping[str, HysteresisLoop]
    elements: Mapping[str, ElementLoop]

    @property
    def agreement(self) -> Agreement:
        """Of the model with Fig. 8, in the metrics of the paper."""
        return agreement(self.static.measured, self.static.model)

    @property
    def hooke_agreement(self) -> Agreement:
        """Of the best linear spring with Fig. 8."""
        return agreement(self.static.measured, self.static.hooke)


def compare_with_figures(actuator: nls.Assembly) -> FigureComparison:
    """Compute the curves of the three figures."""
    driven = actuator.with_part("motor", Driven()).without_part("motor_encoder")
    model = nls.flatten(driven, outputs=["spring.torque"])
    angle, measured = figure_points("fig08_torque_profile_nls").T
    torque = nls.equilibrium_torque(nls.flatten(actuator), "spring", angle)
    hooke = angle * float(angle @ measured / (angle @ angle))
    return FigureComparison(
        StaticCurve(angle, measured, torque, hooke),
        {f"{degrees}°": hysteresis_loop(model, degrees) for degrees in AMPLITUDES},
        {f"{degrees}°": compare_element(actuator, degrees) for degrees in AMPLITUDES},
    )


def hysteresis_loop(model: nls.FlatModel, degrees: int) -> HysteresisLoop:
    """Simulate the loop of Fig. 1 as the second cycle of a sine of the measured amplitude."""
    shown, torque = figure_points(f"fig01_mean_torque_{degrees}deg").T
    turn, amplitude = 2.0 * np.pi * FIG1_FREQUENCY, float(shown.max())
    time = np.linspace(0.0, 2.0 / FIG1_FREQUENCY, 801)
    angle, speed = amplitude * np.sin(turn * time), amplitude * turn * np.cos(turn * time)
    trace = nls.simulate(model, time, inputs={"motor.angle": angle, "motor.speed": speed})
    # The smaller loop is drawn for positive angles only.
    cycle = slice(400, None)
    drawn = angle[cycle] >= min(0.0, float(shown.min()))
    return HysteresisLoop((shown, torque), (angle[cycle][drawn], trace["spring.torque"][cycle][drawn]))


def compare_element(actuator: nls.Assembly, degrees: int) -> ElementLoop:
    """Simulate one element over the two stretches of Fig. 6; its extension over time is taken as a sine."""
    extension, force = element_loop(degrees)
    rubber = nls.tie(actuator.element("spring.rubber"), "grip")
    model = nls.flatten(
        nls.assembly("element", grip=Driven(domain=TRANSLATION), rubber=rubber), outputs=["rubber.force"]
    )
    turn, half = 2.0 * np.pi * FIG6_FREQUENCY, 0.5 * extension.max()
    time = np.linspace(0.0, 2.0 / FIG6_FREQUENCY, 801)
    path, speed = half * (1.0 - np.cos(turn * time)), half * turn * np.sin(turn * time)
    trace = nls.simulate(model, time, inputs={"grip.position": path, "grip.speed": speed})
    return ElementLoop(force, mean_of_strokes(extension, path[400:], trace["rubber.force"][400:]))


def mean_of_strokes(extension: Array, path: Array, force: Array) -> Array:
    """Return the mean force of the strokes up and down at each extension."""
    top = int(np.argmax(path))
    up = np.interp(extension, path[: top + 1], force[: top + 1])
    return 0.5 * (up + np.interp(extension, path[top:][::-1], force[top:][::-1]))
