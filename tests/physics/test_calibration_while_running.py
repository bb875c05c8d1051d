"""What a calibration buys while the machine runs: the plan's further error is the bound of the same bench."""

from __future__ import annotations

import json
import math
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from click.testing import CliRunner

from nlsdesign.bench.calibration import (
    CalibrationPlan,
    FreeRunTest,
    HungWeightTest,
    what_calibration_buys,
)
from nlsdesign.bench.calibration.plan import BoughtBy
from nlsdesign.cli.bench import calibrate
from nlsdesign.feedback.observer import (
    CascadeGain,
    design_observer,
    least_torque_error,
    observer_bench,
    observer_errors,
)
from nlsdesign.feedback.observer.corrected.duty import Duty
from nlsdesign.model import flatten
from nlsdesign.simulation import Prior, declared_prior
from tests.calibrated import LINEAR, deck
from tests.renamed import SCHEMES, renamed

RUNNING = "torque while running, best estimate"
SHORT = Duty(frequencies=(2.0,))


@pytest.fixture(scope="module")
def plan() -> CalibrationPlan:
    actuator = deck(LINEAR)
    least = least_torque_error(observer_bench(flatten(actuator), duty=SHORT))
    return what_calibration_buys(actuator, [HungWeightTest(), FreeRunTest()], errors={RUNNING: least})


def error_of(plan: CalibrationPlan, title: str) -> float:
    return next(each.errors[RUNNING] for each in plan.ranked if each.title == title)


@pytest.mark.slow
def test_now_is_the_bound_of_observer_errors(plan: CalibrationPlan) -> None:
    """One is taken along the machine as declared, the other along drawn machines, with other numbers in the
    slopes: on a linear spring they differ by no more than these numbers do, 10 % each."""
    model = flatten(deck(LINEAR))
    trial = observer_bench(model, duty=SHORT)
    observers = {"cascade": design_observer(model, gain=CascadeGain())}
    drawn = observer_errors(observers, trial, draws=4, bounded=4).bound
    assert plan.now.errors[RUNNING] == pytest.approx(float(np.sqrt(np.mean(drawn**2))), rel=0.15)
    # With what is known made half as wide, and no machine drawn far off, both fall alike.
    half = replace(declared_prior(model), covariance=0.25 * declared_prior(model).covariance)
    narrow = observer_errors(observers, trial, prior=half, draws=4, bounded=4).bound
    least = least_torque_error(trial)(half)
    assert least == pytest.approx(float(np.sqrt(np.mean(narrow**2))), rel=0.1)
    assert least < 0.7 * plan.now.errors[RUNNING]


def test_a_hung_weight_improves_it_and_a_free_run_alone_does_not(plan: CalibrationPlan) -> None:
    """A free run without the spring shows inertia and friction over the torque constant: every ratio, never
    the common scale. Torque constant, inertia, friction and stiffness times one factor give the same motion
    for the same current, but another torque. Of that scale it leaves what four declared numbers say together;
    but the running machine shows those ratios itself, so its error stays. A weight is a torque from outside
    and fixes the scale."""
    now, weighed, free = plan.now.errors[RUNNING], error_of(plan, "hung weight"), error_of(plan, "free run")
    assert weighed < 0.5 * now
    assert free > 0.9 * now
    spreads = next(each.known for each in plan.ranked if each.title == "free run").spreads()
    declared = plan.now.known.spreads()
    tied = ("motor.torque_constant", "motor.inertia", "bearing.damping", "dry_friction.sliding_effort")
    information = sum(1.0 / math.log1p(declared[name]) ** 2 for name in tied)
    assert spreads["motor.torque_constant"] == pytest.approx(math.expm1(information**-0.5), rel=0.01)
    assert error_of(plan, "hung weight and free run") <= weighed * (1.0 + 1e-9)


def test_the_common_scale_alone_is_seen_by_no_encoder() -> None:
    """All that is known but one common factor s of every torque: the least error is s times the torque."""
    model = flatten(deck(LINEAR))
    trial = observer_bench(model, duty=SHORT)
    known = declared_prior(model)
    efforts = ("motor.torque_constant", "motor.inertia", "spring.stiffness", "bearing.damping",
               "dry_friction.sliding_effort")  # fmt: skip
    scale = np.array([1.0 if name in efforts else 0.0 for name in known.names])
    assert scale.sum() == len(efforts)
    tiny = 1e-12 * np.eye(len(scale))
    least = least_torque_error(trial)(replace(known, covariance=0.05**2 * np.outer(scale, scale) + tiny))
    assert least == pytest.approx(0.05 * trial.torque / math.sqrt(2.0), rel=0.05)


def test_other_names_give_the_same() -> None:
    plain, other = flatten(deck(LINEAR)), flatten(renamed(deck(LINEAR), SCHEMES[0]).assembly)
    assert {v.name for v in plain.parameters}.isdisjoint(v.name for v in other.parameters)
    first, second = (
        least_torque_error(observer_bench(m, duty=SHORT))(declared_prior(m)) for m in (plain, other)
    )
    assert first == pytest.approx(second, rel=1e-6)


def known_with(spread: float) -> Prior:
    model = flatten(deck(LINEAR))
    known = declared_prior(model).only(["spring.stiffness"])
    return replace(known, covariance=np.array([[math.log1p(spread) ** 2]]))


def test_rows_are_what_the_plan_holds() -> None:
    wide, narrow = known_with(0.1), known_with(0.01)
    now = BoughtBy((), wide, np.array([0.03, 0.04]), {"running": 0.0123, "inertia": 0.5})
    after = BoughtBy(("weight", "cell"), narrow, np.zeros(2), {"running": 0.001, "inertia": 0.5})
    made = CalibrationPlan(now, (after,), np.zeros(2))
    assert made.rows() == [
        ("nothing", f"{1e3 * math.sqrt(0.00125):.3g}", "12.3", "500", ""),
        ("weight and cell", "0", "1", "500", "spring.stiffness 10 → 1 %"),
    ]
    head, first, second = str(made).splitlines()
    assert (
        head == "calibration  spring torque at rest, mN·m  running, mN·m  inertia, mN·m  spreads, best four"
    )
    assert first.split("  ")[:4] == ["nothing", "35.4", "12.3", "500"]
    assert second.endswith("spring.stiffness 10 → 1 %")


def test_the_table_of_the_command_has_the_column(tmp_path: Path) -> None:
    arguments = ["--deck", LINEAR, "--plan", "--kind", "hung_weight", "--out", str(tmp_path)]
    done = CliRunner().invoke(calibrate, arguments, catch_exceptions=False, env={"COLUMNS": "400"})
    assert done.exit_code == 0, done.output
    assert RUNNING in " ".join(done.output.split())
    written = json.loads((tmp_path / "plan.json").read_text(encoding="utf8"))
    before, after = written["now"]["errors"][RUNNING], written["ranked"][0]["errors"][RUNNING]
    assert after < 0.5 * before
    for value in (before, after):
        assert f"{1e3 * value:.3g}" in done.output


def test_a_machine_without_a_spring_has_no_such_column(tmp_path: Path) -> None:
    arguments = ["--deck", "dfki_pendulum", "--plan", "--kind", "free_run", "--out", str(tmp_path)]
    done = CliRunner().invoke(calibrate, arguments, catch_exceptions=False)
    assert done.exit_code == 0, done.output
    assert json.loads((tmp_path / "plan.json").read_text(encoding="utf8"))["now"]["errors"] == {}
    assert "while running" not in done.output
