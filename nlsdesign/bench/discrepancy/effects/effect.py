"""A row of the catalogue: what an effect is called, where it can sit and how it edits an assembly."""

from __future__ import annotations

from collections.abc import Callable, Iterable, Sequence
from dataclasses import dataclass, field
from typing import Any, NamedTuple, TypeAlias

from ....components import Assembly
from .candidate import Candidate, Unknown


class Edit(NamedTuple):
    """An assembly with an effect in it, and the numbers that the effect leaves open.

    ``more`` are further fields of :class:`Candidate`, such as how it is fitted.
    """

    assembly: Assembly
    unknowns: tuple[Unknown, ...]
    more: dict[str, Any] = {}  # noqa: RUF012 - a named tuple's default, never written to


Places: TypeAlias = Callable[[Assembly], Iterable[str]]
"""From an assembly to the paths of the parts that can have an effect."""

Edits: TypeAlias = Callable[[Assembly, str], Iterable[Edit]]
"""From an assembly and a path to the assemblies with the effect there; several where it has several forms."""


@dataclass(frozen=True)
class Form:
    """One form of an effect: friction of a turning body and of a sliding one are two forms of one effect.

    Parameters
    ----------
    places
        Where it can sit.
    edits
        What it does there.
    signature
        What it leaves in records, in words.
    source
        Where the law comes from.
    brings
        The phenomenon of :attr:`Part.phenomena` that it adds: a place that has it already is left out. Empty
        where a machine can have it several times.
    """

    places: Places
    edits: Edits
    signature: str
    source: str
    brings: str = ""


@dataclass(frozen=True)
class Effect:
    """One effect of the catalogue; calling it gives the ways in which an assembly can have it.

    Parameters
    ----------
    identifier
        Name in verdicts and of the effect in this room.
    description
        What it is, in words.
    rank
        Place in the catalogue, lowest first. Of two effects that the records cannot tell apart the one with
        the lower rank is named, so what is common in machines stands before what is rare.
    forms
        Tried in written order.
    """

    identifier: str
    description: str
    rank: int
    forms: tuple[Form, ...]
    __name__: str = field(init=False, repr=False, default="")

    def __post_init__(self) -> None:
        object.__setattr__(self, "__name__", self.identifier)

    def __call__(self, assembly: Assembly) -> Sequence[Candidate]:
        """Return one candidate for each form, place and edit.

        ``assembly``: as declared; a place that has the phenomenon already is left out.
        """
        return [
            Candidate(
                effect=self.identifier,
                location=site,
                assembly=edit.assembly,
                unknowns=edit.unknowns,
                signature=form.signature,
                source=form.source,
                **edit.more,
            )
            for form in self.forms
            for site in form.places(assembly)
            if not (form.brings and assembly.has(site, form.brings))
            for edit in form.edits(assembly, site)
        ]
