"""Results over the angle, and the errors of observers: over the spread, against the bound, and by cause."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import Any

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.ticker import MaxNLocator

from ...feedback.analysis import Chart, RankDrops
from ...feedback.observer import SpreadErrors
from ...foundation.errors import ValueRangeError
from ...foundation.quantity import typeset_number
from ...foundation.written_numbers import shared_prefix
from .style import (
    AFTER,
    DASHES,
    INK,
    MUTED,
    described,
    legend,
    log_axis,
    look,
    panels,
    styled,
    symmetric_log_axis,
)


@styled
def observability_over_angle(
    charts: Mapping[str, Chart], *, drops: Mapping[str, RankDrops] | None = None
) -> Figure:
    """Draw rank, condition number and standard deviation of the estimate over the angle.

    Where the rank is not full the condition number is infinite: those angles are marked at the upper edge. A
    rank that is lost at a single angle is a point, not a slot as wide as the grid.

    Parameters
    ----------
    charts
        By label, each with the columns of ``Observability``; those with the columns of ``EstimateDeviation``
        too appear in the third panel, which is left out if there is none.
    drops
        By label, the exact angles of lost rank, as ``rank_drops`` finds them; else those on the grid.
    """
    deviations = {label: chart for label, chart in charts.items() if "deviation.best" in _columns(chart)}
    count = 3 if deviations else 2
    figure, axes = panels(count, height=1.5 + 1.4 * count, sharex=True, height_ratios=[1, 1.7, 1.7][:count])
    summaries = []
    for number, (label, chart) in enumerate(charts.items()):
        exact = drops.get(label) if drops else None
        _rank(axes[0], chart, number, label, exact)
        summaries.append(_condition(axes[1], chart, number, label, exact))
    axes[0].set_ylabel("rank")
    axes[0].yaxis.set_major_locator(MaxNLocator(integer=True))
    axes[0].margins(y=0.25)
    axes[0].set_title("Rank of the observability matrix")
    legend(axes[0])
    log_axis(axes[1])
    axes[1].set(
        title="Condition of the scaled matrix (small is good; ✕: not observable)", ylabel="condition number"
    )
    if deviations:
        _deviations(axes[2], deviations)
    axes[-1].set_xlabel("angle in degrees")
    return described(figure, f"Observability over the angle. {' '.join(summaries)}")


@styled
def stability_over_angle(charts: Mapping[str, Chart]) -> Figure:
    """Draw the poles of the plant in each of its modes, and the relaxed and the instantaneous stiffness.

    Poles as slowest real part, and as frequency and damping ratio of the least damped oscillation. A machine
    with dry friction has two modes, sliding and stuck; the legend says which.

    Parameters
    ----------
    charts
        By label, each with the columns of ``Stability``.
    """
    figure, (decay, frequency, damping, stiffness) = panels(4, height=7.6, sharex=True)
    summaries = []
    for number, (label, chart) in enumerate(charts.items()):
        degrees, tone = np.degrees(chart.at), look(number).color
        prefix = f"{label}, " if len(charts) > 1 else ""
        modes = [name.removesuffix(".decay") for name in _columns(chart) if name.endswith(".decay")]
        for mode, dash in zip(modes, DASHES, strict=False):
            shown: Any = {"color": tone, "linestyle": dash, "label": prefix + mode.replace("_", " ")}
            decay.plot(degrees, chart[f"{mode}.decay"], **shown)
            if np.any(chart[f"{mode}.frequency"]):
                frequency.plot(degrees, chart[f"{mode}.frequency"], **shown)
                damping.plot(degrees, chart[f"{mode}.damping_ratio"], **shown)
            summaries.append(_slowest(chart, mode, label))
        for name, dash, state in (
            ("stiffness.fast", "-", "instantaneous"),
            ("stiffness.slow", DASHES[1], "relaxed"),
        ):
            stiffness.plot(degrees, chart[name], color=tone, linestyle=dash, label=prefix + state)
    decay.axhline(0.0, color=INK.light, linewidth=0.9, linestyle=(0, (4, 2)))
    symmetric_log_axis(decay, 10.0)
    for panel, title, unit in (
        (decay, "Slowest real part (stable below zero)", "real part in 1/s"),
        (frequency, "Frequency of the least damped oscillation", "frequency in Hz"),
        (damping, "Its damping ratio (1: nothing oscillates)", "damping ratio"),
        (stiffness, "Stiffness at rest", "stiffness in N·m/rad"),
    ):
        panel.set(title=title, ylabel=unit)
    frequency.set_ylim(bottom=0.0)
    if all(np.min(np.asarray(line.get_ydata(), dtype=float)) > 0.0 for line in damping.lines):
        log_axis(damping)
    stiffness.set_xlabel("angle in degrees")
    for panel in (decay, stiffness):
        legend(panel, columns=2)
    return described(figure, f"Stability and stiffness over the angle. {' '.join(summaries)}")


def _slowest(chart: Chart, mode: str, label: str) -> str:
    values, degrees = chart[f"{mode}.decay"], np.degrees(chart.at)
    worst, ratios = int(np.argmax(values)), chart[f"{mode}.damping_ratio"]
    least = int(np.argmin(ratios))
    text = f"{label}, {mode.replace('_', ' ')}: slowest eigenvalue {typeset_number(float(values[worst]))} 1/s"
    text += f" at {degrees[worst]:.0f}°"
    if ratios[least] < 1.0:
        pitch = float(chart[f"{mode}.frequency"][least])
        text += f", damping at least {typeset_number(float(ratios[least]), 2)} ({typeset_number(pitch)} Hz)"
    return f"{text}."


def _columns(chart: Chart) -> list[str]:
    return [v.name for v in chart.columns]


def _rank(axes: Axes, chart: Chart, number: int, label: str, exact: RankDrops | None) -> None:
    degrees, rank = np.degrees(chart.at), chart["observability.rank"]
    color, dash, marker = look(number)
    lost = rank < np.max(rank)
    alone = lost & ~np.append(lost[1:], False) & ~np.append(False, lost[:-1])
    axes.plot(degrees[~alone], rank[~alone], label=label, color=color, linestyle=dash, drawstyle="steps-mid")
    at, seen = degrees[alone], rank[alone]
    if exact is not None:
        single = [drop for drop in exact.drops if drop.isolated]
        at = np.degrees([drop.first for drop in single])
        seen = np.array([np.max(rank) - len(drop.unseen.directions) for drop in single])
    axes.plot(at, seen, linestyle="none", marker=marker, color=color)


def _condition(axes: Axes, chart: Chart, number: int, label: str, exact: RankDrops | None) -> str:
    degrees, condition = np.degrees(chart.at), chart["observability.condition"]
    finite = np.isfinite(condition)
    tone, dash, _ = look(number)
    axes.plot(degrees, np.where(finite, condition, np.nan), label=label, color=tone, linestyle=dash)
    unobservable = degrees[~finite] if exact is None else np.degrees(exact.angles)
    height = np.full(len(unobservable), 0.97 - 0.07 * number)
    crosses: Any = {"linestyle": "none", "marker": "x", "markersize": 5, "markeredgewidth": 1.6}
    axes.plot(unobservable, height, transform=axes.get_xaxis_transform(), color=tone, **crosses)
    best = f"best condition number {typeset_number(float(np.min(condition)), 2)}"
    if exact is not None:
        return f"{label}: {'; '.join(exact.lines())}; {best}."
    if not len(unobservable):
        return f"{label}: observable everywhere, {best}."
    where = ", ".join(f"{angle:.1f}°" for angle in unobservable[:5]) + (
        " and others" if len(unobservable) > 5 else ""
    )
    return f"{label}: not observable at {where}; {best}."


def _deviations(axes: Axes, charts: Mapping[str, Chart]) -> None:
    for number, (label, chart) in enumerate(charts.items()):
        degrees, prefix = np.degrees(chart.at), f"{label}: " if len(charts) > 1 else ""
        tone, _, marker = look(number)
        points: Any = {"marker": marker, "markevery": max(1, len(degrees) // 12)}
        alone, best = 1e3 * chart["deviation.model"], 1e3 * chart["deviation.best"]
        axes.plot(
            degrees, alone, color=MUTED.light, linestyle=DASHES[1], label=f"{prefix}model alone", **points
        )
        axes.plot(degrees, best, color=tone, label=f"{prefix}best use of the measurement", **points)
    axes.set(title="Standard deviation of the torque estimate", ylabel="standard deviation in mN·m")
    axes.set_ylim(bottom=0.0)
    legend(axes, columns=2)


_CAUSES = 7


@styled
def errors_over_spread(errors: SpreadErrors) -> Figure:
    """Draw the errors of all observers over the frequency, and what causes those of the first.

    Parameters
    ----------
    errors
        Of at least one observer.
    """
    figure, (left, right) = panels(2, height=5.4)
    places = np.arange(len(errors.frequencies), dtype=float)
    count = len(errors.observers)
    words, factor, unit = [], errors.shown_factor, errors.shown_in
    for number, name in enumerate(errors.observers):
        tone, _, point = look(number)
        at = places + 0.22 * (number - (count - 1) / 2.0)
        median, most = (factor * errors.quantile(name, share) for share in (0.5, 0.9))
        left.vlines(at, median, most, color=tone, linewidth=4.0)
        left.plot(at, median, color=tone, marker=point, linestyle="none", label=name)
        left.plot(
            at, factor * errors.exact[number], color=tone, marker=point, linestyle="none", fillstyle="none"
        )
        words.append(
            f"{name}: median {_range(median)}, 90 % {_range(most)}, with exact numbers "
            f"{_range(factor * errors.exact[number])} {unit}."
        )
    if len(errors.bound):
        bound = factor * errors.bound
        left.hlines(
            bound, places - 0.45, places + 0.45, color=INK.light, linestyle=DASHES[1], linewidth=1.2,
            label="bound on the rms",
        )  # fmt: skip
        words.append(f"Bound on the rms of any estimator {_range(bound)} {unit} rms.")
    log_axis(left)
    left.set_xticks(places, [f"{f:g} Hz" for f in errors.frequencies])
    left.set_xlim(-0.6, len(places) - 0.4)
    left.set(title="Bar: median to 90 %; open: exact numbers", ylabel=f"torque error in {unit} rms")
    _draw_causes(right, errors)
    legend(left)
    return described(figure, f"Torque errors over the spread. {' '.join(words)}")


def _draw_causes(axes: Axes, errors: SpreadErrors) -> None:
    """Draw what one standard deviation of each number costs the first observer, and the last beside it."""
    ranked = errors.ranked_causes(errors.observers[0])[:_CAUSES]
    places = -np.arange(len(ranked), dtype=float)
    factor, unit = shared_prefix([size for _, size in ranked], errors.unit)
    for number, name in enumerate(errors.observers):
        tone, _, point = look(number)
        sizes = dict(errors.ranked_causes(name))
        axes.plot(
            [factor * sizes[cause] for cause, _ in ranked], places, color=tone, marker=point, linestyle="none"
        )
    axes.set_yticks(places, [".".join(cause.split(".")[-2:]) for cause, _ in ranked])
    axes.tick_params(axis="y", labelsize=8)
    axes.margins(x=0.05)
    axes.set_xlim(left=0.0)
    axes.set(title=f"Largest causes, {errors.observers[0]}", xlabel=f"{unit} rms for one standard deviation")
    axes.grid(visible=True, axis="y", color=MUTED.light, linewidth=0.3)


def _range(values: np.ndarray) -> str:
    low, high = (typeset_number(float(end)) for end in (np.min(values), np.max(values)))
    return low if low == high else f"{low} to {high}"


Interval = Sequence[float]
_MISSED = "missed"


@styled
def ranked_intervals(
    groups: Mapping[str, Mapping[str, Interval]], *, words: str, missed: Sequence[str] = ()
) -> Figure:
    """Draw panels of names in their order, best on top, each with an interval and a point in it.

    Parameters
    ----------
    groups
        By label of the axis: lower end, point and upper end by name, best first.
    words
        Alternative text: what the figure shows.
    missed
        Names without a number, which come last in every panel.

    Raises
    ------
    ValueRangeError
        If there are no groups, or an interval is not three ascending numbers.
    """
    if not groups:
        raise ValueRangeError("ranked intervals", "there are none to draw", next_step="leave this figure out")
    for label, rows in groups.items():
        for name, interval in rows.items():
            if len(interval) != 3 or not interval[0] <= interval[1] <= interval[2]:
                raise ValueRangeError(f"{label}: {name} {list(interval)}", "must be three ascending numbers")
    most = max(len(rows) for rows in groups.values()) + len(missed)
    columns = min(2, len(groups))
    lines = -(-len(groups) // columns)
    figure, axes = panels(lines, columns, height=lines * (0.75 + 0.22 * most))
    for _number, ((label, rows), each) in enumerate(zip(groups.items(), axes, strict=False)):
        places = -np.arange(len(rows) + len(missed), dtype=float)
        low, middle, high = np.array([list(interval) for interval in rows.values()]).reshape(-1, 3).T
        tone = AFTER.light
        each.hlines(places[: len(rows)], low, high, color=tone, linewidth=3.0)
        each.plot(middle, places[: len(rows)], linestyle="", marker="o", color=INK.light)
        for place in places[len(rows) :]:
            each.annotate(_MISSED, (0.02, place), xycoords=("axes fraction", "data"), va="center", fontsize=8)
        each.set_yticks(places, [*rows, *missed])
        each.set_ylim(places[-1] - 0.6, 0.6)
        each.grid(visible=False, axis="y")
        each.margins(x=0.05)
        each.set_xlabel(label)
    for unused in axes[len(groups) :]:
        unused.set_visible(False)
    return described(figure, words)
