"""What a monitor computes from each sample: residuals of the blocks, and what each change would add to them.

The model is cut into the blocks of a diagnosis. Readings pass a low-pass filter, all the same one, which
gives their rates too; a motion runs straight between two samples, a current is held. A residual r is the sum
of efforts that the filtered readings leave, and the model no longer holds where r follows φ, what a small
change of a number would add: r = Σ δᵢ·φᵢ with δᵢ in units of the change that is to be noticed. What depends
on one motion alone is tabulated.
"""

from __future__ import annotations

from collections.abc import Collection, Mapping, Sequence
from dataclasses import replace
from typing import TYPE_CHECKING, NamedTuple

import casadi as ca
import numpy as np
import scipy

from ..bench.discrepancy.tearing import blocks_of
from ..bench.identification.equation_error.block import Block
from ..foundation.arrays import Array
from ..foundation.errors import ExportError
from ..foundation.symbolic import Expression
from ..model import FlatModel, Table, Variable
from ..model.flat import Symbols, stated_equations
from ..model.graph import applied, as_results, fold, read_graph
from ..model.readings import reading_of
from ..model.roles import contour_ends, declared_reading, motor_of, with_declared_reading
from ..model.transform import with_products

if TYPE_CHECKING:
    from ..export import WatchedBlock, WatchPlan

LAGS = 2.0
"""Time constant of each of the three stages of the filter, in samples."""
NOTICED = {
    "sliding_effort": ("friction", 0.1),
    "stiffness": ("stiffness", 0.05),
    "modulus": ("stiffness", 0.05),
    "viscosity": ("stiffness", 0.05),
    "damping": ("damping", 0.5),
    "inertia": ("inertia", 0.1),
    "mass": ("inertia", 0.1),
    "horizontal_torque": ("load", 0.05),
}
"""Last name of a number: the change that it takes part in, and the share that is to be noticed."""
NOTICED_SHARES = dict(NOTICED.values())
DELAY = 2e-3
"""Delay of the drive that is to be noticed, s."""
LEAST_SPEED = 5.0
"""Times the creep speed of the deck, or counts per stage of the filter, below which friction may stick."""
FINE, SAME = 4097, 1e-9
"""Rows from which those of a table are chosen; share of a column by which it may differ from a sum of
others."""
TABLE_ERROR = 2e-4
"""Largest error of a column by interpolation, as a share of its largest value."""


class Filtered(NamedTuple):
    """A reading as an input, the states of its filter, their next values, and what it shows."""

    variable: Variable
    stages: Expression  # (3,)
    previous: Expression
    following: Expression  # the stages one sample later
    values: tuple[Expression, ...]  # the filtered reading, its rate, its acceleration
    seen: Expression
    held: bool


def _filtered(model: FlatModel, reading: str, sample_time: float) -> Filtered:
    """Return three low-pass stages in a row, exact for a signal that is held or straight between samples.

    A reading is refused where the deck says that it cannot be.
    """
    measured = reading_of(model.readings, reading).measured
    held = measured in {v.name for v in model.inputs}
    text = f"{measured} that acts from this reading to the next" if held else f"{reading}, {measured}"
    variable = replace(model.variable(measured), name=reading, description=text, start=0.0)
    limit = _largest_drive(model, of_effort=False)
    variable = (
        replace(variable, minimum=-limit, maximum=limit)
        if held
        else with_declared_reading(variable, model, measured)
    )
    lag = LAGS * sample_time
    stages, previous, seen = ca.SX.sym(f"{reading}.stage", 3), ca.SX.sym("previous"), ca.SX.sym(reading)
    chain = np.diag([-1.0 / lag] * 3) + np.diag([1.0 / lag] * 2, -1)
    drive = np.array([1.0 / lag, 0.0, 0.0])
    # One matrix exponential of the stages, the value and the slope of what drives them.
    whole = np.zeros((5, 5))
    whole[:3, :3], whole[:3, 3], whole[3, 4] = chain, drive, 1.0
    over = ca.DM(scipy.linalg.expm(whole * sample_time)[:3])
    slope = ca.SX(0) if held else (seen - previous) / sample_time
    following = ca.mtimes(over, ca.vertcat(stages, previous, slope))
    first, second, third = ca.vertsplit(stages)
    values = (third, (second - third) / lag, (first - 2 * second + third) / lag**2)
    return Filtered(variable, stages, previous, following, values, seen, held)


class Told(NamedTuple):
    """What a block tells of filtered readings, its inner states, and its tables."""

    names: tuple[str, ...]  # of the changes
    rows: list[Expression]  # residual, what each change adds to it, speed, load
    state: Expression
    following: Expression  # the state one sample later
    slowest: float  # s, time constant of the inner states
    tables: tuple[Table, ...]
    columns: list[Expression]  # symbols of what the tables hold, in order


def _told(block: Block, filters: Mapping[str, Filtered], plant: FlatModel, sample_time: float) -> Told:
    model, s = block.model, block.model.symbols()
    numbers, count = ca.DM(model.start(model.parameters)), len(model.states)
    moving, late, load = ca.SX.sym("moving", s.input.numel()), ca.SX(0), ca.SX(0)
    state, slopes, added = _sensitivities(block, s, numbers)
    for i, v in enumerate(model.inputs):
        drive = block.drives.get(v.name)
        if drive and filters[drive.signal].held and ca.depends_on(s.output, s.input[i]):
            slope = ca.jacobian(s.output, s.input[i])
            late, load = late + slope * moving[i], load + slope * s.input[i]
    if late.is_zero():
        # Efforts that nothing measured drives are known up to a common factor: the spring is its measure.
        spring = added.pop(next((name for name in added if name.endswith(".stiffness")), ""), None)
        load = load if spring is None else spring[count]
    names, rows = list(added), [s.output, *[-jump[count] for jump in added.values()]]
    if not late.is_zero():
        names, rows = [*names, f"{block.name}.delay"], [*rows, DELAY * late]
    following, slowest = ca.SX(0, 1), 0.0
    if count:
        # Half a sample ahead along the motion, and the implicit half of the trapezoid along the states.
        ahead = slopes + 0.5 * sample_time * ca.mtimes(ca.jacobian(slopes, s.input), moving)
        inner = ca.jacobian(slopes, state)
        implicit = ca.SX.eye(state.numel()) - 0.5 * sample_time * inner
        following = state + sample_time * ca.solve(implicit, ahead)
        at = ca.Function("at", [state, s.input, s.parameter], [inner])(0, model.start(model.inputs), numbers)
        slowest = 1.0 / max(float(np.min(np.abs(np.linalg.eigvals(at.full())))), 1e-3)
    speed = s.input[[v.name for v in model.inputs].index(str(block.moving))]
    results = ca.substitute([ca.vertcat(*rows, speed, load), following], [s.parameter], [ca.SX(numbers)])
    told = ca.Function("told", [state, s.input, moving], results)
    (shown, following), tables, columns = _Tabulation(told, state, block, filters, plant).results()
    return Told(tuple(names), ca.vertsplit(shown), state, following, slowest, tables, columns)


def _sensitivities(
    block: Block, s: Symbols, numbers: ca.DM
) -> tuple[Expression, Expression, dict[str, Expression]]:
    """Return the states with what each change does to them, their slopes, and what it does to all rows."""
    count = len(block.model.states)
    whole = ca.vertcat(*ca.vertsplit(ca.densify(s.derivative))[:count], s.output)
    everything = ca.densify(ca.jacobian(ca.vertcat(s.derivative, s.output), s.parameter))
    steps: dict[str, ca.SX] = {}
    for i, v in enumerate(block.model.parameters):
        last = v.name.partition("[")[0].rpartition(".")[2]
        if last in NOTICED and not everything[:, i].is_zero():
            kind, share = NOTICED[last]
            name = f"{v.name.partition('.')[0]}.{kind}"
            steps.setdefault(name, ca.SX.zeros(numbers.numel()))[i] = share * numbers[i]
    states, slopes, added = [s.state], [whole[:count]], {}
    for name, step in steps.items():
        added[name] = ca.densify(ca.jtimes(whole, s.parameter, step))
        # A slope is looked at where it is evaluated: what cancels is not zero as an expression.
        slope = ca.substitute(added[name][:count], s.parameter, ca.SX(numbers))
        at, draw = ca.Function("at", [s.state, s.input], [slope]), np.random.default_rng(1)
        sizes = [
            np.abs(at(*(draw.normal(size=a.numel()) for a in (s.state, s.input))).full()).max(initial=0.0)
            for _ in range(8)
        ]
        if count and not max(sizes) < 1e-9:
            states.append(ca.SX.sym(f"{name}.inner", count))
            added[name] += ca.jtimes(whole, s.state, states[-1])
            slopes.append(added[name][:count])
    return ca.vertcat(*states), ca.vertcat(*slopes), added


class _Node(NamedTuple):
    """A value of a function, which inputs it follows from, and what it is in the middle of the drives."""

    expression: Expression
    inputs: frozenset[int]
    middle: float | None


_LOGICAL = {ca.OP_LT, ca.OP_LE, ca.OP_EQ, ca.OP_NE, ca.OP_NOT, ca.OP_AND, ca.OP_OR, ca.OP_IF_ELSE_ZERO}
_STATE, _MOVING = -1, -2
LEAST_WORK = 60
"""Operations that follow from one motion alone, from which on they are tabulated."""


class _Tabulation:
    """A function with drives within their limits, where what follows from one motion is looked up."""

    def __init__(
        self,
        function: ca.Function,
        state: Expression,
        block: Block,
        filters: Mapping[str, Filtered],
        plant: FlatModel,
    ) -> None:
        self.function, self.plant = function, plant
        value, rate, self.places, self.held = [], [], dict[int, str](), set[int]()
        for i, v in enumerate(block.model.inputs):
            drive = block.drives.get(v.name)
            seen = filters[drive.signal].values if drive else (ca.SX(v.start), ca.SX(0), ca.SX(0))
            order = drive.order if drive else 0
            value.append(seen[order])
            rate.append(seen[order + 1] if order < 2 else ca.SX(0))
            if drive is None or filters[drive.signal].held:
                self.held.add(i)
            elif order == 0:
                self.places[i] = drive.signal
        self.given = [state, ca.vertcat(*value), ca.vertcat(*rate)]
        self.columns: dict[int, dict[int, tuple[Expression, Expression]]] = {i: {} for i in self.places}
        self.symbols = {i: ca.SX.sym(f"place_{i}") for i in self.places}
        work = dict.fromkeys(self.places, 0)
        fold(read_graph(function), self._input, self._constant,
             combined=lambda operation, operands: self._combined(operation, operands, work))  # fmt: skip
        self.tabulated = {i for i, operations in work.items() if operations >= LEAST_WORK}
        for column in self.columns.values():
            column.clear()

    def _input(self, argument: int, element: int) -> _Node:
        if argument == 1:
            middle = 0.1 if element in self.held else None
            return _Node(self.symbols.get(element, self.given[1][element]), frozenset({element}), middle)
        return _Node(self.given[argument][element], frozenset({-1 - argument}), None)

    @staticmethod
    def _constant(value: float) -> _Node:
        return _Node(ca.SX(value), frozenset(), value)

    def _combined(
        self, operation: int, operands: Sequence[_Node], work: dict[int, int] | None = None
    ) -> _Node:
        """Return an operation on values; ``work`` counts operations by motion, all of them looked up."""
        inputs = frozenset().union(*[each.inputs for each in operands])
        middle, node = None, None
        if all(each.middle is not None for each in operands):
            middle = float(applied(operation, [ca.SX(each.middle or 0.0) for each in operands]))
            if inputs and operation in _LOGICAL and operation != ca.OP_IF_ELSE_ZERO:
                node = _Node(ca.SX(middle), frozenset(), middle)
            elif inputs and operation in (ca.OP_FMIN, ca.OP_FMAX):
                node = next(each for each in operands if each.middle == middle)
        if node is None:
            if len(inputs) > 1:
                wanted = self.tabulated if work is None else work
                operands = [self._looked_up(each, wanted) for each in operands]
            node = _Node(applied(operation, [each.expression for each in operands]), inputs, middle)
        if work and len(node.inputs) == 1 and (place := min(node.inputs)) in work:
            work[place] += 1
        return node

    def _looked_up(self, node: _Node, wanted: Collection[int]) -> _Node:
        """Return a column in place of what follows from one motion alone."""
        place = min(node.inputs, default=_STATE)
        if len(node.inputs) != 1 or place not in self.places:
            return node
        if place not in wanted or node.expression.is_symbolic():
            plain = ca.substitute(node.expression, self.symbols[place], self.given[1][place])
            return node._replace(expression=plain)
        rows = self.columns[place]
        key = node.expression.element_hash()
        if key not in rows:
            rows[key] = ca.SX.sym(f"w_{place}_{len(rows)}"), node.expression
        return node._replace(expression=rows[key][0])

    def results(self) -> tuple[list[Expression], tuple[Table, ...], list[Expression]]:
        """Return the results, with tables over motions and the symbols of their columns."""
        nodes = fold(read_graph(self.function), self._input, self._constant, combined=self._combined)
        read = {at: self._looked_up(node, self.tabulated).expression for at, node in nodes.items()}
        results = as_results(self.function, read)
        tables, symbols, every, combined = [], [], [], []
        for place, rows in self.columns.items():
            if not rows:
                continue
            signal = self.places[place]
            at = ca.Function("at", [self.symbols[place]], [ca.vertcat(*[e for _, e in rows.values()])])
            # As far as the contour of the cams, or the range of the sensor.
            limits = declared_reading(self.plant, reading_of(self.plant.readings, signal).measured).limits
            ends = [*contour_ends(self.plant).values()]
            reach = (-max(ends), max(ends)) if ends else limits[:2] if limits else None
            if reach is None:
                raise ExportError(
                    f"'{signal}'",
                    "has no declared range, over which the laws of the machine could be tabulated",
                    next_step="declare lowest_reading and highest_reading with the sensor",
                )
            fine = np.linspace(*reach, FINE)
            values = at.map(len(fine))(fine[None, :]).full().T
            basis, shares = _independent(values)
            columns = [ca.SX.sym(f"column_{place}_{i}") for i in basis]
            chosen = _breakpoints(values[:, basis])
            named = tuple(
                Variable(f"{signal}.column[{i + 1}]", "", "over the angle") for i in range(len(basis))
            )
            tables.append(
                Table.over(f"{signal}.stage[3]", fine[chosen], named, values[np.ix_(chosen, basis)])
            )
            symbols += columns
            every += [symbol for symbol, _ in rows.values()]
            terms = [*columns, ca.SX(1)]
            combined += [
                sum((float(s) * term for s, term in zip(row, terms, strict=True) if s), start=ca.SX(0))
                for row in shares
            ]
        if every:
            results = ca.substitute(results, [ca.vertcat(*every)], [ca.vertcat(*combined)])
        return results, tuple(tables), symbols


def _independent(values: Array) -> tuple[list[int], Array]:
    """Return columns that make up all others, and their shares in each: (columns, basis + 1)."""
    basis: list[int] = []
    ones, known = np.ones((len(values), 1)), []
    for i, column in enumerate(values.T):
        size = float(np.abs(column).max()) or 1.0
        for members in ([], *[[b] for b in basis], basis):
            terms = np.hstack([values[:, members], ones])
            scale = np.maximum(np.abs(terms).max(axis=0), 1e-30)
            shares = np.linalg.lstsq(terms / scale, column, rcond=None)[0] / scale
            if np.abs(terms @ shares - column).max() < SAME * size:
                shares[np.abs(shares) * scale < SAME * size] = 0.0
                known.append((members, shares))
                break
        else:
            basis = [*basis, i]
            known.append(([i], np.array([1.0, 0.0])))
    table = np.zeros((len(known), len(basis) + 1))
    for row, (members, shares) in zip(table, known, strict=True):
        row[[*(basis.index(m) for m in members), -1]] = shares
    return basis, table


def _breakpoints(values: Array) -> list[int]:
    """Return rows between which all columns are straight to `TABLE_ERROR` of their size."""
    sizes, last = np.maximum(np.abs(values).max(axis=0), 1e-30), len(values) - 1

    def holds(first: int, end: int) -> bool:
        inside = np.linspace(0.0, 1.0, end - first + 1)[:, None]
        error = np.abs(values[first] + inside * (values[end] - values[first]) - values[first : end + 1])
        return float((error.max(axis=0) / sizes).max()) <= TABLE_ERROR

    chosen = [0]
    while chosen[-1] < last:
        # The furthest end that a straight line reaches: doubled while it holds, then halved.
        first, reach, step = chosen[-1], 1, 1
        while step:
            end = min(first + reach + step, last)
            longer = end > first + reach and holds(first, end)
            reach, step = (end - first, 2 * step) if longer else (reach, step // 2)
        chosen.append(first + reach)
    return chosen


def watch_plan(model: FlatModel, sample_time: float = 1e-3) -> WatchPlan:
    """Return what a monitor of a machine computes.

    Parameters
    ----------
    model
        Smooth flat model of the machine, with the sensors that the observer reads.
    sample_time
        In s.

    Returns
    -------
    WatchPlan
        For :func:`~nlsdesign.export.export_watch`.

    Raises
    ------
    MeasurementError
        If what is measured leaves no balance of efforts.
    ExportError
        If a law must be tabulated over a motion without a range.
    """
    from ..export import WatchedBlock, WatchPlan  # here, as its libraries take time to load
    from ..export.c.watch_code import LOAD

    signals = [v.name for v in model.outputs]
    seen = {reading_of(model.readings, name).measured for name in signals}
    signals += [name for body in model.bodies for name in body.commands if name not in seen]
    blocks = [block for block in blocks_of(model, signals) if block.moving]
    names = dict.fromkeys(d.signal for block in blocks for d in block.drives.values())
    filters = {name: _filtered(model, name, sample_time) for name in names}
    told = [_told(block, filters, model, sample_time) for block in blocks]
    settling, watched = 4.0 * LAGS * sample_time, []
    for block, rows in zip(blocks, told, strict=True):
        settling = max(settling, 5.0 * rows.slowest)
        kinds = [name.rpartition(".")[2] for name in rows.names]
        noticed = tuple(DELAY if kind == "delay" else NOTICED_SHARES[kind] for kind in kinds)
        units = tuple("s" if kind == "delay" else "" for kind in kinds)
        creep = [v.start for v in block.model.parameters if v.name.endswith(".creep_speed")]
        moving = reading_of(model.readings, block.drives[str(block.moving)].signal).measured
        quantum = declared_reading(model, moving).quantum
        rubs = creep and "friction" in kinds
        least = max(LEAST_SPEED * max(creep), quantum / (LAGS * sample_time)) if rubs else 0.0
        share = 1.0 if "delay" in kinds else NOTICED_SHARES["stiffness"]
        load = LOAD * share * _largest_drive(model)
        watched.append(WatchedBlock(block.name, rows.names, noticed, units, least, load))
    lasts = {v.name: v.name.partition("[")[0].rpartition(".")[2] for v in model.parameters}
    known = [f"{n.partition('.')[0]}.{NOTICED[last][0]}" for n, last in lasts.items() if last in NOTICED]
    shown = {name for block in watched for name in block.changes}
    unseen = tuple(name for name in dict.fromkeys(known) if name not in shown)
    residuals = with_products(_residual_model(model, watched, told, filters, sample_time))
    return WatchPlan(residuals, tuple(watched), settling, unseen=unseen)


def _residual_model(
    model: FlatModel,
    blocks: Sequence[WatchedBlock],
    told: Sequence[Told],
    filters: Mapping[str, Filtered],
    sample_time: float,
) -> FlatModel:
    """Return what gives the residuals in each sample, as a sampled model."""
    inner = [t.state for t in told]
    state = ca.vertcat(*[ca.vertcat(f.stages, f.previous) for f in filters.values()], *inner)
    following = ca.vertcat(
        *[ca.vertcat(f.following, f.seen) for f in filters.values()], *[t.following for t in told]
    )
    readings = ca.vertcat(*[f.seen for f in filters.values()])
    table = ca.vertcat(ca.SX(0, 1), *[c for t in told for c in t.columns])
    states = [Variable(f"{n}.{part}", "", "of the filter") for n in filters
              for part in ("stage[1]", "stage[2]", "stage[3]", "previous")]  # fmt: skip
    states += [
        Variable(f"{block.name}.inner[{i + 1}]", "", "inner state")
        for block, rows in zip(blocks, inner, strict=True)
        for i in range(rows.numel())
    ]
    outputs = []
    for block in blocks:
        columns = [f"change[{i + 1}]" for i in range(len(block.changes))]
        texts = [*block.changes, "efforts that are left", "of the body", "of the drive or the spring"]
        outputs += [
            Variable(f"{block.name}.{n}", "", text)
            for n, text in zip([*columns, "residual", "rate", "load"], texts, strict=True)
        ]
    rows = [e for t in told for e in (*t.rows[1:-2], t.rows[0], *t.rows[-2:])]
    begun = ca.vertcat(
        *[f.seen for f in filters.values() for _ in range(4)], *[ca.SX.zeros(i.numel()) for i in inner]
    )
    arguments = [state, readings, ca.SX(0, 1), table]
    return FlatModel(
        name=f"{model.name}_residuals",
        description=f"Efforts that readings of {model.name} leave, and what changes add",
        states=tuple(states),
        inputs=tuple(f.variable for f in filters.values()),
        parameters=(),
        outputs=tuple(outputs),
        signals=(),
        sample_time=sample_time,
        tables=tuple(t for each in told for t in each.tables),
        equations=stated_equations(
            state, readings, derivative=following, output=ca.vertcat(*rows), table=table
        ),
        begin=ca.Function("begin", arguments, [begun, begun]),
        origin=model.origin,
    )


def _largest_drive(model: FlatModel, *, of_effort: bool = True) -> float:
    """Return the largest effort of the motor, or its largest command."""
    _, motor = motor_of(model)
    numbers = model.values
    gear = numbers[motor.gear_ratio] if motor.gear_ratio else 1.0
    return numbers[motor.current_limit] * (gear * numbers[motor.torque_constant] if of_effort else 1.0)
