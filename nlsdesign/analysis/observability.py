"""What can be seen of the states: rank, condition and Gramian.

Rank alone misleads: a rank of four with a condition number of nine thousand is no estimate. All numbers here
are of scaled matrices; the scaling is stated with them.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field

import numpy as np
from numpy.typing import NDArray
from scipy.linalg import expm

from ..errors import unknown_name
from ..model import FlatModel, Variable
from .sweep import RestPoint, View

Array = NDArray[np.float64]


@dataclass(frozen=True)
class Observability(View):
    """Rank and condition of the observability matrix, and the finite-horizon Gramian.

    The matrix is that of Ã = T·S⁻¹·A·S and C̃ = R⁻¹·C·S with S the nominal sizes of the states, R those of the
    outputs and T the time scale: rows C̃, C̃Ã, … up to the power n − 1.

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
    """

    nominal: Mapping[str, float] = field(default_factory=dict)
    time_scale: float = 1e-3
    tolerance: float = 1e-9
    horizon: float = 0.1
    measured: tuple[str, ...] = ()

    def columns(self, model: FlatModel) -> tuple[Variable, ...]:
        """Return the columns.

        Raises
        ------
        UnknownNameError
            If something measured is neither a state nor an output of the model.
        """
        known = {v.name for v in model.states + model.outputs}
        for name in (*self.nominal, *self.measured):
            if name not in known:
                raise unknown_name("state or output", name, known)
        scale = f"scaled, time scale {self.time_scale:g} s"
        return (
            Variable("observability.rank", "1", f"rank, tolerance {self.tolerance:g}"),
            Variable("observability.condition", "1", f"condition of the observability matrix, {scale}"),
            Variable("observability.smallest", "1", f"smallest singular value of that matrix, {scale}"),
            Variable("gramian.condition", "1", f"condition of the Gramian over {self.horizon:g} s, scaled"),
            Variable(
                "gramian.smallest", "1", f"smallest eigenvalue of the Gramian over {self.horizon:g} s, scaled"
            ),
        )

    def at(self, point: RestPoint) -> tuple[tuple[float, ...], dict[str, str]]:
        """Return the numbers; in words the direction that is not seen, or least."""
        a, c = self._scaled(point)
        powers = [c]
        for _ in range(len(a) - 1):
            powers.append(powers[-1] @ a)
        _, singular, directions = np.linalg.svd(np.vstack(powers))
        rank = int(np.sum(singular > self.tolerance * singular[0]))
        gramian = np.linalg.eigvalsh(_gramian(a / self.time_scale, c, self.horizon))
        numbers = (
            float(rank),
            _ratio(singular[0], singular[-1], self.tolerance),
            float(singular[-1]),
            # The Gramian is quadratic in the output: its eigenvalues count as zero below tolerance squared,
            # but not below what double precision can tell.
            _ratio(gramian[-1], gramian[0], max(self.tolerance**2, 1e-15)),
            float(max(gramian[0], 0.0)),
        )
        unseen = " and ".join(_in_words(row, point.linear.states) for row in directions[rank:])
        return numbers, {
            "null vector": unseen,
            "weakest direction": _in_words(directions[-1], point.linear.states),
        }

    def _scaled(self, point: RestPoint) -> tuple[Array, Array]:
        linear, sizes = point.linear, {**point.sizes, **self.nominal}
        chosen = [i for i, n in enumerate(linear.outputs) if not self.measured or n in self.measured]
        state = np.array([sizes.get(name, 1.0) for name in linear.states])
        output = np.array([sizes.get(linear.outputs[i], 1.0) for i in chosen])
        a = self.time_scale * linear.A * state[None, :] / state[:, None]
        return a, linear.C[chosen] * state[None, :] / output[:, None]


def _ratio(largest: float, smallest: float, tolerance: float) -> float:
    return float(largest / smallest) if smallest > tolerance * largest else float("inf")


def _gramian(a: Array, c: Array, horizon: float) -> Array:
    """Return ∫₀^horizon e^(Aᵀt)·CᵀC·e^(At) dt from one matrix exponential (Van Loan 1978)."""
    n = len(a)
    block = np.block([[-a.T, c.T @ c], [np.zeros((n, n)), a]])
    # In pieces: the exponential of −Aᵀ over the whole horizon would swamp the rest.
    pieces = max(1, int(np.ceil(horizon * np.max(np.sum(np.abs(a), axis=1)) / 2.0)))
    step = expm(block * horizon / pieces)
    forward = step[n:, n:]
    part = forward.T @ step[:n, n:]
    total, power = np.zeros((n, n)), np.eye(n)
    for _ in range(pieces):
        total += power.T @ part @ power
        power = power @ forward
    result: Array = (total + total.T) / 2
    return result


def _in_words(direction: Array, names: tuple[str, ...]) -> str:
    """Return the names of the states in a unit vector, largest share first, shares below 5 % left out."""
    order = np.argsort(-np.abs(direction))
    sign = np.sign(direction[order[0]])
    large = [i for i in order if abs(direction[i]) > 0.05]
    if len(large) == 1:
        return names[int(large[0])]
    return " ".join(f"{sign * direction[i]:+.2f} {names[i]}" for i in large)
