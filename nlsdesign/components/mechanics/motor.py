"""Electric motors with a winding, driven by a current or by a voltage."""

from __future__ import annotations

from dataclasses import dataclass
from typing import ClassVar

import casadi as ca

from ...foundation.quantity import Quantity
from ...foundation.symbolic import Expression
from ..core.element import ROTATION, Domain, Scope
from ..core.part import parameter
from .bodies import Free, Motion


@dataclass(frozen=True, kw_only=True)
class ElectricMotor(Free):
    """Base of the motors: T = k·I, and k·ω is the voltage that turning induces.

    In SI the torque constant in N·m/A is the voltage constant in V·s/rad, or power would be lost between the
    two sides. Source: Leonhard 2001.
    """

    domain: ClassVar[Domain] = ROTATION

    inertia: Quantity = parameter("kg*m^2", "moment of inertia of the rotor", minimum=1e-12, maximum=1e6)
    torque_constant: Quantity = parameter("N*m/A", "torque per current", minimum=1e-6, maximum=1e3)
    resistance: Quantity = parameter("Ohm", "resistance of the winding", minimum=1e-6, maximum=1e6)
    current_limit: Quantity = parameter("A", "largest current of the amplifier", minimum=1e-6, maximum=1e4)
    voltage_limit: Quantity = parameter("V", "largest voltage of the supply", minimum=1e-3, maximum=1e5)

    def _torque(self, scope: Scope, current: Expression, voltage: Expression) -> Expression:
        """Return k·I and give names to the powers at the winding."""
        loss = scope.parameter("resistance") * current * current
        torque = scope.parameter("torque_constant") * current
        scope.signal("drive_torque", torque, "N*m", f"torque of the winding of {scope.path}")
        scope.signal("voltage", voltage, "V", f"voltage at {scope.path}")
        scope.signal("electrical_power", voltage * current, "W", f"power that {scope.path} takes")
        scope.signal("winding_loss", loss, "W", f"heat in the winding of {scope.path}")
        return torque


@dataclass(frozen=True, kw_only=True)
class ResistiveMotor(ElectricMotor):
    """Motor at a voltage whose winding settles at once: J·ω̇ = k·(U − k·ω)/R + ΣT.

    U is the wanted voltage held within ±U_max, the current is held within ±I_max. Behind a rigid gear k, J
    and ω are those of the output. Continuous, with corners at the limits. Valid for changes slower than L/R;
    :class:`VoltageDrivenMotor` has the inductance.

    Examples
    --------
    >>> servo = ResistiveMotor(inertia=2e-3, torque_constant=0.5, resistance=4.0, voltage_limit=7.4)
    >>> servo.current_limit.number
    10000.0
    """

    command: ClassVar[tuple[str, str]] = ("wanted_voltage", "V")

    current_limit: Quantity = parameter(
        "A", "largest current of the amplifier", minimum=1e-6, maximum=1e4, default=1e4
    )

    def drive(self, scope: Scope, motion: Motion) -> Expression:
        """Return k·I."""
        most, supply = scope.parameter("current_limit"), scope.parameter("voltage_limit")
        resistance = scope.parameter("resistance")
        voltage = ca.fmin(ca.fmax(self.commanded(scope, motion), -supply), supply)
        pushed = (voltage - scope.parameter("torque_constant") * motion.rate) / resistance
        current = ca.fmin(ca.fmax(pushed, -most), most)
        scope.signal("winding_current", current, "A", f"current in the winding of {scope.path}")
        return self._torque(scope, current, voltage)


@dataclass(frozen=True, kw_only=True)
class CurrentDrivenMotor(ElectricMotor):
    """Motor behind a fast current loop: J·ω̇ = k·I + ΣT, U = R·I + k·ω.

    I is the wanted current held within ±I_max, and then within what the supply can push through the winding
    at this speed, (±U_max − k·ω)/R: above U_max/k the supply brakes. So the torque-speed curve is
    T = k·min(I_max, (U_max − k·ω)/R). Continuous, with corners at the limits, elsewhere C∞. Valid for changes
    slower than the current loop and than L/R; :class:`VoltageDrivenMotor` has the inductance.

    Examples
    --------
    >>> numbers = dict(inertia=1.4e-5, torque_constant=0.03, resistance=0.3)
    >>> CurrentDrivenMotor(**numbers, current_limit=20.0, voltage_limit=24.0).domain.effort
    'torque'
    """

    command: ClassVar[tuple[str, str]] = ("current", "A")
    acting: ClassVar[str] = "winding_current"

    def drive(self, scope: Scope, motion: Motion) -> Expression:
        """Return k·I."""
        wanted = self.commanded(scope, motion)
        most, supply = scope.parameter("current_limit"), scope.parameter("voltage_limit")
        resistance = scope.parameter("resistance")
        induced = scope.parameter("torque_constant") * motion.rate
        held = ca.fmin(ca.fmax(wanted, -most), most)
        current = ca.fmin(ca.fmax(held, (-supply - induced) / resistance), (supply - induced) / resistance)
        scope.signal("winding_current", current, "A", f"current in the winding of {scope.path}")
        return self._torque(scope, current, resistance * current + induced)


@dataclass(frozen=True, kw_only=True)
class VoltageDrivenMotor(ElectricMotor):
    """Motor at a voltage: L·İ = U − R·I − k·ω, J·ω̇ = k·I + ΣT; the current is a state.

    U is the wanted voltage, held so that the current approaches ±I_max no faster than
    (±I_max − I)/τ — the amplifier's own limiter, so a current within the limit stays there — and then within
    ±U_max. Continuous, with corners at the limits, elsewhere C∞. Time constant of the winding L/R.

    Examples
    --------
    >>> numbers = dict(inertia=1.4e-5, torque_constant=0.03, resistance=0.3, inductance=8e-5)
    >>> VoltageDrivenMotor(**numbers, current_limit=20.0, voltage_limit=24.0).limiter_time.number
    0.0001
    """

    command: ClassVar[tuple[str, str]] = ("wanted_voltage", "V")

    inductance: Quantity = parameter("H", "inductance of the winding", minimum=1e-9, maximum=1e3)
    limiter_time: Quantity = parameter(
        "s", "time in which the amplifier holds the current", minimum=1e-7, maximum=1.0, default=1e-4
    )

    def drive(self, scope: Scope, motion: Motion) -> Expression:
        """Return k·I."""
        wanted = self.commanded(scope, motion)
        current = scope.state("current", "A", f"current in the winding of {scope.path}")
        most, supply = scope.parameter("current_limit"), scope.parameter("voltage_limit")
        inductance = scope.parameter("inductance")
        used = scope.parameter("resistance") * current + scope.parameter("torque_constant") * motion.rate
        stiffness = inductance / scope.parameter("limiter_time")
        low, high = used + stiffness * (-most - current), used + stiffness * (most - current)
        voltage = ca.fmin(ca.fmax(ca.fmin(ca.fmax(wanted, low), high), -supply), supply)
        scope.derive(current, (voltage - used) / inductance)
        return self._torque(scope, current, voltage)
