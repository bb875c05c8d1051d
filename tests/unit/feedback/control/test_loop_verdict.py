"""What counts as a limit cycle in a run of a closed loop, and what does not."""

from __future__ import annotations

import math

import numpy as np
import pytest

from nlsdesign.export import natively
from nlsdesign.feedback.control import (
    ClosedLoop,
    LoopJudge,
    TorqueGains,
    encoder_loop,
    loop_over_spread,
    sine_response,
    torque_controller,
    tracking,
    zero_torque,
)
from nlsdesign.feedback.control.evaluation.loop_verdict import COUNTS, sustained, without_harmonics
from nlsdesign.feedback.control.evaluation.responses import held_torque, torque_resolution
from nlsdesign.feedback.observer import CascadeGain, FixedGrid, design_observer
from nlsdesign.foundation.errors import ArrangementError, ValueRangeError
from nlsdesign.model import FlatModel, flatten
from tests import observed as ob

STEP = 1e-3
TIME = STEP * np.arange(2000)


def stiffening(gains: TorqueGains, plant: FlatModel | None = None, sample_time: float = STEP) -> ClosedLoop:
    plant = plant or ob.bench(ob.SLOW, friction=0.02)
    observer = design_observer(
        plant, gain=CascadeGain(), grid=FixedGrid(-1.2, 1.2, points=241), sample_time=sample_time
    )
    controller = torque_controller(plant, gains=gains, sample_time=sample_time)
    return encoder_loop(plant, observer=observer, controller=controller)


@pytest.fixture(scope="module")
def gentle() -> ClosedLoop:
    return stiffening(TorqueGains())


@pytest.fixture(scope="module")
def hard() -> ClosedLoop:
    return stiffening(TorqueGains(proportional=200.0))


def test_an_oscillation_is_named_with_amplitude_and_frequency() -> None:
    amplitude, frequency = sustained(0.3 * np.sin(2 * np.pi * 41.0 * TIME), 0.1, STEP)
    assert amplitude == pytest.approx(0.3, rel=0.02)
    assert frequency == pytest.approx(41.0, rel=0.02)


@pytest.mark.parametrize(
    ("rest", "why"),
    [
        (0.09 * np.sin(2 * np.pi * 41.0 * TIME), "below the threshold"),
        (np.exp(-9.0 * (TIME % 0.5)) * np.sin(2 * np.pi * 41.0 * (TIME % 0.5)), "ringing after each kick"),
        (np.where(TIME % 0.2 < 0.004, 1.0, np.where((TIME + 0.1) % 0.2 < 0.004, -1.0, 0.0)), "single kicks"),
        (0.5 * np.random.default_rng(3).standard_normal(2000), "noise"),
        (np.where(TIME < 1.0, 0.0, 0.5), "a step"),
    ],
)  # fmt: skip
def test_what_is_no_limit_cycle(rest: np.ndarray, why: str) -> None:
    assert math.isnan(sustained(rest, 0.1, STEP)[1]), why


def test_a_burst_in_each_half_cycle_is_one() -> None:
    """A loop that is unstable only at high torque oscillates around the peaks of a sine."""
    around = np.maximum(np.abs(np.sin(2 * np.pi * TIME)) - 0.7, 0.0)
    amplitude, frequency = sustained(2.0 * around * np.sin(2 * np.pi * 60.0 * TIME), 0.1, STEP)
    assert 0.2 < amplitude < 0.6
    assert frequency == pytest.approx(60.0, rel=0.1)


def test_harmonics_of_the_drive_are_its_answer() -> None:
    smooth = sum(np.sin(2 * np.pi * k * 1.5 * TIME) / k**2 for k in (1, 3, 5, 7))
    other = 0.01 * np.sin(2 * np.pi * 40.5 * TIME)
    assert without_harmonics(0.7 + smooth + other, 3) == pytest.approx(other, abs=1e-9)


def test_above_two_counts_a_quantiser_is_nearly_a_gain_of_one() -> None:
    """Its describing function by integration of the rounded sine, against the range that the text states."""
    turn = 2 * np.pi * (np.arange(20000) + 0.5) / 20000
    gains = [
        2.0 * np.mean(np.floor(a * np.sin(turn) + 0.5) * np.sin(turn)) / a
        for a in np.linspace(COUNTS, 12.0, 400)
    ]
    assert 0.90 < min(gains) < 0.92
    assert 1.03 < max(gains) < 1.06


def test_a_gentle_loop_settles_and_a_hard_one_gives_no_numbers(gentle: ClosedLoop, hard: ClosedLoop) -> None:
    good = sine_response(gentle, amplitude=0.3, frequencies=[1.0, 5.0], translate=natively)
    assert all(verdict.holds for verdict in good.verdicts)
    assert np.all(np.isfinite(good.decibel))
    lost = held_torque(hard, [1.0], translate=natively)
    assert lost.verdicts[0].state == "limit cycle"
    assert lost.verdicts[0].peak_current == pytest.approx(20.0, rel=0.01)
    assert "limit cycle of ±" in str(lost.verdicts[0])
    assert np.isnan(lost.rms_error[0])
    assert np.isnan(sine_response(hard, amplitude=1.0, frequencies=[1.0], translate=natively).decibel[0])


def test_tracking_carries_the_verdict(hard: ClosedLoop) -> None:
    run = hard.run(1.0, inputs={hard.desired: 1.0})
    followed = tracking(hard, run, settled=0.4)
    assert followed.verdict.state == "limit cycle"
    assert np.isnan(followed.rms_error)


def test_chatter_of_a_coarse_encoder_is_no_limit_cycle() -> None:
    """With counts sixteen times as large the rest is larger, and still below two counts of torque."""
    coarse = stiffening(TorqueGains(), ob.bench(ob.SLOW, friction=0.02).with_values(
        {"motor_encoder.quantum": 16.0 * ob.COUNT}))  # fmt: skip
    fine = stiffening(TorqueGains())
    rests = []
    for each in (fine, coarse):
        response = sine_response(each, amplitude=0.5, frequencies=[2.0], translate=natively)
        assert response.verdicts[0].holds
        rests.append(response.verdicts[0].amplitude)
    assert rests[1] > 1.4 * rests[0]
    assert LoopJudge(coarse).count == pytest.approx(16.0 * ob.COUNT)


def test_one_count_is_worth_the_tangent_stiffness(gentle: ClosedLoop) -> None:
    """Against the difference of the spring's torque over one count, both ends in equilibrium at once."""
    found = torque_resolution(gentle, [0.2, 0.6])
    assert found[1] > found[0] > 0.0
    values = [gentle.plant.evaluate([a, 0.0, 0.0])["spring.torque"] for a in (0.6, 0.6 + ob.COUNT)]
    assert len(gentle.plant.states) == 3
    assert found[1] > 0.5 * (values[1] - values[0])


@pytest.mark.slow
def test_half_the_sample_rate_costs_the_loop_its_margin() -> None:
    gains = TorqueGains(proportional=60.0, velocity_bandwidth=45.0)
    slow, quick = stiffening(gains, sample_time=2e-3), stiffening(gains)
    states = [held_torque(each, [1.0], translate=natively).verdicts[0].state for each in (quick, slow)]
    assert states == ["settled", "limit cycle"]


def test_amplitudes_beyond_the_current_are_refused(gentle: ClosedLoop) -> None:
    """Of these the spring ends first; the bound itself is tested with the laws."""
    for call in (
        lambda: sine_response(gentle, amplitude=9.0, frequencies=[1.0]),
        lambda: held_torque(gentle, [9.0]),
        lambda: loop_over_spread(gentle, amplitude=9.0, frequency=1.0),
    ):
        with pytest.raises(ValueRangeError, match=r"9 N·m: is more than the drive can hold, 2\.776 N·m"):
            call()
    with pytest.raises(ValueRangeError, match="finite and positive"):
        sine_response(gentle, amplitude=0.0, frequencies=[1.0])


def test_a_load_that_is_missing_is_named(gentle: ClosedLoop) -> None:
    with pytest.raises(ArrangementError, match="no body with a prescribed motion"):
        zero_torque(gentle, amplitude=0.1, frequencies=[1.0])


@pytest.mark.slow
def test_unstable_draws_are_counted() -> None:
    """Near the onset a part of the draws limit-cycles; the quantile says so instead of leaving them out."""
    from nlsdesign.components.assembly.deck_writer import declare
    from nlsdesign.foundation.deck import load_deck

    plant = flatten(
        declare(load_deck("austin2015_figure_consistent")), outputs=["motor.angle", "spring.torque"]
    )
    loop = encoder_loop(
        plant, observer=design_observer(plant, gain=CascadeGain()),
        controller=torque_controller(plant, gains=TorqueGains(proportional=40.0)),
    )  # fmt: skip
    spread = loop_over_spread(loop, amplitude=2.8, frequency=2.0, draws=40, seed=3, translate=natively)
    again = loop_over_spread(loop, amplitude=2.8, frequency=2.0, draws=40, seed=3, translate=natively)
    assert np.array_equal(spread.error, again.error, equal_nan=True)
    assert 0.1 < spread.held < 0.9
    assert spread.quantile(0.95) == math.inf
    assert "limit cycle" in str(spread)
    assert np.array_equal(np.isfinite(spread.error), [verdict.holds for verdict in spread.verdicts])
