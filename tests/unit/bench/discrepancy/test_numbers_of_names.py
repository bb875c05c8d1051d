"""The numbers of a name are those of the fit that was judged, whatever table is added beside it."""

from __future__ import annotations

from pathlib import Path

import pytest

import nlsdesign as nls
from nlsdesign.bench.discrepancy import Verdict, diagnose
from tests.hand_machines import Machine, made

SLIDING = 0.12


@pytest.fixture(scope="module")
def found(tmp_path_factory: pytest.TempPathFactory) -> Verdict:
    """A motor whose friction is Coulomb's and grows with a weight; only Coulomb's is looked for."""
    machine = Machine(
        weight=3.0,
        middle=0.9,
        size=0.5,
        friction=lambda rate, angle, load: SLIDING + 0.02 * abs(load),
        extra=lambda rate, angle: 0.04 * max(angle - 0.8, 0.0),
    )
    folder: Path = tmp_path_factory.mktemp("one_sign")
    return diagnose(*made(machine, folder), catalogue=[nls.effects.coulomb_friction])


@pytest.mark.slow
def test_a_name_keeps_its_number_beside_a_table(found: Verdict) -> None:
    assert [each.name for each in found.effects] == ["coulomb_friction"]
    ((name, (level, _, error)),) = found.effects[0].parameters.items()
    assert SLIDING < level < SLIDING + 0.02 * 3.0
    assert error < 0.01
    assert found.actuator.quantities()[name].number == pytest.approx(level, rel=1e-3)
    evidence = found.effects[0].evidence
    assert evidence is not None
    assert evidence.distance > 4.0


@pytest.mark.slow
def test_no_table_is_offered_that_can_stand_for_the_name(found: Verdict) -> None:
    assert "unnamed_friction" not in dict(found.actuator.parts)


@pytest.mark.slow
def test_a_table_is_offered_for_what_the_name_cannot_do(found: Verdict) -> None:
    assert [each.name for each in found.unnamed] == ["unnamed"]
    assert "unnamed_spring" in dict(found.actuator.parts)
    assert not found.complete
