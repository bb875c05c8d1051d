"""A drive that pulls rubber to one side: motor, lossy gear, drum, cable around a guide, load side held."""

from __future__ import annotations

from nlsdesign.components import (
    Assembly,
    CapstanFriction,
    CurrentDrivenMotor,
    CurrentSensor,
    Dashpot,
    Encoder,
    Fixed,
    ForceSensor,
    Inertia,
    InextensibleCable,
    LinearElastic,
    LossyGear,
    OneSidedCam,
    SampleAndHold,
    Specimen,
    StrainStiffening,
    Through,
    ViscousMaterial,
    series,
    specimen,
    through,
    tie,
)
from nlsdesign.components.assembly.deck_writer import numbers_of, require_same_numbers
from nlsdesign.components.assembly.named_parts import assembly
from nlsdesign.foundation.deck import Deck

RUBBER = "spring.cable.rope.rubber"


def one_sided_cable_drive(deck: Deck) -> Assembly:
    """Return a drive whose cable pulls for positive angles of the drum only.

    Motor and drum are one state pair, joined by the gear; the cable goes slack when the drum turns back
    faster than the rubber recovers.

    Parameters
    ----------
    deck
        Numbers of all parts, for instance ``load_deck("one_sided_cable_drive")``.

    Raises
    ------
    NlsError
        If a number is missing, or the deck declares something that this model does not have.

    Examples
    --------
    >>> from nlsdesign.foundation.deck import load_deck
    >>> [name for name, _ in one_sided_cable_drive(load_deck("one_sided_cable_drive")).parts][:5]
    ['motor', 'drum', 'gear', 'load', 'spring']
    """
    cable = CapstanFriction(
        members=(("rope", InextensibleCable(members=(("rubber", _rubber(deck)),))),),
        **numbers_of(deck, "spring.cable", CapstanFriction),
    )
    cam = OneSidedCam(**numbers_of(deck, "spring.cam", OneSidedCam))
    gear = LossyGear(between=("motor", "drum"), **numbers_of(deck, "gear", LossyGear))
    sampling = SampleAndHold(of="motor.angle", **numbers_of(deck, "motor_encoder_sampling", SampleAndHold))
    encoder = Encoder(of="motor_encoder_sampling.reading", **numbers_of(deck, "motor_encoder", Encoder))
    ammeter = CurrentSensor(of="motor.winding_current", **numbers_of(deck, "current_sensor", CurrentSensor))
    cell = numbers_of(deck, "load_cell", ForceSensor)
    actuator = assembly(
        deck.name,
        description=deck.description,
        motor=CurrentDrivenMotor(**numbers_of(deck, "motor", CurrentDrivenMotor)),
        drum=Inertia(**numbers_of(deck, "drum", Inertia)),
        gear=gear,
        load=Fixed(),
        spring=tie(through(cam, cable=cable, **numbers_of(deck, "spring", Through)), "drum", "load"),
        bearing=tie(Dashpot(**numbers_of(deck, "bearing", Dashpot)), "drum"),
        motor_encoder_sampling=sampling,
        motor_encoder=encoder,
        current_sensor=ammeter,
        load_cell=ForceSensor(of="spring.cable.rope.force", **cell),
    )
    return require_same_numbers(actuator, deck)


def _rubber(deck: Deck) -> Specimen:
    inside = f"{RUBBER}.relaxing"
    return specimen(
        stiff=StrainStiffening(**numbers_of(deck, f"{RUBBER}.stiff", StrainStiffening)),
        relaxing=series(
            spring=LinearElastic(**numbers_of(deck, f"{inside}.spring", LinearElastic)),
            dashpot=ViscousMaterial(**numbers_of(deck, f"{inside}.dashpot", ViscousMaterial)),
        ),
        **numbers_of(deck, RUBBER, Specimen),
    )
