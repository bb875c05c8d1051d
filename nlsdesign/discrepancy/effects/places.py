"""Where effects can sit: bodies, springs, pieces of material, what a cam stretches."""

from __future__ import annotations

from collections.abc import Callable, Iterator

from ...components import Assembly, CapstanFriction, Element, InextensibleCable, Part, PullOnly, Slack, Tie
from ...components.core.domain import ROTATION, TRANSLATION, Domain
from ...components.mechanics.bodies import Free
from ...components.transmission.cam_drive import Through


def law(part: Part) -> Part:
    """Return what a tie ties, and any other part itself.

    Parameters
    ----------
    part
        Of an assembly.
    """
    return part.element if isinstance(part, Tie) else part


def laws(assembly: Assembly) -> Iterator[tuple[str, Part]]:
    """Yield path and law of every part.

    Parameters
    ----------
    assembly
        As declared.
    """
    return ((path, law(part)) for path, part in assembly.walk())


def _free(assembly: Assembly, domain: Domain) -> list[str]:
    return [n for n, p in assembly.parts if isinstance(p, Free) and p.domain == domain]


def turning_bodies(assembly: Assembly) -> list[str]:
    """Return the names of the bodies that turn freely.

    Parameters
    ----------
    assembly
        As declared.
    """
    return _free(assembly, ROTATION)


def sliding_bodies(assembly: Assembly) -> list[str]:
    """Return the names of the bodies that slide freely.

    Parameters
    ----------
    assembly
        As declared.
    """
    return _free(assembly, TRANSLATION)


def typical_torque(assembly: Assembly, body: str) -> str:
    """Return the name of a torque that is typical of a body: that of the first tie on it.

    Parameters
    ----------
    assembly
        As declared.
    body
        Name.
    """
    ties = [n for n, p in assembly.parts if isinstance(p, Tie) and body in p.between]
    return f"{ties[0]}.torque" if ties else ""


def turning_ties(assembly: Assembly, holds: Callable[[Part], bool]) -> list[str]:
    """Return the ties of angle and torque with something in them.

    Parameters
    ----------
    assembly
        As declared.
    holds
        Tells of the law of each part in a tie whether it is what is looked for.
    """
    ties = [n for n, p in assembly.parts if isinstance(p, Tie) and p.element.domain == ROTATION]
    return [
        name
        for name in ties
        if any(holds(inner) for path, inner in laws(assembly) if f"{path}.".startswith(f"{name}."))
    ]


def stretched(assembly: Assembly) -> list[str]:
    """Return the paths of what a cam stretches: behind the cam, and inside a cable that only pulls.

    Parameters
    ----------
    assembly
        As declared.
    """
    around = PullOnly | InextensibleCable | Slack | CapstanFriction
    paths = []
    for path, element in laws(assembly):
        if isinstance(element, Through):
            inner = f"{path}.{element.behind[0]}"
            while isinstance(assembly[inner], around) and len(assembly[inner].children()) == 1:
                inner = f"{inner}.{next(iter(assembly[inner].children()))}"
            paths.append(inner)
    return paths


def wrapping(kind: type[Element], **fields: object) -> Callable[[str, Element], Element]:
    """Return a function that puts an element of a name into a wrapper.

    Parameters
    ----------
    kind
        Of the wrapper.
    **fields
        Of the wrapper, without its members.
    """
    return lambda name, element: kind(members=((name, element),), **fields)  # type: ignore[call-arg]
