"""Faults of drives: each lies in the chain between command and effort."""

from __future__ import annotations

from dataclasses import dataclass

import casadi as ca

from ...foundation.quantity import Quantity, same_dimension
from ...foundation.symbolic import Expression
from ..core.domain import ROTATION, TRANSLATION, Domain
from ..core.element import Scope
from ..core.part_numbers import one_of, parameter
from .drive_chain import DriveCommand, DrivePart

CURRENT = Domain("current", "charge", "C", "current", "A", "current", "A", "H")
VOLTAGE = Domain("voltage", "flux", "V*s", "voltage", "V", "voltage", "V", "F")
COMMANDS = (CURRENT, VOLTAGE, ROTATION, TRANSLATION)
"""What may command a drive, a current, a voltage, a torque or a force: its unit is that of the effort."""


def command_domain(unit: str) -> Domain | None:
    """Return the kind of a command, ``None`` for one of another unit."""
    return next((each for each in COMMANDS if same_dimension(each.effort_unit, unit)), None)


@dataclass(frozen=True, kw_only=True)
class DriveFault(DrivePart):
    """Base of faults with a number in the unit of the command."""

    domain: Domain = one_of(*COMMANDS)

    def taken(self, given: str, moved: Domain) -> str | None:
        """Return the unit of the command if the fault has its number in it."""
        return given if same_dimension(self.domain.effort_unit, given) else None


@dataclass(frozen=True, kw_only=True)
class CommandSaturation(DriveFault):
    """An effort that saturates: u' = u/√(1 + (u/u_s)²), as :class:`DriveSaturation` of a current.

    At u_s the effort is 71 % of the ideal one; the gain is that of small commands. C∞. Valid for slow
    changes. Source: Hanselman 2003 (saturation, Froelich's curve of magnetisation in its smooth form).

    Examples
    --------
    >>> CommandSaturation(saturation=9.0, domain=VOLTAGE).title()
    'CommandSaturation(saturation = 9 V)'
    """

    saturation: Quantity = parameter(
        "{effort}", "command u_s at which 71 % of the ideal effort is left", minimum=1e-9, maximum=1e9
    )

    def act(self, scope: Scope, command: DriveCommand) -> Expression:
        """Return u/√(1 + (u/u_s)²)."""
        share = command.value / scope.parameter("saturation")
        return command.value / ca.sqrt(1 + share * share)


@dataclass(frozen=True, kw_only=True)
class GradualSaturation(DriveFault):
    """An effort that saturates gradually: u' = u_s·arctan(u/u_s).

    At u_s the effort is π/4 = 79 % of the ideal one, and it approaches its limit π/2·u_s more slowly than
    :class:`CommandSaturation`; the gain is that of small commands. C∞. Valid for slow changes. Source:
    Hanselman 2003 (saturation, arctangent as curve of magnetisation).

    Examples
    --------
    >>> GradualSaturation(saturation=9.0, domain=VOLTAGE).title()
    'GradualSaturation(saturation = 9 V)'
    """

    saturation: Quantity = parameter(
        "{effort}", "command u_s at which 79 % of the ideal effort is left", minimum=1e-9, maximum=1e9
    )

    def act(self, scope: Scope, command: DriveCommand) -> Expression:
        """Return u_s·arctan(u/u_s)."""
        limit = scope.parameter("saturation")
        return limit * ca.atan(command.value / limit)


@dataclass(frozen=True, kw_only=True)
class CommandCompression(DriveFault):
    """A gain that falls with the command from the first: u' = u/(1 + |u|/u_h).

    The source of the command has an inner resistance that grows with it, as an amplifier whose duty falls
    with the load, or a supply that gives way. At u_h half of the command acts. Continuous with its slope.
    A winding whose resistance grows with the duty has the same law. Source: Hanselman 2003 (Froelich's curve
    of magnetisation in its first form).

    Examples
    --------
    >>> CommandCompression(halving=40.0, domain=VOLTAGE).title()
    'CommandCompression(halving = 40 V)'
    """

    halving: Quantity = parameter("{effort}", "command u_h of which half acts", minimum=1e-9, maximum=1e9)

    def act(self, scope: Scope, command: DriveCommand) -> Expression:
        """Return u/(1 + |u|/u_h)."""
        return command.value / (1 + ca.fabs(command.value) / scope.parameter("halving"))


@dataclass(frozen=True, kw_only=True)
class WindingHeat(DriveFault):
    """A drive that loses effort as it grows warm: I' = I/(1 + ϑ), dϑ/dt = ((I/I_h)² − ϑ)/τ.

    The loss R·I² heats winding and magnets, whose field falls with temperature; ϑ is zero when cold. I_h is
    the steady command at which half of the effort would be left. Valid for ϑ below about 0.5. τ is no shorter
    than 0.3 s: half a millimetre of copper (3.4 MJ/(m³·K)) behind 0.04 mm of enamel (0.2 W/(m·K)) cools in
    3.4e6·5e-4·4e-5/0.2 s, and magnets take longer. Something quicker is not heat. A diagnosis takes each
    record to begin cold.
    Sources: first law of thermodynamics; Hanselman 2003 (magnets and temperature).

    Examples
    --------
    >>> WindingHeat(halving=12.0, cooling_time=60.0).title()
    'WindingHeat(halving = 12 A, cooling_time = 60 s)'
    """

    halving: Quantity = parameter("{effort}", "steady command I_h with ϑ = 1", minimum=1e-9, maximum=1e9)
    cooling_time: Quantity = parameter("s", "time constant τ of cooling", minimum=0.3, maximum=1e6)

    def act(self, scope: Scope, command: DriveCommand) -> Expression:
        """Return I/(1 + ϑ)."""
        heat = scope.state("heat", "1", f"relative loss of effort of {scope.path} by heat")
        share = command.value / scope.parameter("halving")
        scope.derive(heat, (share * share - heat) / scope.parameter("cooling_time"))
        return command.value / (1 + heat)


@dataclass(frozen=True, kw_only=True)
class TorqueConstantDrift(DrivePart):
    """A torque constant that changes with time: I' = I·(1 + d·τ·(1 − e^(−t/τ))), with t from the start.

    Linear in time while t ≪ τ, and d·τ in the end; t is a state, so a model does not depend on the clock.
    Valid while the change is small against one. Source: Hanselman 2003 (magnets and temperature).

    Examples
    --------
    >>> TorqueConstantDrift(drift=-2e-3).settling_time.number
    1000000.0
    """

    drift: Quantity = parameter("1/s", "relative change d per time at first", minimum=-1e3, maximum=1e3)
    settling_time: Quantity = parameter(
        "s", "time constant τ after which it stays", minimum=1e-3, maximum=1e6, default=1e6
    )

    def act(self, scope: Scope, command: DriveCommand) -> Expression:
        """Return I times its factor."""
        elapsed = scope.state("elapsed", "s", f"time that {scope.path} has run")
        scope.derive(elapsed, ca.SX(1))
        settling = scope.parameter("settling_time")
        return command.value * (1 - scope.parameter("drift") * settling * ca.expm1(-elapsed / settling))
