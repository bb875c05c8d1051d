"""The observer from the better model: its torque error before and after, known here in closed form."""

from __future__ import annotations

import json
import math
from pathlib import Path

import numpy as np
import pytest

import models
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
from nlsdesign.feedback.control import (
    ClosedLoop,
    LoopVerdict,
    ScheduledTorque,
    Tracking,
    VelocityLoop,
    encoder_loop,
    torque_controller,
)
from nlsdesign.feedback.observer import CascadeGain, design_observer
from nlsdesign.foundation.deck import load_deck
from nlsdesign.foundation.errors import ArrangementError
from nlsdesign.foundation.quantity import Quantity
from nlsdesign.model import FlatModel, flatten
from nlsdesign.model.transform import with_outputs
from nlsdesign.presentation import report
from nlsdesign.presentation.report.diagnosis_sections import regeneration_sections
from nlsdesign.regeneration import (
    ObserverChoice,
    Regeneration,
    regenerate,
    regenerated_controller,
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


def test_controllers_are_compared_under_the_observers_that_are_exported(result: Regeneration) -> None:
    """The declared observer learns the wrong stiffness, so the sines are followed as well before as after."""
    controller = result.controller
    assert controller is not None
    assert controller.kept == ""
    assert controller.controller.origin == result.plant.origin
    plant = with_outputs(result.plant, ["motor.angle", "spring.torque"])
    loop = encoder_loop(plant, observer=result.observer, controller=controller.controller)
    last = controller.sines[-1]
    run = regenerated_controller.sine_tracking(loop, last.amplitude, last.frequency, 0.0)
    assert run.rms_error == last.after.rms_error
    assert controller.words()[0].startswith("Torque error of the better model under observer and controller")


def test_under_cascades_the_controller_of_the_better_model_follows_it_better(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    """The torque of a spring that is a fifth stiffer than declared is estimated a sixth too small."""
    monkeypatch.setattr(regenerated_controller, "usual_controller", plain_controller)
    models = flatten(machine(DECLARED)), flatten(machine(TRUE))
    old, new = (design_observer(each, gain=CascadeGain(), sample_time=2e-3) for each in models)
    for sine in regenerated_controller.regenerated_controller(*models, (old, new), 2e-3).sines:
        wanted = sine.amplitude / math.sqrt(2.0)
        assert sine.after.rms_error < 0.5 * sine.before.rms_error
        assert sine.before.rms_error > (1.0 - DECLARED / TRUE) * 0.8 * wanted


def plain_controller(model: FlatModel, sample_time: float) -> tuple[FlatModel, str]:
    """The usual controller, whose margins are not the point."""
    return torque_controller(model, sample_time=sample_time), "margins"


HUNTS = LoopVerdict("limit cycle", 1.0, 17.0, 0.5, 9.0, 0.1)


def tracked(error: float) -> Tracking:
    """A run with this error in N·m; one that hunts for what is no number."""
    hunts = math.isnan(error)
    verdict = HUNTS if hunts else LoopVerdict("settled", 0.0, math.nan, 0.0, 1.0, 0.1)
    return Tracking(error, error, error, error, verdict)


@pytest.mark.parametrize(
    ("before", "after", "mixed", "words"),
    [
        (1.0, 1.01, 5.0, "The controller is that of the better model"),
        (1.0, 1.03, 1.5, "follows better; with the generated observer: 1500 mN·m"),
        (
            1.0,
            math.nan,
            1.5,
            "under that of the better model the loop hunts; with the generated observer: 1500",
        ),
        (math.nan, 1.0, 5.0, "The controller is that of the better model"),
        (math.nan, math.nan, 5.0, "hunts, and so does that of the declared model: neither is fit"),
    ],
)
def test_a_controller_that_follows_worse_or_hunts_replaces_nothing(
    before: float, after: float, mixed: float, words: str, monkeypatch: pytest.MonkeyPatch
) -> None:
    declared, better = flatten(machine(DECLARED)), flatten(machine(TRUE))
    old, new = (design_observer(each, gain=CascadeGain(), sample_time=2e-3) for each in (declared, better))

    def sine_tracking(loop: ClosedLoop, *_: float) -> Tracking:
        if loop.controller.origin == better.origin:
            assert loop.observer is new
            return tracked(after)
        return tracked(before if loop.observer is old else mixed)

    monkeypatch.setattr(regenerated_controller, "sine_tracking", sine_tracking)
    monkeypatch.setattr(regenerated_controller, "usual_controller", plain_controller)
    chosen = regenerated_controller.regenerated_controller(declared, better, (old, new), 2e-3)
    stays = "stays" in chosen.words()[1]
    assert words in chosen.words()[1]
    assert bool(chosen.kept) == stays == (not words.startswith("The controller is"))
    assert chosen.controller.origin == (declared if stays else better).origin
    assert ("4 of 4 sines not followed (limit cycle of ±1 N·m at 17 Hz" in chosen.words()[0]) == (
        math.isnan(before) or math.isnan(after)
    )
    assert chosen.to_dict()["sines"][0]["after"] == (None if math.isnan(after) else after)


def test_a_bent_answer_to_a_sine_is_no_limit_cycle_and_an_oscillation_beside_it_is_one() -> None:
    """Behind a delay slow loops bend a sine; over one period its harmonics pass for an oscillation."""
    plant = flatten(models.cam_rubber_actuator(load_deck("austin2015_figure_consistent")))
    observer = design_observer(plant, gain=CascadeGain())
    for bandwidth, hunts in ((3.0, False), (6.0, True)):
        law, inner = ScheduledTorque(bandwidth=bandwidth), VelocityLoop(bandwidth=11.0 / 3.0 * bandwidth)
        controller = torque_controller(plant, law=law, velocity=inner)
        loop = encoder_loop(plant, observer=observer, controller=controller, delay=8)
        run = regenerated_controller.sine_tracking(loop, 1.0, 4.0, 0.0)
        assert (run.verdict.state == "limit cycle") == hunts
        assert math.isnan(run.rms_error) if hunts else 0.2 < run.rms_error < 0.5


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
        regenerated_controller.sine_tracking(
            encoder_loop(plant, observer=observer, controller=torque_controller(model)), 1.0, 2.0, 0.0
        ).rms_error
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
