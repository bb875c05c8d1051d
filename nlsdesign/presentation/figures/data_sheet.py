"""Data sheet of a designed spring on one page A4: what it is, what it does, and what it assumes."""

from __future__ import annotations

import textwrap

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure

from ...design import CamDesign
from ...foundation.quantity import MM, parse_unit, three_digits, typeset_unit, with_unit
from ...foundation.written_numbers import prefixed
from .design_figures import draw_mechanism
from .sheet import Sheet
from .style import AFTER, GRID, INK, MUTED, described, styled

_WIDTH, _HEIGHT, _BORDER = 210.0, 297.0, 8.0
_LEFT, _MIDDLE = 12.0, 108.0
_ANGLES = 11
_MOST_LIMITS, _MOST_SIZES = 9, 12
_LETTERS, _LABEL = 150, 46
_ASSUMED = (
    "Torque of the spring at rest and at the declared temperature, without friction of bearings and guides. "
    "While rubber relaxes its force is higher; it creeps under load that stays. Strengths are those of the "
    "deck, with its factors."
)


@styled
def data_sheet(design: CamDesign, *, deck: str) -> Figure:
    """Return the data sheet of a finished design on one page A4; ``deck``: name of that it began with."""
    page = Sheet(_WIDTH, _HEIGHT)
    page.box(_BORDER, _BORDER, width=_WIDTH - 2 * _BORDER, height=_HEIGHT - 2 * _BORDER)
    page.text(_LEFT, 280.0, text=f"Spring of {design.actuator.name}", fontsize=15.0, weight="bold")
    verdict = (
        "with exact numbers it meets its target"
        if design.miss is None
        else f"misses its target: {design.miss.words}"
    )
    page.text(_LEFT, 274.0, text=f"deck {deck}; design {design.fingerprint}; {verdict}", color=MUTED.light)
    last = float(design.contour.angles[-1])
    views = [_axes(page, _LEFT, lower, 186.0, 27.0) for lower in (239.0, 206.0)]
    for view, angle in zip(views, (0.0, last), strict=True):
        draw_mechanism(view, design, angle)
        view.set_axis_off()
    drawn = [view.dataLim for view in views]
    for view in views:  # at one scale
        view.set_xlim(min(box.x0 for box in drawn), max(box.x1 for box in drawn))
        view.set_ylim(min(box.y0 for box in drawn), max(box.y1 for box in drawn))
    page.table((_LEFT, 202.0), (56.0, 34.0), rows=[("The spring", ""), *_numbers(design)])
    page.table((_MIDDLE, 202.0), (56.0, 34.0), rows=[("Sizes", ""), *_sizes(design)])
    axes = _axes(page, _LEFT + 12.0, 87.0, 78.0, 54.0)
    degrees = np.degrees(design.check.angles)
    if design.tolerance is not None and design.tolerance.causes:
        low, _, high = design.tolerance.band
        axes.fill_between(
            np.degrees(design.tolerance.angles), low, high, facecolor=GRID.light, label="90 % of made springs"
        )
    axes.plot(degrees, design.check.torques, color=AFTER.light, label="design")
    axes.plot(
        degrees, design.target.torque(design.check.angles), color=INK.light, linewidth=1.0,
        linestyle=(0, (4, 2)), label="target",
    )  # fmt: skip
    axes.set(xlabel="angle in degrees", ylabel="torque in N·m", title="Torque")
    axes.legend(loc="best", fontsize=7.5, frameon=False)
    stiffness = _axes(page, _MIDDLE + 14.0, 87.0, 76.0, 54.0)
    slope = np.gradient(design.check.torques, design.check.angles)
    stiffness.plot(np.degrees(design.check.angles), slope, color=AFTER.light)
    stiffness.set(xlabel="angle in degrees", ylabel="stiffness in N·m/rad", title="Stiffness")
    # A jump of the torque at angle zero has a stiffness that would hide all others.
    usual = slope[len(slope) // 50 :]
    stiffness.set_ylim(min(0.0, 1.05 * float(usual.min())), 1.05 * float(np.max(usual, initial=0.0)) or None)
    page.table((_LEFT, 74.0), (13.0, 19.0, 27.0, 14.0, 17.0), rows=_over_angle(design))
    page.table((_MIDDLE, 74.0), (58.0, 32.0), rows=_limits(design))
    for number, line in enumerate(textwrap.wrap(_ASSUMED, _LETTERS)):
        page.text(_LEFT, 17.0 - 3.6 * number, text=line, color=MUTED.light)
    return described(
        page.figure,
        f"Data sheet on one page: cam and rubber at 0° and {np.degrees(last):.0f}°, numbers, sizes, torque "
        "and stiffness over the angle, limits.",
    )


def _axes(page: Sheet, left: float, lower: float, width: float, height: float) -> Axes:
    """Return axes at a place of the page in mm."""
    return page.figure.add_axes((left / _WIDTH, lower / _HEIGHT, width / _WIDTH, height / _HEIGHT))


def _numbers(design: CamDesign) -> list[tuple[str, ...]]:
    """Return what the spring does, a row for each number."""
    check, curves = design.check, design.curves
    stiffness = np.gradient(check.torques, check.angles)
    share = 100.0 * design.rms / design.target.largest
    rows: list[tuple[str, ...]] = [
        ("largest torque", prefixed(float(np.max(np.abs(check.torques))), "N*m")),
        ("at an angle of", f"{np.degrees(float(check.angles[-1])):.4g}°"),
        ("stiffness at 0°", f"{three_digits(float(stiffness[0]))} N·m/rad"),
        ("stiffness at the last angle", f"{three_digits(float(stiffness[-1]))} N·m/rad"),
        ("work stored from 0° to there", prefixed(float(curves.energy), "J")),
        ("with exact numbers, rms", f"{prefixed(design.rms, 'N*m')} ({share:.2g} %)"),
        (
            f"largest force of {'a cable' if design.cam.rolling is None else 'an element'}",
            f"{three_digits(float(np.max(curves.forces)))} N",
        ),
    ]
    if design.rubber_volume > 0.0:
        what = "wire" if design.cam.coils else "rubber"
        rows.append((f"volume of all {what}", f"{three_digits(1e6 * design.rubber_volume)} cm³"))
    if design.tolerance is not None and design.tolerance.causes:
        built, trims = design.tolerance.quantiles[-1], design.tolerance.trims[:1]
        rows.insert(
            5, (f"torque error of {100 * built.share:g} % of made springs, rms", prefixed(built.value, "N*m"))
        )
        if trims:
            after = prefixed(trims[0].quantiles[-1].value, "N*m")
            rows.insert(6, (f"the same, {trims[0].name.rpartition('.')[2].replace('_', ' ')} trimmed", after))
    return rows


def _sizes(design: CamDesign) -> list[tuple[str, ...]]:
    """Return largest radius, anchor, and the numbers of the deck that the design has set."""
    contour = design.contour
    rows: list[tuple[str, ...]] = [
        (
            f"largest radius of the {contour.drawn_line.removesuffix(' line')}",
            f"{MM * float(contour.radii.max()):.4g} mm",
        )
    ]
    if np.isfinite(contour.anchor_distance):
        rows.append(("axis to cable anchor", f"{MM * contour.anchor_distance:.4g} mm"))
    single = {
        name: quantity for name, quantity in design.values.items() if isinstance(quantity.value, int | float)
    }
    for name, quantity in list(single.items())[: _MOST_SIZES - len(rows)]:
        label = " ".join(name.split(".")[-2:]).replace("_", " ")
        rows.append(
            (
                label,
                with_unit(
                    f"{quantity.number / parse_unit(quantity.unit).factor:.4g}", typeset_unit(quantity.unit)
                ),
            )
        )
    return rows


def _over_angle(design: CamDesign) -> list[tuple[str, ...]]:
    """Return torque, stiffness, lever arm and cable force at even angles, with their heads."""
    check, curves, contour = design.check, design.curves, design.contour
    slope = np.gradient(check.torques, check.angles)
    columns = (
        (check.angles, check.torques, 1.0),
        (check.angles, slope, 1.0),
        (contour.angles, contour.lever_arms, MM),
        (curves.angles, curves.forces, 1.0),
    )
    rows: list[tuple[str, ...]] = [("angle", "torque N·m", "stiffness N·m/rad", "arm mm", "force N")]
    for angle in np.linspace(0.0, float(check.angles[-1]), _ANGLES):
        cells = (three_digits(scale * float(np.interp(angle, x, y))) for x, y, scale in columns)
        rows.append((f"{np.degrees(angle):.3g}°", *cells))
    return rows


def _limits(design: CamDesign) -> list[tuple[str, ...]]:
    """Return what each limit bounds, value and bound; those that are reached first."""
    states = sorted(design.limits, key=lambda state: not state.active)
    rows: list[tuple[str, ...]] = [("Limits", "value, bound")]
    for state in states[:_MOST_LIMITS]:
        factor = parse_unit(state.unit).factor
        sign = "≤" if state.upper else "≥"
        text = f"{state.value / factor:.4g} {sign} {state.bound / factor:.4g} {typeset_unit(state.unit)}"
        reached = ", reached" if state.active else ""
        label = textwrap.shorten(state.of, _LABEL - len(reached), placeholder=" …")
        rows.append((f"{label}{reached}", text.strip()))
    if len(states) > _MOST_LIMITS:
        rows.append((f"and {len(states) - _MOST_LIMITS} more", "in design.json"))
    return rows
