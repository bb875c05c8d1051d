"""A model cut at its measured signals into blocks that measurements alone drive; no effect is known here.

A balance, inertia times acceleration less all efforts, can be made small by making all its factors small. An
error of something that was measured cannot. So a balance is written as the error of a measured signal, times
the *declared* effort per unit of that signal, a constant that no hypothesis can change:

1. Where the drive is measured: the error of the drive. With e(u) what a drive of u gives at standstill and b
   the balance, the model asks for the drive u + b/e'(u), to first order: its inverse along the tangent at the
   measured point. So the error is b/e'(u). A drive that saturates gives less and asks for more: the flatter
   it is, the larger its error. Where a drive is held at its limit there is no tangent; the straight line
   from zero to the measured point stands for it. Where e is proportional to u the tangent is that in motion,
   and the inverse exact: a gear with losses passes on another share of the drive in each direction.
2. Where another effort on the body is measured: the balance as it is, for its reading enters there.
3. Where motion alone is measured: the error of the acceleration.
"""

from __future__ import annotations

from collections.abc import Collection, Iterator, Mapping, Sequence
from dataclasses import dataclass, replace
from typing import NamedTuple

import casadi as ca
import numpy as np

from ...foundation.arrays import Array
from ...foundation.errors import MeasurementError
from ...foundation.quantity import same_dimension
from ...foundation.symbolic import Expression, remembered
from ...model import FlatModel, Variable
from ...model.flat import Symbols
from ...model.readings import ReadingNames, reading_of
from ...model.structure import MovingBody, top_part
from ...model.transform import cut, named, without_idle_states
from ..identification.equation_error.block import Block, Drive

MOTION, RATE, ACCELERATION = 0, 1, 2
"""How often the motion of a body is derived to give what is measured."""


@dataclass(frozen=True)
class Measured:
    """A measured signal and what it stands for."""

    reading: ReadingNames  # what it shows, through which sensors
    shown: str  # name of the variable that follows from it: a state or input, or the signal that is shown
    body: MovingBody | None = None  # the body whose motion that is, None if it is none
    order: int = MOTION  # of a motion: 0 for the motion itself, 1 for the rate, 2 for the acceleration

    @property
    def signal(self) -> str:
        """Name of what was measured."""
        return self.reading.signal


def measured_signals(model: FlatModel, signals: Sequence[str]) -> list[Measured]:
    """Return what each measured signal stands for."""
    return [_measured(model, signal) for signal in signals]


def _measured(model: FlatModel, signal: str) -> Measured:
    reading = reading_of(model.readings, signal)
    shown = _variable_behind(model, reading.measured)
    for body in model.bodies:
        orders = (body.motion, body.rate, body.acceleration)
        if shown in orders:
            return Measured(reading, shown, body, orders.index(shown))
    return Measured(reading, shown)


def _variable_behind(model: FlatModel, name: str) -> str:
    """Return the state or input that a signal follows from through a fixed ratio: a motion behind a gear.

    A force that goes with a motion, as that of a spring, is none.
    """
    s = model.symbols()
    known = {v.name: (v, s.signal[i]) for i, v in enumerate(model.signals)}
    if name not in known:
        return name
    variable, value = known[name]
    moving = [(v, s.state[i]) for i, v in enumerate(model.states)]
    moving += [(v, s.input[i]) for i, v in enumerate(model.inputs)]
    inside = [(v, symbol) for v, symbol in moving if ca.depends_on(value, symbol)]
    if len(inside) != 1:
        return name
    behind, symbol = inside[0]
    # Behind a rack or a screw the motion of what is geared has the unit of another domain.
    units = {b.motion: ("m", "rad") for b in model.bodies if top_part(name) in b.geared}
    units |= {b.rate: ("m/s", "rad/s") for b in model.bodies if top_part(name) in b.geared}
    if not any(same_dimension(unit, variable.unit) for unit in (behind.unit, *units.get(behind.name, ()))):
        return name
    everything = ca.vertcat(s.state, s.input, s.time)
    return name if ca.depends_on(ca.jacobian(value, symbol), everything) else behind.name


def behind_ratio(measured: Measured, value: Expression, known: Mapping[str, Expression]) -> Expression:
    """Return the variable that a measured value stands for, where a fixed ratio lies between."""
    name = measured.reading.measured
    if measured.shown == name:
        return value
    seen, symbol = known[name], known[measured.shown]
    offset = ca.substitute(seen, symbol, ca.SX(0))
    return (value - offset) / ca.jacobian(seen, symbol)


def behind_declared_ratio(model: FlatModel, measured: Measured, values: Array) -> Array:
    """Return the variable that measured values stand for, with the ratio that the model has."""
    s, value = model.symbols(), ca.SX.sym("value")
    behind = ca.Function("behind", [value, s.parameter], [behind_ratio(measured, value, named(model, s))])
    numbers = model.start(model.parameters)
    return np.asarray(behind(values[None, :], numbers), dtype=np.float64).ravel()


_NEAR_ZERO = 1e-9
"""Drive, in SI, below which the slope at zero stands for the straight line to the measured point."""
_INSIDE = 0.999
"""Share of the measured drive at which the tangent is taken."""
_LEAST_SLOPE = 0.1
"""Of that line, the least slope that is taken for a tangent: no error counts more than ten times."""


class BalanceTerms(NamedTuple):
    """A balance and what stands in it."""

    balance: Expression  # inertia times acceleration less all efforts
    # derivative, state: of the states left in the block, columns
    derivative: Expression
    state: Expression
    readings: Expression  # symbols of all measured signals and their derivatives
    # parameter, declared: symbols and numbers
    parameter: Expression
    declared: Array


def scaled_balance(
    terms: BalanceTerms, *, drives: Sequence[Expression], efforts: Sequence[Expression], inertia: Expression
) -> tuple[Expression, float]:
    """Return a balance in the scale of what was measured, and the declared effort per unit of that.

    ``drives``: readings of what may drive the body; the first one that does is taken.
    """
    for reading in drives:
        given = _effort_at_standstill(terms, reading)
        slope = _at_start(terms, ca.substitute(ca.jacobian(given, reading), reading, ca.SX(0)))
        declared = _declared(terms, slope)
        if declared == 0.0 or not np.isfinite(declared):
            continue
        tangent = ca.jacobian(given, reading)
        if not ca.depends_on(tangent, reading):
            direct = ca.depends_on(terms.balance, reading) and not _states_behind(terms, reading)
            in_motion = -ca.jacobian(terms.balance, reading) if direct else tangent
            if _clocks(terms):
                first = _at_start(terms, in_motion)
                in_motion = first * _between_least_and_one(in_motion / first)
            return terms.balance * (declared / in_motion), declared
        tiny = _NEAR_ZERO**2
        line = (given * reading + tiny * slope) / (reading * reading + tiny)
        # A record of what a limit lets through stands on the limit itself: the slope is that just below it.
        inside = ca.substitute(tangent, reading, _INSIDE * reading)
        share = ca.fmax(inside / slope, _LEAST_SLOPE * line / slope)
        share = ca.if_else(inside == 0, line / slope, share)
        if _clocks(terms):
            share = _between_least_and_one(share)
        return terms.balance * (declared / (slope * share)), declared
    if any(ca.depends_on(terms.balance, reading) for reading in efforts):
        return terms.balance, 1.0
    declared = _declared(terms, inertia)
    return terms.balance * (declared / inertia), declared


def _clocks(terms: BalanceTerms) -> list[int]:
    """Return the states that go on with time alone, whatever is measured."""
    moving = ca.vertcat(terms.readings, terms.state)
    return [i for i in range(terms.state.numel()) if not ca.depends_on(terms.derivative[i], moving)]


def _at_start(terms: BalanceTerms, value: Expression) -> Expression:
    """Return a value at the time at which a record starts: no drift has happened yet."""
    clocks = ca.vertcat(ca.SX(0, 1), *[terms.state[i] for i in _clocks(terms)])
    started: Expression = ca.substitute(value, clocks, ca.SX.zeros(clocks.shape))
    return started


def _between_least_and_one(share: Expression) -> Expression:
    """Return a share of a slope that lets no error count less than it does, or more than ten times.

    A drive that becomes stronger with time would make any error small, also one of nothing; one that vanishes
    would no longer be judged.
    """
    return ca.fmax(_LEAST_SLOPE, ca.fmin(share, 1))


def _effort_at_standstill(terms: BalanceTerms, reading: Expression) -> Expression:
    """Return the effort that a constant drive gives in the end, while nothing moves.

    States between the drive and its effort, of a delay or a winding, are taken where they rest.
    """
    behind, clocks = _states_behind(terms, reading), _clocks(terms)
    others = [symbol for symbol in ca.vertsplit(terms.readings) if symbol.name() != reading.name()]
    states = [terms.state[i] for i in range(terms.state.numel()) if i not in behind and i not in clocks]
    rest = ca.vertcat(*others, *states)
    still = [terms.balance, ca.vertcat(ca.SX(0, 1), *[terms.derivative[i] for i in behind])]
    balance, rate = ca.substitute(still, [rest], [ca.SX.zeros(rest.shape)])
    if behind:
        inner = ca.vertcat(*[terms.state[i] for i in behind])
        nowhere = ca.SX.zeros(inner.shape)
        slope = ca.substitute(ca.jacobian(rate, inner), inner, nowhere)
        start = ca.substitute(rate, inner, nowhere)
        if bool(_singular(terms, ca.substitute(slope, reading, ca.SX(0)))):
            return ca.SX(0)
        balance = ca.substitute(balance, inner, -ca.solve(slope, start))
    return ca.substitute(balance, reading, ca.SX(0)) - balance


def _states_behind(terms: BalanceTerms, reading: Expression) -> list[int]:
    """Return the states through which a drive reaches its effort, as that of a winding.

    One that a drive of either sign moves to the same side, such as the heat of a winding, passes nothing on:
    it changes what the drive gives, and is no part of it.
    """
    reached: list[int] = []
    frontier: list[Expression] = [reading]
    while frontier:
        symbol = frontier.pop()
        for i in range(terms.state.numel()):
            if i not in reached and _passed_on(terms, symbol, terms.derivative[i]):
                reached.append(i)
                frontier.append(terms.state[i])
    return sorted(reached)


def _warmed(terms: BalanceTerms, drives: Sequence[Expression]) -> list[int]:
    """Return the states that a drive of either sign moves to the same side: a winding that grows warm.

    They begin cold: how warm a drive was before a record nobody knows, and what it holds at the first sample
    it need not have held for long.
    """
    behind = {i for reading in drives for i in _states_behind(terms, reading)}
    moving = [*drives, *[terms.state[i] for i in behind]]
    others = set(range(terms.state.numel())) - behind - set(_clocks(terms))
    return [i for i in sorted(others) if any(ca.depends_on(terms.derivative[i], each) for each in moving)]


_OF_EITHER_SIGN = np.outer([-1.0, 1.0], 10.0 ** np.arange(-6, 7)).ravel()
"""Values, in SI, at which it is asked which way something moves: one sign only counts beyond any bias."""


def _passed_on(terms: BalanceTerms, symbol: Expression, rate: Expression) -> bool:
    """Tell whether a rate follows a symbol, all else at zero, the same way for either sign of that symbol."""
    slope = ca.jacobian(rate, symbol)
    if slope.nnz() == 0:
        return False
    others = [s for s in ca.vertsplit(ca.vertcat(terms.readings, terms.state)) if s.name() != symbol.name()]
    alone = ca.substitute(slope, ca.vertcat(*others), ca.SX.zeros(len(others)))
    slopes = ca.Function("slope", [symbol, terms.parameter], [ca.densify(alone)])
    signs = np.sign(slopes(_OF_EITHER_SIGN[None, :], terms.declared).full())
    return bool(np.any(signs > 0.0) != np.any(signs < 0.0))


def _declared(terms: BalanceTerms, value: Expression) -> float:
    """Return a number that depends on parameters alone at their declared values."""
    return float(ca.Function("declared", [terms.parameter], [value])(terms.declared))


def _singular(terms: BalanceTerms, matrix: Expression) -> bool:
    values = ca.Function("slope", [terms.parameter], [ca.densify(matrix)])(terms.declared).full()
    return not np.all(np.isfinite(values)) or np.linalg.matrix_rank(values) < len(values)


@remembered(32)
def blocks_of(model: FlatModel, signals: Sequence[str]) -> tuple[Block, ...]:
    """Cut a model at measured signals.

    Every measured force or torque gives a block that predicts it from what else is measured; so does the
    command of a controller, a current behind a measured voltage, and a motion that is measured twice. Every
    body that moves freely and whose motion or rate is measured gives a block that balances the efforts on
    it, with measured efforts in place of those that the model would predict. A block that would need a
    command that is not measured is left out.

    ``signals``: full names of measured signals; readings of sensors stand for what these read.
    """
    used = _sorted(model, measured_signals(model, signals))
    drives, efforts = used.drives, used.efforts
    opened, fed, acting = _cut_open(model, used)
    blocks = [_reading_block(fed, target, [*drives, *acting]) for target in (*efforts, *used.targets)]
    blocks += [
        _balance_block(opened, lead, used.accelerations.get(lead.body.name), [*drives, *efforts])
        for lead in drives
        if lead.body and not lead.body.prescribed
    ]
    unknown = _unknown_commands(model, used)
    sound = _uniquely_named([block for block in blocks if _says_something(block, unknown)])
    if not sound:
        raise MeasurementError(
            "records",
            "measure no motion that drives the model, or nothing to compare it with",
            next_step=_what_to_measure(model, drives, unknown, signals),
        )
    return tuple(sound)


class _Sorted(NamedTuple):
    """Measured signals by what they are used for."""

    # drives: motions, rates, commands and other inputs, inner states: they replace these variables
    drives: list[Measured]
    # efforts: signals where the model is cut: predicted, and acting in place of the predicted ones elsewhere
    efforts: list[Measured]
    targets: list[Measured]  # predicted only: what is measured twice, and what does not show a value
    # accelerations: measured accelerations by name of the body whose motion or rate is measured too
    accelerations: dict[str, Measured]


def _sorted(model: FlatModel, measured: Sequence[Measured]) -> _Sorted:
    result = _Sorted([], [], [], {})
    inputs, states = {v.name for v in model.inputs}, {v.name for v in model.states}
    plain = sorted(measured, key=lambda m: m.order)  # the motion leads its rate
    for each in plain:
        names = {d.shown for d in (*result.drives, *result.efforts)}
        body = each.body
        led = body is not None and {body.motion, body.rate} & names
        if not each.reading.shows_value or each.shown in names:
            result.targets.append(each)
        elif body is None and each.shown not in inputs | states:
            result.efforts.append(each)
        elif body is None:
            result.drives.append(each)
            result.targets.extend([each] if each.shown in states else [])
        elif body.prescribed:
            _check_place(model, body, each, names)
            result.drives.append(each)
        elif each.order == ACCELERATION and led and body.name not in result.accelerations:
            result.accelerations[body.name] = each
        elif each.order == ACCELERATION or led:
            result.targets.append(each)
        else:
            result.drives.append(each)
    return result


def _check_place(model: FlatModel, body: MovingBody, each: Measured, names: Collection[str]) -> None:
    """Refuse the rate of a prescribed motion without the motion, where efforts depend on the place."""
    s = model.symbols()
    place = [v.name for v in model.inputs].index(body.motion)
    if each.order == RATE and body.motion not in names and ca.depends_on(s.derivative, s.input[place]):
        raise MeasurementError(
            f"signal '{each.signal}'",
            f"says how fast '{body.name}' moves, not where it is, and efforts depend on that",
            next_step=f"measure '{body.motion}'",
        )


def _unknown_commands(model: FlatModel, measured: _Sorted) -> list[str]:
    """Return the inputs that command a drive and are not measured: they need not have been zero."""
    known = {m.shown for m in measured.drives}
    inputs = {v.name for v in model.inputs}
    wanted = (name for body in model.bodies for name in (*body.commands, *body.goals))
    return [name for name in wanted if name in inputs - known]


def _says_something(block: Block, unknown: Collection[str]) -> bool:
    """Tell whether a block depends on something measured, and on no command that is not known."""
    s, names = block.model.symbols(), [v.name for v in block.model.inputs]
    together = ca.vertcat(s.output, s.derivative)
    driving = [s.input[i] for i, name in enumerate(names) if name in block.drives]
    hidden = [s.input[i] for i, name in enumerate(names) if name in unknown]
    return any(ca.depends_on(together, symbol) for symbol in driving) and not any(
        ca.depends_on(together, symbol) for symbol in hidden
    )


def _uniquely_named(blocks: Sequence[Block]) -> list[Block]:
    """Return the blocks, those that predict a signal named after it where their part has several blocks."""
    names = [block.name for block in blocks]
    return [
        replace(block, name=block.target) if block.target and names.count(block.name) > 1 else block
        for block in blocks
    ]


def _what_to_measure(
    model: FlatModel, drives: Sequence[Measured], unknown: Collection[str], signals: Sequence[str]
) -> str:
    free = [body for body in model.bodies if not body.prescribed]
    led = {m.body.name for m in drives if m.body}
    commands = [f"'{n}'" for b in free if b.name in led for n in b.commands]
    motions = [f"'{body.motion}' or '{body.rate}'" for body in free if body.name not in led]
    wanted = [each for each in commands if unknown] + motions
    example = wanted[0] if wanted else "an angle and a force"
    both = (
        "; of a motor that was on its log is needed, zeros are right only where its winding was open"
        if example in commands
        else ""
    )
    return f"measure for instance {example}{both}; measured are: {', '.join(signals)}"


class _Cut(NamedTuple):
    """A model cut at measured efforts, with its expressions and their names."""

    model: FlatModel
    s: Symbols
    known: Mapping[str, Expression]


def _cut_open(model: FlatModel, used: _Sorted) -> tuple[_Cut, _Cut, list[Measured]]:
    """Return the model cut at all measured efforts, and at those that may act inside a block, with these.

    Where a measured effort acts on a body whose motion is not measured, and nothing else holds it, the body
    would integrate the errors of the measurement; there the model's own effort acts.
    """
    acting, s = used.efforts, model.symbols()
    states = [v.name for v in model.states]
    led = {m.body.name for m in used.drives if m.body}
    opened = fed = cut(model, [e.shown for e in acting], keep=True) if acting else model
    for body in model.bodies:
        if body.prescribed or body.name in led or not acting:
            continue
        motion, rate = states.index(body.motion), states.index(body.rate)
        inside = fed.symbols()
        closed = ca.depends_on(s.derivative[rate], s.state[motion])
        if closed and not ca.depends_on(inside.derivative[rate], inside.state[motion]):
            places = {v.name: inside.input[i] for i, v in enumerate(fed.inputs)}
            acting = [e for e in acting if not ca.depends_on(inside.derivative[rate], places[e.shown])]
            fed = cut(model, [e.shown for e in acting], keep=True) if acting else model
    first, second = (_Cut(each, s := each.symbols(), named(each, s)) for each in (opened, fed))
    return first, second, acting


class _Result(NamedTuple):
    """What a block gives out, and as what."""

    part: str
    variable: Variable
    value: Expression
    target: str | None
    moving: str | None


def _reading_block(fed: _Cut, target: Measured, given: Sequence[Measured]) -> Block:
    """Return the block that predicts a measured signal."""
    # Where an effort acts back on a body inside, the measured one acts; what is predicted does not.
    model, s, inputs = fed.model, fed.s, [v.name for v in fed.model.inputs]
    states = {v.name for v in model.states}
    own_state = target.shown in states and target.body is None
    given = [m for m in given if not (own_state and m.shown == target.shown)]
    led = {name for each in given for name in _given(each)}
    own = ca.vertcat(*[s.derivative[i] for i, v in enumerate(model.states) if v.name not in led])
    torn = {v.name for v in model.signals} & set(inputs)
    used = [m for m in given if m.shown not in torn or ca.depends_on(own, s.input[inputs.index(m.shown)])]
    signal = target.signal
    tearing = _Tearing(fed, used, signal)
    values = {**tearing.known, **{v.name: s.signal[i] for i, v in enumerate(model.signals)}}
    part = top_part(target.shown)
    return tearing.block(_Result(part, model.variable(signal), values[signal], signal, None))


def _given(measured: Measured) -> tuple[str, ...]:
    """Return the names of the variables that follow from a measured one."""
    if measured.body and measured.order == MOTION:
        return measured.shown, measured.body.rate
    return (measured.shown,)


def _balance_block(
    opened: _Cut, lead: Measured, accelerated: Measured | None, given: Sequence[Measured]
) -> Block:
    """Return the block that balances the efforts on a body: inertia times acceleration less all of them."""
    body = lead.body
    assert body is not None
    output = f"{body.name}.unbalanced"
    model, s = opened.model, opened.s
    tearing = _Tearing(opened, given, output)
    inertia = tearing.known[str(body.inertia)]
    efforts = inertia * s.derivative[[v.name for v in model.states].index(body.rate)]
    seen = tearing.inferred(accelerated, 0) if accelerated else tearing.inferred(lead, 2 - lead.order)
    balance = inertia * seen - efforts
    variable = Variable(output, body.domain.effort_unit, f"sum of all efforts on {body.name}")
    moving = lead.signal if lead.order == RATE else f"{lead.signal}.rate"
    return tearing.block(_Result(body.name, variable, balance, None, moving), body)


class _Tearing:
    """A model in which the measured variables are replaced by what their readings say of them."""

    def __init__(self, at: _Cut, given: Sequence[Measured], output: str) -> None:
        self._model, self._s, self.known = at
        self._given, self._output = given, output
        self._drives: dict[str, Drive] = {}
        self._inputs: dict[str, tuple[Variable, Expression]] = {}
        self._replaced = dict(self._replacements())

    def _reading(self, measured: Measured, order: int) -> Expression:
        """Return the symbol of a reading or of one of its derivatives."""
        signal = measured.reading.signal
        # The same reading may be predicted and drive a body inside.
        label = signal + ("", ".rate", ".acceleration")[order]
        label += ".measured" if label == self._output else ""
        if label not in self._inputs:
            self._drives[label] = Drive(signal, order, measured.reading.delays, measured.reading.stretches)
            self._inputs[label] = Variable(label, "", f"measured {signal}"), ca.SX.sym(label)
        return self._inputs[label][1]

    def inferred(self, measured: Measured, order: int) -> Expression:
        """Return what the sensors must have seen, or its derivative of that order."""
        seen = measured.reading.inferred(self._reading(measured, 0), self.known)
        value = behind_ratio(measured, seen, self.known)
        if order == 0:
            return value
        # A reading is a static function of what it reads, so rates follow by its slope, which may change.
        slope = ca.jacobian(value, self._reading(measured, 0))
        bend = ca.simplify(ca.jacobian(slope, self._reading(measured, 0)))
        derived = slope * self._reading(measured, order)
        return derived if order < 2 or bend.is_zero() else derived + bend * self._reading(measured, 1) ** 2

    def _replacements(self) -> Iterator[tuple[str, Expression]]:
        """Yield the variables of the model that follow from readings, with what they follow as."""
        model, measured = self._model, {m.shown for m in self._given}
        variables = {v.name for v in model.states + model.inputs}
        for each in self._given:
            yield each.shown, self.inferred(each, 0)
            if each.body and each.order == MOTION and each.body.rate in variables - measured:
                yield each.body.rate, self.inferred(each, 1)

    def block(self, result: _Result, body: MovingBody | None = None) -> Block:
        """Return the block of a result."""
        model, s = self._model, self._s
        kept = [i for i, v in enumerate(model.states) if v.name not in self._replaced]
        # Where the model is cut, a signal and an input have one name: what is not fed by a reading is unused.
        given = {*self._replaced, *(v.name for v in model.signals)}
        resting = [i for i, v in enumerate(model.inputs) if v.name not in given]
        # Signals with a stated range stay, so that a prediction can say where it is left.
        bounded = [i for i, v in enumerate(model.signals) if v.bounded]
        derivative, value, signal = self._in_readings(
            [_column(s.derivative, kept), result.value, _column(s.signal, bounded)]
        )
        value, per_drive, cold = self._scaled(value, derivative, kept, body)
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
            effort_per_drive=per_drive,
            cold=tuple(model.states[kept[i]].name for i in cold),
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

    def _scaled(
        self, value: Expression, derivative: Expression, kept: Sequence[int], body: MovingBody | None
    ) -> tuple[Expression, float, list[int]]:
        """Return a balance in the scale of what was measured, the effort per unit, and what grows warm."""
        if body is None:
            return value, 1.0, []
        model, s = self._model, self._s
        inputs = {v.name for v in model.inputs}
        own = [m for m in self._given if m.shown in inputs and top_part(m.shown) in (body.name, *body.geared)]
        commands = [m for m in own if m.shown not in body.goals]
        # What a command has become, such as a current in a winding, before a load from outside: that may
        # have been zero all the time, and then a balance in its scale could be made small.
        became = {v.name for v in model.signals}
        first = sorted(commands, key=lambda m: (m.shown not in body.commands, m.shown not in became))
        readings = [symbol for _, symbol in self._inputs.values()]
        efforts = [self._reading(m, 0) for m in self._given if not m.body and m.shown in inputs]
        terms = BalanceTerms(
            value,
            derivative,
            _column(s.state, kept),
            ca.vertcat(*readings),
            s.parameter,
            model.start(model.parameters),
        )
        drives = [self._reading(m, 0) for m in first]
        inertia = self.known[str(body.inertia)]
        balance, per_drive = scaled_balance(terms, drives=drives, efforts=efforts, inertia=inertia)
        return balance, per_drive, _warmed(terms, drives)


def _column(rows: Expression, places: Sequence[int]) -> Expression:
    return ca.SX(ca.vertcat(ca.SX(0, 1), *[rows[i] for i in places]))
