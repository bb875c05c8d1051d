"""Viscous laws: effort as a function of the rate."""

from __future__ import annotations

from dataclasses import dataclass
from typing import ClassVar

from ...foundation.quantity import Quantity
from ...foundation.symbolic import Expression
from .domain import MATERIAL, ROTATION, TRANSLATION, Domain
from .element import Element, Scope
from .part_numbers import one_of, parameter


@dataclass(frozen=True, kw_only=True)
class Viscous(Element):
    """Base of the laws that need the rate."""

    picture: ClassVar[str] = "friction"

    @property
    def needs_rate(self) -> bool:
        """True: the effort depends directly on the rate."""
        return True

    @property
    def dissipates(self) -> bool:
        """True: nothing is stored."""
        return True


@dataclass(frozen=True, kw_only=True)
class Newton(Viscous):
    """Base of Newton's law: effort = constant × rate."""

    picture: ClassVar[str] = "dashpot"
    constant: ClassVar[str] = "damping"
    """Name of the number."""

    phenomena: ClassVar[frozenset[str]] = frozenset({"viscous friction"})

    def effort(self, scope: Scope, motion: Expression, rate: Expression) -> Expression:
        """Return constant × rate."""
        return scope.parameter(self.constant) * rate


@dataclass(frozen=True, kw_only=True)
class Dashpot(Newton):
    """Newton's law F = c·ė, or T = c·ω of bearings and gears where the damping is in N·m·s/rad.

    Source: Newton 1687.

    Examples
    --------
    >>> Dashpot(damping=1e-3, domain=ROTATION).title()
    'Dashpot(damping = 0.001 N·m·s/rad)'
    """

    domain: Domain = one_of(TRANSLATION, ROTATION)
    damping: Quantity = parameter(
        "{effort}*s/{motion}", "damping",
        minimum={TRANSLATION: 1e-9, ROTATION: 0.0}, maximum={TRANSLATION: 1e12, ROTATION: 1e9},
    )  # fmt: skip


@dataclass(frozen=True, kw_only=True)
class ViscousMaterial(Newton):
    """Newton's law of a material, σ = η·ε̇. Source: Austin et al. 2015, eq. (1)."""

    domain: ClassVar[Domain] = MATERIAL
    constant: ClassVar[str] = "viscosity"

    viscosity: Quantity = parameter("Pa*s", "viscosity", minimum=1e-6, maximum=1e15)
