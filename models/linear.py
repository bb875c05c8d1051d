"""The same drivetrain with a linear torsion spring, as the paper compares it."""

from __future__ import annotations

from nlsdesign.components import (
    Assembly,
    CoulombFriction,
    Encoder,
    Fixed,
    GearedMotor,
    TorsionDashpot,
    TorsionSpring,
    tie,
)
from nlsdesign.components.assembly.deck_writer import numbers_of, require_same_numbers
from nlsdesign.components.assembly.named_parts import assembly
from nlsdesign.deck import Deck


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
    found = assembly(
        deck.name,
        description=deck.description,
        motor=GearedMotor(**numbers_of(deck, "motor", GearedMotor)),
        load=Fixed(),
        spring=tie(TorsionSpring(**numbers_of(deck, "spring", TorsionSpring)), "motor", "load"),
        bearing=tie(TorsionDashpot(**numbers_of(deck, "bearing", TorsionDashpot)), "motor"),
        dry_friction=tie(CoulombFriction(**numbers_of(deck, "dry_friction", CoulombFriction)), "motor"),
        motor_encoder=Encoder(of="motor.angle", **numbers_of(deck, "motor_encoder", Encoder)),
    )
    return require_same_numbers(found, deck)
