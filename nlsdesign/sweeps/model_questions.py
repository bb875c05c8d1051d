"""Questions on the flat model of each point: over the angle, over the spread, and in a closed loop."""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import dataclass

import numpy as np

from ..components.assembly.named_parts import Assembly
from ..feedback.analysis import Chart, Observability, Stability, over_angle
from ..feedback.control import TorqueGains, encoder_loop, loop_margins, sine_response, torque_controller
from ..feedback.control.closed_loop import ClosedLoop
from ..feedback.control.evaluation.linear_loop import LinearLoop
from ..feedback.observer import CascadeGain, design_observer, observer_bench, observer_errors
from ..foundation.errors import ArrangementError, ValueRangeError, brief
from ..model import FlatModel, flatten
from ..model.roles import measured_motion, series_spring
from ..model.transform import with_outputs
from .axis_values import in_unit
from .same_bits import same_bits
from .sweep_columns import SweepColumn
from .sweep_question import SweepQuestion, answer, worst

_HALF_POWER = math.sqrt(0.5)
_FREQUENCIES = 200
_SAME_ANGLE = 1e-4
"""Relative: a design finds the end of its contour numerically."""


def _plant(assembly: Assembly, spring: str, measured: str) -> tuple[FlatModel, str, str]:
    """Return the plant with motion and torque as outputs, and their names."""
    whole = flatten(assembly)
    torque, angle = series_spring(whole, spring or None).effort, measured_motion(whole, measured or None)
    return with_outputs(whole, list(dict.fromkeys([angle, torque]))), torque, angle


def _require_contour(model: FlatModel, first: float, last: float) -> None:
    """Refuse angles beyond the end of a cam, where a model goes on and no cam does."""
    furthest = max(abs(first), abs(last))
    for cam in (cam for spring in model.springs for cam in spring.cams if cam.last_angle):
        end = model.values[cam.last_angle or ""]
        if furthest > end * (1.0 + _SAME_ANGLE):
            raise ValueRangeError(
                f"angles to {math.degrees(furthest):.4g}°",
                f"go beyond the contour of {cam.name}, which ends at {math.degrees(end):.4g}°",
                next_step="take first and last within it",
            )  # fmt: skip


@dataclass(frozen=True)
class AngleQuestion(SweepQuestion):
    """Poles, stiffness and observability at rest over the angle: the least and the largest of each.

    Parameters
    ----------
    first, last
        Angles in rad.
    count
        Number of angles.
    spring, measured
        Where the structure leaves them open; empty otherwise.
    """

    first: float = in_unit(0.0, "rad")
    last: float = in_unit(0.8, "rad")
    count: int = 11
    spring: str = ""
    measured: str = ""

    def answers(self, assembly: Assembly) -> tuple[SweepColumn, ...]:
        """Return two columns for each number of the analysis of the assembly that is swept."""
        return tuple(
            answer(f"{end}.{v.name}", v.unit, f"{end} over the angle: {v.description}")
            for v in self._chart(assembly).columns
            for end in ("least", "largest")
        )

    def ask(self, assembly: Assembly) -> Mapping[str, float]:
        """Return least and largest of each number; not a number where one of the angles has none."""
        chart = self._chart(assembly)
        return {
            f"{end}.{v.name}": worst(chart[v.name], of=of)
            for v in chart.columns
            for end, of in (("least", min), ("largest", max))
        }

    def _chart(self, assembly: Assembly) -> Chart:
        model, torque, angle = _plant(assembly, self.spring, self.measured)
        _require_contour(model, self.first, self.last)
        views = [Observability(measured=(angle,)), Stability(torque=torque)]
        return over_angle(model, views, angles=np.linspace(self.first, self.last, self.count), angle=angle)


@dataclass(frozen=True)
class SpreadQuestion(SweepQuestion):
    """Torque error of an observer with exact numbers and over the spread, at the worst frequency of a duty.

    Parameters
    ----------
    draws
        How many machines are drawn at each point.
    seed
        Of the draws.
    sample_time
        In s.
    adaptive
        Whether the observer may learn deviations, where that helps; otherwise it is the cascade.

    Raises
    ------
    ValueRangeError
        If there is no draw, or the seed is negative.
    """

    draws: int = 32
    seed: int = 0
    sample_time: float = in_unit(1e-3, "s")
    adaptive: bool = False

    def __post_init__(self) -> None:
        for name, given, least in (("draws", self.draws, 1), ("seed", self.seed, 0)):
            if isinstance(given, bool) or not isinstance(given, int) or given < least:
                raise ValueRangeError(
                    f"SpreadQuestion: {name} = {brief(given)}", f"must be a whole number from {least} on",
                    next_step=f"write for instance {name} = {32 if name == 'draws' else 0}",
                )  # fmt: skip

    def answers(self, assembly: Assembly) -> tuple[SweepColumn, ...]:
        """Return errors in the unit of the torque."""
        model, torque, _ = _plant(assembly, "", "")
        unit = model.variable(torque).unit
        return (
            answer("error.exact", unit, "rms torque error with the numbers of the deck, worst frequency"),
            answer("error.median", unit, "its median over the spread, worst frequency"),
            answer("error.most", unit, "its 90 % quantile over the spread, worst frequency"),
            answer("error.lost", "", "draws whose machine does not run"),
        )

    def ask(self, assembly: Assembly) -> Mapping[str, float]:
        """Return the errors.

        Raises
        ------
        ArrangementError
            If no number of the deck has a spread.
        """
        model, torque, angle = _plant(assembly, "", "")
        if not any(v.spread > 0.0 for v in model.parameters):
            raise ArrangementError(
                f"model '{model.name}'", "declares no spread, so there are no errors over it",
                next_step="give numbers a spread",
            )  # fmt: skip
        gain = None if self.adaptive else CascadeGain()
        observer = design_observer(model, sample_time=self.sample_time, gain=gain)
        bench = observer_bench(model, estimate=torque, measured=angle, sample_time=self.sample_time)
        errors = observer_errors(
            {"observer": observer}, bench, draws=self.draws, seed=self.seed, bounded=0, translate=same_bits
        )
        return {
            "error.exact": float(np.max(errors.exact[0])),
            "error.median": float(np.max(errors.quantile("observer", 0.5))),
            "error.most": float(np.max(errors.quantile("observer", 0.9))),
            "error.lost": float(errors.lost),
        }


@dataclass(frozen=True)
class LoopQuestion(SweepQuestion):
    """The closed torque loop with its load fixed: stability, margins and bandwidth of the linear one, a sine.

    Parameters
    ----------
    sample_time
        In s.
    delay
        Samples between a current's computation and its effect.
    first, last
        Angles in rad between which the margins are taken.
    count
        Number of angles.
    amplitude, frequency
        Of a sine of the desired torque, in N·m and Hz, that the loop is run on; amplitude 0 for none.
    gains
        Of the controller; picked for the sample time where they are left out.
    """

    sample_time: float = in_unit(1e-3, "s")
    delay: int = 1
    first: float = in_unit(0.1, "rad")
    last: float = in_unit(0.8, "rad")
    count: int = 9
    amplitude: float = in_unit(0.0, "N*m")
    frequency: float = in_unit(2.0, "1/s")
    gains: TorqueGains | None = None

    def answers(self, assembly: Assembly) -> tuple[SweepColumn, ...]:
        """Return stability, margins, bandwidth and, where a sine is asked for, how it went."""
        del assembly
        run = (
            answer("sine.holds", "", "1 where the run on the sine settles"),
            answer(
                "sine.decibel", "", "torque over desired torque, in dB; not a number where it does not hold"
            ),
            answer("sine.saturated", "", "share of the time at the limit of the current"),
        )
        return (
            answer("stable", "", "1 where the linear loop is stable at all angles"),
            answer("gain_margin", "", "least over the angle, in dB; infinite where any growth is allowed"),
            answer("phase_margin", "rad", "least over the angle"),
            answer("delay_margin", "s", "least over the angle"),
            answer("bandwidth", "Hz", "least -3 dB frequency over the angle"),
            *(run if self.amplitude > 0.0 else ()),
        )

    def ask(self, assembly: Assembly) -> Mapping[str, float]:
        """Return the figures; margins and bandwidth are not numbers where the loop is not stable."""
        loop = self._loop(assembly)
        margins = loop_margins(loop, np.linspace(self.first, self.last, self.count))
        values = {
            "stable": float(np.all(margins.linear.stable())),
            "gain_margin": worst(margins.gain, of=min),
            "phase_margin": math.radians(worst(margins.phase, of=min)),
            "delay_margin": worst(margins.delay, of=min),
            "bandwidth": self._bandwidth(loop, margins.linear),
        }
        if self.amplitude > 0.0:
            response = sine_response(
                loop, amplitude=self.amplitude, frequencies=[self.frequency], translate=same_bits
            )
            verdict = response.verdicts[0]
            values["sine.holds"] = float(verdict.holds)
            values["sine.decibel"] = float(response.decibel[0]) if verdict.holds else math.nan
            values["sine.saturated"] = verdict.saturated
        return values

    def _loop(self, assembly: Assembly) -> ClosedLoop:
        plant, _, _ = _plant(assembly, "", "")
        _require_contour(plant, self.first, self.last)
        observer = design_observer(plant, sample_time=self.sample_time, gain=CascadeGain())
        controller = torque_controller(plant, sample_time=self.sample_time, gains=self.gains)
        substeps = max(1, round(10 * self.sample_time / 1e-3))
        return encoder_loop(
            plant, observer=observer, controller=controller, delay=self.delay, substeps=substeps
        )

    def _bandwidth(self, loop: ClosedLoop, linear: LinearLoop) -> float:
        """Return the least frequency at which the torque falls below -3 dB, over all angles."""
        if not np.all(linear.stable()):
            return math.nan
        frequencies = np.geomspace(0.02, 0.499 / self.sample_time, _FREQUENCIES)
        size = np.abs(linear.response(loop.torque, loop.desired, frequencies))
        fallen = size < _HALF_POWER
        if not np.all(np.isfinite(size)) or not np.all(np.any(fallen, axis=1)):
            return math.nan
        first = np.argmax(fallen, axis=1)
        return worst((_crossing(row, k, frequencies) for row, k in zip(size, first, strict=True)), of=min)


def _crossing(size: np.ndarray, place: int, frequencies: np.ndarray) -> float:
    """Return where a row falls through -3 dB, between two frequencies on a logarithmic scale."""
    if place == 0:
        return 0.0
    high, low = math.log(size[place - 1]), math.log(size[place])
    share = (high - math.log(_HALF_POWER)) / (high - low)
    return float(frequencies[place - 1] * (frequencies[place] / frequencies[place - 1]) ** share)
