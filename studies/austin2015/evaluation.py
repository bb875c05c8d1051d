"""The torque loop as a control engineer judges it: verdicts, margins, impedance, onset of limit cycling."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

import nlsdesign as nls
from nlsdesign.components.assembly.changed_copies import with_moved_load
from nlsdesign.export import natively
from nlsdesign.feedback.control import (
    LimitCycleOnset,
    LoopMargins,
    SineResponse,
    TorqueGains,
    encoder_loop,
    loop_margins,
    onset_of_limit_cycling,
    output_impedance,
    sine_response,
)
from nlsdesign.feedback.control.evaluation.margins import OutputImpedance
from nlsdesign.feedback.control.evaluation.spread_margins import SpreadMargins, spread_margins
from nlsdesign.feedback.observer import ObserverDesign

AMPLITUDES = (0.8, 2.8)  # N·m; the small and the large sine of Fig. 10 of the paper
GAIN = "controller.proportional"
KP = 32.0  # rad/s per N·m
BETWEEN = (8.0, 160.0)  # rad/s per N·m


@dataclass(frozen=True, eq=False)
class LoopEvaluation:
    """Responses at two amplitudes, margins over angle and spread, impedance, and where limit cycles begin."""

    responses: tuple[SineResponse, ...]
    margins: LoopMargins
    impedance: OutputImpedance
    onset: LimitCycleOnset
    spread: SpreadMargins | None  # what the fast way leaves out

    @property
    def least_gain_margin(self) -> float:
        """In dB over the angles that the drive can hold; not a number where the loop is unstable."""
        linear = self.margins.linear
        held = self.margins.gain[linear.reached]
        return float(np.min(held)) if len(held) and np.all(np.isfinite(held)) else float("nan")


def evaluate_loop(
    actuator: nls.Assembly, model: nls.FlatModel, observer: ObserverDesign, *, fast: bool
) -> LoopEvaluation:
    """Evaluate the loop with the gains that reproduce the paper's."""
    controller = nls.torque_controller(model, gains=TorqueGains(proportional=KP))
    outputs = [v.name for v in model.outputs]
    moved = nls.flatten(with_moved_load(actuator), outputs=outputs)
    fixed, free = (
        encoder_loop(plant, observer=observer.model, controller=controller) for plant in (model, moved)
    )
    angles, frequencies = np.radians(np.linspace(0.0, 50.0, 26)), np.geomspace(0.5, 11.0, 2 if fast else 12)
    return LoopEvaluation(
        tuple(
            sine_response(fixed, amplitude=a, frequencies=frequencies, translate=natively) for a in AMPLITUDES
        ),
        loop_margins(fixed, angles),
        output_impedance(free, angles[::5]),
        onset_of_limit_cycling(fixed, GAIN, between=BETWEEN, amplitude=AMPLITUDES[1], translate=natively),
        None if fast else spread_margins(fixed, GAIN, last=float(angles[-1]), translate=natively),
    )
