"""The form in which the actuator was published: force, extension, angle and speed as states.

It is not minimal on purpose: the extension follows from the angle, and its rate is called an input. It is
derived here from the same flat model as everything else, so that what it loses can be seen.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace

import casadi as ca

from ..errors import ArrangementError, unknown_name
from ..symbolic import Expression, depends
from .flat import FlatModel, Variable
from .transform import cut, named

GEOMETRIC = "geometric"
"""What stands behind the name of the extension for the one that follows from the angle."""


@dataclass(frozen=True)
class PublishedNames:
    """Names of the variables that make the published form.

    Parameters
    ----------
    inner
        State of the rubber that the force replaces.
    force, extension
        Signals of one element behind the cam.
    rate
        Name of the new input dδ/dt.
    angle, speed
        States of the drivetrain.
    """

    inner: str = "spring.rubber.relaxing.dashpot.strain"
    force: str = "spring.rubber.force"
    extension: str = "spring.rubber.extension"
    rate: str = "spring.rubber.rate"
    angle: str = "motor.angle"
    speed: str = "motor.speed"


def published_form(model: FlatModel, names: PublishedNames | None = None) -> FlatModel:
    """Return the model with x = (F, δ, θ, ω), u = (dδ/dt, other inputs), y = (δ, θ).

    dF/dt = ∂F/∂δ·dδ/dt + ∂F/∂z·ż with the inner state z eliminated by F(δ, z); dδ/dt is the input itself; the
    acceleration is that of the model with the force as it is. The extension that really follows from the
    angle stays as the signal ``<extension>.geometric``. Source: Austin et al. 2015, eq. (3) and (4),
    corrected: the moduli in dF/dt engage with δ, and all elements share the torque.

    Parameters
    ----------
    model
        Continuous, with one element behind a cam between ``angle`` and a fixed load.
    names
        Which variables are meant; those of the published actuator by default.

    Raises
    ------
    UnknownNameError
        If a name does not exist.
    ArrangementError
        If the force does not depend on extension and inner state alone, or is not affine in the latter.
    """
    n = PublishedNames() if names is None else names
    states = [v.name for v in model.states]
    for name in (n.inner, n.angle, n.speed):
        if name not in states:
            raise unknown_name("state", name, states)
    rubber, drive = cut(model, [n.extension]), cut(model, [n.force])
    symbols = {name: ca.SX.sym(name) for name in (n.force, n.extension, n.angle, n.speed, n.rate)}
    outer = {v.name: ca.SX.sym(v.name) for v in model.inputs}
    parameters = {v.name: ca.SX.sym(v.name) for v in model.parameters}
    known = symbols | outer | parameters
    force_rate = _force_rate(rubber, n, known)
    pull = _required(drive, known, f"der({n.speed})")
    extension = replace(model.variable(n.extension), start=0.0)
    found = _expressed(drive, known, [v.name for v in drive.signals if v.name not in symbols])
    signals = {drive.variable(name): value for name, value in found.items() if value is not None}
    signals[replace(extension, name=f"{n.extension}.{GEOMETRIC}")] = _required(model, known, n.extension)
    carried = (n.force, n.extension, n.angle, n.speed)
    equations = ca.Function(
        "equations",
        [
            ca.SX.sym("time"), _column([symbols[name] for name in carried]),
            _column([symbols[n.rate], *outer.values()]), _column(list(parameters.values())), ca.SX(0, 1),
        ],
        [
            _column([force_rate, symbols[n.rate], symbols[n.speed], pull]),
            _column([symbols[n.extension], symbols[n.angle]]), _column(list(signals.values())), ca.SX(0, 1),
        ],
        ["time", "state", "input", "parameter", "table"], ["derivative", "output", "signal", "residual"],
    )  # fmt: skip
    start = model.evaluate([v.start for v in model.states])
    kept = [model.variable(name) for name in carried]
    return replace(
        model,
        description=f"{model.description} (published form)".strip(),
        states=tuple(replace(v, start=start.get(v.name, v.start)) for v in kept),
        inputs=(Variable(n.rate, f"{extension.unit}/s", f"rate of {n.extension}"), *model.inputs),
        outputs=(extension, replace(model.variable(n.angle), start=0.0)),
        signals=tuple(signals),
        equations=equations,
    )


def _required(model: FlatModel, known: Mapping[str, Expression], name: str) -> Expression:
    found = _expressed(model, known, [name])[name]
    if found is None:
        raise ArrangementError(
            f"'{name}'", "does not follow from force, extension, angle and speed alone",
            next_step="the published form knows a fixed load and one element behind one cam",
        )  # fmt: skip
    return found


def _force_rate(rubber: FlatModel, n: PublishedNames, symbols: Mapping[str, Expression]) -> Expression:
    """Return dF/dt as a function of force, extension and its rate."""
    inner = ca.SX.sym(n.inner)
    found = _expressed(rubber, {**symbols, n.inner: inner}, [n.force, f"der({n.inner})"])
    force, inner_rate = found[n.force], found[f"der({n.inner})"]
    if (
        force is None
        or inner_rate is None
        or depends(inner_rate, ca.vertcat(symbols[n.angle], symbols[n.speed]))
    ):
        raise ArrangementError(
            f"'{n.force}'", f"does not follow from '{n.extension}' and '{n.inner}' alone",
            next_step="the published form knows one element with one inner state",
        )  # fmt: skip
    slope = ca.jacobian(force, inner)
    if depends(slope, inner) or slope.nnz() == 0:
        raise ArrangementError(f"'{n.force}'", f"is not affine in '{n.inner}'")
    extension, rate = symbols[n.extension], symbols[n.rate]
    total = ca.jacobian(force, extension) * rate + slope * inner_rate
    solved = (symbols[n.force] - ca.substitute(force, inner, ca.SX(0))) / slope
    return ca.substitute(total, inner, solved)


def _expressed(
    model: FlatModel, known: Mapping[str, Expression], wanted: Sequence[str]
) -> dict[str, Expression | None]:
    """Return wanted variables in terms of known symbols; ``None`` for what needs other symbols."""
    s = model.symbols()
    everything = named(model, s) | {f"der({v.name})": s.derivative[i] for i, v in enumerate(model.states)}
    own = named(model, s)
    leaves = {v.name: own[v.name] for v in (*model.states, *model.inputs, *model.parameters)}
    shared = [name for name in leaves if name in known]
    foreign = _column([leaf for name, leaf in leaves.items() if name not in known])
    result: dict[str, Expression | None] = {}
    for name in wanted:
        value = everything[name]
        if foreign.numel() and depends(value, foreign):
            result[name] = None
            continue
        result[name] = ca.substitute([value], [leaves[k] for k in shared], [known[k] for k in shared])[0]
    return result


def _column(items: Sequence[Expression]) -> Expression:
    return ca.SX(ca.densify(ca.vertcat(*items))) if items else ca.SX(0, 1)
