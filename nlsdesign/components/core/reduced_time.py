"""The scope of laws whose clock runs slower than that of the model."""

from __future__ import annotations

from collections.abc import Mapping

from ...foundation.symbolic import Expression
from .element import UNBOUNDED, Range, Scope
from .switches import StictionConstraint


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
