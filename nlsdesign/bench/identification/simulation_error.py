"""The error of simulated records as residuals over parameters and first states, with exact derivatives."""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from typing import NamedTuple

import numpy as np

from ...foundation.arrays import Array
from ...foundation.errors import MeasurementError, ValueRangeError
from ...model import FlatModel
from .least_squares import Fit
from .parameters import Parameter, box
from .records.measurement import Record, from_sample
from .windowed_simulation import Shooter, Shot, Windows, Wiring, wired


@dataclass(frozen=True)
class Shots:
    """How records are cut into windows and integrated.

    Parameters
    ----------
    length
        Of a window in s.
    joined
        Whether windows must join, so that the whole record is one simulation; otherwise each begins at the
        measured state and stands for a prediction over its length.
    substeps
        Integration steps from sample to sample.
    phases
        How many times windows apart are laid over a record, each time later by that share of their length;
        together they count as one. Where windows happen to begin then matters less.

    Raises
    ------
    ValueRangeError
        If ``phases`` is below one, or above one for windows that are joined.
    """

    length: float
    joined: bool = True
    substeps: int = 1
    phases: int = 1

    def __post_init__(self) -> None:
        if self.phases < 1 or (self.joined and self.phases > 1):
            raise ValueRangeError(
                f"{self.phases} phases", "only windows apart can be laid over a record more than once"
            )


@dataclass(frozen=True)
class Weights:
    """What counts how much in a fit.

    Parameters
    ----------
    sigma
        Standard deviation of measured signals that counts as one, in SI by name; that of others is estimated
        from the records.
    known
        Earlier fits of some of the parameters, for instance of a balance of forces, whose values and
        covariance count as prior.
    """

    sigma: Mapping[str, float] = field(default_factory=dict)
    known: Sequence[Fit] = ()


class Point(NamedTuple):
    """Parameters in the fitted scale, and the state at the beginning of each window, by record."""

    x: Array
    starts: tuple[Array, ...]


class Carry(NamedTuple):
    """How the beginnings of a record's windows follow a step, and the step that closes their gaps."""

    slope: Array
    gap: Array


class Linear(NamedTuple):
    """Residuals and their derivatives at a point, gaps between windows eliminated."""

    residual: Array  # priors first, then the records, in standard deviations
    closing: Array  # what closing the gaps adds to the residuals
    slope: Array  # over parameters and first states, shape (rows, unknowns)
    defect: float  # sum of the gaps relative to the size of the states
    carries: tuple[Carry, ...]  # one for each record


class SimulationError:
    """Records against a model with some parameters free.

    ``priors``: how many of the residuals are those of priors; they come first.
    """

    def __init__(
        self,
        model: FlatModel,
        records: Sequence[Record],
        parameters: Sequence[Parameter],
        *,
        shots: Shots,
        wiring: Wiring | None = None,
        weights: Weights | None = None,
        slopes: bool = True,
    ) -> None:
        if not records:
            raise MeasurementError("records", "there is none to fit", next_step="give at least one")
        if model.tables or model.sample_time is not None:
            raise ValueRangeError(f"model {model.name}", "must be continuous and without tables to be fitted")
        self.parameters, self.shots = tuple(parameters), shots
        self.records = tuple(later for r in records for later in _phases(r, shots))
        self.wiring = wiring or wired(model, list(records[0].trace.signals))
        late = set(self.wiring.late_by.values())
        self._own = [i for i, p in enumerate(parameters) if p.name not in late]
        free = [parameters[i].name for i in self._own]
        self.shooter = Shooter(model, free, self.wiring, substeps=shots.substeps, slopes=slopes)
        self.windows = [Windows(r, model, self.wiring, _samples(shots, r)) for r in self.records]
        weights = weights or Weights()
        stated = [weights.sigma.get(n, 0.0) or _noise(records, n) for n in self.wiring.outputs]
        self.sigma = np.array(stated) * math.sqrt(shots.phases)
        self._low, self._high, self._first = box(parameters)
        self._matrix, self._offset = _prior_rows(parameters, weights.known)
        self.priors = len(self._offset)
        self._size = np.ones(len(model.states))
        self._unknown = model.start(model.states)

    def values(self, x: Array) -> dict[str, float]:
        """Return the parameters in SI by name."""
        return {p.name: p.outward(v) for p, v in zip(self.parameters, x, strict=True)}

    def start(self) -> Point:
        """Return where a fit begins: measured states where there are any, the others as simulated so far."""
        values, starts = self.values(self._first), []
        for each in self.windows:
            guess = each.measured_start(np.tile(self._unknown, (each.number, 1)))
            if len(each.seen) < self.shooter.size:
                # A window inherits from the one before what nobody measured, one after the other.
                hidden = [i for i in range(self.shooter.size) if i not in each.seen]
                for k in range(1, each.number if hidden else 1):
                    one = Windows.only(each, k - 1)
                    guess[k, hidden] = self.shooter.shoot(one, guess[k - 1 : k], values).end[0][hidden]
            starts.append(guess)
        largest = np.max([np.abs(s).max(axis=0) for s in starts], axis=0)
        self._size = np.where(largest > 0.0, largest, 1.0)
        return Point(self._first, tuple(starts))

    def room(self, point: Point) -> tuple[Array, Array]:
        """Return how far a step may go in each direction."""
        open_end = np.full(self._columns - len(point.x), np.inf)
        low = np.concatenate([self._low - point.x, -open_end])
        return np.minimum(low, 0.0), np.maximum(np.concatenate([self._high - point.x, open_end]), 0.0)

    def moved(self, point: Point, linear: Linear, step: Array, share: float) -> Point:
        """Return the point after a share of a step."""
        x = np.clip(point.x + share * step[: len(point.x)], self._low, self._high)
        starts = [
            s + share * (c.slope @ step + c.gap) for s, c in zip(point.starts, linear.carries, strict=True)
        ]
        return Point(x, tuple(starts))

    @property
    def _columns(self) -> int:
        free = self.shooter.size * len(self.records) if self.shots.joined else 0
        return len(self.parameters) + free

    def residual(self, point: Point) -> Array:
        """Return the residuals alone; see :class:`Linear`."""
        values = self.values(point.x)
        rows = [self._prior(point.x)[0]]
        for each, start in zip(self.windows, point.starts, strict=True):
            shot = self.shooter.shoot(each, start, values)
            rows.append(self._late(each, shot.output, None, values)[0])
        return np.concatenate(rows)

    def rows(self, point: Point) -> Linear:
        """Return residuals and derivatives."""
        values = self.values(point.x)
        prior, prior_slope = self._prior(point.x)
        residuals, closings = [prior], [np.zeros_like(prior)]
        slopes, carries, defect = [prior_slope], [], 0.0
        for k, (each, start) in enumerate(zip(self.windows, point.starts, strict=True)):
            shot = self.shooter.shoot(each, start, values)
            carry = self._carry(k, shot, start, values)
            window = np.minimum(np.arange(shot.output.shape[1]) // each.count, each.number - 1)
            slope = np.einsum("oxk,kxz->okz", shot.by_start, carry.slope[window])
            slope[:, :, self._own] += shot.by_parameter.transpose(0, 2, 1) * self._scale(values)
            closing = np.einsum("oxk,kx->ok", shot.by_start, carry.gap[window])
            residual, row_slope, added = self._late(each, shot.output, (slope, closing), values)
            residuals.append(residual)
            slopes.append(row_slope)
            closings.append(added)
            carries.append(carry)
            if self.shots.joined:
                defect += float(np.sum(np.abs(shot.end[:-1] - start[1:]) / self._size))
        return Linear(
            np.concatenate(residuals), np.concatenate(closings), np.vstack(slopes), defect, tuple(carries)
        )

    def _scale(self, values: Mapping[str, float]) -> Array:
        own = [self.parameters[i] for i in self._own]
        return np.array([p.slope(values[p.name]) for p in own])

    def _carry(self, record: int, shot: Shot, start: Array, values: Mapping[str, float]) -> Carry:
        w, nx, columns = len(start), self.shooter.size, self._columns
        slope, gap = np.zeros((w, nx, columns)), np.zeros((w, nx))
        if not self.shots.joined:
            return Carry(slope, gap)
        first = len(self.parameters) + record * nx
        slope[0, :, first : first + nx] = np.diag(self._size)
        by_parameter = shot.end_by_parameter * self._scale(values)
        for i in range(w - 1):
            slope[i + 1] = shot.end_by_start[i] @ slope[i]
            slope[i + 1][:, self._own] += by_parameter[i]
            gap[i + 1] = shot.end_by_start[i] @ gap[i] + shot.end[i] - start[i + 1]
        return Carry(slope, gap)

    def _prior(self, x: Array) -> tuple[Array, Array]:
        slope = np.zeros((self.priors, self._columns))
        slope[:, : len(x)] = self._matrix
        return self._matrix @ x - self._offset, slope

    def _late(
        self, windows: Windows, output: Array, slopes: tuple[Array, Array] | None, values: Mapping[str, float]
    ) -> tuple[Array, Array, Array]:
        """Return the rows of all outputs, read as late as their delays say."""
        residuals, rows, closings = [], [], []
        for o, name in enumerate(self.wiring.outputs):
            y, sigma = output[o], self.sigma[o]
            slope, closing = (slopes[0][o], slopes[1][o]) if slopes else (np.zeros((len(y), 0)), 0.0 * y)
            if name in self.wiring.late_by:
                delay = self.wiring.late_by[name]
                read = _Reading(len(y), values[delay] / windows.record.step)
                rate = read.slope(y) / windows.record.step
                y, slope, closing = read(y), read(slope), read(closing)
                if slopes:
                    names = [p.name for p in self.parameters]
                    column = names.index(delay)
                    slope[:, column] -= rate * self.parameters[column].slope(values[delay])
            residuals.append((y - windows.measured[o]) / sigma)
            rows.append(slope / sigma)
            closings.append(closing / sigma)
        return np.concatenate(residuals), np.vstack(rows), np.concatenate(closings)


class _Reading:
    """Linear interpolation of sampled rows some samples earlier."""

    def __init__(self, count: int, samples: float) -> None:
        place = np.clip(np.arange(count) - samples, 0.0, count - 1.0)
        self._low = np.minimum(place.astype(int), count - 2)
        self._share = place - self._low
        self._inside = (np.arange(count) - samples > 0.0) & (np.arange(count) - samples < count - 1.0)

    def __call__(self, rows: Array) -> Array:
        share = self._share.reshape(-1, *[1] * (rows.ndim - 1))
        result: Array = (1.0 - share) * rows[self._low] + share * rows[self._low + 1]
        return result

    def slope(self, row: Array) -> Array:
        """Return the change per sample where a row is read; none where it is held at an end."""
        result: Array = (row[self._low + 1] - row[self._low]) * self._inside
        return result


def _samples(shots: Shots, record: Record) -> int:
    count = round(shots.length / record.step)
    if count < 2:
        raise ValueRangeError(
            f"windows of {shots.length:g} s",
            f"hold less than two samples of record '{record.name}', which lie {record.step:g} s apart",
        )
    return count


def _phases(record: Record, shots: Shots) -> list[Record]:
    count = _samples(shots, record)
    # One window that is longer than the record is the whole of it; later phases would begin behind its end.
    if shots.phases > 1 and count > len(record.trace):
        raise ValueRangeError(
            f"windows of {shots.length:g} s",
            f"are longer than record '{record.name}', which lasts {record.step * len(record.trace):g} s",
            next_step="give a shorter window",
        )
    starts = [count * k // shots.phases for k in range(shots.phases)]
    return [record, *(from_sample(record, first) for first in starts[1:])]


def _noise(records: Sequence[Record], signal: str) -> float:
    rows = [r.trace[signal] for r in records]
    resolutions = [r.resolution_of(signal) for r in records]
    white = float(np.median([g.noise for g in resolutions]))
    rounding = float(np.median([g.quantum for g in resolutions])) / math.sqrt(12.0)
    return max(white, rounding) or float(np.std(np.concatenate(rows))) or 1.0


def _prior_rows(parameters: Sequence[Parameter], known: Sequence[Fit] = ()) -> tuple[Array, Array]:
    """Return M and m, so that M·x − m are the residuals of everything known before, x in the fitted scale.

    ``parameters``: in the order of x; those with a finite sigma give a row each. ``known``: earlier fits;
    each gives as many rows as it has parameters among these, correlated as they were.
    """
    names = [p.name for p in parameters]
    rows = [np.diag([1.0 / p.sigma for p in parameters]).reshape(len(names), len(names))]
    centres = [
        np.array([p.inward(p.centre) / p.sigma if math.isfinite(p.sigma) else 0.0 for p in parameters])
    ]
    for fit in known:
        places = [(i, names.index(p.name)) for i, p in enumerate(fit.parameters) if p.name in names]
        if not places:
            continue
        own, columns = (list(side) for side in zip(*places, strict=True))
        # From the scale of the earlier fit to that of this one, at the value found.
        ratio = np.array(
            [
                fit.parameters[i].slope(fit.values[names[j]]) / parameters[j].slope(fit.values[names[j]])
                for i, j in places
            ]
        )
        covariance = fit.covariance[np.ix_(own, own)] * np.outer(ratio, ratio)
        strength, axes = np.linalg.eigh(covariance)
        whitened = (axes / np.sqrt(np.maximum(strength, 1e-12 * strength.max()))).T
        wide = np.zeros((len(own), len(names)))
        wide[:, columns] = whitened
        rows.append(wide)
        centres.append(whitened @ np.array([parameters[j].inward(fit.values[names[j]]) for j in columns]))
    return np.vstack(rows), np.concatenate(centres)
