"""What a deck is good for: which commands it is ready for, and how well its torque could be known.

Readiness is found out with what the commands themselves call first.
"""

from __future__ import annotations

from collections.abc import Callable
from functools import cache
from typing import NamedTuple

import numpy as np

from ..bench.discrepancy.tearing import blocks_of
from ..components import Assembly
from ..components.assembly.changed_copies import with_moved_load
from ..design import ExponentialTorque
from ..design.optimisation.solve import GOALS, USUAL, Wanted
from ..feedback.analysis.rest_points import rest_points
from ..feedback.control import ScheduledTorque, torque_controller
from ..feedback.observer import (
    CascadeGain,
    FixedGrid,
    design_observer_with_details,
    least_torque_error,
    observer_bench,
)
from ..feedback.observer.scheduling.scheduled import whole_contour
from ..foundation.errors import ArrangementError, NlsError, ValueRangeError
from ..model import flatten
from ..model.roles import series_cam, series_spring
from ..simulation import Prior
from .range_remarks import swept_angle

_SAMPLE_TIME = 1e-3
_ANGLES = 5
_POINTS = 33


class Readiness(NamedTuple):
    """Whether a command takes a deck."""

    command: str  # as it is typed, without nlsdesign
    reason: NlsError | None  # why not, with the next step; None where the deck is ready

    @property
    def ready(self) -> bool:
        """Whether the command takes the deck."""
        return self.reason is None


def readiness(declared: Assembly) -> list[Readiness]:
    """Return for each command that takes a deck whether it takes this one.

    Parameters
    ----------
    declared
        The machine of the deck.
    """
    model = flatten(declared)
    reach = whole_contour(model).upper
    readings = [r.signal for r in model.readings if r.sensors]
    measured = [*(readings or [v.name for v in model.states]), *(v.name for v in model.inputs)]

    @cache
    def observer() -> None:
        # Every other kind of observer needs the step of a cascade too, and any size of its table will do.
        grid = FixedGrid(-reach, reach, points=_POINTS)
        design_observer_with_details(model, gain=CascadeGain(), sample_time=_SAMPLE_TIME, grid=grid)

    def over_angle() -> None:
        series_spring(model)
        rest_points(model, np.linspace(0.0, reach, _ANGLES), angle=swept_angle(model, None))

    @cache
    def controller() -> None:
        torque_controller(model, law=ScheduledTorque(), sample_time=_SAMPLE_TIME)

    def loop() -> None:
        flatten(with_moved_load(declared))
        observer()
        controller()

    def plant() -> None:
        """Ask for nothing more than the flat model."""

    def records() -> None:
        blocks_of(model, measured)

    def design() -> None:
        # What a design does before its search.
        cam = series_cam(model)
        angle = 0.8 * model.values[cam.last_angle] if cam.last_angle else 0.5
        target = ExponentialTorque(maximum=1.0, angle=angle, shape=1.0)
        question, free = Wanted(target, None, (), None, GOALS).question(declared, USUAL)
        question.search(free)

    asked: dict[str, Callable[[], None]] = {
        "simulate": plant,
        "design": design,
        "analyse angle": over_angle,
        "analyse loop": loop,
        "observer": observer,
        "export c": observer,
        "export controller": controller,
        "export fmu": plant,
        "fit": records,
        "diagnose": records,
    }
    reasons: dict[Callable[[], None], NlsError] = {}
    for check in dict.fromkeys(asked.values()):
        try:
            check()
        except NlsError as error:
            reasons[check] = error
    return [Readiness(name, reasons.get(check)) for name, check in asked.items()]


def errors_while_running(actuator: Assembly) -> dict[str, Callable[[Prior], float]]:
    """Return the least error of the torque that any observer could have, for the plan of a calibration.

    Empty without a spring or an encoder: such a plan speaks of the resting spring alone.
    """
    try:
        least = least_torque_error(observer_bench(flatten(actuator)))
    except (ArrangementError, ValueRangeError):
        return {}
    return {"torque while running, best estimate": least}
