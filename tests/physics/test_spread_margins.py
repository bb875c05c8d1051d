"""A gain with too small a margin is a finding, with the gain that has enough and what a kick does."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from nlsdesign.cli.analyse_loop import _loops
from nlsdesign.export import quickest
from nlsdesign.feedback.control import ClosedLoop, loop_margins
from nlsdesign.feedback.control.evaluation.onset import loop_over_spread
from nlsdesign.feedback.control.evaluation.spread_margins import (
    GAIN_MARGIN,
    PHASE_MARGIN,
    SpreadMargins,
    spread_margins,
)

GAIN, LAST = "controller.proportional", np.radians(50.0)


@pytest.fixture(scope="module")
def loop() -> ClosedLoop:
    return _loops("austin2015_figure_consistent", {"gains": None}, 1, 1e-3)[0]


@pytest.fixture(scope="module")
def published(loop: ClosedLoop) -> SpreadMargins:
    return spread_margins(loop, GAIN, last=LAST, translate=quickest())


def test_the_published_gain_is_a_finding_with_the_gain_that_has_a_margin(published: SpreadMargins) -> None:
    assert published.value == 32.0
    assert not published.kept
    assert published.least[0] < 1.0
    margin, kick = published.findings()
    assert "6 dB, 30° are asked for: 14" in margin
    assert "machines of the spread limit-cycle at 3.5 N·m after a kick of 10 ms" in kick
    assert 0.05 < published.cycling < 0.4


def test_the_gain_that_is_named_has_the_margin_and_survives_the_kick(
    loop: ClosedLoop, published: SpreadMargins
) -> None:
    better = replace(loop, controller=loop.controller.with_values({GAIN: published.enough}))
    found = spread_margins(better, GAIN, last=LAST, translate=quickest())
    assert found.kept
    assert found.findings() == []
    assert found.kicked is not None
    assert found.kicked.held == 1.0
    # By the margins of the declared machine alone, one angle at a time.
    margins = loop_margins(better, np.linspace(0.05, 1.0, 11) * LAST, opening=better.desired)
    assert np.min(margins.gain) >= GAIN_MARGIN
    assert np.min(margins.phase) >= PHASE_MARGIN


def test_a_kick_finds_more_limit_cycles_than_a_gentle_start(loop: ClosedLoop) -> None:
    """Between the onset for a kicked and for a quiet loop friction holds what begins gently."""
    quiet, kicked = (
        loop_over_spread(loop, amplitude=3.5, frequency=0.0, draws=24, kick=kick, translate=quickest())
        for kick in (0.0, 1.0)
    )
    assert kicked.held <= quiet.held < 1.0


def test_a_linear_spring_keeps_its_margin_with_the_same_gain() -> None:
    gentle = _loops("austin2015_soft_spring", {"gains": None}, 1, 1e-3)[0]
    found = spread_margins(gentle, GAIN, last=LAST, translate=quickest())
    assert found.kept
    assert found.enough == found.value
    assert found.findings() == []
