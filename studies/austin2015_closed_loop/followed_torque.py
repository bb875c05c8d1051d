"""Fig. 10: desired to actual torque at 0.8 and 2.8 N·m, point by point, with the verdict on each run."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass

import numpy as np

from nlsdesign.feedback.control import SineResponse, TorqueGains
from nlsdesign.foundation.arrays import Array

from .._published import figure_points
from .benches import DECKS, FILES, HIGH, LOW, Bench

AMPLITUDES = {"low": LOW, "high": HIGH}
IN_FAST = {"low": (1.0, 1.5, 2.0, 3.0, 5.0, 11.0), "high": (1.0, 1.5, 5.0)}
"""Frequencies in Hz of the fast way."""


@dataclass(frozen=True)
class Setting:
    """Gains that are tried on all springs at both amplitudes; the paper prints none."""

    name: str
    gains: TorqueGains
    late: int = 0


GENTLE = Setting("Kp 32, Ki 100", TorqueGains(proportional=32.0, integral=100.0))
STRONG_INTEGRAL = Setting("Kp 32, Ki 800", TorqueGains(proportional=32.0, integral=800.0))
LATE_TORQUE = Setting(
    "Kp 25, Ki 100, torque 6 ms late", TorqueGains(proportional=25.0, integral=100.0), late=6
)
SETTINGS = (GENTLE, STRONG_INTEGRAL, LATE_TORQUE)


@dataclass(frozen=True, eq=False)
class Followed:
    """One spring at one amplitude with one setting.

    Parameters
    ----------
    response
        As simulated.
    late
        Time in s by which the recorded torque is late.
    published
        Frequency in Hz, magnitude in dB, phase in degrees, shape (n, 3).
    """

    response: SineResponse
    late: float
    published: Array

    @property
    def decibel(self) -> Array:
        """Magnitude in dB, not a number where the loop does not settle."""
        return self.response.decibel

    @property
    def phase(self) -> Array:
        """Phase in degrees as it is recorded."""
        shown: Array = self.response.phase_degrees - 360.0 * self.late * self.response.frequency
        return shown

    @property
    def lost(self) -> int:
        """Number of points at which the loop does not settle."""
        return sum(not verdict.holds for verdict in self.response.verdicts)

    @property
    def deviation(self) -> tuple[float, float]:
        """Root mean square deviation from the points where the loop settles, in dB and degrees."""
        good = np.isfinite(self.decibel)
        wrong = (self.decibel - self.published[:, 1], self.phase - self.published[:, 2])
        size = [float(np.sqrt(np.mean(w[good] ** 2))) if np.any(good) else float("nan") for w in wrong]
        return size[0], size[1]

    def at(self, frequency: float) -> tuple[float, float]:
        """Return magnitude in dB and phase in degrees at the point nearest to a frequency."""
        k = int(np.argmin(np.abs(self.response.frequency - frequency)))
        return float(self.decibel[k]), float(self.phase[k])


FollowedTorque = Mapping[tuple[str, str, str], Followed]
"""By name of the setting, amplitude and spring."""


def followed_torque(*, fast: bool = False) -> FollowedTorque:
    """Simulate Fig. 10 for the three springs at the published frequencies."""
    result = {}
    for setting in (GENTLE, LATE_TORQUE) if fast else SETTINGS:
        for amplitude in AMPLITUDES:
            for spring in DECKS:
                bench = Bench(spring, setting.gains, late=setting.late)
                points = published_response(amplitude, spring)
                points = _thinned(points, IN_FAST[amplitude]) if fast else points
                response = bench.response(AMPLITUDES[amplitude], points[:, 0])
                result[setting.name, amplitude, spring] = Followed(response, 1e-3 * setting.late, points)
    return result


def published_response(amplitude: str, spring: str) -> Array:
    """Return frequency in Hz, magnitude in dB and phase in degrees of Fig. 10, shape (n, 3)."""
    magnitude, phase = (
        figure_points(f"fig10_{amplitude}_amplitude_{each}_{FILES[spring]}")
        for each in ("magnitude", "phase")
    )
    return np.column_stack([magnitude, phase[:, 1]])


def _thinned(points: Array, wanted: Sequence[float]) -> Array:
    """Return the points nearest to a few frequencies."""
    return points[sorted({int(np.argmin(np.abs(np.log(points[:, 0] / f)))) for f in wanted})]
