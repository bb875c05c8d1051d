"""Numbers of a machine estimated from records of calibrations, with the declared spreads as prior."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass, replace
from pathlib import Path
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from ..components.assembly.named_parts import Assembly
from ..discrepancy.blocks.shown_values import shown_values
from ..errors import ConvergenceError, MeasurementError
from ..identification import Record, RecordSet, load_record
from ..identification.estimation.covariance import Piece, robust_covariance
from ..identification.estimation.levenberg_marquardt import minimise
from ..identification.records.table_files import table_files
from ..identification.statistics.losses import huber_rows
from ..model import FlatModel, flatten
from ..model.readings import reading_of
from ..model.roles import driven_body
from ..quantity import three_digits, with_unit
from ..simulation import Prior, declared_prior
from .bench_response import BALANCE, BenchResponse, Course, bench_response, shared_factors
from .bench_rows import RecordedRun, Row, SampleNoise, rate_of, rows_of, window_length
from .bench_test import WEIGHT, CalibrationTest, HungWeightTest

Array = NDArray[np.float64]

_HUBER = 3.0
"""Standard deviations beyond which a row counts as Huber says."""
_EVALUATIONS = 60
_REACH = 12.0
"""Standard deviations of the prior that a number may move."""
_LEAST_ROWS = 8
_PER_WINDOW = 24
"""Samples of a window that are enough."""
_FITS = 1.5
"""Misfit in units of the noise up to which a record fits: the noise of a sample is itself an estimate."""
_FOREIGN = 0.1
"""Share of what is measured that a model may miss; beyond it the record is of another machine or unit."""
_SUSPECT = 3.0
"""Standard deviations of the prior beyond which a number is suspect."""


@dataclass(frozen=True, eq=False)
class CalibrationRecords:
    """Records of one kind of calibration.

    Parameters
    ----------
    kind
        How the machine stood on the bench.
    records
        Each begins at rest, with the rubber relaxed.
    source
        File or folder, for the deck.
    """

    kind: CalibrationTest
    records: RecordSet
    source: str = ""


class Misfit(NamedTuple):
    """How well one channel of one record fits.

    Parameters
    ----------
    record, channel, unit
        Which.
    residual, noise
        Root mean square of what the model leaves over, and what noise alone would.
    rows
        How many windows of the record counted.
    """

    record: str
    channel: str
    unit: str
    residual: float
    noise: float
    rows: int

    @property
    def ratio(self) -> float:
        """Residual in units of the noise."""
        return self.residual / self.noise


@dataclass(frozen=True, eq=False)
class Estimate:
    """Numbers after a calibration.

    Parameters
    ----------
    before, after
        What was known, and is; the values of ``after`` are the estimates.
    strain
        How far each number has moved, in standard deviations of the prior, by name.
    misfits
        Of each channel and record.
    files
        Where the records came from.
    """

    before: Prior
    after: Prior
    strain: dict[str, float]
    misfits: tuple[Misfit, ...]
    files: tuple[str, ...]

    @property
    def suspects(self) -> tuple[str, ...]:
        """Numbers that moved further than three standard deviations of their prior."""
        return tuple(name for name, z in self.strain.items() if abs(z) > _SUSPECT)

    @property
    def inflated(self) -> float:
        """Factor by which standard deviations were widened, as the model does not fit within the noise."""
        return max([1.0, *(m.ratio / _FITS for m in self.misfits)])


def load_calibration(
    actuator: Assembly, kind: CalibrationTest, folder: Path, *, mapping: Path | None = None
) -> CalibrationRecords:
    """Read the records of a calibration; none is held out.

    Parameters
    ----------
    actuator
        As declared, without the bench.
    kind
        What was done.
    folder, mapping
        As for :func:`~nlsdesign.identification.load_records`.

    Raises
    ------
    MeasurementError
        If a file cannot be used, or does not hold what this kind needs.
    """
    model = flatten(kind.on_bench(actuator))
    # File by file: none is held out or cut, for each must begin at rest.
    sets = [load_record(file, model, mapping=mapping) for file in table_files(Path(folder))]
    for one in sets[1:]:
        if set(one.signals) != set(sets[0].signals):
            raise MeasurementError(
                f"record '{one.records[0].name}'",
                f"measures {', '.join(one.signals)}, the others {', '.join(sets[0].signals)}",
                next_step="put records of another kind into a folder of their own",
            )
    records = RecordSet(
        tuple(record for one in sets for record in one.records),
        sets[0].columns,
        tuple(finding for one in sets for finding in one.findings),
        tuple(remark for one in sets for remark in one.remarks),
    )
    return CalibrationRecords(kind, records, str(folder))


def estimate(
    actuator: Assembly, tests: Sequence[CalibrationRecords], *, prior: Prior | None = None
) -> Estimate:
    """Estimate the numbers of a machine that are declared with a spread.

    Each record is simulated along its measured motion; measured efforts and the balance of the drive are
    compared, windows of the record are rows. Outliers count as Huber says (Huber 1964). The covariance is
    that of what the residuals scatter (Liang and Zeger 1986), widened where the model does not fit within
    the noise.

    Parameters
    ----------
    actuator
        As declared.
    tests
        One or more kinds of calibration.
    prior
        What is known before; the declared spreads where it is left out.

    Raises
    ------
    MeasurementError
        If a record does not fit the machine, so that no number of it can be trusted.
    ConvergenceError
        If the estimation does not end.
    """
    known = prior or declared_prior(flatten(actuator))
    problem = _Problem(known, [_Bench.of(actuator, test, known) for test in tests])
    start = np.zeros(problem.count)
    reach = np.full(problem.count, _REACH)
    ended = minimise(problem.rows, start, (-reach, reach), evaluations=_EVALUATIONS)
    if not ended.converged:
        raise ConvergenceError(
            "calibration", "did not converge", next_step="check the units and the set-up of the records"
        )
    return problem.estimate(ended.x)


@dataclass(frozen=True, eq=False)
class _Bench:
    """A machine on the bench, its records, and what its instruments add to the unknowns."""

    test: CalibrationRecords
    response: BenchResponse
    own: Prior
    runs: tuple[tuple[Record, RecordedRun], ...]
    units: dict[str, str]
    deviations: Array

    @classmethod
    def of(cls, actuator: Assembly, test: CalibrationRecords, known: Prior) -> _Bench:
        """Return what a test shows."""
        model = flatten(test.kind.on_bench(actuator))
        body = driven_body(model)
        shows = {s: reading_of(model.readings, s).measured for s in test.records.signals}
        motion = next((s for s, of in shows.items() if of == body.motion), None)
        if motion is None:
            raise MeasurementError(test.source or "records", f"do not hold the motion '{body.motion}'",
                                   next_step="log the encoder of the drive")  # fmt: skip
        drive = next((s for s, of in shows.items() if of in body.drives or of in body.commands), None)
        weight = next((s for s, of in shows.items() if of == f"{WEIGHT}.torque"), None)
        if isinstance(test.kind, HungWeightTest) and weight is None:
            raise MeasurementError(test.source or "records", f"do not hold the torque of the weight, '{WEIGHT}.torque'",
                                   next_step="add a column with mass times gravity times lever, in N·m")  # fmt: skip
        channels = [s for s in shows if s not in (motion, drive, weight)]
        if drive is None and not channels:
            raise MeasurementError(test.source or "records", "hold neither the command of the drive nor an effort",
                                   next_step=f"log '{body.drives[0] if body.drives else 'the current'}'")  # fmt: skip
        own = _with_known(declared_prior(model), known)
        response = bench_response(model, own, channels, balanced=drive is not None)
        runs = tuple((r, _run(model, r, (motion, drive, weight), channels)) for r in test.records.records)
        units = {BALANCE: body.domain.effort_unit, **{c: model.variable(c).unit for c in channels}}
        instruments = test.kind.instruments
        largest = max(float(np.max(np.abs(run.course.command))) for _, run in runs)
        deviations = [instruments.zero_angle, instruments.offset * largest, instruments.weight]
        for k in range(len(channels)):
            size = max(float(np.max(np.abs(run.measured[k]))) for _, run in runs)
            deviations.append(instruments.offset * size)
        return cls(test, response, own, runs, units, np.array(deviations))

    def rows(self, x: Array) -> list[tuple[Record, list[Row]]]:
        """Return rows of all records; slopes over factors, instruments, and offsets of the channels."""
        own, offsets = x[: self.response.columns], x[self.response.columns :]
        result = []
        for record, run in self.runs:
            wide, k = [], 0
            for row in rows_of(self.response, run, own):
                more = np.zeros((len(row.residual), len(offsets)))
                residual = row.residual
                if row.channel != BALANCE:
                    more[:, k] = -1.0
                    residual = residual - offsets[k]
                    k += 1
                wide.append(row._replace(residual=residual, slope=np.hstack([row.slope, more])))
            result.append((record, wide))
        return result


def _with_known(own: Prior, known: Prior) -> Prior:
    """Return the prior of a bench whose numbers share factors as what is known before says."""
    covariance = own.covariance.copy()
    shared = [(i, known.place(n)) for i, n in enumerate(own.names) if n in known.names]
    here, there = ([pair[k] for pair in shared] for k in (0, 1))
    covariance[np.ix_(here, here)] = known.covariance[np.ix_(there, there)]
    values = own.values.copy()
    values[here] = known.values[there]
    return replace(own, values=values, covariance=covariance)


def _run(
    model: FlatModel, record: Record, signals: tuple[str, str | None, str | None], channels: Sequence[str]
) -> RecordedRun:
    motion, drive, weight = signals
    still = np.zeros(len(record.trace))
    angle = shown_values(model, record, motion)
    command = still if drive is None else shown_values(model, record, drive)
    hung = still if weight is None else record.trace[weight]
    length = window_length(angle, record.step)
    rate = rate_of(angle, record.step, 0.5 * length)[0]
    # A window needs no more than some dozen samples: each stands for the mean of several.
    several = max(1, int(length / record.step) // _PER_WINDOW)
    course = Course(
        record.step * several, *(_means(np.asarray(v), several) for v in (angle, rate, command, hung))
    )
    measured = np.array([_means(record.trace[c], several) for c in channels])
    finer = 1.0 / math.sqrt(several)
    noise = SampleNoise(
        _deviation(record, motion) * finer,
        0.0 if drive is None else _deviation(record, drive) * finer,
        record.resolution_of(motion).quantum,
        tuple(_deviation(record, c) * finer for c in channels),
        length,
    )
    masked = _means(record.masked_in(record.trace.signals).astype(float), several) > 0.0
    return RecordedRun(course, measured.reshape(len(channels), len(masked)), noise, masked)


def _means(values: Array, several: int) -> Array:
    """Return the means of every so many samples; what is left over at the end is left out."""
    whole = len(values) // several * several
    result: Array = values[:whole].reshape(-1, several).mean(axis=1)
    return result


def _deviation(record: Record, signal: str) -> float:
    seen = record.resolution_of(signal)
    return max(seen.noise, seen.quantum / math.sqrt(12.0))


class _Problem:
    """All tests over unknowns that are independent unit normals before anything is measured."""

    def __init__(self, known: Prior, benches: Sequence[_Bench]) -> None:
        self.known, self.benches = known, benches
        self.shapes = list(shared_factors(known))
        self.shared = known.only(self.shapes)
        self.root = self.shared.root
        self._maps = []
        place = len(self.shapes)
        for bench in benches:
            # Each factor of the bench is one of the machine, or belongs to the bench alone.
            size = bench.response.columns + len(bench.deviations) - 3
            self._maps.append((place, size))
            place += size
        self.count = place

    def factors(self, bench: _Bench, where: tuple[int, int]) -> Array:
        """Return the matrix from the unknowns to the factors of a bench, shape (columns, unknowns)."""
        place, size = where
        matrix = np.zeros((size, self.count))
        for k, name in enumerate(bench.response.factors):
            if name in self.shapes:
                matrix[k, : len(self.shapes)] = self.root[self.shapes.index(name)]
            else:
                matrix[k, place + k] = bench.own.deviations[bench.own.place(name)]
        for j, deviation in enumerate(bench.deviations):
            k = len(bench.response.factors) + j
            matrix[k, place + k] = deviation
        return matrix

    def pieces(self, y: Array) -> list[tuple[Piece, Row, str]]:
        """Return the rows of all records in units of their noise."""
        result = []
        for bench, where in zip(self.benches, self._maps, strict=True):
            matrix = self.factors(bench, where)
            for record, rows in bench.rows(matrix @ y):
                for row in rows:
                    if len(row.residual) < _LEAST_ROWS:
                        continue
                    slope = (row.slope @ matrix) / row.sigma[:, None]
                    time = record.step * row.centres
                    name = f"{bench.test.source}/{record.name}"
                    piece = Piece(row.channel, name, time, row.residual / row.sigma, slope)
                    result.append((piece, row, bench.units[row.channel]))
        if not result:
            raise MeasurementError("records", "hold no stretch in which the machine moves long enough",
                                   next_step="sweep the motor slowly, for at least some seconds")  # fmt: skip
        return result

    def rows(self, y: Array) -> tuple[Array, Array]:
        """Return residuals and slopes, those of the prior first."""
        residuals, slopes = [y], [np.eye(len(y))]
        for piece, _, _ in self.pieces(y):
            residual, slope = huber_rows(piece.residual, piece.slope, _HUBER)
            residuals.append(residual)
            slopes.append(slope)
        return np.concatenate(residuals), np.vstack(slopes)

    def estimate(self, y: Array) -> Estimate:
        """Return what is known at the minimum."""
        found = self.pieces(y)
        misfits = tuple(_misfit(piece, row, unit) for piece, row, unit in found)
        for m, (_, row, _) in zip(misfits, found, strict=True):
            if m.ratio > _SUSPECT and m.residual > _FOREIGN * row.size:
                raise MeasurementError(
                    f"record '{m.record}': {m.channel}",
                    f"misses the model by {with_unit(three_digits(m.residual), m.unit)}, "
                    f"{three_digits(m.ratio)} times its noise and "
                    f"{100 * m.residual / row.size:.0f} % of what was measured, so no number of it can be trusted",
                    next_step="check units, signs and set-up; if they are right, ask `nlsdesign diagnose`",
                )
        robust = [
            piece._replace(**dict(zip(("residual", "slope"), huber_rows(piece.residual, piece.slope, _HUBER), strict=True)))
            for piece, _, _ in found
        ]
        covariance = robust_covariance(robust, np.eye(self.count))
        own = covariance[: len(self.shapes), : len(self.shapes)]
        widened = max([1.0, *(m.ratio / _FITS for m in misfits)]) ** 2
        # Nothing that was known is unlearned.
        strength, axes = np.linalg.eigh(widened * own)
        own = (axes * np.minimum(strength, 1.0)) @ axes.T
        factors = self.root @ y[: len(self.shapes)]
        after = _expanded(self.known, self.shapes, factors, self.root @ own @ self.root.T)
        sizes = self.shared.deviations
        strain = dict(zip(self.shapes, (factors / np.where(sizes > 0.0, sizes, 1.0)).tolist(), strict=True))
        return Estimate(self.known, after, strain, misfits, tuple(b.test.source for b in self.benches))


def _misfit(piece: Piece, row: Row, unit: str) -> Misfit:
    # The median of the squares would hide a misfit; a clipped mean square forgives an outlier only.
    clipped = np.minimum(np.abs(piece.residual), max(_HUBER, 3.0 * float(np.median(np.abs(piece.residual)))))
    noise = float(np.sqrt(np.mean(row.sigma**2)))
    return Misfit(piece.record, row.channel, unit, float(np.sqrt(np.mean(clipped**2))) * noise, noise, len(row.sigma))


def _expanded(known: Prior, shapes: Sequence[str], factors: Array, covariance: Array) -> Prior:
    """Return what is known of all numbers from what is known of their factors."""
    members = shared_factors(known)
    place = {name: k for k, first in enumerate(shapes) for name in members[first]}
    index = [place[name] for name in known.names]
    values = known.values * np.exp(factors[index])
    for bound, hold in ((known.minimum, np.maximum), (known.maximum, np.minimum)):
        if len(bound):
            values = hold(values, bound)
    return replace(known, values=values, covariance=covariance[np.ix_(index, index)])
