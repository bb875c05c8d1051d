"""What makes records hard to read although nothing is hidden: colour of the noise, spikes, coarse counts.

``coloured``  force noise x⁺ = q x + √(1 − q²) n with q = exp(−1/(f τ)), one time τ for each record, 5 to
              100 ms, beside the white one; its size is a multiple of the declared noise
``flicker``   the sum of five such with τ from 4 ms to 4 s: about 1/f
``spikes``    single samples of any channel off by 30 to 3000 times the noise, each way
``coarse``    an encoder of 512 to 2048 counts per turn, declared as such
"""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np

from .actuators import Actuator, Sensors

COUNTS = (512, 1024, 2048)
THREE_RECORDS = ("sine_45deg_0.5Hz", "sine_25deg_2.0Hz", "multisine")
_TIMES = (0.005, 0.1)  # s, of coloured noise
_FLICKER_TIMES = (0.004, 0.0225, 0.126, 0.71, 4.0)  # s


@dataclass(frozen=True)
class Conditions:
    """Circumstances of a set of records; the usual ones are white noise and a fine encoder."""

    coloured: float = 0.0  # standard deviation, as a share of the declared noise of the force
    flicker: float = 0.0  # the same
    spikes: int = 0  # in each record
    counts: int = 0  # per turn; 0 as declared

    def sensors(self, declared: Sensors) -> Sensors:
        """Sensors of the bench under these conditions; the makers declare these."""
        return replace(declared, counts=self.counts) if self.counts else declared

    def declared(self, actuator: Actuator) -> Actuator:
        """The actuator with its sensors under these conditions."""
        return replace(actuator, sensors=self.sensors(actuator.sensors))

    def disturbed(self, table: np.ndarray, sensors: Sensors, draw: np.random.Generator) -> np.ndarray:
        """A record as read under these conditions; columns time (s), angle (rad), current (A), force (N)."""
        table = table.copy()
        count, rate = len(table), sensors.sample_rate
        if self.coloured:
            time = _TIMES[0] * (_TIMES[1] / _TIMES[0]) ** draw.uniform()
            table[:, 3] += self.coloured * sensors.force_noise * first_order_noise(count, time * rate, draw)
        if self.flicker:
            parts = [first_order_noise(count, time * rate, draw) for time in _FLICKER_TIMES]
            table[:, 3] += self.flicker * sensors.force_noise * np.sum(parts, axis=0) / len(parts) ** 0.5
        return self.spiked(table, sensors, draw)

    def spiked(self, table: np.ndarray, sensors: Sensors, draw: np.random.Generator) -> np.ndarray:
        """A record with its spikes; columns time (s), angle (rad), current (A), and maybe force (N)."""
        table, count = table.copy(), len(table)
        sizes = np.array([sensors.angle_quantum, sensors.current_noise, sensors.force_noise])
        for row in draw.choice(np.arange(1, count - 1), size=self.spikes, replace=False):
            column = int(draw.integers(table.shape[1] - 1))
            size = 30.0 * 100.0 ** draw.uniform() * sizes[column]
            table[row, 1 + column] += size if draw.uniform() < 0.5 else -size
        return table


PLAIN = Conditions()


def first_order_noise(count: int, steps: float, draw: np.random.Generator) -> np.ndarray:
    """Noise of unit variance that forgets over so many steps, from its steady state."""
    kept = float(np.exp(-1.0 / steps))
    fresh = np.sqrt(1.0 - kept * kept) * draw.standard_normal(count)
    fresh[0] = draw.standard_normal()
    noise, last = np.empty(count), 0.0
    for i, value in enumerate(fresh.tolist()):
        last = kept * last + value
        noise[i] = last
    return noise


def mistaken(actuator: Actuator, draw: np.random.Generator) -> tuple[Actuator, str]:
    """What its makers declare with one number wrong by 30 to 60 %, and the path of that number in the deck.

    The number is the inertia, the torque constant or the modulus of the relaxing branch.
    """
    factor = 1.0 + (1.0 if draw.uniform() < 0.5 else -1.0) * draw.uniform(0.3, 0.6)
    rubber, drive = actuator.rubber, actuator.drivetrain
    which = int(draw.integers(3))
    if which == 0:
        wrong = replace(actuator, drivetrain=replace(drive, inertia=drive.inertia * factor))
        return wrong, "motor.inertia"
    if which == 1:
        wrong = replace(actuator, drivetrain=replace(drive, torque_constant=drive.torque_constant * factor))
        return wrong, "motor.torque_constant"
    wrong = replace(actuator, rubber=replace(rubber, k=rubber.k * factor))
    return wrong, "spring.cable.rubber.relaxing.spring.modulus"
