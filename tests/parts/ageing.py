"""Rubber that remembers and a cable that rubs, with plausible numbers."""

from __future__ import annotations

from nlsdesign.components import (
    CableGuide,
    Part,
    Spring,
    StressSoftening,
    TensionSet,
    ViscousHeating,
    WorkHeating,
)

_INSIDE = (("band", Spring(stiffness=2500.0)),)
_PARTS: tuple[Part, ...] = (
    CableGuide(members=_INSIDE, wrap=0.12),
    TensionSet(members=_INSIDE, share=0.05),
    WorkHeating(members=_INSIDE, halving_work=40.0, cooling_time=8.0),
    StressSoftening(members=_INSIDE, softening=0.2),
    ViscousHeating(members=_INSIDE, halving_speed=0.3, cooling_time=8.0),
)
EXAMPLES: dict[type[Part], Part] = {type(part): part for part in _PARTS}
