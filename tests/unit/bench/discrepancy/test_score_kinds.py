"""The score by kind of machine counts what it says, and knows the code that it was counted with."""

from __future__ import annotations

import json
import shutil
from pathlib import Path
from typing import Any

import pytest

from benchmarks import discrepancy_score
from benchmarks._score_cases import KIND_TIERS, PAIRS, Case, sample
from benchmarks._score_digest import DECIDING, counted_with, digest, shape
from benchmarks._score_kinds import all_kinds, kind_cases, kind_of, kind_table, named_with_place
from benchmarks._score_table import exact
from benchmarks._score_truth import true_numbers
from tests.rig import ACTUATORS
from tests.rig.kind_cases import CONDITIONS, names_of
from tests.rig.kinds import KINDS

CLEAN, SINGLE, HALF, PAIR, OTHER = KIND_TIERS


def result(tier: str, machine: str, hidden: list[str], named: list[str], **more: Any) -> dict[str, Any]:
    row = {
        "case": f"{tier}{machine}{hidden}{more}", "tier": tier, "machine": machine, "hidden": hidden,
        "named": named, "verdict": "named" if named else "none", "probabilities": [0.9 for _ in named],
        "covered": {}, "seconds": 4.0, "cpu_seconds": 4.0, "code": "abc",
    }  # fmt: skip
    return row | more


def test_cases_go_round_over_effects_conditions_and_kinds() -> None:
    pool = kind_cases(range(20), all_kinds())
    assert len({case.name for case in pool}) == len(pool) == 20 * 6 * len(all_kinds())
    assert {"mujoco_motor", "mujoco_tendon", "mujoco_gear", "specimen"} < set(all_kinds())
    for kind in (KINDS[name] for name in all_kinds() if name in KINDS):
        own = [case for case in pool if case.machine == kind.name]
        assert {c.effects[0] for c in own if c.tier == SINGLE} == set(kind.effects)
        assert {c.effects[0] for c in own if c.tier == HALF} == set(kind.effects)
        assert {c.effects for c in own if c.tier == PAIR} == set(kind.pairs)
        assert {c.effects[0] for c in own if c.tier == OTHER} == set(kind.not_listed)
        assert {c.noise for c in own if c.tier == CLEAN} == set(CONDITIONS)
        assert not any(c.noise == "coarse" and "torque_ripple" in c.effects for c in own)
    few = sample(pool, len(KIND_TIERS) * len(all_kinds()))
    assert {(c.tier, kind_of(c.machine)) for c in few} == {(c.tier, kind_of(c.machine)) for c in pool}
    cam = [case for case in pool if kind_of(case.machine) == "cam"]
    assert {case.machine for case in cam} == set(ACTUATORS)
    assert {case.effects for case in cam if case.tier == PAIR} == set(PAIRS)
    assert discrepancy_score.seeds_of("0:3,7") == [0, 1, 2, 7]


def test_machines_may_be_under_a_cascade_instead() -> None:
    usual, cascaded = (kind_cases([3], all_kinds(), cascaded=each) for each in (False, True))
    assert {c.noise for c in cascaded} == {"cascaded"}
    assert [(c.tier, c.machine, c.effects) for c in cascaded] == [
        (c.tier, c.machine, c.effects) for c in usual if c.machine in KINDS
    ]


def test_a_name_holds_at_its_body_only() -> None:
    case = Case(SINGLE, "elastic_joint", ("joint_coulomb_friction",), 1.0, 1)
    names = names_of("elastic_joint", 1)
    at_load = named_with_place(case, "coulomb_friction", names["load"])
    at_motor = named_with_place(case, "coulomb_friction", names["motor"])
    assert exact({"hidden": ["joint_coulomb_friction"]}, [at_load])
    assert not exact({"hidden": ["joint_coulomb_friction"]}, [at_motor])
    assert not exact({"hidden": ["coulomb_friction"]}, [at_load])
    assert exact({"hidden": ["coulomb_friction", "joint_coulomb_friction"]}, [at_motor, at_load])
    disc = named_with_place(case, "angle_sensor_eccentricity", names["load_encoder"])
    assert exact({"hidden": ["joint_eccentricity"]}, [disc])
    one_body = Case(SINGLE, "geared_joint", (), 1.0, 1)
    assert named_with_place(one_body, "gravity_load", names["arm"]) == "gravity_load"


def test_true_numbers_come_from_the_machine_as_built() -> None:
    sizes, numbers = true_numbers(Case(SINGLE, "belt_axis", ("joint_coulomb_friction",), 1.0, 4))
    assert sizes == {("coulomb_friction", "sliding_effort"): pytest.approx(0.08)}
    names, plant = names_of("belt_axis", 4), KINDS["belt_axis"].plant
    assert numbers[f"{names['spring']}.stiffness"] == pytest.approx(plant.stiffness, rel=0.061)
    both = ("coulomb_friction", "joint_coulomb_friction")
    assert true_numbers(Case(PAIR, "belt_axis", both, 1.0, 4))[0] == {}


def test_the_table_by_kind_counts() -> None:
    results = [
        result(CLEAN, "belt_axis", [], []),
        result(CLEAN, "belt_axis", [], ["drive_delay"]),
        result(SINGLE, "belt_axis", ["joint_coulomb_friction"], ["coulomb_friction@load"],
               covered={"a": [1, 1, 1, True], "b": [1, 1, 9, False]}),
        result(SINGLE, "belt_axis", ["backlash"], ["backlash", "drive_delay"]),
        result(PAIR, "belt_axis", ["backlash", "coulomb_friction"], [], verdict="unknown"),
        result(OTHER, "mujoco_gear", ["external_push"], [], verdict="unknown"),
        {"case": "x", "tier": HALF, "machine": "mujoco_gear", "hidden": ["backlash"], "cpu_seconds": 1.0,
         "error": "E: why"},
    ]  # fmt: skip
    rows = [
        [cell.partition(" (")[0].strip() for cell in line.strip("|").split("|")]
        for line in kind_table(results)
        if line.startswith("|")
    ]
    belt = next(row for row in rows if row[0] == "belt_axis")
    assert belt == ["belt_axis", "1/2", "1/2", "–", "0/1", "–", "0.410 of 4", "1/2", "0 of 5", "4, 4"]
    gear = next(row for row in rows if row[0] == "mujoco_gear")
    assert gear == ["mujoco_gear", "–", "–", "0/1", "–", "1/1", "–", "–", "1 of 2", "2, 4"]
    assert ["belt_axis", "", "drive_delay", "1"] in rows
    assert ["mujoco_gear", "backlash", "failed: E: why", "1"] in rows
    titles = [line for line in kind_table(results) if line.startswith("**")]
    assert titles == ["**Machines of `tests/rig`**", "**Machines in MuJoCo**"]


def test_a_result_of_other_code_is_counted_again(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    out, table, ran = tmp_path / "kinds.jsonl", tmp_path / "page.md", []

    def instant(case: Case, limit: int, yardsticks: bool) -> dict[str, Any]:
        ran.append(case.name)
        assert not yardsticks
        return result(case.tier, case.machine, list(case.effects), [], case=case.name, code=digest())

    monkeypatch.setattr(discrepancy_score, "run", instant)
    monkeypatch.setattr(discrepancy_score.signal, "signal", lambda *given: None)
    words = ["score", "--kinds", "belt_axis", "--seeds", "0:1", "--processes", "0", "--out", str(out)]
    monkeypatch.setattr("sys.argv", [*words, "--table", str(table)])
    discrepancy_score.main()
    assert len(ran) == 6
    assert counted_with(table) == [digest()]
    lines = [json.loads(line) for line in out.read_text().splitlines()]
    lines[2]["code"] = "0123456789ab"
    out.write_text("".join(json.dumps(line) + "\n" for line in lines))
    discrepancy_score.main()
    assert ran[6:] == [lines[2]["case"]]
    assert counted_with(table) == [digest()], "what was counted with other code is not in the table"


def test_the_digest_knows_a_clause_from_a_comment(tmp_path: Path) -> None:
    for folder in DECIDING:
        (tmp_path / folder).mkdir(parents=True)
    rule = tmp_path / DECIDING[0] / "rule.py"
    text = '"""A rule."""\n\n\ndef holds(share):\n    """Say so."""\n    return share > 0.5\n'
    rule.write_text(text)

    def now() -> str:
        return digest.__wrapped__(tmp_path)

    before = now()
    rule.write_text(
        text.replace("    return", "    # half of it\n\n    return").replace("A rule.", "A clause.")
    )
    assert now() == before
    for changed in (
        ("> 0.5", ">= 0.5"),
        ("0.5", "0.6"),
        ("holds", "keeps"),
        ("(share)", "(share, more=None)"),
    ):
        rule.write_text(text.replace(*changed))
        assert now() != before, changed
    rule.write_text(text)
    shutil.copy(rule, rule.with_name("more.py"))
    assert now() != before
    assert shape("x = 1") != shape("x = '1'")


@pytest.mark.slow
def test_the_page_was_counted_with_the_code_of_today(root: Path) -> None:
    counted = counted_with(root / "docs" / "scores.md")
    assert counted == [digest()], (
        "docs/scores.md was counted with other code; count again: python -m benchmarks.discrepancy_score "
        "--kinds all --seeds A:B --out kinds.jsonl --table docs/scores.md"
    )
