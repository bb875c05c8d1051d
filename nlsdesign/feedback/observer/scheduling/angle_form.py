"""The actuator as the observer sees it: matrices that depend on the measured angle, and nothing else.

The angle is measured. So every term of the equations that depends on the angle is known, and what is left is
linear in the other states: ẋ = A(θ)x + g(θ) + b(θ)·δ̇ + E·d(u) + friction(ω), with no column of A for the
angle. A model is brought into that form, and checked. Without friction the error of an observer then obeys
e⁺ = Φ(θ)(I − M(θ)C)e exactly, for every motion.

An observer carries it in one of two forms, that of the paper or the minimal one. In the latter, inner states
that follow the speed, such as a relaxing force with dF_M = a·k·h(θ)·dθ, are carried as ζ = z − Q(θ) with
Q = ∫∂ż/∂ω dθ: ζ is driven by the measured angle alone and never by an estimated speed.
"""

from __future__ import annotations

import copy
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, field
from typing import NamedTuple, Protocol

import casadi as ca
import numpy as np
import scipy

from ....foundation.arrays import Array
from ....foundation.errors import ArrangementError, ValueRangeError, unknown_name
from ....foundation.symbolic import remembered
from ....model import FlatModel, Variable
from ....model.paper_form import GEOMETRIC, PaperFormNames, paper_form
from ....model.transform import with_outputs, without_idle_states
from ...analysis.rest import RestSolver, evaluate_at, evaluate_rows, rate_state, rest_states, typical_sizes


class Coefficients(NamedTuple):
    """Matrices at N angles, for n states and r measured outputs.

    ``a`` (N, n, n); ``drive`` g (N, n); ``shift`` Q (N, n); ``estimate`` (N, n + 1), the row t and last the
    offset of estimate = t·x + t₀; ``rate`` b (N, n), what the rate of the extension does; ``measured``
    (N, r − 1), what the outputs besides the angle are at this angle.
    """

    a: Array
    drive: Array
    shift: Array
    estimate: Array
    rate: Array
    measured: Array


@dataclass(frozen=True, eq=False, kw_only=True)
class AngleScheduledPlant:
    """The plant in the form ẋ = A(θ)x + g(θ) + b(θ)·δ̇ + E·d(u) + friction(ω)."""

    name: str  # name of the model
    states: tuple[Variable, ...]  # all states: the inner ones, then angle and speed
    # angle, speed: names of the state that is measured and scheduled over, and of its rate
    angle: str
    speed: str
    estimate: Variable  # what is wanted
    inputs: tuple[Variable, ...]  # known inputs u
    # measured: states that are measured besides the angle, because they follow from it: the published
    # extension. Their rate δ̇ is then an input too.
    measured: tuple[str, ...]
    at: Callable[[Array], Coefficients]  # takes angles of shape (N,) and returns the coefficients there
    rest: Callable[[Array], Array]  # takes angles of shape (N,) and returns the states at rest, shape (N, n)
    driven: ca.Function  # casadi.Function u -> d, what the inputs add to the rates
    rows: tuple[int, ...]  # states into whose rates d goes; they make E
    # friction: casadi.Function ω -> ω̇, what the speed adds to its own rate beyond its linear part, or None
    friction: ca.Function | None
    sizes: Array  # typical sizes of the states as the observer carries them, shape (n,)
    rate_bandwidth: float  # cut-off frequency of the filter on δ̇ in Hz
    # affine_error: deviation of the estimate from its tangent in the inner states, share of its largest value
    affine_error: float

    @property
    def names(self) -> tuple[str, ...]:
        """Names of the states."""
        return tuple(v.name for v in self.states)

    @property
    def moving(self) -> tuple[int, int]:
        """Places of the angle and of its speed among the states."""
        return self.names.index(self.angle), self.names.index(self.speed)

    @property
    def pole_order(self) -> tuple[str, ...]:
        """Names of the states as poles are given for them: what is measured besides the angle stands last."""
        return (*(name for name in self.names if name not in self.measured), *self.measured)

    @property
    def output_matrix(self) -> Array:
        """C, shape (r, n): the angle first, then what else is measured."""
        places = [self.names.index(name) for name in (self.angle, *self.measured)]
        return np.eye(len(self.states))[places]


ADDITIVE_LIMIT = 1e-6
"""Largest part of the equations, relative to the largest rate, that may be missed by the form above."""
FINE = 2.5e-4
"""Distance in rad of the nodes at which what follows the speed is summed up, a quarter of a sharp corner."""


@dataclass(frozen=True)
class ScheduledNames:
    """Which variable of a model plays which role."""

    # angle, speed: states
    angle: str
    speed: str
    speed_size: float  # typical speed in rad/s
    angles: Array  # ascending, shape (n,): the range in which the form is wanted
    consistent: Mapping[str, str]  # states that agree with a signal at rest, as for rest_states
    rate: str | None = None  # input that is the rate of a measured state, if there is one


class AngleForm:
    """Evaluates one model in the form above; states in the order of the observer: inner ones, angle, speed.

    ``model``: continuous; its first output is what is wanted.
    """

    def __init__(self, model: FlatModel, layout: ScheduledNames) -> None:
        names = [v.name for v in model.states]
        moving = [names.index(layout.angle), names.index(layout.speed)]
        self.model, self.layout = model, layout
        self.order = [i for i in range(len(names)) if i not in moving] + moving
        self.n, self.inner = len(names), len(names) - len(moving)
        # Places among the states of the model, and in the order of the observer.
        self.angle_state, self.speed_state = moving
        self.angle, self.speed = (self.order.index(place) for place in moving)
        self.p, self.u = model.start(model.parameters), model.start(model.inputs)
        self.free_inputs = [i for i, v in enumerate(model.inputs) if v.name != layout.rate]
        s = model.symbols()
        x = ca.vertcat(*[s.state[i] for i in self.order])
        rate = ca.vertcat(*[s.derivative[i] for i in self.order])
        led = s.input[[v.name for v in model.inputs].index(layout.rate)] if layout.rate else ca.SX.sym("none")
        arguments, wanted = [s.time, s.state, s.input, s.parameter], s.output[0]

        def slopes(of: ca.SX, by: ca.SX) -> ca.SX:
            return ca.densify(ca.jacobian(of, by))

        self.rates_and_estimate = ca.Function("values", arguments, [rate, wanted])
        self._slopes = ca.Function(
            "slopes", arguments, [rate, slopes(rate, x), wanted, slopes(wanted, x), slopes(rate, led)]
        )
        follow = slopes(rate[: self.inner], x[self.speed]) if self.inner else ca.SX(0, 1)
        self._follow = ca.Function("follow", arguments, [follow])
        self._rest = RestSolver(model, angle=layout.angle, consistent=layout.consistent)
        self._rested: tuple[Array, Array] | None = None
        self._sum = self._summed()

    def with_values(self, values: Mapping[str, float]) -> AngleForm:
        """Return the same form of the model with other numbers."""
        other = copy.copy(self)
        other.model = self.model.with_values(values)
        other.p = other.model.start(other.model.parameters)
        other._rested = None
        other._sum = other._summed()
        return other

    def rest(self, angles: Array) -> Array:
        """Return rest states in the order of the observer, shape (N, n)."""
        return self.rest_in_model_order(angles)[:, self.order]

    def at(self, angles: Array) -> Coefficients:
        """Return the coefficients at many angles."""
        rest, n, k, count = self.rest_in_model_order(angles), self.n, self.inner, len(angles)
        rate, jacobian, wanted, row, led = evaluate_rows(self._slopes, rest, self.u, self.p)
        # Slopes in the speed are those of the moving actuator: dry friction has none there.
        _, moving, _, moving_row, _ = evaluate_rows(
            self._slopes, _moving(rest, self.speed_state, self.layout.speed_size), self.u, self.p
        )
        a, shift = jacobian.reshape(-1, n, n).copy(), np.zeros((count, n))
        shift[:, :k] = self._shift(angles)
        a[:, :, self.angle] = 0.0
        a[:, :, self.speed] = moving.reshape(-1, n, n)[:, :, self.speed]
        a[:, :k, self.speed] = 0.0
        carried = rest[:, self.order[:k]] - shift[:, :k]
        drive = rate - np.einsum("aij,aj->ai", a[:, :, :k], carried)
        row[:, self.angle], row[:, self.speed] = 0.0, moving_row[:, self.speed]
        offset = wanted[:, 0] - np.einsum("aj,aj->a", row[:, :k], carried)
        measured = rest[:, [i for i, v in enumerate(self.model.states) if v.name in self.layout.consistent]]
        return Coefficients(a, drive, shift, np.column_stack([row, offset]), led, measured)

    def driven(self) -> tuple[ca.Function, tuple[int, ...]]:
        """Return what the inputs add to the rates, u -> d, and the states whose rates these are."""
        u = ca.SX.sym("input", len(self.free_inputs))
        x0 = self.rest_in_model_order(np.zeros(1))[0]
        free = self.free_inputs
        given = ca.vertcat(*[u[free.index(i)] if i in free else float(v) for i, v in enumerate(self.u)])
        added = (
            self.rates_and_estimate(0.0, x0, given, self.p)[0]
            - self.rates_and_estimate(0.0, x0, self.u, self.p)[0]
        )
        values = _sampled(ca.Function("driven", [u], [added]), 1.0)
        scale = max(float(np.max(np.abs(values), initial=0.0)), 1e-300)
        rows = tuple(int(i) for i in np.flatnonzero(np.max(np.abs(values), axis=0) > 1e-12 * scale))
        return ca.Function("driven", [u], [ca.vertcat(*[added[i] for i in rows])]), rows

    def friction(self) -> ca.Function | None:
        """Return what the speed adds to its own rate beyond its linear part, ω -> ω̇; ``None`` for nothing."""
        speed, x0 = ca.SX.sym("speed"), self.rest_in_model_order(np.zeros(1))[0]
        slope = float(self.at(np.zeros(1)).a[0, self.speed, self.speed])
        x = ca.vertcat(*[speed if i == self.speed_state else x0[i] for i in range(len(x0))])
        moving, still = (self.rates_and_estimate(0.0, at, self.u, self.p)[0][self.speed] for at in (x, x0))
        function = ca.Function("friction", [speed], [moving - still - slope * speed])
        size = self.layout.speed_size
        values = _sampled(function, size)
        # Where nothing is left but rounding, there is no friction beyond the linear part.
        return function if np.max(np.abs(values)) > 1e-10 * abs(slope) * size + 1e-12 * size else None

    def check_additive(
        self, driven: ca.Function, rows: Sequence[int], friction: ca.Function | None, sizes: Array
    ) -> None:
        """Raise unless the rates have the form at random angles, speeds and inputs, inner states at rest."""
        draw, angles = np.random.default_rng(2), self.layout.angles
        at = draw.uniform(angles[0], angles[-1], 40)
        speeds = self.layout.speed_size * draw.normal(size=40)
        inputs = np.tile(self.u, (40, 1))
        inputs[:, self.free_inputs] = draw.normal(size=(40, len(self.free_inputs)))
        x = self.rest_in_model_order(at)
        x[:, self.speed_state] = speeds
        rate, _ = evaluate_rows(self.rates_and_estimate, x, inputs, self.p)
        c = self.at(at)
        form = np.einsum("aij,aj->ai", c.a, x[:, self.order] - c.shift) + c.drive
        form[:, : self.inner] += self._followed(at) * speeds[:, None]
        for i, (speed, u) in enumerate(zip(speeds, inputs[:, self.free_inputs], strict=True)):
            form[i, list(rows)] += np.array(driven(u)).ravel()
            form[i, self.speed] += 0.0 if friction is None else float(friction(speed))
        # At rest the rates of the inner states vanish; they are measured by what they would be far from it.
        scale = np.maximum(np.max(np.abs(rate), axis=0), np.max(np.abs(c.a) @ sizes, axis=0))
        missed = np.max(np.abs(rate - form), axis=0) / np.maximum(scale, 1e-300)
        worst = int(np.argmax(missed))
        if missed[worst] > ADDITIVE_LIMIT:
            raise ArrangementError(
                f"observer: rate of '{self.model.states[self.order[worst]].name}'",
                "is not a sum of functions of angle, speed and inputs, and a part linear in the other states",
                next_step="friction inside the spring that follows its speed, as of a cable on a guide "
                "(CapstanFriction), or a load that moves, has no observer over one angle: take the "
                "friction out of the spring, or hold the load",
            )

    def affine_error(self) -> float:
        """Return how far the estimate is from its tangent in the inner states, share of its largest value.

        Taken where the angle jumps from zero to any angle, and from both ends of the range.
        """
        angles, k = self.layout.angles, self.inner
        if not k:
            return 0.0
        c, x, before = (
            self.at(angles),
            self.rest_in_model_order(angles),
            np.array([0.0, angles[0], angles[-1]]),
        )
        off, largest = 0.0, 1e-300
        for carried in self.rest(before)[:, :k] - self._shift(before):
            x[:, self.order[:k]] = carried + c.shift[:, :k]
            wanted = evaluate_rows(self.rates_and_estimate, x, self.u, self.p)[1][:, 0]
            tangent = c.estimate[:, :k] @ carried + c.estimate[:, -1]
            off = max(off, float(np.max(np.abs(wanted - tangent))))
            largest = max(largest, float(np.max(np.abs(wanted))))
        return off / largest

    # --- inside ---------------------------------------------------------------------------------------

    def rest_in_model_order(self, angles: Array) -> Array:
        """Return rest states in the order of the model, shape (N, n)."""
        if self._rested is None or not np.array_equal(self._rested[0], angles):
            self._rested = angles.copy(), self._rest(self.model, angles)
        return self._rested[1].copy()

    def _followed(self, angles: Array) -> Array:
        """Return ∂ż/∂ω of the inner states, shape (N, inner); it may depend on the angle only."""
        x = np.tile(self.model.start(self.model.states), (len(angles), 1))
        x[:, self.angle_state] = angles
        return evaluate_rows(
            self._follow, _moving(x, self.speed_state, self.layout.speed_size), self.u, self.p
        )[0]

    def _shift(self, angles: Array) -> Array:
        """Return Q(θ), shape (N, inner)."""
        return np.zeros((len(angles), self.inner)) if self._sum is None else self._sum(angles)

    def _summed(self) -> scipy.interpolate.CubicHermiteSpline | None:
        """Return Q = ∫₀^θ ∂ż/∂ω dθ as a spline with its exact slope at fine nodes, zero among them."""
        low, high = min(0.0, float(self.layout.angles[0])), max(0.0, float(self.layout.angles[-1]))
        if not self.inner or not np.any(self._followed(np.linspace(low, high, 7))):
            return None
        below, above = int(np.ceil(-low / FINE)), int(np.ceil(high / FINE))
        # Node, middle, node: Simpson's rule.
        slopes = self._followed(FINE / 2.0 * np.arange(-2.0 * below, 2.0 * above + 1.0))
        parts = (slopes[:-2:2] + 4.0 * slopes[1:-1:2] + slopes[2::2]) * (FINE / 6.0)
        whole = np.vstack([np.zeros((1, self.inner)), np.cumsum(parts, axis=0)])
        nodes = np.arange(-below, above + 1) * FINE
        return scipy.interpolate.CubicHermiteSpline(nodes, whole - whole[below], slopes[::2])


def _moving(x: Array, place: int, speed: float) -> Array:
    """Return the states with a speed instead of rest."""
    moved = x.copy()
    moved[:, place] = speed
    return moved


def _sampled(function: ca.Function, size: float) -> Array:
    """Return the results of a function of one vector at random arguments of a size, one row each."""
    draw, width = np.random.default_rng(1), function.size1_in(0)
    return np.array([np.array(function(size * draw.normal(size=width))).ravel() for _ in range(16)])


AFFINE_LIMIT = 0.2
"""Largest deviation of the estimate from its tangent in the inner states, relative to its largest value."""


class StateForm(Protocol):
    """Which states the observer carries."""

    def plant(self, model: FlatModel, *, estimate: str, angle: str, angles: Array) -> AngleScheduledPlant:
        """Return the plant in the form that an observer is designed on.

        Parameters
        ----------
        model
            Continuous, load fixed.
        estimate
            Output or signal that is wanted.
        angle
            State that is measured.
        angles
            Range in which the form is wanted, ascending, shape (n,).

        Raises
        ------
        UnknownNameError
            If a name does not exist.
        ArrangementError
            If the equations do not have the form.
        ValueRangeError
            If the estimate is far from linear in the inner states.
        """
        ...


@dataclass(frozen=True)
class Minimal:
    """The states that the model has: inner states of the rubber, angle, speed.

    The force at equilibrium is read at the measured angle; only what relaxes is estimated. It makes no
    difference whether the model carries the strain of the dashpot, the relaxing force or the total force:
    each is a known function of the angle away from the others, and that function is integrated exactly.
    """

    def plant(self, model: FlatModel, *, estimate: str, angle: str, angles: Array) -> AngleScheduledPlant:
        """Return the plant; see :class:`StateForm`.

        Raises
        ------
        UnknownNameError
            If the angle is no state of the model.
        """
        form, size = minimal_form(model, estimate=estimate, angle=angle, angles=angles)
        return finished(form, size, ())


def minimal_form(model: FlatModel, *, estimate: str, angle: str, angles: Array) -> tuple[AngleForm, Array]:
    """Return the model in its own states, reduced to those that matter, and their typical sizes."""
    if angle not in {v.name for v in model.states}:
        raise unknown_name("state", angle, (v.name for v in model.states))
    model = without_idle_states(model, [estimate, angle])
    sizes, speed = typical_sizes(model, angles, angle=angle), rate_state(model, angle)
    form = AngleForm(model, ScheduledNames(angle, speed, sizes[speed], angles, {}))
    size = np.array([sizes[model.states[i].name] for i in form.order])
    carried = form.rest(angles) - form.at(angles).shift
    largest = np.max(np.abs(carried[:, : form.inner]), axis=0)
    size[: form.inner] = np.where(largest > 0.0, largest, size[: form.inner])
    return form, size


@dataclass(frozen=True)
class PaperForm:
    """The states of the paper: force, extension, angle, speed; the rate of the extension is a held input.

    Kept as the reference. The rate is the difference of the extension at the last two measured angles over
    the sample time, behind a low-pass filter where one is wanted.

    Parameters
    ----------
    names
        Which variables are meant; decided from the structure of the model where they are left out.
    rate_bandwidth
        Cut-off frequency of a first-order filter on the rate in Hz; infinite means none.
    """

    names: PaperFormNames = field(default_factory=PaperFormNames)
    rate_bandwidth: float = float("inf")

    def plant(self, model: FlatModel, *, estimate: str, angle: str, angles: Array) -> AngleScheduledPlant:
        """Return the plant; see :class:`StateForm`.

        Raises
        ------
        ValueRangeError
            If the bandwidth of the rate is not positive.
        """
        if not self.rate_bandwidth > 0.0:
            raise ValueRangeError(f"rate_bandwidth {self.rate_bandwidth:g} Hz", "must be positive")
        n = self.names.of(model)
        published = with_outputs(paper_form(model, self.names), [estimate, n.extension, angle])
        consistent = {n.extension: f"{n.extension}.{GEOMETRIC}"}
        rest = rest_states(published, angles, angle=angle, consistent=consistent)
        names, sizes = [v.name for v in published.states], np.max(np.abs(rest), axis=0)
        s = published.symbols()
        led = s.input[[v.name for v in published.inputs].index(n.rate)]
        rates, jumps = evaluate_at(published, s, [s.derivative, ca.jacobian(s.derivative, led)], rest)
        # What rests at zero, such as a relaxing stress, is as large as its jump when the cable is pulled.
        sizes = np.maximum(sizes, np.max(np.abs(jumps), axis=0) * sizes[names.index(n.extension)])
        sizes[names.index(n.speed)] = np.sqrt(
            sizes[names.index(angle)] * np.max(np.abs(rates[:, names.index(n.speed)]))
        )
        speed_size = float(sizes[names.index(n.speed)])
        layout = ScheduledNames(angle, n.speed, speed_size, angles, consistent, n.rate)
        form = AngleForm(published, layout)
        return finished(form, sizes[form.order], (n.extension,), self.rate_bandwidth)


def finished(
    form: AngleForm, sizes: Array, measured: tuple[str, ...], bandwidth: float = float("inf")
) -> AngleScheduledPlant:
    """Return the plant of a form, checked."""
    (driven, rows), friction = form.driven(), form.friction()
    form.check_additive(driven, rows, friction, sizes)
    deviation, model = form.affine_error(), form.model
    if deviation > AFFINE_LIMIT:
        raise ValueRangeError(
            f"'{model.outputs[0].name}'",
            f"deviates by {deviation:.0%} of its largest value from being linear in the inner states",
            next_step="exchange an inner state with replace_state so that it becomes linear",
        )
    return AngleScheduledPlant(
        name=model.name, states=tuple(model.states[i] for i in form.order), angle=form.layout.angle,
        speed=form.layout.speed, estimate=model.outputs[0],
        inputs=tuple(model.inputs[i] for i in form.free_inputs), measured=measured, at=form.at,
        rest=form.rest, driven=driven, rows=rows, friction=friction, sizes=sizes, rate_bandwidth=bandwidth,
        affine_error=deviation,
    )  # fmt: skip


@remembered(8)
def plant_over(
    form: StateForm, model: FlatModel, estimate: str, angle: str, ends: tuple[float, float]
) -> AngleScheduledPlant:
    """Return the plant of a form between two angles; observers with other gains are designed on the same."""
    return form.plant(model, estimate=estimate, angle=angle, angles=np.linspace(*ends, 65))
