"""Gains under margins, and bandwidth against impedance of the three published springs."""

from __future__ import annotations

from dataclasses import replace
from itertools import pairwise

import numpy as np
import pytest

from nlsdesign.components.assembly.changed_copies import with_moved_load
from nlsdesign.components.assembly.deck_writer import declare
from nlsdesign.export import natively
from nlsdesign.feedback.control import (
    ClosedLoop,
    LoopChoice,
    LoopLimits,
    ScheduledTorque,
    TorqueGains,
    VelocityLoop,
    bandwidth_against_impedance,
    best_choices,
    encoder_loop,
    largest_gain,
    loop_margins,
    sine_response,
    torque_controller,
)
from nlsdesign.feedback.control.evaluation.linear_loop import linear_loop
from nlsdesign.feedback.observer import CascadeGain, design_observer
from nlsdesign.foundation.deck import load_deck
from nlsdesign.foundation.errors import ConvergenceError, InfeasibleError, UnknownNameError
from nlsdesign.model import flatten

GAIN = "controller.proportional"
SPRINGS = {
    "soft": "austin2015_soft_spring",
    "stiff": "austin2015_stiff_spring",
    "nonlinear": "austin2015_figure_consistent",
}


def moved(deck: str) -> ClosedLoop:
    actuator, outputs = declare(load_deck(deck)), ["motor.angle", "spring.torque"]
    bench, plant = flatten(actuator, outputs=outputs), flatten(with_moved_load(actuator), outputs=outputs)
    controller = torque_controller(bench, gains=TorqueGains(integral=20.0))
    return encoder_loop(plant, observer=design_observer(bench, gain=CascadeGain()), controller=controller)


@pytest.fixture(scope="module")
def loops() -> dict[str, ClosedLoop]:
    return {name: moved(deck) for name, deck in SPRINGS.items()}


def test_the_largest_gain_keeps_the_margin_and_a_larger_one_does_not(loops: dict[str, ClosedLoop]) -> None:
    at, limits = np.radians([5.0, 20.0, 35.0]), LoopLimits(gain_margin=6.0)
    tuned = largest_gain(loops["nonlinear"], GAIN, between=(2.0, 200.0), angles=at, limits=limits)
    margins = loop_margins(tuned.loop, at, opening=tuned.loop.desired)
    assert 6.0 <= np.min(margins.gain) < 6.2
    assert "gain margin" in tuned.limited_by
    assert "35°" in tuned.limited_by  # where the spring is stiffest
    # The margin is real: with 6 dB more the loop is at its limit.
    louder = tuned.loop.controller.with_values({GAIN: 2.1 * tuned.value})
    assert not np.all(linear_loop(replace(tuned.loop, controller=louder), at).stable())


@pytest.mark.slow
def test_draws_and_simulated_runs_take_gain_away(loops: dict[str, ClosedLoop]) -> None:
    loop, at = loops["nonlinear"], np.radians([10.0, 35.0])
    plain = largest_gain(loop, GAIN, between=(2.0, 200.0), angles=at)
    spread = largest_gain(loop, GAIN, between=(2.0, 200.0), angles=at, draws=8)
    assert spread.value < 0.97 * plain.value
    assert spread.limited_by.startswith("draw ")
    bold = LoopLimits(gain_margin=0.0, phase_margin=0.0, amplitude=2.8, frequencies=(1.0,), saturated=0.5)
    ran = largest_gain(
        loop, GAIN, between=(20.0, 80.0), angles=np.radians([5.0]), limits=bold, translate=natively
    )
    assert "limit cycle" in ran.limited_by
    assert sine_response(ran.loop, amplitude=2.8, frequencies=[1.0], translate=natively).verdicts[0].holds


def scheduled(loop: ClosedLoop, bandwidth: float) -> ClosedLoop:
    controller = torque_controller(
        loop.plant, law=ScheduledTorque(bandwidth=bandwidth), velocity=VelocityLoop(friction=None)
    )
    return replace(loop, controller=controller)


@pytest.mark.parametrize("name", SPRINGS)
def test_what_is_fed_forward_takes_no_part_in_the_margin(loops: dict[str, ClosedLoop], name: str) -> None:
    """The margin is the factor by which the bandwidth of the scheduled law may grow until the loop is
    unstable, with its whole feedforward."""
    loop, at = scheduled(loops[name], 12.0), np.radians([20.0])
    factor = 10.0 ** (loop_margins(loop, at, opening=loop.desired).gain[0] / 20.0)
    for share, stable in ((0.99, True), (1.01, False)):
        changed = {"controller.bandwidth": 12.0 * factor * share}
        louder = linear_loop(replace(loop, controller=loop.controller.with_values(changed)), at)
        assert louder.reached.all()
        assert bool(louder.stable()[0]) is stable


def test_a_quick_loop_of_a_linear_spring_is_the_same_at_every_angle(loops: dict[str, ClosedLoop]) -> None:
    """Searched from far away the rest lay at a limit of the command, where nothing follows what is wanted."""
    loop = scheduled(loops["soft"], 24.0)
    margins = loop_margins(loop, np.radians([2.0, 20.0, 40.0]), opening=loop.desired)
    assert margins.linear.reached.all()
    assert margins.gain == pytest.approx(margins.gain[0], rel=1e-4)
    assert margins.phase == pytest.approx(margins.phase[0], rel=1e-4)


def test_a_loop_that_holds_no_angle_has_no_gain(loops: dict[str, ClosedLoop]) -> None:
    with pytest.raises(InfeasibleError, match="the current limit lets the loop hold none of the angles"):
        largest_gain(loops["stiff"], GAIN, between=(2.0, 8.0), angles=np.radians([120.0]))


def test_an_observer_without_a_rest_is_refused(loops: dict[str, ClosedLoop]) -> None:
    bench = flatten(declare(load_deck(SPRINGS["soft"])), outputs=["motor.angle", "spring.torque"])
    with pytest.raises(ConvergenceError, match=r"no rest is found.*gain=CascadeGain"):
        loop_margins(replace(loops["soft"], observer=design_observer(bench)), np.radians([20.0]))


def test_what_cannot_be_had(loops: dict[str, ClosedLoop]) -> None:
    with pytest.raises(InfeasibleError, match="breaks a limit everywhere: at the smallest gain margin"):
        largest_gain(loops["nonlinear"], GAIN, between=(30.0, 90.0), angles=np.radians([40.0]))
    with pytest.raises(UnknownNameError, match=r"did you mean 'controller\.integral'"):
        largest_gain(loops["soft"], "controller.integal", between=(1.0, 2.0), angles=[0.0])


@pytest.mark.slow
def test_the_three_springs(loops: dict[str, ClosedLoop]) -> None:
    """Below crossover the impedance is 1/Kp for every spring; the stiffer one is quicker at the same gain,
    and the nonlinear one, soft where it rests, allows the largest gain there."""
    gains = np.geomspace(16.0, 256.0, 9)
    angles = {name: np.zeros(1) if name != "nonlinear" else np.radians([5.0]) for name in loops}
    choices = bandwidth_against_impedance(loops, GAIN, gains, angles=angles, frequency=0.5)
    by = {(c.name, c.gain): c for c in choices}
    for gain in gains[:3]:
        assert by["stiff", gain].bandwidth > by["soft", gain].bandwidth
        for name in ("soft", "stiff"):
            assert by[name, gain].impedance == pytest.approx(1.0 / gain, rel=0.1)
    largest = {name: max(c.gain for c in choices if c.name == name and c.admissible) for name in loops}
    assert largest["nonlinear"] > largest["stiff"]
    front = best_choices(choices)
    assert all(one.admissible for one in front)
    assert all(a.impedance <= b.impedance for a, b in pairwise(front))


def test_a_choice_that_another_beats_in_both_is_left_out() -> None:
    good, worse = LoopChoice("a", 1.0, 10.0, 0.01, True), LoopChoice("b", 1.0, 9.0, 0.02, True)
    unstable = LoopChoice("c", 1.0, 90.0, 0.001, False)
    other = LoopChoice("d", 1.0, 12.0, 0.05, True)
    assert best_choices([worse, good, unstable, other]) == (good, other)
