"""The variables of an FMU: their order, causality and variability.

A value reference is an index into one array; the groups are in the order time, states, derivatives,
inputs, parameters, outputs, signals, event indicators, modes, one extra, and behind them the status word.
An output that is a state is one variable, as is a signal that is an output. Each switch of a model that is
located shows its mode and an event indicator.

What the graph of an expression says where its derivative says nothing: dependence and range.

A rounded reading has the slope zero and yet depends on what is rounded; so both are read off the operations.

Terminals of an FMU (FMI 3.0): what belongs together when it is wired, and the pictures of it.

Two kinds. A *loop* is a bus: readings are named after what they show, so that plant, observer and controller
are wired by equal names. A *flange* is what a load is attached to, with the names of Modelica: ``phi``,
``w``, ``tau`` in rotation, ``s``, ``v``, ``f`` in translation. FMI 2.0 has no terminals.
"""

from __future__ import annotations

import math
import re
from collections import Counter
from collections.abc import Callable, Iterator, Mapping, Sequence
from dataclasses import dataclass, replace
from typing import TypeVar

import casadi as ca
import numpy as np

from ...foundation.arrays import Array
from ...foundation.errors import ExportError
from ...foundation.symbolic import remembered
from ...model.flat import FlatModel, Switch, Variable
from ...model.graph import fold, read_graph
from ..c.guarded_step import FIRST_INDEX_BIT, STATUS_BITS
from .typical_sizes import typical_sizes, with_sizes

LOOP, FLANGE = "loop", "flange"
_MODELICA = {
    "rotation": ("phi", "w", "tau", "Modelica.Mechanics.Rotational.Interfaces.Flange_a"),
    "translation": ("s", "v", "f", "Modelica.Mechanics.Translational.Interfaces.Flange_a"),
}


@dataclass(frozen=True)
class TerminalMember:
    """One variable of a terminal."""

    name: str
    variable: str
    kind: str = "signal"


@dataclass(frozen=True)
class Terminal:
    """Variables that are wired together."""

    name: str
    description: str
    picture: str
    rule: str
    kind: str
    members: tuple[TerminalMember, ...]


def flanges(model: FlatModel) -> tuple[Terminal, ...]:
    """Return the flanges of a plant: the bodies that a load acts on or that are moved from outside.

    ``model``: continuous; a sampled one has none.
    """
    return tuple(_flanges(model))


def _flanges(model: FlatModel) -> Iterator[Terminal]:
    inputs = {v.name for v in model.inputs}
    everything = inputs | {v.name for v in (*model.states, *model.outputs, *model.signals)}
    for body in model.bodies:
        domain = body.domain
        for name in (body.name, *body.geared):
            lead = name == body.name
            motion = body.motion if lead else f"{name}.{domain.motion}"
            rate = body.rate if lead else f"{name}.{domain.rate}"
            effort = f"{name}.reaction" if body.prescribed else f"{name}.{domain.effort}"
            attached = {motion, rate} <= inputs if body.prescribed else effort in inputs
            if attached and {motion, rate, effort} <= everything:
                variables = (motion, rate, effort)
                *labels, kind = _MODELICA[domain.name]
                kinds = ("signal", "signal", "inflow")
                members = tuple(TerminalMember(*each) for each in zip(labels, variables, kinds, strict=True))
                yield Terminal(name, f"Where a load is attached to {name}", FLANGE, "plug", kind, members)


def terminals(model: FlatModel) -> tuple[Terminal, ...]:
    """Return all terminals of the FMU of a model."""
    attached = flanges(model)
    taken = {member.variable for each in attached for member in each.members}
    outputs = [v.name for v in model.outputs if v.name not in taken]
    inputs = [v.name for v in model.inputs if v.name not in taken]
    # Of several readings of one thing that through most sensors has its name; what is an input keeps its own.
    chain = {r.signal: len(r.sensors) for r in model.readings}
    shown = {r.signal: r.measured for r in model.readings if r.measured not in inputs}
    last = {name: max(n for s, n in chain.items() if shown.get(s) == name) for name in shown.values()}
    shown = {signal: name for signal, name in shown.items() if chain[signal] == last[name]}
    labels = {name: shown.get(name, name) for name in (*outputs, *inputs)}
    count = Counter(labels.values())
    members = tuple(
        TerminalMember(label if count[label] == 1 else name, name) for name, label in labels.items()
    )
    text = (
        "What controllers and observers of this machine are wired with; readings are named by what they show"
    )
    name = LOOP if LOOP not in {each.name for each in attached} else "signal_loop"
    bus = (Terminal(name, text, LOOP, "bus", "nlsdesign.loop", members),) if members else ()
    return (*bus, *attached)


def with_flange_outputs(model: FlatModel) -> FlatModel:
    """Return a plant whose outputs include what its flanges give out: a local variable cannot be wired."""
    known = {v.name for v in (*model.inputs, *model.outputs)}
    wanted = dict.fromkeys(m.variable for each in flanges(model) for m in each.members)
    missing = [name for name in wanted if name not in known]
    if not missing:
        return model
    s = model.symbols()
    variables = (*model.states, *model.signals)
    places = [[v.name for v in variables].index(name) for name in missing]
    outputs = _extended(s.output, s.state, s.signal, places)
    groups = [s.time, s.state, s.input, s.parameter, s.table]
    equations = ca.Function("equations", groups, [s.derivative, outputs, s.signal, s.residual])
    switching = model.switching
    if switching is not None:
        modes = ca.SX.sym("m", switching.shown.size1_in(4))
        held, signals = switching.shown(*groups[:4], modes)
        extended = _extended(held, s.state, signals, places)
        switching = replace(switching, shown=ca.Function("shown", [*groups[:4], modes], [extended, signals]))
    added = tuple(variables[i] for i in places)
    return replace(model, outputs=(*model.outputs, *added), equations=equations, switching=switching)


def _extended(outputs: ca.SX, states: ca.SX, signals: ca.SX, places: Sequence[int]) -> ca.SX:
    """Return outputs with further ones, chosen from states and signals."""
    given = ca.densify(ca.vertcat(states, signals))
    return ca.vertcat(ca.densify(outputs), *[given[i] for i in places])


Interval = tuple[float, float]
EVERYTHING: Interval = (-math.inf, math.inf)

_Value = TypeVar("_Value")

_LINEAR = frozenset([ca.OP_ADD, ca.OP_SUB, ca.OP_NEG, ca.OP_TWICE, ca.OP_ASSIGN, ca.OP_LIFT])


@dataclass(frozen=True)
class Dependence:
    """How a value depends on numbered symbols; sets are the bits of whole numbers."""

    on: int = 0  # all symbols that it depends on
    # scaled: those whose factor is not a constant: it depends on other symbols, or there is no factor at all
    scaled: int = 0
    # nonlinear: those whose factor changes while the model runs, or for which there is none: rounded,
    # compared, multiplied by another changing value
    nonlinear: int = 0

    def joined(self, other: Dependence) -> Dependence:
        """Return the dependence of a sum."""
        return Dependence(self.on | other.on, self.scaled | other.scaled, self.nonlinear | other.nonlinear)

    def times(self, factor: Dependence, changing: int) -> Dependence:
        """Return the part of a product's dependence that comes through this operand."""
        if not factor.on:
            return self
        return Dependence(self.on, self.on, self.on if factor.on & changing else self.nonlinear)

    def anyhow(self) -> Dependence:
        """Return the dependence of a function of this value that is no multiple of it."""
        return Dependence(self.on, self.on, self.on)


def dependences(function: ca.Function, symbols: Sequence[Sequence[int]], changing: int) -> list[Dependence]:
    """Return how each nonzero of the first result of an SX function depends on symbols.

    ``symbols``: for each argument the number of the symbol that each element stands for. Looked-up numbers
    stand for the argument of their table, and are nonlinear.
    """
    looked_up = len(symbols) - 1

    def given(argument: int, element: int) -> Dependence:
        bit = 1 << symbols[argument][element]
        return Dependence(bit, bit, bit) if argument == looked_up else Dependence(bit)

    def combined(operation: int, operands: Sequence[Dependence]) -> Dependence:
        together = Dependence()
        for each in operands:
            together = together.joined(each)
        if operation in _LINEAR:
            return together
        if operation in (ca.OP_MUL, ca.OP_DIV, ca.OP_IF_ELSE_ZERO):
            one, other = operands
            weight, weighed = (other, one) if operation == ca.OP_DIV else (one, other)
            factor = weight.times(weighed, changing) if operation == ca.OP_MUL else weight.anyhow()
            return weighed.times(weight, changing).joined(factor)
        return together.anyhow()

    return _of_first_result(fold(read_graph(function), given, lambda _: Dependence(), combined=combined))


def ranges(function: ca.Function, bounds: Sequence[Sequence[Interval]]) -> list[Interval]:
    """Return an interval that holds each nonzero of the first result, by interval arithmetic.

    The interval may be wider than the values that occur, never narrower.
    """
    values = fold(
        read_graph(function),
        lambda argument, element: bounds[argument][element],
        lambda value: (value, value),
        combined=lambda operation, operands: (
            _RANGES[operation](*operands) if operation in _RANGES else EVERYTHING
        ),
    )
    return _of_first_result(values)


def _of_first_result(values: Mapping[tuple[int, int], _Value]) -> list[_Value]:
    """Return what is known of each nonzero of the first result."""
    first = {nonzero: value for (result, nonzero), value in values.items() if result == 0}
    return [first[i] for i in range(len(first))]


def _sum(a: Interval, b: Interval) -> Interval:
    return a[0] + b[0], a[1] + b[1]


def _negative(a: Interval) -> Interval:
    return -a[1], -a[0]


def _product(a: Interval, b: Interval) -> Interval:
    # 0·∞ is 0 here: an unbounded number is not infinite.
    corners = [0.0 if 0.0 in (x, y) else x * y for x in a for y in b]
    return min(corners), max(corners)


def _size(a: Interval) -> Interval:
    least = 0.0 if a[0] <= 0.0 <= a[1] else min(abs(a[0]), abs(a[1]))
    return least, max(abs(a[0]), abs(a[1]))


_RANGES: Mapping[int, Callable[..., Interval]] = {
    ca.OP_ADD: _sum,
    ca.OP_SUB: lambda a, b: _sum(a, _negative(b)),
    ca.OP_NEG: _negative,
    ca.OP_TWICE: lambda a: _sum(a, a),
    ca.OP_MUL: _product,
    ca.OP_SQ: lambda a: _product(_size(a), _size(a)),
    ca.OP_FABS: _size,
    ca.OP_FMIN: lambda a, b: (min(a[0], b[0]), min(a[1], b[1])),
    ca.OP_FMAX: lambda a, b: (max(a[0], b[0]), max(a[1], b[1])),
    ca.OP_IF_ELSE_ZERO: lambda _, a: (min(a[0], 0.0), max(a[1], 0.0)),
    ca.OP_ASSIGN: lambda a: a,
    **dict.fromkeys((ca.OP_SIN, ca.OP_COS, ca.OP_TANH, ca.OP_ERF, ca.OP_SIGN), lambda _: (-1.0, 1.0)),
}


def located_switches(model: FlatModel) -> tuple[Switch, ...]:
    """Return the switches whose changes an importer has to locate.

    A model with corners only has none: an integrator gets across them, at the cost of shorter steps.
    """
    return model.switching.switches if model.switching is not None and model.switching.jumps else ()


def indicator_variables(model: FlatModel) -> list[Variable]:
    """Return an event indicator for each located switch."""
    names = _names(located_switches(model))
    return [
        Variable(f"{name}.indicator", "1", f"Not negative as long as the mode of {name} lasts, in SI units")
        for name in names
    ]


def mode_variables(model: FlatModel) -> list[Variable]:
    """Return the mode of each located switch: −1, 0 or 1."""
    switches, variables = located_switches(model), []
    for name, switch in zip(_names(switches), switches, strict=True):
        modes = ", ".join(f"{mode} {text}" for mode, text in sorted(switch.words) if mode in (-1, 0, 1))
        text = f"Mode of {name}: {modes}"
        variables.append(Variable(f"{name}.mode", "1", text, minimum=-1.0, maximum=1.0))
    return variables


def _names(switches: Sequence[Switch]) -> list[str]:
    """Return structured names; dry frictions on one motion are one switch and have both names."""
    return [
        "_and_".join([first, *(re.sub(r"[^\w]", "_", each) for each in more)])
        for first, *more in (switch.name.split("+") for switch in switches)
    ]


RELATIVE_TOLERANCE = 1e-8
_NAME = re.compile(r"[A-Za-z_]\w*(\[\d+(,\d+)*\])?(\.[A-Za-z_]\w*(\[\d+(,\d+)*\])?)*", re.ASCII)


@dataclass(frozen=True)
class FmuVariable:
    """One variable of an FMU."""

    reference: int  # value reference
    variable: Variable  # name, unit, description, start, range
    causality: str
    variability: str
    initial: str | None = None  # "exact", "calculated" or None where FMI wants none
    derivative_of: int | None = None  # value reference of the state whose derivative this is
    integer: bool = False  # whether it is an integer, the status word

    @property
    def has_start(self) -> bool:
        """Whether FMI wants a start value."""
        return self.initial == "exact" or self.causality in ("input", "parameter")


@dataclass(frozen=True, eq=False)
class FmuLayout:
    """All variables of an FMU by group."""

    model: FlatModel
    # time, states, derivatives, inputs, parameters, outputs, signals, indicators, modes, extra, status: the
    # groups in the order of the value references. outputs and signals leave out states and variables named
    # before; extra is the tolerance of the integrator, or the sample time.
    time: FmuVariable
    states: tuple[FmuVariable, ...]
    derivatives: tuple[FmuVariable, ...]
    inputs: tuple[FmuVariable, ...]
    parameters: tuple[FmuVariable, ...]
    outputs: tuple[FmuVariable, ...]
    signals: tuple[FmuVariable, ...]
    indicators: tuple[FmuVariable, ...]
    modes: tuple[FmuVariable, ...]
    extra: FmuVariable
    status: tuple[FmuVariable, ...]

    @property
    def reals(self) -> tuple[FmuVariable, ...]:
        """All but the status word; the position is the value reference."""
        groups = (self.states, self.derivatives, self.inputs, self.parameters, self.outputs, self.signals)
        inside = [each for group in (*groups, self.indicators, self.modes) for each in group]
        return (self.time, *inside, self.extra)

    @property
    def everything(self) -> tuple[FmuVariable, ...]:
        """All variables in the order of their value references."""
        return (*self.reals, *self.status)

    @property
    def given_out(self) -> tuple[FmuVariable, ...]:
        """Variables of causality output, in the order of the value references."""
        return tuple(each for each in self.reals if each.causality == "output")


@remembered(8)
def layout(model: FlatModel) -> FmuLayout:
    """Return the variables of the FMU of a model."""
    continuous = model.sample_time is None
    changing = "continuous" if continuous else "discrete"
    _check_names(model)
    model = with_flange_outputs(model)
    sizes = typical_sizes(model)
    model = _as_shown(model, sizes)
    outputs, signals = _named_once(model)
    given_out = {v.name for v in model.outputs}
    number = iter(range(10**9))

    def group(
        variables: Sequence[Variable], causality: str, variability: str, initial: str | None
    ) -> tuple[FmuVariable, ...]:
        return tuple(FmuVariable(next(number), v, causality, variability, initial) for v in variables)

    (time,) = group([Variable("time", "s", "Time")], "independent", "continuous", None)
    states = tuple(
        FmuVariable(next(number), v, "output" if v.name in given_out else "local", changing, "exact")
        for v in model.states
    )
    derivatives = tuple(
        FmuVariable(next(number), _rate(s.variable, sizes), "local", changing, "calculated", s.reference)
        for s in states
        if continuous
    )
    return FmuLayout(
        model,
        time,
        states,
        derivatives,
        group(model.inputs, "input", changing, None),
        # Parameters of a plant are fixed, those of a controller tunable.
        group(model.parameters, "parameter", "fixed" if continuous else "tunable", None),
        group(outputs, "output", changing, "calculated"),
        group(signals, "local", changing, "calculated"),
        group(indicator_variables(model), "local", changing, "calculated"),
        group(mode_variables(model), "local", "discrete", "calculated"),
        _extra(model, next(number)),
        () if continuous else (_status(next(number)),),
    )


def _as_shown(model: FlatModel, sizes: Mapping[str, float]) -> FlatModel:
    """Return the model with typical sizes, and with ranges that hold whatever the parameters are tuned to."""
    s = model.symbols()
    groups = [s.time, s.state, s.input, s.parameter, s.table]
    # The guards of a sampled model keep its inputs in their range; those of a plant are only warned of.
    bounds = [
        [EVERYTHING],
        [EVERYTHING] * len(model.states),
        [(v.minimum, v.maximum) if model.sample_time else EVERYTHING for v in model.inputs],
        [(v.minimum, v.maximum) for v in model.parameters],
        [EVERYTHING] * s.table.numel(),
    ]

    def tuned(variables: Sequence[Variable], expressions: ca.SX) -> list[Variable]:
        intervals = ranges(ca.Function("shown", groups, [ca.densify(expressions)]), bounds)
        depends = ca.jacobian_sparsity(expressions, s.parameter).row()
        return [
            replace(v, minimum=min(v.minimum, interval[0]), maximum=max(v.maximum, interval[1]))
            if v.bounded and i in depends
            else v
            for i, (v, interval) in enumerate(zip(variables, intervals, strict=True))
        ]

    signals = tuned(model.signals, s.signal) if model.sample_time else model.signals
    return replace(
        model,
        states=with_sizes(model.states, sizes),
        inputs=with_sizes(model.inputs, sizes),
        outputs=with_sizes(tuned(model.outputs, s.output), sizes),
        signals=with_sizes(signals, sizes),
    )


def _rate(state: Variable, sizes: Mapping[str, float]) -> Variable:
    unit = state.unit + "^2" if state.unit.endswith("/s") else f"{state.unit}/s"
    text = f"Rate of change: {state.description}"
    name = f"der({state.name})"
    return Variable(name, unit, text, nominal=sizes[name])


def _extra(model: FlatModel, reference: int) -> FmuVariable:
    if model.sample_time is None:
        text = "Largest local error of the integrator relative to the largest size of each state so far"
        tolerance = Variable("solver.relative_tolerance", "1", text, RELATIVE_TOLERANCE, 1e-8, 1e-13, 1e-2)
        return FmuVariable(reference, tolerance, "parameter", "fixed")
    period = Variable("sample.time", "s", "Time from sample to sample", model.sample_time)
    return FmuVariable(reference, period, "local", "constant", "exact")


def _status(reference: int) -> FmuVariable:
    bits = ", ".join(
        f"{bit.bit_length() - 1} {flag.lower().replace('_', ' ')}" for flag, (bit, _) in STATUS_BITS.items()
    )
    text = f"Status word of the last sample: bit {bits}; bit {FIRST_INDEX_BIT} + i: input i"
    status = Variable("sample.status", "1", text)
    return FmuVariable(reference, status, "local", "discrete", "calculated", integer=True)


def _check_names(model: FlatModel) -> None:
    own = (
        ("time", "solver.relative_tolerance")
        if model.sample_time is None
        else ("time", "sample.time", "sample.status")
    )
    taken = dict.fromkeys(own, "variable of every FMU")
    known = {v.name for v in (*model.outputs, *model.signals)}
    for kind, group in (("state", model.states), ("input", model.inputs), ("parameter", model.parameters)):
        for variable in group:
            if not _NAME.fullmatch(variable.name):
                raise ExportError(
                    f"{kind} '{variable.name}'", "is not a structured name", next_step="use words and dots"
                )
            if variable.name in taken:
                raise ExportError(
                    f"{kind} '{variable.name}'",
                    f"has the name of {_a(taken[variable.name])}, an FMU knows one variable of a name",
                    next_step="rename one of them",
                )
            taken[variable.name] = kind
    for variable in (*indicator_variables(model), *mode_variables(model)):
        if not _NAME.fullmatch(variable.name) or variable.name in known | taken.keys():
            raise ExportError(f"switch '{variable.name}'", "its name is taken", next_step="rename a part")
        taken[variable.name] = "switch"
    for variable in model.outputs:
        if taken.get(variable.name, "state") != "state":
            raise ExportError(
                f"output '{variable.name}'",
                f"is {_a(taken[variable.name])} as well",
                next_step="leave it out of the outputs",
            )


def _a(kind: str) -> str:
    return f"an {kind}" if kind[0] in "aeiou" else f"a {kind}"


def _named_once(model: FlatModel) -> tuple[list[Variable], list[Variable]]:
    """Return outputs and signals without those that repeat an earlier variable."""
    probes = _probes(model)
    rows = {v.name: probes["state"][i] for i, v in enumerate(model.states)}
    rows |= {v.name: probes["input"][i] for i, v in enumerate(model.inputs)}
    kept: dict[str, list[Variable]] = {"output": [], "signal": []}
    for kind, group in (("output", model.outputs), ("signal", model.signals)):
        for i, variable in enumerate(group):
            if not _NAME.fullmatch(variable.name):
                raise ExportError(
                    f"{kind} '{variable.name}'", "is not a structured name", next_step="use words and dots"
                )
            values = probes[kind][i]
            if variable.name not in rows:
                rows[variable.name] = values
                kept[kind].append(variable)
            elif not np.allclose(rows[variable.name], values, rtol=1e-9, atol=0.0, equal_nan=True):
                raise ExportError(
                    f"'{variable.name}'",
                    f"names {_a(kind)} and something else",
                    next_step="rename one of them",
                )
    return kept["output"], kept["signal"]


def _probes(model: FlatModel) -> dict[str, Array]:
    """Return states, inputs, outputs and signals at five points, to find equal ones."""
    generator = np.random.default_rng(1)
    parameters = model.start(model.parameters)
    samples: dict[str, list[Array]] = {"state": [], "input": [], "output": [], "signal": []}
    for _ in range(5):
        x, u = (_around(group, generator) for group in (model.states, model.inputs))
        _, y, s, _ = model.equations(0.0, x, u, parameters, model.look_up(x.tolist(), u.tolist()))
        for kind, values in zip(samples, (x, u, y, s), strict=True):
            samples[kind].append(np.array(values, dtype=float).reshape(-1))
    return {kind: np.array(values).T for kind, values in samples.items()}


def _around(group: Sequence[Variable], generator: np.random.Generator) -> Array:
    values = [v.start + 0.3 * v.nominal * generator.uniform(-1, 1) for v in group]
    limits = [(v.minimum, v.maximum) for v in group]
    return np.array(
        [min(max(x, low), high) for x, (low, high) in zip(values, limits, strict=True) if not math.isnan(x)]
    )
