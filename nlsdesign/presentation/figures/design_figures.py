"""A finished design: cam, cable and rubber to scale with dimensions, and how near each limit is."""

from __future__ import annotations

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure

from ...design import CamDesign, Contour, LimitState
from ...design.statics.contour import turn
from ...foundation.arrays import Array
from ...foundation.quantity import MM, parse_unit, with_unit
from .style import (
    AFTER,
    BLUE,
    GREEN,
    GRID,
    INK,
    LIMIT,
    MUTED,
    ORANGE,
    SURFACE,
    VERMILLION,
    WIDTH,
    described,
    panels,
    styled,
)


@styled
def design_picture(design: CamDesign) -> Figure:
    """Draw cam, cable and rubber to scale, at angle zero and at the last angle, with dimensions.

    Parameters
    ----------
    design
        Finished.
    """
    last = float(design.contour.angles[-1])
    reach = float(design.contour.radii.max())
    length, _ = next(iter(_pieces(design)), (0.0, 0.0))
    wide = _end_of_cable(design.contour, reach)[0] + length + float(design.curves.extensions.max()) + 8e-3
    left = -wide if np.isfinite(design.contour.anchor_distance) else -1.3 * reach
    figure, axes = panels(2, 1, height=4.0, sharex=True)
    for panel, angle in zip(axes, (0.0, last), strict=True):
        _draw(panel, design, angle)
    low, high = (pick([end(panel) for panel in axes]) for pick, end in ((min, _lowest), (max, _highest)))
    low -= 0.08 * (wide - left) * MM  # room for the dimensions
    for panel in axes:
        panel.set_xlim(left * MM, wide * MM)
        panel.set_ylim(low, high + 2.0)
    figure.set_figheight(2.0 * (WIDTH - 0.8) * (high + 2.0 - low) / ((wide - left) * MM) + 1.2)
    _dimension_radius(axes[0], design, low + 0.02 * (wide - left) * MM)
    axes[1].set_xlabel(f"distance from the centre in mm{_rubber_note(design)}")
    radius = float(design.contour.radii.max()) * MM
    return described(
        figure,
        f"The designed cam at 0° and {np.degrees(last):.0f}°, to scale: radius {radius:.1f} mm, lever arm up "
        f"to {MM * float(design.contour.lever_arms.max()):.1f} mm; the rubber is "
        f"{_rubber_words(design)}.",
    )


@styled
def limit_margins(design: CamDesign) -> Figure:
    """Draw how far each limit is used: the bar ends at 100 % where the design sits on it.

    Parameters
    ----------
    design
        Finished.
    """
    states = list(design.limits)
    figure, (axes,) = panels(height=0.9 + 0.34 * max(1, len(states)))
    places = -np.arange(len(states), dtype=float)
    used = np.array([_used(state) for state in states])
    tones = [LIMIT.light if state.active else AFTER.light for state in states]
    bars = axes.barh(places, np.clip(used, 0.0, 1.2), 0.6, color=tones, edgecolor=SURFACE.light)
    for bar, state in zip(bars, states, strict=True):
        bar.set_hatch("///" if state.active else "")
    axes.axvline(1.0, color=INK.light, linewidth=1.0)
    for place, state, share in zip(places, states, used, strict=True):
        axes.annotate(
            _words(state), (max(min(float(share), 1.2), 1.0), place), (6, 0), textcoords="offset points",
            fontsize=8, va="center", color=INK.light,
        )  # fmt: skip
    axes.set_yticks(places, [f"{state.of} ({'≤' if state.upper else '≥'})" for state in states])
    axes.set_xticks([0.0, 0.25, 0.5, 0.75, 1.0], ["0", "25 %", "50 %", "75 %", "limit"])
    axes.set_xlim(0.0, 1.55)
    axes.grid(visible=False, axis="y")
    axes.set_title("Use of each limit")
    binding = ", ".join(dict.fromkeys(state.of for state in states if state.active)) or "none"
    return described(figure, f"Bars of {len(states)} limits; the design sits on: {binding}.")


def _lowest(axes: Axes) -> float:
    return float(axes.dataLim.y0)


def _highest(axes: Axes) -> float:
    return float(axes.dataLim.y1)


def _used(state: LimitState) -> float:
    """Return the share of a limit that is used; a lower limit is used up where the value falls to it."""
    if state.upper:
        return 0.0 if state.value <= 0.0 else 1.2 if state.bound <= 0.0 else state.value / state.bound
    if state.bound <= 0.0:
        return 1.0 if state.active else 0.0
    return 1.2 if state.value <= 0.0 else state.bound / state.value


def _words(state: LimitState) -> str:
    factor = parse_unit(state.unit).factor
    value, bound = (f"{number / factor:.4g}" for number in (state.value, state.bound))
    sign = "≤" if state.upper else "≥"
    return f"{value} {sign} {with_unit(bound, state.unit)}"


def _draw(axes: Axes, design: CamDesign, angle: float) -> None:
    contour = design.contour
    parallel = not np.isfinite(contour.anchor_distance)
    for half in _halves(contour, parallel):
        axes.fill(*(turn(half, angle) * MM).T, facecolor=GRID.light, edgecolor=MUTED.light, linewidth=0.8)
    arm = float(np.interp(angle, contour.angles, contour.lever_arms))
    contact = _contact(contour, angle)
    end = _end_of_cable(contour, float(contour.radii.max())) + (contact * [0.0, 1.0] if parallel else 0.0)
    for side in (1.0,) if parallel else (1.0, -1.0):
        line = np.vstack([contact, end]) * side * MM
        axes.plot(*line.T, color=BLUE.light, linewidth=1.6)
        axes.plot(*line[0], marker="o", color=VERMILLION.light, markersize=5)
        if not parallel:
            axes.plot(*line[1], marker="o", color=MUTED.light, markersize=4)
        _rubber(axes, design, end * side * MM, side, angle)
    along = (end - contact) / float(np.hypot(*(end - contact)))
    foot = (contact - along * float(contact @ along)) * MM
    axes.plot([0.0, foot[0]], [0.0, foot[1]], color=GREEN.light, linewidth=1.4, linestyle=(0, (2, 1)))
    axes.plot([0], [0], marker="o", color=INK.light, markersize=4, markerfacecolor=SURFACE.light)
    force = float(np.interp(angle, design.curves.angles, design.curves.forces))
    torque = float(np.interp(angle, design.check.angles, design.check.torques))
    axes.set_title(
        f"{np.degrees(angle):.0f}°: arm {MM * arm:.1f} mm, {force:.0f} N, {torque:.2f} N·m", fontsize=8.5
    )
    axes.set_aspect("equal")
    axes.grid(visible=False)


def _end_of_cable(contour: Contour, reach: float) -> Array:
    """Return where the drawn cable ends: at its anchor, or a little outside the cam where it is parallel."""
    near = np.isfinite(contour.anchor_distance) and contour.anchor_distance < 5.0 * reach
    return np.array([contour.anchor_distance if near else 1.9 * reach, 0.0])


def _halves(contour: Contour, parallel: bool) -> list[Array]:
    if not parallel:
        return list(contour.outlines())
    # Of a cam with a parallel cable only the lip is designed; the body behind it is closed over the centre.
    points = contour.points
    return [np.vstack([points, [[0.0, 0.0]], points[:1]])]


def _contact(contour: Contour, angle: float) -> Array:
    point = np.array([[np.interp(angle, contour.angles, column) for column in contour.points.T]])
    return np.asarray(turn(point, angle)[0], dtype=float)


def _rubber(axes: Axes, design: CamDesign, place: Array, side: float, angle: float) -> None:
    """Draw one element behind the end of the cable: as long as it is, as high as a square of its section."""
    pieces = _pieces(design)
    if not pieces:
        return
    length, area = pieces[0]
    stretched = length + float(np.interp(angle, design.curves.angles, design.curves.extensions))
    height, start = float(np.sqrt(area)) * MM, 4.0
    x = side * (np.array([0.0, stretched * MM, stretched * MM, 0.0]) + start) + place[0]
    y = place[1] + np.array([-0.5, -0.5, 0.5, 0.5]) * height
    axes.fill(x, y, facecolor=ORANGE.light, alpha=0.85)
    axes.plot([place[0], place[0] + side * start], [place[1]] * 2, color=BLUE.light, linewidth=1.6)
    if side > 0.0:
        axes.annotate(
            f"{stretched * MM:.1f}", (float(np.mean(x)), float(y.min())), (0, -9), ha="center", fontsize=7.5,
            textcoords="offset points", color=INK.light,
        )  # fmt: skip


def _pieces(design: CamDesign) -> list[tuple[float, float]]:
    """Return rest length and section of each piece of rubber in the finished assembly."""
    from ...model import flatten
    from ...model.roles import series_cam

    model = flatten(design.actuator)
    cam, values = series_cam(model, design.drive), model.values
    return [
        (values[piece.rest_length], float(np.prod([values[name] for name in piece.section])))
        for piece in cam.specimens
    ]


def _rubber_note(design: CamDesign) -> str:
    pieces = _pieces(design)
    if not pieces:
        return ""
    length, area = pieces[0]
    return f"; rubber unstretched {length * MM:.1f} mm, {area * MM**2:.1f} mm² (drawn square)"


def _rubber_words(design: CamDesign) -> str:
    pieces = _pieces(design)
    if not pieces:
        return "not a declared piece"
    length, area = pieces[0]
    return f"{length * MM:.1f} mm long with a section of {area * MM**2:.0f} mm²"


def _dimension_radius(axes: Axes, design: CamDesign, y: float) -> None:
    """Dimension the largest radius of the cam and the distance of the anchor."""
    contour, radius = design.contour, float(design.contour.radii.max()) * MM
    anchor = float(_end_of_cable(contour, radius / MM)[0]) * MM
    _dimension(axes, 0.0, radius, y, f"R {radius:.1f}")
    if contour.anchor_distance * MM == anchor:
        _dimension(axes, 0.0, -anchor, y, f"anchor {anchor:.1f}")


def _dimension(axes: Axes, left: float, right: float, y: float, text: str) -> None:
    axes.plot([left, right], [y, y], color=MUTED.light, linewidth=0.8)
    for end in (left, right):
        axes.plot([end, end], [y - 0.6, y + 0.6], color=MUTED.light, linewidth=0.8)
    axes.annotate(
        text, ((left + right) / 2, y), (0, 2), textcoords="offset points", ha="center", fontsize=7.5,
        color=INK.light,
    )  # fmt: skip
