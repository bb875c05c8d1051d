"""What lies between the current of a motor and its torque, one part after the other."""

from __future__ import annotations

from abc import abstractmethod
from dataclasses import dataclass

import casadi as ca

from ...quantity import Quantity
from ...symbolic import Expression
from ..core.delay import delayed
from ..core.element import Scope
from ..core.part import Part
from ..core.part_numbers import parameter


@dataclass(frozen=True, kw_only=True)
class DrivePart(Part):
    """Base of the parts of a drive: each takes a current and gives the one that acts behind it."""

    @abstractmethod
    def act(self, scope: Scope, current: Expression) -> Expression:
        """Return the current that an ideal motor would need for the same torque.

        Parameters
        ----------
        scope
            Of the part.
        current
            That comes in, in A.
        """


@dataclass(frozen=True, kw_only=True)
class DriveDelay(DrivePart):
    """A torque that follows the current by a transport delay τ: I'(t) = I(t − τ).

    In (2,2) Padé approximation, see :func:`~nlsdesign.components.core.delay.delayed`.
    Source: Golub and Van Loan 2013 (Padé table of the exponential).

    Examples
    --------
    >>> DriveDelay(delay=4e-3).title()
    'DriveDelay(delay = 0.004 s)'
    """

    delay: Quantity = parameter("s", "time from current to torque", minimum=1e-6, maximum=10.0)

    def act(self, scope: Scope, current: Expression) -> Expression:
        """Return the current as it was a delay ago."""
        return delayed(scope, current, "A")


@dataclass(frozen=True, kw_only=True)
class DriveSaturation(DrivePart):
    """Iron that saturates: I' = I/√(1 + (I/I_s)²).

    At I = I_s the torque is 71 % of the ideal one; the torque constant is that of small currents. C∞. Valid
    for slow changes, without hysteresis of the iron.
    Source: Hanselman 2003 (saturation, Froelich's curve of magnetisation in its smooth form).

    Examples
    --------
    >>> DriveSaturation(saturation_current=6.0).title()
    'DriveSaturation(saturation_current = 6 A)'
    """

    saturation_current: Quantity = parameter(
        "A", "current at which 71 % of the ideal torque is left", minimum=1e-6, maximum=1e6
    )

    def act(self, scope: Scope, current: Expression) -> Expression:
        """Return I/√(1 + (I/I_s)²)."""
        share = current / scope.parameter("saturation_current")
        return current / ca.sqrt(1 + share * share)
