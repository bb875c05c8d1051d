"""Bandwidth against output impedance: gains for one spring, and spring and gains designed together.

More gain gives more bandwidth and less impedance until the loop limit-cycles; a softer spring bears more gain
but has further to go. So the torque curve of the spring and the gain belong together: a front over both.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

import nlsdesign as nls
from nlsdesign.components import loss_of, material
from nlsdesign.errors import NlsError
from nlsdesign.report import FigureSection, TableSection

from .alternative_rubber.bench import Bench, Rubber
from .alternative_rubber.candidates import designed
from .alternative_rubber.merits import HIGH, MOVED_AT, largest_gains, measured

Array = NDArray[np.float64]

RUBBER = "PMC-770"
ANGLES, SHAPES = (40.0, 53.0, 65.0), (0.2, 1.0, 2.5)
"""Degrees at which the spring reaches 5 N·m, and shapes of its exponential: 0.2 is nearly a line."""
PUBLISHED = (53.0, 1.0)
MARGINS = (4.0, 2.8, 2.0)
"""Gain at which the loop limit-cycles over the gain that is taken."""


@dataclass(frozen=True, eq=False)
class Spring:
    """A spring and what its loop does at several gains.

    Parameters
    ----------
    angle, shape
        Degrees at which it reaches 5 N·m, and shape of its exponential.
    gains
        In rad/s per N·m, shape (n,).
    bandwidth, impedance
        At 2.8 N·m in Hz, and at 5 Hz in N·m/rad, shape (n,); not a number where there is none.
    """

    angle: float
    shape: float
    gains: Array
    bandwidth: Array
    impedance: Array

    @property
    def label(self) -> str:
        """Angle and shape."""
        return f"{self.angle:g}°, shape {self.shape:g}"


@dataclass(frozen=True, eq=False)
class Results:
    """All springs, and the names of those that miss their target."""

    springs: tuple[Spring, ...]
    missed: tuple[str, ...]

    @property
    def front(self) -> list[tuple[Spring, int]]:
        """Springs and gains that no other betters in bandwidth and impedance, by rising impedance."""
        points = [(s, k) for s in self.springs for k in range(len(s.gains)) if np.isfinite(s.bandwidth[k])]
        kept = [p for p in points if not any(_betters(q, p) for q in points)]
        return sorted(kept, key=lambda p: float(p[0].impedance[p[1]]))

    def spring(self, angle: float, shape: float) -> Spring:
        """Return one of the springs."""
        return next(s for s in self.springs if (s.angle, s.shape) == (angle, shape))

    @property
    def numbers(self) -> dict[str, float]:
        """The claimed numbers, by name with unit."""
        published, k = self.spring(*PUBLISHED), MARGINS.index(2.0)
        at_margin = [s for s in self.springs if np.isfinite(s.bandwidth[k])]
        quick = max(at_margin, key=lambda s: float(s.bandwidth[k]))
        gentle = min(at_margin, key=lambda s: float(s.impedance[k]))
        return {
            "missed": float(len(self.missed)),
            "published_bandwidth_Hz": float(published.bandwidth[k]),
            "published_impedance_Nm_per_rad": float(published.impedance[k]),
            **self._straight(k),
            "largest_bandwidth_Hz": float(quick.bandwidth[k]),
            "largest_bandwidth_angle_deg": quick.angle,
            "least_impedance_Nm_per_rad": float(gentle.impedance[k]),
            "least_impedance_angle_deg": gentle.angle,
            "springs_on_the_front": float(len({s.label for s, _ in self.front})),
        }

    def _straight(self, k: int) -> dict[str, float]:
        """Return the numbers of the spring that is nearly a line to the same torque at the same angle."""
        if all(s.label != f"{PUBLISHED[0]:g}°, shape {SHAPES[0]:g}" for s in self.springs):
            return {}
        straight = self.spring(PUBLISHED[0], SHAPES[0])
        return {
            "straight_bandwidth_Hz": float(straight.bandwidth[k]),
            "straight_impedance_Nm_per_rad": float(straight.impedance[k]),
        }


def _betters(one: tuple[Spring, int], other: tuple[Spring, int]) -> bool:
    """Tell whether one point is as good in both and better in one."""
    (a, i), (b, j) = one, other
    more, less = float(a.bandwidth[i] - b.bandwidth[j]), float(b.impedance[j] - a.impedance[i])
    return min(more, less) >= 0.0 and max(more, less) > 0.0


def main(out: Path, fast: bool = False) -> Results:
    """Design all springs, sweep the gain of each, and write a report."""
    choices = [(a, c) for a in ANGLES for c in SHAPES] if not fast else [PUBLISHED]
    springs, missed = [], []
    for angle, shape in choices:
        spring = spring_of(angle, shape)
        if spring is None:
            missed.append(f"{angle:g}°, shape {shape:g}")
        else:
            springs.append(spring)
    results = Results(tuple(springs), tuple(missed))
    write(out, results)
    return results


def spring_of(angle: float, shape: float, margins: Sequence[float] = MARGINS) -> Spring | None:
    """Return a designed spring with its loop at several gains; none where the target is missed."""
    target = nls.ExponentialTorque(maximum=5.0, angle=nls.degrees(angle), shape=shape)
    rubber = material(RUBBER)
    loss = loss_of(rubber).middle
    try:
        design = designed(rubber, loss, target)
    except NlsError:
        # Limits in conflict: a miss, which the report names.
        return None
    if not design.met:
        return None
    bench = Bench(design.actuator)
    gains = float(largest_gains(bench, [Rubber(loss)])[0]) / np.array(margins)
    columns = measured(bench, [Rubber(loss)] * len(gains), gains)
    return Spring(angle, shape, gains, columns["bandwidth_high"], columns["impedance"])


def write(out: Path, results: Results) -> None:
    """Write the report."""
    lines = {s.label: (s.impedance, s.bandwidth) for s in results.springs}
    front = np.array([(s.impedance[k], s.bandwidth[k]) for s, k in results.front]).reshape(-1, 2)
    rows = tuple(
        (
            s.label,
            s.gains[k],
            MARGINS[k],
            s.bandwidth[k],
            s.impedance[k],
            "yes" if (s, k) in results.front else "",
        )
        for s in results.springs
        for k in range(len(s.gains))
    )
    both = f"bandwidth at {HIGH:g} N·m", f"impedance at {MOVED_AT:g} Hz"
    missed = f" Missed their target within the limits: {'; '.join(results.missed)}." if results.missed else ""
    nls.write_report(
        out / "report.html",
        FigureSection(
            "Bandwidth over impedance",
            nls.figures.curves(
                {**lines, "front": (front[:, 0], front[:, 1])},
                across=f"{both[1]}, N·m/rad",
                up=f"{both[0]}, Hz",
                words=f"Bandwidth over impedance of {len(lines)} springs at {len(MARGINS)} gains.",
            ),
            caption="Along each line the gain rises, from a quarter to half of that at which the loop "
            f"limit-cycles.{missed}",
            means="More gain is better in both until the margin is used up; what is left to choose is the "
            "torque curve. One gain for all angles is bounded where the spring is stiffest, so nearly "
            "straight curves make up most of the front: a stiff one for bandwidth, a soft one for impedance. "
            "Only the one that stiffens most has less impedance still, at a third of the bandwidth.",
            assumed="Rubber of the published actuator with the middle of the range of its loss; one gain for "
            "all angles. A law that is scheduled over the stiffness would not be bounded like this.",
        ),
        TableSection(
            "Springs and gains",
            ("5 N·m at", "Kp", "margin", f"{both[0]}, Hz", f"{both[1]}, N·m/rad", "on the front"),
            rows,
            caption="Gain in rad/s per N·m.",
        ),
        title="Spring and gains together",
        abstract="Bandwidth against output impedance over torque curve and gain.",
    )
