"""Effects of bodies that slide: dry friction, a constant force."""

from __future__ import annotations

from collections.abc import Sequence

from ...components import Assembly, ConstantForce, Element, SlidingFriction, Tie, tie
from ...components.core.element import TRANSLATION
from ...components.mechanics.bodies import Free
from ...quantity import Quantity
from .candidate import SOURCE, Candidate, Unknown, free_name


def _sliding(assembly: Assembly, kind: type[Element]) -> list[str]:
    """Return the bodies that slide freely and have no element of a kind yet."""
    bodies = [n for n, p in assembly.parts if isinstance(p, Free) and p.domain == TRANSLATION]
    taken = [
        b for _, p in assembly.parts if isinstance(p, Tie) and isinstance(p.element, kind) for b in p.between
    ]
    return [b for b in bodies if b not in taken]


def sliding_friction(assembly: Assembly) -> Sequence[Candidate]:
    """Dry friction on a freely sliding body; the same effect as on a turning one.

    Parameters
    ----------
    assembly
        As declared; a body that has dry friction already is left out.
    """
    found = []
    for body in _sliding(assembly, SlidingFriction):
        part = free_name(assembly, "dry_friction")
        element = SlidingFriction(sliding_force=Quantity(1.0, "N", SOURCE))
        found.append(
            Candidate(
                "coulomb_friction",
                body,
                assembly.with_part(part, tie(element, body)),
                (Unknown(f"{part}.sliding_force", (10.0,), 1e-3, 1e4),),
                "a constant force against the motion, that jumps where the speed changes sign",
                "Coulomb 1785; Armstrong-Hélouvry 1991",
            )
        )
    return found


def constant_force(assembly: Assembly) -> Sequence[Candidate]:
    """A force that never changes on a freely sliding body: an offset of the drive, a weight.

    Parameters
    ----------
    assembly
        As declared; a body that has one already is left out.
    """
    found = []
    for body in _sliding(assembly, ConstantForce):
        part = free_name(assembly, "offset")
        element = ConstantForce(load=Quantity(0.0, "N", SOURCE))
        found.append(
            Candidate(
                "constant_force",
                body,
                assembly.with_part(part, tie(element, body)),
                (Unknown(f"{part}.load", (0.0,), -1e3, 1e3),),
                "a force that is the same forward and backward, at any speed and place",
                "Janot et al. 2019",
            )
        )
    return found
