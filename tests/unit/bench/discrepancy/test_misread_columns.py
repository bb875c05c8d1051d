"""A column that is not what is stated is said to be that, and a missing effect is never taken for one."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path

import numpy as np
import pytest

from nlsdesign.bench.discrepancy import Verdict, diagnose
from nlsdesign.bench.identification import load_records
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


def verdict_of(folder: Path, hidden: tuple[str, ...], change: Callable[[str], str], factor: float) -> Verdict:
    """Diagnose a geared joint with no effect in the catalogue, its mapping and its angle changed."""
    write_kind_case(folder, "geared_joint", hidden, 1.0, 1311, says_held=True)
    mapping = folder / "records.toml"
    mapping.write_text(change(mapping.read_text()))
    for file in folder.glob("*.csv"):
        if file.stem not in ONLY:
            file.unlink()
            continue
        head, rows = file.read_text().partition("\n")[0], np.loadtxt(file, delimiter=",", skiprows=1)
        rows[:, head.split(",").index("angle")] *= factor
        np.savetxt(file, rows, "%.9g", ",", header=head, comments="")
    rig = declare(load_deck(folder / "deck.toml"))
    return diagnose(rig, load_records(folder, flatten(rig)), catalogue=())


@pytest.mark.parametrize(
    ("change", "factor", "column", "words"),
    [
        (in_another_unit, 1.0, "angle", "read in rad"),
        (str, 80.0, "angle", "read as the motion before the ratio of motor"),
        (exchanged, 1.0, "current_A", "read exchanged with 'angle'"),
        (held_from_the_other_side, 1.0, "current_A", "read as the records show that it runs"),
    ],
    ids=["unit", "rotor", "exchanged", "held"],
)
def test_a_column_that_is_not_what_is_stated_is_suspect(
    change: Callable[[str], str], factor: float, column: str, words: str, tmp_path: Path
) -> None:
    verdict = verdict_of(tmp_path, (), change, factor)
    assert verdict.verdict == "data_suspect"
    assert any(f"column '{column}'" in each and words in each for each in verdict.where), verdict.where


def test_what_is_missing_in_the_machine_is_no_column(tmp_path: Path) -> None:
    verdict = verdict_of(tmp_path, ("coulomb_friction",), str, 1.0)
    assert verdict.verdict == "unknown"
    assert not any("not what is stated" in each for each in verdict.where)
