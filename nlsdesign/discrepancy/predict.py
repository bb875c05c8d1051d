"""What a model predicts of a measured record, block by block."""

from __future__ import annotations

from ..errors import unknown_name
from ..identification.driven import DrivenBlock
from ..identification.evidence import Bench
from ..identification.measurement import RecordSet
from ..model import Assembly
from ..simulation import Trace
from .cuts import blocks_of


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
        body is short of, which would vanish in a perfect model.

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
    blocks = blocks_of(actuator, records.signals)
    bench = Bench(records, blocks)
    signals, units = {}, {}
    for block in blocks:
        for each in bench.evidence(DrivenBlock(block, []), chosen, {}):
            shown = block.target or block.output
            signals[shown], units[shown] = each.predicted({}), block.model.outputs[0].unit
    return Trace(chosen[0].trace.time, signals, units, name)
