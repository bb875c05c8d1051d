"""Figures of a finished design: the cam to scale, its limits, made springs, its task, and fronts of goals."""

from __future__ import annotations

from collections.abc import Callable
from typing import NamedTuple

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure

from ...design import (
    CamDesign,
    Contour,
    LimitState,
    MotorCycle,
    ParetoFront,
    SpringChoice,
    TaskCurve,
    ToleranceResult,
)
from ...design.statics.contour import RollingContour, turn
from ...foundation.arrays import Array
from ...foundation.errors import ValueRangeError
from ...foundation.quantity import MM, parse_unit, typeset_number, typeset_unit, with_unit
from ...foundation.written_numbers import shared_prefix
from .cam_motion import draw_rolling, numbers_at, rolling_picture
from .style import (
    AFTER,
    BEFORE,
    BLUE,
    DASHES,
    GREEN,
    GRID,
    HOLDS,
    INK,
    LIMIT,
    MUTED,
    ORANGE,
    SURFACE,
    VERMILLION,
    WIDTH,
    described,
    legend,
    look,
    panels,
    styled,
)


@styled
def design_picture(design: CamDesign) -> Figure:
    """Draw cam, cable and rubber to scale, at angle zero and at the last angle, with dimensions."""
    if isinstance(design.contour, RollingContour):
        return rolling_picture(design, design.contour)
    last = float(design.contour.angles[-1])
    reach = float(design.contour.radii.max())
    piece = _piece(design)
    wide = (
        _end_of_cable(design.contour, reach)[0] + piece.length + float(design.curves.extensions.max()) + 8e-3
    )
    left = -wide if np.isfinite(design.contour.anchor_distance) else -1.3 * reach
    figure, axes = panels(2, 1, height=4.0, sharex=True)
    for panel, angle in zip(axes, (0.0, last), strict=True):
        draw_mechanism(panel, design, angle)
    high = max(float(panel.dataLim.y1) for panel in axes)
    low = min(float(panel.dataLim.y0) for panel in axes)
    low -= 0.08 * (wide - left) * MM  # room for the dimensions
    for panel in axes:
        panel.set_xlim(left * MM, wide * MM)
        panel.set_ylim(low, high + 2.0)
    figure.set_figheight(2.0 * (WIDTH - 0.8) * (high + 2.0 - low) / ((wide - left) * MM) + 1.2)
    radius, y = float(design.contour.radii.max()) * MM, low + 0.02 * (wide - left) * MM
    anchor = float(_end_of_cable(design.contour, radius / MM)[0]) * MM
    _dimension(axes[0], radius, y, f"R {radius:.1f}")
    if design.contour.anchor_distance * MM == anchor:
        _dimension(axes[0], -anchor, y, f"anchor {anchor:.1f}")
    axes[1].set_xlabel(f"distance from the centre in mm{piece.note}")
    return described(
        figure,
        f"The designed cam at 0° and {np.degrees(last):.0f}°, to scale: radius {radius:.1f} mm, lever arm up "
        f"to {MM * float(design.contour.lever_arms.max()):.1f} mm; {piece.words}.",
    )


@styled
def limit_margins(design: CamDesign) -> Figure:
    """Draw how far each limit is used: the bar ends at 100 % where the design sits on it."""
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
        factor = parse_unit(state.unit).factor
        value, bound = (f"{number / factor:.4g}" for number in (state.value, state.bound))
        sign = "≤" if state.upper else "≥"
        words = f"{value} {sign} {with_unit(bound, state.unit)}"
        axes.annotate(
            words, (max(min(float(share), 1.2), 1.0), place), (6, 0), textcoords="offset points",
            fontsize=8, va="center", color=INK.light,
        )  # fmt: skip
    axes.set_yticks(places, [f"{state.of} ({'≤' if state.upper else '≥'})" for state in states])
    axes.set_xticks([0.0, 0.25, 0.5, 0.75, 1.0], ["0", "25 %", "50 %", "75 %", "limit"])
    axes.set_xlim(0.0, 1.55)
    axes.grid(visible=False, axis="y")
    axes.set_title("Use of each limit")
    binding = ", ".join(dict.fromkeys(state.of for state in states if state.active)) or "none"
    return described(figure, f"Bars of {len(states)} limits; the design sits on: {binding}.")


def _used(state: LimitState) -> float:
    """Return the share of a limit that is used; a lower limit is used up where the value falls to it."""
    if state.upper:
        return 0.0 if state.value <= 0.0 else 1.2 if state.bound <= 0.0 else state.value / state.bound
    if state.bound <= 0.0:
        return 1.0 if state.active else 0.0
    return 1.2 if state.value <= 0.0 else state.bound / state.value


def draw_mechanism(axes: Axes, design: CamDesign, angle: float) -> None:
    """Draw cam, cable and rubber at an angle in rad into axes, to scale, in mm."""
    contour = design.contour
    if isinstance(contour, RollingContour):
        draw_rolling(axes, design, contour, angle)
        return
    parallel = not np.isfinite(contour.anchor_distance)
    halves = list(contour.outlines())
    if parallel:  # only the lip is designed; the body behind it is closed over the centre
        halves = [np.vstack([contour.points, [[0.0, 0.0]], contour.points[:1]])]
    for half in halves:
        axes.fill(*(turn(half, angle) * MM).T, facecolor=GRID.light, edgecolor=MUTED.light, linewidth=0.8)
    point = np.array([[np.interp(angle, contour.angles, column) for column in contour.points.T]])
    contact = np.asarray(turn(point, angle)[0], dtype=float)
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
    axes.set_title(numbers_at(design, angle), fontsize=8.5)
    axes.set_aspect("equal")
    axes.grid(visible=False)


def _end_of_cable(contour: Contour, reach: float) -> Array:
    """Return where the drawn cable ends: at its anchor, or a little outside the cam where it is parallel."""
    near = np.isfinite(contour.anchor_distance) and contour.anchor_distance < 5.0 * reach
    return np.array([contour.anchor_distance if near else 1.9 * reach, 0.0])


def _rubber(axes: Axes, design: CamDesign, place: Array, side: float, angle: float) -> None:
    """Draw one element behind the end of the cable: as long as it is, rubber as high as a square section."""
    piece = _piece(design)
    if not piece.length:
        return
    stretched = piece.length + float(np.interp(angle, design.curves.angles, design.curves.extensions))
    height, start = piece.height * MM, 4.0
    x = side * (np.array([0.0, stretched * MM, stretched * MM, 0.0]) + start) + place[0]
    y = place[1] + np.array([-0.5, -0.5, 0.5, 0.5]) * height
    axes.fill(x, y, facecolor=ORANGE.light, alpha=0.85)
    axes.plot([place[0], place[0] + side * start], [place[1]] * 2, color=BLUE.light, linewidth=1.6)
    if side > 0.0:
        axes.annotate(
            f"{stretched * MM:.1f}", (float(np.mean(x)), float(y.min())), (0, -9), ha="center", fontsize=7.5,
            textcoords="offset points", color=INK.light,
        )  # fmt: skip


class _Piece(NamedTuple):
    """What is stretched behind the cam: length without load and drawn height in m, and both in words."""

    length: float = 0.0
    height: float = 0.0
    note: str = ""
    words: str = "the rubber is not a declared piece"


def _piece(design: CamDesign) -> _Piece:
    """Return the first piece of rubber, or coil of declared wire, in the finished assembly."""
    from ...model import flatten
    from ...model.roles import series_cam

    model = flatten(design.actuator)
    cam, values = series_cam(model, design.drive), model.values
    for piece in cam.specimens:
        length, area = values[piece.rest_length], float(np.prod([values[name] for name in piece.section]))
        long = f"{length * MM:.1f} mm"
        return _Piece(
            length,
            float(np.sqrt(area)),
            f"; rubber unstretched {long}, {area * MM**2:.1f} mm² (drawn square)",
            f"the rubber is {long} long with a section of {area * MM**2:.0f} mm²",
        )
    for coil in (each for each in cam.coils if each.winding):
        wire, mean = (values[name] for name in coil.winding[:2])
        length, outside = values[coil.free_length], mean + wire
        size = f"{length * MM:.1f} mm long without load, {outside * MM:.1f} mm outside"
        return _Piece(length, outside, f"; coil {size}", f"the coil is {size}")
    return _Piece()


def _dimension(axes: Axes, end: float, y: float, text: str) -> None:
    axes.plot([0.0, end], [y, y], color=MUTED.light, linewidth=0.8)
    for x in (0.0, end):
        axes.plot([x, x], [y - 0.6, y + 0.6], color=MUTED.light, linewidth=0.8)
    axes.annotate(
        text, (end / 2, y), (0, 2), textcoords="offset points", ha="center", fontsize=7.5,
        color=INK.light,
    )  # fmt: skip


_MOST_CAUSES = 12


@styled
def tolerance_bars(result: ToleranceResult) -> Figure:
    """Draw the 95 % quantile of the torque error: of all causes, after each trim, and of each cause alone.

    The lines at the bars of all causes are confidence intervals of 95 %.

    Parameters
    ----------
    result
        Of a tolerance analysis.

    Raises
    ------
    ValueRangeError
        If nothing deviates.
    """
    if not result.causes:
        raise ValueRangeError(
            "tolerance", "nothing deviates, so there is nothing to draw", next_step="leave this figure out"
        )
    built, causes = result.quantiles[-1], result.causes[:_MOST_CAUSES]
    whole = [("all causes, as built", built)]
    whole += [(f"all, {each.name} trimmed", each.quantiles[-1]) for each in result.trims]
    names = [name for name, _ in whole] + [f"{each.cause.name} alone, ± {each.cause.size}" for each in causes]
    figure, (axes,) = panels(height=1.1 + 0.27 * len(names))
    places = -np.arange(len(names), dtype=float)
    tones = [BEFORE.light, *([AFTER.light] * len(result.trims)), *([MUTED.light] * len(causes))]
    hatches = ["///", *([""] * (len(result.trims) + len(causes)))]
    factor, unit = shared_prefix([*(each.value for _, each in whole), *(c.alone for c in causes)], "N*m")
    values = [factor * each.value for _, each in whole] + [factor * each.alone for each in causes]
    bars = axes.barh(places, values, 0.66, color=tones, edgecolor=SURFACE.light)
    for bar, hatch in zip(bars, hatches, strict=True):
        bar.set_hatch(hatch)
    ends = list(values)
    for k, (_, each) in enumerate(whole):
        upper = each.upper if np.isfinite(each.upper) else each.value
        axes.hlines(places[k], factor * each.lower, factor * upper, color=INK.light, linewidth=1.3)
        ends[k] = factor * upper
    for place, value, end in zip(places, values, ends, strict=True):
        axes.annotate(
            typeset_number(value), (end, place), (4, 0), color=INK.light, fontsize=8, va="center",
            textcoords="offset points",
        )  # fmt: skip
    axes.set_yticks(places, names)
    axes.grid(visible=False, axis="y")
    axes.set_ylim(places[-1] - 0.6, 0.6)
    axes.margins(x=0.1)
    axes.set_xlim(left=0.0)
    axes.set(
        title=f"{len(result.errors)} made springs", xlabel=f"95 % quantile of the rms torque error in {unit}"
    )
    best = min((each.value, name) for name, each in whole)
    return described(
        figure,
        f"95 % quantile of the rms torque error of {len(result.errors)} made springs: "
        f"{typeset_number(factor * built.value)} {unit} as built, {typeset_number(factor * best[0])} {unit} "
        f"at best ({best[1]}). Largest cause alone: {causes[0].cause.name}, "
        f"{typeset_number(factor * causes[0].alone)} {unit}.",
    )


@styled
def torque_band(result: ToleranceResult) -> Figure:
    """Draw the band within which 90 % of the made springs lie at each angle, as built and after a trim.

    Parameters
    ----------
    result
        Of a tolerance analysis.
    """
    figure, (upper, lower) = panels(2, height=4.6, sharex=True, height_ratios=[1.6, 1])
    degrees, wanted = np.degrees(result.angles), result.target.torque(result.angles)
    # No hatch: printed to PDF it covers what lies behind it. Dashed edges tell the bands without colour.
    bands = [("as built", result.band, BEFORE.light, "--")]
    bands += [(f"{each.name} trimmed", each.band, AFTER.light, "-") for each in result.trims[:1]]
    widest = [float(np.max(band[2] - band[0])) for _, band, _, _ in bands]
    factor, unit = shared_prefix(widest, "N*m")
    for label, band, tone, dash in bands:
        for axes, scale, off in ((upper, 1.0, 0.0 * wanted), (lower, factor, wanted)):
            low, middle, high = (scale * (row - off) for row in band)
            axes.fill_between(
                degrees, low, high, facecolor=tone, alpha=0.28, edgecolor=tone, linewidth=0.9,
                linestyle=dash, label=f"90 % of the springs, {label}",
            )  # fmt: skip
            axes.plot(degrees, middle, color=tone, linewidth=1.2)
    upper.plot(degrees, wanted, color=INK.light, linewidth=1.2, linestyle=(0, (4, 2)), label="target")
    lower.axhline(0.0, color=INK.light, linewidth=1.0, linestyle=(0, (4, 2)))
    lower.grid(color=GRID.light)
    upper.set(title="Torque of made springs", ylabel="torque in N·m")
    lower.set(title="Made minus target", xlabel="angle in degrees", ylabel=f"error in {unit}")
    legend(upper, columns=2)
    after = f", {typeset_number(factor * widest[1])} {unit} after the trim" if len(widest) > 1 else ""
    return described(
        figure,
        f"Band of the torque over the angle up to {degrees[-1]:.0f}° within which 90 % of the made springs "
        f"lie, with the target; at most {typeset_number(factor * widest[0])} {unit} wide as built{after}. "
        "Errors below.",
    )


_LABELS = ("rigid", "best linear spring", "this curve")
_DASHES = (DASHES[2], DASHES[1], DASHES[0])


@styled
def motor_over_task(curve: TaskCurve) -> Figure:
    """Draw torque, speed and power of the motor over a period: rigid, best linear spring, and the curve.

    Parameters
    ----------
    curve
        For a task.
    """
    rows: tuple[tuple[str, str, Callable[[MotorCycle], Array]], ...] = (
        ("Motor torque", "torque in N·m", lambda motor: motor.torque),
        ("Motor speed", "speed in rad/s", lambda motor: motor.speed),
        ("Power at the motor shaft", "power in W", lambda motor: motor.power),
    )
    cycles = (curve.rigid, curve.linear, curve.best)
    figure, axes = panels(3, height=6.6, sharex=True)
    for panel, (title, label, values) in zip(axes, rows, strict=True):
        panel.axhline(0.0, color=MUTED.light, linewidth=0.8)
        for tone, dash, name, motor in zip((INK, BEFORE, AFTER), _DASHES, _LABELS, cycles, strict=False):
            if motor is None:  # no linear spring keeps the limits
                continue
            time, shown = motor.cycle.time, values(motor)
            closed = np.append(time, motor.cycle.period), np.append(shown, shown[0])
            panel.plot(*closed, color=tone.light, linestyle=dash, label=name, linewidth=1.4)
        panel.set(title=title, ylabel=label)
    legend(axes[0])
    axes[-1].set_xlabel("time in s")
    summary = "; ".join(
        f"{name}: {typeset_number(motor.heat)} J of heat, {typeset_number(motor.peak_power)} W at most"
        for name, motor in zip(_LABELS, cycles, strict=True)
        if motor is not None
    )
    return described(figure, f"Torque, speed and power of the motor over one period of the task. {summary}.")


@styled
def curve_of_task(curve: TaskCurve) -> Figure:
    """Draw the torque curve of a task with the best linear spring, both directions.

    Parameters
    ----------
    curve
        For a task.
    """
    figure, (axes,) = panels(1, height=3.4)
    angle = np.linspace(0.0, curve.target.last_angle, 300)
    opposite = curve.opposite or curve.target
    back = np.linspace(0.0, opposite.last_angle, 300)
    axes.axhline(0.0, color=MUTED.light, linewidth=0.8)
    axes.axvline(0.0, color=MUTED.light, linewidth=0.8)
    for sign, at, branch, label in ((1.0, angle, curve.target, "this curve"), (-1.0, back, opposite, None)):
        axes.plot(np.degrees(sign * at), sign * branch.torque(at), color=AFTER.light, label=label)
    beside = "no linear spring keeps the limits"
    if curve.linear is not None and curve.linear_stiffness is not None:
        line = np.array([np.min(curve.linear.cycle.torque), np.max(curve.linear.cycle.torque)])
        beside = f"best linear spring, {typeset_number(curve.linear_stiffness)} N·m/rad"
        at = np.degrees(line / curve.linear_stiffness)
        axes.plot(at, line, color=BEFORE.light, linestyle=DASHES[1], linewidth=1.2, label=beside)
    axes.set(title="Spring for the task", xlabel="deflection in degrees", ylabel="torque in N·m")
    axes.margins(x=0.03)
    legend(axes)
    return described(
        figure,
        f"Torque of the spring over its deflection up to {np.degrees(curve.target.last_angle):.1f}° and "
        f"{curve.target.largest:.3g} N·m; beside it: {beside}.",
    )


@styled
def springs_for_task(choice: SpringChoice) -> Figure:
    """Draw what springs in each place leave of a task: torques over the angle of the joint, and the goal.

    Parameters
    ----------
    choice
        For a task.
    """
    figure, (loops, bars) = panels(2, height=5.8)
    beside = choice.both_ways or choice.beside
    rigid = choice.none.cycle
    motors = [(rigid.torque, INK, DASHES[2], "of the joint")]
    if beside and beside.sides:
        angle = np.linspace(np.min(rigid.angle), np.max(rigid.angle), 400)
        spring = np.sum([side.torque(angle) for side in beside.sides], axis=0)
        loops.plot(np.degrees(angle), spring, color=AFTER.light, label="spring beside the drive")
        motors.append((beside.best.cycle.torque, BEFORE, DASHES[1], "left for the drive"))
    for torque, tone, dash, label in motors:
        closed = np.append(rigid.angle, rigid.angle[0]), np.append(torque, torque[0])
        loops.plot(
            np.degrees(closed[0]), closed[1], color=tone.light, linestyle=dash, label=label, linewidth=1.2
        )
    loops.axhline(0.0, color=MUTED.light, linewidth=0.8)
    title = "Torque over the angle of the joint"
    loops.set(title=title, xlabel="angle of the joint in degrees", ylabel="torque in N·m")
    legend(loops)
    names, paid = [*choice.motors], [choice.paid(motor) for motor in choice.motors.values()]
    unit, what = ("W", "peak power") if choice.goal.power else ("J", "loss in the motor per period")
    places = np.arange(len(names))
    hatches = ["" if name == choice.best else "///" for name in names]
    tones = [HOLDS.light if name == choice.best else MUTED.light for name in names]
    bars.barh(places, paid, color=tones, hatch=hatches, edgecolor="white", height=0.6)
    bars.set_yticks(places, names)
    bars.invert_yaxis()
    bars.set(title=f"Best: {choice.best}", xlabel=f"{what} in {unit}")
    return described(figure, f"Springs for a task. {choice.reason}")


@styled
def pareto_front(front: ParetoFront) -> Figure:
    """Draw the points of a front: the first goal over the second, by steps of the third where there is one.

    Each point carries its number in the front.

    Parameters
    ----------
    front
        Of two or three goals.
    """
    figure, (axes,) = panels(1, height=3.4)
    labels = [
        goal if unit == "1" else f"{goal} in {typeset_unit(unit)}"
        for goal, unit in zip(front.goals, front.units, strict=True)
    ]
    values = front.shown
    for step, numbers in enumerate(_steps(front)):
        tone, dash, marker = look(step)
        chosen = values[numbers][np.argsort(values[numbers][:, 1])]
        named = None if len(labels) == 2 else _range(front, values[numbers][:, 2])
        joined = dash if len(labels) == 2 else ""
        axes.plot(chosen[:, 1], chosen[:, 0], color=tone, linestyle=joined, marker=marker, label=named)
    for number, row in enumerate(values):
        axes.annotate(str(number), (row[1], row[0]), xytext=(5, 4), textcoords="offset points", fontsize=8)
    axes.set(xlabel=labels[1], ylabel=labels[0])
    axes.margins(0.08)
    if len(labels) == 3:
        axes.set_title(labels[2])
    legend(axes)
    low, high = front.shown.min(axis=0), front.shown.max(axis=0)
    ranges = (
        f"{goal} {with_unit(f'{typeset_number(float(a))} to {typeset_number(float(b))}', unit)}"
        for goal, unit, a, b in zip(front.goals, front.units, low, high, strict=True)
    )
    return described(figure, f"Front of {len(front.points)} designs: " + ", ".join(ranges) + ".")


def _steps(front: ParetoFront) -> list[list[int]]:
    """Return the numbers of the points, for three goals in up to four steps of the third."""
    everything = list(range(len(front.points)))
    if len(front.goals) == 2:
        return [everything]
    third = front.shown[:, 2]
    edges = np.linspace(third.min(), third.max(), 5)[1:-1]
    step = np.searchsorted(edges, third)
    groups = [[number for number in everything if step[number] == k] for k in range(4)]
    return [group for group in groups if group]


def _range(front: ParetoFront, values: np.ndarray) -> str:
    ends = dict.fromkeys(typeset_number(float(value)) for value in (values.min(), values.max()))
    unit = front.units[2]
    return with_unit(" to ".join(ends), "" if unit == "1" else unit)
