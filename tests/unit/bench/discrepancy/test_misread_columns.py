"""A column that is not what is stated is said to be that, and a missing effect is never taken for one."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from pathlib import Path
from typing import NamedTuple

import numpy as np
import pytest

from nlsdesign.bench.discrepancy import Verdict, diagnose
from nlsdesign.bench.discrepancy.effects import Candidate
from nlsdesign.bench.discrepancy.effects.effect import EffectFunction
from nlsdesign.bench.discrepancy.screening.scale_and_sign import error_share, refitted
from nlsdesign.bench.identification import load_records
from nlsdesign.components import Assembly
from nlsdesign.components.assembly.deck_writer import declare
from nlsdesign.foundation.deck import load_deck
from nlsdesign.model import flatten
from tests.rig.kind_cases import write_kind_case

ONLY = ("multisine_1", "sine_1.5Hz")


def in_another_unit(mapping: str) -> str:
    return mapping.replace('unit = "rad"', 'unit = "deg"')


def exchanged(mapping: str) -> str:
    heads = mapping.replace("[columns.angle]", "[columns.?]").replace(
        "[columns.current_A]", "[columns.angle]"
    )
    return heads.replace("[columns.?]", "[columns.current_A]")


def held_from_the_other_side(mapping: str) -> str:
    return mapping.replace('"held"', '"held_before"')


def none_is_asked_for(actuator: Assembly) -> list[Candidate]:
    """Stand for a catalogue where a column is asked about before any effect."""
    raise AssertionError(f"effects are looked for in {actuator.name}")


class Dress(NamedTuple):
    """A wrong way to write records of a machine."""

    kind: str = "geared_joint"
    mapping: Callable[[str], str] = str  # changes records.toml
    scaled: str = "angle"
    factor: float = 1.0  # of the column above


def verdict_of(
    folder: Path, hidden: tuple[str, ...], dress: Dress, catalogue: Sequence[EffectFunction] = ()
) -> Verdict:
    """Diagnose a machine whose records are written otherwise than is stated."""
    write_kind_case(folder, dress.kind, hidden, 1.0, 1311, says_held=True)
    mapping = folder / "records.toml"
    mapping.write_text(dress.mapping(mapping.read_text()))
    for file in folder.glob("*.csv"):
        if file.stem not in ONLY:
            file.unlink()
            continue
        head, rows = file.read_text().partition("\n")[0], np.loadtxt(file, delimiter=",", skiprows=1)
        rows[:, head.split(",").index(dress.scaled)] *= dress.factor
        np.savetxt(file, rows, "%.9g", ",", header=head, comments="")
    rig = declare(load_deck(folder / "deck.toml"))
    return diagnose(rig, load_records(folder, flatten(rig)), catalogue=catalogue)


@pytest.mark.parametrize(
    ("dress", "column", "words"),
    [
        (Dress(mapping=in_another_unit), "angle", "read in rad"),
        pytest.param(
            Dress(factor=80.0),
            "angle",
            "read as the motion before the ratio of motor",
            marks=pytest.mark.slow,
        ),
        pytest.param(
            Dress(mapping=exchanged), "current_A", "read exchanged with 'angle'", marks=pytest.mark.slow
        ),
        pytest.param(
            Dress("belt_axis", scaled="load_angle", factor=180.0 / np.pi),
            "load_angle",
            "read in deg",
            marks=pytest.mark.slow,
        ),
    ],
    ids=["unit", "rotor", "exchanged", "free load"],
)
def test_a_column_of_which_nearly_all_is_wrong_is_suspect_before_effects_are_looked_for(
    dress: Dress, column: str, words: str, tmp_path: Path
) -> None:
    suspected(verdict_of(tmp_path, (), dress, (none_is_asked_for,)), column, words)


def test_the_share_of_a_load_behind_a_belt_is_that_of_its_own_effort(tmp_path: Path) -> None:
    """The current of the motor acts on the motor alone: of the load it would be a share of nothing."""
    write_kind_case(tmp_path, "belt_axis", (), 1.0, 1311, says_held=True)
    for file in tmp_path.glob("*.csv"):
        if file.stem not in ONLY:
            file.unlink()
    rig = declare(load_deck(tmp_path / "deck.toml"))
    again = refitted(rig, load_records(tmp_path, flatten(rig)))
    assert again is not None
    assert 0.0 < error_share(*again, "load") < 0.1


def test_a_column_that_runs_otherwise_between_its_samples_is_suspect_where_no_effect_explains_it(
    tmp_path: Path,
) -> None:
    verdict = verdict_of(tmp_path, (), Dress(mapping=held_from_the_other_side))
    suspected(verdict, "current_A", "read as the records show that it runs")


def suspected(verdict: Verdict, column: str, words: str) -> None:
    assert verdict.verdict == "data_suspect"
    assert any(f"column '{column}'" in each and words in each for each in verdict.where), verdict.where


def test_what_is_missing_in_the_machine_is_no_column(tmp_path: Path) -> None:
    verdict = verdict_of(tmp_path, ("coulomb_friction",), Dress())
    assert verdict.verdict == "unknown"
    assert not any("not what is stated" in each for each in verdict.where)
