"""``nlsdesign analyse loop``: numbers, findings, files, exit status."""

from __future__ import annotations

import json
import math
from pathlib import Path

import numpy as np
import pytest
from click.testing import CliRunner

from nlsdesign.cli.analyse import loop
from nlsdesign.cli.options import controller_of
from nlsdesign.components import declare, with_moved_load
from nlsdesign.feedback.control import (
    ClosedLoop,
    LoopVerdict,
    ScheduledTorque,
    cascade_loops,
    sine_response,
)
from nlsdesign.feedback.control.evaluation import whole_evaluation
from nlsdesign.feedback.control.evaluation.whole_evaluation import stretches
from nlsdesign.feedback.control.laws.known_drive import only_side
from nlsdesign.foundation.deck import load_deck
from nlsdesign.model import flatten
from tests.command_line import two_machines
from tests.undrawn import undrawn

__all__ = ["two_machines", "undrawn"]
pytestmark = pytest.mark.usefixtures("undrawn")
FINGER = str(Path(__file__).parents[3] / "models" / "templates" / "one-sided-finger.toml")


def loops(deck: str) -> tuple[ClosedLoop, ClosedLoop]:
    machine = declare(load_deck(deck))
    return cascade_loops(
        flatten(machine), flatten(with_moved_load(machine)), delay=1, sample_time=1e-3, gains=None
    )


@pytest.fixture
def five_frequencies(monkeypatch: pytest.MonkeyPatch) -> None:
    """A quarter of the sines, and none that takes ten seconds."""
    monkeypatch.setattr(whole_evaluation, "FREQUENCIES", (0.5, 11.0, 5))


@pytest.fixture
def two_frequencies(monkeypatch: pytest.MonkeyPatch) -> None:
    """Few sines, where responses are not looked at."""
    monkeypatch.setattr(whole_evaluation, "FREQUENCIES", (2.0, 8.0, 2))


def run(out: Path, *options: str) -> tuple[int, dict]:
    result = CliRunner().invoke(loop, [*options, "--out", str(out), "--json"])
    assert result.exception is None or isinstance(result.exception, SystemExit), result.output
    return result.exit_code, json.loads(result.stdout)


# The command in the next test; where a loop begins to limit-cycle: test_loop_onset.py, test_loop_verdict.py.
@pytest.mark.slow
@pytest.mark.usefixtures("five_frequencies", "two_machines")
def test_a_loop_that_limit_cycles_is_a_finding_with_the_gain_where_it_begins(tmp_path: Path) -> None:
    options = ("--deck", "austin2015_figure_consistent", "--proportional", "70 rad/s/N/m",
               "--amplitude", "2.8 N*m")  # fmt: skip
    status, found = run(tmp_path, *options)
    assert status == 1
    assert not found["stable"]
    assert any(line.startswith("2.8 N·m held: limit cycle of ±") for line in found["findings"])
    # The sine limit-cycles at nearly all frequencies, which is one finding with their range.
    (sine,) = [line for line in found["findings"] if line.startswith("sine of ")]
    assert sine.startswith("sine of ±2.8 N·m at 0.5 to 5.08 Hz (4 of 5 frequencies): limit cycle of ±0.1")
    (onset,) = found["onset"]
    # Of the loop that export writes, with its velocity loop of 45 Hz; the linear one has no friction.
    assert onset["value"] == pytest.approx(52.4, rel=0.05)
    assert onset["linear"] == pytest.approx(47.9, rel=0.05)
    (response,) = found["responses"]
    lost = [v is None for v in response["magnitude_dB"]]
    assert any(lost)
    assert lost == [not text.startswith("settled") for text in response["verdicts"]]
    for name in ("responses", "impedance", "margins", "coupled_stability"):
        assert "<svg" in (tmp_path / f"{name}.svg").read_text("utf-8")
    assert (
        (tmp_path / "responses.csv")
        .read_text("utf-8")
        .startswith("amplitude [N*m],offset [N*m],frequency [Hz],")
    )


@pytest.mark.slow
@pytest.mark.long_cases("austin2015_figure_consistent")
@pytest.mark.parametrize("deck", ["austin2015_stiff_spring", "austin2015_figure_consistent"])
@pytest.mark.usefixtures("two_frequencies", "two_machines")
def test_the_default_has_a_margin_and_the_controller_is_that_of_export(deck: str, tmp_path: Path) -> None:
    """Where no gain is stated: 6 dB and 30° over the spread, and machines settle after a kick."""
    _, found = run(tmp_path, "--deck", deck, "--amplitude", "0.5 N*m")
    assert not [line for line in found["findings"] if "spread" in line]
    spread = found["margins_over_spread"]
    assert spread["gain"] == "controller.bandwidth"
    assert spread["value_with_6_dB_30_deg"] == spread["value"]
    assert spread["limit_cycling_after_kick"] == 0.0
    plant = loops(deck)[0].plant
    exported, margins = controller_of(plant, 1e-3, law="scheduled", bandwidth=None, velocity_bandwidth=None)
    judged, _ = cascade_loops(plant, plant, delay=1, sample_time=1e-3, law=ScheduledTorque())
    assert judged.controller.values == exported.values
    assert margins.startswith(f"controller.bandwidth 12 has {spread['kept_by_95_percent_dB_deg'][0]:.2g} dB")


def test_frequencies_side_by_side_with_one_verdict_share_a_finding() -> None:
    def ended(state: str, size: float, frequency: float, share: float) -> LoopVerdict:
        return LoopVerdict(state, size, frequency, share, 20.0, 0.05)

    settled, none = ended("settled", 0.01, math.nan, 0.0), ended("no answer", 0.0, math.nan, 0.0)
    swings = [ended("limit cycle", size, 40.0, share) for size, share in ((0.1, 0.5), (1.0, 1.0))]
    frequencies = [0.1, 0.2, 0.4, 0.8, 1.6, 3.2]
    found = dict(stretches(frequencies, [swings[0], swings[1], settled, swings[0], none, none]))
    assert found == {
        "0.1 to 0.2 Hz (2 of 6 frequencies)": "limit cycle of ±0.1 to 1 N·m at 40 Hz, current up to 20 A, "
        "50 to 100 % of the time at the current limit",
        "0.8 Hz": str(swings[0]),
        "1.6 to 3.2 Hz (2 of 6 frequencies)": "no answer",
    }


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


def test_a_spring_of_one_sign_is_swung_about_a_bias_and_silence_is_no_answer() -> None:
    fixed, _ = loops(FINGER)
    side = only_side(fixed.plant)
    assert abs(side) == 1.0
    size, at = 0.02, [5.0]
    silent = sine_response(fixed, amplitude=size, frequencies=at, offset=-1.5 * side * size)
    assert [str(v) for v in silent.verdicts] == ["no answer"]
    assert np.all(np.isnan(silent.decibel))
    biased = sine_response(fixed, amplitude=size, frequencies=at, offset=1.25 * side * size)
    assert [v.state for v in biased.verdicts] == ["settled"]
    assert np.all(np.isfinite(biased.decibel))


def test_a_spring_of_both_signs_needs_no_bias() -> None:
    fixed, _ = loops("austin2015_soft_spring")
    assert only_side(fixed.plant) == 0.0


@pytest.mark.slow
def test_the_loop_of_a_finger_is_judged_on_the_side_that_pulls(tmp_path: Path) -> None:
    status, found = run(tmp_path, "--deck", FINGER)
    assert status in (0, 1)
    for response in found["responses"]:
        assert abs(response["offset_Nm"]) == pytest.approx(1.25 * response["amplitude_Nm"])
        for value, text in zip(response["magnitude_dB"], response["verdicts"], strict=True):
            assert isinstance(value, float) == text.startswith("settled")
    table = (tmp_path / "responses.csv").read_text("utf-8")
    assert "inf" not in table
    assert ",-0," not in table
