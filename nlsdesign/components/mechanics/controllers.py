"""Controllers inside a drive: from a goal and the measured motion to the command behind them."""

from __future__ import annotations

from dataclasses import dataclass
from typing import ClassVar

import casadi as ca

from ...foundation.quantity import Quantity, same_dimension
from ...foundation.symbolic import Expression
from ..core.domain import Domain
from ..core.element import Scope
from ..core.part_numbers import Reading, one_of, parameter, read_as
from .drive_chain import DriveCommand, DrivePart


def _loop(name: str, effort: str, unit: str, *, turning: bool) -> Domain:
    """Return the pair of a motion and a command, for the units of gains."""
    motion, rate, kind = ("rad", "rad/s", "angle") if turning else ("m", "m/s", "position")
    return Domain(f"{name}_by_{kind}", kind, motion, "speed", rate, effort, unit, f"{unit}*s^2/{motion}")


LOOPS: tuple[Domain, ...] = tuple(
    _loop(name, name, unit, turning=turning)
    for turning, effort in ((True, ("torque", "N*m")), (False, ("force", "N")))
    for name, unit in (
        ("voltage", "V"),
        ("current", "A"),
        effort,
        ("speed", "rad/s" if turning else "m/s"),
    )
)
"""What controllers give, and of what they take the motion: the units of their gains tell which it is."""


@dataclass(frozen=True)
class WithoutRate(Reading):
    """No damping by the controller."""

    def opposed(self, scope: Scope, rate: Expression) -> Expression:
        """Return zero."""
        return ca.SX(0)


@dataclass(frozen=True)
class RateFeedback(Reading):
    """Damping by the controller: K_d·q̇ is taken from the command, as of a derivative on the measurement.

    Source: Leonhard 2001.
    """

    derivative: Quantity = parameter(
        "{effort}*s/{motion}", "command per speed, against the motion", minimum=0.0, maximum=1e9
    )

    def opposed(self, scope: Scope, rate: Expression) -> Expression:
        """Return K_d·q̇.

        Parameters
        ----------
        scope, rate
            As of :class:`WithoutRate`.
        """
        return scope.parameter("derivative") * rate


@dataclass(frozen=True)
class WithoutIntegral(Reading):
    """No memory of the error."""

    def added(self, scope: Scope, error: tuple[Expression, Expression], unit: str) -> Expression:
        """Return zero."""
        return ca.SX(0)


@dataclass(frozen=True)
class Integral(Reading):
    """A command that grows as long as there is an error, and stands still while the output is at its limit.

    Source: Leonhard 2001.
    """

    reset_time: Quantity = parameter(
        "s", "time in which a constant error doubles the command", minimum=1e-6, maximum=1e6
    )

    def added(self, scope: Scope, error: tuple[Expression, Expression], unit: str) -> Expression:
        """Return the memory.

        Parameters
        ----------
        scope, error, unit
            As of :class:`WithoutIntegral`.
        """
        difference, command = error
        memory = scope.state("memory", unit, f"integral part of {scope.path}")
        wanted, limit = command + memory, scope.parameter("limit")
        beyond = ca.logic_and(ca.fabs(wanted) > limit, wanted * difference > 0)
        growing = scope.parameter("proportional") * difference / scope.parameter("reset_time")
        scope.derive(memory, ca.if_else(beyond, 0, growing))
        return memory


@dataclass(frozen=True, kw_only=True)
class Controller(DrivePart):
    """Base of the controllers; the domain pairs motion and command, for instance an angle and a voltage."""

    domain: Domain = one_of(*LOOPS)
    limit: Quantity
    memory: Reading

    def taken(self, given: str, moved: Domain) -> str | None:
        """Return the unit of the goal, ``None`` if the units of the gains are not those of the drive."""
        fits = same_dimension(given, self.domain.effort_unit)
        return self._goal if fits and self.domain.motion_unit == moved.motion_unit else None

    @property
    def gives(self) -> str:
        """Unit of the command."""
        return self.domain.effort_unit

    @property
    def _goal(self) -> str:
        return self.domain.motion_unit

    def _held(self, scope: Scope, error: Expression, opposed: Expression) -> Expression:
        """Return the command of an error, held within the limit."""
        assert isinstance(self.memory, WithoutIntegral | Integral)
        command = scope.parameter("proportional") * error - opposed
        command += self.memory.added(scope, (error, command), self.domain.effort_unit)
        limit = scope.parameter("limit")
        return ca.SX(ca.fmin(ca.fmax(command, -limit), limit))


@dataclass(frozen=True, kw_only=True)
class PositionLoop(Controller):
    """Position controller u = ⟨K_p·(goal − q) − K_d·q̇ + memory⟩, held within ±u_max: P, PD, PI or PID.

    With ``rate=RateFeedback(derivative=...)`` it damps, with ``memory=Integral(reset_time=...)`` it leaves
    no error at rest: the memory grows with K_p·(goal − q)/T_n and stands still while u is at its limit. The
    units of the gains say what it commands: a voltage, current, torque, force, or the speed of a loop behind.
    Continuous; corners at the limit. Valid where the controller samples much faster than the motion.
    Source: Leonhard 2001.

    Examples
    --------
    >>> PositionLoop(proportional=Quantity(8.5, "V/rad"), limit=Quantity(7.4, "V")).domain.name
    'voltage_by_angle'
    """

    proportional: Quantity = parameter(
        "{effort}/{motion}", "command per error of the motion", minimum=0.0, maximum=1e12
    )
    limit: Quantity = parameter("{effort}", "largest command", minimum=1e-9, maximum=1e12)
    rate: Reading = read_as(WithoutRate, RateFeedback, default=WithoutRate())
    memory: Reading = read_as(WithoutIntegral, Integral, default=WithoutIntegral())

    def act(self, scope: Scope, command: DriveCommand) -> Expression:
        """Return u for the goal that comes in."""
        assert isinstance(self.rate, WithoutRate | RateFeedback)
        opposed = self.rate.opposed(scope, command.rate)
        return self._held(scope, command.value - command.motion, opposed)


@dataclass(frozen=True, kw_only=True)
class SpeedLoop(Controller):
    """Speed controller u = ⟨K·(goal − q̇) + memory⟩, held within ±u_max: P, or PI with ``memory``.

    Behind a :class:`PositionLoop` that commands a speed it closes a cascade. Memory and limit as there.
    Continuous; corners at the limit. Source: Leonhard 2001.

    Examples
    --------
    >>> SpeedLoop(proportional=Quantity(0.2, "A*s/rad"), limit=Quantity(5.0, "A")).domain.name
    'current_by_angle'
    """

    unit: ClassVar[str] = ""

    proportional: Quantity = parameter(
        "{effort}*s/{motion}", "command per error of the speed", minimum=0.0, maximum=1e12
    )
    limit: Quantity = parameter("{effort}", "largest command", minimum=1e-9, maximum=1e12)
    memory: Reading = read_as(WithoutIntegral, Integral, default=WithoutIntegral())

    @property
    def _goal(self) -> str:
        return self.domain.rate_unit

    def act(self, scope: Scope, command: DriveCommand) -> Expression:
        """Return u for the goal that comes in."""
        return self._held(scope, command.value - command.rate, ca.SX(0))
