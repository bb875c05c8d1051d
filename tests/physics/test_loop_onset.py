"""The gain at which a loop begins to limit-cycle, against a dense sweep and the linearised loop."""

from __future__ import annotations

import math

import numpy as np
import pytest

from nlsdesign.components.assembly.deck_writer import declare
from nlsdesign.export import natively
from nlsdesign.feedback.control import (
    ClosedLoop,
    TorqueGains,
    encoder_loop,
    onset_of_limit_cycling,
    torque_controller,
)
from nlsdesign.feedback.control.evaluation.onset import linear_onset
from nlsdesign.feedback.observer import CascadeGain, design_observer
from nlsdesign.foundation.deck import load_deck
from nlsdesign.foundation.errors import UnknownNameError, ValueRangeError
from nlsdesign.model import flatten
from nlsdesign.simulation.sampled_batch import run_batch

GAIN = "controller.proportional"


@pytest.fixture(scope="module")
def loop() -> ClosedLoop:
    plant = flatten(
        declare(load_deck("austin2015_figure_consistent")), outputs=["motor.angle", "spring.torque"]
    )
    controller = torque_controller(plant, gains=TorqueGains())
    return encoder_loop(plant, observer=design_observer(plant, gain=CascadeGain()), controller=controller)


def swings(loop: ClosedLoop, gains: np.ndarray, amplitude: float) -> np.ndarray:
    """Largest torque between 60 and 100 Hz in the last 2 s of a 1 Hz sine, by its spectrum alone."""
    time = loop.sample_time * np.arange(3000)
    batch = run_batch(
        loop.system([loop.desired]), 2.999, inputs={loop.desired: amplitude * np.sin(2 * np.pi * time)},
        parameters={f"controller.{GAIN}": gains}, keep=(loop.torque,), translate=natively,
    )  # fmt: skip
    torque = batch[loop.torque][:, 1000:]
    spectrum = np.fft.rfft(torque)
    at = np.fft.rfftfreq(torque.shape[1], loop.sample_time)
    spectrum[:, (at < 60.0) | (at > 100.0)] = 0.0
    return np.max(np.abs(np.fft.irfft(spectrum)), axis=1)


@pytest.mark.long_cases("1.0")
@pytest.mark.parametrize("amplitude", [1.0, 2.8])
def test_onset_against_a_dense_sweep(loop: ClosedLoop, amplitude: float) -> None:
    """In the sweep the band of the oscillation jumps up where it begins: ten times steeper than before."""
    found = onset_of_limit_cycling(
        loop, GAIN, between=(20.0, 120.0), amplitude=amplitude, frequency=1.0, translate=natively
    )
    gains = found.value * np.linspace(0.8, 1.2, 41)
    size = swings(loop, gains, amplitude)
    base = np.max(size[:10])
    begins = float(gains[np.flatnonzero(size > 1.5 * base)[0]])
    assert found.value == pytest.approx(begins, rel=0.05)


@pytest.mark.long_cases("2.8-37.5", "1.0-61.6")
@pytest.mark.parametrize(("amplitude", "critical"), [(1.0, 61.6), (2.8, 37.5)])
def test_a_held_torque_begins_where_the_linear_loop_loses_its_stability(
    loop: ClosedLoop, amplitude: float, critical: float
) -> None:
    """Dry friction and counts keep it quiet a little longer: never earlier, at most a tenth later."""
    found = onset_of_limit_cycling(loop, GAIN, between=(20.0, 120.0), amplitude=amplitude, translate=natively)
    assert found.linear == pytest.approx(critical, rel=0.02)
    assert 0.98 < found.value / found.linear < 1.10
    assert found.verdict is not None
    assert found.verdict.frequency == pytest.approx(found.linear_frequency, rel=0.05)
    assert found.below < found.value < found.above < 1.03 * found.below


def test_the_published_amplitudes_of_the_issue(loop: ClosedLoop) -> None:
    """Kp = 70 at 2.8 N·m held: the current swings between its limits at 40 Hz."""
    from dataclasses import replace

    from nlsdesign.feedback.control.evaluation.responses import held_torque

    hard = replace(loop, controller=loop.controller.with_values({GAIN: 70.0}))
    verdict = held_torque(hard, [2.8], translate=natively).verdicts[0]
    assert verdict.state == "limit cycle"
    assert verdict.frequency == pytest.approx(40.0, rel=0.05)
    assert verdict.peak_current == pytest.approx(20.0, rel=1e-3)


def test_where_there_is_none(loop: ClosedLoop) -> None:
    none = onset_of_limit_cycling(loop, GAIN, between=(5.0, 10.0), amplitude=0.5, translate=natively)
    assert none.verdict is None
    assert math.isnan(none.value)
    assert none.above == none.linear == math.inf
    assert "no limit cycle up to 10" in str(none)
    always = onset_of_limit_cycling(loop, GAIN, between=(100.0, 150.0), amplitude=2.8, translate=natively)
    assert always.below == 0.0
    assert always.linear == 0.0
    assert "from 100 or less" in str(always)


def test_bad_ranges_and_names(loop: ClosedLoop) -> None:
    with pytest.raises(UnknownNameError, match=r"did you mean 'controller\.proportional'"):
        onset_of_limit_cycling(loop, "controller.proportionel", between=(5.0, 10.0), amplitude=0.5)
    with pytest.raises(ValueRangeError, match="positive and ascending"):
        onset_of_limit_cycling(loop, GAIN, between=(10.0, 5.0), amplitude=0.5)
    assert linear_onset(loop, GAIN, between=(5.0, 10.0), largest=0.3)[0] == math.inf
