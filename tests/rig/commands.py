"""What the servo of the bench is told to do: six angles over time, one for each kind of record.

Every command starts at zero angle and, but for the hold sequence, at zero speed.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

STEP = 5.0e-5  # s, step of the simulation: 20 kHz

SINES = {  # name of the record: amplitude in degrees, frequency in Hz, duration in s
    "sine_25deg_0.1Hz": (25.0, 0.1, 12.0),
    "sine_45deg_0.5Hz": (45.0, 0.5, 8.0),
    "sine_25deg_2.0Hz": (25.0, 2.0, 5.0),
    "sine_15deg_5.0Hz": (15.0, 5.0, 3.0),
}
RAMP = 0.5  # s, over which a sine or multisine grows to its amplitude
HOLDS = (20.0, 40.0, 10.0, -30.0, 0.0, 45.0)  # degrees
HOLD_TIME = 2.0  # s
HOLD_RISE = 0.25  # s, from one angle to the next
MULTISINE = (0.2, 0.5, 0.9, 1.8, 3.0, 4.4)  # Hz
MULTISINE_TIME, MULTISINE_PEAK = 10.0, 33.0  # s, degrees
RECORDS = (*SINES, "hold", "multisine")


@dataclass(frozen=True)
class Command:
    """Wanted angle and speed at every step of the simulation."""

    time: np.ndarray  # s, shape (n,)
    angle: np.ndarray  # rad, shape (n,)
    speed: np.ndarray  # rad/s, shape (n,)


def _smooth(x: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Rise from 0 to 1 with zero speed at both ends, 3x² − 2x³, and its derivative."""
    x = np.clip(x, 0.0, 1.0)
    return x * x * (3.0 - 2.0 * x), 6.0 * x * (1.0 - x)


def _clock(duration: float) -> np.ndarray:
    return np.arange(round(duration / STEP)) * STEP


def sines(time: np.ndarray, amplitudes: np.ndarray, frequencies: np.ndarray, phases: np.ndarray) -> Command:
    """Sum of sines under a ramp w: θ = w Σ Aᵢ sin(2π fᵢ t + φᵢ), speed by the product rule."""
    ramp, slope = _smooth(time / RAMP)
    angle, speed = np.zeros_like(time), np.zeros_like(time)
    for amplitude, frequency, phase in zip(amplitudes, frequencies, phases, strict=True):
        turn = 2.0 * np.pi * frequency
        angle += amplitude * np.sin(turn * time + phase)
        speed += amplitude * turn * np.cos(turn * time + phase)
    return Command(time, ramp * angle, ramp * speed + slope / RAMP * angle)


def hold(time: np.ndarray) -> Command:
    """Angles of `HOLDS` one after the other, each reached by a smooth rise."""
    return steps(time, np.radians(HOLDS), HOLD_TIME, HOLD_RISE)


def steps(time: np.ndarray, angles: np.ndarray, each: float, duration: float) -> Command:
    """Angles (rad) one after the other, every so many seconds, each reached by a smooth rise."""
    angle, speed, before = np.zeros_like(time), np.zeros_like(time), 0.0
    for i, target in enumerate(angles):
        rise, slope = _smooth((time - i * each) / duration)
        angle += (target - before) * rise
        speed += (target - before) * slope / duration
        before = target
    return Command(time, angle, speed)


def multisine(time: np.ndarray, draw: np.random.Generator) -> Command:
    """Six sines of random phase, amplitudes falling as f^(−1/2), scaled to the same peak in every record."""
    frequencies = np.array(MULTISINE)
    phases = draw.uniform(0.0, 2.0 * np.pi, size=frequencies.size)
    raw = sines(time, frequencies**-0.5, frequencies, phases)
    scale = np.radians(MULTISINE_PEAK) / np.max(np.abs(raw.angle))
    return Command(time, scale * raw.angle, scale * raw.speed)


def commands(draw: np.random.Generator) -> dict[str, Command]:
    """The six commands of a set, by the name of the record."""
    made = {
        name: sines(_clock(duration), np.radians([amplitude]), np.array([frequency]), np.zeros(1))
        for name, (amplitude, frequency, duration) in SINES.items()
    }
    made["hold"] = hold(_clock(HOLD_TIME * len(HOLDS)))
    made["multisine"] = multisine(_clock(MULTISINE_TIME), draw)
    return made


def command_of(time: np.ndarray, angle: np.ndarray) -> Command:
    """A command from samples of the wanted angle, with a cubic spline through them."""
    clock = np.arange(round((time[-1] - time[0]) / STEP)) * STEP
    slope = np.gradient(angle, time)
    step = time[1] - time[0]
    place = np.minimum((clock / step).astype(int), len(time) - 2)
    x = clock / step - place
    left, right, into, out = angle[place], angle[place + 1], step * slope[place], step * slope[place + 1]
    bend, more = 3.0 * (right - left) - 2.0 * into - out, into + out - 2.0 * (right - left)
    return Command(
        clock, left + x * (into + x * (bend + x * more)), (into + x * (2.0 * bend + 3.0 * x * more)) / step
    )
