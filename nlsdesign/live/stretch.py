"""How far rubber is stretched: by the machine as it is declared, and beyond what is stated of its law."""

from __future__ import annotations

import math
from collections.abc import Iterable, Mapping
from typing import NamedTuple

import numpy as np

from ..design.statics.equilibrium import cam_function, elastic_law
from ..foundation.arrays import Array
from ..model import FlatModel
from ..model.roles import series_cam
from ..model.spring_structure import SpecimenNames
from .answers import LiveColumn

BREAKS = 5.0
"""Nominal strain at which soft rubbers break, for rubber of which nothing is stated: the tensile curve of
PMC-770 ends there (Schepelmann 2014)."""
_BEYOND = 5e-4
"""Share of the end by which a strain lies beyond it, from which it is stated."""
_CHANGE = (
    "limit the largest strain, give it more rest length or less pretension, or take a rubber whose law is "
    "stated to hold so far"
)


class StrainEnd(NamedTuple):
    """Strain up to which a piece of rubber may be believed, and what says so."""

    strain: float
    reason: str


def strain_ends(model: FlatModel) -> dict[str, StrainEnd]:
    """Return how far each piece of rubber behind the cam may be stretched, by its path."""
    return {piece.name: _end_of(model, piece) for piece in series_cam(model).specimens}


def smallest(ends: Mapping[str, StrainEnd]) -> float:
    """Return the least strain of several pieces; infinite without any."""
    return min((each.strain for each in ends.values()), default=math.inf)


def _end_of(model: FlatModel, piece: SpecimenNames) -> StrainEnd:
    """Return the least of what the laws beside each other in a piece state, and its elongation at break."""
    ends = [
        StrainEnd(v.maximum, f"its law is stated to hold up to {100.0 * v.maximum:.4g} %")
        for v in model.signals
        if v.bounded
        and math.isfinite(v.maximum)
        and v.name.startswith(f"{piece.name}.")
        and v.name.endswith(".strain")
        # Laws further inside share the strain of the piece with others in series.
        and v.name.count(".") == piece.name.count(".") + 2
    ]
    if piece.elongation_at_break is not None:
        breaks = model.values[piece.elongation_at_break]
        ends.append(StrainEnd(breaks, f"it is declared to break at {100.0 * breaks:.4g} %"))
    unknown = StrainEnd(
        BREAKS, f"nothing is stated of its rubber, and soft rubbers break at {100 * BREAKS:g} %"
    )
    return min(ends, default=unknown)


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
