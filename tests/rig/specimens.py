"""A strip in a tensile machine: a strain that is prescribed, a force that is read.

    F = A (E ε + M) with dM/dt = k dε/dt − M/τ           ε = x / L
    σ* = E ε (1 + c ⟨ε − ε₁⟩/ε₁),  sliders: σ_i = clip(σ_i + k_i Δε, ±y_i),  second branch like M

The branches are advanced by their exact solution for a strain that runs straight over a step of 1 ms.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, replace
from math import exp

import numpy as np

from .conditions import first_order_noise
from .kinds import BUILD, COMMAND, EFFECT, NOISE, stream

STEP = 1.0e-3  # s
REST_LENGTH, AREA = 0.06, 1.2e-5  # m, m²


@dataclass(frozen=True)
class Strip:
    """Numbers of the strip."""

    modulus: float = 4.0e5  # Pa
    branch: float = 2.5e5  # Pa
    viscosity: float = 4.0e5  # Pa·s


@dataclass(frozen=True)
class MissingInStrip:
    """What is hidden in strip and load cell; all vanish at these values."""

    second: float = 0.0  # Pa, of one more branch
    second_time: float = 0.1  # s
    slider: float = 0.0  # Pa, at which four sliders have slipped
    stiffening: float = 0.0
    engage: float = 0.3  # strain
    softening: float = 0.0  # share lost below the largest strain so far
    grip_friction: float = 0.0  # N
    slack: float = 0.0  # m
    bias: float = 0.0  # N
    gain: float = 0.0
    delay: float = 0.0  # s
    drift: float = 0.0  # N/s
    cold: float = 0.0  # share of all stresses that a step of temperature takes
    slips: float = 0.0  # m, by which the grip slips when the pull is hardest
    hum: float = 0.0  # N


EFFECTS = (
    "second_relaxation", "rate_independent_hysteresis", "strain_stiffening", "coulomb_friction",
    "force_sensor_bias", "force_sensor_delay", "force_sensor_drift", "cable_slack",
)  # fmt: skip
PAIRS = (
    ("second_relaxation", "force_sensor_bias"), ("strain_stiffening", "second_relaxation"),
    ("rate_independent_hysteresis", "force_sensor_delay"),
)  # fmt: skip
NOT_LISTED = ("temperature_step", "grip_slips", "mains_hum")
FORCE_NOISE, QUANTUM = 0.01, 2e-6  # N, m


def strip_sizes(draw: np.random.Generator) -> dict[str, dict[str, float]]:
    """Return the fields of `MissingInStrip` that each effect sets at strength 1."""
    about = 1.3 ** draw.uniform(-1.0, 1.0, size=3)
    return {
        "second_relaxation": {"second": 1.2e5, "second_time": 0.12 * about[0]},
        "rate_independent_hysteresis": {"slider": 3.0e4},
        "strain_stiffening": {"stiffening": 0.7, "engage": 0.28 * about[1]},
        "coulomb_friction": {"grip_friction": 0.12},
        "force_sensor_bias": {"bias": 0.12},
        "force_sensor_delay": {"delay": 0.03},
        "force_sensor_drift": {"drift": 0.012},
        "cable_slack": {"slack": 1.5e-3},
        "temperature_step": {"cold": 0.15},
        "grip_slips": {"slips": 2e-3},
        "mains_hum": {"hum": 0.08},
    }


_SHAPES = frozenset({"second_time", "engage"})


def built_strip(effects: tuple[str, ...], strength: float, seed: int) -> tuple[Strip, MissingInStrip]:
    """Return the strip as it is, within the declared spread, and what is hidden in it."""
    u = stream(seed, BUILD).uniform(-1.0, 1.0, size=3)
    plain = Strip()
    strip = Strip(
        plain.modulus * (1.0 + 0.06 * u[0]), plain.branch * (1.0 + 0.06 * u[1]), plain.viscosity * 1.3 ** u[2]
    )
    known, missing = strip_sizes(stream(seed, EFFECT)), MissingInStrip()
    for effect in effects:
        for field, size in known[effect].items():
            missing = replace(missing, **{field: size if field in _SHAPES else strength * size})
    return strip, missing


def strains(draw: np.random.Generator) -> Mapping[str, np.ndarray]:
    """Return the way of the grip at every step, m, by the name of the record."""
    made = {}
    for frequency, duration in ((0.1, 14.0), (0.4, 8.0), (1.5, 5.0)):
        time = np.arange(round(duration / STEP)) * STEP
        made[f"cycles_{frequency:g}Hz"] = _pulled(
            time, 0.5 * (1.0 - np.cos(2.0 * np.pi * frequency * (time - 0.3)))
        )
    time = np.arange(round(12.0 / STEP)) * STEP
    rise = np.clip((time[:, None] - np.array([0.3, 4.0, 7.0, 9.5])) / 0.4, 0.0, 1.0)
    made["hold"] = _pulled(time, (rise * rise * (3.0 - 2.0 * rise)) @ np.array([0.5, 0.45, -0.6, 0.3]))
    for number in range(2):
        time = np.arange(round(9.0 / STEP)) * STEP
        turns = np.array([0.15, 0.4, 0.9, 1.9])
        wave = np.sin(2.0 * np.pi * turns * time[:, None] + draw.uniform(0.0, 2.0 * np.pi, 4)) @ turns**-0.7
        made[f"mixed_{number + 1}"] = _pulled(time, (wave - wave.min()) / np.ptp(wave))
    return made


def _pulled(time: np.ndarray, share: np.ndarray) -> np.ndarray:
    x = np.clip((time - 0.3) / 0.5, 0.0, 1.0)
    way: np.ndarray = 0.45 * REST_LENGTH * x * x * (3.0 - 2.0 * x) * share
    return way


def force_of(strip: Strip, missing: MissingInStrip, way: np.ndarray) -> np.ndarray:
    """Return the true force of the strip at every step, N."""
    yields, rates = (0.15, 0.25, 0.3, 0.3), (8.0, 4.0, 2.0, 1.0)
    sliders, branches = [0.0] * 4, [0.0, 0.0]
    laws = [(strip.branch, strip.viscosity / strip.branch), (missing.second, missing.second_time)]
    before = largest = 0.0
    slipped, top = 0.0, float(np.max(way))
    forces = np.empty_like(way)
    for i, stretch in enumerate((way / REST_LENGTH).tolist()):
        if missing.slips and stretch * REST_LENGTH > 0.98 * top:
            slipped = missing.slips
        strain = (
            max(stretch - (missing.slack + slipped) / REST_LENGTH, 0.0)
            if missing.slack or slipped
            else stretch
        )
        change, before = strain - before, strain
        stress = strip.modulus * strain
        if missing.stiffening:
            stress *= 1.0 + missing.stiffening * max(strain - missing.engage, 0.0) / missing.engage
        for number, (modulus, time) in enumerate(laws):
            if modulus:
                fade = exp(-STEP / time)
                branches[number] = fade * branches[number] + modulus * change * (1.0 - fade) * time / STEP
                stress += branches[number]
        if missing.slider:
            for number, (share, rate) in enumerate(zip(yields, rates, strict=True)):
                limit = share * missing.slider
                moved = sliders[number] + rate * missing.slider * change * 4.0
                sliders[number] = min(max(moved, -limit), limit)
            stress += sum(sliders)
        if missing.softening:
            largest = max(largest, strain)
            stress *= 1.0 - missing.softening * (1.0 - strain / largest if largest else 0.0)
        # What hangs slack in its grips, or on a cable that is too long, cannot push.
        forces[i] = AREA * (max(stress, 0.0) if missing.slack else stress)
    return forces


def strip_records(
    effects: tuple[str, ...], strength: float, seed: int, condition: str
) -> dict[str, np.ndarray]:
    """Return the tables of a set: time (s), way (m), force (N)."""
    strip, missing = built_strip(effects, strength, seed)
    every = 20 if condition == "slow" else 5
    quantum = 1e-4 if condition == "coarse" else QUANTUM
    made = {}
    for number, (name, way) in enumerate(strains(stream(seed, COMMAND)).items()):
        draw, time = stream(seed, NOISE, number), np.arange(len(way)) * STEP
        force = force_of(strip, missing, way)
        if missing.grip_friction:
            turning = np.gradient(way, STEP)
            force = force + missing.grip_friction * np.sign(np.where(np.abs(turning) > 1e-6, turning, 0.0))
        if missing.cold:
            force = force * np.where(time > 0.55 * time[-1], 1.0 - missing.cold, 1.0)
        if missing.delay:
            force = np.interp(time - missing.delay, time, force)
        force = (1.0 + missing.gain) * force + missing.bias + missing.drift * time
        force = force + missing.hum * np.sin(2.0 * np.pi * 3.7 * time)
        table = np.column_stack([time, quantum * np.round(way / quantum), force])[::every]
        table[:, 2] += FORCE_NOISE * draw.standard_normal(len(table))
        if condition == "coloured":
            table[:, 2] += 1.5 * FORCE_NOISE * first_order_noise(len(table), 8.0, draw)
        made[name] = table
    return made


def strip_deck(names: Mapping[str, str]) -> str:
    """Return what its makers declare; names of grip, clamp, strip and load cell."""
    grip, clamp, strip, cell = (names[role] for role in ("grip", "clamp", "strip", "cell"))
    plain, by = Strip(), 'source = "declared by its makers"'
    return f"""\
[deck]
name = "specimen"
description = "A strip in tension"

[{grip}]
component = "Driven"
domain = "translation"

[{clamp}]
component = "Fixed"
domain = "translation"

[{strip}]
component = "Specimen"
between = ["{grip}", "{clamp}"]
area = {{value = {AREA}, unit = "m^2", {by}}}
rest_length = {{value = {REST_LENGTH}, unit = "m", {by}}}

[{strip}.elastic]
component = "LinearElastic"
modulus = {{value = {plain.modulus}, unit = "Pa", {by}, spread = 0.06}}

[{strip}.relaxing]
component = "Series"

[{strip}.relaxing.spring]
component = "LinearElastic"
modulus = {{value = {plain.branch}, unit = "Pa", {by}, spread = 0.06}}

[{strip}.relaxing.dashpot]
component = "ViscousMaterial"
viscosity = {{value = {plain.viscosity}, unit = "Pa*s", {by}, spread = 0.3}}

[{cell}]
component = "ForceSensor"
of = "{strip}.force"
gain = {{value = 1.0, unit = "1", {by}}}
bias = {{value = 0.0, unit = "N", {by}}}
noise = {{value = {FORCE_NOISE}, unit = "N", {by}}}
"""
