"""A positioning drive along a line, without any spring: motor and screw, moving mass, friction, offset."""

from __future__ import annotations

from nlsdesign.components import Assembly, ConstantLoad, CoulombFriction, Dashpot, LinearDrive, tie
from nlsdesign.components.assembly.deck_writer import numbers_of, require_same_numbers
from nlsdesign.components.assembly.named_parts import assembly
from nlsdesign.foundation.deck import Deck


def positioning_drive(deck: Deck) -> Assembly:
    """Return the drive of the EMPS benchmark: m·v̇ = g·V − b·v − F_c·sign(v) − F₀.

    Parameters
    ----------
    deck
        Numbers of all parts, for instance ``load_deck("janot2019_positioning_drive")``.

    Raises
    ------
    NlsError
        If a number is missing, or the deck declares something that this model does not have.

    Examples
    --------
    >>> from nlsdesign.foundation.deck import load_deck
    >>> [name for name, _ in positioning_drive(load_deck("janot2019_positioning_drive")).parts]
    ['carriage', 'guide', 'dry_friction', 'offset']
    """
    drive = assembly(
        deck.name,
        description=deck.description,
        carriage=LinearDrive(**numbers_of(deck, "carriage", LinearDrive)),
        guide=tie(Dashpot(**numbers_of(deck, "guide", Dashpot)), "carriage"),
        dry_friction=tie(CoulombFriction(**numbers_of(deck, "dry_friction", CoulombFriction)), "carriage"),
        offset=tie(ConstantLoad(**numbers_of(deck, "offset", ConstantLoad)), "carriage"),
    )
    return require_same_numbers(drive, deck)
