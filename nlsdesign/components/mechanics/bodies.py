"""Bodies: what has an angle (or a position) of its own. Elements act between bodies."""

from __future__ import annotations

from abc import abstractmethod
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, replace
from typing import ClassVar, NamedTuple, Self

import casadi as ca

from ...foundation.errors import ArrangementError
from ...foundation.quantity import Quantity, typeset_unit
from ...foundation.symbolic import Expression
from ..core.element import ROTATION, TRANSLATION, Domain, Scope
from ..core.part import RESERVED, Part, check_names
from ..core.part_numbers import one_of, parameter
from .controllers import Controller
from .drive_chain import DriveCommand, DrivePart


class Motion(NamedTuple):
    """Motion of a body and its rate."""

    motion: Expression
    rate: Expression


@dataclass(frozen=True, kw_only=True)
class Body(Part):
    """Base of everything that elements can be tied to."""

    @property
    @abstractmethod
    def domain(self) -> Domain:
        """Rotation or translation."""

    @property
    def motion_names(self) -> tuple[str, str]:
        """Own names of the motion and its rate."""
        return ("angle", "speed") if self.domain == ROTATION else ("position", "speed")

    @abstractmethod
    def motion(self, scope: Scope) -> Motion:
        """Return motion and rate, declaring states or inputs."""

    @abstractmethod
    def balance(self, scope: Scope, motion: Motion, effort: Expression) -> None:
        """Close the equations with the sum of the efforts of all elements on the body."""


@dataclass(frozen=True, kw_only=True)
class Free(Body):
    """Base of the bodies that move by themselves: two states, and a drive.

    Parameters
    ----------
    chain
        Pairs of name and part of the drive, in the order of action; none for an ideal drive. What follows the
        last controller lies between the command and the effort. With a controller the input of the body is a
        ``goal``, and its command goes on as a signal.

    Raises
    ------
    ArrangementError
        If a part does not belong into a drive, a name is taken, or the units of two neighbours differ.
    """

    inertia_name: ClassVar[str] = "inertia"
    """Field that says what is accelerated."""
    command: ClassVar[tuple[str, str]] = ("torque", "N*m")
    """Name and unit of what drives the body from outside."""
    acting: ClassVar[str] = ""
    """Name of the signal of what is left of the command within the limits of the drive; empty without one."""

    chain: tuple[tuple[str, DrivePart], ...] = ()

    def __post_init__(self) -> None:
        super().__post_init__()
        kind = type(self).__name__
        check_names(kind, [n for n, _ in self.chain], taken=RESERVED | set(self.parameter_infos()))
        for name, part in self.chain:
            if not isinstance(part, DrivePart):
                raise ArrangementError(
                    f"part '{name}' of {kind}",
                    f"is a {type(part).__name__}, which does not lie between a command and its effort",
                    next_step="put for instance a DriveDelay or a PositionLoop there",
                )
        self._taken(self.chain)

    def _taken(self, parts: Sequence[tuple[str, DrivePart]]) -> str:
        """Return the unit of what comes into parts of the drive that give the command."""
        unit = self.command[1]
        for name, part in reversed(parts):
            taken = part.taken(unit, self.domain)
            if taken is None:
                own = f"{type(part).__name__} gives {typeset_unit(part.gives or part.unit)}"
                raise ArrangementError(
                    f"part '{name}' of {type(self).__name__}",
                    f"{own}; here {typeset_unit(unit)} is asked for, by {self.domain.motion}",
                    next_step=f"give its numbers in units of {typeset_unit(unit)} and "
                    f"{typeset_unit(self.domain.motion_unit)}, or take another part",
                )
            unit = taken
        return unit

    @property
    def loops(self) -> tuple[tuple[str, DrivePart], ...]:
        """The parts of the drive up to the last controller: they give the command."""
        places = [k for k, (_, part) in enumerate(self.chain) if isinstance(part, Controller)]
        return self.chain[: places[-1] + 1] if places else ()

    def children(self) -> Mapping[str, Part]:
        """Return the parts of the drive by name."""
        return dict(self.chain)

    def with_children(self, children: Mapping[str, Part]) -> Self:
        """Return a copy with other parts of the drive."""
        # The kind is checked where the copy is made.
        return replace(self, chain=tuple(children.items()))  # type: ignore[arg-type]

    def motion(self, scope: Scope) -> Motion:
        """Declare motion and speed as states."""
        place, speed = self.motion_names
        return Motion(
            scope.state(place, self.domain.motion_unit, f"{place} of {scope.path}"),
            scope.state(speed, self.domain.rate_unit, f"{speed} of {scope.path}"),
        )

    def commanded(
        self, scope: Scope, motion: Motion, held: Callable[[Expression], Expression] = lambda value: value
    ) -> Expression:
        """Return the command as it acts behind all parts of the drive.

        Parameters
        ----------
        scope, motion
            Of the body.
        held
            Keeps the command within the limits of the drive.
        """
        name, unit = self.command
        meaning = f"{name.replace('_', ' ')} of {scope.path}"
        if not self.loops:
            value = held(scope.input(name, unit, meaning))
        else:
            taken = self._taken(self.loops)
            goal = DriveCommand(scope.input("goal", taken, f"goal of {scope.path}"), taken, *motion)
            value = held(_through(scope, self.loops, goal))
            scope.signal(name, value, unit, meaning)
        return _through(scope, self.chain[len(self.loops) :], DriveCommand(value, unit, *motion))

    @abstractmethod
    def drive(self, scope: Scope, motion: Motion) -> Expression:
        """Return the effort that acts on the body from outside, in the unit of the domain."""

    def inertia_of(self, scope: Scope) -> Expression:
        """Return the inertia or mass."""
        return scope.parameter(self.inertia_name)

    def balance(self, scope: Scope, motion: Motion, effort: Expression) -> None:
        """Newton: inertia × acceleration = sum of efforts."""
        acceleration = (self.drive(scope, motion) + effort) / self.inertia_of(scope)
        scope.derive(motion.motion, motion.rate)
        scope.derive(motion.rate, acceleration)
        scope.signal(
            "acceleration", acceleration, f"{self.domain.motion_unit}/s^2", f"acceleration of {scope.path}"
        )


def _through(scope: Scope, parts: Sequence[tuple[str, DrivePart]], command: DriveCommand) -> Expression:
    """Return what comes out behind parts of a drive."""
    for name, part in parts:
        value = part.act(scope.child(name), command)
        command = command._replace(value=value, unit=part.gives or command.unit)
    return command.value


@dataclass(frozen=True, kw_only=True)
class Inertia(Free):
    """A turning body, J·ω̇ = ΣT + T_o, with a torque T_o from outside: a load, or that of a drive.

    With ``chain`` it stands for a drive that is given a torque, for instance one that comes late.
    """

    domain: ClassVar[Domain] = ROTATION

    inertia: Quantity = parameter("kg*m^2", "moment of inertia", minimum=1e-12, maximum=1e6)

    def drive(self, scope: Scope, motion: Motion) -> Expression:
        """Return the torque from outside, or that of the drive."""
        return self.commanded(scope, motion)


@dataclass(frozen=True, kw_only=True)
class Mass(Free):
    """A sliding body, m·v̇ = ΣF + F_o, with a force F_o from outside: a load, or that of a drive."""

    domain: ClassVar[Domain] = TRANSLATION

    inertia_name: ClassVar[str] = "mass"
    command: ClassVar[tuple[str, str]] = ("force", "N")

    mass: Quantity = parameter("kg", "mass", minimum=1e-9, maximum=1e9)

    def drive(self, scope: Scope, motion: Motion) -> Expression:
        """Return the force from outside, or that of the drive."""
        return self.commanded(scope, motion)


@dataclass(frozen=True, kw_only=True)
class GearedMotor(Free):
    """Electric motor behind a rigid gear, seen from the output: J·ω̇ = n·k_T·I + ΣT.

    The inertia is that of everything that turns, reflected to the output; the gear has no loss here, so
    friction is an element of its own. I is the current within its limit, as it comes out of the parts of the
    drive, in written order. Source: Leonhard 2001.

    Examples
    --------
    >>> from nlsdesign.components import DriveDelay, DriveSaturation
    >>> chain = ("delay", DriveDelay(delay=4e-3)), ("saturation", DriveSaturation(saturation_current=6.0))
    >>> motor = GearedMotor(inertia=0.01, gear_ratio=25.0, torque_constant=0.03, chain=chain)
    >>> list(motor.children())
    ['delay', 'saturation']
    """

    domain: ClassVar[Domain] = ROTATION
    command: ClassVar[tuple[str, str]] = ("current", "A")

    inertia: Quantity = parameter(
        "kg*m^2", "moment of inertia at the gear's output", minimum=1e-12, maximum=1e6
    )
    gear_ratio: Quantity = parameter("1", "motor turns per output turn", minimum=1e-3, maximum=1e4)
    torque_constant: Quantity = parameter("N*m/A", "motor torque per current", minimum=1e-6, maximum=1e3)
    current_limit: Quantity = parameter("A", "largest current", minimum=1e-6, maximum=1e4, default=20.0)

    def drive(self, scope: Scope, motion: Motion) -> Expression:
        """Return n·k_T·I: the current within its limit, then through the parts of the drive."""
        limit = scope.parameter("current_limit")
        current = self.commanded(scope, motion, lambda wanted: ca.fmin(ca.fmax(wanted, -limit), limit))
        torque = scope.parameter("gear_ratio") * scope.parameter("torque_constant") * current
        scope.signal("drive_torque", torque, "N*m", f"torque of {scope.path} at the gear's output")
        return torque


@dataclass(frozen=True, kw_only=True)
class Fixed(Body):
    """A body that does not turn: the bench. With ``domain=TRANSLATION`` the clamp of a tensile machine."""

    domain: Domain = one_of(ROTATION, TRANSLATION)

    def motion(self, scope: Scope) -> Motion:
        """Return zero."""
        return Motion(ca.SX(0), ca.SX(0))

    def balance(self, scope: Scope, motion: Motion, effort: Expression) -> None:
        """Name the torque that the bench has to hold."""
        scope.signal("reaction", -effort, self.domain.effort_unit, f"what holds {scope.path}")


@dataclass(frozen=True, kw_only=True)
class Driven(Body):
    """A body whose motion is prescribed from outside: angle, or position, and speed are inputs.

    With ``domain=TRANSLATION`` the grip of a tensile machine.
    """

    domain: Domain = one_of(ROTATION, TRANSLATION)

    def motion(self, scope: Scope) -> Motion:
        """Declare motion and speed as inputs."""
        place, speed = self.motion_names
        return Motion(
            scope.input(place, self.domain.motion_unit, f"prescribed {place} of {scope.path}"),
            scope.input(speed, self.domain.rate_unit, f"prescribed {speed} of {scope.path}"),
        )

    def balance(self, scope: Scope, motion: Motion, effort: Expression) -> None:
        """Name the effort that the prescribed motion takes."""
        scope.signal("reaction", -effort, self.domain.effort_unit, f"what moves {scope.path}")
