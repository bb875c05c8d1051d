"""The error of an observer as it runs: all matrices that one sample can apply to it, as corners of a box.

With x̂ the corrected state, two runs of one observer on the same signals differ by e, and
e⁺ = (I − M(θ⁺)C)·F(q)·Φ(θ)·e. Φ and M are read from the table, whose values between grid points lie between
those of the grid points and beyond it are held; F(q) is dry friction, which multiplies a difference of speed
by some q between the least and the greatest slope of the braked speed, and moves the angle by T/2·(q − 1)
times it. So each entry lies between bounds that hold for every angle, also between grid points and also where
the angle jumps.
"""

from __future__ import annotations

import math
from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from fractions import Fraction
from itertools import product
from typing import NamedTuple

import casadi as ca
import numpy as np

from ....foundation.arrays import Array
from ..scheduling.angle_form import AngleScheduledPlant
from ..scheduling.scheduled import ObserverDesign
from .exact import Matrix, combined, corners, identity, times
from .intervals import enclose, multiply

SPEED_LIMIT = 1e4
"""Largest speed in rad/s for which the slope of the braked speed is bounded."""
REFINEMENTS, TOLERANCE = 20, 2e-3
"""How often a range of speeds is halved, and how much wider than its middle the bounds may stay."""


class EntryReading(NamedTuple):
    """How an entry is read: ``factor`` × column, or ``factor`` alone where ``column`` is ``None``."""

    factor: float
    column: int | None


@dataclass(frozen=True, eq=False)
class ErrorPolytope:
    """All matrices that a sample can apply to the error."""

    # states, sizes, moving, seen: as of an ErrorSystem
    states: tuple[str, ...]
    sizes: tuple[float, ...]
    moving: tuple[int, int]
    seen: tuple[int, ...]
    sample_time: float  # T in s
    # columns: least and greatest value of each column of the table, shape (columns, 2)
    columns: tuple[tuple[float, float], ...]
    # transition, correction: Φ (n, n) and M (n, r) as they are read
    transition: tuple[tuple[EntryReading, ...], ...]
    correction: tuple[tuple[EntryReading, ...], ...]
    friction: tuple[float, float]  # least and greatest slope of the braked speed; (1, 1) without dry friction

    def exact_corners(self) -> Iterator[Matrix]:
        """Yield every corner of (I − MC)·F(q)·Φ in scaled states, in fractions."""
        n, (angle, speed) = len(self.states), self.moving
        scale = [Fraction(s) for s in self.sizes]
        for m, q, phi in product(
            self._read(self.correction), sorted(set(self.friction)), self._read(self.transition)
        ):
            output = [[Fraction(int(j == place)) for j in range(n)] for place in self.seen]
            seen = combined(identity(n), times(m, output), first=Fraction(1), second=Fraction(-1))
            braked = identity(n)
            braked[speed][speed] = Fraction(q)
            braked[angle][speed] = Fraction(self.sample_time) / 2 * (Fraction(q) - 1)
            error = times(times(seen, braked), phi)
            yield [[error[i][j] * scale[j] / scale[i] for j in range(n)] for i in range(n)]

    def corners(self) -> Array:
        """Return the same corners as floating-point numbers, shape (corners, n, n)."""
        return np.array([[[float(v) for v in row] for row in corner] for corner in self.exact_corners()])

    def _read(self, entries: Sequence[Sequence[EntryReading]]) -> list[Matrix]:
        used = sorted({e.column for row in entries for e in row if e.column is not None})
        result = []
        for values in corners(*([self.columns[c][end] for c in used] for end in (0, 1))):
            at = {c: Fraction(v) for c, v in zip(used, values, strict=True)}
            result.append(
                [
                    [Fraction(e.factor) * (1 if e.column is None else at[e.column]) for e in row]
                    for row in entries
                ]
            )
        return result


def error_polytope(design: ObserverDesign) -> ErrorPolytope:
    """Return what one sample of a finished observer can do to its error."""
    plant, compact = design.step.plant, design.compact
    n, seen = len(plant.states), tuple(int(np.argmax(row)) for row in plant.output_matrix)

    def read(kind: str, width: int) -> tuple[tuple[EntryReading, ...], ...]:
        places = [[compact.places[f"{kind}[{i}][{j}]"] for j in range(width)] for i in range(n)]
        return tuple(tuple(EntryReading(p.factor, p.column) for p in row) for row in places)

    ranges = [(float(np.min(c)), float(np.max(c))) for c in compact.values.T]
    return ErrorPolytope(
        states=plant.names,
        sizes=scaling(plant),
        moving=plant.moving,
        seen=seen,
        sample_time=design.step.sample_time,
        columns=tuple(ranges),
        transition=read("next", n),
        correction=read("correction", len(seen)),
        friction=friction_slopes(plant, design.step.sample_time),
    )


def scaling(plant: AngleScheduledPlant, frequency: float = 30.0) -> tuple[float, ...]:
    """Return the sizes over which states are written: typical ones, the speed at least that of a swing."""
    angle, speed = plant.moving
    sizes = [float(s) for s in plant.sizes]
    sizes[speed] = max(sizes[speed], 2.0 * math.pi * frequency * sizes[angle])
    return tuple(sizes)


def friction_slopes(plant: AngleScheduledPlant, sample_time: float) -> tuple[float, float]:
    """Return verified bounds on the slope of the braked speed over the speed: the sector of dry friction.

    Any two speeds of one observer leave friction as q times their difference, with q between these. Friction
    that rises with the speed gives 0 ≤ q ≤ 1 but for rounding: it never drives two estimates apart.
    """
    if plant.friction is None:
        return (1.0, 1.0)
    speed = ca.SX.sym("speed")
    rate = ca.SX(plant.friction(speed))
    slope = ca.jacobian(rate, speed)
    curvature = ca.jacobian(slope, speed)
    function = ca.Function("friction", [speed], [ca.densify(v) for v in (rate, slope, curvature)])
    edges = np.concatenate([[0.0], np.geomspace(1e-6, SPEED_LIMIT, 2000)])
    edges = np.concatenate([-edges[:0:-1], edges])
    cells, low, high = np.array([edges[:-1], edges[1:]]), 0.0, 0.0
    for _ in range(REFINEMENTS):
        least, greatest = _braked_slopes(function, cells, sample_time)
        points = _braked_slopes(function, np.array([cells.mean(axis=0)] * 2), sample_time)
        wide = (least < min(low, np.min(points[0])) - TOLERANCE) | (
            greatest > max(high, np.max(points[1])) + TOLERANCE
        )
        low, high = (
            min(low, float(np.min(least[~wide], initial=0.0))),
            max(high, float(np.max(greatest[~wide], initial=0.0))),
        )
        if not np.any(wide):
            break
        left = (least[wide], greatest[wide])
        middle = cells[:, wide].mean(axis=0)
        cells = np.hstack([[cells[0, wide], middle], [middle, cells[1, wide]]])
    else:
        low, high = min(low, float(np.min(left[0]))), max(high, float(np.max(left[1])))
    # Rounded outward to few digits; an infinite bound stays one and is refused by the inequality.
    return (_rounded(low, np.floor), _rounded(high, np.ceil))


def _braked_slopes(function: ca.Function, cells: Array, sample_time: float) -> tuple[Array, Array]:
    """Return bounds of 1 + T·f′·φ(x) + T·f·φ′(x)·T·f″ with x = T·f′ and φ(x) = (e^x − 1)/x, or zero."""
    rate, slope, curvature = ((r.lower[:, 0], r.upper[:, 0]) for r in
                              enclose(function, [[(cells[0], cells[1])]]).outputs)  # fmt: skip
    time = (np.array(sample_time), np.array(sample_time))
    x = multiply(time, slope)
    mean, curved = (
        (f(x[0]) * (1.0 - 1e-9), f(x[1]) * (1.0 + 1e-9)) for f in (_mean_exponential, _bent_exponential)
    )
    first = multiply(x, mean)
    second = multiply(multiply(time, rate), multiply(curved, multiply(time, curvature)))
    least, greatest = 1.0 + first[0] + second[0] - 1e-12, 1.0 + first[1] + second[1] + 1e-12
    # Where friction would turn the speed around, it stops it: the slope is zero.
    change = multiply(multiply(time, rate), mean)
    left, right = cells[0] + change[0], cells[1] + change[1]
    stopped = ((cells[0] >= 0.0) & (right < 0.0)) | ((cells[1] <= 0.0) & (left > 0.0))
    least, greatest = np.where(stopped, 0.0, least), np.where(stopped, 0.0, greatest)
    return np.minimum(least, 0.0), np.maximum(greatest, 0.0)


def _mean_exponential(x: Array) -> Array:
    """Return φ(x) = ∫₀¹ e^(sx) ds, which rises; to 1e-10."""
    near = np.abs(x) < 1e-3
    away = np.where(near, 1.0, x)
    return np.where(near, 1.0 + x / 2.0 + x**2 / 6.0 + x**3 / 24.0, np.expm1(away) / away)


def _bent_exponential(x: Array) -> Array:
    """Return φ′(x) = ∫₀¹ s·e^(sx) ds, which rises; to 1e-10."""
    near = np.abs(x) < 1e-2
    away = np.where(near, 1.0, x)
    return np.where(
        near,
        0.5 + x / 3.0 + x**2 / 8.0 + x**3 / 30.0 + x**4 / 144.0,
        (away * np.exp(away) - np.expm1(away)) / away**2,
    )


def _rounded(value: float, way: np.ufunc) -> float:
    return float(way(value * 1e6) / 1e6) if np.isfinite(value) else value
