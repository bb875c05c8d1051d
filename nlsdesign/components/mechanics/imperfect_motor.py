"""Motors that fall short of the ideal one: torque that comes late, torque that saturates."""

from __future__ import annotations

from abc import abstractmethod
from dataclasses import dataclass

import casadi as ca

from ...quantity import Quantity
from ...symbolic import Expression
from ..core.element import Scope
from ..core.part import parameter
from .bodies import GearedMotor, Motion


@dataclass(frozen=True, kw_only=True)
class ImperfectMotor(GearedMotor):
    """Base of motors whose torque is n·k_T times something else than the current: :meth:`acting`."""

    @abstractmethod
    def acting(self, scope: Scope, current: Expression) -> Expression:
        """Return the current that an ideal motor would need for the same torque.

        Parameters
        ----------
        scope
            Of the motor.
        current
            Held within its limit.
        """

    def drive(self, scope: Scope, motion: Motion) -> Expression:
        """Return n·k_T times the acting current."""
        limit = scope.parameter("current_limit")
        current = ca.fmin(ca.fmax(scope.input("current", "A", f"current of {scope.path}"), -limit), limit)
        torque = (
            scope.parameter("gear_ratio") * scope.parameter("torque_constant") * self.acting(scope, current)
        )
        scope.signal("drive_torque", torque, "N*m", f"torque of {scope.path} at the gear's output")
        return torque


@dataclass(frozen=True, kw_only=True)
class DelayedMotor(ImperfectMotor):
    """Geared motor whose torque follows the measured current by a transport delay τ, T(t) = n·k_T·I(t − τ).

    The delay is its (2,2) Padé approximation, e^(−sτ) ≈ (1 − sτ/2 + s²τ²/12)/(1 + sτ/2 + s²τ²/12), with phase
    error below (ωτ)⁵/720. The states are a, which rests at the current, and b = τ·ȧ; the acting current is
    I − b. Source: Golub and Van Loan 2013 (Padé table of the exponential).
    """

    delay: Quantity = parameter("s", "time from current to torque", minimum=1e-6, maximum=10.0)

    def acting(self, scope: Scope, current: Expression) -> Expression:
        """Return the current as it was a delay ago."""
        tau = scope.parameter("delay")
        lag = scope.state("lag", "A", f"lagging current inside the delay of {scope.path}")
        change = scope.state("lag_change", "A", f"its change over one delay, in {scope.path}")
        scope.derive(lag, change / tau)
        scope.derive(change, (12 * (current - lag) - 6 * change) / tau)
        return current - change


@dataclass(frozen=True, kw_only=True)
class SaturatingMotor(ImperfectMotor):
    """Geared motor whose iron saturates: T = n·k_T·I/√(1 + (I/I_s)²).

    At I = I_s the torque is 71 % of the ideal one; k_T is that of small currents. C∞. Valid for slow changes,
    without hysteresis of the iron. Source: Hanselman 2003 (saturation,
    Froelich's curve of magnetisation in its smooth form).
    """

    saturation_current: Quantity = parameter(
        "A", "current at which 71 % of the ideal torque is left", minimum=1e-6, maximum=1e6
    )

    def acting(self, scope: Scope, current: Expression) -> Expression:
        """Return I/√(1 + (I/I_s)²)."""
        share = current / scope.parameter("saturation_current")
        return current / ca.sqrt(1 + share * share)
