"""A torque that reaches the controller late, as over a slow bus or behind a heavy filter."""

from __future__ import annotations

from dataclasses import replace

import casadi as ca

import nlsdesign as nls
from nlsdesign.model import Variable


def late_torque(observer: nls.FlatModel, samples: int) -> nls.FlatModel:
    """Return an observer whose first output is given out so many samples late."""
    if samples == 0:
        return observer
    known, given = observer.symbols(), observer.outputs[0]
    held = ca.SX.sym("late", samples)
    states = tuple(
        Variable(f"{given.name}.late[{k}]", given.unit, f"{given.description}, {k} samples ago")
        for k in range(1, samples + 1)
    )
    equations = ca.Function(
        "equations",
        [known.time, ca.vertcat(known.state, held), known.input, known.parameter, known.table],
        [
            ca.vertcat(known.derivative, known.output[0], held[:-1]),
            ca.vertcat(held[-1], known.output[1:]),
            known.signal,
            known.residual,
        ],
        ["time", "state", "input", "parameter", "table"],
        ["derivative", "output", "signal", "residual"],
    )
    return replace(observer, states=(*observer.states, *states), equations=equations)
