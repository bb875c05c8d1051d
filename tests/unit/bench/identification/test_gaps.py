"""Records with gaps in their time: split, filled in, and told; what is left out is said."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

from nlsdesign.bench.identification import load_record, load_records
from nlsdesign.foundation.errors import MeasurementError
from nlsdesign.model import FlatModel
from tests.unit.bench.identification.test_measurement import MAPPING, model, table, write

__all__ = ["model"]
STEP = 0.002


def folder_with(tmp_path: Path, rows: np.ndarray) -> Path:
    write(tmp_path, "a", table())
    write(tmp_path, "b", rows)
    (tmp_path / "records.toml").write_text(MAPPING.replace('["c*"]', '["b"]'), encoding="utf8")
    return tmp_path


def test_a_record_with_a_gap_is_split_there(tmp_path: Path, model: FlatModel) -> None:
    rows = np.delete(table(), slice(200, 230), axis=0)
    records = load_records(folder_with(tmp_path, rows), model)
    parts = [r for r in records.records if r.name.startswith("b")]
    assert [(r.name, len(r.trace)) for r in parts] == [("b part 1", 200), ("b part 2", len(rows) - 200)]
    assert parts[1].trace.time[0] == pytest.approx(230 * STEP)
    np.testing.assert_allclose(parts[1].trace["cell.reading"], rows[200:, 2], atol=1e-5)
    assert {r.role for r in parts} == {"held_out"}, "the name of the file stands for its parts"
    (remark,) = (r for r in records.remarks if "gap" in r.text)
    assert remark.place == "b.csv: column 't_s', row 202"
    assert "a gap of 0.062 s: split into 2 records" in remark.text


def test_a_part_that_is_too_short_is_left_out_and_this_is_said(tmp_path: Path, model: FlatModel) -> None:
    rows = np.delete(table(), slice(20, 60), axis=0)
    records = load_records(folder_with(tmp_path, rows), model)
    (part,) = (r for r in records.records if r.name.startswith("b"))
    assert (part.name, len(part.trace)) == ("b", len(rows) - 20)
    (remark,) = (r for r in records.remarks if "gap" in r.text)
    assert "one record is left; 20 rows in parts shorter than 50 are left out" in remark.text


def test_a_late_sample_in_a_thousand_is_bridged_and_this_is_said(tmp_path: Path, model: FlatModel) -> None:
    long = np.column_stack([STEP * np.arange(2000), *(np.tile(c, 10)[:2000] for c in table().T[1:])])
    records = load_records(folder_with(tmp_path, np.delete(long, [800, 801], axis=0)), model)
    (record,) = (r for r in records.records if r.name.startswith("b"))
    assert len(record.trace) == 2000
    between = np.interp([800, 801], [799, 802], long[[799, 802], 2])
    np.testing.assert_allclose(record.trace["cell.reading"][800:802], between, atol=1e-5)
    (remark,) = (r for r in records.remarks if "late" in r.text)
    assert "2 missing samples were filled in by straight lines, where 1 came late" in remark.text


def test_a_record_that_is_asked_for_alone_is_not_split(tmp_path: Path, model: FlatModel) -> None:
    folder = folder_with(tmp_path, np.delete(table(), slice(200, 230), axis=0))
    with pytest.raises(MeasurementError, match=r"gap of 0\.062 s.*split the record"):
        load_record(folder / "b.csv", model)


def test_a_clock_that_is_late_throughout_is_refused_and_not_cut_to_pieces(
    tmp_path: Path, model: FlatModel
) -> None:
    rows = np.concatenate([table()[:60], table()[60:][np.arange(len(table()) - 60) % 40 < 30]])
    with pytest.raises(MeasurementError, match=r"b\.csv: column 't_s'.*there is a gap of 0\.022 s"):
        load_records(folder_with(tmp_path, rows), model)
