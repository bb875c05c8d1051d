"""Check of a drive: a command or a current whose sign is turned, or whose unit is a thousand times another.

A measured force is compared with what the model predicts. A drive is an input: nothing predicts it, but a
balance of efforts asks for one. Where what was measured is that drive many times over or turned, the
records are taken with that undone: if the declared model then leaves next to nothing of the error, no
effect is looked for. The second look is needed because an effect that outweighs all others, such as a
weight that the deck lacks, turns the sign of what a balance asks for as well.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import replace

from ....components.assembly.named_parts import Assembly
from ....foundation.errors import ConvergenceError, MeasurementError
from ....model import flatten
from ...identification.equation_error.evidence import Bench
from ...identification.records.measurement import Record, RecordSet
from ...identification.records.quality import Finding
from ..blocks.tearing import blocks_of
from ..selection.comparison import Comparison
from ..selection.hypothesis import Hypothesis
from .acting_effort import Acting
from .scale_check import typical_sizes

_USUAL: Mapping[float, str] = {
    -1.0: "the sign is turned",
    1e3: "is it in thousandths of the stated unit?",
    1e-3: "is it in thousands of the stated unit?",
}
_NEAR = 5.0
"""Factor from one of these within which records make it suspect: the refit has bent numbers to meet them."""
_LEFT = 0.02
"""Share of the mean square error that may be left with the factor undone."""


def drive_findings(actuator: Assembly, comparison: Comparison, base: Hypothesis) -> list[Finding]:
    """Return the drives whose sign or unit is another than stated, with what shows it."""
    findings = []
    records = comparison.bench.records
    for block, (signal, ratios) in _asked(comparison, base).items():
        for factor, words in _USUAL.items():
            if not all(1.0 / _NEAR < ratio / factor < _NEAR for ratio in ratios):
                continue
            left = _left_with(actuator, _divided(records, signal, factor), block)
            before = _error_share(comparison, base, block)
            if left is not None and left <= _LEFT * before:
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


def _error_share(comparison: Comparison, base: Hypothesis, block: str) -> float:
    """Return the mean square error of a balance as a share of that of the effort of its drive."""
    acting, error, effort = Acting(comparison.bench, flatten(base.fitted)), 0.0, 0.0
    for judged in comparison.judged(base):
        if judged.block.name == block:
            measured = acting.filtered(judged)
            error, effort = error + float(judged.error @ judged.error), effort + float(measured @ measured)
    return error / max(effort, 1e-300)


def _left_with(actuator: Assembly, records: RecordSet, block: str) -> float | None:
    """Return the share of the effort that the refitted declared model leaves on other records."""
    try:
        bench = Bench(records, blocks_of(flatten(actuator), records.signals))
        comparison = Comparison(bench, typical_sizes(actuator, bench.records))
        return _error_share(comparison, comparison.base(actuator), block)
    except (ConvergenceError, MeasurementError):
        return None  # then that is not what is wrong


def _divided(records: RecordSet, signal: str, factor: float) -> RecordSet:
    """Return the records with one signal divided by a factor."""
    size = abs(factor)

    def changed(record: Record) -> Record:
        signals = {**record.trace.signals, signal: record.trace[signal] / factor}
        sharp = {
            name: each._replace(noise=each.noise / size, quantum=each.quantum / size)
            if name == signal
            else each
            for name, each in record.resolution.items()
        }
        return replace(record, trace=replace(record.trace, signals=signals), resolution=sharp)

    columns = tuple(
        replace(c, noise=c.noise / size, quantum=c.quantum / size) if c.signal == signal else c
        for c in records.columns
    )
    return replace(records, records=tuple(map(changed, records.records)), columns=columns)
