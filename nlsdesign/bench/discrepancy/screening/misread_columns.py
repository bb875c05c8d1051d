"""Columns that hold something else than is stated.

They are asked about before any effect where nearly nothing is explained, else where no effect explains it.

An angle in degrees under a head in radians, the angle of a rotor where that of its joint is meant, two
columns exchanged, a current that acts a sample later than is declared: no effect undoes any of them, and each
is undone in one way. The records are read so in turn. Where the declared model then leaves next to nothing of
the error, that column is suspect. One column is asked at a time, so a second one that is wrong hides it.
"""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import replace
from itertools import combinations
from typing import NamedTuple

import numpy as np

from ....components.assembly.named_parts import Assembly
from ....foundation.quantity import parse_unit, same_dimension
from ...identification.records.mapping import Column
from ...identification.records.measurement import RecordSet
from ...identification.records.quality import Finding
from ..effects.places import gear_ratios
from ..selection.comparison import Comparison
from ..selection.hypothesis import Hypothesis
from .scale_and_sign import error_share, refitted, with_signals

_LITTLE, _NOISE = 0.05, 1.5
"""Share of error and effort that may be left besides; mean squares of noise that count as nothing left."""


class _Reading(NamedTuple):
    """Another way to read one column or two."""

    column: str
    words: str  # how, after "read"
    records: RecordSet


def misread_findings(
    actuator: Assembly, records: RecordSet, comparison: Comparison, base: Hypothesis, *, least: float = 0.0
) -> list[Finding]:
    """Return the column that, read otherwise, lets the declared model explain nearly all of the error.

    ``records``: as measured. ``comparison``, ``base``: of them as they were read, and the declared model.
    ``least``: share of the effort that this leaves where it is asked at all.
    """
    worst = max(comparison.judged(base), key=lambda judged: float(judged.residual @ judged.residual))
    block = worst.block.name
    before = error_share(comparison, base, block)
    if before < least:
        return []
    shares: dict[tuple[str, str], float] = {}
    for reading in _readings(actuator, records):
        # What one record denies need not be asked of all.
        one = tuple(r for r in reading.records.records if r.name == worst.record.name)
        first = _explained(actuator, replace(reading.records, records=one), block, before)
        left = None if first is None else _explained(actuator, reading.records, block, before)
        if left is not None:
            shares[reading.column, reading.words] = left
    if not shares:
        return []
    column, words = min(shares, key=lambda reading: shares[reading])
    explained = 100.0 * (1.0 - shares[column, words] / before)
    text = (
        f"is not what is stated: read {words}, the declared model explains {explained:.4g} % of the error "
        "that is left as stated; correct the unit, the signal or between_samples of this column"
    )
    return [Finding(f"column '{column}'", text)]


def _explained(actuator: Assembly, records: RecordSet, block: str, before: float) -> float | None:
    """Return the share of the effort that the declared model leaves of records; None where that is much.

    Little is left where it is less than a few per cent of all, or where what is left is the filtered noise.
    """
    if (anew := refitted(actuator, records)) is None:
        return None
    comparison, base = anew
    left = error_share(comparison, base, block)
    squares = [float(np.mean(j.residual**2)) for j in comparison.judged(base) if j.block.name == block]
    little = left <= _LITTLE * min(before, 1.0) or (left < before and max(squares) < _NOISE)
    return left if little else None


def _readings(actuator: Assembly, records: RecordSet) -> Iterator[_Reading]:
    """Yield each other way to read one column or two."""
    ways = list[tuple[str, str, dict[str, tuple[str, float]]]]()
    for column in records.columns:
        units = next((u for u in (("rad", "deg"), ("m", "mm")) if same_dimension(column.unit, u[0])), ())
        factors = {f"in {u}": parse_unit(u).factor / parse_unit(column.unit).factor for u in units}
        for gear, ratio in gear_ratios(actuator) if units else ():
            factors[f"as the motion before the ratio of {gear}"] = 1.0 / ratio
            factors[f"as the motion behind the ratio of {gear}"] = ratio
        others = {words: factor for words, factor in factors.items() if factor != 1.0}
        ways += [(column.name, words, {column.signal: (column.signal, f)}) for words, f in others.items()]
    for one, other in combinations(records.columns, 2):
        factor = parse_unit(one.unit).factor / parse_unit(other.unit).factor
        exchanged = {one.signal: (other.signal, factor), other.signal: (one.signal, 1.0 / factor)}
        ways.append((one.name, f"exchanged with '{other.name}'", exchanged))
    for name, words, taken in ways:
        yield _Reading(name, words, with_signals(records, taken))
    for column in records.columns:
        if column.declared and column.sampling and column.sampling.late:
            words = "as the records show that it runs between its samples"
            yield _Reading(column.name, words, _undeclared(records, column))


def _undeclared(records: RecordSet, column: Column) -> RecordSet:
    """Return the records without what is said of how a column runs between its samples."""
    free = replace(column, sampling=None, declared=False)
    columns = tuple(free if c == column else c for c in records.columns)
    read = tuple(
        replace(r, sampling={s: form for s, form in r.sampling.items() if s != column.signal})
        for r in records.records
    )
    return replace(records, columns=columns, records=read)
