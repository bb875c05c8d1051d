"""Drawings of the flow charts in the pages: floors of boxes, and lines from each to those below."""

from __future__ import annotations

import re
from collections.abc import Mapping, Sequence
from html import escape
from itertools import pairwise

_WIDTH, _ROW, _BOX, _GAP = 720, 74, 30, 12


def drawing(chart: str) -> str:
    """Return a flow chart of Mermaid as SVG in an HTML block; each part of a chart with parts by itself.

    Parameters
    ----------
    chart
        Text of the chart: edges ``a & b --> c``, perhaps inside ``subgraph name … end``.
    """
    parts = re.findall(r"subgraph (\w+)\n(.*?)\n\s*end", chart, re.S) or [("", chart)]
    drawn = [_figure(name, _edges(text)) for name, text in parts]
    return '\n<div class="charts">\n' + "\n".join(drawn) + "\n</div>\n\n"


def _edges(text: str) -> list[tuple[str, str]]:
    edges = []
    for line in text.splitlines():
        steps = [[name.strip() for name in step.split("&")] for step in line.split("-->")]
        for above, below in pairwise(steps):
            edges += [(a, b) for a in above for b in below]
    return edges


def _floors(edges: Sequence[tuple[str, str]]) -> list[list[str]]:
    names = list(dict.fromkeys(name for edge in edges for name in edge))
    depth = dict.fromkeys(names, 0)
    for _ in names:
        for above, below in edges:
            depth[below] = max(depth[below], depth[above] + 1)
    floors = [[name for name in names if depth[name] == level] for level in range(max(depth.values()) + 1)]
    return _ordered(floors, edges)


def _ordered(floors: list[list[str]], edges: Sequence[tuple[str, str]]) -> list[list[str]]:
    """Return the floors with each box below the middle of what leads to it."""
    place = {name: (i + 0.5) / len(floor) for floor in floors for i, name in enumerate(floor)}
    for floor in floors[1:]:
        above = {name: [place[a] for a, b in edges if b == name] for name in floor}
        floor.sort(key=lambda name: sum(above[name]) / max(len(above[name]), 1))
        place |= {name: (i + 0.5) / len(floor) for i, name in enumerate(floor)}
    return floors


def _figure(title: str, edges: Sequence[tuple[str, str]]) -> str:
    floors = _floors(edges)
    widths = {name: 8.2 * len(name) + 18 for floor in floors for name in floor}
    width = max(sum(widths[n] + _GAP for n in floor) for floor in floors)
    height = _ROW * len(floors) - (_ROW - _BOX) + 4
    centres: dict[str, tuple[float, float]] = {}
    for level, floor in enumerate(floors):
        room = (width - sum(widths[n] for n in floor)) / len(floor)
        x = room / 2
        for name in floor:
            centres[name] = (x + widths[name] / 2, 2 + level * _ROW + _BOX / 2)
            x += widths[name] + room
    lines = [_line(centres[a], centres[b]) for a, b in edges]
    boxes = [_box(name, centres[name], widths) for floor in floors for name in floor]
    words = "; ".join(f"{a} uses {b}" for a, b in edges)
    heading = f"<figcaption>{title}</figcaption>" if title else ""
    return (
        f'<figure class="chart">{heading}<svg viewBox="0 0 {width:.0f} {height}" role="img" '
        f'style="max-width: {width:.0f}px" aria-label="{escape(words)}">'
        + "".join(lines + boxes)
        + "</svg></figure>"
    )


def _line(above: tuple[float, float], below: tuple[float, float]) -> str:
    (a, top), (b, bottom) = above, below
    top, bottom = top + _BOX / 2, bottom - _BOX / 2
    bend = (bottom - top) * 0.5
    start, leave = f"M{a:.1f} {top:.1f}", f"C{a:.1f} {top + bend:.1f}"
    return f'<path d="{start}{leave} {b:.1f} {bottom - bend:.1f} {b:.1f} {bottom:.1f}"/>'


def _box(name: str, centre: tuple[float, float], widths: Mapping[str, float]) -> str:
    x, y = centre
    return (
        f'<rect x="{x - widths[name] / 2:.1f}" y="{y - _BOX / 2:.1f}" width="{widths[name]:.1f}" '
        f'height="{_BOX}" rx="5"/><text x="{x:.1f}" y="{y + 4.5:.1f}">{escape(name)}</text>'
    )
