"""Curves over any quantity, beside points from elsewhere, and of torque over the angle."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass

import numpy as np
from matplotlib.figure import Figure

from ...bench.identification.residuals import Agreement
from ...design import Target
from ...foundation.arrays import Array
from ...foundation.errors import ValueRangeError
from ...foundation.quantity import typeset_number
from ...foundation.written_numbers import shared_prefix
from .style import (
    AFTER,
    DASHES,
    GRID,
    INK,
    MUTED,
    crosses,
    described,
    label_panel,
    legend,
    log_axis,
    look,
    panels,
    root_mean_square,
    styled,
)
from .svg import thinned

Curve = tuple[Array, Array]


@styled
def curves(
    lines: Mapping[str, Curve], *, across: str, up: str, words: str, logarithmic: bool = False
) -> Figure:
    """Draw curves over a common quantity.

    Parameters
    ----------
    lines
        Abscissa and ordinate by label, each of shape (n,); fewer than 40 points are drawn as points too.
    across, up
        Labels of the axes, with units.
    words
        Alternative text: what the figure shows.
    logarithmic
        Whether the abscissa is logarithmic.

    Raises
    ------
    ValueRangeError
        If there are no curves.
    """
    if not lines:
        raise ValueRangeError("curves", "there are none to draw", next_step="leave this figure out")
    figure, (axes,) = panels(1, height=3.0)
    for number, (label, (x, y)) in enumerate(lines.items()):
        tone, dash, point = look(number)
        marker = point if len(x) < 40 else ""
        axes.plot(*thinned(x, y), color=tone, linestyle=dash, marker=marker, label=label, linewidth=1.4)
    if logarithmic:
        log_axis(axes, abscissa=True)
    axes.set(xlabel=across, ylabel=up)
    axes.margins(x=0.02)
    legend(axes, columns=3)
    return described(figure, words)


@dataclass(frozen=True, eq=False)
class PointPanel:
    """One panel: curves, and points of the same colour where the labels agree.

    Parameters
    ----------
    title
        What is shown.
    up
        Label of the ordinate, with unit.
    curves
        Abscissa and ordinate by label, shape (n,) each; a value that is not a number interrupts the curve and
        has a cross at the lower edge.
    points
        Abscissa and ordinate by label.
    logarithmic
        Whether the ordinate is logarithmic.

    Raises
    ------
    ValueRangeError
        If points have no curve of the same label.
    """

    title: str
    up: str
    curves: Mapping[str, Curve]
    points: Mapping[str, Curve]
    logarithmic: bool = False

    def __post_init__(self) -> None:
        for label in self.points:
            if label not in self.curves:
                raise ValueRangeError(
                    f"points '{label}'", f"have no curve; the curves are {', '.join(self.curves)}",
                    next_step="give points and curve the same label",
                )  # fmt: skip


@styled
def curves_beside_points(shown: Sequence[PointPanel], *, across: str, words: str, columns: int = 1) -> Figure:
    """Draw curves as lines and points as hollow marks, over a logarithmic abscissa.

    Parameters
    ----------
    shown
        Row by row.
    across
        Label of the abscissa, with unit.
    words
        Alternative text: what the figure shows.
    columns
        Panels side by side.

    Raises
    ------
    ValueRangeError
        If there are no panels.
    """
    if not shown:
        raise ValueRangeError("panels", "there are none to draw", next_step="leave this figure out")
    rows = -(-len(shown) // columns)
    figure, axes = panels(rows, columns, height=0.6 + 2.6 * rows, sharex=True)
    for axis, panel in zip(axes, shown, strict=False):
        for number, (label, (x, y)) in enumerate(panel.curves.items()):
            tone, dash, point = look(number)
            axis.plot(
                x, y, color=tone, linestyle=dash, label=label, linewidth=1.4, markersize=2.0, marker="."
            )
            crosses(axis, x[~np.isfinite(y)], 0.04 + 0.06 * number, tone)
            if label in panel.points:
                axis.plot(*panel.points[label], color=tone, linestyle="none", marker=point, fillstyle="none")
        if panel.logarithmic:
            log_axis(axis)
        axis.set(title=panel.title, ylabel=panel.up)
        axis.margins(x=0.03)
        log_axis(axis, abscissa=True)
    for axis in axes[-columns:]:
        axis.set_xlabel(across)
    for axis in axes[:columns]:
        legend(axis)
    return described(figure, words)


"""Angles in rad and torques in N·m, shape (n,) each."""


@styled
def torque_against_target(target: Target, designs: Mapping[str, Curve]) -> Figure:
    """Draw designs against the target with its tolerance band; below, their errors.

    Parameters
    ----------
    target
        Required torque curve.
    designs
        By label.
    """
    figure, (upper, lower) = panels(2, height=4.6, sharex=True, height_ratios=[2.2, 1])
    grid = np.linspace(0.0, target.last_angle, 200)
    degrees = np.degrees(grid)
    low, high = target.band(grid)
    half = float(high[-1] - target.torque(grid)[-1])
    errors = {
        label: torque - target.torque(np.clip(angle, 0.0, target.last_angle))
        for label, (angle, torque) in designs.items()
    }
    factor, unit = shared_prefix([half, *(root_mean_square(error) for error in errors.values())], "N*m")
    if half > 0.0:
        label = f"tolerance ± {typeset_number(factor * half, 3)} {unit}"
        upper.fill_between(degrees, low, high, color=GRID.light, label=label)
        lower.axhspan(-factor * half, factor * half, color=GRID.light)
    upper.plot(
        degrees, target.torque(grid), color=INK.light, linewidth=1.2, linestyle=(0, (4, 2)), label="target"
    )
    lower.axhline(0.0, color=INK.light, linewidth=1.0, linestyle=(0, (4, 2)))
    summaries = []
    for number, (label, (angle, torque)) in enumerate(designs.items()):
        tone, dash, _ = look(number)
        error = errors[label]
        rms = root_mean_square(error)
        summaries.append(f"{label} {typeset_number(factor * rms, 2)} {unit}")
        upper.plot(np.degrees(angle), torque, color=tone, linestyle=dash, label=label)
        lower.plot(
            np.degrees(angle),
            factor * error,
            color=tone,
            linestyle=dash,
            label=f"{label}: rms {typeset_number(factor * rms, 2)} {unit}",
        )
    label_panel(upper, "torque in N·m", "Torque of the spring")
    label_panel(lower, f"error in {unit}", "Design minus target")
    lower.set_xlabel("angle in degrees")
    return described(
        figure,
        f"Torque over the angle up to {degrees[-1]:.0f}° and {target.largest:.1f} N·m, designs against "
        f"target, with the error below. Root mean square error: {'; '.join(summaries)}.",
    )


@styled
def torque_against_measured(
    models: Mapping[str, Curve], measured: Mapping[str, Curve], *, notes: Mapping[str, str] | None = None
) -> Figure:
    """Draw models against measured points; below, model minus measurement at those points.

    Parameters
    ----------
    models, measured
        By label. Angles of a model ascend; each model is compared with each measurement.
    notes
        Text behind the label of a model in the legend, for instance its error in the metric of a paper.
    """
    _require("measured points", measured)
    figure, (upper, lower) = panels(2, height=4.8, sharex=True, height_ratios=[2.2, 1])
    lower.axhline(0.0, color=MUTED.light, linewidth=0.8)
    descriptions = []
    for number, (label, (angle, torque)) in enumerate(models.items()):
        tone, dash, _ = look(number)
        note = (notes or {}).get(label, "")
        descriptions.append(f"{label} ({note})" if note else label)
        upper.plot(*thinned(np.degrees(angle), torque), color=tone, linestyle=dash, label=": ".join(
            part for part in (label, note) if part))  # fmt: skip
        for position, (at, points) in enumerate(measured.values()):
            marker = look(position).marker
            inside = (at >= angle[0]) & (at <= angle[-1])
            error = np.interp(at[inside], angle, torque) - points[inside]
            lower.plot(
                np.degrees(at[inside]), error, color=tone, linestyle=dash, linewidth=0.8, marker=marker
            )
    for position, (label, (at, points)) in enumerate(measured.items()):
        marker = look(position).marker
        upper.plot(np.degrees(at), points, color=INK.light, linestyle="none", marker=marker, label=label,
                   markerfacecolor="none", markeredgewidth=1.2, markersize=5.5)  # fmt: skip
    label_panel(upper, "torque in N·m", "Torque of the spring", columns=2)
    lower.set(title="Model minus measurement", xlabel="angle in degrees", ylabel="error in N·m")
    upper.margins(x=0.02)
    return described(
        figure,
        f"Torque over the angle: {' and '.join(measured)} against {' and '.join(descriptions)}; error below.",
    )


@styled
def torque_loops(loops: Mapping[str, tuple[Curve, Curve]]) -> Figure:
    """Draw measured and simulated loops of torque over angle, one panel each.

    The area of a loop is the energy lost per cycle; the title of the panel states it.

    Parameters
    ----------
    loops
        By title: measured, then simulated loop, samples in the order of time.
    """
    _require("loops", loops)
    figure, axes = panels(1, len(loops), height=3.5, sharey=True)
    energies = []
    for panel, (title, (measured, model)) in zip(axes, loops.items(), strict=True):
        panel.plot(*_degrees(measured), color=INK.light, linewidth=1.1, label="measured")
        panel.plot(*_degrees(model), color=AFTER.light, linestyle=DASHES[1], label="model")
        areas = [typeset_number(1e3 * abs(loop_area(*loop)), 3) for loop in (measured, model)]
        energies.append(f"{title}: {areas[0]} mJ measured, {areas[1]} mJ in the model")
        panel.set_title(f"{title}, lost per cycle: {areas[0]} mJ measured, {areas[1]} mJ model", fontsize=8.5)
        panel.set_xlabel("angle in degrees")
        panel.margins(x=0.03)
    axes[0].set_ylabel("torque in N·m")
    axes[0].legend(loc="upper left")
    return described(
        figure, f"Loops of torque over angle, measured and simulated. Energy lost: {'; '.join(energies)}."
    )


def metric_note(agreement: Agreement, unit: str = "N·m") -> str:
    """Return the paper's two metrics as a note for a legend: ``13.1 %, 0.083 N·m rms``.

    Parameters
    ----------
    agreement
        Of a model with a measurement.
    unit
        Of the measured quantity.
    """
    return f"{typeset_number(agreement.relative)} %, {typeset_number(agreement.rmse, 2)} {unit} rms"


def loop_area(angle: Array, torque: Array) -> float:
    """Return ∮τ dθ of a loop that is closed by a straight line, in J.

    Positive for a passive spring: the torque leads the angle.

    Parameters
    ----------
    angle, torque
        Shape (n,), in rad and N·m, in the order of time.
    """
    x, y = np.append(angle, angle[0]), np.append(torque, torque[0])
    return float(np.sum(np.diff(x) * (y[1:] + y[:-1]) / 2))


def _degrees(curve: Curve) -> tuple[Array, Array]:
    return thinned(np.degrees(curve[0]), curve[1])


def _require(what: str, given: Mapping[str, object]) -> None:
    if not given:
        raise ValueRangeError(what, "there are none to draw", next_step="leave this figure out")
