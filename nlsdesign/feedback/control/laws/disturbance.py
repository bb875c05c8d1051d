"""Disturbance observer on the motor side: what the drive's numbers do not explain."""

from __future__ import annotations

from dataclasses import dataclass
from typing import NamedTuple

import casadi as ca

from ....foundation.errors import ValueRangeError
from ....foundation.symbolic import Expression
from .law_writer import LawWriter
from .outer_laws import check_settings


class MotorBalance(NamedTuple):
    """What a disturbance observer compares at a sample.

    Parameters
    ----------
    inertia
        J in kg·m².
    torque_per_current
        k in N·m/A.
    raw_speed
        Difference of the measured angle over the last sample, in rad/s.
    load
        Torque that the motor is known to work against, in N·m: spring and friction.
    """

    inertia: Expression
    torque_per_current: Expression
    raw_speed: Expression
    load: Expression


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

    def torque(self, writer: LawWriter, balance: MotorBalance) -> Expression:
        """Return d̂, the torque in N·m that accelerates the motor beyond what is known.

        Parameters
        ----------
        writer
            Of the controller.
        balance
            Of the motor.
        """
        corner = writer.setting(
            "disturbance_bandwidth", "Hz", "disturbance observer: corner of its filter", self.bandwidth
        )
        speed = writer.state("disturbance_observer.speed.previous", "rad/s", "speed over the sample before")
        load = writer.state("disturbance_observer.load.previous", "N*m", "known load one sample ago")
        estimate = writer.state("disturbance_observer.torque", "N*m", "estimated disturbance torque")
        # currents[i] was computed i + 1 samples ago and acted from i + 1 − delay samples ago on.
        currents = [
            writer.state(_current(i), "A", f"current computed {i} samples ago")
            for i in range(1, self.delay + 3)
        ]
        # The difference of two mean speeds is the mean acceleration of both samples, each counted half.
        acting = (currents[self.delay] + currents[self.delay + 1]) / 2
        apart = (
            balance.inertia * (balance.raw_speed - speed) / writer.sample_time
            - balance.torque_per_current * acting
            + load
        )
        disturbance = writer.low_pass(estimate, apart, corner)
        writer.follow("disturbance_observer.speed.previous", balance.raw_speed)
        writer.begin("disturbance_observer.load.previous", balance.load)
        writer.follow("disturbance_observer.load.previous", balance.load)
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
