"""Signs that the records come from another rig than the declared one: of other numbers, or out of its reach.

A missing effect leaves most declared numbers where they are. Of another rig of the same structure the numbers
lie far outside their declared ranges and, let go, explain the records without any effect.
"""

from __future__ import annotations

import math
from typing import NamedTuple

import numpy as np

from ...identification.records.measurement import RecordSet
from ...identification.records.quality import Finding
from ...model import Assembly, flatten
from ...model.structure import reading_of
from ..selection.comparison import Comparison
from ..selection.excess import DECLARED, Excess, excesses
from ..selection.hypothesis import Hypothesis

_AT_END = 3.4
"""Prior standard deviations at which a refit is stopped: twice the declared range is 3.46."""
_FAR = 4.0
"""Declared ranges from the declared value beyond which a number is none of this rig; a refit stops at two."""
_SHARE = 0.98
"""Free numbers may take up most of an effect that the catalogue does not know, but not all of it."""
_CLOSED = 0.05
"""An effect that leaves no more than this of the excess is the simpler explanation, even if its form is not
quite right and many numbers let go come closer."""
_OUT_OF_REACH = 1.2


class OtherNumbers(NamedTuple):
    """What is said of records that other numbers explain.

    Parameters
    ----------
    words
        For the verdict; empty where nothing points to another rig.
    decides
        Whether other numbers alone explain the records, better than any effect that was added.
    """

    words: str
    decides: bool


def other_numbers(comparison: Comparison, base: Hypothesis, better: Hypothesis) -> OtherNumbers:
    """Let the declared numbers go where the records take them, if a refit has driven some to their ends.

    Parameters
    ----------
    comparison
        Evaluates hypotheses.
    base
        Refitted declared model.
    better
        With the effects that were added, if any.
    """
    before, after = excesses(base, comparison.bench), excesses(better, comparison.bench)
    stuck = [n for f in better.fits.values() for n, s in f.strain().items() if abs(s) >= _AT_END]
    if len(stuck) < 2 or not _left(before):
        return OtherNumbers("", False)
    free = comparison.freely(base)
    far = _far_numbers(free, base)
    let_go = excesses(free, comparison.bench)
    explains = 1.0 - _left(let_go) / _left(before)
    little = better is not base and _left(after) <= _CLOSED * _left(before)
    if far and explains >= _SHARE and _left(let_go) < 0.5 * _left(after) and not little:
        told = (
            f"the records may be of another rig: with its numbers free the declared model explains "
            f"{100.0 * explains:.3g} % of the excess without any effect, but then {'; '.join(far)}"
        )
        return OtherNumbers(told, True)
    count = sum(len(f.strain()) for f in better.fits.values())
    if 2 * len(stuck) < count:
        return OtherNumbers("", False)
    told = (
        f"{len(stuck)} of {count} refitted numbers stand at the end of what their declared spread allows "
        f"({', '.join(stuck[:4])}{', ...' if len(stuck) > 4 else ''}): the records may be of another rig"
    )
    return OtherNumbers(told, False)


def _left(found: dict[str, Excess]) -> float:
    return sum(sum(each.excess) for name, each in found.items() if name != DECLARED)


def _far_numbers(free: Hypothesis, base: Hypothesis) -> list[str]:
    """Return in words the numbers that lie far outside their declared ranges, furthest first."""
    found = []
    for fit in free.fits.values():
        for p in fit.parameters:
            value = fit.values[p.name]
            if p.scale != "log" or value <= 0.0:
                continue
            width = math.log1p(_spread(base, p.name))
            moved, error = math.log(value / p.centre), fit.standard_error(p.name) / value
            if abs(moved) - 2.0 * error > _FAR * width:
                told = f"{p.name} is {value:.3g} {p.unit}, {abs(moved) / width:.0f} declared spreads away"
                found.append((abs(moved) / width, told))
    return [told for _, told in sorted(found, key=lambda pair: -pair[0])][:3]


def _spread(base: Hypothesis, name: str) -> float:
    return float(base.assembly.quantities()[name.partition("[")[0]].spread)


def out_of_reach(actuator: Assembly, records: RecordSet) -> list[Finding]:
    """Return the records whose angle goes far beyond the end of the declared cam.

    Parameters
    ----------
    actuator
        As declared.
    records
        Measured. Where more than one angle is measured nothing is said.
    """
    model = flatten(actuator)
    ends = [cam.last_angle for spring in model.springs for cam in spring.cams if cam.last_angle]
    shown = {s: reading_of(model.readings, s).measured for s in records.signals}
    angles = [s for s, name in shown.items() if model.variable(name).unit == "rad"]
    if len(angles) != 1 or len(ends) != 1:
        return []
    name, end = ends[0], model.values[ends[0]]
    column, found = records.column(angles[0]), []
    for record in records.records:
        size = np.abs(record.trace[angles[0]])
        if float(size.max()) > _OUT_OF_REACH * end:
            outside = record.trace.time[size > end]
            found.append(
                Finding(
                    f"{record.source}: column '{column.name}', {outside[0]:.4g} s to {outside[-1]:.4g} s",
                    f"goes to {size.max():.3g} rad, the declared cam ends at {end:.3g} rad ({name}): "
                    "is the unit right, or are these records of another rig?",
                )
            )
    return found
