"""Questions of a sweep answer what the rooms below answer, and draws are those that the deck declares."""

from __future__ import annotations

import math
from pathlib import Path

import numpy as np
import pytest
from scipy.stats import kstest, qmc

from nlsdesign.components import material, with_rubber
from nlsdesign.components.assembly.deck_writer import declare
from nlsdesign.design import ExponentialTorque, MaximumCamRadius, design_cam
from nlsdesign.export import natively
from nlsdesign.feedback.analysis import Stability, over_angle
from nlsdesign.feedback.control import loop_margins
from nlsdesign.feedback.observer import CascadeGain, design_observer, observer_bench, observer_errors
from nlsdesign.foundation.deck import load_deck
from nlsdesign.foundation.errors import UnknownNameError, ValueRangeError
from nlsdesign.foundation.work_sharing import Executor, InThisProcess, Processes
from nlsdesign.model import flatten
from nlsdesign.model.transform import with_outputs
from nlsdesign.simulation import column_runs
from nlsdesign.simulation.buffered import as_it_is
from nlsdesign.simulation.prior import declared_prior
from nlsdesign.sweeps import (
    AngleQuestion,
    DesignQuestion,
    LatinHypercube,
    Listed,
    LoopQuestion,
    RandomDraws,
    SobolSample,
    SpreadQuestion,
    SweepTable,
    run_sweep,
    sweep,
)
from nlsdesign.sweeps.axis_values import Subject, changed_assembly
from nlsdesign.sweeps.questions import QUICK
from nlsdesign.sweeps.sweep_folder import PointPlan
from tests.sweeping import AREA, INERTIA, actuator, question

CONSISTENT = declare(load_deck("austin2015_figure_consistent"))
SOFT = declare(load_deck("austin2015_soft_spring"))


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


def spread_of(out: Path, inertias: list[float], executor: Executor) -> SweepTable:
    """Errors over the spread of the soft spring, for machines and seeds."""
    axes = [Listed({INERTIA: inertias}), Listed({"ask.seed": [0, 1]})]
    asked = SpreadQuestion(draws=4, sample_time=2e-3)
    return sweep(SOFT, axes=axes, ask=asked, out=out, executor=executor)


def test_errors_over_the_spread_are_those_of_the_observer_and_a_seed_draws_other_machines(
    tmp_path: Path,
) -> None:
    inertia = SOFT.quantities()[INERTIA].number
    table = spread_of(tmp_path, [1.5 * inertia, -inertia], InThisProcess())
    assert table.done.tolist() == [True, True, False, False]
    assert all("inertia = -" in reason for reason in table.values["reason"][2:])
    answers = {column.name: table.values[column.name] for column in table.answers}
    assert answers["error.exact"][0] == answers["error.exact"][1]
    assert answers["error.median"][0] != answers["error.median"][1]
    # The same as a direct call for the second seed.
    machine = SOFT.with_values({INERTIA: 1.5 * inertia})
    model = with_outputs(flatten(machine), ["motor.angle", "spring.torque"])
    observer = design_observer(model, sample_time=2e-3, gain=CascadeGain())
    bench = observer_bench(model, estimate="spring.torque", measured="motor.angle", sample_time=2e-3)
    errors = observer_errors({"observer": observer}, bench, draws=4, seed=1, bounded=0, translate=natively)
    assert answers["error.exact"][1] == errors.exact[0].max()
    assert answers["error.median"][1] == errors.quantile("observer", 0.5).max()
    assert answers["error.most"][1] == errors.quantile("observer", 0.9).max()
    assert answers["error.lost"][1] == errors.lost


@pytest.mark.slow
def test_workers_without_a_compiler_write_the_same_bytes(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    inertia = SOFT.quantities()[INERTIA].number
    machines = [inertia, 1.3 * inertia, 1.5 * inertia]
    spread_of(tmp_path / "compiled", machines, Processes(2))
    monkeypatch.setattr(run_sweep, "quickest", lambda: as_it_is)
    monkeypatch.setattr(column_runs, "MANY", 2)
    column_runs._column_run.cache_clear()
    table = spread_of(tmp_path / "interpreted", machines, InThisProcess())
    column_runs._column_run.cache_clear()
    assert table.done.all()
    one, other = ((tmp_path / name / "results.parquet").read_bytes() for name in ("compiled", "interpreted"))
    assert one == other


@pytest.mark.parametrize(("given", "words"), [({"draws": 0}, "draws = 0"), ({"seed": -1}, "seed = -1")])
def test_draws_that_cannot_be_are_refused(given: dict[str, int], words: str) -> None:
    with pytest.raises(ValueRangeError, match=words):
        SpreadQuestion(**given)


def test_draws_follow_the_spread_of_the_deck() -> None:
    plan = PointPlan([RandomDraws(2000, seed=4)], Subject({"deck": actuator()}, question()))
    names = [c.name for c in plan.columns]
    assert "factor(spring.cam.lever_arm)" in names, "the table of a shape has one factor"
    assert not any(name.startswith("spring.cam.lever_arm[") for name in names)
    drawn = np.array([plan.point(k) for k in range(len(plan))])
    prior = declared_prior(flatten(actuator()))
    for name in (INERTIA, AREA, "spring.rubber.stiff.modulus[2]"):
        place = prior.place(name)
        normal = np.log(drawn[:, names.index(name)] / prior.values[place]) / prior.deviations[place]
        assert kstest(normal, "norm").pvalue > 1e-3
    few = PointPlan([RandomDraws(3, seed=4, names=(AREA,))], Subject({"deck": actuator()}, question()))
    again = PointPlan([RandomDraws(9, seed=4, names=(AREA,))], Subject({"deck": actuator()}, question()))
    assert [few.point(k) for k in range(3)] == [again.point(k) for k in range(3)]


def test_samples_fill_their_box_evenly() -> None:
    ranges = {AREA: ("0.1 cm^2", "0.4 cm^2"), INERTIA: (1e-6, 2e-6)}
    subject = Subject({"deck": actuator()}, question())
    for axes in (SobolSample(ranges, 2048, seed=1), LatinHypercube(ranges, 2048, seed=1)):
        plan = PointPlan([axes], subject)
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
