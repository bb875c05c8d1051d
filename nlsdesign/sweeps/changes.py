"""The assembly behind a point: a deck, other rubbers, other numbers."""

from __future__ import annotations

import re
from collections.abc import Mapping
from typing import Any, Final

from ..components import material, with_rubber
from ..components.assembly.named_parts import Assembly
from ..components.core.element import Tie
from ..components.materials.specimen import Specimen
from ..foundation.errors import unknown_name

DECK: Final = "deck"
"""Name of the axis whose words are decks."""
ASK: Final = "ask"
"""First word of the names of what the question itself holds."""

_MOST_KEPT: Final = 64
_kept: dict[tuple[int, str, str], tuple[Assembly, Assembly]] = {}


def pieces_of_rubber(assembly: Assembly) -> tuple[str, ...]:
    """Return the paths of the pieces of rubber of an assembly."""
    inner = ((path, part.element if isinstance(part, Tie) else part) for path, part in assembly.walk())
    return tuple(path for path, part in inner if isinstance(part, Specimen))


def changed_assembly(bases: Mapping[str, Assembly], values: Mapping[str, Any]) -> Assembly:
    """Return the assembly of a point; what begins with ``ask.`` belongs to the question.

    The deck comes first, then rubbers, then numbers, so that a number that is swept is not undone by a
    rubber that brings its own.

    ``bases``: assemblies by the name of their deck; the first is taken where no axis names a deck.
    """
    name = str(values.get(DECK, next(iter(bases))))
    if name not in bases:
        raise unknown_name("deck of the sweep", name, bases)
    made = bases[name]
    pieces = pieces_of_rubber(made)
    numbers: dict[str, float | tuple[float, ...]] = {}
    for name, value in values.items():
        if name == DECK or name.startswith(f"{ASK}."):
            continue
        if isinstance(value, str):
            if name not in pieces:
                raise unknown_name("piece of rubber", name, pieces)
            # The assembly with another rubber; kept, since the fit of its law takes long.
            key = (id(made), name, value)
            if key not in _kept:
                while len(_kept) >= _MOST_KEPT:
                    _kept.pop(next(iter(_kept)))
                # The base is kept beside it, so that its number stands for nothing else.
                _kept[key] = made, with_rubber(made, material(value), piece=name)
            made = _kept[key][1]
    known = made.quantities()
    for name, value in values.items():
        row = row_of_factor(name)
        if row is not None:
            if row not in known:
                raise unknown_name("parameter", row, known)
            scaled = tuple(float(value) * each for each in known[row].values)
            numbers[row] = scaled if isinstance(known[row].value, tuple) else scaled[0]
        elif not isinstance(value, str) and not name.startswith(f"{ASK}."):
            numbers[name] = float(value)
    return made.with_values(numbers) if numbers else made


def row_of_factor(name: str) -> str | None:
    """Return the name within ``factor(NAME)``, which stands for all numbers of a row times one factor."""
    inside = re.fullmatch(r"factor\((.+)\)", name)
    return inside[1] if inside else None
