"""The observer from the better model: its torque error before and after, known here in closed form."""

from __future__ import annotations

import json
import math
from pathlib import Path

import numpy as np
import pytest

from nlsdesign import export
from nlsdesign.bench.identification import Record, RecordSet
from nlsdesign.bench.identification.least_squares import Fit
from nlsdesign.bench.identification.parameters import declared_parameter
from nlsdesign.bench.identification.records.mapping import Column
from nlsdesign.components import (
    ROTATION,
    Assembly,
    Encoder,
    Fixed,
    GearedMotor,
    Inertia,
    LoadFriction,
    Spring,
    tie,
)
from nlsdesign.components.assembly.named_parts import assembly
from nlsdesign.feedback.control import ClosedLoop, encoder_loop, torque_controller
from nlsdesign.feedback.observer import CascadeGain, design_observer
from nlsdesign.foundation.errors import ArrangementError
from nlsdesign.foundation.quantity import Quantity
from nlsdesign.model import FlatModel, flatten
from nlsdesign.presentation import report
from nlsdesign.presentation.report.diagnosis_sections import regeneration_sections
from nlsdesign.regeneration import (
    ObserverChoice,
    Regeneration,
    regenerate,
    regenerated_observer,
    write_regeneration,
)
from nlsdesign.simulation import Trace
from tests.undrawn import undrawn

__all__ = ["undrawn"]
pytestmark = pytest.mark.usefixtures("undrawn")

TIME = np.arange(800) * 0.002
ANGLE = 0.3 * np.sin(4.0 * TIME)
TRUE, DECLARED = 2.4, 2.0


def machine(stiffness: float) -> Assembly:
    source = "by hand"
    number = Quantity(stiffness, "N*m/rad", source, spread=0.1)
    return assembly(
        "machine",
        motor=GearedMotor(
            inertia=Quantity(0.01, "kg*m^2", source),
            gear_ratio=20.0,
            torque_constant=Quantity(0.05, "N*m/A", source),
            current_limit=Quantity(50.0, "A", source),
        ),
        load=Fixed(),
        spring=tie(Spring(stiffness=number, domain=ROTATION), "motor", "load"),
        encoder=Encoder(of="motor.angle", quantum=Quantity(1e-5, "rad", source)),
    )


def rubbing(stiffness: float) -> FlatModel:
    """The machine with friction in the tie of its spring, in proportion to the load."""
    plain = machine(stiffness)
    inside = (("driven", plain.element("spring")),)
    law = LoadFriction(members=inside, ratio=Quantity(0.3, "1", "by hand"))
    return flatten(plain.with_part("spring", law.smooth(0.02)))


def bench(*signals: str) -> RecordSet:
    """The angle swings slowly; current and torque are those of the true spring."""
    torque = TRUE * ANGLE
    known = {
        "encoder.reading": (ANGLE, "rad"),
        "motor.current": ((torque - 0.01 * 16.0 * ANGLE) / (20.0 * 0.05), "A"),
        "spring.torque": (torque, "N*m"),
    }
    trace = Trace(TIME, {n: known[n][0] for n in signals}, {n: known[n][1] for n in signals})
    columns = tuple(Column(n, n, known[n][1]) for n in signals)
    return RecordSet((Record("slow", trace, "fit"), Record("seen last", trace, "held_out")), columns)


ALL = ("encoder.reading", "motor.current", "spring.torque")
CHOICE = ObserverChoice(sample_time=2e-3)


@pytest.fixture(scope="module")
def result() -> Regeneration:
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(regenerated_observer, "DRAWS", 3)
        better = flatten(machine(TRUE))
        parameter = declared_parameter(better.variable("spring.stiffness"))
        fit = Fit((parameter,), {"spring.stiffness": TRUE}, np.array([[1e-6]]), 0.0, {}, True)
        return regenerate(flatten(machine(DECLARED)), better, bench(*ALL), fits=[fit], choice=CHOICE)


def test_the_error_before_is_that_of_the_wrong_stiffness_and_is_gone_after(result: Regeneration) -> None:
    assert [e.record for e in result.errors] == ["seen last"], "held-out records alone"
    before, after = result.nominal
    assert before == pytest.approx((TRUE - DECLARED) * float(np.sqrt(np.mean(ANGLE**2))), rel=0.05)
    assert after < 0.02 * before
    assert result.errors[0].torque == pytest.approx(TRUE * float(np.sqrt(np.mean(ANGLE**2))), rel=0.01)
    assert (result.quantity, result.unit, result.reasons) == ("spring.torque", "N*m", ())


def test_over_the_spread_the_declared_numbers_scatter_and_the_fitted_hardly(result: Regeneration) -> None:
    assert len(result.spread_before) == len(result.spread_after) == 3
    assert np.ptp(result.spread_before) > 0.1 * result.nominal[0]
    assert max(result.spread_after) < 0.05 * min(result.spread_before)


def test_what_is_said_is_what_was_worked_out(result: Regeneration, tmp_path: Path) -> None:
    nominal, spread, learning, generated, tracked, taken = result.words()
    assert nominal.startswith("Error of the observer of `spring.torque` with the nominal numbers")
    assert nominal.endswith(" N·m.")
    assert "over the spread" in spread
    assert "that learns" in learning
    assert "on the records that decide (fit)" in generated
    assert "before → after" in tracked
    assert taken.startswith("The controller is that of the better model")
    assert (len(result.observer.states) > 20) == generated.startswith("Generated is the corrected")
    written = json.loads(json.dumps(result.to_dict(), allow_nan=False))
    assert written["nominal"]["before"] == result.nominal[0]
    page = report.write_report(tmp_path / "r.html", *regeneration_sections(result, {}), title="t")
    assert nominal.partition(": ")[2].removesuffix(".") in page.read_text(encoding="utf-8")


@pytest.fixture
def observer_alone(monkeypatch: pytest.MonkeyPatch) -> None:
    """One draw of the numbers and no controller, whose margins take seconds."""

    def none(*_: object) -> None:
        raise ArrangementError("the controller", "is not the point here")

    monkeypatch.setattr(regenerated_observer, "DRAWS", 1)
    monkeypatch.setattr(regenerated_observer, "regenerated_controller", none)


def with_records(*records: tuple[str, float]) -> RecordSet:
    """Records of machines with these stiffnesses, by role."""
    made = []
    for role, stiffness in records:
        torque = stiffness * ANGLE
        known = {ALL[0]: ANGLE, ALL[1]: (torque - 0.16 * ANGLE), ALL[2]: torque}
        made.append(Record(role, Trace(TIME, known, dict(zip(ALL, ("rad", "A", "N*m"), strict=True))), role))
    return RecordSet(tuple(made), bench(*ALL).columns)


@pytest.mark.usefixtures("observer_alone")
def test_held_out_records_decide_nothing() -> None:
    """On the selection the better model is right; the record held out is of the declared machine."""
    records = with_records(("fit", TRUE), ("selection", TRUE), ("held_out", DECLARED))
    declared, better = flatten(machine(DECLARED)), flatten(machine(TRUE))
    found = regenerate(declared, better, records, choice=CHOICE)
    assert [e.role for e in found.errors] == ["held_out"]
    before, after = found.nominal
    assert before < after, "held out, the declared model would have been taken"
    assert "(selection)" in found.chosen
    assert "not replaced" not in found.chosen


@pytest.mark.usefixtures("observer_alone")
def test_an_observer_that_would_be_worse_replaces_nothing() -> None:
    records = with_records(("fit", TRUE), ("selection", DECLARED), ("held_out", TRUE))
    declared, better = flatten(machine(DECLARED)), flatten(machine(TRUE))
    found = regenerate(declared, better, records, choice=CHOICE)
    assert "of the declared model, which is not replaced" in found.chosen
    assert any("not replaced" in sentence for sentence in found.words())
    assert found.observer is not None
    assert found.observer.origin == declared.origin or "declared" in found.chosen


@pytest.mark.usefixtures("observer_alone")
def test_of_two_that_are_equally_good_the_better_models_is_generated() -> None:
    """The records are of a third machine, from which both are as far to a millionth."""
    records = with_records(("fit", TRUE), ("selection", TRUE), ("held_out", TRUE))
    declared, better = flatten(machine(DECLARED)), flatten(machine(DECLARED + 1e-6 * (DECLARED - TRUE)))
    found = regenerate(declared, better, records, choice=CHOICE)
    before, after = found.nominal
    assert before < after < 1.001 * before
    assert "not replaced" not in found.chosen


def test_observer_and_plant_are_written(
    result: Regeneration, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(export, "export_fmu", lambda model, path: path)
    written, files = write_regeneration(result, tmp_path)
    assert {p.name for p in files} >= {
        "observer.c",
        "controller.c",
        "observer.fmu",
        "controller.fmu",
        "plant.fmu",
    }
    assert written.reasons == ()
    saved = json.loads((tmp_path / "regeneration.json").read_text(encoding="utf-8"))
    assert saved["files"] == [str(path) for path in files]
    assert (tmp_path / "c" / "observer.c").is_file()


def test_the_controller_of_the_better_model_follows_it_better(result: Regeneration) -> None:
    """The torque of a spring that is a fifth stiffer than declared is estimated a sixth too small."""
    controller = result.controller
    assert controller is not None
    assert controller.kept == ""
    assert controller.controller.origin == result.plant.origin
    for sine in controller.sines:
        wanted = sine.amplitude / math.sqrt(2.0)
        assert sine.after < 0.5 * sine.before
        assert sine.before > (1.0 - DECLARED / TRUE) * 0.8 * wanted
    assert controller.words()[0].startswith("Torque error of the better model under observer and controller")


@pytest.mark.parametrize(
    ("before", "after", "stays"),
    [(1.0, 1.01, False), (1.0, 1.03, True), (1.0, math.nan, True), (math.nan, 1.0, False)],
)
def test_a_controller_that_follows_worse_or_hunts_replaces_nothing(
    before: float, after: float, stays: bool, monkeypatch: pytest.MonkeyPatch
) -> None:
    def error(loop: ClosedLoop, *_: float) -> float:
        return after if loop.controller.origin == better.origin else before

    def usual(model: FlatModel, sample_time: float) -> tuple[FlatModel, str]:
        return torque_controller(model, sample_time=sample_time), "margins"

    monkeypatch.setattr(regenerated_observer, "sine_error", error)
    monkeypatch.setattr(regenerated_observer, "usual_controller", usual)
    declared, better = flatten(machine(DECLARED)), flatten(machine(TRUE))
    chosen = regenerated_observer.regenerated_controller(declared, better, 2e-3)
    assert bool(chosen.kept) == stays
    assert chosen.controller.origin == (declared if stays else better).origin
    assert chosen.words()[1].startswith("The controller stays" if stays else "The controller is that of the")


def test_a_controller_without_an_observer_of_its_model_says_whose_is_in_the_loop(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    declared, better = flatten(machine(DECLARED)), flatten(machine(TRUE))

    def observer(model: FlatModel, **_: object) -> FlatModel:
        if model.origin == better.origin:
            raise ArrangementError("this law", "has no observer")
        return design_observer(model, gain=CascadeGain(), sample_time=2e-3)

    def usual(model: FlatModel, sample_time: float) -> tuple[FlatModel, str]:
        return torque_controller(model, sample_time=sample_time), "margins"

    monkeypatch.setattr(regenerated_observer, "design_observer", observer)
    monkeypatch.setattr(regenerated_observer, "usual_controller", usual)
    monkeypatch.setattr(regenerated_observer, "sine_error", lambda *_: 1.0)
    chosen = regenerated_observer.regenerated_controller(declared, better, 2e-3)
    assert chosen.words()[1].endswith(f"the observer in the loop after is {regenerated_observer.STAND_IN}.")


@pytest.mark.usefixtures("observer_alone")
def test_where_a_law_has_no_observer_the_declared_one_takes_its_numbers() -> None:
    """Friction that grows with the load is no function of the angle; the stiffness behind it still is."""
    found = regenerate(flatten(machine(DECLARED)), rubbing(TRUE), bench(*ALL), choice=CHOICE)
    before, after = found.nominal
    assert before == pytest.approx((TRUE - DECLARED) * float(np.sqrt(np.mean(ANGLE**2))), rel=0.05)
    assert after < 0.02 * before
    assert found.observer is not None
    assert found.reasons[0].startswith("no observer can be designed for the better model: ")
    assert found.reasons[0].endswith(f"in its place stands {regenerated_observer.STAND_IN}")


def test_friction_that_grows_with_the_load_inside_a_spring_is_compensated() -> None:
    """A third of the load rubs: the error falls by more than a fifth where the controller reckons with it."""
    plant, declared = rubbing(TRUE), flatten(machine(TRUE))
    observer = design_observer(declared, gain=CascadeGain())
    unknown, known = (
        regenerated_observer.sine_error(
            encoder_loop(plant, observer=observer, controller=torque_controller(model)), 1.0, 2.0, 0.0
        )
        for model in (declared, plant)
    )
    assert known < 0.8 * unknown


def test_a_machine_without_a_spring_says_why_it_has_no_observer() -> None:
    wheel = flatten(assembly("wheel", wheel=Inertia(inertia=1e-3)))
    lacking = regenerate(wheel, wheel, bench(*ALL), choice=CHOICE)
    assert lacking.observer is None
    assert lacking.reasons[0].startswith("no observer can be designed for the better model: ")
    assert "spring" in lacking.reasons[0]
    assert lacking.words() == ()
    assert math.isnan(lacking.nominal[0])
    assert regeneration_sections(lacking, {})


@pytest.mark.usefixtures("observer_alone")
def test_without_a_measured_torque_there_is_an_observer_but_no_error() -> None:
    model = flatten(machine(TRUE))
    lacking = regenerate(model, model, bench(*ALL[:2]), choice=CHOICE)
    assert lacking.observer is not None
    assert "measures neither the torque 'spring.torque' nor a force behind its cam" in lacking.reasons[0]
