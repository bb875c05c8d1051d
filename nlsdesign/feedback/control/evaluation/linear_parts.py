"""Linearised plant and blocks of a sampled loop at many angles at once, without the counts of the sensors.

Shapes begin with the number of angles n: the matrices of angle k are those at index k.

The slope of a staircase is zero or infinite everywhere, so every rounding to whole numbers is left out first.
The instructions of the equations are read one by one and written again with floor(v/q + 1/2) = v/q where q is
the count of an encoder of the model; other uses of floor, such as the interval of a spline, stay.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace

import casadi as ca
import numpy as np
import scipy

from ....foundation.arrays import Array
from ....foundation.errors import ValueRangeError
from ....foundation.symbolic import remembered
from ....model import FlatModel, Table
from ....model.graph import applied, as_results, fold, read_graph
from ....model.roles import measured_motion
from ....model.transform import named
from ....simulation.buffered import Buffered
from ...analysis.rest import evaluate_rows, rate_state, rest_states

SLIDING = 1.0
"""Speed in rad/s or m/s at which the slopes of a moving plant are taken.

It lies far above the creep speed of smooth dry friction, which is constant there and adds no slope. At speed
zero the plant is stuck: dry friction acts as a dashpot, its limit over its creep speed.
"""
_PARAMETER = 3
_FOLLOWS: dict[tuple[object, ...], str] = {
    (ca.OP_DIV, "", "count"): "ratio",
    (ca.OP_ADD, "ratio", ""): "shifted",
    (ca.OP_ADD, "", "ratio"): "shifted",
}


@remembered(64)
def with_fine_counts(model: FlatModel) -> FlatModel:
    """Return a copy of a model in which no reading is rounded.

    Parameters
    ----------
    model
        Continuous or discrete.
    """
    quanta = {f"{sensor}.quantum" for reading in model.readings for sensor in reading.sensors}
    places = frozenset(i for i, v in enumerate(model.parameters) if v.name in quanta)
    return replace(model, equations=_fine(model.equations, places)) if places else model


@remembered(16)
def _fine(function: ca.Function, places: frozenset[int]) -> ca.Function:
    """Return equations that do not round by the parameters at these places; the same for drawn numbers."""
    arguments = [ca.SX.sym(function.name_in(i), function.sparsity_in(i)) for i in range(function.n_in())]
    values = fold(
        read_graph(function),
        lambda i, k: _Counted(arguments[i].nz[k], "count" if i == _PARAMETER and k in places else ""),
        lambda value: _Counted(ca.SX(value)),
        combined=_without_rounding,
    )
    results = as_results(function, {place: each.value for place, each in values.items()})
    names = ([function.name_in(i) for i in range(function.n_in())],
             [function.name_out(i) for i in range(function.n_out())])  # fmt: skip
    return ca.Function(function.name(), arguments, results, *names)


@dataclass(frozen=True)
class _Counted:
    """An expression, and whether it is a count, a ratio to one, or such a ratio shifted by half a count."""

    value: ca.SX
    kind: str = ""
    ratio: ca.SX | None = None


def _without_rounding(operation: int, operands: Sequence[_Counted]) -> _Counted:
    """Return an operation as it is, but for the floor of a shifted ratio, which is the ratio."""
    kinds = [each.kind for each in operands]
    if operation == ca.OP_FLOOR and operands[0].ratio is not None:
        return _Counted(operands[0].ratio)
    kind = _FOLLOWS.get((operation, *kinds), "")
    ratio = operands[kinds.index("ratio")].value if kind == "shifted" else None
    return _Counted(applied(operation, [each.value for each in operands]), kind, ratio)


@dataclass(frozen=True, eq=False)
class LinearPlant:
    """A plant linearised at many angles: ẋ = A x + B u, signals = C x + D u."""

    # states, inputs, signals: names; the driven input comes first
    states: tuple[str, ...]
    inputs: tuple[str, ...]
    signals: tuple[str, ...]
    # a, b, c, d: shapes (n, states, states), (n, states, inputs), (n, signals, states), (n, signals, inputs)
    a: Array
    b: Array
    c: Array
    d: Array
    values: Array  # of the signals, shape (n, signals)
    drive: Array  # value of the driven input that holds the plant, shape (n,)

    def sampled(self, step: float) -> tuple[Array, Array, Array, Array]:
        """Return exact matrices over one sample.

        The first input is held, all others run linearly from sample to sample.
        """
        n, states, inputs = self.b.shape
        others = inputs - 1
        size = states + inputs + others
        whole = np.zeros((n, size, size))
        whole[:, :states, :states] = step * self.a
        whole[:, :states, states : states + inputs] = step * self.b
        whole[:, states + 1 : states + inputs, states + inputs :] = np.eye(others)
        power = scipy.linalg.expm(whole)
        top = power[:, :states]
        slope = top[:, :, states + inputs :]
        constant = top[:, :, states + 1 : states + inputs]
        return top[:, :, :states], top[:, :, states : states + 1], constant - slope, slope


@remembered(32)
def linear_plant(
    plant: FlatModel, angles: tuple[float, ...], *, driven: str, signals: tuple[str, ...], speed: float
) -> LinearPlant:
    """Linearise a plant at rest at many angles of its driven body.

    ``plant``: continuous; prescribed motions stay at their start values. ``speed``: of the driven body, at
    which the slopes are taken.
    """
    motion = measured_motion(plant)
    names = [v.name for v in plant.states]
    rate = names.index(rate_state(plant, motion))
    s = plant.symbols()
    order = [driven, *(v.name for v in plant.inputs if v.name != driven)]
    places = [[v.name for v in plant.inputs].index(name) for name in order]
    known = named(plant, s)
    shown = ca.vertcat(*[known[name] for name in signals]) if signals else ca.SX(0, 1)
    u = ca.vertcat(*[s.input[i] for i in places])
    function = ca.Function(
        "plant", [s.time, s.state, s.input, s.parameter],
        [ca.densify(e) for e in (
            ca.jacobian(s.derivative, s.state), _by(s.derivative, s.input, places),
            ca.jacobian(shown, s.state), _by(shown, s.input, places), shown, s.derivative[rate], u[0],
        )],
    )  # fmt: skip
    rest = rest_states(plant, np.asarray(angles), unmoved=True)
    p, start = plant.start(plant.parameters), plant.start(plant.inputs)
    drive = _holding(function, rest, (start, p), places[0])
    inputs = np.tile(start, (len(angles), 1))
    inputs[:, places[0]] = drive
    moving = rest.copy()
    moving[:, rate] = speed
    at_rest = evaluate_rows(function, rest, inputs, p)[4]
    a, b, c, d = evaluate_rows(function, moving, inputs, p)[:4]
    n, states, count = len(angles), len(names), len(order)
    matrices = (
        a.reshape(n, states, states), b.reshape(n, states, count),
        c.reshape(n, len(signals), states), d.reshape(n, len(signals), count),
    )  # fmt: skip
    if not all(np.all(np.isfinite(matrix)) for matrix in matrices):
        raise ValueRangeError(
            f"linearisation of {plant.name}", "a slope is not finite",
            next_step="take the smooth form of the laws: smoothed(assembly)",
        )  # fmt: skip
    return LinearPlant(tuple(names), tuple(order), signals, *matrices, at_rest, drive)


def _by(expression: ca.SX, inputs: ca.SX, places: list[int]) -> ca.SX:
    return ca.jacobian(expression, inputs)[:, places]


def _holding(function: ca.Function, rest: Array, fixed: tuple[Array, Array], place: int) -> Array:
    """Return the driven input at which the driven body is not accelerated, shape (n,)."""
    start, p = fixed
    inputs = np.tile(start, (len(rest), 1))
    accelerations = []
    for value in (0.0, 1e-3):
        inputs[:, place] = value
        accelerations.append(evaluate_rows(function, rest, inputs, p)[5][:, 0])
    slope = (accelerations[1] - accelerations[0]) / 1e-3
    return -accelerations[0] / slope


@dataclass(frozen=True, eq=False)
class BlockPoint:
    """A discrete block evaluated and linearised at many points."""

    # following, output: shapes (n, states) and (n, outputs)
    following: Array
    output: Array
    # a, b, c, d: slopes of both over state and input, tables included
    a: Array
    b: Array
    c: Array
    d: Array


def block_at(model: FlatModel, state: Array, inputs: Array, *, frozen_tables: bool) -> BlockPoint:
    """Return values and slopes of a discrete block with its tables at many points.

    ``state``, ``inputs``: shapes (n, states) and (n, inputs). ``frozen_tables``: whether tables are held at
    the angle, as in the usual argument for scheduled gains; else they follow it, as in the controller.
    """
    names, n = [v.name for v in (*model.states, *model.inputs)], len(state)
    columns, into = [np.zeros((n, 0))], [np.zeros((n, 0, len(names)))]
    for table in model.tables:
        place = names.index(table.argument)
        at = np.concatenate([state, inputs], axis=1)[:, place]
        columns.append(np.array([table.look_up(float(v)) for v in at]))
        slope = np.zeros((n, table.values.shape[1], len(names)))
        slope[:, :, place] = 0.0 if frozen_tables else _table_slope(table, at)
        into.append(slope)
    w, dw = np.concatenate(columns, axis=1), np.concatenate(into, axis=1)
    p = model.start(model.parameters)
    following, output, fx, fu, fw, yx, yu, yw = _with_slopes(model.equations, n)(state, inputs, p, w)
    count = len(model.states)
    return BlockPoint(
        following[:, :, 0], output[:, :, 0],
        fx + fw @ dw[:, :, :count], fu + fw @ dw[:, :, count:],
        yx + yw @ dw[:, :, :count], yu + yw @ dw[:, :, count:],
    )  # fmt: skip


def _table_slope(table: Table, at: Array) -> Array:
    """Return the slopes of all columns around each argument, shape (n, columns); zero beyond the ends."""
    grid = table.grid
    left = np.clip(np.searchsorted(grid, at, side="right") - 1, 0, len(grid) - 2)
    cell = (grid[left + 1] - grid[left])[:, None]
    slope: Array = (table.values[left + 1] - table.values[left]) / cell
    return np.where(((at >= grid[0]) & (at <= grid[-1]))[:, None], slope, 0.0)


class _AtPoints:
    """A function at a fixed number of points, without conversion of arrays."""

    def __init__(self, function: ca.Function, count: int) -> None:
        self._given = [np.zeros((count, function.size1_in(i))) for i in range(function.n_in())]
        sizes = [(function.size2_out(i), function.size1_out(i)) for i in range(function.n_out())]
        self._shapes = [(count, *size) for size in sizes]
        self._buffered = Buffered(function.map(count), self._given)

    def __call__(self, *arrays: Array) -> list[Array]:
        """Return all outputs, shape (points, rows, columns) each, of inputs of shape (points, rows)."""
        for given, array in zip(self._given, arrays, strict=True):
            given[:] = array
        self._buffered.evaluate()
        results = zip(self._buffered.results, self._shapes, strict=True)
        # Columns lie one behind the other in CasADi.
        return [result.reshape(shape).swapaxes(1, 2).copy() for result, shape in results]


@remembered(16)
def _with_slopes(equations: ca.Function, count: int) -> _AtPoints:
    """Return the equations of a discrete block at rest of time, with slopes over state, input and table."""
    t, x, u, p, w = (ca.SX.sym(equations.name_in(i), equations.size1_in(i)) for i in range(5))
    results = equations.call([t, x, u, p, w])[:2]
    slopes = [ca.jacobian(e, v) for e in results for v in (x, u, w)]
    return _AtPoints(ca.Function("block", [x, u, p, w], [ca.densify(e) for e in (*results, *slopes)]), count)
