"""Poles of the published observer, fitted to the torque that records show, as its authors did.

The gain is a polynomial of the poles, so the slopes of the estimate by them are exact: CasADi differentiates
the step of the observer along the whole record; the derivative of the gain is written out.

Poles that were fitted to records: the torque errors with them, and what makes these mean little.
"""

from __future__ import annotations

import cmath
import math
from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from typing import Any, NamedTuple

import casadi as ca
import numpy as np
from scipy.optimize import least_squares

from ..bench.identification import RecordSet, agreement, rmse
from ..bench.identification.multiple_shooting import least_by_cma
from ..feedback.observer import (
    DesignedObserver,
    FixedGrid,
    ObserverDesign,
    PaperForm,
    PolePlacement,
    design_observer_with_details,
)
from ..feedback.observer.scheduling.angle_form import AngleScheduledPlant
from ..feedback.observer.scheduling.scheduled import check_stability, whole_contour
from ..feedback.observer.scheduling.table import ColumnPlace, Compact, Draft, Entries, linearly
from ..foundation.arrays import Array
from ..foundation.errors import ConvergenceError, MeasurementError, unknown_name
from ..foundation.quantity import three_digits, typeset_unit
from ..foundation.written_numbers import shared_prefix
from ..model import FlatModel
from ..model.roles import measured_motion, passed_ends, series_spring
from .watched_records import ObserverChoice, WatchedRecord

FOREIGN = 50.0
"""Average relative error after the fit in per cent beyond which a record shows another torque than the
deck's. Records of the declared actuator stay below 20, those with a wrong sign or unit are beyond 95."""


class PoleError(NamedTuple):
    """Error of the estimated torque on one record: rms in its unit, and average percent relative error."""

    record: str
    role: str
    # before, after: with the gain of the cascade, and with the fitted poles
    before: float
    after: float
    # percent_before, percent_after: not a number where the record shows no torque
    percent_before: float
    percent_after: float
    ratio: float  # by which the estimate with the gain of the cascade exceeds what is shown, in least squares

    @classmethod
    def of(cls, run: WatchedRecord, published: ObserverDesign, fitted: ObserverDesign) -> PoleError:
        """Return the errors over the samples that count."""
        torque = run.torque[run.skipped :]
        both = [run.estimate(design)[run.skipped :] for design in (published, fitted)]
        before, after = (agreement(torque, estimate) for estimate in both)
        power = float(torque @ torque)
        ratio = float(both[0] @ torque) / power if power > 0.0 else math.nan
        sizes = (before.rmse, after.rmse, before.relative, after.relative)
        return cls(run.record.name, run.record.role, *sizes, ratio)

    def remarks(self, model: FlatModel, run: WatchedRecord) -> Iterator[str]:
        """Yield what makes the error mean little, each with the next step."""
        name = f"record '{self.record}'"
        angles = run.trace[run.readings.get(run.motion, run.motion)]
        furthest = float(np.max(np.abs(angles)))
        for cam, end in passed_ends(model, float(np.min(angles)), float(np.max(angles))).items():
            yield (
                f"{name}: {run.motion} goes to {math.degrees(furthest):.4g}°, the contour of {cam} ends at "
                f"{math.degrees(end):.4g}° -> check unit and mapping of the angle, or declare a longer one"
            )
        if math.isnan(self.percent_after):
            yield f"{name}: no torque in it -> leave it out, or map the column of torque or force"
        elif self.percent_after > FOREIGN:
            yield (
                f"{name}: with fitted poles the torque is still {three_digits(self.percent_after)} % off, "
                f"with the gain of the cascade {self.ratio:.3g} times what is shown: this is not the torque "
                "of the deck -> check sign, unit and mapping of torque or force, and of the angle"
            )
        if self.after > self.before:
            yield (
                f"{name}, {self.role.replace('_', ' ')}: the fit makes it worse, to "
                f"{self.after / self.before:.3g} times the error with the gain of the cascade -> keep that "
                "gain (leave --fit-poles out), or fit to records of more motions"
            )


@dataclass(frozen=True, eq=False, repr=False)
class FittedPoles:
    """The published observer with poles that were fitted to records."""

    design: ObserverDesign
    # poles: in 1/s, of what is seen through the angle; the last is that of the extension
    poles: tuple[complex, ...]
    # worst: angle in rad, at or between points of the table, where the error decays most slowly, and the
    # spectral radius there
    worst: tuple[float, float]
    errors: tuple[PoleError, ...]  # by record; those that were held out decided nothing
    settling: float  # time in s from the begin of each record that no error counts, a quarter of it at most
    deciding: str  # role of the records by which one of several fits was taken
    evaluations: int  # how often records were simulated by the search
    by: str  # how the poles were sought; one of SEARCHES
    at_end: tuple[str, ...]  # states whose pole ended at an end of the range of the search
    remarks: tuple[str, ...]  # on the records, and what makes their errors mean little

    @property
    def margin(self) -> float:
        """Least decay of the error at a standing angle, in 1/s."""
        return slowest_decay(self.worst, self.design)

    @property
    def reason(self) -> str:
        """The poles and their margin in a sentence."""
        plant = self.design.step.plant
        placed = ", ".join(f"{p:.4g}" for p in self.poles)
        ended = f", at the end of its range for {' and '.join(self.at_end)}" if self.at_end else ""
        return (
            f"poles at {placed} 1/s for {', '.join(plant.pole_order)}, fitted by {self.by}{ended}, "
            f"not fitted for {', '.join(plant.measured)}; at a standing angle the error decays with at least "
            f"{self.margin:.3g} 1/s (spectral radius {self.worst[1]:.5f} at {self.worst[0]:.3g} rad), of a "
            "moving one nothing is proved"
        )

    def __repr__(self) -> str:
        return f"FittedPoles: {self.reason}"

    @property
    def observer(self) -> DesignedObserver:
        """The observer as commands write it."""
        return DesignedObserver("published", self.design, self.reason)

    def shown(self) -> tuple[str, tuple[str, ...], list[tuple[str, ...]]]:
        """Return title, heads and rows of the table of errors."""
        unit = typeset_unit(self.design.step.plant.estimate.unit)
        factor, prefixed = shared_prefix([e.after for e in self.errors], unit)
        heads = ("record", "role", f"{prefixed} rms", "fitted", "average relative error, %", "fitted")
        rows: list[tuple[str, ...]] = [
            (e.record, e.role.replace("_", " "), *(three_digits(factor * v) for v in e[2:4]),
             *(three_digits(v) for v in e[4:6]))
            for e in self.errors
        ]  # fmt: skip
        title = (
            f"Torque error from {1e3 * self.settling:.3g} ms on, after the observers have settled (a quarter "
            "of a record at most), with the gain of the cascade and with fitted poles"
        )
        return title, heads, rows

    def content(self) -> dict[str, Any]:
        """Return everything as JSON has it."""
        return {
            "poles": [[complex(p).real, complex(p).imag] for p in self.poles],
            "states": self.design.step.plant.pole_order, "at_end": self.at_end,
            "by": self.by, "decided_by": self.deciding,
            "least_decay": self.margin, "spectral_radius": self.worst[1], "at_angle": self.worst[0],
            "simulations": self.evaluations, "settling_time": self.settling,
            "errors": [error._asdict() for error in self.errors],
        }  # fmt: skip


def slowest_decay(worst: tuple[float, float], design: ObserverDesign) -> float:
    """Return the decay in 1/s of the error at the angle where it is slowest."""
    return -math.log(worst[1]) / design.step.sample_time


SEARCHES = ("gradient", "cma")
"""Ways to the best poles by name: exact slopes, or the evolution strategy of the authors."""
GRID_POINTS = 161
"""Of the table, zero angle among them, where the observer is decomposed."""
SLOWEST = 0.1
"""Least size of a pole in 1/s: an error that is gone in half a minute."""
DAMPING = (0.1, 10.0)
"""Damping of the pair of poles: two real poles apart by 400, or a pair that swings for some periods."""
_SHARES, _NEARLY = ((0.01, 0.012, 0.3, 0.06), (0.1, 0.15, 0.2, 0.06)), 0.999
"""First poles as shares of the fastest that the sample rate carries: slow but for one, and fast; the last
is that of the extension. And the share up to which a search may go."""
SETTLED = 10.0
"""Slowest time constants of the gain of the cascade after which errors count: less than a hundredth is left
of a start, also with poles half as fast."""
_FREE = 3
"""Poles of force, angle and speed."""
_STEPS, _ENOUGH, _SIMULATIONS, _SEED = 40, 1e-5, 400, 1
_AT_END = 1e-2
"""Distance to the end of its range, as a share, within which a pole is at it."""
_AT_ONCE = 500
"""Samples in one call; a function for a whole record takes longer to make than to run."""


def fit_poles(
    model: FlatModel,
    records: RecordSet,
    *,
    choice: ObserverChoice | None = None,
    first: Sequence[complex] | None = None,
    by: str = "gradient",
) -> FittedPoles:
    """Fit the poles of the published observer to the torque that records show.

    Least squares of the torque error over the records of the role ``fit``. Searches from several first poles
    end at several fits; the one that errs least on the records of the role ``selection`` is taken, or on
    those of the fit where there are none. The pole of the extension moves no torque and stays. The first two
    poles may become a complex pair; the third is real.

    Every run begins at rest at its first angle, and a record may begin in motion. So no error counts, in the
    fit or anywhere, before ten slowest time constants of the gain of the cascade, or before a quarter of the
    record if that is sooner: the same samples for all poles.

    Parameters
    ----------
    model
        Continuous; its spring has a cam.
    records
        With the measured angle, the inputs of the model, and the torque or a force behind the cam.
    choice
        What is estimated; by default the torque of the series spring, every millisecond.
    first
        Poles at which the search begins, in 1/s, in the order of the result: of force, angle, speed and
        extension. Each has a negative real part; only the first two may be a complex pair. By default two
        sets.
    by
        ``"gradient"`` for Gauss–Newton steps with exact slopes, or ``"cma"`` for CMA-ES.

    Returns
    -------
    FittedPoles
        The observer, how far its error is from unstable, its errors before and after by record, and remarks.

    Raises
    ------
    UnknownNameError
        If there is no such search.
    MeasurementError
        If no record may be fitted, those of the fit show no torque, or a record lacks a signal; it is named.
    ValueRangeError
        If the first poles are not one per state, not stable, or faster than the sample rate carries.
    ArrangementError
        If the spring has no cam, or there is no observer over one angle.
    ConvergenceError
        If no simulation is finite, or every fit is unstable between two points of the table.
    MissingLibraryError
        If CMA-ES is not installed.
    """
    if by not in SEARCHES:
        raise unknown_name("search", by, SEARCHES)
    choice = choice or ObserverChoice()
    spring = series_spring(model, choice.spring)
    names = _Question(model, spring.effort, measured_motion(model, choice.measured), choice.sample_time)
    published = names.designed(None)
    settling = SETTLED / slowest_decay(check_stability(published.model).worst, published)
    runs = [WatchedRecord.of(model, spring, r, choice).settled(settling) for r in records.records]
    for run in runs:
        if lacking := run.lacks(published):
            raise MeasurementError(
                f"record '{run.record.name}'", f"does not measure {', '.join(lacking)}",
                next_step="map these columns, or leave the record out: the published observer reads them",
            )  # fmt: skip
    of = {role: [run for run in runs if run.record.role == role] for role in ("fit", "selection")}
    if not of["fit"]:
        raise MeasurementError(
            "records", "none has the role 'fit'", next_step="hold out fewer of them, so that one is fitted"
        )
    if not any(np.any(run.torque) for run in of["fit"]):
        raise MeasurementError(
            f"records {', '.join(run.record.name for run in of['fit'])}",
            "no torque in the records: it is zero everywhere",
            next_step="map the column of torque or force, and look whether its sensor was on",
        )
    search = _Search(names, published.step.plant, of["fit"], first)
    logs = search.by_cma() if by == "cma" else search.by_gradient()
    deciding = "selection" if of["selection"] else "fit"
    ranked = sorted(logs, key=lambda x: search.error(x, of[deciding]))
    poles, design, worst = names.stable([search.poles(x)[0] for x in ranked])
    errors = tuple(PoleError.of(run, published, design) for run in runs)
    about = [*map(str, (*records.findings, *records.remarks))]
    about += [text for run, error in zip(runs, errors, strict=True) for text in error.remarks(model, run)]
    how = (deciding, search.evaluations, by, search.at_end(poles))
    return FittedPoles(design, poles, worst, errors, settling, *how, tuple(about))


class _Question(NamedTuple):
    """What is observed."""

    model: FlatModel
    estimate: str
    measured: str
    sample_time: float

    def designed(self, poles: Sequence[complex] | None, *, every_entry: bool = False) -> ObserverDesign:
        """Return the published observer with poles, or with the gain of the cascade where there are none."""
        over = whole_contour(self.model)
        grid = _EveryEntry if every_entry else FixedGrid
        return design_observer_with_details(
            self.model, estimate=self.estimate, measured=self.measured, sample_time=self.sample_time,
            form=PaperForm(), gain=None if poles is None else PolePlacement(tuple(poles)),
            grid=grid(over.lower, over.upper, GRID_POINTS),
        )  # fmt: skip

    def stable(
        self, ranked: Sequence[tuple[complex, ...]]
    ) -> tuple[tuple[complex, ...], ObserverDesign, tuple[float, float]]:
        """Return the first poles whose error decays at every angle, also between points of the table."""
        for poles in ranked:
            design = self.designed(poles)
            worst = check_stability(design.model).worst
            if worst[1] < 1.0:
                return poles, design, worst
        raise ConvergenceError(
            "fitted poles", f"leave an error that grows at {worst[0]:.4g} rad, by {worst[1]:.4g} a sample",
            next_step="take the gain of the cascade: leave --fit-poles out",
        )  # fmt: skip


@dataclass(frozen=True)
class _EveryEntry(FixedGrid):
    """A table with a column for every entry of the step, also where two are alike at some poles."""

    def compact(self, entries: Entries, draft: Draft | None = None) -> Compact:
        """Return the table; see :class:`Grid`."""
        angles = np.linspace(self.lower, self.upper, self.points)
        columns = tuple(entries(angles))
        places = {entry.key: ColumnPlace(1.0, i) for i, entry in enumerate(columns)}
        values = np.ascontiguousarray(np.array([entry.values for entry in columns]).T)
        return Compact(angles, columns, values, places, {}, 0.0)


class _Search:
    """Torque errors over records as a function of three numbers that give the poles, with exact slopes.

    These are the logarithms of frequency and damping of a pair, real or complex, and of the size of a real
    pole. What the pair does to the gain is smooth where two real poles become complex.
    """

    def __init__(
        self,
        question: _Question,
        plant: AngleScheduledPlant,
        runs: Sequence[WatchedRecord],
        first: Sequence[complex] | None,
    ) -> None:
        self.runs, self.evaluations = runs, 0
        self.fastest = math.pi / question.sample_time
        ladder = [-self.fastest * np.array(shares) for shares in _SHARES]
        self.starts = [tuple(rates.tolist()) for rates in ladder] if first is None else [tuple(first)]
        self.design = question.designed(self.starts[0], every_entry=True)
        self.grid = self.design.compact.angles
        self.plants = self.design.step.sampled(self.grid)
        outputs = range(len(plant.output_matrix))
        keys = [f"correction[{i}][{j}]" for i in range(len(plant.states)) for j in outputs]
        columns = [column.key for column in self.design.compact.columns]
        self.rows = [columns.index(key) for key in keys]
        self.steps = {False: self._step(0), True: self._step(_FREE)}
        rates = np.log([SLOWEST, _NEARLY * self.fastest])
        self.ends = np.array([rates, np.log(DAMPING), rates]).T

    def begin(self, poles: Sequence[complex]) -> Array:
        """Return the three numbers of some poles."""
        one, other, alone = (-complex(pole) for pole in poles[:_FREE])
        size = math.sqrt((one * other).real)
        numbers = np.log([size, (one + other).real / (2.0 * size), alone.real])
        inside: Array = np.clip(numbers, *self.ends)
        return inside

    def at_end(self, poles: Sequence[complex]) -> tuple[str, ...]:
        """Return the states whose poles lie at an end of the range of the search."""
        ended = np.min(np.abs(self.ends - self.begin(poles)), axis=0) < _AT_END
        both = ended[0] or ended[1]
        states = self.design.step.plant.pole_order[:_FREE]
        return tuple(n for n, at in zip(states, (both, both, ended[2]), strict=True) if at)

    def poles(self, numbers: Array) -> tuple[tuple[complex, ...], Array]:
        """Return the poles, of which that of the extension stays, and the slopes of the others."""
        size, damping, alone = np.exp(numbers).tolist()
        root = cmath.sqrt(damping**2 - 1.0) or 1e-9
        pair = [-size * (damping + sign * root) for sign in (1.0, -1.0)]
        bends = [-size * damping * (1.0 + sign * damping / root) for sign in (1.0, -1.0)]
        slopes = [[pole, bend, 0.0] for pole, bend in zip(pair, bends, strict=True)]
        real = [pole.real for pole in pair] if damping >= 1.0 else pair
        return (*real, -alone, *self.starts[0][_FREE:]), np.array([*slopes, [0.0, 0.0, -alone]])

    def by_gradient(self) -> list[Array]:
        """Return where Gauss-Newton steps end, from each start."""
        ends = []
        for start in self.starts:
            reached = least_squares(
                lambda x: self.errors(x, self.runs)[0],
                self.begin(start),
                jac=lambda x: self.errors(x, self.runs)[1],
                bounds=self.ends,
                max_nfev=_STEPS,
                ftol=_ENOUGH,
                xtol=_ENOUGH,
            )
            ends.append(reached.x)
        return ends

    def by_cma(self) -> list[Array]:
        """Return where CMA-ES ends, from the first start."""
        within = (*self.ends, self.begin(self.starts[0]))
        best, _, _ = least_by_cma(
            lambda x: self.error(x, self.runs), within, seed=_SEED, simulations=_SIMULATIONS
        )
        return [best]

    def error(self, numbers: Array, runs: Sequence[WatchedRecord]) -> float:
        """Return the root mean square error over records."""
        return rmse(self.errors(numbers, runs, slopes=False)[0])

    def errors(
        self, numbers: Array, runs: Sequence[WatchedRecord], *, slopes: bool = True
    ) -> tuple[Array, Array]:
        """Return estimate minus torque over the samples that count, and its slopes, shape (n, 3)."""
        self.evaluations += 1
        poles, paces = self.poles(numbers)
        if max(map(abs, poles)) > self.fastest:
            return np.full(sum(len(run.torque) - run.skipped for run in runs), np.inf), np.zeros(0)
        placed = [PolePlacement(poles).with_slopes(plant) for plant in self.plants]
        gain = np.array([m.ravel() for m, _ in placed])
        by_pole = np.array([s.reshape(len(s), -1) for _, s in placed])
        by_number = np.real(np.einsum("kj,akc->jac", paces, by_pole))
        parts = []
        for run in runs:
            inputs = run.inputs(self.design)
            table = linearly(self.grid, self.design.compact.values, inputs[0])
            table[self.rows] = linearly(self.grid, gain, inputs[0])
            moved = [linearly(self.grid, values, inputs[0]) for values in by_number[: _FREE * slopes]]
            begun = self.design.start(float(inputs[0, 0]))
            memory = np.zeros(self.steps[slopes].size1_in(0))
            memory[: len(self.design.model.states)] = [
                begun.get(v.name, 0.0) for v in self.design.model.states
            ]
            shown = _along(self.steps[slopes], memory, np.vstack([inputs, table, *moved]))
            parts.append(np.vstack([shown[0] - run.torque, shown[1:]])[:, run.skipped :])
        both = np.hstack(parts)
        return both[0], both[1:].T

    def _step(self, count: int) -> ca.Function:
        """Return many samples of the observer with the slopes of its memory by some poles."""
        model = self.design.model
        s, size = model.symbols(), len(model.states)
        (wanted,) = (i for i, v in enumerate(model.outputs) if v.name == self.design.step.plant.estimate.name)
        after = ca.vertcat(s.derivative, s.output[wanted])
        gain = ca.vertcat(*[s.table[row] for row in self.rows])
        memory, moved = ca.SX.sym("memory", size, count), ca.SX.sym("moved", len(self.rows), count)
        slopes = ca.jacobian(after, s.state) @ memory + ca.jacobian(after, gain) @ moved
        step = ca.Function(
            "step",
            [ca.vertcat(s.state, ca.vec(memory)), ca.vertcat(s.input, s.table, ca.vec(moved))],
            [ca.vertcat(after[:size], ca.vec(slopes[:size, :])), ca.vertcat(after[size], slopes[size, :].T)],
            {"cse": True},
        )
        return step.mapaccum(_AT_ONCE)


def _along(samples: ca.Function, memory: Array, known: Array) -> Array:
    """Return what a step gives along a record of any length, shape (results, n); ``known``: (m, n)."""
    whole = np.pad(known, ((0, 0), (0, -known.shape[1] % _AT_ONCE)), mode="edge")
    results = []
    for part in np.split(whole, whole.shape[1] // _AT_ONCE, axis=1):
        states, result = (np.array(of) for of in samples(memory, part))
        memory = states[:, -1]
        results.append(result)
    together: Array = np.hstack(results)[:, : known.shape[1]]
    return together
