"""A proposed record, run by the rig with the true effect, decides what the records before left open."""

from __future__ import annotations

import pytest

from benchmarks.next_record import DECIDED, PAIRS, case


@pytest.mark.parametrize(
    ("one", "other", "truth"),
    [
        ("current_sensor_bias", "coulomb_friction", "coulomb_friction"),
        pytest.param("coulomb_friction", "stribeck_friction", "stribeck_friction", marks=pytest.mark.slow),
        pytest.param("permanent_set", "cable_slack", "permanent_set", marks=pytest.mark.slow),
    ],
)
def test_the_proposed_record_decides(one: str, other: str, truth: str) -> None:
    (pair,) = [p for p in PAIRS if (p.one, p.other) == (one, other)]
    result = case(pair, truth, "arm", 1)
    assert result["open"]
    assert result["right"]
    assert result["after"] > 10.0 * DECIDED
