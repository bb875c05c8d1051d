"""A deck that was made from another one: its name says from which and how, and changes with its content."""

from __future__ import annotations

import re
from dataclasses import replace

from ..components.assembly.deck_writer import deck_digest
from ..components.assembly.named_parts import Assembly
from ..foundation.deck import ParentDeck

DIGITS = 8
"""Digits of the digest in a name."""

_ENDING = re.compile(rf"_[a-z]+_([0-9a-f]{{{DIGITS}}})\Z")


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
