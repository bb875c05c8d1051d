"""What is seen before any fit: forces that lag the extension they belong to, modes too quick for a log."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from typing import NamedTuple

import casadi as ca
import numpy as np

from ....components.assembly.named_parts import Assembly
from ....foundation.arrays import Array
from ....foundation.errors import ValueRangeError
from ....foundation.symbolic import depends
from ....model import FlatModel, flatten
from ....model.linear import linearise
from ....model.readings import reading_of
from ....model.structure import motions_of_efforts
from ...identification.filters import derivative
from ...identification.records.measurement import Record, RecordSet
from ...identification.records.quality import Finding
from ...identification.residuals import Loop, loop_of
from ..block_prediction import shown_values

_QUICK_OVER_SLOW = 3.0
"""Ratio of paces of records from which a constant delay can be told from another cause."""
_LEAST_SAMPLES = 6.0
"""Samples per period of an oscillation from which derivatives are true to 0.1 %, see `filters.derivative`."""
_SPANS = 50
"""Spans in a record over which its rate is taken: enough for thirty periods."""


def modes_too_quick(assembly: Assembly, step: float) -> tuple[Finding, ...]:
    """Return a remark if the quickest oscillation of a machine has too few samples a period.

    ``step``: time in s from one sample to the next.
    """
    model = flatten(assembly)
    try:
        rates = np.linalg.eigvals(linearise(model, model.start(model.states).tolist())[0])
    except ValueRangeError:
        return ()  # at rest the machine stands at a corner
    swinging = np.abs(rates)[np.abs(rates.imag) > np.abs(rates.real)]
    quickest = float(np.max(swinging, initial=0.0)) / (2.0 * np.pi)
    rate = 1.0 / step
    if rate >= _LEAST_SAMPLES * quickest:
        return ()
    text = (
        f"are sampled at {rate:.4g} Hz, and the quickest mode of the declared machine swings at "
        f"{quickest:.3g} Hz: {rate / quickest:.2g} samples a period do not show it, and what it does may be "
        f"taken for something else; log at {2.0 * _LEAST_SAMPLES * quickest:.3g} Hz or more"
    )
    return (Finding("records", text),)


class LaggingForces(NamedTuple):
    """Forces that lag."""

    findings: tuple[Finding, ...]  # one for each record over which a piece would give work
    # testable: whether the records are quick and slow enough, side by side, to tell a delayed sensor by what
    # it does at each speed; if not, it cannot be told from channels that do not belong together
    testable: bool


def lagging_forces(assembly: Assembly, records: RecordSet) -> LaggingForces:
    """Return measured forces that give work over closed paths and never take any: no passive piece can."""
    model, motions = flatten(assembly), motions_of_efforts(assembly)
    findings: list[Finding] = []
    pace: list[float] = []
    for signal in records.signals:
        reading = reading_of(model.readings, signal)
        motion = motions.get(reading.measured) if reading.shows_value else None
        extension = _extension(model, motion, records.signals) if motion else None
        if motion is None or extension is None:
            continue
        noise = float(np.median([r.resolution_of(signal).noise for r in records.records]))
        paths = [(r, extension(r)) for r in records.records]
        loops = [
            (r, loop)
            for r, path in paths
            if (loop := loop_of(path, shown_values(model, r, signal), r.step, noise=noise)) is not None
        ]
        if any(loop.gives for _, loop in loops) and not any(loop.takes for _, loop in loops):
            head = records.column(signal).name
            findings += [_finding(r, head, motion, loop) for r, loop in loops if loop.gives]
            pace += [_pace(path, r.step) for r, path in paths]
    return LaggingForces(tuple(findings), bool(pace) and max(pace) > _QUICK_OVER_SLOW * min(pace))


def _pace(path: Array, step: float) -> float:
    """Return a typical angular frequency: rate over size, root mean squares."""
    rate = derivative(path, step, order=1, span=len(path) * step / _SPANS)
    return float(np.sqrt(np.mean(rate**2)) / max(float(np.std(path)), 1e-300))


def _finding(record: Record, head: str, motion: str, loop: Loop) -> Finding:
    return Finding(
        f"{record.source or record.name}: column '{head}', samples {loop.first + 1} to {loop.last + 1}",
        f"lags {motion}: the piece would give {-1e3 * loop.work:.3g} mJ over a closed path "
        f"(∮F dδ < 0, {-100 * loop.share:.2g} % of the work that goes in and out), which no passive one can; "
        f"a force that comes at least {1e3 * loop.late_by:.2g} ms late does. Are the channels on one clock?",
    )


def _extension(model: FlatModel, motion: str, signals: Sequence[str]) -> Callable[[Record], Array] | None:
    """Return a motion as a function of a record, if it follows from what is measured."""
    names = [v.name for v in model.signals]
    if motion not in names:
        return None
    s = model.symbols()
    row = ca.SX(s.signal[names.index(motion)])
    row = ca.substitute(row, s.parameter, ca.DM(model.start(model.parameters)))
    movable = {v.name: s.state[i] for i, v in enumerate(model.states)}
    movable |= {v.name: s.input[i] for i, v in enumerate(model.inputs)}
    readings = [r for r in (reading_of(model.readings, signal) for signal in signals) if r.shows_value]
    known = [(movable[r.measured], r.signal) for r in readings if r.measured in movable]
    hidden = [symbol for name, symbol in movable.items() if name not in {r.measured for r in readings}]
    if not known or (hidden and depends(row, ca.vertcat(*hidden))):
        return None
    function = ca.Function("extension", [ca.vertcat(*[symbol for symbol, _ in known])], [row])

    def at(record: Record) -> Array:
        rows = np.array([shown_values(model, record, signal) for _, signal in known])
        values: Array = function.map(rows.shape[1])(rows).full().ravel()
        return values

    return at
