"""What a model predicts of a measured record, block by block."""

from __future__ import annotations

import casadi as ca
import numpy as np

from ...components.assembly.named_parts import Assembly
from ...errors import unknown_name
from ...identification.equation_error.block import Block
from ...identification.equation_error.evidence import Bench
from ...identification.equation_error.filter_choice import measured_inputs
from ...identification.records.measurement import Record, RecordSet
from ...model import flatten
from ...simulation import RangeWarning, Trace, range_warnings, simulate
from ...symbolic import depends
from .tearing import blocks_of


def predict(actuator: Assembly, records: RecordSet, name: str) -> Trace:
    """Drive an actuator with the measured signals of a record.

    Parameters
    ----------
    actuator
        Declared, or as a diagnosis has left it.
    records
        Measured.
    name
        Of the record.

    Returns
    -------
    Trace
        Every measured force or torque as predicted from the measured motion, and the torque that each moving
        body is short of, which would vanish in a perfect model. Its warnings name the laws that the measured
        motion takes out of their stated range.

    Raises
    ------
    UnknownNameError
        If there is no such record.
    MeasurementError
        If nothing measured drives the model.
    """
    chosen = [r for r in records.records if r.name == name]
    if not chosen:
        raise unknown_name("record", name, (r.name for r in records.records))
    blocks = blocks_of(flatten(actuator), records.signals)
    bench = Bench(records, blocks)
    signals, units = {}, {}
    for block in blocks:
        for each in bench.evidence(bench.driven(block, []), chosen, {}):
            shown = block.target or block.output
            signals[shown], units[shown] = each.predicted({}), block.model.outputs[0].unit
    warnings = {each.name: each for block in blocks for each in _range_warnings(block, chosen[0], bench)}
    return Trace(chosen[0].trace.time, signals, units, name, warnings=tuple(warnings.values()))


def ranges_left(actuator: Assembly, records: RecordSet) -> tuple[tuple[str, RangeWarning], ...]:
    """Return the laws that the measured motions take out of their stated range, each with the worst record.

    Parameters
    ----------
    actuator
        Declared, or as a diagnosis has left it.
    records
        Measured.

    Raises
    ------
    MeasurementError
        If nothing measured drives the model.
    """
    model = flatten(actuator)
    if not any(v.bounded for v in model.signals + model.states):
        return ()
    blocks = blocks_of(model, records.signals)
    bench = Bench(records, blocks)
    worst: dict[str, tuple[str, RangeWarning]] = {}
    for record in records.records:
        for warning in (each for block in blocks for each in _range_warnings(block, record, bench)):
            if warning.name not in worst or _excess(warning) > _excess(worst[warning.name][1]):
                worst[warning.name] = record.name, warning
    return tuple(worst.values())


def _excess(warning: RangeWarning) -> float:
    return max(warning.minimum - warning.furthest, warning.furthest - warning.maximum)


def _range_warnings(block: Block, record: Record, bench: Bench) -> tuple[RangeWarning, ...]:
    """Return where the measured motion takes a law of the block out of its stated range."""
    model, time = block.model, record.trace.time
    if not any(v.bounded for v in model.signals + model.states):
        return ()
    rows = measured_inputs(block, record, bench.filters[block.name].span)
    s = model.symbols()
    if any(v.bounded for v in model.states) or depends(s.signal, s.state):
        inputs = {v.name: row for v, row in zip(model.inputs, rows, strict=True)}
        return simulate(model, time, inputs=inputs, tolerance=1e-6).warnings
    state, values = model.start(model.states), model.start(model.parameters)
    computed = np.array(ca.densify(model.equations(0.0, state, rows, values, np.zeros(0))[2]))
    signals = {v.name: computed[i] for i, v in enumerate(model.signals)}
    return range_warnings(model.signals, time, signals)
