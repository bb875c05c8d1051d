"""What any observer could know of the torque while the machine runs, for the plan of a calibration."""

from __future__ import annotations

from collections.abc import Callable

from ..components import Assembly
from ..feedback.observer import least_torque_error, observer_bench
from ..foundation.errors import ArrangementError, ValueRangeError
from ..model import flatten
from ..simulation import Prior


def errors_while_running(actuator: Assembly) -> dict[str, Callable[[Prior], float]]:
    """Return the least error of the torque that any observer could have, where there is one to observe.

    Parameters
    ----------
    actuator
        As declared; without a spring or an encoder the result is empty, and a plan speaks of the resting
        spring alone.

    Returns
    -------
    dict
        As ``errors`` of :func:`~nlsdesign.bench.calibration.what_calibration_buys`.
    """
    try:
        least = least_torque_error(observer_bench(flatten(actuator)))
    except (ArrangementError, ValueRangeError):
        return {}
    return {"torque while running, best estimate": least}
