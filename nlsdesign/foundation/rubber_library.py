"""The library of rubbers: numbers with grade, conditions, source and grade of evidence."""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from .deck import NUMBER_FIELDS, Deck, read_deck
from .errors import DeckError, nearest, unknown_name
from .extensions import extension_files
from .locations import folder
from .quantity import Quantity, same_dimension, with_unit
from .text_files import text_of

EVIDENCE = ("measured curve", "data sheet", "range")
"""Grades of evidence, best first."""
CONDITIONS = {"strain": "1", "strain_rate": "1/s", "frequency": "Hz", "temperature": "K"}
"""Under what a value was found, with the unit of each."""
_WORDS = ("family", "grade", "remark")
_LONGEST_ROW = 6
_FILE = "materials.toml"


@dataclass(frozen=True)
class Property:
    """One thing that is known of a material."""

    name: str  # within the material
    measures: str  # what the value is, in words
    quantity: Quantity  # value or row of values; for the evidence "range" the lowest and the highest
    evidence: str  # one of EVIDENCE
    # conditions: by name, one of CONDITIONS; a row goes with the row of values, for a range it is one too.
    # What is not stated is missing.
    conditions: Mapping[str, Quantity]

    def at(self, condition: str) -> str:
        """Return a condition as text; a dash where the source does not state it."""
        return self._text(self.conditions[condition]) if condition in self.conditions else "–"

    @property
    def shown(self) -> str:
        """Value with unit and spread as text."""
        return f"{self._text(self.quantity)} {self.quantity.spread_text}".rstrip()

    def _text(self, quantity: Quantity) -> str:
        shown = quantity.shown
        numbers = [f"{v:.4g}" for v in (shown if isinstance(shown, tuple) else (shown,))]
        if self.evidence == "range":
            return with_unit(" to ".join(numbers), quantity.unit)
        if len(numbers) > _LONGEST_ROW:
            return with_unit(f"{len(numbers)} values from {numbers[0]} to {numbers[-1]}", quantity.unit)
        return with_unit(", ".join(numbers), quantity.unit)


@dataclass(frozen=True)
class Material:
    """A rubber and what is known of it.

    Parameters
    ----------
    name
        In the library.
    family, grade, remark
        Kind of rubber, the very one, and what to keep in mind.
    properties
        In written order.
    """

    name: str
    family: str
    grade: str
    remark: str
    properties: tuple[Property, ...]

    def __getitem__(self, name: str) -> Property:
        """Return one property."""
        for each in self.properties:
            if each.name == name:
                return each
        raise unknown_name(f"{self.name}: property", name, (p.name for p in self.properties))

    def __contains__(self, name: object) -> bool:
        """Tell whether there is a property of that name."""
        return any(each.name == name for each in self.properties)

    def rows(self) -> list[tuple[str, ...]]:
        """Return one row of text per property: name, value, conditions, evidence, source."""
        return [
            (p.name, p.shown, *(p.at(c) for c in CONDITIONS), p.evidence, p.quantity.source)
            for p in self.properties
        ]

    def __str__(self) -> str:
        lines = [f"{self.name} ({self.family}): {self.grade}", *([f"  {self.remark}"] if self.remark else [])]
        for p in self.properties:
            known = "".join(f", {c.replace('_', ' ')} {p.at(c)}" for c in p.conditions)
            lines.append(f"  {p.name}: {p.measures} {p.shown}{known} [{p.evidence}] {p.quantity.source}")
        return "\n".join(lines)


def materials(path: Path | None = None) -> dict[str, Material]:
    """Return the rubbers of a library by name.

    Parameters
    ----------
    path
        TOML file; if it is left out, the library that comes with the project, and those of packages that the
        present block is extended by.

    Raises
    ------
    NlsError
        If an entry is not sound; file, line, column and field are named.
    DeckError
        If the file cannot be read, or a rubber stands in two libraries.

    Examples
    --------
    >>> materials()["butyl_rubber"]["loss_tangent"].shown
    '0.2 to 0.5'
    """
    if path is not None:
        return _library(path)
    known = _library(folder("models") / _FILE)
    for file in extension_files(_FILE):
        for name, brought in _library(file).items():
            if known.setdefault(name, brought) is not brought:
                rule = f"'{name}' stands in another library already"
                raise DeckError(str(file), rule, next_step="give it another name")
    return known


def _library(chosen: Path) -> dict[str, Material]:
    deck = read_deck(text_of(chosen, DeckError), chosen)
    return {name: _material(deck, name, table) for name, table in deck.tables.items()}


def material(name: str, path: Path | None = None) -> Material:
    """Return one rubber of a library.

    Parameters
    ----------
    name
        For instance ``"PMC-770"``.
    path
        As for :func:`materials`.

    Raises
    ------
    UnknownNameError
        With the nearest name that exists.

    Examples
    --------
    >>> material("PMC-770")["ultimate_stress"].evidence
    'data sheet'
    """
    known = materials(path)
    if name not in known:
        raise unknown_name("material", name, known)
    return known[name]


def _material(deck: Deck, name: str, table: Any) -> Material:
    if not isinstance(table, dict):
        raise DeckError(deck.place(name), "stands outside of any material", next_step="put it into a table")
    for key, raw in table.items():
        if not isinstance(raw, dict) and key not in _WORDS:
            raise DeckError(
                deck.place(f"{name}.{key}"), "is not a field of a material",
                did_you_mean=nearest(key, _WORDS),
                next_step=f"fields are: {', '.join(_WORDS)}; a property is a table",
            )  # fmt: skip
    texts = {field: _text(deck, name, table, field) for field in _WORDS}
    properties = tuple(_property(deck, name, key, raw) for key, raw in table.items() if isinstance(raw, dict))
    if not properties:
        raise DeckError(deck.place(name), "has no property", next_step=f"add a table [{name}.loss_tangent]")
    return Material(name=name, properties=properties, **texts)


def _property(deck: Deck, owner: str, name: str, raw: Mapping[str, Any]) -> Property:
    full = f"{owner}.{name}"
    valid = (*NUMBER_FIELDS, "measures", "evidence", *CONDITIONS)
    for key in raw:
        if key not in valid:
            raise DeckError(
                deck.place(f"{full}.{key}"), "is not a field of a property",
                did_you_mean=nearest(key, valid), next_step=f"fields are: {', '.join(valid)}",
            )  # fmt: skip
    quantity = deck.number(full, {key: raw[key] for key in NUMBER_FIELDS if key in raw})
    evidence = _text(deck, full, raw, "evidence")
    if evidence not in EVIDENCE:
        raise DeckError(
            deck.place(f"{full}.evidence"), f"'{evidence}' is not a grade of evidence",
            did_you_mean=nearest(evidence, EVIDENCE), next_step=f"use one of: {', '.join(EVIDENCE)}",
        )  # fmt: skip
    ascending_pair = len(quantity.values) == 2 and quantity.values[0] < quantity.values[1]
    if evidence == "range" and not ascending_pair:
        raise DeckError(deck.place(f"{full}.value"), "a range is two ascending numbers")
    conditions = dict(_conditions(deck, full, raw, quantity))
    return Property(name, _text(deck, full, raw, "measures"), quantity, evidence, conditions)


def _conditions(
    deck: Deck, full: str, raw: Mapping[str, Any], quantity: Quantity
) -> Iterator[tuple[str, Quantity]]:
    for name, unit in CONDITIONS.items():
        if name not in raw:
            continue
        place = f"{full}.{name}"
        given = raw[name] | {"source": quantity.source} if isinstance(raw[name], dict) else raw[name]
        condition = deck.number(place, given)
        if not same_dimension(condition.unit, unit):
            raise DeckError(
                deck.place(place),
                f"'{condition.unit}' does not measure it",
                next_step=f"use for instance '{unit}'",
            )
        rows = len(condition.values), len(quantity.values)
        if isinstance(condition.value, tuple) and rows[0] != rows[1]:
            raise DeckError(deck.place(place), f"has {rows[0]} numbers, the value has {rows[1]}")
        yield name, condition


def _text(deck: Deck, full: str, table: Mapping[str, Any], key: str) -> str:
    if not isinstance(table.get(key), str):
        raise DeckError(deck.place(full), f"has no text '{key}'", next_step=f'add {key} = "..."')
    return str(table[key])
