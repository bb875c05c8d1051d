"""Terminals of an FMU (FMI 3.0): what belongs together when it is wired, and the pictures of it.

Two kinds. A *loop* is a bus: readings are named after what they show, so that plant, observer and controller
are wired by equal names. A *flange* is what a load is attached to, with the names of Modelica: ``phi``,
``w``, ``tau`` in rotation, ``s``, ``v``, ``f`` in translation. FMI 2.0 has no terminals.
"""

from __future__ import annotations

from collections import Counter
from collections.abc import Iterator, Sequence
from dataclasses import dataclass, replace

import casadi as ca

from ...model.flat import FlatModel

LOOP, FLANGE = "loop", "flange"
_MODELICA = {
    "rotation": ("phi", "w", "tau", "Modelica.Mechanics.Rotational.Interfaces.Flange_a"),
    "translation": ("s", "v", "f", "Modelica.Mechanics.Translational.Interfaces.Flange_a"),
}


@dataclass(frozen=True)
class TerminalMember:
    """One variable of a terminal."""

    name: str
    variable: str
    kind: str = "signal"


@dataclass(frozen=True)
class Terminal:
    """Variables that are wired together."""

    name: str
    description: str
    picture: str
    rule: str
    kind: str
    members: tuple[TerminalMember, ...]


def flanges(model: FlatModel) -> tuple[Terminal, ...]:
    """Return the flanges of a plant: the bodies that a load acts on or that are moved from outside.

    ``model``: continuous; a sampled one has none.
    """
    return tuple(_flanges(model))


def _flanges(model: FlatModel) -> Iterator[Terminal]:
    inputs = {v.name for v in model.inputs}
    everything = inputs | {v.name for v in (*model.states, *model.outputs, *model.signals)}
    for body in model.bodies:
        domain = body.domain
        for name in (body.name, *body.geared):
            lead = name == body.name
            motion = body.motion if lead else f"{name}.{domain.motion}"
            rate = body.rate if lead else f"{name}.{domain.rate}"
            effort = f"{name}.reaction" if body.prescribed else f"{name}.{domain.effort}"
            attached = {motion, rate} <= inputs if body.prescribed else effort in inputs
            if attached and {motion, rate, effort} <= everything:
                variables = (motion, rate, effort)
                *labels, kind = _MODELICA[domain.name]
                kinds = ("signal", "signal", "inflow")
                members = tuple(TerminalMember(*each) for each in zip(labels, variables, kinds, strict=True))
                yield Terminal(name, f"Where a load is attached to {name}", FLANGE, "plug", kind, members)


def terminals(model: FlatModel) -> tuple[Terminal, ...]:
    """Return all terminals of the FMU of a model."""
    attached = flanges(model)
    taken = {member.variable for each in attached for member in each.members}
    outputs = [v.name for v in model.outputs if v.name not in taken]
    inputs = [v.name for v in model.inputs if v.name not in taken]
    # Of several readings of one thing that through most sensors has its name; what is an input keeps its own.
    chain = {r.signal: len(r.sensors) for r in model.readings}
    shown = {r.signal: r.measured for r in model.readings if r.measured not in inputs}
    last = {name: max(n for s, n in chain.items() if shown.get(s) == name) for name in shown.values()}
    shown = {signal: name for signal, name in shown.items() if chain[signal] == last[name]}
    labels = {name: shown.get(name, name) for name in (*outputs, *inputs)}
    count = Counter(labels.values())
    members = tuple(
        TerminalMember(label if count[label] == 1 else name, name) for name, label in labels.items()
    )
    text = (
        "What controllers and observers of this machine are wired with; readings are named by what they show"
    )
    name = LOOP if LOOP not in {each.name for each in attached} else "signal_loop"
    bus = (Terminal(name, text, LOOP, "bus", "nlsdesign.loop", members),) if members else ()
    return (*bus, *attached)


def with_flange_outputs(model: FlatModel) -> FlatModel:
    """Return a plant whose outputs include what its flanges give out: a local variable cannot be wired."""
    known = {v.name for v in (*model.inputs, *model.outputs)}
    wanted = dict.fromkeys(m.variable for each in flanges(model) for m in each.members)
    missing = [name for name in wanted if name not in known]
    if not missing:
        return model
    s = model.symbols()
    variables = (*model.states, *model.signals)
    places = [[v.name for v in variables].index(name) for name in missing]
    outputs = _extended(s.output, s.state, s.signal, places)
    groups = [s.time, s.state, s.input, s.parameter, s.table]
    equations = ca.Function("equations", groups, [s.derivative, outputs, s.signal, s.residual])
    switching = model.switching
    if switching is not None:
        modes = ca.SX.sym("m", switching.shown.size1_in(4))
        held, signals = switching.shown(*groups[:4], modes)
        extended = _extended(held, s.state, signals, places)
        switching = replace(switching, shown=ca.Function("shown", [*groups[:4], modes], [extended, signals]))
    added = tuple(variables[i] for i in places)
    return replace(model, outputs=(*model.outputs, *added), equations=equations, switching=switching)


def _extended(outputs: ca.SX, states: ca.SX, signals: ca.SX, places: Sequence[int]) -> ca.SX:
    """Return outputs with further ones, chosen from states and signals."""
    given = ca.densify(ca.vertcat(states, signals))
    return ca.vertcat(ca.densify(outputs), *[given[i] for i in places])
