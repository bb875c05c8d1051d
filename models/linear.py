"""The same drivetrain with a linear torsion spring, as the paper compares it."""

from __future__ import annotations

from nlsdesign.components import (
    Assembly,
    CoulombFriction,
    Dashpot,
    Encoder,
    Fixed,
    GearedMotor,
    Spring,
    tie,
)
from nlsdesign.components.assembly.deck_writer import numbers_of, require_same_numbers
from nlsdesign.components.assembly.named_parts import assembly
from nlsdesign.foundation.deck import Deck


def linear_spring_actuator(deck: Deck) -> Assembly:
    """Return an actuator with a linear spring between motor and load.

    Parameters
    ----------
    deck
        Numbers of all parts, for instance ``load_deck("austin2015_soft_spring")``.

    Raises
    ------
    NlsError
        If a number is missing, or the deck declares something that this model does not have.
    """
    actuator = assembly(
        deck.name,
        description=deck.description,
        motor=GearedMotor(**numbers_of(deck, "motor", GearedMotor)),
        load=Fixed(),
        spring=tie(Spring(**numbers_of(deck, "spring", Spring)), "motor", "load"),
        bearing=tie(Dashpot(**numbers_of(deck, "bearing", Dashpot)), "motor"),
        dry_friction=tie(CoulombFriction(**numbers_of(deck, "dry_friction", CoulombFriction)), "motor"),
        motor_encoder=Encoder(of="motor.angle", **numbers_of(deck, "motor_encoder", Encoder)),
    )
    return require_same_numbers(actuator, deck)
