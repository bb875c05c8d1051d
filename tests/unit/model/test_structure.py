"""What a flat model says it is made of: bodies, springs, cams and readings, whatever the parts are called."""

from __future__ import annotations

import pytest

from nlsdesign.components import TRANSLATION, Driven, Encoder, ForceSensor, SampleAndHold, Spring, tie
from nlsdesign.components import assembly as assemble
from nlsdesign.components.assembly.deck_writer import declare
from nlsdesign.foundation.deck import load_deck
from nlsdesign.model import FlatModel, flatten


def model_of(deck: str) -> FlatModel:
    return flatten(declare(load_deck(deck)))


def names_in(model: FlatModel) -> set[str]:
    groups = (model.states, model.inputs, model.parameters, model.signals)
    return {v.name for group in groups for v in group}


@pytest.mark.parametrize(
    "deck", ["austin2015_figure_consistent", "janot2019_positioning_drive", "one_sided_cable_drive"]
)
def test_every_name_that_is_given_is_one_of_the_model(deck: str) -> None:
    model, known = model_of(deck), names_in(model_of(deck))
    for body in model.bodies:
        assert {body.motion, body.rate, body.inertia, *body.drives} <= known
        assert model.variable(body.rate).unit == body.domain.rate_unit
    for spring in model.springs:
        assert {spring.motion, spring.effort} <= known
        assert model.variable(spring.effort).unit == spring.domain.effort_unit
        for cam in spring.cams:
            assert {cam.angle, cam.lever_arm, cam.extension, cam.force, cam.pretension, cam.elements} <= known
            assert (model.variable(cam.lever_arm).unit, model.variable(cam.force).unit) == ("m", "N")
    for reading in model.readings:
        assert {reading.signal, reading.measured} <= known


def test_a_gear_train_is_one_body_with_the_inertia_of_all() -> None:
    (motor,) = model_of("one_sided_cable_drive").bodies
    assert (motor.name, motor.inertia, motor.drives) == ("motor", "motor.train_inertia", ("motor.current",))


def test_a_carriage_moves_along_a_line_and_has_a_mass() -> None:
    (carriage,) = model_of("janot2019_positioning_drive").bodies
    assert (carriage.motion, carriage.rate) == ("carriage.position", "carriage.speed")
    assert (carriage.inertia, carriage.domain.effort, carriage.prescribed) == (
        "carriage.mass",
        "force",
        False,
    )


def test_what_only_pushes_or_rubs_is_no_spring() -> None:
    assert [s.name for s in model_of("janot2019_positioning_drive").springs] == []
    assert [s.name for s in model_of("austin2015_figure_consistent").springs] == ["spring"]


def test_a_prescribed_motion_is_a_body_without_inertia() -> None:
    pulled = assemble("pulled", grip=Driven(domain=TRANSLATION), rubber=tie(Spring(stiffness=100.0), "grip"))
    (grip,) = flatten(pulled).bodies
    assert grip.prescribed
    assert (grip.motion, grip.rate, grip.drives) == ("grip.position", "grip.speed", ())


def test_a_reading_names_the_whole_chain_of_sensors() -> None:
    chain = assemble(
        "chain",
        shaft=Driven(),
        grip=Driven(domain=TRANSLATION),
        rubber=tie(Spring(stiffness=100.0), "grip"),
        encoder=Encoder(of="shaft.angle", quantum=1e-3),
        latch=SampleAndHold(of="encoder.reading", sample_rate=1e3),
        cell=ForceSensor(of="rubber.force"),
    )
    readings = {r.signal: (r.measured, r.sensors) for r in flatten(chain).readings}
    assert readings == {
        "encoder.reading": ("shaft.angle", ("encoder",)),
        "latch.reading": ("shaft.angle", ("latch", "encoder")),
        "cell.reading": ("rubber.force", ("cell",)),
    }
    assert chain.measured("shaft.angle") == ("shaft.angle", ())
