"""The sign of a loop of force over extension: a passive piece takes work over a cycle, it never gives any."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from ....foundation.arrays import Array

_BACK = 0.03
"""A path has come back where it is this near its beginning, as a share of its range."""
_SIGNIFICANT = 5.0
_LEAST_SHARE = 0.01
"""Below this share of the work on the way, rounding and filters decide on the sign."""


class Loop(NamedTuple):
    """Work over a path that comes back to where it began.

    Parameters
    ----------
    work
        ∮F dδ in J: what the piece has taken.
    share
        Of ∮|F dδ|, the work that went in and out.
    uncertainty
        Standard deviation of the work, from the noise of the force, in J.
    first, last
        Indices of the samples between which the path is closed.
    late_by
        Least delay of the force against the extension in s that turns the sign: with the force read so much
        earlier the loop is empty. Zero where the work is not negative.
    """

    work: float
    share: float
    uncertainty: float
    first: int
    last: int
    late_by: float

    @property
    def gives(self) -> bool:
        """Whether the piece has plainly given work."""
        return self.work < -_SIGNIFICANT * self.uncertainty and self.share < -_LEAST_SHARE

    @property
    def takes(self) -> bool:
        """Whether the piece has plainly taken work."""
        return self.work > _SIGNIFICANT * self.uncertainty and self.share > _LEAST_SHARE


def loop_of(extension: Array, force: Array, step: float, *, noise: float = 0.0) -> Loop | None:
    """Return the loop of a record, or ``None`` if its path does not come back.

    ``extension``, ``force``: of a piece, force positive against positive extension; shape (n,).
    """
    span = float(np.ptp(extension))
    back = np.flatnonzero(np.abs(extension - extension[0]) <= _BACK * span)
    last = int(back[-1])
    if span == 0.0 or last < len(extension) // 2:
        return None
    path, pull = extension[: last + 1], force[: last + 1]
    steps = np.diff(path)
    parts = 0.5 * (pull[1:] + pull[:-1]) * steps
    work = float(parts.sum() - np.mean(pull[[0, -1]]) * (path[-1] - path[0]))
    # A force that comes late by τ takes τ·∫ (dF/dt) dδ from the work, to first order.
    per_second = float(np.sum(np.diff(pull) * steps)) / step
    delay = -work / per_second if work < 0.0 < per_second else 0.0
    return Loop(
        work,
        work / max(float(np.abs(parts).sum()), 1e-300),
        noise * float(np.linalg.norm(steps)),
        0,
        last,
        delay,
    )
