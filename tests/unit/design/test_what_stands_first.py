"""What can be made stands before what exact numbers would give: text, file, report, live page."""

from __future__ import annotations

import re
from dataclasses import replace
from pathlib import Path

import pytest

from nlsdesign.components import declare
from nlsdesign.design import CamDesign, DesignSettings, ExponentialTorque, design_cam, design_summary
from nlsdesign.foundation.deck import load_deck
from nlsdesign.foundation.quantity import quantity
from nlsdesign.live.gallery import question_of
from nlsdesign.live.views import view_of
from nlsdesign.presentation.report import write_design_report
from tests.undrawn import undrawn

__all__ = ["undrawn"]
pytestmark = pytest.mark.usefixtures("undrawn")

MADE, EXACT = "torque error over the spread", "torque error, exact numbers"
FREE = ["spring.cam.contour", "spring.pretension", "spring.rubber.area", "spring.rubber.rest_length"]
"""All that a small cam needs to follow the target; the spread of the rubber is then all that is left."""


@pytest.fixture(scope="module")
def design() -> CamDesign:
    return design_cam(
        declare(load_deck("austin2015_figure_consistent")),
        target=ExponentialTorque(maximum=quantity(5.0, "N*m"), angle=quantity(53.0, "deg"), shape=1.0),
        free=FREE,
        settings=DesignSettings(starts=1, draws=40, look_for_size_ranges=False, look_for_remedies=False),
    )


def test_the_error_over_the_spread_follows_the_verdict_and_the_exact_one_it(design: CamDesign) -> None:
    rows = design.rows()
    names = [name for name, _ in rows]
    assert names[0] == "verdict"
    assert rows[0][1] == "meets its target with exact numbers"
    assert names[1] == MADE
    assert names.index(EXACT) < names.index("target")
    assert design.tolerance is not None
    worst = design.tolerance.quantiles[-1].value
    text = dict(rows)[MADE]
    number, milli = re.findall(r"below ([0-9.]+) (m?)N·m rms", text)[0]
    assert float(number) * (1e-3 if milli else 1.0) == pytest.approx(worst, rel=1e-3)
    share = float(re.findall(r"\(([0-9.]+) %", text)[0])
    assert share == pytest.approx(100.0 * worst / design.target.largest, rel=0.05)
    assert worst > 10.0 * design.rms, "the exact error says nothing of a made spring"


def test_without_draws_it_says_that_no_made_spring_was_looked_at(design: CamDesign) -> None:
    rows = dict(replace(design, tolerance=None).rows())
    assert rows[MADE] == "not known: no draws were asked for, or a remark says why"


def test_the_file_has_the_same_order(design: CamDesign) -> None:
    keys = list(design_summary(design))
    assert keys.index("rms_error_over_spreads") < keys.index("torque_error_rms")


def test_the_report_begins_with_made_springs(design: CamDesign, tmp_path: Path) -> None:
    page = write_design_report(tmp_path / "report.html", design, deck="a deck").read_text(encoding="utf-8")
    assert 0 < page.index("torque error, 95 % of made springs") < page.index(EXACT)


def test_the_live_page_is_told_the_error_over_the_spread(design: CamDesign) -> None:
    question = question_of(declare(load_deck("austin2015_figure_consistent")), "a deck")
    assert design.tolerance is not None
    assert view_of(question, 1, design).made_error == design.tolerance.quantiles[-1].value
