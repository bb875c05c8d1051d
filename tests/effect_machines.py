"""Machines on which effects of the catalogue are offered, one at least for each effect."""

from __future__ import annotations

from collections.abc import Callable

import pytest

from nlsdesign.bench.discrepancy.effects import Effect
from nlsdesign.components import (
    ROTATION,
    TRANSLATION,
    Assembly,
    CoulombFriction,
    CurrentSensor,
    Dashpot,
    Driven,
    Encoder,
    Fixed,
    ForceSensor,
    Gear,
    GearedMotor,
    GravityLoad,
    HorizontalTorque,
    Inertia,
    Mass,
    ResistiveMotor,
    Spring,
    TorqueSensor,
    tie,
)
from nlsdesign.components.assembly.deck_writer import declare
from nlsdesign.components.assembly.named_parts import assembly
from nlsdesign.foundation.deck import load_deck
from tests.rig import EFFECTS, LATER_EFFECTS

KNOWN = {*EFFECTS, *LATER_EFFECTS, "constant_force", "drivetrain_resonance", "command_compression"} - {"none"}
"""Effects of which tests say where they are offered: those of the rig, and three that it does not have.

An effect that is added to the catalogue needs no line here.
"""


def joint() -> Assembly:
    """A geared joint with a weight and a torque transducer before an elastic link."""
    return assembly(
        "joint",
        motor=GearedMotor(inertia=0.02, gear_ratio=50.0, torque_constant=0.03),
        base=Fixed(),
        link=tie(Spring(stiffness=80.0, domain=ROTATION), "motor", "base"),
        oil=tie(Dashpot(damping=0.01, domain=ROTATION), "motor"),
        encoder=Encoder(of="motor.angle", quantum=1e-4),
        ammeter=CurrentSensor(of="motor.current"),
        cell=TorqueSensor(of="link.torque"),
    )


def servo() -> Assembly:
    """A motor at a voltage that turns a weight, and drives a wheel through a shaft."""
    weight = HorizontalTorque(horizontal_torque=0.3)
    return assembly(
        "servo",
        motor=ResistiveMotor(inertia=2e-3, torque_constant=0.5, resistance=4.0, voltage_limit=7.4),
        arm=tie(GravityLoad(weight=weight), "motor"),
        encoder=Encoder(of="motor.angle", quantum=1e-3),
    )


def slide() -> Assembly:
    """A mass on a spring with a load cell, pushed from outside."""
    return assembly(
        "slide",
        carriage=Mass(mass=2.0),
        wall=Fixed(domain=TRANSLATION),
        spring=tie(Spring(stiffness=900.0), "carriage", "wall"),
        cell=ForceSensor(of="spring.force"),
    )


def tensile() -> Assembly:
    """A spring that a testing machine strains."""
    return assembly(
        "tensile",
        grip=Driven(domain=TRANSLATION),
        clamp=Fixed(domain=TRANSLATION),
        spring=tie(Spring(stiffness=900.0), "grip", "clamp"),
        cell=ForceSensor(of="spring.force"),
    )


def torsion() -> Assembly:
    """A torsion bar that a testing machine twists."""
    return assembly(
        "torsion",
        head=Driven(domain=ROTATION),
        foot=Fixed(),
        bar=tie(Spring(stiffness=4.0, domain=ROTATION), "head", "foot"),
        cell=TorqueSensor(of="bar.torque"),
    )


def wheels() -> Assembly:
    """Two wheels, one geared to the other, one spring, and friction of a seal."""
    return assembly(
        "wheels",
        first=Inertia(inertia=1e-3),
        second=Inertia(inertia=2e-3),
        gear=Gear(between=("first", "second"), ratio=5.0),
        spring=tie(Spring(stiffness=2.0, domain=ROTATION), "second"),
        seal=tie(CoulombFriction(sliding_effort=0.1, domain=ROTATION).smooth(), "first"),
    )


def elastic() -> Assembly:
    """A motor that turns an arm through a shaft, with an encoder on both."""
    return assembly(
        "elastic",
        motor=GearedMotor(inertia=0.02, gear_ratio=50.0, torque_constant=0.03),
        arm=Inertia(inertia=0.3),
        shaft=tie(Spring(stiffness=80.0, domain=ROTATION), "motor", "arm"),
        encoder=Encoder(of="motor.angle", quantum=1e-4),
        outer=Encoder(of="arm.angle", quantum=1e-4),
        ammeter=CurrentSensor(of="motor.current"),
    )


def train() -> Assembly:
    """Two masses with a spring between them and a scale beside each."""
    return assembly(
        "train",
        front=Mass(mass=2.0),
        back=Mass(mass=3.0),
        coupling=tie(Spring(stiffness=900.0), "front", "back"),
        first=Encoder(of="front.position", quantum=1e-6, domain=TRANSLATION),
        second=Encoder(of="back.position", quantum=1e-6, domain=TRANSLATION),
    )


MACHINES: dict[str, Callable[[], Assembly]] = {
    "rig": lambda: declare(load_deck("test_rig")),
    "strip": lambda: declare(load_deck("vhb4910_specimen")),
    "drive": lambda: declare(load_deck("janot2019_positioning_drive")),
    "cable": lambda: declare(load_deck("one_sided_cable_drive")),
    "joint": joint,
    "servo": servo,
    "slide": slide,
    "tensile": tensile,
    "torsion": torsion,
    "wheels": wheels,
    "elastic": elastic,
    "train": train,
}


def bare(machine: Assembly) -> Assembly:
    """The machine without what may be declared of an effect already."""
    names = [
        n for n, p in machine.parts if getattr(getattr(p, "element", None), "phenomena", set()) & DECLARED
    ]
    for name in names:
        machine = machine.without_part(name)
    return machine


DECLARED = {"dry friction", "constant load", "gravity"}


def machine_for(effect: Effect) -> Assembly:
    """Return the first machine on which an effect is offered, with what it declares or without."""
    pairs = ((made(), bare(made())) for made in MACHINES.values())
    able = next((machine for pair in pairs for machine in pair if effect(machine)), None)
    if able is None:
        pytest.fail(
            f"no machine of tests/effect_machines.py can have '{effect.__name__}': "
            "add one that can to MACHINES"
        )
    return able
