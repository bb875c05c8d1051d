"""Effects of a piece of rubber at large stretch: relaxation, and that it buckles instead of pushing."""

from __future__ import annotations

from collections.abc import Sequence

from ...components import Assembly, FlowingChains, Hyperelastic, PullOnly, Specimen, Tie
from ...quantity import Quantity
from .candidate import SOURCE, Candidate, Unknown

_MOST_BRANCHES = 3
_STARTS = {1: ((3e4, 3e5, 3e6),), 2: ((3e4, 3e5), (3e6,))}
"""Viscosities in Pa·s where fits begin, by the number of branches: from quick to slow."""


def large_strain_relaxation(assembly: Assembly) -> Sequence[Candidate]:
    """One or two more relaxing branches at large stretch in a piece of material.

    The same effect as relaxation at small strain. Two at once are a hypothesis of their own: what one time
    constant leaves over is small beside what it explains, however plain it is.

    Parameters
    ----------
    assembly
        As declared; only pieces whose equilibrium law is one of large stretch are looked at.
    """
    found = []
    for path, part in assembly.walk():
        piece = part.element if isinstance(part, Tie) else part
        if not isinstance(piece, Specimen):
            continue
        if not any(isinstance(law, Hyperelastic) for _, law in piece.members):
            continue
        names = [f"{path}.flowing_{n}" for n in range(1, _MOST_BRANCHES + 1)]
        left = [n for n in names if n.rpartition(".")[2] not in piece.children()]
        found += [_relaxing(assembly, path, left[:count]) for count in _STARTS if count <= len(left)]
    return found


def _relaxing(assembly: Assembly, path: str, names: Sequence[str]) -> Candidate:
    law = FlowingChains(shear_modulus=Quantity(1e5, "Pa", SOURCE), viscosity=Quantity(1e6, "Pa*s", SOURCE))
    edited, unknowns = assembly, []
    for name, starts in zip(names, _STARTS[len(names)], strict=True):
        edited = edited.with_part(name, law)
        unknowns += [
            Unknown(f"{name}.shear_modulus", (3e4,), 1e2, 1e9),
            Unknown(f"{name}.viscosity", starts, 1e1, 1e12),
        ]
    return Candidate(
        "second_relaxation",
        path,
        edited,
        tuple(unknowns),
        "force that creeps towards rest with a time constant of its own, less so the further stretched",
        "Green and Tobolsky 1946; Reese and Govindjee 1998",
    )


def buckling(assembly: Assembly) -> Sequence[Candidate]:
    """A piece of material between two bodies that goes slack instead of pushing.

    Parameters
    ----------
    assembly
        As declared; a piece behind a cable that only pulls is left out.
    """
    found = []
    for name, part in assembly.parts:
        if not isinstance(part, Tie) or not isinstance(part.element, Specimen):
            continue
        # A sensor of the force between the bodies goes on reading that, not what the piece would push.
        pulled = PullOnly(members=(("piece", part.element),), width=Quantity(1e-3, "N", SOURCE))
        found.append(
            Candidate(
                "cable_slack",
                name,
                assembly.with_part(name, pulled),
                (Unknown(f"{name}.width", (0.01,), 1e-4, 0.2, f"{name}.force"),),
                "no force on the way back from where the memory of the piece would have to push",
                "geometry",
            )
        )
    return found
