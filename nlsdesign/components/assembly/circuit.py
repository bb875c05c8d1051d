"""The spring–dashpot circuit of an element (series and parallel), as lines of text."""

from __future__ import annotations

import re
import textwrap
from collections.abc import Sequence
from dataclasses import dataclass
from typing import TypeAlias

from ..core.element import Combination, Element, Tie
from ..core.part import Part
from ..core.series import Series
from ..mechanics.gear import Transmission
from ..sensing.sensors import Sensor
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
    """Circuits in parallel: extensions are equal, forces add."""

    items: tuple[Circuit, ...]  # from top to bottom, two at least


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


_WIRE = set(" ─│")
_TREE = re.compile(r"^ *(│  )*([├└]─ )?")
_WITHIN = re.compile(r"(?<!,) (?=[^()]*\)$)")
_NARROWEST = 40
"""Columns; a narrower drawing is not broken further."""


def draw(title: str, parts: Sequence[tuple[str, Part]], *, width: int | None = None) -> str:
    """Return named parts with their circuits, and as a tree with their laws and numbers.

    ``width``: most letters of a line; without it lines are as long as they are.
    """
    lines = [title]
    for name, part in parts:
        if isinstance(part, Tie):
            ends = f" ── [{name}] ── ".join(_ends(part))
            lines.append(f"  {ends}   {part.element.title()}")
            if part.element.children():
                circuit = circuit_of(part.element, name)
                drawn = [f"    {line}" for line in circuit_lines(circuit, *_ends(part))]
                lines += drawn if width is None else _broken(drawn, max(width, _NARROWEST))
            lines += _branches(part.element, "    ")
        elif isinstance(part, Transmission):
            lines.append(f"  {part.between[0]} ══ [{name}] ══ {part.between[1]}   {part.title()}")
        elif isinstance(part, Sensor):
            lines.append(f"  {name} ◁ {part.of}   {part.title()}")
        else:
            lines.append(f"  ({name})   {part.title()}")
            lines += _branches(part, "    ")
    if width is not None:
        lines = [part for line in lines for part in _wrapped(line, max(width, _NARROWEST))]
    return "\n".join(lines)


def _wrapped(line: str, width: int) -> list[str]:
    """Return a line of the tree as several, with the branches that pass it."""
    if len(line) <= width:
        return [line]
    branch = _TREE.match(line)
    assert branch is not None  # it matches nothing too
    below = branch[0].replace("├─", "│ ").replace("└─", "  ") + "    "
    wrapper = textwrap.TextWrapper(width, subsequent_indent=below, break_on_hyphens=False)
    # A number stays with its name and unit: the lines break behind commas.
    held = _WITHIN.sub("\N{NO-BREAK SPACE}", line)
    if max(map(len, held.split(" "))) > width - len(below):
        held = line
    return [part.replace("\N{NO-BREAK SPACE}", " ") for part in wrapper.wrap(held)]


def _broken(lines: Sequence[str], width: int) -> list[str]:
    """Return a drawing in pieces below one another, cut where all its lines are wire."""
    left, pieces = list(lines), []
    while max(map(len, left)) > width:
        longest = max(map(len, left))
        left = [line.ljust(longest) for line in left]
        places = range(width - 2, width // 2, -1)
        cut = next((i for i in places if all(set(line[i - 1 : i + 1]) <= _WIRE for line in left)), width - 2)
        pieces += [f"{line[:cut]} …" if line[:cut].strip() else "" for line in left]
        left = [f"    … {line[cut:]}" if line[cut:].strip() else "" for line in left]
    return [line.rstrip() for line in (*pieces, *left)]


def _ends(part: Tie) -> tuple[str, str]:
    return part.between[0], part.between[1] if len(part.between) == 2 else "frame"


def _branches(part: Part, indent: str) -> list[str]:
    children = list(part.children().items())
    lines = []
    for number, (name, child) in enumerate(children):
        last = number == len(children) - 1
        lines.append(f"{indent}{'└─' if last else '├─'} {name}: {child.title()}")
        lines += _branches(child, indent + ("   " if last else "│  "))
    return lines
