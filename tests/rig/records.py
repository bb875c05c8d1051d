"""Sensors, and the sets of six records that they leave."""

from __future__ import annotations

from collections.abc import Collection, Mapping
from functools import lru_cache

import numpy as np

from .actuators import Actuator, Sensors, as_built
from .bench import History, Servo, simulate
from .commands import RECORDS, STEP, Command, commands
from .conditions import PLAIN, Conditions
from .effects import Hidden, hidden_effects

# Streams of random numbers, one for each purpose: with the same seed the actuator, the commands and the noise
# are the same whatever is hidden.
_BUILD, _COMMAND, _EFFECT, _NOISE, _CONDITIONS, _MISTAKE = range(6)


def _stream(seed: int, purpose: int, record: int = 0) -> np.random.Generator:
    return np.random.default_rng([seed, purpose, record])


def stream_of_mistakes(seed: int) -> np.random.Generator:
    """Random numbers for what the makers declare wrongly."""
    return _stream(seed, _MISTAKE)


def truth(actuator: Actuator, effects: Mapping[str, float], seed: int) -> tuple[Actuator, Hidden]:
    """The actuator as built, and the sizes of what is hidden, behind the records of `make_records`."""
    return (
        as_built(actuator, _stream(seed, _BUILD)),
        hidden_effects(actuator, effects, _stream(seed, _EFFECT)),
    )


def measure(
    history: History, sensors: Sensors, hidden: Hidden, noise: np.random.Generator | None
) -> np.ndarray:
    """Sample the true signals: time (s), angle (rad), current (A), force (N), shape (n, 4).

        angle = quantum · round((θₘ + A sin(θₘ + φ) − A sin φ) / quantum)
        current = I + bias + noise
        force(t) = gain · F(t' − delay) + bias + drift · t + chirp + noise, t' = (1 + error) t,
                   F = 0 before the record; the gain grows with |F| where the sensor is not linear

    Without a noise generator the angle is not rounded either.
    """
    every = round(1.0 / (sensors.sample_rate * STEP))
    late = round(hidden.force_delay / STEP)
    force = np.concatenate([np.zeros(late), _rung(history.force, hidden)])[: history.force.size]
    time = history.time
    if hidden.clock_error:
        force = np.interp((1.0 + hidden.clock_error) * time, time, force)
    force = force * (1.0 + hidden.force_curve * np.abs(force))
    if hidden.chirp:
        turns = (hidden.chirp_frequency + hidden.chirp_rate * time) * time
        force = force + hidden.chirp * np.sin(2.0 * np.pi * turns)
    angle, phase = history.motor_angle, hidden.disc_phase
    table = np.column_stack(
        [
            time,
            angle + hidden.eccentricity * (np.sin(angle + phase) - np.sin(phase)),
            history.current + hidden.current_bias,
            hidden.force_gain * force + hidden.force_bias + hidden.force_drift * time,
        ]
    )[::every]
    if noise is not None:
        table[:, 1] = sensors.angle_quantum * np.round(table[:, 1] / sensors.angle_quantum)
        table[:, 2] += sensors.current_noise * noise.standard_normal(len(table))
        table[:, 3] += sensors.force_noise * noise.standard_normal(len(table))
    return table


def _rung(force: np.ndarray, hidden: Hidden) -> np.ndarray:
    """Force behind a mass on the cable, x'' + 2 ζ ω x' + ω² x = ω² F with ζ = 0.06; half-implicit steps.

    The same with ζ = 0.7 is a filter in the amplifier of the sensor.
    """
    if hidden.lowpass:
        force = _second_order(force, 1.0 / hidden.lowpass, 0.7)
    if not hidden.resonance:
        return force
    read = _second_order(force, 2.0 * np.pi * hidden.resonance_frequency, 0.06)
    return (1.0 - hidden.resonance) * force + hidden.resonance * read


def _second_order(force: np.ndarray, turn: float, damping: float) -> np.ndarray:
    place = speed = 0.0
    read = np.empty_like(force)
    for i, value in enumerate(force.tolist()):
        speed += STEP * (turn * turn * (value - place) - 2.0 * damping * turn * speed)
        place += STEP * speed
        read[i] = place
    return read


def make_records(
    actuator: Actuator,
    effects: Mapping[str, float],
    seed: int,
    *,
    noise: bool = True,
    only: Collection[str] = RECORDS,
    conditions: Conditions = PLAIN,
) -> dict[str, np.ndarray]:
    """Six bench records of an actuator with hidden effects.

    Parameters
    ----------
    actuator
        As declared; the records come from one that lies within the declared spread, drawn from the seed.
    effects
        Strength of each effect by its name; 1 is the usual size, {} or {"none": 1.0} hides nothing.
    seed
        Fixes actuator, multisine, noise and the incidental numbers of the effects.
    noise
        False gives records without noise and without the rounding of the encoder.
    only
        Names of the records to make; each is the same as in the full set.
    conditions
        Under which the sensors read.

    Returns
    -------
    dict
        Table of shape (n, 4) for each record: time (s), angle (rad), current (A), force (N).

    Raises
    ------
    ValueError
        If an effect is unknown or its strength negative.
    """
    _, hidden = truth(actuator, effects, seed)
    sensors, strengths = conditions.sensors(actuator.sensors), tuple(effects.items())
    made = {}
    for number, name in enumerate(RECORDS):
        if name in only:
            draw = _stream(seed, _NOISE, number) if noise else None
            table = measure(_history(actuator, strengths, seed, name), sensors, hidden, draw)
            made[name] = conditions.disturbed(table, sensors, _stream(seed, _CONDITIONS, number))
    return made


@lru_cache(maxsize=4)
def _commands(seed: int) -> dict[str, Command]:
    """The commands of one set; they are drawn together, whichever of its records are made."""
    return commands(_stream(seed, _COMMAND))


@lru_cache(maxsize=24)
def _history(actuator: Actuator, effects: tuple[tuple[str, float], ...], seed: int, name: str) -> History:
    """True signals behind one record of a set; tests of one machine ask for the same several times."""
    wanted = _commands(seed)[name]
    return simulate(*truth(actuator, dict(effects), seed), Servo.for_actuator(actuator), wanted)


def make_record(
    actuator: Actuator, effects: Mapping[str, float], seed: int, command: Command, number: int
) -> np.ndarray:
    """One more record of the actuator behind `make_records`, of a command of one's own.

    The number makes its noise another one than that of the other records; the six of a set have 0 to 5.
    """
    built, hidden = truth(actuator, effects, seed)
    history = simulate(built, hidden, Servo.for_actuator(actuator), command)
    return measure(history, actuator.sensors, hidden, _stream(seed, _NOISE, number))
