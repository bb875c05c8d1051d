"""The variables of an FMU: their order, causality and variability.

A value reference is an index into one array; the groups are in the order time, states, derivatives,
inputs, parameters, outputs, signals, event indicators, modes, one extra, and behind them the status word.
An output that is a state is one variable, as is a signal that is an output. Each switch of a model that is
located shows its mode and an event indicator.
"""

from __future__ import annotations

import math
import re
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace

import casadi as ca
import numpy as np

from ...foundation.arrays import Array
from ...foundation.errors import ExportError
from ...foundation.symbolic import remembered
from ...model.flat import FlatModel, Switch, Variable
from ..c.guarded_step import FIRST_INDEX_BIT, STATUS_BITS
from .expression_walk import EVERYTHING, ranges
from .terminals import with_flange_outputs
from .typical_sizes import typical_sizes, with_sizes


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


def _probes(model: FlatModel, points: int = 5) -> dict[str, Array]:
    """Return states, inputs, outputs and signals at several points, to find equal ones."""
    generator = np.random.default_rng(1)
    parameters = model.start(model.parameters)
    samples: dict[str, list[Array]] = {"state": [], "input": [], "output": [], "signal": []}
    for _ in range(points):
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
