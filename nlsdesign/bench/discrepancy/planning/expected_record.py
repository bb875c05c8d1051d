"""The record that an experiment would leave, if a hypothesis were right."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass

import numpy as np

from ....foundation.arrays import Array
from ....foundation.errors import MeasurementError
from ....model import FlatModel
from ....model.readings import reading_of
from ....model.structure import MovingBody, body_moved_by
from ....simulation import Trace, simulate
from ...identification.equation_error.block_response import DrivenBlock
from ...identification.records.measurement import Record

_ROUNDS, _CLOSE = 6, 1e-3
"""Corrections of a drive, and the share of it below which a further one changes nothing that is measured."""
_PROBE = 1e-3
"""Step of a drive by which its slope is taken, relative to the largest that was measured."""


@dataclass(frozen=True)
class MeasuredSignals:
    """The measured signals by what they are.

    Parameters
    ----------
    motions
        The body whose motion each shows, by the name of the signal.
    rates
        The body whose speed each shows.
    drives
        Inputs of the model, such as a current.
    efforts
        Forces and torques that the model predicts.
    """

    motions: Mapping[str, MovingBody]
    rates: Mapping[str, MovingBody]
    drives: tuple[str, ...]
    efforts: tuple[str, ...]


def measured_signals(model: FlatModel, signals: Sequence[str]) -> MeasuredSignals:
    """Sort measured signals by what they are."""
    inputs = {v.name for v in model.inputs}
    motions, rates, drives, efforts = {}, {}, [], []
    for signal in signals:
        shown = reading_of(model.readings, signal).measured
        body = body_moved_by(model.bodies, shown)
        turning = next((b for b in model.bodies if b.rate == shown), None)
        if turning is not None:
            rates[signal] = turning
        elif body is not None:
            motions[signal] = body
        elif shown in inputs:
            drives.append(signal)
        else:
            efforts.append(signal)
    return MeasuredSignals(motions, rates, tuple(drives), tuple(efforts))


def check_command(measured: MeasuredSignals, commanded: str) -> None:
    """Check that all measured signals follow from the commanded one."""
    if commanded in measured.drives:
        return
    if commanded not in measured.motions:
        raise MeasurementError(
            f"commanded signal '{commanded}'",
            "is neither a measured motion nor a measured drive",
            next_step="command one of: " + ", ".join([*measured.motions, *measured.drives]),
        )
    body = measured.motions[commanded]
    others = [s for s, b in measured.motions.items() if b != body and not b.prescribed]
    if others:
        raise MeasurementError(
            f"measured motion '{others[0]}'",
            f"does not follow from '{commanded}' alone",
            next_step="command a drive",
        )


@dataclass(frozen=True, eq=False)
class Machine:
    """What is needed to say which record an experiment would leave.

    Parameters
    ----------
    model
        Of the hypothesis, with its fitted numbers.
    driven
        Its blocks, ready for evaluation.
    measured
        The measured signals by what they are.
    units
        SI units by signal.
    rest
        Value of each signal at rest.
    largest
        Largest size of each signal in the records.
    """

    model: FlatModel
    driven: tuple[DrivenBlock, ...]
    measured: MeasuredSignals
    units: Mapping[str, str]
    rest: Mapping[str, float]
    largest: Mapping[str, float]

    def record(self, time: Array, commanded: str, value: Array) -> Record:
        """Return the record that a command would leave.

        A commanded motion is taken as followed by the machine; a commanded drive is simulated.
        """
        if commanded in self.measured.drives:
            return self._simulated(time, commanded, value)
        signals = {s: np.full(len(time), v) for s, v in self.rest.items()}
        signals[commanded] = value
        body = self.measured.motions[commanded]
        for signal, other in (*self.measured.motions.items(), *self.measured.rates.items()):
            if other == body and signal != commanded:
                is_rate = signal in self.measured.rates
                signals[signal] = np.gradient(value, time) if is_rate else value
        readings = [d for d in self.driven if d.block.target is not None]
        balances = [d for d in self.driven if d.block.target is None]
        # A force may depend on another measured one, and a drive on all of them.
        for _ in readings:
            for each in readings:
                assert each.block.target is not None
                signals[each.block.target] = self._response(each, time, signals)
        for each in balances:
            self._balance(each, time, signals)
        return self._as_record(time, signals)

    def _response(self, driven: DrivenBlock, time: Array, signals: Mapping[str, Array]) -> Array:
        record = self._as_record(time, signals)
        return driven.respond(driven.samples(record, self.model.values), self.model.values).output

    def _balance(self, driven: DrivenBlock, time: Array, signals: dict[str, Array]) -> None:
        """Set the drive of a body to what its motion asks for."""
        drives = [d.signal for d in driven.block.drives.values() if d.signal in self.measured.drives]
        if not drives:
            return
        drive = drives[0]
        probe = _PROBE * self.largest[drive] or 1.0
        error = self._response(driven, time, signals)
        moved = self._response(driven, time, {**signals, drive: signals[drive] + probe})
        slope = float(np.median(moved - error)) / probe
        if slope == 0.0 or not np.isfinite(slope):
            return
        for _ in range(_ROUNDS):
            step = error / slope
            signals[drive] = signals[drive] - step
            if np.max(np.abs(step)) <= _CLOSE * max(float(np.max(np.abs(signals[drive]))), 1e-300):
                break
            error = self._response(driven, time, signals)

    def _simulated(self, time: Array, commanded: str, value: Array) -> Record:
        shown = reading_of(self.model.readings, commanded).measured
        run = simulate(self.model, time, inputs={shown: value}, tolerance=1e-6)
        return self._as_record(time, {s: run[s] for s in self.units})

    def _as_record(self, time: Array, signals: Mapping[str, Array]) -> Record:
        return Record("experiment", Trace(time, dict(signals), dict(self.units), "experiment"))
