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
    return replace(
        observer,
        states=(*observer.states, *states),
        equations=equations,
        begin=_with_delay_line(observer, observer.begin, held, 2),
        expected=_with_delay_line(observer, observer.expected, held, 1),
    )


def _with_delay_line(
    observer: nls.FlatModel, function: ca.Function | None, held: ca.SX, count: int
) -> ca.Function | None:
    """Return a function of the observer's states as one of all states; two results are states themselves."""
    if function is None:
        return None
    known = observer.symbols()
    results = function.call([known.state, known.input, known.parameter, known.table])
    if count == 2:
        results = [ca.vertcat(result, held) for result in results]
    arguments = [ca.vertcat(known.state, held), known.input, known.parameter, known.table]
    return ca.Function(function.name(), arguments, results)
