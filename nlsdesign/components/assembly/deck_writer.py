"""Assemblies from decks and decks from assemblies; a deck declares parts, ties and numbers."""

from __future__ import annotations

import hashlib
from collections.abc import Mapping
from pathlib import Path
from typing import Any

from ...foundation.deck import Deck, ParentDeck
from ...foundation.errors import DeckError, NlsError, nearest
from ...foundation.quantity import Quantity
from ...foundation.text_files import write_text
from ..core.element import Element, Tie
from ..core.part import Part
from ..mechanics.gear import Transmission
from ..sensing.sensors import Sensor
from .deck_reader import Builder
from .named_parts import Assembly, arrangement_problems, source_problems
from .part_text import part_lines, text_of


def deck_problems(deck: Deck) -> list[NlsError]:
    """Return all problems of a deck, each with file, line and column."""
    return _declared(deck)[1]


def declare(deck: Deck) -> Assembly:
    """Return the assembly that a deck declares.

    Parameters
    ----------
    deck
        As read by ``load_deck``.

    Raises
    ------
    NlsError
        The first problem; ``deck_problems`` gives all.
    """
    declared, problems = _declared(deck)
    if declared is None:
        raise problems[0]
    return declared


def _declared(deck: Deck) -> tuple[Assembly | None, list[NlsError]]:
    builder = Builder(deck)
    parent = builder.head()
    parts: dict[str, Part | None] = {}
    for name, table in deck.tables.items():
        if not isinstance(table, dict):
            step = "put it into a table such as [motor]"
            builder.problems.append(DeckError(deck.place(name), "stands outside of any part", next_step=step))
            continue
        part = builder.part(name, table)
        is_tied = issubclass(builder.class_of(name) or Part, Element)
        parts[name] = builder.tied(name, part, table) if is_tied else part
    complete = tuple((name, part) for name, part in parts.items() if part is not None)
    unreadable = [name for name, part in parts.items() if part is None]
    for name, error in (*arrangement_problems(complete, unreadable), *source_problems(complete, unreadable)):
        field = next((f for f in (f"{name}.between", f"{name}.of") if f in deck.places), name)
        builder.problems.append(error.at(deck.place(field)))
    if builder.problems:
        return None, builder.problems
    try:
        return Assembly(deck.name, complete, deck.description, parent), []
    except NlsError as error:
        return None, [error.at(deck.place("deck"))]


def deck_text(assembly: Assembly) -> str:
    """Return an assembly as the text of a deck."""
    lines = ["[deck]", f"name = {text_of(assembly.name)}", f"description = {text_of(assembly.description)}"]
    if assembly.parent:
        lines.append(f"parent = {_parent(assembly.parent)}")
    return "\n".join([*lines, *_parts_lines(assembly, {})]) + "\n"


def deck_digest(assembly: Assembly, changed: Mapping[str, Quantity] | None = None) -> str:
    """Return the SHA-256 of the parts of an assembly as a deck writes them, 64 hexadecimal digits.

    Every number, unit, source, spread and the arrangement count; the table ``[deck]``, with name, description
    and parent, does not: the same machine under another name has the same digest. Comments and the order of
    the fields of a part do not count either. The order of parts does, for it is the order of the variables.
    """
    lines = _parts_lines(assembly, changed or {})
    return hashlib.sha256(("\n".join(lines) + "\n").encode()).hexdigest()


def _parts_lines(assembly: Assembly, changed: Mapping[str, Quantity]) -> list[str]:
    lines: list[str] = []
    for name, part in assembly.parts:
        if isinstance(part, Tie | Transmission):
            ends = ", ".join(text_of(end) for end in part.between)
            inner = part.element if isinstance(part, Tie) else part
            structure = [f"between = [{ends}]"]
            lines += part_lines(name, inner, structure=structure, changed=changed)
        else:
            of = [f"of = {text_of(part.of)}"] if isinstance(part, Sensor) else []
            lines += part_lines(name, part, structure=of, changed=changed)
    return lines


def _parent(parent: ParentDeck) -> str:
    """Return the deck before this one, and those before it, as an inline table."""
    fields = {"name": parent.name, "digest": parent.digest, "change": parent.change}
    items = [f"{key} = {text_of(text)}" for key, text in fields.items() if text]
    items += [f"parent = {_parent(parent.parent)}"] if parent.parent else []
    return "{" + ", ".join(items) + "}"


def write_deck(assembly: Assembly, path: Path) -> None:
    """Write an assembly as a deck; the file appears whole or not at all.

    Parameters
    ----------
    assembly
        Parts.
    path
        File to write.
    """
    write_text(path, deck_text(assembly))


def numbers_of(deck: Deck, path: str, kind: type[Part]) -> dict[str, Any]:
    """Return the numbers and readings that stand directly in one table of a deck, by field name."""
    table: Any = deck.tables
    for step in path.split("."):
        table = table.get(step) if isinstance(table, dict) else None
    if not isinstance(table, dict) or table.get("component") != kind.__name__:
        rule = f"this model has a {kind.__name__} here"
        raise DeckError(
            deck.place(path), rule, next_step="use declare(deck), which takes any deck as it stands"
        )
    builder = Builder(deck)
    quantities = builder.fields(path, table, kind)
    if builder.problems:
        raise builder.problems[0]
    return quantities


def require_same_numbers(assembly: Assembly, deck: Deck) -> Assembly:
    """Return the assembly if it has used every number of the deck."""
    for name in deck.numbers():
        if name not in assembly.quantities():
            raise DeckError(
                deck.place(name), f"the model {assembly.name} does not have this number",
                did_you_mean=nearest(name, assembly.quantities()),
                next_step="use declare(deck), which takes any deck as it stands",
            )  # fmt: skip
    return assembly
