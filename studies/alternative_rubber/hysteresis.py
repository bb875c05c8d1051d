"""When an observer cures hysteresis: one spring with more and more loss, three ways to know its torque."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from nlsdesign.components import Material
from nlsdesign.foundation.arrays import Array

from .bench import Bench, Measured, Rubber, Run
from .candidates import TARGET, designed, with_loss
from .merits import AT, GAIN_MARGIN, HELD, HIGH, largest_gains

LOSSES = (0.02, 0.05, 0.1, 0.15, 0.2, 0.3)
"""Loss tangents of the rubber."""
WRONG = 0.5
"""How far the loss tangent of the rubber is off what the observer takes it for: the ranges of the library end
43 to 67 % off their middle."""
ALLOWED = 0.05
"""Error of the torque estimate over the wanted torque, root mean squares, that is taken for good; assumed."""


@dataclass(frozen=True, eq=False)
class Hysteresis:
    """Torque errors over the loss tangent of the rubber.

    Parameters
    ----------
    loss_tangents
        For which the observer takes the rubber, shape (n,).
    estimate
        Error of the torque estimate over the wanted torque, root mean squares, by how it is known: ``exact``,
        ``wrong`` (the worse of both sides) and ``static``; shape (n,) each. Not a number where the loop
        limit-cycles.
    tracking
        Error of the torque over the wanted one, alike.
    lost
        Energy that a cycle turns into heat over the energy put into the spring, alike.
    """

    loss_tangents: Array
    estimate: dict[str, Array]
    tracking: dict[str, Array]
    lost: dict[str, Array]

    def threshold(self, kind: str) -> float:
        """Return the loss tangent at which the error of the estimate passes what is allowed.

        Linear between the points; not a number where it does not pass within them.
        """
        errors = self.estimate[kind]
        above = np.flatnonzero(errors > ALLOWED)
        if len(above) == 0 or above[0] == 0 or not np.isfinite(errors[: above[0]]).all():
            return float("nan")
        k = above[0]
        return float(np.interp(ALLOWED, errors[k - 1 : k + 1], self.loss_tangents[k - 1 : k + 1]))


def hysteresis(elastic: Material, losses: Sequence[float] = LOSSES) -> Hysteresis:
    """Run one spring with rubber of each loss: observer exact, observer wrong, and static torque curve."""
    actuator = designed(elastic, losses[0]).actuator
    static = Bench(actuator, static=True)
    columns: dict[str, list[Array]] = {"exact": [], "wrong": [], "static": []}
    for loss in losses:
        bench, rubber = Bench(with_loss(actuator, elastic, loss)), Rubber(loss)
        gain = float(largest_gains(bench, [rubber])[0]) / GAIN_MARGIN
        columns["exact"].append(_measured(bench, [rubber], gain)[0])
        ends = [Rubber(loss * (1.0 - WRONG)), Rubber(loss * (1.0 + WRONG))]
        columns["wrong"].append(np.max(_measured(bench, ends, gain), axis=0))
        columns["static"].append(_measured(static, [rubber], gain)[0])
    rows = {kind: np.array(values) for kind, values in columns.items()}
    return Hysteresis(
        np.array(losses),
        {kind: values[:, 0] for kind, values in rows.items()},
        {kind: values[:, 1] for kind, values in rows.items()},
        {kind: values[:, 2] for kind, values in rows.items()},
    )


def _measured(bench: Bench, rubbers: Sequence[Rubber], gain: float) -> Array:
    """Return errors of estimate and torque and the energy lost, relative, shape (rubbers, 3)."""
    runs = [Run(r, gain, torque) for r in rubbers for torque in HELD] + [
        Run(r, gain, HIGH, AT) for r in rubbers
    ]
    run, count = bench.run(runs), len(rubbers)
    steady = ~np.any(run.cycling[:-count].reshape(count, len(HELD)), axis=1)
    size = HIGH / np.sqrt(2.0)
    rows = np.stack([run.estimate_error / size, run.error / size, run.lost / stored(run)], axis=1)
    return np.where(steady[:, None], rows[-count:], np.nan)


def stored(run: Measured) -> Array:
    """Return the energy in J put into the spring per cycle, up to both ends of its motion, shape (runs,).

    Of the target's torque curve, which the spring has at rest; it is stretched twice a cycle.
    """
    energy: Array = 2.0 * TARGET.energy(np.max(np.abs(run.deflection[:, run.counted]), axis=1))
    return energy
