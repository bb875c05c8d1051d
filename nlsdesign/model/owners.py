"""Which part declared a variable, and how the numbers of a part are called."""

from __future__ import annotations

from collections.abc import Collection, Iterator, Mapping
from dataclasses import dataclass, replace

from ..components.core.part import Part


@dataclass(frozen=True)
class Owners:
    """Which part declared a variable: path of the part by name of the variable, in order of declaration."""

    parameters: Mapping[str, str]
    states: Mapping[str, str]
    inputs: Mapping[str, str]
    signals: Mapping[str, str]

    def keeping(self, states: Collection[str], inputs: Collection[str]) -> Owners:
        """Return a copy with these states and inputs only."""
        return replace(
            self,
            states={name: path for name, path in self.states.items() if name in states},
            inputs={name: path for name, path in self.inputs.items() if name in inputs},
        )


def declared_by(paths: Collection[str], owned: Mapping[str, str]) -> Iterator[str]:
    """Yield the names of what some parts have declared."""
    return (name for name, path in owned.items() if path in paths)


def number_names(path: str, part: Part, field: str) -> list[str]:
    """Return the names that one field of a part has in the model: one, or one for each item of a row."""
    given, name = part.parameters()[field], f"{path}.{field}"
    if not isinstance(given.value, tuple):
        return [name]
    return [f"{name}[{number}]" for number in range(1, len(given.values) + 1)]
