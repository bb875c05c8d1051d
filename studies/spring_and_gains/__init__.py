"""Bandwidth against output impedance: gains for one spring, and spring and gains designed together.

More gain gives more bandwidth and less impedance until the loop limit-cycles; a softer spring bears more gain
but has further to go. So the torque curve of the spring and the gain belong together: a front over both.

Two halves. Simulated: the gain of each designed spring is half that at which its loop limit-cycles. Linear:
the gain of each published and each designed spring is the largest that keeps its margins over the angle and
over machines drawn from the spread, with a PID law and with the one that is scheduled over the stiffness.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path

import numpy as np

import nlsdesign as nls
from nlsdesign.components import loss_of, material
from nlsdesign.design import CamDesign
from nlsdesign.feedback.control import LoopChoice, best_choices
from nlsdesign.foundation.arrays import Array
from nlsdesign.foundation.errors import NlsError
from nlsdesign.foundation.written_numbers import three_digits
from nlsdesign.presentation.report import FigureSection, TableSection

from ..alternative_rubber.bench import Bench, Rubber
from ..alternative_rubber.candidates import designed
from ..alternative_rubber.merits import HIGH, MOVED_AT, largest_gains, measured
from .under_margins import (
    DECKS,
    DRAWS,
    LIMITS,
    Line,
    front_of,
    lines_of,
    published,
    stiffness_felt,
)

RUBBER = "PMC-770"
ANGLES, SHAPES = (40.0, 53.0, 65.0), (0.2, 1.0, 2.5)
"""Degrees at which the spring reaches 5 N·m, and shapes of its exponential: 0.2 is nearly a line."""
PUBLISHED = (53.0, 1.0)
MARGINS = (4.0, 2.8, 2.0)
"""Gain at which the loop limit-cycles over the gain that is taken."""


def _label(angle: float, shape: float) -> str:
    return f"{angle:g}° shape {shape:g}"


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
        return _label(self.angle, self.shape)


@dataclass(frozen=True, eq=False)
class Results:
    """All springs, the names of those that miss their target, and the lines of the linear half."""

    springs: tuple[Spring, ...]
    missed: tuple[str, ...]
    lines: tuple[Line, ...] = ()

    @property
    def best_under_margins(self) -> tuple[LoopChoice, ...]:
        """Choices of the linear half that no other betters in bandwidth and impedance."""
        return front_of(self.lines)

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
            **self._under_margins(),
        }

    def _under_margins(self) -> dict[str, float]:
        """Return the numbers of the linear half."""
        numbers: dict[str, float] = {}
        for line in self.lines:
            if line.spring in DECKS:
                numbers |= line.numbers | {f"{line.spring}_reach_Hz": line.reach}
        best = self.best_under_margins
        if len({line.spring for line in self.lines}) > len(DECKS):
            numbers["best_under_margins"] = float(len(best))
            numbers["designed_among_them"] = float(sum(c.name.split(",")[0] not in DECKS for c in best))
        return numbers

    def _straight(self, k: int) -> dict[str, float]:
        """Return the numbers of the spring that is nearly a line to the same torque at the same angle."""
        if all(s.label != _label(PUBLISHED[0], SHAPES[0]) for s in self.springs):
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
    designs = {choice: design_for(*choice) for choice in choices}
    made = {choice: design for choice, design in designs.items() if design is not None}
    springs = tuple(swept(design, *choice) for choice, design in made.items())
    actuators = {s.label: d.actuator for s, d in zip(springs, made.values(), strict=True)} if not fast else {}
    asked = {name: a for name, a in published().items() if name == "nonlinear" or not fast}
    missed = tuple(_label(*choice) for choice, design in designs.items() if design is None)
    results = Results(springs, missed, lines_of(asked | actuators))
    write(out, results)
    return results


def design_for(angle: float, shape: float) -> CamDesign | None:
    """Return a designed spring; none where the target is missed."""
    target = nls.ExponentialTorque(maximum=5.0, angle=nls.degrees(angle), shape=shape)
    rubber = material(RUBBER)
    try:
        design = designed(rubber, loss_of(rubber).middle, target)
    except NlsError:
        # Limits in conflict: a miss, which the report names.
        return None
    return design if design.met else None


def swept(design: CamDesign, angle: float, shape: float, margins: Sequence[float] = MARGINS) -> Spring:
    """Return what the simulated loop of a design does at several gains."""
    loss = loss_of(material(RUBBER)).middle
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
        *_linear_sections(results),
        title="Spring and gains together",
        abstract="Bandwidth against output impedance over torque curve and gain.",
    )


def _linear_sections(results: Results) -> tuple[FigureSection, TableSection]:
    """Return figure and table of the linear half."""
    best = results.best_under_margins
    curves = {
        line.label: _points(line.choices)
        for line in results.lines
        if line.choices and line.spring in DECKS
    }  # fmt: skip
    for law in dict.fromkeys(line.law.title for line in results.lines):
        own = [line.last for line in results.lines if line.law.title == law and line.spring not in DECKS]
        kept_ones = best_choices([c for c in own if c is not None])
        if kept_ones:
            curves[f"best designed, {law}"] = _points(kept_ones)
    curves["no other is better in both"] = _points(best)
    up = f"bandwidth up to {HIGH:g} N·m, Hz"
    across = f"impedance at {MOVED_AT:g} Hz, N·m/rad"
    kept = f"{LIMITS.gain_margin:g} dB and {LIMITS.phase_margin:g}°"
    rows = tuple(
        (
            line.label,
            f"{three_digits(line.largest)} {line.law.unit}" if line.choices else line.limited_by,
            *_last(line),
            "yes" if any(c in best for c in line.choices) else "",
        )
        for line in results.lines
    )
    figure = FigureSection(
        "Published and designed springs under margins",
        nls.figures.curves(
            curves,
            across=across,
            up=up,
            words=f"Bandwidth over impedance of {len(curves) - 1} lines of springs and laws under margins.",
        ),
        caption=f"Along each line of a published spring the gain rises from a quarter to the largest that "
        f"keeps {kept} at three torques, for the declared machine and for {DRAWS} drawn from its spread; of "
        "the designed springs that gain only, of those that no other designed one betters.",
        means="A soft spring bears the most gain and has the least impedance, but the motor has furthest to "
        f"go: it makes a sine of {HIGH:g} N·m only up to the lowest frequency. A PID gain is bounded where "
        "the spring is stiffest and is slow where it is soft; scheduled over the stiffness a stiffening "
        "spring follows small motions as quickly as a straight one. Its impedance is no less for that, since "
        "both laws have nearly the same gain at the stiffest place. In these figures nothing is better than "
        "springs that are straight or nearly so, from soft to stiff.",
        assumed="Linear loops at rest at 0.3, 1.4 and 2.8 N·m, the plant sliding, no counts; the worst of "
        "these counts. Bandwidth is the lower of that of small motions and the frequency up to which speed "
        f"limit and current allow a sine of {HIGH:g} N·m. Nothing is fed forward.",
    )
    heads = ("spring, law", "largest gain", "small motions, Hz", "reach, Hz", across, "on the front")
    return figure, TableSection(
        "Largest gains under margins", heads, rows, caption=f"Margins of {kept}; reach at {HIGH:g} N·m."
    )


def _points(choices: Sequence[LoopChoice]) -> tuple[Array, Array]:
    """Return impedance and bandwidth."""
    return np.array([stiffness_felt(c) for c in choices]), np.array([c.bandwidth for c in choices])


def _last(line: Line) -> tuple[float, float, float]:
    """Return bandwidth of small motions, reach and impedance at the largest gain."""
    if line.last is None:
        return np.nan, line.reach, np.nan
    return line.small[-1], line.reach, stiffness_felt(line.last)
