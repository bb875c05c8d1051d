"""One instance of each part that moves along a line."""

from __future__ import annotations

from nlsdesign.components import ConstantForce, LinearDrive, Part, SlidingFriction

EXAMPLES: dict[type[Part], Part] = {
    LinearDrive: LinearDrive(mass=95.1, force_constant=35.15, voltage_limit=10.0),
    SlidingFriction: SlidingFriction(sliding_force=20.4),
    ConstantForce: ConstantForce(load=-3.16),
}
