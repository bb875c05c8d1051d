"""Blocks: pieces of a model, cut at the measured signals, each driven by measurements alone."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace

import casadi as ca

from ...components.assembly.named_parts import Assembly
from ...errors import MeasurementError
from ...identification.equation_error.block import Block, Drive
from ...model import FlatModel, Variable, flatten
from ...model.flat import Symbols
from ...model.transform import cut, named, without_idle_states
from ...symbolic import Expression, depends

READING_WIDTH, BALANCE_WIDTH = 2.0, 4.0
"""Filter widths in samples. A balance holds a second derivative, whose noise asks for more."""


@dataclass(frozen=True)
class _Known:
    """A variable of the model whose value follows from a measurement, and the sensors between, last first."""

    truth: str
    signal: str
    sensors: tuple[str, ...]


class _SensorNumbers:
    """The parameters and states of one sensor as symbols of a flat model."""

    def __init__(self, model: FlatModel, symbols: tuple[Expression, Expression], owner: str) -> None:
        parameter, state = symbols
        self._symbols = {v.name: parameter[i] for i, v in enumerate(model.parameters)}
        self._symbols |= {v.name: state[i] for i, v in enumerate(model.states)}
        self._owner = owner

    def parameter(self, name: str) -> Expression:
        """Return the symbol of one number."""
        return self._symbols[f"{self._owner}.{name}"]

    def memory(self, name: str) -> Expression:
        """Return the symbol of one state."""
        return self._symbols[f"{self._owner}.{name}"]


def blocks_of(assembly: Assembly, signals: Sequence[str]) -> list[Block]:
    """Cut the model of an assembly at measured signals.

    Every measured force or torque gives a block that predicts it from the measured motion. Every measured
    motion of a body that moves freely gives a block that balances the efforts on it, with measured efforts in
    place of those that the model would predict.

    Parameters
    ----------
    assembly
        What is measured.
    signals
        Full names of measured signals; readings of sensors stand for what these read.

    Raises
    ------
    MeasurementError
        If nothing can be compared: no motion is measured, or no effort and no drive.
    """
    model = flatten(assembly)
    known = [_known(assembly, s) for s in signals]
    states, inputs = {v.name for v in model.states}, {v.name for v in model.inputs}
    moving = [k for k in known if k.truth in states and _speed_of(k.truth) in states]
    efforts = [k for k in known if k.truth not in states | inputs]
    driven = [k for k in known if k.truth in inputs]
    opened = cut(model, [e.truth for e in efforts], keep=True) if efforts else model
    found = [
        _reading_block(assembly, opened, effort, moving + driven + efforts)
        for effort in efforts
        if moving + driven
    ]
    found += [_balance_block(assembly, opened, body, moving + driven + efforts) for body in moving]
    if not found:
        raise MeasurementError(
            "records",
            "measure no motion that drives the model, or nothing to compare it with",
            next_step=f"measure for instance an angle and a force; measured are: {', '.join(signals)}",
        )
    return found


def _known(assembly: Assembly, signal: str) -> _Known:
    sensors, chain, truth = assembly.sensors(), [], signal
    while truth.endswith(".reading") and (owner := truth.rpartition(".")[0]) in sensors:
        chain.append(owner)
        truth = sensors[owner].of
    return _Known(truth, signal, tuple(chain))


def _speed_of(motion: str) -> str:
    return f"{motion.rpartition('.')[0]}.speed"


def _reading_block(assembly: Assembly, model: FlatModel, effort: _Known, given: Sequence[_Known]) -> Block:
    name = effort.truth.partition(".")[0]
    # Where an effort acts back on a body inside, the measured one acts.
    s, inputs = model.symbols(), [v.name for v in model.inputs]
    led = {n for k in given for n in (k.truth, _speed_of(k.truth))}
    own = ca.vertcat(*[s.derivative[i] for i, v in enumerate(model.states) if v.name not in led])
    cuts = {v.name for v in model.signals} & set(inputs)
    used = [k for k in given if k.truth not in cuts or depends(own, s.input[inputs.index(k.truth)])]
    return _driven(assembly, model, used, (name, effort.signal, effort.signal))


def _balance_block(assembly: Assembly, model: FlatModel, body: _Known, given: Sequence[_Known]) -> Block:
    name = body.truth.rpartition(".")[0]
    return _driven(assembly, model, given, (name, f"{name}.unbalanced", None))


class _Readings:
    """What readings of sensors say of the variables of a model, as symbols that they drive."""

    def __init__(
        self, assembly: Assembly, model: FlatModel, symbols: tuple[Expression, Expression], output: str
    ) -> None:
        self._sensors, self._model, self._symbols = assembly.sensors(), model, symbols
        self._output = output
        self.drives: dict[str, Drive] = {}
        self.new: dict[str, tuple[Variable, Expression]] = {}

    def reading(self, known: _Known, order: int) -> Expression:
        """Return the symbol of a reading or of one of its derivatives."""
        # The same reading may be predicted and drive a body inside.
        label = known.signal + ("", ".rate", ".acceleration")[order]
        label += ".measured" if label == self._output else ""
        if label not in self.new:
            self.drives[label] = Drive(known.signal, order, self._late_by(known))
            self.new[label] = Variable(label, "", f"measured {known.signal}"), ca.SX.sym(label)
        return self.new[label][1]

    def _late_by(self, known: _Known) -> str | None:
        late = [f"{s}.{self._sensors[s].late_by}" for s in known.sensors if self._sensors[s].late_by]
        if len(late) > 1:
            raise MeasurementError(
                f"signal '{known.signal}'",
                f"is late by {' and '.join(late)}, which cannot be told apart",
                next_step="put both delays into one sensor",
            )
        return late[0] if late else None

    def inferred(self, known: _Known, order: int) -> Expression:
        """Return what the sensor must have seen, or its derivative."""
        value = self.reading(known, 0)
        for sensor in known.sensors:
            numbers = _SensorNumbers(self._model, self._symbols, sensor)
            value = self._sensors[sensor].infer(numbers, value)
        if order == 0:
            return value
        # A reading is a static function of what it reads, so rates follow by its slope.
        return ca.jacobian(value, self.reading(known, 0)) * self.reading(known, order)


def _driven(
    assembly: Assembly, model: FlatModel, given: Sequence[_Known], what: tuple[str, str, str | None]
) -> Block:
    """Return the block whose prescribed variables follow from readings."""
    name, output, target = what
    s = model.symbols()
    states, inputs = [v.name for v in model.states], [v.name for v in model.inputs]
    readings = _Readings(assembly, model, (s.parameter, s.state), output)
    inferred = readings.inferred
    old, instead, prescribed = [], [], list[str]()
    for known in given:
        if known.truth in states:
            pair = [known.truth, _speed_of(known.truth)]
            old += [s.state[states.index(n)] for n in pair]
            instead += [inferred(known, 0), inferred(known, 1)]
            prescribed += pair
        elif known.truth in inputs:
            old.append(s.input[inputs.index(known.truth)])
            instead.append(inferred(known, 0))
            rate = _speed_of(known.truth)
            if rate in inputs and rate not in [k.truth for k in given]:
                old.append(s.input[inputs.index(rate)])
                instead.append(inferred(known, 1))
    if target is None:
        body = next(k for k in given if k.truth.rpartition(".")[0] == name and k.truth in states)
        result, variable = (
            _unbalanced(model, s, name),
            Variable(output, _effort_unit(model, name), f"sum of all efforts on {name}"),
        )
        result = _inertia(model, s, name) * inferred(body, 2) - result
        drive = next((k for k in given if k.truth in inputs and k.truth.startswith(f"{name}.")), None)
    else:
        place = next(i for i, v in enumerate(model.signals) if v.name == target)
        result, variable = s.signal[place], model.signals[place]
    kept = [i for i, n in enumerate(states) if n not in prescribed]
    derivative = ca.SX(ca.vertcat(ca.SX(0, 1), *[s.derivative[i] for i in kept]))
    # Signals with a stated range stay, so that a prediction can say where it is left.
    bounded = [i for i, v in enumerate(model.signals) if v.bounded]
    ranged = ca.SX(ca.vertcat(ca.SX(0, 1), *[s.signal[i] for i in bounded]))
    rows = ca.substitute([derivative, result, ranged], [ca.vertcat(*old)], [ca.vertcat(*instead)])
    resting = [i for i, n in enumerate(inputs) if not any(n in (k.truth, _speed_of(k.truth)) for k in given)]
    columns = [
        s.time,
        ca.vertcat(*[s.state[i] for i in kept]),
        ca.vertcat(*[e for _, e in readings.new.values()], *[s.input[i] for i in resting]),
        s.parameter,
        s.table,
    ]
    if target is None and drive is not None:
        rows[1] = _in_drive_units(rows[1], readings.reading(drive, 0), s.parameter, model)
    equations = ca.Function(
        "equations", [ca.SX(c) for c in columns], [ca.densify(rows[0]), rows[1], rows[2], ca.SX(0, 1)]
    )
    pruned = replace(
        model,
        equations=equations,
        states=tuple(model.states[i] for i in kept),
        signals=tuple(model.signals[i] for i in bounded),
        outputs=(variable,),
        inputs=(*[v for v, _ in readings.new.values()], *[model.inputs[i] for i in resting]),
    )
    return Block(
        name,
        without_idle_states(pruned, [output]),
        readings.drives,
        output,
        target,
        READING_WIDTH if target else BALANCE_WIDTH,
        None if target else f"{body.signal}.rate",
    )


def _inertia(model: FlatModel, s: Symbols, body: str) -> Expression:
    """Return what moves with a body: of a train of gears, the inertia seen from its leading body."""
    known = named(model, s)
    names = (f"{body}.{n}" for n in ("train_inertia", "inertia", "mass"))
    return next(known[name] for name in names if name in known)


def _effort_unit(model: FlatModel, body: str) -> str:
    return "N*m" if f"{body}.inertia" in model.values else "N"


def _unbalanced(model: FlatModel, s: Symbols, body: str) -> Expression:
    place = [v.name for v in model.states].index(f"{body}.speed")
    return _inertia(model, s, body) * s.derivative[place]


def _in_drive_units(
    balance: Expression, drive: Expression, parameter: Expression, model: FlatModel
) -> Expression:
    """Return the balance as the error of the measured drive, times the declared torque (or force) per drive.

    A balance can be made small by making all its factors small; an error of a measured signal cannot.
    """
    slope = ca.substitute(ca.jacobian(balance, drive), drive, ca.SX(0))
    declared = ca.substitute(slope, parameter, ca.DM(model.start(model.parameters)))
    return balance * (declared / slope)
