"""Rubber that remembers and a cable that rubs, with plausible numbers."""

from __future__ import annotations

from nlsdesign.components import (
    CapstanFriction,
    Following,
    LargestMotion,
    Part,
    PermanentSet,
    SelfHeating,
    Spring,
    StressSoftening,
    ViscousHeat,
    WorkHeat,
    WrapProduct,
)

_INSIDE = (("band", Spring(stiffness=2500.0)),)
_PARTS: tuple[Part, ...] = (
    CapstanFriction(members=_INSIDE, guide=WrapProduct(wrap=0.12), creep_speed=2e-4),
    PermanentSet(members=_INSIDE, share=0.05, memory=Following()),
    SelfHeating(members=_INSIDE, heat=WorkHeat(halving_work=40.0, cooling_time=8.0)),
    StressSoftening(members=_INSIDE, curve=LargestMotion(softening=0.2)),
    SelfHeating(members=_INSIDE, heat=ViscousHeat(halving_speed=0.3, cooling_time=8.0)),
)
EXAMPLES: tuple[Part, ...] = _PARTS
