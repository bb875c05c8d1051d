"""From a lever arm or contour to a declared cam, and from a declared cam to its contour."""

from __future__ import annotations

import math
from abc import ABC, abstractmethod
from dataclasses import dataclass, replace
from typing import Any, Generic, TypeVar

import numpy as np
import scipy
from numpy.typing import ArrayLike

from ...components.transmission.cam import Cam, TwoSidedCam
from ...components.transmission.cam_shapes import AnchoredCam, MirroredCam, OneSidedCam
from ...components.transmission.lopsided_cam import LopsidedCam
from ...components.transmission.roller_cam import RollerCam
from ...components.transmission.rolling_pair import RollingPair
from ...foundation.arrays import Array, Mask
from ...foundation.errors import ArrangementError, ValueRangeError
from ...foundation.quantity import Quantity, significant
from .contour import (
    Contour,
    PairContour,
    RollerContour,
    contour_from_lever_arm,
    pair_contour,
    roller_contour,
)

Made = TypeVar("Made", bound=Cam)

_SAMPLES_PER_VALUE = 12
_JUMP = 1e-6
"""First lever arm, relative to the largest, from which it counts as a jump."""
_SOLVED = 1e-6
"""Share of its end by which a designed contour may end before the angle that was asked for: what the solver
leaves."""
_LOOSE = 1e-6
"""Weight of the smoothness of control values, which decides only those that no angle decides."""
_SOURCE = "designed: fitted to a lever arm over the angle"


@dataclass(frozen=True)
class CamFit:
    """A declared cam and how well it holds the lever arm that it was made for."""

    cam: Cam
    error: float  # largest deviation of its lever arm in m, outside the change of sides or the onset
    # changed: names of the numbers of the cam that the fit has set
    changed: tuple[str, ...] = ("lever_arm", "last_angle")

    def changes(self) -> dict[str, Quantity]:
        """Return the numbers that the fit has changed, by their names in the cam."""
        return {name: getattr(self.cam, name) for name in self.changed}


@dataclass(frozen=True)
class DeclaredCam(ABC, Generic[Made]):
    """A cam of an assembly as the design sees it."""

    part: Made

    @property
    def through_centre(self) -> bool:
        """Whether the cable passes through the centre, so that the lever arm is zero at angle zero."""
        return math.isfinite(self.anchor_distance)

    @property
    def anchor_distance(self) -> float:
        """Distance of the anchor in m; infinite for a cable that stays parallel, and without a cable."""
        anchor: Quantity | None = getattr(self.part, "anchor_distance", None)
        return math.inf if anchor is None else anchor.number

    @abstractmethod
    def contour(self, last_angle: float | None, points: int) -> Contour:
        """Return the contour, without the change of sides or the onset near angle zero.

        ``last_angle``: in rad; the end of the cam's table for ``None``.
        """

    @abstractmethod
    def fitted(self, angles: Array, lever_arms: Array, count: int, anchor: float | None) -> CamFit:
        """Return a cam like this one with a given lever arm.

        ``angles``, ``lever_arms``: shape (n,); angles ascend from zero. ``anchor``: another distance of the
        anchor in m; its own for ``None``.
        """


class _BothSides(DeclaredCam[Made]):
    """A cam whose lever arm changes sides over an angle at angle zero."""

    def fitted(self, angles: Array, lever_arms: Array, count: int, anchor: float | None) -> CamFit:
        """Return a cam with that lever arm, fitted through the law of this kind."""
        part: Any = self.part
        # The control values are fitted to h(θ) through the law of the cam, so that the change costs nothing
        # where h starts at zero. A jump is rounded over the width.
        width, (dense, wanted) = part.changeover.number, _dense(angles, lever_arms, count)
        root = np.hypot(dense, width)
        basis = spline_basis(dense**2 / (root + width), angles[-1], count) * (dense / root)[:, None]
        values = _solved(basis, wanted, dense >= (10.0 * width if _jumps(wanted) else 0.0))
        error = _largest(basis @ values - wanted, dense > 20.0 * width)
        end = part.last_angle.with_value(float(angles[-1]), _SOURCE)
        return CamFit(replace(part, lever_arm=_row(part.lever_arm, values), last_angle=end), error)


class _TwoSided(_BothSides[TwoSidedCam]):
    def contour(self, last_angle: float | None, points: int) -> Contour:
        """Return the contour behind the change of sides or the onset."""
        angles = np.linspace(0.0, _end(self.part.last_angle.number, last_angle), points)
        # Beyond the change of sides the cable lies on the contour with the lever arm H(θ − w).
        arms = _lever_arms(self.part.lever_arm, self.part.last_angle, angles - self.part.changeover.number)
        return contour_from_lever_arm(angles, arms, anchor_distance=self.anchor_distance)


class _Rolling(_BothSides[Made]):
    """A cam without a cable."""

    @property
    def through_centre(self) -> bool:
        """True: both sides are alike."""
        return True

    def law(self, last_angle: float | None, points: int) -> tuple[Array, scipy.interpolate.BSpline]:
        """Return angles, and the lever arm on its side as a spline."""
        part: Any = self.part
        end, row = part.last_angle.number, np.array(part.lever_arm.values)
        angles = np.linspace(0.0, _end(end, last_angle), points)
        return angles, scipy.interpolate.BSpline(end / (len(row) - 3) * np.arange(-3, len(row) + 1), row, 3)


class _Roller(_Rolling[RollerCam]):
    def contour(self, last_angle: float | None, points: int) -> RollerContour:
        """Return the edge under the roller."""
        angles, spline = self.law(last_angle, points)
        width, root = self.part.changeover.number, np.hypot(angles, self.part.changeover.number)
        # A roller follows the change of sides too.
        q, slope = angles**2 / (root + width), angles / root
        taken, arm = spline.antiderivative(), spline(q)
        way = (taken(q) - taken(0.0), arm * slope, spline(q, 1) * slope**2 + arm * width**2 / root**3)
        base, radius = self.part.base_radius.number, self.part.roller_radius.number
        return roller_contour(angles, way, base_radius=base, roller_radius=radius)


class _Pair(_Rolling[RollingPair]):
    def contour(self, last_angle: float | None, points: int) -> PairContour:
        """Return the edge that rolls on its mirror image."""
        angles, spline = self.law(last_angle, points)
        # Where the lever arm begins with a jump the profile begins with a facet, in place of the change of
        # sides: beyond that the lever arm is H(θ − w).
        at, taken = angles - self.part.changeover.number, spline.antiderivative()
        p = (self.part.base_distance.number + taken(at) - taken(0.0)) / 2.0
        return pair_contour(Contour(angles / 2.0, p, spline(at), p + 2.0 * spline(at, 1), math.inf))


class _OneSided(DeclaredCam[OneSidedCam]):
    def contour(self, last_angle: float | None, points: int) -> Contour:
        """Return the contour behind the change of sides or the onset."""
        angles = np.linspace(0.0, _end(self.part.last_angle.number, last_angle), points)
        # Beyond the onset the cable lies on the contour with the lever arm H(θ − w/2).
        arms = _lever_arms(self.part.lever_arm, self.part.last_angle, angles - self.part.onset.number / 2)
        return contour_from_lever_arm(angles, arms, anchor_distance=np.inf)

    def fitted(self, angles: Array, lever_arms: Array, count: int, anchor: float | None) -> CamFit:
        """Return a cam with that lever arm, fitted through the law of this kind."""
        width = self.part.onset.number
        dense, wanted = _dense(angles, lever_arms, count)
        r = np.clip(dense / width, 0.0, 1.0)
        taken = width * r**3 * (1.0 - r / 2.0) + np.maximum(dense - width, 0.0)
        basis = spline_basis(taken, angles[-1], count) * (r * r * (3.0 - 2.0 * r))[:, None]
        values = _solved(basis, wanted, dense >= (width if _jumps(wanted) else 0.0))
        error = _largest(basis @ values - wanted, dense > 2.0 * width)
        cam = replace(
            self.part,
            lever_arm=_row(self.part.lever_arm, values),
            last_angle=self.part.last_angle.with_value(float(angles[-1]), _SOURCE),
        )
        return CamFit(cam, error)


class _Anchored(DeclaredCam[AnchoredCam]):
    def contour(self, last_angle: float | None, points: int) -> Contour:
        """Return the contour behind the change of sides or the onset."""
        end, anchor = self.part.last_direction.number, self.part.anchor_distance.number
        values = np.array(self.part.support.values)
        step = end / (len(values) - 3)

        def support(at: Array, order: int = 0) -> Array:
            basis: Array = _basis_derivative(at, end, len(values), order) @ values / step**order
            return basis

        directions = np.linspace(0.0, end, max(points, 1001))
        reached = directions - np.arcsin(support(directions) / anchor)
        # The change of sides turns the contour back by its width, so that much more of the angle is covered;
        # what a fit of the end point is off by is far less than that width.
        covered = float(reached[-1]) + 1.1 * self.part.changeover.number
        last = min(_end(covered, last_angle), float(reached[-1]))
        directions = np.linspace(0.0, float(np.interp(last, reached, directions)), points)
        p = support(directions)
        return Contour(directions, p, support(directions, 1), p + support(directions, 2), anchor)

    def fitted(self, angles: Array, lever_arms: Array, count: int, anchor: float | None) -> CamFit:
        """Return a cam with that lever arm, fitted through the law of this kind."""
        width, old = self.part.changeover.number, self.part.anchor_distance
        anchor = old.number if anchor is None else anchor
        dense, wanted = _dense(angles, lever_arms, count)
        root = np.hypot(dense, width)
        # The law is h = p(φ)·θ/√(θ² + w²) at φ − asin(p(φ)/D) = √(θ² + w²) − w.
        slope = np.where(dense > 0.0, dense / root, 1.0)
        directions = dense**2 / (root + width) + np.arcsin(np.clip(wanted / slope / anchor, -1.0, 1.0))
        end = float(directions[-1])
        basis = spline_basis(directions, end, count) * slope[:, None]
        values = _solved(basis, wanted, dense >= (10.0 * width if _jumps(wanted) else 0.0))
        error = _largest(basis @ values - wanted, dense > 20.0 * width)
        cam = replace(
            self.part,
            support=_row(self.part.support, values),
            last_direction=self.part.last_direction.with_value(end, _SOURCE),
            anchor_distance=old if anchor == old.number else old.with_value(anchor, _SOURCE),
        )
        return CamFit(cam, error, ("support", "last_direction"))


@dataclass(frozen=True, eq=False)
class DesignedCam:
    """A declared cam together with the contour that it was fitted to.

    The contour of the fitted cam ripples: it is the second derivative of a spline that follows the lever arm
    of the designed contour to micrometres, through the change of sides near angle zero. What is cut is the
    designed one.
    """

    part: Cam
    designed: Contour


@dataclass(frozen=True)
class _Designed(DeclaredCam[Cam]):
    designed: Contour

    @property
    def through_centre(self) -> bool:
        """As of the fitted cam."""
        return declared_cam(self.part).through_centre

    @property
    def anchor_distance(self) -> float:
        """Distance of the anchor in m."""
        return self.designed.anchor_distance

    def contour(self, last_angle: float | None, points: int) -> Contour:
        """Return the designed contour, at directions of equal distance."""
        angles, at = self.designed.angles, self.designed.directions
        end = float(angles[-1]) * (1.0 + _SOLVED)
        last = min(_end(end, last_angle), float(angles[-1]))
        directions = np.linspace(0.0, float(np.interp(last, angles, at)), points)
        p, slope, rho = self.designed.lever_arms, self.designed.slopes, self.designed.radii_of_curvature
        return Contour(
            directions,
            scipy.interpolate.CubicHermiteSpline(at, p, slope)(directions),
            scipy.interpolate.CubicHermiteSpline(at, slope, rho - p)(directions),
            np.interp(directions, at, rho),
            self.designed.anchor_distance,
        )

    def fitted(self, angles: Array, lever_arms: Array, count: int, anchor: float | None) -> CamFit:
        """Return a cam with that lever arm, of the kind of the declared one."""
        return declared_cam(self.part).fitted(angles, lever_arms, count, anchor)


def declared_cam(part: object) -> DeclaredCam[Any]:
    """Return a cam of an assembly as the design sees it."""
    if isinstance(part, DesignedCam):
        return _Designed(part.part, part.designed)
    if isinstance(part, TwoSidedCam):
        return _TwoSided(part)
    if isinstance(part, OneSidedCam):
        return _OneSided(part)
    if isinstance(part, AnchoredCam):
        return _Anchored(part)
    if isinstance(part, RollerCam):
        return _Roller(part)
    if isinstance(part, RollingPair):
        return _Pair(part)
    if isinstance(part, LopsidedCam):
        raise ArrangementError(
            "a LopsidedCam", "has two contours, and a target is for one",
            next_step="design both with design_sides(actuator, targets=(front, back), ...)",
        )  # fmt: skip
    raise ArrangementError(
        f"a {type(part).__name__}", "has no contour",
        next_step="give its spring a TwoSidedCam, OneSidedCam, AnchoredCam, RollerCam or RollingPair",
    )  # fmt: skip


def one_side(part: Any, *, back: bool, like: Any = None) -> Cam:
    """Return the cam with two equal sides that is a side of one whose sides differ.

    ``like``: the other side as it was designed, whose anchor and elements it shares.
    """
    if not isinstance(part, LopsidedCam):
        raise ArrangementError(
            f"a {type(part).__name__}", "has no contour for each side",
            next_step="declare it as a LopsidedCam, or design one curve with design_cam",
        )  # fmt: skip
    side = part.side(back=back)
    return side if like is None else replace(like, lever_arm=side.lever_arm, last_angle=side.last_angle)


def both_sides(part: Any, front: Any, back: Any) -> Cam:
    """Return a cam whose sides differ with the contours of two that were designed, and what these share."""
    made: Cam = replace(
        part, lever_arm=front.lever_arm, last_angle=front.last_angle, back_lever_arm=back.lever_arm,
        back_last_angle=back.last_angle, elements=front.elements, anchor_distance=front.anchor_distance,
    )  # fmt: skip
    return made


def one_sided(part: Any, last_angle: float) -> OneSidedCam:
    """Return a one-sided cam up to an angle in rad, with the elements and the cable of another."""
    arms, end = Quantity((0.01,) * 8, "m"), Quantity(last_angle, "rad")
    return OneSidedCam(lever_arm=arms, last_angle=end, elements=part.elements, cable=part.cable)


def with_roller(part: Any, arm: float, last_angle: float) -> RollerCam:
    """Return a cam with a roller to begin with: a bearing of 10 mm, and room for the pressure angle.

    ``arm``: a typical lever arm in m; ``last_angle`` in rad; ``part``: whose elements it has.
    """
    roller = Quantity(5e-3, "m", "assumed: a ball bearing 623 of 10 mm outer diameter")
    arms, base = Quantity((0.0, *[0.5 * arm] * 7), "m"), Quantity(2.0 * arm + roller.number, "m")
    end = Quantity(last_angle, "rad")
    return RollerCam(
        lever_arm=arms, last_angle=end, base_radius=base, roller_radius=roller, elements=part.elements
    )


def as_pair(part: Any, arm: float, last_angle: float) -> RollingPair:
    """Return a pair of cams to begin with, with the elements of another; as for :func:`with_roller`."""
    arms, base = Quantity((0.0, *[0.5 * arm] * 7), "m"), Quantity(8.0 * arm, "m")
    end = Quantity(last_angle, "rad")
    return RollingPair(lever_arm=arms, last_angle=end, base_distance=base, elements=part.elements)


def with_contour(part: object, contour: Contour | None) -> object:
    """Return a part as what the design sees of it: with its contour where that was designed.

    ``contour``: that it was fitted to; ``None`` where that is not known.
    """
    # What rolls follows the ripples of the fitted cam as well, so that is what it is judged by.
    if contour is None or not isinstance(part, Cam) or isinstance(part, MirroredCam):
        return part
    return DesignedCam(part, contour)


def contour_of_cam(cam: object, *, last_angle: float | None = None, points: int = 241) -> Contour:
    """Return the contour of a declared cam, without the change of sides or the onset near angle zero.

    Parameters
    ----------
    cam
        A :class:`~nlsdesign.components.TwoSidedCam`, ``OneSidedCam``, ``AnchoredCam``, ``RollerCam`` or
        ``RollingPair``.
    last_angle
        In rad; the end of the cam's table if it is left out.
    points
        Number of points.

    Raises
    ------
    ArrangementError
        If the part is no such cam.
    ValueRangeError
        If the contour ends before the last angle.
    """
    return declared_cam(cam).contour(last_angle, points)


def cam_from_profile(
    angles: ArrayLike,
    lever_arms: ArrayLike,
    *,
    like: object,
    count: int = 48,
    anchor_distance: float | None = None,
) -> CamFit:
    """Return a cam with a given lever arm.

    The control values are fitted to h(θ) through the law of the cam, with its change of sides or onset. A
    jump of h at zero is rounded over the width of those.

    ``angles`` are four or more θ that ascend from zero, ``lever_arms`` h there in m; of ``like``, a cam as
    for :func:`contour_of_cam`, all but its contour is kept, the anchor distance too where none is given.
    """
    made = declared_cam(like)
    theta, arm = np.asarray(angles, dtype=float), np.asarray(lever_arms, dtype=float)
    if theta[0] != 0.0 or np.any(np.diff(theta) <= 0.0) or theta.shape != arm.shape:
        raise ValueRangeError("cam table", "angles must ascend from zero, one lever arm for each")
    return made.fitted(theta, arm, count, anchor_distance)


def spline_basis(at: Array, last: float, count: int) -> Array:
    """Return the values of all uniform cubic B-splines of a cam, shape (n, count)."""
    return _basis_derivative(at, last, count, 0)


def _basis_derivative(at: Array, last: float, count: int, order: int) -> Array:
    """Return a derivative, 0 to 2, of all B-splines with respect to the angle in steps of the knots."""
    offset = (at / last * (count - 3))[:, None] - (np.arange(count) - 1)[None, :]
    outer, inner, sign = np.clip(2 - abs(offset), 0, None), np.clip(1 - abs(offset), 0, None), np.sign(offset)
    values = (
        (outer**3 - 4 * inner**3) / 6,
        -sign * (outer**2 - 4 * inner**2) / 2,
        outer - 4 * inner,
    )
    return np.asarray(values[order], dtype=float)


def _end(end: float, wanted: float | None) -> float:
    if wanted is None:
        return end
    if wanted > end * (1 + 1e-9):
        raise ValueRangeError(
            f"last_angle = {end:g} rad of the cam", f"the contour ends before the wanted {wanted:g} rad",
            next_step="free the contour, or ask for a target with a smaller angle",
        )  # fmt: skip
    return wanted


def _lever_arms(row: Quantity, last: Quantity, at: Array) -> Array:
    """Return a spline, continued below zero as the cubic that it is there."""
    end, values = last.number, np.array(row.values)
    first = np.linspace(0.0, end / (len(values) - 3), 4)
    start = np.polynomial.Polynomial.fit(first, spline_basis(first, end, len(values)) @ values, 3)
    return np.where(at < 0.0, start(at), spline_basis(at, end, len(values)) @ values)


def _dense(angles: Array, lever_arms: Array, count: int) -> tuple[Array, Array]:
    dense = np.linspace(0.0, angles[-1], max(_SAMPLES_PER_VALUE * count, len(angles)))
    return dense, scipy.interpolate.make_interp_spline(angles, lever_arms, k=3)(dense)


def _row(old: Quantity, values: Array) -> Quantity:
    """Return designed control values; the spread of those before was of another cam, made another way."""
    return old.with_value(significant(values), _SOURCE).with_spread(0.0)


def _jumps(wanted: Array) -> bool:
    return bool(abs(wanted[0]) > _JUMP * np.max(np.abs(wanted)))


def _solved(basis: Array, wanted: Array, used: Mask) -> Array:
    # Within the onset of a jump no angle is used, and the control values that act there alone are free: they
    # go on as their neighbours do.
    smooth = _LOOSE * np.diff(np.eye(basis.shape[1]), n=3, axis=0)[: 0 if used.all() else None]
    rows = np.vstack([basis[used], smooth])
    values, *_ = np.linalg.lstsq(rows, np.concatenate([wanted[used], np.zeros(len(smooth))]), rcond=None)
    return np.asarray(values, dtype=float)


def _largest(errors: Array, where: Mask) -> float:
    return float(np.max(np.abs(errors)[where], initial=0.0))
