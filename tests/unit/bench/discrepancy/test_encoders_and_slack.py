"""Machines of the rig with a fault of an encoder, a resonance, a slack strip: the right name and place."""

from __future__ import annotations

from pathlib import Path
from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest

from benchmarks._score_run import opened
from nlsdesign.bench.discrepancy import Verdict, diagnose, effects
from nlsdesign.bench.discrepancy import case as reading
from nlsdesign.bench.discrepancy.case import Case
from nlsdesign.bench.discrepancy.effects.effect import EffectFunction
from nlsdesign.bench.discrepancy.selection.search import Outcome
from nlsdesign.bench.identification.equation_error.inferred_sampling import no_terms, plain_terms
from tests.rig.kind_cases import names_of, write_kind_case

NO: Any = None


def diagnosed(
    folder: Path, kind: str, effect: str, seed: int, condition: str, *rivals: EffectFunction
) -> Verdict:
    write_kind_case(folder, kind, (effect,), 1.0, seed, condition=condition)
    return diagnose(*opened(folder), catalogue=rivals)


@pytest.mark.long_cases("1171-coarse", "1196-plain")
@pytest.mark.parametrize(("seed", "condition"), [(1171, "coarse"), (1196, "plain")])
def test_an_eccentric_disc_is_told_at_its_own_encoder(seed: int, condition: str, tmp_path: Path) -> None:
    """What the disc does to an acceleration was left out; the motor's encoder then left as little."""
    rivals = effects.angle_sensor_eccentricity, effects.angle_sensor_bias
    verdict = diagnosed(tmp_path, "elastic_joint", "joint_eccentricity", seed, condition, *rivals)
    (disc,) = verdict.effects
    assert (disc.name, disc.location) == (
        "angle_sensor_eccentricity",
        names_of("elastic_joint", seed)["load_encoder"],
    )
    assert verdict.complete
    assert condition == "coarse" or disc.aliases == ()


@pytest.mark.slow
def test_an_eccentric_disc_that_was_set_to_zero_elsewhere_has_a_zero_of_its_own(tmp_path: Path) -> None:
    """Its error vanishes where the encoder was set to zero, not where the machine is at zero."""
    write_kind_case(tmp_path, "elastic_joint", ("joint_eccentricity",), 1.0, 1196, condition="plain")
    names = names_of("elastic_joint", 1196)
    for file in tmp_path.glob("*.csv"):
        head, rows = file.read_text().partition("\n")[0], np.loadtxt(file, delimiter=",", skiprows=1)
        rows[:, head.split(",").index(names["load_place"])] += 0.01
        np.savetxt(file, rows, "%.9g", ",", header=head, comments="")
    rivals = effects.angle_sensor_eccentricity, effects.gravity_load
    (disc,) = diagnose(*opened(tmp_path), catalogue=rivals).effects
    assert (disc.name, disc.location) == ("angle_sensor_eccentricity", names["load_encoder"])
    (offset,) = [each for name, each in disc.parameters.items() if name.endswith(".offset")]
    assert offset[0] == pytest.approx(0.01, abs=3.0 * offset[2])


@pytest.mark.slow
def test_an_eccentric_disc_shows_in_the_balance_of_a_direct_drive(tmp_path: Path) -> None:
    rivals = effects.angle_sensor_eccentricity, effects.torque_ripple
    verdict = diagnosed(tmp_path, "direct_drive", "angle_sensor_eccentricity", 1195, "coarse", *rivals)
    assert [effect.name for effect in verdict.effects] == ["angle_sensor_eccentricity"]
    assert verdict.complete


@pytest.mark.slow
def test_a_resonance_is_told_although_one_record_rings_out_of_step(tmp_path: Path) -> None:
    """The numbers of the other records, right within 5 %, predict the record of steps worse than none."""
    rivals = effects.drivetrain_resonance, effects.torque_ripple
    verdict = diagnosed(tmp_path, "direct_drive", "drivetrain_resonance", 1311, "plain", *rivals)
    assert [effect.name for effect in verdict.effects] == ["drivetrain_resonance"]
    assert verdict.complete


@pytest.mark.slow
def test_the_zero_of_either_of_two_encoders_is_one_class(tmp_path: Path) -> None:
    rivals = (effects.angle_sensor_bias,)
    verdict = diagnosed(tmp_path, "belt_axis", "angle_sensor_bias", 1196, "plain", *rivals)
    (zero,) = verdict.effects
    places = {zero.location, *(alias.rpartition(" at ")[2] for alias in zero.aliases)}
    assert len(places) == 2
    assert all(alias.startswith("angle_sensor_bias at ") for alias in zero.aliases)


@pytest.mark.slow
def test_a_strip_that_hangs_slack_in_its_grips_is_no_permanent_set(tmp_path: Path) -> None:
    rivals = effects.cable_slack, effects.permanent_set, effects.force_sensor_bias
    verdict = diagnosed(tmp_path, "specimen", "cable_slack", 1171, "coloured", *rivals)
    (slack,) = verdict.effects
    assert slack.name == "cable_slack"
    ((length, _, error),) = slack.parameters.values()
    assert abs(length - 1.5e-3) < 3.0 * error < 0.5e-3


@pytest.mark.parametrize(("complete", "lacks"), [(True, no_terms), (False, plain_terms)])
def test_inputs_are_asked_as_if_nothing_were_missing_where_nothing_is(
    complete: bool, lacks: object, monkeypatch: pytest.MonkeyPatch
) -> None:
    """Plain terms hide a shift of a current: it stayed read as sampled beside a name that explained all."""
    asked = list[object]()
    bench: Any = SimpleNamespace(inferred=lambda _, missing=plain_terms: asked.append(missing))
    monkeypatch.setattr(reading, "_blocks", lambda *_: [])
    monkeypatch.setattr(Case, "_read_as", lambda *_: None)
    step: Any = SimpleNamespace()
    last: Any = SimpleNamespace(fitted=None)
    outcome = Outcome(last, (step,), complete=complete)
    assert Case(NO, bench, NO, NO).read_as_inferred_beside(outcome, "named") is None
    assert asked == [lacks]
