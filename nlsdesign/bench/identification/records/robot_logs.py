"""Logs of robots: rosbag2 (a folder, or its ``.mcap`` and ``.db3``), ROS 1 ``.bag``, and MCAP with JSON.

A log holds messages of several topics, each at its own pace. A topic becomes a clock ``topic/time`` and
columns ``topic/field``; where a message names its joints, ``topic/field/joint``. Messages of one topic that
hold different numbers, as two drivers on ``/joint_states`` publish them, become columns with their own clock.
"""

from __future__ import annotations

import itertools
import json
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass, field, fields, is_dataclass
from pathlib import Path
from typing import Any, Final

import numpy as np

from ....foundation.arrays import Array
from ....foundation.errors import MeasurementError

LOG_ENDINGS: Final = (".mcap", ".db3", ".bag")
_NAMES = ("name", "names", "joint_names")
"""Fields in which a message says which joint each number of its lists is of."""
_LONGEST_LIST = 64
"""Lists of more numbers are pictures, maps or clouds of points, not the signals of a joint."""
_CLOCKS_APART = 0.05
"""Times in s by which the stamps of two topics run behind the log before they count as two clocks."""
_UNITS: Final[Mapping[tuple[str, str], str]] = {
    ("JointState", "position"): "rad", ("JointState", "velocity"): "rad/s",
    ("JointTrajectoryPoint", "positions"): "rad", ("JointTrajectoryPoint", "velocities"): "rad/s",
    ("JointTrajectoryPoint", "accelerations"): "rad/s^2",
    ("Wrench", "force"): "N", ("Wrench", "torque"): "N*m", ("BatteryState", "voltage"): "V",
    ("BatteryState", "current"): "A", ("Imu", "angular_velocity"): "rad/s",
    ("Imu", "linear_acceleration"): "m/s^2",
}  # fmt: skip
"""Units by type of message and field, after the comments in the definitions of ROS's common interfaces; of
joints those of a turning one, for the messages do not say which it is. An effort may be a torque, a force or
a current, so it has none."""


@dataclass(frozen=True, eq=False)
class LogColumns:
    """What a log holds: columns and their units by head, the clocks among them, and what was assumed.

    ``behind`` is the usual time in s by which the stamps of a clock lie behind the writing of the log.
    """

    columns: Mapping[str, Array]
    units: Mapping[str, str]
    behind: Mapping[str, float]
    remarks: tuple[str, ...]


@dataclass(eq=False)
class _Series:
    """Messages of one topic that hold the same numbers, as they are read."""

    heads: tuple[str, ...]
    units: Mapping[str, str]
    rows: list[tuple[float, ...]] = field(default_factory=list)
    stamps: list[int | None] = field(default_factory=list)
    written: list[int] = field(default_factory=list)

    @property
    def times(self) -> list[int]:
        """Times of the messages in ns: their stamps where all have one and these ascend, else of writing."""
        stamps = [stamp for stamp in self.stamps if stamp is not None]
        ascend = len(stamps) == len(self.written) and all(a < b for a, b in itertools.pairwise(stamps))
        return stamps if ascend else self.written


def is_robot_log(path: Path) -> bool:
    """Tell whether a path is a log: a file by its ending, a folder by the ``metadata.yaml`` of rosbag2."""
    return (path / "metadata.yaml").is_file() if path.is_dir() else path.suffix.lower() in LOG_ENDINGS


def read_robot_log(path: Path, rosbags: Any, mcap: Any) -> LogColumns:
    """Read all numbers of a log; ``rosbags``, ``mcap``: modules ``rosbags.highlevel`` and ``mcap.reader``."""
    passed: dict[str, str] = {}
    plain = False
    if path.suffix.lower() == ".mcap":
        with path.open("rb") as stream:
            plain = mcap.make_reader(stream).get_header().profile not in ("ros1", "ros2")
    messages = _json_messages(path, mcap, passed) if plain else _ros_messages(path, rosbags, passed)
    series: dict[tuple[str, tuple[str, ...]], _Series] = {}
    for topic, kind, written, message in messages:
        numbers = dict(_numbers(message, kind))
        heads = tuple(numbers)
        if not heads:
            passed.setdefault(topic, "it holds no numbers")
            continue
        one = series.get((topic, heads))
        if one is None:
            units = {head: unit for head, (_, unit) in numbers.items() if unit}
            one = series[topic, heads] = _Series(heads, units)
        one.rows.append(tuple(value for value, _ in numbers.values()))
        one.stamps.append(_stamp(message))
        one.written.append(written)
    if not series:
        reasons = "; ".join(f"'{topic}': {reason}" for topic, reason in sorted(passed.items()))
        raise MeasurementError(
            path.name, f"holds no message with numbers{f' ({reasons})' if reasons else ''}",
            next_step="record the topic with the states of the joints, for instance /joint_states",
        )  # fmt: skip
    return _columns(series, passed)


def _ros_messages(path: Path, rosbags: Any, passed: dict[str, str]) -> Iterator[tuple[str, str, int, Any]]:
    from rosbags.typesys import Stores, get_typestore  # there wherever rosbags is

    with rosbags.AnyReader([path], default_typestore=get_typestore(Stores.LATEST)) as reader:
        known = [c for c in reader.connections if c.msgtype in reader.typestore.types]
        for connection in reader.connections:
            if connection not in known:
                passed[connection.topic] = f"the log does not define its type '{connection.msgtype}'"
        for connection, written, raw in reader.messages(connections=known) if known else ():
            kind = connection.msgtype.rpartition("/")[2]
            yield connection.topic, kind, written, reader.deserialize(raw, connection.msgtype)


def _json_messages(path: Path, mcap: Any, passed: dict[str, str]) -> Iterator[tuple[str, str, int, Any]]:
    with path.open("rb") as stream:
        for schema, channel, message in mcap.make_reader(stream).iter_messages():
            if channel.message_encoding != "json":
                passed[channel.topic] = (
                    f"its messages are in {channel.message_encoding or 'no encoding'}, not JSON"
                )
                continue
            kind = schema.name.rpartition("/")[2].rpartition(".")[2] if schema else ""
            yield channel.topic, kind, message.log_time, json.loads(message.data)


def _members(message: Any) -> Iterator[tuple[str, Any]]:
    """Return fields and values of a message of ROS or of JSON."""
    if isinstance(message, Mapping):
        yield from message.items()
    else:
        for each in fields(message):
            if each.name != "__msgtype__":
                yield each.name, getattr(message, each.name)


_NOT_FINITE = ("NaN", "Infinity", "-Infinity")
"""Numbers that JSON cannot hold, as the JSON form of Protocol Buffers writes them: as text."""


def _number(value: Any) -> float | None:
    """Return a number of a message, none for anything else."""
    is_number = isinstance(value, bool | int | float | np.number) or (
        isinstance(value, str) and value in _NOT_FINITE
    )
    return float(value) if is_number else None


def _numbers(message: Any, kind: str, joints: Sequence[str] = ()) -> Iterator[tuple[str, tuple[float, str]]]:
    """Return what a message holds: path of fields, number and unit; its head stays out."""
    members = dict(_members(message))
    texts = [names for key in _NAMES if isinstance(names := members.get(key), (list, tuple)) and names]
    named = next((names for names in texts if all(isinstance(name, str) for name in names)), joints)
    for name, value in members.items():
        if name == "header":
            continue
        unit = _UNITS.get((kind, name), "")
        if (number := _number(value)) is not None:
            yield name, (number, unit)
        elif isinstance(value, Mapping) or is_dataclass(value):
            inner = kind if unit else _kind_of(value) or kind
            for path, (size, own) in _numbers(value, inner, named):
                yield f"{name}/{path}", (size, own or unit)
        elif isinstance(value, (list, tuple, np.ndarray)) and 0 < len(value) <= _LONGEST_LIST:
            labels = (
                [f"/{n}" for n in named]
                if len(named) == len(value)
                else [f"[{k}]" for k in range(len(value))]
            )
            for label, item in zip(labels, value, strict=True):
                if (number := _number(item)) is not None:
                    yield f"{name}{label}", (number, unit)
                elif isinstance(item, Mapping) or is_dataclass(item):
                    for path, numbered in _numbers(item, _kind_of(item) or kind):
                        yield f"{name}{label}/{path}", numbered


def _kind_of(message: Any) -> str:
    return str(getattr(message, "__msgtype__", "")).rpartition("/")[2]


def _stamp(message: Any) -> int | None:
    """Return the time in ns that a message gives itself; none where it has no head or the time is zero."""
    header = dict(_members(message)).get("header")
    stamp = (
        dict(_members(header)).get("stamp") if isinstance(header, Mapping) or is_dataclass(header) else None
    )
    if not (isinstance(stamp, Mapping) or is_dataclass(stamp)):
        return None
    parts = dict(_members(stamp))
    seconds, rest = parts.get("sec", parts.get("secs")), parts.get("nanosec", parts.get("nsecs", 0))
    if not (isinstance(seconds, int | np.integer) and isinstance(rest, int | np.integer)):
        return None
    return (10**9 * int(seconds) + int(rest)) or None


def _columns(series: Mapping[tuple[str, tuple[str, ...]], _Series], passed: Mapping[str, str]) -> LogColumns:
    columns: dict[str, Array] = {}
    units: dict[str, str] = {}
    behind: dict[str, float] = {}
    remarks = [f"topic '{topic}' is left out: {reason}" for topic, reason in sorted(passed.items())]
    times = {key: one.times for key, one in series.items()}
    began = min(int(time[0]) for time in times.values())
    count: dict[str, int] = {}
    for (topic, heads), one in series.items():
        count[topic] = count.get(topic, 0) + 1
        prefix = topic.strip("/") + (f"~{count[topic]}" if count[topic] > 1 else "")
        written, time, clock = np.array(one.written), times[topic, heads], f"{prefix}/time"
        if time is one.written:
            text = "stamps are missing or do not ascend; its time is that of writing the log, with its jitter"
            remarks.append(f"topic '{topic}': {text}")
        columns[clock], units[clock] = (np.array(time) - began) * 1e-9, "s"
        behind[clock] = float(np.median(written - np.array(time))) * 1e-9
        for head, values in zip(heads, np.array(one.rows).T, strict=True):
            columns[f"{prefix}/{head}"] = values
        units |= {f"{prefix}/{head}": unit for head, unit in one.units.items()}
        if "rad" in one.units.values():
            text = "joints are taken to turn (rad), efforts have no unit; records.toml says what they are"
            remarks.append(f"topic '{topic}': {text}")
    return LogColumns(columns, units, behind, tuple(remarks))


def of_joint(head: str, joint: str) -> bool:
    """Tell whether a column is one of a joint: its name stands between slashes of the head, or at its end."""
    return f"/{joint}/" in f"{head}/"


def check_one_clock(where: str, behind: Mapping[str, float], clocks: Sequence[str]) -> None:
    """Refuse clocks of a log that run on different machines: how late one is for the other is unknown."""
    known = [clock for clock in dict.fromkeys(clocks) if clock in behind]
    if not known:
        return
    first, last = min(known, key=behind.__getitem__), max(known, key=behind.__getitem__)
    if behind[last] - behind[first] > _CLOCKS_APART:
        raise MeasurementError(
            f"{where}: '{first}' and '{last}'",
            f"are of two clocks: stamps {behind[first]:.3g} s and {behind[last]:.3g} s behind the log",
            next_step="map columns of one clock, or remove the lag of two columns of one motion by [[align]]",
        )
