"""Dependencies of outputs and derivatives, from the sparsity of the symbolic Jacobian."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import casadi as ca

from ...model.flat import Symbols
from .fmu_variables import FmuLayout, FmuVariable


@dataclass(frozen=True)
class FmiUnknown:
    """One unknown of the model structure, as FMI calls it.

    Parameters
    ----------
    variable
        The unknown.
    dependencies
        Value references of the knowns it depends on.
    kinds
        Their kinds as FMI names them.
    """

    variable: FmuVariable
    dependencies: tuple[int, ...]
    kinds: tuple[str, ...]


@dataclass(frozen=True)
class ModelStructure:
    """The model structure.

    Parameters
    ----------
    outputs, derivatives
        Depend on inputs, continuous states and time.
    initial
        Computed at the start; these depend also on parameters and start values.
    """

    outputs: tuple[FmiUnknown, ...]
    derivatives: tuple[FmiUnknown, ...]
    initial: tuple[FmiUnknown, ...]


def model_structure(layout: FmuLayout) -> ModelStructure:
    """Return the model structure of an FMU.

    Parameters
    ----------
    layout
        Its variables.
    """
    model = layout.model
    s = model.symbols()
    given = [(v, s.state[i]) for i, v in enumerate(layout.states) if v.causality == "output"]
    own = {v.name: i for i, v in enumerate(model.outputs)}
    given += [(v, ca.densify(s.output)[own[v.variable.name]]) for v in layout.outputs]
    rates = [(v, ca.densify(s.derivative)[i]) for i, v in enumerate(layout.derivatives)]
    dependencies = {v.reference: slopes for v, slopes in _slopes(layout, s, [*given, *rates])}

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


def _slopes(
    layout: FmuLayout, s: Symbols, unknowns: Sequence[tuple[FmuVariable, ca.SX]]
) -> list[tuple[FmuVariable, dict[int, str]]]:
    """Return for each unknown the value references it depends on, each with the kind of its slope."""
    knowns = [layout.time, *layout.states, *layout.inputs, *layout.parameters]
    expressions = ca.SX(ca.vertcat(*[e for _, e in unknowns]))
    slopes = ca.jacobian(expressions, ca.vertcat(s.time, s.state, s.input, s.parameter))
    cells = [ca.SX(slopes.nz[k]) for k in range(slopes.nnz())]
    changing = ca.vertcat(s.time, s.state, s.input, s.table)
    varied = set(ca.jacobian_sparsity(ca.SX(ca.vertcat(*cells)), changing).row()) if cells else set()
    tuned = "fixed" if layout.model.sample_time is None else "tunable"
    kinds_of: list[dict[int, str]] = [{} for _ in unknowns]
    rows, columns = slopes.sparsity().get_triplet()
    for number, (row, column) in enumerate(zip(rows, columns, strict=True)):
        kind = "dependent" if number in varied else "constant" if cells[number].is_constant() else tuned
        kinds_of[row][knowns[column].reference] = kind
    # Looked-up numbers change with the argument of their table.
    reference = {v.variable.name: v.reference for v in (*layout.states, *layout.inputs)}
    arguments = [reference[table.argument] for table in layout.model.tables for _ in table.columns]
    rows, columns = ca.jacobian_sparsity(expressions, s.table).get_triplet()
    for row, column in zip(rows, columns, strict=True):
        kinds_of[row][arguments[column]] = "dependent"
    return [(variable, kinds) for (variable, _), kinds in zip(unknowns, kinds_of, strict=True)]
