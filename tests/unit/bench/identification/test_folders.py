"""Folders as benches leave them: what is read beside the records, what is passed over, what is said."""

from __future__ import annotations

import math
from pathlib import Path

import numpy as np
import pytest

from nlsdesign.bench.identification import load_records
from nlsdesign.foundation.errors import MeasurementError
from nlsdesign.model import FlatModel
from tests.unit.bench.identification.test_measurement import model, table, write

__all__ = ["model"]
HEADS = ("t_s", "theta_deg", "torque_N*m")


@pytest.fixture
def folder(tmp_path: Path) -> Path:
    for name in "abc":
        write(tmp_path, name, table(), HEADS)
    return tmp_path


def roles(folder: Path, model: FlatModel) -> dict[str, str]:
    return {record.name: record.role for record in load_records(folder, model).records}


def test_held_out_may_be_chosen_without_a_mapping_of_the_columns(folder: Path, model: FlatModel) -> None:
    """The remark on records that are held out by default says: to choose, write held_out in records.toml."""
    assert any("write held_out in records.toml" in str(r) for r in load_records(folder, model).remarks)
    (folder / "records.toml").write_text('held_out = ["b"]\n', encoding="utf8")
    assert roles(folder, model) == {"a": "fit", "b": "held_out", "c": "fit"}


def test_a_rate_and_a_clock_need_no_mapping_of_the_columns(folder: Path, model: FlatModel) -> None:
    rows = table()
    rows[:, 0] *= 1e3
    for name in "abc":
        write(folder, name, rows, ("clock", *HEADS[1:]))
    text = 'resample_Hz = 250\n[time]\ncolumn = "clock"\nunit = "ms"\n'
    (folder / "records.toml").write_text(text, encoding="utf8")
    found = load_records(folder, model)
    assert set(found.signals) == {"encoder.reading", "cell.reading"}
    assert found.records[0].step == pytest.approx(0.004)


@pytest.mark.parametrize("file", ["a", "b", "c"])
def test_a_column_that_one_file_lacks_is_not_dropped_from_all(
    file: str, folder: Path, model: FlatModel
) -> None:
    write(folder, file, table()[:, :2], HEADS[:2])
    words = rf"{file}\.csv: column 'torque_N\*m': is missing -> record it in every file"
    with pytest.raises(MeasurementError, match=words):
        load_records(folder, model)


def test_hidden_files_are_none_of_the_bench(folder: Path, model: FlatModel) -> None:
    (folder / "._a.csv").write_bytes(bytes(range(256)))
    assert set(roles(folder, model)) == set("abc")


def test_a_table_that_is_not_read_is_told(folder: Path, model: FlatModel) -> None:
    (folder / "d.xlsx").write_bytes(b"PK")
    assert any("d.xlsx: is not read" in str(r) for r in load_records(folder, model).remarks)


def test_a_folder_that_does_not_exist_is_said_so(folder: Path, model: FlatModel) -> None:
    (folder / "bench").mkdir()
    (folder / "bench" / "one.csv").write_text("t_s\n0\n", encoding="utf8")
    with pytest.raises(MeasurementError, match=r"there is no such folder; did you mean 'bench'"):
        load_records(folder / "bnch", model)


def test_a_folder_in_place_of_a_file_is_one_message(folder: Path, model: FlatModel) -> None:
    (folder / "d.csv").mkdir()
    with pytest.raises(MeasurementError, match=r"d\.csv: cannot be read: Is a directory -> "):
        load_records(folder, model)


def test_rows_are_the_same_with_and_without_a_clock_of_the_mapping(folder: Path, model: FlatModel) -> None:
    plain = load_records(folder, model).records[0].trace["cell.reading"]
    (folder / "records.toml").write_text('[time]\ncolumn = "t_s"\n', encoding="utf8")
    np.testing.assert_array_equal(load_records(folder, model).records[0].trace["cell.reading"], plain)


def test_counts_coarser_than_declared_are_used_and_told(folder: Path, model: FlatModel) -> None:
    """The noise floor rests on the declared count; with a finer one, clean records look as if they lacked."""
    assert not any("counts" in str(r) for r in load_records(folder, model).remarks)
    for name in "abc":
        rows = table()
        rows[:, 1] = np.round(rows[:, 1])
        write(folder, name, rows, HEADS)
    loaded = load_records(folder, model)
    told = [str(r) for r in loaded.remarks if "counts" in str(r)]
    (quantum,) = [c.quantum for c in loaded.columns if c.name == "theta_deg"]
    assert quantum == pytest.approx(math.radians(1.0))
    words = "moves in counts of 1 deg, 0.0573 deg are declared: the former are used"
    assert told == [f"column 'theta_deg': {words}"]
