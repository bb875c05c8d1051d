"""The friction that a plant declares, read off its equations."""

from __future__ import annotations

from collections.abc import Callable

import casadi as ca

from ....foundation.symbolic import Expression, depends
from ....model.transform import cut, named
from .known_drive import KnownDrive, all_but
from .law_writer import LawWriter


def declared_friction(
    drive: KnownDrive, writer: LawWriter, width: Expression
) -> Callable[[Expression], Expression]:
    """Return what the plant declares to resist its motor as a function of the speed alone, in N·m.

    It is read off the equations: all torques that depend on nothing but the speed of the motor, such as
    those of bearings and of dry friction in its smooth form. Losses that grow with the load are not in
    it. Its change of sign is spread over ±width: f(s)·(1 + ω/s)/2 + f(−s)·(1 − ω/s)/2 with
    s = √(ω² + width²), because a command that passes zero would otherwise make the current jump.

    Parameters
    ----------
    drive
        What is known of the plant.
    writer
        Of the controller; it is given the parameters of the plant that enter.
    width
        In rad/s.
    """
    torque = _speed_torques(drive, writer)

    def smooth(speed: Expression) -> Expression:
        size = ca.sqrt(speed * speed + width * width)
        share = speed / size
        return (torque(size) * (1 + share) + torque(-size) * (1 - share)) / 2

    return smooth


def _speed_torques(drive: KnownDrive, writer: LawWriter) -> Callable[[Expression], Expression]:
    """Return the sum of the torques on the motor that depend on nothing but its speed."""
    known, s = drive.named
    rate = known[drive.body.rate]
    others = ca.vertcat(s.time, all_but(s.state, rate), s.input)
    by_speed = [
        v.name
        for v in drive.plant.signals
        if v.unit == "N*m" and depends(known[v.name], rate) and not depends(known[v.name], others)
    ]
    if not by_speed:
        return lambda speed: ca.SX(0)
    # Cut at all of them at once, a torque inside another one of them has no effect of its own.
    opened = cut(drive.plant, by_speed)
    after = opened.symbols()
    within = named(opened, after)
    acceleration = after.derivative[[v.name for v in opened.states].index(drive.body.rate)]
    total = ca.SX(0)
    for name in by_speed:
        share = -within[drive.body.inertia or ""] * ca.jacobian(acceleration, within[name])
        if not depends(share, ca.vertcat(after.state, after.input)):
            total += ca.substitute(share, after.parameter, s.parameter) * known[name]
    placed = drive.written(writer, total)
    return lambda speed: ca.SX(ca.substitute(placed, rate, speed))
