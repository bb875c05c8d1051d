"""What a torque may be asked for: what the drive can hold, and how fast it can follow at most."""

from __future__ import annotations

import math
from dataclasses import replace

import numpy as np

from ....foundation.errors import NlsError
from ....model import FlatModel
from ....model.roles import declared_reading
from .known_drive import KnownDrive, torque_range
from .outer_laws import stiffness_table


def with_command_limits(controller: FlatModel, plant: FlatModel) -> FlatModel:
    """Return a torque controller whose desired torque has the range and the largest rate of its drive.

    The range is what the drive can hold, by its largest current and the contour of its cam. The rate is the
    largest slope of the spring's torque at rest over the angle, times the largest speed of the motor that the
    deck declares with its encoder; where it declares none, there is no largest rate. The controller is
    unchanged where the plant has no torque at rest, as where its load moves freely.
    """
    drive = KnownDrive(plant)
    try:
        lowest, highest = torque_range(plant)
        rate = _largest_rate(drive)
    except NlsError:
        return controller
    current = plant.values[drive.motor.current_limit]
    reason = f"what the drive can hold with {current:g} A and on the contour of its cam"
    inputs = []
    for v in controller.inputs:
        if v.name == drive.names.desired:
            v = replace(v, minimum=lowest, maximum=highest, largest_rate=rate, source=reason)
        elif v.name == drive.names.desired_rate:
            v = replace(v, minimum=-rate, maximum=rate)
        inputs.append(v)
    return replace(controller, inputs=tuple(inputs))


def _largest_rate(drive: KnownDrive) -> float:
    """Return how fast the torque of the spring can change at rest, in N·m/s."""
    limits = declared_reading(drive.plant, drive.names.angle).limits
    if limits is None:
        return math.inf
    return float(np.max(stiffness_table(drive).values)) * abs(drive.spring_turns_value) * limits[2]
