"""Inner velocity loop: from a speed command to the motor current; with an observer of disturbances."""

from __future__ import annotations

import math
from dataclasses import dataclass, field
from typing import NamedTuple

import casadi as ca

from ....foundation.errors import ValueRangeError
from ....foundation.symbolic import Expression
from ....model import Variable
from .known_drive import KnownDrive, current_for, currents_of_supply, known_load
from .law_writer import GAIN, AntiWindup, ConditionalIntegration, Integration, LawWriter, limited
from .outer_laws import Heard, HeldBack, SpeedCommand, check_settings


@dataclass(frozen=True)
class DisturbanceObserver:
    """Disturbance torque d̂ = Q(s)·(J·s·ω − k·I + r·T̂ + friction); the motor is given its opposite.

    Q is a low-pass of first order. The current in the balance is the one that acted: the commands of earlier
    samples, as late as they act. With it the drive answers as its nominal inertia up to the bandwidth of Q;
    in place of the integral of the velocity loop.
    Sources: Ohnishi et al. 1996; Kong et al. 2009 (on the motor of a series elastic drive); Paine et al. 2014
    (in a force loop).

    Parameters
    ----------
    bandwidth
        Of Q in Hz.
    delay
        Samples between the computation of a current and its effect, as in a closed loop: a whole number.

    Raises
    ------
    ValueRangeError
        If the bandwidth is negative or not finite, or the delay is no whole number from 0 to 20.
    """

    bandwidth: float = 10.0
    delay: int = 1

    def __post_init__(self) -> None:
        check_settings(self)
        if not (isinstance(self.delay, int) and 0 <= self.delay <= 20):
            raise ValueRangeError(f"delay {self.delay}", "must be a whole number of samples from 0 to 20")

    def torque(
        self,
        writer: LawWriter,
        *,
        inertia: Expression,
        torque_per_current: Expression,
        raw_speed: Expression,
        load: Expression,
    ) -> Expression:
        """Return d̂, the torque in N·m that accelerates the motor beyond what is known.

        Parameters
        ----------
        writer
            Of the controller.
        inertia, torque_per_current
            Of the motor: J in kg·m² and k in N·m/A.
        raw_speed
            Difference of the measured angle over the last sample, in rad/s.
        load
            Torque that the motor is known to work against, in N·m: spring and friction.
        """
        corner = writer.setting(
            "disturbance_bandwidth", "Hz", "disturbance observer: corner of its filter", self.bandwidth
        )
        speed = writer.state("disturbance_observer.speed.previous", "rad/s", "speed over the sample before")
        load_before = writer.state("disturbance_observer.load.previous", "N*m", "known load one sample ago")
        estimate = writer.state("disturbance_observer.torque", "N*m", "estimated disturbance torque")
        # currents[i] was computed i + 1 samples ago and acted from i + 1 − delay samples ago on.
        currents = [
            writer.state(_current(i), "A", f"current computed {i} samples ago")
            for i in range(1, self.delay + 3)
        ]
        # The difference of two mean speeds is the mean acceleration of both samples, each counted half.
        acting = (currents[self.delay] + currents[self.delay + 1]) / 2
        apart = inertia * (raw_speed - speed) / writer.sample_time - torque_per_current * acting + load_before
        disturbance = writer.low_pass(estimate, apart, corner)
        writer.follow("disturbance_observer.speed.previous", raw_speed)
        writer.begin("disturbance_observer.load.previous", load)
        writer.follow("disturbance_observer.load.previous", load)
        writer.follow("disturbance_observer.torque", disturbance)
        for i in range(2, self.delay + 3):
            writer.follow(_current(i), currents[i - 2])
        return ca.SX(disturbance)

    def remember(self, writer: LawWriter, current: Expression) -> None:
        """Keep the current that was computed at this sample.

        Parameters
        ----------
        writer
            Of the controller.
        current
            Within its limits, in A.
        """
        writer.follow(_current(1), current)


def _current(number: int) -> str:
    return f"disturbance_observer.current[{number}]"


BANDWIDTH = 45.0
"""Bandwidth in Hz by default, where the sampling rate carries it."""

SHARE_OF_RATE = 0.045
"""Share of the sampling rate that the bandwidth has at most by default: 33° of phase for two samples."""

LEAST_WIDTH = 1e-6
"""Least speed in rad/s over which the compensated friction changes sign."""


@dataclass(frozen=True)
class FrictionCompensation:
    """Adds what the plant declares to resist its motor beside the spring, at the commanded speed.

    Friction, also where it depends on the place or grows with the load, and what else acts on the motor as a
    function of angle and speed: ripple, weights, constant loads; no end stop. At the measured angle and the
    estimated torque of the spring. The plant's own numbers are parameters of the controller.

    Parameters
    ----------
    share
        Of that torque that is added, 1.
    width
        Speed in rad/s over which friction changes sign: the larger, the less a command near zero chatters.

    Raises
    ------
    ValueRangeError
        If a setting is negative or not finite, or the width is zero.
    """

    share: float = 1.0
    width: float = 1.0

    def __post_init__(self) -> None:
        check_settings(self)
        if self.width < LEAST_WIDTH:
            raise ValueRangeError(
                f"width {self.width:g} rad/s", f"must be at least {LEAST_WIDTH:g} rad/s",
                next_step="take about the speed that one count of the encoder per sample is",
            )  # fmt: skip

    def torque(
        self, writer: LawWriter, drive: KnownDrive, heard: Heard, speed: Expression, *, gain: Expression
    ) -> Expression:
        """Return the torque in N·m that resists the motor at a speed.

        Parameters
        ----------
        writer, drive, heard
            As a :class:`TorqueLaw` gets them.
        speed
            Of the motor in rad/s.
        gain
            Of the velocity loop in N·m·s/rad.
        """
        share = writer.setting(
            "friction_share", "1", "velocity loop: share of the declared friction and loads added", self.share
        )
        width = writer.number(
            Variable(
                f"{GAIN}.friction_width", "rad/s", "velocity loop: speed over which that changes sign",
                self.width, self.width, LEAST_WIDTH,
            )
        )  # fmt: skip
        return share * known_load(drive, writer, width, gain)(heard.angle, speed, heard.torque)


class MotorCurrent(NamedTuple):
    """What the velocity loop asks for."""

    current: Expression  # within its limits, in A
    held: HeldBack  # what the limits held back, for the outer law
    speed: Expression  # filtered speed of the motor in rad/s


@dataclass(frozen=True)
class VelocityLoop:
    """PI on the filtered speed: D(I) = J·ω_b·(ω_d − ω̂)·(1 + ω_i∫dt) + J·ω̇_d + c·r·T̂ + R(θ, ω_d, T̂) − d̂.

    D is k·I, or what the plant declares of a drive whose gain falls with the current; R is what resists the
    motor, see :class:`FrictionCompensation`. ω_d is the commanded speed of the motor, ω̇_d its rate as far as
    the outer law knows it, ω̂ the filtered difference of the measured angle. The current is held within
    ±I_max, and within what the supply can push through the winding, (±U_max − k·ω̂)/R, where the motor
    declares a resistance. Source: Vallery et al. 2008.

    Parameters
    ----------
    bandwidth
        Of the velocity loop, f_b = ω_b/2π in Hz; by default 45 Hz, or 0.045 of the sampling rate where that
        is less.
    integral
        Frequency f_i = ω_i/2π below which it integrates, in Hz.
    speed_bandwidth
        Cut-off frequency of the filter on the difference of the encoder, in Hz.
    compensation
        Share c of the estimated spring torque that is added, so that the loop does not have to carry it.
    friction
        Compensation of what resists the motor; ``None`` for none.
    disturbance
        Disturbance observer; ``None`` for none.
    windup
        What the integral does while the current is at its limit.

    Raises
    ------
    ValueRangeError
        If a setting is negative or not finite.
    """

    bandwidth: float | None = None
    integral: float = 3.0
    speed_bandwidth: float = 500.0
    compensation: float = 1.0
    friction: FrictionCompensation | None = field(default_factory=FrictionCompensation)
    disturbance: DisturbanceObserver | None = None
    windup: AntiWindup = field(default_factory=ConditionalIntegration)

    def __post_init__(self) -> None:
        check_settings(self)

    def closes_at(self, sample_time: float) -> float:
        """Return the bandwidth in Hz.

        Parameters
        ----------
        sample_time
            In s.
        """
        return min(BANDWIDTH, SHARE_OF_RATE / sample_time) if self.bandwidth is None else self.bandwidth

    def current(
        self, writer: LawWriter, drive: KnownDrive, heard: Heard, command: SpeedCommand
    ) -> MotorCurrent:
        """Write the loop into a controller and return the current, for the command of its outer law."""
        raw, speed = self.measured_speed(writer, drive, heard)
        slow = writer.state("velocity_loop.integral", "N*m", "integral part of the motor torque")
        turns, inertia = drive.spring_turns(writer), drive.inertia(writer)
        constant = drive.torque_per_current(writer)
        closes_at = writer.setting(
            "velocity_bandwidth", "Hz", "velocity loop: bandwidth", self.closes_at(writer.sample_time)
        )
        stiffness = inertia * 2.0 * math.pi * closes_at
        share = writer.setting(
            "compensation", "1", "velocity loop: share of the estimated spring torque added to the current",
            self.compensation,
        )  # fmt: skip
        wanted_speed = command.speed / turns
        lacking = wanted_speed - speed
        load = turns * heard.torque
        torque = stiffness * lacking + slow + share * load + inertia * command.acceleration / turns
        if self.friction is not None:
            torque += self.friction.torque(writer, drive, heard, wanted_speed, gain=stiffness)
        if self.disturbance is not None:
            resisting = (
                load
                if self.friction is None
                else load + self.friction.torque(writer, drive, heard, speed, gain=stiffness)
            )
            torque -= self.disturbance.torque(
                writer, inertia=inertia, torque_per_current=constant, raw_speed=raw, load=resisting
            )
        wanted = current_for(drive, writer, torque)
        current = self._limited(writer, drive, wanted, speed)
        if self.disturbance is not None:
            self.disturbance.remember(writer, current)
        beyond = wanted - current
        rate = 2.0 * math.pi * writer.setting(
            "velocity_integral", "Hz", "velocity loop: corner below which it integrates", self.integral
        )  # fmt: skip
        one = Integration("velocity", slow, lacking, rate * stiffness * lacking, (beyond,), beyond * constant)
        writer.follow("velocity_loop.integral", self.windup.following(writer, one))
        return MotorCurrent(
            current,
            HeldBack(command.beyond, beyond * ca.sign(turns), ca.fabs(turns) * constant / stiffness),
            speed,
        )

    def measured_speed(
        self, writer: LawWriter, drive: KnownDrive, heard: Heard
    ) -> tuple[Expression, Expression]:
        """Return the difference of the measured angle over a sample, and the same behind the filter."""
        names = drive.names
        before = writer.state(f"{names.angle}.previous", "rad", "measured angle one sample ago")
        old = writer.state(f"{names.speed}.filtered", "rad/s", "filtered difference of the measured angle")
        corner = writer.setting(
            "speed_bandwidth", "Hz", "velocity loop: corner of the filter on the difference of the encoder",
            self.speed_bandwidth,
        )  # fmt: skip
        raw = (heard.angle - before) / writer.sample_time
        speed = writer.low_pass(old, raw, corner)
        writer.begin(f"{names.angle}.previous", heard.angle, resumes=True)
        writer.follow(f"{names.angle}.previous", heard.angle)
        writer.follow(f"{names.speed}.filtered", speed)
        return raw, speed

    def _limited(
        self, writer: LawWriter, drive: KnownDrive, wanted: Expression, speed: Expression
    ) -> Expression:
        current = limited(wanted, drive.current_limit(writer))
        supply = currents_of_supply(drive, writer, speed)
        if supply is None:
            return current
        return ca.fmin(ca.fmax(current, supply[0]), supply[1])
