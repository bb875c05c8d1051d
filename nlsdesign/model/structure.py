"""What a flat model is made of, by name: bodies, springs and readings.

Consumers ask here which variable is the speed of a body or the lever arm of a cam; nobody takes names apart.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass

from ..components.assembly.named_parts import Assembly
from ..components.core.element import Domain
from ..components.core.part import walk
from ..components.core.tie import Tie
from ..components.mechanics.bodies import Body, Free
from ..components.sensing.sensors import Sensor
from ..components.transmission.cam_drive import Through
from ..symbolic import Expression


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
    """

    name: str
    domain: Domain
    motion: str
    rate: str
    inertia: str | None
    drives: tuple[str, ...]

    @property
    def prescribed(self) -> bool:
        """Whether the motion comes from outside."""
        return self.inertia is None


@dataclass(frozen=True)
class CamNames:
    """The names around one cam.

    Parameters
    ----------
    name
        Path of the cam.
    drive
        Path of the part that holds cam and element.
    angle, lever_arm
        Signals: angle of the cam, lever arm at that angle.
    element
        Path of what is stretched.
    extension, force
        Signals of what is stretched.
    pretension, elements
        Parameters: extension at angle zero, number of equal elements.
    last_angle
        Parameter that says where the contour ends; ``None`` for a cam that has no end.
    """

    name: str
    drive: str
    angle: str
    lever_arm: str
    element: str
    extension: str
    force: str
    pretension: str
    elements: str
    last_angle: str | None


@dataclass(frozen=True)
class SpringNames:
    """A tie that restores: what lies between two bodies and is elastic.

    Parameters
    ----------
    name
        Path of the tie.
    domain
        Of its motion and effort.
    motion, effort
        Signals.
    between
        Names of the bodies at its ends, one or two.
    cams
        The cams in it, in written order.
    """

    name: str
    domain: Domain
    motion: str
    effort: str
    between: tuple[str, ...]
    cams: tuple[CamNames, ...]


@dataclass(frozen=True)
class ReadingNames:
    """What a measured signal shows, through which chain of sensors.

    Parameters
    ----------
    signal
        Name of the reading; of a signal that is measured without a sensor, its own.
    measured
        Name of the state, input or signal that it shows.
    sensors
        Names of the sensors between, the one that gives the reading first.
    laws
        The sensors themselves, in the same order.
    """

    signal: str
    measured: str
    sensors: tuple[str, ...] = ()
    laws: tuple[Sensor, ...] = ()

    @property
    def delays(self) -> tuple[str, ...]:
        """Names of the parameters whose sum says by how many seconds the reading is late."""
        pairs = zip(self.sensors, self.laws, strict=True)
        return tuple(f"{name}.{law.late_by}" for name, law in pairs if law.late_by)

    @property
    def shows_value(self) -> bool:
        """Whether what is measured can be inferred from the reading."""
        return all(law.shows_value for law in self.laws)

    def inferred(self, reading: Expression, known: Mapping[str, Expression]) -> Expression:
        """Return the value behind a reading: the inverse of each sensor, the last one first.

        Parameters
        ----------
        reading
            What the last sensor gave, later by the sum of the ``delays``.
        known
            Parameters and states of the model by full name.

        Raises
        ------
        ArrangementError
            If a sensor does not show the value, see ``shows_value``.
        """
        for name, law in zip(self.sensors, self.laws, strict=True):
            reading = law.infer(_NumbersOf(name, known), reading)
        return reading


class _NumbersOf:
    """The parameters and states of one sensor among those of a model."""

    def __init__(self, sensor: str, known: Mapping[str, Expression]) -> None:
        self._sensor, self._known = sensor, known

    def parameter(self, name: str) -> Expression:
        """Return one of its numbers."""
        return self._known[f"{self._sensor}.{name}"]

    def memory(self, name: str) -> Expression:
        """Return one of its states."""
        return self._known[f"{self._sensor}.{name}"]


def reading_of(readings: Sequence[ReadingNames], signal: str) -> ReadingNames:
    """Return what a signal shows; one that is not the reading of a sensor shows itself.

    Parameters
    ----------
    readings
        Of a flat model.
    signal
        Full name.
    """
    return next((r for r in readings if r.signal == signal), ReadingNames(signal, signal))


def body_moved_by(bodies: Sequence[MovingBody], motion: str) -> MovingBody | None:
    """Return the body that has this motion, ``None`` if there is none.

    Parameters
    ----------
    bodies
        Of a flat model.
    motion
        Full name of an angle or a position.
    """
    return next((body for body in bodies if body.motion == motion), None)


def top_part(name: str) -> str:
    """Return the part of the assembly to which a hierarchical name belongs: names begin with it.

    Parameters
    ----------
    name
        Full name of a variable or of a part.
    """
    return name.partition(".")[0]


def moving_bodies(
    assembly: Assembly, states: Sequence[str], inputs: Sequence[str], signals: Sequence[str]
) -> tuple[MovingBody, ...]:
    """Return the bodies that have a motion of their own, in written order.

    Parameters
    ----------
    assembly
        As declared.
    states, inputs, signals
        Names in its model.
    """
    bodies = []
    for name, part in assembly.parts:
        if not isinstance(part, Body):
            continue
        motion, rate = (f"{name}.{own}" for own in part.motion_names)
        if motion not in states and motion not in inputs:
            continue  # a body at rest, or one that a gear leads
        drives = tuple(n for n in inputs if n.startswith(f"{name}.") and n not in (motion, rate))
        inertia = None
        if isinstance(part, Free):
            train = f"{name}.train_inertia"
            inertia = train if train in signals else f"{name}.{part.inertia_name}"
        bodies.append(MovingBody(name, part.domain, motion, rate, inertia, drives if inertia else ()))
    return tuple(bodies)


def springs_of(assembly: Assembly) -> tuple[SpringNames, ...]:
    """Return the ties that restore, in written order.

    Parameters
    ----------
    assembly
        As declared.
    """
    return tuple(
        SpringNames(
            name,
            part.element.domain,
            f"{name}.{part.element.domain.motion}",
            f"{name}.{part.element.domain.effort}",
            part.between,
            tuple(_cam(path, p) for path, p in walk(part.element, name) if isinstance(p, Through)),
        )
        for name, part in assembly.parts
        if isinstance(part, Tie) and part.element.restores
    )


def _cam(path: str, part: Through) -> CamNames:
    element, cam = f"{path}.{part.behind[0]}", f"{path}.cam"
    inner = part.behind[1].domain
    end = f"{cam}.last_angle" if "last_angle" in part.cam.parameters() else None
    return CamNames(
        name=cam,
        drive=path,
        angle=f"{path}.{part.domain.motion}",
        lever_arm=f"{cam}.lever_arm_now",
        element=element,
        extension=f"{element}.{inner.motion}",
        force=f"{element}.{inner.effort}",
        pretension=f"{path}.pretension",
        elements=f"{cam}.elements",
        last_angle=end,
    )


def readings_of(assembly: Assembly) -> tuple[ReadingNames, ...]:
    """Return what each sensor of an assembly shows, through which chain of sensors.

    Parameters
    ----------
    assembly
        As declared.
    """
    sensors, readings = assembly.sensors(), []
    for name in sensors:
        measured, chain = assembly.measured(f"{name}.reading")
        laws = tuple(sensors[each] for each in chain)
        readings.append(ReadingNames(f"{name}.reading", measured, chain, laws))
    return tuple(readings)
