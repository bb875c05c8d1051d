"""The largest gains that keep their margins over angle and spread, for published and designed springs.

Linearised loops: what they show holds for small motions around a held torque. Where the simulated loops of
this study limit-cycle or saturate is in its other half.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Mapping
from dataclasses import dataclass, replace

import numpy as np

import nlsdesign as nls
from nlsdesign.components.assembly.changed_copies import with_moved_load
from nlsdesign.feedback.analysis.rest import rest_states
from nlsdesign.feedback.control import (
    ClosedLoop,
    LoopChoice,
    LoopLimits,
    PidTorque,
    ScheduledTorque,
    TorqueLaw,
    VelocityLoop,
    bandwidth_against_impedance,
    best_choices,
    encoder_loop,
    largest_gain,
    saturation_line,
)
from nlsdesign.feedback.observer import CascadeGain
from nlsdesign.foundation.arrays import Array
from nlsdesign.foundation.errors import InfeasibleError, ValueRangeError

from ..alternative_rubber.merits import HELD, MOVED_AT

DECKS = {
    "nonlinear": "austin2015_figure_consistent",
    "soft": "austin2015_soft_spring",
    "stiff": "austin2015_stiff_spring",
}
"""Decks of the three springs of the publication, by short name."""
LIMITS = LoopLimits(gain_margin=6.0, phase_margin=30.0)
DRAWS = 4
"""Machines drawn from the spread of the deck, besides the declared one."""
SHARES = (0.25, 0.5, 1.0)
"""Of the largest gain, along each line."""
FRACTIONS = np.array([0.3, 0.4, 0.5, 0.6, 0.7, 0.8, 0.9, 0.9999])
"""Of the frequency at which the speed limit is met, at which the current is looked at."""
SEEN = nls.degrees(85.0)
"""Largest angle at which a loop is linearised: tables of a spring without a contour end at 90°."""
_SWEPT, _BY_DRAWS = 181, 0.5


@dataclass(frozen=True)
class Law:
    """A torque law, its gain and the range in which the largest is looked for."""

    title: str
    law: TorqueLaw
    gain: str
    unit: str
    between: tuple[float, float]


LAWS = (
    Law(
        "PID",
        PidTorque(proportional=32.0, integral=100.0),
        "controller.proportional",
        "rad/s per N·m",
        (2.0, 400.0),
    ),
    # What is fed forward has no part in margins and impedance, so following is compared without it too.
    Law("scheduled", ScheduledTorque(feedforward=0.0), "controller.bandwidth", "Hz", (1.0, 60.0)),
)


@dataclass(frozen=True, eq=False)
class Line:
    """A spring with one law: what it does up to the largest gain that keeps its margins.

    Parameters
    ----------
    spring, law
        Names.
    largest
        Gain; not a number where none keeps the margins.
    limited_by
        What a larger one would break.
    reach
        Frequency in Hz up to which current and speed of the motor allow a sine of the largest torque.
    small
        Bandwidth in Hz of the linear loop at shares of that gain: of small motions, at the worst of the
        torques.
    choices
        The same with the reach where that is less; the impedance is that at :data:`MOVED_AT`.
    """

    spring: str
    law: Law
    largest: float
    limited_by: str
    reach: float
    small: tuple[float, ...]
    choices: tuple[LoopChoice, ...]

    @property
    def label(self) -> str:
        """Spring and law."""
        return f"{self.spring}, {self.law.title}"

    @property
    def last(self) -> LoopChoice | None:
        """The choice with the largest gain; none where no gain keeps the margins."""
        return self.choices[-1] if self.choices else None

    @property
    def numbers(self) -> dict[str, float]:
        """Claimed numbers of the largest gain, by name with unit; none where no gain keeps the margins."""
        if self.last is None:
            return {}
        name = f"{self.spring}_{self.law.title.lower()}"
        unit = "Hz" if self.law.unit == "Hz" else "rad_per_s_per_Nm"
        return {
            f"{name}_gain_{unit}": self.largest,
            f"{name}_bandwidth_Hz": self.small[-1],
            f"{name}_impedance_Nm_per_rad": stiffness_felt(self.last),
        }


def stiffness_felt(choice: LoopChoice) -> float:
    """Return the impedance as torque over angle in N·m/rad: times 2πf."""
    return 2.0 * math.pi * MOVED_AT * choice.impedance


def lines_of(springs: Mapping[str, nls.Assembly], *, draws: int = DRAWS) -> tuple[Line, ...]:
    """Return a line for each spring with each law."""
    return tuple(line for name, actuator in springs.items() for line in _both(name, actuator, draws))


def front_of(lines: tuple[Line, ...]) -> tuple[LoopChoice, ...]:
    """Return the choices of all lines that no other betters in bandwidth and impedance."""
    return best_choices([choice for line in lines for choice in line.choices])


def published() -> dict[str, nls.Assembly]:
    """Return the actuators of the three published springs."""
    return {name: nls.declare(nls.load_deck(deck)) for name, deck in DECKS.items()}


def _both(name: str, actuator: nls.Assembly, draws: int) -> list[Line]:
    loop_with, angles = loops_of(actuator), angles_of(actuator)
    reach, seen = reach_of(loop_with(LAWS[0]), float(angles[-1])), np.minimum(angles, SEEN)
    return [_line(name, law, loop_with(law), seen, reach, draws) for law in LAWS]


def reach_of(loop: ClosedLoop, angle: float) -> float:
    """Return the frequency in Hz up to which the drive can make a sine of the angle of that amplitude.

    That at which the speed limit of the controller is met; where the current does not carry it so far, the
    last frequency at which it does.
    """
    limit = loop.controller.values["controller.speed_limit"]
    frequencies = limit / (2.0 * math.pi * angle) * FRACTIONS
    line = saturation_line(loop, frequencies, largest_angle=angle, speed_limit=limit)
    carried = [words == "angle" for words in line.limited_by]
    if not carried[0]:
        return math.nan
    return float(frequencies[carried.index(False) - 1] if False in carried else frequencies[-1])


def _line(name: str, law: Law, loop: ClosedLoop, angles: Array, reach: float, draws: int) -> Line:
    try:
        tuned = largest_gain(loop, law.gain, between=law.between, angles=angles, limits=LIMITS)
        # Draws take gain away, never add: the machine as declared is one of them.
        below = (_BY_DRAWS * tuned.value, tuned.value)
        tuned = largest_gain(loop, law.gain, between=below, angles=angles, limits=LIMITS, draws=draws)
    except InfeasibleError as error:
        # No gain keeps the margins: the line has no points and says why.
        return Line(name, law, math.nan, str(error), reach, (), ())
    label = f"{name}, {law.title}"
    choices = bandwidth_against_impedance(
        {label: loop}, law.gain, tuned.value * np.array(SHARES), angles={label: angles}, frequency=MOVED_AT,
        limits=LIMITS,
    )  # fmt: skip
    within = tuple(replace(c, bandwidth=min(c.bandwidth, reach)) for c in choices)
    return Line(name, law, tuned.value, tuned.limited_by, reach, tuple(c.bandwidth for c in choices), within)


def loops_of(actuator: nls.Assembly) -> Callable[[Law], ClosedLoop]:
    """Return a function from a law to the loop of an actuator whose load is moved."""
    outputs = ["motor.angle", "spring.torque"]
    bench = nls.flatten(actuator, outputs=outputs)
    plant = nls.flatten(with_moved_load(actuator), outputs=outputs)
    observer = nls.design_observer(bench, gain=CascadeGain())

    def loop_with(law: Law) -> ClosedLoop:
        controller = nls.torque_controller(bench, law=law.law, velocity=VelocityLoop(friction=None))
        return encoder_loop(plant, observer=observer, controller=controller)

    return loop_with


def angles_of(actuator: nls.Assembly) -> Array:
    """Return the angles in rad at which the spring holds the torques of :data:`HELD`, shape (3,)."""
    model = nls.flatten(actuator, outputs=["motor.angle", "spring.torque"])
    ends = [model.values[cam.last_angle] for s in model.springs for cam in s.cams if cam.last_angle]
    swept = np.linspace(0.0, min(ends, default=nls.degrees(120.0)), _SWEPT)
    states = rest_states(model, swept, angle="motor.angle")
    torque = np.array([model.evaluate(list(row))["spring.torque"] for row in states])
    if np.max(np.abs(torque)) < HELD[-1]:
        raise ValueRangeError(f"spring of {actuator.name}", f"does not reach {HELD[-1]:g} N·m")
    return np.interp(HELD, np.maximum.accumulate(np.abs(torque)), swept)
