"""Checks of measured tables before anything is fitted to them; each names file, column and rows.

Samples that a sensor or a recorder got wrong are masked, see :mod:`~.faulty_samples`; jumps of a position
and channels that are constant or clipped are findings. Findings make records suspect; remarks only say what
was changed or what is unusual.
"""

from __future__ import annotations

from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass

import numpy as np

from ....foundation.arrays import Array, Indices, Mask
from ....foundation.errors import MeasurementError
from ....foundation.written_numbers import without_power
from ..residuals import noise_of, quantum_of
from .faulty_samples import LONGEST, Group, Surroundings, Witness, faulty_groups, repaired

GAP = 1.5
"""A step this much longer than the usual one is a gap."""
_BRIDGED = 20.0
"""Longest gap, in usual steps, for which a slower clock is proposed."""
_JITTER = 0.02
"""Steps that differ by more than this share are interpolated to a uniform grid."""
_LARGEST = 1e100
"""Nothing that is measured is larger in any unit."""
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
    count: float = 0.0  # declared size of one count, in the unit of the file; zero where none is


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
            (remarks if rests else findings).append(
                Finding(f"{place}, {rows}", f"is constant at {without_power(now[0], 6)}")
            )
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
                way_out = (
                    "unwrap it"
                    if wraps
                    else "was it reset, did its coupling slip, or are rows missing? Split the record there"
                )
                size = f"{without_power(group.size, 4)} {self.column.unit}"
                size += f" ({abs(group.size) / self.column.count:.0f} counts)" if self.column.count else ""
                text = f"the position jumps by {size} between two samples at {self._at(group)}"
                yield Finding(where, f"{text}: {way_out}")
            elif group not in short:
                length = group.behind - group.first
                value = without_power(self.column.values[group.first], 6)
                text = f"rests at {value} for {length} samples, while others go on"
                yield Finding(where, f"{text}, from {self._at(group)}: cut the record there")
        count = sum(g.behind - g.first for g in short)
        if count > _MANY * len(self.time):
            share = f"{100.0 * count / len(self.time):.2g} % of its samples are faulty"
            yield Finding(f"{self.place}, {self._rows(groups[0])}", f"{share}: check cable and recorder")

    def _one(self, group: Group) -> str:
        names = {"spike": "spike", "dropout": "samples off", "stuck": "value stuck"}
        size = f" by {without_power(group.size)} {self.column.unit}" if group.size else ""
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
        text = f"rests on its {which} value {without_power(extreme, 6)}"
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
