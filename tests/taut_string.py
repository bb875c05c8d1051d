"""A cable pulled taut around a lip of a cam that is a polygon: lengths alone, no support function.

The cable runs from the centre of the cam around the lip to an anchor on the x axis; at angle zero it lies
along that axis. Used by tests only; it shares no code with the package.
"""

from __future__ import annotations

from collections.abc import Callable

import numpy as np


def arc_lip(
    radius: float, middle: float, error: Callable[[np.ndarray], np.ndarray] | None = None
) -> np.ndarray:
    """Points of an arc that touches the x axis from below at (middle, 0), shape (40001, 2).

    ``error`` moves each tangent outwards by a length over the direction of its normal.
    """
    phi = np.linspace(0.0, 2.2, 40001)
    points = np.column_stack([middle + radius * np.sin(phi), radius * np.cos(phi) - radius])
    if error is None:
        return points
    step = 1e-5
    out, along = error(phi), (error(phi + step) - error(phi - step)) / (2 * step)
    normal, tangent = np.array([np.sin(phi), np.cos(phi)]), np.array([np.cos(phi), -np.sin(phi)])
    return points + (out * normal + along * tangent).T


def length(lip: np.ndarray, anchor: float, angle: float) -> float:
    """Length of the taut cable from the centre to the anchor, with the cam turned anticlockwise."""
    sine, cosine = np.sin(angle), np.cos(angle)
    end = np.array([anchor * cosine, -anchor * sine])  # the anchor seen from the cam
    away = np.hypot(*end)
    # Height of each point above the straight cable; none above means that nothing is touched.
    height = (lip[:, 1] * end[0] - lip[:, 0] * end[1]) / away
    if np.all(height <= 0.0):
        return float(away)
    # Seen from each end the touched point is the one that needs the steepest cable.
    first = int(np.argmax(np.arctan2(lip[:, 1], lip[:, 0])))
    seen = lip - end
    # From the anchor the cable comes in the direction of −x; the highest point is the one turned least.
    last = int(
        np.argmin(np.mod(np.arctan2(seen[:, 1], seen[:, 0]), 2 * np.pi) + 2 * np.pi * (seen[:, 0] > 0))
    )
    around = np.sum(np.hypot(*np.diff(lip[min(first, last) : max(first, last) + 1], axis=0).T))
    return float(np.hypot(*lip[first]) + around + np.hypot(*seen[last]))


def pulled(
    lip: np.ndarray, anchor: float, angles: np.ndarray, step: float = 5e-4
) -> tuple[np.ndarray, np.ndarray]:
    """Extension since just after angle zero, and lever arm as its slope."""
    start = length(lip, anchor, 0.0)
    longer = np.array([length(lip, anchor, angle) - start for angle in angles])
    arms = [(length(lip, anchor, a + step) - length(lip, anchor, a - step)) / (2 * step) for a in angles]
    return longer, np.array(arms)
