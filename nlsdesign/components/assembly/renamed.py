"""Names that components and their numbers had before, and what to write instead."""

from __future__ import annotations

from ...errors import UnknownNameError

COMPONENTS: dict[str, str] = {
    "DelayedForceSensor": "TransportDelay of the force, and a ForceSensor of its reading",
    "DelayedMotor": 'GearedMotor with chain=(("delay", DriveDelay(...)),); in a deck with [motor.delay]',
    "DriftingForceSensor": "Drift of the force, and a ForceSensor of its reading",
    "EccentricEncoder": "Eccentricity of the angle, and an Encoder of its reading",
    "SampledEncoder": "SampleAndHold of the angle, and an Encoder of its reading",
    "SaturatingMotor": 'GearedMotor with chain=(("saturation", DriveSaturation(...)),); '
    "in a deck with [motor.saturation]",
}
"""What stands for a component of an old name: the new name first, then what else to say."""


def renamed(name: str) -> UnknownNameError | None:
    """Return the error that says the new name of a component; ``None`` if the name was never one.

    Parameters
    ----------
    name
        As written.
    """
    if name not in COMPONENTS:
        return None
    return UnknownNameError(
        f"component '{name}'", "has another name now", next_step=f"write {COMPONENTS[name]}"
    )
