"""What a deck is good for: which commands it is ready for, and how well its torque could be known.

Readiness is found out with what the commands themselves call first.

Which laws a machine leaves the stated range of over its angles, and which cams end before them.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Iterable
from functools import cache
from typing import NamedTuple

import numpy as np

from ..bench.discrepancy.tearing import blocks_of
from ..components import Assembly
from ..components.assembly.changed_copies import with_moved_load
from ..design import ExponentialTorque
from ..design.optimisation.solve import GOALS, USUAL, Wanted
from ..feedback.analysis import ranges_at_rest
from ..feedback.analysis.rest_points import rest_points
from ..feedback.control import ScheduledTorque, torque_controller
from ..feedback.control.laws.torque_loop import rate_remarks
from ..feedback.observer import (
    CascadeGain,
    FixedGrid,
    design_observer_with_details,
    least_torque_error,
    observer_bench,
)
from ..feedback.observer.scheduling.scheduled import whole_contour
from ..foundation.errors import ArrangementError, NlsError, UnitError, ValueRangeError
from ..foundation.quantity import typeset_unit
from ..model import FlatModel, flatten
from ..model.roles import measured_motion, passed_ends, series_cam, series_spring
from ..simulation import Prior

_COUNT = 41


def range_remarks(
    declared: Assembly, *, last: float | None = None, first: float | None = None, measured: str | None = None
) -> list[str]:
    """Return what is to be known of a machine over its angles, each with the next step.

    Parameters
    ----------
    declared
        The machine.
    last, first
        Ends of the angles in rad; by default those of the contour of the cams, or ±90° where there is none.
    measured
        State that is swept; decided from the structure if it is left out.
    """
    try:
        model = flatten(declared)
        high = whole_contour(model).upper if last is None else last
        angles = np.linspace(-high if first is None else first, high, _COUNT)
        left_ranges = ranges_at_rest(model, angles, angle=swept_angle(model, measured))
    except NlsError:
        # Without an angle to go over, or a rest on it, whoever goes over it says what is wrong.
        return []
    remarks = rate_remarks(model) if last is None else beyond_contour(model, (angles[0], high))
    for warning in left_ranges:
        part = declared[warning.part]
        law = type(getattr(part, "element", part)).__name__
        remarks.append(
            f"{warning} ({law}) -> take a law that is stated to hold so far, such as one fitted to a "
            "measured curve (nlsdesign materials), or keep the stretch smaller: more rest length, less "
            "pretension or angle"
        )
    return remarks


def usual_last(model: FlatModel) -> float:
    """Return the angle in rad to which an analysis goes by default: the end of the contour, 50° at most."""
    return min(math.radians(50.0), whole_contour(model).upper)


def beyond_contour(model: FlatModel, angles: Iterable[float]) -> list[str]:
    """Return which cams end before an angle."""
    angles = list(angles)
    furthest = max(abs(angle) for angle in angles)
    return [
        f"the contour of {name} ends at {math.degrees(end):.4g}°, the "
        f"angles go to {math.degrees(furthest):.4g}°: beyond its end the lever arm stays what it is there -> "
        "stay within it (--to), or declare a longer contour"
        for name, end in passed_ends(model, min(angles), max(angles)).items()
    ]


def swept_angle(model: FlatModel, measured: str | None) -> str:
    """Return the name of the angle that an analysis goes over; refuse a state that is no angle."""
    name = measured_motion(model, measured)
    unit = model.variable(name).unit
    if unit != "rad":
        raise UnitError(
            f"'{name}'", f"is in {typeset_unit(unit) or '1'}; analyse goes over an angle",
            next_step="name the angle of a body that turns, with --measured",
        )  # fmt: skip
    return name


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
