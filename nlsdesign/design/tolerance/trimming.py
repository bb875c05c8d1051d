"""The trim after assembly: one number set anew on each made spring so that its torque error is least."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from ...foundation.arrays import Array, Indices
from ...foundation.errors import ArrangementError, ValueRangeError, unknown_name
from ...foundation.quantity import Quantity
from ...foundation.spread import NormalSpread
from ...model import FlatModel
from ...model.structure import CamNames
from ..curves.numbers import in_si
from .causes import AnchorCause, Cause, NumberCause
from .made_spring import MadeSpring

_STEPS = 12
_SETTLED = 1e-4
"""Step, relative to a tenth of the number, below which the trim is settled."""
_USABLE = 1e-7
"""Step, likewise, from which on the change of the torque gives a derivative."""


@dataclass(frozen=True)
class Trim:
    """A number that is set after assembly, on each spring, with its torque curve measured.

    Parameters
    ----------
    name
        Full name: the pretension, the distance of the anchor, or another single number behind the cam.
    lowest, highest
        Range of the adjustment in the unit of the number; that of the part where it is left out.
    """

    name: str
    lowest: Quantity | float | None = None
    highest: Quantity | float | None = None

    def column(self, model: FlatModel, cam: CamNames) -> tuple[Cause, tuple[float, float]]:
        """Return the trim as a move of the spring, and its range in SI.

        Parameters
        ----------
        model
            Flat model of the actuator.
        cam
            Names around the cam.

        Raises
        ------
        UnknownNameError
            If the number does not exist or cannot be set.
        UnitError
            If the range is given in a unit of something else.
        ValueRangeError
            If the range is empty.
        """
        anchored = () if cam.anchor_distance is None else (cam.anchor_distance,)
        valid = (*cam.numbers, *anchored)
        if self.name not in valid:
            raise unknown_name("trim", self.name, valid)
        variable = model.variable(self.name)
        ends = [
            edge if given is None else in_si(f"range of {self.name}", given, variable.unit)
            for given, edge in ((self.lowest, variable.minimum), (self.highest, variable.maximum))
        ]
        if not ends[0] < ends[1]:
            raise ValueRangeError(
                f"trim of '{self.name}' from {ends[0]:g} to {ends[1]:g}", "has no room",
                next_step="give a lowest below the highest",
            )  # fmt: skip
        size = 0.1 * abs(variable.start) or 1e-3
        name, unit, source = f"trim of {self.name}", variable.unit, "set after assembly"
        spread = NormalSpread(size)
        if self.name in anchored:
            return AnchorCause(name, variable.start, size, unit, source, False, NormalSpread(size)), (
                ends[0],
                ends[1],
            )
        spread = NormalSpread(size)
        moved = NumberCause(name, variable.start, size, unit, source, False, spread, ((self.name, size),))
        return moved, (ends[0], ends[1])


@dataclass(frozen=True, eq=False)
class Trimmed:
    """Springs after their trim."""

    settings: Array  # the number as set, shape (draws,), in SI
    places: Array  # the trim itself in units of its cause, shape (draws,)
    torques: Array  # shape (draws, columns), in N·m
    # tangents: change of the torque per unit of the trim in its last step, shape (draws, columns), in N·m
    tangents: Array
    rms: Array  # shape (draws,), in N·m


def trimmed(
    spring: MadeSpring,
    deviations: Array,
    *,
    column: int,
    ends: tuple[float, float],
    touched: tuple[Array, Array] | None = None,
    start: Trimmed | None = None,
) -> Trimmed:
    """Return springs whose trim makes their rms error least.

    The error over the angle is nearly linear in the trim, so Gauss and Newton's step is used, with the
    change of the torque in the step before as derivative.

    ``deviations``: in units of the standard deviations, shape (draws, causes); the column of the trim is
    zero.
    """
    cause = spring.causes[column]
    if not np.max(np.abs(spring.sensitivities[column])) > 1e-12 * np.max(np.abs(spring.wanted)):
        raise ArrangementError(
            f"'{cause.name}'", "does not change the torque at rest",
            next_step="trim the pretension, or another number that does",
        )  # fmt: skip
    ends_of_each = trim_range(spring, deviations, column=column, ends=ends)
    search = _TrimSearch(spring, deviations, column, touched)
    place, torques, tangent, errors = search.settled(ends_of_each, start)
    settings = cause.nominal + deviations @ _moves(spring, column) + cause.deviation * place
    return Trimmed(settings, place, torques, tangent, errors)


class _TrimSearch:
    """Springs with a trim in units of its cause."""

    def __init__(
        self, spring: MadeSpring, deviations: Array, column: int, touched: tuple[Array, Array] | None
    ) -> None:
        self.spring, self.deviations, self.column = spring, deviations, column
        # What moves the cam moves the points of contact too; all else leaves them where they are.
        self.fixed: tuple[Array, Array] | None = None
        if isinstance(spring.causes[column], NumberCause):
            self.fixed = touched or spring.contour.deviating(spring.causes, deviations)

    def torques(self, rows: Indices, at: Array) -> Array:
        changed = self.deviations[rows].copy()
        changed[:, self.column] = at
        known = None if self.fixed is None else (self.fixed[0][rows], self.fixed[1][rows])
        return self.spring.torques(changed, known)

    def settled(self, ends: tuple[Array, Array], start: Trimmed | None) -> tuple[Array, Array, Array, Array]:
        """Return places, torques, tangents and rms errors at the best places within the ends."""
        spring, (low, high), count = self.spring, ends, len(self.deviations)
        active = np.arange(count)
        place = np.clip(0.0 if start is None else start.places, low, high)
        current = self.torques(active, place)
        tangent = np.tile(spring.sensitivities[self.column], (count, 1))
        if start is not None:
            tangent = start.tangents.copy()
        best_place, best_torques, best_rms = place.copy(), current.copy(), spring.rms(current)
        for _ in range(_STEPS):
            slope = tangent[active]
            size = np.maximum(slope**2 @ spring.weights, 1e-300)
            step = (((spring.wanted - current[active]) * slope) @ spring.weights) / size
            new = np.clip(place[active] + step, low[active], high[active])
            moved, after = new - place[active], self.torques(active, new)
            usable = np.abs(moved) > _USABLE
            tangent[active[usable]] = (after - current[active])[usable] / moved[usable, None]
            place[active], current[active] = new, after
            rms = spring.rms(after)
            better = rms < best_rms[active]
            chosen = active[better]
            best_rms[chosen], best_place[chosen], best_torques[chosen] = (
                rms[better],
                new[better],
                after[better],
            )
            active = active[np.abs(moved) > _SETTLED]
            if not len(active):
                break
        return best_place, best_torques, tangent, best_rms


def trim_range(
    spring: MadeSpring, deviations: Array, *, column: int, ends: tuple[float, float]
) -> tuple[Array, Array]:
    """Return the least and largest trim of each spring in units of its cause, shape (draws,) each."""
    cause = spring.causes[column]
    start = cause.nominal + deviations @ _moves(spring, column)
    return (ends[0] - start) / cause.deviation, (ends[1] - start) / cause.deviation


def _moves(spring: MadeSpring, column: int) -> Array:
    """Return how far each cause moves the number of a trim per standard deviation, shape (causes,), in SI."""
    own, moves = spring.causes[column], np.zeros(len(spring.causes))
    for k, cause in enumerate(spring.causes):
        if isinstance(own, AnchorCause) and isinstance(cause, AnchorCause):
            moves[k] = cause.deviation
        if isinstance(own, NumberCause) and isinstance(cause, NumberCause):
            moves[k] = dict(cause.numbers).get(own.numbers[0][0], 0.0)
    moves[column] = 0.0
    return moves
