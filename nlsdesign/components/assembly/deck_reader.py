"""Parts from the tables of a deck; all problems are collected, not only the first."""

from __future__ import annotations

import dataclasses
import functools
import importlib
import inspect
import pkgutil
import re
from collections.abc import Mapping, Sequence
from types import ModuleType
from typing import Any

from ...foundation.deck import NUMBER_FIELDS, Deck, ParentDeck
from ...foundation.errors import ArrangementError, DeckError, NlsError, brief, nearest, unknown_name
from ...foundation.extensions import extension_modules
from ...foundation.quantity import Quantity
from ..core.domain import Domain
from ..core.element import Combination, Element, Tie
from ..core.part import Part
from ..core.part_numbers import ParameterInfo, Reading, domain_by_units, readings, templates
from ..mechanics.bodies import Body, Free
from ..mechanics.gear import Transmission
from ..sensing.sensors import Sensor
from ..transmission.cam_drive import Through
from .library_rubber import FIELDS, takes_material, with_library_rubber
from .part_text import NUMBERS, renamed

_PARENT_FIELDS = ("name", "digest", "change", "parent")


@functools.cache
def _modules() -> tuple[ModuleType, ...]:
    """Import every module of the inner rooms of ``components``: a law needs no entry in any list."""
    room = importlib.import_module(__name__.rsplit(".", 2)[0])
    names = (module.name for module in pkgutil.walk_packages(room.__path__, room.__name__ + "."))
    return tuple(importlib.import_module(name) for name in names)


def component_classes() -> dict[str, type[Part]]:
    """Return the components that a deck can name, by name: all public parts that are not abstract.

    Those of packages that the present block is extended by are among them.
    """
    own, brought = _parts_in(_modules()), _parts_in(extension_modules())
    for name, kind in brought.items():
        if own.setdefault(name, kind) is not kind:
            rule = f"has the name of a component of {own[name].__module__}"
            raise ArrangementError(f"{kind.__module__}.{name}", rule, next_step="give it another name")
    return {name: own[name] for name in sorted(own) if not inspect.isabstract(own[name])}


def _parts_in(modules: Sequence[ModuleType]) -> dict[str, type[Part]]:
    kinds = (
        kind
        for module in modules
        for name, kind in vars(module).items()
        if inspect.isclass(kind) and kind.__module__ == module.__name__ and name[0] != "_"
    )
    return {c.__name__: c for c in kinds if issubclass(c, Part) and c not in (Part, Tie)}


class Builder:
    """Builds parts from tables and collects all problems."""

    def __init__(self, deck: Deck) -> None:
        self.deck = deck
        self.problems: list[NlsError] = []
        self.classes = component_classes()

    def part(self, path: str, table: Mapping[str, Any]) -> Part | None:
        """Return the part of a table with all parts inside, ``None`` if there is a problem in it."""
        before = len(self.problems)
        kind = self._kind(path, table)
        if kind is not None and takes_material(kind) and any(key in table for key in FIELDS):
            try:
                table = with_library_rubber(self.deck, path, table)
            except NlsError as error:
                self.problems.append(error)
                return None
        inner = {key: raw for key, raw in table.items() if _is_part(raw)}
        children = {key: self.part(f"{path}.{key}", raw) for key, raw in inner.items()}
        if kind is None:
            return None
        made = {key: child for key, child in children.items() if child is not None}
        fields = self.fields(path, table, kind, next(iter(made.values()), None))
        if inner and not issubclass(kind, Combination | Through | Free):
            self.problem(f"{path}.{next(iter(inner))}", f"{kind.__name__} holds no other part")
        if len(self.problems) > before or len(made) < len(children):
            return None
        try:
            return kind(**fields, **_structure(kind, table, made))
        except NlsError as error:
            self.problems.append(error.at(self.deck.place(path)))
            return None

    def fields(
        self, path: str, table: Mapping[str, Any], kind: type[Part], inner: Part | None = None
    ) -> dict[str, Any]:
        """Return the numbers, readings and domain of a part; what it lacks or does not have are problems.

        ``inner``: a part inside, whose domain is that of the numbers; ``None`` where there is none.
        """
        names, keys = kind.parameter_infos(), self._keys(path, kind)
        given: dict[str, Quantity] = {}
        intended: set[str | None] = set()
        for key, raw in table.items():
            full = f"{path}.{key}"
            if key in names and not (isinstance(raw, dict) and "component" in raw):
                try:
                    given[key] = self.deck.number(full, raw)
                except NlsError as error:
                    self.problems.append(error)
            elif key not in keys and not _is_part(raw):
                valid = [*keys, *names]
                new = NUMBERS.get(key)
                near = new if new in names else nearest(key, valid)
                intended.add(near)
                step = f"fields are: {', '.join(valid)}"
                rule = f"{kind.__name__} has no field '{key}'"
                self.problem(full, rule, did_you_mean=near, next_step=step)
        stated = self._stated_domain(path, table, kind)
        domain = stated or _domain_of(kind, given, inner)
        infos = kind.parameter_infos(domain)
        sound: dict[str, Quantity] = {}
        for key, number in given.items():
            try:
                sound[key] = infos[key].checked(key, number)
            except NlsError as error:
                self.problems.append(error.at(self.deck.place(f"{path}.{key}")))
        # What stands there misspelt, or is not sound, has been named already.
        there = {*table, *intended}
        self._missing(path, kind, kind, infos, there)
        fields: dict[str, Any] = {name: q for name, q in sound.items() if name in templates(kind)}
        if stated:
            fields["domain"] = stated
        return fields | {
            name: reading
            for name, kinds in readings(kind).items()
            if (reading := self._reading(path, kind, kinds, infos, (there, sound))) is not None
        }

    def _reading(
        self,
        path: str,
        kind: type[Part],
        kinds: tuple[type[Reading], ...],
        infos: Mapping[str, ParameterInfo],
        numbers: tuple[set[str | None], Mapping[str, Quantity]],
    ) -> Reading | None:
        """Return the reading whose numbers a table has; where it has none the part takes its own."""
        there, sound = numbers
        asked = {name for each in kinds for name in templates(each)} & there
        fitting = [each for each in kinds if asked <= set(templates(each))]
        if not fitting:
            ways = "; or ".join(f"{' and '.join(templates(e))} ({e.__name__})" for e in kinds if templates(e))
            rule = f"{kind.__name__} has either {ways}, not {' and '.join(sorted(map(str, asked)))}"
            self.problem(path, rule, next_step="keep those of one way")
            return None
        holder = next(f for f in dataclasses.fields(kind) if f.metadata.get("readings") == kinds)
        if not asked and holder.default is not dataclasses.MISSING:
            return None
        best = min(fitting, key=lambda each: len(_needed(each) - asked))
        self._missing(path, kind, best, infos, there)
        numbers_of_it = {name: q for name, q in sound.items() if name in templates(best)}
        return best(**numbers_of_it) if _needed(best) <= set(numbers_of_it) else None

    def _missing(
        self,
        path: str,
        kind: type[Part],
        holder: type,
        infos: Mapping[str, ParameterInfo],
        there: set[str | None],
    ) -> None:
        for name in templates(holder):
            if name in _needed(holder) and name not in there:
                step = f'add {name} = {{value = ..., unit = "{infos[name].unit}", source = "..."}}'
                self.problem(path, f"{kind.__name__} needs '{name}'", next_step=step)

    def _stated_domain(self, path: str, table: Mapping[str, Any], kind: type[Part]) -> Domain | None:
        if "domain" not in table or "domain" not in self._keys(path, kind):
            return None
        known = {domain.name: domain for domain in kind.domains()}
        if not isinstance(table["domain"], str) or table["domain"] not in known:
            rule = f"is {brief(table['domain'])}, not a domain of {kind.__name__}"
            self.problem(f"{path}.domain", rule, next_step=f"write one of: {', '.join(known)}")
            return None
        return known[table["domain"]]

    def tied(self, name: str, element: Part | None, table: Mapping[str, Any]) -> Tie | None:
        """Return an element of the top level with the bodies at its ends.

        ``element``: the element; its ends are checked even where it could not be made.
        """
        ends = table.get("between")
        if not isinstance(ends, list) or not all(isinstance(end, str) for end in ends):
            wrong = "is missing" if ends is None else f"is {brief(ends)}, not a list of names"
            step = 'write between = ["motor", "load"], or one name for the resting frame'
            self.problem(f"{name}.between", wrong, next_step=step)
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
        """Return the component of a table of the top level, if there is such a component."""
        table = self.deck.tables[name]
        return self.classes.get(_text(table.get("component"))) if isinstance(table, dict) else None

    def head(self) -> ParentDeck | None:
        """Check the table ``[deck]``, and return the deck that this one was made from."""
        for key, raw in self.deck.head.items():
            if key not in ("name", "description", "parent"):
                valid = ("name", "description", "parent")
                self.problem(f"deck.{key}", "is not a field of [deck]", did_you_mean=nearest(key, valid))
            elif key != "parent" and not isinstance(raw, str):
                self.problem(f"deck.{key}", f"is {brief(raw)}, not a text")
        return _parent(self, "deck.parent", self.deck.head.get("parent"))

    def _kind(self, path: str, table: Mapping[str, Any]) -> type[Part] | None:
        name = table.get("component")
        if name is None:
            misspelt = nearest("component", [key for key in table if key not in ("between", "of")])
            self.problem(
                f"{path}.{misspelt}" if misspelt else path,
                "is not a field; the table has no component" if misspelt else "the table has no component",
                did_you_mean="component" if misspelt else None,
                next_step='write component = "..."',
            )
            return None
        old = renamed(_text(name))
        if old:
            self.problems.append(old.at(self.deck.place(f"{path}.component")))
            return None
        if not isinstance(name, str) or name not in self.classes:
            self.problem(
                f"{path}.component",
                f"'{_text(name)}' is not a component",
                did_you_mean=nearest(_text(name), self.classes),
                next_step=f"use one of: {', '.join(sorted(self.classes))}",
            )
            return None
        kind = self.classes[name]
        if issubclass(kind, Sensor) and not isinstance(table.get("of"), str):
            self.problem(path, f"{name} needs 'of'", next_step='add of = "...", the signal that it reads')
        between = table.get("between")
        paired = isinstance(between, list) and len(between) == 2 and all(isinstance(e, str) for e in between)
        if issubclass(kind, Transmission) and not paired:
            self.problem(path, f"{name} needs 'between'", next_step='add between = ["motor", "wheel"]')
        return kind

    def _keys(self, path: str, kind: type[Part]) -> list[str]:
        tied = (issubclass(kind, Element) and "." not in path) or issubclass(kind, Transmission)
        free = any("domains" in field.metadata for field in dataclasses.fields(kind))
        return ["component"] + ["between"] * tied + ["of"] * issubclass(kind, Sensor) + ["domain"] * free

    def problem(
        self, full_name: str, rule: str, *, did_you_mean: str | None = None, next_step: str | None = None
    ) -> None:
        """Add a problem, with its place in the deck."""
        place = self.deck.place(full_name)
        self.problems.append(DeckError(place, rule, did_you_mean=did_you_mean, next_step=next_step))


def _parent(builder: Builder, path: str, raw: object) -> ParentDeck | None:
    if raw is None:
        return None
    before = len(builder.problems)
    if not isinstance(raw, dict):
        builder.problem(
            path, f"is {brief(raw)}, not a deck", next_step='write {name = "...", digest = "..."}'
        )
        return None
    for key in raw:
        if key not in _PARENT_FIELDS:
            rule = f"is not a field of {path}"
            builder.problem(f"{path}.{key}", rule, did_you_mean=nearest(key, _PARENT_FIELDS))
    texts = {key: raw.get(key, "") for key in ("name", "digest", "change")}
    for key, text in texts.items():
        if not isinstance(text, str) or not (text or key == "change"):
            builder.problem(f"{path}.{key}", f"is {brief(text)}, not a text" if key in raw else "is missing")
    digest = texts["digest"]
    if isinstance(digest, str) and digest and not re.fullmatch("[0-9a-f]{64}", digest):
        step = "copy it from `nlsdesign deck check`, or leave the parent out"
        builder.problem(f"{path}.digest", f"'{digest}' is no SHA-256 of 64 digits", next_step=step)
    earlier = _parent(builder, f"{path}.parent", raw.get("parent"))
    return ParentDeck(**texts, parent=earlier) if len(builder.problems) == before else None


def _text(raw: object) -> str:
    return raw if isinstance(raw, str) else brief(raw)


def _is_part(raw: object) -> bool:
    """Tell a table of a part, even one whose component is missing, from a number."""
    return isinstance(raw, dict) and ("component" in raw or not set(raw) & set(NUMBER_FIELDS))


def _needed(holder: type) -> set[str]:
    """Return the names of the numbers without a default."""
    fields = {field.name: field for field in dataclasses.fields(holder)}
    return {name for name in templates(holder) if fields[name].default is dataclasses.MISSING}


def _domain_of(kind: type[Part], given: Mapping[str, Quantity], inner: Part | None) -> Domain | None:
    """Return the domain that the part inside has, or that the units tell."""
    if not kind.domains():
        return None
    if isinstance(inner, Element) and inner.domain in kind.domains():
        return inner.domain
    named = {
        name: template
        for holder in (kind, *(each for kinds in readings(kind).values() for each in kinds))
        for name, template in templates(holder).items()
    }
    return domain_by_units(kind.domains(), named, given)


def _without_one_behind(has_cam: bool, names: list[str]) -> DeckError:
    if not has_cam:
        step = 'add a table such as [spring.cam] with component = "TwoSidedCam"'
        return DeckError("Through", "needs a table 'cam'", next_step=step)
    if not names:
        step = 'add a table such as [spring.rubber] with component = "Specimen"'
        return DeckError("Through", "needs one table for the element behind the cam", next_step=step)
    return DeckError(
        "Through", f"has {len(names)} elements behind its cam, {', '.join(map(repr, names))}, and takes one",
        next_step='put both into one table: component = "Parallel" where they share the stretch, "Series" '
        "where they share the force",
    )  # fmt: skip


def _structure(kind: type[Part], table: Mapping[str, Any], children: Mapping[str, Part]) -> dict[str, Any]:
    """Return the fields of a part that are not numbers."""
    if issubclass(kind, Combination):
        return {"members": tuple(children.items())}
    if issubclass(kind, Through):
        behind = [pair for pair in children.items() if pair[0] != "cam"]
        if "cam" not in children or len(behind) != 1:
            raise _without_one_behind("cam" in children, [name for name, _ in behind])
        return {"cam": children["cam"], "behind": behind[0]}
    if issubclass(kind, Free):
        return {"chain": tuple(children.items())}
    if issubclass(kind, Transmission):
        return {"between": tuple(table["between"])}
    return {"of": table["of"]} if issubclass(kind, Sensor) else {}
