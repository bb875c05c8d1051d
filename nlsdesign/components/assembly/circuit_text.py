"""The circuit of an assembly as text."""

from __future__ import annotations

import re
import textwrap
from collections.abc import Sequence

from ..core.part import Part
from ..core.tie import Tie
from ..mechanics.gear import Transmission
from ..sensing.sensors import Sensor
from .circuit import circuit_lines, circuit_of

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
