"""Machines that lack nothing, under digital controllers: how currents run between samples, and modes."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path
from typing import Any, cast

import pytest

from benchmarks._score_run import opened
from nlsdesign.bench.discrepancy import diagnose, effects
from nlsdesign.bench.discrepancy.case import Case, blocks_of
from nlsdesign.bench.discrepancy.effects.effect import Candidate
from nlsdesign.bench.discrepancy.selection.hypothesis import Hypothesis
from nlsdesign.bench.identification.equation_error import block_noise
from nlsdesign.bench.identification.equation_error.evidence import Bench
from nlsdesign.bench.identification.equation_error.inferred_sampling import no_terms, plain_terms
from nlsdesign.components import Fixed
from nlsdesign.components.assembly.named_parts import assembly
from nlsdesign.model import flatten
from tests.rig.kind_cases import write_kind_case

LATE = {"belt_axis": 0.25, "elastic_joint": 0.1}
"""Samples by which a current that is held for a tick acts late where a row has two ticks, or five."""


@pytest.fixture(scope="module")
def joint(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """Folder of a clean joint whose controller is slow."""
    folder = tmp_path_factory.mktemp("joint")
    write_kind_case(folder, "elastic_joint", (), 0.0, 1103, condition="slow")
    return folder


@pytest.mark.long_cases("rack_carriage-1100-plain", "belt_axis-1103-slow", "elastic_joint-1103-slow")
@pytest.mark.parametrize(
    ("kind", "seed", "condition"),
    [("rack_carriage", 1100, "plain"), ("belt_axis", 1103, "slow"), ("elastic_joint", 1103, "slow")],
)
def test_a_clean_machine_whose_current_is_held_gets_no_name(
    kind: str, seed: int, condition: str, joint: Path, tmp_path: Path
) -> None:
    """A spring's force that acts late looks like its damping: a drifting clock, a resonance were named."""
    if kind != "elastic_joint":
        write_kind_case(tmp_path, kind, (), 0.0, seed, condition=condition)
    verdict = diagnose(*opened(joint if kind == "elastic_joint" else tmp_path))
    assert (verdict.verdict, verdict.effects) == ("none", ())
    assert any("nothing says how it runs between its samples" in remark for remark in verdict.remarks)


@pytest.mark.long_cases("belt_axis")
@pytest.mark.parametrize("kind", LATE)
def test_numbers_that_blocks_share_tell_when_a_current_acts(kind: str, joint: Path, tmp_path: Path) -> None:
    if kind != "elastic_joint":
        write_kind_case(tmp_path, kind, (), 0.0, 1103, condition="slow")
    declared, records = opened(joint if kind == "elastic_joint" else tmp_path)
    blocks = blocks_of(flatten(declared), records.signals)
    bench = Bench(records, blocks)
    plainly, nothing_missing = (
        next(c.sampling.late for c in told.columns if c.sampling and c.signal == "amplifier_reading.reading")
        for told in (bench.inferred(blocks), bench.inferred(blocks, no_terms))
    )
    assert nothing_missing == pytest.approx(LATE[kind], abs=0.01)
    assert plainly == 0.0, "terms that may be missing take what tells it"


@pytest.mark.parametrize("let_pass", [block_noise._BLURRED, 1e9])
def test_a_span_of_rates_leaves_what_a_damped_mode_does(
    let_pass: float, joint: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """A span of 1.3 periods of the mode takes most of its rate, and so of what the spring's damping does."""
    monkeypatch.setattr(block_noise, "_BLURRED", let_pass)
    declared, records = opened(joint)
    blocks = blocks_of(flatten(declared), records.signals)
    filters = {name: read.filters for name, read in Bench(records, blocks).block_noise.items()}
    own = filters["table_side"].span
    assert own < 0.1 if let_pass < 1.0 else own > 0.15
    assert filters["axis_1"].span > 0.15, "behind the noise of the current nothing of it is seen"


@pytest.mark.slow
def test_a_span_of_rates_leaves_what_a_damping_does_that_nobody_declared(tmp_path: Path) -> None:
    """A span of a third of a period took a hundredth of the rate, and 2.4 times the noise was left."""
    write_kind_case(tmp_path, "elastic_joint", ("spring_damping",), 1.0, 1286)
    verdict = diagnose(*opened(tmp_path), catalogue=(effects.spring_damping, effects.second_relaxation))
    assert [(each.name, verdict.complete) for each in verdict.effects] == [("spring_damping", True)]
    gaps = [each for each in verdict.gaps if each.block == "table_side"]
    assert gaps
    assert max(each.after / each.noise_floor for each in gaps) < 1.1


@pytest.mark.slow
def test_a_shift_that_explains_a_third_is_no_answer(tmp_path: Path) -> None:
    """Behind coarse counts friction is little beyond noise; a shift takes a third of it, and hid the name."""
    write_kind_case(tmp_path, "belt_axis", ("load_dependent_friction",), 1.0, 1120, condition="coarse")
    rivals = (effects.load_dependent_friction, effects.coulomb_friction, effects.current_sensor_bias)
    verdict = diagnose(*opened(tmp_path), catalogue=rivals)
    assert [effect.name for effect in verdict.effects] == ["load_dependent_friction"]


@pytest.mark.long_cases("drivetrain_resonance-1170", "backlash-1200")
@pytest.mark.parametrize(("effect", "seed"), [("drivetrain_resonance", 1170), ("backlash", 1200)])
def test_what_a_name_leaves_is_a_shift_within_a_sample_before_it_is_a_fault(
    effect: str, seed: int, tmp_path: Path
) -> None:
    """The effect hides at first that the current is held; a clock that drifts was named for it.

    The resonance is found from a start at half the frequency of the quickest motion.
    """
    write_kind_case(tmp_path, "elastic_joint", (effect,), 1.0, seed)
    rivals = (getattr(effects, effect), effects.clock_drift)
    verdict = diagnose(*opened(tmp_path), catalogue=rivals)
    assert [each.name for each in verdict.effects] == [effect]
    assert verdict.complete


def test_a_lag_is_not_what_inputs_are_read_beside() -> None:
    """It may stand for the shift itself, and would hide it for good."""
    asked = list[str]()

    class Asked(Case):
        def _read_beside(self, hypothesis: Hypothesis, lacks: object) -> Case | None:
            assert lacks is plain_terms
            asked.append(hypothesis.newest.effect)
            return self

    case = Asked(cast(Any, None), cast(Any, None), cast(Any, None), cast(Any, None))
    blank = assembly("blank", load=Fixed())
    friction, lag = (
        Hypothesis(blank, (Candidate(name, "motor", blank, (), "sign", "source", explains_lag=late),))
        for name, late in (("friction", False), ("delay", True))
    )
    assert (case.is_read_otherwise_beside(friction), case.is_read_otherwise_beside(lag)) == (True, False)
    assert not replace(case, settled=True).is_read_otherwise_beside(friction), "once is enough"
    assert asked == ["friction"]


@pytest.mark.slow
def test_a_drift_that_imitates_half_a_sample_is_no_name(tmp_path: Path) -> None:
    """Behind coarse counts the hold of a current is not told; 0.26 ms in a second imitate half a sample."""
    write_kind_case(tmp_path, "rack_carriage", ("spring_damping",), 1.0, 1198, condition="coarse")
    verdict = diagnose(*opened(tmp_path), catalogue=(effects.spring_damping, effects.clock_drift))
    assert [each.name for each in verdict.effects] == ["spring_damping"]


def test_a_wrong_number_that_a_refit_takes_is_mentioned(tmp_path: Path) -> None:
    """Records of a motor tell inertia over torque constant: a wrong inertia moves both, each by half."""
    write_kind_case(tmp_path, "direct_drive", (), 0.0, 1286)
    declared, records = opened(tmp_path)
    inertia = next(name for name in declared.quantities() if name.endswith(".inertia"))
    verdicts = {1.0: "none", 1.4: "data_suspect"}
    for factor, expected in verdicts.items():
        wrong = declared.with_values({inertia: factor * declared.quantities()[inertia].number})
        verdict = diagnose(wrong, records, catalogue=())
        assert verdict.verdict == expected
        assert (verdict.headline() == "Deck and records contradict each other") == (factor > 1.0)
        assert any(f"{inertia} 2." in words and "below" in words for words in verdict.findings) == (
            factor > 1.0
        )


@pytest.mark.slow
@pytest.mark.parametrize(("hidden", "named"), [("soft_centre", "soft_windup"), ("backlash", "backlash")])
def test_a_soft_middle_is_no_dead_zone(hidden: str, named: str, tmp_path: Path) -> None:
    """The bench lacks stiffness as a Gaussian of the motion, the law as one over a squared cosh."""
    write_kind_case(tmp_path, "belt_axis", (hidden,), 1.0, 1292)
    rivals = (effects.backlash, effects.soft_windup, effects.strain_stiffening)
    verdict = diagnose(*opened(tmp_path), catalogue=rivals)
    assert [each.name for each in verdict.effects] == [named]
