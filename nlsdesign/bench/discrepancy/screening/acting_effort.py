"""What the error of a block is a part of: the measured signal, or the effort of the drive on a body."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace

import casadi as ca
import numpy as np

from ....foundation.arrays import Array
from ....model import FlatModel
from ....model.readings import reading_of
from ...identification.equation_error.block import Block
from ...identification.equation_error.block_response import DrivenBlock
from ...identification.equation_error.evidence import Bench
from ...identification.filters import derivative
from ..selection.comparison import Judged


class Acting:
    """The signal or effort beside which the error of a block is judged.

    A block with a target is judged beside that signal; a balance of efforts beside the effort of the drive,
    or beside the largest measured effort on a body without a drive, or beside its inertial effort.

    Parameters
    ----------
    bench
        The records.
    model
        The whole model; its bodies say which signals drive them.
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
        moving = {d.signal for d in block.drives.values() if d.order > 0}
        others = [s for s in dict.fromkeys(d.signal for d in block.drives.values()) if s not in moving]
        own = {name for body in self._model.bodies if body.name == block.name for name in body.drives}
        drives = [s for s in others if reading_of(self._model.readings, s).measured in own]
        return drives, [s for s in others if s not in drives]


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
