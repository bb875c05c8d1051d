"""Checks of what channels show: faulty samples, which are masked, and channels that are constant or clipped.

Findings make records suspect; remarks only say what was changed or what is unusual.
"""

from __future__ import annotations

from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass

import numpy as np

from ....foundation.arrays import Array, Indices, Mask
from ..statistics.residuals import noise_of, quantum_of
from .faulty_samples import LONGEST, Group, Surroundings, Witness, faulty_groups, repaired
from .quality import Finding, rows_in_words

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


@dataclass(frozen=True, eq=False)
class Sampled:
    """A column as it stands in the file.

    Parameters
    ----------
    head, unit
        Of the column.
    values
        Finite, shape (n,).
    commanded
        Whether it is an input of the model: a command may rest, jump, and be limited.
    shows_input
        Whether it is an input, or the reading of one: a limit may be that of the drive.
    motion
        Whether it is a position or an angle.
    """

    head: str
    unit: str
    values: Array
    commanded: bool = False
    shows_input: bool = False
    motion: bool = False


@dataclass(frozen=True, eq=False)
class Checked:
    """Columns after the checks.

    Parameters
    ----------
    values, masked
        By head, shape (n,): repaired values, and which samples these are; only of columns that were changed.
    findings, remarks
        What makes the file suspect, and what was changed or is unusual.
    """

    values: Mapping[str, Array]
    masked: Mapping[str, Mask]
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
            rests = column.shows_input or _all_rest(others)
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


def _all_rest(others: Sequence[Witness]) -> bool:
    return bool(others) and not any(_moves(each.values) for each in others)


def _moves(values: Array) -> bool:
    return bool(np.ptp(values) > _MOVES * max(noise_of(values), quantum_of(values)))


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
        run = _longest_run(values == extreme)
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


def _longest_run(mask: Mask) -> Indices:
    places = np.flatnonzero(mask)
    runs = np.split(places, np.flatnonzero(np.diff(places) > 1) + 1)
    return max(runs, key=len)
