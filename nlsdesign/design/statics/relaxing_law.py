"""What the element behind a cam does beyond its equilibrium while it relaxes, from the flat model alone."""

from __future__ import annotations

from dataclasses import dataclass

import casadi as ca

from ...foundation.errors import ArrangementError
from ...foundation.symbolic import Expression, depends
from ...model import FlatModel
from ...model.flat import Symbols
from ...model.roles import series_cam
from ...model.structure import CamNames, body_moved_by
from .equilibrium import cam_function, handle_of, resting_states

_ANGLE = 0.2
"""Cam angle in rad at which the element is cut out; any at which the cam has a lever arm would do."""


@dataclass(frozen=True, eq=False)
class RelaxingLaw:
    """Force of the element behind a cam above that of equilibrium, over extension, rate and inner states.

    Parameters
    ----------
    element
        Path of the element.
    states
        Names of the inner states.
    function
        ``casadi.Function`` (extension, rate, states, parameters) -> (excess force, derivatives of the
        states); parameters are all those of the flat model, in its order. The derivatives are affine in the
        states.
    """

    element: str
    states: tuple[str, ...]
    function: ca.Function


def relaxing_law(model: FlatModel, spring: str | None = None) -> RelaxingLaw:
    """Return the law of the element behind a cam with its inner states free.

    The model stands at an angle where its cam has a lever arm; the pretension makes up for the extension
    there, and the speed of the body that turns the cam is the rate of the extension over that lever arm.

    ``spring``: path of the cam spring; decided from the structure if it is left out.
    """
    cam, symbols = series_cam(model, spring), model.symbols()
    arm, before = _at_the_cut(model, cam)
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


def _at_the_cut(model: FlatModel, cam: CamNames) -> tuple[float, float]:
    """Return lever arm and extension without pretension at the angle of the cut."""
    arm, extension = cam_function(model, cam.drive)(_ANGLE, model.start(model.parameters))
    if not abs(float(arm)) > 1e-9:
        raise ArrangementError(
            f"cam '{cam.name}'", f"has no lever arm at {_ANGLE:g} rad",
            next_step="give its lever arm numbers above zero",
        )  # fmt: skip
    return float(arm), float(extension)


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
    values = {names[handle]: _ANGLE / slope, body.rate: speed / slope}
    others = [i for i, name in enumerate(names) if name not in cam.states]
    old = ca.vertcat(*[movable[i] for i in others])
    new = ca.vertcat(*[values.get(names[i], ca.SX(0)) for i in others])
    result: Expression = ca.substitute(cut, old, new)
    return result
