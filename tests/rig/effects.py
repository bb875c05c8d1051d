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
quadratic_drag                    0.006 T per (rad/s)²
drive_delay                       8 ms from the measured current to the torque
torque_constant_saturation        T ∝ I_s arctan(I/I_s), I_s = 1.5 times the current for T
cable_friction                    a guide with the wrap µα = 0.12 between rubber and cam
cam_profile_error                 lever arm larger by 0.12 h(45°) exp(−((θ − 0.4)/0.15)²)
stress_softening                  F* less by 0.25 at zero extension, by 0 at the largest one so far
self_heating                      0.30 per (F δ) of loss, cooling in about 8 s
permanent_set                     0.06 of the largest extension so far
strain_stiffening                 0.2 F at δ, growing with the cube of the extension
force_sensor_drift                0.004 F/s from the start of each record
angle_sensor_eccentricity         0.02 rad · (sin(θ + phase) − sin(phase))
winding_heat                      torque per ampere falls by 0.08/s at the current for T, cooling in 6 s
cable_resonance (no catalogue)    force read through a weakly damped mass at about 18 Hz
load_disturbance (no catalogue)   load side turns by 0.03 rad, about 3.3 Hz
amplifier_dead_zone (no cat.)     0.10 of the current for T makes no torque
temperature_step (no catalogue)   F* less by 0.12 from a moment in the middle of each record on
time_varying_load (no catalogue)  0.12 T sin(2π f t + phase) on the motor side, f about 0.15 Hz
external_push (no catalogue)      0.5 T half a sine of about 0.3 s, once in each record
hardening_stop (no catalogue)     0.5 T at 0.7 rad, growing with the square of the angle from 0.45 rad on
chirping_interference (no cat.)   0.03 F sin(2π (f + r t) t) on the force read, f about 3 Hz, r about 0.8 Hz/s
sensor_lowpass (no catalogue)     force read through x'' + 1.4 ω x' + ω² x = ω² F, ω/2π about 9 Hz / strength
asymmetric_friction               level 0.15 T against positive, 0.05 T against negative motion
constant_torque                   0.06 T
gravity_load                      0.10 T sin(θ)
position_dependent_friction       level 0.10 T (1 + 0.8 sin(2θ + phase))
torque_constant_drift             torque per ampere falls by 0.012/s from the start of each record
force_sensor_nonlinearity         F (1 + 0.12 |F|/F₄₅)
clock_drift                       force read at (1 + 0.004) t, angle and current at t
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
    drag: float = 0.0  # N·m·s²/rad²
    drive_delay: float = 0.0  # s
    saturation: float = 0.0  # 1/A
    wrap: float = 0.0  # µα, of a guide of the cable
    guide_stiffness: float = 0.0  # N/m, while the cable sticks to the guide
    profile_error: float = 0.0  # m, lever arm at the middle of the bump
    softening: float = 0.0  # share of F* that is lost at small extension
    heating: float = 0.0  # 1/J, softness per heat
    cooling_time: float = 1.0  # s
    permanent_set: float = 0.0  # share of the largest extension
    cubic: float = 0.0  # N/m³
    force_drift: float = 0.0  # N/s
    eccentricity: float = 0.0  # rad
    disc_phase: float = 0.0  # rad
    winding_heat: float = 0.0  # 1/(A²·s)
    winding_time: float = 6.0  # s
    resonance: float = 0.0  # share of the force that goes through the mass
    resonance_frequency: float = 18.0  # Hz
    shake: float = 0.0  # rad, of the load side
    shake_frequency: float = 1.0  # Hz
    dead_zone: float = 0.0  # A
    cold: float = 0.0  # share of F* that a rise of temperature takes away at once
    cold_place: float = 0.5  # when, as a share of the record
    slow_load: float = 0.0  # N·m
    slow_frequency: float = 0.15  # Hz
    slow_phase: float = 0.0  # rad
    push: float = 0.0  # N·m, largest of a half sine
    push_place: float = 0.5  # when it begins, as a share of the record
    push_time: float = 0.3  # s
    stop: float = 0.0  # N·m/rad², on the square of the way beyond the place
    stop_place: float = 0.45  # rad
    chirp: float = 0.0  # N
    chirp_frequency: float = 3.0  # Hz, at the start
    chirp_rate: float = 0.8  # Hz/s
    lowpass: float = 0.0  # s, 1/ω of a filter of second order
    constant_torque: float = 0.0  # N·m
    weight: float = 0.0  # N·m, with its arm level
    weight_phase: float = 0.0  # rad
    shaft_share: float = 0.0  # of the inertia of a machine, behind a shaft that twists
    place_friction: float = 0.0  # N·m, mean of a level that goes with the angle
    place_phase: float = 0.0  # rad
    constant_drift: float = 0.0  # 1/s
    force_curve: float = 0.0  # 1/N
    clock_error: float = 0.0  # s/s


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
    later = 1.3 ** draw.uniform(-1.0, 1.0, size=3)
    # Drawn after everything that was there before, so that older records stay as they are.
    place = draw.uniform(0.35, 0.65, size=2)
    last = 1.3 ** draw.uniform(-1.0, 1.0, size=5)
    angle = draw.uniform(0.0, 2.0 * np.pi, size=2)
    current = s.torque / actuator.drivetrain.torque_per_ampere
    lever_arm = float(actuator.cam.lever_arm(np.radians(45.0)))
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
        "quadratic_drag": {"drag": 0.006 * s.torque},
        "drive_delay": {"drive_delay": 0.008},
        "torque_constant_saturation": {"saturation": 1.0 / (1.5 * current)},
        "cable_friction": {"wrap": 0.12, "guide_stiffness": 10.0 * s.stiffness},
        "cam_profile_error": {"profile_error": 0.12 * lever_arm},
        "stress_softening": {"softening": 0.25},
        "self_heating": {"heating": 0.30 / (s.force * s.extension), "cooling_time": 8.0 * later[0]},
        "permanent_set": {"permanent_set": 0.06},
        "strain_stiffening": {"cubic": 0.2 * s.force / s.extension**3},
        "force_sensor_drift": {"force_drift": 0.004 * s.force},
        "angle_sensor_eccentricity": {"eccentricity": 0.02, "disc_phase": phase[0]},
        "winding_heat": {"winding_heat": 0.08 / current**2},
        "cable_resonance": {"resonance": 1.0, "resonance_frequency": 18.0 * later[1]},
        "load_disturbance": {"shake": 0.03, "shake_frequency": 3.3 * later[2]},
        "amplifier_dead_zone": {"dead_zone": 0.10 * current},
        "temperature_step": {"cold": 0.12, "cold_place": place[0]},
        "time_varying_load": {
            "slow_load": 0.12 * s.torque, "slow_frequency": 0.15 * last[0], "slow_phase": angle[0],
        },
        "external_push": {"push": 0.5 * s.torque, "push_place": place[1], "push_time": 0.3 * last[1]},
        "hardening_stop": {"stop": 0.5 * s.torque / 0.25**2},
        "chirping_interference": {
            "chirp": 0.03 * s.force, "chirp_frequency": 3.0 * last[2], "chirp_rate": 0.8 * last[3],
        },
        "sensor_lowpass": {"lowpass": 1.0 / (2.0 * np.pi * 9.0 * last[4])},
        "asymmetric_friction": {"friction": 0.10 * s.torque, "constant_torque": -0.05 * s.torque},
        "constant_torque": {"constant_torque": 0.06 * s.torque},
        "gravity_load": {"weight": 0.10 * s.torque},
        "position_dependent_friction": {"place_friction": 0.10 * s.torque, "place_phase": angle[1]},
        "torque_constant_drift": {"constant_drift": 0.012},
        "force_sensor_nonlinearity": {"force_curve": 0.12 / s.force},
        "clock_drift": {"clock_error": 0.004},
    }  # fmt: skip


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
    "quadratic_drag",
    "drive_delay",
    "torque_constant_saturation",
    "cable_friction",
    "cam_profile_error",
    "stress_softening",
    "self_heating",
    "permanent_set",
    "strain_stiffening",
    "force_sensor_drift",
    "angle_sensor_eccentricity",
)
LATER_EFFECTS = (
    "asymmetric_friction",
    "constant_torque",
    "gravity_load",
    "position_dependent_friction",
    "torque_constant_drift",
    "force_sensor_nonlinearity",
    "clock_drift",
    "winding_heat",
)
"""What a catalogue may know as well."""
OUTSIDE_ANY_CATALOGUE = (
    "periodic_disturbance",
    "rubbing_spot",
    "cable_resonance",
    "load_disturbance",
    "amplifier_dead_zone",
    "temperature_step",
    "time_varying_load",
    "external_push",
    "hardening_stop",
    "chirping_interference",
    "sensor_lowpass",
)
STRENGTHS = {"weak": 0.5, "strong": 1.0}
"""The two strengths at which every effect is tried."""

# What an effect changes in shape rather than in size: the strength leaves these alone.
_SHAPES = (
    "stribeck_speed",
    "ripple_order",
    "ripple_phase",
    "disturbance_frequency",
    "disturbance_phase",
    "branch_time",
    "slider_stiffness",
    "guide_stiffness",
    "cooling_time",
    "disc_phase",
    "resonance_frequency",
    "shake_frequency",
    "cold_place",
    "slow_frequency",
    "slow_phase",
    "push_place",
    "push_time",
    "stop_place",
    "chirp_frequency",
    "chirp_rate",
    "place_phase",
    "weight_phase",
)


def hidden_effects(actuator: Actuator, effects: Mapping[str, float], draw: np.random.Generator) -> Hidden:
    """Sizes of the named effects, each at its strength, added up where two act on the same number.

    Raises
    ------
    ValueError
        If an effect has no such name or a strength is negative or not finite.
    """
    return applied(_sizes(actuator, draw), effects)


def applied(sizes: Mapping[str, Mapping[str, float]], effects: Mapping[str, float]) -> Hidden:
    """Sizes of the named effects from the fields that each sets at strength 1; raises as `hidden_effects`."""
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
