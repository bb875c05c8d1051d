"""Where effects can sit: bodies, springs, pieces of material, what a cam stretches."""

from __future__ import annotations

from collections.abc import Callable, Iterator

from ....components import (
    Assembly,
    Buckling,
    CapstanFriction,
    Driven,
    Element,
    Gear,
    GearedMotor,
    InextensibleCable,
    Parallel,
    Part,
    PullOnly,
    Series,
    Slack,
    Specimen,
    Tie,
    parallel,
)
from ....components.core.domain import ROTATION, TRANSLATION, Domain
from ....components.core.springs import Elastic
from ....components.mechanics.bodies import Body, Free
from ....components.transmission.cam_drive import Through
from .effect import free_inside, wrapped


def law(part: Part) -> Part:
    """Return what a tie ties, and any other part itself."""
    return part.element if isinstance(part, Tie) else part


def laws(assembly: Assembly) -> Iterator[tuple[str, Part]]:
    """Yield path and law of every part."""
    return ((path, law(part)) for path, part in assembly.walk())


def gear_ratios(assembly: Assembly) -> Iterator[tuple[str, float]]:
    """Yield path and ratio of every gear and geared motor."""
    for path, part in laws(assembly):
        if isinstance(part, Gear):
            yield path, part.ratio.number
        elif isinstance(part, GearedMotor):
            yield path, part.gear_ratio.number


def _free(assembly: Assembly, domain: Domain) -> list[str]:
    return [n for n, p in assembly.parts if isinstance(p, Free) and p.domain == domain]


def turning_bodies(assembly: Assembly) -> list[str]:
    """Return the names of the bodies that turn freely."""
    return _free(assembly, ROTATION)


def sliding_bodies(assembly: Assembly) -> list[str]:
    """Return the names of the bodies that slide freely."""
    return _free(assembly, TRANSLATION)


def moving_bodies(assembly: Assembly) -> list[str]:
    """Return the names of the bodies that turn or slide freely."""
    return [*turning_bodies(assembly), *sliding_bodies(assembly)]


def domain_of(assembly: Assembly, body: str) -> Domain:
    """Return whether a body turns or slides."""
    part = assembly[body]
    assert isinstance(part, Body)
    return part.domain


def efforts_of_ties(assembly: Assembly, body: str) -> list[str]:
    """Return the names of the efforts that elements exert on a body."""
    ties = [(n, p) for n, p in assembly.parts if isinstance(p, Tie) and body in p.between]
    return [f"{name}.{part.element.domain.effort}" for name, part in ties]


def turns_per_turn(assembly: Assembly, body: str) -> list[float]:
    """Return how often shafts turn per turn of a body: itself, the motor in it, what is geared to it."""
    part, turns = assembly[body], [1.0]
    if isinstance(part, GearedMotor):
        turns.append(part.gear_ratio.number)
    for _, gear in assembly.parts:
        if isinstance(gear, Gear) and body in gear.between:
            ratio = abs(gear.ratio.number)
            turns.append(1.0 / ratio if gear.between[0] == body else ratio)
    return list(dict.fromkeys(turns))


def driven_ties(assembly: Assembly) -> list[str]:
    """Return the ties that a prescribed motion strains, with no body of their own motion at an end."""
    result = []
    for name, part in assembly.parts:
        if isinstance(part, Tie):
            ends = [assembly[end] for end in part.between]
            if any(isinstance(e, Driven) for e in ends) and not any(isinstance(e, Free) for e in ends):
                result.append(name)
    return result


def driving_end(assembly: Assembly, tie: str) -> str:
    """Return the name of the body whose motion strains a tie: the first that is driven or moves freely."""
    part = assembly[tie]
    assert isinstance(part, Tie)
    return next(end for end in part.between if isinstance(assembly[end], Driven | Free))


def restoring_ties(assembly: Assembly) -> list[str]:
    """Return the names of the ties that pull back, in whatever domain."""
    return [n for n, p in assembly.parts if isinstance(p, Tie) and p.element.restores]


def ties_between_bodies(assembly: Assembly) -> dict[str, tuple[str, ...]]:
    """Return the ties that pull back between two bodies that both move freely, with these bodies."""
    pairs = {name: assembly[name].between for name in restoring_ties(assembly)}  # type: ignore[attr-defined]
    return {
        name: ends
        for name, ends in pairs.items()
        if len(ends) == 2 and all(isinstance(assembly[end], Free) for end in ends)
    }


def loaded_ties(assembly: Assembly) -> list[str]:
    """Return the names of the ties whose load depends on where the body is: what pulls back, and weights.

    Friction in proportion to a load that never changes is Coulomb friction.
    """
    pulling = restoring_ties(assembly)
    return [
        n
        for n, p in assembly.parts
        if isinstance(p, Tie) and (n in pulling or "gravity" in p.element.phenomena)
    ]


def lumped_springs(assembly: Assembly) -> list[str]:
    """Return the paths of elastic laws of force or torque that are no piece of a material.

    What stands in series with something else, and what an effect has put beside a spring, is left out.
    """
    return [
        path
        for path, each in laws(assembly)
        if isinstance(each, Elastic)
        and each.domain in (TRANSLATION, ROTATION)
        and each.phenomena == {"elasticity"}
        and not isinstance(_holder(assembly, path), Series)
    ]


def lumped_springs_without(phenomenon: str) -> Callable[[Assembly], list[str]]:
    """Return the places of lumped springs with nothing beside them that has a phenomenon."""

    def places(assembly: Assembly) -> list[str]:
        return [
            path for path in lumped_springs(assembly) if phenomenon not in _phenomena_beside(assembly, path)
        ]

    return places


def _holder(assembly: Assembly, path: str) -> Part | None:
    owner = path.rpartition(".")[0]
    return law(assembly[owner]) if owner else None


def _phenomena_beside(assembly: Assembly, path: str) -> set[str]:
    """Return what the laws bring that share their motion with one at a path."""
    owner = path.rpartition(".")[0]
    if not isinstance(_holder(assembly, path), Parallel):
        return set()
    inside = (part for where, part in laws(assembly) if where.startswith(f"{owner}."))
    return {each for part in inside for each in part.phenomena}


def effort_over_motion(assembly: Assembly, path: str) -> tuple[str, str]:
    """Return the names of effort and motion of an element."""
    domain = assembly.element(path).domain
    return f"{path}.{domain.effort}", f"{path}.{domain.motion}"


def beside(assembly: Assembly, path: str, name: str, law: Element) -> tuple[Assembly, str]:
    """Return the assembly with a law that shares the motion of another, and the path of the new one.

    A law of stress in a piece of material, and one among laws in parallel, takes its place beside them; any
    other is put in parallel with the piece, and sensors that read it read both from now on.
    """
    piece = assembly.element(path)
    if isinstance(piece, Specimen) and law.domain != piece.domain:
        free = free_inside(piece, name)
        return assembly.with_part(f"{path}.{free}", law), f"{path}.{free}"
    owner, _, own = path.rpartition(".")
    outer = "both" if owner else own
    inner_name = own if owner else "declared"
    name = f"{name}_2" if name == inner_name else name

    def around(inner: str, element: Element) -> Element:
        return parallel(**{inner: element, name: law})

    edited = wrapped(assembly, path, outer if owner else inner_name, around, read_outside=True)
    return edited, f"{owner}.{outer}.{name}" if owner else f"{path}.{name}"


def turning_ties(assembly: Assembly, holds: Callable[[Part], bool]) -> list[str]:
    """Return the ties of angle and torque with something in them."""
    ties = [n for n, p in assembly.parts if isinstance(p, Tie) and p.element.domain == ROTATION]
    return [
        name
        for name in ties
        if any(holds(inner) for path, inner in laws(assembly) if f"{path}.".startswith(f"{name}."))
    ]


def stretched(assembly: Assembly) -> list[str]:
    """Return the paths of what a cam stretches: behind the cam, and inside a cable that only pulls."""
    around = PullOnly | Buckling | InextensibleCable | Slack | CapstanFriction
    paths = []
    for path, element in laws(assembly):
        if isinstance(element, Through):
            inner = f"{path}.{element.behind[0]}"
            while isinstance(assembly[inner], around) and len(assembly[inner].children()) == 1:
                inner = f"{inner}.{next(iter(assembly[inner].children()))}"
            paths.append(inner)
    return paths


def wrapping(kind: type[Element], **fields: object) -> Callable[[str, Element], Element]:
    """Return a function that puts an element of a name into a wrapper."""
    return lambda name, element: kind(members=((name, element),), **fields)  # type: ignore[call-arg]
