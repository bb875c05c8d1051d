"""Sensors: what the bench and the controller see of a signal.

Decision. A flat model is continuous, so a sensor gives it what is continuous of the reading: gain, bias,
drift, delay and filter, and the rounding of an encoder as a static function. Noise, exact delay, sample rate
and hold live in :meth:`Sensor.recorded`, which :func:`nlsdesign.simulation.trace` asks for what the bench
would have written down of a simulated run. A controller that samples is a discrete flat model of its own with
its own sample time; a hold inside the plant would count its half sample twice.

A sensor may read an earlier sensor: ``of="cell.reading"``.
"""

from __future__ import annotations

from abc import abstractmethod
from dataclasses import dataclass
from typing import ClassVar, Protocol, Self

import casadi as ca
import numpy as np

from ...foundation.arrays import Array
from ...foundation.errors import ValueRangeError
from ...foundation.quantity import Quantity, same_dimension
from ...foundation.symbolic import Expression
from ..core.domain import ROTATION, TRANSLATION, Domain
from ..core.element import Scope
from ..core.part import Part, parameter
from ..core.part_numbers import NotDeclared, Reading, one_of, read_as


class Numbers(Protocol):
    """Gives the symbols of a part's own numbers."""

    def parameter(self, name: str) -> Expression:
        """Return the symbol of one number."""
        ...

    def memory(self, name: str) -> Expression:
        """Return the symbol of one of the part's own states."""
        ...


@dataclass(frozen=True, kw_only=True)
class Sensor(Part):
    """Base of everything that reads a signal.

    Parameters
    ----------
    of
        Full name of the signal that is read, for instance ``"motor.angle"``.
    """

    units: ClassVar[tuple[str, ...]] = ()
    """Units of the signals that it can read; any if there are none."""
    shows_value: ClassVar[bool] = True
    """Whether what is read can be inferred from the reading; not from a rate."""

    of: str

    def sees(self, unit: str) -> bool:
        """Tell whether it can read a signal in this unit.

        Parameters
        ----------
        unit
            Of the signal.
        """
        return not self.units or any(same_dimension(unit, own) for own in self.units)

    @abstractmethod
    def read(self, scope: Scope, value: Expression, unit: str) -> Expression:
        """Return the continuous reading of a value.

        Parameters
        ----------
        scope
            Gives parameters, takes states.
        value
            What is read.
        unit
            Its unit.
        """

    @abstractmethod
    def recorded(self, times: Array, values: Array, noise: np.random.Generator) -> Array:
        """Return what the bench would have written down.

        Parameters
        ----------
        times
            Strictly ascending, in s, shape (n,).
        values
            What was to be read at these times, shape (n,).
        noise
            Source of chance.

        Returns
        -------
        numpy.ndarray
            Shape (n,).

        Raises
        ------
        ValueRangeError
            If the times lie wider apart than the samples of the sensor.
        """

    def reading_unit(self, unit: str) -> str:
        """Return the unit of the reading of a signal.

        Parameters
        ----------
        unit
            Of the signal.
        """
        return unit

    @property
    def late_by(self) -> str | None:
        """Name of the parameter that says by how much the reading is late, if there is one."""
        return None

    @property
    def stretched_by(self) -> str | None:
        """Name of the parameter that says by how much per time the reading becomes late, if there is one."""
        return None

    def infer(self, numbers: Numbers, reading: Expression) -> Expression:
        """Return the value behind a reading: the inverse of :meth:`read`, but for rounding, noise and delay.

        Parameters
        ----------
        numbers
            Gives the sensor's own parameters.
        reading
            What the sensor gave, ``late_by`` later.

        Raises
        ------
        ArrangementError
            If the reading does not show the value, see ``shows_value``.
        """
        return reading


@dataclass(frozen=True)
class ReadingLimits(Reading):
    """What a reading of the encoder can be on this machine; they enter no law.

    Generated code does not use a reading beyond them, and its status word says so.

    Examples
    --------
    >>> limits = ReadingLimits(lowest_reading=-1.5, highest_reading=1.5, largest_rate=90.0, stale_time=0.1)
    >>> limits.stale_time
    0.1
    """

    lowest_reading: Quantity = parameter("{motion}", "smallest possible reading", minimum=-1e5, maximum=1e5)
    highest_reading: Quantity = parameter("{motion}", "largest possible reading", minimum=-1e5, maximum=1e5)
    largest_rate: Quantity = parameter("{rate}", "fastest motion", minimum=1e-6, maximum=1e6)
    stale_time: Quantity = parameter(
        "s",
        "time without change while the drive changes",
        minimum=1e-6,
        maximum=1e4,
    )

    def within(self, domain: Domain | None) -> Self:
        """Return a copy whose numbers are checked.

        Parameters
        ----------
        domain
            Of the sensor.

        Raises
        ------
        ValueRangeError
            If the lowest reading is not below the highest.
        """
        checked = super().within(domain)
        if not checked.lowest_reading.number < checked.highest_reading.number:
            raise ValueRangeError(
                f"lowest_reading = {checked.lowest_reading}, highest_reading = {checked.highest_reading}",
                "leave no reading that could be used",
                next_step="give the lowest reading below the highest",
            )
        return checked


@dataclass(frozen=True, kw_only=True)
class Encoder(Sensor):
    """Incremental encoder: reading = q·round(x/q), of an angle or of a position along a line.

    The reading has no derivative; use the motion for that. :class:`ReadingLimits` may be declared, for the
    guards of generated code.

    Examples
    --------
    >>> from nlsdesign import quantity
    >>> Encoder(of="carriage.position", quantum=quantity(5, "um")).sees("m")
    True
    """

    units: ClassVar[tuple[str, ...]] = ("rad", "m")

    domain: Domain = one_of(ROTATION, TRANSLATION)
    quantum: Quantity = parameter("{motion}", "motion of one count", minimum=1e-9, maximum=1.0)
    limits: Reading = read_as(NotDeclared, ReadingLimits, default=NotDeclared())

    def sees(self, unit: str) -> bool:
        """Tell whether a motion is in the unit of the count."""
        return same_dimension(unit, self.domain.motion_unit)

    def read(self, scope: Scope, value: Expression, unit: str) -> Expression:
        """Return the motion rounded to whole counts."""
        quantum = scope.parameter("quantum")
        return quantum * ca.floor(value / quantum + 0.5)

    def recorded(self, times: Array, values: Array, noise: np.random.Generator) -> Array:
        """Return the motion rounded to whole counts."""
        quantum = self.quantum.number
        return quantum * np.floor(values / quantum + 0.5)


@dataclass(frozen=True, kw_only=True)
class _Transducer(Sensor):
    """Law of a transducer: reading = gain·x + bias; ``noise`` is the standard deviation of a sample, white.

    Its kinds say in which unit they read.
    """

    gain: Quantity = parameter("1", "gain", minimum=0.01, maximum=100.0, default=1.0)
    bias: Quantity
    noise: Quantity

    def read(self, scope: Scope, value: Expression, unit: str) -> Expression:
        """Return gain·x + bias."""
        return scope.parameter("gain") * value + scope.parameter("bias")

    def recorded(self, times: Array, values: Array, noise: np.random.Generator) -> Array:
        """Return gain·x + bias + noise."""
        scatter = self.noise.number * noise.standard_normal(len(values))
        return self.gain.number * values + self.bias.number + scatter

    def infer(self, numbers: Numbers, reading: Expression) -> Expression:
        """Return (reading − bias)/gain."""
        return (reading - numbers.parameter("bias")) / numbers.parameter("gain")


@dataclass(frozen=True, kw_only=True)
class ForceSensor(_Transducer):
    """Load cell: reading = gain·F + bias; ``noise`` is the standard deviation of a sample, white."""

    units: ClassVar[tuple[str, ...]] = ("N",)

    bias: Quantity = parameter("N", "bias", minimum=-1e6, maximum=1e6, default=0.0)
    noise: Quantity = parameter("N", "standard deviation of the noise", maximum=1e6, default=0.0)


@dataclass(frozen=True, kw_only=True)
class TorqueSensor(_Transducer):
    """Torque transducer: reading = gain·T + bias; ``noise`` is the standard deviation of a sample, white.

    Examples
    --------
    >>> TorqueSensor(of="spring.torque", noise=5e-3).title()
    'TorqueSensor(gain = 1, bias = 0 N·m, noise = 0.005 N·m)'
    """

    units: ClassVar[tuple[str, ...]] = ("N*m",)

    bias: Quantity = parameter("N*m", "bias", minimum=-1e6, maximum=1e6, default=0.0)
    noise: Quantity = parameter("N*m", "standard deviation of the noise", maximum=1e6, default=0.0)


@dataclass(frozen=True, kw_only=True)
class CurrentSensor(Sensor):
    """Ammeter: reading = I + bias. Its gain is not told apart from the motor's torque constant."""

    units: ClassVar[tuple[str, ...]] = ("A",)

    bias: Quantity = parameter("A", "bias", minimum=-1e4, maximum=1e4, default=0.0)
    noise: Quantity = parameter("A", "standard deviation of the noise", maximum=1e4, default=0.0)

    def read(self, scope: Scope, value: Expression, unit: str) -> Expression:
        """Return I + bias."""
        return value + scope.parameter("bias")

    def recorded(self, times: Array, values: Array, noise: np.random.Generator) -> Array:
        """Return I + bias + noise."""
        return values + self.bias.number + self.noise.number * noise.standard_normal(len(values))

    def infer(self, numbers: Numbers, reading: Expression) -> Expression:
        """Return reading − bias."""
        return reading - numbers.parameter("bias")
