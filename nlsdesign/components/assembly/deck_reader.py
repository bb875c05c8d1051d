"""Parts from the tables of a deck; all problems are collected, not only the first."""

from __future__ import annotations

import dataclasses
import functools
import importlib
import inspect
import pkgutil
from collections.abc import Mapping
from types import ModuleType
from typing import Any

from ...deck import NUMBER_FIELDS, Deck
from ...errors import DeckError, NlsError, nearest, unknown_name
from ...quantity import Quantity
from ..core.element import Combination, Element
from ..core.part import Part
from ..core.tie import Tie
from ..mechanics.bodies import Body
from ..mechanics.gear import Gear
from ..sensing.sensors import Sensor
from ..transmission.cam_drive import Through


@functools.cache
def _modules() -> tuple[ModuleType, ...]:
    """Import every module of the inner rooms of ``components``: a law needs no entry in any list."""
    room = importlib.import_module(__name__.rsplit(".", 2)[0])
    names = (module.name for module in pkgutil.walk_packages(room.__path__, room.__name__ + "."))
    return tuple(importlib.import_module(name) for name in names)


def component_classes() -> dict[str, type[Part]]:
    """Return the components that a deck can name, by name: all public parts that are not abstract."""
    kinds = (
        kind
        for module in _modules()
        for name, kind in vars(module).items()
        if inspect.isclass(kind) and kind.__module__ == module.__name__ and name[0] != "_"
    )
    parts = {c.__name__: c for c in kinds if issubclass(c, Part) and c not in (Part, Tie)}
    return {name: parts[name] for name in sorted(parts) if not inspect.isabstract(parts[name])}


class Builder:
    """Builds parts from tables and collects all problems.

    Parameters
    ----------
    deck
        As read.
    """

    def __init__(self, deck: Deck) -> None:
        self.deck = deck
        self.problems: list[NlsError] = []
        self.classes = component_classes()

    def part(self, path: str, table: Mapping[str, Any]) -> Part | None:
        """Return the part of a table with all parts inside, ``None`` if there is a problem in it.

        Parameters
        ----------
        path
            Full name of the table.
        table
            As read.
        """
        before = len(self.problems)
        kind = self._kind(path, table)
        inner = {key: raw for key, raw in table.items() if _is_part(raw)}
        children = {key: self.part(f"{path}.{key}", raw) for key, raw in inner.items()}
        if kind is None:
            return None
        fields = self.numbers(path, table, kind)
        if inner and not issubclass(kind, Combination | Through):
            self._problem(f"{path}.{next(iter(inner))}", f"{kind.__name__} holds no other part")
        complete = {key: child for key, child in children.items() if child is not None}
        if len(self.problems) > before or len(complete) < len(children):
            return None
        try:
            return kind(**fields, **_structure(kind, table, complete))
        except NlsError as error:
            self.problems.append(error.at(self.deck.place(path)))
            return None

    def numbers(self, path: str, table: Mapping[str, Any], kind: type[Part]) -> dict[str, Quantity]:
        """Return the numbers of a part; fields that it does not have or that are missing are problems.

        Parameters
        ----------
        path, table
            As for :meth:`part`.
        kind
            The component.
        """
        infos, quantities = kind.parameter_infos(), {}
        intended: set[str | None] = set()
        keys = self._keys(path, kind)
        for key, raw in table.items():
            full = f"{path}.{key}"
            if key in infos:
                try:
                    given = self.deck.number(full, raw)
                except NlsError as error:
                    self.problems.append(error)
                    continue
                try:
                    quantities[key] = infos[key].checked(key, given)
                except NlsError as error:
                    self.problems.append(error.at(self.deck.place(full)))
            elif key not in keys and not _is_part(raw):
                rule, step = (
                    f"{kind.__name__} has no field '{key}'",
                    f"fields are: {', '.join([*keys, *infos])}",
                )
                intended.add(nearest(key, [*keys, *infos]))
                self._problem(full, rule, did_you_mean=nearest(key, [*keys, *infos]), next_step=step)
        for field in dataclasses.fields(kind):
            # A misspelt field has been reported already.
            missing = field.name in infos and field.name not in table and field.name not in intended
            if missing and field.default is dataclasses.MISSING:
                step = (
                    f'add {field.name} = {{value = ..., unit = "{infos[field.name].unit}", source = "..."}}'
                )
                self._problem(path, f"{kind.__name__} needs '{field.name}'", next_step=step)
        return quantities

    def tied(self, name: str, element: Part | None, table: Mapping[str, Any]) -> Tie | None:
        """Return an element of the top level with the bodies at its ends.

        Parameters
        ----------
        name
            Of the table.
        element
            The element; its ends are checked even where it could not be made.
        table
            As read.
        """
        ends = table.get("between")
        if not isinstance(ends, list) or not all(isinstance(end, str) for end in ends):
            wrong = "is missing" if ends is None else f"is {ends!r}, not a list of names"
            step = 'write between = ["motor", "load"], or one name for the resting frame'
            self._problem(f"{name}.between", wrong, next_step=step)
            return None
        # A table of an unknown component may be a body.
        bodies = [n for n in self.deck.tables if issubclass(self.class_of(n) or Body, Body)]
        unknown = [unknown_name("body", end, bodies) for end in ends if end not in bodies]
        self.problems += [error.at(self.deck.place(f"{name}.between")) for error in unknown]
        if unknown or not isinstance(element, Element):
            return None
        try:
            return Tie(element=element, between=tuple(ends))
        except NlsError as error:
            self.problems.append(error.at(self.deck.place(f"{name}.between")))
            return None

    def class_of(self, name: str) -> type[Part] | None:
        """Return the component of a table of the top level, if there is such a component.

        Parameters
        ----------
        name
            Of the table.
        """
        table = self.deck.tables[name]
        return self.classes.get(str(table.get("component"))) if isinstance(table, dict) else None

    def head(self) -> None:
        """Check the table ``[deck]``."""
        for key, raw in self.deck.head.items():
            if key not in ("name", "description"):
                valid = ("name", "description")
                self._problem(f"deck.{key}", "is not a field of [deck]", did_you_mean=nearest(key, valid))
            elif not isinstance(raw, str):
                self._problem(f"deck.{key}", f"is {raw!r}, not a text")

    def _kind(self, path: str, table: Mapping[str, Any]) -> type[Part] | None:
        name = table.get("component")
        if name is None:
            misspelt = nearest("component", [key for key in table if key not in ("between", "of")])
            self._problem(
                f"{path}.{misspelt}" if misspelt else path,
                "is not a field; the table has no component" if misspelt else "the table has no component",
                did_you_mean="component" if misspelt else None,
                next_step='write component = "..."',
            )
            return None
        if not isinstance(name, str) or name not in self.classes:
            self._problem(
                f"{path}.component",
                f"'{name}' is not a component",
                did_you_mean=nearest(str(name), self.classes),
                next_step=f"use one of: {', '.join(sorted(self.classes))}",
            )
            return None
        kind = self.classes[name]
        if issubclass(kind, Sensor) and not isinstance(table.get("of"), str):
            self._problem(path, f"{name} needs 'of'", next_step='add of = "...", the signal that it reads')
        if issubclass(kind, Gear) and not _is_pair(table.get("between")):
            self._problem(path, f"{name} needs 'between'", next_step='add between = ["motor", "wheel"]')
        return kind

    def _keys(self, path: str, kind: type[Part]) -> list[str]:
        tied = (issubclass(kind, Element) and "." not in path) or issubclass(kind, Gear)
        return ["component"] + ["between"] * tied + ["of"] * issubclass(kind, Sensor)

    def _problem(
        self, full_name: str, rule: str, *, did_you_mean: str | None = None, next_step: str | None = None
    ) -> None:
        place = self.deck.place(full_name)
        self.problems.append(DeckError(place, rule, did_you_mean=did_you_mean, next_step=next_step))


def _is_part(raw: object) -> bool:
    """Tell a table of a part, even one whose component is missing, from a number."""
    return isinstance(raw, dict) and ("component" in raw or not set(raw) & set(NUMBER_FIELDS))


def _is_pair(raw: object) -> bool:
    return isinstance(raw, list) and len(raw) == 2 and all(isinstance(end, str) for end in raw)


def _structure(kind: type[Part], table: Mapping[str, Any], children: Mapping[str, Part]) -> dict[str, Any]:
    """Return the fields of a part that are not numbers."""
    if issubclass(kind, Combination):
        return {"members": tuple(children.items())}
    if issubclass(kind, Through):
        behind = [pair for pair in children.items() if pair[0] != "cam"]
        if "cam" not in children or len(behind) != 1:
            raise DeckError("Through", "needs a table 'cam' and one table for the element behind it")
        return {"cam": children["cam"], "behind": behind[0]}
    if issubclass(kind, Gear):
        return {"between": tuple(table["between"])}
    return {"of": table["of"]} if issubclass(kind, Sensor) else {}
