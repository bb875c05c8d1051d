"""The circuit of an assembly as text."""

from __future__ import annotations

from collections.abc import Sequence

from .gear import Gear
from .part import Part
from .sensors import Sensor
from .tie import Tie


def draw(title: str, parts: Sequence[tuple[str, Part]]) -> str:
    """Return named parts as a tree with their laws and numbers.

    Parameters
    ----------
    title
        First line.
    parts
        Pairs of name and body, gear, tie or sensor.
    """
    lines = [title]
    for name, part in parts:
        if isinstance(part, Tie):
            ends = " ── ".join((part.between[0], f"[{name}]", *(part.between[1:] or ("frame",))))
            lines.append(f"  {ends}   {part.element.title()}")
            lines += _branches(part.element, "    ")
        elif isinstance(part, Gear):
            lines.append(f"  {part.between[0]} ══ [{name}] ══ {part.between[1]}   {part.title()}")
        elif isinstance(part, Sensor):
            lines.append(f"  {name} ◁ {part.of}   {part.title()}")
        else:
            lines.append(f"  ({name})   {part.title()}")
    return "\n".join(lines)


def _branches(part: Part, indent: str) -> list[str]:
    children = list(part.children().items())
    lines = []
    for number, (name, child) in enumerate(children):
        last = number == len(children) - 1
        lines.append(f"{indent}{'└─' if last else '├─'} {name}: {child.title()}")
        lines += _branches(child, indent + ("   " if last else "│  "))
    return lines
