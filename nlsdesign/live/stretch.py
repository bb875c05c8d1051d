"""How far rubber is stretched: by the machine as it is declared, and beyond what is stated of its law."""

from __future__ import annotations

import math
from collections.abc import Iterable, Mapping

import numpy as np

from ..design.optimisation.defaults import StrainEnd
from ..design.statics.equilibrium import cam_function, elastic_law
from ..foundation.arrays import Array
from ..model import FlatModel
from .answers import LiveColumn

_BEYOND = 5e-4
"""Share of the end by which a strain lies beyond it, from which it is stated."""
_CHANGE = (
    "limit the largest strain, give it more rest length or less pretension, or take a rubber whose law is "
    "stated to hold so far"
)


def smallest(ends: Mapping[str, StrainEnd]) -> float:
    """Return the least strain of several pieces; infinite without any."""
    return min((each.strain for each in ends.values()), default=math.inf)


def stretched_beyond(ends: Mapping[str, StrainEnd], columns: Iterable[LiveColumn]) -> tuple[str, ...]:
    """Return where rubber is stretched beyond what is stated of it, how far, and what to change."""
    angle, *others = columns
    rows = {each.name: each.values for each in others}
    sentences = []
    for name, end in ends.items():
        strains = rows[f"{name}.strain"]
        beyond = strains > end.strain * (1.0 + _BEYOND)
        if np.any(beyond):
            first, last = (math.degrees(angle.values[beyond][k]) for k in (0, -1))
            sentences.append(
                f"{name} is stretched to {100.0 * float(strains.max()):.4g} % between {first:.3g}° and "
                f"{last:.3g}°, but {end.reason}: {_CHANGE}"
            )
    return tuple(sentences)


def declared_strain(model: FlatModel, angles: Array) -> float | None:
    """Return the largest strain of rubber of the machine as it is declared; ``None`` without rubber."""
    law = elastic_law(model)
    if not law.specimens:
        return None
    parameters = model.start(model.parameters)
    extensions = np.array(cam_function(model)(angles.reshape(1, -1), parameters)[1]).ravel()
    stretched = model.values[law.cam.pretension] + extensions
    strains = np.array([np.array(law.function(float(e), parameters)[2]).ravel() for e in stretched])
    return float(strains.max())
