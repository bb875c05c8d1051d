"""From an assembly to the flat model; the only place that walks the tree to write equations.

Parameters are declared in written order in a first walk; equations are taken in a second, and states, inputs
and signals sorted into that order. So the order of the vectors is that of the deck, whatever the order in
which laws happen to ask for their symbols.
"""

from __future__ import annotations

import math
from collections import Counter
from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass

import casadi as ca

from ..components.assembly.named_parts import Assembly, source_problems
from ..components.core.element import Tie, observed_effort
from ..components.mechanics.bodies import Body, Motion
from ..components.sensing.sensors import Sensor
from ..foundation.errors import ArrangementError, UnitError, nearest, unknown_name
from ..foundation.quantity import typeset_unit
from ..foundation.symbolic import Expression, depends, remembered
from .equation_builder import EquationBuilder, PartScope
from .flat import INTERFACE, FlatModel, Switching, Variable
from .gear_train import balance_train, train_motions, trains
from .origin import DeclaredOrigin
from .readings import readings_of
from .stiction import Laws, natural_modes, switch_laws, switching
from .structure import Owners, moving_bodies, springs_of


@remembered(32)
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
    >>> from nlsdesign.components import ROTATION, Inertia, Spring, assembly, tie
    >>> spring = tie(Spring(stiffness=2.0, domain=ROTATION), "wheel")
    >>> swing = assembly("swing", wheel=Inertia(inertia=1e-3), spring=spring)
    >>> [v.name for v in flatten(swing).states]
    ['wheel.angle', 'wheel.speed']
    """
    builder = EquationBuilder(assembly)
    _write_mechanics(assembly, builder)
    _write_sensors(assembly, builder)
    open_states = [name for name in builder.states if name not in builder.derivatives]
    if open_states:
        raise ArrangementError(open_states[0], "no equation gives its derivative")
    laws = switch_laws(builder)
    readings = [f"{name}.reading" for name, part in assembly.parts if isinstance(part, Sensor)]
    ties = [f"{n}.{p.element.domain.effort}" for n, p in assembly.parts if isinstance(p, Tie)]
    chosen = _chosen("input", inputs, builder.inputs, builder.in_order(builder.inputs))
    given = _chosen("output", outputs, builder.named(), readings or ties)
    builder.signals = {name: builder.signals[name] for name in builder.in_order(builder.signals)}
    solved = _solved(builder, laws, chosen, given)
    moving = [s for n, (_, s) in builder.states.items() if isinstance(assembly[builder.owners[n]], Body)]
    roots = [*solved.signals, *solved.outputs, *moving, *solved.laws.lasts]
    states = _needed_states(builder, solved.derivatives, roots)
    equations, switches = _equations(builder, solved, states, chosen)
    names = [*(f"der({n})" for n in states), *given, *builder.signals, *builder.checks]
    _check(assembly, builder, equations, names=names)
    owners = Owners(
        builder.owned(builder.parameters), builder.owned(states), builder.owned(chosen),
        builder.owned(builder.signals),
    )  # fmt: skip
    return FlatModel(
        name=assembly.name,
        description=assembly.description,
        states=tuple(builder.states[n][0] for n in states),
        inputs=tuple(builder.inputs[n][0] for n in chosen),
        parameters=tuple(v for v, _ in builder.parameters.values()),
        outputs=tuple(_variable_of(builder, n) for n in given),
        signals=tuple(v for v, _ in builder.signals.values()),
        equations=equations,
        switching=switches,
        bodies=moving_bodies(assembly, owners),
        springs=springs_of(assembly, owners),
        readings=readings_of(assembly),
        origin=DeclaredOrigin(assembly),
    )


def _write_mechanics(assembly: Assembly, builder: EquationBuilder) -> None:
    bodies = {name: part for name, part in assembly.parts if isinstance(part, Body)}
    scopes = {name: PartScope(builder, name) for name, _ in assembly.parts}
    geared = trains(assembly)
    followers = {w.name for lead, train in geared.items() for w in train.wheels() if w.name != lead}
    motions = {name: b.motion(scopes[name]) for name, b in bodies.items() if name not in followers}
    turning = {lead: train_motions(train, scopes, motions[lead]) for lead, train in geared.items()}
    motions |= {name: motion for train in turning.values() for name, (motion, _) in train.items()}
    sums = {name: ca.SX(0) for name in bodies}
    rest = Motion(ca.SX(0), ca.SX(0))
    for name, part in assembly.parts:
        if not isinstance(part, Tie):
            continue
        one, other = motions[part.between[0]], (motions[part.between[1]] if len(part.between) > 1 else rest)
        effort = observed_effort(part.element, scopes[name], one.motion - other.motion, one.rate - other.rate)
        for sign, body in zip((-1, 1), part.between, strict=False):
            sums[body] += sign * effort
        at_end = part.element.at_first_end(scopes[name], effort, one.rate)
        sums[part.between[0]] -= 0 if at_end is None else at_end
    for name, turned in bodies.items():
        if name in geared:
            balance_train(geared[name], scopes, turning[name], sums)
        elif name not in followers:
            turned.balance(scopes[name], motions[name], sums[name])


def _write_sensors(assembly: Assembly, builder: EquationBuilder) -> None:
    for _, error in source_problems(assembly.parts):
        raise error
    for name, part in assembly.sensors().items():
        known = builder.named()
        if part.of not in known:
            raise unknown_name(f"sensor '{name}' reads", part.of, known)
        unit = _variable_of(builder, part.of).unit
        if not part.sees(unit):
            fitting = [n for n in known if part.sees(_variable_of(builder, n).unit)]
            readable = " or ".join(map(typeset_unit, part.units))
            raise UnitError(
                f"sensor '{name}' of '{part.of}'",
                f"{type(part).__name__} reads {readable}, '{part.of}' is in {typeset_unit(unit) or '1'}",
                did_you_mean=nearest(part.of, fitting),
                next_step=f"read one of: {', '.join(fitting) or 'nothing here has such a unit'}",
            )
        reading = part.read(PartScope(builder, name), known[part.of], unit)
        about = f"reading of {name}, which sees {part.of}"
        PartScope(builder, name).signal("reading", reading, part.reading_unit(unit), about)


def _variable_of(builder: EquationBuilder, name: str) -> Variable:
    for group in (builder.states, builder.inputs, builder.signals):
        if name in group:
            return group[name][0]
    raise unknown_name("signal", name, builder.named())


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
    builder: EquationBuilder, derivatives: Mapping[str, Expression], roots: Iterable[Expression]
) -> list[str]:
    """Drop states that nothing depends on, such as the place of a dashpot between dashpots."""
    wanted = list(roots)
    needed: set[str] = set()
    while wanted:
        expression = wanted.pop()
        for name, (_, symbol) in builder.states.items():
            if name not in needed and depends(expression, symbol):
                needed.add(name)
                wanted.append(derivatives[name])
    return [name for name in builder.in_order(builder.states) if name in needed]


@dataclass(frozen=True)
class _Solved:
    """The equations with all unknowns solved and unused inputs at zero."""

    derivatives: dict[str, Expression]
    signals: list[Expression]
    outputs: list[Expression]
    checks: list[Expression]
    laws: Laws


def _solved(builder: EquationBuilder, laws: Laws, inputs: Sequence[str], outputs: Sequence[str]) -> _Solved:
    """Solve for all unknowns; all are substituted together, so that they go on sharing their common parts."""
    known = builder.named()
    groups = [
        list(builder.derivatives.values()),
        [e for _, e in builder.signals.values()],
        [known[name] for name in outputs],
        list(builder.checks.values()),
        *laws.columns(),
    ]
    everything = builder.cleaned(ca.vertcat(*[e for group in groups for e in group]))
    rest = ca.vertcat(*[e for n, (_, e) in builder.inputs.items() if n not in inputs])
    everything = ca.cse(ca.SX(ca.substitute(everything, rest, ca.SX.zeros(rest.shape))))
    items = iter(ca.vertsplit(everything))
    derivatives, signals, results, checks, *of_laws = [[next(items) for _ in group] for group in groups]
    return _Solved(
        dict(zip(builder.derivatives, derivatives, strict=True)),
        signals,
        results,
        checks,
        laws.with_columns(of_laws),
    )


def _equations(
    builder: EquationBuilder, solved: _Solved, states: Sequence[str], inputs: Sequence[str]
) -> tuple[ca.Function, Switching | None]:
    """Return the equations with the modes that belong to the state, and with modes that are held."""
    laws = solved.laws
    columns = [
        ca.SX.sym("time"),
        ca.vertcat(*[builder.states[n][1] for n in states]),
        ca.vertcat(*[builder.inputs[n][1] for n in inputs]),
        ca.vertcat(*[e for _, e in builder.parameters.values()]),
        ca.SX.sym("w", 0),
    ]
    rows = [[solved.derivatives[n] for n in states], solved.outputs, solved.signals, solved.checks]
    switches = switching(laws, columns, rows, states) if laws.switches else None
    everything = ca.vertcat(*[e for row in rows for e in row])
    if laws.modes and depends(everything, ca.vertcat(*laws.modes)):
        everything = ca.cse(ca.SX(ca.substitute(everything, ca.vertcat(*laws.modes), natural_modes(laws))))
        items = iter(ca.vertsplit(everything))
        rows = [[next(items) for _ in row] for row in rows]
    equations = ca.Function(
        "equations", [ca.SX(c) for c in columns], [ca.SX(ca.vertcat(*r)) for r in rows], *INTERFACE
    )
    return equations, switches


def _check(
    assembly: Assembly, builder: EquationBuilder, equations: ca.Function, *, names: Sequence[str]
) -> None:
    """Raise unless all variables have different names, and all numbers near rest are finite.

    ``names``: of the numbers that the equations give.
    """
    groups = (builder.states, builder.inputs, builder.parameters, builder.signals)
    for name, count in Counter(name for group in groups for name in group).items():
        if count > 1:
            raise ArrangementError(
                f"name '{name}'", "is used twice", next_step="rename the part or the number"
            )
    # Not at rest itself, where a law may have a corner.
    arguments = [ca.DM.ones(equations.sparsity_in(i)) * 1e-3 for i in range(equations.n_in())]
    arguments[3] = ca.DM([v.start for v, _ in builder.parameters.values()])
    values = [float(v) for result in equations.call(arguments) for v in ca.densify(result).nonzeros()]
    singular = [name for name, value in zip(names, values, strict=True) if not math.isfinite(value)]
    if singular:
        raise ArrangementError(
            f"assembly '{assembly.name}'",
            f"the equations are singular: {singular[0]} has no finite value",
            next_step="look there for springs or dashpots of zero stiffness in series",
        )
