"""Other views of the same flat model: another state, other outputs, cut open at a named signal.

None of these changes what the model says. They exchange the coordinates in which it says it, so that an
observer or an analysis can be written on the relaxing force, on the total force, or in the published form.
"""

from __future__ import annotations

from collections.abc import Callable, Iterable, Mapping, Sequence
from dataclasses import replace
from itertools import accumulate, pairwise
from typing import Any, NamedTuple

import casadi as ca
import numpy as np

from ..foundation.errors import ArrangementError, unknown_name
from ..foundation.symbolic import Expression, dependence, depends
from .flat import INTERFACE, FlatModel, Switching, Symbols, Variable
from .graph import applied, as_results, fold, read_graph
from .structure import ModelParts


def named(model: FlatModel, symbols: Symbols) -> dict[str, Expression]:
    """Return the expression of every parameter, signal, output, input and state by name."""
    groups = (
        (model.parameters, symbols.parameter),
        (model.signals, symbols.signal),
        (model.outputs, symbols.output),
        (model.inputs, symbols.input),
        (model.states, symbols.state),
    )
    return {v.name: item for group, column in groups for v, item in zip(group, _rows(column), strict=True)}


def with_outputs(model: FlatModel, names: Sequence[str]) -> FlatModel:
    """Return a copy that gives out other variables.

    Parameters
    ----------
    model
        Continuous or discrete.
    names
        States, inputs, signals or present outputs.

    Raises
    ------
    UnknownNameError
        If a name does not exist, with the nearest that does.
    """
    outputs = tuple(model.variable(name) for name in names)

    def given_out(s: Symbols) -> Symbols:
        known = named(model, s)
        return s._replace(output=_column([known[name] for name in names]))

    return _rebuilt(model, given_out(model.symbols()), outputs=outputs, again=given_out)


def with_signal(
    model: FlatModel, variable: Variable, value: Callable[[Mapping[str, Expression]], Expression]
) -> FlatModel:
    """Return a copy with one more named signal.

    Examples
    --------
    >>> from nlsdesign.components import ROTATION, Inertia, Spring, assembly, tie
    >>> from nlsdesign.model import Variable, flatten
    >>> spring = tie(Spring(stiffness=2.0, domain=ROTATION), "wheel")
    >>> swing = assembly("swing", wheel=Inertia(inertia=1e-3), spring=spring)
    >>> energy = Variable("spring.energy", "J", "energy stored in the spring")
    >>> half = lambda n: n["spring.torque"] * n["wheel.angle"] / 2
    >>> with_signal(flatten(swing), energy, half).evaluate([0.5, 0.0])["spring.energy"]
    0.25
    """
    s = model.symbols()
    if variable.name in named(model, s):
        raise ArrangementError(
            f"signal '{variable.name}'", "the name is taken", next_step="choose another name"
        )

    def shown(s: Symbols) -> Symbols:
        return s._replace(signal=_column([s.signal, value(named(model, s))]))

    return _rebuilt(model, shown(s), signals=(*model.signals, variable), again=shown)


def replace_state(model: FlatModel, old: str, signal: str) -> FlatModel:
    """Return the same model with a signal as state instead of one of its states.

    With s = α + β·x, where α and β may depend on all other states, the derivative of the new state is
    ∂s/∂t + Σ ∂s/∂xᵢ·ẋᵢ, and x = (s − α)/β goes on as a signal.
    """
    if old not in {v.name for v in model.states}:
        raise unknown_name("state", old, (v.name for v in model.states))
    if signal not in {v.name for v in model.signals}:
        raise unknown_name("signal", signal, (v.name for v in model.signals))
    s = model.symbols()
    value, place = named(model, s)[signal], [v.name for v in model.states].index(old)
    _check_replacement(model, s, value, (old, signal))
    new = ca.SX.sym(signal)
    slope = ca.jacobian(value, s.state[place])
    solved = (new - ca.substitute(value, s.state[place], ca.SX(0))) / slope
    rate = ca.jtimes(value, s.state, s.derivative) + ca.jacobian(value, s.time)
    derivative = _exchanged(s.derivative, place, rate)
    kept = [i for i, v in enumerate(model.signals) if v.name != signal]
    row = _column([*(s.signal[i] for i in kept), s.state[place]])
    # All columns at once, so that they go on sharing their common parts.
    columns = ca.substitute([derivative, s.output, row, s.residual], [s.state[place]], [solved])
    variable = replace(model.variable(signal), start=_at_start(model, signal))
    changed = s._replace(
        state=_exchanged(s.state, place, new),
        derivative=columns[0], output=columns[1], signal=columns[2], residual=columns[3],
    )  # fmt: skip
    states = tuple(variable if i == place else v for i, v in enumerate(model.states))
    signals = (*(model.signals[i] for i in kept), replace(model.states[place], start=0.0))
    exchanged = parts_of(model).with_state(old, signal)
    return with_parts(_rebuilt(model, changed, states=states, signals=signals), exchanged)


def cut(model: FlatModel, names: Sequence[str], *, keep: bool = False) -> FlatModel:
    """Return the model cut open at named signals: each becomes an input, whatever it came from.

    What lay only before the cut drops out of the equations behind it. It works on the graph of the
    expressions: everything computed from the signal's node follows the new input.
    """
    s = model.symbols()
    known = {v.name: s.signal[i] for i, v in enumerate(model.signals)}
    opened_at: dict[int, Expression] = {}
    for name in names:
        if name not in known:
            raise unknown_name("signal", name, known)
        if known[name].is_leaf():
            raise ArrangementError(f"signal '{name}'", "is only another name of a state, input or constant")
        opened_at[known[name].element_hash()] = ca.SX.sym(name)
    fresh = [opened_at[known[name].element_hash()] for name in names]
    kept = [i for i, v in enumerate(model.signals) if keep or v.name not in names]
    rest = _column([s.signal[i] for i in kept])
    followed = ca.SX(0, 1) if keep else rest
    columns = _regrown([s.derivative, s.output, followed, s.residual], opened_at)
    changed = s._replace(
        input=_column([s.input, *fresh]),
        derivative=columns[0], output=columns[1], signal=rest if keep else columns[2], residual=columns[3],
    )  # fmt: skip
    opened = tuple(replace(model.variable(name), start=_at_start(model, name)) for name in names)
    return _rebuilt(
        model, changed, inputs=(*model.inputs, *opened), signals=tuple(model.signals[i] for i in kept)
    )


def without_idle_states(model: FlatModel, roots: Sequence[str]) -> FlatModel:
    """Return the model without the states that neither these variables nor their derivatives depend on.

    ``roots``: what must stay: states, outputs or signals. They become the outputs.
    """
    s = model.symbols()
    known = named(model, s)
    outputs = tuple(model.variable(name) for name in roots)
    s = s._replace(output=_column([known[name] for name in roots]))
    shown, moved, seen, left = np.split(
        dependence(_column([s.output, s.derivative, s.signal, s.residual]), s.state),
        np.cumsum([s.output.numel(), s.derivative.numel(), s.signal.numel()]),
    )
    needed = shown.any(axis=0)
    for _ in model.states:
        needed = needed | moved[needed].any(axis=0)
    kept = np.flatnonzero(needed)
    visible = np.flatnonzero(~seen[:, ~needed].any(axis=1))
    closed = np.flatnonzero(~left[:, ~needed].any(axis=1))
    changed = s._replace(
        state=_column([s.state[int(i)] for i in kept]),
        derivative=_column([s.derivative[int(i)] for i in kept]),
        signal=_column([s.signal[int(i)] for i in visible]),
        residual=_column([s.residual[int(i)] for i in closed]),
    )
    states, signals = tuple(model.states[i] for i in kept), tuple(model.signals[i] for i in visible)
    return _rebuilt(model, changed, states=states, outputs=outputs, signals=signals)


def parts_of(model: FlatModel) -> ModelParts:
    """Return bodies, springs and readings of a model together."""
    return ModelParts(model.bodies, model.springs, model.readings)


def with_parts(model: FlatModel, parts: ModelParts) -> FlatModel:
    """Return the model made of other parts; what has no variables in it is left out."""
    names = {v.name for v in (*model.states, *model.inputs, *model.outputs, *model.signals)}
    kept = parts.within(names, {v.name for v in model.inputs})
    return replace(model, bodies=kept.bodies, springs=kept.springs, readings=kept.readings)


def with_products(model: FlatModel) -> FlatModel:
    """Return a sampled model that multiplies by the inverse of a constant instead of dividing by it.

    On a controller a division takes as long as a dozen products. No compiler may replace it: digits change.
    """
    names = [name for name in ("equations", "begin", "expected") if getattr(model, name) is not None]
    functions: dict[str, Any] = {name: _multiplying(getattr(model, name)) for name in names}
    return replace(model, **functions)


# --- inside ---------------------------------------------------------------------------------------


def _rebuilt(
    model: FlatModel,
    s: Symbols,
    *,
    states: tuple[Variable, ...] | None = None,
    inputs: tuple[Variable, ...] | None = None,
    outputs: tuple[Variable, ...] | None = None,
    signals: tuple[Variable, ...] | None = None,
    again: Callable[[Symbols], Symbols] | None = None,
) -> FlatModel:
    """Return the model with these expressions and names; groups that are not given stay.

    ``again`` makes the same change in the expressions with all modes held.
    """
    moved = states is not None or inputs is not None
    if moved and model.switching is not None and model.switching.jumps:
        raise ArrangementError(
            model.name, f"'{model.switching.jumps[0]}' is sharp, so its states cannot be exchanged",
            next_step="take its smooth form: in a deck a creep_speed or width, in Python smoothed(assembly)",
        )  # fmt: skip
    rows = [s.derivative, s.output, s.signal, s.residual]
    shared = ca.cse(ca.vertcat(*rows)) if any(r.numel() for r in rows) else ca.SX(0, 1)
    ends = accumulate((row.shape[0] for row in rows), initial=0)
    given = [s.time, s.state, s.input, s.parameter, s.table]
    equations = ca.Function("equations", given, [shared[a:b] for a, b in pairwise(ends)], *INTERFACE)
    changed = replace(
        model,
        equations=equations,
        # Corners may be forgotten: the equations say them too.
        switching=None if moved else _switching(model, again),
        states=model.states if states is None else states,
        inputs=model.inputs if inputs is None else inputs,
        outputs=model.outputs if outputs is None else outputs,
        signals=model.signals if signals is None else signals,
    )
    return with_parts(changed, parts_of(model))


def _switching(model: FlatModel, again: Callable[[Symbols], Symbols] | None) -> Switching | None:
    """Return the switches of a model whose outputs or signals have been changed."""
    if model.switching is None or again is None:
        return model.switching
    s = model.symbols()
    shown = model.switching.shown
    if (shown.size1_in(1), shown.size1_in(2)) != (s.state.numel(), s.input.numel()):
        return None  # states or inputs were exchanged before, and only a model with corners allows that
    given = [s.time, s.state, s.input, s.parameter, ca.SX.sym("mode", len(model.switching.switches))]
    output, signal = shown.call(given)
    s = again(s._replace(output=output, signal=signal))
    return replace(model.switching, shown=ca.Function("shown", given, [s.output, s.signal]))


def _multiplying(function: ca.Function) -> ca.Function:
    """Return a function without divisions by constants, but for those whose inverse no float may hold."""

    def combined(operation: int, operands: Sequence[Expression]) -> Expression:
        if operation == ca.OP_DIV and operands[1].is_constant() and 1e-30 < abs(float(operands[1])) < 1e30:
            return operands[0] * (1.0 / float(operands[1]))
        return applied(operation, operands)

    given = function.sx_in()
    values = fold(read_graph(function), lambda i, k: given[i].nz[k], ca.SX, combined=combined)
    results = as_results(function, values)
    return ca.Function(function.name(), given, results, function.name_in(), function.name_out())


def _column(items: Iterable[Expression]) -> Expression:
    listed = [item for item in items if item.numel()]
    return ca.SX(ca.densify(ca.vertcat(*listed))) if listed else ca.SX(0, 1)


def _exchanged(column: Expression, place: int, item: Expression) -> Expression:
    return _column([item if i == place else column[i] for i in range(column.shape[0])])


def _at_start(model: FlatModel, name: str) -> float:
    return model.evaluate([v.start for v in model.states])[name]


def _check_replacement(model: FlatModel, s: Symbols, value: Expression, names: tuple[str, str]) -> None:
    old, signal = names
    state = s.state[[v.name for v in model.states].index(old)]
    slope = ca.jacobian(value, state)
    thing = f"'{signal}' as state instead of '{old}'"
    if model.sample_time is not None:
        raise ArrangementError(thing, "a discrete model has no derivatives")
    if depends(value, s.input):
        raise ArrangementError(thing, "the signal depends on an input, whose derivative is not known")
    if depends(slope, state):
        raise ArrangementError(
            thing, "the signal is not affine in the state", next_step="choose another signal"
        )
    point = ca.Function("slope", [s.time, s.state, s.parameter], [slope])
    if float(point(0.0, model.start(model.states), model.start(model.parameters))) == 0.0:
        raise ArrangementError(
            thing, "the signal does not change with the state at the start",
            next_step="choose a signal on the far side of the cam, such as a force or a stress",
        )  # fmt: skip


def _rows(column: Expression) -> list[Expression]:
    """Return the items of a column; all in one call, which is far quicker than one by one."""
    return ca.vertsplit(column) if column.numel() else []


def _regrown(columns: Sequence[Expression], replaced: Mapping[int, Expression]) -> list[Expression]:
    """Return the expressions with whole nodes of their graph replaced, by hash of the node."""
    grown, changed = dict(replaced), set(replaced)
    rows = [_rows(column) for column in columns]
    for row in rows:
        for root in row:
            _grow(root, grown, changed)
    return [_column([grown[root.element_hash()] for root in row]) for row in rows]


class _Node(NamedTuple):
    """A node of a graph with its hash, and those just below it with theirs."""

    node: Expression
    key: int
    below: list[tuple[Expression, int]]


def _node(node: Expression, key: int) -> _Node:
    below = [node.dep(i) for i in range(node.n_dep())]
    return _Node(node, key, [(each, each.element_hash()) for each in below])


def _grow(root: Expression, grown: dict[int, Expression], changed: set[int]) -> None:
    """Add ``root`` and all nodes below it to ``grown``, without recursion: graphs are deep.

    What lies over nothing that was replaced stays the node that it is; the hashes of all others are added to
    ``changed``.
    """
    waiting = [_node(root, root.element_hash())]
    while waiting:
        node, key, below = waiting[-1]
        missing = [] if key in grown else [_node(*each) for each in below if each[1] not in grown]
        if missing:
            waiting += missing
            continue
        waiting.pop()
        if key in grown:
            continue
        if not any(each in changed for _, each in below):
            grown[key] = node
            continue
        changed.add(key)
        grown[key] = applied(node.op(), [grown[each] for _, each in below])
