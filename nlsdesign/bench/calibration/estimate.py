"""Numbers of a machine estimated from records of calibrations, with the declared spreads as prior."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import NamedTuple

import numpy as np
import scipy

from ...components.assembly.named_parts import Assembly
from ...foundation.arrays import Array
from ...foundation.errors import ConvergenceError, MeasurementError, ValueRangeError, unknown_name
from ...foundation.quantity import three_digits, with_unit
from ...model import flatten
from ...simulation import Prior, declared_prior
from ..identification import RecordSet, load_record
from ..identification.covariance import Piece, inverse_information, robust_covariance
from ..identification.least_squares import Minimum, huber_rows, minimise
from ..identification.records.table_files import table_files
from .bench_response import BenchRows
from .bench_test import WEIGHT, CalibrationTest
from .unknowns import BenchEvidence, Unknowns, recorded_bench

_HUBER = 3.0
"""Standard deviations beyond which a row counts as Huber says."""
_EVALUATIONS = 120
_ENOUGH = 0.1
"""Gain of half a sum of squares that no longer matters: it moves no number by half a standard deviation."""
_REACH = 12.0
"""Standard deviations of the prior that a number may move."""
FITS = 1.5
"""Residual in units of the noise up to which a record fits: the noise of a sample is itself an estimate."""
_FOREIGN = 0.1
"""Share of what is measured that a model may miss; beyond it the record is of another machine or unit."""
_LEARNED = 0.97
"""Share of the earlier standard deviation below which something was learned of a number."""
_LEAST_TOLD = 0.1
"""Share of the variance of a number that records must tell to put its declared value in doubt."""
_TELLS = 0.1
"""Share of the variance before, below which a direction is told by the records."""
_SAME = 1e-9
"""Share by which two readings of one number may differ."""
_SUSPECT = 3.0
"""Standard deviations of the prior beyond which a number is suspect."""


@dataclass(frozen=True, eq=False)
class CalibrationRecords:
    """Records of one kind of calibration."""

    kind: CalibrationTest  # how the machine stood on the bench
    records: RecordSet  # each begins at rest, with the rubber relaxed
    source: str = ""  # file or folder, for the deck


class ChannelMisfit(NamedTuple):
    """How well one channel of one record fits."""

    record: str
    channel: str
    unit: str
    # residual, noise: root mean square of what the model leaves over, and what noise alone would
    residual: float
    noise: float
    rows: int  # how many windows of the record counted

    @property
    def ratio(self) -> float:
        """Residual in units of the noise."""
        return self.residual / self.noise


@dataclass(frozen=True, eq=False)
class Estimate:
    """Numbers after a calibration."""

    # before, after: what was known, and is; the values of after are the estimates
    before: Prior
    after: Prior
    strain: dict[str, float]  # how far each number has moved, in standard deviations of the prior, by name
    # doubt: the same, in standard deviations of what such records would move it by chance: several numbers of
    # one product are in doubt alike
    doubt: dict[str, float]
    # chance: how often a machine as declared would need numbers as far from the declared ones, all taken
    # together
    chance: float
    misfits: tuple[ChannelMisfit, ...]  # of each channel and record
    told_by: dict[str, str]  # what each number is known from, by name; no entry where nothing was added
    files: tuple[str, ...]  # where the records came from

    @property
    def suspects(self) -> tuple[str, ...]:
        """Numbers whose declared value or spread is in doubt by more than three standard deviations."""
        return tuple(name for name, z in self.doubt.items() if abs(z) > _SUSPECT)

    @property
    def inflated(self) -> float:
        """Factor by which standard deviations were widened, as the model does not fit within the noise.

        What a model lacks does not average out over the windows of a record, as noise does.
        """
        return _widened(self.misfits)


def _widened(misfits: Sequence[ChannelMisfit]) -> float:
    rows = sum(m.rows for m in misfits)
    beyond = max([0.0, *((m.ratio / FITS) ** 2 - 1.0 for m in misfits)])
    return math.sqrt(1.0 + beyond * rows)


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
        As for :func:`~nlsdesign.bench.identification.load_records`.

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
    findings = [finding for one in sets for finding in one.findings]
    # A weight stays the same, as it should.
    for weight in (c.name for c in sets[0].columns if c.signal == f"{WEIGHT}.torque"):
        findings = [f for f in findings if "constant" not in f.text or f"column '{weight}'" not in f.place]
    records = RecordSet(
        tuple(record for one in sets for record in one.records),
        sets[0].columns,
        tuple(findings),
        tuple(remark for one in sets for remark in one.remarks),
    )
    return CalibrationRecords(kind, records, str(folder))


def record_findings(tests: Sequence[CalibrationRecords]) -> list[str]:
    """Return in sentences what was found in the files: what is suspect, and remarks."""
    suspect = [f"suspect: {finding}" for test in tests for finding in test.records.findings]
    return suspect + [str(remark) for test in tests for remark in test.records.remarks]


def prior_of(actuator: Assembly, given: Prior | None) -> Prior:
    """Return what is known of a machine: as given, or the declared spreads."""
    model = flatten(actuator)
    if given is None:
        return declared_prior(model)
    values = model.values
    for name, value in zip(given.names, given.values, strict=True):
        if name not in values:
            raise unknown_name("number", name, values)
        if abs(values[name] - value) > _SAME * abs(value):
            raise ValueRangeError(
                f"{name} = {value:g} in what is known, {values[name]:g} in the deck",
                "must be the same: what is known is known about these values",
                next_step="give the deck that was written with it",
            )
    numbers = [model.variable(name) for name in given.names]
    low, high = (np.array([getattr(v, end) for v in numbers], dtype=float) for end in ("minimum", "maximum"))
    return Prior(given.names, given.values, given.covariance, low, high, given.kinds)


def estimate(
    actuator: Assembly, tests: Sequence[CalibrationRecords], *, prior: Prior | None = None
) -> Estimate:
    """Estimate the numbers of a machine that are declared with a spread.

    Each record is simulated along its measured motion; measured efforts and the balance of the drive are
    compared, windows of the record are rows. Outliers count as Huber says (Huber 1964). The covariance is
    that of what the residuals scatter, widened where the model does not fit within the noise.

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
    if not tests:
        raise MeasurementError("calibration", "has no records", next_step="give those of at least one kind")
    known = prior_of(actuator, prior)
    benches = [
        recorded_bench(
            flatten(test.kind.on_bench(actuator)),
            test.kind,
            test.records.records,
            known=known,
            source=test.source,
        )
        for test in tests
    ]
    unknowns = Unknowns(known, benches)

    ended = _fitted(unknowns, np.zeros(unknowns.count), 1.0)
    fitted_pieces = unknowns.pieces(ended.x)
    misfits = tuple(_misfit(piece, row, bench.units[row.channel]) for bench, piece, row in fitted_pieces)
    for m, (_, _, row) in zip(misfits, fitted_pieces, strict=True):
        if m.ratio > _SUSPECT and m.residual > _FOREIGN * row.size:
            raise _foreign(m, row.size)
    if not ended.converged:
        raise ConvergenceError(
            "calibration", "did not converge", next_step="check the units and the set-up of the records"
        )
    widened = _widened(misfits)
    if widened > 1.0:
        # What the model lacks counts as noise, so that it does not drag numbers from what was declared.
        ended = _fitted(unknowns, ended.x, widened)
        fitted_pieces = unknowns.pieces(ended.x)
    result = _estimated(unknowns, ended.x, fitted_pieces, misfits)
    if widened > 1.0 and not result.told_by:
        worst = max(misfits, key=lambda m: m.ratio)
        raise MeasurementError(
            f"record '{worst.record}': {worst.channel}",
            f"misses the model by {with_unit(three_digits(worst.residual), worst.unit)}, "
            f"{three_digits(worst.ratio)} times its noise: too much to learn anything from these records",
            next_step="check that deck and records are of one machine; ask `nlsdesign diagnose`",
        )
    return result


def _fitted(unknowns: Unknowns, start: Array, widened: float) -> Minimum:
    """Return the most likely unknowns where everything measured is so many times as noisy as it should be."""

    def rows(y: Array) -> tuple[Array, Array]:
        residuals, slopes = [y], [np.eye(len(y))]
        for _, piece, _ in unknowns.pieces(y):
            residual, slope = huber_rows(piece.residual / widened, piece.slope / widened, _HUBER)
            residuals.append(residual)
            slopes.append(slope)
        return np.concatenate(residuals), np.vstack(slopes)

    reach = np.full(unknowns.count, _REACH)
    return minimise(rows, start, (-reach, reach), evaluations=_EVALUATIONS, least=_ENOUGH)


def _estimated(
    unknowns: Unknowns,
    y: Array,
    fitted_pieces: Sequence[tuple[BenchEvidence, Piece, BenchRows]],
    misfits: tuple[ChannelMisfit, ...],
) -> Estimate:
    covariance = _covariance(unknowns, fitted_pieces, _widened(misfits))
    after = unknowns.learned(y, covariance)
    known, size = unknowns.known, len(unknowns.shapes)
    deviations = known.only(unknowns.shapes).deviations
    scale = np.where(deviations > 0.0, deviations, 1.0)
    strain = (unknowns.root @ y[:size]) / scale
    # Of a number that shares its part in a product the records tell a share of the strain only.
    left = np.diag(unknowns.root @ covariance[:size, :size] @ unknowns.root.T) / scale**2
    doubt = strain / np.sqrt(np.maximum(1.0 - left, _LEAST_TOLD))
    # How often numbers as declared would move as far in the directions that the records tell.
    strength, axes = np.linalg.eigh(covariance[:size, :size])
    informed = strength < _TELLS
    squares = float(np.sum((axes[:, informed].T @ y[:size]) ** 2))
    chance = float(scipy.stats.chi2.sf(squares, max(1, int(np.sum(informed)))))
    return Estimate(
        known,
        after,
        dict(zip(unknowns.shapes, strain.tolist(), strict=True)),
        dict(zip(unknowns.shapes, doubt.tolist(), strict=True)),
        chance,
        misfits,
        _told_by(unknowns, fitted_pieces, after),
        tuple(bench.source for bench in unknowns.benches),
    )


def _covariance(
    unknowns: Unknowns, fitted_pieces: Sequence[tuple[BenchEvidence, Piece, BenchRows]], widened: float
) -> Array:
    """Return the covariance of the unknowns: of what the residuals scatter, or of what the model misses."""
    if widened > 1.0:
        slopes = np.vstack([piece.slope for _, piece, _ in fitted_pieces]) / widened
        return inverse_information(np.eye(unknowns.count) + slopes.T @ slopes)
    robust = []
    for _, piece, _ in fitted_pieces:
        residual, slope = huber_rows(piece.residual, piece.slope, _HUBER)
        robust.append(piece._replace(residual=residual, slope=slope))
    return robust_covariance(robust, np.eye(unknowns.count))


def _told_by(
    unknowns: Unknowns, fitted_pieces: Sequence[tuple[BenchEvidence, Piece, BenchRows]], after: Prior
) -> dict[str, str]:
    """Return which bench alone would leave the least uncertainty of each number that became better known."""
    alone = {}
    for bench in unknowns.benches:
        own = [piece.slope for each, piece, _ in fitted_pieces if each is bench]
        information = sum((s.T @ s for s in own), start=np.eye(unknowns.count))
        covariance = np.asarray(np.linalg.inv(information), dtype=np.float64)
        alone[bench.title] = unknowns.learned(np.zeros(unknowns.count), covariance).deviations
    before, source_of = unknowns.known.deviations, {}
    for k, name in enumerate(unknowns.known.names):
        if after.deviations[k] < _LEARNED * before[k]:
            source_of[name] = min(alone, key=lambda title: float(alone[title][k]))
    return source_of


def _foreign(m: ChannelMisfit, size: float) -> MeasurementError:
    return MeasurementError(
        f"record '{m.record}': {m.channel}",
        f"misses the model by {with_unit(three_digits(m.residual), m.unit)}, {three_digits(m.ratio)} times "
        f"its noise and {100 * m.residual / size:.0f} % of what was measured: no number of it can be trusted",
        next_step="check units, signs and set-up; if they are right, ask `nlsdesign diagnose`",
    )


def _misfit(piece: Piece, row: BenchRows, unit: str) -> ChannelMisfit:
    # The median of the squares would hide a misfit; a clipped mean square forgives an outlier only.
    clipped = np.minimum(np.abs(piece.residual), max(_HUBER, 3.0 * float(np.median(np.abs(piece.residual)))))
    noise = float(np.sqrt(np.mean(row.sigma**2)))
    residual = float(np.sqrt(np.mean(clipped**2))) * noise
    return ChannelMisfit(piece.record, row.channel, unit, residual, noise, len(row.sigma))
