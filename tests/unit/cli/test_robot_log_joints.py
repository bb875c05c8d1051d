"""Commands on a log of a robot: several joints in one call, each with its deck."""

from __future__ import annotations

import csv
import json
from pathlib import Path

import numpy as np
import pytest

from tests.command_line import Run, run
from tests.rig.kind_cases import NAMES, write_kind_case

__all__ = ["run"]
MAPPING = """
[time]
column = "joint_states/time"
[columns."joint_states/position/{{joint}}"]
signal = "{sensor}"
unit = "rad"
[columns."joint_states/effort/{{joint}}"]
signal = "{ammeter}"
unit = "A"
"""


def columns(file: Path) -> np.ndarray:
    with file.open(encoding="utf-8") as stream:
        return np.array([[float(cell) for cell in row] for row in list(csv.reader(stream))[1:]])


def as_logs(folder: Path, joints: dict[str, Path]) -> None:
    """Write the records of several machines as one robot logs them: MCAP in JSON, currents as efforts."""
    writers = pytest.importorskip("mcap.writer")
    for file in sorted(next(iter(joints.values())).glob("*.csv")):
        tables = [columns(case / file.name) for case in joints.values()]
        with (folder / f"{file.stem}.mcap").open("wb") as stream:
            log = writers.Writer(stream)
            log.start()
            topic = log.register_channel(
                "/joint_states", "json", log.register_schema("", "jsonschema", b"{}")
            )
            for rows in zip(*tables, strict=False):
                at = 1_700_000_000 * 10**9 + round(rows[0][0] * 1e9)
                message = {
                    "header": {"stamp": {"sec": at // 10**9, "nanosec": at % 10**9}},
                    "name": list(joints),
                    "position": [row[1] for row in rows],
                    "effort": [row[2] for row in rows],
                }
                log.add_message(topic, log_time=at, data=json.dumps(message).encode(), publish_time=at)
            log.finish()


@pytest.mark.slow
def test_two_joints_of_one_log_are_diagnosed_in_one_call(run: Run, tmp_path: Path) -> None:
    joints = {"elbow": tmp_path / "elbow", "knee": tmp_path / "knee"}
    for (joint, case), hidden in zip(joints.items(), (("coulomb_friction",), ()), strict=True):
        write_kind_case(case, "geared_joint", hidden, 1.0, 2077 + (len(NAMES) if joint == "knee" else 0))
    logs = tmp_path / "logs"
    logs.mkdir()
    as_logs(logs, joints)
    signals = [line.split('"')[1] for line in (joints["elbow"] / "records.toml").read_text().splitlines()
               if line.startswith("signal")]  # fmt: skip
    (logs / "records.toml").write_text(MAPPING.format(sensor=signals[0], ammeter=signals[1]))
    named = [word for joint, case in joints.items() for word in ("--joint", f"{joint}={case / 'deck.toml'}")]
    status, text, errors = run(
        "diagnose", *named, "--records", str(logs), "--out", str(tmp_path / "out"), "--json"
    )
    assert status == 0, errors
    verdicts = json.loads(text)
    assert [effect["name"] for effect in verdicts["elbow"]["effects"]] == ["coulomb_friction"]
    assert verdicts["knee"]["effects"] == []
    for joint in joints:
        assert (tmp_path / "out" / joint / "report.html").is_file()


@pytest.mark.parametrize(
    ("words", "message"),
    [
        ([], "--deck: is missing"),
        (["--joint", "elbow"], "--deck: is missing"),
        (["--joint", "elbow=a.toml", "--joint", "knee"], "--joint knee: is not one joint with its deck"),
        (["--deck", "a.toml", "--joint", "elbow=b.toml"], "--joint elbow=b.toml: is not one joint"),
        (["--joint", "elbow=a.toml", "--joint", "elbow=b.toml"], "is not one joint with its deck"),
    ],
)
def test_joints_without_a_deck_each_are_refused(
    words: list[str], message: str, run: Run, tmp_path: Path
) -> None:
    status, _, errors = run("diagnose", *words, "--records", str(tmp_path), "--out", str(tmp_path / "out"))
    assert status != 0
    assert message in errors.replace("\n", " ")
