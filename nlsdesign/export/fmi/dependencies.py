"""Dependencies of outputs and derivatives, from the operations of their expressions."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import casadi as ca

from ...model.flat import Symbols
from .expression_walk import Dependence, dependences
from .fmu_variables import FmuLayout, FmuVariable


@dataclass(frozen=True)
class FmiUnknown:
    """One unknown of the model structure, as FMI calls it."""

    variable: FmuVariable
    dependencies: tuple[int, ...]  # value references of the knowns it depends on
    kinds: tuple[str, ...]  # their kinds as FMI names them


@dataclass(frozen=True)
class ModelStructure:
    """The model structure."""

    # outputs, derivatives: depend on inputs, continuous states and time
    outputs: tuple[FmiUnknown, ...]
    derivatives: tuple[FmiUnknown, ...]
    initial: tuple[FmiUnknown, ...]  # computed at the start; these depend also on parameters and start values


def model_structure(layout: FmuLayout) -> ModelStructure:
    """Return the model structure of an FMU."""
    model = layout.model
    s = model.symbols()
    given = [(v, s.state[i]) for i, v in enumerate(layout.states) if v.causality == "output"]
    own = {v.name: i for i, v in enumerate(model.outputs)}
    given += [(v, ca.densify(s.output)[own[v.variable.name]]) for v in layout.outputs]
    rates = [(v, ca.densify(s.derivative)[i]) for i, v in enumerate(layout.derivatives)]
    dependencies = {v.reference: kinds for v, kinds in _kinds(layout, s, [*given, *rates])}

    running = {0, *[v.reference for v in layout.inputs]}
    if model.sample_time is None:
        running |= {v.reference for v in layout.states}

    def entry(variable: FmuVariable, *, initial: bool) -> FmiUnknown:
        kinds = {
            reference: "dependent" if initial and kind != "constant" else kind
            for reference, kind in sorted(dependencies[variable.reference].items())
            if initial or reference in running
        }
        return FmiUnknown(variable, tuple(kinds), tuple(kinds.values()))

    outputs, derivatives = [v for v, _ in given], [v for v, _ in rates]
    computed = sorted([*layout.outputs, *derivatives], key=lambda v: v.reference)
    return ModelStructure(
        tuple(entry(v, initial=False) for v in outputs),
        tuple(entry(v, initial=False) for v in derivatives),
        tuple(entry(v, initial=True) for v in computed),
    )


def _kinds(
    layout: FmuLayout, s: Symbols, unknowns: Sequence[tuple[FmuVariable, ca.SX]]
) -> list[tuple[FmuVariable, dict[int, str]]]:
    """Return for each unknown the value references it depends on, each with its kind.

    They are read off the operations, not off the slopes: a rounded or compared value depends on what is
    rounded, though its slope is zero.
    """
    model = layout.model
    knowns = [layout.time, *layout.states, *layout.inputs, *layout.parameters]
    place = {each.variable.name: number for number, each in enumerate(knowns)}
    symbols = [[place[v.variable.name] for v in group] for group in (layout.states, layout.inputs)]
    symbols = [[0], *symbols, [place[v.variable.name] for v in layout.parameters]]
    symbols.append([place[table.argument] for table in model.tables for _ in table.columns])
    changing = sum(1 << number for number in range(1 + len(layout.states) + len(layout.inputs)))
    expressions = ca.SX(ca.vertcat(*[e for _, e in unknowns]))
    groups = [s.time, s.state, s.input, s.parameter, s.table]
    of_each = dependences(ca.Function("unknowns", groups, [ca.densify(expressions)]), symbols, changing)
    tuned = "fixed" if model.sample_time is None else "tunable"

    def kind(of: Dependence, bit: int) -> str:
        return "dependent" if of.nonlinear & bit else tuned if of.scaled & bit else "constant"

    return [
        (variable, {each.reference: kind(of, 1 << i) for i, each in enumerate(knowns) if of.on & (1 << i)})
        for (variable, _), of in zip(unknowns, of_each, strict=True)
    ]
