"""Checks of measured tables before anything is fitted to them; each names file, column and rows.

Samples that a sensor or a recorder got wrong are masked: spikes, dropouts, stuck values, and jumps of a
position. A group of samples is faulty where it begins and ends abruptly, while the samples on both sides of
it lie on one cubic from which the group is off by many times their scatter (after Hampel 1974: a robust
scale, taken from the neighbours). So a step, a jump of stick–slip, the start of a motion or coarse counts are
not faults: there the two sides do not continue each other, or scatter as much as the group. A change that
another channel shows at the same time is no fault of a sensor either. All scales come from the channel
itself.

Channels that are constant or clipped are findings. Findings make records suspect; remarks only say what was
changed or what is unusual.
"""

from __future__ import annotations

from collections.abc import Iterable, Iterator, Mapping, Sequence
from dataclasses import dataclass
from functools import cached_property
from typing import NamedTuple

import numpy as np
import scipy

from ....foundation.arrays import Array, Indices, Mask
from ....foundation.errors import MeasurementError
from ..residuals import noise_of, quantum_of

GAP = 1.5
"""A step this much longer than the usual one is a gap."""
_BRIDGED = 20.0
"""Longest gap, in usual steps, for which a slower clock is proposed."""
_JITTER = 0.02
"""Steps that differ by more than this share are interpolated to a uniform grid."""
_LARGEST = 1e100
"""Nothing that is measured is larger in any unit."""
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
_MANY = 0.01
"""A channel with a larger share of faulty samples is suspect: each takes 41 samples of a filter of 4 with
it, so a third of the residuals would be lost."""
_SHOWN = 3
_CLIPPED_RUN = 5
"""Smallest number of equal extreme samples that may be clipping."""
_APPROACH, _MISSING_COUNTS = 3, 3.0
"""Samples before and after a run from which its slope is taken, and the missing peak height in counts."""
_MOVES, _DRIFT = 10.0, 3.0
"""A channel moves where its range is so many times its noise and its count; it goes on over a few samples
where means of a third of them differ by so many times their noise, and its count."""
_FASTEST, _LEAST_PERIOD = 98.0, 20.0
"""Percentile of the changes that counts as the fastest, and the samples a period below which a rate is lost:
a central difference over it is 2 % too small."""
_TURN = {"rad": 2.0 * np.pi, "deg": 360.0}


@dataclass(frozen=True)
class Finding:
    """What is odd about data that can be read."""

    place: str
    text: str

    def __str__(self) -> str:
        return f"{self.place}: {self.text}"


def check_columns(file: str, columns: Mapping[str, Array], *, first_row: int = 2) -> None:
    """Check that every number is finite, and of a size that can be measured."""
    for head, values in columns.items():
        bad = np.flatnonzero(~np.isfinite(values))
        if len(bad):
            raise MeasurementError(
                f"{file}: column '{head}', {rows_in_words(_first_run(bad), first_row)}",
                f"is not a finite number ({len(bad)} in all)",
                next_step="cut the record before or after these rows",
            )
        huge = np.flatnonzero(np.abs(values) > _LARGEST)
        if len(huge):
            raise MeasurementError(
                f"{file}: column '{head}', {rows_in_words(huge[:1], first_row)}",
                f"{values[huge[0]]:g} is larger than anything that is measured",
                next_step="correct the number",
            )


def check_time(file: str, head: str, time: Array, *, first_row: int = 2, bridged: float = 0.0) -> str:
    """Check that time ascends without gaps.

    ``bridged``: step in s of a slower clock to which the channel will be resampled; shorter gaps are
    accepted. Result: empty if the grid is uniform; otherwise the change that makes it uniform.
    """
    steps = np.diff(time)
    back = np.flatnonzero(steps <= 0.0)
    if len(back):
        what = "runs backwards" if np.any(steps < 0.0) else "stands still"
        raise MeasurementError(
            f"{file}: column '{head}', {rows_in_words(_first_run(back + 1), first_row)}",
            f"time {what} ({time[back[0]]:g} s is followed by {time[back[0] + 1]:g} s)",
            next_step="sort the record, or cut it where the clock was set back",
        )
    usual = float(np.median(steps))
    gaps = np.flatnonzero(steps > max(GAP * usual, (1.0 + _JITTER) * bridged))
    if len(gaps):
        raise MeasurementError(
            f"{file}: column '{head}', {rows_in_words(gaps[:1] + 1, first_row)}",
            f"there is a gap of {steps[gaps[0]]:g} s; samples lie {usual:g} s apart ({len(gaps)} in all)",
            next_step="split the record into one file before and one after the gap"
            + slower_clock(steps, usual),
        )
    uneven = float(np.max(np.abs(steps - usual))) / usual
    return (
        ""
        if uneven <= _JITTER
        else f" (interpolated to a uniform grid, steps varied by {100 * uneven:.1f} %)"
    )


def slower_clock(steps: Array, usual: float) -> str:
    """Return the proposal of a clock slow enough for the gaps; none where these are too long."""
    longest = float(np.max(steps))
    if longest > _BRIDGED * usual:
        return ""
    rate = float(f"{1.0 / longest:.2g}")
    rate = rate if rate * longest <= 1.0 else float(f"{0.95 / longest:.2g}")
    return f", or put it on a slower clock: resample_Hz = {rate:g} in records.toml"


def _first_run(indices: Indices) -> Indices:
    ends = np.flatnonzero(np.diff(indices) > 1)
    return indices[: int(ends[0]) + 1] if len(ends) else indices


def rows_in_words(indices: Indices, first_row: int) -> str:
    """Return the rows of a run of samples, for messages."""
    first, last = int(indices[0]) + first_row, int(indices[-1]) + first_row
    return f"row {first}" if first == last else f"rows {first} to {last}"


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


@dataclass(frozen=True, eq=False)
class Sampled:
    """A column as it stands in the file."""

    head: str
    unit: str
    values: Array  # finite, shape (n,)
    commanded: bool = False  # whether it is an input of the model: a command may rest, jump, and be limited
    # shows_input: whether it is an input, or the reading of one: a limit may be that of the drive
    shows_input: bool = False
    motion: bool = False  # whether it is a position or an angle


@dataclass(frozen=True, eq=False)
class Checked:
    """Columns after the checks."""

    # values, masked: by head, shape (n,): repaired values, and which samples these are; only of columns that
    # were changed
    values: Mapping[str, Array]
    masked: Mapping[str, Mask]
    # findings, remarks: what makes the file suspect, and what was changed or is unusual
    findings: tuple[Finding, ...]
    remarks: tuple[Finding, ...]


def check_channels(file: str, time: Array, columns: Sequence[Sampled], *, first_row: int = 2) -> Checked:
    """Check the columns of one clock."""
    witnesses = {c.head: Witness(c.values) for c in columns}
    values: dict[str, Array] = {}
    masked: dict[str, Mask] = {}
    findings: list[Finding] = []
    remarks: list[Finding] = []
    for column in columns:
        others = [w for head, w in witnesses.items() if head != column.head]
        around = Surroundings(others, column.commanded, column.motion)
        groups = faulty_groups(column.values, around)
        if groups:
            short = [g for g in groups if g.behind - g.first <= LONGEST and g.kind != "jump"]
            values[column.head], masked[column.head] = repaired(column.values, short)
            words = _Words(file, column, time, first_row)
            remarks += words.masked(short)
            findings += words.suspect(groups, short)
        place = f"{file}: column '{column.head}'"
        now = values.get(column.head, column.values)
        if np.ptp(now) == 0.0:
            rows = rows_in_words(np.arange(len(now)), first_row)
            moving = (
                np.ptp(each.values) > _MOVES * max(noise_of(each.values), quantum_of(each.values))
                for each in others
            )
            rests = column.shows_input or (bool(others) and not any(moving))
            (remarks if rests else findings).append(Finding(f"{place}, {rows}", f"is constant at {now[0]:g}"))
        remarks += _too_coarse(place, column, now, time)
        for finding, suspect in _clipped(place, column, now, others, first_row):
            (findings if suspect else remarks).append(finding)
    return Checked(values, masked, tuple(findings), tuple(remarks))


@dataclass(frozen=True, eq=False)
class _Words:
    """What is said about the faulty samples of a column."""

    file: str
    column: Sampled
    time: Array
    first_row: int

    @property
    def place(self) -> str:
        return f"{self.file}: column '{self.column.head}'"

    def masked(self, groups: Sequence[Group]) -> Iterable[Finding]:
        if not groups:
            return []
        count = sum(g.behind - g.first for g in groups)
        listed = "; ".join(self._one(g) for g in groups[:_SHOWN])
        more = f"; and {len(groups) - _SHOWN} more" if len(groups) > _SHOWN else ""
        samples = "1 sample" if count == 1 else f"{count} samples"
        text = f"{listed}{more}: {samples} masked ({100.0 * count / len(self.time):.2g} %)"
        return [Finding(f"{self.place}, {self._rows(groups[0])}", text)]

    def suspect(self, groups: Sequence[Group], short: Sequence[Group]) -> Iterable[Finding]:
        for group in groups:
            where = f"{self.place}, {self._rows(group)}"
            if group.kind == "jump":
                turn = _TURN.get(self.column.unit, np.inf)
                wraps = abs(abs(group.size) - turn) < 0.01 * turn
                way_out = "unwrap it" if wraps else "was it reset? Split the record there, or undo the jump"
                text = f"the position jumps by {group.size:.4g} {self.column.unit} between two samples"
                yield Finding(where, f"{text} at {self._at(group)}: {way_out}")
            elif group not in short:
                length = group.behind - group.first
                text = (
                    f"rests at {self.column.values[group.first]:g} for {length} samples, while others go on"
                )
                yield Finding(where, f"{text}, from {self._at(group)}: cut the record there")
        count = sum(g.behind - g.first for g in short)
        if count > _MANY * len(self.time):
            share = f"{100.0 * count / len(self.time):.2g} % of its samples are faulty"
            yield Finding(f"{self.place}, {self._rows(groups[0])}", f"{share}: check cable and recorder")

    def _one(self, group: Group) -> str:
        names = {"spike": "spike", "dropout": "samples off", "stuck": "value stuck"}
        size = f" by {group.size:.3g} {self.column.unit}" if group.size else ""
        return f"{names[group.kind]}{size} in {self._rows(group)} at {self._at(group)}"

    def _at(self, group: Group) -> str:
        return f"{self.time[group.first]:g} s"

    def _rows(self, group: Group) -> str:
        return rows_in_words(np.arange(group.first, max(group.behind, group.first + 1)), self.first_row)


def _too_coarse(place: str, column: Sampled, values: Array, time: Array) -> Iterable[Finding]:
    """Yield how often a motion would have to be sampled, where that was too seldom for its rates.

    A sine of amplitude A and n samples a period changes by at most 2πA/n from one sample to the next.
    """
    fastest = float(np.percentile(np.abs(np.diff(values)), _FASTEST))
    if not column.motion or fastest <= _DRIFT * max(noise_of(values), quantum_of(values)):
        return
    period = np.pi * float(np.ptp(values)) / fastest
    if period < _LEAST_PERIOD:
        rate = (len(time) - 1) / float(time[-1] - time[0])
        wanted = float(f"{rate * _LEAST_PERIOD / period:.2g}")
        text = f"has about {period:.2g} samples a period where it is fastest, too few for its rates"
        yield Finding(place, f"{text}: record at {wanted:g} Hz or more")


def _clipped(
    place: str, column: Sampled, values: Array, others: Sequence[Witness], first_row: int
) -> Iterable[tuple[Finding, bool]]:
    """Yield a finding on a clipped channel, and whether it makes the channel suspect.

    A command at its limit, a current at that of its drive, and a body at a stop are no faults. Where
    everything else rests too, a channel may rest as well.
    """
    # Without noise a channel may rest on its largest value; with noise this is clipping.
    if np.ptp(values) == 0.0 or noise_of(values) < 2.0 * quantum_of(values):
        return
    for extreme, which in ((values.max(), "largest"), (values.min(), "smallest")):
        places = np.flatnonzero(values == extreme)
        runs = np.split(places, np.flatnonzero(np.diff(places) > 1) + 1)
        run = max(runs, key=len)
        if len(run) < _CLIPPED_RUN or not _cut_off(values, run):
            continue
        if others and not any(_changes(each.values, run) for each in others):
            continue
        where = f"{place}, {rows_in_words(run, first_row)}"
        text = f"rests on its {which} value {extreme:g}"
        if column.shows_input or column.motion:
            reason = "a limit of the drive" if column.shows_input else "a stop"
            yield Finding(where, f"{text}: taken for {reason}"), False
        else:
            yield Finding(where, f"{text}: clipped or saturated"), True
        return


def _changes(values: Array, run: Indices) -> bool:
    """Tell whether a channel goes on while another one rests: by more than its noise and counts."""
    thirds = np.array_split(values[run[0] : run[-1] + 1], 3)
    changes = float(np.ptp([part.mean() for part in thirds]))
    return bool(changes > _DRIFT * max(noise_of(values) / np.sqrt(len(thirds[-1])), quantum_of(values)))


def _cut_off(values: Array, run: Indices) -> bool:
    """Tell whether a signal approaches its extreme so fast that its peak must lie beyond it."""
    first, last = int(run[0]), int(run[-1])
    sides = values[max(first - _APPROACH, 0) : first + 1], values[last : last + _APPROACH + 1]
    slopes = [abs(part[-1] - part[0]) / (len(part) - 1) for part in sides if len(part) > 1]
    half = 0.5 * len(run)
    # Peak of the parabola that has this slope half of the approach before the run.
    missing = 0.5 * half**2 * max(slopes, default=0.0) / (half + 0.5 * _APPROACH)
    return missing > _MISSING_COUNTS * max(quantum_of(values), noise_of(values))
