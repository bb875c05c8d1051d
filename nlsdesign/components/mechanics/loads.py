"""Loads that act all the time: a constant force or torque, and the weight on an arm."""

from __future__ import annotations

from dataclasses import dataclass
from typing import ClassVar

import casadi as ca

from ...foundation.quantity import Quantity
from ...foundation.symbolic import Expression
from ..core.domain import ROTATION, TRANSLATION, Domain
from ..core.element import Scope
from ..core.part_numbers import Reading, one_of, parameter, read_as
from ..core.springs import Elastic


@dataclass(frozen=True, kw_only=True)
class Load(Elastic):
    """Base of loads: they store energy, and pull back to no place of their own as a spring does."""

    picture: ClassVar[str] = "box"

    @property
    def restores(self) -> bool:
        """False: a load is no spring between drive and load."""
        return False


@dataclass(frozen=True, kw_only=True)
class ConstantLoad(Load):
    """A force or torque that never changes, F = F₀, positive against positive motion: a weight, an offset.

    It stores F₀·e, so it is elastic. With dry friction it reads as friction that differs between the two
    directions; the two cannot be told apart. Source: Janot et al. 2019, the offset of the model.

    Examples
    --------
    >>> ConstantLoad(load=-3.16).title()
    'ConstantLoad(load = -3.16 N)'
    >>> ConstantLoad(load=Quantity(0.2, "N*m")).domain.effort
    'torque'
    """

    phenomena: ClassVar[frozenset[str]] = frozenset({"constant load"})

    domain: Domain = one_of(TRANSLATION, ROTATION)
    # Not named "force" or "torque": every element between bodies has a signal of that name.
    load: Quantity = parameter("{effort}", "constant force or torque", minimum=-1e9, maximum=1e9)

    def effort(self, scope: Scope, motion: Expression, rate: Expression) -> Expression:
        """Return F₀."""
        return scope.parameter("load")


@dataclass(frozen=True)
class MassOnArm(Reading):
    """A weight given as what hangs where: largest torque m·g·l."""

    mass: Quantity = parameter("kg", "mass on the arm", minimum=0.0, maximum=1e6)
    arm: Quantity = parameter("m", "distance of its centre from the axis", minimum=0.0, maximum=1e3)
    gravity: Quantity = parameter("m/s^2", "acceleration of free fall", maximum=30.0, default=9.80665)

    def largest(self, scope: Scope) -> Expression:
        """Return m·g·l.

        Parameters
        ----------
        scope
            Of the load.
        """
        return scope.parameter("mass") * scope.parameter("gravity") * scope.parameter("arm")


@dataclass(frozen=True)
class HorizontalTorque(Reading):
    """A weight given by its torque while the arm is horizontal."""

    horizontal_torque: Quantity = parameter(
        "N*m", "torque of the weight while the arm is horizontal", minimum=-1e9, maximum=1e9
    )

    def largest(self, scope: Scope) -> Expression:
        """Return that torque.

        Parameters
        ----------
        scope
            Of the load.
        """
        return scope.parameter("horizontal_torque")


@dataclass(frozen=True, kw_only=True)
class GravityLoad(Load):
    """The weight on an arm that turns in a vertical plane: T = m·g·l·sin(θ − θ₀), zero where it hangs.

    The moment of inertia m·l² belongs to the body that turns and is not added here. The weight is given by
    ``weight=MassOnArm(mass=..., arm=...)`` or, where only the product shows, by
    ``weight=HorizontalTorque(horizontal_torque=...)``. Valid for a rigid arm. Source: Newton 1687.

    Examples
    --------
    >>> weight = MassOnArm(mass=Quantity(0.49, "kg"), arm=Quantity(0.1, "m"))
    >>> GravityLoad(weight=weight, hanging_angle=0.0).title()
    'GravityLoad(hanging_angle = 0 rad, mass = 0.49 kg, arm = 0.1 m, gravity = 9.80665 m/s²)'
    """

    domain: ClassVar[Domain] = ROTATION
    phenomena: ClassVar[frozenset[str]] = frozenset({"gravity"})

    hanging_angle: Quantity = parameter(
        "rad", "angle at which the arm hangs straight down", minimum=-1e3, maximum=1e3, default=0.0
    )
    weight: Reading = read_as(MassOnArm, HorizontalTorque)

    def effort(self, scope: Scope, motion: Expression, rate: Expression) -> Expression:
        """Return T."""
        assert isinstance(self.weight, MassOnArm | HorizontalTorque)
        return self.weight.largest(scope) * ca.sin(motion - scope.parameter("hanging_angle"))
