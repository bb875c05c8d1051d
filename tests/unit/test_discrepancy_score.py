"""The score counts what it says it counts, runs each case once, and goes on after a failure."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest

from benchmarks._score_cases import PAIRS, Case, cases, sample
from benchmarks._score_run import run
from benchmarks._score_table import table
from benchmarks._score_yardsticks import Table, f_test, forward_bic
from benchmarks.discrepancy_score import _seeds
from tests.rig import EFFECTS, OUTSIDE_ANY_CATALOGUE


def result(
    kind: str, hidden: list[str], named: list[str], verdict: str = "named", **more: Any
) -> dict[str, Any]:
    found = {
        "case": "+".join(hidden) + str(more), "kind": kind, "hidden": hidden, "verdict": verdict,
        "named": named, "aliases": [[] for _ in named], "closed": 0.9, "ratio": 1.0, "seconds": 10.0,
        "covered": {}, "yardsticks": {"BIC": named[:1]},
    }  # fmt: skip
    return found | more


def test_cases_of_seeds_are_every_effect_at_both_strengths_and_differ() -> None:
    found = cases([100, 101])
    assert len({case.name for case in found}) == len(found)
    singles = [c for c in found if c.kind == "single"]
    assert {(c.effects[0], c.strength) for c in singles} == {
        (e, s) for e in EFFECTS if e != "none" for s in ("weak", "strong")
    }
    assert {c.actuator for c in singles} == {"arm", "wrist"}
    assert sum(c.kind == "clean" for c in found) == 4
    assert set(OUTSIDE_ANY_CATALOGUE).isdisjoint(EFFECTS)
    assert {e for pair in PAIRS for e in pair} <= set(EFFECTS)


def test_a_sample_has_each_effect_once_and_some_of_each_kind_early() -> None:
    found = sample([100, 101, 102], "strong", 4)
    assert len({case.name for case in found}) == len(found) == len(EFFECTS) - 1 + 12
    assert {c.kind for c in found[:12]} == {"single", "clean", "outside", "pair"}
    assert _seeds("100-102,7") == [100, 101, 102, 7]


def test_the_table_counts() -> None:
    results = [
        result(
            "single",
            ["coulomb_friction"],
            ["coulomb_friction"],
            covered={"coulomb_friction": [1, 1, 1, True]},
        ),
        result("single", ["cable_friction"], ["load_dependent_friction"], aliases=[["cable_friction"]]),
        result("single", ["backlash"], [], "unknown", closed=0.0),
        result("pair", ["backlash", "force_sensor_delay"], ["force_sensor_delay", "backlash"]),
        result("pair", ["torque_ripple", "cable_slack"], ["torque_ripple"]),
        result("clean", [], [], "none"),
        result("clean", [], ["cable_slack"]),
        result("outside", ["rubbing_spot"], [], "unknown"),
        {"case": "broken", "kind": "single", "hidden": ["self_heating"], "seconds": 1.0, "error": "E: why"},
    ]
    text = table(results)
    rows = {
        cells[0]: cells[1:]
        for line in text.splitlines()
        if line.startswith("|") and (cells := [c.strip() for c in line.strip("|").split("|")])
    }
    assert rows["single: right first name"] == ["1/3", "1/3"]
    assert rows["single: in the class of the first name"] == ["2/3", "–"]
    assert rows["single: `unknown`"][0] == "1/3"
    assert rows["pair: both and no other"] == ["1/2", "0/2"]
    assert rows["clean: something invented"][0] == "1/2"
    assert rows["outside the catalogue: `unknown`"][0] == "1/1"
    assert "True value inside the 95 % interval: 1/1" in text
    assert "at least 0.8 in 4/5" in text
    assert "`broken`: E: why" in text
    assert rows["backlash"] == ["1", "unknown"]


def test_a_case_that_fails_gives_the_reason() -> None:
    found = run(Case("single", "arm", ("no_such_effect",), "strong", 1), 0, True)
    assert "no_such_effect" in found["error"]
    assert found["case"] == "no_such_effect:strong:arm:1"


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
