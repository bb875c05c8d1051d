"""Faulty samples of one channel: spikes, dropouts, stuck values, and jumps of a position.

A group of samples is faulty where it begins and ends abruptly, while the samples on both sides of
it lie on one cubic from which the group is off by many times their scatter (after Hampel 1974: a robust
scale, taken from the neighbours). So a step, a jump of stick–slip, the start of a motion or coarse counts are
not faults: there the two sides do not continue each other, or scatter as much as the group. A change that
another channel shows at the same time is no fault of a sensor either. All scales come from the channel
itself.
"""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from functools import cached_property
from typing import NamedTuple

import numpy as np
import scipy

from ....foundation.arrays import Array, Indices, Mask
from ..residuals import noise_of, quantum_of

LONGEST = 20
"""Samples that are at most interpolated: of the order of the filter through which a rate is measured."""
_SIDE = 12
"""Samples on either side of a group that must continue each other."""
_LEAST_SIDE = 6
_NEXT, _SHORT = 2, 3
"""Samples beside a group that must be good, and the length that a cubic bridges; beyond it, a parabola."""
_ABRUPT, _OFF = 5.0, 8.0
"""A change between two samples is abrupt, and a group is faulty, beyond so many times the scatter. White
noise reaches 4.9 once in a million samples."""
_SLOPE_SPAN, _SCATTER_SPAN = 11, 51
"""Samples over which the usual change between samples, and the scatter of the changes, are taken."""
_TO_DEVIATION = 1.4826
_TAIL = 1.96 * _TO_DEVIATION
"""Of normal noise, the size that 5 % exceed, over the median size."""
_SHARE_OF_RANGE = 1e-4
"""Scatter is taken to be at least this share of the range: smaller faults do not matter."""
_MEDIAN_SPAN, _LONG_TAIL, _HALF_WAY = 5, 2, 2e-5
"""Faults are extremes of the channel itself where so many times more samples are half as far from the median
of their neighbours. White noise has this share of samples at half of the least fault."""
_BUSY = 0.05
"""Where a larger share of all changes is abrupt, this is how the channel moves."""
_COMMAND = 3
"""A command that leaves and returns for longer is a pulse."""
_CHANCE = 1e-4
"""Largest expected number of runs of equal values, as long, that chance would leave in the record."""
_FREE_SIGNS = 0.6
"""Share of fourth differences that turn the sign, from which on a channel is noise about a slower course:
0.80 for white noise, 0 for a smooth motion."""
_RETURN = 3
"""Samples within which a position that returns has not jumped."""
_JUMP, _JUMP_OVER_ALL = 10.0, 3.0
"""A position jumps where it changes by more than these times the largest change nearby, and anywhere else."""
_CONFIRMS = 4.0
_ORDERS = (2, 3)
"""Orders of the polynomials by which another channel is asked."""
_NEARBY, _BETTER = (4, 8), 0.95
"""Samples off a group at which a turn of its own is looked for; it leaves less than this share."""
_REACH = 12
"""Samples on either side over which another channel is asked whether something happened."""


class Group(NamedTuple):
    """Faulty samples."""

    # first, behind: indices of the first sample, and of the first one that is good again
    first: int
    behind: int
    # kind: "spike", "dropout" (several samples off), "stuck" (a value is repeated) or "jump", behind which
    # all samples are off
    kind: str
    size: float  # largest distance from the samples around, in the unit of the channel


@dataclass(frozen=True, eq=False)
class Witness:
    """Another channel on the same clock: what it shows at the same time is no fault of a sensor."""

    values: Array  # shape (n,)

    @cached_property
    def least(self) -> float:
        """Scatter that its samples have at least."""
        return max(noise_of(self.values), quantum_of(self.values))

    def turns(self, first: int, behind: int, reach: int) -> bool:
        """Tell whether it changes its course where a group is.

        Then its samples around the group are better described by two parabolas, one before and one behind,
        than by one polynomial of as many coefficients over both; or by two cubics, where it is pushed for
        several samples and slows down behind them, as under a controller that is told to step.
        """
        left = np.arange(max(first - reach, 0), first)
        right = np.arange(behind, min(behind + reach, len(self.values)))
        if min(len(left), len(right)) < _LEAST_SIDE:
            return False
        return any(self._turns_as(order, left, right) for order in _ORDERS)

    def _turns_as(self, order: int, left: Indices, right: Indices) -> bool:
        """Tell whether two polynomials of an order are better than one, and none that turns nearby is."""
        whole = np.concatenate([left, right])
        joint = _sum_of_squares(self.values, whole, 2 * order + 1)
        apart = _sum_of_squares(self.values, left, order) + _sum_of_squares(self.values, right, order)
        least = max(apart, len(whole) * self.least**2)
        if joint <= _CONFIRMS * least:
            return False
        first, behind = int(left[-1]) + 1, int(right[0])
        places = (*(first - shift for shift in _NEARBY), *(behind + shift for shift in _NEARBY))
        sides = [(np.arange(left[0], split), np.arange(split, right[-1] + 1)) for split in places]
        sums = [
            sum(_sum_of_squares(self.values, side, order) for side in pair)
            for pair in sides
            if min(map(len, pair)) > order
        ]
        return min(sums, default=np.inf) >= _BETTER * least


@dataclass(frozen=True, eq=False)
class Surroundings:
    """What decides, beside the channel itself, whether samples are faulty."""

    others: Sequence[Witness] = ()  # other channels on the same clock
    commanded: bool = False  # whether the channel is an input of the model: a command may rest, and jump
    motion: bool = False  # whether the channel is a position or an angle: a body is never in two places


def faulty_groups(values: Array, around: Surroundings) -> list[Group]:
    """Return the groups of samples that are faulty, in order."""
    if len(values) < 2 * _SIDE or np.ptp(values) == 0.0:
        return []
    scatter = _Scatter(values)
    groups: list[Group] = []
    if len(scatter.edges) <= _BUSY * len(values):
        longest = _COMMAND if around.commanded else LONGEST
        excursions: list[Group] = []
        behind = 0
        for place, edge in enumerate(scatter.edges):
            first = int(edge) + 1
            if first < behind:
                continue
            for other in scatter.edges[place + 1 :]:
                if other - edge > longest:
                    break
                size = scatter.group(first, int(other) + 1)
                if size and not _confirmed(first, int(other) + 1, around.others):
                    behind = int(other) + 1
                    excursions.append(
                        Group(first, behind, "spike" if behind == first + 1 else "dropout", size)
                    )
                    break
        excursions = _standing_clear(scatter, excursions)
        if not around.commanded:
            excursions += _held(scatter, excursions, around)
        groups += excursions
    if not around.commanded:
        groups += [g for g in _stuck(values, around) if not _overlaps(g, groups)]
        if around.motion:
            groups += _jumps(scatter, groups, around)
    return sorted(groups)


def repaired(values: Array, groups: Sequence[Group]) -> tuple[Array, Mask]:
    """Return the channel with faulty samples interpolated, and which these are.

    A cubic through the good samples on both sides is put in; at an end of the record, and in a group longer
    than :data:`LONGEST`, a straight line between the nearest good samples. What is behind a jump is left as
    it is.
    """
    mask = np.zeros(len(values), dtype=bool)
    groups = [g for g in groups if g.kind != "jump"]
    for group in groups:
        mask[group.first : group.behind] = True
    good = np.flatnonzero(~mask)
    result = values.copy()
    for group in groups:
        place = int(np.searchsorted(good, group.first))
        sides = good[max(place - _SIDE, 0) : place + _SIDE]
        inside = np.arange(group.first, group.behind)
        if min(place, len(good) - place) < _LEAST_SIDE or len(inside) > LONGEST:
            result[inside] = np.interp(inside, sides, values[sides])
        else:
            result[inside] = _Course.through(values, sides, group.first)(inside)
    return result, mask


class _Course(NamedTuple):
    """A polynomial over sample numbers, and the scatter about it."""

    coefficients: Array
    origin: int
    scatter: float

    @staticmethod
    def through(values: Array, places: Indices, origin: int, order: int = 3) -> _Course:
        """Return the polynomial through samples by least squares."""
        powers = np.vander((places - origin) / _SIDE, order + 1)
        coefficients: Array = np.asarray(
            np.linalg.lstsq(powers, values[places], rcond=None)[0], dtype=np.float64
        )
        left = values[places] - powers @ coefficients
        freedom = max(len(places) - order - 1, 1)
        return _Course(coefficients, origin, float(np.sqrt(left @ left / freedom)))

    def __call__(self, places: Indices) -> Array:
        at = (places - self.origin) / _SIDE
        result: Array = np.asarray(np.polyval(self.coefficients, at), dtype=np.float64)
        return result


class _Scatter:
    """The changes of a channel from sample to sample, without its slope, and which of them are abrupt."""

    def __init__(self, values: Array) -> None:
        self.values = values
        self.changes = np.diff(values)
        self.jumps = self.changes - scipy.ndimage.median_filter(self.changes, _SLOPE_SPAN, mode="nearest")
        low, high = np.percentile(values, (5.0, 95.0))
        self.least = max(noise_of(values), quantum_of(values), _SHARE_OF_RANGE * float(high - low))
        size = np.abs(self.jumps)
        local = _TO_DEVIATION * scipy.ndimage.median_filter(size, _SCATTER_SPAN, mode="nearest")
        scale = np.maximum(local, self.least)
        # A channel whose changes have heavy tails by nature is judged by these.
        usual, rare = np.percentile(size, (50.0, 95.0))
        self.tail = max(1.0, float(rare) / max(_TAIL * float(usual), _TAIL * self.least / _TO_DEVIATION))
        self.edges = np.flatnonzero(size > _ABRUPT * self.tail * scale)

    def group(self, first: int, behind: int, *, both: bool = True) -> float:
        """Return how far a group is off if the samples around it continue each other; 0 if not."""
        values = self.values
        left = np.arange(max(first - _SIDE, 0), first)
        right = np.arange(behind, min(behind + _SIDE, len(values)))
        if min(len(left), len(right)) < _LEAST_SIDE:
            return 0.0
        inside = np.arange(first, behind)
        # Over a longer gap a cubic would join any two courses.
        order = 3 if len(inside) <= _SHORT else 2
        near = np.concatenate([left[-_NEXT:], right[:_NEXT]])
        far = _Course.through(values, np.concatenate([left[:-_NEXT], right[_NEXT:]]), first, order)
        if np.max(np.abs(values[near] - far(near))) > _ABRUPT * self.tail * max(far.scatter, self.least):
            return 0.0  # it comes and goes gradually
        course = _Course.through(values, np.concatenate([left, right]), first, order)
        scale = self.tail * max(course.scatter, self.least)
        off = np.abs(values[inside] - course(inside))
        largest = float(off.max())
        ends = min(off[0], off[-1]) if both else max(off[0], off[-1])
        return largest if largest > _OFF * scale and ends >= 0.5 * largest else 0.0


def _standing_clear(scatter: _Scatter, groups: list[Group]) -> list[Group]:
    """Leave out groups that are only the far end of a distribution with long tails.

    Where faults are the extremes of what the channel does anyway, more samples are off by a half of the
    smallest of them than by all of it.
    """
    if not groups:
        return groups
    off = np.abs(scatter.values - scipy.ndimage.median_filter(scatter.values, _MEDIAN_SPAN, mode="nearest"))
    expected = _HALF_WAY * len(off)
    for place, group in enumerate(sorted(groups, key=lambda g: g.size)):
        below = int(np.sum((off > 0.5 * group.size) & (off < group.size)))
        left = len(groups) - place
        if below - expected <= _LONG_TAIL * left:
            return [g for g in groups if g.size >= group.size]
    return []


def _held(scatter: _Scatter, groups: Sequence[Group], around: Surroundings) -> Iterator[Group]:
    """Yield groups in which a moving channel holds one value and then catches up."""
    values = scatter.values
    for edge in scatter.edges:
        last = int(edge)
        first = last
        while first > 0 and last - first < LONGEST and values[first - 1] == values[last]:
            first -= 1
        group = Group(first + 1, last + 1, "stuck", 0.0)
        if 2 <= group.behind - group.first < LONGEST and not _overlaps(group, groups):
            size = scatter.group(group.first, group.behind, both=False)
            if size and not _confirmed(group.first, group.behind, around.others):
                yield group._replace(size=size)


def _stuck(values: Array, around: Surroundings) -> Iterator[Group]:
    """Yield runs of equal values in a channel that is noise all around, while other channels go on."""
    # The usual smallest change: the count, if there is one, also behind a jump by a part of it.
    changes = np.abs(np.diff(values))
    changes = changes[changes > 0.0]
    count = float(np.percentile(changes, 5.0)) if len(changes) else 0.0
    if noise_of(values) < 2.0 * count:
        return
    extremes = float(values.min()), float(values.max())
    abrupt = _JUMP * max(noise_of(values), float(np.median(np.abs(np.diff(values)))))
    equal = np.diff(values) == 0.0
    bounds = np.flatnonzero(np.diff(np.concatenate([[False], equal, [False]])))
    starts, ends = bounds[::2], bounds[1::2] + 1
    long = ends - starts >= 4
    usual = (np.sum(equal) - np.sum((ends - starts - 1)[long])) / len(equal)
    for first, behind in zip(starts[long].tolist(), ends[long].tolist(), strict=True):
        at_an_end = first == 0 or behind == len(values)
        pairs = () if at_an_end else ((first - 1, first), (behind - 1, behind))
        edges = [float(abs(values[b] - values[a])) for a, b in pairs] or [0.0]
        if values[first] in extremes and min(edges) < abrupt:
            continue  # it may be clipped, or slack
        if around.motion and edges[-1] < abrupt:
            continue  # a body that moves on from where it rested has no way to catch up
        length = behind - first
        span = max(_SCATTER_SPAN, 2 * length)
        near = np.concatenate([equal[max(first - span, 0) : first], equal[behind : behind + span]])
        chance = max(float(usual), float(np.mean(near)) if len(near) else 1.0)
        if chance ** (length - 1) * len(values) > _CHANCE:
            continue
        sides = values[max(first - span, 0) : first + 1], values[behind - 1 : behind + span]
        goes_on = not around.others or any(np.ptp(each.values[first:behind]) > 0.0 for each in around.others)
        if goes_on and all(_is_noise(side) for side in sides):
            yield Group(first, behind, "stuck", max(edges))


def _is_noise(side: Array) -> bool:
    signs = np.sign(np.diff(side, 4))
    return len(signs) > _LEAST_SIDE and bool(np.mean(signs[1:] * signs[:-1] < 0.0) > _FREE_SIGNS)


def _jumps(scatter: _Scatter, groups: Sequence[Group], around: Surroundings) -> Iterator[Group]:
    """Yield the samples at which a position jumps to another course of the same speed."""
    size = np.abs(scatter.changes)
    rest = size.copy()
    rest[scatter.edges] = 0.0
    for edge in scatter.edges.tolist():
        near = rest[max(edge - _SIDE, 0) : edge + _SIDE + 1]
        least = max(_JUMP * max(float(near.max()), scatter.least), _JUMP_OVER_ALL * float(rest.max()))
        group = Group(edge + 1, edge + 1, "jump", float(scatter.changes[edge]))
        known = any(g.first - 1 <= edge <= g.behind for g in groups)
        # A sample that is off jumps there and back; after a reset the position stays where it jumped to.
        beside = scatter.changes[max(edge - _RETURN, 0) : edge + _RETURN + 1]
        stays = abs(float(np.sum(beside))) > 0.5 * size[edge]
        if size[edge] > least and stays and not known and not _confirmed(edge + 1, edge + 1, around.others):
            yield group


def _overlaps(group: Group, groups: Sequence[Group]) -> bool:
    return any(group.first < each.behind and each.first < group.behind for each in groups)


def _confirmed(first: int, behind: int, others: Sequence[Witness]) -> bool:
    """Tell whether another channel changes its course where a group is."""
    return any(each.turns(first, behind, _REACH) for each in others)


def _sum_of_squares(values: Array, places: Indices, order: int) -> float:
    at = (places - places[0]) / max(places[-1] - places[0], 1)
    powers = np.vander(at, order + 1)
    left = values[places] - powers @ np.linalg.lstsq(powers, values[places], rcond=None)[0]
    return float(left @ left)
