"""What is worked grows warm, and what is warm is softer."""

from __future__ import annotations

import math
from abc import abstractmethod
from dataclasses import dataclass
from typing import ClassVar

import casadi as ca

from ...foundation.errors import ArrangementError
from ...foundation.quantity import Quantity
from ...foundation.symbolic import Expression
from ..core.domain import MATERIAL, ROTATION, TRANSLATION, Domain
from ..core.element import UNBOUNDED, Combination, Element, Scope, observed_effort
from ..core.part import walk
from ..core.part_numbers import Reading, parameter, read_as
from ..core.springs import Elastic
from .quasilinear import QuasilinearRelaxation

_ROOM = 293.15


@dataclass(frozen=True)
class Heat(Reading):
    """Base of what makes a piece warm, and how much softer it is then."""

    @abstractmethod
    def effort(self, held: Combination, scope: Scope, motion: Expression, rate: Expression) -> Expression:
        """Return the effort of the warm elements that are held; the rest as for :meth:`Element.effort`."""


@dataclass(frozen=True)
class HeatBalance(Heat):
    """First law for a material: σ = g·Σσ with g = 1 − b·T', T' the rise over the ambient T₀.

    C·dT'/dt = g·D − b·T·(P − D) − h·T' with the power P put into the laws inside, what they lose D, and
    T = T₀ + T'. The middle term is the heat that a spring takes up whose modulus depends on temperature; with
    it energy is conserved exactly. b = −1/T₀ is the entropy spring of unfilled rubber, b > 0 filled. One
    temperature for the whole piece: thinner than about a centimetre. Valid while T' < 1/(2·b).
    Sources: Schapery 1964; Holzapfel 2000, ch. 7.

    Examples
    --------
    >>> HeatBalance(heat_capacity=1.8e6, cooling=4e4, softening=3e-3).ambient.number
    293.15
    """

    takes: ClassVar[tuple[Domain, ...]] = (MATERIAL,)
    placing: ClassVar[str | None] = "put it inside a specimen"

    heat_capacity: Quantity = parameter("J/m^3/K", "heat capacity C per volume", minimum=1e3, maximum=1e8)
    cooling: Quantity = parameter(
        "W/m^3/K", "heat h given off per volume and kelvin", minimum=0.0, maximum=1e9
    )
    softening: Quantity = parameter("1/K", "fall b of the modulus per kelvin", minimum=-0.02, maximum=0.1)
    ambient: Quantity = parameter(
        "K", "temperature T₀ around it", minimum=150.0, maximum=600.0, default=_ROOM
    )

    def effort(self, held: Combination, scope: Scope, motion: Expression, rate: Expression) -> Expression:
        """Return the stress at the present temperature."""
        names = ("heat_capacity", "cooling", "softening", "ambient")
        capacity, cooling, softening, ambient = (scope.parameter(name) for name in names)
        warming = scope.state("warming", "K", f"temperature of {scope.path} above the ambient")
        b = self.softening.number
        scope.signal("warming", warming, "K", "", valid=(-math.inf, 0.5 / b) if b > 0.0 else UNBOUNDED)
        scope.signal("temperature", ambient + warming, "K", f"temperature of {scope.path}")
        stress = held.inside(scope, motion, rate)
        factor, lost = 1 - softening * warming, scope.losses()
        heat = factor * lost - softening * (ambient + warming) * (stress * rate - lost)
        scope.derive(warming, (heat - cooling * warming) / capacity)
        scope.loss((factor - 1) * lost)
        scope.signal("lost_power", factor * lost, "W/m^3", f"power that {scope.path} loses per volume")
        return factor * stress


@dataclass(frozen=True)
class RelativeHeat(Heat):
    """Base of heat as a relative loss of stiffness ϑ, zero when cold: F = F_in/(1 + ϑ), dϑ/dt = q − ϑ/τ."""

    takes: ClassVar[tuple[Domain, ...]] = (TRANSLATION, ROTATION)
    placing: ClassVar[str | None] = "put it around the specimen"

    @abstractmethod
    def heating(self, scope: Scope, inside: Expression, rate: Expression) -> Expression:
        """Return q."""

    def effort(self, held: Combination, scope: Scope, motion: Expression, rate: Expression) -> Expression:
        """Return the effort of the warm elements."""
        inside = held.inside(scope, motion, rate)
        heat = scope.state("heat", "1", f"relative loss of stiffness of {scope.path} by heat")
        scope.derive(heat, self.heating(scope, inside, rate) - heat / scope.parameter("cooling_time"))
        return inside / (1 + heat)


@dataclass(frozen=True)
class WorkHeat(RelativeHeat):
    """Heat of all work: F = F_in/(1 + ϑ), dϑ/dt = |F_in·ẋ|/E − ϑ/τ.

    A fixed share of all work becomes heat; E is the work after which, uncooled, half of the stiffness is
    left. Valid for ϑ below about 0.5. Source: first law of thermodynamics with a constant loss factor;
    Medalia 1991 (heat build-up).

    Examples
    --------
    >>> WorkHeat(halving_work=40.0, cooling_time=8.0).halving_work
    40.0
    """

    placing: ClassVar[str | None] = (
        "stress times strain rate is work per volume, not work: put it around the specimen"
    )

    halving_work: Quantity = parameter("J", "work E after which ϑ = 1", minimum=1e-6, maximum=1e12)
    cooling_time: Quantity = parameter("s", "time constant τ of cooling", minimum=1e-3, maximum=1e6)

    def heating(self, scope: Scope, inside: Expression, rate: Expression) -> Expression:
        """Return |F_in·ẋ|/E."""
        return ca.fabs(inside * rate) / scope.parameter("halving_work")


@dataclass(frozen=True)
class ViscousHeat(RelativeHeat):
    """Heat of viscous loss: F = F_in/(1 + ϑ), dϑ/dt = ((ẋ/v)² − ϑ)/τ.

    The loss is that of a dashpot, so a slow motion makes no heat; v is the steady speed at which half of the
    stiffness would be left. Valid for ϑ below about 0.5 and motions slower than the relaxation of the branch
    that makes the loss. Source: first law of thermodynamics with the loss c·ẋ² of a dashpot; Medalia 1991
    (heat build-up).

    Examples
    --------
    >>> ViscousHeat(halving_speed=0.3, cooling_time=8.0).halving_speed
    0.3
    """

    halving_speed: Quantity = parameter("{rate}", "steady speed v with ϑ = 1", minimum=1e-9, maximum=1e6)
    cooling_time: Quantity = parameter("s", "time constant τ of cooling", minimum=1e-3, maximum=1e6)

    def heating(self, scope: Scope, inside: Expression, rate: Expression) -> Expression:
        """Return (ẋ/v)²/τ."""
        share = rate / scope.parameter("halving_speed")
        return share * share / scope.parameter("cooling_time")


@dataclass(frozen=True)
class LossHeat(Heat):
    """Heat of what the laws inside lose: F = Σ Fₑ/(1 + ϑ) + Σ Fᵣ/(1 + c·ϑ), dϑ/dt = D/E − ϑ/τ.

    D is the power that the laws inside lose, of a relaxing branch or of sliders; E is the loss after which,
    uncooled, half of the equilibrium stiffness is left. Fₑ are the elastic laws, Fᵣ those that relax or
    slide, and c tells by how much these soften as well: 0 not at all, 1 alike. Valid for ϑ below about 0.5.
    Sources: first law of thermodynamics; Medalia 1991 (heat build-up); Schapery 1964.

    Examples
    --------
    >>> LossHeat(halving_loss=4e6, cooling_time=8.0, relaxing_share=0.0).halving_loss
    4000000.0
    """

    halving_loss: Quantity = parameter(
        "{effort}*{motion}", "loss E after which ϑ = 1", minimum=1e-9, maximum=1e15
    )
    cooling_time: Quantity = parameter("s", "time constant τ of cooling", minimum=1e-3, maximum=1e6)
    relaxing_share: Quantity = parameter(
        "1", "softening c of what relaxes, per softening of the equilibrium", minimum=0.0, maximum=10.0
    )

    def effort(self, held: Combination, scope: Scope, motion: Expression, rate: Expression) -> Expression:
        """Return the effort of the warm elements."""
        elastic, relaxing = ca.SX(0), ca.SX(0)
        for name, member in held.members:
            inside = observed_effort(member, scope.child(name), motion, rate)
            if is_equilibrium(member):
                elastic += inside
            else:
                relaxing += inside
        heat = scope.state("heat", "1", f"relative loss of stiffness of {scope.path} by heat")
        left = 1 / (1 + scope.parameter("relaxing_share") * heat)
        lost = left * scope.losses()
        scope.derive(heat, lost / scope.parameter("halving_loss") - heat / scope.parameter("cooling_time"))
        scope.loss(lost - scope.losses())
        return elastic / (1 + heat) + left * relaxing


def is_equilibrium(member: Element) -> bool:
    """Tell whether a law has no memory and no loss: everything in it is elastic."""
    leaves = [part for _, part in walk(member) if not part.children()]
    return all(isinstance(leaf, Elastic) for leaf in leaves)


@dataclass(frozen=True, kw_only=True)
class SelfHeating(Combination):
    """Rubber that softens by its own heat: F = g·F_in, where g falls with the heat of working.

    What heats, and how g falls, is the reading ``heat``: :class:`HeatBalance` in a material,
    :class:`WorkHeat` or :class:`ViscousHeat` around a piece whose section and length are not known apart,
    :class:`LossHeat` around laws of which some relax or slide.
    Source: first law of thermodynamics.

    Raises
    ------
    ArrangementError
        If the heat is that of what is lost, and a member relaxes without saying what it loses.

    Examples
    --------
    >>> from nlsdesign.components import LinearElastic
    >>> law = (("law", LinearElastic(modulus=1e6)),)
    >>> heat = HeatBalance(heat_capacity=1.8e6, cooling=4e4, softening=3e-3)
    >>> SelfHeating(members=law, heat=heat).parameters()["ambient"].number
    293.15
    """

    phenomena: ClassVar[frozenset[str]] = frozenset({"self-heating"})

    heat: Heat = read_as(HeatBalance, WorkHeat, ViscousHeat, LossHeat)

    def __post_init__(self) -> None:
        super().__post_init__()
        if isinstance(self.heat, RelativeHeat):
            return
        for path, part in walk(self):
            if isinstance(part, QuasilinearRelaxation):
                raise ArrangementError(
                    f"SelfHeating member '{path}'", "relaxes without saying what it loses",
                    next_step="use linear branches (springs with dashpots), or WorkHeat around the piece",
                )  # fmt: skip

    def effort(self, scope: Scope, motion: Expression, rate: Expression) -> Expression:
        """Return the effort at the present temperature."""
        return self.heat.effort(self, scope, motion, rate)
