"""What is unknown in one or several calibrations, scaled to unit normals, and the rows that bind it."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np

from ...foundation.arrays import Array
from ...foundation.errors import MeasurementError
from ...model import FlatModel
from ...model.readings import reading_of
from ...model.roles import driven_body
from ...simulation import Prior, declared_prior
from ..discrepancy.block_prediction import shown_values
from ..identification import Record
from ..identification.covariance import Piece
from .bench_response import (
    BALANCE,
    BenchCourse,
    BenchResponse,
    BenchRows,
    RecordedRun,
    SampleNoise,
    bench_response,
    rate_of,
    rows_of,
    shared_factors,
    window_length,
)
from .bench_test import WEIGHT, CalibrationTest, HungWeightTest

LEAST_ROWS = 8
"""Rows of a channel on a record below which it says nothing."""
_PER_WINDOW = 24
"""Samples of a window that are enough."""


@dataclass(frozen=True, eq=False)
class BenchEvidence:
    """A machine on the bench, its records, and what its instruments add to the unknowns."""

    title: str  # what was done
    source: str  # where the records come from
    response: BenchResponse  # of the machine on the bench
    own: Prior  # what is known of its numbers, those of the bench included
    runs: tuple[tuple[str, RecordedRun], ...]  # name, and what was recorded or is expected
    units: dict[str, str]
    # deviations: of the instruments: zero of the motion, offset of the command, factor of the weight, then
    # offset and gain of each channel
    deviations: Array

    @property
    def unknowns(self) -> int:
        """Number of factors and of what the instruments may be wrong by."""
        return len(self.response.factors) + len(self.deviations)

    def rows(self, x: Array) -> list[tuple[str, float, list[BenchRows]]]:
        """Return name, time between samples, and rows of all records.

        ``x``: factors, then instruments; shape (unknowns,).
        """
        own, cells = x[: self.response.columns], x[self.response.columns :]
        result = []
        for name, run in self.runs:
            wide = []
            for row in rows_of(self.response, run, own):
                more = np.zeros((len(row.residual), len(cells)))
                residual = row.residual
                if row.channel != BALANCE:
                    k = 2 * self.response.channels.index(row.channel)
                    more[:, k], more[:, k + 1] = -1.0, -row.shown
                    residual = residual - cells[k] - cells[k + 1] * row.shown
                    row = row._replace(slope=(1.0 + cells[k + 1]) * row.slope)
                if len(residual) >= LEAST_ROWS:
                    wide.append(row._replace(residual=residual, slope=np.hstack([row.slope, more])))
            result.append((name, run.course.step, wide))
        return result


def bench_evidence(
    model: FlatModel,
    kind: CalibrationTest,
    channels: Sequence[str],
    runs: Sequence[tuple[str, RecordedRun]],
    *,
    known: Prior,
    source: str = "",
    balanced: bool = True,
) -> BenchEvidence:
    """Return a machine on the bench with what was recorded, or is expected."""
    own = bench_prior(model, known)
    instruments = kind.instruments
    largest = max(float(np.max(np.abs(run.course.command))) for _, run in runs)
    deviations = [instruments.zero_angle, instruments.offset * largest, instruments.weight]
    for k, channel in enumerate(channels):
        most = max(float(np.max(np.abs(run.measured[k]))) for _, run in runs)
        # Whether the deck says itself how well the gain of a cell is known.
        reading = reading_of(model.readings, channel)
        gain_is_free = any(
            "gain" in law.parameters() and bool(law.parameters()["gain"].spread) for law in reading.laws
        )
        deviations += [instruments.offset * most, 0.0 if gain_is_free else instruments.cell]
    body = driven_body(model)
    return BenchEvidence(
        kind.title,
        source,
        bench_response(model, own, channels, balanced=balanced),
        own,
        tuple(runs),
        {BALANCE: body.domain.effort_unit, **{c: model.variable(c).unit for c in channels}},
        np.array(deviations),
    )


def recorded_bench(
    model: FlatModel, kind: CalibrationTest, records: Sequence[Record], *, known: Prior, source: str
) -> BenchEvidence:
    """Return a machine on the bench with its records."""
    body = driven_body(model)
    where = source or "records"
    shows = {s: reading_of(model.readings, s).measured for s in records[0].trace.signals}
    motion = next((s for s, of in shows.items() if of == body.motion), None)
    if motion is None:
        raise MeasurementError(
            where, f"do not hold the motion '{body.motion}'", next_step="log the encoder of the drive"
        )
    drive = next((s for s, of in shows.items() if of in body.drives or of in body.commands), None)
    weight = next((s for s, of in shows.items() if of == f"{WEIGHT}.torque"), None)
    if isinstance(kind, HungWeightTest) and weight is None:
        raise MeasurementError(
            where,
            f"do not hold the torque of the weight, '{WEIGHT}.torque'",
            next_step="add a column with mass times gravity times lever, in N·m",
        )
    channels = [s for s in shows if s not in (motion, drive, weight)]
    if drive is None and not channels:
        command = body.drives[0] if body.drives else "the current of the motor"
        raise MeasurementError(
            where, "hold neither the command of the drive nor an effort", next_step=f"log '{command}'"
        )
    runs = [(r.name, _run(model, r, (motion, drive, weight), channels)) for r in records]
    return bench_evidence(model, kind, channels, runs, known=known, source=source, balanced=drive is not None)


def bench_prior(model: FlatModel, known: Prior) -> Prior:
    """Return what is known of the numbers of a bench: of the machine's own what was known, and of others."""
    own = declared_prior(model)
    covariance, values = own.covariance.copy(), own.values.copy()
    shared = [(i, known.place(n)) for i, n in enumerate(own.names) if n in known.names]
    here, there = ([pair[k] for pair in shared] for k in (0, 1))
    covariance[np.ix_(here, here)] = known.covariance[np.ix_(there, there)]
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
    course = BenchCourse(
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


class Unknowns:
    """All benches over unknowns that are independent unit normals before anything is measured.

    ``known``: of the numbers of the machine. ``shapes``: names of the factors of the machine, which come
    first. ``root``: from the unknowns of the machine to its factors. ``count``: number of unknowns, with
    those of the instruments.
    """

    def __init__(self, known: Prior, benches: Sequence[BenchEvidence]) -> None:
        self.known, self.benches = known, tuple(benches)
        self.shapes = list(shared_factors(known))
        self.root = known.only(self.shapes).root
        self._places = list(np.cumsum([len(self.shapes), *(b.unknowns for b in benches)]))
        self.count = int(self._places[-1])

    def pieces(self, y: Array) -> list[tuple[BenchEvidence, Piece, BenchRows]]:
        """Return the rows of all records in units of their noise."""
        result = []
        for bench, place in zip(self.benches, self._places, strict=False):
            matrix = self._factors(bench, int(place))
            for name, step, rows in bench.rows(matrix @ y):
                for row in rows:
                    slope = (row.slope @ matrix) / row.sigma[:, None]
                    where = f"{bench.source}/{name}".strip("/")
                    time = np.asarray(step * row.centres, dtype=np.float64)
                    piece = Piece(row.channel, where, time, row.residual / row.sigma, slope)
                    result.append((bench, piece, row))
        if not result:
            raise MeasurementError(
                "records",
                "hold no stretch in which the machine moves long enough in one direction",
                next_step="sweep the motor slowly, for at least some seconds",
            )
        return result

    def _factors(self, bench: BenchEvidence, place: int) -> Array:
        """Return the matrix from the unknowns to factors and instruments of a bench."""
        matrix = np.zeros((bench.unknowns, self.count))
        for k, name in enumerate(bench.response.factors):
            if name in self.shapes:
                matrix[k, : len(self.shapes)] = self.root[self.shapes.index(name)]
            else:
                matrix[k, place + k] = bench.own.deviations[bench.own.place(name)]
        for j, deviation in enumerate(bench.deviations):
            k = len(bench.response.factors) + j
            matrix[k, place + k] = deviation
        return matrix

    def learned(self, y: Array, covariance: Array) -> Prior:
        """Return what is known of all numbers.

        ``covariance``: of the unknowns, shape (count, count).
        """
        size = len(self.shapes)
        # Nothing that was known is unlearned.
        strength, axes = np.linalg.eigh(covariance[:size, :size])
        own = (axes * np.clip(strength, 0.0, 1.0)) @ axes.T
        members = shared_factors(self.known)
        places = {name: k for k, first in enumerate(self.shapes) for name in members[first]}
        index = [places[name] for name in self.known.names]
        wide = (self.root @ own @ self.root.T)[np.ix_(index, index)]
        values = self.known.numbers((self.root @ y[:size])[index])
        for bound, hold in ((self.known.minimum, np.maximum), (self.known.maximum, np.minimum)):
            if len(bound):
                values = hold(values, bound)
        return replace(self.known, values=values, covariance=0.5 * (wide + wide.T))
