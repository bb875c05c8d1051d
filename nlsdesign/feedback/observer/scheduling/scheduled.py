"""Designs an observer that is scheduled over a measured angle, as a discrete flat model with one table.

Whether its error is stable is told in two ways, which are kept apart. The error matrix
E(θ) = Φ(θ)(I − M(θ)C) is taken from the finished observer by automatic differentiation of its step, with its
entries as the table gives them, so it knows nothing of the design.

- Check: the spectral radius of E at angles ten times finer than the grid. It says that the observer is stable
  at every checked angle that stands still. For a moving angle it says nothing.
- Proof: where E is block triangular with constant stable blocks, see
  :class:`~nlsdesign.feedback.observer.scheduling.step.CascadeGain`. The table interpolates linearly between
  equal numbers, so the blocks are constant for all angles, not only the checked ones.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass, replace

import casadi as ca
import numpy as np

from ....foundation.arrays import Array
from ....foundation.errors import ArrangementError, ValueRangeError
from ....foundation.quantity import typeset_unit
from ....foundation.symbolic import Expression, remembered
from ....model import FlatModel, Variable
from ....model.flat import stated_equations
from ....model.roles import measured_motion, spring_torque
from ....model.transform import with_products
from .angle_form import Minimal, StateForm, plant_over
from .measured_angle import measured_angle, with_plausible_inputs
from .step import CascadeGain, FittedGain, GainRule, ObserverStep, speed_change
from .table import Compact, Draft, FineEntries, Grid, TableTorqueError
from .torque_grid import RESOLUTION, GridByTorqueError, TableTrial

MEMORY, ESTIMATE, INNOVATION, PREVIOUS = "memory", "estimate", "innovation", "previous"
"""What is added to a name of the plant for variables that the plant does not have."""


@dataclass(frozen=True, eq=False)
class ObserverDesign:
    """An observer and what went into it.

    Parameters
    ----------
    model
        The observer: discrete, scheduled over one table.
    step
        Its step as exact functions of the angle.
    compact
        Its table, and the error that the table makes.
    """

    model: FlatModel
    step: ObserverStep
    compact: Compact

    @property
    def table_error(self) -> dict[str, float]:
        """Largest error of each sum of the step by reading the table, as a share of its typical size.

        Measured at the grid points and three points between any two of them.
        """
        return dict(self.compact.error)

    @property
    def table_torque_error(self) -> TableTorqueError:
        """What the table does to the estimated torque, measured on motions over its range."""
        if self.compact.torque_error is not None:
            return self.compact.torque_error
        grid = self.compact.angles
        fine = FineEntries.of(self.step.entries, float(grid[0]), float(grid[-1]), RESOLUTION)

        def written(compact: Compact) -> ObserverDesign:
            model = replace(_Writer(self.step, compact).model(), bodies=self.model.bodies)
            return ObserverDesign(model, self.step, compact)

        return TableTrial(Draft(self.step.plant, written), fine).error(self.compact)

    def start(self, angle: float) -> dict[str, float]:
        """Return the start values of an observer that begins while the actuator rests at an angle.

        Parameters
        ----------
        angle
            In rad.
        """
        plant, at = self.step.plant, np.array([angle])
        matrices = self.step.matrices(at)
        memory = plant.rest(at)[0] - matrices["shift"][0, :, 0] - matrices["prior"][0, :, 0]
        values = {f"{n}.{MEMORY}": float(m) for n, m in zip(plant.names, memory, strict=True)}
        for i, name in enumerate(plant.measured):
            values[f"{name}.{PREVIOUS}"] = float(matrices["measured"][0, i, 0])
        return values

    def __str__(self) -> str:
        grid = self.compact.angles
        lines = [
            f"Observer of {self.step.plant.estimate.name} every {self.step.sample_time:g} s",
            f"  table: {len(grid)} angles from {grid[0]:.4g} to {grid[-1]:.4g} rad, "
            f"{len(self.compact.columns)} columns{self.compact.cost(self.step.plant.estimate.unit)}",
            f"  estimate is linear in the inner states to {self.step.plant.affine_error:.2g} of its size",
        ]
        lines += [
            f"  table error of {row}: {error:.2g}" for row, error in self.compact.error.items() if error
        ]
        return "\n".join(lines)


@remembered(16)
def design_observer_with_details(
    model: FlatModel,
    *,
    estimate: str | None = None,
    measured: str | None = None,
    sample_time: float = 1e-3,
    gain: GainRule | FittedGain | None = None,
    form: StateForm | None = None,
    grid: Grid | None = None,
) -> ObserverDesign:
    """Design a scheduled observer at the declared numbers, with its table error and start values.

    Parameters
    ----------
    model, estimate, measured, sample_time
        As for :func:`~nlsdesign.feedback.observer.design_observer`.
    gain
        Rule for the correction; :class:`~nlsdesign.feedback.observer.CascadeGain` by default.
    form
        Which states are carried; :class:`~nlsdesign.feedback.observer.Minimal` by default.
    grid
        Range and number of grid points; :func:`whole_contour` by default.

    Raises
    ------
    UnknownNameError
        If a name does not exist.
    ValueRangeError
        If the sample time is not between 0 and 1 s, the model is discrete, or the estimate is far from linear
        in the inner states.
    ArrangementError
        If what is measured is not an angle, or the equations cannot be scheduled over one.
    ConvergenceError
        If a gain cannot be found, or the table does not keep its error bound.
    """
    check_sampling(model, sample_time)
    estimate, measured = spring_torque(model, estimate), measured_motion(model, measured)
    if model.variable(measured).unit != "rad":
        raise ArrangementError(
            f"measured: '{measured}'",
            f"is in {typeset_unit(model.variable(measured).unit)}; an observer is scheduled over an angle",
            next_step="export the plant alone, or observe a machine whose motor turns",
        )
    rule, over = gain or CascadeGain(), grid or whole_contour(model)
    reference = np.linspace(over.lower, over.upper, 65)
    plant = plant_over(form or Minimal(), model, estimate, measured, (over.lower, over.upper))
    fitted = rule.fitted(plant, sample_time, reference) if isinstance(rule, FittedGain) else rule
    step = ObserverStep(plant, fitted, sample_time, reference)
    observed = tuple(body for body in model.bodies if body.motion == measured)

    def written(compact: Compact) -> ObserverDesign:
        flat = replace(_Writer(step, compact).model(), bodies=observed, origin=model.origin)
        return ObserverDesign(with_plausible_inputs(flat, model, plant, compact.angles), step, compact)

    design = written(over.compact(step.entries, Draft(plant, written)))
    return replace(design, model=with_products(design.model).with_values(design.start(0.0)))


def check_sampling(model: FlatModel, sample_time: float) -> None:
    """Refuse a model or a sample time that no observer can be designed for."""
    if not 0.0 < sample_time < 1.0:
        raise ValueRangeError(f"sample_time {sample_time:g} s", "must lie between 0 and 1 s")
    if model.sample_time is not None:
        raise ValueRangeError(f"model '{model.name}'", "an observer is designed on a continuous model")


def whole_contour(model: FlatModel) -> GridByTorqueError:
    """Return a grid that reaches to the ends of the cam's contour, or ±90° where there is none.

    ``model``: its cams say where a contour ends; beyond it there is no lever arm.
    """
    cams = [cam for spring in model.springs for cam in spring.cams]
    end = min((model.values[cam.last_angle] for cam in cams if cam.last_angle), default=math.pi / 2.0)
    return GridByTorqueError(-end, end)


class _Writer:
    """Writes the step of an observer over an angle with the entries read from its table."""

    def __init__(self, step: ObserverStep, compact: Compact) -> None:
        self.step, self.compact, self.plant = step, compact, step.plant
        plant = self.plant
        self.w = ca.SX.sym("w", len(compact.columns))
        self.n = len(plant.states)
        self.angle_place, self.speed_place = plant.moving
        self.filters = math.isfinite(plant.rate_bandwidth)
        self.memory = [ca.SX.sym(f"{name}.{MEMORY}") for name in plant.names]
        self.previous = [ca.SX.sym(f"{name}.{PREVIOUS}") for name in plant.measured]
        self.filtered = [ca.SX.sym(f"{name}.rate") for name in plant.measured] if self.filters else []
        self.angle = ca.SX.sym(plant.states[self.angle_place].name)
        self.u = [ca.SX.sym(v.name) for v in plant.inputs]

    @property
    def _given(self) -> list[Expression]:
        """States, inputs, no parameters, and numbers of the table."""
        states = _column([*self.memory, *self.previous, *self.filtered])
        return [states, _column([self.angle, *self.u]), ca.SX(0, 1), self.w]

    def _outputs(self) -> tuple[Variable, ...]:
        """Return what is wanted, the estimates of the states, and the innovation of each that is measured."""
        plant, v = self.plant, self.plant.estimate
        size = float(np.max(np.abs(self.step.scales["estimate"])))
        outputs = [Variable(v.name, v.unit, f"estimate of {v.name}", nominal=size)]
        for v in plant.states:
            name = f"{v.name}.{ESTIMATE}" if v.name == plant.angle else v.name
            outputs.append(Variable(name, v.unit, f"estimate of {v.name}"))
        for name in (plant.angle, *plant.measured):
            unit = plant.states[plant.names.index(name)].unit
            outputs.append(Variable(f"{name}.{INNOVATION}", unit, f"measured minus expected {name}"))
        return tuple(outputs)

    def read(self, kind: str, i: int, j: int = 0) -> Expression:
        """Return one entry; zero entries vanish from the expressions."""
        place = self.compact.places[f"{kind}[{i}][{j}]"]
        return ca.SX(place.factor) if place.column is None else place.factor * self.w[place.column]

    def row(self, kind: str, i: int, of: Sequence[Expression]) -> Expression:
        """Return one sum."""
        return sum((self.read(kind, i, j) * x for j, x in enumerate(of)), start=ca.SX(0))

    def model(self) -> FlatModel:
        """Return the observer."""
        plant, n = self.plant, self.n
        measured = [self.angle, *(self.read("measured", i) for i in range(len(plant.measured)))]
        prior = self._prior()
        seen = [int(np.argmax(row)) for row in plant.output_matrix]
        innovation = [y - prior[i] for y, i in zip(measured, seen, strict=True)]
        state = [prior[i] + self.row("correction", i, innovation) for i in range(n)]
        rates = self._rates(measured[1:])
        driven = ca.SX(plant.driven(ca.vertcat(*self.u)))
        pushed = [*[driven[i] for i in range(driven.numel())], *(rates or [ca.SX(0)])]
        following = [self.row("next", i, [*state, ca.SX(1), *pushed]) for i in range(n)]
        estimate = self.row("estimate", 0, [*state, ca.SX(1)])
        shown = [state[i] + self.read("shift", i) for i in range(n)]
        states, inputs, _, w = self._given
        equations = stated_equations(
            states, inputs, table=w,
            derivative=_column([*following, *measured[1:], *(rates if self.filtered else [])]),
            output=_column([estimate, *shown, *innovation]),
        )  # fmt: skip
        grid, table = self.compact.angles, self.compact.table(plant.angle)
        words = f"table of {len(grid)} angles from {grid[0]:.4g} to {grid[-1]:.4g} rad"
        # Of the angle the model predicts what is expected.
        expected = [prior[self.angle_place], *self.u]
        return FlatModel(
            name=f"{plant.name}_observer",
            description=f"observer of {plant.estimate.name}, {self.step.gain}, {words}",
            states=self._states(),
            inputs=(measured_angle(plant, grid), *plant.inputs),
            parameters=(),
            outputs=self._outputs(),
            signals=(),
            equations=equations,
            sample_time=self.step.sample_time,
            tables=() if table is None else (table,),  # none where every entry is a literal
            begin=self._begin(measured[1:], prior),
            expected=ca.Function("expected", self._given, [_column(expected)]),
        )

    def _begin(self, measured: Sequence[Expression], prior: Sequence[Expression]) -> ca.Function:
        """Return the states of a machine that rests at the first reading, and those after a gap."""
        plant, count = self.plant, self.n
        given = {self.angle_place: self.angle, self.speed_place: ca.SX(0)}
        given |= {plant.names.index(name): y for name, y in zip(plant.measured, measured, strict=True)}
        inner = [i for i in range(count) if i not in given]
        known = [given.get(i, ca.SX(0)) for i in range(count)]
        offset = [self.row("next", i, [*known, ca.SX(1)]) + self.read("prior", i) for i in inner]
        carried = [[self.read("next", i, j) for j in inner] for i in inner]
        for i, value in zip(inner, _at_rest(carried, offset), strict=True):
            known[i] = value
        begun = [known[i] - self.read("prior", i) for i in range(count)]
        resumed = list(self.memory)
        resumed[self.angle_place] += self.angle - prior[self.angle_place]
        rates = [ca.SX(0)] * (len(self.previous) + len(self.filtered) - len(measured))
        results = [_column([*begun, *measured, *rates]), _column([*resumed, *measured, *rates])]
        return ca.Function("begin", self._given, results)

    def _rates(self, measured: Sequence[Expression]) -> list[Expression]:
        time = self.step.sample_time
        raw = [(now - before) / time for now, before in zip(measured, self.previous, strict=True)]
        if not self.filtered:
            return raw
        keep = math.exp(-2.0 * math.pi * self.plant.rate_bandwidth * time)
        return [keep * old + (1.0 - keep) * new for old, new in zip(self.filtered, raw, strict=True)]

    def _prior(self) -> list[Expression]:
        """Return the states expected at a sample, after friction, half of which moves the angle too."""
        after = [self.memory[i] + self.read("prior", i) for i in range(self.n)]
        if self.plant.friction is None:
            return after
        time, speed = self.step.sample_time, ca.SX.sym("speed")
        change = speed_change(ca.SX(self.plant.friction(speed)), speed, time)
        change = ca.substitute(change, speed, after[self.speed_place])
        after[self.angle_place] += time / 2.0 * change
        after[self.speed_place] += change
        return after

    def _states(self) -> tuple[Variable, ...]:
        """Return what each estimate carries on from sample to sample, and what the rates need."""
        plant = self.plant
        states = [
            Variable(
                f"{v.name}.{MEMORY}", v.unit, f"what the estimate of {v.name} carries on", nominal=float(size)
            )
            for v, size in zip(plant.states, plant.sizes, strict=True)
        ]
        for name in plant.measured:
            v = plant.states[plant.names.index(name)]
            states.append(Variable(f"{name}.{PREVIOUS}", v.unit, f"{name} one sample ago"))
        for name in plant.measured if self.filters else ():
            v = plant.states[plant.names.index(name)]
            states.append(Variable(f"{name}.rate", f"{v.unit}/s", f"filtered rate of {name}"))
        return tuple(states)


def _at_rest(carried: Sequence[Sequence[Expression]], offset: Sequence[Expression]) -> list[Expression]:
    """Return the inner states that stay as they are: x = A·x + g.

    A state that never decays, such as a permanent set, has no rest of its own and begins at zero.

    ``carried``: A, shape (n, n).
    """
    count = len(offset)
    shares = [carried[i][i] for i in range(count)]
    # What is kept over a sample is below one, or varies with the angle.
    moving = [i for i, kept in enumerate(shares) if not kept.is_constant() or float(kept) < 1.0 - 1e-12]
    result = [ca.SX(0)] * count
    if not moving:
        return result
    matrix = ca.SX.eye(len(moving)) - ca.SX(
        ca.vertcat(*[ca.horzcat(*[carried[i][j] for j in moving]) for i in moving])
    )
    rest = ca.solve(matrix, _column([offset[i] for i in moving]))
    for place, i in enumerate(moving):
        result[i] = rest[place]
    return result


def _column(items: Sequence[Expression]) -> Expression:
    return ca.SX(ca.densify(ca.vertcat(*items))) if items else ca.SX(0, 1)


@dataclass(frozen=True, eq=False)
class ErrorStability:
    """What is known of the stability of the estimation error."""

    angles: Array  # checked angles in rad, shape (n,)
    radius: Array  # spectral radius of the error matrix at each
    proved: bool  # whether the whole error is proved to vanish exponentially for every motion
    proved_inner: bool  # whether that is proved of the inner states, on which the estimate of the force rests

    @property
    def worst(self) -> tuple[float, float]:
        """Angle in rad and radius where the error decays most slowly."""
        at = int(np.argmax(self.radius))
        return float(self.angles[at]), float(self.radius[at])

    def __str__(self) -> str:
        angle, radius = self.worst
        if self.proved:
            proof = "proved: block triangular with constant stable blocks, for every motion of the angle"
        elif self.proved_inner:
            proof = "proved for the inner states only; angle and speed are checked at frozen angles"
        else:
            proof = "not proved; checked at frozen angles only"
        return (
            f"error of the observer: {proof}\n"
            f"  largest spectral radius {radius:.6f} at {angle:.4g} rad, {len(self.angles)} angles checked"
        )


def error_matrices(observer: FlatModel, angles: Array, speed: float = 0.0) -> Array:
    """Return the error matrix of an observer at many angles, shape (N, n, n)."""
    (inner, moving), (body,) = _memory(observer), observer.bodies
    memory = [*inner, *moving]
    s = observer.symbols()
    known = {v.name: s.output[i] for i, v in enumerate(observer.outputs)}
    shown = ca.vertcat(known[f"{body.motion}.{INNOVATION}"], known[body.rate])
    error = ca.densify(ca.jacobian(s.derivative, s.state)[memory, memory])
    function = ca.Function("error", [s.state, s.input, s.table], [ca.vec(error.T), ca.densify(shown)])
    count = len(angles)
    state = np.tile(observer.start(observer.states)[:, None], (1, count))
    given = np.tile(observer.start(observer.inputs)[:, None], (1, count))
    given[0] = angles
    table = np.array([observer.look_up(list(state[:, i]), list(given[:, i])) for i in range(count)]).T
    many = function.map(count)
    for _ in range(2):
        # Without innovation the estimated speed is its memory and something known.
        at = np.array(many(state, given, table)[1])
        state[moving] += [at[0], speed - at[1]]
    entries = np.array(many(state, given, table)[0])
    return entries.T.reshape(len(angles), len(memory), len(memory))


def _memory(observer: FlatModel) -> tuple[list[int], list[int]]:
    """Return the places of what goes from sample to sample: of the inner states, and of angle and speed."""
    (body,) = observer.bodies
    places = {v.name: i for i, v in enumerate(observer.states)}
    moving = [places[f"{name}.{MEMORY}"] for name in (body.motion, body.rate)]
    memory = {places[name] for v in observer.outputs if (name := f"{v.name}.{MEMORY}") in places}
    return sorted(memory - set(moving)), moving


def check_stability(
    observer: FlatModel, *, finer: int = 10, speeds: tuple[float, ...] = (0.0, 1.0)
) -> ErrorStability:
    """Check, and where the structure allows prove, that the estimation error vanishes."""
    tables, bodies = observer.tables, observer.bodies
    if len(tables) != 1 or [body.motion for body in bodies] != [tables[0].argument]:
        raise ValueRangeError(
            f"model '{observer.name}'", "is not an observer with one table over the angle of a body"
        )
    grid = tables[0].grid
    shares = np.arange(finer) / finer
    angles = np.append((grid[:-1, None] + shares * np.diff(grid)[:, None]).ravel(), grid[-1])
    matrices = np.array([error_matrices(observer, angles, speed) for speed in speeds])
    radius = np.max(np.abs(np.linalg.eigvals(matrices)), axis=(0, 2))
    every = matrices.reshape(-1, *matrices.shape[2:])
    count = len(_memory(observer)[0])
    own, cross, moving = every[:, :count, :count], every[:, :count, count:], every[:, count:, count:]
    first = not np.any(cross) and _same_and_stable(own)
    proved, inner = first and _same_and_stable(moving), first
    return ErrorStability(angles, radius, proved, inner)


def _same_and_stable(blocks: Array) -> bool:
    if blocks.shape[1] == 0:
        return True
    return bool(np.all(blocks == blocks[0]) and np.max(np.abs(np.linalg.eigvals(blocks[0]))) < 1.0)
