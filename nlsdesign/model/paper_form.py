"""The form of the paper on the actuator: force, extension, angle and speed as states.

It is not minimal on purpose: the extension follows from the angle, and its rate is called an input. It is
derived here from the same flat model as everything else, so that what it loses can be seen.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from typing import NamedTuple

import casadi as ca

from ..foundation.errors import ArrangementError, unknown_name
from ..foundation.symbolic import Expression, depends
from .flat import FlatModel, Variable, stated_equations
from .roles import driven_body, series_cam
from .transform import cut, named, parts_of, with_parts

GEOMETRIC = "geometric"
"""What stands behind the name of the extension for the one that follows from the angle."""


@dataclass(frozen=True)
class PaperFormNames:
    """Names of the variables that make the form of the paper; the structure decides those not given."""

    # inner: state of the rubber that the force replaces: the only one of the element behind the cam
    inner: str | None = None
    # force, extension: signals of one element behind the cam
    force: str | None = None
    extension: str | None = None
    rate: str | None = None  # name of the new input dδ/dt
    # angle, speed: states of the driven body
    angle: str | None = None
    speed: str | None = None

    def of(self, model: FlatModel) -> KnownNames:
        """Return the names in a model."""
        cam, body = series_cam(model), driven_body(model)
        if self.inner is None and len(cam.states) != 1:
            raise ArrangementError(
                f"'{cam.element}'", f"has {len(cam.states)} inner states",
                next_step="the form of the paper knows one element with one inner state; name it as inner=",
            )  # fmt: skip
        return KnownNames(
            inner=self.inner or cam.states[0],
            force=self.force or cam.force,
            extension=self.extension or cam.extension,
            rate=self.rate or f"{cam.element}.rate",
            angle=self.angle or body.motion,
            speed=self.speed or body.rate,
        )


class KnownNames(NamedTuple):
    """The variables of one model that make the form of the paper; see :class:`PaperFormNames`."""

    inner: str
    force: str
    extension: str
    rate: str
    angle: str
    speed: str


def paper_form(model: FlatModel, names: PaperFormNames | None = None) -> FlatModel:
    """Return the model with x = (F, δ, θ, ω), u = (dδ/dt, other inputs), y = (δ, θ).

    dF/dt = ∂F/∂δ·dδ/dt + ∂F/∂z·ż with the inner state z eliminated by F(δ, z); dδ/dt is the input itself; the
    acceleration is that of the model with the force as it is. The extension that really follows from the
    angle stays as the signal ``<extension>.geometric``. Source: Austin et al. 2015, eq. (3) and (4),
    corrected: the moduli in dF/dt engage with δ, and all elements share the torque.
    """
    n = (names or PaperFormNames()).of(model)
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
    others = _expressed(drive, known, [v.name for v in drive.signals if v.name not in symbols])
    signals = {drive.variable(name): value for name, value in others.items() if value is not None}
    signals[replace(extension, name=f"{n.extension}.{GEOMETRIC}")] = _required(model, known, n.extension)
    carried = (n.force, n.extension, n.angle, n.speed)
    equations = stated_equations(
        _column([symbols[name] for name in carried]), _column([symbols[n.rate], *outer.values()]),
        derivative=_column([force_rate, symbols[n.rate], symbols[n.speed], pull]),
        output=_column([symbols[n.extension], symbols[n.angle]]),
        parameter=_column(list(parameters.values())), signal=_column(list(signals.values())),
    )  # fmt: skip
    start = model.evaluate([v.start for v in model.states])
    kept = [model.variable(name) for name in carried]
    changed = replace(
        model,
        description=f"{model.description} (form of the paper)".strip(),
        states=tuple(replace(v, start=start.get(v.name, v.start)) for v in kept),
        inputs=(Variable(n.rate, f"{extension.unit}/s", f"rate of {n.extension}"), *model.inputs),
        outputs=(extension, replace(model.variable(n.angle), start=0.0)),
        signals=tuple(signals),
        equations=equations,
    )
    return with_parts(changed, parts_of(model).with_state(n.inner, n.force))


def _required(model: FlatModel, known: Mapping[str, Expression], name: str) -> Expression:
    expression = _expressed(model, known, [name])[name]
    if expression is None:
        raise ArrangementError(
            f"'{name}'", "does not follow from force, extension, angle and speed alone",
            next_step="the form of the paper knows a fixed load and one element behind one cam",
        )  # fmt: skip
    return expression


def _force_rate(rubber: FlatModel, n: KnownNames, symbols: Mapping[str, Expression]) -> Expression:
    """Return dF/dt as a function of force, extension and its rate."""
    inner = ca.SX.sym(n.inner)
    of_rubber = _expressed(rubber, {**symbols, n.inner: inner}, [n.force, f"der({n.inner})"])
    force, inner_rate = of_rubber[n.force], of_rubber[f"der({n.inner})"]
    if (
        force is None
        or inner_rate is None
        or depends(inner_rate, ca.vertcat(symbols[n.angle], symbols[n.speed]))
    ):
        raise ArrangementError(
            f"'{n.force}'", f"does not follow from '{n.extension}' and '{n.inner}' alone",
            next_step="the form of the paper knows one element with one inner state",
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
