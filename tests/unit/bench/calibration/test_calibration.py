"""Rows, responses, plans and decks of a calibration, against formulas by hand."""

from __future__ import annotations

import json
import math
import warnings
from dataclasses import replace
from datetime import date
from pathlib import Path

import numpy as np
import pytest

from nlsdesign.bench.calibration import (
    FreeRunTest,
    HungWeightTest,
    Instruments,
    LoadCellTest,
    calibrated,
    estimate,
    load_calibration,
    read_joint_numbers,
    what_calibration_buys,
    write_calibration,
)
from nlsdesign.bench.calibration.bench_response import (
    BenchCourse,
    RecordedRun,
    SampleNoise,
    bench_response,
    rows_of,
    windows,
)
from nlsdesign.bench.calibration.bench_test import CalibrationTest
from nlsdesign.bench.calibration.estimate import Estimate
from nlsdesign.components import Assembly, CoulombFriction
from nlsdesign.components.assembly.deck_writer import declare
from nlsdesign.foundation.deck import load_deck
from nlsdesign.foundation.errors import (
    ArrangementError,
    ExportError,
    MeasurementError,
    UnknownNameError,
    ValueRangeError,
)
from nlsdesign.model import flatten
from nlsdesign.simulation import Prior, declared_prior
from tests.calibrated import CAM, LINEAR, deck, misses, read, recorded, truth
from tests.rig.calibration_bench import Logger, Machine

TRUE = Machine(
    stiffness=3.55, inertia=6.3e-4, torque_constant=0.0585, damping=1.3e-3, friction=0.014, zero=3e-3
)


@pytest.fixture(scope="module")
def weighed(tmp_path_factory: pytest.TempPathFactory) -> Estimate:
    """The linear spring after a hung weight."""
    folder = recorded("hung_weight", tmp_path_factory.mktemp("weighed"), TRUE)
    return estimate(deck(LINEAR), [read("hung_weight", folder, deck(LINEAR))])


# --- windows and responses ------------------------------------------------------------------------


def test_a_window_moves_two_derivatives_onto_itself() -> None:
    step = 2e-3
    time = step * np.arange(2000)
    view = windows(len(time), step, 0.1)
    for motion, second in (
        (np.ones_like(time), 0.0 * time),
        (time, 0.0 * time),
        (0.5 * time**2, np.ones_like(time)),
        (np.sin(40.0 * time), -1600.0 * np.sin(40.0 * time)),
    ):
        size = max(1.0, float(np.max(np.abs(second))))
        assert view.second @ motion == pytest.approx(view.mean @ second, abs=2e-4 * size)


def test_the_balance_of_a_linear_spring_is_that_of_newton() -> None:
    model = flatten(HungWeightTest().on_bench(deck(LINEAR)))
    response = bench_response(model, declared_prior(model), [])
    time = 1e-3 * np.arange(50)
    course = BenchCourse(1e-3, 0.3 + 0.2 * time, np.full(50, 0.2), 5.0 + time, np.full(50, -0.4))
    shown = response.along(course, np.zeros(response.columns))
    effort = 4.0 * 0.055 * course.command + 0.4 - 3.4 * course.motion - 1e-3 * 0.2 - 0.02
    assert shown.value[0] == pytest.approx(effort / 5.97e-4, rel=1e-9)
    assert shown.value[1] == pytest.approx(np.full(50, 0.22 / 5.97e-4), rel=1e-9)


@pytest.mark.long_cases("austin2015_as_printed")
@pytest.mark.parametrize("name", [CAM, "austin2015_as_printed"])
def test_slow_samples_show_the_same_relaxation(name: str) -> None:
    """As printed the rubber relaxes within a fifth of the slow step."""
    model = flatten(LoadCellTest().on_bench(deck(name)))
    response = bench_response(model, declared_prior(model), ["spring.torque"])
    torque = []
    for step, every in ((4e-3, 1), (2.5e-4, 16)):
        time = step * np.arange(round(1.2 / step))
        angle, rate = 0.3 + 0.2 * np.sin(7.0 * time), 1.4 * np.cos(7.0 * time)
        shown = response.along(
            BenchCourse(step, angle, rate, 0.0 * time, 0.0 * time), np.zeros(response.columns)
        )
        torque.append(shown.value[2][::every])
    # The run begins at rest: the first moment is another course for each step.
    assert torque[0][25:] == pytest.approx(torque[1][25:], rel=2e-3)


def test_standstill_says_nothing_of_the_balance() -> None:
    model = flatten(HungWeightTest().on_bench(deck(LINEAR)))
    response = bench_response(model, declared_prior(model), [])
    time = 4e-3 * np.arange(1500)
    moving = (time > 1.0) & (time < 5.0)
    rate = np.where(moving, 0.1 * np.sign(np.sin(2.0 * math.pi * (time - 1.0) / 2.0)), 0.0)
    course = BenchCourse(4e-3, np.cumsum(rate) * 4e-3, rate, 0.0 * time, 0.0 * time)
    noise = SampleNoise(1e-5, 0.01, 1e-5, (), 0.1)
    (rows,) = rows_of(
        response,
        RecordedRun(course, np.zeros((0, 1500)), noise, np.zeros(1500, dtype=bool)),
        np.zeros(response.columns),
    )
    told = time[rows.centres]
    assert len(told) > 20
    for turn in (1.0, 2.0, 3.0, 4.0, 5.0):
        assert np.min(np.abs(told - turn)) > 0.04, "a window reaches over a reversal or into rest"
    assert told.min() > 1.0
    assert told.max() < 5.0


def test_friction_turns_at_once_on_the_bench() -> None:
    bench = HungWeightTest().on_bench(deck(LINEAR))
    (rub,) = [part for _, part in bench.walk() if isinstance(getattr(part, "element", part), CoulombFriction)]
    model = flatten(bench)
    response = bench_response(model, declared_prior(model), [])
    still = np.zeros(2)
    shown = response.along(
        BenchCourse(1e-3, still, np.array([1e-3, -1e-3]), still, still), np.zeros(response.columns)
    )
    assert shown.value[0] * 5.97e-4 == pytest.approx([-0.020001, 0.020001], rel=1e-6)
    assert rub is not None


@pytest.mark.long_cases(
    "kind0-austin2015_figure_consistent", "kind0-one_sided_cable_drive", "kind1-one_sided_cable_drive"
)
@pytest.mark.parametrize("name", [CAM, "test_rig", "one_sided_cable_drive"])
@pytest.mark.parametrize("kind", [HungWeightTest(), LoadCellTest()])
def test_slopes_are_those_of_differences(name: str, kind: CalibrationTest) -> None:
    model = flatten(kind.on_bench(deck(name)))
    cells = [r.signal for r in model.readings if model.variable(r.measured).unit in ("N", "N*m")]
    response = bench_response(model, declared_prior(model), cells)
    time = 4e-3 * np.arange(150)
    ratio = 12.0 if name.startswith("one") else 1.0
    course = BenchCourse(
        4e-3, ratio * 0.4 * (1.0 - np.cos(6.0 * time)) + 0.05, ratio * 2.4 * np.sin(6.0 * time) + 1e-2,
        0.3 + np.sin(time), 0.2 + 0.0 * time,
    )  # fmt: skip
    x = 0.02 * np.random.default_rng(3).standard_normal(response.columns)
    slope = response.along(course, x).slope
    for k in range(response.columns):
        step = 1e-5 * np.eye(response.columns)[k]
        ends = [response.along(course, x + sign * step).value for sign in (1.0, -1.0)]
        expected = (ends[0] - ends[1]) / 2e-5
        size = np.max(np.abs(expected), axis=1, keepdims=True) + 1e-6 * np.max(
            np.abs(ends[0]), axis=1, keepdims=True
        )
        # At a knot, and where friction of the gear turns, a difference straddles a corner.
        off = np.abs(slope[:, :, k] - expected) > 1e-4 * size
        assert np.mean(off) < 0.03, response.factors[k : k + 1]


def test_everything_but_the_drive_is_clamped() -> None:
    for kind in (HungWeightTest(), LoadCellTest(), FreeRunTest()):
        model = flatten(kind.on_bench(deck("one_sided_cable_drive")))
        assert [b.name for b in model.bodies if not b.prescribed] == ["motor"]
    assert not flatten(FreeRunTest().on_bench(deck(CAM))).springs


# --- estimates ------------------------------------------------------------------------------------


@pytest.mark.slow
def test_a_hung_weight_tells_constant_stiffness_and_friction(weighed: Estimate) -> None:
    off = misses(weighed, truth(TRUE))
    assert {"motor.torque_constant", "spring.stiffness", "dry_friction.sliding_effort"} <= set(off)
    assert max(map(abs, off.values())) < 3.0
    spreads = weighed.after.spreads()
    assert spreads["motor.torque_constant"] < 0.005
    # All torques are scaled by the weight, which is known to 0.3 % itself.
    assert spreads["motor.torque_constant"] > 0.0025
    assert weighed.inflated == 1.0
    assert weighed.told_by["spring.stiffness"] == "hung weight"
    assert weighed.after.correlation("motor.torque_constant", "spring.stiffness") > 0.8


def test_a_free_run_knows_ratios_alone(tmp_path: Path) -> None:
    found = estimate(deck(LINEAR), [read("free_run", recorded("free_run", tmp_path, TRUE), deck(LINEAR))])
    # By hand: one common factor of the four efforts stays as uncertain as their priors leave it together.
    common = 1.0 / math.sqrt(2.0 / math.log(1.1) ** 2 + 2.0 / math.log(1.6) ** 2)
    names = ("motor.inertia", "motor.torque_constant", "bearing.damping", "dry_friction.sliding_effort")
    for name in names:
        assert found.after.deviations[found.after.place(name)] == pytest.approx(common, rel=0.1)
    ratio = np.zeros((1, len(found.after.names)))
    ratio[0, found.after.place(names[0])], ratio[0, found.after.place(names[1])] = 1.0, -1.0
    assert found.after.deviation_of(ratio)[0] < 0.01
    true = TRUE.inertia / TRUE.torque_constant
    seen = found.after.values[found.after.place(names[0])] / found.after.values[found.after.place(names[1])]
    assert math.log(true / seen) == pytest.approx(0.0, abs=3.0 * found.after.deviation_of(ratio)[0])
    assert "spring.stiffness" not in found.told_by
    words = " ".join(calibrated(deck(LINEAR), found).words())
    assert "motor.inertia over motor.torque_constant is known to" in words


@pytest.mark.slow
def test_records_that_are_given_twice_do_not_move_what_they_told(weighed: Estimate, tmp_path: Path) -> None:
    result = calibrated(deck(LINEAR), weighed, day=date(2026, 1, 2))
    paths = write_calibration(result, tmp_path / "out")
    again = declare(load_deck(paths["deck"]))
    known = read_joint_numbers(paths["joint"])
    folder = recorded("hung_weight", tmp_path, TRUE, seed=9)
    next_one = estimate(again, [read("hung_weight", folder, again)], prior=known)
    k = known.place("motor.torque_constant")
    assert next_one.after.deviations[k] < known.deviations[k]
    assert next_one.after.deviations[k] > known.deviations[k] / 2.0
    assert max(map(abs, misses(next_one, truth(TRUE), least=1.1).values())) < 3.5
    assert next_one.suspects == ()


def test_a_wrong_declared_number_is_suspect(tmp_path: Path) -> None:
    wrong = replace(TRUE, torque_constant=0.08)
    found = estimate(
        deck(LINEAR), [read("hung_weight", recorded("hung_weight", tmp_path, wrong), deck(LINEAR))]
    )
    assert "motor.torque_constant" in found.suspects
    assert abs(misses(found, truth(wrong))["motor.torque_constant"]) < 3.0
    assert any("motor.torque_constant moved by +3" in w for w in calibrated(deck(LINEAR), found).words())


@pytest.mark.slow
@pytest.mark.long_cases("-1.0")
@pytest.mark.parametrize("factor", [1e-3, -1.0])
def test_a_weight_in_another_unit_or_sign_is_refused(tmp_path: Path, factor: float) -> None:
    folder = recorded("hung_weight", tmp_path, replace(TRUE, weight_factor=factor))
    with pytest.raises(MeasurementError, match=r"times its noise.*no number of it can be trusted.*units"):
        estimate(deck(LINEAR), [read("hung_weight", folder, deck(LINEAR))])


@pytest.mark.slow
def test_what_the_deck_lacks_widens_all(tmp_path: Path, weighed: Estimate) -> None:
    folder = recorded("hung_weight", tmp_path, replace(TRUE, breakaway=0.012))
    found = estimate(deck(LINEAR), [read("hung_weight", folder, deck(LINEAR))])
    assert found.inflated > 2.0
    # What the weight is good for stays; friction, whose form is wrong, is known less well.
    k = found.after.place("dry_friction.sliding_effort")
    assert found.after.deviations[k] > 2.0 * weighed.after.deviations[k]
    assert abs(misses(found, truth(TRUE))["spring.stiffness"]) < 3.0
    assert any("widened by" in w for w in calibrated(deck(LINEAR), found).words())


@pytest.mark.slow
def test_records_of_another_spring_are_refused(tmp_path: Path) -> None:
    folder = recorded("hung_weight", tmp_path, Machine())
    with pytest.raises(MeasurementError, match=r"misses the model by .* times its noise"):
        estimate(deck(LINEAR), [read("hung_weight", folder, deck(LINEAR))])


def test_nothing_becomes_less_known(weighed: Estimate) -> None:
    left = np.linalg.eigvalsh(weighed.before.covariance - weighed.after.covariance)
    assert left.min() > -1e-12


# Quicker: spikes in unit/bench/identification/test_shooting.py and test_faulty_samples.py
@pytest.mark.slow
def test_spikes_do_not_decide(tmp_path: Path) -> None:
    folder = recorded("hung_weight", tmp_path, TRUE, logger=Logger(spikes=4))
    found = estimate(deck(LINEAR), [read("hung_weight", folder, deck(LINEAR))])
    assert max(map(abs, misses(found, truth(TRUE)).values())) < 3.0


# --- decks ----------------------------------------------------------------------------------------


def test_the_deck_says_what_was_calibrated_when_from_what(weighed: Estimate, tmp_path: Path) -> None:
    result = calibrated(deck(LINEAR), weighed, day=date(2026, 3, 4))
    paths = write_calibration(result, tmp_path)
    numbers = declare(load_deck(paths["deck"])).quantities()
    constant = numbers["motor.torque_constant"]
    assert constant.unit == "mN*m/A"
    assert constant.source.startswith(
        "calibrated 2026-03-04 from hung_weight (declared 55 mN·m/A ± 10 %: n*kT = 0.220"
    )
    assert constant.spread.share(1.0) == pytest.approx(
        weighed.after.spreads()["motor.torque_constant"], rel=5e-3
    )
    assert constant.number == pytest.approx(
        float(weighed.after.values[weighed.after.place("motor.torque_constant")]), rel=1e-4
    )
    untouched = numbers["motor.current_limit"]
    assert untouched == deck(LINEAR).quantities()["motor.current_limit"]
    told = {n["name"]: n for n in json.loads(paths["result"].read_text())["numbers"]}
    assert told["motor.torque_constant"]["before"] == pytest.approx(0.055)


def test_a_row_takes_the_largest_spread_of_its_numbers(weighed: Estimate) -> None:
    actuator = deck(CAM)
    before = declared_prior(flatten(actuator))
    place = before.place("spring.rubber.stiff.modulus[2]")
    information = np.zeros((len(before.names),) * 2)
    information[place, place] = 1e6
    found = replace(
        weighed,
        before=before,
        after=before.after(information),
        strain=dict.fromkeys(before.names, 0.0),
        doubt=dict.fromkeys(before.names, 0.0),
        told_by={before.names[place]: "hung weight"},
    )
    result = calibrated(actuator, found)
    assert result.actuator.quantities()["spring.rubber.stiff.modulus"].spread.share(1.0) == pytest.approx(0.1)
    assert [n.name for n in result.numbers] == ["spring.rubber.stiff.modulus[2]"]


def test_the_deck_that_was_read_stays(weighed: Estimate, tmp_path: Path) -> None:
    result = calibrated(deck(LINEAR), weighed)
    own = tmp_path / f"{LINEAR}_calibrated.toml"
    own.write_text("mine")
    with pytest.raises(ExportError, match="not overwritten"):
        write_calibration(result, tmp_path, deck=own)
    assert own.read_text() == "mine"
    assert sorted(p.name for p in tmp_path.iterdir()) == [own.name]


def test_what_is_known_must_belong_to_the_deck(weighed: Estimate) -> None:
    wrong = Prior(("motor.inertia",), np.array([1e-3]), np.array([[0.01]]))
    with pytest.raises(ValueRangeError, match=r"motor\.inertia = 0\.001 in what is known, 0\.000597"):
        what_calibration_buys(deck(LINEAR), prior=wrong)
    foreign = Prior(("motor.mass",), np.array([1.0]), np.array([[0.01]]))
    with pytest.raises(UnknownNameError, match=r"motor\.mass"):
        what_calibration_buys(deck(LINEAR), prior=foreign)


def test_a_file_without_joint_numbers_is_refused(tmp_path: Path) -> None:
    (tmp_path / "x.json").write_text('{"names": ["a"]}')
    with pytest.raises(MeasurementError, match=r"x\.json.*joint_numbers"):
        read_joint_numbers(tmp_path / "x.json")


# --- records that do not hold what is needed --------------------------------------------------------


def table(folder: Path, heads: str, rows: np.ndarray, mapping: str) -> Path:
    np.savetxt(folder / "a.csv", rows, delimiter=",", header=heads, comments="")
    (folder / "records.toml").write_text(mapping)
    return folder


ANGLE = '[columns.angle]\nsignal = "motor_encoder.reading"\nunit = "rad"\n'


def test_records_without_weight_or_effort_are_refused(tmp_path: Path) -> None:
    time = 1e-3 * np.arange(3000)
    noisy = 0.3 * np.sin(3.0 * time) + 1e-4 * np.random.default_rng(0).standard_normal(3000)
    folder = table(tmp_path, "t_s,angle", np.array([time, noisy]).T, ANGLE)
    for kind, text in ((HungWeightTest(), "torque of the weight"), (FreeRunTest(), "neither the command")):
        tests = [load_calibration(deck(LINEAR), kind, folder)]
        with pytest.raises(MeasurementError, match=text):
            estimate(deck(LINEAR), tests)
    with pytest.raises(MeasurementError, match="has no records"):
        estimate(deck(LINEAR), [])


def test_a_machine_at_rest_tells_nothing(tmp_path: Path) -> None:
    time, random = 1e-3 * np.arange(3000), np.random.default_rng(0)
    rows = np.array([time, 1e-4 * random.standard_normal(3000), 0.04 * random.standard_normal(3000)]).T
    current = '[columns.current]\nsignal = "motor.current"\nunit = "A"\n'
    folder = table(tmp_path, "t_s,angle,current", rows, ANGLE + current)
    with pytest.raises(MeasurementError, match="moves long enough"):
        estimate(deck(LINEAR), [load_calibration(deck(LINEAR), FreeRunTest(), folder)])


def test_an_instrument_cannot_be_negative() -> None:
    with pytest.raises(ValueRangeError, match="cell"):
        Instruments(cell=-0.1)


def test_a_part_with_the_name_of_the_bench_is_refused() -> None:
    taken = deck(CAM).with_part("hung_weight", deck(CAM)["bearing"])
    with pytest.raises(ArrangementError, match=r"'hung_weight'.*rename"):
        HungWeightTest().on_bench(taken)


# --- plans ----------------------------------------------------------------------------------------


@pytest.fixture(scope="module")
def actuator() -> Assembly:
    return deck(LINEAR)


def test_a_plan_promises_what_records_then_give(weighed: Estimate, actuator: Assembly) -> None:
    plan = what_calibration_buys(actuator, [HungWeightTest()])
    promised, given = plan.ranked[0].known.spreads(), weighed.after.spreads()
    for name in ("motor.torque_constant", "spring.stiffness"):
        assert promised[name] == pytest.approx(given[name], rel=0.5)


def test_torque_of_a_linear_spring_is_as_uncertain_as_its_stiffness(actuator: Assembly) -> None:
    plan = what_calibration_buys(actuator, [FreeRunTest()])
    assert plan.now.torque == pytest.approx(3.4 * np.abs(plan.angles) * math.log(1.05), rel=1e-9)
    # A run without the spring says nothing of it.
    assert plan.ranked[0].torque == pytest.approx(plan.now.torque)


def test_calibrations_are_ranked_by_what_is_asked(actuator: Assembly) -> None:
    def of_inertia(known: Prior) -> float:
        return known.spreads()["motor.inertia"]

    by_torque = what_calibration_buys(actuator)
    assert [each.title for each in by_torque.ranked][-1] == "free run"
    assert len(by_torque.ranked[0].titles) == 3
    asked = what_calibration_buys(actuator, errors={"inertia": of_inertia}, rank_by="inertia")
    sizes = [each.errors["inertia"] for each in asked.ranked]
    assert sizes == sorted(sizes)
    assert asked.now.errors["inertia"] == pytest.approx(0.1)
    assert asked.to_dict()["ranked_by"] == "inertia"
    with pytest.raises(UnknownNameError, match="inertia"):
        what_calibration_buys(actuator, errors={"inertia": of_inertia}, rank_by="inertie")


def test_better_instruments_buy_more(actuator: Assembly) -> None:
    good, poor = (
        what_calibration_buys(actuator, [HungWeightTest(Instruments(weight=w))]).ranked[0].known.spreads()
        for w in (1e-3, 2e-2)
    )
    assert good["motor.torque_constant"] == pytest.approx(1e-3, rel=0.3)
    assert poor["motor.torque_constant"] == pytest.approx(2e-2, rel=0.3)


def test_a_spring_without_a_spread_has_nothing_to_be_calibrated() -> None:
    exact = deck("austin2015_stiff_spring")
    numbers = exact.quantities()
    known = exact.with_values({"spring.stiffness": replace(numbers["spring.stiffness"], spread=0.0)})
    plan = what_calibration_buys(known, [HungWeightTest()])
    assert plan.now.torque_rms == 0.0
    assert "none of its numbers has a spread" in plan.words()[0]
    still = exact.with_values({name: replace(each, spread=0.0) for name, each in numbers.items()})
    plan = what_calibration_buys(still, [HungWeightTest()])
    assert plan.words()[0].startswith("nothing is to be calibrated: no number of the deck has a spread")


def test_a_drive_that_saturates_is_planned_slowly_enough() -> None:
    """No command gives a motion that is too fast for it; a division by zero would be a plan of nothing."""
    with warnings.catch_warnings():
        warnings.simplefilter("error")
        plan = what_calibration_buys(deck("xl330_pendulum"), [FreeRunTest()])
    assert all(math.isfinite(reach) for reach in plan.reach.values())


def test_machines_without_a_spring_can_be_planned() -> None:
    plan = what_calibration_buys(deck("dfki_pendulum"))
    assert "load cell" in plan.left_out
    # No spring, so there is no torque: never a zero that looks like a result.
    assert plan.heads == ("calibration", "spreads, best four")
    assert all(len(row) == 2 for row in plan.rows())
    assert "has no spring" in plan.words()[0]
    written = json.loads(json.dumps(plan.to_dict(), allow_nan=False))
    assert written["now"]["torque_rms_Nm"] is None
    assert written["ranked_by"] == "spreads of all numbers"
    assert "e+" not in str(plan)
    assert {each.title for each in plan.ranked} >= {"hung weight", "free run"}
