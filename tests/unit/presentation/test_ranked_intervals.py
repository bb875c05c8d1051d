"""Ranked intervals: every name is drawn in its order, and intervals that are none are refused."""

from __future__ import annotations

import pytest

from nlsdesign.foundation.errors import ValueRangeError
from nlsdesign.presentation.figures import ranked_intervals
from nlsdesign.presentation.figures.style import alternative_text
from nlsdesign.presentation.figures.svg import svg_text

GROUPS = {
    "size, mm": {"small": (1.0, 2.0, 3.0), "large": (4.0, 5.0, 5.5)},
    "loss, mJ": {"small": (1.0, 1.0, 1.0)},
}


def test_names_stand_in_their_order_and_what_missed_comes_last() -> None:
    figure = ranked_intervals(GROUPS, missed=("none",), words="Two sizes.")
    axes = figure.axes[0]
    heights = {t.get_text(): y for t, y in zip(axes.get_yticklabels(), axes.get_yticks(), strict=True)}
    assert heights["small"] > heights["large"] > heights["none"]
    assert alternative_text(figure) == "Two sizes."
    points = axes.lines[-1].get_xydata()
    assert [tuple(row) for row in points] == [(2.0, heights["small"]), (5.0, heights["large"])]
    assert axes.get_xlabel() == "size, mm"
    assert "missed" in svg_text(figure)


@pytest.mark.parametrize("interval", [(1.0, 2.0), (2.0, 1.0, 3.0), (1.0, float("nan"), 3.0)])
def test_an_interval_is_three_ascending_numbers(interval: tuple[float, ...]) -> None:
    with pytest.raises(ValueRangeError, match=r"size: small .* must be three ascending numbers"):
        ranked_intervals({"size": {"small": interval}}, words="")


def test_nothing_to_draw_is_said() -> None:
    with pytest.raises(ValueRangeError, match="leave this figure out"):
        ranked_intervals({}, words="")
