"""Errors of a model before and after a diagnosis."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from typing import Any

import numpy as np
from matplotlib.figure import Figure

from ...foundation.arrays import Array
from ...foundation.errors import ValueRangeError
from ...foundation.quantity import typeset_number, typeset_unit
from .style import (
    AFTER,
    BEFORE,
    DASHES,
    GRID,
    HOLDS,
    INK,
    MUTED,
    SURFACE,
    described,
    label_panel,
    legend,
    panels,
    root_mean_square,
    styled,
)
from .svg import thinned

Curve = tuple[Array, Array]

UNCHANGED = "refitted model"
"""What stands in place of ``before`` where nothing was added, so that there is no ``after``."""


_MOST_LEVEL = 9
"""Records up to which the numbers of bars have room side by side."""
_GAP = 6.0
"""Usual steps between samples beyond which a line is interrupted."""


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
        Error that measurement noise alone leaves.
    held_out
        Whether the record was used by no fit.
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
        Name of the error, for the axis.

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
    unit = typeset_unit(unit)
    positions = np.arange(len(ordered), dtype=float)
    changed = any(e.before != e.after for e in ordered)
    near = 0.1 * max(max(e.before, e.after, e.noise_floor) for e in ordered)
    bars = (("before", -0.2, BEFORE.light, "///"), ("after", 0.2, AFTER.light, ""))
    for which, shift, tone, hatch in bars if changed else bars[:1]:
        heights = [getattr(e, which) for e in ordered]
        label = which if changed else UNCHANGED
        places = positions + (shift if changed else 0.0)
        drawn = axes.bar(places, heights, 0.38, color=tone, hatch=hatch, edgecolor=SURFACE.light, label=label)
        # A label between its bar and the noise floor would be struck through by the line.
        tops = [
            e.noise_floor if h < e.noise_floor < h + near else h
            for h, e in zip(heights, ordered, strict=True)
        ]
        for bar, top, height in zip(drawn, tops, heights, strict=True):
            axes.annotate(
                typeset_number(height), (bar.get_x() + bar.get_width() / 2, top), (0, 2), color=INK.light,
                fontsize=8, ha="center", va="bottom", textcoords="offset points",
                rotation=90.0 if len(ordered) > _MOST_LEVEL else 0.0,
            )  # fmt: skip
    floors = [e.noise_floor for e in ordered]
    axes.hlines(
        floors, positions - 0.45, positions + 0.45, color=INK.light, linewidth=1.6, label="noise floor"
    )
    fitted = sum(not e.held_out for e in ordered)
    if 0 < fitted < len(ordered):
        axes.axvline(fitted - 0.5, color=MUTED.light, linestyle=(0, (4, 2)), linewidth=1.0)
    for name, first, last in (("fitted", 0, fitted), ("held out", fitted, len(ordered))):
        if last > first:
            where: Any = {"transform": axes.get_xaxis_transform(), "ha": "center", "va": "top"}
            axes.text((first + last - 1) / 2, 1.0, name, color=MUTED.light, fontweight="bold", **where)
    crowded = max(len(e.record) for e in ordered) * len(ordered) > 90
    axes.set_xticks(positions, [e.record for e in ordered])
    if crowded:
        axes.tick_params(axis="x", labelrotation=25)
    axes.grid(visible=False, axis="x")
    axes.set_xlim(-0.6, len(ordered) - 0.4)
    axes.margins(y=0.22)
    axes.set_ylabel(f"rms {quantity} in {unit}" if unit else f"rms {quantity}")
    legend(axes)
    held_out = [
        f"{e.record} {typeset_number(e.before)} to {typeset_number(e.after)} {unit}"
        for e in ordered
        if e.held_out
    ]
    return described(
        figure, f"Error of each record before and after. Held out: {'; '.join(held_out) or 'none'}."
    )


@dataclass(frozen=True, eq=False)
class HeldOut:
    """One record: measured and predicted, filtered alike; arrays of shape (n,)."""

    time: Array  # in s
    # measured, before, after: the quantity as measured, from the model as declared, and from the model with
    # the added effects
    measured: Array
    before: Array
    after: Array
    # quantity, unit: name and unit, for the axes
    quantity: str
    unit: str
    noise: float = 0.0  # standard deviation of the noise that passes the filter
    title: str = "Held-out record"  # above the upper panel


@styled
def held_out_series(record: HeldOut) -> Figure:
    """Draw a record over time, measured and predicted; below, the errors, whose rms is that of the record."""
    unit, record = typeset_unit(record.unit), _interrupted(record)
    figure, (upper, lower) = panels(2, height=4.6, sharex=True, height_ratios=[1.3, 1])
    upper.plot(
        *thinned(record.time, record.measured), color=INK.light, linewidth=2.6, alpha=0.4, label="measured"
    )
    errors = []
    changed = not np.array_equal(record.before, record.after, equal_nan=True)
    for label, values, tone, dash in (
        ("before" if changed else UNCHANGED, record.before, BEFORE.light, DASHES[1]),
        *([("after", record.after, AFTER.light, DASHES[0])] if changed else []),
    ):
        residual = record.measured - values
        rms = f"{typeset_number(root_mean_square(residual))} {unit}"
        errors.append(f"{rms} {label}")
        upper.plot(*thinned(record.time, values), color=tone, linestyle=dash, linewidth=1.2, label=label)
        lower.plot(
            *thinned(record.time, residual),
            color=tone,
            linestyle="-",
            linewidth=0.9,
            label=f"{label}: rms {rms}",
        )
    if record.noise > 0.0:
        lower.axhspan(
            -2 * record.noise,
            2 * record.noise,
            color=GRID.light,
            zorder=0.5,
            label="noise, ± 2 standard deviations",
        )
    label_panel(upper, f"{record.quantity} in {unit}", record.title)
    label_panel(lower, f"error in {unit}", "Measured minus predicted")
    lower.set_xlabel("time in s")
    return described(
        figure, f"{record.title}: {record.quantity} over time. Remaining error: {', '.join(errors)}."
    )


def _interrupted(record: HeldOut) -> HeldOut:
    """Return the record with a gap where samples do not count: a line across would look like measured."""
    steps = np.diff(record.time)
    gaps = np.flatnonzero(steps > _GAP * np.median(steps)) + 1 if len(steps) else np.array([], dtype=int)
    if not len(gaps):
        return record
    time = np.insert(record.time, gaps, 0.5 * (record.time[gaps - 1] + record.time[gaps]))
    measured, before, after = (
        np.insert(values, gaps, np.nan) for values in (record.measured, record.before, record.after)
    )
    return replace(record, time=time, measured=measured, before=before, after=after)


@styled
def binned_errors(before: Curve, after: Curve, *, across: str, unit: str, name: str) -> Figure:
    """Draw the mean error in bins of a quantity, before and after."""
    figure, (axes,) = panels(height=3.0)
    changed = not np.array_equal(before[1], after[1])
    for label, (x, y), tone, dash, marker in (
        ("before" if changed else UNCHANGED, before, BEFORE.light, DASHES[1], "s"),
        *([("after", after, AFTER.light, DASHES[0], "o")] if changed else []),
    ):
        axes.plot(*thinned(x, y), color=tone, linestyle=dash, marker=marker, label=label, linewidth=1.4)
    axes.margins(x=0.02)
    axes.set_xlabel(across)
    label_panel(axes, f"mean error in {typeset_unit(unit)}", "Mean error in bins")
    sizes = [typeset_number(root_mean_square(y), 2) for _, y in (before, after)]
    return described(
        figure,
        f"Mean error of {name} over {across}: {sizes[0]} {typeset_unit(unit)} rms before, "
        f"{sizes[1]} {typeset_unit(unit)} after.",
    )


@dataclass(frozen=True)
class CandidateShare:
    """Share of the excess over the noise floor that one candidate explains."""

    name: str
    share: float  # between zero and one; below zero where the error grew
    chosen: bool = False  # whether it was added to the model


@styled
def candidate_shares(candidates: Sequence[CandidateShare]) -> Figure:
    """Draw the share of the excess over the noise floor that each candidate explains, the largest on top."""
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
            color=HOLDS.light if each.chosen else MUTED.light,
            alpha=1 if each.chosen else 0.55,
        )
        label = f"{round(100 * each.share)} %{', added' if each.chosen else ''}".replace("-", "−")
        axes.text(max(share, 0.0) + 1.0, row, label, va="center", fontsize=8.5)
    axes.axvline(0.0, color=MUTED.light, linewidth=0.8)
    axes.set_yticks(range(len(ordered)), [each.name for each in ordered])
    axes.set_xlim(min(0.0, 100 * max(ordered[0].share, -0.1)) - 1.0, 112.0)
    axes.set_xlabel("explained share of the excess over the noise floor in %")
    axes.grid(visible=False, axis="y")
    best = ordered[::-1][:3]
    summary = ", ".join(f"{c.name} {100 * c.share:.0f} %" for c in best)
    return described(
        figure,
        f"Share of the excess over the noise floor that each candidate explains, largest first: {summary}.",
    )
