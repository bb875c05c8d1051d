"""A sweep over sets of records: each verdict is that of the diagnosis, each failure has its reason."""

from __future__ import annotations

import math
from pathlib import Path

import numpy as np
import pytest

from models.test_rig import test_rig_deck as rig_deck
from nlsdesign.bench.discrepancy import Verdict, diagnose
from nlsdesign.bench.identification import load_records
from nlsdesign.components import Assembly
from nlsdesign.components.assembly.deck_writer import write_deck
from nlsdesign.foundation.errors import ExportError, MeasurementError, UnknownNameError
from nlsdesign.foundation.work_sharing import InThisProcess, Processes
from nlsdesign.model import flatten
from nlsdesign.sweeps import DiagnosisQuestion, Listed, SweepTable, sweep
from nlsdesign.sweeps.sweep_file import read_sweep_file
from tests.diagnosed import declared_rig
from tests.rig import ACTUATORS, make_records, write_declaration, write_records

SHORT, FORCE = "sine_15deg_5.0Hz", 3


@pytest.fixture
def sets(tmp_path: Path) -> tuple[Assembly, Path]:
    """A rig, and two folders beside its deck: a cell that ends too early, and one that shows nothing."""
    write_declaration(tmp_path, ACTUATORS["arm"])
    clean = make_records(ACTUATORS["arm"], {}, 11, only=(SHORT,))[SHORT]
    clipped, dead = clean.copy(), clean.copy()
    clipped[:, FORCE] = np.minimum(clipped[:, FORCE], 0.6 * clipped[:, FORCE].max())
    dead[:, FORCE] = 12.0
    for name, rows in (("clipped", clipped), ("dead", dead)):
        write_records(tmp_path / name, {"a": rows})
    rig = declared_rig(tmp_path / "rig.toml", tmp_path / "cam.csv")
    write_deck(rig, tmp_path / "deck.toml")
    return rig, tmp_path


def asked(rig: Assembly, folder: Path, *names: str, out: str = "out") -> SweepTable:
    listed = Listed({"ask.records": [str(folder / name) for name in names]})
    question = DiagnosisQuestion(str(folder / names[0]), effects=("coulomb_friction",))
    return sweep(rig, axes=[listed], ask=question, out=folder / out, executor=InThisProcess())


def agrees(table: SweepTable, row: int, found: Verdict) -> None:
    """The row says what the verdict of a direct call says, digit for digit."""
    answers = {column.name: float(table.values[column.name][row]) for column in table.answers}
    verdicts = {name: value for name, value in answers.items() if name.startswith("verdict.")}
    assert verdicts.pop(f"verdict.{found.verdict}") == 1.0
    assert set(verdicts.values()) == {0.0}
    assert answers["named"] == len(found.effects)
    if any(gap.role == "held_out" for gap in found.gaps):
        assert (answers["held_out_ratio"], answers["closed"]) == (found.held_out_ratio, found.closed)
    else:
        assert math.isnan(answers["held_out_ratio"])
    named = {each.name: each.probability for each in found.effects}
    for name in (n.removeprefix("named.") for n in answers if n.startswith("named.")):
        assert answers[f"named.{name}"] == (name in named)
        assert np.array_equal(answers[f"probability.{name}"], named.get(name, math.nan), equal_nan=True)


@pytest.mark.slow
def test_sets_of_records_are_points_and_a_set_that_cannot_be_judged_says_why(
    sets: tuple[Assembly, Path],
) -> None:
    rig, folder = sets
    table = asked(rig, folder, "clipped", "dead")
    assert table.done.tolist() == [True, False]
    assert table.values["verdict.data_suspect"][0] == 1.0
    assert table.values["held_out_ratio"][0] > 10.0
    with pytest.raises(MeasurementError) as error:
        diagnose(rig, load_records(folder / "dead", flatten(rig)))
    assert table.values["reason"][1] == " ".join(str(error.value).split())
    # Records that were changed since are another set, though their folder has the same name.
    write_records(
        folder / "dead", {"a": np.loadtxt(folder / "dead" / "a.csv", delimiter=",", skiprows=1)[:900]}
    )
    with pytest.raises(ExportError, match=r"the files of axis ask\.records in .*dead were others"):
        asked(rig, folder, "clipped", "dead")


def test_folders_of_records_stand_beside_the_sweep_file_and_are_looked_for_before_anything_runs(
    sets: tuple[Assembly, Path], monkeypatch: pytest.MonkeyPatch
) -> None:
    _, folder = sets
    monkeypatch.chdir("/")
    text = """
decks = "deck.toml"
[[axes]]
Listed = {values = {"ask.records" = ["clipped", "dead"]}}
[ask.DiagnosisQuestion]
records = "clipped"
effects = ["coulomb_friction"]
"""
    path = folder / "sweep.toml"
    path.write_text(text, encoding="utf-8")
    task = read_sweep_file(path)
    assert [task.plan.point(k) for k in range(2)] == [(str(folder / "clipped"),), (str(folder / "dead"),)]
    path.write_text(text.replace('"dead"]', '"deed"]'), encoding="utf-8")
    with pytest.raises(MeasurementError, match="deed: is no folder"):
        read_sweep_file(path)
    path.write_text(text.replace('["coulomb_friction"]', '["coulomb_frictoin"]'), encoding="utf-8")
    with pytest.raises(UnknownNameError, match="did you mean 'coulomb_friction'"):
        read_sweep_file(path)


# Two diagnoses with the whole catalogue, twice: three minutes.
@pytest.mark.slow
def test_practice_records_get_the_verdict_of_a_direct_call_whoever_computes_it(
    shared_folder: Path, tmp_path: Path
) -> None:
    practice = shared_folder / "practice"
    rig = rig_deck(practice / "rig.toml", practice / "cam.csv")
    names = ("p01", "p02")
    axes = [Listed({"ask.records": [str(practice / name) for name in names]})]
    ask = DiagnosisQuestion(str(practice / "p01"))
    table = sweep(rig, axes=axes, ask=ask, out=tmp_path / "two", executor=Processes(2))
    assert table.done.all()
    for row, name in enumerate(names):
        agrees(table, row, diagnose(rig, load_records(practice / name, flatten(rig))))
    assert table.values["named.coulomb_friction"].tolist() == [1.0, 0.0]
    assert table.values["named.backlash"].tolist() == [0.0, 1.0]


# A whole diagnosis of records that no code of the package has made.
@pytest.mark.slow
def test_an_effect_of_the_rig_is_named_and_a_machine_that_cannot_be_is_a_reason(tmp_path: Path) -> None:
    write_declaration(tmp_path, ACTUATORS["arm"])
    write_records(tmp_path / "records", make_records(ACTUATORS["arm"], {"coulomb_friction": 1.0}, seed=3))
    rig = declared_rig(tmp_path / "rig.toml", tmp_path / "cam.csv")
    inertia = rig.quantities()["motor.inertia"].number
    axes = [Listed({"motor.inertia": [inertia, -inertia]})]
    ask = DiagnosisQuestion(str(tmp_path / "records"))
    table = sweep(rig, axes=axes, ask=ask, out=tmp_path / "out", executor=Processes(2))
    assert table.done.tolist() == [True, False]
    agrees(table, 0, diagnose(rig, load_records(tmp_path / "records", flatten(rig))))
    assert table.values["named.coulomb_friction"][0] == 1.0
    assert "inertia = -" in table.values["reason"][1]
