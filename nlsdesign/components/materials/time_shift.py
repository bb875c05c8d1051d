"""Laws by which a temperature shifts relaxation times."""

from __future__ import annotations

import math
from abc import abstractmethod
from dataclasses import dataclass
from typing import ClassVar

import casadi as ca

from ...foundation.errors import ArrangementError, ValueRangeError
from ...foundation.quantity import Quantity
from ...foundation.symbolic import Expression
from ..core.domain import MATERIAL, Domain
from ..core.element import Combination, Scope
from ..core.part import walk
from ..core.part_numbers import parameter
from ..core.reduced_time import ReducedTime
from .self_heating import SelfHeating


@dataclass(frozen=True, kw_only=True)
class TimeShift(Combination):
    """Base of laws by which a temperature multiplies every relaxation time inside with one factor a_T.

    Raises
    ------
    ArrangementError
        If something inside heats up, which takes place in real time.
    """

    takes: ClassVar[tuple[Domain, ...]] = (MATERIAL,)
    placing: ClassVar[str | None] = "put it inside a specimen"
    phenomena: ClassVar[frozenset[str]] = frozenset({"temperature shift"})

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
        return self.inside(ReducedTime(scope, factor), motion, factor * rate)


@dataclass(frozen=True, kw_only=True)
class WlfShift(TimeShift):
    """log₁₀ a_T = −c₁·(T − T_r)/(c₂ + T − T_r): how time scales of rubber move above its glass transition.

    With T_r about 50 K above the glass transition, c₁ and c₂ are nearly the same for all amorphous polymers.
    Valid from the glass transition to 100 K above it; moduli are taken as they are. Source:
    Williams et al. 1955.

    Raises
    ------
    ValueRangeError
        If the temperature is not above the pole of the law.

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
