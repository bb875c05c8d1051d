"""The smallest system around a part, and a name for it; the documentation shows these systems as decks."""

from __future__ import annotations

from nlsdesign.components import (
    MATERIAL,
    ROTATION,
    TRANSLATION,
    Assembly,
    Cam,
    DrivePart,
    Element,
    Encoder,
    EncoderOffset,
    GearedMotor,
    Inertia,
    Mass,
    Part,
    Pulley,
    ResistiveMotor,
    Sensor,
    Spring,
    Tie,
    specimen,
    through,
    tie,
)
from nlsdesign.components.assembly.named_parts import assembly
from nlsdesign.components.core.part_numbers import readings
from nlsdesign.components.mechanics.bodies import Body
from nlsdesign.components.mechanics.controllers import Controller
from nlsdesign.components.mechanics.gear import Transmission

EXAMPLES: list[Part] = []
"""None here; every module of this folder has the list."""


def around(part: Part) -> Assembly:
    """The smallest system in which the part does something."""
    if isinstance(part, Encoder | EncoderOffset) and part.domain == TRANSLATION:
        spring = tie(Spring(stiffness=2500.0), "carriage")
        return assembly("bench", carriage=Mass(mass=0.4), spring=spring, part=part)
    if isinstance(part, Sensor):
        spring = tie(through(Pulley(radius=0.01), rubber=Spring(stiffness=2500.0)), "motor")
        motor = GearedMotor(inertia=6e-4, gear_ratio=4.0, torque_constant=0.055)
        return assembly("bench", motor=motor, spring=spring, part=part)
    if isinstance(part, Body):
        spring = (
            Spring(stiffness=3.4, domain=ROTATION) if part.domain == ROTATION else Spring(stiffness=2500.0)
        )
        other = Inertia(inertia=6e-4) if part.domain == ROTATION else Mass(mass=0.4)
        return assembly("bench", part=part, other=other, spring=tie(spring, "part", "other"))
    if isinstance(part, Controller):
        numbers = {"inertia": 6e-4, "torque_constant": 0.5, "resistance": 4.0, "voltage_limit": 24.0}
        motor = ResistiveMotor(**numbers, chain=(("part", part),))
        return assembly("bench", motor=motor, spring=tie(Spring(stiffness=3.4, domain=ROTATION), "motor"))
    if isinstance(part, DrivePart):
        motor = GearedMotor(inertia=6e-4, gear_ratio=4.0, torque_constant=0.055, chain=(("part", part),))
        return assembly("bench", motor=motor, spring=tie(Spring(stiffness=3.4, domain=ROTATION), "motor"))
    if isinstance(part, Transmission):
        kinds = {ROTATION: Inertia(inertia=6e-4), TRANSLATION: Mass(mass=0.4)}
        bodies = {name: kinds[domain] for name, domain in zip(part.between, part.joins, strict=True)}
        return assembly("bench", **bodies, part=part)
    if isinstance(part, Tie):
        return assembly("bench", shaft=Inertia(inertia=6e-4), part=part)
    if isinstance(part, Cam):
        return around(through(part, rubber=Spring(stiffness=2500.0)))
    assert isinstance(part, Element), f"{type(part).__name__} is no kind of component that is known here"
    if part.domain == MATERIAL:
        return around(specimen(area=1e-4, rest_length=0.0125, law=part))
    body = Inertia(inertia=6e-4) if part.domain == ROTATION else Mass(mass=0.4)
    return assembly("bench", body=body, part=tie(part, "body"))


def named(part: Part) -> str:
    """Class, readings and domain of an example, as its name."""
    held = [type(getattr(part, field)).__name__ for field in readings(type(part))]
    domain = (
        [part.domain.name]
        if isinstance(part, Element | Body | Encoder | EncoderOffset) and len(part.domains()) > 1
        else []
    )
    return "-".join([type(part).__name__, *held, *domain])
