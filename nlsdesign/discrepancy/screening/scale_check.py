"""Check of scale: a measured signal many times as large as the refitted model says, or turned in sign."""

from __future__ import annotations

from collections.abc import Mapping

import numpy as np

from ...components.assembly.named_parts import Assembly
from ...identification.records.measurement import RecordSet
from ...identification.records.quality import Finding
from ...model import FlatModel, flatten
from ...model.readings import reading_of
from ..blocks.shown_values import shown_values
from ..selection.comparison import Comparison
from ..selection.hypothesis import Hypothesis

_FACTOR = 4.0
"""Factor between measured and predicted beyond which a unit or a sign is wrong: no effect is that large."""


def typical_sizes(actuator: Assembly, records: RecordSet) -> dict[str, float]:
    """Return the size of each signal of the declared model where the measured signals are largest.

    Parameters
    ----------
    actuator
        As declared.
    records
        All records.
    """
    model = flatten(actuator)
    measured = {s: max(float(np.max(np.abs(r.trace[s]))) for r in records.records) for s in records.signals}
    readings = (reading_of(model.readings, signal) for signal in records.signals)
    shown = {r.measured: _largest(model, records, r.signal) for r in readings if r.shows_value}
    state = [shown.get(v.name, v.start) for v in model.states]
    inputs = [shown.get(v.name, v.start) for v in model.inputs]
    computed = {name: abs(value) for name, value in model.evaluate(state, inputs).items()}
    return {name: value for name, value in (computed | shown | measured).items() if value > 0.0}


def _largest(model: FlatModel, records: RecordSet, signal: str) -> float:
    return max(float(np.max(np.abs(shown_values(model, record, signal)))) for record in records.records)


def scale_findings(comparison: Comparison, base: Hypothesis) -> list[Finding]:
    """Return records whose measured signal is many times, or a small part of, what the model predicts.

    Parameters
    ----------
    comparison
        Evaluates hypotheses.
    base
        Refitted declared model.
    """
    findings = []
    for judged in comparison.judged(base):
        target = judged.block.target
        if target is None:
            continue
        measured, predicted = judged.record.trace[target], judged.predicted
        ratio = float(measured @ predicted) / max(float(predicted @ predicted), 1e-300)
        if not 1.0 / _FACTOR < ratio < _FACTOR:
            head = comparison.bench.records.column(target).name
            findings.append(
                Finding(
                    f"{judged.record.source}: column '{head}'",
                    f"is {ratio:.3g} times what the refitted model predicts from the motion" + _hint(ratio),
                )
            )
    return findings


def _hint(ratio: float) -> str:
    usual: Mapping[str, float] = {
        "the sign is turned": -1.0,
        "is it in thousandths of the stated unit?": 1e3,
        "is it in thousands of the stated unit?": 1e-3,
        "degrees for radians?": 180.0 / np.pi,
    }
    close = [words for words, size in usual.items() if 0.5 < ratio / size < 2.0]
    return f"; {close[0]}" if close else "; are these records of another rig?"
