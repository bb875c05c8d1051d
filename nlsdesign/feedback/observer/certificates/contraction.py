"""The proof of an observer as it runs: its error contracts at every sample, decided in fractions.

The solver proposes a Lyapunov function; nothing that is claimed rests on it.
"""

from __future__ import annotations

import math
from dataclasses import asdict, dataclass
from fractions import Fraction
from pathlib import Path
from typing import Any, ClassVar

import numpy as np

from ....foundation.arrays import Array
from ....foundation.errors import ArrangementError, ConvergenceError, ValueRangeError
from ....foundation.written_numbers import shared_prefix, without_power
from ....model import FlatModel
from ..scheduling.scheduled import ObserverDesign
from ..scheduling.step import ConstantGain
from .certificate import FORMAT, Certificate, hashes_of_code
from .co_design import fastest, lyapunov_function
from .exact import (
    Matrix,
    combined,
    exact,
    exponential_below,
    identity,
    is_positive_definite,
    times,
    transposed,
)
from .polytope import EntryReading, ErrorPolytope, error_polytope
from .torque_bound import Assumptions, TorqueErrorBound, torque_bound

LITERALS = 1e-5
"""Part of the contraction kept for numbers that the C code rounds: four roundings of a float in each entry of
three by three, 7e-7 together, times the ten that the norm of P can make of it at condition 100."""


@dataclass(frozen=True, eq=False)
class Contraction:
    """The error of an observer contracts at every sample, and how far its torque can be off.

    Parameters
    ----------
    gain
        M, one row per state.
    polytope
        All that one sample can do to the error.
    lyapunov
        P in scaled states, shape (n, n).
    decay
        In 1/s: √(eᵀPe) falls at least with e^(−decay·t).
    condition
        Bound on the condition of P.
    assumptions
        Of the bound on the torque.
    torque
        The bound, or why there is none.
    """

    form: ClassVar[str] = FORMAT
    sampled: ClassVar[bool] = True

    gain: ConstantGain
    polytope: ErrorPolytope
    lyapunov: Array
    decay: float
    condition: float
    assumptions: Assumptions
    torque: TorqueErrorBound | str

    @property
    def statement(self) -> tuple[str, ...]:
        """Return in sentences what is proved, and what is not."""
        low, high = self.polytope.friction
        friction = (
            "the plant has no dry friction"
            if (low, high) == (1.0, 1.0)
            else "dry friction included, as a sector: of a difference of speed it leaves "
            f"between {low:g} and {high:g} times"
        )
        first = (
            f"Two runs of this observer on the same signals approach each other at least with "
            f"e^(-{self.decay:.6g} t), in the norm of P (condition at most {self.condition:g}), for every "
            f"sequence of measured angles and every current, in exact arithmetic; {friction}."
        )
        if isinstance(self.torque, str):
            return first, f"No bound on the torque error is certified: {self.torque}."
        a, t = self.assumptions, self.torque
        factor, unit = shared_prefix([t.total, *t.causes.values()], "N*m")
        total = f"{without_power(factor * t.total, 4)} {unit}"
        causes = ", ".join(f"{name} {without_power(factor * value)}" for name, value in t.causes.items())
        second = (
            "Once a wrong start is forgotten, the estimated torque is at the instants of sampling within "
            f"{total} of that of the deck's model ({causes} {unit}), for every current "
            f"and friction, every motion from {a.angles[0]:.4g} to {a.angles[1]:.4g} rad with at most "
            f"{a.speed:g} rad/s, an angle measured to {a.angle_error:.3g} rad, and "
            f"{sum(v > 0.0 for v in a.spreads.values())} parameters of the spring anywhere in their ranges, "
            f"computed in {a.real}."
        )
        third = "Not covered: effects that the deck does not declare, and late or lost samples."
        return first, second, third

    def observer(self) -> dict[str, Any]:
        """Return what a file says of the observer beside the names of its torque and angle."""
        return {"gain": [list(row) for row in self.gain.rows]}

    def numbers(self) -> dict[str, Any]:
        """Return the numbers of the proof as JSON holds them."""
        p, torque = self.polytope, self.torque
        scalars = ("states", "sizes", "moving", "seen", "sample_time", "columns")
        return {
            "polytope": {
                **{name: getattr(p, name) for name in scalars},
                "friction": p.friction,
                "transition": [[list(entry) for entry in row] for row in p.transition],
            },
            "lyapunov": self.lyapunov.tolist(),
            "decay": self.decay,
            "condition": self.condition,
            "assumptions": numbers_of(self.assumptions),
            "torque": torque if isinstance(torque, str) else {"total": torque.total, **asdict(torque)},
        }

    @classmethod
    def read(cls, content: dict[str, Any]) -> Contraction:
        """Return the proof that the content of a file holds.

        Raises
        ------
        ValueError
            If a matrix does not have one row per state, or an index names none.
        """
        p, torque = content["polytope"], content["torque"]
        gain = ConstantGain(tuple(tuple(float(v) for v in row) for row in content["observer"]["gain"]))
        transition = tuple(
            tuple(EntryReading(float(f), None if c is None else int(c)) for f, c in row)
            for row in p["transition"]
        )
        polytope = ErrorPolytope(
            states=tuple(p["states"]), sizes=tuple(p["sizes"]), moving=(p["moving"][0], p["moving"][1]),
            seen=tuple(p["seen"]), sample_time=p["sample_time"],
            columns=tuple((low, high) for low, high in p["columns"]), transition=transition,
            correction=tuple(tuple(EntryReading(v, None) for v in row) for row in gain.rows),
            friction=(p["friction"][0], p["friction"][1]),
        )  # fmt: skip
        n = len(polytope.states)
        lyapunov = np.array(content["lyapunov"], dtype=float)
        sized = lyapunov.shape == (n, n) and len(transition) == n and len(polytope.sizes) == n
        if not sized or min(polytope.sizes) <= 0.0:
            raise ValueError("matrices do not have one row per state")
        places = {*polytope.moving, *polytope.seen}
        used = {e.column for row in transition for e in row if e.column is not None}
        if not (places <= set(range(n)) and used <= set(range(len(polytope.columns)))):
            raise ValueError("an index names a state or a column that there is not")
        bound: TorqueErrorBound | str = torque
        if not isinstance(torque, str):
            start = {k: (v[0], v[1]) for k, v in torque["start"].items()}
            causes = {k: float(v) for k, v in torque.items() if k not in ("total", "start")}
            bound = TorqueErrorBound(**causes, start=start)
        return cls(
            gain, polytope, lyapunov, float(content["decay"]), float(content["condition"]),
            assumptions_of(content["assumptions"]), bound,
        )  # fmt: skip


def numbers_of(assumptions: Assumptions) -> dict[str, Any]:
    """Return assumptions as JSON holds them."""
    return {**asdict(assumptions), "spreads": dict(assumptions.spreads)}


def assumptions_of(content: dict[str, Any]) -> Assumptions:
    """Return the assumptions that JSON holds."""
    low, high = content["angles"]
    return Assumptions(
        (low, high), content["speed"], content["angle_error"], content["spreads"], content["real"]
    )


def certify(
    model: FlatModel,
    design: ObserverDesign,
    *,
    assumptions: Assumptions | None = None,
    decay: float | None = None,
    condition: float = 100.0,
    deck: tuple[str, str] = ("", ""),
    code: Path | None = None,
) -> Certificate[Contraction]:
    """Prove what can be proved of an observer.

    Parameters
    ----------
    model
        Continuous; what the observer was designed on.
    design
        The observer; its gain may be any that is the same at every angle.
    assumptions
        Of the bound on the torque; :func:`declared_assumptions` by default.
    decay
        To be proved, in 1/s; 98 % of the fastest that can be by default.
    condition
        Largest condition of P.
    deck
        Name and text.
    code
        Folder of the C files of the observer.

    Raises
    ------
    ConvergenceError
        If no Lyapunov function is found: nothing is proved then, and nothing refuted.
    ValueRangeError
        If the decay that is asked for is faster than can be proved, with the fastest that can; or the gain
        differs from angle to angle.
    """
    polytope = error_polytope(design)
    if any(e.column is not None for row in polytope.correction for e in row):
        raise ValueRangeError(
            "gain of the observer", "differs from angle to angle; a certificate is for one constant gain",
            next_step="take CertifiedGain or CascadeGain",
        )  # fmt: skip
    errors = polytope.corners()
    if not np.all(np.isfinite(errors)):
        raise ConvergenceError("certificate", "the slope of dry friction has no bound over the speeds")

    decay, lyapunov = _proved(polytope, errors, decay, condition)
    assumed = assumptions or declared_assumptions(model, design)
    try:
        torque: TorqueErrorBound | str = torque_bound(model, design, assumed)
    except ArrangementError as error:
        torque = f"{error.thing} {error.rule}"  # the contraction holds without it; the file says why
    plant = design.step.plant
    gain = ConstantGain(tuple(tuple(e.factor for e in row) for row in polytope.correction))
    return Certificate(
        deck, model.values, plant.estimate.name, plant.angle,
        Contraction(gain, polytope, lyapunov, decay, condition, assumed, torque),
        {} if code is None else hashes_of_code(code),
    )  # fmt: skip


def _proved(
    polytope: ErrorPolytope, errors: Array, decay: float | None, condition: float
) -> tuple[float, Array]:
    """Return a decay and P, proposed by the solver, rounded, and decided in fractions."""
    time = polytope.sample_time

    def proposed(rate: float) -> Array | None:
        p = lyapunov_function(errors, math.exp(-2.0 * rate * time), condition / 1.001)
        if p is None:
            return None
        rounded = np.array([[float(f"{v:.10g}") for v in row] for row in p])
        return rounded if contracts(polytope, rounded, rate) else None

    if decay is not None:
        lyapunov = proposed(decay)
        if lyapunov is not None:
            return decay, lyapunov
    best = fastest(proposed, 20.0 / time)
    if best is None:
        raise ConvergenceError(
            "certificate", f"no quadratic Lyapunov function of condition {condition:g} was found",
            next_step="design the observer with CertifiedGain, or allow a larger condition",
        )  # fmt: skip
    if decay is not None:
        raise ValueRangeError(
            f"decay {decay:g} 1/s", f"cannot be proved; the fastest that can is {best[0]:.4g} 1/s",
            next_step=f"ask for at most {0.98 * best[0]:.3g} 1/s",
        )  # fmt: skip
    slower = float(f"{0.98 * best[0]:.6g}")
    lyapunov = proposed(slower)
    return best if lyapunov is None else (slower, lyapunov)


def declared_assumptions(model: FlatModel, design: ObserverDesign) -> Assumptions:
    """Return the whole table, half a count of the encoder, and no deviation of any parameter.

    Parameters
    ----------
    model
        Its readings say how the angle is measured.
    design
        The observer.
    """
    grid, plant = design.compact.angles, design.step.plant
    named = [
        model.values[f"{sensor}.quantum"]
        for reading in model.readings
        if reading.measured == plant.angle
        for sensor in reading.sensors
        if f"{sensor}.quantum" in model.values
    ]
    return Assumptions((float(grid[0]), float(grid[-1])), angle_error=max(named, default=0.0) / 2.0)


def contracts(polytope: ErrorPolytope, lyapunov: Array, decay: float) -> bool:
    """Return whether √(eᵀPe) falls with e^(−decay·T) at every corner, decided in fractions.

    ``lyapunov``: P, shape (n, n).
    """
    p = exact(lyapunov)
    if not is_positive_definite(p):
        return False
    keep = exponential_below(Fraction(decay) * Fraction(polytope.sample_time)) * (1 - Fraction(LITERALS))
    for error in polytope.exact_corners():
        left = times(transposed(error), times(p, error))
        if not is_positive_definite(combined(p, left, first=keep * keep, second=Fraction(-1))):
            return False
    return True


def within_condition(lyapunov: Array, condition: float) -> bool:
    """Return whether 1 ⪯ P ⪯ condition, decided in fractions up to a millionth.

    ``lyapunov``: P, shape (n, n).
    """
    p, one = exact(lyapunov), identity(len(lyapunov))
    margin = Fraction(1, 10**6)
    above: Matrix = combined(p, one, first=Fraction(1), second=-(1 - margin))
    below: Matrix = combined(one, p, first=Fraction(condition) * (1 - margin), second=Fraction(-1))
    return is_positive_definite(above) and is_positive_definite(below)
