"""A loop over draws of the numbers of its plant: how often it holds, and how far its figures scatter."""

from __future__ import annotations

import math
from collections import Counter
from collections.abc import Mapping
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from ....foundation.errors import ValueRangeError
from ....simulation.buffered import Translate, as_it_is
from ....simulation.prior import declared_prior
from ....simulation.sampled_batch import PLANT
from ..laws.largest_torque import check_torque
from ..loop.closed_loop import ClosedLoop
from .loop_verdict import LoopVerdict
from .periodic_runs import run_periodic
from .responses import held_drive, sine_drive

Array = NDArray[np.float64]


@dataclass(frozen=True, eq=False)
class LoopSpread:
    """What a loop does over draws of the numbers of its plant; observer and controller stay as designed.

    Parameters
    ----------
    amplitude, frequency
        Of the desired torque in N·m and Hz; zero Hz is a held torque.
    drawn
        The numbers in SI by name, each of shape (n,).
    verdicts
        On each run.
    error
        Root mean square of the torque error over that of the desired torque, shape (n,); not a number where
        a verdict does not hold.
    """

    amplitude: float
    frequency: float
    drawn: Mapping[str, Array]
    verdicts: tuple[LoopVerdict, ...]
    error: Array

    @property
    def held(self) -> float:
        """Share of the draws in which the loop settles, 1."""
        return float(np.mean([verdict.holds for verdict in self.verdicts]))

    def quantile(self, share: float) -> float:
        """Return a quantile of the error over all draws; a draw that does not settle counts as infinite.

        Parameters
        ----------
        share
            Between 0 and 1.
        """
        ranked = np.sort(np.where(np.isfinite(self.error), self.error, np.inf))
        return float(ranked[min(int(share * len(ranked)), len(ranked) - 1)])

    def __str__(self) -> str:
        states = Counter(verdict.state for verdict in self.verdicts)
        counts = ", ".join(f"{number} {state}" for state, number in states.most_common())
        return (
            f"{len(self.verdicts)} draws at {self.amplitude:g} N·m, {self.frequency:g} Hz: "
            f"{counts}; error over desired torque {self.quantile(0.5):.3g} in the median, "
            f"{self.quantile(0.9):.3g} at 90 %"
        )


def loop_over_spread(
    loop: ClosedLoop,
    *,
    amplitude: float,
    frequency: float,
    draws: int = 100,
    seed: int = 1,
    translate: Translate = as_it_is,
) -> LoopSpread:
    """Run a loop on draws of the numbers of its plant, which its observer and controller do not know.

    Parameters
    ----------
    loop
        Closed loop; its plant has numbers with a spread.
    amplitude
        Of the desired torque in N·m.
    frequency
        Of its sine in Hz; zero holds it.
    draws
        Number of draws.
    seed
        The same seed gives the same numbers.
    translate
        For instance :func:`~nlsdesign.export.natively`: then compiled code runs.

    Raises
    ------
    ValueRangeError
        If no number of the plant has a spread, or the amplitude is beyond the current limit.
    """
    check_torque(loop.plant, amplitude)
    drawn = declared_prior(loop.plant).draws(draws, seed)
    if not drawn:
        raise ValueRangeError(
            f"plant '{loop.plant.name}'", "has no number with a spread", next_step="state spreads in the deck"
        )
    parameters = {f"{PLANT}.{name}": values for name, values in drawn.items()}
    if frequency > 0.0:
        drive = sine_drive(
            loop, amplitude=amplitude, frequencies=np.full(draws, frequency), parameters=parameters
        )
    else:
        drive = held_drive(loop, torques=np.full(draws, amplitude), parameters=parameters)
    runs = run_periodic(loop, drive, translate=translate)
    errors = []
    for run in runs:
        wanted = drive.drives(run.time, np.zeros(1, dtype=np.intp))[loop.desired]
        desired = np.asarray(wanted, dtype=float)[0]
        error = run[loop.torque] - desired
        size = float(np.sqrt(np.mean(desired**2)))
        errors.append(float(np.sqrt(np.mean(error**2))) / size if run.verdict.holds else math.nan)
    return LoopSpread(amplitude, frequency, drawn, tuple(run.verdict for run in runs), np.array(errors))
