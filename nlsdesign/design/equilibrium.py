"""The elastic law of a spring with all relaxation at rest, taken from the flat model alone."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from functools import cached_property

import casadi as ca
import numpy as np
from numpy.typing import ArrayLike, NDArray

from ..errors import ArrangementError, ConvergenceError, unknown_name
from ..model import FlatModel, Variable
from ..symbolic import Expression, depends
from .rounding import rounded

_NEWTON_STEPS = 30


@dataclass(frozen=True, eq=False)
class ElasticLaw:
    """Force of the element behind a cam over its extension, in equilibrium.

    Parameters
    ----------
    spring
        Path of the cam spring, for instance ``"spring"``.
    element
        Path of the element behind the cam.
    parameters
        All parameters of the flat model, in its order.
    specimens
        Paths of the pieces of rubber in it.
    function
        ``casadi.Function`` (extension, parameters) -> (force, stiffness, strains, stresses); one strain and
        one nominal stress for each specimen.
    """

    spring: str
    element: str
    parameters: tuple[Variable, ...]
    specimens: tuple[str, ...]
    function: ca.Function

    @property
    def numbers(self) -> NDArray[np.float64]:
        """Values of the parameters, shape (parameters,)."""
        return np.array([v.start for v in self.parameters])

    def force(self, extension: ArrayLike) -> NDArray[np.float64]:
        """Return the force at the numbers of the model.

        Parameters
        ----------
        extension
            In m, any shape.

        Returns
        -------
        numpy.ndarray
            Of the same shape, in N.
        """
        return self._evaluated(extension, 0)

    def stiffness(self, extension: ArrayLike) -> NDArray[np.float64]:
        """Return d(force)/d(extension) at the numbers of the model.

        Parameters
        ----------
        extension
            In m, any shape.

        Returns
        -------
        numpy.ndarray
            Of the same shape, in N/m.
        """
        return self._evaluated(extension, 1)

    def without_knots(self, longest: float, share: float) -> ElasticLaw:
        """Return the law with rounded knots.

        Parameters
        ----------
        longest
            Extension in m up to which the law is looked at.
        share
            Width of the rounding relative to that range.
        """
        places = np.linspace(0.0, longest, 101).reshape(1, -1)
        numbers = np.repeat(self.numbers[:, None], places.size, axis=1)
        extension, parameters = ca.SX.sym("extension"), ca.SX.sym("parameters", len(self.parameters))
        old = self.function.call([extension, parameters])
        smooth = rounded(ca.Function("force", [extension, parameters], old[:1]), [places, numbers], share)
        force = smooth.call([extension, parameters])[0]
        results = [force, ca.jacobian(force, extension), *old[2:]]
        return replace(self, function=ca.Function("law", [extension, parameters], results))

    def _evaluated(self, extension: ArrayLike, which: int) -> NDArray[np.float64]:
        given = np.asarray(extension, dtype=float)
        found = self._with_numbers(given.reshape(1, -1))[which]
        result: NDArray[np.float64] = np.array(found, dtype=float).reshape(given.shape)
        return result

    @cached_property
    def _with_numbers(self) -> ca.Function:
        symbol = ca.SX.sym("extension")
        return ca.Function("law", [symbol], self.function.call([symbol, ca.SX(self.numbers)])[:2])


def elastic_law(model: FlatModel, spring: str) -> ElasticLaw:
    """Return the equilibrium law of the element behind a cam.

    At angle zero with a cam without lever arm the pretension is the extension of the element: that cuts the
    element out of the flat model. Inner states (of relaxation) stand where their derivatives vanish.

    Parameters
    ----------
    model
        Flat model of an assembly.
    spring
        Path of the cam spring.

    Raises
    ------
    UnknownNameError
        If there is no cam spring of that name.
    ConvergenceError
        If the inner states find no equilibrium.
    """
    pretension = f"{spring}.pretension"
    known = [v.name for v in model.parameters]
    if pretension not in known:
        springs = [name.removesuffix(".pretension") for name in known if name.endswith(".pretension")]
        raise unknown_name("cam spring", spring, springs)
    element = _element_behind(model, spring)
    signals, angle, parameters = _at_rest(model, spring)
    extension = ca.SX.sym("extension")
    flat_cam = ca.vertcat(
        *[parameters[i] for i, name in enumerate(known) if name.startswith(f"{spring}.cam.lever_arm")]
    )
    old = ca.vertcat(angle, flat_cam, parameters[known.index(pretension)])
    new = ca.vertcat(ca.SX.zeros(1 + flat_cam.shape[0]), extension)

    def cut(name: str) -> Expression:
        return ca.substitute(signals[name], old, new)

    specimens = tuple(
        name.removesuffix(".area")
        for name in known
        if name.startswith(f"{spring}.") and name.endswith(".area")
    )
    force = cut(f"{element}.force")
    strains = [cut(f"{path}.strain") for path in specimens]
    stresses = [cut(f"{path}.force") / parameters[known.index(f"{path}.area")] for path in specimens]
    results = [force, ca.jacobian(force, extension), ca.vertcat(*strains), ca.vertcat(*stresses)]
    function = ca.Function("law", [extension, parameters], [ca.SX(e) for e in results])
    if not np.isfinite(float(function(1e-3, model.start(model.parameters))[0])):
        raise ConvergenceError(
            f"equilibrium of '{element}'", "the inner states find no rest at an extension of 1 mm",
            next_step="look for a branch that carries no force at rest at any extension",
        )  # fmt: skip
    return ElasticLaw(spring, element, model.parameters, specimens, function)


def torque_function(model: FlatModel, spring: str) -> ca.Function:
    """Return the torque of a spring in equilibrium as a function (angle, parameters) -> torque.

    Parameters
    ----------
    model
        Flat model of an assembly.
    spring
        Path of the spring.
    """
    signals, angle, parameters = _at_rest(model, spring)
    return ca.Function("torque", [angle, parameters], [signals[f"{spring}.torque"]])


def cam_function(model: FlatModel, spring: str) -> ca.Function:
    """Return the law of a cam as a function (angle, parameters) -> (lever arm, extension without pretension).

    Parameters
    ----------
    model
        Flat model of an assembly.
    spring
        Path of the cam spring.
    """
    element = _element_behind(model, spring)
    signals, angle, parameters = _at_rest(model, spring)
    pretension = parameters[[v.name for v in model.parameters].index(f"{spring}.pretension")]
    results = [signals[f"{spring}.cam.lever_arm_now"], signals[f"{element}.extension"] - pretension]
    return ca.Function("cam", [angle, parameters], results)


def equilibrium_torque(model: FlatModel, spring: str, angles: ArrayLike) -> NDArray[np.float64]:
    """Return the torque of a spring over its angle with all relaxation at rest.

    Parameters
    ----------
    model
        Flat model of an assembly.
    spring
        Path of the spring.
    angles
        In rad, any shape.

    Returns
    -------
    numpy.ndarray
        Of the same shape, in N·m.
    """
    given = np.asarray(angles, dtype=float)
    torque = torque_function(model, spring)(given.reshape(1, -1), model.start(model.parameters))
    result: NDArray[np.float64] = np.array(torque, dtype=float).reshape(given.shape)
    return result


def _element_behind(model: FlatModel, spring: str) -> str:
    forces = [v.name for v in model.signals if v.name.startswith(f"{spring}.") and v.name.endswith(".force")]
    direct = [name.removesuffix(".force") for name in forces if name.count(".") == spring.count(".") + 2]
    if len(direct) != 1:
        raise ArrangementError(
            f"part '{spring}'",
            f"has {len(direct)} elements behind its cam",
            next_step="declare it with through(cam, rubber=...)",
        )
    return direct[0]


def _at_rest(model: FlatModel, spring: str) -> tuple[dict[str, Expression], Expression, Expression]:
    """Return the signals over the spring's angle and the parameters, with everything else at rest."""
    symbols = model.symbols()
    names = [v.name for v in model.signals]
    if f"{spring}.torque" not in names:
        springs = [name.removesuffix(".torque") for name in names if name.endswith(".torque")]
        raise unknown_name("spring", spring, springs)
    movable = ca.vertcat(symbols.state, symbols.input)
    handle = _handle(symbols.signal[names.index(f"{spring}.angle")], movable, spring)
    inner = [i for i, v in enumerate(model.states) if v.name.startswith(f"{spring}.")]
    angle = movable[handle]
    others = ca.vertcat(*[movable[i] for i in range(movable.shape[0]) if i not in (handle, *inner)])
    both = ca.vertcat(symbols.signal, symbols.derivative)
    both = ca.substitute(both, others, ca.SX.zeros(others.shape))
    states = ca.vertcat(*[symbols.state[i] for i in inner])
    rates = ca.vertcat(*[both[len(names) + i] for i in inner])
    signals = ca.substitute(both[: len(names)], states, _resting_states(ca.SX(rates), ca.SX(states)))
    return dict(zip(names, ca.vertsplit(signals), strict=True)), angle, symbols.parameter


def _handle(angle: Expression, movable: Expression, spring: str) -> int:
    slopes = ca.jacobian(angle, movable)
    for i in range(movable.shape[0]):
        if ca.is_equal(slopes[i], ca.SX(1)):
            return i
    raise ArrangementError(f"part '{spring}'", "its angle is no state and no input of the model")


def _resting_states(rates: Expression, states: Expression) -> Expression:
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
    found = ca.SX.zeros(len(moving))
    for _ in range(steps):
        found = found + step.call([found, *_others(rates, states)])[0]
    result[moving] = found
    return result


def _others(expression: Expression, states: Expression) -> Sequence[Expression]:
    """Return the symbols of an expression besides the states."""
    return [s for s in ca.symvar(expression) if not depends(states, s)]
