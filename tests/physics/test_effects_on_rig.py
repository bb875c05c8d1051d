"""Each effect of the catalogue leaves its signature on a record of the rig, and explains most of it there.

The rig's formulation of an effect is never the package's. Two records are enough to see it; what to name in
full sets is the matter of ``test_diagnosis_rig.py`` and of ``benchmarks/discrepancy_score.py``.
"""

from __future__ import annotations

from pathlib import Path

import pytest

from nlsdesign.bench.discrepancy.effects import ALL, backlash
from nlsdesign.bench.discrepancy.screening.scale_and_sign import typical_sizes
from nlsdesign.bench.discrepancy.selection.comparison import Comparison
from nlsdesign.bench.discrepancy.selection.criteria import Criteria
from nlsdesign.bench.discrepancy.selection.hypothesis import excesses
from nlsdesign.bench.discrepancy.selection.measures import total_excess
from nlsdesign.bench.discrepancy.tearing import blocks_of
from nlsdesign.bench.identification import load_records
from nlsdesign.bench.identification.equation_error.evidence import Bench
from nlsdesign.model import flatten
from tests.diagnosed import declared_rig, with_true_contact
from tests.rig import ACTUATORS, make_records, with_slack_cable, write_set

RULE = Criteria()

CASES = {
    "drive_delay": "arm",
    "torque_constant_saturation": "wrist",
    "cable_friction": "arm",
    "cam_profile_error": "wrist",
    "stress_softening": "arm",
    "self_heating": "arm",
    "permanent_set": "wrist",
    "strain_stiffening": "arm",
    "force_sensor_drift": "wrist",
    "angle_sensor_eccentricity": "arm",
}
RECORDS = ("sine_45deg_0.5Hz", "sine_25deg_2.0Hz", "sine_15deg_5.0Hz")


SLOW = {"drive_delay", "strain_stiffening", "permanent_set", "self_heating", "angle_sensor_eccentricity"}
"""One of each room stays in the quick run."""


@pytest.mark.long_cases(
    "force_sensor_drift",
    "torque_constant_saturation",
    "cam_profile_error",
    "stress_softening",
    "cable_friction",
)
@pytest.mark.parametrize(
    "effect",
    [pytest.param(effect, marks=pytest.mark.slow) if effect in SLOW else effect for effect in CASES],
)
def test_an_effect_is_seen_and_mostly_explained(tmp_path: Path, effect: str) -> None:
    actuator = with_slack_cable(ACTUATORS[CASES[effect]])
    write_set(tmp_path, actuator, make_records(actuator, {effect: 1.0}, 21, only=RECORDS))
    declared = with_true_contact(declared_rig(tmp_path / "rig.toml", tmp_path / "cam.csv"))
    records = load_records(tmp_path, flatten(declared))
    bench = Bench(records, blocks_of(flatten(declared), records.signals))
    comparison = Comparison(bench, typical_sizes(declared, records))
    base = comparison.coarsely(comparison.base(declared))
    before = excesses(base, bench, RULE)
    assert any(each.open for each in before.values()), "the refitted declared model lacks nothing"
    (tried,) = [e for e in ALL if e.__name__ == effect]
    with_it = [comparison.with_effect(base, candidate) for candidate in tried(declared)]
    left = min(total_excess(excesses(h, bench, RULE)) for h in with_it)
    assert left < 0.5 * total_excess(before)


@pytest.mark.slow
def test_a_deck_that_declares_backlash_is_looked_at_coarsely(tmp_path: Path) -> None:
    """As when a deck that a diagnosis has written is diagnosed again: a body coasts, and nothing is new."""
    actuator = ACTUATORS["wrist"]
    write_set(tmp_path, actuator, make_records(actuator, {"backlash": 1.0}, 21, only=RECORDS[1:]))
    plain = declared_rig(tmp_path / "rig.toml", tmp_path / "cam.csv")
    (candidate,) = backlash(plain)
    left = []
    for declared in (plain, candidate.assembly.with_values({"spring.gap": 0.05})):
        records = load_records(tmp_path, flatten(declared))
        bench = Bench(records, blocks_of(flatten(declared), records.signals))
        comparison = Comparison(bench, typical_sizes(declared, records))
        left.append(total_excess(excesses(comparison.coarsely(comparison.base(declared)), bench, RULE)))
    assert left[1] < 0.5 * left[0]
