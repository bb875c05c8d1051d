"""Collects the symbols and equations of all parts, and gives each part its own view of the collection."""

from __future__ import annotations

from collections.abc import Iterable, Mapping
from dataclasses import replace

import casadi as ca

from ..components.assembly.named_parts import Assembly
from ..components.core.element import UNBOUNDED, Jump, Kink, Range, StictionConstraint, Tie
from ..foundation.errors import ArrangementError
from ..foundation.symbolic import Expression, depends, symbol
from .flat import Variable
from .structure import number_names

TYPICAL_SIZE = {"m": 1e-2, "m/s": 0.1, "N": 10.0, "Pa": 1e5}
"""Nominal size of a state by its unit, where one of the unit is far off; for tolerances and scaling."""


class EquationBuilder:
    """Symbols, equations and names that the parts have given so far."""

    def __init__(self, assembly: Assembly) -> None:
        self.parameters: dict[str, tuple[Variable, Expression]] = {}
        self.inputs: dict[str, tuple[Variable, Expression]] = {}
        self.states: dict[str, tuple[Variable, Expression]] = {}
        self.signals: dict[str, tuple[Variable, Expression]] = {}
        self.derivatives: dict[str, Expression] = {}
        self.unknowns = ca.SX(0, 1)
        self.solutions = ca.SX(0, 1)
        self.checks: dict[str, Expression] = {}
        self.losses: list[tuple[str, Expression]] = []
        self.kinks: list[Kink] = []
        self.jumps: list[Jump] = []
        self.constraints: list[StictionConstraint] = []
        self.owners: dict[str, str] = {}
        self.order = {path: number for number, (path, _) in enumerate(assembly.walk())}
        for path, part in assembly.walk():
            inner = part.element if isinstance(part, Tie) else part
            for field_name, info in inner.infos().items():
                given = part.parameters()[field_name]
                for name, value in zip(number_names(path, inner, field_name), given.values, strict=True):
                    variable = Variable(
                        name, info.unit, info.description, value, abs(value) or 1.0,
                        info.minimum, info.maximum, given.source, given.spread,
                    )  # fmt: skip
                    self.parameters[name] = (variable, ca.SX.sym(name))
                    self.owners[name] = path

    def cleaned(self, expression: Expression) -> Expression:
        """Return an expression with all defined unknowns replaced by their solutions."""
        return ca.SX(ca.substitute(expression, self.unknowns, self.solutions))

    def define(self, unknown: Expression, solution: Expression) -> None:
        """Note the solution of an unknown; no solution ever contains a defined unknown.

        All are replaced in one call each time, so that the solutions go on sharing their common parts;
        one by one, they would grow with every step.
        """
        solution = self.cleaned(solution)
        if depends(self.solutions, unknown):
            self.solutions = ca.SX(ca.substitute(self.solutions, unknown, solution))
        self.unknowns = ca.vertcat(self.unknowns, unknown)
        self.solutions = ca.vertcat(self.solutions, solution)

    def own(self, path: str, name: str) -> str:
        """Return the full name of what a part declares, and note whose it is."""
        full = f"{path}.{name}"
        self.owners[full] = path
        return full

    def owned(self, names: Iterable[str]) -> dict[str, str]:
        """Return the path of the part that declared each name."""
        return {name: self.owners[name] for name in names}

    def rate_of_input(self, name: str, variable: Variable) -> Expression:
        """Return the symbol of an input that says how fast another one changes: of a prescribed speed."""
        owner = self.owners[name]
        full = self.own(owner, "acceleration")
        if full not in self.inputs:
            text = f"prescribed acceleration of {owner}"
            self.inputs[full] = (Variable(full, f"{variable.unit}/s", text), ca.SX.sym(full))
        return self.inputs[full][1]

    def named(self) -> dict[str, Expression]:
        """Return states, inputs and signals by name."""
        groups = (self.states, self.inputs, self.signals)
        return {name: e for group in groups for name, (_, e) in group.items()}

    def in_order(self, names: Iterable[str]) -> list[str]:
        """Return names in the written order of the parts that own them."""
        return sorted(names, key=lambda name: self.order.get(self.owners[name], len(self.order)))


class SwitchScope:
    """Takes what one part declares of the places where it is not smooth."""

    def __init__(self, builder: EquationBuilder, path: str) -> None:
        self._builder = builder
        self.path = path

    def kink(self, value: Expression, *, above: str, below: str, name: str = "") -> None:
        """Declare that the effort has a kink where a value vanishes."""
        full = f"{self.path}.{name}" if name else self.path
        self._builder.kinks.append(Kink(full, value, above, below))

    def jump(self, value: Expression, *, above: str, below: str, name: str = "") -> Expression:
        """Return a symbol that is 1 where a value is positive and −1 where it is negative."""
        full = f"{self.path}.{name}" if name else self.path
        mode = symbol(f"{full}.mode")
        self._builder.jumps.append(Jump(full, value, above, below, mode))
        return mode

    def stiction(self, constraint: StictionConstraint) -> Expression:
        """Take an effort that holds a rate at zero, and return it."""
        self._builder.constraints.append(constraint)
        return constraint.effort


class NamingScope(SwitchScope):
    """What one part has named in the builder: numbers, inputs, states, signals."""

    def parameter(self, name: str) -> Expression:
        """Return the symbol of one of the part's own numbers."""
        return self._builder.parameters[f"{self.path}.{name}"][1]

    def row(self, name: str) -> list[Expression]:
        """Return the symbols of one of the part's own rows of numbers."""
        prefix = f"{self.path}.{name}"
        if prefix in self._builder.parameters:
            return [self._builder.parameters[prefix][1]]
        return [e for n, (_, e) in self._builder.parameters.items() if n.startswith(prefix + "[")]

    def input(self, name: str, unit: str, description: str) -> Expression:
        """Declare an input."""
        full = self._builder.own(self.path, name)
        self._builder.inputs[full] = (Variable(full, unit, description), symbol(full))
        return self._builder.inputs[full][1]

    def state(self, name: str, unit: str, description: str) -> Expression:
        """Declare a state."""
        full = self._builder.own(self.path, name)
        if full in self._builder.states:
            raise ArrangementError(full, "two equations claim this state")
        variable = Variable(full, unit, description, nominal=TYPICAL_SIZE.get(unit, 1.0))
        self._builder.states[full] = (variable, symbol(full))
        return self._builder.states[full][1]

    def signal(
        self, name: str, value: Expression, unit: str, description: str, *, valid: Range = UNBOUNDED
    ) -> None:
        """Give a name to an expression; of a state or input of that name, only the range is noted."""
        full = self._builder.own(self.path, name)
        low, high = valid
        for group in (self._builder.states, self._builder.inputs):
            if full in group:
                variable, known = group[full]
                if valid != UNBOUNDED:
                    group[full] = (replace(variable, minimum=low, maximum=high), known)
                return
        variable = Variable(full, unit, description, minimum=low, maximum=high)
        self._builder.signals[full] = (variable, ca.SX(value))


class PartScope(NamingScope):
    """The view of one part in the builder: its own names, and what it says of them."""

    def child(self, name: str) -> PartScope:
        """Return the scope of a part inside."""
        return PartScope(self._builder, f"{self.path}.{name}")

    def derive(self, state: Expression, derivative: Expression) -> None:
        """Give the derivative of a state."""
        self._builder.derivatives[state.name()] = derivative

    def define(self, unknown: Expression, solution: Expression) -> None:
        """Give the solution of an unknown."""
        self._builder.define(unknown, solution)

    def loss(self, power: Expression) -> None:
        """Note power that turns into heat inside the part."""
        self._builder.losses.append((f"{self.path}.", power))

    def losses(self) -> Expression:
        """Return the sum of what the part and all parts inside it have noted as lost."""
        inside = [power for path, power in self._builder.losses if path.startswith(f"{self.path}.")]
        return sum(inside, start=ca.SX(0))

    def check(self, name: str, residual: Expression) -> None:
        """Record a residual that must vanish."""
        self._builder.checks[name] = residual

    def total_rate(self, value: Expression, moving: Mapping[Expression, Expression]) -> Expression:
        """Return the time derivative of an expression of states and moving symbols."""
        value = self._builder.cleaned(value)
        rate = ca.SX(0)
        for each, own_rate in moving.items():
            rate += ca.jacobian(value, each) * own_rate
        for name, (_, each) in self._builder.states.items():
            if depends(value, each):
                rate += ca.jacobian(value, each) * self._builder.cleaned(self._builder.derivatives[name])
        return rate

    def rate_is_used(self, rate: Expression) -> bool:
        """Tell whether anything given so far contains this symbol."""
        given = [*self._builder.derivatives.values(), *(e for _, e in self._builder.signals.values())]
        given += [self._builder.solutions, *(power for _, power in self._builder.losses)]
        return any(depends(e, rate) for e in given)
