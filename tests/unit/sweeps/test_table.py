"""The table of a sweep: parts in any order give the same bytes; the deck behind a point comes back."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

from nlsdesign.components.assembly.deck_writer import deck_text, declare
from nlsdesign.foundation.deck import load_deck
from nlsdesign.foundation.errors import MeasurementError, UnknownNameError
from nlsdesign.sweeps.sweep_columns import STATE_COLUMNS, SweepColumn
from nlsdesign.sweeps.sweep_parts import Parts
from nlsdesign.sweeps.sweep_table import about_text, read_sweep

DECK = "austin2015_as_printed"
AREA, RUBBER = "spring.rubber.area", "spring.rubber"
COLUMNS = (
    STATE_COLUMNS[0],
    SweepColumn("motor.inertia", "kg*m^2", "of the rotor", "axis", "grid", 1e-6, 2e-6),
    SweepColumn(RUBBER, "", "material", "axis", "list"),
    SweepColumn("answer", "N*m", "some torque", "answer"),
    *STATE_COLUMNS[1:],
)


def row(point: int, *, status: str = "done", reason: str = "", place: str = "a") -> dict[str, object]:
    answer = float(point) ** 2 if status == "done" else float("nan")
    return {
        "point": point, "motor.inertia": 1e-6 * (1 + point / 10), RUBBER: "Dragon_Skin_30", "answer": answer,
        "status": status, "reason": reason, "(seconds)": 0.1 * point, "(worker)": place,
    }  # fmt: skip


def folder_with(path: Path, parts: list[list[dict[str, object]]]) -> Path:
    path.mkdir()
    assembly = declare(load_deck(DECK))
    (path / "sweep.json").write_text(about_text({"deck": DECK}, COLUMNS), encoding="utf-8")
    (path / "deck.toml").write_text(deck_text(assembly), encoding="utf-8")
    for rows in parts:
        Parts(path, COLUMNS).write(rows)
    return path


def test_the_table_does_not_depend_on_order_parts_and_workers(tmp_path: Path) -> None:
    rows = [row(k) for k in range(50)]
    one = folder_with(tmp_path / "one", [rows])
    shuffled = [row(int(k), place="b") for k in np.random.default_rng(1).permutation(50)]
    many = folder_with(tmp_path / "many", [shuffled[k : k + 1] for k in range(50)])  # merged on the way
    first, second = (Parts(path, COLUMNS).finish().read_bytes() for path in (one, many))
    assert first == second
    assert len(list((many / "parts").iterdir())) < 50
    table = read_sweep(many)
    assert table.values["point"].tolist() == list(range(50))
    assert table.values["answer"].tolist() == [float(k * k) for k in range(50)]


def test_a_table_that_is_not_finished_is_read_from_its_parts(tmp_path: Path) -> None:
    place = folder_with(tmp_path / "half", [[row(3)], [row(1, status="failed", reason="no rest")], [row(2)]])
    table = read_sweep(place)
    assert table.values["point"].tolist() == [1, 2, 3]
    assert table.done.tolist() == [False, True, True]
    assert table.values["reason"].tolist() == ["no rest", "", ""]
    assert [c.name for c in table.axes] == ["motor.inertia", RUBBER]
    assert [c.name for c in table.answers] == ["answer"]
    assert len(read_sweep(folder_with(tmp_path / "none", []))) == 0


def test_a_point_that_was_done_later_counts_and_never_twice(tmp_path: Path) -> None:
    place = folder_with(
        tmp_path / "again", [[row(0, status="failed", reason="x"), row(1)], [row(0)], [row(1)]]
    )
    table = read_sweep(place)
    assert table.values["point"].tolist() == [0, 1]
    assert table.done.all()


def test_a_damaged_part_is_set_aside_and_its_points_are_missing(tmp_path: Path) -> None:
    place = folder_with(tmp_path / "damaged", [[row(0)], [row(1)]])
    part = sorted((place / "parts").glob("*.parquet"))[0]
    part.write_bytes(part.read_bytes()[:-20])
    with pytest.raises(MeasurementError, match="computes what is missing"):
        read_sweep(place)
    parts = Parts(place, COLUMNS)
    assert parts.damaged == [part.name]
    assert parts.standing(3).tolist() == [False, True, False]


def test_the_deck_behind_a_point(tmp_path: Path) -> None:
    table = read_sweep(folder_with(tmp_path / "deck", [[row(4), row(9)]]))
    made = table.assembly_at(9)
    assert made.quantities()["motor.inertia"].value == pytest.approx(1.9e-6, rel=1e-12)
    assert "Dragon_Skin_30" in made.quantities()[f"{RUBBER}.stiff.modulus"].source
    with pytest.raises(UnknownNameError, match="4 to 9"):
        table.assembly_at(5)
    with pytest.raises(UnknownNameError, match="did you mean 'answer'"):
        table.column("answr")


def test_a_folder_without_a_sweep_is_refused(tmp_path: Path) -> None:
    with pytest.raises(MeasurementError, match="name the folder that 'nlsdesign sweep' wrote"):
        read_sweep(tmp_path)
    (tmp_path / "sweep.json").write_text('{"format": "another"}', encoding="utf-8")
    with pytest.raises(MeasurementError, match="is no 'nlsdesign sweep 1'"):
        read_sweep(tmp_path)
