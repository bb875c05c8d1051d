"""The law of a spring at rest and while it relaxes, of the flat model, sharp or with round corners."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass, replace
from functools import cached_property

import casadi as ca
import numpy as np
from numpy.typing import ArrayLike

from ...components.assembly.named_parts import Assembly
from ...components.core.element import Element
from ...foundation.arrays import Array
from ...foundation.errors import ArrangementError, ConvergenceError
from ...foundation.symbolic import Expression, depends, remembered
from ...model import FlatModel, Variable
from ...model.flat import Symbols
from ...model.graph import applied, as_results, fold, read_graph
from ...model.roles import series_cam, series_spring
from ...model.structure import CamNames, body_moved_by

_NEWTON_STEPS = 30
_CORNERS = (ca.OP_FMAX, ca.OP_FMIN, ca.OP_FABS)


def has_corners(function: ca.Function) -> bool:
    """Tell whether a function of SX contains a maximum, minimum or absolute value."""
    return any(step.operation in _CORNERS for step in read_graph(function).steps)


def rounded(function: ca.Function, samples: list[Array], share: float | Expression) -> ca.Function:
    """Return a function of SX with all corners rounded: Newton's method goes in circles at a knot.

    The instructions of the function are written again, with

        max(a, b) = (a + b + |a − b|)/2,  min(a, b) = (a + b − |a − b|)/2,  |v| ≈ √(v² + w²),

    where w is a share of the largest |v| that occurs. Everything else stays as it is.
    ``samples``: for each argument typical values, shape (argument, samples) or (argument,). ``share``: a
    symbol becomes one more argument of the result.
    """
    arguments = [ca.SX.sym(function.name_in(i), function.size1_in(i)) for i in range(function.n_in())]
    _, distances = _rewritten(function, arguments, [])
    if not distances:
        return function
    sampled = np.array(ca.Function("distances", arguments, [ca.vertcat(*distances)])(*samples))
    widths = [share * float(np.max(np.abs(row))) for row in sampled]
    results, _ = _rewritten(function, arguments, widths)
    return ca.Function(function.name(), [*arguments, *_symbols(share)], results)


def _symbols(share: float | Expression) -> list[Expression]:
    return [share] if isinstance(share, ca.SX) else []


def _rewritten(
    function: ca.Function, arguments: list[Expression], widths: list[float | Expression]
) -> tuple[list[Expression], list[Expression]]:
    """Return the results, with corners rounded where widths are given, and the distances from the corners."""
    distances: list[Expression] = []

    def written(operation: int, operands: Sequence[Expression]) -> Expression:
        if operation not in _CORNERS:
            return applied(operation, operands)
        a, b = operands if len(operands) == 2 else (operands[0], ca.SX(0))
        width = widths[len(distances)] if widths else 0.0
        distances.append(a - b)
        away = a - b
        sharp = not isinstance(width, ca.SX) and width <= 0.0
        size = ca.fabs(away) if sharp else ca.sqrt(away**2 + width**2)
        if operation == ca.OP_FABS:
            return size
        return (a + b + size) / 2 if operation == ca.OP_FMAX else (a + b - size) / 2

    values = fold(read_graph(function), lambda i, k: arguments[i].nz[k], ca.SX, combined=written)
    return as_results(function, values), distances


@dataclass(frozen=True, eq=False)
class ElasticLaw:
    """Force of the element behind a cam over its extension, in equilibrium."""

    cam: CamNames  # names around the cam, and of the pieces of rubber behind it
    parameters: tuple[Variable, ...]  # all parameters of the flat model, in its order
    # function: casadi.Function (extension, parameters) -> (force, stiffness, strains, stresses, coils); one
    # strain and one nominal stress for each specimen; extension, shear stress, tensile strength and volume of
    # wire of each coil, zero where they are not known
    function: ca.Function

    @property
    def element(self) -> str:
        """Path of the element behind the cam."""
        return self.cam.element

    @property
    def specimens(self) -> tuple[str, ...]:
        """Paths of the pieces of rubber in it."""
        return tuple(piece.name for piece in self.cam.specimens)

    @property
    def numbers(self) -> Array:
        """Values of the parameters, shape (parameters,)."""
        return np.array([v.start for v in self.parameters])

    def force(self, extension: ArrayLike) -> Array:
        """Return the force at the numbers of the model.

        Result: of the same shape, in N.
        """
        return self._evaluated(extension, 0)

    def stiffness(self, extension: ArrayLike) -> Array:
        """Return d(force)/d(extension) at the numbers of the model.

        Result: of the same shape, in N/m.
        """
        return self._evaluated(extension, 1)

    def without_knots(self, longest: float, share: float | Expression) -> ElasticLaw:
        """Return the law with rounded knots; a symbol as share becomes one more argument of its function."""
        places = np.linspace(0.0, longest, 101).reshape(1, -1)
        numbers = np.repeat(self.numbers[:, None], places.size, axis=1)
        extension, parameters = ca.SX.sym("extension"), ca.SX.sym("parameters", len(self.parameters))
        old = self.function.call([extension, parameters])
        smooth = rounded(ca.Function("force", [extension, parameters], old[:1]), [places, numbers], share)
        given = [extension, parameters, *_symbols(share)]
        force = smooth.call(given)[0]
        results = [force, ca.jacobian(force, extension), *old[2:]]
        return replace(self, function=ca.Function("law", given, results))

    def _evaluated(self, extension: ArrayLike, which: int) -> Array:
        given = np.asarray(extension, dtype=float)
        values = self._with_numbers[which](given.reshape(1, -1))
        return np.array(values, dtype=float).reshape(given.shape)

    @cached_property
    def _with_numbers(self) -> list[ca.Function]:
        symbol = ca.SX.sym("extension")
        results = self.function.call([symbol, ca.SX(self.numbers)])[:2]
        return [ca.Function("law", [symbol], [result]) for result in results]


@remembered(16)
def elastic_law(model: FlatModel, spring: str | None = None) -> ElasticLaw:
    """Return the equilibrium law of the element behind a cam.

    At angle zero with a cam without lever arm the pretension is the extension of the element: that cuts the
    element out of the flat model. Inner states (of relaxation) stand where their derivatives vanish.
    """
    cam = series_cam(model, spring)
    place = {v.name: i for i, v in enumerate(model.parameters)}
    signals, angle, parameters = _at_rest(model, cam.angle, cam.states)
    extension = ca.SX.sym("extension")
    flat_cam = ca.vertcat(*[parameters[place[name]] for name in cam.control_values])
    old = ca.vertcat(angle, flat_cam, parameters[place[cam.pretension]])
    new = ca.vertcat(ca.SX.zeros(1 + flat_cam.shape[0]), extension)

    def cut(name: str) -> Expression:
        return ca.substitute(signals[name], old, new)

    force = cut(cam.force)
    strains = [cut(piece.strain) for piece in cam.specimens]
    sections = [[parameters[place[name]] for name in piece.section] for piece in cam.specimens]
    pieces = zip(cam.specimens, sections, strict=True)
    stresses = [cut(piece.force) / math.prod(section) for piece, section in pieces]
    coils = [
        ca.SX(0) if name is None else cut(name)
        for coil in cam.coils
        for name in (coil.extension, coil.shear_stress, coil.tensile_strength, coil.wire_volume)
    ]
    columns = [ca.vertcat(*each) for each in (strains, stresses, coils)]
    results = [force, ca.jacobian(force, extension), *columns]
    function = ca.Function("law", [extension, parameters], [ca.SX(e) for e in results])
    if not np.isfinite(float(function(1e-3, model.start(model.parameters))[0])):
        raise ConvergenceError(
            f"equilibrium of '{cam.element}'", "the inner states find no rest at an extension of 1 mm",
            next_step="look for a branch that carries no force at rest at any extension",
        )  # fmt: skip
    return ElasticLaw(cam, model.parameters, function)


def torque_function(model: FlatModel, spring: str | None = None) -> ca.Function:
    """Return the torque of a spring in equilibrium as a function (angle, parameters) -> torque.

    ``spring``: path of the spring; decided from the structure if it is left out.
    """
    tie = series_spring(model, spring)
    signals, angle, parameters = _at_rest(model, tie.motion, tie.states)
    return ca.Function("torque", [angle, parameters], [signals[tie.effort]])


def cam_function(model: FlatModel, spring: str | None = None) -> ca.Function:
    """Return the law of a cam as a function (angle, parameters) -> (lever arm, extension without pretension).

    ``spring``: path of the cam spring; decided from the structure if it is left out.
    """
    cam = series_cam(model, spring)
    signals, angle, parameters = _at_rest(model, cam.angle, cam.states)
    pretension = parameters[[v.name for v in model.parameters].index(cam.pretension)]
    results = [signals[cam.lever_arm], signals[cam.extension] - pretension]
    return ca.Function("cam", [angle, parameters], results)


def equilibrium_torque(model: FlatModel, spring: str | None, angles: ArrayLike) -> Array:
    """Return the torque of a spring over its angle with all relaxation at rest.

    Parameters
    ----------
    model
        Flat model of an assembly.
    spring
        Path of the spring; ``None`` where the structure decides.
    angles
        In rad, any shape.

    Returns
    -------
    numpy.ndarray
        Of the same shape, in N·m.

    Raises
    ------
    UnknownNameError
        If there is no spring of that name.
    ArrangementError
        If the structure does not decide, or the spring's angle is neither state nor input.
    """
    given = np.asarray(angles, dtype=float)
    torque = torque_function(model, spring)(given.reshape(1, -1), model.start(model.parameters))
    return np.array(torque, dtype=float).reshape(given.shape)


def _at_rest(
    model: FlatModel, motion: str, states: Sequence[str]
) -> tuple[dict[str, Expression], Expression, Expression]:
    """Return the signals over a spring's angle and the parameters, with everything else at rest.

    ``motion`` is the signal of the angle, ``states`` are the inner states, which rest where they do not move.
    """
    symbols = model.symbols()
    names = [v.name for v in model.signals]
    movable = ca.vertcat(symbols.state, symbols.input)
    turning = symbols.signal[names.index(motion)]
    handle, slope = handle_of(turning, movable, motion)
    inner = [i for i, v in enumerate(model.states) if v.name in states]
    angle = ca.SX.sym("angle")
    others = ca.vertcat(*[movable[i] for i in range(movable.shape[0]) if i not in (handle, *inner)])
    both = ca.vertcat(symbols.signal, symbols.derivative)
    # A spring that sits turned on its shaft is at zero where that is not.
    begin = ca.substitute(turning, movable, ca.SX.zeros(movable.shape))
    at = (angle - begin) / slope
    old, new = ca.vertcat(others, movable[handle]), ca.vertcat(ca.SX.zeros(others.shape), at)
    both = ca.substitute(both, old, new)
    at_rest = ca.vertcat(*[symbols.state[i] for i in inner])
    rates = ca.vertcat(*[both[len(names) + i] for i in inner])
    signals = ca.substitute(both[: len(names)], at_rest, resting_states(ca.SX(rates), ca.SX(at_rest)))
    return dict(zip(names, ca.vertsplit(signals), strict=True)), angle, symbols.parameter


def handle_of(angle: Expression, movable: Expression, motion: str) -> tuple[int, Expression]:
    """Return the state or input that turns the spring, and the angle per unit of it (a gear has a ratio)."""
    slopes = ca.SX(ca.jacobian(angle, movable))
    places = [i for i in range(movable.shape[0]) if not slopes[i].is_zero()]
    places.sort(key=lambda i: not ca.is_equal(slopes[i], ca.SX(1)))
    if places and not depends(slopes[places[0]], movable):
        return places[0], slopes[places[0]]
    raise ArrangementError(
        f"'{motion}'", "is neither a state nor an input of the model",
        next_step="tie the spring between one body that moves and one that rests",
    )  # fmt: skip


def resting_states(rates: Expression, states: Expression) -> Expression:
    """Return the states at which the rates vanish; those that never move at rest stay at zero."""
    moving = [i for i in range(states.shape[0]) if not rates[i].is_zero()]
    idle = [i for i in range(states.shape[0]) if i not in moving]
    result = ca.SX.zeros(states.shape)
    if not moving:
        return result
    unknown, zero = ca.vertcat(*[states[i] for i in moving]), ca.vertcat(*[states[i] for i in idle])
    rates = ca.substitute(ca.vertcat(*[rates[i] for i in moving]), zero, ca.SX.zeros(zero.shape))
    slopes = ca.jacobian(rates, unknown)
    steps = _NEWTON_STEPS if depends(slopes, unknown) else 1
    step = ca.Function("step", [unknown, *_others(rates, states)], [-ca.solve(slopes, rates)])
    resting = ca.SX.zeros(len(moving))
    for _ in range(steps):
        resting = resting + step.call([resting, *_others(rates, states)])[0]
    result[moving] = resting
    return result


def _others(expression: Expression, states: Expression) -> Sequence[Expression]:
    """Return the symbols of an expression besides the states."""
    return [s for s in ca.symvar(expression) if not depends(states, s)]


def with_smooth_cables(actuator: Assembly) -> Assembly:
    """Return the assembly with every cable that goes slack in its smooth form.

    Within the range of a design the cable is taut, where the two forms agree.
    """
    for path, part in actuator.walk():
        if "unilateral contact" in part.phenomena and isinstance(part, Element) and not part.is_smooth:
            actuator = actuator.with_part(path, part.smooth())
    return actuator


_ANGLE = 0.2
"""Cam angle in rad at which the element is cut out; any at which the cam has a lever arm would do."""


@dataclass(frozen=True, eq=False)
class RelaxingLaw:
    """Force of the element behind a cam above that of equilibrium, over extension, rate and inner states."""

    element: str  # path of the element
    states: tuple[str, ...]  # names of the inner states
    # function: casadi.Function (extension, rate, states, parameters) -> (excess force, derivatives of the
    # states); parameters are all those of the flat model, in its order. The derivatives are affine in the
    # states.
    function: ca.Function


def relaxing_law(model: FlatModel, spring: str | None = None) -> RelaxingLaw:
    """Return the law of the element behind a cam with its inner states free.

    The model stands at an angle where its cam has a lever arm; the pretension makes up for the extension
    there, and the speed of the body that turns the cam is the rate of the extension over that lever arm.

    ``spring``: path of the cam spring; decided from the structure if it is left out.
    """
    cam, symbols = series_cam(model, spring), model.symbols()
    # Lever arm and extension without pretension at the angle of the cut.
    cut_arm, cut_extension = cam_function(model, cam.drive)(_ANGLE, model.start(model.parameters))
    if not abs(float(cut_arm)) > 1e-9:
        raise ArrangementError(
            f"cam '{cam.name}'", f"has no lever arm at {_ANGLE:g} rad",
            next_step="give its lever arm numbers above zero",
        )  # fmt: skip
    arm, before = float(cut_arm), float(cut_extension)
    place = {v.name: i for i, v in enumerate(model.parameters)}
    extension, rate = ca.SX.sym("extension"), ca.SX.sym("rate")
    inner = [i for i, v in enumerate(model.states) if v.name in cam.states]
    states = _column([symbols.state[i] for i in inner])
    # The cam's own numbers are those of the model, whatever the parameters say: any cam cuts the same.
    own = [place[name] for name in place if name.startswith(f"{cam.name}.")]
    old = ca.vertcat(*[symbols.parameter[i] for i in (place[cam.pretension], *own)])
    new = ca.vertcat(extension - before, *[model.parameters[i].start for i in own])
    force = symbols.signal[[v.name for v in model.signals].index(cam.force)]
    cut = ca.substitute(ca.vertcat(force, *[symbols.derivative[i] for i in inner]), old, new)
    cut = _moved(model, symbols, cut, cam, rate / arm)
    rates = _column(ca.vertsplit(cut)[1:])
    if depends(ca.jacobian(rates, states), states):
        raise ArrangementError(
            f"'{cam.element}'", "relaxes by a law that is not linear in its inner states",
            next_step="exchange it for linear branches (springs with dashpots) that do the same at the "
            "working point, or leave out goals that let the rubber relax",
        )  # fmt: skip
    excess = _excess(cut[0], rates, states, rate)
    function = ca.Function("relaxing", [extension, rate, states, symbols.parameter], [excess, rates])
    return RelaxingLaw(cam.element, tuple(model.states[i].name for i in inner), function)


def _column(items: list[Expression]) -> Expression:
    return ca.vertcat(*items) if items else ca.SX(0, 1)


def _excess(force: Expression, rates: Expression, states: Expression, rate: Expression) -> Expression:
    """Return the force minus that at rest; where it is affine, in its slopes alone, without any knots."""
    at_rest = resting_states(ca.SX(ca.substitute(rates, rate, 0.0)), states)
    moved, rest = ca.vertcat(states, rate), ca.vertcat(at_rest, 0.0)
    slopes = ca.jacobian(force, moved)
    if depends(slopes, moved):
        return force - ca.substitute(force, moved, rest)
    return ca.SX(ca.mtimes(slopes, moved - rest))


def _moved(
    model: FlatModel, symbols: Symbols, cut: Expression, cam: CamNames, speed: Expression
) -> Expression:
    """Return expressions with the cam at the angle of the cut, turning at a speed; all else rests."""
    movable = ca.vertcat(symbols.state, symbols.input)
    names = [v.name for v in (*model.states, *model.inputs)]
    angle = symbols.signal[[v.name for v in model.signals].index(cam.angle)]
    handle, slope = handle_of(angle, movable, cam.angle)
    body = body_moved_by(model.bodies, names[handle])
    if body is None or body.rate not in names:
        raise ArrangementError(
            f"'{names[handle]}'", "turns the cam, but belongs to no body with a speed",
            next_step="tie the spring between bodies",
        )  # fmt: skip
    begin = ca.substitute(angle, movable, ca.SX.zeros(movable.shape))
    values = {names[handle]: (_ANGLE - begin) / slope, body.rate: speed / slope}
    others = [i for i, name in enumerate(names) if name not in cam.states]
    old = ca.vertcat(*[movable[i] for i in others])
    new = ca.vertcat(*[values.get(names[i], ca.SX(0)) for i in others])
    return ca.substitute(cut, old, new)
