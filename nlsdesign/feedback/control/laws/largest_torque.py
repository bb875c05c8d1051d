"""The largest torque that a drive can hold in its spring, and the check of what is asked for."""

from __future__ import annotations

import math
from typing import NamedTuple

from ....foundation.errors import ArrangementError, ValueRangeError
from ....model import FlatModel
from ....model.linear import rest_state
from ....model.roles import series_spring
from ....model.transform import cut
from .known_drive import KnownDrive

SLOW = 1.0
"""Speed of the motor in rad/s at which friction is counted: what is dry slides, what is viscous is small."""


_SMALL_TURN, _NOTHING = 0.1, 1e-6
"""Angle in rad at which a spring without a cam is looked at, and share of a torque that is none."""


class TorqueLimit(NamedTuple):
    """The largest torque of the series spring in both directions, and what limits it.

    Parameters
    ----------
    torque
        In N·m.
    reason
        In words.
    """

    torque: float
    reason: str


def torque_limit(plant: FlatModel) -> TorqueLimit:
    """Return the largest torque that a drive can bring into its series spring slowly, in both directions.

    That is where the largest current just overcomes spring, friction and the losses of the gear,
    r·|T| = k·I_max − friction, or the torque of the spring at rest at the end of the contour of its cam,
    whichever is less. A one-sided spring has one direction only, and that one counts.

    Parameters
    ----------
    plant
        Continuous, load fixed or prescribed; friction in its smooth form.

    Raises
    ------
    ArrangementError
        If a load moves freely: nothing holds the far end of the spring. Or if the plant has no motor that is
        driven by a current and turns a series spring, or sharp dry friction.
    """
    drive = KnownDrive(plant)
    loose = [b.name for b in plant.bodies if not b.prescribed and b.name != drive.body.name]
    if loose:
        raise ArrangementError(
            f"body '{loose[0]}'", "moves freely, so no torque can be held in the spring",
            next_step="fix the load, or prescribe its motion",
        )  # fmt: skip
    sides = [(_by_current(drive, way), _by_contour(drive, way)) for way in (1.0, -1.0)]
    used = [side for side in sides if side[1] > 0.0] or [(0.0, 0.0)]
    current, contour = min(side[0] for side in used), min(side[1] for side in used)
    if contour < current:
        return TorqueLimit(contour, "the spring is at the end of its contour there")
    most = plant.values[drive.motor.current_limit]
    return TorqueLimit(current, f"the current is at its limit there, {most:g} A")


def largest_torque(plant: FlatModel) -> float:
    """Return the largest torque in N·m that a drive can hold in its series spring; see :func:`torque_limit`.

    Parameters
    ----------
    plant
        Continuous, load fixed or prescribed.
    """
    return torque_limit(plant).torque


def only_side(plant: FlatModel) -> float:
    """Return the sign of the only torque that a series spring can give, 0 where it can give both.

    A cable that pulls to one side gives no torque at rest at the other end of its travel.

    Parameters
    ----------
    plant
        Continuous, load fixed or prescribed; friction in its smooth form.
    """
    drive = KnownDrive(plant)
    spring = series_spring(plant)
    ends = [plant.values[cam.last_angle] for cam in spring.cams if cam.last_angle]
    angle = (min(ends) if ends else _SMALL_TURN) / abs(drive.spring_turns_value)
    torques = []
    for way in (1.0, -1.0):
        state = rest_state(plant, {drive.body.motion: way * angle, drive.body.rate: 0.0})
        torques.append(plant.evaluate(list(state))[spring.effort])
    strongest = max(torques, key=abs)
    if min(map(abs, torques)) > _NOTHING * abs(strongest) or strongest == 0.0:
        return 0.0
    return math.copysign(1.0, strongest)


def check_torque(plant: FlatModel, torque: float) -> None:
    """Check that a drive can hold a torque.

    Parameters
    ----------
    plant
        Continuous, load fixed or prescribed.
    torque
        Amplitude in N·m.

    Raises
    ------
    ValueRangeError
        If it cannot, with the largest that it can.
    """
    most = torque_limit(plant)
    if not abs(torque) <= most.torque:
        raise ValueRangeError(
            f"torque {torque:g} N·m",
            f"is more than the drive can hold, {most.torque:.4g} N·m: {most.reason}",
            next_step=f"ask for {math.floor(most.torque * 1000.0) / 1000.0:g} N·m or less",
        )


def _by_current(drive: KnownDrive, way: float) -> float:
    """Return the size of the torque against which the largest current just creeps on, forward or backward."""
    plant, effort = drive.plant, series_spring(drive.plant).effort
    opened = cut(plant, [effort])
    states, inputs = opened.start(opened.states), opened.start(opened.inputs)
    names, places = [v.name for v in opened.states], [v.name for v in opened.inputs]
    states[names.index(drive.body.rate)] = way * SLOW
    inputs[places.index(drive.names.current)] = way * plant.values[drive.motor.current_limit]
    against = way * math.copysign(1.0, drive.spring_turns_value)

    def pushes_on(torque: float) -> bool:
        inputs[places.index(effort)] = against * torque
        return way * opened.evaluate(list(states), list(inputs))[f"der({drive.body.rate})"] > 0.0

    if not pushes_on(0.0):
        return 0.0
    low, high = 0.0, 1.0
    while pushes_on(high) and math.isfinite(high):
        low, high = high, 2.0 * high
    while high - low > 1e-12 * high:
        middle = (low + high) / 2.0
        low, high = (middle, high) if pushes_on(middle) else (low, middle)
    return low


def _by_contour(drive: KnownDrive, way: float) -> float:
    """Return the size of the torque at rest at the end of the contour; infinite without a cam."""
    plant, spring = drive.plant, series_spring(drive.plant)
    ends = [plant.values[cam.last_angle] for cam in spring.cams if cam.last_angle]
    if not ends:
        return math.inf
    angle = way * min(ends) / abs(drive.spring_turns_value)
    state = rest_state(plant, {drive.body.motion: angle, drive.body.rate: 0.0})
    return abs(plant.evaluate(list(state))[spring.effort])
