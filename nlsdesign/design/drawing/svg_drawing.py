"""SVG of a cam at scale 1:1, with true arcs."""

from __future__ import annotations

import numpy as np

from ...foundation.quantity import MM
from .arc_path import ArcPath
from .cam_part import CamPart

_TEXT = 2.2


def part_svg(part: CamPart, *, note: str = "") -> str:
    """Return a cam as it is made, at scale 1:1, its cable at angle zero and at both ends of the contour."""
    sizes = [float(np.abs(cable.points).max()) for cable in part.cables]
    sizes += [float(np.abs(each.centre).max()) + each.diameter / 2.0 for each in part.rollers]
    reach = 1.12 * MM * max(part.outermost, *sizes)
    body = []
    if part.base_radius:
        body.append(
            _circle(0.0, 0.0, part.base_radius, 'fill="#f0f0f0" stroke="#606060" stroke-width="0.12"')
        )
    body += [
        f'<path class="edge" d="{path_data(outline)}" fill="#d4d8dc" stroke="#202020" stroke-width="0.15"/>'
        for outline in part.outlines
    ]
    for hole in part.holes:
        look = (
            'fill="none" stroke="#202020" stroke-width="0.12" stroke-dasharray="0.8 0.5"'
            if hole.base_only
            else 'fill="white" stroke="#202020" stroke-width="0.12"'
        )
        body.append(_circle(hole.centre[0], hole.centre[1], hole.diameter / 2.0, look))
    look = 'fill="none" stroke="#b03020" stroke-width="0.12"'
    body += [_circle(each.centre[0], each.centre[1], each.diameter / 2.0, look) for each in part.rollers]
    body += [
        f'<path class="cable" d="{path_data(cable)}" stroke="#b03020" stroke-width="0.1"/>'
        for cable in part.cables
    ]
    body.append('<path d="M -1.5 0 H 1.5 M 0 -1.5 V 1.5" stroke="#202020" stroke-width="0.08"/>')
    text = (
        f"Machined edge for a {part.counterpart} of radius "
        f"{MM * part.number(f'{part.counterpart}_radius'):.4g} mm, "
        f"plate {MM * part.number('thickness'):.4g} mm; mm, 1:1"
    )
    return page(reach, body, lines=[text, note])


def page(reach: float, body: list[str], *, lines: list[str]) -> str:
    """Return a square page about the axis with some lines of text below.

    ``reach``: half the width of the drawing in mm. ``body``: elements in mm with y upwards. ``lines``: text
    below the drawing; the first is the title too.
    """
    lines = [line.replace("&", "&amp;").replace("<", "&lt;").replace(">", "&gt;") for line in lines if line]
    longest = max(len(line) for line in lines)
    size = min(_TEXT, 2.0 * reach / (0.56 * longest))
    below = (len(lines) + 0.5) * 1.5 * size
    width, height = 2.0 * reach, 2.0 * reach + below
    texts = [
        f'<text x="{-reach + size:.3f}" y="{reach + 1.5 * size * (index + 0.6):.3f}" '
        f'font-family="sans-serif" font-size="{size:.3f}">{line}</text>'
        for index, line in enumerate(lines)
    ]
    return (
        "\n".join(
            [
                f'<svg xmlns="http://www.w3.org/2000/svg" width="{width:.3f}mm" height="{height:.3f}mm" '
                f'viewBox="{-reach:.3f} {-reach:.3f} {width:.3f} {height:.3f}">',
                f"<title>{'. '.join(lines)}</title>",
                f'<rect x="{-reach:.3f}" y="{-reach:.3f}" width="{width:.3f}" height="{height:.3f}" '
                'fill="white"/>',
                '<g transform="scale(1,-1)" fill="none" stroke-linejoin="round">',
                *body,
                "</g>",
                *texts,
                "</svg>",
            ]
        )
        + "\n"
    )


def path_data(path: ArcPath) -> str:
    """Return the path in mm as the data of an SVG path, y upwards."""
    points, (_, ends, bulges) = path.points * MM, path.ends
    steps = [f"M {points[0][0]:.5f} {points[0][1]:.5f}"]
    for (x, y), bulge, radius in zip(ends * MM, bulges, np.abs(path.radii) * MM, strict=True):
        if bulge == 0.0:
            steps.append(f"L {x:.5f} {y:.5f}")
        else:
            steps.append(
                f"A {radius:.6f} {radius:.6f} 0 {int(abs(bulge) > 1.0)} {int(bulge > 0.0)} {x:.5f} {y:.5f}"
            )
    return " ".join([*steps, "Z"] if path.closed else steps)


def _circle(x: float, y: float, radius: float, look: str) -> str:
    return f'<circle cx="{MM * x:.5f}" cy="{MM * y:.5f}" r="{MM * radius:.5f}" {look}/>'
