"""Certificates in continuous time: one gain L and one P for every A of ė = (A(θ) − L·C)·e.

With Y = P·L the inequality (A − LC)ᵀP + P(A − LC) + 2αP ≺ 0 is linear in P and Y; it is affine in A, so the
corners of the ranges of its entries decide. The solver proposes, fractions decide.
Source: Boyd et al. 1994, sec. 5.1.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import asdict, dataclass
from fractions import Fraction
from typing import Any, ClassVar

import numpy as np

from ....foundation.arrays import Array
from ....foundation.errors import ValueRangeError
from ....model import FlatModel
from ....model.paper_form import PaperFormNames
from ....model.roles import measured_motion, spring_torque
from ..scheduling.angle_form import Minimal, PaperForm
from ..scheduling.scheduled import whole_contour
from .certificate import FORMAT, Certificate
from .co_design import (
    MARGIN,
    GainAndLyapunov,
    Inequality,
    fastest,
    least_disturbed,
    noise_inequality,
    unknown_matrices,
)
from .error_system import ErrorSystem, error_system
from .exact import combined, exact, is_positive_definite, times, transposed

BANDWIDTH = 20.0
"""Hz; no faster decay is sought where none is asked for."""


@dataclass(frozen=True, eq=False)
class ContinuousContraction:
    """The error of an observer in continuous time decays, with one gain for every angle."""

    form: ClassVar[str] = f"{FORMAT}, continuous time"
    sampled: ClassVar[bool] = False

    states: Minimal | PaperForm  # which states the observer carries
    gain: tuple[tuple[float, ...], ...]  # L, one row per state, one number per measured output
    system: ErrorSystem  # all matrices A
    lyapunov: Array  # P in scaled states, shape (n, n)
    decay: float  # in 1/s: √(eᵀPe) falls at least with e^(−decay·t)
    condition: float  # bound on the condition of P

    @property
    def statement(self) -> tuple[str, ...]:
        """Return in sentences what is proved, and what is not."""
        least, greatest = self.system.friction
        low, high = self.system.angles
        return (
            f"In continuous time two runs of the observer x̂' = f(x̂, u, θ) + L·(y − C·x̂) on the same "
            f"measured angle approach each other at least with e^(-{self.decay:.6g} t), in the norm of P "
            f"(condition at most {self.condition:g}), for every motion from {low:.4g} to {high:.4g} rad, "
            f"every current, and friction whose slope over the speed lies between {-greatest:.6g} and "
            f"{-least:.6g} 1/s, dry friction included as a sector.",
            "The plant itself is such a run where deck and measurement are exact, so its state is estimated "
            "with this decay. A controller samples: nothing is said of that here.",
        )

    def observer(self) -> dict[str, Any]:
        """Return what a file says of the observer beside the names of its torque and angle."""
        form: dict[str, Any] = {"states": "minimal"}
        if isinstance(self.states, PaperForm):
            form = {"states": "published", "names": asdict(self.states.names)}
        return {"form": form, "gain": [list(row) for row in self.gain]}

    def numbers(self) -> dict[str, Any]:
        """Return the numbers of the proof as JSON holds them."""
        return {
            "system": asdict(self.system),
            "lyapunov": self.lyapunov.tolist(),
            "decay": self.decay,
            "condition": self.condition,
        }

    @classmethod
    def read(cls, content: dict[str, Any]) -> ContinuousContraction:
        """Return the proof that the content of a file holds; ``ValueError`` where it does not fit."""
        form, e = content["observer"]["form"], content["system"]
        states: Minimal | PaperForm = Minimal()
        if form["states"] == "published":
            states = PaperForm(PaperFormNames(**form["names"]))
        elif form["states"] != "minimal":
            raise ValueError(f"form '{form['states']}' is not known")
        low, high, gain = (
            tuple(tuple(float(v) for v in row) for row in matrix)
            for matrix in (e["lower"], e["upper"], content["observer"]["gain"])
        )
        system = ErrorSystem(
            tuple(e["states"]), tuple(e["sizes"]), (e["moving"][0], e["moving"][1]), tuple(e["seen"]),
            (e["angles"][0], e["angles"][1]), low, high,
        )  # fmt: skip
        n, lyapunov = len(system.states), np.array(content["lyapunov"], dtype=float)
        square = all(len(m) == n and all(len(row) == n for row in m) for m in (low, high, lyapunov.tolist()))
        if not square or [len(row) for row in gain] != [len(system.seen)] * n or min(system.sizes) <= 0.0:
            raise ValueError("matrices do not have one row per state")
        return cls(states, gain, system, lyapunov, float(content["decay"]), float(content["condition"]))


def certify_continuous(
    model: FlatModel,
    *,
    estimate: str | None = None,
    measured: str | None = None,
    form: Minimal | PaperForm | None = None,
    decay: float | None = None,
    condition: float = 100.0,
    angles: tuple[float, float] | None = None,
) -> Certificate[ContinuousContraction]:
    """Design one gain in continuous time together with the proof that every error vanishes.

    Parameters
    ----------
    model
        Continuous, load fixed.
    estimate, measured
        Torque and angle; decided from the structure if they are left out.
    form
        Which states the observer carries: :class:`Minimal` by default, or :class:`PaperForm`.
    decay
        In 1/s; by default 95 % of the fastest that can be, but no faster than 2π·20 Hz.
    condition
        Largest condition of P in states over their typical sizes.
    angles
        Range of the angle in rad; the whole contour of the cam by default.

    Raises
    ------
    ValueRangeError
        If a setting is not positive or a range is empty, or no gain is fast enough: with the fastest decay
        that can be proved and what limits it.
    ArrangementError
        If the error is not linear with coefficients that depend on the angle alone, but for friction.
    ConvergenceError
        If an entry has no bound.
    """
    for name, value in (("decay", decay), ("condition", condition)):
        if value is not None and not 0.0 < value < math.inf:
            raise ValueRangeError(f"{name} {value:g}", "must be positive and finite")
    if condition < 1.0:
        raise ValueRangeError(f"condition {condition:g}", "no matrix has a condition below 1")
    contour = whole_contour(model)
    over = (contour.lower, contour.upper) if angles is None else angles
    if not (math.isfinite(over[0]) and math.isfinite(over[1]) and over[0] < over[1]):
        raise ValueRangeError(f"angles {over[0]:g} to {over[1]:g} rad", "must be finite and ascending")
    estimate, measured = spring_torque(model, estimate), measured_motion(model, measured)
    form = form or Minimal()
    system = error_system(model, form, estimate=estimate, measured=measured, angles=over)
    solution, reached = _designed(system, decay, condition)
    gain = tuple(tuple(row) for row in solution.gain.tolist())
    proof = ContinuousContraction(form, gain, system, solution.lyapunov, reached, condition)
    return Certificate(("", ""), model.values, estimate, measured, proof)


def _designed(system: ErrorSystem, decay: float | None, condition: float) -> tuple[GainAndLyapunov, float]:
    """Return a gain and P, rounded and decided in fractions, and their decay."""
    matrices, most = system.scaled_corners(), 2.0 * math.pi * BANDWIDTH
    rows = sorted({*system.moving, *system.seen}), list(range(len(system.states)))
    for corrected in rows if len(rows[0]) < len(rows[1]) else rows[:1]:
        if decay is None:
            best = fastest(lambda d: _solved(system, matrices, d, condition, corrected), most)  # noqa: B023
            trials = [] if best is None else [best[0] if best[0] >= most else 0.97 * best[0], 0.9 * best[0]]
        else:
            trials = [decay]
        for each in trials:
            rate = float(f"{each:.6g}")
            solution = _solved(system, matrices, rate, condition, corrected)
            if solution is not None and decays(system, solution, rate):
                return solution, rate
    highest = 100.0 * max(most, decay or 0.0)
    best = fastest(lambda d: _solved(system, matrices, d, condition, rows[1]), highest)
    raise ValueRangeError(
        "decay" if decay is None else f"decay {decay:g} 1/s",
        "is not proved for any gain" if best is None
        else f"is not reached by any gain; the fastest that is proved is {best[0]:.4g} 1/s: "
        + _limit(system, best[0], condition),
        next_step="allow a larger condition or a smaller range of angles" if best is None
        else f"ask for at most {0.98 * best[0]:.3g} 1/s",
    )  # fmt: skip


def _limit(system: ErrorSystem, reached: float, condition: float) -> str:
    """Return what keeps the decay from being faster, in words."""
    inner = [i for i in range(len(system.states)) if i not in (*system.moving, *system.seen)]
    slowest = min((-system.upper[i][i] for i in inner), default=math.inf)
    if reached > 0.8 * slowest:
        return f"where the lever arm vanishes nothing corrects the rubber, which forgets at {slowest:.4g} 1/s"
    return f"P of condition {condition:g} and the sector of friction limit it"


def _solved(
    system: ErrorSystem, corners: Array, decay: float, condition: float, corrected: Sequence[int]
) -> GainAndLyapunov | None:
    """Return the gain that lets the least of a wrong measurement into V; L in SI, both rounded."""
    n, r, size = len(system.states), len(system.seen), np.array(system.sizes)
    output = np.zeros((r, n))
    output[range(r), system.seen] = 1.0
    # Unknowns of one size: a correction of angle and speed is some hundred times per second.
    unit = max(decay, float(np.max(np.abs(corners))))
    p, y = unknown_matrices(n, r, corrected, unit=unit)
    inequalities = [
        Inequality(-np.eye(n), p),
        Inequality(condition / 1.001 * np.eye(n), -p),
        noise_inequality(p, y / unit),
    ]
    for a in corners:
        moved = p @ a - y @ output
        falling = -(moved + moved.transpose(0, 2, 1)) - 2.0 * decay * MARGIN * p
        inequalities.append(Inequality(np.zeros((n, n)), falling / unit))
    least = least_disturbed(p, y, inequalities)
    if least is None:
        return None
    gain = least.gain * size[:, None] / size[list(system.seen)][None, :]
    solution = GainAndLyapunov(_digits(gain, 7), _digits(least.lyapunov, 10))
    return solution if _falls(corners, output, solution, size, system.seen, decay) else None


def _falls(
    corners: Array, output: Array, solution: GainAndLyapunov, size: Array, seen: Sequence[int], decay: float
) -> bool:
    """Return whether V falls at every corner, in floating-point numbers."""
    gain = solution.gain / size[:, None] * size[list(seen)][None, :]
    moved = solution.lyapunov @ (corners - gain @ output)
    falling = -(moved + moved.transpose(0, 2, 1)) - 2.0 * decay * solution.lyapunov
    return bool(np.min(np.linalg.eigvalsh(falling)) > 0.0)


def decays(system: ErrorSystem, solution: GainAndLyapunov, decay: float) -> bool:
    """Return whether √(eᵀPe) falls with e^(−decay·t) at every corner, decided in fractions.

    ``solution``: L in SI, shape (n, r), and P in scaled states, shape (n, n).
    """
    p, rate = exact(solution.lyapunov), Fraction(decay)
    if not is_positive_definite(p):
        return False
    for a in system.exact_corners(tuple(tuple(row) for row in solution.gain.tolist())):
        moved = times(p, a)
        rise = combined(moved, transposed(moved), first=Fraction(1), second=Fraction(1))
        if not is_positive_definite(combined(rise, p, first=Fraction(-1), second=-2 * rate)):
            return False
    return True


def covers(claimed: ErrorSystem, again: ErrorSystem) -> bool:
    """Return whether the ranges of a certificate hold those that were computed again."""
    low, high, least, most = (np.array(v) for v in (claimed.lower, claimed.upper, again.lower, again.upper))
    spare = 1e-7 * np.maximum(np.abs(least), np.abs(most))
    alike = (again.states, again.moving, again.seen, again.angles) == (
        claimed.states, claimed.moving, claimed.seen, claimed.angles,
    )  # fmt: skip
    return alike and bool(np.all(low <= least + spare) and np.all(high >= most - spare))


def _digits(values: Array, count: int) -> Array:
    """Return numbers to so many digits: what is written is what is proved."""
    return np.array([[float(f"{v:.{count}g}") for v in row] for row in values])
