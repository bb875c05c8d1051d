"""Which deck a flat model comes from."""

from __future__ import annotations

import hashlib
from collections.abc import Mapping
from dataclasses import dataclass, field, replace

from ..foundation.deck import ParentDeck
from ..foundation.quantity import Quantity


@dataclass(frozen=True)
class Origin:
    """Name and content of the deck behind a model; what is derived from the model carries it on.

    Parameters
    ----------
    deck
        Name of the deck.
    digest
        SHA-256 of its parts as this package writes them, 64 hexadecimal digits: each number, unit, source,
        spread and the arrangement counts; comments, the order of fields and the table ``[deck]`` do not. It
        is that of the numbers in the model: where these were changed, that of a deck with the changed ones.
    parent
        The deck that this one was made from by a design, a fit or a diagnosis.
    changed
        Full names of the numbers that are no longer those of the deck; empty where the model is as declared.
    numbers
        All numbers of the deck by full name, as they are in the model.
    """

    deck: str
    digest: str
    parent: ParentDeck | None = None
    changed: tuple[str, ...] = ()
    numbers: Mapping[str, Quantity] = field(default_factory=dict, compare=False, repr=False)

    def with_values(self, values: Mapping[str, float | Quantity]) -> Origin:
        """Return the origin of the model with other numbers.

        Parameters
        ----------
        values
            Numbers in SI, or quantities, by full name of the parameter.
        """
        if not values:
            return self
        text = "\n".join([self.digest, *(f"{name} = {value!r}" for name, value in sorted(values.items()))])
        changed = tuple(dict.fromkeys([*self.changed, *values]))
        return replace(self, digest=hashlib.sha256(text.encode()).hexdigest(), changed=changed)


def common_origin(*origins: Origin | None) -> Origin | None:
    """Return the origin of a model that was made from several.

    Result: the one that all have; where they differ, one that names every deck and has the digest of none.
    ``None`` if none has one.
    """
    known = [each for each in origins if each is not None]
    if not known:
        return None
    if len(known) == len(origins) and len({each.digest for each in known}) == 1:
        return known[0]
    names = [each.deck if each is not None else "no deck" for each in origins]
    digests = "\n".join(each.digest if each is not None else "" for each in origins)
    return Origin(" and ".join(names), hashlib.sha256(digests.encode()).hexdigest())
