"""Torque controller of a series elastic drive: an outer law on the torque around a velocity loop.

What a torque may be asked for: what the drive can hold, and how fast it can follow at most.
"""

from __future__ import annotations

import math
from dataclasses import dataclass, replace

import numpy as np

from ....foundation.errors import ArrangementError, ValueRangeError
from ....foundation.symbolic import remembered
from ....model import FlatModel, Variable
from ....model.roles import declared_reading, series_spring, with_declared_reading
from ....model.transform import with_products
from .known_drive import KnownDrive, torque_range, torques_by_current, voltage_is_limited
from .law_writer import DESIRED, LawWriter
from .law_writer import LoopNames as LoopNames
from .law_writer import loop_names as loop_names
from .outer_laws import Heard, PidTorque, ScheduledTorque, TorqueLaw, check_settings, stiffness_table
from .velocity_loop import VelocityLoop

CARRIED = 0.1
"""Share of the sampling rate above which no loop is closed.

From the mean time of a difference of angles to the middle of the hold of the current, one sample of
computation between them, two samples pass: at a tenth of the rate 72° of phase, which leaves 18° of the 90°
that an integrating plant has.
"""


@dataclass(frozen=True)
class TorqueGains:
    """Settings of a PID law and its velocity loop in one list; all of them can be tuned in the controller.

    Where none is given they are :data:`REPRODUCED_GAINS`, whatever the spring.

    Parameters
    ----------
    proportional
        Speed command per torque error, in rad/s per N·m. Below crossover the torque that a moved load feels
        is its speed over this number.
    integral
        In rad/s² per N·m.
    derivative
        In rad per N·m.
    derivative_bandwidth
        Cut-off frequency of the filter on the derivative, in Hz.
    speed_limit
        Largest speed command, in rad/s.
    velocity_bandwidth
        Of the velocity loop, in Hz.
    velocity_integral
        Frequency below which the velocity loop integrates, in Hz.
    speed_bandwidth
        Cut-off frequency of the filter on the difference of the encoder, in Hz.
    compensation
        Share of the estimated spring torque that is added to the current, so that the velocity loop does not
        have to carry it.

    Raises
    ------
    ValueRangeError
        If a gain is negative or not finite.
    """

    proportional: float = 32.0
    integral: float = 100.0
    derivative: float = 0.0
    derivative_bandwidth: float = 100.0
    speed_limit: float = 60.0
    velocity_bandwidth: float = 60.0
    velocity_integral: float = 6.0
    speed_bandwidth: float = 300.0
    compensation: float = 1.0

    def __post_init__(self) -> None:
        check_settings(self)

    @property
    def law(self) -> PidTorque:
        """The outer law with these gains."""
        return PidTorque(
            self.proportional, self.integral, self.derivative, self.derivative_bandwidth, self.speed_limit
        )

    @property
    def velocity(self) -> VelocityLoop:
        """The velocity loop with these gains, without compensation of friction."""
        return VelocityLoop(
            bandwidth=self.velocity_bandwidth,
            integral=self.velocity_integral,
            speed_bandwidth=self.speed_bandwidth,
            compensation=self.compensation,
            friction=None,
        )


REPRODUCED_GAINS = TorqueGains()
"""Kp 32 rad/s per N·m and Ki 100 rad/s² per N·m, with which the studies reproduce Austin et al. 2015.

The paper prints no gains. On the deck of its nonlinear spring these have a gain margin below 1 dB, which
:func:`~nlsdesign.feedback.control.evaluate_loop` finds."""


@remembered(16)
def torque_controller(
    plant: FlatModel,
    *,
    law: TorqueLaw | None = None,
    velocity: VelocityLoop | None = None,
    gains: TorqueGains | None = None,
    sample_time: float = 1e-3,
    current: str | None = None,
) -> FlatModel:
    """Return the controller as a discrete flat model.

    Inputs are the desired torque, the estimate of the spring's torque and the measured angle of the motor;
    output is the motor current. Their names are those of the plant, the desired torque has the ending
    ``.desired``: ``spring.torque.desired``, ``spring.torque``, ``motor.angle`` and ``motor.current`` where
    the plant's parts are called spring and motor. An outer law commands the speed of the spring, the velocity
    loop makes it. Inertia, gear ratio, torque constant, limits and friction are parameters of the controller
    under the names that they have in the plant, the settings are called ``controller.NAME``.

    Parameters
    ----------
    plant
        Continuous, on the bench: load fixed or prescribed.
    law
        Outer law. If neither a law nor gains are given it is
        :class:`~nlsdesign.feedback.control.laws.outer_laws.ScheduledTorque` where the angle of the motor
        alone tells that of the spring, as with a fixed load; else a PID with the gain that the spring allows,
        and the description says why.
    velocity
        Velocity loop inside; with its defaults if only a law is given.
    gains
        Settings of a PID and its velocity loop in one list, in place of ``law`` and ``velocity``, for
        instance :data:`REPRODUCED_GAINS`.
    sample_time
        In s.
    current
        Name of the output; by default that of the input of the motor.

    Raises
    ------
    ArrangementError
        If the plant has no motor that is driven by a current, or no series spring that it turns, or both
        gains and parts are given.
    ValueRangeError
        If the sample time is not positive, a bandwidth is more than it carries, or the outer loop is faster
        than the inner one.
    """
    if not (math.isfinite(sample_time) and sample_time > 0.0):
        raise ValueRangeError(f"sample_time {sample_time:g} s", "must be positive")
    drive, writer = KnownDrive(plant), LawWriter(sample_time, plant.origin)
    outer, inner, reason = _parts(drive, law, velocity, gains)
    _check_bandwidths(outer, inner, sample_time)
    names = drive.names
    heard = Heard(
        writer.input(names.desired, "N*m", "torque that the spring should have"),
        writer.input(names.torque, "N*m", "estimate of the torque that the spring has"),
        writer.input(names.angle, "rad", "measured angle of the motor"),
    )
    command = outer.command(writer, drive, heard)
    motor = inner.current(writer, drive, heard, command)
    command.finish(motor.held)
    speed = command.speed / drive.spring_turns(writer)
    writer.signal(f"{names.speed}.{DESIRED}", "rad/s", "speed command", speed)
    writer.signal(f"{names.speed}.measured", "rad/s", "filtered speed", motor.speed)
    limit = plant.variable(drive.motor.current_limit).start
    output = Variable(
        current or names.current, "A", "current for the coming sample",
        nominal=limit, minimum=-limit, maximum=limit,
    )  # fmt: skip
    supply = "" if voltage_is_limited(drive) else "; no voltage is limited, for the motor declares no winding"
    description = f"{outer.title} around a velocity loop{reason}{supply}"
    model = with_products(writer.model("torque_controller", description, (output, motor.current)))
    inputs = [with_declared_reading(v, plant, v.name) if v.name == names.angle else v for v in model.inputs]
    return with_command_limits(replace(model, inputs=tuple(inputs)), plant)


def _parts(
    drive: KnownDrive, law: TorqueLaw | None, velocity: VelocityLoop | None, gains: TorqueGains | None
) -> tuple[TorqueLaw, VelocityLoop, str]:
    """Return outer law and velocity loop, and why it is not the usual law where nobody has chosen one."""
    if gains is not None and (law is not None or velocity is not None):
        raise ArrangementError(
            "gains", "are those of a PID law and its velocity loop, and law or velocity is given as well",
            next_step="give law=PidTorque(...) and velocity=VelocityLoop(...) alone",
        )  # fmt: skip
    if gains is not None:
        return gains.law, gains.velocity, ""
    inner = velocity or VelocityLoop()
    if law is not None:
        return law, inner, ""
    if drive.spring_seen_at_the_motor:
        return ScheduledTorque(), inner, ""
    angle = series_spring(drive.plant).motion
    return PidTorque(), inner, f", for a law by tangent stiffness would have to be given {angle} as well"


def _check_bandwidths(law: TorqueLaw, velocity: VelocityLoop, sample_time: float) -> None:
    outer, inner = law.closes_at(sample_time), velocity.closes_at(sample_time)
    loops = {"torque loop": outer, "velocity loop": inner}
    if velocity.disturbance is not None:
        loops["disturbance observer"] = velocity.disturbance.bandwidth
    for name, value in loops.items():
        if value > CARRIED / sample_time * (1.0 + 1e-9):
            raise ValueRangeError(
                f"bandwidth of the {name} {value:g} Hz",
                f"is more than a sample time of {1e3 * sample_time:g} ms carries: a tenth of the sampling "
                f"rate, {CARRIED / sample_time:g} Hz, where the two samples between angle and current take "
                "72° of phase",
                next_step=f"ask for {CARRIED / sample_time:g} Hz or less, or sample faster",
            )
    if outer > inner:
        raise ValueRangeError(
            f"bandwidth of the torque loop {outer:g} Hz",
            f"is above that of the velocity loop inside, {inner:g} Hz, which has to make its commands",
            next_step=f"ask for a third of it or less, {inner / 3.0:g} Hz",
        )


def with_command_limits(controller: FlatModel, plant: FlatModel) -> FlatModel:
    """Return a torque controller whose desired torque has the range and the largest rate of its drive.

    The range is what the drive can hold, by its largest current and the contour of its cam. The rate is the
    largest slope of the spring's torque at rest over the angle, times the largest speed of the motor that the
    deck declares with its encoder; where it declares none, there is no largest rate. The controller is
    unchanged where the plant has no torque at rest, as where its load moves freely.
    """
    drive = KnownDrive(plant)
    try:
        lowest, highest = torque_range(plant)
        limits, rate = declared_reading(plant, drive.names.angle).limits, math.inf
        if limits is not None:
            slope = float(np.max(stiffness_table(drive).values))
            rate = slope * abs(drive.spring_turns_value) * limits[2]
    except ArrangementError:  # no torque at rest: the drive could hold none; any other error is one
        return controller
    current = plant.values[drive.motor.current_limit]
    reason = f"what the drive can hold with {current:g} A and on the contour of its cam"
    inputs = []
    for v in controller.inputs:
        if v.name == drive.names.desired:
            v = replace(v, minimum=lowest, maximum=highest, largest_rate=rate, source=reason)
        elif v.name == drive.names.desired_rate:
            v = replace(v, minimum=-rate, maximum=rate)
        inputs.append(v)
    return replace(controller, inputs=tuple(inputs))


def largest_speed(plant: FlatModel) -> float:
    """Return the speed in rad/s that the motor can reach on its contour when its largest current is reversed.

    From rest, as far as the current of one sign holds the spring, with that of the other sign, by energy:
    J·ω²/2 = τ·(θ − θ₀) + E(θ₀) − E(θ). τ is what the current leaves beside friction, E what the spring at
    rest holds. A supply of limited voltage turns the motor no faster than without load, U/k.

    ``plant``: load held.
    """
    drive = KnownDrive(plant)
    numbers = plant.evaluate(list(plant.start(plant.states))) | dict(plant.values)
    table, turns = stiffness_table(drive), abs(drive.spring_turns_value)
    deflections = table.grid * (turns if drive.spring_seen_at_the_motor else 1.0)
    # Torque at rest and energy over the deflections of a spring; both are 0 in the middle.
    results = [table.values[:, 0]]
    for _ in range(2):
        cells = (results[-1][1:] + results[-1][:-1]) / 2.0 * np.diff(deflections)
        summed = np.concatenate([[0.0], np.cumsum(cells)])
        results.append(summed - np.interp(0.0, deflections, summed))
    torques, held = results[1], results[2]
    fastest = 0.0
    for way, against in zip((1.0, -1.0), torques_by_current(plant), strict=True):
        allowed = np.flatnonzero(torques >= -against if way > 0.0 else torques <= against)
        start = allowed[0 if way > 0.0 else -1]
        energy = against * way * (deflections - deflections[start]) + held[start] - held
        fastest = max(fastest, 2.0 * float(np.max(energy)) / numbers[drive.body.inertia or ""])
    speed = math.sqrt(fastest)
    if voltage_is_limited(drive):
        turned = drive.motor.gear_ratio
        constant = numbers[drive.motor.torque_constant] * (numbers[turned] if turned else 1.0)
        speed = min(speed, numbers[f"{drive.body.name}.voltage_limit"] / constant)
    return speed


def rate_remarks(plant: FlatModel) -> list[str]:
    """Return that an encoder of the motor declares less speed than drive and spring can reach, if so."""
    try:
        angle = KnownDrive(plant).names.angle
        limits, speed = declared_reading(plant, angle).limits, largest_speed(plant)
    except ArrangementError:
        return []  # without a series spring and a held load nothing is scheduled
    if limits is None or speed <= limits[2]:
        return []
    return [
        f"largest_rate of the encoder of {angle} is {limits[2]:.4g} rad/s, the drive reaches {speed:.4g} "
        "rad/s when its largest current is reversed: good readings beyond the rate are refused "
        f"-> declare at least {math.ceil(speed):g} rad/s, or a smaller current_limit"
    ]
