"""Answers of a sweep: quantiles with bounds, surfaces over two axes, and whether axes are independent."""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from itertools import combinations, combinations_with_replacement, product
from typing import Any, Final, NamedTuple

import numpy as np
from numpy.typing import ArrayLike, NDArray
from scipy.spatial import Delaunay, QhullError
from scipy.stats import binom, rankdata

from ..foundation.arrays import Array

SHARES = (0.05, 0.25, 0.5, 0.75, 0.95)
CONFIDENCE = 0.95


class BoundedQuantile(NamedTuple):
    """A quantile with the bounds of its confidence."""

    share: float  # of the values that lie at or below it
    value: float  # of the sample, one of its values
    # lower, upper: bounds, values of the sample; not a number where the sample is too small to bound that
    # side
    lower: float
    upper: float


def answer_quantiles(values: ArrayLike, shares: Sequence[float] = SHARES) -> list[BoundedQuantile]:
    """Return quantiles, each with the order statistics that bound it with 95 % confidence.

    The bounds hold for independent draws of any continuous distribution: the number of draws below a quantile
    has a binomial distribution. Infinite values count as the largest or smallest.

    ``values``: of one answer; those that are not a number are left out.
    """
    column = np.asarray(values, dtype=float).ravel()
    ordered = np.sort(column[~np.isnan(column)])
    count, tail = len(ordered), 0.5 * (1.0 - CONFIDENCE)
    if not count:
        return []
    result = []
    for share in shares:
        low = int(binom.ppf(tail, count, share))
        high = int(binom.ppf(1.0 - tail, count, share)) + 1
        lower = float(ordered[low - 1]) if low >= 1 else math.nan
        upper = float(ordered[high - 1]) if high <= count else math.nan
        middle = min(count, max(1, math.ceil(count * share - 1e-9)))
        result.append(BoundedQuantile(share, float(ordered[middle - 1]), lower, upper))
    return result


_FOLDS, _CELLS, _HIGHEST_DEGREE = 10, 41, 4
_LEAST_EXPLAINED = 0.1


@dataclass(frozen=True, eq=False)
class AnswerSurface:
    """An answer over two axes, and how well it predicts points that it has not seen."""

    # across, up: nodes of the two axes, shapes (m,) and (n,), in SI
    across: Array
    up: Array
    # values: shape (n, m), in SI; not a number outside the points' convex hull, and where a point of a grid
    # failed
    values: Array
    method: str  # how it was made, as text
    # error: root mean square of what it predicts for points that were left out, minus their answers; not a
    # number where no point could be left out
    error: float
    deviation: float  # standard deviation of the answers, which the mean alone would leave
    unpredicted: int  # how many points that were left out lay outside the hull of the others

    @property
    def predicts(self) -> bool:
        """Whether it predicts at least a tenth of the variance of points that were left out.

        The form that predicts best is chosen by the same error, so a little is predicted of noise too.
        """
        return bool(self.explained >= _LEAST_EXPLAINED)

    @property
    def explained(self) -> float:
        """Share of the variance that it predicts, one minus the square of error over deviation."""
        return 1.0 - (self.error / self.deviation) ** 2 if self.deviation > 0.0 else float("nan")


def answer_surface(across: Array, up: Array, answer: Array, *, others_vary: bool) -> AnswerSurface | str:
    """Return an answer over two axes, or why there is none, as text.

    Where nothing else varies, it is linear between neighbouring points. Where further axes vary, points
    beside one another differ for other reasons, and a polynomial of the two axes is fitted, of the degree up
    to four that predicts left-out points best.

    ``across``, ``up``, ``answer``: numbers of the points, shape (n,), in SI; points with an answer that is
    not finite are left out.
    """
    good = np.isfinite(across) & np.isfinite(up) & np.isfinite(answer)
    places = np.column_stack([across, up])[good].astype(float)
    values = np.asarray(answer, dtype=float)[good]
    if len(values) < 6:
        return f"{len(values)} points with a finite answer are too few for a surface; six are the least"
    low, width = places.min(axis=0), np.ptp(places, axis=0)
    if not np.all(width > 0.0):
        return "one of the two axes does not vary"
    unit = (places - low) / width
    try:
        hull = Delaunay(unit)
    except QhullError:
        return "the points lie on one line, so there is no surface between them"
    if others_vary:
        return _polynomial(unit, values, hull, low, width)
    error, unpredicted = _left_out(unit, values)
    deviation = float(np.std(values))
    nodes = _grid(places)
    if nodes is not None:
        x, y = nodes
        field = np.full((len(y), len(x)), np.nan)
        field[np.searchsorted(y, places[:, 1]), np.searchsorted(x, places[:, 0])] = values
        return AnswerSurface(
            x, y, field, "linear between the points of a grid", error, deviation, unpredicted
        )
    x = y = np.linspace(0.0, 1.0, _CELLS)
    field = _linear(hull, values, _mesh(x, y)).reshape(_CELLS, _CELLS)
    method = "linear between neighbouring points (Delaunay), within their convex hull"
    return AnswerSurface(
        low[0] + x * width[0], low[1] + y * width[1], field, method, error, deviation, unpredicted
    )


def _mesh(x: Array, y: Array) -> Array:
    return np.column_stack([each.ravel() for each in np.meshgrid(x, y)])


def _grid(places: Array) -> tuple[Array, Array] | None:
    """Return the nodes of a grid, none where the points are not on one or most of it is empty."""
    x, y = np.unique(places[:, 0]), np.unique(places[:, 1])
    cells = len(x) * len(y)
    distinct = len(np.unique(places, axis=0)) == len(places)
    return (x, y) if min(len(x), len(y)) > 1 and distinct and 2 * len(places) >= cells else None


def _linear(hull: Delaunay, values: Array, places: Array) -> Array:
    """Return the linear interpolation; not a number outside the hull."""
    simplex = hull.find_simplex(places, tol=1e-9)
    transform = hull.transform[simplex]
    share = np.einsum("nij,nj->ni", transform[:, :2], places - transform[:, 2])
    weights = np.column_stack([share, 1.0 - share.sum(axis=1)])
    result = np.einsum("ni,ni->n", weights, values[hull.simplices[simplex]])
    return np.asarray(np.where(simplex < 0, np.nan, result))


def _left_out(places: Array, values: Array) -> tuple[float, int]:
    """Return the error on points that were left out by turns, and how many of them were outside the hull."""
    fold = np.random.default_rng(0).permutation(len(values)) % min(_FOLDS, len(values))
    wrong = np.full(len(values), np.nan)
    for number in range(fold.max() + 1):
        rest = fold != number
        try:
            hull = Delaunay(places[rest])
        except QhullError:
            continue
        wrong[~rest] = _linear(hull, values[rest], places[~rest]) - values[~rest]
    seen = np.isfinite(wrong)
    error = float(np.sqrt(np.mean(wrong[seen] ** 2))) if np.any(seen) else float("nan")
    return error, int(np.sum(~seen))


def _polynomial(unit: Array, values: Array, hull: Delaunay, low: Array, width: Array) -> AnswerSurface:
    best: tuple[float, int, Array] | None = None
    for degree in range(_HIGHEST_DEGREE + 1):
        terms = _terms(unit, degree)
        if 2 * terms.shape[1] > len(values):
            break
        # Leaving one out costs nothing: its error is the residual over one minus its own weight.
        basis, factor = np.linalg.qr(terms)
        if np.linalg.cond(factor) > 1e10:
            break
        residual = values - basis @ (basis.T @ values)
        left_out = residual / np.maximum(1e-12, 1.0 - np.sum(basis**2, axis=1))
        error = float(np.sqrt(np.mean(left_out**2)))
        if best is None or error < best[0]:
            best = error, degree, np.asarray(np.linalg.solve(factor, basis.T @ values), dtype=np.float64)
    error, degree, weights = best or (float("nan"), 0, np.array([values.mean()]))
    x = y = np.linspace(0.0, 1.0, _CELLS)
    mesh = _mesh(x, y)
    field = np.where(hull.find_simplex(mesh, tol=1e-9) < 0, np.nan, _terms(mesh, degree) @ weights)
    return AnswerSurface(
        low[0] + x * width[0], low[1] + y * width[1], field.reshape(_CELLS, _CELLS),
        f"polynomial of degree {degree}, while the other axes vary", error, float(np.std(values)), 0,
    )  # fmt: skip


def _terms(unit: Array, degree: int) -> Array:
    """Return products of the two columns, centred, up to a degree."""
    centred = 2.0 * unit - 1.0
    columns = [np.ones(len(unit))]
    for total in range(1, degree + 1):
        columns += [
            np.prod(centred[:, list(c)], axis=1) for c in combinations_with_replacement((0, 1), total)
        ]
    return np.column_stack(columns)


LEAST_CORRELATION: Final = 0.1
_DEVIATIONS: Final = 4.0


def codes(values: NDArray[Any]) -> Array:
    """Return numbers as they are, and words as the numbers of their place in the alphabet."""
    column = np.asarray(values)
    if column.dtype.kind in "fiub":
        return column.astype(float)
    return np.unique(column.astype(str), return_inverse=True)[1].ravel().astype(float)


def dependent_axes(axes: Mapping[str, NDArray[Any]]) -> str:
    """Return which two axes depend most on each other, as text; empty where none do.

    The ranks of the values are compared, and their distances from the middle rank, which shows two axes that
    lie on a circle or a wedge. What does not show in either is not seen.

    ``axes``: values of each axis, shape (n,); words too.
    """
    ranks = {name: rankdata(codes(values)) for name, values in axes.items()}
    worst, words = 0.0, ""
    for one, other in combinations(ranks, 2):
        wide = [np.abs(each - np.median(each)) for each in (ranks[one], ranks[other])]
        for first, second in product(*zip((ranks[one], ranks[other]), wide, strict=True)):
            constant = np.ptp(first) == 0.0 or np.ptp(second) == 0.0
            size = 0.0 if constant else float(abs(np.corrcoef(first, second)[0, 1]))
            limit = max(LEAST_CORRELATION, _DEVIATIONS / np.sqrt(len(first)))
            if size > max(limit, worst):
                worst, words = (
                    size,
                    f"axes {one} and {other} depend on each other (rank correlation {size:.2f})",
                )
    return words
