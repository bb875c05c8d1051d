"""Errors of observers: with exact numbers, over the spread, against the least possible, and by cause."""

from __future__ import annotations

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure

from ...feedback.observer import SpreadErrors
from ...foundation.prefixes import shared_prefix
from .number_text import significant
from .style import DASHES, INK, MUTED, described, legend, log_axis, look, panels, styled

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
            f"{name}: exact {_range(factor * errors.exact[number])}, median {_range(median)}, 90 % "
            f"{_range(most)} {unit}."
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
    left.set_ylabel(f"torque error in {unit} rms")
    left.set_title("Bar: median to 90 %; open: exact numbers")
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
    axes.set_yticks(places, [_short(cause) for cause, _ in ranked])
    axes.tick_params(axis="y", labelsize=8)
    axes.margins(x=0.05)
    axes.set_xlim(left=0.0)
    axes.set_xlabel(f"{unit} rms for one standard deviation")
    axes.set_title(f"Largest causes, {errors.observers[0]}")
    axes.grid(visible=True, axis="y", color=MUTED.light, linewidth=0.3)


def _short(cause: str) -> str:
    """Return the last parts of a long name."""
    return ".".join(cause.split(".")[-2:])


def _range(values: np.ndarray) -> str:
    low, high = (significant(float(end)) for end in (np.min(values), np.max(values)))
    return low if low == high else f"{low} to {high}"
