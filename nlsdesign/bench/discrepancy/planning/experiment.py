"""What to measure next: the experiment that tells the present hypotheses apart best.

Candidates (:mod:`.candidate_commands`) are driven through every hypothesis within the limits of the
machine, which gives the record that each would leave; the one with the largest expected separation
(:mod:`.separation`) is proposed.
"""

from __future__ import annotations

import itertools
import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any

import numpy as np

from ....foundation.arrays import Array
from ....foundation.errors import ConvergenceError, MeasurementError
from ....foundation.quantity import parse_unit, with_unit
from ....foundation.text_files import write_text
from ....foundation.work_sharing import parallel_map
from ....model import FlatModel, flatten
from ....model.readings import reading_of
from ....model.structure import MovingBody, body_moved_by
from ....simulation import Trace, simulate
from ...identification.equation_error.block import Block, NoiseFloor
from ...identification.equation_error.block_noise import LEAST_ROWS, noise_floor
from ...identification.equation_error.block_response import DrivenBlock
from ...identification.equation_error.evidence import Bench
from ...identification.records.measurement import Record
from ..selection.hypothesis import Hypothesis
from ..tearing import blocks_of
from .candidate_commands import Command, MachineLimits, commands, limits_seen
from .separation import ReadyHypothesis, Values, apart, made_ready

_ROUNDS, _CLOSE = 6, 1e-3
"""Corrections of a drive, and the share of it below which a further one changes nothing that is measured."""
_PROBE = 1e-3
"""Step of a drive by which its slope is taken, relative to the largest that was measured."""


@dataclass(frozen=True)
class MeasuredSignals:
    """The measured signals by what they are."""

    motions: Mapping[str, MovingBody]  # the body whose motion each shows, by the name of the signal
    rates: Mapping[str, MovingBody]  # the body whose speed each shows
    drives: tuple[str, ...]  # inputs of the model, such as a current
    efforts: tuple[str, ...]  # forces and torques that the model predicts


def measured_signals(model: FlatModel, signals: Sequence[str]) -> MeasuredSignals:
    """Sort measured signals by what they are."""
    inputs = {v.name for v in model.inputs}
    motions, rates, drives, efforts = {}, {}, [], []
    for signal in signals:
        shown = reading_of(model.readings, signal).measured
        body = body_moved_by(model.bodies, shown)
        turning = next((b for b in model.bodies if b.rate == shown), None)
        if turning is not None:
            rates[signal] = turning
        elif body is not None:
            motions[signal] = body
        elif shown in inputs:
            drives.append(signal)
        else:
            efforts.append(signal)
    return MeasuredSignals(motions, rates, tuple(drives), tuple(efforts))


def check_command(measured: MeasuredSignals, commanded: str) -> None:
    """Check that all measured signals follow from the commanded one."""
    if commanded in measured.drives:
        return
    if commanded not in measured.motions:
        raise MeasurementError(
            f"commanded signal '{commanded}'",
            "is neither a measured motion nor a measured drive",
            next_step="command one of: " + ", ".join([*measured.motions, *measured.drives]),
        )
    body = measured.motions[commanded]
    others = [s for s, b in measured.motions.items() if b != body and not b.prescribed]
    if others:
        raise MeasurementError(
            f"measured motion '{others[0]}'",
            f"does not follow from '{commanded}' alone",
            next_step="command a drive",
        )


@dataclass(frozen=True, eq=False)
class Machine:
    """What is needed to say which record an experiment would leave."""

    model: FlatModel  # of the hypothesis, with its fitted numbers
    driven: tuple[DrivenBlock, ...]  # its blocks, ready for evaluation
    measured: MeasuredSignals  # the measured signals by what they are
    units: Mapping[str, str]  # SI units by signal
    rest: Mapping[str, float]  # value of each signal at rest
    largest: Mapping[str, float]  # largest size of each signal in the records

    def record(self, time: Array, commanded: str, value: Array) -> Record:
        """Return the record that a command would leave.

        A commanded motion is taken as followed by the machine; a commanded drive is simulated.
        """
        if commanded in self.measured.drives:
            return self._simulated(time, commanded, value)
        signals = {s: np.full(len(time), v) for s, v in self.rest.items()}
        signals[commanded] = value
        body = self.measured.motions[commanded]
        for signal, other in (*self.measured.motions.items(), *self.measured.rates.items()):
            if other == body and signal != commanded:
                is_rate = signal in self.measured.rates
                signals[signal] = np.gradient(value, time) if is_rate else value
        readings = [d for d in self.driven if d.block.target is not None]
        balances = [d for d in self.driven if d.block.target is None]
        # A force may depend on another measured one, and a drive on all of them.
        for _ in readings:
            for each in readings:
                assert each.block.target is not None
                signals[each.block.target] = self._response(each, time, signals)
        for each in balances:
            self._balance(each, time, signals)
        return self._as_record(time, signals)

    def _response(self, driven: DrivenBlock, time: Array, signals: Mapping[str, Array]) -> Array:
        record = self._as_record(time, signals)
        return driven.respond(driven.samples(record, self.model.values), self.model.values).output

    def _balance(self, driven: DrivenBlock, time: Array, signals: dict[str, Array]) -> None:
        """Set the drive of a body to what its motion asks for."""
        drives = [d.signal for d in driven.block.drives.values() if d.signal in self.measured.drives]
        if not drives:
            return
        drive = drives[0]
        probe = _PROBE * self.largest[drive] or 1.0
        error = self._response(driven, time, signals)
        moved = self._response(driven, time, {**signals, drive: signals[drive] + probe})
        slope = float(np.median(moved - error)) / probe
        if slope == 0.0 or not np.isfinite(slope):
            return
        for _ in range(_ROUNDS):
            step = error / slope
            signals[drive] = signals[drive] - step
            if np.max(np.abs(step)) <= _CLOSE * max(float(np.max(np.abs(signals[drive]))), 1e-300):
                break
            error = self._response(driven, time, signals)

    def _simulated(self, time: Array, commanded: str, value: Array) -> Record:
        shown = reading_of(self.model.readings, commanded).measured
        run = simulate(self.model, time, inputs={shown: value}, tolerance=1e-6)
        return self._as_record(time, {s: run[s] for s in self.units})

    def _as_record(self, time: Array, signals: Mapping[str, Array]) -> Record:
        return Record("experiment", Trace(time, dict(signals), dict(self.units), "experiment"))


_REACH = 1.02
"""A drive or motion may exceed its limit by this factor: the model that says so is not better known."""
_DECIDES = 3.0
"""Standard errors from which a record decides between two hypotheses, with little risk of chance."""
_DIGITS = 9


@dataclass(frozen=True)
class Separation:
    """How well an experiment tells two hypotheses apart."""

    # one, other: effects of each, joined by " + "
    one: str
    other: str
    # standard_errors: expected distance of their predictions in standard errors of the noise, after each was
    # refitted
    standard_errors: float
    # block, time: where, and when, they are furthest apart
    block: str
    time: float

    @property
    def decides(self) -> bool:
        """Whether the record is expected to decide between the two."""
        return self.standard_errors >= _DECIDES


@dataclass(frozen=True, eq=False)
class Experiment:
    """A record that is proposed."""

    motion: str  # what is commanded, in words
    signal: str  # name of the measured signal that is commanded
    # head, unit: head and unit of its column in the records
    head: str
    unit: str
    # command: of that signal over time, in SI, with the other signals as the best hypothesis expects them
    command: Trace
    separations: tuple[Separation, ...]  # one for each pair of hypotheses, the worst first
    limits: MachineLimits  # within which it stays

    @property
    def duration(self) -> float:
        """Duration in s."""
        return float(self.command.time[-1] - self.command.time[0])

    @property
    def decides(self) -> bool:
        """Whether it is expected to decide between every pair."""
        return all(s.decides for s in self.separations)

    def words(self) -> str:
        """Return in sentences what to record and what it would show."""
        value = self.command[self.signal] / parse_unit(self.unit).factor
        span = f"{value.min():.3g} to {with_unit(f'{value.max():.3g}', self.unit)}"
        text = f"Record {self.motion} of {self.signal} for {self.duration:.3g} s, from {span}."
        for each in self.separations:
            pair = f"{each.one or 'the declared model'} and {each.other or 'the declared model'}"
            text += (
                f" It would tell {pair} apart by {each.standard_errors:.2g} standard errors, most at "
                f"`{each.block}` around {each.time:.3g} s" + ("." if each.decides else ", too few to decide.")
            )
        return text

    def to_dict(self) -> dict[str, Any]:
        """Return it for ``verdict.json``."""
        return {
            "motion": self.motion,
            "signal": self.signal,
            "duration_s": self.duration,
            "separations": [
                {
                    "one": s.one,
                    "other": s.other,
                    "standard_errors": s.standard_errors,
                    "block": s.block,
                    "time_s": s.time,
                }
                for s in self.separations
            ],
            "words": self.words(),
        }


def next_experiment(
    hypotheses: Sequence[Hypothesis],
    bench: Bench,
    *,
    commanded: str = "",
    limits: MachineLimits | None = None,
    duration: float | None = None,
) -> Experiment | None:
    """Return the record that would tell hypotheses apart best.

    Parameters
    ----------
    hypotheses
        Fitted to the records, the best first: what was chosen, and what the records do not tell from it.
    bench
        The records so far, with their noise.
    commanded
        Measured signal that the bench is to follow. By default the measured motion, as where it is
        servoed or prescribed, and without one the first measured drive.
    limits
        Of the machine; by default what the records show that it has done.
    duration
        In s; by default that of the longest record.

    Returns
    -------
    Experiment or None
        ``None`` where there are fewer than two hypotheses, or no candidate stays within the limits.

    Raises
    ------
    MeasurementError
        If the signal cannot be commanded.
    """
    if len(hypotheses) < 2:
        return None
    plan = _Plan(hypotheses, bench, commanded)
    bounds = limits or plan.limits()
    time = plan.time(duration)
    candidates = commands(time, plan.rest[plan.commanded], bounds)
    results = list(parallel_map(lambda k: plan.judged(time, candidates[k], bounds), len(candidates)))
    best: tuple[float, int] | None = None
    for k, result in enumerate(results):
        if result is not None and (best is None or result.score > best[0]):
            best = result.score, k
    if best is None or best[0] <= 0.0:
        return None
    chosen = results[best[1]]
    assert chosen is not None
    column = bench.records.column(plan.commanded)
    separations = sorted(chosen.separations, key=lambda s: s.standard_errors)
    return Experiment(
        candidates[best[1]].words, plan.commanded, column.name, column.unit, chosen.record.trace,
        tuple(separations), bounds,
    )  # fmt: skip


def write_command(experiment: Experiment, path: Path) -> None:
    """Write the commanded signal over time as CSV: ``t_s`` and the head of its column in the records.

    The numbers have the unit of that column, and the unit stands in the head.

    Parameters
    ----------
    experiment
        To be recorded.
    path
        File; its folder is made if needed.
    """
    unit, head = experiment.unit, experiment.head
    name = head if head.endswith((f"_{unit}", f"[{unit}]")) else f"{head} [{unit}]"
    value = experiment.command[experiment.signal] / parse_unit(unit).factor
    rows = zip(experiment.command.time, value, strict=True)
    lines = [f"t_s,{name}", *(f"{t:.{_DIGITS}g},{v:.{_DIGITS}g}" for t, v in rows)]
    write_text(path, "\n".join(lines) + "\n")


@dataclass(frozen=True, eq=False)
class _Judged:
    """What a candidate would leave, and how far it tells the hypotheses apart."""

    record: Record
    separations: tuple[Separation, ...]
    score: float


class _Plan:
    """The hypotheses, ready to be evaluated on candidates."""

    def __init__(self, hypotheses: Sequence[Hypothesis], bench: Bench, commanded: str) -> None:
        self._bench, records = bench, bench.records
        model = flatten(hypotheses[0].fitted)
        self._measured = measured_signals(model, records.signals)
        self._declared = _declared_limits(model, self._measured)
        self.commanded = commanded or _usual(self._measured)
        check_command(self._measured, self.commanded)
        traces = [r.trace for r in records.records]
        self.rest = {s: float(np.median([t[s][0] for t in traces])) for s in records.signals}
        self._largest = {s: max(float(np.max(np.abs(t[s]))) for t in traces) for s in records.signals}
        self._noise = _noise(hypotheses[0], bench)
        self._rivals = [self._rival(h, flatten(h.fitted)) for h in hypotheses]
        first = self._rivals[0]
        self._blocks: tuple[Block, ...] = tuple(d.block for d in first.driven)
        self._open = _differing(hypotheses)
        self._machine = Machine(
            model, first.driven, self._measured, dict(traces[0].units), self.rest, self._largest
        )

    def _rival(self, hypothesis: Hypothesis, model: FlatModel) -> ReadyHypothesis:
        driven = []
        for block in blocks_of(model, self._bench.records.signals):
            names = set(block.model.values)
            free = [p.name for f in hypothesis.fits.values() for p in f.parameters if p.name in names]
            driven.append(self._bench.driven(block, list(dict.fromkeys(free))))
        return made_ready(hypothesis, self._bench, driven, self._noise)

    def limits(self) -> MachineLimits:
        """Return what the records show that the machine has done; declared limits of drives stand first."""
        seen = limits_seen(
            self._bench.records.records,
            self.commanded,
            drives=self._measured.drives,
            motions=tuple(self._measured.motions),
        )
        return replace(seen, drive=tuple((n, self._declared.get(n, most)) for n, most in seen.drive))

    def time(self, duration: float | None) -> Array:
        """Return the samples of the experiment, with the step of the records."""
        records = self._bench.records.records
        step = float(np.median([r.step for r in records]))
        long = duration or max(float(r.trace.time[-1] - r.trace.time[0]) for r in records)
        return np.asarray(np.arange(max(round(long / step), 1) + 1) * step, dtype=np.float64)

    def judged(self, time: Array, command: Command, limits: MachineLimits) -> _Judged | None:
        """Return how well a candidate tells the hypotheses apart; nothing where it leaves the limits."""
        try:
            record = self._machine.record(time, self.commanded, command.value)
            if not _inside(record, limits):
                return None
            floors = self._floors(record)
            answers = [r.responses(record, floors) for r in self._rivals]
        except ConvergenceError:
            return None  # what a hypothesis cannot predict tells nothing; other commands are tried
        separations = []
        for i, j in itertools.combinations(range(len(self._rivals)), 2):
            ways = (
                apart(answers[i], answers[j][0], self._rivals[j], self._noise),
                apart(answers[j], answers[i][0], self._rivals[i], self._noise),
            )
            squares = 0.5 * (ways[0].squares + ways[1].squares)
            clearer = max(ways, key=lambda a: a.squares)
            at = float(time[floors[clearer.block].places[clearer.row]]) if clearer.block in floors else 0.0
            names = [" + ".join(self._rivals[k].hypothesis.names) for k in (i, j)]
            separations.append(Separation(names[0], names[1], math.sqrt(squares), clearer.block, at))
        score = sum(math.log1p(0.5 * s.standard_errors**2) for s in separations)
        return _Judged(record, tuple(separations), score)

    def _floors(self, record: Record) -> dict[str, NoiseFloor]:
        bench = self._bench
        floors = {
            b.name: noise_floor(b, record, bench.noise, bench.block_noise[b.name].filters)
            for b in self._blocks
            if b.name in self._open and b.name in bench.block_noise
        }
        return {name: f for name, f in floors.items() if len(f.sigma) >= LEAST_ROWS}


def _differing(hypotheses: Sequence[Hypothesis]) -> set[str]:
    """Return the names of the blocks of which not all hypotheses share one fit."""
    first = {name: fit for names, fit in hypotheses[0].fits.items() for name in names}
    return {
        name
        for h in hypotheses
        for names, fit in h.fits.items()
        for name in names
        if first.get(name) is not fit
    }


def _declared_limits(model: FlatModel, measured: MeasuredSignals) -> dict[str, float]:
    """Return the declared limit of each measured drive that has one."""
    limits = {b.motor.command: model.values[b.motor.current_limit] for b in model.bodies if b.motor}
    shown = {drive: reading_of(model.readings, drive).measured for drive in measured.drives}
    return {drive: limits[name] for drive, name in shown.items() if name in limits}


def _usual(measured: MeasuredSignals) -> str:
    """Return what benches command: the motion where it is the only one measured, or else the drive."""
    bodies = {body.name for body in measured.motions.values() if not body.prescribed}
    motions = list(measured.motions) if len(bodies) <= 1 else []
    free = [s for s in motions if not measured.motions[s].prescribed]
    named = [*free, *motions, *measured.drives]
    if not named:
        raise MeasurementError(
            "records", "measure nothing that can be commanded", next_step="measure a motion or a drive"
        )
    return named[0]


def _inside(record: Record, limits: MachineLimits) -> bool:
    trace = record.trace
    drives = all(float(np.max(np.abs(trace[n]))) <= _REACH * most for n, most in limits.drive)
    return drives and all(
        low - (_REACH - 1.0) * (high - low) <= float(trace[n].min())
        and float(trace[n].max()) <= high + (_REACH - 1.0) * (high - low)
        for n, low, high in limits.travel
    )


def _noise(best: Hypothesis, bench: Bench) -> Values:
    """Return the variance of each block in units of its noise floor: what the best hypothesis leaves.

    Coloured residuals count as so much more variance as they are fewer than their number.
    """
    fitted = {r.name for r in bench.records.of("fit")}
    result = {}
    for name in bench.block_noise:
        own = [t for (block, record), t in best.tallies.items() if block == name and record in fitted]
        rows = sum(t.rows for t in own)
        size = sum(t.squares for t in own) / max(rows, 1)
        colour = rows / max(sum(t.effective_size for t in own), 1.0)
        result[name] = max(size, 1.0) * max(colour, 1.0)
    return result
