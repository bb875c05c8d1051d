"""An assembly: bodies, elements tied and gears set between them, and sensors, all by name.

What sensors read, and what is wrong with it as far as it can be seen without equations.
"""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass, replace
from typing import Any

from ...foundation.deck import ParentDeck
from ...foundation.errors import ArrangementError, NlsError, unknown_name, visible
from ...foundation.quantity import Quantity
from ..core.element import Element, Parallel, Tie
from ..core.part import LONGEST, Part, check_names, find, quantities, replaced, resolved, walk, with_values
from ..mechanics.bodies import Body, Fixed
from ..mechanics.gear import Transmission, transmission_problems
from ..sensing.sensors import Sensor
from .circuit import NotebookCircuits, draw


def sensors_behind(sensors: Mapping[str, Sensor], signal: str) -> tuple[str, tuple[str, ...]]:
    """Return what a signal shows, and the sensors between, the one that gives the reading first.

    ``signal``: full name; a signal that is not the reading of a sensor shows itself.
    """
    readings = {f"{name}.reading": name for name in sensors}
    chain: list[str] = []
    while signal in readings:
        name = readings[signal]
        if name in chain:
            sensor_of = {f"{other}.reading": other for other in sensors}
            way, at = [name], sensor_of[sensors[name].of]
            while at != name:
                way.append(at)
                at = sensor_of[sensors[at].of]
            raise ArrangementError(
                f"sensor '{name}' reads '{sensors[name].of}'",
                "which reads itself in a circle: " + " ◁ ".join([*way, name]),
                next_step="let one of them read a signal of a body, a tie or a gear",
            )
        chain.append(name)
        signal = sensors[name].of
    return signal, tuple(chain)


def chain_problems(parts: Sequence[tuple[str, Part]]) -> Iterator[tuple[str, NlsError]]:
    """Yield the chains of sensors that never reach a signal, with the name of the sensor."""
    sensors = {name: part for name, part in parts if isinstance(part, Sensor)}
    order = list(sensors)
    for place, (name, sensor) in enumerate(sensors.items()):
        following = [other for other in order[place:] if sensor.of == f"{other}.reading"]
        if not following:
            continue
        try:
            sensors_behind(sensors, f"{name}.reading")
        except ArrangementError as error:
            yield name, error
            continue
        yield (
            name,
            ArrangementError(
                f"sensor '{name}' reads '{sensor.of}'",
                "which is written behind it; a sensor reads what stands before it",
                next_step=f"write '{following[0]}' before '{name}'",
            ),
        )


def source_problems(
    parts: Sequence[tuple[str, Part]], unsure: Sequence[str] = ()
) -> Iterator[tuple[str, NlsError]]:
    """Yield the sensors that read what no part can have, with the name of the sensor.

    ``unsure``: names of parts that are there but could not be read; nothing is said of sensors that read
    them.
    """
    paths = {path: inner for name, part in parts for path, inner in walk(part, name)}
    for name, sensor in parts:
        if not isinstance(sensor, Sensor) or sensor.of.partition(".")[0] in unsure:
            continue
        if sensor.of in paths:
            proposed = _signals(sensor.of, paths[sensor.of])
            yield (
                name,
                ArrangementError(
                    f"sensor '{name}' reads '{sensor.of}'",
                    "which is a part, not a signal",
                    did_you_mean=proposed[0] if proposed else None,
                    next_step="name one of its signals",
                ),
            )
        elif sensor.of.rpartition(".")[0] not in paths:
            known = [signal for path, part in paths.items() for signal in _signals(path, part)]
            yield name, unknown_name(f"sensor '{name}' reads", sensor.of, known)


def _signals(path: str, part: Part) -> list[str]:
    """Return signals that a part has by its kind."""
    inner = part.element if isinstance(part, Tie) else part
    if isinstance(inner, Sensor):
        return [f"{path}.reading"]
    if isinstance(inner, Body):
        return [f"{path}.{own}" for own in inner.motion_names]
    if isinstance(inner, Element):
        return [f"{path}.{own}" for own in (inner.domain.effort, inner.domain.motion)]
    return []


@dataclass(frozen=True)
class Assembly(NotebookCircuits):
    """Named parts that make one system.

    Parameters
    ----------
    name
        Short name; also that of generated code.
    parts
        Pairs of name and body, gear, tie or sensor, in written order.
    description
        One sentence.
    parent
        The deck that these parts were made from by a design, a fit or a diagnosis; ``None`` where there is
        none.

    Raises
    ------
    ArrangementError
        If the parts have no body, or are connected in a way that has no solution.
    """

    name: str
    parts: tuple[tuple[str, Part], ...]
    description: str = ""
    parent: ParentDeck | None = None

    def __post_init__(self) -> None:
        for field in ("name", "description"):
            object.__setattr__(self, field, visible(getattr(self, field)))
        if len(self.name) > LONGEST:
            raise ArrangementError(
                f"assembly '{self.name[:20]}...'",
                f"its name has {len(self.name)} letters, more than {LONGEST}",
                next_step="give a short name, which also names files; the description may be long",
            )  # fmt: skip
        # In a deck the table [deck] holds name and description.
        check_names(f"assembly '{self.name}'", [name for name, _ in self.parts], taken=("deck",))
        for _, error in arrangement_problems(self.parts):
            raise error
        if not any(isinstance(part, Body) for _, part in self.parts):
            raise ArrangementError(
                f"assembly '{self.name}'", "has no body", next_step="add for instance load=Fixed()"
            )

    def __getitem__(self, path: str) -> Part:
        """Return the part at a path."""
        for where, part in self.walk():
            if where == path:
                return part
        raise unknown_name("part", path, (where for where, _ in self.walk()))

    def walk(self) -> list[tuple[str, Part]]:
        """Return every part with its path, in written order."""
        return [pair for name, part in self.parts for pair in walk(part, name)]

    def sensors(self) -> dict[str, Sensor]:
        """Return the sensors by name."""
        return {name: part for name, part in self.parts if isinstance(part, Sensor)}

    def measured(self, signal: str) -> tuple[str, tuple[str, ...]]:
        """Return the variable that a signal measures, and the chain of sensors, the last one first.

        Parameters
        ----------
        signal
            Full name; a signal that is not the reading of a sensor is returned itself.

        Raises
        ------
        ArrangementError
            If the sensors read one another in a circle.
        """
        return sensors_behind(self.sensors(), signal)

    def quantities(self) -> dict[str, Quantity]:
        """Return every number by full name."""
        return {k: q for name, part in self.parts for k, q in quantities(part, name).items()}

    def with_values(self, values: Mapping[str, Quantity | float | tuple[float, ...]]) -> Assembly:
        """Return a copy with other numbers.

        Parameters
        ----------
        values
            Quantities, or numbers in SI, by full name.

        Raises
        ------
        UnknownNameError
            With the nearest name that exists.
        """
        inside: dict[str, dict[str, Quantity | float | tuple[float, ...]]] = {}
        for name, value in resolved(self.quantities(), values).items():
            head, _, tail = name.partition(".")
            inside.setdefault(head, {})[tail] = value
        parts = dict(self.parts)
        for head, numbers in inside.items():
            part = parts[head]
            changed = with_values(part.element if isinstance(part, Tie) else part, numbers)
            parts[head] = part.around(changed) if isinstance(part, Tie) else changed
        return replace(self, parts=tuple(parts.items()))

    def with_part(self, path: str, new: Part) -> Assembly:
        """Return a copy in which a part is added or replaced.

        Parameters
        ----------
        path
            Existing path, or a new name at the top or inside a combination.
        new
            The part; a bare element in place of a tie keeps the bodies.

        Raises
        ------
        UnknownNameError
            If the path leads through a part that does not exist.
        """
        head, _, tail = path.partition(".")
        parts = dict(self.parts)
        old = parts.get(head)
        if tail:
            if old is None:
                raise unknown_name("part", path, (where for where, _ in self.walk()))
            inner = old.element if isinstance(old, Tie) else old
            owner, _, name = tail.rpartition(".")
            holder = find(inner, owner)
            inside = replaced(inner, owner, holder.with_children({**holder.children(), name: new}))
            parts[head] = old.around(inside) if isinstance(old, Tie) else inside
        elif isinstance(old, Tie) and isinstance(new, Element):
            parts[head] = old.around(new)
        else:
            parts[head] = new
        return replace(self, parts=tuple(parts.items()))

    def element(self, path: str) -> Element:
        """Return the element at a path; for a tie, the element that it ties.

        Parameters
        ----------
        path
            For instance ``"spring"`` or ``"spring.rubber"``.

        Raises
        ------
        ArrangementError
            If the part is no element.
        """
        part = self[path]
        element = part.element if isinstance(part, Tie) else part
        if not isinstance(element, Element):
            raise ArrangementError(f"part '{path}'", f"is a {type(element).__name__}, not an element")
        return element

    def without_part(self, name: str) -> Assembly:
        """Return a copy without a part at the top.

        Parameters
        ----------
        name
            Name of the part.

        Raises
        ------
        UnknownNameError
            If there is no such part.
        """
        if name not in dict(self.parts):
            raise unknown_name("part", name, dict(self.parts))
        return replace(self, parts=tuple((n, p) for n, p in self.parts if n != name))

    def has(self, path: str, phenomenon: str) -> bool:
        """Tell whether a body or a part has a phenomenon already.

        Parameters
        ----------
        path
            Of a body: all that is tied to it is looked at. Of another part: the part, what is inside it and
            what is around it.
        phenomenon
            As parts state it in :attr:`Part.phenomena`, for instance ``"dry friction"``.

        Raises
        ------
        UnknownNameError
            With the nearest path that exists.
        """
        if isinstance(self[path], Body):
            ties = {name for name, part in self.parts if isinstance(part, Tie) and path in part.between}
            near = [part for where, part in self.walk() if where.partition(".")[0] in {*ties, path}]
        else:
            near = [
                part
                for where, part in self.walk()
                if f"{where}.".startswith(f"{path}.") or path.startswith(f"{where}.")
            ]
        return any(phenomenon in (part.element if isinstance(part, Tie) else part).phenomena for part in near)

    def __str__(self) -> str:
        return draw(f"{self.name}: {self.description}".rstrip(": "), self.parts)


def arrangement_problems(
    parts: Sequence[tuple[str, Part]], unreadable: Sequence[str] = ()
) -> Iterator[tuple[str, NlsError]]:
    """Yield the problems of an arrangement of parts, each with the name of the part.

    ``unreadable``: names of parts that are declared but could not be read; ties to them are not judged.
    """
    bodies = {name: part for name, part in parts if isinstance(part, Body)}
    for name, part in parts:
        if isinstance(part, Tie):
            if not set(unreadable) & set(part.between):
                yield from ((name, error) for error in _tie_problems(name, part, bodies))
        elif not isinstance(part, Body | Sensor | Transmission):
            yield (
                name,
                ArrangementError(
                    f"part '{name}'",
                    f"is a {type(part).__name__}; an assembly holds bodies, gears, ties and sensors",
                    next_step="tie an element to bodies with tie(element, 'motor', 'load')",
                ),
            )
    yield from transmission_problems(parts, unreadable)
    yield from chain_problems(parts)
    first: dict[frozenset[str], str] = {}
    for path, tie in parts:
        if not isinstance(tie, Tie) or not _rubs(tie.element):
            continue
        ends = frozenset(tie.between)
        if ends in first:
            where = " and ".join(f"'{end}'" for end in tie.between)
            yield (
                path,
                ArrangementError(
                    f"parts '{first[ends]}' and '{path}'",
                    f"both bring dry friction to {where}, and hold the same motion",
                    next_step="take one of them, with the sum of both",
                ),
            )
        first.setdefault(ends, path)


def _rubs(element: Element) -> bool:
    """Tell whether dry friction acts on the motion of an element as a whole."""
    if isinstance(element, Parallel):
        return any(_rubs(member) for _, member in element.members)
    return "dry friction" in element.phenomena


def _tie_problems(name: str, part: Tie, bodies: Mapping[str, Body]) -> Iterator[NlsError]:
    missing = [end for end in part.between if end not in bodies]
    if missing:
        yield from (unknown_name(f"'{name}': body", end, bodies) for end in missing)
        return
    ends = [bodies[end] for end in part.between]
    for end, body in zip(part.between, ends, strict=True):
        if body.domain != part.element.domain:
            yield ArrangementError(
                f"part '{name}'",
                f"relates {part.element.domain.motion} and {part.element.domain.effort}, "
                f"but '{end}' has a {body.domain.motion}",
                next_step="put a cam or pulley (through) in between, or join bodies with a Rack or a Screw",
            )
    if all(isinstance(body, Fixed) for body in ends) or len(set(part.between)) < len(part.between):
        yield ArrangementError(
            f"part '{name}'",
            "both ends rest on the same or on fixed bodies, so it can never move",
            next_step="tie one end to a body that moves",
        )


def assembly(name: str, *, description: str = "", **parts: Any) -> Assembly:
    """Make an assembly of named parts.

    Parameters
    ----------
    name
        Short name of the system.
    description
        One sentence.
    **parts
        Bodies, gears, ties and sensors by name.
    """
    return Assembly(name, tuple(parts.items()), description)
