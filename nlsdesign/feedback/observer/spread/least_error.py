"""What the best estimator could reach on the bench, as a function of what is known of the numbers."""

from __future__ import annotations

import math
from collections.abc import Callable

import numpy as np

from ....simulation.buffered import Translate, as_it_is
from ....simulation.prior import Prior
from ....simulation.sampled_batch import PLANT, run_batch
from ..adaptive.adaptive_observer import encoder_quantum
from ..adaptive.estimator_bound import SensedTorque, estimator_bound, rms_over
from .observer_bench import ObserverBench


def least_torque_error(bench: ObserverBench, *, translate: Translate = as_it_is) -> Callable[[Prior], float]:
    """Return a function from a prior to the Cramér–Rao bound along the bench, N·m rms.

    The machine runs once, with the numbers of the deck; a calibration is worth what it takes off this bound.

    Parameters
    ----------
    bench
        One run for all observers.
    translate
        For instance :func:`~nlsdesign.export.natively`: then compiled code runs.

    Raises
    ------
    ArrangementError
        If no encoder of the measured motion is declared.
    """
    system = bench.system({})
    names = [f"{PLANT}.{v.name}" for v in bench.model.inputs]
    batch = run_batch(system, bench.stop, inputs=bench.inputs, keep=names, translate=translate)
    inputs = np.vstack([batch[name] for name in names])
    sensed = SensedTorque(
        bench.estimate, bench.measured, encoder_quantum(bench.model, bench.measured), system.sample_time
    )

    def least(prior: Prior) -> float:
        bound = estimator_bound(bench.model, prior, inputs, sensed)
        squares = [rms_over([bound], first, last) ** 2 for _, first, last in bench.stretches]
        return math.sqrt(float(np.mean(squares)))

    return least
