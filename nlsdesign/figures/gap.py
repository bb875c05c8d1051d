"""The gap between model and measurement before and after a diagnosis."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from numpy.typing import NDArray

from ..errors import ValueRangeError
from .lines import thinned
from .numbers import root_mean_square, significant
from .style import BLUE, GREEN, GRID, INK, MUTED, SURFACE, VERMILLION, described, legend, panels, styled

Floats = NDArray[np.float64]


@dataclass(frozen=True)
class RecordError:
    """Error of the model on one record, root mean square.

    Parameters
    ----------
    record
        Name of the record.
    before, after
        Of the refitted model as declared, and of the model with the added effects.
    noise_floor
        What no model can go below.
    held_out
        Whether no fit has seen this record.
    """

    record: str
    before: float
    after: float
    noise_floor: float
    held_out: bool


@styled
def gap_bars(errors: Sequence[RecordError], *, unit: str, quantity: str = "error") -> Figure:
    """Draw the error on each record before and after, with the noise floor; held-out records on the right.

    Parameters
    ----------
    errors
        At least one.
    unit
        Of the errors, for instance ``"N"``.
    quantity
        What the error is of, for the axis.

    Raises
    ------
    ValueRangeError
        If there is no record.
    """
    if not errors:
        raise ValueRangeError(
            "errors of a diagnosis", "there is no record to draw", next_step="leave this figure out"
        )
    ordered = sorted(errors, key=lambda e: e.held_out)
    figure, (axes,) = panels(height=3.4)
    place = np.arange(len(ordered), dtype=float)
    bars = (("before", -0.2, VERMILLION.light, "///"), ("after", 0.2, BLUE.light, ""))
    for label, shift, tone, hatch in bars:
        heights = [getattr(e, label) for e in ordered]
        found = axes.bar(
            place + shift, heights, 0.38, color=tone, hatch=hatch, edgecolor=SURFACE.light, label=label
        )
        axes.bar_label(found, [significant(h, 2) for h in heights], padding=2, fontsize=8, color=INK.light)
    floors = [e.noise_floor for e in ordered]
    axes.hlines(floors, place - 0.45, place + 0.45, color=INK.light, linewidth=1.6, label="noise floor")
    fitted = sum(not e.held_out for e in ordered)
    if 0 < fitted < len(ordered):
        axes.axvline(fitted - 0.5, color=MUTED.light, linestyle=(0, (4, 2)), linewidth=1.0)
    for name, first, last in (("fitted", 0, fitted), ("held out", fitted, len(ordered))):
        if last > first:
            where: Any = {"transform": axes.get_xaxis_transform(), "ha": "center", "va": "top"}
            axes.text((first + last - 1) / 2, 1.0, name, color=MUTED.light, fontweight="bold", **where)
    crowded = max(len(e.record) for e in ordered) * len(ordered) > 90
    axes.set_xticks(place, [e.record for e in ordered])
    if crowded:
        axes.tick_params(axis="x", labelrotation=25)
    axes.grid(visible=False, axis="x")
    axes.set_xlim(-0.6, len(ordered) - 0.4)
    axes.margins(y=0.22)
    axes.set_ylabel(f"rms {quantity} in {unit}")
    legend(axes)
    seen = [
        f"{e.record} {significant(e.before, 2)} to {significant(e.after, 2)} {unit}"
        for e in ordered
        if e.held_out
    ]
    return described(figure, f"Error of each record before and after. Held out: {'; '.join(seen) or 'none'}.")


@dataclass(frozen=True, eq=False)
class HeldOut:
    """One held-out record: measured and simulated; arrays of shape (n,).

    Parameters
    ----------
    time
        In s.
    measured, before, after
        The quantity as measured, from the model as declared, and from the model with the added effects.
    quantity, unit
        What it is, for the axes.
    noise
        Standard deviation of the measurement.
    """

    time: Floats
    measured: Floats
    before: Floats
    after: Floats
    quantity: str
    unit: str
    noise: float = 0.0


@styled
def held_out_series(record: HeldOut) -> Figure:
    """Draw a held-out record over time, measured and simulated, and what remains below.

    Parameters
    ----------
    record
        The record.
    """
    figure, (upper, lower) = panels(2, height=4.6, sharex=True, height_ratios=[1.3, 1])
    upper.plot(
        *thinned(record.time, record.measured), color=INK.light, linewidth=2.6, alpha=0.4, label="measured"
    )
    said = []
    for label, values, tone, dash in (
        ("before", record.before, VERMILLION.light, (0, (5, 1.6))),
        ("after", record.after, BLUE.light, "-"),
    ):
        rest = record.measured - values
        rms = f"{significant(root_mean_square(rest))} {record.unit}"
        said.append(f"{rms} {label}")
        upper.plot(*thinned(record.time, values), color=tone, linestyle=dash, linewidth=1.2, label=label)
        lower.plot(
            *thinned(record.time, rest), color=tone, linestyle="-", linewidth=0.9, label=f"{label}: rms {rms}"
        )
    if record.noise > 0.0:
        lower.axhspan(
            -2 * record.noise, 2 * record.noise, color=GRID.light, zorder=0.5, label="noise, ± 2 deviations"
        )
    _finish(upper, f"{record.quantity} in {record.unit}", "Record that no fit has seen")
    _finish(lower, f"rest in {record.unit}", "Measured minus simulated")
    lower.set_xlabel("time in s")
    return described(
        figure, f"A held-out record of {record.quantity} over time. Remaining error: {', '.join(said)}."
    )


@dataclass(frozen=True)
class CandidateShare:
    """How much of the excess over the noise one candidate explains on held-out records.

    Parameters
    ----------
    name
        Of the effect.
    share
        Between zero and one; below zero where it made things worse.
    chosen
        Whether it was added to the model.
    """

    name: str
    share: float
    chosen: bool = False


@styled
def candidate_shares(candidates: Sequence[CandidateShare]) -> Figure:
    """Draw which share of the excess over the noise each candidate explains, the best on top.

    Parameters
    ----------
    candidates
        At least one.

    Raises
    ------
    ValueRangeError
        If there is no candidate.
    """
    if not candidates:
        raise ValueRangeError("candidates", "there is none to draw", next_step="leave this figure out")
    ordered = sorted(candidates, key=lambda c: c.share)
    figure, (axes,) = panels(height=1.0 + 0.3 * len(ordered))
    for row, each in enumerate(ordered):
        share = 100 * max(each.share, -0.1)
        axes.barh(
            row,
            share,
            0.62,
            color=GREEN.light if each.chosen else MUTED.light,
            alpha=1 if each.chosen else 0.55,
        )
        words = f"{100 * each.share:.0f} %{', added' if each.chosen else ''}".replace("-", "−")
        axes.text(max(share, 0.0) + 1.0, row, words, va="center", fontsize=8.5)
    axes.axvline(0.0, color=MUTED.light, linewidth=0.8)
    axes.set_yticks(range(len(ordered)), [each.name for each in ordered])
    axes.set_xlim(min(0.0, 100 * max(ordered[0].share, -0.1)) - 1.0, 112.0)
    axes.set_xlabel("share of the held-out excess over the noise that is explained, in %")
    axes.grid(visible=False, axis="y")
    best = ordered[::-1][:3]
    words = ", ".join(f"{c.name} {100 * c.share:.0f} %" for c in best)
    return described(
        figure, f"Share of the held-out error that each candidate explains, best first: {words}."
    )


def _finish(axes: Axes, ordinate: str, title: str) -> None:
    axes.set_ylabel(ordinate)
    axes.set_title(title)
    legend(axes)
