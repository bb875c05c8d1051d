"""``nlsdesign analyse loop``: numbers, findings, files, exit status."""

from __future__ import annotations

import json
from pathlib import Path

import pytest
from click.testing import CliRunner

from nlsdesign.cli.analyse_loop import loop


def run(out: Path, *options: str) -> tuple[int, dict]:
    result = CliRunner().invoke(loop, [*options, "--out", str(out), "--json"])
    assert result.exception is None or isinstance(result.exception, SystemExit), result.output
    return result.exit_code, json.loads(result.stdout)


def test_a_loop_that_limit_cycles_is_a_finding_with_the_gain_where_it_begins(tmp_path: Path) -> None:
    options = ("--deck", "austin2015_figure_consistent", "--proportional", "70 rad/s/N/m",
               "--amplitude", "2.8 N*m")  # fmt: skip
    status, found = run(tmp_path, *options)
    assert status == 1
    assert not found["stable"]
    assert any(line.startswith("2.8 N·m held: limit cycle of ±") for line in found["findings"])
    (onset,) = found["onset"]
    assert onset["value"] == pytest.approx(38.1, rel=0.05)
    assert onset["linear"] == pytest.approx(37.5, rel=0.05)
    (response,) = found["responses"]
    lost = [v is None for v in response["magnitude_dB"]]
    assert any(lost)
    assert lost == [not text.startswith("settled") for text in response["verdicts"]]
    for name in ("responses", "impedance", "margins", "coupled_stability"):
        assert "<svg" in (tmp_path / f"{name}.svg").read_text("utf-8")
    assert (tmp_path / "responses.csv").read_text("utf-8").startswith("amplitude [N*m],frequency [Hz],")


@pytest.mark.slow
def test_a_gentle_loop_on_a_linear_spring_has_no_finding(tmp_path: Path) -> None:
    status, found = run(tmp_path, "--deck", "austin2015_soft_spring", "--amplitude", "0.8 N*m")
    assert status == 0
    assert found["stable"]
    assert found["findings"] == []
    assert "no limit cycle" in found["onset"][0]["words"]
    assert min(v for v in found["margins"][0]["gain_dB"]) > 3.0


def test_bad_input_writes_nothing(tmp_path: Path) -> None:
    out = tmp_path / "none"
    result = CliRunner().invoke(
        loop, ["--deck", "austin2015_soft_spring", "--amplitude", "9 N*m", "--out", str(out)]
    )
    assert "is more than the drive can hold, 4.3" in str(result.exception)
    assert not out.exists()
    result = CliRunner().invoke(loop, ["--deck", "vhb4910_specimen", "--out", str(out)])
    assert "needs" in str(result.exception)
    assert not out.exists()
