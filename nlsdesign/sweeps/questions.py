"""Questions that ask a room below: on the flat model of a point, for a cam design, and for a diagnosis."""

from __future__ import annotations

import hashlib
import math
from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import Final

import numpy as np

from ..bench.discrepancy import diagnose
from ..bench.discrepancy.effects import catalogue
from ..bench.identification import load_records
from ..components.assembly.named_parts import Assembly
from ..design import DesignSettings, Goal, Limit, Target, design_cam
from ..design.optimisation.solve import GOALS, require_designable
from ..feedback.analysis import Chart, Observability, Stability, over_angle
from ..feedback.control import TorqueGains, encoder_loop, loop_margins, sine_response, torque_controller
from ..feedback.control.closed_loop import ClosedLoop
from ..feedback.control.evaluation.linear_loop import LinearLoop
from ..feedback.observer import CascadeGain, design_observer, observer_bench, observer_errors
from ..foundation.errors import ArrangementError, MeasurementError, ValueRangeError, brief, unknown_name
from ..model import FlatModel, flatten
from ..model.roles import measured_motion, passed_ends, series_spring
from ..model.transform import with_outputs
from .axis_values import ASK, in_unit, si_unit
from .run_sweep import same_bits
from .sweep_columns import SweepColumn
from .sweep_question import SweepQuestion, answer, worst

_HALF_POWER = math.sqrt(0.5)
_FREQUENCIES = 200


def _plant(assembly: Assembly, spring: str, measured: str) -> tuple[FlatModel, str, str]:
    """Return the plant with motion and torque as outputs, and their names."""
    whole = flatten(assembly)
    torque, angle = series_spring(whole, spring or None).effort, measured_motion(whole, measured or None)
    return with_outputs(whole, list(dict.fromkeys([angle, torque]))), torque, angle


def _require_contour(model: FlatModel, first: float, last: float) -> None:
    """Refuse angles beyond the end of a cam."""
    furthest = max(abs(first), abs(last))
    for name, end in passed_ends(model, min(first, last), max(first, last)).items():
        raise ValueRangeError(
            f"angles to {math.degrees(furthest):.4g}°",
            f"go beyond the contour of {name}, which ends at {math.degrees(end):.4g}°",
            next_step="take first and last within it",
        )


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
    corrected
        Whether the torque of the cascade may be corrected by what the drive shows, where that helps.

    Raises
    ------
    ValueRangeError
        If there is no draw, or the seed is negative.
    """

    draws: int = 32
    seed: int = 0
    sample_time: float = in_unit(1e-3, "s")
    corrected: bool = False

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
        if not any(v.uncertain for v in model.parameters):
            raise ArrangementError(
                f"model '{model.name}'", "declares no spread, so there are no errors over it",
                next_step="give numbers a spread",
            )  # fmt: skip
        gain = None if self.corrected else CascadeGain()
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
        Of a PID; the default law of a torque controller where they are left out.
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
        plant, _, _ = _plant(assembly, "", "")
        _require_contour(plant, self.first, self.last)
        observer = design_observer(plant, sample_time=self.sample_time, gain=CascadeGain())
        controller = torque_controller(plant, sample_time=self.sample_time, gains=self.gains)
        substeps = max(1, round(10 * self.sample_time / 1e-3))
        loop = encoder_loop(
            plant, observer=observer, controller=controller, delay=self.delay, substeps=substeps
        )
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


QUICK = DesignSettings(starts=4, draws=0, look_for_size_ranges=False, look_for_remedies=False)
"""Four starts, no draws, no remedies: what a sweep of designs asks of each by default."""
_LEVER_ARM = ".lever_arm"
_ANSWERS = (
    answer("met", "", "1 where the design meets its target"),
    answer("torque_error_rms", "N*m", "rms torque error of the finished assembly"),
    answer("torque_error_relative", "", "the same over the largest torque of the target"),
    answer("torque_error_largest", "N*m", "largest torque error"),
    answer("cam_radius", "m", "largest radius of the contour"),
    answer("radius_of_curvature", "m", "smallest radius of curvature of the contour"),
    answer("lever_arm", "m", "largest lever arm"),
    answer("strain", "", "largest strain of the rubber"),
    answer("cable_force", "N", "largest force in a cable"),
    answer("energy", "N*m", "energy taken up from angle zero to the last angle"),
    answer("rubber_volume", "m^3", "of all elements"),
)


@dataclass(frozen=True)
class DesignQuestion(SweepQuestion):
    """The cam of a spring, and what else is free, for a target; a miss is an answer, ``met`` 0.

    A point whose limits contradict each other fails, with their names as its reason.

    Parameters
    ----------
    target
        Torque curve.
    free
        Full names of what may change besides the contour; ``None`` for the contour alone. Single numbers are
        answers too, as ``designed.NAME``.
    keep
        Limits, besides those of the settings.
    goals
        What is made small, as a sum.
    spring
        Path of the cam spring where the structure leaves it open; empty otherwise.
    settings
        Of the search.
    """

    target: Target
    free: tuple[str, ...] | None = None
    keep: tuple[Limit, ...] = ()
    goals: tuple[Goal, ...] = GOALS
    spring: str = ""
    settings: DesignSettings = QUICK

    def answers(self, assembly: Assembly) -> tuple[SweepColumn, ...]:
        """Return error, sizes, strain, force and energy, and each free single number."""
        known = assembly.quantities()
        chosen = [n for n in self.free or () if n in known and not isinstance(known[n].value, tuple)]
        numbers = [answer(f"designed.{n}", si_unit(known[n].unit), "chosen by the design") for n in chosen]
        return (*_ANSWERS, *numbers)

    def require_fit(self, assembly: Assembly) -> None:
        """Refuse free names, limits and goals that the assembly does not have."""
        require_designable(
            assembly, target=self.target, free=self.free, keep=self.keep, goals=self.goals,
            spring=self.spring or None, settings=self.settings,
        )  # fmt: skip

    def chosen(self, assembly: Assembly) -> frozenset[str]:
        """Return what is free, and the numbers of a contour that is."""
        rows = [name for name in assembly.quantities() if name.endswith(_LEVER_ARM)]
        cams = [name.removesuffix(_LEVER_ARM) for name in rows if name.startswith(self.spring)]
        if self.free is not None:
            cams = [cam for cam in cams if {f"{cam}.contour", f"{cam}{_LEVER_ARM}"} & set(self.free)]
        contours = {f"{cam}{end}" for cam in cams for end in (_LEVER_ARM, ".last_angle")}
        return frozenset({*(self.free or ()), *contours})

    def ask(self, assembly: Assembly) -> Mapping[str, float]:
        """Return what the design is."""
        made = design_cam(
            assembly, target=self.target, free=self.free, keep=self.keep, goals=self.goals,
            spring=self.spring or None, settings=self.settings,
        )  # fmt: skip
        values = {
            "met": float(made.met),
            "torque_error_rms": made.rms,
            "torque_error_relative": made.rms / made.target.largest,
            "torque_error_largest": made.check.largest,
            "cam_radius": float(made.contour.radii.max()),
            "radius_of_curvature": float(made.contour.radii_of_curvature.min()),
            "lever_arm": float(made.contour.lever_arms.max()),
            "strain": max((float(row.max()) for row in made.curves.strains.values()), default=float("nan")),
            "cable_force": float(made.curves.forces.max()),
            "energy": made.curves.energy,
            "rubber_volume": made.rubber_volume,
        }
        changed = made.actuator.quantities()
        names = [c.name.removeprefix("designed.") for c in self.answers(assembly)[len(_ANSWERS) :]]
        return values | {f"designed.{name}": changed[name].number for name in names}


RECORDS: Final = f"{ASK}.records"
"""Name of the axis that lists folders of records."""
_VERDICTS = ("none", "named", "unknown", "undecidable", "data_suspect")


@dataclass(frozen=True)
class DiagnosisQuestion(SweepQuestion):
    """What the declared model lacks on a set of records.

    Parameters
    ----------
    records
        Folder of the records; an axis ``ask.records`` lists several, absolute where workers run elsewhere.
    effects
        Names of the catalogue that get a column; all by default.

    Raises
    ------
    UnknownNameError
        If the catalogue has no effect of a name.
    """

    records: str
    effects: tuple[str, ...] = ()

    def __post_init__(self) -> None:
        known = [each.__name__ for each in catalogue()]
        for name in self._names():
            if name not in known:
                raise unknown_name("effect of the catalogue", name, known)

    def answers(self, assembly: Assembly) -> tuple[SweepColumn, ...]:
        """Return which verdict it is, errors, and of each effect whether it is named and how probable."""
        del assembly
        verdicts = (answer(f"verdict.{name}", "", "1 where that is the verdict") for name in _VERDICTS)
        effects = (
            column
            for name in self._names()
            for column in (
                answer(f"named.{name}", "", "1 where the effect is named"),
                answer(f"probability.{name}", "", "that it is there, where it is named"),
            )
        )
        figures = (
            answer("named", "", "number of effects that are named"),
            answer("held_out_ratio", "", "error on held-out records over the noise floor, after"),
            answer("closed", "", "share of the held-out excess that is gone"),
        )
        return (*verdicts, *figures, *effects)

    def ask(self, assembly: Assembly) -> Mapping[str, float]:
        """Return the verdict in numbers."""
        verdict = diagnose(assembly, load_records(Path(self.records), flatten(assembly)))
        named: dict[str, float] = {}
        for each in verdict.effects:  # one effect may be named at several places
            named[each.name] = float(np.fmax(each.probability, named.get(each.name, math.nan)))
        held_out = any(each.role == "held_out" and each.block == verdict.block for each in verdict.gaps)
        values = {f"verdict.{name}": float(verdict.verdict == name) for name in _VERDICTS}
        values |= {
            "named": float(len(verdict.effects)),
            "held_out_ratio": verdict.held_out_ratio if held_out else math.nan,
            "closed": verdict.closed if held_out else math.nan,
        }
        for name in self._names():
            values[f"named.{name}"] = float(name in named)
            values[f"probability.{name}"] = named.get(name, math.nan)
        return values

    def _names(self) -> tuple[str, ...]:
        # Functions of the catalogue are named as their effects.
        return self.effects or tuple(dict.fromkeys(each.__name__ for each in catalogue()))

    def describe(self) -> str:
        """Return the question with a digest of the records, so that changed records are another question."""
        return f"{super().describe()} {_content(Path(self.records))}"

    def stands_for(self, name: str, text: str) -> str:
        """Return the digest of the records in a folder that an axis lists.

        Raises
        ------
        MeasurementError
            If there is no such folder.
        """
        return _content(Path(text)) if name == RECORDS else ""


def _content(folder: Path) -> str:
    if not folder.is_dir():
        raise MeasurementError(str(folder), "is no folder", next_step="name the folder of the records")
    digest = hashlib.sha256()
    for path in sorted(p for p in folder.rglob("*") if p.is_file()):
        digest.update(path.relative_to(folder).as_posix().encode())
        digest.update(hashlib.sha256(path.read_bytes()).digest())
    return digest.hexdigest()
