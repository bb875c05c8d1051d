"""Results over the angle: observability, estimation error, stability, stiffness."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.ticker import MaxNLocator

from ..analysis import Chart
from ..observer import ErrorStability
from .number_text import significant
from .style import DASHES, INK, MUTED, described, legend, log_axis, look, panels, styled


@styled
def observability_over_angle(charts: Mapping[str, Chart]) -> Figure:
    """Draw rank, condition number and standard deviation of the estimate over the angle.

    Where the rank is not full the condition number is infinite: those angles are marked at the upper edge.

    Parameters
    ----------
    charts
        By label, each with the columns of ``Observability``; those with the columns of ``EstimateDeviation``
        too appear in the third panel, which is left out if there is none.
    """
    deviations = {label: chart for label, chart in charts.items() if "deviation.best" in _columns(chart)}
    count = 3 if deviations else 2
    figure, axes = panels(count, height=1.5 + 1.4 * count, sharex=True, height_ratios=[1, 1.7, 1.7][:count])
    summaries = []
    for number, (label, chart) in enumerate(charts.items()):
        degrees = np.degrees(chart.at)
        color, dash, _ = look(number)
        rank = chart["observability.rank"]
        axes[0].step(degrees, rank, where="mid", label=label, color=color, linestyle=dash)
        summaries.append(_condition(axes[1], chart, number, label))
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
    """Draw the slowest decay at rest, and the relaxed and the instantaneous stiffness.

    Parameters
    ----------
    charts
        By label, each with the columns of ``Stability``.
    """
    figure, (left, right) = panels(1, 2, height=3.2)
    summaries = []
    for number, (label, chart) in enumerate(charts.items()):
        degrees, decay = np.degrees(chart.at), chart["decay"]
        tone, own, _ = look(number)
        left.plot(degrees, decay, color=tone, linestyle=own, label=label)
        for name, dash, state in (
            ("stiffness.fast", "-", "instantaneous"),
            ("stiffness.slow", DASHES[1], "relaxed"),
        ):
            shown = f"{label}, {state}" if len(charts) > 1 else state
            right.plot(degrees, chart[name], color=tone, linestyle=dash, label=shown)
        worst = int(np.argmax(decay))
        summaries.append(
            f"{label}: slowest eigenvalue {significant(float(decay[worst]))} 1/s at {degrees[worst]:.0f}°."
        )
    left.axhline(0.0, color=INK.light, linewidth=0.9, linestyle=(0, (4, 2)))
    left.set_title("Slowest real part (stable below the dashed line)", fontsize=8.5)
    left.set_ylabel("real part in 1/s")
    right.set_title("Stiffness at rest")
    right.set_ylabel("stiffness in N·m/rad")
    for panel in (left, right):
        panel.set_xlabel("angle in degrees")
    if len(charts) > 1:
        left.legend(loc="best")
    right.legend(loc="best")
    return described(figure, f"Stability and stiffness over the angle. {' '.join(summaries)}")


@styled
def observer_stability(checks: Mapping[str, ErrorStability], *, sample_time: float) -> Figure:
    """Draw how fast the error of each observer decays at each angle.

    The decay is −ln(spectral radius)/T: below zero the error would grow. The legend states whether it is
    proved for a moving angle or checked at frozen angles only.

    Parameters
    ----------
    checks
        By name of the observer.
    sample_time
        T in s.
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


def _columns(chart: Chart) -> set[str]:
    return {v.name for v in chart.columns}


def _condition(axes: Axes, chart: Chart, number: int, label: str) -> str:
    degrees, condition = np.degrees(chart.at), chart["observability.condition"]
    finite = np.isfinite(condition)
    tone, dash, _ = look(number)
    axes.plot(degrees, np.where(finite, condition, np.nan), label=label, color=tone, linestyle=dash)
    unobservable = degrees[~finite]
    height = np.full(len(unobservable), 0.97 - 0.07 * number)
    crosses: Any = {"linestyle": "none", "marker": "x", "markersize": 5, "markeredgewidth": 1.6}
    axes.plot(unobservable, height, transform=axes.get_xaxis_transform(), color=tone, **crosses)
    best = f"best condition number {significant(float(np.min(condition)), 2)}"
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
