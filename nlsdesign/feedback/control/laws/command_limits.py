"""What a torque may be asked for: what the drive can hold, and how fast it can follow at most."""

from __future__ import annotations

import math
from dataclasses import replace

import numpy as np

from ....foundation.errors import ArrangementError
from ....model import FlatModel
from ....model.roles import declared_reading
from .known_drive import KnownDrive, torque_range, torques_by_current, voltage_is_limited
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
        limits, rate = declared_reading(plant, drive.names.angle).limits, math.inf
        if limits is not None:
            slope = float(np.max(stiffness_table(drive).values))
            rate = slope * abs(drive.spring_turns_value) * limits[2]
    except ArrangementError:  # no torque at rest: the drive could hold none; any other error is one
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


def largest_speed(plant: FlatModel) -> float:
    """Return the speed in rad/s that the motor can reach on its contour when its largest current is reversed.

    From rest, as far as the current of one sign holds the spring, with that of the other sign, by energy:
    J·ω²/2 = τ·(θ − θ₀) + E(θ₀) − E(θ). τ is what the current leaves beside friction, E what the spring at
    rest holds. A supply of limited voltage turns the motor no faster than without load, U/k.

    ``plant``: load held.
    """
    drive = KnownDrive(plant)
    numbers = plant.evaluate(list(plant.start(plant.states))) | dict(plant.values)
    table, turns = stiffness_table(drive), abs(drive.spring_turns_value)
    deflections = table.grid * (turns if drive.spring_seen_at_the_motor else 1.0)
    # Torque at rest and energy over the deflections of a spring; both are 0 in the middle.
    results = [table.values[:, 0]]
    for _ in range(2):
        cells = (results[-1][1:] + results[-1][:-1]) / 2.0 * np.diff(deflections)
        summed = np.concatenate([[0.0], np.cumsum(cells)])
        results.append(summed - np.interp(0.0, deflections, summed))
    torques, held = results[1], results[2]
    fastest = 0.0
    for way, against in zip((1.0, -1.0), torques_by_current(plant), strict=True):
        allowed = np.flatnonzero(torques >= -against if way > 0.0 else torques <= against)
        start = allowed[0 if way > 0.0 else -1]
        energy = against * way * (deflections - deflections[start]) + held[start] - held
        fastest = max(fastest, 2.0 * float(np.max(energy)) / numbers[drive.body.inertia or ""])
    speed = math.sqrt(fastest)
    if voltage_is_limited(drive):
        turned = drive.motor.gear_ratio
        constant = numbers[drive.motor.torque_constant] * (numbers[turned] if turned else 1.0)
        speed = min(speed, numbers[f"{drive.body.name}.voltage_limit"] / constant)
    return speed


def rate_remarks(plant: FlatModel) -> list[str]:
    """Return that an encoder of the motor declares less speed than drive and spring can reach, if so."""
    try:
        angle = KnownDrive(plant).names.angle
        limits, speed = declared_reading(plant, angle).limits, largest_speed(plant)
    except ArrangementError:
        return []  # without a series spring and a held load nothing is scheduled
    if limits is None or speed <= limits[2]:
        return []
    return [
        f"largest_rate of the encoder of {angle} is {limits[2]:.4g} rad/s, the drive reaches {speed:.4g} "
        "rad/s when its largest current is reversed: good readings beyond the rate are refused "
        f"-> declare at least {math.ceil(speed):g} rad/s, or a smaller current_limit"
    ]
