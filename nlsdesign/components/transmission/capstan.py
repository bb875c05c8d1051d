"""Friction of a cable that is bent around a guide."""

from __future__ import annotations

from dataclasses import dataclass

import casadi as ca

from ...errors import ArrangementError
from ...quantity import Quantity
from ...symbolic import Expression, smooth_sign
from ..core.element import TRANSLATION, Combination, Scope, observed_effort
from ..core.part import parameter


@dataclass(frozen=True, kw_only=True)
class CapstanFriction(Combination):
    """A cable bent by the angle φ around a guide: F = F_in·e^(µφ·tanh(ė/v_s)).

    F_in is the pull of the elements behind the guide: pulled in it takes e^(µφ) times as much, let out it
    holds back to e^(−µφ). The power lost, F_in·(e^(…) − 1)·ė, is never negative. A push, F_in < 0, passes
    unchanged, for no cable pushes. C∞ in the rate, with a corner at F_in = 0; at rest it creeps instead of
    sticking. Several guides multiply: their µφ add. :class:`CableGuide` has µφ as one number, for fits.
    Source: Euler 1769, Eytelwein 1808.

    Examples
    --------
    >>> from nlsdesign.components import Spring
    >>> rope = (("rubber", Spring(stiffness=2500.0)),)
    >>> CapstanFriction(members=rope, friction=0.1, wrap_angle=1.5).needs_rate
    True
    """

    friction: Quantity = parameter("1", "friction coefficient of cable and guide", minimum=0.0, maximum=2.0)
    wrap_angle: Quantity = parameter("rad", "angle by which the guide bends the cable", maximum=100.0)
    creep_speed: Quantity = parameter(
        "m/s",
        "speed of the cable at which 76 % of the exponent acts",
        minimum=1e-9,
        maximum=1.0,
        default=1e-4,
    )

    def __post_init__(self) -> None:
        super().__post_init__()
        if self._inner != TRANSLATION:
            raise ArrangementError(
                "CapstanFriction",
                "acts on extension and force",
                next_step="put it behind the cam: through(cam, cable=CapstanFriction(...))",
            )

    @property
    def needs_rate(self) -> bool:
        """True: friction depends on the direction."""
        return True

    def effort(self, scope: Scope, motion: Expression, rate: Expression) -> Expression:
        """Return F = F_in·e^(µφ·tanh(ė/v_s))."""
        forces = [observed_effort(m, scope.child(n), motion, rate) for n, m in self.members]
        inside = sum(forces[1:], start=forces[0])
        exponent = scope.parameter("friction") * scope.parameter("wrap_angle")
        return tightened(inside, exponent * smooth_sign(rate, scope.parameter("creep_speed")))


def tightened(pull: Expression, exponent: Expression) -> Expression:
    """Return the pull in front of a guide; a push passes unchanged.

    Parameters
    ----------
    pull
        Behind the guide.
    exponent
        µφ with the sign of the rate.
    """
    return pull + ca.fmax(pull, 0) * (ca.exp(exponent) - 1)
