"""Outer laws of a torque loop: from desired and estimated torque to the speed that the spring should have."""

from __future__ import annotations

import math
from abc import ABC, abstractmethod
from collections.abc import Callable
from dataclasses import dataclass, field
from typing import ClassVar, NamedTuple

import casadi as ca

from ....foundation.errors import ValueRangeError
from ....foundation.symbolic import Expression
from .known_drive import KnownDrive
from .law_writer import LawWriter, limited
from .windup import AntiWindup, ConditionalIntegration, Integration


class Heard(NamedTuple):
    """What a controller is given at a sample.

    Parameters
    ----------
    desired, torque
        Torque that the spring should have, and the estimate of the one it has, in N·m.
    angle
        Measured angle of the motor in rad.
    """

    desired: Expression
    torque: Expression
    angle: Expression


class HeldBack(NamedTuple):
    """By how much commands exceed their limits at a sample; zero within them.

    Parameters
    ----------
    speed
        Of the spring, in rad/s.
    current
        In A.
    speed_per_current
        Speed of the spring that makes one ampere, in rad/s/A; its sign says which way the current pushes.
    """

    speed: Expression
    current: Expression
    speed_per_current: Expression


class SpeedCommand(NamedTuple):
    """What an outer law asks for.

    Parameters
    ----------
    speed
        Of the spring, within its limits, in rad/s.
    beyond
        What the limits took away, in rad/s.
    acceleration
        Of the spring, as far as the law knows it beforehand, in rad/s².
    finish
        Takes what all limits held back and says what the states of the law are one sample later.
    """

    speed: Expression
    beyond: Expression
    acceleration: Expression
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
    whatever the spring. The loop gain is Kp·k_t(θ): a stiffening spring loses margin.
    Sources: Pratt and Williamson 1995; Robinson 2000; Vallery et al. 2008 (around a velocity loop).

    Parameters
    ----------
    proportional
        Kp in rad/s per N·m.
    integral
        Ki in rad/s² per N·m.
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
        If a setting is negative or not finite.
    """

    title: ClassVar[str] = "PID on the estimated torque"

    proportional: float = 32.0
    integral: float = 100.0
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
        before = writer.state("torque_loop.error.previous", "N*m", "torque error one sample ago")
        old_rate = writer.state("torque_loop.error.rate", "N*m/s", "filtered rate of the torque error")
        integral = writer.state("torque_loop.integral", "rad/s", "integral part of the speed command")
        gain = writer.setting(
            "proportional", "rad/s/N/m", "torque loop: speed command per torque error", self.proportional
        )
        slow = writer.setting("integral", "rad/s^2/N/m", "torque loop: integral gain", self.integral)
        fast = writer.setting("derivative", "rad/N/m", "torque loop: derivative gain", self.derivative)
        corner = writer.setting(
            "derivative_bandwidth", "Hz", "torque loop: corner of the filter on the derivative",
            self.derivative_bandwidth,
        )  # fmt: skip
        error = heard.desired - heard.torque
        rate = writer.low_pass(old_rate, (error - before) / time, corner)
        asked = gain * error + integral + fast * rate
        speed = held_speed(writer, asked, self.speed_limit, self.acceleration_limit)

        def finish(held: HeldBack) -> None:
            writer.begin("torque_loop.error.previous", error)
            writer.follow("torque_loop.error.previous", error)
            writer.follow("torque_loop.error.rate", rate)
            one = Integration(
                "torque", integral, error, slow * error, (held.speed, held.current),
                held.speed + held.current * held.speed_per_current,
            )  # fmt: skip
            writer.follow("torque_loop.integral", self.windup.following(writer, one))

        return SpeedCommand(speed, asked - speed, ca.SX(0), finish)


def held_speed(writer: LawWriter, asked: Expression, limit: float, acceleration: float | None) -> Expression:
    """Return a speed command within its limit, and within that of its change where there is one.

    Parameters
    ----------
    writer
        Of the controller.
    asked
        In rad/s.
    limit
        In rad/s.
    acceleration
        In rad/s²; ``None`` for none.
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

    Parameters
    ----------
    part
        A dataclass; what is no number passes.

    Raises
    ------
    ValueRangeError
        If one is not.
    """
    for name, value in vars(part).items():
        if isinstance(value, int | float) and not (math.isfinite(value) and value >= 0.0):
            raise ValueRangeError(f"{name} {value:g}", "must be finite and not negative")
