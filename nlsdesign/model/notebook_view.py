"""A flat model in a notebook: what goes in, what it keeps and what comes out, and its equations."""

from __future__ import annotations

from collections.abc import Sequence
from html import escape
from typing import Protocol

from ..foundation.quantity import typeset_unit

LINE = 18.0
"""Height of a line in pixels."""
_STYLE = "fill:none;stroke:currentColor;stroke-width:1.5"
_WORDS = "font:12px system-ui,sans-serif;fill:currentColor"


class Named(Protocol):
    """Something with a name and a unit."""

    @property
    def name(self) -> str:
        """Hierarchical name."""
        ...

    @property
    def unit(self) -> str:
        """SI unit."""
        ...


def model_html(name: str, description: str, groups: Sequence[Sequence[Named]], latex: str) -> str:
    """Return a model as HTML.

    ``latex``: equations, for the mathematics of the notebook; nothing if empty.
    """
    title = f"<p><b>{escape(name)}</b> {escape(description)}</p>"
    shown = f"<div>$${escape(latex)}$$</div>" if latex else ""
    return f"<div>{title}{block_svg(name, *groups)}{shown}</div>"


def block_svg(name: str, inputs: Sequence[Named], states: Sequence[Named], outputs: Sequence[Named]) -> str:
    """Return a block diagram as SVG."""
    left, inside, right = (
        7.0 * max((len(_label(v)) for v in g), default=0) for g in (inputs, states, outputs)
    )
    inside = max(inside, 90.0) + 24.0
    height = LINE * max(len(inputs), len(states) + 1, len(outputs)) + 20.0
    start, end = left + 40.0, left + 40.0 + inside
    width = end + 40.0 + right
    drawn = [
        f'<rect x="{start:.0f}" y="4" width="{inside:.0f}" height="{height:.0f}" rx="6" style="{_STYLE}"/>',
        _text(start + inside / 2, 20.0, "states" if states else "no states", "middle"),
    ]
    drawn += [
        _text(start + inside / 2, 20.0 + LINE * n, _label(v), "middle") for n, v in enumerate(states, 1)
    ]
    for group, edge, way, anchor in ((inputs, start, -1, "end"), (outputs, end, 1, "start")):
        for number, variable in enumerate(group):
            y = 20.0 + LINE * number
            drawn.append(_text(edge + way * 36.0, y, _label(variable), anchor))
            tip = edge - 2.0 if way < 0 else edge + 30.0
            arrow = f"M{edge + way * 32:.0f} {y - 4:.0f}H{edge:.0f}M{tip - 6:.0f} {y - 8:.0f}l6 4l-6 4"
            drawn.append(f'<path style="{_STYLE}" d="{arrow}"/>')
    return (
        f'<svg xmlns="http://www.w3.org/2000/svg" width="{width:.0f}" height="{height + 8:.0f}" role="img" '
        f'viewBox="0 0 {width:.0f} {height + 8:.0f}" aria-label="Model {escape(name)}">{"".join(drawn)}</svg>'
    )


def _label(variable: Named) -> str:
    return f"{variable.name} [{typeset_unit(variable.unit) or '1'}]"


def _text(x: float, y: float, words: str, anchor: str) -> str:
    return f'<text x="{x:.0f}" y="{y:.0f}" text-anchor="{anchor}" style="{_WORDS}">{escape(words)}</text>'
