"""Pictures of a finished design: to scale, inside their frame, and bars as long as the limits are used."""

from __future__ import annotations

import numpy as np
import pytest
from matplotlib.backends.backend_agg import FigureCanvasAgg
from matplotlib.container import BarContainer
from matplotlib.patches import Polygon

from nlsdesign.design import CamDesign, DesignSettings, design_cam
from nlsdesign.presentation.figures import data_sheet as sheet_module
from nlsdesign.presentation.figures.data_sheet import data_sheet
from nlsdesign.presentation.figures.design_figures import design_picture, limit_margins
from nlsdesign.presentation.figures.style import alternative_text
from tests.cam_cases import CONCAVE, KEEP, RUBBER, TARGET, actuator

HASTY = DesignSettings(starts=1, draws=0, look_for_size_ranges=False)


@pytest.fixture(scope="module")
def design() -> CamDesign:
    return design_cam(actuator(CONCAVE), target=TARGET, free=RUBBER, keep=KEEP, settings=HASTY)


def test_the_rubber_is_as_long_as_it_is_and_nothing_leaves_the_frame(design: CamDesign) -> None:
    figure = design_picture(design)
    rest = design.values["spring.rubber.rest_length"].number
    for axes, place in zip(figure.axes, (0, -1), strict=True):
        pieces = [p.get_xy() for p in axes.patches if isinstance(p, Polygon)]
        widths = sorted(np.ptp(xy[:, 0]) for xy in pieces)
        wanted = 1e3 * (rest + design.curves.extensions[place])
        assert min(abs(width - wanted) for width in widths) < 1e-6
        assert axes.get_aspect() == 1.0
        (left, right), (low, high) = axes.get_xlim(), axes.get_ylim()
        for xy in pieces:
            assert left <= xy[:, 0].min()
            assert xy[:, 0].max() <= right
            assert low <= xy[:, 1].min()
            assert xy[:, 1].max() <= high
    assert f"{1e3 * rest:.1f} mm" in figure.axes[1].get_xlabel()
    assert "section of" in alternative_text(figure)


def test_bars_are_as_long_as_the_limits_are_used(design: CamDesign) -> None:
    figure = limit_margins(design)
    (axes,) = figure.axes
    (bars,) = [each for each in axes.containers if isinstance(each, BarContainer)]
    assert len(bars) == len(design.limits) >= 3
    for bar, state in zip(bars, design.limits, strict=True):
        share = state.value / state.bound if state.upper else state.bound / state.value
        assert bar.get_width() == pytest.approx(min(share, 1.2))
        assert (bar.get_hatch() == "///") == state.active
    # No text lies on the line of the limit: all begin to the right of it.
    assert all(text.xy[0] >= 1.0 for text in axes.texts)


def test_the_data_sheet_is_one_page_a4_on_which_no_text_lies_on_another(design: CamDesign) -> None:
    page = data_sheet(design, deck="rubber")
    assert page.get_size_inches() * 25.4 == pytest.approx([210.0, 297.0])
    canvas = FigureCanvasAgg(page)
    canvas.draw()
    renderer = canvas.get_renderer()
    sheet, first, last, *_ = page.axes
    texts = [text for text in sheet.texts if text.get_text()]
    boxes = [text.get_window_extent(renderer) for text in texts]
    frame = sheet.get_window_extent(renderer)
    for text, box in zip(texts, boxes, strict=True):
        assert frame.x0 < box.x0 < box.x1 < frame.x1, text.get_text()
        assert frame.y0 < box.y0 < box.y1 < frame.y1, text.get_text()
    for number, one in enumerate(boxes):
        for other in boxes[number + 1 :]:
            assert min(one.x1, other.x1) <= max(one.x0, other.x0) or min(one.y1, other.y1) <= max(
                one.y0, other.y0
            )
    words = [text.get_text() for text in texts]
    torque = f"{float(design.check.torques[-1]):.3g}"
    assert f"{np.degrees(design.target.last_angle):.4g}°" in words
    assert any(word.startswith(torque) for word in words)
    # Both views of the mechanism are drawn at one scale.
    assert first.get_xlim() == last.get_xlim()
    assert "Data sheet" in alternative_text(page)


def test_a_limit_with_a_name_that_is_cut_short_is_still_said_to_be_reached(
    design: CamDesign, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(sheet_module, "_LABEL", 20)
    words = [text.get_text() for text in data_sheet(design, deck="rubber").axes[0].texts]
    assert sum(word.endswith(", reached") for word in words) == sum(s.active for s in design.limits) > 0
