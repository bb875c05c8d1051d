"""Laws by which a temperature shifts relaxation times.

The scope of laws whose clock runs slower than that of the model.
"""

from __future__ import annotations

import math
from abc import abstractmethod
from collections.abc import Mapping
from dataclasses import dataclass
from typing import ClassVar

import casadi as ca

from ...foundation.errors import ArrangementError, ValueRangeError
from ...foundation.quantity import Quantity
from ...foundation.symbolic import Expression
from ..core.domain import MATERIAL, Domain
from ..core.element import UNBOUNDED, Combination, Range, Scope, StictionConstraint
from ..core.part import walk
from ..core.part_numbers import parameter
from .self_heating import SelfHeating


class Forwarding:
    """A scope that hands everything that has no time in it to another one."""

    def __init__(self, scope: Scope) -> None:
        self._scope, self.path = scope, scope.path

    def parameter(self, name: str) -> Expression:
        """Return the symbol of one of the part's own numbers."""
        return self._scope.parameter(name)

    def row(self, name: str) -> list[Expression]:
        """Return the symbols of one of the part's own rows of numbers."""
        return self._scope.row(name)

    def input(self, name: str, unit: str, description: str) -> Expression:
        """Declare an input."""
        return self._scope.input(name, unit, description)

    def state(self, name: str, unit: str, description: str) -> Expression:
        """Declare a state."""
        return self._scope.state(name, unit, description)

    def signal(
        self, name: str, value: Expression, unit: str, description: str, *, valid: Range = UNBOUNDED
    ) -> None:
        """Give a name to an expression."""
        self._scope.signal(name, value, unit, description, valid=valid)

    def define(self, unknown: Expression, solution: Expression) -> None:
        """Give the solution of an unknown."""
        self._scope.define(unknown, solution)

    def check(self, name: str, residual: Expression) -> None:
        """Record a residual that must vanish."""
        self._scope.check(name, residual)

    def rate_is_used(self, rate: Expression) -> bool:
        """Tell whether anything given so far contains this symbol."""
        return self._scope.rate_is_used(rate)

    def kink(self, value: Expression, *, above: str, below: str, name: str = "") -> None:
        """Say that the effort has a corner where a value vanishes."""
        self._scope.kink(value, above=above, below=below, name=name)

    def jump(self, value: Expression, *, above: str, below: str, name: str = "") -> Expression:
        """Return a symbol that is 1 where a value is positive and −1 where it is negative."""
        return self._scope.jump(value, above=above, below=below, name=name)

    def stiction(self, constraint: StictionConstraint) -> Expression:
        """Take an effort that holds a rate at zero, and return it."""
        return self._scope.stiction(constraint)


class ReducedTime(Forwarding):
    """Rates inside are per reduced time ξ, with dξ = dt/a_T."""

    def __init__(self, scope: Scope, factor: Expression) -> None:
        super().__init__(scope)
        self._factor = factor

    def child(self, name: str) -> Scope:
        """Return the scope of a part inside."""
        return ReducedTime(self._scope.child(name), self._factor)

    def derive(self, state: Expression, derivative: Expression) -> None:
        """Give the derivative of a state."""
        self._scope.derive(state, derivative / self._factor)

    def loss(self, power: Expression) -> None:
        """Note power that turns into heat inside the part."""
        self._scope.loss(power / self._factor)

    def losses(self) -> Expression:
        """Return the sum of what the part and all parts inside it have noted as lost."""
        return self._factor * self._scope.losses()

    def total_rate(self, value: Expression, moving: Mapping[Expression, Expression]) -> Expression:
        """Return the derivative of an expression of states and the given moving symbols."""
        real = {symbol: rate / self._factor for symbol, rate in moving.items()}
        return self._factor * self._scope.total_rate(value, real)


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
