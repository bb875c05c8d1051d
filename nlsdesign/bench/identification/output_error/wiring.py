"""How a record is wired to a model: which inputs it drives, and which signals it is compared with."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field

from ....foundation.errors import MeasurementError, unknown_name
from ....model import FlatModel
from ....model.structure import body_moved_by
from ..equation_error.block import Drive


@dataclass(frozen=True)
class Wiring:
    """Wires between the measured signals of records and a model.

    Parameters
    ----------
    inputs
        How each driven input of the model follows from a measured signal, by name of the input. Others rest
        at their start value.
    outputs
        Signal or state of the model that predicts each measured signal, by name of the measured one.
    late_by
        Name of a parameter of the fit that says by how many seconds a measured signal comes late, by name of
        the measured one.
    """

    inputs: Mapping[str, Drive]
    outputs: Mapping[str, str]
    late_by: Mapping[str, str] = field(default_factory=dict)


def wired(model: FlatModel, measured: Sequence[str], late_by: Mapping[str, str] | None = None) -> Wiring:
    """Wire measured signals to the inputs and signals of a model that have their names.

    An input that is the speed of a measured motion is driven by its smoothed rate.
    """
    names = {v.name for v in model.inputs}
    known = names | {v.name for v in model.states + model.signals}
    inputs, outputs = {}, {}
    for signal in measured:
        if signal not in known:
            raise unknown_name("signal of the model", signal, known)
        if signal not in names:
            outputs[signal] = signal
            continue
        inputs[signal] = Drive(signal)
        body = body_moved_by(model.bodies, signal)
        if body and body.rate in names - set(measured):
            inputs[body.rate] = Drive(signal, 1)
    if not outputs:
        raise MeasurementError(
            "records",
            "measure inputs of the model alone, so there is nothing to compare",
            next_step=f"measure one of: {', '.join(sorted(known - names))}",
        )
    return Wiring(inputs, outputs, late_by or {})
