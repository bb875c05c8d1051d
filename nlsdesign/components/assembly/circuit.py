"""The spring–dashpot circuit of an element (series and parallel), as lines of text."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import TypeAlias

from ..core.element import Combination, Element
from ..core.series import Series
from ..transmission.cam_drive import Through

GLYPHS = {
    "spring": "╱╲╱╲",
    "dashpot": "─[│─",
    "friction": "▟▛▟▛",
    "cam": "─◖─",
    "box": "─▭─",
    "around": "─◇─",
}
"""Text symbol of an element, by the name of its picture."""


@dataclass(frozen=True)
class Leaf:
    """One element."""

    label: str
    picture: str


@dataclass(frozen=True)
class Row:
    """Circuits in series: forces are equal, extensions add."""

    items: tuple[Circuit, ...]


@dataclass(frozen=True)
class Stack:
    """Circuits in parallel: extensions are equal, forces add.

    Parameters
    ----------
    items
        From top to bottom, two at least.
    """

    items: tuple[Circuit, ...]


Circuit: TypeAlias = Leaf | Row | Stack


def circuit_of(element: Element, label: str) -> Circuit:
    """Return the circuit of an element."""
    if isinstance(element, Through):
        name, behind = element.behind
        return Row((Leaf("cam", "cam"), circuit_of(behind, name)))
    if not isinstance(element, Combination):
        return Leaf(label, element.picture)
    inside = [(name, member) for name, member in element.members]
    if isinstance(element, Series):
        return Row(tuple(circuit_of(member, f"{label}.{name}") for name, member in inside))
    items = tuple(circuit_of(member, name) for name, member in inside)
    together = items[0] if len(items) == 1 else Stack(items)
    # A parallel or a specimen is no more than its members; other combinations act on them and are drawn.
    return together if element.picture == "none" else Row((Leaf(label, element.picture), together))


def circuit_lines(circuit: Circuit, left: str, right: str) -> list[str]:
    """Return a circuit between two ends as lines of text."""
    lines = _lines(circuit)
    ends = f"({left})", f"─({right})"
    rest = [" " * len(end) for end in ends]
    return [
        ((ends[0] if n == 0 else rest[0]) + line + (ends[1] if n == 0 else rest[1])).rstrip()
        for n, line in enumerate(lines)
    ]


def _lines(circuit: Circuit) -> list[str]:
    """Return lines of equal width; the terminals are the ends of the first."""
    if isinstance(circuit, Leaf):
        return [f"─{GLYPHS[circuit.picture]} {circuit.label} ─"]
    parts = [_lines(item) for item in circuit.items]
    return _beside(parts) if isinstance(circuit, Row) else _below(parts)


def _beside(parts: Sequence[list[str]]) -> list[str]:
    height = max(len(part) for part in parts)
    lines = []
    for number in range(height):
        pieces = [part[number] if number < len(part) else " " * len(part[0]) for part in parts]
        lines.append("".join(pieces))
    return lines


def _below(parts: Sequence[list[str]]) -> list[str]:
    width = max(len(part[0]) for part in parts)
    lines = []
    for number, part in enumerate(parts):
        last = number == len(parts) - 1
        left, right = "┬┬" if number == 0 else "└┘" if last else "├┤"
        lines.append(left + part[0].ljust(width, "─") + right)
        bar = " " if last else "│"
        lines += [bar + line.ljust(width) + bar for line in part[1:]]
    return lines
