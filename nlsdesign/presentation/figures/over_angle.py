"""Results over the angle: observability, estimation error, stability, stiffness."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.ticker import MaxNLocator

from ...feedback.analysis import Chart, RankDrops
from ...feedback.observer import ErrorStability
from .number_text import significant
from .style import DASHES, INK, MUTED, described, legend, log_axis, look, panels, styled


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
    axes[1].set_ylabel("condition number")
    axes[1].set_title("Condition of the scaled matrix (small is good; ✕: not observable)")
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
    decay.set_yscale("symlog", linthresh=10.0)
    for panel, title, unit in (
        (decay, "Slowest real part (stable below zero)", "real part in 1/s"),
        (frequency, "Frequency of the least damped oscillation", "frequency in Hz"),
        (damping, "Its damping ratio (1: nothing oscillates)", "damping ratio"),
        (stiffness, "Stiffness at rest", "stiffness in N·m/rad"),
    ):
        panel.set_title(title)
        panel.set_ylabel(unit)
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
    text = f"{label}, {mode.replace('_', ' ')}: slowest eigenvalue {significant(float(values[worst]))} 1/s"
    text += f" at {degrees[worst]:.0f}°"
    if ratios[least] < 1.0:
        pitch = float(chart[f"{mode}.frequency"][least])
        text += f", damping at least {significant(float(ratios[least]), 2)} ({significant(pitch)} Hz)"
    return f"{text}."


@styled
def observer_stability(checks: Mapping[str, ErrorStability], *, sample_time: float) -> Figure:
    """Draw how fast the error of each observer decays at each angle.

    The decay is −ln(spectral radius)/T: below zero the error would grow. The legend states whether it is
    proved for a moving angle or checked at frozen angles only.
    """
    figure, (axes,) = panels(height=3.0)
    summaries = []
    for number, (label, check) in enumerate(checks.items()):
        color, dash, _ = look(number)
        decay = -np.log(check.radius) / sample_time
        known = (
            "proved" if check.proved else "proved for inner states" if check.proved_inner else "checked only"
        )
        axes.plot(np.degrees(check.angles), decay, color=color, linestyle=dash, label=f"{label} ({known})")
        at = int(np.argmin(decay))
        where = f"{np.degrees(check.angles[at]):.0f}°"
        summaries.append(f"{label}: slowest {significant(float(decay[at]))} 1/s at {where}, {known}.")
    if all(np.all(check.radius < 1.0) for check in checks.values()):
        log_axis(axes)
    else:
        axes.axhline(0.0, color=INK.light, linewidth=0.9, linestyle=(0, (4, 2)))
    axes.set_title("Slowest decay of the estimation error")
    axes.set_ylabel("decay in 1/s")
    axes.set_xlabel("angle in degrees")
    legend(axes, columns=2)
    return described(figure, f"Decay of the observers' error over the angle. {' '.join(summaries)}")


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
    best = f"best condition number {significant(float(np.min(condition)), 2)}"
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
    axes.set_ylabel("standard deviation in mN·m")
    axes.set_title("Standard deviation of the torque estimate")
    axes.set_ylim(bottom=0.0)
    legend(axes, columns=2)
