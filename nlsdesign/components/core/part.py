"""Parts: immutable declarations whose numbers carry unit, range, meaning and source."""

from __future__ import annotations

import dataclasses
import re
from abc import ABC
from collections.abc import Collection, Iterator, Mapping, Sequence
from dataclasses import dataclass
from typing import Any, ClassVar, Self

from ...foundation.errors import ArrangementError, UnitError, unknown_name
from ...foundation.quantity import Quantity, same_dimension, typeset_unit
from .domain import Domain
from .part_numbers import ParameterInfo as ParameterInfo
from .part_numbers import Reading, Template, domain_by_units, readings, templates
from .part_numbers import parameter as parameter

LONGEST = 100
"""Letters in the longest name of a deck or a part: names become those of variables, files and columns."""
RESERVED = frozenset({"component", "between", "of", "domain"})
"""Keys of a deck that say what a part is and where it sits."""


@dataclass(frozen=True, kw_only=True)
class Part(ABC):  # noqa: B024 - a bare part has no law; its kinds do
    """Base of everything that is declared: its numbers are the fields made by :func:`parameter`."""

    phenomena: ClassVar[frozenset[str]] = frozenset()
    """What the part brings into a system, in the terms of the field; the parts inside say their own."""

    def __post_init__(self) -> None:
        for name, kinds in readings(type(self)).items():
            _reading(self, name, kinds)
        for field in dataclasses.fields(self):
            if "domains" in field.metadata:
                object.__setattr__(self, "domain", _decided(self, field.metadata["domains"]))
        for name, template in templates(type(self)).items():
            info = template.within(_domain(self))
            object.__setattr__(self, name, info.checked(name, getattr(self, name)))
        for name, kinds in readings(type(self)).items():
            object.__setattr__(self, name, _reading(self, name, kinds).within(_domain(self)))

    @classmethod
    def domains(cls) -> tuple[Domain, ...]:
        """Return the domains in which the part can be, the usual one first; none where it has none."""
        for field in dataclasses.fields(cls):
            if "domains" in field.metadata:
                return tuple(field.metadata["domains"])
        own = getattr(cls, "domain", None)
        return (own,) if isinstance(own, Domain) else ()

    @classmethod
    def parameter_infos(cls, domain: Domain | None = None) -> dict[str, ParameterInfo]:
        """Return unit, description and range of each number that may be given, by field name.

        Parameters
        ----------
        domain
            Whose units; by default the usual one of the class.
        """
        where = domain or next(iter(cls.domains()), None)
        kinds = [cls, *(kind for several in readings(cls).values() for kind in several)]
        return {name: each.within(where) for kind in kinds for name, each in templates(kind).items()}

    def infos(self) -> dict[str, ParameterInfo]:
        """Return unit, description and range of each number that this part has, in its own domain."""
        return {name: template.within(_domain(self)) for name, template in _templates(self).items()}

    def remarks(self) -> Iterator[str]:
        """Yield what is lawful and likely to be a slip, each with the least change that mends it."""
        yield from ()

    def parameters(self) -> dict[str, Quantity]:
        """Return the numbers of this part alone by field name, those of its readings among them."""
        holders = [self, *(getattr(self, name) for name in readings(type(self)))]
        return {name: getattr(holder, name) for holder in holders for name in templates(type(holder))}

    def with_numbers(self, numbers: Mapping[str, Quantity]) -> Self:
        """Return a copy with other numbers of this part alone.

        Parameters
        ----------
        numbers
            By field name.
        """
        own = {name: number for name, number in numbers.items() if name in templates(type(self))}
        changed: dict[str, Any] = dict(own)
        for field in readings(type(self)):
            reading = getattr(self, field)
            inside = {n: q for n, q in numbers.items() if n in templates(type(reading))}
            changed[field] = dataclasses.replace(reading, **inside)
        return dataclasses.replace(self, **changed)

    def stated_domain(self) -> Domain | None:
        """Return the domain if it must be stated because the units of the numbers do not tell it."""
        choices = next(
            (f.metadata["domains"] for f in dataclasses.fields(self) if "domains" in f.metadata), ()
        )
        if not choices or _domain(self) == domain_by_units(choices, _templates(self), self.parameters()):
            return None
        return _domain(self)

    def children(self) -> Mapping[str, Part]:
        """Return the parts inside this one by name."""
        return {}

    def with_children(self, children: Mapping[str, Part]) -> Self:
        """Return a copy with other parts inside.

        Parameters
        ----------
        children
            All parts inside, by name.

        Raises
        ------
        UnknownNameError
            If there are children; a part without any takes none.
        """
        if children:
            raise unknown_name("part", next(iter(children)), ())
        return self

    def title(self) -> str:
        """Return one line that names the law and its numbers."""
        numbers = [f"{n} = {_short(q)}" for n, q in self.parameters().items()]
        domain = self.stated_domain()
        stated = [f"domain = {domain.name}"] if domain else []
        return f"{type(self).__name__}({', '.join(numbers + stated)})"


def _domain(part: Part) -> Domain | None:
    return getattr(part, "domain", None)


def _templates(part: Part) -> dict[str, Template]:
    kinds = [type(part), *(type(getattr(part, name)) for name in readings(type(part)))]
    return {name: template for kind in kinds for name, template in templates(kind).items()}


def _decided(part: Part, domains: tuple[Domain, ...]) -> Domain:
    domain = _domain(part)
    if domain is None:
        return domain_by_units(domains, _templates(part), part.parameters())
    if domain not in domains:
        raise ArrangementError(
            f"{type(part).__name__}: domain = {domain!r}",
            f"must be one of {', '.join(each.name for each in domains)}",
            next_step=f"for instance domain={domains[0].name.upper()}",
        )
    return domain


def _reading(part: Part, name: str, kinds: tuple[type[Reading], ...]) -> Reading:
    reading = getattr(part, name)
    if not isinstance(reading, kinds):
        raise ArrangementError(
            f"{type(part).__name__}: {name} = {reading!r}",
            f"must be one of {', '.join(f'{kind.__name__}(...)' for kind in kinds)}",
        )
    assert isinstance(reading, Reading)
    return reading


def _short(given: Quantity) -> str:
    if len(given.values) <= 4:
        return str(given)
    return f"<{len(given.values)} numbers in {typeset_unit(given.unit) or '1'}>"


def check_names(owner: str, names: Sequence[str], taken: Collection[str] = ()) -> None:
    """Check that names of parts are plain words, used once."""
    for number, name in enumerate(names):
        if not re.fullmatch(r"[A-Za-z_][A-Za-z0-9_]*", name):
            raise ArrangementError(
                f"{owner}: name '{name}'",
                "is not a plain word",
                next_step="use letters, digits and underscores, and a letter first",
            )
        if len(name) > LONGEST:
            raise ArrangementError(
                f"{owner}: name '{name[:20]}...'",
                f"has {len(name)} letters, more than {LONGEST}",
                next_step="give a shorter name",
            )
        if name in taken or name in names[:number]:
            raise ArrangementError(f"{owner}: name '{name}'", "is taken", next_step="choose another name")


def walk(part: Part, path: str = "") -> Iterator[tuple[str, Part]]:
    """Yield every part with its path, parents first, in written order."""
    yield path, part
    for name, child in part.children().items():
        yield from walk(child, f"{path}.{name}" if path else name)


def quantities(part: Part, path: str = "") -> dict[str, Quantity]:
    """Return all numbers of a part and everything in it by full name."""
    by_name: dict[str, Quantity] = {}
    for where, each in walk(part, path):
        by_name |= {f"{where}.{name}" if where else name: q for name, q in each.parameters().items()}
    return by_name


def find(part: Part, path: str) -> Part:
    """Return the part at a path."""
    parts = dict(walk(part))
    if path not in parts:
        raise unknown_name("part", path, (name for name in parts if name))
    return parts[path]


def replaced(part: Part, path: str, new: Part) -> Part:
    """Return a copy in which the part at a path is another one.

    ``path``: where; the empty path is the root itself.
    """
    if not path:
        return new
    find(part, path)
    head, _, tail = path.partition(".")
    children = dict(part.children())
    return part.with_children(children | {head: replaced(children[head], tail, new)})


def with_values(part: Part, values: Mapping[str, Quantity | float | tuple[float, ...]]) -> Part:
    """Return a copy with other numbers."""
    changes: dict[str, dict[str, Quantity]] = {}
    for name, value in resolved(quantities(part), values).items():
        owner, _, field_name = name.rpartition(".")
        changes.setdefault(owner, {})[field_name] = value
    # All numbers of a part change at once: rules between them, such as ascending knots, hold at the end.
    for owner, fields in changes.items():
        target = find(part, owner) if owner else part
        part = replaced(part, owner, target.with_numbers(fields))
    return part


def resolved(
    known: Mapping[str, Quantity], values: Mapping[str, Quantity | float | tuple[float, ...]]
) -> dict[str, Quantity]:
    """Return new numbers as whole quantities by full name.

    ``values``: quantities, or numbers in SI, by full name; ``name[3]`` is the third of a row. A number
    without a source says so, and what the old source spoke of.
    """
    changed: dict[str, Quantity] = {}
    for name, value in values.items():
        item = re.fullmatch(r"(.+)\[(\d+)\]", name)
        row, index = (item[1], int(item[2])) if item else (name, None)
        if row not in known:
            raise unknown_name("parameter", name, known)
        changed[row] = _changed(name, changed.get(row, known[row]), value, index)
    return changed


def _changed(
    name: str, old: Quantity, value: Quantity | float | tuple[float, ...], index: int | None
) -> Quantity:
    if index is None:
        return value if isinstance(value, Quantity) else old.with_value(value)
    if not isinstance(old.value, tuple) or not 1 <= index <= len(old.value):
        row = name.rpartition("[")[0]
        items = range(1, len(old.value) + 1) if isinstance(old.value, tuple) else ()
        raise unknown_name("parameter", name, [f"{row}[{i}]" for i in items] or [row])
    if isinstance(value, Quantity) and not same_dimension(value.unit, old.unit):
        raise UnitError(f"{name} = {value}", f"the others of the row are in '{old.unit}'")
    number = value.number if isinstance(value, Quantity) else value
    return old.with_value(tuple(number if i == index else v for i, v in enumerate(old.value, start=1)))  # type: ignore[misc]
