"""What a calibration would buy, before any record exists: from the information of the run that is planned.

The runs that a calibration is planned with: motions of the machine as declared, and the current needed.
"""

from __future__ import annotations

import json
import math
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np

from ...components.assembly.named_parts import Assembly
from ...foundation.arrays import Array
from ...foundation.errors import ArrangementError, InfeasibleError, unknown_name
from ...foundation.text_files import write_text
from ...foundation.written_numbers import shared_prefix, without_power
from ...model import FlatModel, flatten
from ...model.readings import reading_of
from ...model.roles import driven_body, series_spring
from ...simulation import Prior
from .bench_response import (
    BenchCourse,
    BenchResponse,
    RecordedRun,
    SampleNoise,
    bench_response,
    window_length,
)
from .bench_test import CalibrationTest, FreeRunTest, HungWeightTest, LoadCellTest
from .estimate import prior_of
from .unknowns import BenchEvidence, Unknowns, bench_evidence, bench_prior

_SAMPLES = 1000.0
"""Hz at which a bench is taken to log."""
_PER_WINDOW = 24
"""Samples of a window that are enough; each stands for the mean of several."""
_SLOW = (0.25, 8.0, 1.0)
_QUICK = (_SLOW, (1.0, 4.0, 1.0), (5.0, 3.0, 0.5))
"""Frequency in Hz, duration in s, share of the amplitude of each sweep."""
_PART = 0.75
"""Of the contour that a sweep uses."""
_NO_CONTOUR = 0.6
"""Amplitude in rad where no cam says how far its contour goes."""
_WEIGHT = 0.5
"""Torque of the weight, in torques of the spring at the end of the sweep."""
_CURRENT = 0.8
"""Share of the limit of the current that a plan uses."""
_COUNT = 2.0 * math.pi / 8192.0
"""Count of the encoder in rad where none is declared, assumed: 13 bit."""
_FINE = 2e-3
"""Noise of current and cell where none is declared, assumed: share of the largest value."""
_LONGEST = 0.25
"""Longest window in s."""
_FREE_SPEED, _FREE_PERIOD, _FREE_TIME = 25.0, 2.0, 8.0
"""Free run: rad/s, s, s."""


class _Sweep(NamedTuple):
    """A motion over time, and the weight that hangs meanwhile."""

    name: str
    step: float
    motion: Array
    weight: float


def planned_bench(model: FlatModel, kind: CalibrationTest, known: Prior) -> BenchEvidence:
    """Return a bench with the runs that are planned for a kind of calibration."""
    # The readings of efforts.
    efforts = {"N", "N*m"}
    channels = [
        r.signal
        for r in model.readings
        if model.variable(reading_of(model.readings, r.signal).measured).unit in efforts
    ]
    response = bench_response(model, bench_prior(model, known), channels)
    share = 1.0
    while True:
        runs = [_run(model, response, sweep) for sweep in _sweeps(model, kind, response, share)]
        # A drive that saturates by itself has no command for a motion that is too fast for it.
        most = float(np.max([np.max(np.abs(run.course.command)) for _, run in runs]))
        limit = _limit(model)
        if math.isfinite(most) and most <= _CURRENT * limit:
            return bench_evidence(model, kind, channels, runs, known=known)
        share *= 0.8
        if share < 0.05:
            raise InfeasibleError(
                f"{kind.title} of '{model.name}'",
                f"needs more than {_CURRENT:g} of the limit of its drive for any motion worth the name",
                next_step="check the limit of the current in the deck",
            )


def sweep_end(model: FlatModel) -> float:
    """Return how far a calibration turns the drive, in rad of the series spring."""
    if not model.springs:
        return _NO_CONTOUR
    ends = [cam.last_angle for cam in series_spring(model).cams if cam.last_angle]
    return _PART * model.values[ends[0]] if ends else _NO_CONTOUR


def _limit(model: FlatModel) -> float:
    motor = driven_body(model).motor
    return model.values[motor.current_limit] if motor else math.inf


def _sweeps(
    model: FlatModel, kind: CalibrationTest, response: BenchResponse, share: float
) -> Sequence[_Sweep]:
    if isinstance(kind, FreeRunTest):
        step = _step(_LONGEST)
        time = np.arange(0.0, _FREE_TIME, step)
        turn = 2.0 * math.pi / _FREE_PERIOD
        # Speed as a sine whose size changes, so that acceleration and speed are told apart.
        size = share * _FREE_SPEED * (1.0 + 0.5 * np.sin(0.31 * turn * time))
        return [_Sweep("free run", step, np.cumsum(size * _begun(time) * np.sin(turn * time)) * step, 0.0)]
    end = share * sweep_end(model) * drive_ratio(model)
    # Whether the spring resists to both sides.
    still = np.zeros(response.columns)
    forth, back = (abs(float(response.resting(angle, still).value[0, 0])) for angle in (end, -end))
    both = back > 0.1 * forth
    if isinstance(kind, HungWeightTest):
        held = response.resting(end, np.zeros(response.columns))
        torque = _WEIGHT * response.inertia * abs(float(held.value[0, 0])) * abs(drive_ratio(model))
        weights = (0.0, torque, -torque) if both else (0.0, torque, 2.0 * torque)
        return [_sine(f"weight {w:.3g} N·m", end, _SLOW, both)._replace(weight=w) for w in weights]
    return [_sine(f"{sweep[0]:g} Hz", end, sweep, both) for sweep in _QUICK]


def _step(window: float) -> float:
    return max(1, int(window * _SAMPLES) // _PER_WINDOW) / _SAMPLES


def drive_ratio(model: FlatModel) -> float:
    """Return the turns of the driven body for one of the spring."""
    if not model.springs:
        return 1.0
    body, spring = driven_body(model), series_spring(model)
    shown = [
        model.evaluate([a if v.name == body.motion else v.start for v in model.states])[spring.motion]
        for a in (0.0, 1e-3)
    ]
    change = (shown[1] - shown[0]) / 1e-3
    return 1.0 / change if change else 1.0


def _begun(time: Array) -> Array:
    s = np.clip((time - 0.2) / 0.5, 0.0, 1.0)
    result: Array = s * s * (3.0 - 2.0 * s)
    return result


def _sine(name: str, end: float, sweep: tuple[float, float, float], both: bool) -> _Sweep:
    frequency, seconds, part = sweep
    step = _step(min(_LONGEST, 0.2 / frequency))
    time = np.arange(0.0, seconds, step)
    phase = 2.0 * math.pi * frequency * (time - 0.2)
    shape = np.sin(phase) if both else 0.5 - 0.5 * np.cos(phase)
    return _Sweep(name, step, part * end * _begun(time) * shape, 0.0)


def _run(model: FlatModel, response: BenchResponse, sweep: _Sweep) -> tuple[str, RecordedRun]:
    step = sweep.step
    rate = np.gradient(sweep.motion, step)
    still = np.zeros(len(rate))
    course = BenchCourse(step, sweep.motion, rate, still, still + sweep.weight)
    free = response.along(course, np.zeros(response.columns))
    with np.errstate(divide="ignore", invalid="ignore"):
        command = (np.gradient(rate, step) - free.value[0]) / free.value[1]
    course = course._replace(command=command)
    shown = response.along(course, np.zeros(response.columns))
    measured = shown.value[2:]
    count = _declared(model, driven_body(model).motion, "quantum") or _COUNT
    drive = next(iter(driven_body(model).drives), "")
    noises = [
        _declared(model, c, "noise") or _FINE * float(np.max(np.abs(m)))
        for c, m in zip(response.channels, measured, strict=True)
    ]
    most = min(_limit(model), 10.0 * float(np.max(np.abs(command))))
    finer = 1.0 / math.sqrt(max(1.0, step * _SAMPLES))
    noise = SampleNoise(
        count / math.sqrt(12.0) * finer,
        (_declared(model, drive, "noise") or _FINE * most) * finer,
        count,
        tuple(n * finer for n in noises),
        window_length(sweep.motion, step),
    )
    return sweep.name, RecordedRun(course, measured, noise, np.zeros(len(rate), dtype=bool))


def _declared(model: FlatModel, signal: str, which: str) -> float:
    """Return the declared count or noise of what reads a signal; zero where there is none."""
    for reading in model.readings:
        if signal in (reading.measured, reading.signal):
            for law in reading.laws:
                number = law.parameters().get(which)
                if number is not None and number.number > 0.0:
                    return number.number
    return 0.0


ErrorOf = Callable[[Prior], float]
"""Size of an error, in its unit, over what is known of the numbers."""

_ANGLES = 41
_NARROWED = 0.9
"""Share of a spread below which a number is named as better known."""


class BoughtBy(NamedTuple):
    """What one calibration, or several together, would leave."""

    titles: tuple[str, ...]  # what is done
    known: Prior  # of the numbers, afterwards
    torque: Array  # standard deviation of the torque of the resting spring at each angle, N·m
    errors: Mapping[str, float]  # other errors in N·m, by name

    @property
    def title(self) -> str:
        """What is done, in words."""
        return " and ".join(self.titles) if self.titles else "nothing"

    @property
    def torque_rms(self) -> float:
        """Root mean square over the angles of the standard deviation of the torque, N·m; nan without any."""
        return float(np.sqrt(np.mean(self.torque**2))) if len(self.torque) else math.nan

    def narrowed(self, before: Prior) -> dict[str, tuple[float, float]]:
        """Return the spreads before and after of the numbers that become better known, the most so first."""
        earlier, later = before.spreads(), self.known.spreads()
        narrowed = {n: (earlier[n], s) for n, s in later.items() if s < _NARROWED * earlier[n]}
        return dict(sorted(narrowed.items(), key=lambda pair: pair[1][1] / pair[1][0]))


@dataclass(frozen=True, eq=False)
class CalibrationPlan:
    """Calibrations ranked by what they would buy.

    Parameters
    ----------
    now
        Without any.
    ranked
        The best first.
    angles
        Of the torques, in rad of the series spring.
    ranked_by
        Name of the error by which they are ranked; where it is empty the torque of the spring decides, or in
        a machine without one all numbers alike.
    left_out
        Why a kind cannot be done, by its title.
    reach
        Largest motion of the drive that was planned, by title: as far as its current allows.
    """

    now: BoughtBy
    ranked: tuple[BoughtBy, ...]
    angles: Array
    ranked_by: str = ""
    left_out: Mapping[str, str] = field(default_factory=dict)
    reach: Mapping[str, float] = field(default_factory=dict)

    def rows(self) -> list[tuple[str, ...]]:
        """Return a table: calibration, torque of the resting spring and further errors, spreads.

        Errors are in the units of :attr:`heads`.
        """
        rows, names, factor = [], tuple(self.now.errors), self._prefix()[0]
        for each in (self.now, *self.ranked):
            narrowed = list(each.narrowed(self.now.known).items())[:4]
            spreads = ", ".join(f"{n} {_per_cent(a)} → {_per_cent(b)} %" for n, (a, b) in narrowed)
            sizes = (*([each.torque_rms] if len(self.angles) else []), *(each.errors[name] for name in names))
            rows.append((each.title, *(without_power(factor * size) for size in sizes), spreads))
        return rows

    @property
    def heads(self) -> tuple[str, ...]:
        """Heads of :meth:`rows`, with the unit of the errors."""
        unit = self._prefix()[1]
        errors = (*(["spring torque at rest"] if len(self.angles) else []), *self.now.errors)
        return ("calibration", *(f"{name}, {unit}" for name in errors), "spreads, best four")

    def words(self) -> tuple[str, ...]:
        """Return what the table does not say: no spring, no spread, or one that the torque does not feel."""
        if not self.now.known.names:
            return (
                "nothing is to be calibrated: no number of the deck has a spread -> write spread = 0.1 where "
                "a number is known to a tenth",
            )
        if not len(self.angles):
            return (
                "the machine has no spring, so there is no torque of a resting spring to know better; "
                "calibrations are ranked by the spreads of all numbers alike",
            )
        if self.now.torque_rms == 0.0:
            return (
                "the torque of the resting spring is taken as exactly known: none of its numbers has a "
                "spread -> write the spread of its stiffness, or of its rubber and cam",
            )
        return ()

    def _prefix(self) -> tuple[float, str]:
        return shared_prefix([self.now.torque_rms, *self.now.errors.values()], "N*m")

    def __str__(self) -> str:
        return "\n".join(["  ".join(row) for row in (self.heads, *self.rows())] + list(self.words()))

    def to_dict(self) -> dict[str, Any]:
        """Return the table for ``plan.json``: errors before and after, and spreads by number."""
        return {
            "ranked_by": self.ranked_by
            or ("torque of the resting spring" if len(self.angles) else "spreads of all numbers"),
            "words": list(self.words()),
            "now": {"torque_rms_Nm": _plain(self.now.torque_rms), "errors": dict(self.now.errors)},
            "ranked": [
                {
                    "calibration": each.title,
                    "torque_rms_Nm": _plain(each.torque_rms),
                    "errors": dict(each.errors),
                    "spreads": {
                        name: {"before": a, "after": b}
                        for name, (a, b) in each.narrowed(self.now.known).items()
                    },
                }
                for each in self.ranked
            ],
            "left_out": dict(self.left_out),
            "reach": dict(self.reach),
        }


def _per_cent(spread: float) -> str:
    return without_power(100.0 * spread, 2)


def _plain(size: float) -> float | None:
    """Return a number as JSON can hold it."""
    return size if math.isfinite(size) else None


def what_calibration_buys(
    actuator: Assembly,
    kinds: Sequence[CalibrationTest] = (HungWeightTest(), LoadCellTest(), FreeRunTest()),
    *,
    prior: Prior | None = None,
    errors: Mapping[str, ErrorOf] | None = None,
    rank_by: str = "",
) -> CalibrationPlan:
    """Rank calibrations by what they would buy.

    Each is planned as a motion of the machine with its declared numbers, counts and noises; where the deck
    declares no noise, one is assumed. The Fisher information of all its samples is added to what is known,
    the errors of the instruments are unknowns of their own, so the result is the least covariance that such a
    record can leave to first order, the Bayesian Cramér–Rao bound. Each kind alone, and all together.

    Parameters
    ----------
    actuator
        As declared.
    kinds
        What could be done.
    prior
        What is known now; the declared spreads where it is left out.
    errors
        Further errors by name, each a function of what is known of the numbers, for instance the bound of an
        observer.
    rank_by
        Name of one of them; the torque of the resting spring where it is left out.

    Raises
    ------
    UnknownNameError
        If there is no error of that name.
    """
    known = prior_of(actuator, prior)
    wanted = dict(errors or {})
    if rank_by and rank_by not in wanted:
        raise unknown_name("error", rank_by, wanted)
    angles, slopes = _torque_slopes(actuator, known)

    def bought(titles: Sequence[str], learned: Prior) -> BoughtBy:
        sizes = {name: float(error(learned)) for name, error in wanted.items()}
        return BoughtBy(tuple(titles), learned, learned.deviation_of(slopes), sizes)

    benches, left_out = [], {}
    for kind in kinds:
        try:
            benches.append(planned_bench(flatten(kind.on_bench(actuator)), kind, known))
        except (ArrangementError, InfeasibleError) as error:
            left_out[kind.title] = str(error)  # another kind may still be possible
    purchases = [bought([b.title], _learned(Unknowns(known, [b]))) for b in benches]
    if len(benches) > 1:
        purchases.append(bought([b.title for b in benches], _learned(Unknowns(known, benches))))

    def place(each: BoughtBy) -> float:
        if rank_by:
            return each.errors[rank_by]
        # Without a spring all numbers count alike.
        return each.torque_rms if len(angles) else float(np.sum(np.log(each.known.deviations)))

    ranked = sorted(purchases, key=place)
    reach = {b.title: max(float(np.max(np.abs(r.course.motion))) for _, r in b.runs) for b in benches}
    return CalibrationPlan(bought((), known), tuple(ranked), angles, rank_by, left_out, reach)


def write_plan(plan: CalibrationPlan, folder: Path) -> Path:
    """Write the plan as ``plan.json``.

    Parameters
    ----------
    plan
        From :func:`~nlsdesign.bench.calibration.what_calibration_buys`.
    folder
        Is made where it does not exist.
    """
    file = folder / "plan.json"
    write_text(file, json.dumps(plan.to_dict(), indent=2, ensure_ascii=False) + "\n")
    return file


def _learned(unknowns: Unknowns) -> Prior:
    still = np.zeros(unknowns.count)
    slopes = np.vstack([piece.slope for _, piece, _ in unknowns.pieces(still)])
    covariance = np.asarray(np.linalg.inv(np.eye(unknowns.count) + slopes.T @ slopes), dtype=np.float64)
    return unknowns.learned(still, covariance)


def _torque_slopes(actuator: Assembly, known: Prior) -> tuple[Array, Array]:
    """Return angles, and derivatives of the relaxed torque with respect to the logarithms of the numbers."""
    if not flatten(actuator).springs:
        return np.zeros(0), np.zeros((0, len(known.names)))
    model = flatten(LoadCellTest().on_bench(actuator))
    spring = series_spring(model)
    response = bench_response(model, known, [spring.effort], balanced=False)
    end = sweep_end(model)
    angles, ratio = np.linspace(-end, end, _ANGLES), drive_ratio(model)
    slopes = np.zeros((_ANGLES, len(known.names)))
    for k, angle in enumerate(angles):
        at_rest = response.resting(ratio * float(angle), np.zeros(response.columns))
        for j, name in enumerate(response.factors):
            slopes[k, known.place(name)] = at_rest.slope[2, 0, j]
    return angles, slopes
