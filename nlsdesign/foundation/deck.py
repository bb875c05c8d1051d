"""Decks: TOML files in which every number has value, unit, source and spread; errors name line and column."""

from __future__ import annotations

import math
import re
import tomllib
from collections.abc import Iterator, Mapping
from dataclasses import dataclass, field
from fractions import Fraction
from pathlib import Path
from typing import Any, Self

from .errors import DeckError, NlsError, UnitError, ValueRangeError, brief, nearest, unknown_name, visible
from .locations import folder
from .quantity import Quantity, parse_unit, same_dimension
from .spread import EXACT, NormalSpread, RelativeSpread, Spread, UniformSpread
from .text_files import is_there, text_of
from .written_numbers import split_number

_KEY_PART = r"""(?:[A-Za-z0-9_\-]+|"[^"]*"|'[^']*')"""
_NAME = rf"{_KEY_PART}(?:\s*\.\s*{_KEY_PART})*"
_HEADER = re.compile(rf"^\s*\[\[?\s*({_NAME})\s*\]")
_KEY = re.compile(rf"^(\s*)({_NAME})\s*=")
_ITEM = re.compile(r"\[\d+\]$")
MOST_SPREAD = 5.0
"""Largest relative spread of a number in a deck: a factor of six."""
_MOST_LEVELS = 64
"""Names within names; the deepest deck of the project has seven."""
_TOO_DEEP = re.compile(rf"""(?<![\w.\-"'])(?:[\w\-"']+\s*\.\s*){{{_MOST_LEVELS}}}""")
_MOST_DIGITS = 1000
_TOO_MANY_DIGITS = re.compile(rf"[0-9A-Fa-f_]{{{_MOST_DIGITS}}}")
NUMBER_FIELDS = ("value", "unit", "source", "spread", "range")


class Written(float):
    """A number with its decimal text, so that it is rounded only once, in SI."""

    text: str

    def __new__(cls, text: str) -> Self:
        """Return the number of a text."""
        made = super().__new__(cls, text)
        made.text = text
        return made

    def times(self, factor: float) -> float:
        """Return the number in SI, correctly rounded."""
        if self == 0.0 or not math.isfinite(self):
            return float(self) * factor
        return float(Fraction(self.text) * Fraction(factor))


@dataclass(frozen=True)
class ParentDeck:
    """The deck that another deck was made from, as ``[deck]`` names it."""

    name: str
    digest: str  # SHA-256 of its parts, 64 hexadecimal digits
    change: str = ""  # what was done to it, such as "diagnosed"
    parent: ParentDeck | None = None  # the deck that it was made from itself

    def __post_init__(self) -> None:
        for field_name in ("name", "digest", "change"):
            object.__setattr__(self, field_name, visible(getattr(self, field_name)))

    def line(self) -> tuple[ParentDeck, ...]:
        """Return this deck and those before it, the latest first."""
        return (self, *(self.parent.line() if self.parent else ()))


@dataclass(frozen=True)
class Deck:
    """The tables of a deck as they were read, with the place of each name."""

    name: str
    description: str
    path: Path
    tables: Mapping[str, Any]
    places: Mapping[str, tuple[int, int]]
    head: Mapping[str, Any] = field(default_factory=dict)
    stands_in: str = ""

    def named(self, name: str) -> str:
        """Return the name by which something stands in the file."""
        return f"{self.stands_in}.{name}" if self.stands_in else name

    def place(self, full_name: str) -> str:
        """Return ``file:line:column: name``.

        A table that only its inner tables mention stands where the first of them does; what does not stand in
        the file at all has the place of the nearest table above.
        """
        named = self.named(full_name)
        inner = [place for name, place in self.places.items() if name.startswith(f"{named}.")]
        known = named
        while known and known not in self.places:
            known = _ITEM.sub("", known) if _ITEM.search(known) else known.rpartition(".")[0]
        line, column = (
            self.places[named]
            if known == named and known
            else min(inner, default=self.places.get(known, (1, 1)))
        )
        return f"{self.path.name}:{line}:{column}: {named}"

    def quantity(self, full_name: str) -> Quantity:
        """Return the number of that name."""
        node: Any = self.tables
        for step in full_name.split("."):
            if not isinstance(node, Mapping) or step not in node:
                raise unknown_name(f"{self.path.name}: number", full_name, self.places)
            node = node[step]
        return self.number(full_name, node)

    def numbers(self) -> list[str]:
        """Return the full names of all numbers in the deck, in written order."""
        return [name for name, table in _tables("", self.tables) if "value" in table or "range" in table]

    def number(self, full_name: str, raw: object) -> Quantity:
        """Return a number of the deck as a quantity."""
        where = self.place(full_name)
        if not isinstance(raw, dict):
            raise DeckError(
                where, f"is the bare value {brief(raw)}; a number needs a unit and a source",
                next_step='write {value = ..., unit = "...", source = "...", spread = ...}',
            )  # fmt: skip
        for key in raw:
            if key not in NUMBER_FIELDS:
                raise DeckError(
                    where, f"has an unknown field '{key}'", did_you_mean=nearest(key, NUMBER_FIELDS)
                )
        if "unit" not in raw:
            raise UnitError(
                where, "has no unit", next_step='add for instance unit = "mm"; "1" for a pure number'
            )
        if "range" in raw:
            for key in ("value", "spread"):
                if key in raw:
                    rule = f"has both range and {key}"
                    raise DeckError(where, rule, next_step=f"leave out {key}: a range has none")
        given = {*raw, "value"} if "range" in raw else set(raw)
        missing = [key for key in ("value", "source") if key not in given]
        if missing:
            raise DeckError(where, f"has no {' and no '.join(missing)}", next_step=f"add {missing[0]} = ...")
        return self._converted(where, raw)

    def _converted(self, where: str, raw: dict[str, Any]) -> Quantity:
        given: Any = raw.get("range", raw.get("value"))
        items, spread = given if isinstance(given, list) else [given], raw.get("spread", 0.0)
        numbers = [*items, *(() if isinstance(spread, str) else (spread,))]
        if not all(isinstance(v, int | float) and not isinstance(v, bool) for v in numbers):
            shown = f", spread {brief(spread)}" if spread else ""
            raise DeckError(where, f"{brief(given)}{shown} is not a number")
        if any(isinstance(v, Written) and len(v.text) > _MOST_DIGITS for v in numbers):
            raise DeckError(where, f"has a number of more than {_MOST_DIGITS} digits")
        for key in ("unit", "source"):
            if not isinstance(raw[key], str) or not raw[key].strip():
                raise DeckError(
                    where, f"{key} {brief(raw[key])} is not a text", next_step=f'write {key} = "..."'
                )
        try:
            factor = parse_unit(raw["unit"]).factor
            scaled = tuple(v.times(factor) if isinstance(v, Written) else float(v) * factor for v in items)
            if "range" in raw:
                # The middle of a range with the range as its spread.
                if len(scaled) != 2 or not scaled[0] < scaled[1]:
                    raise ValueRangeError(
                        "range",
                        "is a range from a smaller to a larger number",
                        next_step="write range = [1.0, 3.0]",
                    )
                return Quantity(
                    0.5 * (scaled[0] + scaled[1]),
                    raw["unit"],
                    raw["source"],
                    UniformSpread(0.5 * (scaled[1] - scaled[0])),
                )
            in_si = scaled if isinstance(given, list) else scaled[0]
            return Quantity(in_si, raw["unit"], raw["source"], _spread(spread, raw["unit"]))
        except NlsError as error:
            raise error.at(where) from None
        except OverflowError:
            rule = f"{brief(given)} {raw['unit']}, spread {brief(spread)}, is too large to compute with"
            raise ValueRangeError(where, rule, next_step="correct the number or its unit") from None


def _spread(given: float | str, unit: str) -> Spread:
    """Return a spread as it stands in a deck: a share, or a standard deviation with its unit."""
    if isinstance(given, str):
        size, written = split_number(given)
        if not same_dimension(written or "1", unit):
            raise UnitError(
                f'spread = "{given}"',
                f"is not of the dimension of '{unit}'",
                next_step=f'write spread = "{size:g} {unit}", or a share without a unit, 0.1 for 10 %',
            )
        return NormalSpread(size * parse_unit(written or "1").factor)
    if given > MOST_SPREAD:
        raise ValueRangeError(
            f"spread = {given:g}", f"means a factor of {1.0 + given:g} up or down for one standard deviation",
            next_step=f"write spread = {given / 100:g} if {given:g} % was meant, or a standard deviation "
            f'with its unit, spread = "1 {unit}", if the sign of the number is not known',
        )  # fmt: skip
    return RelativeSpread(float(given)) if given else EXACT


def _tables(path: str, table: Mapping[str, Any]) -> Iterator[tuple[str, Mapping[str, Any]]]:
    for key, inner in table.items():
        if isinstance(inner, Mapping):
            full = f"{path}.{key}" if path else key
            yield full, inner
            yield from _tables(full, inner)


def deck_names() -> list[str]:
    """Return the names of the decks that come with the project."""
    return sorted(path.stem for path in (folder("models") / "decks").glob("*.toml"))


def template_names() -> list[str]:
    """Return the names of the templates that come with the project."""
    return sorted(path.stem for path in (folder("models") / "templates").glob("*.toml"))


_READY = "# Ready for: "


def template_text(name: str) -> str:
    """Return the text of a template: TOML, with a comment that names the commands that it is meant for."""
    if name not in template_names():
        raise unknown_name("template", name, template_names())
    return (folder("models") / "templates" / f"{name}.toml").read_text(encoding="utf8")


def commands_named_in(template: str) -> tuple[str, ...]:
    """Return the commands that the text of a template says that it is ready for."""
    line = next(line for line in template.splitlines() if line.startswith(_READY))
    return tuple(line.removeprefix(_READY).split(", "))


def load_deck(name: str | Path) -> Deck:
    """Read a deck by file name, or by the name of one that comes with the project.

    Parameters
    ----------
    name
        For instance ``"austin2015_as_printed"`` or ``"my/actuator.toml"``.

    Raises
    ------
    DeckError
        If the file cannot be read as TOML.
    UnknownNameError
        If there is neither such a file nor such a deck.
    """
    path = Path(name)
    if path.suffix != ".toml":
        if str(name) not in deck_names():
            inside = path / "model.toml"
            if is_there(inside):
                raise DeckError(f"deck '{name}'", "is a folder", next_step=f"name the deck in it: {inside}")
            if is_there(path) and path.is_dir():
                decks = sorted(path.glob("*.toml"))
                named = f"name the deck in it: {decks[0]}" if len(decks) == 1 else "name a .toml file"
                if len(decks) > 1:
                    named += f" in it, for instance {decks[0]}"
                raise DeckError(f"deck '{path}'", "is a folder", next_step=named)
            if is_there(path) and path.is_file():
                raise DeckError(
                    f"deck '{name}'", "is a file whose name does not end in .toml",
                    next_step="give a deck, which is a .toml file, or the name of one of the project",
                )  # fmt: skip
            raise unknown_name("deck", str(name), deck_names())
        path = folder("models") / "decks" / f"{name}.toml"
    if not is_there(path):
        raise DeckError(str(path), "no such file", did_you_mean=nearest(path.stem, deck_names()),
                        next_step="give a .toml file or the name of a deck")  # fmt: skip
    return read_deck(text_of(path, DeckError), path)


def read_deck(text: str, path: Path) -> Deck:
    """Read a deck from text."""
    deep = _TOO_DEEP.search(text)
    if deep:
        raise _too_deep(f"{path.name}:{text.count(chr(10), 0, deep.start()) + 1}")
    try:
        tables = tomllib.loads(text, parse_float=Written)
    except tomllib.TOMLDecodeError as error:
        message = str(error)
        match = re.search(r"\s*\(at line (\d+), column (\d+)\)", message)
        lines = text.splitlines() or [""]
        place = f"{match[1]}:{match[2]}" if match else f"{len(lines)}:{len(lines[-1]) + 1}"
        rule = message.replace(match[0], "") if match else message
        raise DeckError(
            f"{path.name}:{place}", f"is not valid TOML: {rule}", next_step="correct that line"
        ) from None
    except RecursionError:
        raise _too_deep(path.name) from None
    except ValueError:  # of Python, for whole numbers of more digits than it reads
        long = _TOO_MANY_DIGITS.search(text)
        line = text.count("\n", 0, long.start() if long else 0) + 1
        raise DeckError(f"{path.name}:{line}", f"has a number of more than {_MOST_DIGITS} digits") from None
    # How many tables and lists stand within each other.
    levels = 0
    inner: list[Any] = [tables]
    while inner:
        levels += 1
        each = [v for t in inner for v in (t.values() if isinstance(t, dict) else t)]
        inner = [v for v in each if isinstance(v, (dict, list))]
    if levels > _MOST_LEVELS:
        raise _too_deep(path.name)
    places = _places(text)
    head = tables.pop("deck", {})
    if not isinstance(head, dict):
        line, column = places.get("deck", (1, 1))
        raise DeckError(f"{path.name}:{line}:{column}: deck", "is not a table", next_step="write [deck]")
    given = (head.get("name", path.stem), head.get("description", ""))
    name, description = (visible(each) if isinstance(each, str) else brief(each) for each in given)
    return Deck(name, description, path, tables, places, head)


def _too_deep(where: str) -> DeckError:
    rule = f"has tables or lists within each other, more than {_MOST_LEVELS} deep"
    return DeckError(where, rule, next_step="combine parts side by side instead of within each other")


def _places(text: str) -> dict[str, tuple[int, int]]:
    """Return line and column of each name; the tables of a list ``[[axes]]`` stand as ``axes[1]`` too."""
    places: dict[str, tuple[int, int]] = {}
    table, counts = "", dict[str, int]()
    for number, line in enumerate(text.splitlines(), start=1):
        header, key = _HEADER.match(line), _KEY.match(line)
        if not header and not key:
            continue
        place = (number, line.index("[") + 1 if header else len(key[1]) + 1 if key else 1)
        if header:
            table = _joined(header[1])
            if line.lstrip().startswith("[["):
                counts[table] = counts.get(table, 0) + 1
        full = table if header else f"{table}.{_joined(key[2])}".lstrip(".") if key else ""
        places.setdefault(full, place)
        for listed, count in counts.items():
            if full == listed or full.startswith(f"{listed}."):
                places.setdefault(f"{listed}[{count}]{full.removeprefix(listed)}", place)
    return places


def _joined(name: str) -> str:
    return re.sub(r"[\s\"']", "", name)
