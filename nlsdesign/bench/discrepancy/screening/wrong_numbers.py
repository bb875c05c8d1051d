"""Declared numbers that the records contradict, some of them or all: let go, they explain what is left.

A refit stops at three standard deviations. Where a number stands there and something is left over, the number
may have been declared wrongly, alone or beside a missing effect. It is then fitted as if nothing were known
of it, and that is kept only if the numbers end far outside their declared values and explain enough.

A missing effect leaves most declared numbers where they are. Of another rig of the same structure the numbers
lie far outside their declared values and, let go, explain the records without any effect.
"""

from __future__ import annotations

import math
from typing import NamedTuple

import numpy as np

from ....components.assembly.named_parts import Assembly
from ....foundation.errors import ConvergenceError
from ....foundation.quantity import with_unit
from ....model import flatten
from ....model.readings import reading_of
from ...identification.equation_error.evidence import Bench
from ...identification.records.measurement import RecordSet
from ...identification.records.quality import Finding
from ..selection.comparison import Comparison
from ..selection.criteria import Change, Criteria, is_complete
from ..selection.hypothesis import Hypothesis, excesses
from ..selection.measures import DECLARED, Excesses, standing_of

AT_END = 2.97
"""Declared standard deviations at which a number stands at its end: a refit stops at three."""
_OUTSIDE = 3.0
"""Declared standard deviations beyond which a number was declared wrongly; a refit stops there."""
_CERTAIN = 2.0
"""Standard errors by which it must lie beyond."""
_MENTIONED, _MOST_MENTIONED = 2.0, 4
"""Declared standard deviations from which a refitted number is called by its name, and how many are."""


def with_numbers_let_go(
    comparison: Comparison, hypothesis: Hypothesis, criteria: Criteria
) -> Hypothesis | None:
    """Return a hypothesis with the numbers let go at whose ends a refit was stopped, if they explain enough.

    Result: refitted; nothing where no block is open or no number stands at its end, where letting go explains
    less than an effect would have to, or where the numbers end near their declared values.
    """
    stuck, every = stuck_numbers(hypothesis), excesses(hypothesis, comparison.bench, criteria)
    if not stuck or is_complete(every):
        return None
    try:
        free = comparison.polished(hypothesis, released=stuck)
    except ConvergenceError:
        return None  # numbers without a response explain nothing; the hypothesis stays as it is
    before, after = _blocks(every), _blocks(excesses(free, comparison.bench, criteria))
    left, now = (sum(e.excess for e in each.values()) for each in (before, after))
    if now > (1.0 - criteria.least_share) * left or not Change(criteria, before, after).is_more_than_noise:
        return None
    stands = [
        not criteria.objections_of_numbers(standing_of(c.unknowns, free.fits.values())) for c in free.added
    ]
    return free if all(stands) and wrong_numbers(free) else None


def stuck_numbers(hypothesis: Hypothesis) -> list[str]:
    """Return the names of the positive declared numbers that stand at the end of what their spread allows."""
    scores = {n: z for f in hypothesis.fits.values() for n, z in f.prior_z_scores().items()}
    return [n for n in positive_numbers(hypothesis) if abs(scores.get(n, 0.0)) >= AT_END]


def positive_numbers(hypothesis: Hypothesis) -> list[str]:
    """Return the names of the fitted numbers that are positive by nature."""
    return [p.name for f in hypothesis.fits.values() for p in f.parameters if p.scale == "log"]


def wrong_numbers(hypothesis: Hypothesis) -> list[str]:
    """Return in words the numbers that were let go and lie outside what their declared spread allows."""
    words = []
    for fit in hypothesis.fits.values():
        for p in fit.parameters:
            if p.name not in hypothesis.released:
                continue
            width = hypothesis.assembly.quantities()[p.name.partition("[")[0]].spread.deviation
            moved, error = math.log(fit.values[p.name] / p.centre), fit.standard_error(p.name)
            if abs(moved) - _CERTAIN * error / fit.values[p.name] <= _OUTSIDE * width:
                continue
            numbers = [with_unit(f"{each:.4g}", p.unit) for each in (p.centre, fit.values[p.name])]
            words.append(
                f"{p.name} is declared as {numbers[0]}, but the records say {numbers[1]}, "
                f"{abs(moved) / width:.1f} standard deviations away"
            )
    return words


def far_numbers(hypothesis: Hypothesis) -> list[str]:
    """Return the refitted numbers that are far from what is declared, and how many standard deviations."""
    scores = {n: z for f in hypothesis.fits.values() for n, z in f.prior_z_scores().items()}
    far = sorted((n for n, z in scores.items() if abs(z) >= _MENTIONED), key=lambda n: -abs(scores[n]))[
        :_MOST_MENTIONED
    ]
    return [f"{n} {abs(scores[n]):.1f} {'above' if scores[n] > 0.0 else 'below'}" for n in far]


def is_explained_by_numbers(
    criteria: Criteria, before: Excesses, with_effects: Excesses, with_numbers: Excesses
) -> bool:
    """Tell whether numbers let go explain plainly more than effects do, although not all.

    What is left may be as little as the inexact form of an effect may leave: a bench has friction that sticks
    or counts that round, which leave a trace whatever the numbers are. A wrong number that explains all but
    that is no reason to name an effect that explains less.
    """
    first, effects, numbers = (
        sum(each.excess for each in _blocks(every).values()) for every in (before, with_effects, with_numbers)
    )
    return numbers <= criteria.inexact * first and criteria.richer * numbers < effects


def _blocks(every: Excesses) -> Excesses:
    return {name: each for name, each in every.items() if name != DECLARED}


def sentence_of(hypothesis: Hypothesis) -> str:
    """Return one sentence on the wrong numbers of a hypothesis; empty where there are none."""
    words = wrong_numbers(hypothesis)
    return f"a declared number is probably wrong: {'; '.join(words)}" if words else ""


_FAR = 4.0
"""Declared standard deviations beyond which a number is none of this rig; a refit stops at three."""
_SHARE = 0.98
"""Share of the excess that numbers let go must explain: of an effect that the catalogue does not know they
may take up most, but not all."""
_CLOSED = 0.05
"""An effect that leaves no more than this of the excess is the simpler explanation, even if its form is not
quite right and many numbers let go come closer."""
_OUT_OF_REACH = 1.2
"""Multiple of the last declared angle of a cam beyond which records are not of this cam."""
_MOST_SHOWN = 4
"""So many numbers are listed in a message."""


class OtherNumbers(NamedTuple):
    """What can be told of records that other numbers explain."""

    words: str  # for the verdict; empty where nothing points to another rig
    decides: bool  # whether other numbers alone explain the records, better than any effect that was added


def other_numbers(
    comparison: Comparison, base: Hypothesis, better: Hypothesis, criteria: Criteria
) -> OtherNumbers:
    """Let the declared numbers go where the records take them, if a refit has driven some to their ends."""
    before, after = _left(base, comparison.bench, criteria), _left(better, comparison.bench, criteria)
    scores = {n: z for f in better.fits.values() for n, z in f.prior_z_scores().items()}
    stuck = [n for n, z in scores.items() if abs(z) >= AT_END]
    if len(stuck) < 2 or not before:
        return OtherNumbers("", False)
    try:
        free = comparison.polished(base, released=positive_numbers(base))
    except ConvergenceError:
        return OtherNumbers("", False)  # numbers without a response explain nothing: they are none of a rig
    left, far = _left(free, comparison.bench, criteria), _far_numbers(free, base)
    share = 1.0 - left / before
    if far and numbers_explain(share, left=left, after=after, before=before, named=better is not base):
        words = (
            f"the records may be of another rig: with its numbers free the declared model explains "
            f"{100.0 * share:.3g} % of the excess without any effect, but then {'; '.join(far)}"
        )
        return OtherNumbers(words, True)
    if 2 * len(stuck) < len(scores):
        return OtherNumbers("", False)
    shown = ", ".join(stuck[:_MOST_SHOWN]) + (", ..." if len(stuck) > _MOST_SHOWN else "")
    words = (
        f"{len(stuck)} of {len(scores)} refitted numbers stand at the end of what their declared spread "
        f"allows ({shown}): the records may be of another rig"
    )
    return OtherNumbers(words, False)


def numbers_explain(share: float, *, left: float, after: float, before: float, named: bool) -> bool:
    """Tell whether numbers let go explain records, and better than an effect."""
    effect_is_simpler = named and after <= _CLOSED * before
    return share >= _SHARE and left < 0.5 * after and not effect_is_simpler


def _left(hypothesis: Hypothesis, bench: Bench, criteria: Criteria) -> float:
    return sum(e.excess for name, e in excesses(hypothesis, bench, criteria).items() if name != DECLARED)


def _far_numbers(free: Hypothesis, base: Hypothesis) -> list[str]:
    """Return in words the numbers that lie far outside their declared values, furthest first."""
    far = []
    for fit in free.fits.values():
        for p in fit.parameters:
            value = fit.values[p.name]
            if p.scale != "log" or value <= 0.0:
                continue
            width = base.assembly.quantities()[p.name.partition("[")[0]].spread.deviation
            moved, error = math.log(value / p.centre), fit.standard_error(p.name) / value
            if abs(moved) - 2.0 * error > _FAR * width:
                number = with_unit(f"{value:.3g}", p.unit)
                words = f"{p.name} is {number}, {abs(moved) / width:.0f} standard deviations away"
                far.append((abs(moved) / width, words))
    return [words for _, words in sorted(far, key=lambda pair: -pair[0])][:3]


def out_of_reach(actuator: Assembly, records: RecordSet) -> list[Finding]:
    """Return the records whose angle goes far beyond the end of the declared cam.

    ``records``: measured. Where more than one angle is measured nothing is said.
    """
    model = flatten(actuator)
    ends = [cam.last_angle for spring in model.springs for cam in spring.cams if cam.last_angle]
    shown = {s: reading_of(model.readings, s).measured for s in records.signals}
    angles = [s for s, name in shown.items() if model.variable(name).unit == "rad"]
    if len(angles) != 1 or len(ends) != 1:
        return []
    name, end = ends[0], model.values[ends[0]]
    column, findings = records.column(angles[0]), []
    for record in records.records:
        size = np.abs(record.trace[angles[0]])
        if float(size.max()) > _OUT_OF_REACH * end:
            outside = record.trace.time[size > end]
            findings.append(
                Finding(
                    f"{record.source}: column '{column.name}', {outside[0]:.4g} s to {outside[-1]:.4g} s",
                    f"goes to {size.max():.3g} rad, the declared cam ends at {end:.3g} rad ({name}): "
                    "the unit is another one, or these are records of another rig",
                )
            )
    return findings
