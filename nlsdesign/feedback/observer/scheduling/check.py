"""Is the error of an observer stable? What is proved, and what is only checked, is said apart.

The error matrix E(θ) = Φ(θ)(I − M(θ)C) is taken from the finished observer by automatic differentiation of
its step, with its entries as the table gives them, so it knows nothing of the design.

- Check: the spectral radius of E at angles ten times finer than the grid. It says that the observer is stable
  at every checked angle that stands still. For a moving angle it says nothing.
- Proof: where E is block triangular with constant stable blocks, see
  :class:`~nlsdesign.feedback.observer.scheduling.gains.CascadeGain`. The table interpolates linearly between
  equal numbers, so the blocks are constant for all angles, not only the checked ones.
"""

from __future__ import annotations

from dataclasses import dataclass

import casadi as ca
import numpy as np
from numpy.typing import NDArray

from ....foundation.errors import ValueRangeError
from ....model import FlatModel
from .scheduled import INNOVATION, MEMORY

Array = NDArray[np.float64]


@dataclass(frozen=True, eq=False)
class ErrorStability:
    """What is known of the stability of the estimation error.

    Parameters
    ----------
    angles
        Checked angles in rad, shape (n,).
    radius
        Spectral radius of the error matrix at each.
    proved
        Whether the whole error is proved to vanish exponentially for every motion.
    proved_inner
        Whether that is proved of the inner states, on which the estimate of the force rests.
    """

    angles: Array
    radius: Array
    proved: bool
    proved_inner: bool

    @property
    def worst(self) -> tuple[float, float]:
        """Angle in rad and radius where the error decays most slowly."""
        at = int(np.argmax(self.radius))
        return float(self.angles[at]), float(self.radius[at])

    def __str__(self) -> str:
        angle, radius = self.worst
        if self.proved:
            proof = "proved: block triangular with constant stable blocks, for every motion of the angle"
        elif self.proved_inner:
            proof = "proved for the inner states only; angle and speed are checked at frozen angles"
        else:
            proof = "not proved; checked at frozen angles only"
        return (
            f"error of the observer: {proof}\n"
            f"  largest spectral radius {radius:.6f} at {angle:.4g} rad, {len(self.angles)} angles checked"
        )


def error_matrices(observer: FlatModel, angles: Array, speed: float = 0.0) -> Array:
    """Return the error matrix of an observer at many angles, shape (N, n, n).

    Parameters
    ----------
    observer
        As :func:`~nlsdesign.feedback.observer.scheduling.scheduled.design_observer` gave it.
    angles
        Measured angles in rad, shape (N,).
    speed
        Estimated speed in rad/s, which matters where dry friction is part of the observer.
    """
    (inner, moving), (body,) = _memory(observer), observer.bodies
    memory = [*inner, *moving]
    s = observer.symbols()
    known = {v.name: s.output[i] for i, v in enumerate(observer.outputs)}
    shown = ca.vertcat(known[f"{body.motion}.{INNOVATION}"], known[body.rate])
    error = ca.densify(ca.jacobian(s.derivative, s.state)[memory, memory])
    function = ca.Function("error", [s.state, s.input, s.table], [ca.vec(error.T), ca.densify(shown)])
    count = len(angles)
    state = np.tile(observer.start(observer.states)[:, None], (1, count))
    given = np.tile(observer.start(observer.inputs)[:, None], (1, count))
    given[0] = angles
    table = np.array([observer.look_up(list(state[:, i]), list(given[:, i])) for i in range(count)]).T
    many = function.map(count)
    for _ in range(2):
        # Without innovation the estimated speed is its memory and something known.
        at = np.array(many(state, given, table)[1])
        state[moving] += [at[0], speed - at[1]]
    entries = np.array(many(state, given, table)[0])
    matrices: Array = entries.T.reshape(len(angles), len(memory), len(memory))
    return matrices


def _memory(observer: FlatModel) -> tuple[list[int], list[int]]:
    """Return the places of what goes from sample to sample: of the inner states, and of angle and speed."""
    (body,) = observer.bodies
    places = {v.name: i for i, v in enumerate(observer.states)}
    moving = [places[f"{name}.{MEMORY}"] for name in (body.motion, body.rate)]
    memory = {places[name] for v in observer.outputs if (name := f"{v.name}.{MEMORY}") in places}
    return sorted(memory - set(moving)), moving


def check_stability(
    observer: FlatModel, *, finer: int = 10, speeds: tuple[float, ...] = (0.0, 1.0)
) -> ErrorStability:
    """Check, and where the structure allows prove, that the estimation error vanishes.

    Parameters
    ----------
    observer
        As :func:`~nlsdesign.feedback.observer.scheduling.scheduled.design_observer` gave it.
    finer
        How many times finer than its table the angles are.
    speeds
        Estimated speeds in rad/s at which the matrices are taken.

    Raises
    ------
    ValueRangeError
        If the model has no table over an angle.
    """
    tables, bodies = observer.tables, observer.bodies
    if len(tables) != 1 or [body.motion for body in bodies] != [tables[0].argument]:
        raise ValueRangeError(
            f"model '{observer.name}'", "is not an observer with one table over the angle of a body"
        )
    grid = tables[0].grid
    shares = np.arange(finer) / finer
    angles = np.append((grid[:-1, None] + shares * np.diff(grid)[:, None]).ravel(), grid[-1])
    matrices = np.array([error_matrices(observer, angles, speed) for speed in speeds])
    radius = np.max(np.abs(np.linalg.eigvals(matrices)), axis=(0, 2))
    every = matrices.reshape(-1, *matrices.shape[2:])
    proved, inner = _structure(every, len(_memory(observer)[0]))
    return ErrorStability(angles, radius, proved, inner)


def _structure(matrices: Array, count: int) -> tuple[bool, bool]:
    """Return whether all are block triangular with the same stable blocks, and whether the first block is."""
    own, cross, moving = matrices[:, :count, :count], matrices[:, :count, count:], matrices[:, count:, count:]
    first = not np.any(cross) and _same_and_stable(own)
    return first and _same_and_stable(moving), first


def _same_and_stable(blocks: Array) -> bool:
    if blocks.shape[1] == 0:
        return True
    return bool(np.all(blocks == blocks[0]) and np.max(np.abs(np.linalg.eigvals(blocks[0]))) < 1.0)
