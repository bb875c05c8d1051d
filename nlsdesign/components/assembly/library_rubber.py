"""Rubbers of the library in a deck: ``material = "..."`` in a piece stands for its laws and its strength.

Coils of a maker in an assembly: a row of a catalogue stands for the numbers of the declared coil.
"""

from __future__ import annotations

import tomllib
from collections.abc import Mapping
from dataclasses import replace
from typing import Any, NamedTuple

from ...foundation.deck import Deck, Written
from ...foundation.errors import ArrangementError, DeckError, NlsError, unknown_name
from ...foundation.quantity import Quantity
from ...foundation.rubber_library import Material, material
from ..core.element import Tie
from ..core.part_numbers import readings, templates
from ..materials.loss_tangent import Relaxation, relaxing_law_of
from ..materials.material_law import MaterialLaw, law_of
from ..materials.specimen import Specimen, specimen
from ..mechanics.coils import Coil
from .named_parts import Assembly
from .part_text import part_lines

MATERIAL, USING, LOSS = FIELDS = ("material", "using", "loss_tangent")
"""Fields of a piece of rubber that name what the library knows."""
_KNOWN = "library"


def with_library_rubber(deck: Deck, path: str, table: Mapping[str, Any]) -> dict[str, Any]:
    """Return the table of a piece with the laws and the strength of the rubber that it names.

    What stands in the table itself comes first: a number of its own, a law in a table of the same name (with
    a component it replaces the law of the library, without one it changes numbers of it), a further law.
    """
    own = {key: raw for key, raw in table.items() if key not in FIELDS}
    for key in (MATERIAL, USING):
        if key in table and not isinstance(table[key], str):
            raise DeckError(
                deck.place(f"{path}.{key}"), f"is {table[key]!r}, not a text",
                next_step='write the name of a rubber of `nlsdesign materials`, for instance "PMC-770"',
            )  # fmt: skip
    if MATERIAL not in table:
        key = next(key for key in FIELDS if key in table)
        rule = "belongs to a material of the library, and none is named"
        raise DeckError(deck.place(f"{path}.{key}"), rule, next_step='add material = "..."')
    try:
        law = _law(deck, path, table)
    except NlsError as error:
        raise error.at(deck.place(f"{path}.{MATERIAL}")) from None
    # The fields and tables of a piece of that rubber, as a deck has them, without its sizes.
    piece = specimen(rest_length=0.01, area=1e-4, section=None, strength=law.strength, **dict(law.members))
    tables = tomllib.loads("\n".join(part_lines("piece", piece)), parse_float=Written)["piece"]
    known = {key: raw for key, raw in tables.items() if key not in ("component", "rest_length", "area")}
    return _merged(known, own)


def _law(deck: Deck, path: str, table: Mapping[str, Any]) -> MaterialLaw:
    named, using = material(table[MATERIAL]), table.get(USING)
    if LOSS not in table:
        return law_of(named, using=using)
    if table[LOSS] == _KNOWN:
        return relaxing_law_of(named, using=using)
    if isinstance(table[LOSS], str):
        rule = f"is {table[LOSS]!r}, neither a number nor {_KNOWN!r}"
        step = f'write "{_KNOWN}" for what is known of the rubber, or a number with unit "1" and source'
        raise DeckError(LOSS, rule, next_step=step)
    return relaxing_law_of(named, using=using, loss_tangent=deck.number(f"{path}.{LOSS}", table[LOSS]).number)


def _merged(known: Mapping[str, Any], own: Mapping[str, Any]) -> dict[str, Any]:
    """Return the tables of the library with what stands in the deck put over them."""
    result = {**known, **own}
    for key in own.keys() & known.keys():
        law, other = known[key], own[key]
        is_law = isinstance(law, dict) and "component" in law and isinstance(other, dict)
        # Another component is another law, not other numbers of this one.
        if is_law and other.get("component", law["component"]) == law["component"]:
            result[key] = _merged(law, other)
    return result


def takes_material(kind: type) -> bool:
    """Tell whether a component can be made of a rubber of the library."""
    return issubclass(kind, Specimen)


def with_rubber(
    actuator: Assembly,
    material: Material,
    *,
    piece: str | None = None,
    using: str | None = None,
    loss_tangent: float | Relaxation | None = None,
) -> Assembly:
    """Return a copy whose rubber is one of the library: other laws and strength, the same sizes.

    Parameters
    ----------
    actuator
        With a piece of rubber.
    material
        Of the library, for instance ``material("Dragon_Skin_30")``.
    piece
        Path of the piece, for instance ``"spring.rubber"``; not needed where there is but one.
    using
        As for :func:`~nlsdesign.components.law_of`.
    loss_tangent
        If given, the rubber relaxes with it, as for :func:`~nlsdesign.components.relaxing_law_of`; what the
        library knows of it is ``loss_of(material)``.

    Raises
    ------
    ArrangementError
        If the assembly has no piece of rubber, or several and none is named, or if nothing that is known of
        the rubber gives an elastic law.
    UnknownNameError
        If there is no such piece.
    ValueRangeError
        If the loss tangent is not above 0 and at most 2.

    Examples
    --------
    >>> from nlsdesign.components import material
    >>> from nlsdesign.components.assembly.deck_writer import declare
    >>> from nlsdesign.foundation.deck import load_deck
    >>> published = declare(load_deck("austin2015_as_printed"))
    >>> softer = with_rubber(published, material("Dragon_Skin_30"))
    >>> [quantity.source[:24] for name, quantity in softer.quantities().items() if name.endswith("modulus")]
    ['fitted to Dragon_Skin_30']
    """
    inner = ((path, part.element if isinstance(part, Tie) else part) for path, part in actuator.walk())
    pieces = {path: part for path, part in inner if isinstance(part, Specimen)}
    if piece is not None and piece not in pieces:
        raise unknown_name("piece of rubber", piece, pieces)
    if piece is None and len(pieces) != 1:
        raise ArrangementError(
            f"assembly '{actuator.name}'",
            f"has {len(pieces)} pieces of rubber" if pieces else "has no piece of rubber",
            next_step=f"say piece='...', one of: {', '.join(pieces)}" if pieces
            else "declare one with specimen(...)",
        )  # fmt: skip
    path = piece or next(iter(pieces))
    law = (
        law_of(material, using=using)
        if loss_tangent is None
        else relaxing_law_of(material, loss_tangent=loss_tangent, using=using)
    )
    return actuator.with_part(path, law.in_place_of(pieces[path]))


class PlacedCoil(NamedTuple):
    """A coil of an assembly, with its path."""

    assembly: Assembly
    path: str
    coil: Coil

    @property
    def units(self) -> dict[str, str]:
        """Unit of each number that a coil of its kind can have, by name."""
        return {name: info.unit for name, info in type(self.coil).parameter_infos().items()}

    def number(self, name: str, listed: Quantity) -> Quantity:
        """Return a listed number with the spread of the one that it replaces."""
        declared = self.coil.parameters().get(name)
        return listed if declared is None else replace(listed, spread=declared.spread)

    def exchanged(self, numbers: Mapping[str, Quantity]) -> Assembly:
        """Return the assembly with another coil; what is not given stays as declared.

        ``numbers``: by name; those of a wire take the place of a stated rate, and a rate that of a wire;
        both at once are refused.
        """
        kind = type(self.coil)
        changes: dict[str, Any] = {name: numbers[name] for name in templates(kind) if name in numbers}
        for field, choices in readings(kind).items():
            now = getattr(self.coil, field)
            stated = [[name for name in templates(choice) if name in numbers] for choice in choices]
            if sum(map(bool, stated)) > 1:
                one, other = (names[0] for names in stated if names)
                raise ArrangementError(
                    f"{one} and {other}", "say the same twice",
                    next_step=f"leave out the column {one}, or those of the wire",
                )  # fmt: skip
            for choice in choices:
                given = {name: numbers[name] for name in templates(choice) if name in numbers}
                if given and isinstance(now, choice):
                    changes[field] = replace(now, **given)
                elif given and len(given) == len(templates(choice)):
                    changes[field] = choice(**given)
                elif given:
                    lacking = sorted(set(templates(choice)) - set(given))
                    raise ArrangementError(
                        f"{', '.join(given)}", f"says nothing without {', '.join(lacking)}",
                        next_step="add the columns, or leave these out",
                    )  # fmt: skip
        return self.assembly.with_part(self.path, replace(self.coil, **changes))


def placed_coil(assembly: Assembly, path: str | None = None) -> PlacedCoil:
    """Return the coil of an assembly; ``path`` where it has several."""
    coils = {at: part for at, part in assembly.walk() if isinstance(part, Coil)}
    if path is not None and path not in coils:
        raise unknown_name("coil", path, coils)
    if path is None and len(coils) != 1:
        raise ArrangementError(
            f"assembly '{assembly.name}'", f"has {len(coils)} coils" if coils else "has no coil",
            next_step="name one of them" if coils else "declare an ExtensionCoil or a CompressionCoil first",
        )  # fmt: skip
    at = path or next(iter(coils))
    return PlacedCoil(assembly, at, coils[at])
