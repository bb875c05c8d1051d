"""The ledger into which parts write their symbols and equations, and the view that one part has of it."""

from __future__ import annotations

from collections.abc import Iterable, Mapping
from dataclasses import replace

import casadi as ca

from ..components.assembly.named_parts import Assembly
from ..components.core.element import UNBOUNDED, Range
from ..components.core.part import Part
from ..components.core.switches import Corner, Hold, Side
from ..components.core.tie import Tie
from ..errors import ArrangementError
from ..symbolic import Expression, depends, symbol
from .flat import Variable

TYPICAL_SIZE = {"m": 1e-2, "m/s": 0.1, "N": 10.0, "Pa": 1e5}
"""Nominal size of a state by its unit, where one of the unit is far off; for tolerances and scaling."""


class Ledger:
    """What the parts have said so far: symbols, equations, names."""

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
        self.corners: list[Corner] = []
        self.sides: list[Side] = []
        self.holds: list[Hold] = []
        self.order = {path: number for number, (path, _) in enumerate(assembly.walk())}
        for path, part in assembly.walk():
            self._declare(path, part)

    def _declare(self, path: str, part: Part) -> None:
        inner = part.element if isinstance(part, Tie) else part
        for field_name, info in inner.parameter_infos().items():
            given = part.parameters()[field_name]
            row = isinstance(given.value, tuple)
            for number, value in enumerate(given.values, start=1):
                name = f"{path}.{field_name}" + (f"[{number}]" if row else "")
                variable = Variable(
                    name, info.unit, info.description, value, abs(value) or 1.0, info.minimum, info.maximum,
                    given.source, given.spread,
                )  # fmt: skip
                self.parameters[name] = (variable, ca.SX.sym(name))

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

    def rate_of_input(self, name: str, variable: Variable) -> Expression:
        """Return the symbol of an input that says how fast another one changes: of a prescribed speed."""
        owner = name.rpartition(".")[0]
        full = f"{owner}.acceleration"
        if full not in self.inputs:
            text = f"prescribed acceleration of {owner}"
            self.inputs[full] = (Variable(full, f"{variable.unit}/s", text), ca.SX.sym(full))
        return self.inputs[full][1]

    def named(self) -> dict[str, Expression]:
        """Return states, inputs and signals by name."""
        found = {name: e for group in (self.states, self.inputs) for name, (_, e) in group.items()}
        return found | {name: e for name, (_, e) in self.signals.items()}

    def in_order(self, names: Iterable[str]) -> list[str]:
        """Return names in the written order of the parts that own them."""
        return sorted(names, key=lambda name: self.order.get(name.rpartition(".")[0], len(self.order)))


class SwitchScope:
    """What one part says of the places where it is not smooth."""

    def __init__(self, ledger: Ledger, path: str) -> None:
        self._ledger = ledger
        self.path = path

    def corner(self, value: Expression, *, above: str, below: str, name: str = "") -> None:
        """Say that the effort has a corner where a value vanishes."""
        full = f"{self.path}.{name}" if name else self.path
        self._ledger.corners.append(Corner(full, value, above, below))

    def side(self, value: Expression, *, above: str, below: str, name: str = "") -> Expression:
        """Return a symbol that is 1 where a value is positive and −1 where it is negative."""
        full = f"{self.path}.{name}" if name else self.path
        mode = symbol(f"{full}.mode")
        self._ledger.sides.append(Side(full, value, above, below, mode))
        return mode

    def hold(self, hold: Hold) -> Expression:
        """Take an effort that holds a rate at zero, and return it."""
        self._ledger.holds.append(hold)
        return hold.effort


class OwnNames(SwitchScope):
    """What one part has named on the ledger: numbers, inputs, states, signals."""

    def parameter(self, name: str) -> Expression:
        """Return the symbol of one of the part's own numbers."""
        return self._ledger.parameters[f"{self.path}.{name}"][1]

    def row(self, name: str) -> list[Expression]:
        """Return the symbols of one of the part's own rows of numbers."""
        prefix = f"{self.path}.{name}"
        if prefix in self._ledger.parameters:
            return [self._ledger.parameters[prefix][1]]
        return [e for n, (_, e) in self._ledger.parameters.items() if n.startswith(prefix + "[")]

    def input(self, name: str, unit: str, description: str) -> Expression:
        """Declare an input."""
        full = f"{self.path}.{name}"
        found = symbol(full)
        self._ledger.inputs[full] = (Variable(full, unit, description), found)
        return found

    def state(self, name: str, unit: str, description: str) -> Expression:
        """Declare a state.

        Raises
        ------
        ArrangementError
            If two equations claim the state.
        """
        full = f"{self.path}.{name}"
        if full in self._ledger.states:
            raise ArrangementError(full, "two equations claim this state")
        found = symbol(full)
        variable = Variable(full, unit, description, nominal=TYPICAL_SIZE.get(unit, 1.0))
        self._ledger.states[full] = (variable, found)
        return found

    def signal(
        self, name: str, value: Expression, unit: str, description: str, *, valid: Range = UNBOUNDED
    ) -> None:
        """Give a name to an expression; of a state or input of that name, only the range is noted."""
        full = f"{self.path}.{name}"
        low, high = valid
        for group in (self._ledger.states, self._ledger.inputs):
            if full in group:
                variable, known = group[full]
                if valid != UNBOUNDED:
                    group[full] = (replace(variable, minimum=low, maximum=high), known)
                return
        variable = Variable(full, unit, description, minimum=low, maximum=high)
        self._ledger.signals[full] = (variable, ca.SX(value))


class PartScope(OwnNames):
    """The view of one part on the ledger: its own names, and what it says of them."""

    def child(self, name: str) -> PartScope:
        """Return the scope of a part inside."""
        return PartScope(self._ledger, f"{self.path}.{name}")

    def derive(self, state: Expression, derivative: Expression) -> None:
        """Give the derivative of a state."""
        self._ledger.derivatives[state.name()] = derivative

    def define(self, unknown: Expression, solution: Expression) -> None:
        """Give the solution of an unknown."""
        self._ledger.define(unknown, solution)

    def loss(self, power: Expression) -> None:
        """Note power that turns into heat inside the part."""
        self._ledger.losses.append((f"{self.path}.", power))

    def losses(self) -> Expression:
        """Return the sum of what the part and all parts inside it have noted as lost."""
        inside = [power for path, power in self._ledger.losses if path.startswith(f"{self.path}.")]
        return sum(inside, start=ca.SX(0))

    def check(self, name: str, residual: Expression) -> None:
        """Record a residual that must vanish."""
        self._ledger.checks[name] = residual

    def total_rate(self, value: Expression, moving: Mapping[Expression, Expression]) -> Expression:
        """Return the time derivative of an expression of states and moving symbols."""
        value = self._ledger.cleaned(value)
        rate = ca.SX(0)
        for each, own_rate in moving.items():
            rate += ca.jacobian(value, each) * own_rate
        for name, (_, each) in self._ledger.states.items():
            if depends(value, each):
                rate += ca.jacobian(value, each) * self._ledger.cleaned(self._ledger.derivatives[name])
        return rate

    def rate_is_used(self, rate: Expression) -> bool:
        """Tell whether anything given so far contains this symbol."""
        given = [*self._ledger.derivatives.values(), *(e for _, e in self._ledger.signals.values())]
        given += [self._ledger.solutions, *(power for _, power in self._ledger.losses)]
        return any(depends(e, rate) for e in given)
