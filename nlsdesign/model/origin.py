"""From which deck a flat model comes, and how a deck that was made from another one is called."""

from __future__ import annotations

import hashlib
import re
from collections.abc import Mapping
from dataclasses import dataclass, field, replace
from functools import cached_property

from ..components.assembly.deck_writer import deck_digest
from ..components.assembly.named_parts import Assembly
from ..components.core.part import resolved
from ..foundation.deck import ParentDeck
from ..foundation.quantity import Quantity

DIGITS = 8
"""Digits of the digest in a name."""

_ENDING = re.compile(rf"_[a-z]+_([0-9a-f]{{{DIGITS}}})\Z")


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


class DeclaredOrigin(Origin):
    """An origin that knows its assembly, so that it can tell the digest after numbers were changed.

    Fits and draws flatten and change models by the thousand, and ask none of them where it is from; to write
    and hash the parts takes milliseconds. So nothing is computed before it is wanted.

    ``assembly``: what the model was flattened from. ``values``: parameters that were changed since, in SI or
    as quantities, by full name; other names are passed over.
    """

    def __init__(self, assembly: Assembly, values: Mapping[str, float | Quantity] | None = None) -> None:
        # Frozen: attributes are set as dataclasses set theirs.
        object.__setattr__(self, "_assembly", assembly)
        object.__setattr__(self, "_values", values or {})

    _assembly: Assembly
    _values: Mapping[str, float | Quantity]

    @property
    def deck(self) -> str:  # pyrefly: ignore[bad-override]
        """Name of the deck."""
        return self._assembly.name

    @property
    def parent(self) -> ParentDeck | None:  # pyrefly: ignore[bad-override]
        """The deck that this one was made from."""
        return self._assembly.parent

    @cached_property
    def digest(self) -> str:
        """SHA-256 of the parts with the numbers of the model."""
        return deck_digest(self._assembly, self._differing)

    @property
    def changed(self) -> tuple[str, ...]:  # pyrefly: ignore[bad-override]
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


def derived(made: Assembly, declared: Assembly, change: str) -> Assembly:
    """Return an assembly under the name of the deck that it was made from, how, and the digits of its digest.

    ``made``: result of a design, a fit or a diagnosis; itself if nothing was changed. ``declared``: what it
    was made from. It becomes the parent.

    Examples
    --------
    >>> from nlsdesign.components import ROTATION, Inertia, Spring, assembly, tie
    >>> spring = tie(Spring(stiffness=2.0, domain=ROTATION), "wheel")
    >>> swing = assembly("swing", wheel=Inertia(inertia=1e-3), spring=spring)
    >>> fitted = derived(swing.with_values({"spring.stiffness": 2.1}), swing, "refitted")
    >>> fitted.name, fitted.parent.name
    ('swing_refitted_1eb4b24f', 'swing')
    """
    digest, before = deck_digest(made), deck_digest(declared)
    if digest == before:
        return made
    # The name of a deck that was derived itself does not grow: its line of parents says where it came from.
    root = _ENDING.sub("", declared.name) if declared.parent else declared.name
    parent = ParentDeck(declared.name, before, change, declared.parent)
    return replace(made, name=f"{root}_{change}_{digest[:DIGITS]}", parent=parent)


def named_by_content(made: Assembly) -> Assembly:
    """Return a derived assembly under the name that its present numbers give it.

    ``made``: changed, for instance in a source, after it got its name; one without a derived name comes back.
    """
    digits = digits_in_name(made)
    return replace(made, name=made.name.removesuffix(digits) + deck_digest(made)[:DIGITS]) if digits else made


def digits_in_name(assembly: Assembly) -> str:
    """Return the digits of a digest with which the name of a derived deck ends, empty where it has none."""
    match = _ENDING.search(assembly.name) if assembly.parent else None
    return match[1] if match else ""
