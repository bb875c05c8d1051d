"""Logs of robots: the same records as from CSV, joints by name, clocks that differ, refusals with a name."""

from __future__ import annotations

import json
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from nlsdesign.bench.identification import describe_records, load_records
from nlsdesign.bench.identification.records.table_files import read_table
from nlsdesign.foundation.errors import MeasurementError
from tests.unit.bench.identification.test_measurement import model, table

__all__ = ["model"]
BEGAN = 1_700_000_000_123_456_789
JOINTS = ("knee", "elbow")
MAPPING = """
[time]
column = "joint_states/time"
[columns."joint_states/position/{joint}"]
signal = "encoder.reading"
unit = "rad"
[columns."joint_states/effort/{joint}"]
signal = "cell.reading"
unit = "N*m"
"""


def samples() -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Times in ns from the beginning, angles in rad and torques in N·m of one joint."""
    time, angle, torque = table().T
    return np.rint(time * 1e9).astype(int), np.radians(angle), torque


def ros2(path: Path, *, plugin: str = "MCAP", late: int = 300_000, second: int | None = None) -> Path:
    """Write a bag of rosbag2 with two joints; ``second``: ns by which another topic's stamps lag the log."""
    rosbag2, typesys = pytest.importorskip("rosbags.rosbag2"), pytest.importorskip("rosbags.typesys")
    store = typesys.get_typestore(typesys.Stores.ROS2_JAZZY)
    kind = "sensor_msgs/msg/JointState"
    state, head, stamp = (
        store.types[name] for name in (kind, "std_msgs/msg/Header", "builtin_interfaces/msg/Time")
    )
    with rosbag2.Writer(path, version=9, storage_plugin=rosbag2.StoragePlugin[plugin]) as writer:
        topic = writer.add_connection("/joint_states", kind, typestore=store)
        other = writer.add_connection("/load_cell", kind, typestore=store) if second is not None else None
        text = writer.add_connection("/said", "std_msgs/msg/String", typestore=store)
        said = store.types["std_msgs/msg/String"]("begin")
        writer.write(text, BEGAN, store.serialize_cdr(said, "std_msgs/msg/String"))
        for time, angle, torque in zip(*samples(), strict=True):
            at = BEGAN + int(time)

            def message(at: int, names: list[str], position: list[float], effort: list[float]) -> Any:
                header = head(stamp(at // 10**9, at % 10**9), "")
                vectors = [np.array(v, dtype=float) for v in (position, [], effort)]
                return store.serialize_cdr(state(header, names, *vectors), kind)

            writer.write(
                topic, at + late, message(at, list(JOINTS), [angle, -2.0 * angle], [torque, 3.0 * torque])
            )
            if other is not None and second is not None:
                writer.write(other, at + late, message(at + late - second, ["knee"], [], [torque]))
    return path


def plain(file: Path, encoding: str = "json") -> Path:
    """Write MCAP with messages in JSON, without stamps."""
    with file.open("wb") as stream:
        writer = pytest.importorskip("mcap.writer").Writer(stream)
        writer.start()
        schema = writer.register_schema("joint", "jsonschema", b"{}")
        channel = writer.register_channel("state", encoding, schema)
        for time, angle, torque in zip(*samples(), strict=True):
            data = json.dumps({"q": {"knee": angle}, "tau": [torque]}).encode()
            at = BEGAN + int(time)
            writer.add_message(channel, log_time=at, data=data, publish_time=at)
        writer.finish()
    return file


@pytest.mark.parametrize("plugin", ["MCAP", "SQLITE3"])
def test_a_joint_of_a_bag_is_the_record_that_a_table_would_give(
    plugin: str, tmp_path: Path, model: Any
) -> None:
    ros2(tmp_path / "run", plugin=plugin)
    (tmp_path / "records.toml").write_text(MAPPING, encoding="utf8")
    time, angle, torque = samples()
    knee, elbow = (load_records(tmp_path, model, joint=joint) for joint in JOINTS)
    found = np.concatenate([record.trace["encoder.reading"] for record in knee.records])
    np.testing.assert_allclose(found, angle, rtol=1e-12)
    moved = np.concatenate([record.trace["encoder.reading"] for record in elbow.records])
    np.testing.assert_allclose(moved, -2.0 * angle, rtol=1e-12)
    efforts = np.concatenate([record.trace["cell.reading"] for record in elbow.records])
    np.testing.assert_allclose(efforts, 3.0 * torque, rtol=1e-12)
    assert knee.records[0].step == pytest.approx(np.median(np.diff(time)) * 1e-9, rel=1e-9)


def test_what_a_log_holds_says_topics_units_and_what_is_left_out(tmp_path: Path) -> None:
    log = read_table(ros2(tmp_path / "run"))
    assert log.heads == (
        "joint_states/time", "joint_states/position/knee", "joint_states/position/elbow",
        "joint_states/effort/knee", "joint_states/effort/elbow",
    )  # fmt: skip
    assert log.units["joint_states/position/knee"] == "rad"
    # An effort may be a torque, a force or a current: nobody guesses.
    assert "joint_states/effort/knee" not in log.units
    assert "topic '/said' is left out: it holds no numbers" in log.remarks
    # Stamps of the robot are taken, not the times of writing.
    np.testing.assert_allclose(log.given["joint_states/time"], samples()[0] * 1e-9, atol=1e-9)
    assert log.behind["joint_states/time"] == pytest.approx(3e-4)


def test_a_joint_needs_no_mapping_where_its_units_decide(tmp_path: Path, model: Any) -> None:
    ros2(tmp_path / "run")
    records = load_records(tmp_path, model, joint="elbow")
    assert {c.signal: c.name for c in records.columns} == {
        "encoder.reading": "joint_states/position/elbow [rad]"
    }
    described = describe_records(tmp_path, model, joint="knee")
    assert [column.head for column in described.undecided] == ["joint_states/effort/knee"]
    assert '[columns."joint_states/position/knee"]' in described.mapping()


def test_mcap_with_json_is_read_and_other_encodings_are_named(tmp_path: Path) -> None:
    log = read_table(plain(tmp_path / "run.mcap"))
    time, angle, _ = samples()
    assert log.heads == ("state/time", "state/q/knee", "state/tau[0]")
    np.testing.assert_allclose(log.given["state/q/knee"], angle, rtol=1e-12)
    np.testing.assert_allclose(log.given["state/time"], (time - time[0]) * 1e-9, atol=1e-9)
    assert any("its time is that of writing the log" in remark for remark in log.remarks)
    with pytest.raises(MeasurementError, match="its messages are in protobuf, not JSON"):
        read_table(plain(tmp_path / "other.mcap", "protobuf"))


def test_a_bag_of_the_older_system_is_read(tmp_path: Path) -> None:
    rosbag1, typesys = pytest.importorskip("rosbags.rosbag1"), pytest.importorskip("rosbags.typesys")
    store = typesys.get_typestore(typesys.Stores.ROS1_NOETIC)
    kind = "geometry_msgs/msg/Wrench"
    vector = store.types["geometry_msgs/msg/Vector3"]
    with rosbag1.Writer(tmp_path / "run.bag") as writer:
        topic = writer.add_connection("/wrist", kind, typestore=store)
        for number in range(60):
            message = store.types[kind](vector(0.0, 0.0, number), vector(0.0, 0.0, 0.5 * number))
            writer.write(topic, BEGAN + 10**7 * number, store.serialize_ros1(message, kind))
    log = read_table(tmp_path / "run.bag")
    np.testing.assert_allclose(log.given["wrist/torque/z"], 0.5 * np.arange(60))
    assert (log.units["wrist/force/x"], log.units["wrist/torque/z"]) == ("N", "N*m")


def test_a_mapping_reads_what_it_names_beside_the_joint(tmp_path: Path, model: Any) -> None:
    ros2(tmp_path / "run", second=300_000)
    mapping = MAPPING.replace("joint_states/effort/{joint}", "load_cell/effort/knee")
    text = "resample_Hz = 200\n" + mapping + 'time = "load_cell/time"\n'
    (tmp_path / "records.toml").write_text(text, encoding="utf8")
    records = load_records(tmp_path, model, joint="elbow")
    assert {column.name for column in records.columns} == {
        "joint_states/position/elbow",
        "load_cell/effort/knee",
    }


def test_a_joint_with_a_slash_in_its_name_is_found(tmp_path: Path) -> None:
    table = read_table(ros2(tmp_path / "run"))
    given = {head.replace("elbow", "left/elbow"): values for head, values in table.given.items()}
    renamed = replace(table, given=given)
    assert renamed.of_joint("left/elbow").heads == (
        "joint_states/time", "joint_states/position/left/elbow", "joint_states/effort/left/elbow",
    )  # fmt: skip


def test_two_clocks_are_refused_with_both_lags(tmp_path: Path, model: Any) -> None:
    ros2(tmp_path / "run", second=4_000_000_000)
    mapping = MAPPING.replace("{joint}", "knee").replace("joint_states/effort", "load_cell/effort")
    mapping = "resample_Hz = 200\n" + mapping + 'time = "load_cell/time"\n'
    (tmp_path / "records.toml").write_text(mapping, encoding="utf8")
    with pytest.raises(MeasurementError, match=r"are of two clocks: stamps 0\.0003 s and 4 s") as error:
        load_records(tmp_path, model)
    assert "[[align]]" in str(error.value)


def test_an_unknown_joint_and_a_damaged_log_are_named(tmp_path: Path, model: Any) -> None:
    ros2(tmp_path / "run")
    with pytest.raises(MeasurementError, match=r"joint 'nee'.*\n?.*did you mean.*knee"):
        load_records(tmp_path, model, joint="nee")
    file = next((tmp_path / "run").glob("*.mcap"))
    file.write_bytes(file.read_bytes()[: file.stat().st_size // 2])
    with pytest.raises(MeasurementError, match=rf"{file.name}.*cannot be read"):
        read_table(file)


def test_messages_of_one_topic_that_hold_different_joints_have_clocks_of_their_own(tmp_path: Path) -> None:
    file = tmp_path / "run.mcap"
    with file.open("wb") as stream:
        writer = pytest.importorskip("mcap.writer").Writer(stream)
        writer.start()
        channel = writer.register_channel("states", "json", writer.register_schema("", "jsonschema", b"{}"))
        for number in range(60):
            for joint in JOINTS:
                at = BEGAN + 10_000_000 * number + (2_000_000 if joint == "elbow" else 0)
                stamp = {"sec": at // 10**9, "nanosec": at % 10**9}
                message = {"header": {"stamp": stamp}, "name": [joint], "position": [number]}
                writer.add_message(channel, log_time=at, data=json.dumps(message).encode(), publish_time=at)
        writer.finish()
    log = read_table(file)
    assert log.heads == (
        "states/time", "states/position/knee", "states~2/time", "states~2/position/elbow",
    )  # fmt: skip
    assert log.given["states~2/time"][0] == pytest.approx(0.002)
    assert log.of_joint("elbow").heads == ("states~2/time", "states~2/position/elbow")


def test_numbers_that_are_not_finite_come_as_text_and_leave_one_topic(tmp_path: Path) -> None:
    """As Protocol Buffers write them in JSON; a topic is not split by them; other texts are none."""
    file = tmp_path / "run.mcap"
    with file.open("wb") as stream:
        writer = pytest.importorskip("mcap.writer").Writer(stream)
        writer.start()
        channel = writer.register_channel("states", "json", writer.register_schema("", "jsonschema", b"{}"))
        for number, torque in enumerate([0.5, "NaN", "-Infinity", 0.25]):
            message = {"q": number, "tau": [torque], "mode": "run"}
            at = BEGAN + 10_000_000 * number
            writer.add_message(channel, log_time=at, data=json.dumps(message).encode(), publish_time=at)
        writer.finish()
    log = read_table(file)
    assert log.heads == ("states/time", "states/q", "states/tau[0]")
    np.testing.assert_array_equal(log.given["states/tau[0]"], [0.5, np.nan, -np.inf, 0.25])
