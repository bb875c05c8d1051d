"""``nlsdesign records describe``: what it tells, what it writes, and its exit status."""

from __future__ import annotations

import json
from pathlib import Path

import numpy as np
from click.testing import CliRunner

from nlsdesign.cli.main import program
from tests.unit.bench.identification.test_description import german

DECK = "test_rig"
HEADS = ("Zeit [ms]", "Strom in mA", "Winkel (°)", "Kraft [N]")


def bench(folder: Path, heads: tuple[str, ...] = HEADS) -> Path:
    time = 0.002 * np.arange(600)
    draws = np.random.default_rng(7).standard_normal((2, 600))
    angle = 20.0 * np.sin(2.0 * np.pi * time)
    rows = np.column_stack([time, 500.0 * np.sin(time) + draws[0], angle, 60.0 + angle + 0.3 * draws[1]])
    for number in range(3):
        german(folder, f"run{number}", rows + np.array([0.0, number, 0.0, 0.0]), heads)
    return folder


def describe(folder: Path, *words: str) -> tuple[int, str]:
    given = [
        "records",
        "describe",
        str(folder),
        "--deck",
        DECK,
        "--out",
        str(folder / "records.toml"),
        *words,
    ]
    done = CliRunner().invoke(program, given, env={"COLUMNS": "200"})
    return done.exit_code, done.output


def test_a_german_bench_is_read_at_the_first_try(tmp_path: Path) -> None:
    status, text = describe(bench(tmp_path), "--json")
    told = json.loads(text)
    assert status == 0
    assert [column["signals"] for column in told["columns"]] == [
        ["current_sensor.reading"], ["motor_encoder.reading"], ["force_sensor.reading"]
    ]  # fmt: skip
    assert [column["unit"] for column in told["columns"]] == ["mA", "°", "N"]
    assert sorted(told["records"].values()) == ["fit", "fit", "held_out"]
    assert any("was read as cp1252" in remark for remark in told["remarks"])
    assert (
        '[columns."Strom in mA"]\nsignal = "current_sensor.reading"'
        in (tmp_path / "records.toml").read_text()
    )


def test_what_is_not_decided_is_a_finding_and_the_mapping_is_written_all_the_same(tmp_path: Path) -> None:
    status, text = describe(bench(tmp_path, ("Zeit [ms]", "Strom in mA", "Winkel", "Kraft [N]")))
    assert status == 1
    assert "undecided: 'Winkel': its head names no unit" in text
    assert "# 'Winkel': its head names no unit" in (tmp_path / "records.toml").read_text()


def test_a_mapping_beside_its_records_needs_no_option(tmp_path: Path) -> None:
    status, text = describe(bench(tmp_path))
    assert status == 0
    assert text.rstrip().endswith(f"next: nlsdesign fit --deck {DECK} --records {tmp_path}")
    assert "put it beside" not in text
    away = tmp_path / "elsewhere.toml"
    _, text = describe(tmp_path, "--out", str(away))
    assert f"--mapping {away}" in text
