"""What a rubber is worth in the torque loop: gains by one rule, figures of merit, and how they vary."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, field, replace
from itertools import product

import numpy as np
from numpy.typing import NDArray
from scipy.interpolate import PchipInterpolator

import nlsdesign as nls
from nlsdesign.design import CamDesign
from nlsdesign.foundation.arrays import Array
from nlsdesign.foundation.errors import ConvergenceError, NlsError

from .bench import Bench, Rubber, Run
from .candidates import Candidate, designed

LOW, HIGH = 0.3, 2.8
"""Amplitudes of the torque in N·m: a tenth of, and all of, that of the published measurements."""
HELD = (LOW, 1.4, HIGH)
"""Torques in N·m that are held while the gain is looked for."""
HOLD = 1.25
"""Time in s for which it is held."""
LADDER, BEYOND = 129, 1.03
"""Gains of the last look at the onset, and how far beyond the bracket of the search they reach."""
GAIN_MARGIN = 2.0
"""The loop begins to limit-cycle at this many times its gain: 6 dB."""
SWEPT = (6.0, 10.0, 14.0, 18.0, 24.0, 32.0, 44.0)
"""Frequencies in Hz at which the response is taken; whole numbers, so that a second has whole cycles."""
FALL = 1.0 / np.sqrt(2.0)
"""Of the torque over what was wanted, at the bandwidth: −3 dB."""
AT, MOVED_AT, MOVED = 2.0, 5.0, nls.degrees(5.0)
"""Hz of the energy lost and of the error of the estimate; Hz and amplitude in rad of the moved load."""

METRICS = {
    "bandwidth_low": f"bandwidth at {LOW} N·m, Hz",
    "bandwidth_high": f"bandwidth at {HIGH} N·m, Hz",
    "impedance": f"impedance at {MOVED_AT:g} Hz, N·m/rad",
    "loss": f"energy lost per cycle at {AT:g} Hz, mJ",
    "estimate_error": f"error of the torque estimate at {AT:g} Hz, mN·m",
    "volume": "volume of rubber, cm³",
}
"""What is ranked, by name."""
SQUARED = ("estimate_error",)
"""What is interpolated by its square."""
MORE_IS_BETTER = ("bandwidth_low", "bandwidth_high")


@dataclass(frozen=True, eq=False)
class Merits:
    """Figures of merit of one rubber, over its loss tangent and the factor of its modulus.

    Parameters
    ----------
    candidate, design
        The rubber and the spring that was designed for it.
    proportional
        Gain of the torque loop at the middle of the losses; not a number where the target was missed and no
        loop was made.
    loss_tangents, moduli
        At which the figures were measured, shape (3,) each.
    values
        By name of the metric, shape (3, 3); not a number where the loop limit-cycles or the design misses.
    between
        Relative error of each figure between these points, at one that was measured as well.
    """

    candidate: Candidate
    design: CamDesign | None
    proportional: float
    loss_tangents: Array
    moduli: Array
    values: dict[str, Array]
    between: dict[str, float] = field(default_factory=dict)

    @property
    def met(self) -> bool:
        """Whether the design meets its target within its limits."""
        return self.design is not None and self.design.met

    def at(self, metric: str, loss_tangents: Array, moduli: Array) -> Array:
        """Return a figure between the points at which it was measured, shape (n,).

        By quadratics; the square of the error of the estimate, which is nearly one with its least at the loss
        that the observer takes the rubber for.
        """
        power = 2.0 if metric in SQUARED else 1.0
        weights = (_quadratic(self.loss_tangents, loss_tangents), _quadratic(self.moduli, moduli))
        if not np.all(np.isfinite(self.values[metric])):
            return np.full(len(loss_tangents), np.nan)
        value: Array = np.einsum("ni,nj,ij->n", *weights, self.values[metric] ** power)
        least = float(np.min(self.values[metric]))
        return np.maximum(value, least**power) ** (1.0 / power) if power > 1.0 else value


def _quadratic(knots: Array, at: Array) -> Array:
    """Return the weights of three knots, shape (n, 3)."""
    a, b, c = knots
    return np.stack(
        [
            (at - b) * (at - c) / ((a - b) * (a - c)),
            (at - a) * (at - c) / ((b - a) * (b - c)),
            (at - a) * (at - b) / ((c - a) * (c - b)),
        ],
        axis=1,
    )


def merits_of(candidate: Candidate) -> Merits:
    """Design the spring for a rubber, choose the gain by the rule, and measure what the loop does."""
    loss, moduli = candidate.loss, 1.0 + 2.0 * candidate.spread * np.array([-1.0, 0.0, 1.0])
    tangents = np.array([loss.lower, loss.middle, loss.upper])
    design = _designed(candidate)
    if design is None or not design.met:
        missed = np.full((3, 3), np.nan)
        return Merits(candidate, design, np.nan, tangents, moduli, dict.fromkeys(METRICS, missed))
    bench = Bench(design.actuator)
    gains = largest_gains(bench, [Rubber(t) for t in tangents]) / GAIN_MARGIN
    check = Rubber(0.25 * tangents[0] + 0.75 * tangents[2], 1.0 + candidate.spread)
    rubbers = [*(Rubber(t, m) for t, m in product(tangents, moduli)), check]
    columns = measured(
        bench, rubbers, _quadratic(tangents, np.array([r.loss_tangent for r in rubbers])) @ gains
    )
    checked, columns = {n: c[-1] for n, c in columns.items()}, {n: c[:-1] for n, c in columns.items()}
    columns["volume"] = np.full(9, 1e6 * design.rubber_volume)
    values = {name: column.reshape(3, 3) for name, column in columns.items()}
    made = Merits(candidate, design, float(gains[1]), tangents, moduli, values)
    at = (np.array([check.loss_tangent]), np.array([check.modulus]))
    return replace(made, between={n: float(made.at(n, *at)[0] / value - 1.0) for n, value in checked.items()})


def _designed(candidate: Candidate) -> CamDesign | None:
    try:
        return designed(candidate.elastic, candidate.loss.middle)
    except NlsError:
        # Limits in conflict: a miss, which the ranking shows as one.
        return None


def largest_gains(bench: Bench, rubbers: Sequence[Rubber]) -> Array:
    """Return the gain at which the loop begins to limit-cycle while it holds a torque, for each rubber.

    Counts of the encoder make each run a little random: over about 1 % of the gain some runs limit-cycle and
    some do not, and a search for one bracket moves by that much where a number moves by a millionth. So two
    searches find the place, and from the share of a ladder of gains across it that is quiet follows the gain
    below which half the runs are. Between runs that differ by a millionth it scatters by 0.2 %.
    """
    count = len(rubbers)
    low, high = np.full(count, 4.0), np.full(count, 400.0)
    for _ in range(2):
        gains = np.geomspace(low, high, 9, axis=1)
        cycling = _cycling(bench, rubbers, gains)
        if np.any(cycling[:, 0]) or not np.all(cycling[:, -1]):
            what = "every gain" if np.any(cycling[:, 0]) else "no gain"
            raise ConvergenceError(
                bench.actuator.name, f"limit-cycles at {what} from {low[0]:g} to {high[0]:g} rad/s per N·m"
            )
        first = np.argmax(cycling, axis=1)[:, None]
        low, high = (np.take_along_axis(gains, at, axis=1)[:, 0] for at in (first - 1, first))
    ends = low / BEYOND, high * BEYOND
    quiet: Array = np.mean(~_cycling(bench, rubbers, np.geomspace(*ends, LADDER, axis=1)), axis=1)
    onset: Array = ends[0] * (ends[1] / ends[0]) ** quiet
    return onset


def _cycling(bench: Bench, rubbers: Sequence[Rubber], gains: Array) -> NDArray[np.bool_]:
    """Return whether the loop limit-cycles at one of the held torques, shape (rubbers, gains)."""
    runs = [
        Run(rubber, float(gain), torque)
        for rubber, row in zip(rubbers, gains, strict=True)
        for gain in row
        for torque in HELD
    ]
    cycling = bench.run(runs, stop=HOLD).cycling.reshape(*gains.shape, len(HELD))
    result: NDArray[np.bool_] = np.any(cycling, axis=2)
    return result


def measured(bench: Bench, rubbers: Sequence[Rubber], gains: Array) -> dict[str, Array]:
    """Return the figures of merit of a loop with each rubber; not a number where the loop limit-cycles.

    ``gains``: of the loop with each loss, at the declared modulus, shape (n,). The modulus of a spring that
    was weighed is known, so the gain is lowered by as much as it is stiffer.
    """
    asked = [(torque, 0.0, 0.0) for torque in HELD] + [(LOW, f, 0.0) for f in SWEPT]
    asked += [(HIGH, f, 0.0) for f in (AT, *SWEPT)] + [(0.0, MOVED_AT, MOVED)]
    runs = [
        Run(rubber, float(gain) / rubber.modulus, torque, frequency, moved)
        for torque, frequency, moved in asked
        for rubber, gain in zip(rubbers, gains, strict=True)
    ]
    # All runs in one call, for the loop is compiled once for each.
    ran, count, swept, start = bench.run(runs), len(rubbers), len(SWEPT), len(HELD)
    rows = np.arange(len(runs)).reshape(len(asked), count)
    steady = ~np.any(ran.cycling[rows[:start]], axis=0)
    first = rows[start + swept]
    sizes = np.abs(ran.response)[rows]
    columns = {
        "bandwidth_low": bandwidths(SWEPT, sizes[start : start + swept].T),
        "bandwidth_high": bandwidths((AT, *SWEPT), sizes[start + swept : -1].T),
        "impedance": np.abs(ran.impedance[rows[-1]]),
        "loss": 1e3 * ran.lost[first],
        "estimate_error": 1e3 * ran.estimate_error[first],
    }
    return {name: np.where(steady, column, np.nan) for name, column in columns.items()}


def bandwidths(frequencies: Sequence[float], sizes: Array) -> Array:
    """Return the frequencies in Hz at which the response has fallen by 3 dB; not a number if nowhere.

    ``sizes``: torque over what was wanted, shape (n, m).
    """
    return np.array([_fall(np.array(frequencies), row) for row in sizes])


def _fall(frequencies: Array, sizes: Array) -> float:
    """Return where the size falls below −3 dB for good, on a monotone curve in dB over the logarithm."""
    if not np.all(np.isfinite(sizes)):
        return float("nan")
    fine = np.linspace(np.log(frequencies[0]), np.log(frequencies[-1]), 2001)
    curve = PchipInterpolator(np.log(frequencies), np.log(sizes))(fine)
    above = np.flatnonzero(curve >= np.log(FALL))
    if len(above) == 0 or above[-1] == len(fine) - 1:
        return float("nan")
    return float(np.exp(fine[above[-1]]))
