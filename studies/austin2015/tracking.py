"""What a spring does for its torque loop: one controller on the published and the designed actuator."""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass

import numpy as np

import nlsdesign as nls
from nlsdesign.bench.identification import rmse
from nlsdesign.export import natively
from nlsdesign.feedback.control import LoopVerdict, TorqueGains, sine_response
from nlsdesign.feedback.observer import ObserverDesign

from .torque_loop import FROM_ENCODER

AMPLITUDE = 2.8  # N·m; the large sine of Fig. 10 of the paper
FREQUENCIES = (2.0, 5.0, 11.0)  # Hz
PROPORTIONAL = (32.0, 45.0)  # rad/s per N·m: the default, and a harder one
STOP, SETTLED = 2.0, 1.0  # s


@dataclass(frozen=True, eq=False)
class Following:
    """One run of the closed loop on a sine of the wanted torque.

    Parameters
    ----------
    proportional
        Gain of the torque loop in rad/s per N·m.
    frequency
        In Hz.
    relative_error
        Root mean square torque error over that of the wanted torque, once settled; not a number where the
        loop does not settle.
    estimate_error
        Root mean square of estimated minus actual torque in N·m, likewise.
    verdict
        On the loop with that sine; harmonics of the drive are no limit cycle.
    peak_current
        In A, once settled.
    run
        The whole run.
    """

    proportional: float
    frequency: float
    relative_error: float
    estimate_error: float
    verdict: LoopVerdict
    peak_current: float
    run: nls.Trace


def follow_sines(
    model: nls.FlatModel,
    observer: ObserverDesign,
    frequencies: Sequence[float],
) -> tuple[Following, ...]:
    """Run the closed loop on sines, for each gain and frequency; all other gains are the defaults."""
    return tuple(_follow(model, observer, kp, hertz) for kp in PROPORTIONAL for hertz in frequencies)


def _follow(model: nls.FlatModel, observer: ObserverDesign, kp: float, hertz: float) -> Following:
    controller = nls.torque_controller(model, gains=TorqueGains(proportional=kp))
    loop = nls.ClosedLoop(plant=model, observer=observer.model, controller=controller, wires=FROM_ENCODER)
    run = loop.run(STOP, inputs=nls.sine(loop.desired, AMPLITUDE, hertz))
    late = run.time >= SETTLED
    peak = float(np.max(np.abs(run["plant.motor.current"][late])))
    judged = sine_response(loop, amplitude=AMPLITUDE, frequencies=[hertz], translate=natively)
    (verdict,) = judged.verdicts
    wanted, torque, estimate = (run[n][late] for n in (loop.desired, loop.torque, loop.estimate))
    errors = rmse(torque - wanted) / rmse(wanted), rmse(estimate - torque)
    if not verdict.holds:
        errors = math.nan, math.nan
    return Following(kp, hertz, *errors, verdict, peak, run)


def tracking_numbers(runs: Mapping[str, Sequence[Following]]) -> dict[str, float]:
    """Return tracking error over wanted torque by actuator, gain and frequency."""
    return {
        f"{name}_tracking_error_Kp_{each.proportional:g}_at_{each.frequency:g}_Hz": each.relative_error
        for name, followed in runs.items()
        for each in followed
        if each.verdict.holds
    }
