"""Check of scale: a measured signal many times as large as the refitted model says, or turned in sign."""

from __future__ import annotations

from collections.abc import Mapping

import numpy as np

from ....components.assembly.named_parts import Assembly
from ....foundation.arrays import Array
from ....model import FlatModel, flatten
from ....model.readings import ReadingNames, reading_of
from ....model.structure import MovingBody, top_part
from ...identification.equation_error.block_noise import rate_span
from ...identification.filters import derivative
from ...identification.records.measurement import RecordSet
from ...identification.records.quality import Finding
from ..blocks.shown_values import shown_values
from ..effects.places import efforts_of_ties
from ..effects.sizes import LONGEST, QUICKEST, Sizes, efforts_on
from ..selection.comparison import Comparison
from ..selection.hypothesis import Hypothesis

_FACTOR = 4.0
"""Factor between measured and predicted beyond which a unit or a sign is wrong: no effect is that large."""
_USUAL = 0.998
"""Share of the samples that do not exceed the size of a signal: the others are taken for spikes."""


def typical_sizes(actuator: Assembly, records: RecordSet) -> Sizes:
    """Return the size of each signal of the declared model on the records, of efforts and of times.

    The model is evaluated where one of the measured signals, or the rate of a measured motion, is as large as
    it becomes; a single sample that stands out is not taken for a size.
    """
    model = flatten(actuator)
    sizes = {LONGEST: max(float(r.trace.time[-1] - r.trace.time[0]) for r in records.records)}
    quickest: dict[str, float] = {}
    signal_of = {r.measured: r.signal for r in _shown(model, records)}
    spans = {name: rate_span(records.records, signal) for name, signal in signal_of.items()}
    for record in records.records:
        known = {s: np.asarray(record.trace[s], float) for s in records.signals}
        shown = {r.measured: shown_values(model, record, r.signal) for r in _shown(model, records)}
        moving = [b for b in model.bodies if b.motion in shown]
        shown |= {
            b.rate: _rate(shown[b.motion], record.step, spans[b.motion])
            for b in moving
            if b.rate not in shown
        }
        for body in moving:
            time = _rms(shown[body.motion] - np.mean(shown[body.motion])) / max(
                _rms(shown[body.rate]), 1e-300
            )
            quickest[body.name] = min(time or np.inf, quickest.get(body.name, np.inf))
        _enlarge(sizes, {name: _large(values)[0] for name, values in {**known, **shown}.items()})
        for place in {_large(values)[1] for values in shown.values()}:
            state, inputs = (
                [float(shown[v.name][place]) if v.name in shown else v.start for v in variables]
                for variables in (model.states, model.inputs)
            )
            _enlarge(sizes, model.evaluate(state, inputs))
    sizes |= {QUICKEST: min(quickest.values())} if quickest else {}
    for body in model.bodies:
        sizes[efforts_on(body.name)] = _effort(actuator, model, body, sizes, quickest.get(body.name))
    return Sizes({name: value for name, value in sizes.items() if 0.0 < value < np.inf})


def _shown(model: FlatModel, records: RecordSet) -> list[ReadingNames]:
    """Return what the measured signals show, as far as it can be inferred from them."""
    readings = (reading_of(model.readings, signal) for signal in records.signals)
    return [reading for reading in readings if reading.shows_value]


def _effort(
    actuator: Assembly, model: FlatModel, body: MovingBody, sizes: Mapping[str, float], quickest: float | None
) -> float:
    """Return the largest effort on a body: of what is tied to it, of its drive, or of its inertia."""
    unit = body.domain.effort_unit
    own = {
        v.name for v in (*model.signals, *model.inputs) if v.unit == unit and top_part(v.name) == body.name
    }
    names = {*own, *efforts_of_ties(actuator, body.name)}
    inertia = model.values.get(str(body.inertia), sizes.get(str(body.inertia), 0.0))
    inertial = inertia * sizes.get(body.rate, 0.0) / quickest if quickest else 0.0
    return max([inertial, *(sizes.get(name, 0.0) for name in names)])


def _enlarge(sizes: dict[str, float], values: Mapping[str, float]) -> None:
    for name, value in values.items():
        sizes[name] = max(abs(value), sizes.get(name, 0.0))


def _large(values: Array) -> tuple[float, int]:
    """Return how large a signal becomes but for single samples, and a sample at which it is that large."""
    size = np.abs(values)
    level = float(np.quantile(size, _USUAL))
    return level, int(np.argmin(np.abs(size - level)))


def _rate(motion: Array, step: float, span: float) -> Array:
    """Return the rate of a motion; at both ends of a record, where the filter reaches beyond, that beside."""
    rate, reach = derivative(motion, step, order=1, span=span), max(2, round(0.5 * span / step) + 1)
    if len(rate) > 2 * reach:
        rate[:reach], rate[-reach:] = rate[reach], rate[-reach - 1]
    return rate


def _rms(values: Array) -> float:
    return float(np.sqrt(np.mean(values**2)))


def scale_findings(comparison: Comparison, base: Hypothesis) -> list[Finding]:
    """Return records whose measured signal is many times, or a small part of, what the model predicts."""
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
        "is the motion in degrees, not in the stated unit?": np.pi / 180.0,
    }
    close = [words for words, size in usual.items() if 0.5 < ratio / size < 2.0]
    return f"; {close[0]}" if close else "; are these records of another rig?"
