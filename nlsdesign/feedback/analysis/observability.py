"""What can be seen of the states: rank, condition and Gramian, and what becomes of what is not seen.

Rank alone misleads: a rank of four with a condition number of nine thousand is no estimate. All numbers here
are of scaled matrices; the scaling is stated with them.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from ...foundation.errors import unknown_name
from ...model import FlatModel, Variable
from .batched import exponential_and_gramian, transposed
from .rest_points import RestPoints
from .sweep import Columns, View

Array = NDArray[np.float64]
_STILL = 1e-9
"""Share of the largest slope below which the eigenvalue of what is not seen counts as zero."""


class Unseen(NamedTuple):
    """What a measurement does not see at one angle.

    ``directions``: orthonormal in units of the typical sizes, shape (k, n); ``eigenvalues``: of the motion
    within them, shape (k,); ``words``: names and shares of the states.
    """

    directions: Array
    eigenvalues: NDArray[np.complex128]
    words: str

    @property
    def detectable(self) -> bool:
        """Whether all that is not seen decays."""
        return bool(np.all(self.eigenvalues.real < 0.0))

    def fate(self) -> str:
        """Return in words what becomes of it."""
        slowest = self.eigenvalues[int(np.argmax(self.eigenvalues.real))]
        if slowest.real < 0.0:
            return f"decays with {slowest.real:.3g} 1/s: detectable"
        if slowest.real == 0.0:
            return "does not decay (eigenvalue 0): not detectable"
        return f"grows with {slowest.real:+.3g} 1/s: not detectable"


@dataclass(frozen=True)
class Observability(View):
    """Rank and condition of the observability matrix, and the finite-horizon Gramian.

    The matrix is that of Ã = T·S⁻¹·A·S and C̃ = R⁻¹·C·S with S the nominal sizes of the states, R those of the
    outputs and T the time scale: rows C̃, C̃Ã, … up to the power n − 1. A is that of the machine that moves:
    dry friction has its sliding level. While it sticks, an angle shows nothing of the inner states.

    Parameters
    ----------
    nominal
        Sizes by name of state or output in SI; the typical sizes over the sweep for those left out.
    time_scale
        T in s, by default one sample at 1 kHz.
    tolerance
        Singular values below ``tolerance`` times the largest count as zero.
    horizon
        Length of the Gramian ∫e^(Aᵀt)CᵀCe^(At)dt in s.
    measured
        Outputs that are measured; all of them by default.

    Notes
    -----
    The linearisation is exact, so it contains −N·h′(θ)·F/J, the change of the lever arm with the angle. An
    observer that reads its matrices at the measured angle does not need it; rank and null vector are equal.

    The angles of a sweep meet an angle where the rank drops by chance only;
    :func:`~nlsdesign.feedback.analysis.rank_drops.rank_drops` finds them exactly.
    """

    nominal: Mapping[str, float] = field(default_factory=dict)
    time_scale: float = 1e-3
    tolerance: float = 1e-9
    horizon: float = 0.1
    measured: tuple[str, ...] = ()

    def over(self, points: RestPoints) -> Columns:
        """Return the numbers; in words the direction that is not seen, or least, and what becomes of it.

        Raises
        ------
        UnknownNameError
            If something measured is no output of the model, or a size is of something that is not in it.
        """
        self._check(points.model)
        a, c = self.scaled(points)
        _, singular, directions = np.linalg.svd(observability_matrices(a, c), full_matrices=True)
        singular = _padded(singular, a.shape[-1])
        seen = singular > self.tolerance * singular[:, :1]
        _, gramians = exponential_and_gramian(a / self.time_scale, transposed(c) @ c, self.horizon)
        gramian = np.asarray(np.linalg.eigvalsh(gramians), dtype=float)
        # The Gramian is quadratic in the output: its eigenvalues count as zero below tolerance squared, but
        # not below what double precision can tell.
        values = (
            np.sum(seen, axis=-1).astype(float),
            _ratio(singular[:, 0], singular[:, -1], self.tolerance),
            singular[:, -1],
            _ratio(gramian[:, -1], gramian[:, 0], max(self.tolerance**2, 1e-15)),
            np.maximum(gramian[:, 0], 0.0),
        )
        names = points.state_names
        unseen = [
            None if all(row) else unseen_of(v[~row], each / self.time_scale, names)
            for row, v, each in zip(seen, directions, a, strict=True)
        ]
        words = {
            "null vector": tuple(each.words if each else "" for each in unseen),
            "weakest direction": tuple(in_words(v[-1], names) for v in directions),
            "verdict": tuple(f"{e.words} not seen, {e.fate()}" if e else "observable" for e in unseen),
        }
        return Columns(self._columns(points), np.column_stack(values), words)

    def scaled(self, points: RestPoints) -> tuple[Array, Array]:
        """Return Ã and C̃, shapes (N, n, n) and (N, r, n).

        Parameters
        ----------
        points
            The model at rest at each angle.
        """
        sizes = {**points.sizes, **self.nominal}
        chosen = [i for i, n in enumerate(points.output_names) if not self.measured or n in self.measured]
        state = np.array([sizes.get(name, 1.0) for name in points.state_names])
        output = np.array([sizes.get(points.output_names[i], 1.0) for i in chosen])
        a = self.time_scale * points.moving.a * state[None, :] / state[:, None]
        return a, points.moving.c[:, chosen] * state[None, :] / output[:, None]

    def _check(self, model: FlatModel) -> None:
        outputs = {v.name for v in model.outputs}
        known = outputs | {v.name for v in model.states}
        for name in self.nominal:
            if name not in known:
                raise unknown_name("state or output", name, known)
        for name in self.measured:
            if name not in outputs:
                raise unknown_name("measured output", name, outputs)

    def _columns(self, points: RestPoints) -> tuple[Variable, ...]:
        scale = f"scaled, time scale {self.time_scale:g} s, mode {points.moving.name!r}"
        gramian = f"of the Gramian over {self.horizon:g} s, scaled"
        return (
            Variable("observability.rank", "1", f"rank, tolerance {self.tolerance:g}"),
            Variable("observability.condition", "1", f"condition of the observability matrix, {scale}"),
            Variable("observability.smallest", "1", f"smallest singular value of that matrix, {scale}"),
            Variable("gramian.condition", "1", f"condition {gramian}"),
            Variable("gramian.smallest", "1", f"smallest eigenvalue {gramian}"),
        )


def observability_matrices(a: Array, c: Array) -> Array:
    """Return the rows C, CA, … up to the power n − 1, shape (N, r·n, n).

    Parameters
    ----------
    a, c
        Shapes (N, n, n) and (N, r, n).
    """
    powers = [c]
    for _ in range(a.shape[-1] - 1):
        powers.append(powers[-1] @ a)
    return np.concatenate(powers, axis=1)


def unseen_of(directions: Array, a: Array, names: tuple[str, ...]) -> Unseen:
    """Return what becomes of directions that are not seen.

    Parameters
    ----------
    directions
        Orthonormal, shape (k, n), in units of the sizes.
    a
        Slopes in the same units, shape (n, n), in 1/s.
    names
        Of the states.
    """
    eigenvalues = np.linalg.eigvals(directions @ a @ directions.T).astype(complex)
    zero = np.abs(eigenvalues) <= _STILL * np.max(np.abs(a))
    return Unseen(
        directions,
        np.where(zero, 0.0, eigenvalues),
        " and ".join(in_words(each, names) for each in directions),
    )


def in_words(direction: Array, names: tuple[str, ...]) -> str:
    """Return the names of the states in a unit vector, largest share first, shares below 5 % left out.

    Parameters
    ----------
    direction
        Shape (n,).
    names
        Of the states.
    """
    order = np.argsort(-np.abs(direction))
    sign = np.sign(direction[order[0]])
    large = [i for i in order if abs(direction[i]) > 0.05]
    if len(large) == 1:
        return names[int(large[0])]
    return " ".join(f"{sign * direction[i]:+.2f} {names[i]}" for i in large)


def _padded(singular: Array, count: int) -> Array:
    """Return the singular values with zeros for directions that no row can see."""
    missing = count - singular.shape[-1]
    return np.pad(singular, ((0, 0), (0, missing))) if missing else singular


def _ratio(largest: Array, smallest: Array, tolerance: float) -> Array:
    counts = smallest > tolerance * largest
    return np.where(counts, largest / np.where(counts, smallest, 1.0), np.inf)
