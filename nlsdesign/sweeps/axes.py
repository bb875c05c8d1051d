"""Axes of a sweep: a grid, a Sobol or Latin hypercube sample, a list, draws over the spread of the deck.

Every set of axes gives its rows one at a time, so that a sweep needs no memory for the points that wait.

Saltelli's plan: the points that Sobol indices with totals need, and how to see that points are one.
"""

from __future__ import annotations

import functools
import itertools
from abc import ABC, abstractmethod
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from typing import Any, Final, Literal, NamedTuple

import numpy as np

from ..foundation.arrays import Array
from ..foundation.errors import ValueRangeError, brief, missing_library, unknown_name
from ..model import flatten
from ..simulation.prior import LONGEST_ROW, declared_prior
from .axis_values import Given, Subject
from .sweep_columns import SALTELLI, SweepColumn

_BLOCK: Final = 1024
_MOST_SOBOL: Final = 2**30
MOST_HELD: Final = 10_000_000
"""Rows of a set of axes that stands in memory."""


@dataclass(frozen=True, eq=False)
class BoundAxes:
    """A set of axes with its values."""

    columns: tuple[SweepColumn, ...]
    count: int
    row: Callable[[int], tuple[Any, ...]]


class AxisSet(ABC):
    """Axes that are varied together; a sweep crosses all its sets."""

    @abstractmethod
    def bound(self, subject: Subject) -> BoundAxes:
        """Return the axes with their values.

        Parameters
        ----------
        subject
            What they change.

        Raises
        ------
        NlsError
            If a name does not exist, or a value does not fit it.
        """


def _count(name: str, count: int, least: int = 1, most: int = MOST_HELD) -> None:
    if isinstance(count, bool) or not isinstance(count, int) or count < least:
        raise ValueRangeError(f"{name}: count = {brief(count)}", f"must be a whole number from {least} on",
                              next_step="take for instance 64")  # fmt: skip
    if count > most:
        raise ValueRangeError(f"{name}: count = {count}", f"must be at most {most}",
                              next_step="split the sweep: a folder for each stretch of an axis")  # fmt: skip


def require_seed(name: str, seed: int) -> None:
    """Refuse what is no seed."""
    if isinstance(seed, bool) or not isinstance(seed, int) or seed < 0:
        raise ValueRangeError(f"{name}: seed = {brief(seed)}", "must be a whole number from 0 on",
                              next_step="take for instance 1")  # fmt: skip


@dataclass(frozen=True)
class GridAxis(AxisSet):
    """One axis with even steps, or with steps of an even ratio.

    Parameters
    ----------
    name
        Full name of the number.
    lower, upper
        Ends, both belong to it; with unit, or in SI.
    count
        Number of values, 2 or more.
    spacing
        ``"even"`` or ``"ratio"``.
    """

    name: str
    lower: Given
    upper: Given
    count: int
    spacing: Literal["even", "ratio"] = "even"

    def bound(self, subject: Subject) -> BoundAxes:
        """Return the axis; see :meth:`AxisSet.bound`.

        Raises
        ------
        UnknownNameError
            If the name or the spacing does not exist.
        ValueRangeError
            If the count, an end or the spacing does not fit.
        """
        _count(f"grid over {self.name}", self.count, 2)
        column, ends = subject.column(self.name, (self.lower, self.upper), "grid")
        lower, upper = _ends(column, ends)
        if subject.is_whole(self.name) and (self.spacing == "ratio" or (upper - lower) % (self.count - 1)):
            raise ValueRangeError(
                f"axis '{self.name}'", f"takes whole numbers only, not {self.count} steps like these",
                next_step=f"take count = {upper - lower + 1:.0f}, or list them: Listed",
            )  # fmt: skip
        if self.spacing not in ("even", "ratio"):
            raise unknown_name(f"grid over {self.name}: spacing", self.spacing, ("even", "ratio"))
        if self.spacing == "ratio" and lower <= 0.0:
            raise ValueRangeError(
                f"grid over {self.name}", "begins at or below zero, so its steps have no ratio",
                next_step='take spacing = "even"',
            )  # fmt: skip
        space = np.geomspace if self.spacing == "ratio" else np.linspace
        values: Array = space(lower, upper, self.count)
        if not np.all(np.diff(values) > 0.0):
            _distinct(self.name, values.tolist())
        return BoundAxes((column,), self.count, lambda number: (float(values[number]),))


@dataclass(frozen=True)
class Listed(AxisSet):
    """Rows that are written down: one axis with its values, or several whose values belong together.

    Parameters
    ----------
    values
        Numbers or words by name; all rows are equally long.
    """

    values: Mapping[str, Sequence[Given]]

    def bound(self, subject: Subject) -> BoundAxes:
        """Return the axes; see :meth:`AxisSet.bound`.

        Raises
        ------
        ValueRangeError
            If there are no rows, or names have rows of different length.
        """
        names = ", ".join(self.values)
        if not self.values or any(isinstance(each, str) for each in self.values.values()):
            raise ValueRangeError(
                "list of an axis", "has no rows", next_step='write {"NAME" = ["1 mm", "2 mm"]}'
            )
        if len({len(each) for each in self.values.values()}) != 1:
            raise ValueRangeError(
                f"list over {names}", "has rows of different length",
                next_step="give each name as many values; use two lists to cross them",
            )  # fmt: skip
        _count(f"list over {names}", len(next(iter(self.values.values()))))
        pairs = [subject.column(name, tuple(given), "list") for name, given in self.values.items()]
        rows = list(zip(*(values for _, values in pairs), strict=True))
        _distinct(names, rows)
        return BoundAxes(tuple(column for column, _ in pairs), len(rows), rows.__getitem__)


@dataclass(frozen=True)
class SobolSample(AxisSet):
    """A scrambled Sobol sequence over ranges; counts that are powers of two are balanced.

    Parameters
    ----------
    ranges
        Lower and upper end by name.
    count
        Number of points.
    seed
        Of the scrambling.
    """

    ranges: Mapping[str, tuple[Given, Given]]
    count: int
    seed: int = 0

    def bound(self, subject: Subject) -> BoundAxes:
        """Return the axes; see :meth:`AxisSet.bound`."""
        _count("Sobol sample", self.count, 1, _MOST_SOBOL)
        require_seed("Sobol sample", self.seed)
        columns, lower, upper = _box(subject, self.ranges, "sobol")

        @functools.lru_cache(maxsize=2)
        def block(number: int) -> Array:
            from scipy.stats import qmc

            sampler = qmc.Sobol(len(columns), scramble=True, seed=np.random.default_rng(self.seed))
            if number:
                sampler.fast_forward(number * _BLOCK)
            unit: Array = sampler.random(_BLOCK)
            return unit

        def row(number: int) -> tuple[float, ...]:
            unit = block(number // _BLOCK)[number % _BLOCK]
            return tuple((lower + (upper - lower) * unit).tolist())

        return BoundAxes(columns, self.count, row)


@dataclass(frozen=True)
class LatinHypercube(AxisSet):
    """A Latin hypercube over ranges: each axis has one point in each of its ``count`` stretches.

    Parameters
    ----------
    ranges
        Lower and upper end by name.
    count
        Number of points; all are held in memory, 8 bytes for each axis.
    seed
        The same seed gives the same points.
    """

    ranges: Mapping[str, tuple[Given, Given]]
    count: int
    seed: int = 0

    def bound(self, subject: Subject) -> BoundAxes:
        """Return the axes; see :meth:`AxisSet.bound`."""
        from scipy.stats import qmc

        _count("Latin hypercube", self.count)
        require_seed("Latin hypercube", self.seed)
        columns, lower, upper = _box(subject, self.ranges, "latin_hypercube")
        sampler = qmc.LatinHypercube(len(columns), seed=np.random.default_rng(self.seed))
        points = lower + (upper - lower) * sampler.random(self.count)
        return BoundAxes(columns, self.count, lambda number: tuple(points[number].tolist()))


@dataclass(frozen=True)
class RandomDraws(AxisSet):
    """Machines drawn over the spread of the deck, as errors and loops over the spread draw them.

    Every number is its declared value times exp(x), x normal with ln(1 + spread) as standard deviation. A row
    of more than twelve numbers is the table of a shape and has one factor.

    Parameters
    ----------
    count
        Number of machines.
    seed
        The same seed gives the same machines; the first of many draws are those of a short one.
    names
        Only these numbers; by default all that have a spread and that the question does not choose itself.
    """

    count: int
    seed: int = 0
    names: tuple[str, ...] = ()

    def bound(self, subject: Subject) -> BoundAxes:
        """Return the axes; see :meth:`AxisSet.bound`.

        Raises
        ------
        ValueRangeError
            If no number of the deck has a spread.
        UnknownNameError
            If a named number has none.
        """
        _count("random draws", self.count, 1, _MOST_SOBOL)
        require_seed("random draws", self.seed)
        given: object = self.names
        if isinstance(given, str):
            raise ValueRangeError(f"random draws: names = '{given}'", "is one text, not a list",
                                  next_step=f"write names = ['{given}']")  # fmt: skip
        prior = declared_prior(flatten(subject.base))
        by_head = itertools.groupby(prior.names, key=lambda name: name.partition("[")[0])
        groups = {head: list(inner) for head, inner in by_head}
        places: dict[str, tuple[int, bool]] = {}
        for head, inner in groups.items():
            shape = len(inner) > LONGEST_ROW
            for name in [f"factor({head})"] if shape else inner:
                places[name] = (prior.place(inner[0] if shape else name), shape)
        kept = {name: place for name, place in places.items() if not subject.is_chosen(name)}
        for name in self.names:
            if name not in places:
                raise unknown_name("number with a spread", name, places)
        chosen = {name: places[name] for name in self.names} if self.names else kept
        if not chosen:
            raise ValueRangeError("random draws", "no number of the deck has a spread",
                                  next_step="give numbers a spread")  # fmt: skip
        at = [place for place, _ in chosen.values()]
        shapes = np.array([shape for _, shape in chosen.values()])
        values = np.where(shapes, 1.0, prior.values[at])
        low = _ends_of(prior.minimum, at, shapes, -np.inf)
        high = _ends_of(prior.maximum, at, shapes, np.inf)
        deviations, kinds = prior.deviations[at], [prior.kinds[k] for k in at]

        def moved(x: Array) -> Array:
            return np.array([k.number(v, e) for k, v, e in zip(kinds, values.tolist(), x, strict=True)])

        def row(number: int) -> tuple[float, ...]:
            normal = np.random.default_rng([self.seed, number]).standard_normal(len(at))
            return tuple(np.clip(moved(deviations * normal), low, high).tolist())

        columns = []
        edges = np.sort([moved(-3.0 * deviations), moved(3.0 * deviations)], axis=0).T
        for name, value, ends in zip(chosen, values, edges.tolist(), strict=True):
            column, _ = subject.column(name, (float(value),), "random")
            words = "drawn over its spread; range of three deviations"
            columns.append(SweepColumn(column.name, column.unit, words, "axis", "random", *ends))
        return BoundAxes(tuple(columns), self.count, row)


def _ends_of(ends: Array, at: list[int], shapes: Any, without: float) -> Array:
    return np.where(shapes, without, ends[at]) if len(ends) else np.full(len(at), without)


def _ends(column: SweepColumn, ends: tuple[Any, ...]) -> tuple[float, float]:
    if column.lower is None:
        raise ValueRangeError(f"axis '{column.name}'", "takes words, which have no range",
                              next_step="list them: Listed")  # fmt: skip
    lower, upper = ends
    if not lower < upper:
        raise ValueRangeError(f"axis '{column.name}'", f"goes from {lower:g} to {upper:g} in SI",
                              next_step="give the smaller end first, and two different ones")  # fmt: skip
    return float(lower), float(upper)


def _box(
    subject: Subject, ranges: Mapping[str, tuple[Given, Given]], kind: str
) -> tuple[tuple[SweepColumn, ...], Array, Array]:
    if not ranges:
        raise ValueRangeError(
            "sample", "has no ranges", next_step='write ranges = {"NAME" = ["1 mm", "2 mm"]}'
        )
    columns, ends = [], []
    for name, given in ranges.items():
        if isinstance(given, str) or len(given) != 2:
            raise ValueRangeError(f"range of {name}", "has no two ends", next_step='write ["1 mm", "2 mm"]')
        column, values = subject.column(name, tuple(given), kind)
        # The points of a sample lie between whole numbers.
        if subject.is_whole(name):
            raise ValueRangeError(
                f"range of {name}", "takes whole numbers only, a sample has others",
                next_step="list them (Listed), or take a GridAxis in steps of one",
            )  # fmt: skip
        ends.append(_ends(column, values))
        columns.append(column)
    low, high = np.array(ends).T
    return tuple(columns), low, high


def _distinct(name: str, rows: Sequence[Any]) -> None:
    seen: dict[Any, int] = {}
    for number, row in enumerate(rows):
        if row in seen:
            raise ValueRangeError(
                f"axis '{name}'", f"has the same point twice: rows {seen[row] + 1} and {number + 1}",
                next_step="leave one out",
            )  # fmt: skip
        seen[row] = number


class SaltelliForm(NamedTuple):
    """The form of a Saltelli plan."""

    blocks: int  # whole blocks
    # rows: points of a block: one of the first sample, one per axis with that axis from the second sample,
    # with second order also the reverse, and one of the second sample
    rows: int
    second_order: bool  # whether blocks hold the reverse exchanges


def saltelli_plan(points: Array) -> SaltelliForm | None:
    """Return the form of the plan, none where the points are not one; a last block that is cut is left out.

    ``points``: shape (n, d), in their order.
    """
    count, axes = points.shape
    for second_order in (False, True):
        rows = (2 * axes + 2) if second_order else (axes + 2)
        blocks = count // rows
        # Two of four axes and one of ten may have blocks of the same length: the exchanges decide.
        if blocks >= 2 and _exchanged(points[: blocks * rows].reshape(blocks, rows, axes), second_order):
            return SaltelliForm(blocks, rows, second_order)
    return None


def _exchanged(blocks: Array, second_order: bool) -> bool:
    axes = blocks.shape[2]
    first, second = blocks[:, 0], blocks[:, -1]
    if np.all(first == second):
        return False
    for axis in range(axes):
        expected = first.copy()
        expected[:, axis] = second[:, axis]
        if not np.array_equal(blocks[:, 1 + axis], expected):
            return False
        reverse = second.copy()
        reverse[:, axis] = first[:, axis]
        if second_order and not np.array_equal(blocks[:, 1 + axes + axis], reverse):
            return False
    return True


_MOST_BLOCKS = 2**24


@dataclass(frozen=True)
class SaltelliSample(AxisSet):
    """Blocks of points of Saltelli's plan, from a scrambled Sobol sequence of twice as many dimensions.

    A block has two points more than there are axes; with second order two more than twice the axes. The page
    of the sweep sees the plan in the points, so it must be the only set of axes with more than one row.

    Parameters
    ----------
    ranges
        Lower and upper end by name.
    count
        Number of blocks, a power of two.
    second_order
        Whether blocks also hold the reverse exchanges, which shares of pairs of axes need.
    seed
        Of the scrambling, 0 or larger.
    """

    ranges: Mapping[str, tuple[Given, Given]]
    count: int
    second_order: bool = False
    seed: int = 0

    def bound(self, subject: Subject) -> BoundAxes:
        """Return the axes; see :meth:`AxisSet.bound`.

        Raises
        ------
        ValueRangeError
            If the number of blocks is no power of two, or a range is empty.
        MissingLibraryError
            If SALib is not installed.
        NlsError
            If a name does not exist, or a value does not fit it.
        """
        whole = isinstance(self.count, int) and not isinstance(self.count, bool)
        if not whole or not 2 <= self.count <= _MOST_BLOCKS or self.count & (self.count - 1):
            raise ValueRangeError(
                f"Saltelli sample: count = {self.count}", "must be a power of two, from 2 on",
                next_step="take for instance 256; the number of points is that times the axes plus two",
            )  # fmt: skip
        require_seed("Saltelli sample", self.seed)
        rows_each = (2 if self.second_order else 1) * len(self.ranges) + 2
        if self.count * rows_each > MOST_HELD:
            raise ValueRangeError(
                f"Saltelli sample: count = {self.count}", f"makes {self.count * rows_each} points, "
                f"at most {MOST_HELD} stand in memory", next_step="take fewer blocks",
            )  # fmt: skip
        try:
            from SALib.sample import sobol
        except ModuleNotFoundError:
            raise missing_library("a Saltelli sample", "SALib", "sensitivity") from None
        columns, low, high = _box(subject, self.ranges, SALTELLI)
        unit = {"num_vars": len(columns), "names": list(self.ranges), "bounds": [[0.0, 1.0]] * len(columns)}
        generator = np.random.default_rng(self.seed)
        points = sobol.sample(unit, self.count, calc_second_order=self.second_order, seed=generator)
        rows = low + (high - low) * points
        return BoundAxes(columns, len(rows), lambda number: tuple(rows[number].tolist()))
