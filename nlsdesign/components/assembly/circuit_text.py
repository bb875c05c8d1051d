"""The circuit of an assembly as text."""

from __future__ import annotations

from collections.abc import Sequence

from ..core.part import Part
from ..core.tie import Tie
from ..mechanics.gear import Gear
from ..sensing.sensors import Sensor
from .circuit import circuit_lines, circuit_of


def draw(title: str, parts: Sequence[tuple[str, Part]]) -> str:
    """Return named parts with their circuits, and as a tree with their laws and numbers.

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
            ends = f" ── [{name}] ── ".join(_ends(part))
            lines.append(f"  {ends}   {part.element.title()}")
            if part.element.children():
                circuit = circuit_of(part.element, name)
                lines += [f"    {line}" for line in circuit_lines(circuit, *_ends(part))]
            lines += _branches(part.element, "    ")
        elif isinstance(part, Gear):
            lines.append(f"  {part.between[0]} ══ [{name}] ══ {part.between[1]}   {part.title()}")
        elif isinstance(part, Sensor):
            lines.append(f"  {name} ◁ {part.of}   {part.title()}")
        else:
            lines.append(f"  ({name})   {part.title()}")
            lines += _branches(part, "    ")
    return "\n".join(lines)


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
