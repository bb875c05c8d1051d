"""Warnings of commands: laws that are used beyond their stated range, angles beyond the end of a cam."""

from __future__ import annotations

import math
from collections.abc import Iterable
from typing import TYPE_CHECKING

import click

from ..foundation.errors import UnitError, ValueRangeError, visible
from ..foundation.quantity import typeset_unit

if TYPE_CHECKING:
    from ..components.assembly.named_parts import Assembly
    from ..model import FlatModel

_COUNT = 41
_MOST = 100.0
"""Angle in rad: contours end at one turn, springs without one at a few."""

_SAME_ANGLE = 1e-4
"""Relative: a design finds the end of its contour numerically, and the remark prints four digits."""


def range_remarks(
    declared: Assembly, *, last: float | None = None, first: float | None = None, measured: str | None = None
) -> list[str]:
    """Return what is to be known of the angles that a command goes over, with the next step.

    ``last``, ``first``: ends of the angles in rad; by default those of the contour of the cams, or ±90° where
    there is none. ``measured``: state that is swept; decided from the structure if it is left out.
    """
    import numpy as np

    from ..feedback.analysis import ranges_at_rest
    from ..feedback.observer.scheduling.scheduled import whole_contour
    from ..foundation.errors import NlsError
    from ..model import flatten

    try:
        model = flatten(declared)
        reach = whole_contour(model).upper
        high = reach if last is None else last
        angles = np.linspace(-high if first is None else first, high, _COUNT)
        left = ranges_at_rest(model, angles, angle=swept_angle(model, measured))
    except NlsError:
        # Without an angle to go over, or a rest on it, the command itself says what is wrong.
        return []
    remarks = [] if last is None else beyond_contour(model, (angles[0], high))
    for each in left:
        law = type(_part(declared, each.part)).__name__
        remarks.append(
            f"{each} ({law}) -> take a law that is stated to hold so far, such as one fitted to a measured "
            "curve (nlsdesign materials), or keep the stretch smaller: more rest length, less pretension or "
            "angle"
        )
    return remarks


def usual_last(model: FlatModel) -> float:
    """Return the angle to which a command goes that is not told: the end of the contour, 50° at most."""
    from ..feedback.observer.scheduling.scheduled import whole_contour

    return min(math.radians(50.0), whole_contour(model).upper)


def check_angles(first: float, last: float) -> None:
    """Refuse angles in the wrong order, and those that no spring is turned by."""
    if not last > first:
        raise ValueRangeError("--to", "must lie above --from", next_step="give the smaller angle as --from")
    for option, angle in (("--from", first), ("--to", last)):
        if abs(angle) > _MOST:
            raise ValueRangeError(
                f"{option} {math.degrees(angle):.4g}°", f"is more than {math.degrees(_MOST):.0f}°",
                next_step="stay within the contour, or within a few turns where there is none",
            )  # fmt: skip


def beyond_contour(model: FlatModel, angles: Iterable[float]) -> list[str]:
    """Return which cams end before an angle."""
    furthest = max(abs(angle) for angle in angles)
    cams = [cam for spring in model.springs for cam in spring.cams if cam.last_angle]
    return [
        f"the contour of {cam.name} ends at {math.degrees(model.values[cam.last_angle or '']):.4g}°, the "
        f"angles go to {math.degrees(furthest):.4g}°: beyond its end the lever arm stays what it is there -> "
        "stay within it (--to), or declare a longer contour"
        for cam in cams
        if furthest > model.values[cam.last_angle or ""] * (1.0 + _SAME_ANGLE)
    ]


def warn(remarks: Iterable[str]) -> None:
    """Print remarks where they do not mix with what a command prints for others to read."""
    for remark in remarks:
        click.echo(f"warning: {visible(remark)}", err=True)


def swept_angle(model: FlatModel, measured: str | None) -> str:
    """Return the angle that an analysis goes over.

    ``measured``: name of the state; decided from the structure if it is left out.
    """
    from ..model.roles import measured_motion

    name = measured_motion(model, measured)
    unit = model.variable(name).unit
    if unit != "rad":
        raise UnitError(
            f"'{name}'", f"is in {typeset_unit(unit) or '1'}; analyse goes over an angle",
            next_step="name the angle of a body that turns, with --measured",
        )  # fmt: skip
    return name


def _part(declared: Assembly, path: str) -> object:
    part = declared[path]
    return getattr(part, "element", part)
