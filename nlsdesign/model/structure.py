"""What a flat model is made of, by name: bodies, springs and readings.

Consumers ask here which variable is the speed of a body or the lever arm of a cam; nobody takes names apart.
"""

from __future__ import annotations

from collections.abc import Collection, Iterable, Sequence
from dataclasses import dataclass, replace

from ..components.assembly.named_parts import Assembly
from ..components.core.element import MATERIAL, Domain, Element, Tie
from ..components.mechanics.bodies import Body, Free, GearedMotor, Inertia, Mass
from ..components.mechanics.motor import ElectricMotor
from .gear_train import trains
from .owners import Owners, declared_by
from .readings import ReadingNames
from .spring_structure import CamNames as CamNames
from .spring_structure import SpringNames as SpringNames


@dataclass(frozen=True)
class MotorNames:
    """The names around a motor.

    Parameters
    ----------
    command
        Input: current, or wanted voltage. ``None`` where it is held at zero.
    inertia, torque_constant, current_limit
        Parameters.
    gear_ratio
        Parameter; ``None`` for a motor without a gear of its own.
    """

    command: str | None
    inertia: str
    torque_constant: str
    current_limit: str
    gear_ratio: str | None


@dataclass(frozen=True)
class MovingBody:
    """A body with a motion of its own.

    Parameters
    ----------
    name
        Path of the body.
    domain
        Rotation or translation, with the units of motion, rate and effort.
    motion, rate
        Names of the two states, or of the two inputs where the motion is prescribed.
    inertia
        Name of the parameter or signal that says what is accelerated: with a gear train the inertia of all
        that turns, seen from this body. ``None`` where the motion is prescribed.
    drives
        Names of the inputs that act on the body from outside, such as a current or a torque.
    geared
        Names of the bodies that move with it through rigid gears.
    motor
        The motor in it; ``None`` for a body without one.
    commands
        Names of the inputs and signals that command a drive in it, or in what is geared to it, such as a
        voltage or current: whatever is not known of them was not zero. A load from outside is none.
    goals
        Names of the inputs that controllers in it follow.
    """

    name: str
    domain: Domain
    motion: str
    rate: str
    inertia: str | None
    drives: tuple[str, ...]
    geared: tuple[str, ...] = ()
    motor: MotorNames | None = None
    commands: tuple[str, ...] = ()
    goals: tuple[str, ...] = ()

    @property
    def acceleration(self) -> str:
        """Name of the signal of its acceleration; there is none where the motion is prescribed."""
        return f"{self.name}.acceleration"

    @property
    def prescribed(self) -> bool:
        """Whether the motion comes from outside."""
        return self.inertia is None


def body_moved_by(bodies: Sequence[MovingBody], motion: str) -> MovingBody | None:
    """Return the body that has this motion, ``None`` if there is none."""
    return next((body for body in bodies if body.motion == motion), None)


def motions_of_efforts(assembly: Assembly) -> dict[str, str]:
    """Return the motion that does work with each force and torque, by name of the effort."""
    pieces = ((path, part.element if isinstance(part, Tie) else part) for path, part in assembly.walk())
    return {
        f"{path}.{piece.domain.effort}": f"{path}.{piece.domain.motion}"
        for path, piece in pieces
        if isinstance(piece, Element) and piece.domain != MATERIAL
    }


def top_part(name: str) -> str:
    """Return the part of the assembly to which a hierarchical name belongs: names begin with it."""
    return name.partition(".")[0]


def moving_bodies(assembly: Assembly, owners: Owners) -> tuple[MovingBody, ...]:
    """Return the bodies that have a motion of their own, in written order."""
    geared = {lead: tuple(w.name for w in train.wheels())[1:] for lead, train in trains(assembly).items()}
    bodies = []
    for name, part in assembly.parts:
        if not isinstance(part, Body):
            continue
        motion, rate = (f"{name}.{own}" for own in part.motion_names)
        if motion not in owners.states and motion not in owners.inputs:
            continue  # a body at rest, or one that a gear leads
        if not isinstance(part, Free):
            bodies.append(MovingBody(name, part.domain, motion, rate, None, ()))
            continue
        drives = tuple(declared_by([name], owners.inputs))
        inertia = f"{name}.{'train_inertia' if name in geared else part.inertia_name}"
        motor = _motor(name, part, drives) if isinstance(part, GearedMotor | ElectricMotor) else None
        commands, goals = _commands(assembly, (name, *geared.get(name, ())))
        bodies.append(
            MovingBody(
                name, part.domain, motion, rate, inertia, drives, geared.get(name, ()), motor, commands, goals
            )
        )
    return tuple(bodies)


def _commands(assembly: Assembly, names: Iterable[str]) -> tuple[tuple[str, ...], tuple[str, ...]]:
    """Return what commands the drives in bodies that move together, and the goals of their controllers."""
    free = [(name, part) for name in names if isinstance(part := assembly[name], Free)]
    driven = [(n, p) for n, p in free if p.chain or not isinstance(p, Inertia | Mass)]
    return tuple(f"{n}.{p.command[0]}" for n, p in driven), tuple(f"{n}.goal" for n, p in driven if p.loops)


def _motor(name: str, part: GearedMotor | ElectricMotor, drives: Iterable[str]) -> MotorNames:
    return MotorNames(
        command=None if part.loops else next(iter(drives), None),
        inertia=f"{name}.{part.inertia_name}",
        torque_constant=f"{name}.torque_constant",
        current_limit=f"{name}.current_limit",
        gear_ratio=f"{name}.gear_ratio" if isinstance(part, GearedMotor) else None,
    )


@dataclass(frozen=True)
class ModelParts:
    """Bodies, springs and readings of a model."""

    bodies: tuple[MovingBody, ...]
    springs: tuple[SpringNames, ...]
    readings: tuple[ReadingNames, ...]

    def within(self, names: Collection[str], inputs: Collection[str]) -> ModelParts:
        """Return what is left where a model has these variables only.

        A body stays while it has motion and rate, a spring while it has motion and effort, a reading while
        it has its signal. Of inputs and inner states those stay that there are.
        """
        return ModelParts(
            tuple(
                _with_drives(body, inputs) for body in self.bodies if {body.motion, body.rate} <= set(names)
            ),
            tuple(
                _with_states(spring, names)
                for spring in self.springs
                if {spring.motion, spring.effort} <= set(names)
            ),
            tuple(reading for reading in self.readings if reading.signal in names),
        )

    def with_state(self, old: str, new: str) -> ModelParts:
        """Return what there is where another inner state of a spring stands in the place of one."""

        def exchanged(states: tuple[str, ...]) -> tuple[str, ...]:
            return tuple(new if state == old else state for state in states)

        springs = (
            replace(
                spring,
                states=exchanged(spring.states),
                cams=tuple(replace(cam, states=exchanged(cam.states)) for cam in spring.cams),
            )
            for spring in self.springs
        )
        return replace(self, springs=tuple(springs))


def _with_drives(body: MovingBody, inputs: Collection[str]) -> MovingBody:
    motor = body.motor
    if motor and motor.command not in inputs:
        motor = replace(motor, command=None)
    return replace(body, drives=tuple(name for name in body.drives if name in inputs), motor=motor)


def _with_states(spring: SpringNames, names: Collection[str]) -> SpringNames:
    cams = (
        replace(cam, states=tuple(state for state in cam.states if state in names)) for cam in spring.cams
    )
    return replace(spring, states=tuple(state for state in spring.states if state in names), cams=tuple(cams))
