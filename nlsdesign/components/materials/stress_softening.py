"""Laws that remember the hardest pull so far: stress softening and permanent set."""

from __future__ import annotations

from dataclasses import dataclass

import casadi as ca

from ...errors import ArrangementError
from ...quantity import Quantity
from ...symbolic import Expression, positive_part
from ..core.element import MATERIAL, Combination, Scope, observed_effort
from ..core.part import parameter
from .hyperelastic import Hyperelastic


@dataclass(frozen=True, kw_only=True)
class MaterialCombination(Combination):
    """Base of wrappers around laws of stress and strain, which act in parallel inside."""

    def __post_init__(self) -> None:
        super().__post_init__()
        if self._inner != MATERIAL:
            raise ArrangementError(
                type(self).__name__, "acts on strain and stress",
                next_step="put it inside a specimen",
            )  # fmt: skip

    @property
    def needs_rate(self) -> bool:
        """True if any law inside needs the rate."""
        return any(member.needs_rate for _, member in self.members)

    def stress_inside(self, scope: Scope, motion: Expression, rate: Expression) -> Expression:
        """Return the sum of the stresses inside.

        Parameters
        ----------
        scope
            Of the wrapper.
        motion, rate
            What the laws inside see.
        """
        stresses = [observed_effort(m, scope.child(n), motion, rate) for n, m in self.members]
        return sum(stresses[1:], start=stresses[0])


@dataclass(frozen=True, kw_only=True)
class Softening(MaterialCombination):
    """Stress softening (Mullins effect): σ = η·dW/dλ with η = 1 − erf((W_m − W)/m)/r.

    W is the energy of the laws inside and W_m the greatest so far, a state that rises with W and never falls.
    η is 1 on first loading and again where W reaches W_m. The sharp law has a corner there; here W_m − W and
    the switch of the state are rounded over ``width``·m: σ is C∞ in strain and state, the rate of W_m C⁰ at a
    reversal, and W_m lags by about seven widths, so η is off by about ten times ``width``/r. What softens is
    lost: (erf(W_m/m) − erf((W_m − W)/m))/r per rise of W_m. Valid for what the first pull to a strain does;
    there is no recovery, no set and no loss on reloading. Source: Ogden and Roxburgh 1999.

    Examples
    --------
    >>> from nlsdesign.components import NeoHooke
    >>> gum = NeoHooke(shear_modulus=0.6e6)
    >>> Softening(members=(("gum", gum),), strength=1.8, scale=0.12e6).domain.motion
    'strain'
    """

    strength: Quantity = parameter(
        "1", "r: the stress never falls below 1 − 1/r of that of first loading", minimum=1.0, maximum=1e6
    )
    scale: Quantity = parameter("Pa", "energy m over which the softening sets in", minimum=1e-3, maximum=1e12)
    width: Quantity = parameter(
        "1", "part of m over which corners are rounded", minimum=1e-6, maximum=0.1, default=1e-3
    )

    def __post_init__(self) -> None:
        super().__post_init__()
        for name, member in self.members:
            if not isinstance(member, Hyperelastic):
                raise ArrangementError(
                    f"Softening member '{name}'",
                    f"is a {type(member).__name__}, which does not say its strain energy",
                    next_step="use a law such as NeoHooke, Yeoh or Ogden; dashpots belong beside it",
                )

    def effort(self, scope: Scope, motion: Expression, rate: Expression) -> Expression:
        """Return the softened stress."""
        scale, strength = scope.parameter("scale"), scope.parameter("strength")
        width = scope.parameter("width") * scale
        stress = self.stress_inside(scope, motion, rate)
        laws = [(n, m) for n, m in self.members if isinstance(m, Hyperelastic)]
        energy = sum((m.energy(scope.child(n), 1 + motion) for n, m in laws), start=ca.SX(0))
        meaning = f"greatest strain energy of {scope.path} so far"
        greatest, growth = _greatest(scope, ("greatest_energy", "Pa", meaning), energy, stress * rate, width)

        def softened(below: Expression) -> Expression:
            return ca.erf(positive_part(below, width) / scale) / strength

        softness = softened(greatest - energy)
        scope.loss((softened(greatest) - softness) * growth)
        scope.signal("softening", 1 - softness, "1", f"stress of {scope.path} over that of first loading")
        return (1 - softness) * stress


@dataclass(frozen=True, kw_only=True)
class PermanentSet(MaterialCombination):
    """A rest length that grows: the laws inside see ε − s with s = c·ε_m, ε_m the greatest strain so far.

    ε_m is a state that rises with ε and never falls; its switch is rounded over ``width``, so σ is C∞ in
    strain and state and the rate of ε_m is C⁰ at a reversal. What is lost is σ·ds/dt, never negative for laws
    whose memory fades. A set that is known and no longer grows is :class:`Slack`. Valid for c up to a few
    tenths, as tension sets are measured. Source: ISO 2285 (tension set as a part of the strain).

    Examples
    --------
    >>> from nlsdesign.components import NeoHooke
    >>> gum = NeoHooke(shear_modulus=0.6e6)
    >>> PermanentSet(members=(("gum", gum),), share=0.05).title()
    'PermanentSet(share = 0.05, width = 0.0001)'
    """

    share: Quantity = parameter("1", "part c of the greatest strain that stays", minimum=0.0, maximum=0.9)
    width: Quantity = parameter(
        "1", "strain over which the corner is rounded", minimum=1e-7, maximum=0.1, default=1e-4
    )

    def effort(self, scope: Scope, motion: Expression, rate: Expression) -> Expression:
        """Return the stress of the laws inside at what is left of the strain."""
        meaning = f"greatest strain of {scope.path} so far"
        state = ("greatest_strain", "1", meaning)
        greatest, growth = _greatest(scope, state, motion, rate, scope.parameter("width"))
        share = scope.parameter("share")
        stress = self.stress_inside(scope, motion - share * greatest, rate - share * growth)
        scope.loss(stress * share * growth)
        return stress


def _greatest(
    scope: Scope, state: tuple[str, str, str], value: Expression, rate: Expression, width: Expression
) -> tuple[Expression, Expression]:
    """Return the greatest value so far, a state with name, unit and meaning, and its rate.

    The state follows the value up, behind it by ``width``·ln(1 + value/width), whatever the speed.
    """
    greatest = scope.state(*state)
    growth = (1 + ca.tanh((value - greatest) / (2 * width))) / 2 * ca.fmax(rate, 0)
    scope.derive(greatest, growth)
    return greatest, growth
