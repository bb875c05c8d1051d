"""The assembly behind a point: a deck, other rubbers, other numbers."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

from ..components import material, with_rubber
from ..components.assembly.named_parts import Assembly
from ..components.core.tie import Tie
from ..components.materials.specimen import Specimen
from ..errors import unknown_name

DECK = "deck"
"""Name of the axis whose words are decks."""


def pieces_of_rubber(assembly: Assembly) -> tuple[str, ...]:
    """Return the paths of the pieces of rubber of an assembly.

    Parameters
    ----------
    assembly
        To look through.
    """
    inner = ((path, part.element if isinstance(part, Tie) else part) for path, part in assembly.walk())
    return tuple(path for path, part in inner if isinstance(part, Specimen))


def changed_assembly(bases: Mapping[str, Assembly], values: Mapping[str, Any]) -> Assembly:
    """Return the assembly of a point; what names no part of the assembly belongs to the question.

    The deck comes first, then rubbers, then numbers, so that a number that is swept is not undone by a
    rubber that brings its own.

    Parameters
    ----------
    bases
        Assemblies by the name of their deck; the first is taken where no axis names a deck.
    values
        Numbers in SI and words by the name of their axis.

    Raises
    ------
    UnknownNameError
        If there is no such deck or material.
    NlsError
        If a number or a rubber is refused by the part that it belongs to.
    """
    name = str(values.get(DECK, next(iter(bases))))
    if name not in bases:
        raise unknown_name("deck of the sweep", name, bases)
    made = bases[name]
    for path in pieces_of_rubber(made):
        if path in values:
            made = with_rubber(made, material(str(values[path])), piece=path)
    known = made.quantities()
    numbers = {name: float(value) for name, value in values.items() if name.partition("[")[0] in known}
    return made.with_values(numbers) if numbers else made
