"""The origin of a model in an assembly; its digest is computed where somebody asks for it."""

from __future__ import annotations

from collections.abc import Mapping
from functools import cached_property

from ..components.assembly.deck_writer import deck_digest
from ..components.assembly.named_parts import Assembly
from ..components.core.part import resolved
from ..foundation.deck import ParentDeck
from ..foundation.quantity import Quantity
from .origin import Origin


class DeclaredOrigin(Origin):
    """An origin that knows its assembly, so that it can tell the digest after numbers were changed.

    Fits and draws flatten and change models by the thousand, and ask none of them where it is from; to write
    and hash the parts takes milliseconds. So nothing is computed before it is wanted.

    Parameters
    ----------
    assembly
        What the model was flattened from.
    values
        Parameters that were changed since, in SI or as quantities, by full name; other names are passed over.
    """

    def __init__(self, assembly: Assembly, values: Mapping[str, float | Quantity] | None = None) -> None:
        # Frozen: attributes are set as dataclasses set theirs.
        object.__setattr__(self, "_assembly", assembly)
        object.__setattr__(self, "_values", values or {})

    _assembly: Assembly
    _values: Mapping[str, float | Quantity]

    @property
    def deck(self) -> str:
        """Name of the deck."""
        return self._assembly.name

    @property
    def parent(self) -> ParentDeck | None:
        """The deck that this one was made from."""
        return self._assembly.parent

    @cached_property
    def digest(self) -> str:
        """SHA-256 of the parts with the numbers of the model."""
        return deck_digest(self._assembly, self._differing)

    @property
    def changed(self) -> tuple[str, ...]:
        """Full names of the numbers that are not those of the deck."""
        return tuple(self._differing)

    @cached_property
    def numbers(self) -> Mapping[str, Quantity]:
        """All numbers by full name, as they are in the model."""
        return {**self._assembly.quantities(), **self._differing}

    @cached_property
    def _differing(self) -> Mapping[str, Quantity]:
        """Quantities that differ from those of the deck, by full name."""
        if not self._values:
            return {}
        known = self._assembly.quantities()
        given = {n: v for n, v in self._values.items() if n.partition("[")[0] in known}
        return {name: q for name, q in resolved(known, given).items() if q != known[name]}

    def with_values(self, values: Mapping[str, float | Quantity]) -> Origin:
        """Return the origin of the model with other numbers."""
        return DeclaredOrigin(self._assembly, {**self._values, **values}) if values else self
