"""Outer laws of a torque loop: from desired and estimated torque to the speed that the spring should have.

A PID, or a speed commanded by the tangent stiffness of the spring.
"""

from __future__ import annotations

import math
from abc import ABC, abstractmethod
from collections.abc import Callable
from dataclasses import dataclass, field
from typing import ClassVar, NamedTuple

import casadi as ca
import numpy as np

from ....foundation.errors import ArrangementError, ValueRangeError
from ....foundation.symbolic import Expression
from ....model import Table, Variable
from ....model.roles import contour_ends, series_spring
from ....model.transform import named
from ...analysis.rest import evaluate_at, rest_states
from .known_drive import KnownDrive
from .law_writer import (
    GAIN,
    AntiWindup,
    ConditionalIntegration,
    Integration,
    LawWriter,
    filtered_rate,
    limited,
)


class Heard(NamedTuple):
    """What a controller is given at a sample."""

    # desired, torque: torque that the spring should have, and the estimate of the one it has, in N·m
    desired: Expression
    torque: Expression
    angle: Expression  # measured angle of the motor in rad


SLOW_PART = 3.125
"""Integral over proportional gain of a PID by default, in 1/s: 100 over 32, as in the studies."""


class HeldBack(NamedTuple):
    """By how much commands exceed their limits at a sample; zero within them."""

    speed: Expression  # of the spring, in rad/s
    current: Expression  # in A
    # speed_per_current: speed of the spring that makes one ampere, in rad/s/A; its sign says which way the
    # current pushes
    speed_per_current: Expression


class SpeedCommand(NamedTuple):
    """What an outer law asks for."""

    speed: Expression  # of the spring, within its limits, in rad/s
    beyond: Expression  # what the limits took away, in rad/s
    acceleration: Expression  # of the spring, as far as the law knows it beforehand, in rad/s²
    # finish: takes what all limits held back and says what the states of the law are one sample later
    finish: Callable[[HeldBack], None]


class TorqueLaw(ABC):
    """Base of the outer laws. A law commands a speed of the spring; the velocity loop makes it."""

    title: ClassVar[str]
    """What the law is, in a few words."""

    @abstractmethod
    def command(self, writer: LawWriter, drive: KnownDrive, heard: Heard) -> SpeedCommand:
        """Write the law into a controller.

        Parameters
        ----------
        writer
            Of the controller.
        drive
            What is known of the plant.
        heard
            Inputs of the controller.
        """

    @abstractmethod
    def closes_at(self, sample_time: float) -> float:
        """Return the bandwidth in Hz that the law asks for; zero where that depends on the spring.

        Parameters
        ----------
        sample_time
            In s.
        """


@dataclass(frozen=True)
class PidTorque(TorqueLaw):
    """PID on the estimated torque: v = Kp·e + ∫Ki·e dt + Kd·de/dt, e = T_d − T̂.

    v is the speed of the spring. Below crossover a load that is moved with the speed ω feels the torque ω/Kp,
    whatever the spring. The loop gain is Kp·k_t(θ): a stiffening spring loses margin, so by default Kp is
    such that the loop gain is that of :class:`ScheduledTorque` where the spring is stiffest.
    Sources: Pratt and Williamson 1995; Robinson 2000; Vallery et al. 2008 (around a velocity loop).

    Parameters
    ----------
    proportional
        Kp in rad/s per N·m; by default 2π·f_c/k_t at the largest tangent stiffness, with f_c of 12 Hz, or
        0.012 of the sampling rate where that is less.
    integral
        Ki in rad/s² per N·m; by default 3.125 1/s times Kp.
    derivative
        Kd in rad per N·m.
    derivative_bandwidth
        Cut-off frequency of the filter on the derivative, in Hz.
    speed_limit
        Largest speed command, in rad/s.
    acceleration_limit
        Largest change of the speed command per second, in rad/s²; ``None`` for none.
    windup
        What the integral does while a limit holds the command back.

    Raises
    ------
    ValueRangeError
        If a setting is negative or not finite; when it is written also if there is no Kp and the spring has
        no stiffness.
    """

    title: ClassVar[str] = "PID on the estimated torque"

    proportional: float | None = None
    integral: float | None = None
    derivative: float = 0.0
    derivative_bandwidth: float = 100.0
    speed_limit: float = 60.0
    acceleration_limit: float | None = None
    windup: AntiWindup = field(default_factory=ConditionalIntegration)

    def __post_init__(self) -> None:
        check_settings(self)

    def closes_at(self, sample_time: float) -> float:
        """Return zero: where the loop gain Kp·k_t crosses one depends on the spring."""
        return 0.0

    def command(self, writer: LawWriter, drive: KnownDrive, heard: Heard) -> SpeedCommand:
        """Return v within its limits; see :class:`TorqueLaw`."""
        time = writer.sample_time
        proportional = self._proportional(drive, time) if self.proportional is None else self.proportional
        whole = SLOW_PART * proportional if self.integral is None else self.integral
        gain = writer.setting(
            "proportional", "rad/s/N/m", "torque loop: speed command per torque error", proportional
        )
        slow = writer.setting("integral", "rad/s^2/N/m", "torque loop: integral gain", whole)
        fast = writer.setting("derivative", "rad/N/m", "torque loop: derivative gain", self.derivative)
        corner = writer.setting(
            "derivative_bandwidth", "Hz", "torque loop: corner of the filter on the derivative",
            self.derivative_bandwidth,
        )  # fmt: skip
        error = heard.desired - heard.torque
        rate = filtered_rate(
            writer,
            "torque_loop.error",
            value=error,
            corner=corner,
            of="torque error",
            unit="N*m",
            rate_unit="N*m/s",
        )
        integral = writer.state("torque_loop.integral", "rad/s", "integral part of the speed command")
        asked = gain * error + integral + fast * rate
        speed = held_speed(writer, asked, self.speed_limit, self.acceleration_limit)

        def finish(held: HeldBack) -> None:
            one = Integration(
                "torque", integral, error, slow * error, (held.speed, held.current),
                held.speed + held.current * held.speed_per_current,
            )  # fmt: skip
            writer.follow("torque_loop.integral", self.windup.following(writer, one))

        return SpeedCommand(speed, asked - speed, ca.SX(0), finish)

    def _proportional(self, drive: KnownDrive, sample_time: float) -> float:
        """Return the gain with which the loop closes at its bandwidth where the spring is stiffest."""
        stiffest = float(np.max(stiffness_table(drive).values[:, 0]))
        if stiffest <= 0.0:
            raise ValueRangeError(
                f"proportional gain of '{drive.plant.name}'",
                "has no default: the spring has no stiffness",
                next_step="give PidTorque(proportional=...)",
            )
        return 2.0 * math.pi * ScheduledTorque().closes_at(sample_time) / stiffest


def held_speed(writer: LawWriter, asked: Expression, limit: float, acceleration: float | None) -> Expression:
    """Return a speed command within its limit, and within that of its change where there is one.

    ``acceleration``: in rad/s²; ``None`` for none.
    """
    most = writer.setting("speed_limit", "rad/s", "torque loop: largest speed command", limit)
    speed = limited(asked, most)
    if acceleration is None:
        return speed
    change = writer.sample_time * writer.setting(
        "acceleration_limit", "rad/s^2", "torque loop: largest change of the speed command per second",
        acceleration,
    )  # fmt: skip
    before = writer.state("torque_loop.command.previous", "rad/s", "speed command one sample ago")
    speed = before + limited(speed - before, change)
    writer.follow("torque_loop.command.previous", speed)
    return speed


def check_settings(part: object) -> None:
    """Check that the numbers of a part of a controller are finite and not negative.

    ``part``: a dataclass; what is no number passes.
    """
    for name, value in vars(part).items():
        if isinstance(value, int | float) and not (math.isfinite(value) and value >= 0.0):
            raise ValueRangeError(f"{name} {value:g}", "must be finite and not negative")


POINTS = 257
"""Grid points of the table of the stiffness; odd, so that zero is one of them."""

BANDWIDTH = 12.0
"""Bandwidth in Hz by default, where the sampling rate carries it."""

SHARE_OF_RATE = 0.012
"""Share of the sampling rate that the bandwidth has at most by default."""

FLOOR_SHARE = 0.2
"""Floor of the stiffness over the secant stiffness at the end of the contour, by default."""


LEAST_FLOOR = 1e-3
"""Least floor over the secant stiffness where the spring has no stiffness somewhere."""


class DesiredRate(ABC):
    """Where the rate of the desired torque comes from."""

    @abstractmethod
    def rate(self, writer: LawWriter, drive: KnownDrive, heard: Heard) -> Expression:
        """Return dT_d/dt in N·m/s; it is asked with what :meth:`TorqueLaw.command` gets."""


@dataclass(frozen=True)
class FilteredDifference(DesiredRate):
    """The rate is the difference of the desired torque over a sample, behind a low-pass of first order.

    Parameters
    ----------
    bandwidth
        Cut-off frequency in Hz.

    Raises
    ------
    ValueRangeError
        If it is negative or not finite.
    """

    bandwidth: float = 150.0

    def __post_init__(self) -> None:
        check_settings(self)

    def rate(self, writer: LawWriter, drive: KnownDrive, heard: Heard) -> Expression:
        """Return the filtered difference; see :class:`DesiredRate`."""
        corner = writer.setting(
            "rate_bandwidth", "Hz", "torque loop: corner of the filter on the rate of the desired torque",
            self.bandwidth,
        )  # fmt: skip
        return filtered_rate(
            writer,
            "torque_loop.desired",
            value=heard.desired,
            corner=corner,
            of="desired torque",
            unit="N*m",
            rate_unit="N*m/s",
        )


@dataclass(frozen=True)
class GivenRate(DesiredRate):
    """The rate is an input, ``spring.torque.desired.rate``, given by whoever plans the torque."""

    def rate(self, writer: LawWriter, drive: KnownDrive, heard: Heard) -> Expression:
        """Return the input; see :class:`DesiredRate`."""
        return writer.input(
            drive.names.desired_rate, "N*m/s", "rate of the torque that the spring should have"
        )


@dataclass(frozen=True)
class ScheduledTorque(TorqueLaw):
    """Speed by tangent stiffness: v = (c·dT_d/dt + 2π·f_c·(T_d − T̂))/k(φ), k = √(k_t(φ)² + k_0²).

    k_t is the slope of the torque at rest over the measured angle, a table from the equations of the plant;
    the floor k_0 holds the command finite where the spring has no stiffness, as at the centre of a two-sided
    cam. The loop gain is 2π·f_c whatever the angle, so a stiffening spring keeps its margins. The rate of
    the feedforward part is known beforehand and goes to the velocity loop as an acceleration.
    Sources: definition (dT/dt = k_t·dφ/dt); Vallery et al. 2008 (around a velocity loop).

    Parameters
    ----------
    bandwidth
        f_c in Hz; by default 12 Hz, or 0.012 of the sampling rate where that is less.
    stiffness_floor
        k_0 in N·m/rad; by default a fifth of the secant stiffness at the end of the table, torque
        over angle.
    feedforward
        Share c of the rate of the desired torque, 1.
    acceleration_share
        Share of the acceleration known beforehand that goes to the velocity loop, 1.
    acceleration_bandwidth
        Cut-off frequency of the filter on it, in Hz.
    speed_limit
        Largest speed of the spring that is commanded, in rad/s.
    acceleration_limit
        Largest change of the speed command per second, in rad/s²; ``None`` for none.
    rate
        Where dT_d/dt comes from.

    Raises
    ------
    ValueRangeError
        If a setting is negative or not finite; when it is written also if the floor is zero and the spring
        has no stiffness somewhere.
    """

    title: ClassVar[str] = "speed by tangent stiffness on the estimated torque"

    bandwidth: float | None = None
    stiffness_floor: float | None = None
    feedforward: float = 1.0
    acceleration_share: float = 1.0
    acceleration_bandwidth: float = 100.0
    speed_limit: float = 60.0
    acceleration_limit: float | None = None
    rate: DesiredRate = field(default_factory=FilteredDifference)

    def __post_init__(self) -> None:
        check_settings(self)

    def closes_at(self, sample_time: float) -> float:
        """Return f_c in Hz; see :class:`TorqueLaw`."""
        return min(BANDWIDTH, SHARE_OF_RATE / sample_time) if self.bandwidth is None else self.bandwidth

    def command(self, writer: LawWriter, drive: KnownDrive, heard: Heard) -> SpeedCommand:
        """Return v within its limits; see :class:`TorqueLaw`."""
        stiffness = self._stiffness(writer, drive, heard)
        closes_at = self.closes_at(writer.sample_time)
        gain = 2.0 * math.pi * writer.setting("bandwidth", "Hz", "torque loop: bandwidth", closes_at)
        share = writer.setting(
            "feedforward", "1", "torque loop: share of the rate of the desired torque", self.feedforward
        )
        ahead = share * self.rate.rate(writer, drive, heard) / stiffness
        asked = ahead + gain * (heard.desired - heard.torque) / stiffness
        speed = held_speed(writer, asked, self.speed_limit, self.acceleration_limit)

        def finish(held: HeldBack) -> None:
            """There is no integral that could wind up."""

        return SpeedCommand(speed, asked - speed, self._acceleration(writer, ahead), finish)

    def _stiffness(self, writer: LawWriter, drive: KnownDrive, heard: Heard) -> Expression:
        table = stiffness_table(drive)
        if table.argument != drive.names.angle:
            writer.input(table.argument, "rad", "measured angle of the spring")
        (slope,) = writer.look_up(table)
        # The torque at the stiffer end of the table over the angle there, in N·m/rad. A mean of the slopes,
        # so that a corner of the law at one angle does not decide.
        stiffnesses = table.values[:, 0]
        sides = [(table.grid >= 0.0), (table.grid <= 0.0)]
        secant = max(float(np.mean(stiffnesses[side])) for side in sides if np.any(side))
        smallest = int(np.argmin(stiffnesses))
        value = FLOOR_SHARE * secant if self.stiffness_floor is None else self.stiffness_floor
        least = LEAST_FLOOR * secant if table.values[smallest, 0] <= LEAST_FLOOR * secant else 0.0
        angle = round(float(table.grid[smallest]), 9) + 0.0
        if value < least or secant <= 0.0:
            raise ValueRangeError(
                f"stiffness_floor {value:g} N·m/rad",
                f"the spring has no stiffness at {angle:.4g} rad, so the law would divide by zero there",
                next_step=f"give at least {least:.2g} N·m/rad; a fifth of the secant stiffness, "
                f"{FLOOR_SHARE * secant:.3g} N·m/rad, is the default",
            )
        stiffness_floor = Variable(
            f"{GAIN}.stiffness_floor", "N*m/rad", "torque loop: stiffness that the law takes at least",
            value, value or 1.0, least,
        )  # fmt: skip
        floor = writer.number(stiffness_floor)
        stiffness = ca.sqrt(slope * slope + floor * floor)
        name = f"{series_spring(drive.plant).name}.stiffness.scheduled"
        return writer.signal(name, "N*m/rad", "stiffness that the law divides by", stiffness)

    def _acceleration(self, writer: LawWriter, ahead: Expression) -> Expression:
        """Return the filtered rate of the feedforward part of the speed.

        The speed is not limited before: where the spring has no stiffness the command jumps, and the current
        limit then holds acceleration and braking alike.
        """
        share = writer.setting(
            "acceleration_share", "1", "torque loop: share of the acceleration known beforehand",
            self.acceleration_share,
        )  # fmt: skip
        corner = writer.setting(
            "acceleration_bandwidth", "Hz", "torque loop: corner of the filter on that acceleration",
            self.acceleration_bandwidth,
        )  # fmt: skip
        return share * filtered_rate(
            writer,
            "torque_loop.feedforward",
            value=ahead,
            corner=corner,
            of="feedforward",
            unit="rad/s",
            rate_unit="rad/s^2",
        )


def stiffness_table(drive: KnownDrive) -> Table:
    """Return the slope of the spring's torque at rest over its measured angle, zero where the torque falls.

    Over the contour of the cam, or ±90° where there is none; held at the ends, as the lever arm is. All inner
    states of the spring are relaxed, or as they start where only motion moves them, as in hysteresis. The
    argument is the angle of the motor where that alone tells the angle of the spring, else the angle of the
    spring, which is then an input of its own.
    """
    plant, body = drive.plant, drive.body
    free = [each.name for each in plant.bodies if not each.prescribed and each.name != body.name]
    if free:
        raise ArrangementError(
            f"body '{free[0]}'", "moves freely, so the spring has no torque at rest to schedule by",
            next_step="design the controller on the same machine with a Fixed load: names and numbers stay",
        )  # fmt: skip
    spring, turns = series_spring(plant), drive.spring_turns_value
    end = min(contour_ends(plant, spring).values(), default=math.pi / 2.0)
    angles = np.linspace(-end, end, POINTS)
    offset = plant.evaluate(list(plant.start(plant.states)))[spring.motion]
    offset -= turns * float(plant.variable(body.motion).start)
    # The mean slope of each cell around a grid point, so that the sum over the table is the torque.
    edges = np.concatenate([angles[:1], (angles[1:] + angles[:-1]) / 2.0, angles[-1:]])
    symbols = plant.symbols()
    (at_rest,) = evaluate_at(
        plant,
        symbols,
        [named(plant, symbols)[spring.effort]],
        rest_states(plant, (edges - offset) / turns, unmoved=True),
    )
    torques = at_rest.ravel()
    slopes = np.maximum(np.diff(torques) / np.diff(edges), 0.0)
    column = Variable(f"{spring.name}.tangent_stiffness", "N*m/rad", f"slope of {spring.effort} at rest")
    if not drive.spring_seen_at_the_motor:
        return Table(spring.motion, -end, float(angles[1] - angles[0]), (column,), slopes[:, None])
    seen = (angles - offset) / turns
    order = np.argsort(seen)
    step = float(abs(seen[1] - seen[0]))
    return Table(body.motion, float(np.min(seen)), step, (column,), slopes[order][:, None])
