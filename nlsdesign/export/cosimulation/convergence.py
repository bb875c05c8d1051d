"""How a co-simulation converges when the step is halved again and again."""

from __future__ import annotations

import itertools
import math
from collections.abc import Mapping
from dataclasses import dataclass, replace

import numpy as np

from ...foundation.errors import ValueRangeError
from .cosimulate import FmuSystem, Signal
from .coupling import Stepping

_EXACT = 1e-9
"""Differences below this part of the range of a signal are those of the integrators, not of the coupling."""


@dataclass(frozen=True)
class Convergence:
    """What halving the step changes.

    Parameters
    ----------
    steps
        Longest step of each run in s, each half of the one before.
    differences
        By signal: largest difference of each run from the next, in the unit of the signal.
    ranges
        By signal: largest less smallest value in the last run.
    """

    steps: tuple[float, ...]
    differences: Mapping[str, tuple[float, ...]]
    ranges: Mapping[str, float]

    def orders(self, name: str) -> tuple[float, ...]:
        """Return the observed order at each halving after the first, not a number where nothing changes.

        Parameters
        ----------
        name
            Of a signal.
        """
        changes = self.differences[name]
        floor = _EXACT * self.ranges[name]
        return tuple(
            math.log2(one / other) if one > floor and other > floor else math.nan
            for one, other in itertools.pairwise(changes)
        )


def convergence(
    system: FmuSystem,
    *,
    inputs: Mapping[str, Signal],
    stop: float,
    stepping: Stepping | None = None,
    halvings: int = 3,
) -> Convergence:
    """Run a system with a step that is halved again and again.

    Parameters
    ----------
    system
        FMUs and wires.
    inputs
        Signals from outside by input.
    stop
        End in s.
    stepping
        The first step, coupling, and limits.
    halvings
        Number of halvings, at least 2 for an order.

    Raises
    ------
    ValueRangeError
        If there are fewer than two halvings or more than ten.
    """
    if not 2 <= halvings <= 10:
        raise ValueRangeError(f"{halvings} halvings", "from 2 to 10 tell an order")
    plain = replace(stepping or Stepping(), estimate=False)
    runs = [system.run(inputs=inputs, stop=stop, stepping=plain, parts=2**k) for k in range(halvings + 1)]
    differences = {
        name: tuple(
            float(np.max(np.abs(one[name] - other[name][::2]))) for one, other in itertools.pairwise(runs)
        )
        for name in runs[0].trace.signals
    }
    steps = tuple(runs[0].step / 2**k for k in range(halvings + 1))
    return Convergence(steps, differences, {name: float(np.ptp(runs[-1][name])) for name in differences})
