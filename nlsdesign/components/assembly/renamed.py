"""Names that components and their numbers had before, and what to write instead."""

from __future__ import annotations

from ...foundation.errors import UnknownNameError

COMPONENTS: dict[str, str] = {
    "CableGuide": "CapstanFriction with guide=WrapProduct(wrap=...); in a deck with wrap",
    "ConstantForce": "ConstantLoad, with its load in N",
    "DryFriction": "CoulombFriction, which sticks unless it has a creep_speed",
    "DryLoadFriction": "LoadFriction, which sticks unless it has a creep_speed",
    "DryStribeckFriction": "StribeckFriction, which sticks unless it has a creep_speed",
    "DelayedForceSensor": "TransportDelay of the force, and a ForceSensor of its reading",
    "DelayedMotor": 'GearedMotor with chain=(("delay", DriveDelay(...)),); in a deck with [motor.delay]',
    "DriftingForceSensor": "Drift of the force, and a ForceSensor of its reading",
    "DrivenPoint": 'Driven with domain=TRANSLATION; in a deck with domain = "translation"',
    "EccentricEncoder": "Eccentricity of the angle, and an Encoder of its reading",
    "FixedPoint": 'Fixed with domain=TRANSLATION; in a deck with domain = "translation"',
    "InertialBacklash": "Backlash with contact=Inertial(inertia=...); in a deck with inertia",
    "LooseCable": "Slack, which is sharp unless it has a width",
    "MisshapenCam": "CamWithProfileError",
    "Play": "Backlash, which is sharp unless it has a width or an inertia",
    "RoundedEndStop": "EndStop with contact=Rounded(width=...); in a deck with width",
    "SampledEncoder": "SampleAndHold of the angle, and an Encoder of its reading",
    "SaturatingMotor": 'GearedMotor with chain=(("saturation", DriveSaturation(...)),); '
    "in a deck with [motor.saturation]",
    "SlidingFriction": "CoulombFriction, with its sliding_effort in N",
    "SmoothStrainStiffening": "StrainStiffening with contact=Rounded(width=...); in a deck with width",
    "Softening": "StressSoftening with curve=OgdenRoxburgh(...); in a deck with strength and scale",
    "TensionSet": "PermanentSet with memory=Following(...); in a deck with following",
    "TorsionDashpot": "Dashpot, with its damping in N·m·s/rad",
    "TorsionSpring": "Spring, with its stiffness in N·m/rad",
    "ViscousHeating": "SelfHeating with heat=ViscousHeat(...); in a deck with halving_speed",
    "WorkHeating": "SelfHeating with heat=WorkHeat(...); in a deck with halving_work",
}
"""What stands for a component of an old name: the new name first, then what else to say."""

NUMBERS: dict[str, str] = {"sliding_force": "sliding_effort", "sliding_torque": "sliding_effort"}
"""New name of a number by its old one."""


def renamed(name: str) -> UnknownNameError | None:
    """Return the error that says the new name of a component; ``None`` if the name was never one."""
    if name not in COMPONENTS:
        return None
    return UnknownNameError(
        f"component '{name}'", "has another name now", next_step=f"write {COMPONENTS[name]}"
    )
