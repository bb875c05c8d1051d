"""Laws that know temperature: self-heating, and relaxation times that a temperature shifts."""

from __future__ import annotations

import math
from abc import abstractmethod
from dataclasses import dataclass

import casadi as ca

from ...errors import ArrangementError, ValueRangeError
from ...quantity import Quantity
from ...symbolic import Expression
from ..core.element import UNBOUNDED, Scope
from ..core.part import parameter, walk
from ..core.reduced_time import ReducedTime
from .stress_softening import MaterialCombination

_ROOM = 293.15


@dataclass(frozen=True, kw_only=True)
class SelfHeating(MaterialCombination):
    """Rubber that softens by its own heat: σ = g·Σσ with g = 1 − b·T', T' the rise over the ambient T₀.

    C·dT'/dt = g·D − b·T·(P − D) − h·T' with the power P put into the laws inside, what they lose D, and
    T = T₀ + T'. The middle term is the heat that a spring takes up whose modulus depends on temperature; with
    it energy is conserved exactly. b = −1/T₀ is the entropy spring of unfilled rubber, b > 0 filled. One
    temperature for the whole piece: thinner than about a centimetre. Valid while T' < 1/(2·b).
    Sources: Schapery 1964; Holzapfel 2000, ch. 7.

    Examples
    --------
    >>> from nlsdesign.components import LinearElastic
    >>> law = (("law", LinearElastic(modulus=1e6)),)
    >>> SelfHeating(members=law, heat_capacity=1.8e6, cooling=4e4, softening=3e-3).ambient.number
    293.15
    """

    heat_capacity: Quantity = parameter("J/m^3/K", "heat capacity C per volume", minimum=1e3, maximum=1e8)
    cooling: Quantity = parameter(
        "W/m^3/K", "heat h given off per volume and kelvin", minimum=0.0, maximum=1e9
    )
    softening: Quantity = parameter("1/K", "fall b of the modulus per kelvin", minimum=-0.02, maximum=0.1)
    ambient: Quantity = parameter(
        "K", "temperature T₀ around it", minimum=150.0, maximum=600.0, default=_ROOM
    )

    def effort(self, scope: Scope, motion: Expression, rate: Expression) -> Expression:
        """Return the stress at the present temperature."""
        names = ("heat_capacity", "cooling", "softening", "ambient")
        capacity, cooling, softening, ambient = (scope.parameter(name) for name in names)
        warming = scope.state("warming", "K", f"temperature of {scope.path} above the ambient")
        b = self.softening.number
        scope.signal("warming", warming, "K", "", valid=(-math.inf, 0.5 / b) if b > 0.0 else UNBOUNDED)
        scope.signal("temperature", ambient + warming, "K", f"temperature of {scope.path}")
        stress = self.stress_inside(scope, motion, rate)
        factor, lost = 1 - softening * warming, scope.losses()
        heat = factor * lost - softening * (ambient + warming) * (stress * rate - lost)
        scope.derive(warming, (heat - cooling * warming) / capacity)
        scope.loss((factor - 1) * lost)
        scope.signal("lost_power", factor * lost, "W/m^3", f"power that {scope.path} loses per volume")
        return factor * stress


@dataclass(frozen=True, kw_only=True)
class TimeShift(MaterialCombination):
    """Base of laws by which a temperature multiplies every relaxation time inside with one factor a_T."""

    temperature: Quantity = parameter("K", "temperature T", minimum=100.0, maximum=700.0)
    reference: Quantity = parameter(
        "K", "temperature T_r at which the laws inside were measured", minimum=100.0, maximum=700.0
    )

    def __post_init__(self) -> None:
        super().__post_init__()
        for path, part in walk(self):
            if isinstance(part, SelfHeating):
                raise ArrangementError(
                    f"{type(self).__name__} member '{path}'",
                    "heats up and cools in real time, which this law would shift",
                    next_step="put the shift inside the self-heating",
                )

    @abstractmethod
    def shift(self, scope: Scope) -> Expression:
        """Return a_T, one at the reference temperature.

        Parameters
        ----------
        scope
            Gives the parameters.
        """

    def effort(self, scope: Scope, motion: Expression, rate: Expression) -> Expression:
        """Return the stress of the laws inside, whose clock runs slower by a_T."""
        factor = self.shift(scope)
        scope.signal("time_shift", factor, "1", f"factor on the relaxation times of {scope.path}")
        return self.stress_inside(ReducedTime(scope, factor), motion, factor * rate)


@dataclass(frozen=True, kw_only=True)
class WlfShift(TimeShift):
    """log₁₀ a_T = −c₁·(T − T_r)/(c₂ + T − T_r): how time scales of rubber move above its glass transition.

    With T_r about 50 K above the glass transition, c₁ and c₂ are nearly the same for all amorphous polymers.
    Valid from the glass transition to 100 K above it; moduli are taken as they are. Source: Williams,
    Landel and Ferry 1955.

    Examples
    --------
    >>> from nlsdesign.components import maxwell
    >>> branch = (("branch", maxwell(modulus=1e6, viscosity=3e4)),)
    >>> WlfShift(members=branch, temperature=293.15, reference=263.15).c1.number
    8.86
    """

    c1: Quantity = parameter("1", "constant c₁", minimum=0.1, maximum=100.0, default=8.86)
    c2: Quantity = parameter("K", "constant c₂", minimum=1.0, maximum=1000.0, default=101.6)

    def __post_init__(self) -> None:
        super().__post_init__()
        lowest = self.reference.number - self.c2.number
        if self.temperature.number <= lowest:
            raise ValueRangeError(
                f"temperature = {self.temperature}",
                f"must lie above reference − c2 = {lowest:g} K, where the law has its pole",
            )

    def shift(self, scope: Scope) -> Expression:
        """Return a_T."""
        over = scope.parameter("temperature") - scope.parameter("reference")
        return ca.exp(-math.log(10.0) * scope.parameter("c1") * over / (scope.parameter("c2") + over))


@dataclass(frozen=True, kw_only=True)
class ArrheniusShift(TimeShift):
    """ln a_T = B·(1/T − 1/T_r) with B = E_a/R: time scales far above the glass transition, or below it.

    Valid where one activation energy E_a rules; for rubber more than 100 K above its glass transition.
    Sources: Arrhenius 1889; Ferry 1980, ch. 11.

    Examples
    --------
    >>> from nlsdesign.components import maxwell
    >>> branch = (("branch", maxwell(modulus=1e6, viscosity=3e4)),)
    >>> ArrheniusShift(members=branch, temperature=320.0, reference=293.15, activation=6e3).needs_rate
    False
    """

    activation: Quantity = parameter(
        "K", "activation energy over the gas constant, B = E_a/R", minimum=0.0, maximum=1e5
    )

    def shift(self, scope: Scope) -> Expression:
        """Return a_T."""
        inverse = 1 / scope.parameter("temperature") - 1 / scope.parameter("reference")
        return ca.exp(scope.parameter("activation") * inverse)
