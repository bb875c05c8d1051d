"""Blocks: pieces of a model, cut at the measured signals, each driven by measurements alone."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import dataclass, replace
from typing import NamedTuple

import casadi as ca

from ...errors import MeasurementError
from ...identification.equation_error.block import Block, Drive
from ...model import FlatModel, Variable
from ...model.flat import Symbols
from ...model.readings import ReadingNames, reading_of
from ...model.structure import MovingBody, body_moved_by, top_part
from ...model.transform import cut, named, without_idle_states
from ...symbolic import Expression, depends


@dataclass(frozen=True)
class _Measured:
    """A measured signal: what it shows, and the body whose motion that is, if it is a motion."""

    reading: ReadingNames
    body: MovingBody | None

    @property
    def shown(self) -> str:
        """Name of the state, input or effort that it shows."""
        return self.reading.measured

    @property
    def given(self) -> tuple[str, ...]:
        """Names of the variables that follow from it: an effort or input, or a motion and its rate."""
        return (self.shown, self.body.rate) if self.body else (self.shown,)


def blocks_of(model: FlatModel, signals: Sequence[str]) -> list[Block]:
    """Cut a model at measured signals.

    Every measured force or torque gives a block that predicts it from the measured motion. Every measured
    motion of a body that moves freely gives a block that balances the efforts on it, with measured efforts in
    place of those that the model would predict.

    Parameters
    ----------
    model
        Of what is measured.
    signals
        Full names of measured signals; readings of sensors stand for what these read.

    Raises
    ------
    MeasurementError
        If nothing can be compared: no motion is measured, or no effort and no drive.
    """
    measured = [_measured(model, signal) for signal in signals]
    states, inputs = {v.name for v in model.states}, {v.name for v in model.inputs}
    moving = [m for m in measured if m.body and not m.body.prescribed]
    efforts = [m for m in measured if m.shown not in states | inputs]
    driven = [m for m in measured if m.shown in inputs]
    opened = cut(model, [e.shown for e in efforts], keep=True) if efforts else model
    given = moving + driven + efforts
    blocks = [_reading_block(opened, effort, given) for effort in efforts if moving + driven]
    blocks += [_balance_block(opened, each.body, given) for each in moving if each.body]
    if not blocks:
        raise MeasurementError(
            "records",
            "measure no motion that drives the model, or nothing to compare it with",
            next_step=f"measure for instance an angle and a force; measured are: {', '.join(signals)}",
        )
    return blocks


def _measured(model: FlatModel, signal: str) -> _Measured:
    reading = reading_of(model.readings, signal)
    return _Measured(reading, body_moved_by(model.bodies, reading.measured))


class _Result(NamedTuple):
    """What a block gives out, and as what."""

    part: str
    variable: Variable
    value: Expression
    target: str | None
    moving: str | None


def _reading_block(model: FlatModel, effort: _Measured, given: Sequence[_Measured]) -> Block:
    """Return the block that predicts a measured effort."""
    # Where an effort acts back on a body inside, the measured one acts.
    s, inputs = model.symbols(), [v.name for v in model.inputs]
    led = {name for each in given for name in each.given}
    own = ca.vertcat(*[s.derivative[i] for i, v in enumerate(model.states) if v.name not in led])
    torn = {v.name for v in model.signals} & set(inputs)
    used = [m for m in given if m.shown not in torn or depends(own, s.input[inputs.index(m.shown)])]
    signal = effort.reading.signal
    place = next(i for i, v in enumerate(model.signals) if v.name == signal)
    tearing = _Tearing(model, s, used, signal)
    predicted = _Result(top_part(effort.shown), model.signals[place], s.signal[place], signal, None)
    return tearing.block(predicted)


def _balance_block(model: FlatModel, body: MovingBody, given: Sequence[_Measured]) -> Block:
    """Return the block that balances the efforts on a body: inertia times acceleration less all of them."""
    output = f"{body.name}.unbalanced"
    s = model.symbols()
    tearing = _Tearing(model, s, given, output)
    motion = next(m for m in given if m.body == body)
    inertia = named(model, s)[str(body.inertia)]
    efforts = inertia * s.derivative[[v.name for v in model.states].index(body.rate)]
    balance = inertia * tearing.inferred(motion, 2) - efforts
    variable = Variable(output, body.domain.effort_unit, f"sum of all efforts on {body.name}")
    moving = f"{motion.reading.signal}.rate"
    return tearing.block(_Result(body.name, variable, balance, None, moving), body)


class _Tearing:
    """A model in which the measured variables are replaced by what their readings say of them."""

    def __init__(self, model: FlatModel, s: Symbols, given: Sequence[_Measured], output: str) -> None:
        self._model, self._s, self._given, self._output = model, s, given, output
        self._known = named(model, s)
        self._drives: dict[str, Drive] = {}
        self._inputs: dict[str, tuple[Variable, Expression]] = {}
        self._replaced = dict(self._replacements())

    def _reading(self, measured: _Measured, order: int) -> Expression:
        """Return the symbol of a reading or of one of its derivatives."""
        signal = measured.reading.signal
        # The same reading may be predicted and drive a body inside.
        label = signal + ("", ".rate", ".acceleration")[order]
        label += ".measured" if label == self._output else ""
        if label not in self._inputs:
            self._drives[label] = Drive(signal, order, measured.reading.delays)
            self._inputs[label] = Variable(label, "", f"measured {signal}"), ca.SX.sym(label)
        return self._inputs[label][1]

    def inferred(self, measured: _Measured, order: int) -> Expression:
        """Return what the sensors must have seen, or its derivative."""
        value = measured.reading.inferred(self._reading(measured, 0), self._known)
        if order == 0:
            return value
        # A reading is a static function of what it reads, so rates follow by its slope.
        return ca.jacobian(value, self._reading(measured, 0)) * self._reading(measured, order)

    def _replacements(self) -> Iterator[tuple[str, Expression]]:
        """Yield the variables of the model that follow from readings, with what they follow as."""
        model, measured = self._model, {m.shown for m in self._given}
        variables = {v.name for v in model.states + model.inputs}
        for each in self._given:
            yield each.shown, self.inferred(each, 0)
            if each.body and each.body.rate in variables - measured:
                yield each.body.rate, self.inferred(each, 1)

    def block(self, result: _Result, body: MovingBody | None = None) -> Block:
        """Return the block of a result.

        Parameters
        ----------
        result
            In the symbols of the model.
        body
            Whose balance it is.
        """
        model, s = self._model, self._s
        kept = [i for i, v in enumerate(model.states) if v.name not in self._replaced]
        resting = [i for i, v in enumerate(model.inputs) if v.name not in self._replaced]
        # Signals with a stated range stay, so that a prediction can say where it is left.
        bounded = [i for i, v in enumerate(model.signals) if v.bounded]
        derivative, value, signal = self._in_readings(
            [_column(s.derivative, kept), result.value, _column(s.signal, bounded)]
        )
        value = self._in_drive_units(value, body)
        driven = ca.vertcat(*[symbol for _, symbol in self._inputs.values()])
        columns = [
            s.time,
            _column(s.state, kept),
            ca.vertcat(driven, _column(s.input, resting)),
            s.parameter,
            s.table,
        ]
        rows = [ca.densify(derivative), value, signal, ca.SX(0, 1)]
        torn = replace(
            model,
            equations=ca.Function("equations", [ca.SX(c) for c in columns], rows),
            states=tuple(model.states[i] for i in kept),
            signals=tuple(model.signals[i] for i in bounded),
            outputs=(result.variable,),
            inputs=(*[v for v, _ in self._inputs.values()], *[model.inputs[i] for i in resting]),
        )
        return Block(
            name=result.part,
            model=without_idle_states(torn, [result.variable.name]),
            drives=self._drives,
            output=result.variable.name,
            target=result.target,
            moving=result.moving,
        )

    def _in_readings(self, rows: list[Expression]) -> list[Expression]:
        """Return expressions with the readings in place of the variables that they show."""
        model, s = self._model, self._s
        names = [v.name for v in (*model.states, *model.inputs)]
        # An effort that was cut is an input and goes on as a signal: the input is what is replaced.
        symbols = dict(zip(names, ca.vertsplit(ca.vertcat(s.state, s.input)), strict=True))
        shown = ca.vertcat(*[symbols[name] for name in self._replaced])
        replaced: list[Expression] = ca.substitute(rows, [shown], [ca.vertcat(*self._replaced.values())])
        return replaced

    def _in_drive_units(self, balance: Expression, body: MovingBody | None) -> Expression:
        """Return a balance as the error of the measured drive, times the declared effort per drive.

        A balance can be made small by making all its factors small; an error of a measured signal cannot.
        """
        inputs = {v.name for v in self._model.inputs}
        drives = (m for m in self._given if m.shown in inputs and body and top_part(m.shown) == body.name)
        drive = next(drives, None)
        if drive is None:
            return balance
        reading, parameter = self._reading(drive, 0), self._s.parameter
        slope = ca.substitute(ca.jacobian(balance, reading), reading, ca.SX(0))
        declared = ca.substitute(slope, parameter, ca.DM(self._model.start(self._model.parameters)))
        return balance * (declared / slope)


def _column(rows: Expression, places: Sequence[int]) -> Expression:
    return ca.SX(ca.vertcat(ca.SX(0, 1), *[rows[i] for i in places]))
