"""From an assembly to the flat model; the only place that walks the tree to write equations.

Names are declared in written order in a first walk; equations are taken in a second. So the order of the
vectors is that of the deck, whatever the order in which laws happen to ask for their symbols.
"""

from __future__ import annotations

import math
from collections.abc import Iterable, Mapping, Sequence
from dataclasses import replace

import casadi as ca

from ..components.assembly import Assembly
from ..components.bodies import Body, Motion
from ..components.element import UNBOUNDED, Range, observed_effort
from ..components.part import Part
from ..components.sensors import Sensor
from ..components.tie import Tie
from ..errors import ArrangementError, UnitError, nearest, unknown_name
from ..symbolic import Expression, depends
from .flat import FlatModel, Variable
from .train import balance_train, train_motions, trains

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

    def named(self) -> dict[str, Expression]:
        """Return states, inputs and signals by name."""
        found = {name: e for group in (self.states, self.inputs) for name, (_, e) in group.items()}
        return found | {name: e for name, (_, e) in self.signals.items()}

    def in_order(self, names: Iterable[str]) -> list[str]:
        """Return names in the written order of the parts that own them."""
        return sorted(names, key=lambda name: self.order.get(name.rpartition(".")[0], len(self.order)))


class PartScope:
    """The view of one part on the ledger: its own names only."""

    def __init__(self, ledger: Ledger, path: str) -> None:
        self._ledger = ledger
        self.path = path

    def child(self, name: str) -> PartScope:
        """Return the scope of a part inside."""
        return PartScope(self._ledger, f"{self.path}.{name}")

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
        symbol = ca.SX.sym(full)
        self._ledger.inputs[full] = (Variable(full, unit, description), symbol)
        return symbol

    def state(self, name: str, unit: str, description: str) -> Expression:
        """Declare a state."""
        full = f"{self.path}.{name}"
        if full in self._ledger.states:
            raise ArrangementError(full, "two equations claim this state")
        symbol = ca.SX.sym(full)
        variable = Variable(full, unit, description, nominal=TYPICAL_SIZE.get(unit, 1.0))
        self._ledger.states[full] = (variable, symbol)
        return symbol

    def derive(self, state: Expression, derivative: Expression) -> None:
        """Give the derivative of a state."""
        self._ledger.derivatives[state.name()] = derivative

    def signal(
        self, name: str, value: Expression, unit: str, description: str, *, valid: Range = UNBOUNDED
    ) -> None:
        """Give a name to an expression; of a state or input of that name, only the range is noted."""
        full = f"{self.path}.{name}"
        low, high = valid
        for group in (self._ledger.states, self._ledger.inputs):
            if full in group:
                variable, symbol = group[full]
                if valid != UNBOUNDED:
                    group[full] = (replace(variable, minimum=low, maximum=high), symbol)
                return
        variable = Variable(full, unit, description, minimum=low, maximum=high)
        self._ledger.signals[full] = (variable, ca.SX(value))

    def loss(self, power: Expression) -> None:
        """Note power that turns into heat inside the part."""
        self._ledger.losses.append((f"{self.path}.", power))

    def losses(self) -> Expression:
        """Return the sum of what the part and all parts inside it have noted as lost."""
        inside = [power for path, power in self._ledger.losses if path.startswith(f"{self.path}.")]
        return sum(inside, start=ca.SX(0))

    def define(self, unknown: Expression, solution: Expression) -> None:
        """Give the solution of an unknown."""
        self._ledger.define(unknown, solution)

    def check(self, name: str, residual: Expression) -> None:
        """Record a residual that must vanish."""
        self._ledger.checks[name] = residual

    def total_rate(self, value: Expression, moving: Mapping[Expression, Expression]) -> Expression:
        """Return the time derivative of an expression of states and moving symbols."""
        value = self._ledger.cleaned(value)
        rate = ca.SX(0)
        for symbol, own_rate in moving.items():
            rate += ca.jacobian(value, symbol) * own_rate
        for name, (_, symbol) in self._ledger.states.items():
            if depends(value, symbol):
                rate += ca.jacobian(value, symbol) * self._ledger.cleaned(self._ledger.derivatives[name])
        return rate

    def rate_is_used(self, rate: Expression) -> bool:
        """Tell whether anything given so far contains this symbol."""
        given = [*self._ledger.derivatives.values(), *(e for _, e in self._ledger.signals.values())]
        given += [self._ledger.solutions, *(power for _, power in self._ledger.losses)]
        return any(depends(e, rate) for e in given)


def flatten(
    assembly: Assembly, *, inputs: Sequence[str] | None = None, outputs: Sequence[str] | None = None
) -> FlatModel:
    """Write the equations of an assembly as a flat model.

    Parameters
    ----------
    assembly
        Parts.
    inputs
        Names of the inputs that stay; the others rest at zero. All by default.
    outputs
        Names of states, inputs or signals to give out; by default the readings of the sensors, or the
        efforts of the ties where there are no sensors.

    Raises
    ------
    UnknownNameError
        If an input or output does not exist, with the nearest that does.
    ArrangementError
        If parts are tied in a way that leaves an equation open.

    Examples
    --------
    >>> from nlsdesign.components import Inertia, TorsionSpring, assembly, tie
    >>> spring = tie(TorsionSpring(stiffness=2.0), "wheel")
    >>> swing = assembly("swing", wheel=Inertia(inertia=1e-3), spring=spring)
    >>> [v.name for v in flatten(swing).states]
    ['wheel.angle', 'wheel.speed']
    """
    ledger = Ledger(assembly)
    _write_mechanics(assembly, ledger)
    _write_sensors(assembly, ledger)
    return _model(assembly, ledger, inputs, outputs)


def _write_mechanics(assembly: Assembly, ledger: Ledger) -> None:
    bodies = {name: part for name, part in assembly.parts if isinstance(part, Body)}
    scopes = {name: PartScope(ledger, name) for name, _ in assembly.parts}
    geared = trains(assembly)
    followers = {w.name for lead, train in geared.items() for w in train.wheels() if w.name != lead}
    motions = {name: b.motion(scopes[name]) for name, b in bodies.items() if name not in followers}
    turning = {lead: train_motions(train, scopes, motions[lead]) for lead, train in geared.items()}
    motions |= {name: motion for found in turning.values() for name, (motion, _) in found.items()}
    sums = {name: ca.SX(0) for name in bodies}
    rest = Motion(ca.SX(0), ca.SX(0))
    for name, part in assembly.parts:
        if not isinstance(part, Tie):
            continue
        one, other = motions[part.between[0]], (motions[part.between[1]] if len(part.between) > 1 else rest)
        effort = observed_effort(part.element, scopes[name], one.motion - other.motion, one.rate - other.rate)
        for sign, body in zip((-1, 1), part.between, strict=False):
            sums[body] += sign * effort
    for name, turned in bodies.items():
        if name in geared:
            balance_train(geared[name], scopes, turning[name], sums)
        elif name not in followers:
            turned.balance(scopes[name], motions[name], sums[name])


def _write_sensors(assembly: Assembly, ledger: Ledger) -> None:
    for name, part in assembly.sensors().items():
        known = ledger.named()
        if part.of not in known:
            raise unknown_name(f"sensor '{name}' reads", part.of, known)
        unit = _variable_of(ledger, part.of).unit
        if not part.sees(unit):
            fitting = [n for n in known if part.sees(_variable_of(ledger, n).unit)]
            raise UnitError(
                f"sensor '{name}' of '{part.of}'",
                f"{type(part).__name__} reads {' or '.join(part.units)}, '{part.of}' is in {unit}",
                did_you_mean=nearest(part.of, fitting),
                next_step=f"read one of: {', '.join(fitting) or 'nothing here has such a unit'}",
            )
        reading = part.read(PartScope(ledger, name), known[part.of], unit)
        about = f"reading of {name}, which sees {part.of}"
        PartScope(ledger, name).signal("reading", reading, part.reading_unit(unit), about)


def _variable_of(ledger: Ledger, name: str) -> Variable:
    for group in (ledger.states, ledger.inputs, ledger.signals):
        if name in group:
            return group[name][0]
    raise unknown_name("signal", name, ledger.named())


def _default_outputs(assembly: Assembly) -> list[str]:
    readings = [f"{name}.reading" for name, part in assembly.parts if isinstance(part, Sensor)]
    ties = [f"{n}.{p.element.domain.effort}" for n, p in assembly.parts if isinstance(p, Tie)]
    return readings or ties


def _chosen(
    kind: str, given: Sequence[str] | None, valid: Iterable[str], default: Sequence[str]
) -> list[str]:
    """Return the names that the user chose, each once, or the default."""
    chosen = list(default if given is None else [given] if isinstance(given, str) else dict.fromkeys(given))
    for name in chosen:
        if name not in valid:
            raise unknown_name(kind, name, valid)
    return chosen


def _needed_states(
    ledger: Ledger, derivatives: Mapping[str, Expression], roots: Iterable[Expression]
) -> list[str]:
    """Drop states that nothing depends on, such as the place of a dashpot between dashpots."""
    wanted = list(roots)
    needed: set[str] = set()
    while wanted:
        expression = wanted.pop()
        for name, (_, symbol) in ledger.states.items():
            if name not in needed and depends(expression, symbol):
                needed.add(name)
                wanted.append(derivatives[name])
    return [name for name in ledger.in_order(ledger.states) if name in needed]


def _model(
    assembly: Assembly, ledger: Ledger, inputs: Sequence[str] | None, outputs: Sequence[str] | None
) -> FlatModel:
    kept = _chosen("input", inputs, ledger.inputs, ledger.in_order(ledger.inputs))
    known = ledger.named()
    given = _chosen("output", outputs, known, _default_outputs(assembly))
    open_states = [name for name in ledger.states if name not in ledger.derivatives]
    if open_states:
        raise ArrangementError(open_states[0], "no equation gives its derivative")

    ledger.signals = {name: ledger.signals[name] for name in ledger.in_order(ledger.signals)}
    derivatives, signals, results, checks = _finished(ledger, kept, given)
    moving = [ledger.states[n][1] for n in ledger.states if isinstance(assembly[n.rpartition(".")[0]], Body)]
    states = _needed_states(ledger, derivatives, [*signals, *results, *moving])
    columns = [
        ca.SX.sym("time"),
        ca.vertcat(*[ledger.states[n][1] for n in states]),
        ca.vertcat(*[ledger.inputs[n][1] for n in kept]),
        ca.vertcat(*[e for _, e in ledger.parameters.values()]),
        ca.SX.sym("w", 0),
    ]
    rows = [[derivatives[n] for n in states], results, signals, checks]
    equations = ca.Function(
        "equations", [ca.SX(c) for c in columns], [ca.SX(ca.vertcat(*r)) for r in rows],
        ["time", "state", "input", "parameter", "table"], ["derivative", "output", "signal", "residual"],
    )  # fmt: skip
    _check_unique(ledger)
    values = [v.start for v, _ in ledger.parameters.values()]
    if not all(math.isfinite(v) for v in _probe(equations, values)):
        raise ArrangementError(
            f"assembly '{assembly.name}'",
            "the equations are singular",
            next_step="look for springs or dashpots of zero stiffness in series",
        )
    return FlatModel(
        assembly.name, assembly.description,
        tuple(ledger.states[n][0] for n in states), tuple(ledger.inputs[n][0] for n in kept),
        tuple(v for v, _ in ledger.parameters.values()), tuple(_variable_of(ledger, n) for n in given),
        tuple(v for v, _ in ledger.signals.values()), equations,
    )  # fmt: skip


def _finished(
    ledger: Ledger, inputs: Sequence[str], outputs: Sequence[str]
) -> tuple[dict[str, Expression], list[Expression], list[Expression], list[Expression]]:
    """Return derivatives, signals, outputs and checks with all unknowns solved and unused inputs at zero.

    All are substituted together, so that they go on sharing their common parts.
    """
    known = ledger.named()
    groups = [
        list(ledger.derivatives.values()),
        [e for _, e in ledger.signals.values()],
        [known[name] for name in outputs],
        list(ledger.checks.values()),
    ]
    everything = ledger.cleaned(ca.vertcat(*[e for group in groups for e in group]))
    rest = ca.vertcat(*[e for n, (_, e) in ledger.inputs.items() if n not in inputs])
    everything = ca.cse(ca.SX(ca.substitute(everything, rest, ca.SX.zeros(rest.shape))))
    done = iter(ca.vertsplit(everything))
    split = [[next(done) for _ in group] for group in groups]
    return dict(zip(ledger.derivatives, split[0], strict=True)), split[1], split[2], split[3]


def _check_unique(ledger: Ledger) -> None:
    seen: set[str] = set()
    for group in (ledger.states, ledger.inputs, ledger.parameters, ledger.signals):
        for name in group:
            if name in seen:
                raise ArrangementError(
                    f"name '{name}'", "is used twice", next_step="rename the part or the number"
                )
            seen.add(name)


def _probe(equations: ca.Function, parameters: Sequence[float]) -> list[float]:
    """Return every number that the equations give near rest, with the parameters as they are."""
    # Not at rest itself, where a law may have a corner.
    arguments = [ca.DM.ones(equations.sparsity_in(i)) * 1e-3 for i in range(equations.n_in())]
    arguments[3] = ca.DM(parameters)
    return [float(v) for result in equations.call(arguments) for v in ca.densify(result).nonzeros()]
