"""A cycle of the spring behind a cam that is known by its energy alone, exact for each harmonic."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np

from nlsdesign.foundation.arrays import Array

from . import paper as p

SAMPLES = 4096
_GRID = np.linspace(0.0, 20e-3, 40_001)


@dataclass(frozen=True)
class Cam:
    """A cam by the energy that all elements hold at an angle, and the scale of the rubber behind it."""

    energy: Callable[[Array], Array]
    scale: float


def fig8_energy(angle: Array) -> Array:
    """Return ∫τ dθ of the power law through Fig. 8."""
    factor, power = p.POWER_LAW
    result: Array = factor * np.abs(angle) ** (power + 1.0) / (power + 1.0)
    return result


def target_energy(angle: Array) -> Array:
    """Return ∫τ dθ of the target of 2014, 5 N·m at 53° with c = 1."""
    x = np.abs(angle)
    result: Array = p.TARGET_TORQUE / np.expm1(p.TARGET_ANGLE) * (np.expm1(x) - x)
    return result


# The third: cam made for the rubber that is 2.55 times as strong, printed rubber behind it.
CAMS = {
    "cam of Fig. 8 for the printed rubber": (Cam(fig8_energy, 1.0), 1.0),
    "cam of the 2014 target": (Cam(target_energy, 1.0), 1.0),
    "cam of Fig. 8 for 2.55 times the rubber": (Cam(fig8_energy, p.FORCE_SCALE), 1.0),
}


def extension_of(cam: Cam, angle: Array) -> Array:
    """Return δ(θ) from N·U(δ) = ∫τ dθ."""
    stored = p.ELEMENTS * cam.scale * p.static_energy(_GRID)
    return np.interp(cam.energy(angle), stored, _GRID)


def cycle(cam: Cam, amplitude: float, frequency: float, viscosity: float, scale: float) -> dict[str, Array]:
    """Return angle, force and extension rate of one element over a steady cycle; exact for each harmonic."""
    angle = amplitude * np.sin(2.0 * np.pi * np.arange(SAMPLES) / SAMPLES)
    extension = extension_of(cam, angle)
    harmonics = np.fft.rfft(extension)
    s = 2j * np.pi * frequency * np.arange(len(harmonics))
    tau = viscosity / (scale * p.BRANCH)
    branch = np.fft.irfft(harmonics * p.STIFFNESS_PER_MODULUS * viscosity * s / (1.0 + s * tau), SAMPLES)
    rate = np.fft.irfft(harmonics * s, SAMPLES)
    return {"angle": angle, "rate": rate, "force": scale * p.static_force(extension) + branch}


def loss(cam: Cam, amplitude: float, frequency: float, viscosity: float, scale: float) -> tuple[float, float]:
    """Return energy lost per cycle and energy put in while winding, in J, all elements."""
    run = cycle(cam, amplitude, frequency, viscosity, scale)
    power = p.ELEMENTS * run["force"] * run["rate"]
    return float(power.mean() / frequency), float(np.clip(power, 0.0, None).mean() / frequency)
