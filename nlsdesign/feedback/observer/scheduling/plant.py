"""The actuator as the observer sees it: matrices that depend on the measured angle, and nothing else.

The angle is measured. So every term of the equations that depends on the angle is known, and what is left is
linear in the other states: ẋ = A(θ)x + g(θ) + E·d(u) + friction(ω), with no column of A for the angle.
Without friction the error of an observer then obeys e⁺ = Φ(θ)(I − M(θ)C)e exactly, for every motion.

Inner states that follow the speed, such as a relaxing force with dF_M = a·k·h(θ)·dθ, are carried as
ζ = z − Q(θ) with Q = ∫∂ż/∂ω dθ: ζ is driven by the measured angle alone and never by an estimated speed.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from typing import NamedTuple

import casadi as ca
import numpy as np
from numpy.typing import NDArray

from ....model import Variable

Array = NDArray[np.float64]


class Coefficients(NamedTuple):
    """Matrices at N angles, for n states and r measured outputs.

    ``a`` (N, n, n); ``drive`` g (N, n); ``shift`` Q (N, n); ``estimate`` (N, n + 1), the row t and last the
    offset of estimate = t·x + t₀; ``rate`` b (N, n), what the rate of the extension does; ``measured``
    (N, r − 1), what the outputs besides the angle are at this angle.
    """

    a: Array
    drive: Array
    shift: Array
    estimate: Array
    rate: Array
    measured: Array


@dataclass(frozen=True, eq=False, kw_only=True)
class AngleScheduledPlant:
    """The plant in the form ẋ = A(θ)x + g(θ) + b(θ)·δ̇ + E·d(u) + friction(ω).

    Parameters
    ----------
    name
        Name of the model.
    states
        All states: the inner ones, then angle and speed.
    angle, speed
        Names of the state that is measured and scheduled over, and of its rate.
    estimate
        What is wanted.
    inputs
        Known inputs u.
    measured
        States that are measured besides the angle, because they follow from it: the published extension.
        Their rate δ̇ is then an input too.
    at
        Takes angles of shape (N,) and returns the coefficients there.
    rest
        Takes angles of shape (N,) and returns the states at rest, shape (N, n).
    driven
        ``casadi.Function`` u -> d, what the inputs add to the rates.
    rows
        States into whose rates d goes; they make E.
    friction
        ``casadi.Function`` ω -> ω̇, what the speed adds to its own rate beyond its linear part, or ``None``.
    sizes
        Typical sizes of the states as the observer carries them, shape (n,).
    rate_bandwidth
        Cut-off frequency of the filter on δ̇ in Hz.
    affine_error
        Deviation of the estimate from its tangent in the inner states, share of its largest value.
    """

    name: str
    states: tuple[Variable, ...]
    angle: str
    speed: str
    estimate: Variable
    inputs: tuple[Variable, ...]
    measured: tuple[str, ...]
    at: Callable[[Array], Coefficients]
    rest: Callable[[Array], Array]
    driven: ca.Function
    rows: tuple[int, ...]
    friction: ca.Function | None
    sizes: Array
    rate_bandwidth: float
    affine_error: float

    @property
    def names(self) -> tuple[str, ...]:
        """Names of the states."""
        return tuple(v.name for v in self.states)

    @property
    def moving(self) -> tuple[int, int]:
        """Places of the angle and of its speed among the states."""
        return self.names.index(self.angle), self.names.index(self.speed)

    @property
    def output_matrix(self) -> Array:
        """C, shape (r, n): the angle first, then what else is measured."""
        places = [self.names.index(name) for name in (self.angle, *self.measured)]
        matrix: Array = np.eye(len(self.states))[places]
        return matrix
