"""Numbers refitted by simulation over windows, begun where the blocks of a model have left them."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import replace

from ....components.assembly.named_parts import Assembly
from ....foundation.errors import MeasurementError
from ....model import FlatModel, flatten
from ....model.readings import reading_of
from ...identification.equation_error.block import Drive
from ...identification.least_squares import Fit
from ...identification.multiple_shooting import coloured_sigma, fit_by_simulation, predict_in_windows
from ...identification.parameters import declared_parameter
from ...identification.records.measurement import Record, RecordSet
from ...identification.residuals import rmse
from ...identification.simulation_error import Shots, Weights
from ...identification.windowed_simulation import Wiring
from ..blocks.shown_values import shown_values
from .verdict import RecordGap

_PHASES = 4
"""Windows begin at so many phases of one length, so that no sample is always near a beginning."""


def fitted_over_windows(
    actuator: Assembly, records: RecordSet, starts: Mapping[str, float], length: float
) -> tuple[dict[str, float], Fit]:
    """Fit numbers so that simulations over windows, each from the measured state, follow the records.

    ``actuator``: as declared; the spreads of its numbers are the prior.
    """
    model = flatten(actuator)
    free = [declared_parameter(model.variable(name), start) for name, start in starts.items()]
    wiring, shots = wiring_of(model, records.signals), Shots(length, False, phases=_PHASES)
    fitted = [_without_sensors(model, record, wiring) for record in records.of("fit")]
    white = fit_by_simulation(model, fitted, free, shots=shots, wiring=wiring)
    # What a model leaves over is coloured; weighed as white it would drown the prior.
    weights = Weights(coloured_sigma(white))
    fit = fit_by_simulation(model, fitted, free, shots=shots, wiring=wiring, weights=weights).fit
    return dict(fit.values), fit


def window_gaps(
    actuator: Assembly, values: Mapping[str, float], records: RecordSet, length: float
) -> tuple[RecordGap, ...]:
    """Return the error of predictions over windows, with the declared and with other numbers."""
    models = [flatten(actuator), flatten(actuator.with_values(values))]
    wiring = wiring_of(models[0], records.signals)
    gaps = []
    for record in records.records:
        shown = _without_sensors(models[0], record, wiring)
        runs = [predict_in_windows(m, shown, length, wiring=wiring) for m in models]
        for signal in wiring.outputs:
            before, after = (rmse(run.error[signal]) for run in runs)
            floor, unit = record.resolution_of(signal).noise, record.trace.units[signal]
            name = f"{signal} over {length:g} s"
            rows = len(runs[0].time)
            gaps.append(RecordGap(name, record.name, record.role, before, after, floor, rows, unit))
    return tuple(gaps)


def wiring_of(model: FlatModel, signals: Sequence[str]) -> Wiring:
    """Wire readings to the inputs and states that they show; other readings to themselves."""
    inputs: dict[str, Drive] = {}
    outputs: dict[str, str] = {}
    names, states = {v.name for v in model.inputs}, {v.name for v in model.states}
    for signal in signals:
        reading = reading_of(model.readings, signal)
        if reading.measured in names and reading.shows_value:
            inputs[reading.measured] = Drive(signal)
        else:
            direct = reading.measured in states and reading.shows_value
            outputs[signal] = reading.measured if direct else signal
    if not any(output in states for output in outputs.values()):
        raise MeasurementError(
            "fit over windows", "no state of the model is measured, so no window can begin",
            next_step="leave --window out, or measure an angle or a position",
        )  # fmt: skip
    return Wiring(inputs, outputs)


def _without_sensors(model: FlatModel, record: Record, wiring: Wiring) -> Record:
    """Return a record in which readings that stand for a state or an input are what their sensors have seen.

    With the numbers that the model has; readings that are compared with readings stay.
    """
    replaced = {drive.signal for drive in wiring.inputs.values()}
    replaced |= {signal for signal, output in wiring.outputs.items() if output != signal}
    signals = {
        n: shown_values(model, record, n) if n in replaced else v for n, v in record.trace.signals.items()
    }
    return replace(record, trace=replace(record.trace, signals=signals))
