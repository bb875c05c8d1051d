"""The spring–dashpot circuit of an element (series and parallel), as lines of text.

The circuits of an assembly as a small picture (SVG), for notebooks; without a plotting library.
"""

from __future__ import annotations

import re
import textwrap
from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from html import escape
from typing import Any, NamedTuple, TypeAlias

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


CELL, ROW, END = 96.0, 46.0, 74.0
"""Width of an element, height of a row, width of a body, in pixels."""

# Paths around the middle of a cell of 96 pixels; the wire is at height zero.
_PICTURES = {
    "spring": "M0 0h20l4 -9 8 18 8 -18 8 18 8 -18 8 18 8 -18 4 9h20",
    "dashpot": "M0 0h40M40 -10h22M40 10h22M40 -10v20M54 -7v14M54 0h42",
    "friction": "M0 0h30M30 -8h36v16h-36zM34 8l8 -16M44 8l8 -16M54 8l8 -16M66 0h30",
    "cam": "M0 0h32M48 -13a13 13 0 0 1 0 26a20 13 0 0 1 0 -26M48 0h48",
    "box": "M0 0h30M30 -9h36v18h-36zM66 0h30",
    "around": "M0 0h36M36 0l12 -10 12 10 -12 10zM60 0h36",
}
_STYLE = "fill:none;stroke:currentColor;stroke-width:1.5;stroke-linejoin:round"
_TEXT_STYLE = "font:11px system-ui,sans-serif;fill:currentColor"


class Size(NamedTuple):
    """Columns and rows that a circuit occupies."""

    columns: int
    rows: int


def size_of(circuit: Circuit) -> Size:
    """Return the size of a circuit in cells."""
    if isinstance(circuit, Leaf):
        return Size(1, 1)
    sizes = [size_of(item) for item in circuit.items]
    if isinstance(circuit, Row):
        return Size(sum(s.columns for s in sizes), max(s.rows for s in sizes))
    return Size(max(s.columns for s in sizes), sum(s.rows for s in sizes))


class NotebookCircuits:
    """How named parts show themselves in a notebook: the circuits as a picture, and the parts as text."""

    name: str
    description: str
    parts: tuple[tuple[str, Part], ...]

    def _repr_html_(self) -> str:
        """Return the circuits as a picture and the parts with their numbers."""
        details = f"<details><summary>parts and numbers</summary><pre>{escape(str(self))}</pre></details>"
        title = f"<p><b>{escape(self.name)}</b> {escape(self.description)}</p>"
        return f"<div>{title}{assembly_svg(self.name, self.parts)}{details}</div>"

    def _repr_mimebundle_(self, include: Any = None, exclude: Any = None) -> dict[str, str]:
        """Return text and picture; a notebook chooses the richest form that it can show."""
        return {"text/plain": str(self), "text/html": self._repr_html_()}


def assembly_svg(name: str, parts: Sequence[tuple[str, Part]]) -> str:
    """Return all bodies, ties, gears and sensors as one picture, one line each, with their circuits.

    ``name``: of the assembly; the label for screen readers.
    """
    drawn, top, width = [], 8.0, 0.0
    for label, part in parts:
        if isinstance(part, Tie):
            circuit = circuit_of(part.element, label)
            ends = part.between[0], part.between[1] if len(part.between) == 2 else "frame"
        elif isinstance(part, Transmission):
            circuit, ends = Leaf(label, "around"), part.between
        else:
            continue
        size = size_of(circuit)
        drawn += list(_tie(circuit, size, ends, top))
        top += size.rows * ROW
        width = max(width, 2 * END + size.columns * CELL)
    sensors = [f"{n} ◁ {part.of}" for n, part in parts if isinstance(part, Sensor)]
    for line in sensors:
        drawn.append(_text(8.0, top + 18.0, line, "start"))
        top += 20.0
    width = max(width, 240.0, 8.0 * max((len(line) for line in sensors), default=0))
    head = (
        f'<svg xmlns="http://www.w3.org/2000/svg" width="{width + 8:.0f}" height="{top + 8:.0f}" '
        f'viewBox="0 0 {width + 8:.0f} {top + 8:.0f}" role="img" aria-label="Circuit of {escape(name)}">'
    )
    return head + "".join(drawn) + "</svg>"


def _tie(circuit: Circuit, size: Size, ends: tuple[str, ...], top: float) -> Iterator[str]:
    wire = top + ROW / 2
    right = END + size.columns * CELL
    yield _body(4.0, wire, ends[0])
    yield _body(right, wire, ends[1])
    yield from _drawn(circuit, END, wire, size.columns * CELL)


def _drawn(circuit: Circuit, left: float, wire: float, width: float) -> Iterator[str]:
    """Draw a circuit from left to right; surplus width is filled with wire."""
    if isinstance(circuit, Leaf):
        yield _line(_PICTURES[circuit.picture], f' transform="translate({left:.0f} {wire:.0f})"')
        yield _line(f"M{left + CELL:.0f} {wire:.0f}H{left + width:.0f}")
        yield _text(left + CELL / 2, wire + 21.0, circuit.label, "middle")
        return
    sizes = [size_of(item) for item in circuit.items]
    if isinstance(circuit, Row):
        for number, (item, size) in enumerate(zip(circuit.items, sizes, strict=True)):
            share = size.columns * CELL
            last = number == len(sizes) - 1
            yield from _drawn(item, left, wire, width if last else share)
            left, width = left + share, width - share
        return
    at = wire
    for item, size in zip(circuit.items, sizes, strict=True):
        yield from _drawn(item, left, at, width)
        lowest, at = at, at + size.rows * ROW
    for x in (left, left + width):
        yield _line(f"M{x:.0f} {wire:.0f}V{lowest:.0f}")


def _body(left: float, wire: float, name: str) -> str:
    size = f'width="{END - 4:.0f}" height="26" rx="5"'
    box = f'<rect x="{left:.0f}" y="{wire - 13:.0f}" {size} style="{_STYLE}"/>'
    return box + _text(left + END / 2 - 2, wire + 4.0, name, "middle")


def _line(path: str, placed: str = "") -> str:
    return f'<path{placed} style="{_STYLE}" d="{path}"/>'


def _text(x: float, y: float, text: str, anchor: str) -> str:
    return f'<text x="{x:.0f}" y="{y:.0f}" text-anchor="{anchor}" style="{_TEXT_STYLE}">{escape(text)}</text>'
