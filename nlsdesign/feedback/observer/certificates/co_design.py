"""One gain and one Lyapunov function together, by matrix inequalities: V = eᵀPe falls at every corner.

With Y = P·M the inequality ρ²P ⪰ (A − MCA)ᵀP(A − MCA) is linear in P and Y, by Schur's complement, for every
corner A = F(q)·Φ. What is found here is a proposal: a certificate checks it in exact arithmetic on the table.
No other module knows the solver of semidefinite programs. Source: Boyd et al. 1994, sec. 5.1.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace
from typing import NamedTuple, TypeVar

import clarabel
import numpy as np
import scipy

from ....foundation.arrays import Array
from ....foundation.errors import ValueRangeError
from ..scheduling.angle_form import AngleScheduledPlant
from ..scheduling.step import ConstantGain, linear
from .exact import corners
from .polytope import friction_slopes, scaling

SOLVED = ("Solved", "AlmostSolved")


@dataclass(frozen=True, eq=False)
class Inequality:
    """F₀ + Σ xᵢ Fᵢ ⪰ 0."""

    constant: Array  # F₀, shape (n, n), symmetric
    factors: Array  # F, shape (unknowns, n, n), symmetric


def minimised(cost: Array, inequalities: Sequence[Inequality]) -> Array | None:
    """Return the unknowns of least cost under matrix inequalities; ``None`` where there are none."""
    rows, sides, cones = [], [], []
    for each in inequalities:
        n = len(each.constant)
        # The upper triangle, column by column.
        row, column = np.array([(i, j) for j in range(n) for i in range(j + 1)]).T
        weight = np.where(row == column, 1.0, math.sqrt(2.0))
        rows.append(-(each.factors[:, row, column] * weight).T)
        sides.append(each.constant[row, column] * weight)
        cones.append(clarabel.PSDTriangleConeT(n))
    settings = clarabel.DefaultSettings()
    settings.verbose = False
    count = len(cost)
    solver = clarabel.DefaultSolver(
        scipy.sparse.csc_matrix((count, count)), np.asarray(cost, dtype=float),
        scipy.sparse.csc_matrix(np.vstack(rows)), np.concatenate(sides), cones, settings,
    )  # fmt: skip
    solution = solver.solve()
    x = np.array(solution.x)
    return x if str(solution.status) in SOLVED and np.all(np.isfinite(x)) else None


Sought = TypeVar("Sought")

MARGIN = 1.02
"""How much faster than what is asked for a gain is designed, so that rounding does not spoil the proof."""
DIRECTIONS = 6
"""Up to so many independent directions in which the plant varies, all corners of their box are taken."""


class GainAndLyapunov(NamedTuple):
    """M (n, r) and P (n, n), in scaled states."""

    gain: Array
    lyapunov: Array


def unknown_matrices(n: int, r: int, corrected: Sequence[int], *, unit: float = 1.0) -> tuple[Array, Array]:
    """Return P (k, n, n) and Y (k, n, r) of each unknown; the last one, in neither, bounds the noise in V.

    ``corrected``: rows of the gain that may differ from zero, in a unit; P joins no other state with these.
    """
    pairs = [(i, j) for j in range(n) for i in range(j + 1) if (i in corrected) == (j in corrected)]
    spots = [(i, j) for i in corrected for j in range(r)]
    p = np.zeros((len(pairs) + len(spots) + 1, n, n))
    y = np.zeros((len(p), n, r))
    for k, (i, j) in enumerate(pairs):
        p[k, i, j] = p[k, j, i] = 1.0
    for k, (i, j) in enumerate(spots):
        y[len(pairs) + k, i, j] = unit
    return p, y


def least_disturbed(p: Array, y: Array, inequalities: Sequence[Inequality]) -> GainAndLyapunov | None:
    """Return gain and P that let the least of a wrong measurement into V; ``None`` where there are none."""
    cost = np.zeros(len(p))
    cost[-1] = 1.0
    result = minimised(cost, inequalities)
    if result is None:
        return None
    lyapunov = np.tensordot(result, p, 1)
    if np.min(np.linalg.eigvalsh(lyapunov)) <= 0.5:
        return None
    gain = np.linalg.solve(lyapunov, np.tensordot(result, y, 1))
    return GainAndLyapunov(np.asarray(gain, dtype=np.float64), lyapunov)


@dataclass(frozen=True, eq=False)
class GainProblem:
    """Corners of one sample before the correction, in scaled states, and what is asked of the gain."""

    corners: Array  # F(q)·Φ, shape (corners, n, n)
    output_matrix: Array  # C, shape (r, n)
    sample_time: float  # T in s
    moving: tuple[int, int]  # places of angle and speed
    condition: float  # largest condition of P

    @property
    def structures(self) -> tuple[tuple[int, ...], ...]:
        """Rows of the gain that may differ from zero: first those of angle and speed, then all."""
        return tuple(sorted(self.moving)), tuple(range(self.corners.shape[1]))

    @property
    def inner_limit(self) -> float:
        """Slowest rate in 1/s at which the inner states forget by themselves; infinite without any."""
        inner = [i for i in range(self.corners.shape[1]) if i not in self.moving]
        if not inner:
            return math.inf
        radius = float(np.max(np.abs(np.linalg.eigvals(self.corners[:, inner][:, :, inner]))))
        return -math.log(radius) / self.sample_time if radius > 0.0 else math.inf

    def solved(
        self, decay: float, moving_decay: float, *, corrected: Sequence[int]
    ) -> GainAndLyapunov | None:
        """Return the gain that lets the least of a wrong measurement into V; ``None`` where there is none."""
        n, r = self.corners.shape[1], len(self.output_matrix)
        p, y = unknown_matrices(n, r, corrected)
        ends = [np.eye(n), self.condition * np.eye(n)]
        inequalities = [Inequality(-ends[0], p), Inequality(ends[1], -p), noise_inequality(p, y)]
        moving = list(self.moving)
        for a in self.corners:
            moved = p @ a - y @ self.output_matrix @ a
            inequalities.append(_contraction(p, moved, math.exp(-2.0 * decay * self.sample_time)))
            block = np.ix_(range(len(p)), moving, moving)
            keep = math.exp(-2.0 * moving_decay * self.sample_time)
            if moving_decay > decay:
                inequalities.append(_contraction(p[block], moved[block], keep))
        solution = least_disturbed(p, y, inequalities)
        if solution is None:
            return None
        gain, lyapunov = solution.gain, solution.lyapunov
        contracted = self.corners - gain @ self.output_matrix @ self.corners
        holds = contraction(lyapunov, contracted) <= math.exp(-decay * self.sample_time) * (1.0 + 1e-9)
        return solution if holds else None


def noise_inequality(p: Array, y: Array) -> Inequality:
    """Return [[s·1, Yᵀ], [Y, P]] ⪰ 0, that is MᵀPM ⪯ s, with s the last unknown.

    ``p``, ``y``: P and Y = P·M by unknown, shapes (unknowns, n, n) and (unknowns, n, r).
    """
    count, n, r = y.shape
    factors = np.zeros((count, r + n, r + n))
    factors[:, r:, r:], factors[:, r:, :r], factors[:, :r, r:] = p, y, y.transpose(0, 2, 1)
    factors[-1, :r, :r] = np.eye(r)
    return Inequality(np.zeros((r + n, r + n)), factors)


def _contraction(p: Array, moved: Array, keep: float) -> Inequality:
    """Return [[keep·P, (P·E)ᵀ], [P·E, P]] ⪰ 0."""
    n = p.shape[1]
    factors = np.zeros((len(p), 2 * n, 2 * n))
    factors[:, :n, :n], factors[:, n:, n:] = keep * p, p
    factors[:, n:, :n], factors[:, :n, n:] = moved, moved.transpose(0, 2, 1)
    return Inequality(np.zeros((2 * n, 2 * n)), factors)


def contraction(lyapunov: Array, errors: Array) -> float:
    """Return the largest factor by which √(eᵀPe) can change in one sample.

    ``lyapunov``: P, shape (n, n), positive definite. ``errors``: shape (corners, n, n).
    """
    root = np.linalg.cholesky(lyapunov).T
    return float(np.max(np.linalg.norm(root @ errors @ np.linalg.inv(root), ord=2, axis=(1, 2))))


def lyapunov_function(errors: Array, keep: float, condition: float) -> Array | None:
    """Return P of condition at most so much with eᵀPe falling by ``keep`` at every corner, or ``None``.

    ``errors``: shape (corners, n, n), in scaled states.
    """
    n = errors.shape[1]
    pairs = [(i, j) for j in range(n) for i in range(j + 1)]
    p = np.zeros((len(pairs) + 1, n, n))
    for k, (i, j) in enumerate(pairs):
        p[k, i, j] = p[k, j, i] = 1.0
    margin, cost = np.zeros_like(p), np.zeros(len(p))
    margin[-1], cost[-1] = np.eye(n), -1.0
    inequalities = [Inequality(-np.eye(n), p), Inequality(condition * np.eye(n), -p)]
    inequalities += [
        Inequality(np.zeros((n, n)), keep * p - e.T @ p @ e - margin) for e in errors
    ]  # ρ²P − EᵀPE ⪰ margin
    result = minimised(cost, inequalities)
    if result is None or result[-1] <= 0.0:
        return None
    return np.tensordot(result, p, 1)


def fastest(at_decay: Callable[[float], Sought | None], highest: float) -> tuple[float, Sought] | None:
    """Return the largest decay, within a thousandth, at which something is found, and what; by bisection.

    ``highest``: where the search begins; nothing faster is tried.
    """
    best, at, low, high = at_decay(highest), highest, 0.0, highest
    if best is not None:
        return at, best
    while high > 1e-9 * highest and high - low > 1e-3 * low:
        middle = math.sqrt(low * high) if low else high / 4.0
        tried = at_decay(middle)
        if tried is None:
            high = middle
        else:
            low, best = middle, tried
    return None if best is None else (low, best)


@dataclass(frozen=True)
class CertifiedGain:
    """One gain for every angle, designed together with the Lyapunov function that proves it.

    The table over the angle stays as it is; only the correction is constant. Dry friction of the
    plant is part of the design, as the sector of slopes of the braked speed. Among the gains that are fast
    enough, the one is taken that lets the least of a wrong measurement into the error.

    Raises
    ------
    ValueRangeError
        If a setting is not positive, or, when the observer is designed, no gain is fast enough: with the
        fastest that is, and what limits it.

    Notes
    -----
    Nothing corrects the rubber: where the lever arm vanishes no measurement says anything about it, so for a
    moving angle no gain makes it forget faster than k/η, and a correction elsewhere would let errors of
    current and friction into the torque. Only where that structure does not suffice, rows of the inner states
    are designed too.

    Parameters
    ----------
    decay
        Least decay of the whole error in 1/s; by default 95 % of the fastest, but no faster than angle and
        speed are asked to be.
    bandwidth
        f in Hz; while the rubber is right, angle and speed decay at least with 2πf.
    condition
        Largest condition of P in states over their typical sizes.
    """

    decay: float | None = None
    bandwidth: float = 20.0
    condition: float = 100.0

    def __post_init__(self) -> None:
        for name in ("decay", "bandwidth", "condition"):
            value = getattr(self, name)
            if value is not None and not 0.0 < value < math.inf:
                raise ValueRangeError(f"{name} {value:g}", "must be positive and finite")
        if self.condition < 1.0:
            raise ValueRangeError(f"condition {self.condition:g}", "no matrix has a condition below 1")

    def fitted(self, plant: AngleScheduledPlant, sample_time: float, angles: Array) -> ConstantGain:
        """Return the gain; see :class:`~nlsdesign.feedback.observer.scheduling.step.FittedGain`.

        Parameters
        ----------
        plant
            In the form that an observer is designed on.
        sample_time
            T in s.
        angles
            Angles that stand for the range, shape (N,).

        Raises
        ------
        ValueRangeError
            If no gain is fast enough.
        """
        problem = gain_problem(plant, sample_time, angles, condition=self.condition)
        gain = np.array(scaling(plant))[:, None] * self._fast_enough(problem).gain
        # To seven digits: what is written is what is proved.
        return ConstantGain(tuple(tuple(float(f"{v:.7g}") for v in row) for row in gain))

    def _fast_enough(self, problem: GainProblem) -> GainAndLyapunov:
        wanted = 2.0 * math.pi * self.bandwidth
        for rows in problem.structures:
            if self.decay is not None:
                trials = [self.decay * MARGIN, self.decay]
            else:
                best = fastest(lambda d: problem.solved(d, wanted * MARGIN, corrected=rows), wanted * MARGIN)  # noqa: B023
                trials = [] if best is None else [best[0] if best[0] >= wanted else 0.97 * best[0], best[0]]
            for decay in trials:
                result = problem.solved(decay, wanted * MARGIN, corrected=rows)
                if result is not None:
                    return result
        raise self._refusal(problem)

    def _refusal(self, problem: GainProblem) -> ValueRangeError:
        """Return what is said where no gain is fast enough: the fastest that is, and what limits it."""
        wanted, every = 2.0 * math.pi * self.bandwidth, 1.0 / problem.sample_time
        rows = problem.structures[0]
        loose = replace(problem, condition=1e4 * problem.condition)
        carried, free = (
            fastest(lambda d: each.solved(1e-6 * every, d, corrected=rows), 20.0 * every)  # noqa: B023
            for each in (problem, loose)
        )
        if carried is None or carried[0] < wanted * MARGIN:
            most = 0.0 if carried is None else carried[0] / (2.0 * math.pi * MARGIN)
            by_condition = free is not None and free[0] >= wanted * MARGIN
            beyond = f"P of condition {self.condition:g}" if by_condition else "what the sample rate carries"
            return ValueRangeError(
                f"bandwidth {self.bandwidth:g} Hz",
                f"is beyond {beyond}, at one sample every {problem.sample_time:g} s; "
                f"the fastest with a proof is {most:.3g} Hz",
                next_step=f"ask for at most {0.98 * most:.3g} Hz, or sample faster",
            )
        reached = fastest(lambda d: problem.solved(d, wanted * MARGIN, corrected=rows), 20.0 * every)
        most = 0.0 if reached is None else reached[0]
        limit = problem.inner_limit
        if most > 0.8 * limit:
            reason = (
                f"where the lever arm vanishes nothing corrects the rubber, which forgets at {limit:.4g} 1/s"
            )
        else:
            reason = (
                f"P of condition {self.condition:g} and one sample every {problem.sample_time:g} s limit it"
            )
        asked = "" if self.decay is None else f" {self.decay:g} 1/s"
        return ValueRangeError(
            f"decay{asked}",
            f"is not reached by any gain; the fastest that is proved is {most:.4g} 1/s: {reason}",
            next_step=f"ask for at most {0.98 * most:.3g} 1/s",
        )


def gain_problem(
    plant: AngleScheduledPlant, sample_time: float, angles: Array, *, condition: float
) -> GainProblem:
    """Return the corners of the exact step over a range of angles."""
    scale = np.array(scaling(plant))
    transition = linear(plant.at(angles).a, sample_time)[0]
    transition = transition * scale[None, None, :] / scale[None, :, None]
    angle, speed = plant.moving
    braked = []
    for q in sorted(set(friction_slopes(plant, sample_time))):
        matrix = np.eye(len(scale))
        matrix[speed, speed] = q
        matrix[angle, speed] = sample_time / 2.0 * (q - 1.0) * scale[speed] / scale[angle]
        braked.append(matrix)
    every = np.array([f @ phi for f in braked for phi in _hull(transition)])
    return GainProblem(every, plant.output_matrix * scale[None, :], sample_time, plant.moving, condition)


def _hull(matrices: Array) -> Array:
    """Return few matrices whose convex hull holds all that are given."""
    count, n = len(matrices), matrices.shape[1]
    flat = matrices.reshape(count, -1)
    centre = flat.mean(axis=0)
    _, singular, directions = np.linalg.svd(flat - centre, full_matrices=False)
    used = directions[singular > 1e-12 * max(1.0, float(np.max(np.abs(flat))))]
    if len(used) > DIRECTIONS:
        return matrices
    share = (flat - centre) @ used.T
    ends = corners(list(share.min(axis=0)), list(share.max(axis=0)))
    return np.array([centre + np.array(end) @ used for end in ends]).reshape(-1, n, n)
