"""The score counts what it says it counts, runs each case once, and goes on after a failure."""

from __future__ import annotations

import json
from dataclasses import replace
from pathlib import Path
from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest

from benchmarks import discrepancy_score
from benchmarks._score_cases import CATALOGUE, PAIRS, TIERS, TRIPLES, Case, cases, known_effects, sample
from benchmarks._score_digest import digest
from benchmarks._score_run import opened, run, write_case
from benchmarks._score_table import table, wilson
from benchmarks._score_truth import covered, true_numbers
from benchmarks._score_yardsticks import Table, f_test, forward_bic
from tests.rig import ACTUATORS, EFFECTS, OUTSIDE_ANY_CATALOGUE
from tests.rig.machines import MACHINES

SINGLE = Case("single", "arm", ("coulomb_friction",), 1.0, 1)


def result(
    tier: str, hidden: list[str], named: list[str], verdict: str = "named", **more: Any
) -> dict[str, Any]:
    row = {
        "case": "+".join(hidden) + str(more), "tier": tier, "hidden": hidden, "verdict": verdict,
        "named": named, "aliases": [[] for _ in named], "closed": 0.9, "ratio": 1.0, "before": 9.0,
        "seconds": 10.0, "cpu_seconds": 10.0, "covered": {}, "yardsticks": {"BIC": named[:1]},
        "probabilities": [None for _ in named],
    }  # fmt: skip
    return row | more


def cells(text: str) -> dict[str, list[str]]:
    """First cell of each row to the others, without per cents and intervals."""
    return {
        row[0]: [cell.partition(" (")[0] for cell in row[1:]]
        for line in text.splitlines()
        if line.startswith("|") and (row := [c.strip() for c in line.strip("|").split("|")])
    }


def test_cases_of_seeds_have_every_tier_and_effect_and_differ() -> None:
    pool = cases(range(200, 204))
    assert len({case.name for case in pool}) == len(pool)
    assert {case.tier for case in pool} == set(TIERS)
    for tier, strength in (("single", 1.0), ("single half", 0.5)):
        own = [c for c in pool if c.tier == tier]
        assert {c.effects[0] for c in own} == set(known_effects()) >= set(EFFECTS) - {"none"}
        assert {c.strength for c in own} == {strength}
        assert {c.machine for c in own if c.effects == ("backlash",)} == set(ACTUATORS)
    assert {c.machine for c in pool if c.tier == "machine clean"} == set(MACHINES)
    assert all(set(c.effects) <= CATALOGUE for c in pool if c.tier not in ("outside",))
    assert not {e for c in pool if c.tier == "outside" for e in c.effects} & CATALOGUE
    assert {e for several in (*PAIRS, *TRIPLES) for e in several} <= CATALOGUE
    assert set(OUTSIDE_ANY_CATALOGUE).isdisjoint(EFFECTS)


def test_a_sample_is_even_over_tiers_and_always_the_same() -> None:
    pool = cases([200, 201])
    chosen = sample(pool, 2 * len(TIERS))
    assert [case.tier for case in chosen] == 2 * list(dict.fromkeys(c.tier for c in pool))
    assert chosen == sample(pool, 2 * len(TIERS))
    singles = [case.effects for case in sample(cases([200, 201], ["single"]), len(known_effects()))]
    assert len(set(singles)) == len(singles), "an effect comes again only after all others"
    assert len(sample(pool, 10**6)) == len(pool)
    assert discrepancy_score.seeds_of("100-102,7") == [100, 101, 102, 7]


def test_the_table_counts() -> None:
    results = [
        result(
            "single", ["coulomb_friction"], ["coulomb_friction"], probabilities=[0.97],
            covered={"coulomb_friction:sliding_effort": [1, 1, 1, True], "motor.inertia": [1, 0.1, 2, False]},
        ),
        result(
            "single", ["cable_friction"], ["load_dependent_friction"], aliases=[["cable_friction"]],
            probabilities=[0.96],
        ),
        result("single", ["backlash"], [], "unknown", closed=0.0),
        result("single", ["current_sensor_bias"], ["constant_torque"]),
        result("pair", ["backlash", "force_sensor_delay"], ["force_sensor_delay", "backlash"]),
        result("pair", ["torque_ripple", "cable_slack"], ["torque_ripple"]),
        result("pair", ["torque_ripple", "cable_slack"], ["torque_ripple", "torque_ripple"]),
        result("clean white", [], [], "none"),
        result("clean spikes", [], ["cable_slack"]),
        result("clean coloured", [], [], "unknown"),
        result("outside", ["load_disturbance"], [], "unknown"),
        result("outside", ["sensor_lowpass"], ["force_sensor_delay"]),
        result("outside", ["external_push"], ["coulomb_friction"], closed=0.1),
        {
            "case": "broken", "tier": "single", "hidden": ["self_heating"], "seconds": 1.0,
            "cpu_seconds": 1.0, "error": "E: why",
        },
    ]  # fmt: skip
    text = table(results)
    rows = cells(text)
    assert rows["singles: first name right"][0] == "2/5"
    assert rows["singles: exactly the right set"][0] == "2/5"
    assert rows["pairs: exactly the right set"][0] == "1/3"
    assert rows["clean: nothing invented"][0] == "2/3"
    assert rows["clean: verdict `none`"][0] == "1/3"
    assert rows["outside the catalogue: not named"][0] == "2/3"
    assert rows["at least 80 % of the closable gap closed, where something was named"][0] == "6/6"
    assert rows["95 % intervals that hold the true value"][0] == "1/2"
    assert rows["single"] == ["5", "2/5", "3/5", "2/5", "1/5", "named 3, unknown 1, failed 1", "10, 10"]
    assert rows["0.95 to 0.99"] == ["2", "0.965", "1/2"]
    assert "Mean probability 0.965, share right 0.500, Brier score 0.461." in text
    assert rows["one effect: right first name"] == ["2/5", "2/4"]
    assert "`broken`: E: why" in text
    assert rows["backlash"] == ["1", "unknown"]


def test_intervals_of_shares_are_those_of_wilson() -> None:
    # Newcombe 1998, table I: 81 of 263 and 0 of 20, method 3.
    assert wilson(81, 263) == pytest.approx((0.2553, 0.3662), abs=1e-4)
    assert wilson(0, 20) == pytest.approx((0.0, 0.1611), abs=1e-4)


@pytest.mark.slow
def test_a_case_that_fails_gives_the_reason() -> None:
    broken = run(replace(SINGLE, effects=("no_such_effect",)))
    assert "no_such_effect" in broken["error"]
    assert broken["case"] == "single:no_such_effect:1:arm:1"
    assert broken["cpu_seconds"] >= 0.0


def test_a_run_goes_on_where_it_was_interrupted(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    out, ran = tmp_path / "score.jsonl", []

    def instant(case: Case, limit: int, yardsticks: bool) -> dict[str, Any]:
        ran.append(case.name)
        return result(case.tier, list(case.effects), list(case.effects), case=case.name, code=digest())

    monkeypatch.setattr(discrepancy_score, "run", instant)
    monkeypatch.setattr(
        discrepancy_score.signal, "signal", lambda *given: None
    )  # of this process, not of the run
    words = ["score", "--seeds", "200", "--tier", "pair", "--processes", "0", "--out", str(out)]
    for count in (2, 4):
        monkeypatch.setattr("sys.argv", [*words, "--sample", str(count)])
        discrepancy_score.main()
    assert len(ran) == len(set(ran)) == 4
    assert [json.loads(line)["case"] for line in out.read_text().splitlines()] == ran
    assert "pairs: exactly the right set | 4/4" in capsys.readouterr().out


@pytest.mark.long_cases("joint", "cam")
@pytest.mark.parametrize(
    ("case", "files", "signals"),
    [
        (Case("three records", "shoulder", ("cable_slack",), 1.0, 2), 3, 3),
        (Case("clean coarse", "joint", (), 0.0, 2, "counts 512"), 6, 2),
    ],
    ids=["cam", "joint"],
)
def test_the_files_of_a_case_are_all_that_is_needed(
    tmp_path: Path, case: Case, files: int, signals: int
) -> None:
    assert write_case(tmp_path, case) == ""
    declared, records = opened(tmp_path)
    assert len(records.records) == files
    assert len(records.signals) == signals
    assert not any("slack" in name for name, _ in declared.parts)


@pytest.mark.slow
def test_the_wrong_number_is_the_declared_one(tmp_path: Path) -> None:
    case = Case("wrong number", "elbow", (), 0.0, 201)
    path = write_case(tmp_path, case)
    declared, _ = opened(tmp_path)
    part, _, field = path.rpartition(".")
    value = getattr(dict(declared.parts).get(part) or declared.element(part), field).number
    true = true_numbers(case)[1][path]
    assert 0.2 < abs(value / true - 1.0) < 0.75


def test_coverage_compares_with_the_truth_of_the_rig() -> None:
    numbers = {"friction.sliding_effort": (0.5, "N*m", 0.1), "friction.creep_speed": (1.0, "1", 1.0)}
    effect = SimpleNamespace(name="coulomb_friction", parameters=numbers)
    verdict: Any = SimpleNamespace(effects=(effect,), fits=())
    rows = covered(verdict, ({("coulomb_friction", "sliding_effort"): 0.69}, {}))
    assert rows == {"coulomb_friction:friction.sliding_effort": [0.5, 0.1, 0.69, True]}
    rows = covered(verdict, ({("coulomb_friction", "sliding_effort"): 0.70}, {}))
    assert rows["coulomb_friction:friction.sliding_effort"][3] is False
    sizes, declared = true_numbers(SINGLE)
    assert sizes[("coulomb_friction", "sliding_effort")] > 0.0
    assert declared["motor.inertia"] == pytest.approx(ACTUATORS["arm"].drivetrain.inertia, rel=0.061)


def test_yardsticks_name_what_is_there_and_only_that_on_noise() -> None:
    draw = np.random.default_rng(5)
    columns = {name: draw.normal(size=(2000, 1)) for name in ("a", "b", "c")}
    noise = draw.normal(size=2000)
    there = Table({"motor": noise + 3.0 * columns["b"][:, 0]}, {"motor": columns})
    assert f_test(there) == ["b"]
    assert forward_bic(there) == ["b"]
    assert forward_bic(Table({"motor": noise}, {"motor": columns})) == []
    with pytest.raises(KeyError):
        f_test(Table({"spring": noise}, {"motor": columns}))
