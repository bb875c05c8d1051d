"""The loops of one machine that are evaluated: load fixed and load moved, with one cascade observer."""

from __future__ import annotations

from typing import Any

from ....model import FlatModel
from ....model.roles import measured_motion, series_spring
from ....model.transform import with_outputs
from ...observer import CascadeGain, design_observer
from ..closed_loop import ClosedLoop, encoder_loop
from ..laws.torque_loop import torque_controller


def cascade_loops(
    fixed: FlatModel, moved: FlatModel, *, delay: int, sample_time: float, **law: Any
) -> tuple[ClosedLoop, ClosedLoop]:
    """Return the torque loop with its load fixed and with it moved; one observer and controller for both.

    Parameters
    ----------
    fixed, moved
        The machine as declared, and with the motion of its load prescribed.
    delay
        Samples between a current's computation and its effect.
    sample_time
        In s.
    **law
        As for :func:`~nlsdesign.feedback.control.torque_controller`: law, gains, velocity.
    """
    plants = [with_outputs(m, [measured_motion(m), series_spring(m).effort]) for m in (fixed, moved)]
    # What an adaptive observer has learned depends on what went before, so a loop with it has no one figure.
    observer = design_observer(plants[0], sample_time=sample_time, gain=CascadeGain())
    controller = torque_controller(plants[0], sample_time=sample_time, **law)
    substeps = max(1, round(10 * sample_time / 1e-3))
    first, second = (
        encoder_loop(plant, observer=observer, controller=controller, delay=delay, substeps=substeps)
        for plant in plants
    )
    return first, second
