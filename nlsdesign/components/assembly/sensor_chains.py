"""What sensors read, and what is wrong with it as far as it can be seen without equations."""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence

from ...foundation.errors import ArrangementError, NlsError, unknown_name
from ..core.element import Element, Tie
from ..core.part import Part, walk
from ..mechanics.bodies import Body
from ..sensing.sensors import Sensor


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
