"""The command ``calibrate``: a table, a deck, and clear refusals."""

from __future__ import annotations

import json
import shlex
from pathlib import Path

import pytest
from click.testing import CliRunner

from nlsdesign.cli.bench import calibrate
from nlsdesign.foundation.deck import load_deck
from nlsdesign.foundation.errors import MeasurementError
from tests.calibrated import LINEAR, recorded
from tests.rig.calibration_bench import Machine

TRUE = Machine(stiffness=3.3, torque_constant=0.053)


def run(*arguments: str) -> str:
    # Wide enough that no cell is wrapped.
    done = CliRunner().invoke(calibrate, list(arguments), catch_exceptions=False, env={"COLUMNS": "400"})
    assert done.exit_code == 0, done.output
    return done.output


def test_a_plan_is_a_ranked_table(tmp_path: Path) -> None:
    deck = tmp_path / "stiff spring.toml"
    deck.write_bytes(load_deck(LINEAR).path.read_bytes())
    out = run("--deck", str(deck), "--plan", "--out", str(tmp_path))
    following = shlex.split(out.partition("next: ")[2])
    assert following[following.index("--deck") + 1] == str(deck)
    assert out.index("hung weight and load cell") < out.index("free run  ")
    plan = json.loads((tmp_path / "plan.json").read_text())
    errors = [row["torque_rms_Nm"] for row in plan["ranked"]]
    assert errors == sorted(errors)
    assert plan["ranked"][0]["spreads"]["spring.stiffness"]["before"] == pytest.approx(0.05)


def test_records_become_a_deck(tmp_path: Path) -> None:
    folder = recorded("free_run", tmp_path, TRUE)
    out = run("--deck", LINEAR, "--kind", "free_run", "--records", str(folder), "--out", str(tmp_path / "o"))
    assert "motor.torque_constant" in out
    assert "motor.inertia over motor.torque_constant is known to" in out
    written = load_deck(tmp_path / "o" / f"{LINEAR}_calibrated.toml")
    assert "calibrated" in written.quantity("bearing.damping").source
    told = run(
        *("--deck", str(written.path), "--known", str(tmp_path / "o" / "joint_numbers.json"), "--json"),
        *("--plan", "--kind", "hung_weight", "--out", str(tmp_path / "p")),
    )
    table = json.loads(told)
    assert [row["calibration"] for row in table["ranked"]] == ["hung weight"]
    # The inertia follows from the torque constant, as their ratio is known already.
    assert table["ranked"][0]["spreads"]["motor.inertia"]["after"] < 0.01


def test_each_folder_needs_its_kind(tmp_path: Path) -> None:
    for wrong in (["--kind", "free_run"], ["--records", str(tmp_path)], []):
        done = CliRunner().invoke(calibrate, ["--deck", LINEAR, *wrong, "--out", str(tmp_path / "o")])
        assert isinstance(done.exception, MeasurementError)
        assert "needs its kind" in str(done.exception)
    assert not (tmp_path / "o").exists()
