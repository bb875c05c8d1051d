"""One instance of each part that sticks, strikes, or has play."""

from __future__ import annotations

from nlsdesign.components import (
    DryFriction,
    DryLoadFriction,
    DryStribeckFriction,
    EndStop,
    LooseCable,
    LuGreFriction,
    Part,
    Play,
    RigidStop,
    RoundedEndStop,
    Spring,
    TorsionSpring,
)

_SPRING = (("spring", TorsionSpring(stiffness=3.4)),)

EXAMPLES: dict[type[Part], Part] = {
    DryFriction: DryFriction(sliding_torque=0.02),
    DryStribeckFriction: DryStribeckFriction(sliding_torque=0.02, breakaway=0.01, stribeck_speed=0.5),
    DryLoadFriction: DryLoadFriction(ratio=0.1, members=_SPRING),
    LuGreFriction: LuGreFriction(
        stiffness=120.0, bristle_damping=0.1, damping=1e-3,
        sliding_torque=0.02, breakaway=0.01, stribeck_speed=0.5,
    ),
    EndStop: EndStop(lower=-1.5, upper=1.5, stiffness=2000.0, damping=0.1),
    RoundedEndStop: RoundedEndStop(lower=-1.5, upper=1.5, stiffness=2000.0, damping=0.1, width=1e-3),
    RigidStop: RigidStop(lower=-1.5, upper=1.5, restitution=0.5),
    Play: Play(gap=0.005, members=_SPRING),
    LooseCable: LooseCable(length=0.002, members=(("spring", Spring(stiffness=2500.0)),)),
}  # fmt: skip
