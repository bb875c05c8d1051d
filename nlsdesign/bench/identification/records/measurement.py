"""Measured records, read from tables through a mapping of columns to signals with units.

Held out by default are the records most like another one. That choice, like the order in which records are
fitted, depends on their content and not on the names of their files.
"""

from __future__ import annotations

import fnmatch
import hashlib
import math
from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass, field, replace
from pathlib import Path
from typing import Literal
from weakref import WeakKeyDictionary

import numpy as np
import scipy

from ....foundation.arrays import Array, Mask
from ....foundation.csv_tables import heads_with_units
from ....foundation.errors import MeasurementError, nearest, unknown_name, visible
from ....foundation.quantity import parse_unit
from ....foundation.written_numbers import without_power
from ....model import FlatModel
from ....simulation import Trace
from ..filters import blurred, derivative
from ..residuals import noise_beside, noise_of, quantum_of
from .clocks import Resolution
from .column_heads import default_mapping, times_among, times_without_unit
from .gaps import between_gaps
from .ingest import read_run
from .mapping import Column as Column
from .mapping import ColumnMap as ColumnMap
from .mapping import Inputs, check_signals, read_mapping, with_known_sampling
from .quality import Finding
from .robot_logs import is_robot_log
from .sampling import SAMPLED, Sampling
from .table_files import RecordTable, read_table, table_files, unread_tables

_SHARE = 3
"""One of so many records is held out."""
_PER_SIGNAL = 4
"""Marks of a signal, behind the length of the record."""
_LAGS = 100
"""Rates are taken over this part of the shortest record, where noise counts little."""
_DIGITS = 9
"""Distances that agree to so many digits are equal: they must not depend on the order of a sum."""
_PART = " part "
"""Between the name of a file with gaps and the number of one of its records."""
_COARSER = 3.0
"""Declared counts beyond which the smallest step in all records is no matter of chance."""


def surrounded(traces: Sequence[Trace]) -> tuple[int, ...]:
    """Return the indices of records to hold out: a third, rounded, and at least one of two.

    A record is described by its length and, for every signal, by its smallest and largest value, its usual
    rate, and how unevenly it moves: the root mean square of the rate over its mean size, large where motion
    alternates with rest. Held out, one after the other, is a record of the pair that is most alike among
    those that are left, so that fits keep every kind of motion: the one nearer to the middle of the range of
    all, so that it is predicted by interpolation, and among equals the one of the smaller motion.

    ``traces``: with the same signals; at least two.
    """
    lag = min(float(t.time[-1] - t.time[0]) for t in traces) / _LAGS
    rows = []
    for trace in traces:
        step = float(trace.time[1] - trace.time[0])
        lag_samples = max(1, round(lag / step))
        row = [float(np.log(trace.time[-1] - trace.time[0]))]
        for name in sorted(traces[0].signals):
            values = trace[name]
            change = np.abs(values[lag_samples:] - values[:-lag_samples])
            rate = float(np.sqrt(np.mean(change**2)))
            form = rate / max(float(np.mean(change)), 1e-300)
            row += [float(values.min()), float(values.max()), _log(rate), _log(form)]
        rows.append(row)
    marks = np.array(rows)
    left = list(range(len(traces)))
    chosen: list[int] = []
    while len(chosen) < (len(traces) + 1) // _SHARE:
        distance = dict(zip(left, _distance(marks[left]), strict=True))
        apart = dict(zip(left, _to_nearest(marks[left]), strict=True))
        rank = {k: (apart[k], distance[k], _extent(marks, k), content_digest(traces[k])) for k in left}
        best = min(left, key=rank.__getitem__)
        chosen.append(best)
        left.remove(best)
    return tuple(sorted(chosen))


def content_digest(trace: Trace) -> str:
    """Return a digest of time and signals, whatever their order."""
    digest = hashlib.sha256(trace.time.tobytes())
    for name in sorted(trace.signals):
        digest.update(trace.signals[name].tobytes())
    return digest.hexdigest()


def _log(value: float) -> float:
    return float(np.log(max(value, 1e-300)))


def _distance(marks: Array) -> list[float]:
    """Return how far each record lies from the middle of the range of all.

    The mean fourth power over the marks: a record that is extreme in one of them is outside, whatever the
    others.
    """
    low, high = marks.min(axis=0), marks.max(axis=0)
    share = (marks - low) / np.where(high > low, high - low, 1.0)
    return [round(float(d), _DIGITS) for d in np.mean((share - 0.5) ** 4, axis=1)]


def _to_nearest(marks: Array) -> list[float]:
    """Return the distance of each record to the one most like it, marks counted in their ranges."""
    low, high = marks.min(axis=0), marks.max(axis=0)
    share = (marks - low) / np.where(high > low, high - low, 1.0)
    apart = np.sqrt(np.mean((share[:, None] - share[None]) ** 2, axis=2))
    np.fill_diagonal(apart, np.inf)
    return [round(float(d), _DIGITS) for d in apart.min(axis=1)]


def _extent(marks: Array, row: int) -> float:
    """Return the mean range of the signals of a record, as a share of the largest."""
    ranges = marks[:, 2::_PER_SIGNAL] - marks[:, 1::_PER_SIGNAL]
    largest = np.where(ranges.max(axis=0) > 0.0, ranges.max(axis=0), 1.0)
    return round(float(np.mean(ranges[row] / largest)), _DIGITS)


Role = Literal["fit", "selection", "held_out"]

_derived: WeakKeyDictionary[Trace, dict[tuple[str, Sampling, int | str, float], Array]] = WeakKeyDictionary()
"""Derivatives of the signals of a trace, by signal, by how it is read, by order (or "blur") and span."""


@dataclass(frozen=True, eq=False)
class Record:
    """One measured run on a uniform time grid.

    Parameters
    ----------
    name
        Name of the file without its ending.
    trace
        Signals in SI by full name.
    role
        ``fit``: parameters are fitted to it; ``selection``: hypotheses are compared on it; ``held_out``: used
        only for the final assessment.
    source
        File, and the changes made to its samples.
    resolution
        Noise and count of signals that were interpolated or filtered; their samples no longer show it.
    masked
        Samples of a signal that are faulty, shape (n,), by signal: they stand interpolated in the trace, and
        a residual that depends on one of them does not count.
    sampling
        How signals run between their samples, by signal; others are what they were at their stamps.
    """

    name: str
    trace: Trace
    role: Role = "fit"
    source: str = ""
    resolution: Mapping[str, Resolution] = field(default_factory=dict)
    masked: Mapping[str, Mask] = field(default_factory=dict)
    sampling: Mapping[str, Sampling] = field(default_factory=dict)

    def __post_init__(self) -> None:
        # Names of files may hold anything.
        object.__setattr__(self, "name", visible(self.name))

    @property
    def step(self) -> float:
        """Time between samples in s."""
        return float((self.trace.time[-1] - self.trace.time[0]) / (len(self.trace) - 1))

    def sampling_of(self, signal: str) -> Sampling:
        """Return how a signal runs between its samples.

        Parameters
        ----------
        signal
            Full name.
        """
        return self.sampling.get(signal, SAMPLED)

    def at_samples(self, signal: str) -> Array:
        """Return what a smooth signal with the same effect as a measured one has at the samples, shape (n,).

        Parameters
        ----------
        signal
            Full name.
        """
        return self.sampling_of(signal).at_samples(self.trace[signal])

    def derived(self, signal: str, order: int, span: float) -> Array:
        """Return a signal at the samples, or its rate or second derivative there, shape (n,), read-only.

        Every hypothesis asks for the same ones: each is taken once, as :func:`~.filters.derivative` does.

        Parameters
        ----------
        signal
            Full name.
        order
            0 for the signal itself.
        span
            Time in s over which a rate is taken.
        """
        if order == 0:
            return self.at_samples(signal)
        known = _derived.setdefault(self.trace, {})
        key = signal, self.sampling_of(signal), order, span
        if key not in known:
            known[key] = derivative(self.at_samples(signal), self.step, order=order, span=span)
            known[key].flags.writeable = False
        return known[key]

    def read_as(self, sampling: Mapping[str, Sampling]) -> Record:
        """Return the record with some signals running between their samples as they are told to.

        Parameters
        ----------
        sampling
            By full name of the signal; others stay as they are.
        """
        known = {**self.sampling, **sampling}
        return replace(self, sampling={s: form for s, form in known.items() if form is not SAMPLED})

    def blur(self, signal: str, span: float) -> Array:
        """Return what a span takes from the rate of a signal at the samples, shape (n,).

        Parameters
        ----------
        signal
            Full name.
        span
            Time in s over which the rate is taken.
        """
        known, key = _derived.setdefault(self.trace, {}), (signal, self.sampling_of(signal), "blur", span)
        if key not in known:
            known[key] = blurred(self.at_samples(signal), self.step, span=span)
            known[key].flags.writeable = False
        return known[key]

    def as_computed(self, signal: str) -> Array:
        """Return what a prediction of a measured signal must equal at the samples, shape (n,).

        Parameters
        ----------
        signal
            Full name.
        """
        return self.sampling_of(signal).as_computed(self.trace[signal])

    def refined(self, times: int) -> Record:
        """Return the record with several samples in the place of one, between those that were measured.

        What was held or averaged becomes the smooth signal with the same effect; samples that are masked have
        no part in those beside them.

        Parameters
        ----------
        times
            How many; 1 leaves it as it is.
        """
        if times == 1:
            return self
        trace, share = self.trace, math.sqrt(times)
        clock = np.arange(len(trace), dtype=np.float64)
        finer = np.arange((len(trace) - 1) * times + 1) / times
        signals, resolution = {}, {}
        for name in trace.signals:
            noise, quantum = self.resolution_of(name)
            resolution[name] = Resolution(share * noise, share * quantum)
            sound = ~self.masked_in([name])
            spline = scipy.interpolate.make_interp_spline(clock[sound], self.at_samples(name)[sound], k=5)
            signals[name] = spline(finer)
        below, above = np.floor(finer).astype(int), np.ceil(finer).astype(int)
        return replace(
            self,
            trace=Trace(trace.time[0] + finer * self.step, signals, trace.units, trace.name),
            resolution=resolution,
            masked={name: mask[below] | mask[above] for name, mask in self.masked.items()},
            sampling={},
        )

    def resolution_of(self, signal: str) -> Resolution:
        """Return noise and size of a count of a signal, in SI.

        Parameters
        ----------
        signal
            Full name.

        Returns
        -------
        Resolution
            From before the resampling where the signal was resampled; else estimated from its samples.
        """
        if signal in self.resolution:
            return self.resolution[signal]
        # What was interpolated has another noise, and no counts.
        values = self.trace[signal][~self.masked_in([signal])]
        return Resolution(noise_of(values), quantum_of(values))

    def noise_beside(self, signal: str, readings: Sequence[str]) -> float:
        """Return the white noise of a signal beside what a controller makes of readings, in SI.

        Parameters
        ----------
        signal
            Full name.
        readings
            Full names of what the controller reads.

        Returns
        -------
        float
            Infinite where the signal was resampled, or where there is too little to tell.
        """
        if signal in self.resolution or not readings:
            return math.inf
        columns = np.column_stack([self.trace[name] for name in readings])
        return noise_beside(self.trace[signal], columns, self.masked_in([signal, *readings]))

    def masked_in(self, signals: Iterable[str]) -> Mask:
        """Return the samples that are masked in at least one of these signals, shape (n,).

        Parameters
        ----------
        signals
            Full names.
        """
        result = np.zeros(len(self.trace), dtype=bool)
        for name in signals:
            result |= self.masked.get(name, False)
        return result


@dataclass(frozen=True, eq=False)
class RecordSet:
    """Records of one rig with the same signals.

    Parameters
    ----------
    records
        In order of name.
    columns
        Measured columns.
    findings
        Reasons to suspect the data.
    remarks
        What was changed, masked or assumed, and what is unusual; these do not make the data suspect.
    """

    records: tuple[Record, ...]
    columns: tuple[Column, ...]
    findings: tuple[Finding, ...] = field(default=())
    remarks: tuple[Finding, ...] = field(default=())

    @property
    def signals(self) -> tuple[str, ...]:
        """Full names of the measured signals."""
        return tuple(c.signal for c in self.columns)

    @property
    def deciding(self) -> tuple[Record, ...]:
        """Records that may decide on noise and filters: those held out only where there are no others."""
        return self.of("fit", "selection") or self.records

    @property
    def shift(self) -> float:
        """Time in s by which two channels may be shifted against each other without any fault.

        Half a sample of each of which is not said how it runs between its samples.
        """
        loose = min(2, sum(not column.declared for column in self.columns))
        return 0.5 * loose * max(record.step for record in self.records)

    def of(self, *roles: Role) -> tuple[Record, ...]:
        """Return the records of some roles.

        Parameters
        ----------
        *roles
            For instance ``"fit"``.
        """
        return tuple(r for r in self.records if r.role in roles)

    def without_held_out(self) -> RecordSet:
        """Return the records that may choose anything, with the findings about them.

        Raises
        ------
        MeasurementError
            If all records are held out.
        """
        kept = tuple(r for r in self.records if r.role != "held_out")
        if not kept:
            raise MeasurementError(
                "records",
                "are all held out, so nothing can be fitted",
                next_step="hold out some of them only",
            )
        held = [r.source or r.name for r in self.records if r.role == "held_out"]
        others = [r.source or r.name for r in kept]
        findings = tuple(
            f
            for f in self.findings
            if not any(f.place.startswith(s) for s in held) or any(f.place.startswith(s) for s in others)
        )
        return replace(self, records=kept, findings=findings)

    def column(self, signal: str) -> Column:
        """Return the column that measures a signal.

        Parameters
        ----------
        signal
            Full name.

        Raises
        ------
        UnknownNameError
            If the signal is not measured.
        """
        for each in self.columns:
            if each.signal == signal:
                return each
        raise unknown_name("measured signal", signal, self.signals)

    def read_as(self, sampling: Mapping[str, Sampling]) -> RecordSet:
        """Return the records in which some inputs run between their samples as they are told to.

        Parameters
        ----------
        sampling
            By full name of the signal; others stay as they are.
        """
        columns = tuple(replace(c, sampling=sampling.get(c.signal, c.sampling)) for c in self.columns)
        return replace(self, records=tuple(r.read_as(sampling) for r in self.records), columns=columns)

    def in_canonical_order(self) -> RecordSet:
        """Return the same records and findings, ordered by the content of the records.

        Rounding of sums and choices among equals depend on the order of records. In canonical order results
        do not depend on the names of files.
        """
        ordered = tuple(sorted(self.records, key=_content))
        findings, remarks = (
            tuple(sorted(group, key=lambda finding: (_index_of_record(finding, ordered), finding.text)))
            for group in (self.findings, self.remarks)
        )
        return replace(self, records=ordered, findings=findings, remarks=remarks)


def load_records(
    folder: Path,
    model: FlatModel,
    *,
    mapping: Path | None = None,
    hold_out: Sequence[str] = (),
    joint: str | None = None,
) -> RecordSet:
    """Read all tables of a folder as records of one rig.

    Parameters
    ----------
    folder
        Holds one file per record, ``*.csv``, ``*.parquet``, ``*.mat``, ``*.h5`` or ``*.hdf5``, or one log of
        a robot, ``*.mcap``, ``*.db3``, ``*.bag`` or a folder of rosbag2, and perhaps ``records.toml``. Files
        without a column of time are not records and are left out.
    model
        Whose signals are measured.
    mapping
        TOML with ``[time] column, unit``, ``[columns.<head>] signal, unit, noise, quantum``, the lists of
        globs ``held_out`` and ``selection``, and ``held_out_after``, a time with unit at which every record
        is cut. ``resample_Hz`` puts all columns on one clock, also those with one of their own,
        ``[columns.<head>] time``; ``[[align]] column, to`` removes a lag first. By default ``records.toml``
        in the folder; where it maps no column, or is missing, the heads must be names of signals, or name a
        unit that only one sensor of the model has.
    hold_out
        Globs on record names. Without any, here or in the mapping, a third of the records is held out, those
        that the others surround, see :func:`~.held_out.surrounded`; a single record is cut after two thirds.
    joint
        Name of a joint in logs of a robot. Without a mapping only its columns are read, and of these the ones
        of which the model has one signal in their unit; in a mapping ``{joint}`` stands for the name.

    Raises
    ------
    MeasurementError
        If a file cannot be used as it stands: file, column and rows are named.
    MissingLibraryError
        If a library is missing that reads a file of the folder.
    """
    folder = Path(folder)
    files = table_files(folder)
    path = mapping or (folder / "records.toml" if (folder / "records.toml").exists() else None)
    given = read_mapping(path, joint) if path else None
    tables = {file: _table(file, given, joint) for file in files}
    runs = {file: table for file, table in tables.items() if _is_run(table.heads, given)}
    if not runs:
        raise _without_time(str(folder), tables.values())
    # Where files differ in their columns, their names must not choose among them; of the file with the most
    # columns none is left out silently because another file lacks it.
    first = min(runs, key=lambda file: (-len(runs[file].heads), tuple(runs[file].heads)))
    chosen = default_mapping(runs[first].heads, model, first.name, given, joint=joint is not None)
    check_signals(first.name, chosen.columns, model)
    chosen = with_known_sampling(first.name, replace(chosen, inputs=Inputs.of(model)), model)
    pieces = {file: between_gaps(table, chosen) for file, table in runs.items()}
    whole = [
        _record(file, part, chosen, number if len(each.tables) > 1 else 0)
        for file, each in pieces.items()
        for number, part in enumerate(each.tables, 1)
    ]
    records = [record for one in whole for record in one.records]
    findings = tuple(finding for one in whole for finding in one.findings)
    remarks = [remark for each in pieces.values() for remark in each.remarks]
    remarks += [remark for one in whole for remark in one.remarks]
    remarks += [
        Finding(file.name, "has no column of time, so it is not taken for a record")
        for file in tables
        if file not in runs
    ]
    remarks += [
        Finding(file.name, f"is not read: '{file.suffix}' is no ending of a table; export it as CSV")
        for file in unread_tables(folder)
    ]
    chosen, coarser = _with_counts_as_seen(chosen, records)
    remarks += coarser
    held = tuple(hold_out) or chosen.held_out
    if chosen.held_out_after is not None and not hold_out:
        parts = tuple(part for r in records for part in cut_in_time(r, chosen.held_out_after))
        return RecordSet(parts, chosen.columns, findings, tuple(remarks))
    roles = split(records, held, chosen.selection)
    if not held and len(records) > 1:
        remarks.append(_by_default(roles))
    return RecordSet(roles, chosen.columns, findings, tuple(remarks))


def load_record(file: Path, model: FlatModel, *, mapping: Path | None = None) -> RecordSet:
    """Read one table as a whole record, independent of other files in its folder.

    Parameters
    ----------
    file
        As for :func:`load_records`.
    model
        Whose signals are measured.
    mapping
        As for :func:`load_records`; by default ``records.toml`` beside the file.

    Returns
    -------
    RecordSet
        With this record alone; its role is ``"held_out"``.

    Raises
    ------
    MeasurementError
        If the file does not exist, or cannot be used as it stands.
    """
    file = Path(file)
    if not (file.is_file() or is_robot_log(file)):
        near = nearest(file.name, [f.name for f in file.parent.glob("*")] if file.parent.is_dir() else [])
        raise MeasurementError(str(file), "there is no such file", did_you_mean=near)
    beside = file.parent / "records.toml"
    path = mapping or (beside if beside.exists() else None)
    given = read_mapping(path) if path else None
    table = _table(file, given)
    if not _is_run(table.heads, given):
        raise _without_time(file.name, [table])
    chosen = default_mapping(table.heads, model, file.name, given)
    check_signals(file.name, chosen.columns, model)
    chosen = with_known_sampling(file.name, replace(chosen, inputs=Inputs.of(model)), model)
    one = _record(file, table, chosen)
    return replace(one, records=(replace(one.records[0], role="held_out"),))


def _table(file: Path, mapping: ColumnMap | None, joint: str | None = None) -> RecordTable:
    """Return the table of a file; units below its heads become part of them where no mapping names these."""
    mapped = mapping is not None and bool(mapping.columns)
    # A mapping names what it reads: also columns of no joint, such as a command.
    table = read_table(file) if joint is None or mapped else read_table(file).of_joint(joint)
    if (mapping is not None and mapping.columns) or not table.units:
        return table
    units = {h: u for h, u in table.units.items() if mapping is None or h != mapping.time.name}
    named = heads_with_units(file.name, table.heads, units)
    return replace(table, given={n: table.given[h] for n, h in zip(named, table.heads, strict=True)})


def _without_time(where: str, tables: Iterable[RecordTable]) -> MeasurementError:
    """Return the error on records without time; a time without unit is not guessed, but asked for."""
    for table in tables:
        for head in times_without_unit(table.heads):
            steps = np.diff(table.given[head])
            usual = f"{float(np.median(steps)):g}" if len(steps) else "0"
            return MeasurementError(
                f"{table.file}: column '{head}'",
                f"names no unit; its samples lie {usual} apart, which may be seconds or milliseconds",
                next_step="name it 't_s' or 't_ms', or give its unit in records.toml: [time]",
            )
    return MeasurementError(where, "has no column of time", next_step="name it 't_s' or 'time [s]'")


def _with_counts_as_seen(chosen: ColumnMap, records: Sequence[Record]) -> tuple[ColumnMap, list[Finding]]:
    """Put counts in the place of declared ones that are plainly finer: the noise floor would be too low."""
    remarks, columns = [], []
    for column in chosen.columns:
        count = min(r.resolution_of(column.signal).quantum for r in records)
        if count > _COARSER * column.quantum > 0.0:
            unit = parse_unit(column.unit)
            seen, declared = (
                f"{without_power(each / unit.factor)} {column.unit}" for each in (count, column.quantum)
            )
            text = f"moves in counts of {seen}, {declared} are declared: the former are used"
            remarks.append(Finding(f"column '{column.name}'", text))
            column = replace(column, quantum=count)
        columns.append(column)
    return replace(chosen, columns=tuple(columns)), remarks


def _by_default(records: Sequence[Record]) -> Finding:
    held = ", ".join(sorted(r.name for r in records if r.role == "held_out"))
    text = f"held out by default: {held}, inside the range of the others"
    return Finding("records", f"{text}; to choose, write held_out in records.toml")


def _is_run(heads: Sequence[str], mapping: ColumnMap | None) -> bool:
    """Tell whether a file is a record: tables without any of the columns may lie in the same folder."""
    if mapping is not None and mapping.time.name:
        return any(c.name in heads for c in (mapping.time, *mapping.columns))
    return bool(times_among(heads))


def split(
    records: Sequence[Record], held_out: Sequence[str] = (), selection: Sequence[str] = ()
) -> tuple[Record, ...]:
    """Return the records with their roles.

    ``held_out``, ``selection``: globs on names; see :func:`load_records` for what happens without
    ``held_out``.
    """
    if not held_out and len(records) == 1:
        record = records[0]
        cut = 2 * len(record.trace) // 3
        return (
            _part(record, slice(None, cut), "fit", "first two thirds"),
            _part(record, slice(cut, None), "held_out", "last third"),
        )
    names = [r.name for r in records]
    compared = {n for g in selection for n in _named_by(g, names)}
    if held_out:
        chosen = {n for g in held_out for n in _named_by(g, names)}
    else:
        free = [r for r in records if r.name not in compared] if len(compared) < len(names) - 1 else records
        chosen = {free[k].name for k in surrounded([r.trace for r in free])}
    compared -= chosen
    for glob in (*held_out, *selection):
        if not _named_by(glob, names):
            raise MeasurementError(
                f"held-out records '{glob}'",
                "no record has such a name",
                did_you_mean=nearest(glob, names),
                next_step=f"records are: {', '.join(names)}",
            )
    roles: dict[str, Role] = {n: "held_out" if n in chosen else "selection" for n in compared | chosen}
    if len(roles) == len(names):
        raise MeasurementError(
            "records", "none is left for fitting",
            next_step="hold out fewer records (--hold-out, or held_out and selection in records.toml)",
        )  # fmt: skip
    return tuple(replace(r, role=roles.get(r.name, "fit")) for r in records)


def _named_by(glob: str, names: Iterable[str]) -> list[str]:
    """Return the names that a glob fits; that of a file stands for all of its records."""
    return [n for n in names if fnmatch.fnmatch(n, glob) or fnmatch.fnmatch(n.partition(_PART)[0], glob)]


def cut_in_time(record: Record, at: float) -> tuple[Record, Record]:
    """Return the part before a time, for fitting, and the part after it, held out.

    ``at``: time in s; the sample there belongs to the first part.
    """
    trace = record.trace
    cut = int(np.searchsorted(trace.time, at, side="right"))
    if cut < 2 or len(trace) - cut < 2:
        raise MeasurementError(
            f"record '{record.name}'",
            f"cannot be cut at {at:g} s; it runs from {trace.time[0]:g} to {trace.time[-1]:g} s",
        )
    return (
        _part(record, slice(None, cut), "fit", f"until {at:g} s"),
        _part(record, slice(cut, None), "held_out", f"after {at:g} s"),
    )


def from_sample(record: Record, first: int) -> Record:
    """Return a record from one sample on."""
    return _part(record, slice(first, None), record.role, f"from {record.trace.time[first]:g} s")


def _part(record: Record, rows: slice, role: Role, label: str) -> Record:
    trace, name = record.trace, f"{record.name} ({label})"
    signals = {n: v[rows] for n, v in trace.signals.items()}
    part = Trace(trace.time[rows], signals, trace.units, name)
    masked = {n: m[rows] for n, m in record.masked.items()}
    return replace(record, name=name, role=role, trace=part, masked=masked)


def _record(file: Path, table: RecordTable, mapping: ColumnMap, part: int = 0) -> RecordSet:
    """Return one table as a record; ``part`` counts those of a file that has gaps."""
    name = f"{file.stem}{_PART}{part}" if part else file.stem
    run = read_run(name, table, mapping)
    sampling = {c.signal: c.sampling for c in mapping.columns if c.sampling and c.sampling != SAMPLED}
    record = Record(
        name, run.trace, source=f"{run.source}{_PART}{part}" if part else run.source,
        resolution=run.resolution, masked=run.masked, sampling={} if mapping.resample else sampling,
    )  # fmt: skip
    assumed = () if part > 1 else tuple(Finding(table.file, remark) for remark in table.remarks)
    return RecordSet((record,), mapping.columns, run.findings, (*assumed, *run.remarks))


def _content(record: Record) -> tuple[int, str, str]:
    """Return number of samples, a digest of time and signals, and the role."""
    return len(record.trace), content_digest(record.trace), record.role


def _index_of_record(finding: Finding, ordered: tuple[Record, ...]) -> int:
    """Return the index of the record of a finding; the number of records if it belongs to none."""
    file = finding.place.partition(":")[0]
    known = [k for k, record in enumerate(ordered) if (record.source or record.name).startswith(file)]
    return known[0] if known else len(ordered)
