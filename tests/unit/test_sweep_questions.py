"""Questions of a sweep answer what the rooms below answer, and draws are those that the deck declares."""

from __future__ import annotations

import math

import numpy as np
import pytest
from scipy.stats import kstest, qmc

from nlsdesign.analysis import Stability, over_angle
from nlsdesign.components import material, with_rubber
from nlsdesign.components.assembly.deck_writer import declare
from nlsdesign.control import loop_margins
from nlsdesign.deck import load_deck
from nlsdesign.design import ExponentialTorque, MaximumCamRadius, design_cam
from nlsdesign.errors import UnknownNameError
from nlsdesign.model import flatten
from nlsdesign.model.transform import with_outputs
from nlsdesign.simulation.prior import declared_prior
from nlsdesign.sweeps import (
    AngleQuestion,
    DesignQuestion,
    LatinHypercube,
    LoopQuestion,
    Plan,
    RandomDraws,
    SobolSample,
    SpreadQuestion,
    Subject,
)
from nlsdesign.sweeps.changes import changed_assembly
from nlsdesign.sweeps.design_question import QUICK
from tests.sweeping import AREA, INERTIA, actuator, question

CONSISTENT = declare(load_deck("austin2015_figure_consistent"))


def test_the_angle_is_that_of_the_analysis() -> None:
    answers = AngleQuestion(first=0.2, last=0.8, count=5).ask(CONSISTENT)
    model = with_outputs(flatten(CONSISTENT), ["motor.angle", "spring.torque"])
    chart = over_angle(model, [Stability(torque="spring.torque")], angles=np.linspace(0.2, 0.8, 5))
    for name in ("stiffness.slow", "stuck.decay"):
        assert answers[f"least.{name}"] == pytest.approx(float(chart[name].min()), rel=1e-12)
        assert answers[f"largest.{name}"] == pytest.approx(float(chart[name].max()), rel=1e-12)


@pytest.mark.slow
def test_the_design_is_that_of_the_designer() -> None:
    target = ExponentialTorque(maximum=2.0, angle=0.9, shape=1.0)
    free, keep = ("spring.cam.contour", "spring.pretension"), (MaximumCamRadius(radius=0.03),)
    answers = DesignQuestion(target, free, keep).ask(CONSISTENT)
    made = design_cam(CONSISTENT, target=target, free=free, keep=keep, settings=QUICK)
    assert answers["met"] == float(made.met)
    assert answers["torque_error_rms"] == made.rms
    assert answers["cam_radius"] == float(made.contour.radii.max())
    assert answers["designed.spring.pretension"] == made.values["spring.pretension"].number


@pytest.mark.slow
def test_the_loop_is_that_of_the_margins() -> None:
    asked = LoopQuestion(first=0.3, last=0.7, count=3)
    answers = asked.ask(CONSISTENT)
    margins = loop_margins(asked._loop(CONSISTENT), np.linspace(0.3, 0.7, 3))
    assert answers["stable"] == 1.0
    assert answers["gain_margin"] == float(margins.gain.min())
    assert answers["phase_margin"] == pytest.approx(math.radians(float(margins.phase.min())))
    # At its bandwidth the torque is the root of a half, and above it at none of the frequencies before.
    loop = asked._loop(CONSISTENT)
    size = np.abs(margins.linear.response(loop.torque, loop.desired, [answers["bandwidth"]]))
    assert float(size.min()) == pytest.approx(math.sqrt(0.5), rel=0.01)


@pytest.mark.slow
def test_errors_over_the_spread_grow_with_the_spread() -> None:
    asked = SpreadQuestion(draws=8)
    answers = asked.ask(CONSISTENT)
    assert answers["error.exact"] < answers["error.median"] < answers["error.most"]
    assert set(answers) == {c.name for c in asked.answers(CONSISTENT)}


def test_draws_follow_the_spread_of_the_deck() -> None:
    plan = Plan([RandomDraws(2000, seed=4)], Subject({"deck": actuator()}, question()))
    names = [c.name for c in plan.columns]
    assert "factor(spring.cam.lever_arm)" in names, "the table of a shape has one factor"
    assert not any(name.startswith("spring.cam.lever_arm[") for name in names)
    drawn = np.array([plan.point(k) for k in range(len(plan))])
    prior = declared_prior(flatten(actuator()))
    for name in (INERTIA, AREA, "spring.rubber.stiff.modulus[2]"):
        place = prior.place(name)
        normal = np.log(drawn[:, names.index(name)] / prior.values[place]) / prior.deviations[place]
        assert kstest(normal, "norm").pvalue > 1e-3
    few = Plan([RandomDraws(3, seed=4, names=(AREA,))], Subject({"deck": actuator()}, question()))
    again = Plan([RandomDraws(9, seed=4, names=(AREA,))], Subject({"deck": actuator()}, question()))
    assert [few.point(k) for k in range(3)] == [again.point(k) for k in range(3)]


def test_samples_fill_their_box_evenly() -> None:
    ranges = {AREA: ("0.1 cm^2", "0.4 cm^2"), INERTIA: (1e-6, 2e-6)}
    subject = Subject({"deck": actuator()}, question())
    for axes in (SobolSample(ranges, 2048, seed=1), LatinHypercube(ranges, 2048, seed=1)):
        plan = Plan([axes], subject)
        points = np.array([plan.point(k) for k in range(2048)])
        unit = (points - [1e-5, 1e-6]) / [3e-5, 1e-6]
        assert unit.min() >= 0.0
        assert unit.max() <= 1.0
        counts = np.histogram(unit[:, 0], bins=64, range=(0.0, 1.0))[0]
        assert set(counts) == {32}, "each stretch has its share"
        random = np.random.default_rng(0).random((2048, 2))
        assert qmc.discrepancy(unit) < 0.5 * qmc.discrepancy(random)
        assert plan.point(1500) == tuple(points[1500]), "in any order"


def test_a_point_is_a_changed_deck_and_nothing_is_left_out() -> None:
    base = actuator()
    values = {
        "spring.rubber": "Dragon_Skin_30",
        AREA: 2e-5,
        "factor(spring.cam.lever_arm)": 1.1,
        "ask.seed": 3,
    }
    made = changed_assembly({"deck": base}, values)
    expected = with_rubber(base, material("Dragon_Skin_30"), piece="spring.rubber").quantities()
    arms = base.quantities()["spring.cam.lever_arm"].values
    assert made.quantities()["spring.cam.lever_arm"].values == tuple(1.1 * each for each in arms)
    assert made.quantities()[AREA].number == 2e-5
    assert made.quantities()["spring.rubber.stiff.modulus"] == expected["spring.rubber.stiff.modulus"]
    # A number that the other rubber does not have must not be passed over.
    with pytest.raises(UnknownNameError, match="relaxing"):
        changed_assembly({"deck": base}, {**values, "spring.rubber.relaxing.spring.modulus": 1e5})
