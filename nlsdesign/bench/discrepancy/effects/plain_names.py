"""Effects and places in words, for people who do not know the identifiers of the catalogue."""

from __future__ import annotations

import re

from ....components import Assembly, Element, Tie
from . import catalogue

_PERSONS = frozenset({"coulomb", "stribeck"})
"""Names of persons keep their capital."""
_PHRASE = re.compile(r"(?:An? |The )?(?P<phrase>[^,.:;=(]+?)(?=[,.:;=(]|$)")
"""The first phrase of a description, without its article."""


def title(identifier: str) -> str:
    """Return the name of an effect in words.

    Examples
    --------
    >>> title("second_relaxation"), title("coulomb_friction")
    ('second relaxation', 'Coulomb friction')
    """
    return " ".join(each.capitalize() if each in _PERSONS else each for each in identifier.split("_"))


def capitalised(text: str) -> str:
    """Return a text with its first letter as a capital, the others as they are."""
    return text[:1].upper() + text[1:]


def place_in_words(assembly: Assembly, location: str) -> str:
    """Return a place with its preposition, such as ``in the rubber`` or ``at the motor``.

    ``assembly``: holds the part; a path that it does not have is put into words alone. ``location``: path of
    a part. Where another part has the same name, the part around both is said as well.
    """
    parts = dict(assembly.walk())
    steps = location.split(".")
    count = next(
        (n for n in range(1, len(steps)) if sum(_ends_with(path, steps[-n:]) for path in parts) <= 1),
        len(steps),
    )
    inside = location in parts and isinstance(_law(parts[location]), Element)
    names = " of the ".join(step.replace("_", " ") for step in reversed(steps[-count:]))
    return f"{'in' if inside else 'at'} the {names}"


def kind_in_words(assembly: Assembly, location: str) -> str:
    """Return what a part is, from the description of its law; empty for a path without a part."""
    parts = dict(assembly.walk())
    described = type(_law(parts[location])).__doc__ if location in parts else None
    first = _PHRASE.match(described or "")
    text = first["phrase"] if first else ""
    return text[:1].lower() + text[1:]


def effect_in_words(assembly: Assembly, identifier: str, location: str) -> str:
    """Return an effect with its place, such as ``second relaxation in the rubber``.

    ``location``: path of the part. It is left out where the effect has its name already.
    """
    named, place = title(identifier), place_in_words(assembly, location)
    part = place.partition(" the ")[2]
    return named if named.startswith(part) else f"{named} {place}"


def simpler_forms(assembly: Assembly, identifier: str) -> tuple[str, ...]:
    """Return the identifiers of the effects of which an effect is a richer form.

    ``identifier``: of the catalogue; any other has none.
    """
    row = next((each for each in catalogue() if each.__name__ == identifier), None)
    candidates = row(assembly) if row is not None else ()
    return tuple(dict.fromkeys(simple for each in candidates for simple in each.simpler))


def _ends_with(path: str, last: list[str]) -> bool:
    return path.split(".")[-len(last) :] == last


def _law(part: object) -> object:
    return part.element if isinstance(part, Tie) else part
