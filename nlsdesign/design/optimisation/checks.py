"""Torque of a model against a target, and over the spread of the moduli."""

from __future__ import annotations

import itertools

import numpy as np
from numpy.typing import NDArray

from ...model import FlatModel
from ...model.roles import series_spring
from ..curves.target import Target
from ..statics.equilibrium import torque_function
from .result import Sensitivity, TorqueCheck

Floats = NDArray[np.float64]

_ANGLES = 801
_MOST_MODULI = 10


def torque_check(model: FlatModel, *, target: Target, spring: str | None = None) -> TorqueCheck:
    """Return the equilibrium torque of a model against a target.

    Parameters
    ----------
    model
        Flat model of the actuator.
    target
        Torque curve.
    spring
        Path of the spring; decided from the structure if it is left out.

    Raises
    ------
    ArrangementError
        If the structure does not say which spring is meant.
    """
    angles = np.linspace(0.0, target.last_angle, _ANGLES)
    torque = torque_function(model, spring)(angles.reshape(1, -1), model.start(model.parameters))
    values = np.array(torque, dtype=float).ravel()
    return TorqueCheck(angles, values, target.torque(angles), target.weight(angles))


def torque_sensitivity(model: FlatModel, *, target: Target, spring: str | None = None) -> Sensitivity:
    """Return the worst rms torque error over the corners of the moduli's stated spread.

    The torque is linear in the moduli for the laws of this project, so the rms error is convex in them and
    its largest value lies at a corner. With more than ten moduli only the two common corners are looked at.

    Parameters
    ----------
    model
        Flat model of the actuator.
    target
        Torque curve.
    spring
        Path of the spring; decided from the structure if it is left out.

    Raises
    ------
    ArrangementError
        If the structure does not say which spring is meant.
    """
    angles = np.linspace(0.0, target.last_angle, 201)
    wanted, numbers = target.torque(angles), model.start(model.parameters)
    law, inside = torque_function(model, spring), set(series_spring(model, spring).parameters)

    def torque(deviations: dict[int, float]) -> Floats:
        changed = numbers.copy()
        for index, deviation in deviations.items():
            changed[index] *= 1.0 + deviation
        return np.array(law(angles.reshape(1, -1), changed), dtype=float).ravel()

    nominal = torque({})
    moduli = [
        (i, v)
        for i, v in enumerate(model.parameters)
        if v.name in inside and v.unit == "Pa" and v.spread > 0.0
        if np.max(np.abs(torque({i: v.spread}) - nominal)) > 1e-9 * target.largest
    ]
    if not moduli:
        return Sensitivity(TorqueCheck(angles, nominal, wanted).rms, ())
    signs = (
        itertools.product((-1.0, 1.0), repeat=len(moduli))
        if len(moduli) <= _MOST_MODULI
        else [(s,) * len(moduli) for s in (-1.0, 1.0)]
    )
    corners = [{i: sign * v.spread for sign, (i, v) in zip(corner, moduli, strict=True)} for corner in signs]
    errors = [TorqueCheck(angles, torque(corner), wanted).rms for corner in corners]
    worst = int(np.argmax(errors))
    return Sensitivity(errors[worst], tuple((v.name, corners[worst][i]) for i, v in moduli))
