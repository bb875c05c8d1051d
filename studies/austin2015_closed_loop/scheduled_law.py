"""The law that commands speed by tangent stiffness, on the exact plant and over the spread of the deck."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from nlsdesign.export import natively
from nlsdesign.feedback.control import LoopSpread, LoopVerdict, ScheduledTorque, loop_over_spread, tracking
from nlsdesign.simulation import Sine

from .benches import HIGH, NONLINEAR, Bench

GOALS = {1.0: 0.05, 2.0: 0.09, 5.0: 0.19, 11.0: 0.29}
"""Error over desired torque, both root mean square, by frequency in Hz, at 2.8 N·m."""
HELD = (0.8, 2.8)  # N·m
SINE = 11.0  # Hz


@dataclass(frozen=True, eq=False)
class ScheduledLaw:
    """What the scheduled law does.

    Parameters
    ----------
    errors
        Error over desired torque by frequency in Hz, at 2.8 N·m and with the exact plant, and the verdict on
        the run; where that does not hold the error is that of an oscillating loop.
    spreads
        Draws of the deck's spread: 0.8 and 2.8 N·m held, and the sine of 2.8 N·m at 11 Hz.
    """

    errors: dict[float, tuple[float, LoopVerdict]]
    spreads: tuple[LoopSpread, ...]

    @property
    def held(self) -> float:
        """Share of the draws in which both held torques settle."""
        kept = np.all(
            [[v.holds for v in each.verdicts] for each in self.spreads if not each.frequency], axis=0
        )
        return float(np.mean(kept))

    @property
    def stable(self) -> int:
        """Number of draws in which the loop settles, held and on the sine."""
        held = np.all([[v.holds for v in each.verdicts] for each in self.spreads], axis=0)
        return int(np.sum(held))

    @property
    def draws(self) -> int:
        """Number of draws."""
        return len(self.spreads[0].verdicts)


def scheduled_law(draws: int) -> ScheduledLaw:
    """Run the scheduled law on the exact plant and on draws of its numbers."""
    loop = Bench(NONLINEAR, law=ScheduledTorque()).loop()
    errors = {}
    for frequency in GOALS:
        settled = max(1.0 / frequency, 0.2)
        run = loop.run(settled + 2.0 / frequency, inputs={loop.desired: Sine(HIGH, frequency)})
        late = run.time >= settled
        wrong = (run[loop.torque] - run[loop.desired])[late]
        size = float(np.sqrt(np.mean(wrong**2)) / np.sqrt(np.mean(run[loop.desired][late] ** 2)))
        errors[frequency] = (size, tracking(loop, run, settled=settled).verdict)
    driven = (*((torque, 0.0) for torque in HELD), (HIGH, SINE))
    spreads = tuple(
        loop_over_spread(loop, amplitude=a, frequency=f, draws=draws, seed=12, translate=natively)
        for a, f in driven
    )
    return ScheduledLaw(errors, spreads)
