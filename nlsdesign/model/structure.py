"""What a flat model is made of, by name: bodies, springs with their cams and cables, readings.

Consumers ask here which variable is the speed of a body or the lever arm of a cam; nobody takes names apart.
"""

from __future__ import annotations

from collections.abc import Collection, Iterable, Iterator, Mapping, Sequence
from dataclasses import dataclass, replace

from ..components.assembly.named_parts import Assembly
from ..components.core.element import MATERIAL, Domain, Element, Tie
from ..components.core.part import Part, walk
from ..components.core.part_numbers import templates
from ..components.materials.specimen import Specimen, Strength, TensionSet
from ..components.mechanics.bodies import Body, Free, GearedMotor, Inertia, Mass
from ..components.mechanics.coils import INDEX, Coil, Winding
from ..components.mechanics.motor import ElectricMotor
from ..components.transmission.cam import Cable, Cam
from ..components.transmission.cam_drive import Through
from ..components.transmission.capstan import CapstanFriction
from ..components.transmission.roller_cam import RollerCam
from ..components.transmission.rolling_pair import RollingPair
from .gear_train import trains
from .readings import ReadingNames


@dataclass(frozen=True)
class Owners:
    """Which part declared a variable: path of the part by name of the variable, in order of declaration."""

    parameters: Mapping[str, str]
    states: Mapping[str, str]
    inputs: Mapping[str, str]
    signals: Mapping[str, str]

    def keeping(self, states: Collection[str], inputs: Collection[str]) -> Owners:
        """Return a copy with these states and inputs only."""
        return replace(
            self,
            states={name: path for name, path in self.states.items() if name in states},
            inputs={name: path for name, path in self.inputs.items() if name in inputs},
        )


def declared_by(paths: Collection[str], owned: Mapping[str, str]) -> Iterator[str]:
    """Yield the names of what some parts have declared."""
    return (name for name, path in owned.items() if path in paths)


def number_names(path: str, part: Part, field: str) -> list[str]:
    """Return the names that one field of a part has in the model: one, or one for each item of a row."""
    given, name = part.parameters()[field], f"{path}.{field}"
    if not isinstance(given.value, tuple):
        return [name]
    return [f"{name}[{number}]" for number in range(1, len(given.values) + 1)]


@dataclass(frozen=True)
class MotorNames:
    """The names around a motor."""

    command: str | None  # input: current, or wanted voltage. None where it is held at zero.
    # inertia, torque_constant, current_limit: parameters
    inertia: str
    torque_constant: str
    current_limit: str
    gear_ratio: str | None  # parameter; None for a motor without a gear of its own


@dataclass(frozen=True)
class MovingBody:
    """A body with a motion of its own."""

    name: str  # path of the body
    domain: Domain  # rotation or translation, with the units of motion, rate and effort
    # motion, rate: names of the two states, or of the two inputs where the motion is prescribed
    motion: str
    rate: str
    # inertia: name of the parameter or signal that says what is accelerated: with a gear train the inertia of
    # all that turns, seen from this body. None where the motion is prescribed.
    inertia: str | None
    # drives: names of the inputs that act on the body from outside, such as a current or a torque
    drives: tuple[str, ...]
    geared: tuple[str, ...] = ()  # names of the bodies that move with it through rigid gears
    motor: MotorNames | None = None  # the motor in it; None for a body without one
    # commands: names of the inputs and signals that command a drive in it, or in what is geared to it, such
    # as a voltage or current: whatever is not known of them was not zero. A load from outside is none.
    commands: tuple[str, ...] = ()
    goals: tuple[str, ...] = ()  # names of the inputs that controllers in it follow
    acting: tuple[str, ...] = ()  # names of the signals that are a command within the limits of its drive

    @property
    def acceleration(self) -> str:
        """Name of the signal of its acceleration; there is none where the motion is prescribed."""
        return f"{self.name}.acceleration"

    @property
    def prescribed(self) -> bool:
        """Whether the motion comes from outside."""
        return self.inertia is None


@dataclass(frozen=True)
class SpecimenNames:
    """The names around one piece of material."""

    name: str
    section: tuple[str, ...]
    rest_length: str
    strain: str
    force: str
    tensile_strength: str | None = None
    elongation_at_break: str | None = None
    tension_set: str | None = None


@dataclass(frozen=True)
class CoilNames:
    """The names around one coil."""

    name: str  # path of the coil
    extension: str  # signal of its motion, whose range is its travel
    free_length: str  # parameter
    # winding: parameters of its wire: diameter, mean diameter of the coils, their number and the shear
    # modulus; none where the rate is stated
    winding: tuple[str, ...]
    idle: tuple[str, ...]  # parameters that do not enter the law
    # shear_stress, tensile_strength, wire_volume: signals; None where the wire is not known well enough
    shear_stress: str | None
    tensile_strength: str | None
    wire_volume: str | None
    index_range: tuple[float, float] = INDEX  # least and greatest spring index that can be made


@dataclass(frozen=True)
class CableNames:
    """The numbers of the cable of a cam, all parameters."""

    diameter: str
    breaking_force: str
    bend_ratio: str  # least diameter of a bend over the diameter of the cable


@dataclass(frozen=True)
class RollingNames:
    """The numbers of what rolls on a cam, a roller or another cam, all parameters."""

    what: str  # in words
    base: str  # at angle zero distance of the roller's centre from the axis, or of the two pivots
    radius: str | None = None  # of the roller; None for a pair
    guide_friction: str | None = None  # coefficient of friction of its guide; None where it is not declared


@dataclass(frozen=True)
class CamNames:
    """The names around one cam and what stands behind it."""

    name: str  # path of the cam
    drive: str  # path of the part that holds cam and element
    # angle, torque, lever_arm: signals: angle and torque of the drive, lever arm at that angle
    angle: str
    torque: str
    lever_arm: str
    element: str  # path of what is stretched
    # extension, force: signals of what is stretched
    extension: str
    force: str
    # pretension, elements: parameters: extension at angle zero, number of equal elements
    pretension: str
    elements: str
    control_values: tuple[str, ...]  # parameters that shape the lever arm; none for a wheel
    # anchor_distance, last_angle: parameters: distance of the anchor from the centre, where the contour ends;
    # None for a cam without
    anchor_distance: str | None
    last_angle: str | None
    # numbers: parameters of the drive and the element that are single numbers and enter a law: no strength
    numbers: tuple[str, ...]
    states: tuple[str, ...]  # inner states of the element
    specimens: tuple[SpecimenNames, ...]  # the pieces of material in it
    cable: CableNames | None = None  # the declared cable; None where there is none
    # guides: for each guide that bends its cable the parameters whose product is the exponent µφ of its
    # friction
    guides: tuple[tuple[str, ...], ...] = ()
    coils: tuple[CoilNames, ...] = ()  # the coils in it
    rolling: RollingNames | None = None  # what rolls on the cam; None for a cam with a cable
    # back_last_angle: parameter: where the contour for negative angles ends; None where it is no other one
    back_last_angle: str | None = None

    @property
    def contour(self) -> str:
        """Name by which a design frees the contour; the name of the lever arm means the same."""
        return f"{self.name}.contour"

    @property
    def lengths(self) -> tuple[str, ...]:
        """Parameters: length without load of each piece of material and each coil."""
        return (*(piece.rest_length for piece in self.specimens), *(coil.free_length for coil in self.coils))

    @property
    def sizes(self) -> tuple[str, ...]:
        """Parameters that a designer may free besides the contour: pretension, sections, lengths, wire."""
        pieces = [name for piece in self.specimens for name in (*piece.section, piece.rest_length)]
        coils = [name for coil in self.coils for name in coil.winding[:3]]
        anchor = [] if self.anchor_distance is None else [self.anchor_distance]
        return tuple(dict.fromkeys([self.pretension, *pieces, *coils, *anchor]))


@dataclass(frozen=True)
class SpringNames:
    """A tie that restores: what lies between two bodies and is elastic."""

    name: str
    domain: Domain
    motion: str
    effort: str
    between: tuple[str, ...]
    cams: tuple[CamNames, ...]
    parameters: tuple[str, ...] = ()
    states: tuple[str, ...] = ()


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
        train = (name, *geared.get(name, ()))
        commands, goals = _commands(assembly, train)
        acting = tuple(f"{n}.{p.acting}" for n in train if isinstance(p := assembly[n], Free) and p.acting)
        bodies.append(
            MovingBody(
                name, part.domain, motion, rate, inertia, drives, train[1:], motor, commands, goals, acting
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


def springs_of(assembly: Assembly, owners: Owners) -> tuple[SpringNames, ...]:
    """Return the ties that restore, in written order."""
    springs = []
    for name, part in assembly.parts:
        if not isinstance(part, Tie) or not part.element.restores:
            continue
        inside, domain = [path for path, _ in walk(part, name)], part.element.domain
        drives = [(path, p) for path, p in walk(part.element, name) if isinstance(p, Through)]
        springs.append(
            SpringNames(
                name=name,
                domain=domain,
                motion=f"{name}.{domain.motion}",
                effort=f"{name}.{domain.effort}",
                between=part.between,
                cams=tuple(_cam(path, drive, owners) for path, drive in drives),
                parameters=tuple(declared_by(inside, owners.parameters)),
                states=tuple(declared_by(inside, owners.states)),
            )
        )
    return tuple(springs)


def _cam(path: str, part: Through, owners: Owners) -> CamNames:
    (own, behind), cam = part.behind, f"{path}.cam"
    element, inner, of_cam = f"{path}.{own}", behind.domain, part.cam.parameters()
    pieces = dict(walk(behind, element))
    rolling = None
    if isinstance(part.cam, RollerCam):
        friction = f"{cam}.guide_friction" if part.cam.needs_rate else None
        rolling = RollingNames("a roller", f"{cam}.{part.cam.base}", f"{cam}.roller_radius", friction)
    if isinstance(part.cam, RollingPair):
        rolling = RollingNames("another cam that rolls on it", f"{cam}.{part.cam.base}")
    return CamNames(
        name=cam,
        drive=path,
        angle=f"{path}.{part.domain.motion}",
        torque=f"{path}.{part.domain.effort}",
        lever_arm=f"{cam}.lever_arm_now",
        element=element,
        extension=f"{element}.{inner.motion}",
        force=f"{element}.{inner.effort}",
        pretension=f"{path}.pretension",
        elements=f"{cam}.elements",
        control_values=tuple(
            name
            for row in ("lever_arm", "back_lever_arm", "support")
            if row in of_cam
            for name in number_names(cam, part.cam, row)
        ),
        anchor_distance=f"{cam}.anchor_distance" if "anchor_distance" in of_cam else None,
        last_angle=f"{cam}.last_angle" if "last_angle" in of_cam else None,
        numbers=tuple(_single_numbers({path: part, **pieces})),
        states=tuple(declared_by(pieces, owners.states)),
        specimens=tuple(_specimen(name, p) for name, p in pieces.items() if isinstance(p, Specimen)),
        cable=_cable(cam, part.cam),
        guides=tuple(
            tuple(f"{name}.{field}" for field in templates(type(p.guide)))
            for name, p in pieces.items()
            if isinstance(p, CapstanFriction)
        ),
        coils=tuple(_coil(name, p) for name, p in pieces.items() if isinstance(p, Coil)),
        rolling=rolling,
        back_last_angle=f"{cam}.back_last_angle" if "back_last_angle" in of_cam else None,
    )


def _single_numbers(parts: Mapping[str, Part]) -> Iterator[str]:
    for path, part in parts.items():
        beside = (part.strength, part.lasting) if isinstance(part, Specimen) else ()
        idle: Collection[str] = [name for reading in beside for name in templates(type(reading))]
        idle = part.of_no_law() if isinstance(part, Coil) else idle
        for field, given in part.parameters().items():
            if not isinstance(given.value, tuple) and field not in idle:
                yield from number_names(path, part, field)


def _specimen(path: str, part: Specimen) -> SpecimenNames:
    declared = isinstance(part.strength, Strength)
    return SpecimenNames(
        name=path,
        section=tuple(f"{path}.{field}" for field in templates(type(part.section))),
        rest_length=f"{path}.rest_length",
        strain=f"{path}.strain",
        force=f"{path}.{part.domain.effort}",
        tensile_strength=f"{path}.tensile_strength" if declared else None,
        elongation_at_break=f"{path}.elongation_at_break" if declared else None,
        tension_set=f"{path}.tension_set" if isinstance(part.lasting, TensionSet) else None,
    )


def _coil(path: str, part: Coil) -> CoilNames:
    wire = templates(Winding) if isinstance(part.winding, Winding) else ()
    named = {name: f"{path}.{name}" for name in part.signals()}
    return CoilNames(
        name=path,
        extension=f"{path}.{part.domain.motion}",
        free_length=f"{path}.free_length",
        winding=tuple(f"{path}.{field}" for field in wire),
        idle=tuple(f"{path}.{field}" for field in part.of_no_law()),
        shear_stress=named.get("shear_stress"),
        tensile_strength=named.get("tensile_strength"),
        wire_volume=named.get("wire_volume"),
    )


def _cable(path: str, part: Cam) -> CableNames | None:
    if not isinstance(part.cable, Cable):
        return None
    return CableNames(f"{path}.cable_diameter", f"{path}.cable_breaking_force", f"{path}.cable_bend_ratio")
