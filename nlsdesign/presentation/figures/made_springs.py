"""What made springs do: the torque error by cause, and the torque of most of them over the angle."""

from __future__ import annotations

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure

from ...design import ToleranceResult
from ...foundation.errors import ValueRangeError
from ...foundation.prefixes import shared_prefix
from .number_text import significant
from .style import AFTER, BEFORE, GRID, INK, MUTED, SURFACE, described, legend, panels, styled

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
    ends = [value for value in values]
    for k, (_, each) in enumerate(whole):
        upper = each.upper if np.isfinite(each.upper) else each.value
        axes.hlines(places[k], factor * each.lower, factor * upper, color=INK.light, linewidth=1.3)
        ends[k] = factor * upper
    for place, value, end in zip(places, values, ends, strict=True):
        axes.annotate(
            significant(value, 3), (end, place), (4, 0), color=INK.light, fontsize=8, va="center",
            textcoords="offset points",
        )  # fmt: skip
    axes.set_yticks(places, names)
    axes.grid(visible=False, axis="y")
    axes.set_ylim(places[-1] - 0.6, 0.6)
    axes.margins(x=0.1)
    axes.set_xlim(left=0.0)
    axes.set_xlabel(f"95 % quantile of the rms torque error in {unit}")
    axes.set_title(f"{len(result.errors)} made springs")
    best = min((each.value, name) for name, each in whole)
    return described(
        figure,
        f"95 % quantile of the rms torque error of {len(result.errors)} made springs: "
        f"{significant(factor * built.value, 3)} {unit} as built, {significant(factor * best[0], 3)} {unit} "
        f"at best ({best[1]}). Largest cause alone: {causes[0].cause.name}, "
        f"{significant(factor * causes[0].alone, 3)} {unit}.",
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
    _targeted(upper, degrees, wanted)
    lower.axhline(0.0, color=INK.light, linewidth=1.0, linestyle=(0, (4, 2)))
    lower.grid(color=GRID.light)
    upper.set_ylabel("torque in N·m")
    upper.set_title("Torque of made springs")
    lower.set_ylabel(f"error in {unit}")
    lower.set_title("Made minus target")
    lower.set_xlabel("angle in degrees")
    legend(upper, columns=2)
    after = f", {significant(factor * widest[1], 3)} {unit} after the trim" if len(widest) > 1 else ""
    return described(
        figure,
        f"Band of the torque over the angle up to {degrees[-1]:.0f}° within which 90 % of the made springs "
        f"lie, with the target; at most {significant(factor * widest[0], 3)} {unit} wide as built{after}. "
        "Errors below.",
    )


def _targeted(axes: Axes, degrees: np.ndarray, wanted: np.ndarray) -> None:
    axes.plot(degrees, wanted, color=INK.light, linewidth=1.2, linestyle=(0, (4, 2)), label="target")
