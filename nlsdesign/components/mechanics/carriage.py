"""The carriage of a positioning drive along a line."""

from __future__ import annotations

from dataclasses import dataclass
from typing import ClassVar

import casadi as ca

from ...foundation.quantity import Quantity
from ...foundation.symbolic import Expression
from ..core.element import TRANSLATION, Domain, Scope
from ..core.part import parameter
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
    command: ClassVar[tuple[str, str]] = ("voltage", "V")

    mass: Quantity = parameter("kg", "mass that moves, reflected to the line", minimum=1e-9, maximum=1e9)
    force_constant: Quantity = parameter(
        "N/V", "force on the carriage per voltage", minimum=1e-9, maximum=1e9
    )
    voltage_limit: Quantity = parameter("V", "largest voltage", minimum=1e-6, maximum=1e4)

    def drive(self, scope: Scope, motion: Motion) -> Expression:
        """Return g·V with the voltage held within its limit, then through the parts of the drive."""
        limit = scope.parameter("voltage_limit")
        voltage = self.commanded(scope, motion, lambda wanted: ca.fmin(ca.fmax(wanted, -limit), limit))
        force = scope.parameter("force_constant") * voltage
        scope.signal("drive_force", force, "N", f"force of {scope.path} on the carriage")
        return force
