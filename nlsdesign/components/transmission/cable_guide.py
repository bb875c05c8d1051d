"""A cable that rubs on a guide."""

from __future__ import annotations

from dataclasses import dataclass

from ...errors import ArrangementError
from ...quantity import Quantity
from ...symbolic import Expression, smooth_sign
from ..core.element import TRANSLATION, Combination, Scope, observed_effort
from ..core.part import parameter
from .capstan import tightened


@dataclass(frozen=True, kw_only=True)
class CableGuide(Combination):
    """Capstan law of a cable on a fixed guide: F = F_in·e^(µα·tanh(ẋ/v_s)).

    Pulled out, the cable is tighter in front of the guide by the factor e^(µα), let in, looser by as much;
    µα is the coefficient of friction times the angle of wrap. Smooth at standstill over the speed v_s: there
    it creeps instead of sticking. A push passes unchanged, for no cable pushes. Where friction and angle are
    known apart, :class:`CapstanFriction` says both. Valid without bending stiffness and weight. Source: Euler
    1769, Eytelwein 1808.
    """

    wrap: Quantity = parameter("1", "friction times angle of wrap, µα", minimum=0.0, maximum=10.0)
    creep_speed: Quantity = parameter(
        "m/s", "speed at which 76 % of the friction acts", minimum=1e-7, maximum=1.0, default=2e-4
    )

    def __post_init__(self) -> None:
        super().__post_init__()
        if self._inner != TRANSLATION:
            raise ArrangementError("CableGuide", "acts on extension and force")

    @property
    def needs_rate(self) -> bool:
        """True: friction depends on the direction."""
        return True

    def effort(self, scope: Scope, motion: Expression, rate: Expression) -> Expression:
        """Return F_in·e^(µα·tanh(ẋ/v_s))."""
        forces = [observed_effort(m, scope.child(n), motion, rate) for n, m in self.members]
        direction = smooth_sign(rate, scope.parameter("creep_speed"))
        return tightened(sum(forces[1:], start=forces[0]), scope.parameter("wrap") * direction)
