"""Rubber that remembers and a cable that rubs, with plausible numbers."""

from __future__ import annotations

from nlsdesign.components import (
    MATERIAL,
    ROTATION,
    BoucWen,
    CapstanFriction,
    DamageByMotion,
    Dashpot,
    Following,
    HardeningSpring,
    LargestMotion,
    LossHeat,
    Part,
    PermanentSet,
    SelfHeating,
    SoftWindup,
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
    SelfHeating(
        members=(*_INSIDE, ("loss", Dashpot(damping=30.0))),
        heat=LossHeat(halving_loss=4.0, cooling_time=8.0, relaxing_share=0.5),
    ),
    StressSoftening(members=_INSIDE, curve=DamageByMotion(damage=0.3, damage_motion=5e-3)),
    BoucWen(stiffness=400.0, yield_effort=3.0, exponent=1.5),
    BoucWen(stiffness=0.4, yield_effort=0.03, exponent=1.0, domain=ROTATION),
    BoucWen(stiffness=4e5, yield_effort=3e4, exponent=2.0, domain=MATERIAL),
    HardeningSpring(cubic=3e6, scale=0.01),
    SoftWindup(missing=200.0, width=5e-3),
    SoftWindup(missing=2.0, width=0.1, domain=ROTATION),
    HardeningSpring(cubic=2.0, scale=0.4, domain=ROTATION),
    HardeningSpring(cubic=7e5, scale=0.3, domain=MATERIAL),
)
EXAMPLES: tuple[Part, ...] = _PARTS
