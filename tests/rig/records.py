"""Sensors, and the sets of six records that they leave."""

from __future__ import annotations

from collections.abc import Collection, Mapping

import numpy as np

from .actuators import Actuator, Sensors, as_built
from .bench import History, Servo, simulate
from .commands import RECORDS, STEP, Command, commands
from .effects import Hidden, hidden_effects

# Streams of random numbers, one for each purpose: with the same seed the actuator, the commands and the noise
# are the same whatever is hidden.
_BUILD, _COMMAND, _EFFECT, _NOISE = range(4)


def _stream(seed: int, purpose: int, record: int = 0) -> np.random.Generator:
    return np.random.default_rng([seed, purpose, record])


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
        force(t) = gain · F(t − delay) + bias + drift · t + noise, F = 0 before the record

    Without a noise generator the angle is not rounded either.
    """
    every = round(1.0 / (sensors.sample_rate * STEP))
    late = round(hidden.force_delay / STEP)
    force = np.concatenate([np.zeros(late), _rung(history.force, hidden)])[: history.force.size]
    angle, phase = history.motor_angle, hidden.disc_phase
    table = np.column_stack(
        [
            history.time,
            angle + hidden.eccentricity * (np.sin(angle + phase) - np.sin(phase)),
            history.current + hidden.current_bias,
            hidden.force_gain * force + hidden.force_bias + hidden.force_drift * history.time,
        ]
    )[::every]
    if noise is not None:
        table[:, 1] = sensors.angle_quantum * np.round(table[:, 1] / sensors.angle_quantum)
        table[:, 2] += sensors.current_noise * noise.standard_normal(len(table))
        table[:, 3] += sensors.force_noise * noise.standard_normal(len(table))
    return table


def _rung(force: np.ndarray, hidden: Hidden) -> np.ndarray:
    """Force behind a mass on the cable, x'' + 2 ζ ω x' + ω² x = ω² F with ζ = 0.06; half-implicit steps."""
    if not hidden.resonance:
        return force
    turn, damping = 2.0 * np.pi * hidden.resonance_frequency, 0.06
    place = speed = 0.0
    read = np.empty_like(force)
    for i, value in enumerate(force.tolist()):
        speed += STEP * (turn * turn * (value - place) - 2.0 * damping * turn * speed)
        place += STEP * speed
        read[i] = place
    return (1.0 - hidden.resonance) * force + hidden.resonance * read


def make_records(
    actuator: Actuator,
    effects: Mapping[str, float],
    seed: int,
    *,
    noise: bool = True,
    only: Collection[str] = RECORDS,
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

    Returns
    -------
    dict
        Table of shape (n, 4) for each record: time (s), angle (rad), current (A), force (N).

    Raises
    ------
    ValueError
        If an effect is unknown or its strength negative.
    """
    built, hidden = truth(actuator, effects, seed)
    servo = Servo.for_actuator(actuator)
    told = commands(_stream(seed, _COMMAND))
    return {
        name: measure(
            simulate(built, hidden, servo, told[name]),
            actuator.sensors,
            hidden,
            _stream(seed, _NOISE, number) if noise else None,
        )
        for number, name in enumerate(RECORDS)
        if name in only
    }


def make_record(
    actuator: Actuator, effects: Mapping[str, float], seed: int, command: Command, number: int
) -> np.ndarray:
    """One more record of the actuator behind `make_records`, of a command of one's own.

    The number makes its noise another one than that of the other records; the six of a set have 0 to 5.
    """
    built, hidden = truth(actuator, effects, seed)
    history = simulate(built, hidden, Servo.for_actuator(actuator), command)
    return measure(history, actuator.sensors, hidden, _stream(seed, _NOISE, number))
