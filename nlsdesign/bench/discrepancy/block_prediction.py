"""What a model predicts of a measured record, block by block, and what a signal shows of the model."""

from __future__ import annotations

from typing import NamedTuple

import casadi as ca
import numpy as np

from ...components.assembly.named_parts import Assembly
from ...foundation.arrays import Array
from ...foundation.errors import unknown_name
from ...foundation.symbolic import depends
from ...model import FlatModel, flatten
from ...model.readings import reading_of
from ...simulation import RangeWarning, Trace, range_warnings, simulate
from ..identification.equation_error.block import Block
from ..identification.equation_error.block_noise import measured_inputs
from ..identification.equation_error.evidence import Bench
from ..identification.records.measurement import Record, RecordSet
from .tearing import blocks_of


def shown_values(model: FlatModel, record: Record, signal: str) -> Array:
    """Return the values behind the readings of a signal, with the numbers that the model has.

    The inverse of each sensor of the chain, the last one first, earlier by the sum of their delays. States of
    sensors, such as a drift so far, are taken as they start.
    """
    reading, values = reading_of(model.readings, signal), record.at_samples(signal)
    if not reading.sensors:
        return values
    numbers = {v.name: ca.SX(v.start) for v in (*model.parameters, *model.states)}
    symbol = ca.SX.sym("reading")
    behind = ca.Function("behind", [symbol], [reading.inferred(symbol, numbers)])
    shown: Array = behind.map(len(values))(values[None, :]).full().ravel()
    delay = sum(model.values[name] for name in reading.delays)
    stretch = sum(model.values[name] for name in reading.stretches)
    time = record.trace.time
    late = delay + stretch * (time - time[0])
    return np.interp(time + late, time, shown) if delay or stretch else shown


class BandError(NamedTuple):
    """The error of a prediction in the band of frequencies that the record shows, beside the noise there."""

    error: float  # measured minus predicted, filtered as a fit filters it, root mean square
    noise_floor: float  # what measurement noise alone would cause in it, root mean square


def band_errors(actuator: Assembly, records: RecordSet, name: str) -> dict[str, BandError]:
    """Return the error of each prediction of a record beside its noise floor, both in SI.

    The torque that a body is short of holds the acceleration, so the counts of an encoder are differentiated
    twice: without the filter of a fit it shows little but their noise.

    Parameters
    ----------
    actuator
        Declared, or as a diagnosis has left it.
    records
        Measured.
    name
        Of the record.

    Raises
    ------
    UnknownNameError
        If there is no such record.
    MeasurementError
        If nothing measured drives the model.
    """
    _record_of(records, name)
    blocks = blocks_of(flatten(actuator), records.signals)
    bench = Bench(records, blocks)
    chosen = _record_of(bench.records, name)
    errors = {}
    for block in blocks:
        for each in bench.evidence(bench.driven(block, []), [chosen], {}):
            sigma, relative = each.floor.sigma, each.residual({})[0]
            sizes = [float(np.sqrt(np.mean(values**2))) for values in (relative * sigma, sigma)]
            errors[block.target or block.output] = BandError(*sizes)
    return errors


def _record_of(records: RecordSet, name: str) -> Record:
    for record in records.records:
        if record.name == name:
            return record
    raise unknown_name("record", name, (r.name for r in records.records))


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
    chosen = [_record_of(records, name)]
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
    """Return the laws that measured motions take out of their stated range, each with the worst record."""
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
    rows = measured_inputs(block, record, bench.block_noise[block.name].filters.span)
    s = model.symbols()
    if any(v.bounded for v in model.states) or depends(s.signal, s.state):
        inputs = {v.name: row for v, row in zip(model.inputs, rows, strict=True)}
        return simulate(model, time, inputs=inputs, tolerance=1e-6).warnings
    state, values = model.start(model.states), model.start(model.parameters)
    computed = np.array(ca.densify(model.equations(0.0, state, rows, values, np.zeros(0))[2]))
    signals = {v.name: computed[i] for i, v in enumerate(model.signals)}
    return range_warnings(model.signals, time, signals)
