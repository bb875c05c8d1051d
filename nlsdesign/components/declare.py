"""Decks to assemblies and back. A deck declares everything: parts, ties, numbers."""

from __future__ import annotations

import dataclasses
from collections.abc import Mapping
from pathlib import Path
from typing import Any

from .. import components
from ..deck import Deck, write_text
from ..errors import DeckError, NlsError, nearest
from ..quantity import Quantity, parse_unit
from .assembly import Assembly
from .element import Combination, Element
from .networks import Through
from .part import Part
from .sensors import Sensor
from .tie import Tie

_STRUCTURE = ("component", "between", "of")


def component_classes() -> dict[str, type[Part]]:
    """Return the components that a deck can name, by name."""
    everything = (getattr(components, name) for name in components.__all__)
    kinds = [c for c in everything if isinstance(c, type) and issubclass(c, Part)]
    return {
        c.__name__: c for c in kinds if not getattr(c, "__abstractmethods__", None) and c not in (Part, Tie)
    }


class _Builder:
    """Builds parts from tables and collects everything that is wrong on the way."""

    def __init__(self, deck: Deck) -> None:
        self.deck = deck
        self.problems: list[NlsError] = []
        self.classes = component_classes()

    def part(self, path: str, table: Mapping[str, Any]) -> Part | None:
        kind = self._kind(path, table)
        if kind is None:
            return None
        infos = kind.parameter_infos()
        fields: dict[str, Any] = {}
        children: dict[str, Part] = {}
        for key, raw in table.items():
            if key in _STRUCTURE:
                continue
            if isinstance(raw, dict) and "component" in raw:
                child = self.part(f"{path}.{key}", raw)
                children |= {} if child is None else {key: child}
            elif key in infos:
                self._number(f"{path}.{key}", raw, infos[key], fields, key)
            else:
                self._unknown_field(f"{path}.{key}", key, kind)
        return self._made(path, kind, fields, children, table)

    def _kind(self, path: str, table: Mapping[str, Any]) -> type[Part] | None:
        where, name = self.deck.place(f"{path}.component"), table.get("component")
        if not isinstance(name, str):
            self.problems.append(
                DeckError(where, "is missing", next_step='add component = "..." to the table')
            )
            return None
        if name not in self.classes:
            self.problems.append(
                DeckError(where, f"'{name}' is not a component", did_you_mean=nearest(name, self.classes),
                          next_step=f"use one of: {', '.join(sorted(self.classes))}")
            )  # fmt: skip
            return None
        return self.classes[name]

    def _number(self, full: str, raw: object, info: Any, fields: dict[str, Any], key: str) -> None:
        try:
            fields[key] = info.checked(key, self.deck.number(full, raw))
        except NlsError as error:
            located = error.thing.startswith(self.deck.path.name)
            self.problems.append(error if located else error.at(self.deck.place(full)))

    def _unknown_field(self, full: str, key: str, kind: type[Part]) -> None:
        valid = [*kind.parameter_infos(), *_STRUCTURE]
        step = f"fields are: {', '.join(kind.parameter_infos())}"
        rule = f"{kind.__name__} has no field '{key}'"
        self.problems.append(
            DeckError(self.deck.place(full), rule, did_you_mean=nearest(key, valid), next_step=step)
        )

    def _made(
        self,
        path: str,
        kind: type[Part],
        fields: dict[str, Any],
        children: dict[str, Part],
        table: Mapping[str, Any],
    ) -> Part | None:
        needed = [f.name for f in dataclasses.fields(kind) if f.name in kind.parameter_infos()
                  and f.default is dataclasses.MISSING and f.name not in table]  # fmt: skip
        if needed:
            unit = kind.parameter_infos()[needed[0]].unit
            example = f'add {needed[0]} = {{value = ..., unit = "{unit}", source = "..."}}'
            rule = f"{kind.__name__} needs '{needed[0]}'"
            self.problems.append(DeckError(self.deck.place(path), rule, next_step=example))
        if self.problems:
            return None
        try:
            if issubclass(kind, Combination):
                fields["members"] = tuple(children.items())
            elif issubclass(kind, Through):
                behind = [pair for pair in children.items() if pair[0] != "cam"]
                if "cam" not in children or len(behind) != 1:
                    raise DeckError("Through", "needs a table 'cam' and one table for the element behind it")
                fields |= {"cam": children["cam"], "behind": behind[0]}
            elif issubclass(kind, Sensor):
                fields["of"] = str(table.get("of", ""))
            return kind(**fields)
        except NlsError as error:
            self.problems.append(error.at(self.deck.place(path)))
            return None


def deck_problems(deck: Deck) -> list[NlsError]:
    """Return everything that is wrong with a deck, each with file, line and column.

    Parameters
    ----------
    deck
        As read.
    """
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
    found, problems = _declared(deck)
    if found is None:
        raise problems[0]
    return found


def _declared(deck: Deck) -> tuple[Assembly | None, list[NlsError]]:
    builder = _Builder(deck)
    parts: list[tuple[str, Part]] = []
    for name, table in deck.tables.items():
        if not isinstance(table, dict):
            builder.problems.append(DeckError(deck.place(name), "stands outside of any part",
                                              next_step="put it into a table such as [motor]"))  # fmt: skip
            continue
        before = list(builder.problems)
        builder.problems = []
        part = builder.part(name, table)
        builder.problems = before + builder.problems
        if isinstance(part, Element):
            part = Tie(element=part, between=tuple(table.get("between", ())))
        if part is not None:
            parts.append((name, part))
    if builder.problems:
        return None, builder.problems
    try:
        return Assembly(deck.name, tuple(parts), deck.description), []
    except NlsError as error:
        return None, [error.at(deck.path.name)]


def deck_text(assembly: Assembly) -> str:
    """Return an assembly as the text of a deck.

    Parameters
    ----------
    assembly
        Parts, made in Python or read from another deck.
    """
    lines = ["[deck]", f"name = {_string(assembly.name)}", f"description = {_string(assembly.description)}"]
    for name, part in assembly.parts:
        if isinstance(part, Tie):
            ends = ", ".join(_string(end) for end in part.between)
            lines += _table(name, part.element, [f"between = [{ends}]"])
        else:
            lines += _table(name, part, [f"of = {_string(part.of)}"] if isinstance(part, Sensor) else [])
    return "\n".join(lines) + "\n"


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


def _table(path: str, part: Part, structure: list[str]) -> list[str]:
    lines = ["", f"[{path}]", f"component = {_string(type(part).__name__)}", *structure]
    lines += [f"{name} = {_number(q)}" for name, q in part.parameters().items()]
    for name, child in part.children().items():
        lines += _table(f"{path}.{name}", child, [])
    return lines


def _number(given: Quantity) -> str:
    factor = parse_unit(given.unit).factor
    items = [_shortest(v, factor) for v in given.values]
    value = "[" + ", ".join(items) + "]" if isinstance(given.value, tuple) else items[0]
    text = f"{{value = {value}, unit = {_string(given.unit)}, source = {_string(given.source)}"
    return text + (f", spread = {given.spread!r}}}" if given.spread else "}")


def _shortest(value: float, factor: float) -> str:
    """Return the shortest decimal that reads back as the same number in SI."""
    exact = value / factor
    candidates = (repr(float(f"{exact:.{digits}g}")) for digits in (6, 12, 15))
    return next((text for text in candidates if float(text) * factor == value), repr(exact))


def _string(text: str) -> str:
    return '"' + text.replace("\\", "\\\\").replace('"', '\\"').replace("\n", " ") + '"'


def numbers_of(deck: Deck, path: str) -> dict[str, Any]:
    """Return the numbers that stand directly in one table of a deck, by field name.

    Parameters
    ----------
    deck
        As read.
    path
        Full name of the table, for instance ``"spring.rubber"``.

    Raises
    ------
    NlsError
        If a number is not written as one.
    """
    inside = [name for name in deck.numbers() if name.rpartition(".")[0] == path]
    return {name.rpartition(".")[2]: deck.quantity(name) for name in inside}


def require_same_numbers(assembly: Assembly, deck: Deck) -> Assembly:
    """Return the assembly if it has used every number of the deck.

    Parameters
    ----------
    assembly
        Made from the deck by a function.
    deck
        Where the numbers came from.

    Raises
    ------
    DeckError
        If the deck declares a number that the assembly does not have.
    """
    for name in deck.numbers():
        if name not in assembly.quantities():
            raise DeckError(
                deck.place(name), f"the model {assembly.name} does not have this number",
                did_you_mean=nearest(name, assembly.quantities()),
                next_step="use declare(deck), which takes any deck as it stands",
            )  # fmt: skip
    return assembly
