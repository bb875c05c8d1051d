"""Torque of a model against a target."""

from __future__ import annotations

import numpy as np

from ...model import FlatModel
from ..curves.target import Target
from ..statics.equilibrium import torque_function
from .result import TorqueCheck

_ANGLES = 801


def torque_check(model: FlatModel, *, target: Target, spring: str | None = None) -> TorqueCheck:
    """Return the equilibrium torque of a model against a target.

    ``spring``: path of the spring; decided from the structure if it is left out.
    """
    angles = np.linspace(0.0, target.last_angle, _ANGLES)
    torque = torque_function(model, spring)(angles.reshape(1, -1), model.start(model.parameters))
    values = np.array(torque, dtype=float).ravel()
    return TorqueCheck(angles, values, target.torque(angles), target.weight(angles))
