"""A machine whose every part has another name: the same machine."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass, replace
from typing import TypeVar

from nlsdesign.components import Assembly
from nlsdesign.components.core.element import Tie
from nlsdesign.components.core.part import Part
from nlsdesign.components.mechanics.gear import Gear
from nlsdesign.components.sensing.sensors import Sensor

Value = TypeVar("Value")
ROLE = "cam"
"""The one inner name that a deck prescribes: what an element stands behind."""

WORDS = (
    *("finger", "wall", "tendon", "strip", "hard", "soft", "coil", "oil", "collar", "rub"),
    *("dial", "ring", "meter", "gauge", "bolt", "clip", "pin"),
)


def in_words(number: int, old: str) -> str:
    """Other words, which sort differently."""
    return WORDS[number] if number < len(WORDS) else f"part{number}"


def nested(number: int, old: str) -> str:
    """Names that contain each other: a, aa, aaa, ..."""
    return "a" * (number + 1)


def against_the_order(number: int, old: str) -> str:
    """Names whose alphabetic order is the reverse of the written one."""
    return f"p{99 - number}"


def exchanged(number: int, old: str) -> str:
    """Names that mean another part in the published deck: the motor is called spring."""
    swapped = {"motor": "spring", "spring": "motor", "load": "motor_encoder", "motor_encoder": "load"}
    return swapped.get(old, old)


Scheme = Callable[[int, str], str]
SCHEMES: tuple[Scheme, ...] = (in_words, nested, against_the_order, exchanged)


@dataclass(frozen=True)
class Renamed:
    """A machine with other names, and how to translate.

    ``paths`` gives the new path of each part by its old one.
    """

    assembly: Assembly
    paths: Mapping[str, str]

    def name(self, old: str) -> str:
        """Return what a full name of the original is called here; other names stay."""
        for path in sorted(self.paths, key=len, reverse=True):
            if old == path or old.startswith(f"{path}."):
                return self.paths[path] + old[len(path) :]
        return old

    def keys(self, values: Mapping[str, Value]) -> dict[str, Value]:
        """Return a mapping with its keys translated."""
        return {self.name(key): value for key, value in values.items()}


def renamed(assembly: Assembly, scheme: Scheme) -> Renamed:
    """Return the machine with every part renamed, also those inside others, and all that refers to them."""
    paths: dict[str, str] = {}
    for number, (path, _) in enumerate(assembly.walk()):
        owner, _, own = path.rpartition(".")
        new = own if own == ROLE and owner else scheme(number, own)
        paths[path] = f"{paths[owner]}.{new}" if owner else new
    machine = Renamed(assembly, paths)
    parts = tuple((paths[name], _renamed(part, name, machine)) for name, part in assembly.parts)
    return replace(machine, assembly=replace(assembly, parts=parts))


def _renamed(part: Part, path: str, machine: Renamed) -> Part:
    children = {
        machine.paths[f"{path}.{name}"].rpartition(".")[2]: _renamed(child, f"{path}.{name}", machine)
        for name, child in part.children().items()
    }
    if children:
        part = part.with_children(children)
    if isinstance(part, Tie | Gear):
        part = replace(part, between=tuple(machine.paths[body] for body in part.between))
    if isinstance(part, Sensor):
        part = replace(part, of=machine.name(part.of))
    return part
