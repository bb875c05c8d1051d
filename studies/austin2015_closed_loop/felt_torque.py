"""Fig. 9: the torque that a load feels which is moved while no torque is wanted.

The paper prints neither the amplitude of the load nor the gains. Of a linear spring only amplitude over gain
shows. ±20° with twice the gains meets all points of all three springs to 2 Hz; ±10° meets those of the linear
springs alone, for there the dead zone of the nonlinear one takes up half of the motion. Both are assumptions.
"""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import dataclass

import numpy as np

import nlsdesign as nls
from nlsdesign.feedback.control import TorqueGains, ZeroTorque
from nlsdesign.foundation.arrays import Array

from .._published import figure_points
from .benches import DECKS, FILES, NONLINEAR, POWER_LAW, SOFT, STIFF, Bench
from .causes import ADDED, LATE

FIRST = 0.45  # Hz; below it the published torques are those of a few counts
TO_TWO = (0.5, 1.0, 2.0)  # Hz

LINEAR_GAINS = TorqueGains(proportional=64.0, integral=110.0)
NONLINEAR_GAINS = TorqueGains(proportional=135.0, integral=100.0)
WIDE, NARROW = 20.0, 10.0  # degrees
LATE_GAINS = {
    SOFT: TorqueGains(proportional=32.0, integral=50.0),
    STIFF: TorqueGains(proportional=32.0, integral=50.0),
    NONLINEAR: TorqueGains(proportional=70.0, integral=100.0),
}


@dataclass(frozen=True, eq=False)
class FeltTorque:
    """Fig. 9 beside the published points.

    Parameters
    ----------
    points
        Published frequency in Hz and torque in N·m rms by spring, shape (n, 2).
    prompt
        Simulated with the loop of the deck, ±20°.
    late
        Simulated with the torque 8 ms late and half the gains, ±10°.
    added
        Of the nonlinear spring at the highest frequency, in N·m rms, by what was added; not a number where
        the loop limit-cycles. Second the verdict.
    """

    points: Mapping[str, Array]
    prompt: Mapping[str, ZeroTorque]
    late: Mapping[str, ZeroTorque]
    added: Mapping[str, tuple[float, str]]

    def deviation(self, spring: str, *, late: bool, up_to: float) -> float:
        """Return the largest relative deviation from the points up to a frequency; NaN if lost."""
        result = (self.late if late else self.prompt)[spring]
        chosen = result.frequency <= 1.01 * up_to
        wanted = np.interp(result.frequency[chosen], *self.points[spring].T)
        return float(np.max(np.abs(result.rms[chosen] / wanted - 1.0)))

    @property
    def published_last(self) -> float:
        """Published torque of the nonlinear spring at the highest frequency, N·m rms."""
        return float(self.points[NONLINEAR][-1, 1])

    def below_both(self, up_to: float) -> bool:
        """Tell whether the nonlinear spring feels less than both linear ones wherever it settles."""
        own = self.prompt[NONLINEAR]
        good = np.isfinite(own.rms) & (own.frequency <= up_to)
        return all(bool(np.all(own.rms[good] < self.prompt[s].rms[good])) for s in (SOFT, STIFF))


def felt_torque(*, fast: bool = False) -> FeltTorque:
    """Simulate Fig. 9 for the three springs, and what each added cause does to the nonlinear one."""
    points = {s: figure_points(f"fig09_output_impedance_{FILES[s]}") for s in DECKS}
    points = {s: p[p[:, 0] > FIRST] for s, p in points.items()}
    frequencies = np.array([*TO_TWO, 9.0, 11.0]) if fast else points[SOFT][:, 0]
    gains = {s: NONLINEAR_GAINS if s == NONLINEAR else LINEAR_GAINS for s in DECKS}
    prompt = {s: Bench(s, gains[s]).felt(WIDE, frequencies) for s in DECKS}
    late = {s: Bench(s, LATE_GAINS[s], late=LATE).felt(NARROW, frequencies) for s in DECKS}
    added = {}
    for cause in ADDED[-1:] if fast else ADDED:
        seen = Bench(NONLINEAR, LATE_GAINS[NONLINEAR], cause=cause).felt(NARROW, np.array([11.0]))
        added[cause.name] = (float(seen.rms[0]), str(seen.verdicts[0]))
    return FeltTorque(points, prompt, late, added)


def held_motor(degrees: float) -> float:
    """Return the torque in N·m rms of the nonlinear spring's power law whose motor stands still.

    The load is moved as a sine of this amplitude, so this is what the spring alone would give.
    """
    turned = nls.degrees(degrees) * np.sin(np.linspace(0.0, 2.0 * math.pi, 2000, endpoint=False))
    torque = POWER_LAW[0] * np.abs(turned) ** POWER_LAW[1]
    return float(np.sqrt(np.mean(torque**2)))
