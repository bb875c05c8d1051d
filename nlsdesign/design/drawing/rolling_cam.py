"""Parts on which a roller or an equal cam rolls: edge as arcs, back, way of what rolls."""

from __future__ import annotations

import math
from dataclasses import dataclass, replace
from typing import cast

import numpy as np
import scipy

from ...foundation.arrays import Array
from ...foundation.errors import ArrangementError, ValueRangeError
from ...foundation.quantity import MM, Quantity
from ..curves.numbers import plain
from ..statics.contour import STRAIGHT, Contour, PairContour, RollerContour, RollingContour
from .arc_path import ArcPath, biarc, joined
from .cam_outline import Contours, LipEdge, Lips, back_of, few_arcs, lip_edge
from .cam_part import Hole
from .machined_cam import DrawnCam, MachinedCam, derived_size

_CHECKED = 33
_RUN_OUT = 9
"""Nodes over the run-out."""
_ROLLED = 5e-9
"""Largest distance in m between the arcs and an edge on which something rolls: there the direction of the
edge makes the torque, not its place, and it errs by the power 2/3 of this."""


@dataclass(frozen=True, kw_only=True)
class MachinedRollingCam(MachinedCam):
    """Base of cams on which something rolls: one piece, cut through, with a bore on the axis."""

    def _one_piece(self, made: RollingContour, lip: LipEdge, numbers: dict[str, Quantity]) -> DrawnCam:
        """Return the piece, with the way of the centre of what rolls, and lines to it at both ends."""
        self._body_radius(min(lip.last_support, float(made.radii.min())), numbers)
        outline = joined(lip.path, back_of((lip, lip), numbers), lip.path.mirrored(), closed=True)
        way = np.vstack([made.centre_line[:0:-1] * [-1.0, 1.0], made.centre_line])
        last = made.centre_line[-1]
        lines = [
            way,
            *(np.array([[0.0, 0.0], end]) for end in (made.centre_line[0], last, last * [-1.0, 1.0])),
        ]
        return DrawnCam([outline], self.bore(), [ArcPath(points, np.zeros(len(points))) for points in lines])


@dataclass(frozen=True, kw_only=True)
class MachinedPair(MachinedRollingCam):
    """Sizes of a cam that rolls on an equal one; other parameters are those of :class:`MachinedCam`.

    Two are cut. ``hub_bore`` is the hole of the pivot to which the element is fixed. Beyond the last angle
    the distance of the pivots goes on with the last lever arm. Teeth or bands along the edge are not drawn.

    Examples
    --------
    >>> MachinedPair().given()["thickness"].shown
    4.0
    """

    def given(self) -> dict[str, Quantity]:
        """Return the numbers by name, with those derived that need no contour."""
        usual = {
            "tool_radius": derived_size(5e-3, "any tool, as no edge is hollow"),
            "thickness": derived_size(4e-3, "usual plate"),
        }
        return usual | super().given()

    def _edge(self, contour: Contour, numbers: dict[str, Quantity]) -> LipEdge:
        if not isinstance(contour, PairContour):
            raise ArrangementError(
                "contour under a cable or a roller", "does not roll on its mirror image",
                next_step="draw it as a MachinedTwoSidedCam, MachinedOneSidedCam or MachinedRollerCam",
            )  # fmt: skip
        rho = contour.radii_of_curvature
        least = int(np.argmin(rho))
        if rho[least] <= 0.0:
            raise ValueRangeError(
                f"edge at {math.degrees(contour.angles[least]):.3g}°",
                f"is hollow, with a radius of {MM * -rho[least]:.4g} mm: both cams would meet there",
                next_step=f"take a base_distance larger by {2.0 * MM * -rho[least]:.3g} mm",
            )
        numbers["sharpest_edge"] = derived_size(float(rho[least]), "smallest radius of curvature of the edge")
        numbers["pivot_distance"] = derived_size(
            float(contour.centre_radii[0]), "base distance of the contour"
        )
        over, edge = plain(self.over_travel) / 2.0, contour.edge
        lip = lip_edge(edge, 0.0, over_travel=0.0, accuracy=_ROLLED)
        if over == 0.0:
            return lip
        # With a constant lever arm p' the support function grows evenly, and ρ = p.
        turned = np.linspace(0.0, over, _RUN_OUT)
        p = edge.lever_arms[-1] + edge.slopes[-1] * turned
        slopes = np.full(_RUN_OUT, edge.slopes[-1])
        beyond = lip_edge(Contour(edge.directions[-1] + turned, p, slopes, p, math.inf), 0.0, over_travel=0.0)
        path, deviation = joined(lip.path, beyond.path), max(lip.deviation, beyond.deviation)
        return LipEdge(path, deviation, 0.0, beyond.last_direction, beyond.last_support)

    def _drawn(self, contours: Contours, lips: Lips, numbers: dict[str, Quantity]) -> DrawnCam:
        made = cast(PairContour, contours[0])
        drawn = self._one_piece(made, lips[0], numbers)
        half = drawn.outlines[0].turned(math.pi)
        at_rest = made.centre_line[0]
        bores = tuple(Hole("pivot of the other cam", at_rest, hole.diameter) for hole in drawn.holes)
        partner = ArcPath(half.points + at_rest, half.bulges, closed=True)
        return drawn._replace(rollers=bores, partners=(partner,))


@dataclass(frozen=True, kw_only=True)
class MachinedRollerCam(MachinedRollingCam):
    """Sizes of a cam on which a roller runs; other parameters are those of :class:`MachinedCam`.

    Beyond the last angle the roller's centre goes on with the last lever arm.

    Parameters
    ----------
    roller_radius
        Of the roller: the edge lies inside the way of its centre by it.

    Examples
    --------
    >>> from nlsdesign.foundation.quantity import quantity
    >>> MachinedRollerCam(roller_radius=quantity(3.0, "mm")).given()["thickness"].shown
    4.0
    """

    roller_radius: Quantity | float

    def given(self) -> dict[str, Quantity]:
        """Return the numbers by name, with those derived that need no contour."""
        radius = plain(self.roller_radius)
        derived = {
            "tool_radius": derived_size(radius, "radius of the roller, as every hollow is wider"),
            "thickness": derived_size(max(4e-3, radius), "radius of the roller, at least 4 mm"),
        }
        return derived | super().given()

    def _edge(self, contour: Contour, numbers: dict[str, Quantity]) -> LipEdge:
        if not isinstance(contour, RollerContour):
            raise ArrangementError(
                "contour under a cable", "is no edge for a roller",
                next_step="draw it as a MachinedTwoSidedCam or MachinedOneSidedCam",
            )  # fmt: skip
        rho, r = contour.radii_of_curvature, contour.roller_radius
        under = np.flatnonzero((rho > -r) & (rho <= 0.0))
        if len(under):
            worst = under[np.argmin(rho[under])]
            turns = float(rho[worst]) + r
            first, last = (f"{math.degrees(contour.bearings[k]):.3g}°" for k in (under[0], under[-1]))
            raise ValueRangeError(
                f"edge from {first} to {last}",
                f"is undercut: the centre of the roller of {MM * r:.4g} mm radius turns with "
                f"{MM * turns:.4g} mm at {math.degrees(contour.bearings[worst]):.3g}°",
                next_step=f"take a roller of at most {MM * turns:.3g} mm radius, a larger base radius, "
                "or limit the radius of curvature (MinimumRadiusOfCurvature)",
            )
        how = "smallest radius of curvature of the edge"
        numbers["sharpest_edge"] = derived_size(float(np.min(rho, where=rho > 0.0, initial=STRAIGHT)), how)
        if np.any(rho < 0.0):
            numbers["narrowest_hollow"] = derived_size(float(-np.max(rho[rho < 0.0])), how)
        numbers["pitch_radius"] = derived_size(float(contour.centre_radii[0]), "base radius of the contour")
        return roller_edge(contour, over_travel=numbers["over_travel"].number)

    def _drawn(self, contours: Contours, lips: Lips, numbers: dict[str, Quantity]) -> DrawnCam:
        made = cast(RollerContour, contours[0])
        drawn = self._one_piece(made, lips[0], numbers)
        last = made.centre_line[-1]
        centres = (made.centre_line[0], last, last * [-1.0, 1.0])
        # From the axis through the centre of the roller, and as far again as the roller is wide.
        beyond = [1.0 + 2.0 * made.roller_radius / float(np.hypot(*c)) for c in centres]
        lines = [
            replace(each, points=each.points * more)
            for each, more in zip(drawn.cables[1:], beyond, strict=True)
        ]
        rollers = tuple(Hole("roller", centre, 2.0 * made.roller_radius) for centre in centres)
        return drawn._replace(cables=[drawn.cables[0], *lines], rollers=rollers)


def roller_edge(contour: RollerContour, *, over_travel: float) -> LipEdge:
    """Return the edge on which the centre of a roller follows its way, as arcs.

    Beyond the last angle the way goes on with the last lever arm.
    """
    radius = contour.roller_radius
    end, rho, arm = (float(c[-1]) for c in (contour.bearings, contour.centre_radii, contour.lever_arms))
    way = np.column_stack([contour.centre_radii, contour.lever_arms, contour.slopes])
    path, deviation = _arcs_along(contour.bearings, way, radius)
    if over_travel > 0.0:
        turned = np.linspace(0.0, over_travel, _RUN_OUT)
        rest = np.column_stack([rho + arm * turned, np.full(_RUN_OUT, arm), np.zeros(_RUN_OUT)])
        run_out, beyond = _arcs_along(end + turned, rest, radius)
        path, deviation = joined(path, run_out), max(deviation, beyond)
        rho += arm * over_travel
    last = end + over_travel - math.atan2(arm, rho)
    return LipEdge(path, deviation, 0.0, last, rho**2 / math.hypot(rho, arm) - radius)


def _arcs_along(bearings: Array, way: Array, radius: float) -> tuple[ArcPath, float]:
    """Return the edge of a roller's way as arcs; columns of ``way``: ρ and its derivatives by the bearing."""
    centre = scipy.interpolate.BPoly.from_derivatives(bearings, way)

    def over(first: float, last: float) -> tuple[ArcPath, float]:
        at = np.linspace(first, last, _CHECKED)
        rho, arm = centre(at)[:, None], centre(at, 1)[:, None]
        outwards = np.column_stack([np.sin(at), np.cos(at)])
        along, speed = outwards[:, ::-1] * [1.0, -1.0], np.hypot(rho, arm)
        tangents = (arm * outwards + rho * along) / speed
        points = rho * outwards - radius * (rho * outwards - arm * along) / speed
        path = biarc(points[0], points[-1], first=tangents[0], last=tangents[-1])
        # A point belongs to the arc on whose side of their common point it lies.
        which = ((points - path.points[1]) @ (points[-1] - points[0]) > 0.0).astype(int)
        with np.errstate(invalid="ignore"):
            away = np.abs(np.hypot(*(points - path.centres[which]).T) - np.abs(path.radii)[which])
        # An arc that is straight to the last digit has no centre; its span is halved.
        error = float(np.max(away))
        return path, error if math.isfinite(error) else math.inf

    return few_arcs(over, bearings, _ROLLED)
