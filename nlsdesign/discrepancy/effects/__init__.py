"""The catalogue of missing effects: functions that return an assembly with the effect in it."""

from .ageing import permanent_set, self_heating, stress_softening
from .cable import cable_compliance, cable_friction, cable_slack, cam_angle_offset, cam_profile_error
from .candidate import Candidate, Effect, Unknown, wrapped
from .drive import drive_delay, torque_constant_saturation
from .friction import (
    backlash,
    coulomb_friction,
    load_dependent_friction,
    quadratic_drag,
    stribeck_friction,
    torque_ripple,
)
from .rubber import rate_independent_hysteresis, second_relaxation, strain_stiffening
from .sensing import (
    angle_sensor_eccentricity,
    current_sensor_bias,
    force_sensor_bias,
    force_sensor_delay,
    force_sensor_drift,
    force_sensor_gain,
)
from .sliding import constant_force

ALL: tuple[Effect, ...] = (
    coulomb_friction,
    stribeck_friction,
    load_dependent_friction,
    quadratic_drag,
    torque_ripple,
    backlash,
    current_sensor_bias,
    cable_compliance,
    cable_slack,
    cam_angle_offset,
    second_relaxation,
    rate_independent_hysteresis,
    force_sensor_delay,
    force_sensor_bias,
    force_sensor_gain,
    drive_delay,
    torque_constant_saturation,
    strain_stiffening,
    cam_profile_error,
    angle_sensor_eccentricity,
    stress_softening,
    permanent_set,
    self_heating,
    cable_friction,
    force_sensor_drift,
    constant_force,
)

__all__ = [
    "ALL",
    "Candidate",
    "Effect",
    "Unknown",
    "angle_sensor_eccentricity",
    "backlash",
    "cable_compliance",
    "cable_friction",
    "cable_slack",
    "cam_angle_offset",
    "cam_profile_error",
    "constant_force",
    "coulomb_friction",
    "current_sensor_bias",
    "drive_delay",
    "force_sensor_bias",
    "force_sensor_delay",
    "force_sensor_drift",
    "force_sensor_gain",
    "load_dependent_friction",
    "permanent_set",
    "quadratic_drag",
    "rate_independent_hysteresis",
    "second_relaxation",
    "self_heating",
    "strain_stiffening",
    "stress_softening",
    "stribeck_friction",
    "torque_constant_saturation",
    "torque_ripple",
    "wrapped",
]
