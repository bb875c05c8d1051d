"""Terminals of the FMUs: what they hold, that equal names wire a loop, and the sign of a flange."""

from __future__ import annotations

from collections.abc import Mapping
from pathlib import Path

import fmpy
import numpy as np
import pytest
from lxml import etree

from nlsdesign.components.assembly.deck_writer import declare
from nlsdesign.export.fmi.fmu import fmu_texts
from nlsdesign.export.fmi.fmu_variables import with_flange_outputs
from nlsdesign.feedback.control import torque_controller
from nlsdesign.feedback.observer import CascadeGain, design_observer
from nlsdesign.foundation.deck import load_deck
from nlsdesign.model import flatten
from nlsdesign.model.flat import FlatModel
from tests.renamed import in_words, renamed

PLACE = "terminalsAndIcons/terminalsAndIcons.xml"
FOLDER = Path(fmpy.__file__).parent / "schema" / "fmi3"


def plant_of(deck: str) -> FlatModel:
    return flatten(declare(load_deck(deck)))


def terminals_in(model: FlatModel) -> dict[str, dict[str, tuple[str, str]]]:
    """Member → (variable, kind) by terminal, as an importer reads them; checked against the description."""
    texts = fmu_texts(model, version="3.0", step=1e-3)
    root = etree.fromstring(texts[PLACE])
    etree.XMLSchema(etree.parse(str(FOLDER / "fmi3TerminalsAndIcons.xsd"))).assertValid(root)
    description = etree.fromstring(texts["modelDescription.xml"])
    causality = {v.get("name"): v.get("causality") for v in description.find("ModelVariables")}
    found: dict[str, dict[str, tuple[str, str]]] = {}
    for terminal in root.iter("Terminal"):
        members = {
            m.get("memberName"): (m.get("variableName"), m.get("variableKind"))
            for m in terminal.iter("TerminalMemberVariable")
        }
        assert len(members) == len(list(terminal.iter("TerminalMemberVariable")))
        for variable, _ in members.values():
            assert causality[variable] in ("input", "output"), variable
        (picture,) = terminal.iter("TerminalGraphicalRepresentation")
        icon = texts[f"terminalsAndIcons/{picture.get('iconBaseName')}.png"]
        assert icon.startswith(b"\x89PNG\r\n\x1a\n")
        assert terminal.get("name") not in found
        found[terminal.get("name")] = members
    return found


def wires_of(models: Mapping[str, FlatModel]) -> dict[str, str]:
    """What a tool wires that joins the buses: each input with the output of the same member name."""
    buses = {part: terminals_in(model)["loop"] for part, model in models.items()}
    given = {
        name: f"{part}.{variable}"
        for part, model in models.items()
        for name, (variable, _) in buses[part].items()
        if variable not in {v.name for v in model.inputs}
    }
    return {
        f"{part}.{variable}": given[name]
        for part, model in models.items()
        for name, (variable, _) in buses[part].items()
        if variable in {v.name for v in model.inputs} and name in given
    }


def test_equal_names_on_the_bus_wire_the_torque_loop():
    plant = plant_of("austin2015_figure_consistent")
    models = {
        "plant": plant,
        "observer": design_observer(plant, gain=CascadeGain()),
        "controller": torque_controller(plant),
    }
    assert wires_of(models) == {
        "plant.motor.current": "controller.motor.current",
        "observer.motor.angle": "plant.motor_encoder.reading",
        "observer.motor.current": "controller.motor.current",
        "controller.motor.angle": "plant.motor_encoder.reading",
        "controller.spring.torque": "observer.spring.torque",
    }


def test_the_bus_follows_structure_not_names():
    assembly = renamed(declare(load_deck("austin2015_figure_consistent")), in_words).assembly
    plant = flatten(assembly)
    models = {"plant": plant, "controller": torque_controller(plant)}
    (command,) = plant.inputs
    (reading,) = plant.readings
    wires = wires_of(models)
    assert wires[f"plant.{command.name}"] == f"controller.{command.name}"
    assert wires[f"controller.{reading.measured}"] == f"plant.{reading.signal}"


def test_of_a_chain_of_sensors_the_last_has_the_name_of_what_is_shown():
    bus = terminals_in(plant_of("one_sided_cable_drive"))["loop"]
    assert bus["motor.angle"][0] == "motor_encoder.reading"
    assert bus["motor_encoder_sampling.reading"][0] == "motor_encoder_sampling.reading"
    rig = terminals_in(plant_of("test_rig"))["loop"]
    assert rig["motor.current"][0] == "motor.current"
    assert rig["current_sensor.reading"][0] == "current_sensor.reading"


def test_a_load_on_a_geared_body_is_a_flange():
    plant = plant_of("one_sided_cable_drive")
    flange = terminals_in(plant)["drum"]
    assert flange == {
        "phi": ("drum.angle", "signal"),
        "w": ("drum.speed", "signal"),
        "tau": ("drum.torque", "inflow"),
    }
    # What flows in accelerates in the direction of the angle.
    state = plant.start(plant.states)
    pushed, rest = (plant.evaluate(state, [0.0, torque])["drum.acceleration"] for torque in (1.0, 0.0))
    assert pushed > rest


def test_a_body_moved_from_outside_is_a_flange_and_its_reaction_flows_in():
    plant = plant_of("vhb4910_specimen")
    flange = terminals_in(plant)["grip"]
    assert flange == {
        "s": ("grip.position", "signal"),
        "v": ("grip.speed", "signal"),
        "f": ("grip.reaction", "inflow"),
    }
    # Whoever stretches the strip does work on it.
    stretched = plant.evaluate(np.zeros(len(plant.states)), [0.05, 1.0])
    assert stretched["grip.reaction"] * 1.0 > 0.0


@pytest.mark.parametrize("version", ["2.0", "3.0"])
def test_fmi_2_has_no_terminals(version):
    texts = fmu_texts(plant_of("one_sided_cable_drive"), version=version, step=1e-3)
    assert (PLACE in texts) == (version == "3.0")
    assert ("terminalsAndIcons/flange.png" in texts) == (version == "3.0")
    assert ("model.png" in texts) == (version == "2.0")
    # What a flange gives out is an output in both.
    root = etree.fromstring(texts["modelDescription.xml"])
    given = {v.get("name") for v in root.find("ModelVariables") if v.get("causality") == "output"}
    assert {"drum.angle", "drum.speed"} <= given


def test_outputs_of_flanges_are_shown_whatever_the_mode_of_a_switch():
    plant = with_flange_outputs(plant_of("one_sided_cable_drive"))
    assert plant.switching is not None
    count = len(plant.outputs)
    assert plant.switching.shown.size1_out(0) == plant.equations.size1_out(1) == count
    state = plant.start(plant.states) + 0.2
    parameters, inputs = plant.start(plant.parameters), [1.0, 0.5]
    modes = plant.switching.natural(0.0, state, inputs, parameters)
    shown = np.array(plant.switching.shown(0.0, state, inputs, parameters, modes)[0]).ravel()
    expected = np.array(plant.equations(0.0, state, inputs, parameters, [])[1]).ravel()
    np.testing.assert_allclose(shown, expected, rtol=1e-12)
    names = [v.name for v in plant.outputs]
    at = plant.evaluate(state, inputs)
    for name in ("drum.angle", "drum.speed"):
        assert shown[names.index(name)] == pytest.approx(at[name]) != 0.0
