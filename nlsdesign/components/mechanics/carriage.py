"""A positioning drive along a line: its carriage, and a constant force that acts on it."""

from __future__ import annotations

from dataclasses import dataclass
from typing import ClassVar

import casadi as ca

from ...quantity import Quantity
from ...symbolic import Expression
from ..core.element import TRANSLATION, Domain, Scope
from ..core.part import parameter
from ..core.springs import Elastic
from .bodies import Free, Motion


@dataclass(frozen=True, kw_only=True)
class LinearDrive(Free):
    """Carriage of a motor with a rigid screw or belt, seen along the line: m·v̇ = g·V + ΣF.

    V is the voltage given to a current amplifier whose loop is far faster than the motion, so the force
    follows it; ``mass`` is that of everything that moves, rotor and screw reflected to the line.
    Source: Janot et al. 2019, the model of the EMPS benchmark.

    Examples
    --------
    >>> LinearDrive(mass=95.1, force_constant=35.15, voltage_limit=10.0).title()
    'LinearDrive(mass = 95.1 kg, force_constant = 35.15 N/V, voltage_limit = 10 V)'
    """

    domain: ClassVar[Domain] = TRANSLATION

    inertia_name: ClassVar[str] = "mass"

    mass: Quantity = parameter("kg", "mass that moves, reflected to the line", minimum=1e-9, maximum=1e9)
    force_constant: Quantity = parameter(
        "N/V", "force on the carriage per voltage", minimum=1e-9, maximum=1e9
    )
    voltage_limit: Quantity = parameter("V", "largest voltage", minimum=1e-6, maximum=1e4)

    def drive(self, scope: Scope, motion: Motion) -> Expression:
        """Return g·V with the voltage held within its limit."""
        limit = scope.parameter("voltage_limit")
        voltage = ca.fmin(ca.fmax(scope.input("voltage", "V", f"voltage of {scope.path}"), -limit), limit)
        force = scope.parameter("force_constant") * voltage
        scope.signal("drive_force", force, "N", f"force of {scope.path} on the carriage")
        return force

    def inertia_of(self, scope: Scope) -> Expression:
        """Return m."""
        return scope.parameter("mass")


@dataclass(frozen=True, kw_only=True)
class ConstantForce(Elastic):
    """A force that never changes, F = F₀, positive against positive motion: a weight, an amplifier's offset.

    It stores F₀·e, so it is elastic. With dry friction it reads as friction that differs between the two
    directions; the two cannot be told apart. Source: Janot et al. 2019, the offset of the model.

    Examples
    --------
    >>> ConstantForce(load=-3.16).title()
    'ConstantForce(load = -3.16 N)'
    """

    domain: ClassVar[Domain] = TRANSLATION

    picture: ClassVar[str] = "box"
    phenomena: ClassVar[frozenset[str]] = frozenset({"constant force"})

    # Not named "force": every element between bodies has a signal of that name.
    load: Quantity = parameter("N", "constant force", minimum=-1e9, maximum=1e9)

    @property
    def restores(self) -> bool:
        """False: it pushes the same way at every place."""
        return False

    def effort(self, scope: Scope, motion: Expression, rate: Expression) -> Expression:
        """Return F₀."""
        return scope.parameter("load")
