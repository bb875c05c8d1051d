"""Hidden effects: what may be wrong with a bench, how large it is at strength 1.

Sizes are shares of what the declared actuator does at 45° at rest (torque T, force F, extension δ, tangent
stiffness S of the rubber) so that they are alike on every actuator:

================================  ============================================================================
coulomb_friction                  level 0.12 T
stribeck_friction                 sliding level 0.08 T, breakaway level 0.20 T, Stribeck speed about 0.3 rad/s
load_dependent_friction           level 0.10 |torque of the spring|
rubbing_spot (no catalogue)       level 0.25 T exp(−((θ − 0.25)/0.06)²), a cam that touches its housing
torque_ripple                     0.08 T sin(order · θ + phase)
backlash                          gap 0.05 rad between the motor side and the cam side
periodic_disturbance (no cat.)    0.17 T sin(2π f t + phase) on the motor side, f about 7 Hz
second_relaxation                 Maxwell branch of 1.2 k with a relaxation time of about 1 s
rate_independent_hysteresis       sliders, 0.08 F together, 0.6 S together as long as they stick
cable_compliance                  stiffness 5 S / strength, in series with the rubber
cable_slack                       0.05 δ of dead extension
cam_angle_offset                  cam turned by 0.04 rad against the encoder
current_sensor_bias               0.06 T / torque per ampere
force_sensor_bias                 0.03 F
force_sensor_gain                 factor 1.15
force_sensor_delay                10 ms
================================  ============================================================================

"About" means: times 1.3ᵘ with u uniform in (−1, 1), drawn from the seed.  Strength multiplies the size.
"""

from __future__ import annotations

import difflib
from collections.abc import Mapping
from dataclasses import dataclass, replace

import numpy as np

from .actuators import Actuator


@dataclass(frozen=True)
class Hidden:
    """Physical size of every effect; zero (or infinite cable stiffness) means that it is absent."""

    friction: float = 0.0  # N·m, level while sliding fast
    breakaway: float = 0.0  # N·m, what the level rises by towards standstill
    stribeck_speed: float = 1.0  # rad/s
    load_friction: float = 0.0  # N·m per N·m of spring torque
    spot_friction: float = 0.0  # N·m, at the middle of the spot
    ripple: float = 0.0  # N·m
    ripple_order: float = 1.0  # per turn of the cam
    ripple_phase: float = 0.0  # rad
    gap: float = 0.0  # rad, from stop to stop
    disturbance: float = 0.0  # N·m
    disturbance_frequency: float = 1.0  # Hz
    disturbance_phase: float = 0.0  # rad
    branch_modulus: float = 0.0  # Pa
    branch_time: float = 1.0  # s
    slider_force: float = 0.0  # N, all sliders together
    slider_stiffness: float = 0.0  # N/m, all sliders together
    cable_stiffness: float = np.inf  # N/m
    slack: float = 0.0  # m
    cam_offset: float = 0.0  # rad
    current_bias: float = 0.0  # A
    force_bias: float = 0.0  # N
    force_gain: float = 1.0
    force_delay: float = 0.0  # s


@dataclass(frozen=True)
class Scale:
    """What the declared actuator does at 45° at rest."""

    torque: float  # N·m
    force: float  # N
    extension: float  # m
    stiffness: float  # N/m, tangent


def scale_of(actuator: Actuator) -> Scale:
    """Sizes at 45°, from the declared numbers."""
    angle = np.radians(45.0)
    extension = float(actuator.cam.extension(angle))
    force, above = actuator.rubber.equilibrium(np.array([extension, extension + 1e-5]))
    return Scale(
        torque=float(actuator.cam.lever_arm(angle) * force),
        force=float(force),
        extension=extension,
        stiffness=float((above - force) / 1e-5),
    )


def _sizes(actuator: Actuator, draw: np.random.Generator) -> dict[str, dict[str, float]]:
    """Fields of `Hidden` that each effect sets, at strength 1."""
    s = scale_of(actuator)
    about = 1.3 ** draw.uniform(-1.0, 1.0, size=3)
    phase = draw.uniform(0.0, 2.0 * np.pi, size=2)
    return {
        "none": {},
        "coulomb_friction": {"friction": 0.12 * s.torque},
        "stribeck_friction": {
            "friction": 0.08 * s.torque,
            "breakaway": 0.12 * s.torque,
            "stribeck_speed": 0.3 * about[0],
        },
        "load_dependent_friction": {"load_friction": 0.10},
        "rubbing_spot": {"spot_friction": 0.25 * s.torque},
        "torque_ripple": {
            "ripple": 0.08 * s.torque,
            "ripple_order": actuator.ripple_order,
            "ripple_phase": phase[0],
        },
        "backlash": {"gap": 0.05},
        "periodic_disturbance": {
            "disturbance": 0.17 * s.torque,
            "disturbance_frequency": 7.0 * about[1],
            "disturbance_phase": phase[1],
        },
        "second_relaxation": {"branch_modulus": 1.2 * actuator.rubber.k, "branch_time": about[2]},
        "rate_independent_hysteresis": {
            "slider_force": 0.08 * s.force,
            "slider_stiffness": 0.6 * s.stiffness,
        },
        "cable_compliance": {"cable_stiffness": 5.0 * s.stiffness},
        "cable_slack": {"slack": 0.05 * s.extension},
        "cam_angle_offset": {"cam_offset": 0.04},
        "current_sensor_bias": {"current_bias": 0.06 * s.torque / actuator.drivetrain.torque_per_ampere},
        "force_sensor_bias": {"force_bias": 0.03 * s.force},
        "force_sensor_gain": {"force_gain": 1.15},
        "force_sensor_delay": {"force_delay": 0.010},
    }


EFFECTS = (
    "none",
    "coulomb_friction",
    "stribeck_friction",
    "load_dependent_friction",
    "torque_ripple",
    "backlash",
    "second_relaxation",
    "rate_independent_hysteresis",
    "cable_compliance",
    "cable_slack",
    "cam_angle_offset",
    "current_sensor_bias",
    "force_sensor_bias",
    "force_sensor_gain",
    "force_sensor_delay",
)
OUTSIDE_ANY_CATALOGUE = ("periodic_disturbance", "rubbing_spot")

# What an effect changes in shape rather than in size: the strength leaves these alone.
_SHAPES = (
    "stribeck_speed",
    "ripple_order",
    "ripple_phase",
    "disturbance_frequency",
    "disturbance_phase",
    "branch_time",
    "slider_stiffness",
)


def hidden_effects(actuator: Actuator, effects: Mapping[str, float], draw: np.random.Generator) -> Hidden:
    """Sizes of the named effects, each at its strength, added up where two act on the same number.

    Raises
    ------
    ValueError
        If an effect has no such name or a strength is negative or not finite.
    """
    sizes = _sizes(actuator, draw)
    hidden = Hidden()
    for name, strength in effects.items():
        if name not in sizes:
            near = difflib.get_close_matches(name, sizes, n=1)
            raise ValueError(f"the rig has no effect {name!r}" + (f"; nearest: {near[0]!r}" if near else ""))
        if not (np.isfinite(strength) and strength >= 0.0):
            raise ValueError(f"strength of {name} is {strength}; it must be finite and not negative")
        for field, size in sizes[name].items() if strength > 0.0 else ():
            hidden = replace(hidden, **{field: _combined(field, getattr(hidden, field), size, strength)})
    return hidden


def _combined(field: str, present: float, size: float, strength: float) -> float:
    """New value of a field of `Hidden`; a cable gets softer, not stiffer, with the strength."""
    if field in _SHAPES:
        return size
    if field == "cable_stiffness":
        return size / strength
    if field == "force_gain":
        return present + strength * (size - 1.0)
    return present + strength * size
