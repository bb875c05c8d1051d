"""Which laws a machine leaves the stated range of over its angles, and which cams end before them."""

from __future__ import annotations

import math
from collections.abc import Iterable

import numpy as np

from ..components import Assembly
from ..feedback.analysis import ranges_at_rest
from ..feedback.control.laws.command_limits import rate_remarks
from ..feedback.observer.scheduling.scheduled import whole_contour
from ..foundation.errors import NlsError, UnitError
from ..foundation.quantity import typeset_unit
from ..model import FlatModel, flatten
from ..model.roles import measured_motion, passed_ends

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
