"""Check of scale and sign: a signal many times as large as the model says, or turned, is no missing effect.

A measured force is compared with what the refitted model predicts. A drive, a command or a current, is
an input: nothing predicts it, but a balance of efforts asks for one. Where what was measured is that drive
many times over or turned, the records are taken with that undone: if the declared model then leaves next to
nothing of the error, no effect is looked for. The second look is needed because an effect that outweighs all
others, such as a weight that the deck lacks, turns the sign of what a balance asks for as well.
"""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from dataclasses import replace

import casadi as ca
import numpy as np

from ....components.assembly.named_parts import Assembly
from ....foundation.arrays import Array
from ....foundation.errors import ConvergenceError, MeasurementError
from ....foundation.quantity import same_dimension
from ....model import FlatModel, flatten
from ....model.readings import reading_of
from ....model.structure import MovingBody, top_part
from ...identification.equation_error.block import Block
from ...identification.equation_error.block_noise import rate_span
from ...identification.equation_error.block_response import DrivenBlock
from ...identification.equation_error.evidence import Bench
from ...identification.filters import derivative
from ...identification.records.measurement import Record, RecordSet
from ...identification.records.quality import Finding
from ..block_prediction import shown_values
from ..effects.places import efforts_of_ties
from ..effects.sizes import LONGEST, MIDDLE, QUICKEST, SHIFT, Sizes, efforts_on, span_of
from ..selection.comparison import Comparison, Judged
from ..selection.hypothesis import Hypothesis
from ..tearing import behind_declared_ratio, blocks_of, measured_signals


class Acting:
    """The signal or effort beside which the error of a block is judged.

    A block with a target is judged beside that signal; a balance of efforts beside the effort of the drive,
    or beside the largest measured effort on a body without a drive, or beside its inertial effort.

    ``model``: the whole model; its bodies say which signals drive them.
    """

    def __init__(self, bench: Bench, model: FlatModel) -> None:
        self._bench, self._model = bench, model
        self._driven: dict[Block, DrivenBlock] = {}

    def name(self, block: Block) -> str:
        """Return the name of the signal or effort, for people."""
        if block.target is not None:
            return block.target
        drives, others = self._outside(block)
        body = next((b for b in self._model.bodies if b.name == block.name), None)
        effort = body.domain.effort if body is not None else "effort"
        if drives:
            return f"{effort} of the drive"
        return f"measured {effort}" if others else f"{effort} of the inertia"

    def drives(self, block: Block) -> list[str]:
        """Return the measured signals that drive the body of a balance."""
        return self._outside(block)[0]

    def filtered(self, judged: Judged) -> Array:
        """Return the signal or effort over a record, filtered as the error is, in the unit of the block."""
        block, trace = judged.block, judged.record.trace
        if block.target is not None:
            result: Array = judged.floor.filter @ np.asarray(trace[block.target])
            return result
        drives, others = self._outside(block)
        groups = [drives] if drives else [[signal] for signal in others]
        raw = [self._effort(judged, group) for group in groups] or [_inertial_effort(judged)]
        efforts = [judged.floor.filter @ each for each in raw]
        return max(efforts, key=lambda effort: float(np.std(effort)))

    def _effort(self, judged: Judged, signals: Sequence[str]) -> Array:
        """Return what signals add to the efforts on a body: the balance without them less that with them."""
        block, record = judged.block, judged.record
        if block not in self._driven:
            self._driven[block] = self._bench.driven(block, ())
        silent = {
            name: np.zeros_like(values) for name, values in record.trace.signals.items() if name in signals
        }
        trace = replace(record.trace, signals={**record.trace.signals, **silent})
        (without,) = self._bench.evidence(self._driven[block], [replace(record, trace=trace)], {})
        effort: Array = without.predicted({}) - judged.predicted
        return effort

    def _outside(self, block: Block) -> tuple[list[str], list[str]]:
        """Return the measured signals that drive the body of a balance, and other measured efforts on it."""
        symbols, drives = block.model.symbols(), block.drives
        acts = ca.which_depends(symbols.output, symbols.input, 1, False)
        acting = [
            v.name for v, does in zip(block.model.inputs, acts, strict=True) if does and v.name in drives
        ]
        moving = {d.signal for d in drives.values() if d.order > 0}
        others = [s for s in dict.fromkeys(drives[name].signal for name in acting) if s not in moving]
        bodies = [body for body in self._model.bodies if body.name == block.name]
        own = {name for body in bodies for name in (*body.drives, *body.acting)}
        driving = [s for s in others if reading_of(self._model.readings, s).measured in own]
        return driving, [s for s in others if s not in driving]


def _inertial_effort(judged: Judged) -> Array:
    """Return inertia times acceleration over a record, unfiltered."""
    block, record = judged.block, judged.record
    model, effort = block.model, np.zeros(len(record.trace))
    for place, variable in enumerate(model.inputs):
        drive = block.drives.get(variable.name)
        if drive is not None and drive.order == 2:
            s = model.symbols()
            slope = ca.Function(
                "inertia",
                [s.state, s.input, s.parameter, s.table],
                [ca.densify(ca.jacobian(s.output, s.input[place]))],
            )
            start = (model.start(each) for each in (model.states, model.inputs, model.parameters))
            inertia = float(slope(*start, np.zeros(0)))
            effort = effort + inertia * derivative(record.trace[drive.signal], record.step, order=2)
    return effort


_FACTOR = 4.0
"""Factor between measured and predicted beyond which a unit or a sign is wrong: no effect is that large."""
_ALIKE = 0.5
"""Share of the squares of a signal that the prediction must explain, times that factor."""
_USUAL = 0.998
"""Share of the samples that do not exceed the size of a signal: the others are taken for spikes."""


def typical_sizes(actuator: Assembly, records: RecordSet) -> Sizes:
    """Return the size of each signal of the declared model on the records, of efforts and of times.

    The model is evaluated where one of the measured signals, or the rate of a measured motion, is as large as
    it becomes; a single sample that stands out is not taken for a size.
    """
    model = flatten(actuator)
    sizes = {LONGEST: max(float(r.trace.time[-1] - r.trace.time[0]) for r in records.records)}
    sizes[MIDDLE] = 0.5 * sizes[LONGEST]
    sizes[SHIFT] = records.shift
    quickest: dict[str, float] = {}
    ends: dict[str, list[float]] = {}
    seen = [m for m in measured_signals(model, records.signals) if m.reading.shows_value]
    spans = {m.shown: rate_span(records.records, m.signal) for m in reversed(seen)}
    for record in records.records:
        known = {s: np.asarray(record.trace[s], float) for s in records.signals}
        read = {m.reading.measured: shown_values(model, record, m.signal) for m in seen}
        shown = {m.shown: behind_declared_ratio(model, m, read[m.reading.measured]) for m in reversed(seen)}
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
        _enlarge(sizes, {name: _large(values)[0] for name, values in {**known, **read, **shown}.items()})
        for body in moving:
            ends.setdefault(body.motion, []).extend(np.quantile(shown[body.motion], (1.0 - _USUAL, _USUAL)))
        for place in {_large(values)[1] for values in shown.values()}:
            state, inputs = (
                [float(shown[v.name][place]) if v.name in shown else v.start for v in variables]
                for variables in (model.states, model.inputs)
            )
            _enlarge(sizes, model.evaluate(state, inputs))
    sizes |= {span_of(name): float(np.ptp(values)) for name, values in ends.items()}
    sizes |= {QUICKEST: min(quickest.values())} if quickest else {}
    for body in model.bodies:
        sizes[efforts_on(body.name)] = _effort(actuator, model, body, sizes, quickest.get(body.name))
        for part in body.geared:
            motion, rate = (f"{part}.{name}" for name in actuator[part].motion_names)  # type: ignore[attr-defined]
            ratio = sizes.get(body.rate, 0.0) / (sizes.get(rate, 0.0) or math.inf)
            sizes[efforts_on(part)] = ratio * sizes[efforts_on(body.name)]
            sizes[span_of(motion)] = sizes.get(span_of(body.motion), 0.0) / (ratio or math.inf)
    return Sizes({name: value for name, value in sizes.items() if 0.0 < value < np.inf})


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
    """Return records whose measured signal is many times, or a small part of, what the model predicts.

    It must have the course of that: where a stiff spring lies between two encoders, a fault of one of them
    makes the prediction many times as large, and of another course.
    """
    findings = []
    for judged in comparison.judged(base):
        target = judged.block.target
        if target is None:
            continue
        measured, predicted = judged.record.trace[target], judged.predicted
        ratio = float(measured @ predicted) / max(float(predicted @ predicted), 1e-300)
        alike = ratio * float(measured @ predicted) / max(float(measured @ measured), 1e-300)
        if alike > _ALIKE and not 1.0 / _FACTOR < ratio < _FACTOR:
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


_USUAL_SHARE: Mapping[float, str] = {
    -1.0: "the sign is turned",
    1e3: "is it in thousandths of the stated unit?",
    1e-3: "is it in thousands of the stated unit?",
}
_BEYOND_LIMIT, _OFTEN = 10.0, 0.9
"""Times the declared limit of its drive that a current cannot be for the rest of this share of a record."""
_NEAR = 5.0
"""Factor from one of these within which records make it suspect: the refit has bent numbers to meet them."""
_LEFT = 0.02
"""Share of the mean square error that may be left with the factor undone."""


def limit_findings(model: FlatModel, records: RecordSet) -> list[Finding]:
    """Return the columns of currents that are far beyond what their drive is declared to allow."""
    findings = []
    for body in model.bodies:
        name = body.motor.current_limit if body.motor else ""
        limit, own = model.values.get(name, math.inf), {*body.commands, *body.acting}
        for column in (c for c in records.columns if same_dimension(c.unit, "A")):
            sizes = [float(np.quantile(np.abs(r.trace[column.signal]), _OFTEN)) for r in records.records]
            drives = reading_of(model.readings, column.signal).measured in own
            if drives and max(sizes) > _BEYOND_LIMIT * limit:
                text = (
                    f"is above {max(sizes):.3g} A for a tenth of a record, and {name} is declared as "
                    f"{limit:.3g} A; is it in thousandths of the stated unit?"
                )
                findings.append(Finding(f"column '{column.name}'", text))
    return findings


def drive_findings(actuator: Assembly, comparison: Comparison, base: Hypothesis) -> list[Finding]:
    """Return the drives whose sign or unit is another than stated, with what shows it."""
    findings = []
    records = comparison.bench.records
    for block, (signal, ratios) in _asked(comparison, base).items():
        for factor, words in _USUAL_SHARE.items():
            if not all(1.0 / _NEAR < ratio / factor < _NEAR for ratio in ratios):
                continue
            undone = refitted(actuator, with_signals(records, {signal: (signal, 1.0 / factor)}))
            before = error_share(comparison, base, block)
            if undone and (left := error_share(*undone, block)) <= _LEFT * before:
                share = 100.0 * (1.0 - left / before)
                text = (
                    f"is {_range(ratios)} times what '{block}' asks of the drive; with that undone the "
                    f"declared model explains {share:.4g} % of the error: {words}"
                )
                findings.append(Finding(f"column '{records.column(signal).name}'", text))
    return findings


def _range(ratios: list[float]) -> str:
    low, high = f"{min(ratios, key=abs):.3g}", f"{max(ratios, key=abs):.3g}"
    return low if low == high else f"{low} to {high}"


def _asked(comparison: Comparison, base: Hypothesis) -> dict[str, tuple[str, list[float]]]:
    """Return the measured drive of each balance, and by record how many times as large as asked for it is."""
    acting, asked = Acting(comparison.bench, flatten(base.fitted)), dict[str, tuple[str, list[float]]]()
    for judged in comparison.judged(base):
        drives = acting.drives(judged.block) if judged.block.target is None else []
        if len(drives) != 1:
            continue  # of several it cannot be told which one is wrong
        measured = acting.filtered(judged)
        needed = measured - judged.error
        ratio = float(measured @ needed) / max(float(needed @ needed), 1e-300)
        asked.setdefault(judged.block.name, (drives[0], []))[1].append(ratio)
    return asked


def error_share(comparison: Comparison, base: Hypothesis, block: str) -> float:
    """Return the mean square error of a balance as a share of that of the effort of its drive."""
    acting, error, effort = Acting(comparison.bench, flatten(base.fitted)), 0.0, 0.0
    for judged in comparison.judged(base):
        if judged.block.name == block:
            measured = acting.filtered(judged)
            error, effort = error + float(judged.error @ judged.error), effort + float(measured @ measured)
    return error / max(effort, 1e-300)


def refitted(actuator: Assembly, records: RecordSet) -> tuple[Comparison, Hypothesis] | None:
    """Return the declared model refitted to records that are read otherwise; None where it cannot be."""
    try:
        bench = Bench(records, blocks_of(flatten(actuator), records.signals))
        comparison = Comparison(bench, typical_sizes(actuator, bench.records))
        return comparison, comparison.base(actuator)
    except (ConvergenceError, MeasurementError):
        return None  # then that is not what is wrong


def with_signals(records: RecordSet, taken: Mapping[str, tuple[str, float]]) -> RecordSet:
    """Return the records with each of some signals taken from another or from itself, times a factor."""

    def changed(record: Record) -> Record:
        signals = {to: factor * record.trace[source] for to, (source, factor) in taken.items()}
        sharp = {
            to: each._replace(noise=abs(factor) * each.noise, quantum=abs(factor) * each.quantum)
            for to, (source, factor) in taken.items()
            if (each := record.resolution.get(source))
        }
        trace = replace(record.trace, signals={**record.trace.signals, **signals})
        return replace(record, trace=trace, resolution={**record.resolution, **sharp})

    return replace(records, records=tuple(map(changed, records.records)))
