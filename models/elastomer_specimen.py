"""A strip of elastomer in a tensile machine, without motor or cam: grip, strip, clamp, load cell."""

from __future__ import annotations

from nlsdesign.components import (
    TRANSLATION,
    Assembly,
    Driven,
    Fixed,
    ForceSensor,
    InextensibleCable,
    LinearElastic,
    Series,
    Specimen,
    ViscousMaterial,
    series,
    specimen,
    tie,
)
from nlsdesign.components.assembly.deck_writer import numbers_of, require_same_numbers
from nlsdesign.components.assembly.named_parts import assembly
from nlsdesign.foundation.deck import Deck

_RUBBER = "strip.rubber"


def elastomer_specimen(deck: Deck) -> Assembly:
    """Return a strip with two relaxation times between a driven grip and a clamp that stands still.

    The strip buckles instead of pushing: on the way back it hangs slack until the grip reaches the length at
    which it rests by then.

    Parameters
    ----------
    deck
        Numbers of all parts, for instance ``load_deck("vhb4910_specimen")``.

    Raises
    ------
    NlsError
        If a number is missing, or the deck declares something that this model does not have.

    Examples
    --------
    >>> from nlsdesign.foundation.deck import load_deck
    >>> [name for name, _ in elastomer_specimen(load_deck("vhb4910_specimen")).parts]
    ['grip', 'clamp', 'strip', 'load_cell']
    """
    rubber = specimen(
        elastic=LinearElastic(**numbers_of(deck, f"{_RUBBER}.elastic", LinearElastic)),
        fast=_relaxing(deck, f"{_RUBBER}.fast"),
        slow=_relaxing(deck, f"{_RUBBER}.slow"),
        **numbers_of(deck, _RUBBER, Specimen),
    )
    tester = assembly(
        deck.name,
        description=deck.description,
        grip=Driven(domain=TRANSLATION),
        clamp=Fixed(domain=TRANSLATION),
        strip=tie(InextensibleCable(members=(("rubber", rubber),)), "grip", "clamp"),
        load_cell=ForceSensor(of="strip.force", **numbers_of(deck, "load_cell", ForceSensor)),
    )
    return require_same_numbers(tester, deck)


def _relaxing(deck: Deck, path: str) -> Series:
    return series(
        spring=LinearElastic(**numbers_of(deck, f"{path}.spring", LinearElastic)),
        dashpot=ViscousMaterial(**numbers_of(deck, f"{path}.dashpot", ViscousMaterial)),
    )
