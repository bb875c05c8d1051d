"""What the springs of a flat model are made of, by name: cams, cables, pieces of material."""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from dataclasses import dataclass

from ..components.assembly.named_parts import Assembly
from ..components.core.element import Domain, Tie
from ..components.core.part import Part, walk
from ..components.core.part_numbers import templates
from ..components.materials.specimen import Specimen, Strength
from ..components.transmission.cam import Cable, Cam
from ..components.transmission.cam_drive import Through
from ..components.transmission.capstan import CapstanFriction
from .owners import Owners, declared_by, number_names


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


@dataclass(frozen=True)
class CableNames:
    """The numbers of the cable of a cam, all parameters.

    Parameters
    ----------
    diameter, breaking_force
        Of the cable.
    bend_ratio
        Least diameter of a bend over the diameter of the cable.
    """

    diameter: str
    breaking_force: str
    bend_ratio: str


@dataclass(frozen=True)
class CamNames:
    """The names around one cam and what stands behind it.

    Parameters
    ----------
    name
        Path of the cam.
    drive
        Path of the part that holds cam and element.
    angle, torque, lever_arm
        Signals: angle and torque of the drive, lever arm at that angle.
    element
        Path of what is stretched.
    extension, force
        Signals of what is stretched.
    pretension, elements
        Parameters: extension at angle zero, number of equal elements.
    control_values
        Parameters that shape the lever arm; none for a wheel.
    anchor_distance, last_angle
        Parameters: distance of the anchor from the centre, where the contour ends; ``None`` for a cam
        without.
    numbers
        Parameters of the drive and the element that are single numbers and enter a law: no strength.
    states
        Inner states of the element.
    specimens
        The pieces of material in it.
    cable
        The declared cable; ``None`` where there is none.
    guides
        For each guide that bends its cable the parameters whose product is the exponent µφ of its friction.
    """

    name: str
    drive: str
    angle: str
    torque: str
    lever_arm: str
    element: str
    extension: str
    force: str
    pretension: str
    elements: str
    control_values: tuple[str, ...]
    anchor_distance: str | None
    last_angle: str | None
    numbers: tuple[str, ...]
    states: tuple[str, ...]
    specimens: tuple[SpecimenNames, ...]
    cable: CableNames | None = None
    guides: tuple[tuple[str, ...], ...] = ()


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
            for row in ("lever_arm", "support")
            if row in of_cam
            for name in number_names(cam, part.cam, row)
        ),
        anchor_distance=f"{cam}.anchor_distance" if "anchor_distance" in of_cam else None,
        last_angle=f"{cam}.last_angle" if "last_angle" in of_cam else None,
        numbers=tuple(_single_numbers({path: part, **pieces})),
        states=tuple(declared_by(pieces, owners.states)),
        specimens=tuple(_specimen(name, p) for name, p in pieces.items() if isinstance(p, Specimen)),
        cable=_cable(cam, part.cam),
        guides=tuple(_exponent(name, p) for name, p in pieces.items() if isinstance(p, CapstanFriction)),
    )


def _exponent(path: str, part: CapstanFriction) -> tuple[str, ...]:
    return tuple(f"{path}.{field}" for field in templates(type(part.guide)))


def _single_numbers(parts: Mapping[str, Part]) -> Iterator[str]:
    for path, part in parts.items():
        strength = templates(type(part.strength)) if isinstance(part, Specimen) else {}
        for field, given in part.parameters().items():
            if not isinstance(given.value, tuple) and field not in strength:
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
    )


def _cable(path: str, part: Cam) -> CableNames | None:
    if not isinstance(part.cable, Cable):
        return None
    return CableNames(f"{path}.cable_diameter", f"{path}.cable_breaking_force", f"{path}.cable_bend_ratio")
