"""What lies between the command of a drive and its effort, one part after the other."""

from __future__ import annotations

from abc import abstractmethod
from dataclasses import dataclass
from typing import ClassVar, NamedTuple

import casadi as ca

from ...foundation.quantity import Quantity, same_dimension
from ...foundation.symbolic import Expression
from ..core.domain import Domain
from ..core.element import Scope, delayed
from ..core.part import Part
from ..core.part_numbers import parameter


class DriveCommand(NamedTuple):
    """What comes into a part of a drive."""

    # value, unit: for instance a current in A, or the goal of a position controller in rad
    value: Expression
    unit: str
    # motion, rate: of the body that is driven
    motion: Expression
    rate: Expression


@dataclass(frozen=True, kw_only=True)
class DrivePart(Part):
    """Base of the parts of a drive: each takes a command and gives the one that acts behind it."""

    unit: ClassVar[str] = ""
    """Unit of the only command that it can take; any if there is none."""

    def taken(self, given: str, moved: Domain) -> str | None:
        """Return the unit of the command that it takes, ``None`` if it cannot give what is asked for.

        Parameters
        ----------
        given
            Unit of what it has to give.
        moved
            Domain of the body that is driven.
        """
        return given if not self.unit or same_dimension(self.unit, given) else None

    @property
    def gives(self) -> str:
        """Unit of what it gives; empty if that is the unit of what it takes."""
        return ""

    @abstractmethod
    def act(self, scope: Scope, command: DriveCommand) -> Expression:
        """Return the command that an ideal drive would need for the same effort.

        Parameters
        ----------
        scope
            Of the part.
        command
            That comes in.
        """


@dataclass(frozen=True, kw_only=True)
class DriveDelay(DrivePart):
    """An effort that follows the command by a transport delay τ: u'(t) = u(t − τ).

    Before a controller its goal comes late. In (2,2) Padé approximation, see
    :func:`~nlsdesign.components.core.element.delayed`. Source: Golub and Van Loan 2013 (Padé table of the
    exponential).

    Examples
    --------
    >>> DriveDelay(delay=4e-3).title()
    'DriveDelay(delay = 0.004 s)'
    """

    delay: Quantity = parameter("s", "time from command to effort", minimum=1e-6, maximum=10.0)

    def act(self, scope: Scope, command: DriveCommand) -> Expression:
        """Return the command as it was a delay ago."""
        return delayed(scope, command.value, command.unit)


@dataclass(frozen=True, kw_only=True)
class DriveLag(DrivePart):
    """An amplifier or a filter that follows its command with a time constant: T·u̇' = u − u'.

    Valid where one time constant dominates. Source: Leonhard 2001 (loops in cascade, the inner one as a lag).

    Examples
    --------
    >>> DriveLag(time_constant=0.012).title()
    'DriveLag(time_constant = 0.012 s)'
    """

    time_constant: Quantity = parameter(
        "s", "time in which 63 % of a step has come through", minimum=1e-6, maximum=100.0
    )

    def act(self, scope: Scope, command: DriveCommand) -> Expression:
        """Return the command behind the lag."""
        behind = scope.state("behind", command.unit, f"command behind {scope.path}")
        scope.derive(behind, (command.value - behind) / scope.parameter("time_constant"))
        return behind


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

    unit: ClassVar[str] = "A"

    saturation_current: Quantity = parameter(
        "A", "current at which 71 % of the ideal torque is left", minimum=1e-6, maximum=1e6
    )

    def act(self, scope: Scope, command: DriveCommand) -> Expression:
        """Return I/√(1 + (I/I_s)²)."""
        share = command.value / scope.parameter("saturation_current")
        return command.value / ca.sqrt(1 + share * share)
