"""What a verdict says to people and to programs: words for effects and places, one number in all places."""

from __future__ import annotations

import json
import math
from dataclasses import dataclass, replace
from types import SimpleNamespace
from typing import Any, cast

import numpy as np
import pytest

from nlsdesign.bench.discrepancy import ALL, Verdict
from nlsdesign.bench.discrepancy.diagnose import _runners_up, _strained
from nlsdesign.bench.discrepancy.effects.effect import Candidate
from nlsdesign.bench.discrepancy.effects.plain_names import (
    effect_in_words,
    kind_in_words,
    place_in_words,
    simpler_forms,
    title,
)
from nlsdesign.bench.discrepancy.reporting.circumstances import DiagnosisRun, RecordOfRun, settings_of
from nlsdesign.bench.discrepancy.reporting.named_effect import EffectEvidence, NamedEffect, as_sentence
from nlsdesign.bench.discrepancy.reporting.verdict import Course, RecordGap, in_brief
from nlsdesign.bench.discrepancy.screening.scale_and_sign import _hint
from nlsdesign.bench.discrepancy.selection.hypothesis import Hypothesis
from nlsdesign.bench.discrepancy.selection.measures import DECLARED, Excess
from nlsdesign.bench.discrepancy.selection.search import Outcome
from nlsdesign.bench.discrepancy.selection.trials import Skipped, Tried
from nlsdesign.bench.identification.least_squares import Fit
from nlsdesign.bench.identification.parameters import declared_parameter
from nlsdesign.components import (
    ROTATION,
    Assembly,
    Encoder,
    Fixed,
    Inertia,
    LinearElastic,
    Spring,
    specimen,
    tie,
)
from nlsdesign.components.assembly.named_parts import assembly
from nlsdesign.model import Variable
from nlsdesign.presentation import report
from nlsdesign.presentation.figures.style import alternative_text
from tests.undrawn import undrawn

__all__ = ["undrawn"]
pytestmark = pytest.mark.usefixtures("undrawn")


def piece() -> Any:
    return specimen(area=1e-4, rest_length=0.05, law=LinearElastic(modulus=1e6))


def machine() -> Assembly:
    return assembly(
        "machine",
        motor=Inertia(inertia=1e-3),
        load=Fixed(),
        spring=tie(Spring(stiffness=2.0, domain=ROTATION), "motor", "load"),
        angle_sensor=Encoder(of="motor.angle", quantum=1e-3),
    )


# --- words ----------------------------------------------------------------------------------------


def test_effects_have_names_without_underscores() -> None:
    names = [title(row.__name__) for row in ALL]
    assert len(set(names)) == len(ALL)
    assert not any("_" in name for name in names)
    assert title("stribeck_friction") == "Stribeck friction", "a person keeps the capital"
    assert title("second_relaxation") == "second relaxation"


def test_places_are_said_with_a_preposition_and_only_as_much_as_is_needed() -> None:
    two = assembly(
        "two",
        body=Inertia(inertia=1e-3),
        left=tie(Spring(stiffness=2.0, domain=ROTATION), "body"),
        wheel_one=Inertia(inertia=1e-3),
    )
    assert place_in_words(two, "left") == "in the left"
    assert place_in_words(two, "wheel_one") == "at the wheel one"
    assert place_in_words(two, "not.there") == "at the there", "a path without a part is put into words alone"


def test_parts_of_the_same_name_are_told_apart_by_what_is_around_them() -> None:
    from nlsdesign.components import TRANSLATION, Mass, parallel

    def spring() -> Spring:
        return Spring(stiffness=2.0, domain=TRANSLATION)

    both = assembly(
        "both", mass=Mass(mass=1.0), left=tie(parallel(rubber=spring(), steel=spring()), "mass"),
        right=tie(parallel(rubber=spring(), brass=spring()), "mass"),
    )  # fmt: skip
    assert place_in_words(both, "left.rubber") == "in the rubber of the left"
    assert place_in_words(both, "left.steel") == "in the steel"
    assert effect_in_words(both, "second_relaxation", "left.steel") == "second relaxation in the steel"


def test_a_place_is_left_out_where_the_effect_has_its_name() -> None:
    assert (
        effect_in_words(machine(), "angle_sensor_eccentricity", "angle_sensor") == "angle sensor eccentricity"
    )
    assert effect_in_words(machine(), "coulomb_friction", "motor") == "Coulomb friction at the motor"


def test_the_kind_of_a_part_is_the_first_phrase_of_its_description() -> None:
    assert kind_in_words(machine(), "angle_sensor") == "incremental encoder"
    assert kind_in_words(machine(), "motor") == "turning body"
    assert kind_in_words(machine(), "nowhere") == ""


def test_the_simpler_form_of_an_effect_comes_from_the_catalogue() -> None:
    assert simpler_forms(machine(), "stribeck_friction") == ("coulomb_friction",)
    assert simpler_forms(machine(), "coulomb_friction") == ()
    assert simpler_forms(machine(), "of my own") == ()


# --- a verdict ------------------------------------------------------------------------------------

TIME = np.linspace(0.0, 1.0, 50)
GAPS = (
    RecordGap("motor", "slow", "fit", 0.30, 0.011, 0.01, 100, "N*m", 1.2, "torque of the drive"),
    RecordGap("motor", "fast", "held_out", 0.26, 0.012, 0.01, 100, "N*m", 0.52, "torque of the drive"),
)
EFFECT = NamedEffect(
    "stribeck_friction", "motor", {"dry_friction.sliding_effort": (0.3748171, "N*m", 4.3e-4)}, ("backlash",),
    0.98, "a torque against the motion", "Stribeck 1902", 0.97,
    EffectEvidence(310.0, 12.0, "sliding_effort", 87.2, "slow", -1.5, (("coulomb_friction", 41.0, 6.0),)),
)  # fmt: skip


@dataclass(frozen=True)
class Rule:
    """A rule.

    Parameters
    ----------
    rate, other
        False discovery rate
        at most.

    Raises
    ------
    Nothing
        At all.
    """

    rate: float = 0.01
    other: int = 3


def verdict(kind: str = "named", **changed: Any) -> Verdict:
    course = Course("fast", "torque of the drive", "N*m", TIME, TIME, 0.74 * TIME, 0.988 * TIME, 0.01)
    effects = (EFFECT,) if kind == "named" else ()
    tried = (("stribeck_friction", 0.999), ("coulomb_friction", 0.97), ("self_heating", 0.001))
    where = ("motor (open): 25.00 times the noise floor on held-out records before, 1.15 after", "A finding.")
    made = Verdict(kind, effects, where, GAPS, "motor", tried, machine(), machine(), course, criteria=Rule())
    return replace(made, **changed)


def test_the_headline_is_in_words() -> None:
    assert verdict().headline() == "Stribeck friction at the motor"
    for kind in ("none", "unknown", "undecidable", "data_suspect"):
        other = verdict(kind)
        assert other.headline()
        assert other.words()
        assert report.verdict_sections(other)


def test_the_gap_is_told_in_times_the_noise_in_the_unit_and_as_a_share_of_the_drive() -> None:
    rows = verdict().gap().rows()
    assert rows == (
        ("26.0", "1.20", "times the noise"),
        ("0.260", "0.0120", "N·m"),
        ("50.0 %", "2.31 %", "of the torque of the drive"),
    )


def test_without_held_out_records_the_error_is_told_as_that_of_the_fitted_ones() -> None:
    gap = verdict(gaps=GAPS[:1]).gap()
    assert (gap.role, gap.rows()[0]) == ("fit", ("30.0", "1.10", "times the noise"))
    assert "on fitted records" in gap.words()


def test_one_held_out_figure_stands_in_all_places(tmp_path: Any) -> None:
    said = verdict()
    before, after = "0.260", "0.0120"
    written = said.to_dict()
    assert written["error"]["held_out"] == {"before": 0.26, "after": 0.012}
    assert written["error"]["signal"] == {"name": "torque of the drive", "rms": 0.52}
    assert any(f"{before} → {after} N·m" in line for line in written["where"])
    assert f"{before} → {after} N·m" in str(said)
    assert "25.00" not in str(said), "a ratio to another floor"
    page = report.write_report(tmp_path / "r.html", *report.verdict_sections(said), title="t").read_text()
    assert f'<span class="before">{before}</span> → <span class="after">{after}</span>' in page
    bars = next(p for p in report.verdict_sections(said)[1].parts if p.title == "Error of each record: motor")  # type: ignore[attr-defined]
    assert f"{before} to {after} N·m" in alternative_text(bars.figure)


def test_where_nothing_was_added_there_is_no_after(tmp_path: Any) -> None:
    same = replace(GAPS[1], after=0.26)
    course = replace(verdict().course, after=verdict().course.before)
    other = verdict("unknown", gaps=(same,), course=course)
    assert "→" not in other.gap().words()
    page = report.write_report(tmp_path / "r.html", *report.verdict_sections(other), title="t").read_text()
    assert 'class="after"' not in page
    assert 'class="shrinking"' not in page
    assert ">after</text>" not in page


def test_an_effect_is_told_with_probability_evidence_and_class() -> None:
    words = verdict().words()
    assert "sliding effort = 0.37482 ± 0.00043 N·m" in words
    assert "Probability 0.97." in words
    assert "their log-likelihood falls by 310 ± 12." in words
    assert "`sliding_effort` is 87.2 standard errors away from no effect" in words
    assert "'slow': there it rises by 1.50." in words
    assert "do not tell it from: backlash." in words


def test_a_verdict_begins_with_three_sentences_for_whoever_stands_at_the_bench(tmp_path: Any) -> None:
    said = verdict()
    assert in_brief(said) == (
        "Stribeck friction at the motor is missing from the deck: sliding effort = 0.37482 ± 0.00043 N·m.",
        "With it the error of `motor` on held-out records falls from 26.0 to 1.20 times the noise.",
        "It is there with a probability of 0.97.",
    )
    assert str(said).splitlines()[1:5] == [*in_brief(said), "In detail:"]
    page = report.write_report(tmp_path / "r.html", *report.verdict_sections(said), title="t").read_text()
    assert page.index("0.97") < page.index("<summary>In detail</summary>") < page.index("310 ± 12")
    second = replace(EFFECT, name="coulomb_friction", probability=0.9)
    both = in_brief(verdict(effects=(EFFECT, second), complete=False))
    assert " and " in both[0]
    assert " are missing from the deck: " in both[0]
    assert both[1].endswith("to 1.20 times the noise, so something without a name is left.")
    assert both[2] == "Each is there with at least probability 0.9."


def test_a_verdict_without_a_name_begins_with_the_error_that_is_left_and_the_next_step() -> None:
    other = verdict("unknown", next_steps=("record a slower motion",))
    assert in_brief(other) == (
        "Something is missing; what was tried and how far it goes is listed below.",
        "The error of `motor` on held-out records is 1.20 times the noise.",
        "Record a slower motion.",
    )
    assert str(other).count("Something is missing; what") == 1
    assert in_brief(verdict("data_suspect", where=("odd: it rests",)))[1] == "odd: it rests."


def test_a_large_gain_is_told_without_a_power_of_ten() -> None:
    assert "falls by 3480." in EffectEvidence(1e5, 2e4, worst_record="slow", worst_change=3478.2).words()


def test_why_the_records_are_suspect_stands_in_the_card(tmp_path: Any) -> None:
    """A reader of the card alone must learn what to look at."""
    same = replace(GAPS[1], after=0.26)
    course = replace(verdict().course, after=verdict().course.before)
    strained = "declared numbers: refitted 2.3 standard deviations of their spread away before, 2.3 after"
    reason = "slow.csv: column 'force_N', rows 5 to 9: rests at 3 for 5 samples: cut the record there"
    said = verdict("data_suspect", where=(strained, reason), gaps=(same,), course=course)
    assert said.headline() == "The records are suspect"
    assert "slow.csv: column 'force_N', rows 5 to 9: rests at 3 for 5 samples" in said.words(), (
        "as it is named"
    )
    assert "refitted 2.3" not in said.words()
    assert str(said).lower().count("rests at 3") == 1, "once"
    page = report.write_report(tmp_path / "r.html", *report.verdict_sections(said), title="t").read_text()
    assert page.count("rests at 3") == 1, "once"
    assert page.index("rests at 3") < page.index("refitted 2.3")


def test_a_declared_number_that_is_wrong_does_not_make_the_records_suspect(tmp_path: Any) -> None:
    wrong = "a declared number is probably wrong: motor.inertia is declared as 2 kg·m², but the records say 1"
    said = verdict("data_suspect", where=(wrong,))
    assert said.headline() == "Deck and records contradict each other"
    assert "records are suspect" not in said.words()
    assert "A declared number is probably wrong: motor.inertia" in said.words()
    page = report.write_report(tmp_path / "r.html", *report.verdict_sections(said), title="t").read_text()
    assert "after, with declared numbers let go." in page
    assert "with what was added. Both" not in page


def test_an_effect_beside_a_contradiction_is_not_said_to_explain_too_little() -> None:
    (first, *_) = verdict("data_suspect").tried_words()
    assert first.endswith("explains 99.9 % of the excess over the noise: deck and records contradict each "
                          "other, so nothing is named.")  # fmt: skip


def test_an_effect_of_several_forms_is_listed_once_with_its_best() -> None:
    tried = (("backlash", 0.5, "too late"), ("backlash", 0.4, "too early"), ("self_heating", 0.3, "too cold"))
    said = verdict("unknown", runners_up=tried)
    assert len(said.tried_words()) == 2
    assert said.tried_words()[0].endswith("too late.")
    shares = next(p for p in report.verdict_sections(said)[1].parts if p.title == "Effects tried first")  # type: ignore[attr-defined]
    labels = [t.get_text() for t in shares.figure.axes[0].get_yticklabels()]
    assert labels == ["self heating", "backlash"]


def test_the_course_of_an_unchanged_model_is_told_in_one_sentence() -> None:
    same = replace(GAPS[1], after=0.26)
    course = replace(verdict().course, after=verdict().course.before)
    other = verdict("unknown", gaps=(same,), course=course)
    captions = [getattr(p, "caption", "") for p in report.verdict_sections(other)[1].parts]  # type: ignore[attr-defined]
    assert any("as the refitted model has it, to which nothing was added. Below" in c for c in captions)


def test_why_the_richer_form_won_is_said() -> None:
    words = verdict().words()
    assert "Coulomb friction, its simpler form, in its place it falls by 41.0 ± 6.0: that is why" in words
    assert "Coulomb friction, its simpler form, alone leaves 3.00 % of the excess" in words
    assert "Stribeck friction 0.100 %" in words
    close = replace(EFFECT, evidence=replace(EFFECT.evidence, over_simpler=(("coulomb_friction", 5.0, 4.0),)))
    assert "is why" not in verdict(effects=(close,)).words()


def test_why_the_simpler_form_won_is_said() -> None:
    simple = replace(EFFECT, name="coulomb_friction")
    (sentence,) = verdict(effects=(simple,)).tried_words()
    assert sentence.startswith("Stribeck friction alone explains 99.9 % of the excess over the noise: ")
    assert sentence.endswith("Coulomb friction, its simpler form, predicts as well.")


def test_what_helped_is_said_even_if_nothing_is_named() -> None:
    text = str(verdict("unknown"))
    assert "Stribeck friction alone explains 99.9 % of the excess over the noise: too little" in text
    assert "Coulomb friction alone explains 97.0 %" in text
    assert "elf heating" not in text, "0.1 % is no help"
    because = verdict("unknown", runners_up=(("backlash", 0.4, "its gap is zero within its error"),))
    assert "explains 40.0 % of the excess over the noise: its gap is zero within its error." in str(because)
    assert because.to_dict()["runners_up"][0]["reason"] == "its gap is zero within its error"


def test_what_explains_nothing_is_no_runner_up() -> None:
    blank = assembly("blank", load=Inertia(inertia=1.0))
    tried = tuple(
        Tried(Hypothesis(blank, (Candidate(name, "load", blank, (), "", ""),)), share, ("too late",))
        for name, share in (("backlash", 0.0), ("self_heating", -0.2), ("drive_delay", 0.01))
    )
    assert _runners_up(Outcome(Hypothesis(blank), tried=tried), ()) == (
        ("drive_delay", 0.01, "too late", {}),
    )


def test_what_is_not_all_is_said() -> None:
    assert "That is not all" in verdict(complete=False).words()
    assert "That is not all" not in verdict().words()


def test_nothing_is_left_out_silently(tmp_path: Any) -> None:
    skipped = (Skipped("backlash", "motor", ("coulomb_friction",), "too expensive"),)
    full = verdict(remarks=("Rows 12 to 14 of 'slow' are masked.",), skipped=skipped)
    page = report.write_report(tmp_path / "r.html", *report.verdict_sections(full), title="t").read_text()
    for text in (str(full), page, json.dumps(full.to_dict())):
        assert "masked" in text
        assert "too expensive" in text
        assert "A finding." in text


def test_the_file_is_json_with_rule_run_and_numbers() -> None:
    run = DiagnosisRun("d.toml", "records", "2026-01-02T03:04", "nlsdesign diagnose", "1.0",
              (RecordOfRun("slow", "fit", "slow.csv", 100, 0.99, 101.0),))  # fmt: skip
    variable = Variable("motor.inertia", "kg*m^2", "inertia", start=1e-3, spread=0.2)
    declared = declared_parameter(variable)
    step = math.log1p(0.2)
    fit = Fit((declared,), {"motor.inertia": 1e-3 * 1.2}, np.array([[0.01**2]]), 0.0, {}, True)
    full = verdict(run=run, fits=(fit,), gaps=(*GAPS[:1], replace(GAPS[1], signal=math.nan)))
    written = json.loads(json.dumps(full.to_dict(), allow_nan=False))
    assert written["error"]["signal"]["rms"] is None
    assert written["criteria"]["rate"] == {"value": 0.01, "meaning": "False discovery rate at most."}
    assert written["run"]["records"][0] == {
        "name": "slow", "role": "fit", "source": "slow.csv", "samples": 100, "duration": 0.99, "rate": 101.0,
    }  # fmt: skip
    assert written["run"]["command"] == "nlsdesign diagnose"
    (number,) = written["numbers"]
    assert number["declared"] == 1e-3
    assert number["fitted"] == pytest.approx(1.2e-3)
    assert number["standard_error"] == pytest.approx(1.2e-5)
    assert number["spread"] == pytest.approx(math.expm1(step))
    assert number["strain"] == pytest.approx(1.0), "one declared spread"
    assert [r["record"] for r in written["records"]] == ["slow", "fast"]
    assert (written["effects"][0]["probability"], written["complete"]) == (0.97, True)
    assert written["effects"][0]["evidence"]["removal_cost"] == 310.0


def test_the_meaning_of_each_criterion_is_read_from_its_description() -> None:
    assert settings_of(None) == ()
    assert [(s.name, s.value, s.meaning) for s in settings_of(Rule(0.02))] == [
        ("rate", 0.02, "False discovery rate at most."),
        ("other", 3, "False discovery rate at most."),
    ]


def test_every_table_of_the_report_has_a_caption(tmp_path: Any) -> None:
    run = DiagnosisRun("d.toml", "records", "2026-01-02", "nlsdesign diagnose", "1.0",
              (RecordOfRun("slow", "fit", "slow.csv", 100, 0.99, 101.0),))  # fmt: skip
    made = report.verdict_sections(verdict(run=run))
    page = report.write_report(tmp_path / "r.html", *made, title="t").read_text()
    assert page.count("<table>") == page.count("<caption") >= 4
    tables = [p for p in made[1].parts if isinstance(p, report.TableSection)]  # type: ignore[attr-defined]
    assert all(table.caption for table in tables)


def test_a_reason_that_asks_ends_with_its_question_mark() -> None:
    assert as_sentence("is it in thousandths of the unit?") == "Is it in thousandths of the unit?"
    assert as_sentence("the sign is turned") == "The sign is turned."


def test_strained_numbers_are_called_by_their_names() -> None:
    before = Excess(DECLARED, "1", 1.0, 2.3, 2.3, 16.0, 3, 3.0, open=True)
    fit = SimpleNamespace(prior_z_scores=lambda: {"arm.mass": 3.46, "gear.loss": -2.1, "arm.inertia": 0.3})
    (said,) = _strained(before, before, cast(Hypothesis, SimpleNamespace(fits={"motor": fit})))
    assert said.endswith("away before, 2.3 after: arm.mass 3.5 above, gear.loss 2.1 below")


def test_a_motion_in_degrees_is_recognised_by_the_force_that_it_predicts() -> None:
    assert "in degrees" in _hint(0.0205)
    assert "another rig" in _hint(0.1)
