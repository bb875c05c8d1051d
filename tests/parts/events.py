"""One instance of each part that sticks, strikes, or has backlash."""

from __future__ import annotations

from nlsdesign.components import (
    ROTATION,
    Backlash,
    CoulombFriction,
    EndStop,
    GearFriction,
    LoadFriction,
    LuGreFriction,
    Part,
    RigidStop,
    Rounded,
    Slack,
    Spring,
    StribeckFriction,
)

_SPRING = (("spring", Spring(stiffness=3.4, domain=ROTATION)),)

EXAMPLES: tuple[Part, ...] = (
    CoulombFriction(sliding_effort=0.02),
    StribeckFriction(sliding_effort=0.02, breakaway=0.01, stribeck_speed=0.5),
    GearFriction(ratio=0.1, members=_SPRING),
    LoadFriction(ratio=0.1, members=_SPRING),
    LuGreFriction(
        stiffness=120.0, bristle_damping=0.1, damping=1e-3,
        sliding_effort=0.02, breakaway=0.01, stribeck_speed=0.5,
    ),
    EndStop(lower=-1.5, upper=1.5, stiffness=2000.0, damping=0.1),
    EndStop(lower=-1.5, upper=1.5, stiffness=2000.0, damping=0.1, contact=Rounded(width=1e-3)),
    RigidStop(lower=-1.5, upper=1.5, restitution=0.5),
    Backlash(gap=0.005, members=_SPRING),
    Slack(length=0.002, members=(("spring", Spring(stiffness=2500.0)),)),
)  # fmt: skip
