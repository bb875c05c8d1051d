"""What an effect of the catalogue is: a row with a name, and how it edits an assembly wherever it can sit."""

from __future__ import annotations

from collections.abc import Callable, Iterable, Mapping, Sequence
from dataclasses import dataclass, field, fields, replace
from typing import Any, NamedTuple, TypeAlias

from ....components import Assembly, Element, Part
from ....components.sensing.sensors import Sensor
from ....foundation.quantity import Quantity
from ..fitting import Strategy

SOURCE = "fitted to bench records"


def number(value: float, unit: str) -> Quantity:
    """Return a number in SI that a fit is going to change."""
    return Quantity(value, unit, SOURCE)


@dataclass(frozen=True)
class Unknown:
    """A number that an effect brings along.

    Parameters
    ----------
    name
        Full name in the edited assembly.
    starts
        Where fits begin; several where the cost has several minima.
    lower, upper
        Bounds. Where both are positive the number is fitted on a logarithmic scale.
    of
        Size in which starts and bounds are counted, as :class:`~.sizes.Sizes` reads it: for instance a signal
        of the declared model, for its largest value on the records. Empty where they are in SI, as of angles,
        shares and exponents, which have a size by themselves.
    null
        Value at which the effect vanishes: 0, 1 for a gain, infinity for a stiffness in series; ``None`` for
        a number that only shapes the effect, such as a time constant or an order.
    beyond
        Size below which something plainer explains the number, which is then a bound too; empty for none. A
        number of either sign keeps the sign of its start then.
    above
        Name of a number of the edited assembly of which it is at least three times as much: a speed at which
        friction falls lies above the width of its sign. Empty where there is none.
    limiting
        Whether the effect has a limiting form at both bounds, such as a corner that is as sharp as it gets:
        then standing there is no objection.
    """

    name: str
    starts: tuple[float, ...]
    lower: float
    upper: float
    of: str = ""
    null: float | None = 0.0
    beyond: str = ""
    above: str = ""
    limiting: bool = False


@dataclass(frozen=True)
class Candidate:
    """One effect at one place of one assembly.

    Parameters
    ----------
    effect
        Identifier, for instance ``"coulomb_friction"``.
    location
        Path of the part that has the effect.
    assembly
        The assembly with the effect, its unknowns at some value.
    unknowns
        Numbers to fit.
    signature
        What it leaves in records, in words.
    source
        Where the law comes from.
    strategy
        Where its fits begin.
    explains_lag
        Whether readings that lag what they read are what it leaves.
    bends_reading
        Whether it is a fault of a sensor that changes a reading over its own value or over time, as a law of
        what is read may do.
    simpler
        Identifiers of the effects of which this one is a richer form, so that it must predict better.
    acts_in
        Names of the blocks in which its numbers stand; empty until it is fitted.
    """

    effect: str
    location: str
    assembly: Assembly
    unknowns: tuple[Unknown, ...]
    signature: str
    source: str
    strategy: Strategy = field(default_factory=Strategy)
    explains_lag: bool = False
    bends_reading: bool = False
    simpler: tuple[str, ...] = ()
    acts_in: frozenset[str] = frozenset()


EffectFunction: TypeAlias = Callable[[Assembly], Sequence[Candidate]]
"""A function from an assembly to the ways in which it can have the effect; none where it cannot."""


def wrapped(
    assembly: Assembly,
    path: str,
    name: str,
    wrapper: Callable[[str, Element], Element],
    *,
    read_outside: bool = False,
) -> Assembly:
    """Return the assembly with an element inside a wrapper; sensors go on reading what they read.

    ``path``: path of the element, for instance ``"spring.rubber"``. A tie keeps its name and takes the
    wrapper; any other wrapper takes its own name beside the former neighbours. ``name``: name of the wrapper;
    for a tie, of the element inside.
    """
    owner, _, last = path.rpartition(".")
    old = assembly.element(path)
    if not owner:
        outer, inner = path, f"{path}.{name}"
        edited = assembly.with_part(path, wrapper(name, old))
    else:
        outer, inner = f"{owner}.{name}", f"{owner}.{name}.{last}"
        holder = assembly[owner]
        children = {
            (name if key == last else key): (wrapper(last, old) if key == last else part)
            for key, part in holder.children().items()
        }
        edited = assembly.with_part(owner, holder.with_children(children))
    own = (old.domain.motion, old.domain.rate, old.domain.effort) if read_outside else ()
    renamed = {f"{path}.{signal}": f"{outer}.{signal}" for signal in own}
    return _reading_on(edited, path, inner, renamed)


def _reading_on(assembly: Assembly, old: str, new: str, renamed: Mapping[str, str]) -> Assembly:
    parts = [
        (
            n,
            replace(p, of=renamed.get(p.of, new + p.of[len(old) :]))
            if isinstance(p, Sensor) and p.of.startswith(old + ".")
            else p,
        )
        for n, p in assembly.parts
    ]
    return replace(assembly, parts=tuple(parts))


def free_name(assembly: Assembly, name: str) -> str:
    """Return a name that no part at the top has yet.

    ``name``: the name wanted; a number is added where it is taken.
    """
    taken, number, free = {n for n, _ in assembly.parts}, 2, name
    while free in taken:
        free, number = f"{name}_{number}", number + 1
    return free


def free_inside(part: Part, name: str) -> str:
    """Return a name that no part inside another has yet.

    ``name``: the name wanted; a number is added where it is taken.
    """
    taken, number, free = set(part.children()), 2, name
    while free in taken:
        free, number = f"{name}_{number}", number + 1
    return free


def numbers_of(part: Part) -> dict[str, Any]:
    """Return the fields of a part, to make a part of a more special kind from it."""
    return {field.name: getattr(part, field.name) for field in fields(part)}


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
