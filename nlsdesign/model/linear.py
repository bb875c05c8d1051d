"""Linearisation of the flat model."""

from __future__ import annotations

from collections.abc import Sequence
from typing import TYPE_CHECKING, NamedTuple

import casadi as ca
import numpy as np

from ..foundation.arrays import Array
from ..foundation.errors import ConvergenceError, ValueRangeError, unknown_name
from .flat import FlatModel

if TYPE_CHECKING:
    import control


class LinearModel(NamedTuple):
    """Matrices of ẋ = A x + B u, y = C x + D u around a point, with the names of the rows.

    Shapes (n, n), (n, m), (r, n), (r, m).
    """

    A: Array
    B: Array
    C: Array
    D: Array
    states: tuple[str, ...]
    inputs: tuple[str, ...]
    outputs: tuple[str, ...]
    sample_time: float | None

    def to_control(self) -> control.StateSpace:
        """Return the model as ``control.StateSpace`` with the same names."""
        import control

        step = 0 if self.sample_time is None else self.sample_time
        return control.StateSpace(
            self.A, self.B, self.C, self.D, step,
            states=[_label(n) for n in self.states],
            inputs=[_label(n) for n in self.inputs],
            outputs=[_label(n) for n in self.outputs],
        )  # fmt: skip


def _label(name: str) -> str:
    # python-control reserves the dot for subsystems.
    return name.replace(".", "_")


def jacobian_function(model: FlatModel) -> ca.Function:
    """Return (t, x, u, p, w) -> (A, B, C, D) of a flat model."""
    s = model.symbols()
    return ca.Function(
        "linear",
        [s.time, s.state, s.input, s.parameter, s.table],
        [
            ca.jacobian(s.derivative, s.state),
            ca.jacobian(s.derivative, s.input),
            ca.jacobian(s.output, s.state),
            ca.jacobian(s.output, s.input),
        ],
    )


def linearise(model: FlatModel, state: Sequence[float], inputs: Sequence[float] = ()) -> LinearModel:
    """Return the exact linearisation at a point.

    Parameters
    ----------
    model
        Continuous or discrete.
    state, inputs
        The point, shapes (states,) and (inputs,); inputs rest at their start values by default.

    Raises
    ------
    ValueRangeError
        If the laws have no finite slope there, as at a sharp corner.
    """
    u = np.asarray(inputs if len(inputs) else model.start(model.inputs), dtype=float)
    x = np.asarray(state, dtype=float)
    matrices = jacobian_function(model)(
        0.0, x, u, model.start(model.parameters), model.look_up(list(x), list(u))
    )
    a, b, c, d = (np.array(m, dtype=float) for m in matrices)
    if not all(np.all(np.isfinite(m)) for m in (a, b, c, d)):
        raise ValueRangeError(
            f"linearisation of {model.name} at {x.tolist()}",
            "the slope is not finite there",
            next_step="move away from the corner or use the smooth form of the law",
        )
    names = tuple(tuple(v.name for v in group) for group in (model.states, model.inputs, model.outputs))
    return LinearModel(a, b, c, d, names[0], names[1], names[2], model.sample_time)


_RESTS = 1e-9
"""Rate relative to its typical size below which a state rests."""


def rest_state(model: FlatModel, held: dict[str, float]) -> Array:
    """Return the state in which all states but the held ones rest."""
    for name in held:
        if name not in (names := [v.name for v in model.states]):
            raise unknown_name("state", name, names)
    u, x = model.start(model.inputs), model.start(model.states)
    for i, v in enumerate(model.states):
        x[i] = held.get(v.name, x[i])
    free = [i for i, v in enumerate(model.states) if v.name not in held]
    p, jac = model.start(model.parameters), jacobian_function(model)
    for _ in range(100):
        w = model.look_up(list(x), list(u))
        rate = np.array(model.equations(0.0, x, u, p, w)[0]).ravel()[free]
        if np.all(np.abs(rate) <= _RESTS * np.array([model.states[i].nominal for i in free])):
            return x
        slope = np.array(jac(0.0, x, u, p, w)[0])[np.ix_(free, free)]
        x[free] -= np.linalg.lstsq(slope, rate, rcond=None)[0]
    raise ConvergenceError(
        f"rest state of {model.name}",
        f"not found while holding {held}",
        next_step="hold another state, or start nearer",
    )
