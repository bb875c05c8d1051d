"""Faults of sensors: each is a sensor in the chain, so any of them stands before or behind any other."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from typing import ClassVar

import casadi as ca
import numpy as np

from ...foundation.arrays import Array
from ...foundation.quantity import Quantity
from ...foundation.symbolic import Expression
from ..core.domain import ROTATION, TRANSLATION, Domain
from ..core.element import Scope, delayed
from ..core.part_numbers import one_of, parameter
from .sensors import Numbers, Sensor


@dataclass(frozen=True, kw_only=True)
class TransportDelay(Sensor):
    """A bus or a filter chip that passes on everything τ later: reading(t) = value(t − τ).

    In the flat model as its (2,2) Padé approximation, see :func:`~nlsdesign.components.core.element.delayed`.
    In records the delay is exact, by lines between samples; before the first sample the value stood still.
    Source: Golub and Van Loan 2013 (Padé table of the exponential).

    Examples
    --------
    >>> TransportDelay(of="load_cell.reading", delay=1e-3).title()
    'TransportDelay(delay = 0.001 s)'
    """

    delay: Quantity = parameter("s", "transport delay", minimum=1e-6, maximum=10.0)

    @property
    def late_by(self) -> str | None:
        """The delay."""
        return "delay"

    def read(self, scope: Scope, value: Expression, unit: str) -> Expression:
        """Return the delayed value."""
        return delayed(scope, value, unit)

    def recorded(self, times: Array, values: Array, noise: np.random.Generator) -> Array:
        """Return what was there τ before."""
        return np.interp(times - self.delay.number, times, values)


@dataclass(frozen=True, kw_only=True)
class Drift(Sensor):
    """A force or torque whose zero wanders as the instrument warms up: reading = F + d·(t − t₀).

    The drift so far is a state that starts at zero, so a model does not depend on the clock. Valid for runs
    that are short against the time of warming up. Source: data sheets, "temperature coefficient of zero".

    Examples
    --------
    >>> Drift(of="spring.force", drift=0.01).parameters()["drift"].unit
    'N/s'
    """

    units: ClassVar[tuple[str, ...]] = ("N", "N*m")

    domain: Domain = one_of(TRANSLATION, ROTATION)
    drift: Quantity = parameter("{effort}/s", "change of the zero", minimum=-1e4, maximum=1e4)

    def read(self, scope: Scope, value: Expression, unit: str) -> Expression:
        """Return F + drift so far."""
        drifted = scope.state("drifted", unit, f"drift of {scope.path} so far")
        scope.derive(drifted, scope.parameter("drift"))
        return value + drifted

    def recorded(self, times: Array, values: Array, noise: np.random.Generator) -> Array:
        """Return F + drift so far."""
        line: Array = values + self.drift.number * (times - times[0])
        return line

    def infer(self, numbers: Numbers, reading: Expression) -> Expression:
        """Return reading − drift so far."""
        return reading - numbers.memory("drifted")


@dataclass(frozen=True, kw_only=True)
class LoadNonlinearity(Sensor):
    """A load cell or transducer whose gain changes with the load: reading = F·(1 + n·|F|/F_fs).

    Alike on both sides. F_fs is the full scale; data sheets state the largest distance from the line through
    zero and full scale, a quarter of n. Valid while 2·|n·F| < F_fs, so that the reading grows with the load.
    Source: data sheets, "nonlinearity in per cent of full scale".

    Examples
    --------
    >>> LoadNonlinearity(of="spring.force", nonlinearity=0.02, full_scale=200.0).title()
    'LoadNonlinearity(nonlinearity = 0.02, full_scale = 200 N)'
    """

    units: ClassVar[tuple[str, ...]] = ("N", "N*m")

    domain: Domain = one_of(TRANSLATION, ROTATION)
    nonlinearity: Quantity = parameter(
        "1", "relative change n of the gain at full scale", minimum=-1e6, maximum=1e6
    )
    full_scale: Quantity = parameter("{effort}", "full scale F_fs", minimum=1e-9, maximum=1e9)

    def read(self, scope: Scope, value: Expression, unit: str) -> Expression:
        """Return F·(1 + n·|F|/F_fs)."""
        share = ca.fabs(value) / scope.parameter("full_scale")
        return value * (1 + scope.parameter("nonlinearity") * share)

    def recorded(self, times: Array, values: Array, noise: np.random.Generator) -> Array:
        """Return F·(1 + n·|F|/F_fs)."""
        share = np.abs(values) / self.full_scale.number
        return values * (1.0 + self.nonlinearity.number * share)

    def infer(self, numbers: Numbers, reading: Expression) -> Expression:
        """Return 2·R/(1 + √(1 + 4·n·|R|/F_fs)), the load behind a reading R."""
        share = ca.fabs(reading) / numbers.parameter("full_scale")
        under_root = ca.fmax(1 + 4 * numbers.parameter("nonlinearity") * share, 1e-6)
        return 2 * reading / (1 + ca.sqrt(under_root))


@dataclass(frozen=True, kw_only=True)
class ClockDrift(Sensor):
    """An instrument with a clock of its own, late by more and more: reading(t) = value(t − ε·t), t from 0.

    ε < 0 where its clock runs ahead. In the flat model, with a = ε·t and v̇, v̈ from a filter of three equal
    lags T: v − a·(v̇ + 3·T·v̈) + a²·v̈/2, to second order. Valid where a and T are short against the motion.
    In records, and where a reading drives a model, the shift is exact. Source: Oppenheim and Schafer 2010
    (changing the sampling rate).

    Examples
    --------
    >>> ClockDrift(of="load_cell.reading", rate=2e-4).differentiating_time.number
    0.001
    """

    rate: Quantity = parameter("1", "time ε lost per time", minimum=-0.5, maximum=0.5)
    differentiating_time: Quantity = parameter(
        "s", "time constant T of the filter of the derivatives", minimum=1e-6, maximum=1.0, default=1e-3
    )

    @property
    def stretched_by(self) -> str | None:
        """The rate."""
        return "rate"

    def read(self, scope: Scope, value: Expression, unit: str) -> Expression:
        """Return the value of somewhat earlier or later."""
        lag = scope.parameter("differentiating_time")
        elapsed = scope.state("elapsed", "s", f"time that {scope.path} has run")
        lags, inner = [], value
        for place in ("first", "second", "third"):
            lags.append(scope.state(place, unit, f"value behind the {place} lag of {scope.path}"))
            scope.derive(lags[-1], (inner - lags[-1]) / lag)
            inner = lags[-1]
        scope.derive(elapsed, ca.SX(1))
        slope, bend = (lags[1] - lags[2]) / lag, (lags[0] - 2 * lags[1] + lags[2]) / lag**2
        late = scope.parameter("rate") * elapsed
        return value - late * (slope + 3 * lag * bend) + late**2 / 2 * bend

    def recorded(self, times: Array, values: Array, noise: np.random.Generator) -> Array:
        """Return what was there ε·t before."""
        earlier: Array = np.interp(times - self.rate.number * (times - times[0]), times, values)
        return earlier


@dataclass(frozen=True, kw_only=True)
class Eccentricity(Sensor):
    """An encoder disc that sits off its shaft: it shows θ + a·sin(nθ) + b·(cos(nθ) − 1).

    n is the number of turns of the disc per turn of what is read: 1, or the gear ratio for a disc on the
    motor's shaft. The error vanishes at zero, where encoders are set to zero. An eccentricity e under a read
    head at radius R gives a² + b² = (e/R)². Valid while n·√(a² + b²) < 1, so that counts grow with the angle.
    Source: geometry; data sheets (of optical encoders, "eccentricity error").

    Examples
    --------
    >>> Eccentricity(of="motor.angle", sine=0.01, cosine=0.0).title()
    'Eccentricity(sine = 0.01 rad, cosine = 0 rad, order = 1)'
    """

    units: ClassVar[tuple[str, ...]] = ("rad",)

    sine: Quantity = parameter("rad", "amplitude of the error in sin(nθ)", minimum=-0.5, maximum=0.5)
    cosine: Quantity = parameter("rad", "amplitude of the error in cos(nθ)", minimum=-0.5, maximum=0.5)
    order: Quantity = parameter(
        "1", "turns of the disc per turn of what is read", minimum=1e-3, maximum=1e5, default=1.0
    )

    def read(self, scope: Scope, value: Expression, unit: str) -> Expression:
        """Return the angle with the error of the disc."""
        return value + _disc_error(scope.parameter, value)

    def recorded(self, times: Array, values: Array, noise: np.random.Generator) -> Array:
        """Return the angles with the error of the disc."""
        phase = self.order.number * values
        error: Array = self.sine.number * np.sin(phase) + self.cosine.number * (np.cos(phase) - 1)
        return values + error

    def infer(self, numbers: Numbers, reading: Expression) -> Expression:
        """Return the angle behind a reading: three rounds of θ ← reading − error(θ).

        Each round takes the remainder down by the factor n·√(a² + b²).
        """
        angle = reading
        for _ in range(3):
            angle = reading - _disc_error(numbers.parameter, angle)
        return angle


@dataclass(frozen=True, kw_only=True)
class EncoderOffset(Sensor):
    """An encoder whose zero is off: reading = θ + θ_0, or x + x_0. Source: data sheets, "zero offset".

    Examples
    --------
    >>> EncoderOffset(of="joint.angle", offset=0.02).title()
    'EncoderOffset(offset = 0.02 rad)'
    """

    units: ClassVar[tuple[str, ...]] = ("rad", "m")

    domain: Domain = one_of(ROTATION, TRANSLATION)
    offset: Quantity = parameter("{motion}", "what is read at zero", minimum=-1e6, maximum=1e6)

    def read(self, scope: Scope, value: Expression, unit: str) -> Expression:
        """Return the motion with the offset."""
        return value + scope.parameter("offset")

    def recorded(self, times: Array, values: Array, noise: np.random.Generator) -> Array:
        """Return the motion with the offset."""
        return values + self.offset.number

    def infer(self, numbers: Numbers, reading: Expression) -> Expression:
        """Return the motion behind a reading."""
        return reading - numbers.parameter("offset")


def _disc_error(number: Callable[[str], Expression], angle: Expression) -> Expression:
    phase = number("order") * angle
    return number("sine") * ca.sin(phase) + number("cosine") * (ca.cos(phase) - 1)
