"""Poles of the published observer against records of the independent rig: exact slopes beside CMA-ES."""

from __future__ import annotations

import math
import re
from collections.abc import Iterator, Sequence
from dataclasses import replace

import numpy as np
import pytest

from nlsdesign import declare, flatten, load_deck
from nlsdesign.bench.identification import Record, RecordSet
from nlsdesign.bench.identification.records.mapping import Column
from nlsdesign.bench.identification.records.quality import Finding
from nlsdesign.components import CurrentSensor, ForceSensor
from nlsdesign.feedback.observer.scheduling.scheduled import error_matrices
from nlsdesign.foundation.errors import ConvergenceError, MeasurementError, UnknownNameError, ValueRangeError
from nlsdesign.foundation.quantity import Quantity
from nlsdesign.model import FlatModel
from nlsdesign.regeneration import FittedPoles, ObserverChoice, fit_poles, fitted_poles
from nlsdesign.simulation import Trace
from tests.rig import make_records
from tests.rig.published import HIDDEN, PUBLISHED, SEED, record_name

SIGNALS = {"motor_encoder.reading": "rad", "ammeter.reading": "A", "load_cell.reading": "N"}
ROLES = {"sine_25deg_2.0Hz": "fit", "sine_15deg_5.0Hz": "selection", "multisine": "held_out"}
SECONDS, COARSE = 1.5, ObserverChoice(sample_time=2e-3)


@pytest.fixture(scope="module", autouse=True)
def small_table() -> Iterator[None]:
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(fitted_poles, "GRID_POINTS", 21)
        yield


@pytest.fixture(scope="module")
def model() -> FlatModel:
    actuator = declare(load_deck("austin2015_figure_consistent"))
    noise = [Quantity(value, unit, "rig") for value, unit in ((0.04, "A"), (0.3, "N"))]
    return flatten(
        actuator.with_part("ammeter", CurrentSensor(of="motor.current", noise=noise[0])).with_part(
            "load_cell", ForceSensor(of="spring.rubber.force", noise=noise[1])
        )
    )


@pytest.fixture(scope="module")
def bench() -> RecordSet:
    """The published actuator, built a little otherwise and with a relaxation that no deck declares."""
    tables = make_records(PUBLISHED, HIDDEN, seed=SEED, only=tuple(ROLES))
    return recorded({name: tables[name] for name in ROLES})


def recorded(tables: dict[str, np.ndarray], signals: Sequence[str] = tuple(SIGNALS)) -> RecordSet:
    records = []
    for name, table in tables.items():
        time, *values = table[table[:, 0] <= SECONDS].T
        values[2] = 0.5 * values[2]  # of one element
        known = {n: v for n, v in zip(SIGNALS, values, strict=True) if n in signals}
        trace = Trace(time, known, {n: SIGNALS[n] for n in known})
        records.append(Record(record_name(name), trace, ROLES[name]))
    return RecordSet(tuple(records), tuple(Column(n, n, SIGNALS[n]) for n in signals))


@pytest.fixture(scope="module")
def fitted(model: FlatModel, bench: RecordSet) -> FittedPoles:
    """A few steps from each start, which is far enough."""
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(fitted_poles, "_STEPS", 8)
        return fit_poles(model, bench, choice=COARSE)


@pytest.mark.slow
def test_fitted_poles_err_less_than_the_gain_of_the_cascade(fitted: FittedPoles) -> None:
    fit, selection, held_out = fitted.errors
    assert [e.role for e in fitted.errors] == ["fit", "selection", "held_out"]
    assert fit.after < 0.8 * fit.before
    assert selection.after < 0.8 * selection.before
    assert fit.percent_after < fit.percent_before
    assert held_out.before > 0.0
    assert fitted.deciding == "selection"


@pytest.mark.slow
def test_the_error_printed_is_that_of_the_observer_that_is_written(
    fitted: FittedPoles, model: FlatModel, bench: RecordSet
) -> None:
    """The search simulates on its own; the table of errors runs the finished observer."""
    question = fitted_poles._Question(model, "spring.torque", "motor.angle", COARSE.sample_time)
    plant = fitted.design.step.plant
    run = fitted_poles.WatchedRecord.of(
        model, fitted_poles.series_spring(model, None), bench.of("fit")[0], COARSE
    ).settled(fitted.settling)
    search = fitted_poles._Search(question, plant, [run], fitted.poles)
    numbers = search.begin(fitted.poles)
    assert search.error(numbers, [run]) == pytest.approx(fitted.errors[0].after, rel=1e-6)
    # Slopes are exact: central differences of the same simulation agree to their own error.
    _, slopes = search.errors(numbers, [run])
    for k in range(3):
        step = 1e-5 * np.eye(3)[k]
        sides = [search.errors(numbers + sign * step, [run], slopes=False)[0] for sign in (1.0, -1.0)]
        differences = (sides[0] - sides[1]) / 2e-5
        scale = np.max(np.abs(differences)) + 1e-9
        assert np.max(np.abs(slopes[:, k] - differences)) < 1e-5 * scale


@pytest.mark.slow
def test_the_margin_is_that_of_the_error_between_the_points_too(fitted: FittedPoles) -> None:
    ends = fitted.design.compact.angles[[0, -1]]
    angles = np.linspace(*ends, 20 * 25 + 1)
    radius = np.abs(np.linalg.eigvals(error_matrices(fitted.design.model, angles))).max(axis=1)
    assert fitted.worst[1] == pytest.approx(radius.max(), abs=2e-3)
    assert fitted.worst[1] < 1.0
    assert fitted.margin > 0.0
    assert f"{fitted.margin:.3g} 1/s" in fitted.reason


@pytest.fixture(scope="module")
def alone(model: FlatModel, bench: RecordSet) -> FittedPoles:
    """Without a record that selects."""
    return fit_poles(model, replace(bench, records=bench.of("fit")), choice=COARSE)


@pytest.mark.slow
def test_exact_slopes_end_no_worse_than_cma(alone: FittedPoles, model: FlatModel, bench: RecordSet) -> None:
    pytest.importorskip("cma")
    yardstick = fit_poles(model, replace(bench, records=bench.of("fit")), choice=COARSE, by="cma")
    assert alone.errors[0].after <= 1.001 * yardstick.errors[0].after
    assert alone.evaluations < yardstick.evaluations
    assert (alone.deciding, yardstick.deciding) == ("fit", "fit")


@pytest.mark.slow
def test_of_several_fits_selection_takes_one_that_errs_more_on_the_fit(
    alone: FittedPoles, fitted: FittedPoles, model: FlatModel, bench: RecordSet
) -> None:
    assert alone.errors[0].after < fitted.errors[0].after
    assert selected(alone, model, bench) > selected(fitted, model, bench)


def selected(fit: FittedPoles, model: FlatModel, bench: RecordSet) -> float:
    """Error on the record that selects."""
    spring = fitted_poles.series_spring(model, None)
    run = fitted_poles.WatchedRecord.of(model, spring, bench.of("selection")[0], COARSE)
    run = run.settled(fit.settling)
    return run.error(run.estimate(fit.design))


@pytest.mark.parametrize("role", ["selection", "held_out"])
def test_selection_chooses_among_fits_and_held_out_records_do_not(
    role: str, monkeypatch: pytest.MonkeyPatch, model: FlatModel, bench: RecordSet
) -> None:
    """One record shows no torque at all, as if its spring were gone: its role says what that changes."""
    both = [np.log([200.0, 1.1, 1500.0]), np.log([100.0, 0.3, 1500.0])]
    monkeypatch.setattr(fitted_poles._Search, "by_gradient", lambda self: both)
    records = []
    for record in bench.records:
        trace = record.trace
        if record.role == role:
            nothing = np.zeros(len(trace))
            trace = trace.with_signals({"load_cell.reading": nothing}, {"load_cell.reading": "N"})
        records.append(replace(record, trace=trace))
    before, after = (
        fit_poles(model, each, choice=COARSE) for each in (bench, replace(bench, records=tuple(records)))
    )
    assert (before.poles != after.poles) == (role == "selection")
    changed = [e.role for e, other in zip(before.errors, after.errors, strict=True) if e != other]
    assert role in changed
    assert changed == [role] or role == "selection"


def test_the_search_reads_records_of_the_fit_alone(
    monkeypatch: pytest.MonkeyPatch, model: FlatModel, bench: RecordSet
) -> None:
    seen = []

    class Watching(fitted_poles._Search):
        def by_gradient(self) -> list[np.ndarray]:
            seen.extend(run.record.role for run in self.runs)
            return [self.begin(self.starts[1])]

    monkeypatch.setattr(fitted_poles, "_Search", Watching)
    fit_poles(model, bench, choice=COARSE)
    assert seen == ["fit"]


def test_what_cannot_be_fitted_is_named(model: FlatModel, bench: RecordSet) -> None:
    tables = {name: np.zeros((100, 4)) + np.arange(100)[:, None] * 1e-3 for name in ROLES}
    with pytest.raises(MeasurementError, match=r"record 'sine_2\.0Hz': does not measure motor\.current"):
        fit_poles(model, recorded(tables, ("motor_encoder.reading", "load_cell.reading")), choice=COARSE)
    with pytest.raises(MeasurementError, match="measures neither the torque"):
        fit_poles(model, recorded(tables, ("motor_encoder.reading", "ammeter.reading")), choice=COARSE)
    with pytest.raises(MeasurementError, match="none has the role 'fit'"):
        fit_poles(model, replace(bench, records=bench.of("held_out")), choice=COARSE)
    with pytest.raises(UnknownNameError, match="gradient"):
        fit_poles(model, bench, by="gradiant")
    with pytest.raises(ValueRangeError, match=r"faster than the sample rate carries, 1571 1/s"):
        fit_poles(model, bench, choice=COARSE, first=(-50.0, -60.0, -1600.0, -200.0))


def test_poles_that_are_unstable_between_two_points_of_the_table_are_refused(
    monkeypatch: pytest.MonkeyPatch, model: FlatModel, bench: RecordSet
) -> None:
    monkeypatch.setattr(
        fitted_poles._Search, "by_gradient", lambda self: [self.begin((-8.0, -11.0, -16.0, -200.0))]
    )
    with pytest.raises(ConvergenceError, match=r"leave an error that grows at .* rad"):
        fit_poles(model, bench, choice=COARSE)


POLES = (-34.0 - 155.0j, -34.0 + 155.0j, -1500.0, -94.0)


@pytest.fixture
def searched_nothing(monkeypatch: pytest.MonkeyPatch) -> None:
    """Poles of a fit to the record of 5 Hz, without the search."""
    monkeypatch.setattr(fitted_poles._Search, "by_gradient", lambda self: [self.begin(POLES)])


def changed(record: Record, role: str, *, rows: slice = slice(None), **times: float) -> Record:
    """Return rows of a record with another role, a signal of it times a number."""
    trace = record.trace
    signals = {n: times.get(n.partition(".")[0], 1.0) * v[rows] for n, v in trace.signals.items()}
    return replace(record, role=role, trace=Trace(trace.time[rows], signals, trace.units))


def over(bench: RecordSet, *records: Record) -> RecordSet:
    return replace(bench, records=records)


@pytest.mark.usefixtures("searched_nothing")
def test_a_record_that_begins_in_motion_is_judged_after_the_observers_have_settled(
    monkeypatch: pytest.MonkeyPatch, model: FlatModel, bench: RecordSet
) -> None:
    """The last third of a sine, as it is held out by default: a start at rest is not its error."""
    sine = bench.of("selection")[0]
    third = 2 * len(sine.trace) // 3
    records = over(bench, changed(sine, "fit"), changed(sine, "held_out", rows=slice(third, None)))
    fitted = fit_poles(model, records, choice=COARSE)
    moving = fitted.errors[1]
    assert moving.after < moving.before
    assert not fitted.remarks
    assert fitted.content()["settling_time"] == fitted.settling
    assert f"from {1e3 * fitted.settling:.3g} ms on" in fitted.shown()[0]
    monkeypatch.setattr(fitted_poles, "SETTLED", 0.0)
    spoiled = fit_poles(model, records, choice=COARSE)
    assert spoiled.errors[1].after > 3.0 * moving.after
    assert any(
        "(first" not in r and "the fit makes it worse" in r and "held out" in r for r in spoiled.remarks
    )


def test_the_same_samples_count_for_all_poles_and_no_more_than_a_quarter_does_not(
    model: FlatModel, bench: RecordSet
) -> None:
    question = fitted_poles._Question(model, "spring.torque", "motor.angle", COARSE.sample_time)
    plant = question.designed(None).step.plant
    spring = fitted_poles.series_spring(model, None)
    whole = fitted_poles.WatchedRecord.of(model, spring, bench.of("fit")[0], COARSE)
    count = len(whole.torque)
    assert whole.settled(0.1).skipped == round(0.1 / COARSE.sample_time)
    run = whole.settled(1e3)
    assert run.skipped == count // 4
    search = fitted_poles._Search(question, plant, [run], POLES)
    faster = search.begin(POLES)
    errors, slopes = search.errors(faster, [run])
    assert (len(errors), len(slopes)) == (count - run.skipped,) * 2
    assert np.array_equal(errors, search.errors(faster, [whole])[0][run.skipped :])
    refused = search.errors(np.log([9000.0, 1.0, 10.0]), [run])[0]
    assert refused.shape == errors.shape
    assert np.all(np.isinf(refused))


def test_no_torque_in_the_records_is_refused(model: FlatModel, bench: RecordSet) -> None:
    with pytest.raises(MeasurementError, match=r"records sine_2\.0Hz: no torque in the records.* -> map"):
        fit_poles(model, over(bench, changed(bench.of("fit")[0], "fit", load_cell=0.0)), choice=COARSE)


@pytest.mark.usefixtures("searched_nothing")
@pytest.mark.parametrize(
    ("role", "factors", "words"),
    [
        ("fit", {"load_cell": -1.0}, r"still [\d.]+ % off, .*-\d.* times what is shown.*check sign, unit"),
        ("fit", {"load_cell": 1e3}, r"still 99\.9 % off.*not the torque of the deck"),
        ("held_out", {"load_cell": 0.0}, r"no torque in it"),
        (
            "fit",
            {"motor_encoder": 6.0},
            r"goes to \d+\.?\d*°, the contour of .* ends at 65°.*mapping of the angle",
        ),
    ],
)
def test_records_that_do_not_show_the_torque_of_the_deck_are_remarked(
    model: FlatModel, bench: RecordSet, role: str, factors: dict[str, float], words: str
) -> None:
    sine = bench.of("selection")[0]
    strange = replace(changed(sine, role, **factors), name="strange")
    fitted = fit_poles(model, over(bench, changed(sine, "fit"), strange), choice=COARSE)
    assert any(re.search(f"record 'strange': .*{words}", remark) for remark in fitted.remarks), fitted.remarks
    assert not any(remark.startswith("record 'sine") for remark in fitted.remarks)


@pytest.mark.usefixtures("searched_nothing")
def test_the_order_of_the_poles_is_one_and_so_is_what_is_at_an_end(
    monkeypatch: pytest.MonkeyPatch, model: FlatModel, bench: RecordSet
) -> None:
    order = ("spring.rubber.force", "motor.angle", "motor.speed", "spring.rubber.extension")
    with pytest.raises(ValueRangeError, match=f"one per state: {', '.join(order)}"):
        fit_poles(model, bench, choice=COARSE, first=(-50.0, -60.0, -200.0))
    for wrong, words in ((math.nan, "not nan for motor.angle"), (1.0, "not 1 for motor.angle")):
        with pytest.raises(ValueRangeError, match=f"{words}; they stand for {', '.join(order)}"):
            fit_poles(model, bench, choice=COARSE, first=(-50.0, wrong, -200.0, -94.0))
    noted = replace(
        over(bench, changed(bench.of("fit")[0], "fit")), remarks=(Finding("sine.csv", "3 masked"),)
    )
    fitted = fit_poles(model, noted, choice=COARSE, first=POLES)
    assert fitted.poles == pytest.approx(POLES)
    assert fitted.at_end == ()
    assert fitted.remarks[0] == "sine.csv: 3 masked"
    assert f"for {', '.join(order)}, fitted by gradient, not fitted for {order[3]};" in fitted.reason
    assert str(fitted) == repr(fitted) == f"FittedPoles: {fitted.reason}"
    monkeypatch.setattr(fitted_poles._Search, "by_gradient", lambda self: [self.ends[1] - [3.0, 0.5, 0.0]])
    ended = fit_poles(model, noted, choice=COARSE)
    assert ended.at_end == ("motor.speed",)
    assert "at the end of its range for motor.speed, not fitted" in ended.reason
