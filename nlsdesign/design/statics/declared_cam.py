"""From a lever arm to a declared cam, and from a declared cam to its contour."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike, NDArray
from scipy.interpolate import make_interp_spline

from ...components.transmission.cam import TwoSidedCam
from ...errors import ArrangementError, ValueRangeError
from ...quantity import Quantity, significant
from .contour import Contour, contour_from_lever_arm

Floats = NDArray[np.float64]

_SAMPLES_PER_VALUE = 12


def contour_of_cam(cam: object, *, last_angle: float | None = None, points: int = 241) -> Contour:
    """Return the contour of a declared cam, without the change of sides near angle zero.

    Parameters
    ----------
    cam
        A :class:`~nlsdesign.components.TwoSidedCam`; its lever arm and anchor distance are used.
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
    cam = two_sided(cam)
    end = cam.last_angle.number
    last = end if last_angle is None else last_angle
    if last > end * (1 + 1e-9):
        raise ValueRangeError(
            f"last_angle = {end:g} rad of the cam", f"the contour ends before the wanted {last:g} rad",
            next_step="free the contour, or ask for a target with a smaller angle",
        )  # fmt: skip
    angles = np.linspace(0.0, last, points)
    values = np.array(cam.lever_arm.values)
    # Beyond the change of sides the cable lies on the contour with the lever arm H(θ − w); near zero the
    # contour goes on as the cubic that H is there.
    first = np.linspace(0.0, cam.step, 4)
    start = np.polynomial.Polynomial.fit(first, _spline_basis(first, end, len(values)) @ values, 3)
    beyond = angles - cam.changeover.number
    arms = np.where(beyond < 0.0, start(beyond), _spline_basis(beyond, end, len(values)) @ values)
    return contour_from_lever_arm(angles, arms, anchor_distance=cam.anchor_distance.number)


@dataclass(frozen=True)
class CamFit:
    """A declared cam and how well it holds the lever arm that it was made for.

    Parameters
    ----------
    cam
        The cam.
    error
        Largest deviation of its lever arm in m, outside the change of sides.
    """

    cam: TwoSidedCam
    error: float

    def changes(self) -> dict[str, Quantity]:
        """Return the numbers that the fit has changed, by their names in the cam."""
        return {"lever_arm": self.cam.lever_arm, "last_angle": self.cam.last_angle}


def cam_from_profile(angles: ArrayLike, lever_arms: ArrayLike, *, like: object, count: int = 48) -> CamFit:
    """Return a two-sided cam with a given lever arm.

    The law of :class:`~nlsdesign.components.TwoSidedCam` changes sides over the angle w; the control values
    are fitted to h(θ) through that law, so that the change costs nothing where h starts at zero. A jump of
    h at zero is rounded over w.

    Parameters
    ----------
    angles
        θ from zero, ascending, shape (n,), n ≥ 4.
    lever_arms
        h, shape (n,), in m.
    like
        A :class:`~nlsdesign.components.TwoSidedCam`; its number of elements, change of sides and anchor
        distance are kept.
    count
        Number of control values.

    Raises
    ------
    ValueRangeError
        If the table does not ascend from zero.
    ArrangementError
        If ``like`` is no two-sided cam.
    """
    like = two_sided(like)
    theta, arm = np.asarray(angles, dtype=float), np.asarray(lever_arms, dtype=float)
    if theta[0] != 0.0 or np.any(np.diff(theta) <= 0.0) or theta.shape != arm.shape:
        raise ValueRangeError("cam table", "angles must ascend from zero, one lever arm for each")
    width = like.changeover.number
    dense = np.linspace(0.0, theta[-1], max(_SAMPLES_PER_VALUE * count, len(theta)))
    wanted = make_interp_spline(theta, arm, k=3)(dense)
    root = np.hypot(dense, width)
    basis = _spline_basis(dense**2 / (root + width), theta[-1], count) * (dense / root)[:, None]
    # Where the lever arm jumps at zero, the change of sides is none of the contour's business.
    jumps = abs(wanted[0]) > 1e-6 * float(np.max(np.abs(wanted)))
    used = dense >= 10.0 * width if jumps else np.ones(len(dense), dtype=bool)
    values, *_ = np.linalg.lstsq(basis[used], wanted[used], rcond=None)
    beyond = dense > 20.0 * width
    error = float(np.max(np.abs(basis @ values - wanted)[beyond], initial=0.0))
    source = "designed: fitted to a lever arm over the angle"
    cam = TwoSidedCam(
        lever_arm=like.lever_arm.with_value(significant(values), source),
        last_angle=like.last_angle.with_value(float(theta[-1]), source),
        changeover=like.changeover,
        anchor_distance=like.anchor_distance,
        elements=like.elements,
        cable=like.cable,
    )
    return CamFit(cam, error)


def two_sided(part: object) -> TwoSidedCam:
    """Return a part if it is a two-sided cam.

    Parameters
    ----------
    part
        Any part.

    Raises
    ------
    ArrangementError
        If it has no contour.
    """
    if not isinstance(part, TwoSidedCam):
        raise ArrangementError(
            f"a {type(part).__name__}", "has no contour", next_step="declare the spring with a TwoSidedCam"
        )
    return part


def _spline_basis(at: Floats, last: float, count: int) -> Floats:
    """Return the values of all uniform cubic B-splines of a cam at some angles, shape (n, count)."""
    distance = np.abs((at / last * (count - 3))[:, None] - (np.arange(count) - 1)[None, :])
    result: Floats = (np.clip(2 - distance, 0, None) ** 3 - 4 * np.clip(1 - distance, 0, None) ** 3) / 6
    return result
