"""A proposed record, run by the rig with the true effect, decides what the records before left open."""

from __future__ import annotations

import pytest

from benchmarks.next_record import DECIDED, PAIRS, case


# By hand and in every run: test_next_experiment.py, the proposed record decides what the first could not.
@pytest.mark.slow
@pytest.mark.parametrize(
    ("one", "other", "truth"),
    [
        ("current_sensor_bias", "coulomb_friction", "coulomb_friction"),
        ("coulomb_friction", "stribeck_friction", "stribeck_friction"),
        ("permanent_set", "cable_slack", "permanent_set"),
    ],
)
def test_the_proposed_record_decides(one: str, other: str, truth: str) -> None:
    (pair,) = [p for p in PAIRS if (p.one, p.other) == (one, other)]
    result = case(pair, truth, "arm", 1)
    assert result["open"]
    assert result["right"]
    assert result["after"] > 10.0 * DECIDED
