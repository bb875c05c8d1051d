"""The published actuator: motor, two-sided cam, two rubber elements, load side held by the bench."""

from __future__ import annotations

from nlsdesign.components import (
    Assembly,
    CoulombFriction,
    Dashpot,
    Encoder,
    Fixed,
    GearedMotor,
    LinearElastic,
    Specimen,
    StrainStiffening,
    Through,
    TwoSidedCam,
    ViscousMaterial,
    series,
    specimen,
    through,
    tie,
)
from nlsdesign.components.assembly.deck_writer import numbers_of, require_same_numbers
from nlsdesign.components.assembly.named_parts import assembly
from nlsdesign.foundation.deck import Deck


def cam_rubber_actuator(deck: Deck) -> Assembly:
    """Return the actuator of Austin, Schepelmann and Geyer (IROS 2015).

    Parameters
    ----------
    deck
        Numbers of all parts, for instance ``load_deck("austin2015_as_printed")``.

    Raises
    ------
    NlsError
        If a number is missing, or the deck declares something that this model does not have; ``declare``
        takes such a deck as it stands.

    Examples
    --------
    >>> from nlsdesign.foundation.deck import load_deck
    >>> [name for name, _ in cam_rubber_actuator(load_deck("austin2015_as_printed")).parts]
    ['motor', 'load', 'spring', 'bearing', 'dry_friction', 'motor_encoder']
    """
    rubber = specimen(
        stiff=StrainStiffening(**numbers_of(deck, "spring.rubber.stiff", StrainStiffening)),
        relaxing=series(
            spring=LinearElastic(**numbers_of(deck, "spring.rubber.relaxing.spring", LinearElastic)),
            dashpot=ViscousMaterial(**numbers_of(deck, "spring.rubber.relaxing.dashpot", ViscousMaterial)),
        ),
        **numbers_of(deck, "spring.rubber", Specimen),
    )
    cam = TwoSidedCam(**numbers_of(deck, "spring.cam", TwoSidedCam))
    actuator = assembly(
        deck.name,
        description=deck.description,
        motor=GearedMotor(**numbers_of(deck, "motor", GearedMotor)),
        load=Fixed(),
        spring=tie(through(cam, rubber=rubber, **numbers_of(deck, "spring", Through)), "motor", "load"),
        bearing=tie(Dashpot(**numbers_of(deck, "bearing", Dashpot)), "motor"),
        dry_friction=tie(CoulombFriction(**numbers_of(deck, "dry_friction", CoulombFriction)), "motor"),
        motor_encoder=Encoder(of="motor.angle", **numbers_of(deck, "motor_encoder", Encoder)),
    )
    return require_same_numbers(actuator, deck)
