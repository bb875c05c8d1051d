"""Coils of a maker in an assembly: a row of a catalogue stands for the numbers of the declared coil."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import replace
from typing import Any, NamedTuple

from ...foundation.errors import ArrangementError, unknown_name
from ...foundation.quantity import Quantity
from ..core.part_numbers import readings, templates
from ..mechanics.coils import Coil
from .named_parts import Assembly


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
