"""A servo with a weight and a torque-driven pendulum, measured: blocks, refit, and what is missing."""

from __future__ import annotations

import os
import re
from pathlib import Path

import numpy as np
import pytest

from nlsdesign.bench.discrepancy.tearing import blocks_of
from nlsdesign.bench.identification import RecordSet, load_records
from nlsdesign.bench.identification.equation_error.evidence import Bench
from nlsdesign.bench.identification.least_squares import Fit, fit
from nlsdesign.bench.identification.parameters import declared_parameter
from nlsdesign.cli.studies import claims, run_study
from nlsdesign.components import (
    Assembly,
    CoulombFriction,
    LoadFriction,
    StribeckFriction,
    tie,
)
from nlsdesign.components.assembly.deck_writer import declare
from nlsdesign.foundation.deck import load_deck
from nlsdesign.foundation.quantity import Quantity
from nlsdesign.model import flatten

SHARED = os.environ.get("NLSDESIGN_SHARED", "")
STUDIES = Path(__file__).parents[2] / "studies"
# The measurements are no part of the project: they may not travel with it.
measured = pytest.mark.skipif(not SHARED, reason="NLSDESIGN_SHARED does not name the folder of measurements")


def guess(value: float, unit: str) -> Quantity:
    return Quantity(value, unit, "order of magnitude", 3.0)


def records(name: str, declared: Assembly, folder: Path, change: dict[str, str]) -> RecordSet:
    text = (STUDIES / f"{name}_records.toml").read_text(encoding="utf8")
    for old, new in change.items():
        text = re.sub(old, new, text, flags=re.DOTALL)
    (folder / "records.toml").write_text(text, encoding="utf8")
    data = Path(SHARED) / "measured" / name
    return load_records(data, flatten(declared), mapping=folder / "records.toml")


def fitted(bench: Bench, made: Assembly) -> tuple[float, Fit]:
    """Mean square of the balance in noise floors, and the fit."""
    (block,) = blocks_of(flatten(made), bench.records.signals)
    parameters = [declared_parameter(v) for v in block.model.parameters if v.spread]
    start = {p.name: p.start for p in parameters}
    driven = bench.driven(block, list(start), start)
    best = fit(bench.evidence(driven, bench.records.records, start), parameters)
    evidence = bench.evidence(driven, bench.records.records, best.values)
    return float(np.mean(np.concatenate([e.residual(best.values)[0] for e in evidence]) ** 2)), best


def test_the_decks_give_one_balance_each_and_the_servo_a_block_of_its_controller() -> None:
    servo, pendulum = (flatten(declare(load_deck(n))) for n in ("xl330_pendulum", "dfki_pendulum"))
    signals = ["encoder.reading", "servo.goal", "servo.wanted_voltage"]
    names = [(b.name, b.target) for b in blocks_of(servo, signals)]
    assert names == [("servo.wanted_voltage", "servo.wanted_voltage"), ("servo", None)]
    (block,) = blocks_of(pendulum, ["encoder.reading", "arm.torque"])
    assert (block.name, block.unit) == ("arm", "N*m")


@measured
def test_the_servo_lacks_friction_in_proportion_to_its_load_and_no_stribeck(tmp_path: Path) -> None:
    declared = declare(load_deck("xl330_pendulum"))
    without_goal = {r"\[columns.goal_rad\].*": ""}  # of other gains than the deck's
    bench_records = records("xl330", declared, tmp_path, without_goal)
    bench = Bench(bench_records, blocks_of(flatten(declared), bench_records.signals))
    coulomb = CoulombFriction(sliding_effort=guess(0.05, "N*m")).smooth()
    stribeck = StribeckFriction(
        sliding_effort=guess(0.05, "N*m"), breakaway=guess(0.05, "N*m"), stribeck_speed=guess(0.3, "rad/s")
    ).smooth()
    weight = LoadFriction(members=(("held", declared.element("weight")),), ratio=guess(0.3, "1")).smooth()
    linear, _ = fitted(bench, declared)
    dry, _ = fitted(bench, declared.with_part("dry", tie(coulomb, "servo")))
    falling, _ = fitted(bench, declared.with_part("dry", tie(stribeck, "servo")))
    loaded, best = fitted(bench, declared.with_part("weight", tie(weight, "servo")))
    assert loaded < 0.5 * linear
    assert loaded < 0.6 * dry
    assert falling > 0.99 * dry
    assert 0.25 < best.values["weight.ratio"] < 0.45
    assert best.values["servo.inertia"] == pytest.approx(0.0065, rel=0.1)


@measured
def test_the_pendulum_has_the_same_inertia_and_friction_at_every_rate(tmp_path: Path) -> None:
    declared = declare(load_deck("dfki_pendulum"))
    coulomb = CoulombFriction(sliding_effort=guess(0.15, "N*m")).smooth()
    rubbing = declared.with_part("dry", tie(coulomb, "arm"))
    results = []
    for rate in (500, 200, 100):
        resampled = {"resample_Hz = [0-9.]+": f"resample_Hz = {rate}"}
        seen = records("dfki_pendulum", declared, tmp_path, resampled)
        bench = Bench(seen, blocks_of(flatten(declared), seen.signals))
        without, _ = fitted(bench, declared)
        with_it, best = fitted(bench, rubbing)
        assert with_it < 0.4 * without
        results.append((best.values["arm.inertia"], best.standard_error("arm.inertia")))
        assert 0.13 < best.values["dry.sliding_effort"] < 0.2
    (first, error), *others = results
    for inertia, other in others:
        assert abs(inertia - first) < error + other
        assert abs(inertia - first) < 0.02 * first


@measured
@pytest.mark.slow
def test_the_closed_loop_at_a_gain_held_out_keeps_its_claims(tmp_path: Path) -> None:
    results, expected = run_study("xl330", tmp_path), claims("xl330")
    assert set(results) == set(expected)
    for key, claim in expected.items():
        assert claim.holds(results[key]), (key, results[key], claim)
    assert results["load_friction_error_mrad"] <= 51.0
    assert results["load_friction_error_mrad"] < 0.8 * results["linear_error_mrad"]


def test_without_the_measurements_the_study_says_why_it_has_no_result(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    monkeypatch.delenv("NLSDESIGN_SHARED", raising=False)
    assert run_study("xl330", tmp_path) == {}
    assert "skipped: The measurements 'xl330'" in capsys.readouterr().out
